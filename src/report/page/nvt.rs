//! NVT runs: contact probability of the surface atoms.

use super::loads::PANEL_SIDE;
use super::prelude::*;
use asperity_grid::units::ANGSTROM_M;

pub(super) fn section(writer: &FigureWriter, atoms: &AtomsResults, nvt: &NvtResults) -> Result<Markup> {
    let length_m = atoms.cells as f64 * nvt.lattice_constant_angstrom * ANGSTROM_M;
    let contact = |s: &NvtState| format!("{} ± {}", percent(s.contact_area.value), percent(s.contact_area.error));
    let mut figures = Vec::new();
    for (i, state) in nvt.states.iter().enumerate() {
        let small = &writer.load(&state.probability_map, PANEL_SIDE, |v| v)?;
        let range = ColourRange { low: 0.0, high: 1.0 };
        let values = Values { quantity: "contact probability", unit: "", small, range, contact: None };
        let title = writer.loads.label(state.p_star);
        let alt = format!("contact probability of the surface atoms at {title}");
        let image = writer.values((&format!("probability-{}", i + 1), &alt), &values, length_m)?;
        figures.push(panel(&title, image, contact(state) + " in contact"));
    }
    let still = |s: &NvtState| atoms.states.iter().find(|a| (a.p_star / s.p_star - 1.0).abs() < 1e-6);
    let mean = |v: ValueWithError, unit: &str| format!("{} ± {}", significant(v.value, 4), with_unit(v.error, 1, unit));
    Ok(html! {
        h3 { "At " (trimmed(nvt.temperature_k, 4)) " K" }
        (figure(
            panels(figures.len().min(3), &figures),
            html! { "Contact probability of each surface atom: fraction of the time in contact, over " (significant(nvt.averaging_ps, 3)) " ps after "
                (significant(nvt.equilibration_ps, 3)) " ps of equilibration, in a cell expanded to the lattice constant of "
                (significant(nvt.lattice_constant_angstrom, 5)) " Å. Contact: mean probability; majority contact: fraction of the surface atoms with a probability above one half; any contact: above zero. "
                "Errors are standard errors from " (nvt.blocks) " blocks of time." },
        ))
        (columns!("numbers", nvt.states.iter().map(|s| (s, still(s))), |(s, still)| {
            writer.loads.head() => writer.loads.value(s.p_star),
            "contact" => contact(s),
            "at 0 K" => or_dash(still.map(|a| percent(a.contact_area))),
            "majority contact" => percent(s.majority_contact),
            "any contact" => percent(s.any_contact),
            "mean gap" => mean(s.mean_gap_angstrom, "Å"),
            "at 0 K" => or_dash(still.map(|a| with_unit(a.mean_gap_angstrom, 4, "Å"))),
            "temperature" => mean(s.temperature_k, "K"),
        }))
    })
}

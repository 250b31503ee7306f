//! NVT runs: contact probability of the surface atoms.

use maud::{Markup, html};

use super::figures::{FigureWriter, figure, numbers, panel, panels, text};
use super::loads::PANEL_SIDE;
use crate::error::Result;
use crate::record::results::{AtomsResults, NvtResults, ValueWithError};
use crate::report::map::{Bar, Legend};
use crate::report::number::{percent, significant, trimmed};
use crate::report::picture::{self, Range};
use crate::units::ANGSTROM_M;

pub(super) fn section(writer: &FigureWriter, atoms: &AtomsResults, nvt: &NvtResults) -> Result<Markup> {
    let (mut drawn, mut rows) = (Vec::new(), Vec::new());
    for (i, state) in nvt.states.iter().enumerate() {
        let small = picture::load(&writer.field(&state.probability_map)?, PANEL_SIDE, |v| v)?;
        let range = Range { low: 0.0, high: 1.0 };
        let legend = Legend::Ramp(Bar::plain("contact probability", range, "", false));
        let title = format!("p* = {}", trimmed(state.p_star, 4));
        let names = (format!("probability-{}", i + 1), format!("contact probability of the surface atoms at {title}"));
        let length = atoms.cells as f64 * nvt.lattice_constant_angstrom * ANGSTROM_M;
        let image = writer.map((&names.0, &names.1), &picture::map(&small, range), length, legend)?;
        let contact = state.contact_area;
        let words = format!("{} ± {}", percent(contact.value), percent(contact.error));
        drawn.push(panel(&title, image, html! { (words) " in contact" }));
        let still = atoms.states.iter().find(|s| (s.p_star / state.p_star - 1.0).abs() < 1e-6);
        let at_rest = |of: Option<String>| text(of.unwrap_or("–".into()));
        rows.push(vec![
            text(trimmed(state.p_star, 4)),
            text(words),
            at_rest(still.map(|s| percent(s.contact_area))),
            text(percent(state.majority_contact)),
            text(percent(state.any_contact)),
            text(with_error(state.mean_gap_angstrom, "Å")),
            at_rest(still.map(|s| format!("{}\u{a0}Å", significant(s.mean_gap_angstrom, 4)))),
            text(with_error(state.temperature_k, "K")),
        ]);
    }
    let head = ["p*", "contact", "at 0 K", "majority contact", "any contact", "mean gap", "at 0 K", "temperature"];
    Ok(html! {
        h3 { "At " (trimmed(nvt.temperature_k, 4)) " K" }
        (figure(
            panels(drawn.len().min(3), &drawn),
            html! { "Contact probability of each surface atom: fraction of the time in contact, over " (significant(nvt.averaging_ps, 3)) " ps after "
                (significant(nvt.equilibration_ps, 3)) " ps of equilibration, in a cell expanded to the lattice constant of "
                (significant(nvt.lattice_constant_angstrom, 5)) " Å. Contact: mean probability; majority contact: fraction of the surface atoms with a probability above one half; any contact: above zero. "
                "Errors are standard errors from " (nvt.blocks) " blocks of time." },
        ))
        (numbers(&head, rows))
    })
}

fn with_error(mean: ValueWithError, unit: &str) -> String {
    format!("{} ± {}\u{a0}{unit}", significant(mean.value, 4), significant(mean.error, 1))
}

//! Contact of the atoms under several criteria, sensitivity to the contact distance, and stress maps.

use super::loads::PANEL_SIDE;
use super::prelude::*;
use asperity_grid::units::ANGSTROM_M;

/// Contact under each criterion and the stress maps; empty if the scene does not request distributions.
pub(super) fn section(writer: &FigureWriter, atoms: &AtomsResults) -> Result<Markup> {
    let available: Vec<_> = atoms.states.iter().filter(|s| !s.criteria.is_empty()).collect();
    let Some(first) = available.first() else { return Ok(html! {}) };
    let head: Vec<&str> =
        std::iter::once(writer.loads.head()).chain(first.criteria.iter().map(|w| name(&w.id))).collect();
    let rows = available.iter().map(|s| {
        let shares =
            s.criteria.iter().map(|w| html! { (percent(w.contact_area)) " " (quiet(format!("({})", count(w.atoms)))) });
        std::iter::once(writer.loads.value(s.p_star).render()).chain(shares).collect()
    });
    Ok(html! {
        h3 { "Contact by criterion" }
        (table("numbers", &head, rows))
        p.quiet {
            @for (i, w) in first.criteria.iter().enumerate() {
                @if i > 0 { " " } em { (capitalised(name(&w.id))) } ": " (w.criterion) "."
            }
            " In brackets: number of contact atoms, including those from below the surface layer."
        }
        (stresses(writer, atoms)?)
    })
}

fn name(id: &str) -> &str {
    match id {
        "force_threshold" => "force threshold",
        "voronoi_area" => "Voronoi area",
        other => other,
    }
}

/// Onset of plasticity; empty if not requested.
pub(super) fn plasticity(writer: &FigureWriter, atoms: &AtomsResults) -> Result<Markup> {
    let Some(p) = &atoms.plasticity else { return Ok(html! {}) };
    let curve = Curve::new("", ATOMS, p.steps.iter().map(|s| (s[0], s[1])));
    let plot =
        Plot { proportion: 0.36, ..Plot::new(linear(""), linear("defect atoms"), vec![curve]).against(writer.loads) };
    let caption = html! { "Defect atoms: centro-symmetry parameter above "
    (p.threshold) " a0², of the " (count(p.atoms)) " between the uppermost " (p.masked_layers) " layers and the lowest, at every load step." };
    Ok(html! {
        h3 { "Onset of plasticity" }
        p {
            @match p.first_yield {
                Some(load) => {
                    "The crystal first yields at " (writer.loads.quantity.symbol()) strong { (writer.loads.value(load)) } ": more than " (p.noise_atoms)
                    " defect atoms"
                    @if let Some(previous) = p.last_elastic { "; at the previous step, " (writer.loads.label(previous)) ", fewer" } "."
                    @if let Some(h) = p.hardness_gpa { " Beyond it the mean contact stress is " (significant(h, 3))
                        " GPa, an estimate of the hardness." }
                },
                None => { "At no step are there more than " (p.noise_atoms) " defect atoms: the block remains elastic." },
            }
        }
        (writer.figures([Figure::new("plasticity", caption, plot)])?)
        (columns!("numbers", atoms.states.iter().filter_map(|s| Some((s, s.defects?))), |(s, plastic)| {
            writer.loads.head() => writer.loads.value(s.p_star),
            "defect atoms (centro-symmetry)" => count(plastic.atoms),
            "their volume" => with_unit(plastic.volume_nm3, 3, "nm³"),
            "contact stress" => with_unit(s.contact_stress_gpa, 3, "GPa"),
        }))
    })
}

/// The smoothed normal stress of every load.
fn stresses(writer: &FigureWriter, atoms: &AtomsResults) -> Result<Markup> {
    let mut figures = Vec::new();
    let (mut width, mut worst) = (0.0, 0.0_f64);
    let highest = atoms.states.iter().filter_map(|s| s.stress.as_ref()).map(|s| s.highest_gpa).fold(0.0, f64::max);
    for (i, state) in atoms.states.iter().enumerate() {
        let Some(stress) = &state.stress else { continue };
        (width, worst) = (stress.width_angstrom, worst.max(stress.load_error.abs()));
        let small = &writer.load(&stress.map, PANEL_SIDE, |v| v)?;
        let own = writer.own_ranges() || highest <= 0.0;
        let range =
            ColourRange { low: 0.0, high: if own { ColourRange::of(&small.values, 0.0).high } else { highest } };
        let values = Values { quantity: "normal stress", unit: "GPa", small, range, contact: None };
        let title = writer.loads.label(state.p_star);
        let names = (format!("stress-atoms-{}", i + 1), format!("normal stress of the atoms at {title}"));
        let image = writer.values((&names.0, &names.1), &values, atoms.length_angstrom * ANGSTROM_M)?;
        figures.push(panel(&title, image, html! { "at most " (significant(stress.highest_gpa, 3)) " GPa" }));
    }
    if figures.is_empty() {
        return Ok(html! {});
    }
    Ok(figure(
        panels(figures.len().min(3), &figures),
        html! { "Normal stress: the indenter’s force on each atom, spread by a Gaussian with a standard deviation of "
        (trimmed(width, 4)) " Å. The integral of the field is the load to " (significant(worst, 1)) " (relative). " (writer.range_note()) },
    ))
}

/// Contact fraction of the atoms against the contact distance, and of the continuum against the gap threshold.
pub(super) fn sensitivity(writer: &FigureWriter, c: &ComparisonResults) -> Result<Markup> {
    let mut figures = Vec::new();
    for (i, load) in c.loads.iter().enumerate().filter(|(_, l)| !l.area_vs_distance.is_empty()) {
        // Both panels have a common upper end of their vertical axes.
        let top = top(load);
        let plot = |label: &str, curves: Vec<Curve>| {
            let first = curves[0].points[0].0;
            Plot {
                include: vec![(first, 0.0), (first, top)],
                ..Plot::new(linear(label), linear("contact (%)"), curves)
            }
        };
        let distance = |label: &str, style: Style, k: usize| {
            Curve::line(label, style, load.area_vs_distance.iter().map(|row| (row[0], 100.0 * row[k])))
        };
        let gap = |label: &str, style: Style, k: usize| {
            Curve::line(label, style, load.area_vs_gap.iter().map(|row| (row[0], 100.0 * row[k])))
        };
        let by_distance = vec![
            distance("atoms", ATOMS, 1),
            distance("offset wall", THRESHOLD, 2),
            distance("compliant wall", SOFT, 3),
        ];
        let by_gap = vec![gap("hard wall", HARD, 1), gap("compliant wall", SOFT, 2)];
        let name = |start: &str| format!("{start}-{}", i + 1);
        let drawn = writer.small([
            ("Contact distance", name("area-vs-distance"), plot("contact distance (Å)", by_distance)),
            ("Gap threshold", name("area-vs-gap"), plot("gap threshold (Å)", by_gap)),
        ])?;
        let caption = html! { "Contact at " (writer.loads.label(load.p_star)) @if i == 0 { ". Left: against the contact distance d_c, from 0.95 to 1.1 of "
        "the distance at which the repulsion begins, with the same criterion for the continuum’s surface atoms. Right: continuum, against the "
        "gap threshold, over the same lengths. Where the left curves are steep, the criterion determines the area." } @else { "." } };
        figures.push(figure(panels(2, &drawn), caption));
    }
    Ok(html! { @if !figures.is_empty() { h3 { "Sensitivity to the contact criterion" } (each(&figures)) } })
}

fn top(load: &LoadComparison) -> f64 {
    let rows = load.area_vs_distance.iter().flat_map(|r| &r[1..]).chain(load.area_vs_gap.iter().flat_map(|r| &r[1..]));
    100.0 * rows.copied().fold(0.0, f64::max)
}

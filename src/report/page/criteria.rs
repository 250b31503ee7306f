//! Contact of the atoms under several criteria, sensitivity to the contact distance, and stress maps.

use maud::{Markup, html};

use super::figures::{FigureWriter, capitalised, figure, numbers, panel, panels, text};
use super::loads::PANEL_SIDE;
use crate::error::Result;
use crate::record::results::{AtomsResults, ComparisonResults, LoadComparison};
use crate::report::map::{Bar, Legend};
use crate::report::number::{count, percent, significant, trimmed};
use crate::report::picture::{self, Range};
use crate::report::plot::{ATOMS, Axis, Curve, HARD, PANEL, Plot, SOFT, Style, THRESHOLD};
use crate::units::ANGSTROM_M;

/// Contact under each criterion and the stress maps; empty if the scene does not request distributions.
pub(super) fn section(writer: &FigureWriter, atoms: &AtomsResults) -> Result<Markup> {
    let known: Vec<_> = atoms.states.iter().filter(|s| !s.criteria.is_empty()).collect();
    let Some(first) = known.first() else { return Ok(html! {}) };
    let mut head = vec!["p*"];
    head.extend(first.criteria.iter().map(|w| name(&w.id)));
    let rows = known
        .iter()
        .map(|s| {
            let shares = s.criteria.iter().map(|w| {
                html! { (percent(w.contact_area)) " " span.quiet { "(" (count(w.atoms)) ")" } }
            });
            [text(trimmed(s.p_star, 4))].into_iter().chain(shares).collect()
        })
        .collect();
    Ok(html! {
        h3 { "Contact by criterion" }
        (numbers(&head, rows))
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
    let points = p.steps.iter().map(|s| (s[0], s[1])).collect();
    let curves = vec![Curve { label: String::new(), style: ATOMS, points }];
    let plot = Plot { proportion: 0.36, ..Plot::new((Axis::Linear, Axis::Linear), ("p*", "defect atoms"), curves) };
    let rows = atoms
        .states
        .iter()
        .filter_map(|s| {
            let plastic = s.defects?;
            Some(vec![
                text(trimmed(s.p_star, 4)),
                text(count(plastic.atoms)),
                text(format!("{}\u{a0}nm³", significant(plastic.volume_nm3, 3))),
                text(format!("{}\u{a0}GPa", significant(s.contact_stress_gpa, 3))),
            ])
        })
        .collect();
    let words = html! { "Defect atoms: centro-symmetry parameter above "
    (p.threshold) " a0², of the " (count(p.atoms)) " below the uppermost " (p.masked_layers) " layers, at every load step." };
    Ok(html! {
        h3 { "Onset of plasticity" }
        p {
            @match p.first_yield {
                Some(load) => {
                    "The crystal first yields at p* = " strong { (significant(load, 3)) } ": more than " (p.noise_atoms)
                    " defect atoms"
                    @if let Some(before) = p.last_elastic { "; at the previous step, p* = " (significant(before, 3)) ", fewer" } "."
                    @if let Some(h) = p.hardness_gpa { " Beyond it the mean contact stress is " (significant(h, 3))
                        " GPa, an estimate of the hardness." }
                },
                None => { "At no step are there more than " (p.noise_atoms) " defect atoms: the block remains elastic." },
            }
        }
        @if let Some(svg) = writer.curves("plasticity", &plot)? { (figure(svg, words)) }
        (numbers(&["p*", "defect atoms (centro-symmetry)", "their volume", "contact stress"], rows))
    })
}

/// The smoothed normal stress of every load.
fn stresses(writer: &FigureWriter, atoms: &AtomsResults) -> Result<Markup> {
    let mut drawn = Vec::new();
    let (mut width, mut worst) = (0.0, 0.0_f64);
    let highest = atoms.states.iter().filter_map(|s| s.stress.as_ref()).map(|s| s.highest_gpa).fold(0.0, f64::max);
    for (i, state) in atoms.states.iter().enumerate() {
        let Some(stress) = &state.stress else { continue };
        (width, worst) = (stress.width_angstrom, worst.max(stress.load_error.abs()));
        let small = picture::load(&writer.field(&stress.map)?, PANEL_SIDE, |v| v)?;
        let own = Range { low: 0.0, ..Range::of(&small.values, 0.0) };
        let range = if writer.own_ranges() || highest <= 0.0 { own } else { Range { low: 0.0, high: highest } };
        let legend = Legend::Ramp(Bar::plain("normal stress", range, "GPa", false));
        let title = format!("p* = {}", trimmed(state.p_star, 4));
        let names = (format!("stress-atoms-{}", i + 1), format!("normal stress of the atoms at {title}"));
        let picture = picture::map(&small, range);
        let image = writer.map((&names.0, &names.1), &picture, atoms.length_angstrom * ANGSTROM_M, legend)?;
        let below = html! { "at most " (significant(stress.highest_gpa, 3)) " GPa" };
        drawn.push(panel(&title, image, below));
    }
    if drawn.is_empty() {
        return Ok(html! {});
    }
    Ok(figure(
        panels(drawn.len().min(3), &drawn),
        html! { "Normal stress: the indenter’s force on each atom, spread by a Gaussian with a standard deviation of "
        (trimmed(width, 4)) " Å. The integral of the field is the load to " (significant(worst, 1)) " (relative). " (writer.range_note()) },
    ))
}

/// Contact fraction of the atoms against the contact distance, and of the continuum against the gap threshold.
pub(super) fn sensitivity(writer: &FigureWriter, c: &ComparisonResults) -> Result<Markup> {
    let mut figures = Vec::new();
    for (i, load) in c.loads.iter().enumerate() {
        if load.area_vs_distance.is_empty() {
            continue;
        }
        let panel_of = |name: &str, title: &str, x_label: &str, curves: Vec<Curve>| -> Result<Option<Markup>> {
            let plot = Plot {
                width: PANEL,
                proportion: 0.8,
                include: vec![(curves[0].points[0].0, 0.0), (curves[0].points[0].0, top(load))],
                ..Plot::new((Axis::Linear, Axis::Linear), (x_label, "contact (%)"), curves)
            };
            Ok(writer.curves(&format!("{name}-{}", i + 1), &plot)?.map(|svg| panel(title, svg, html! {})))
        };
        let distance = |label: &str, style: Style, k: usize| {
            curve(label, style, load.area_vs_distance.iter().map(|row| (row[0], 100.0 * row[k])).collect())
        };
        let gap = |label: &str, style: Style, k: usize| {
            curve(label, style, load.area_vs_gap.iter().map(|row| (row[0], 100.0 * row[k])).collect())
        };
        let by_distance = vec![
            distance("atoms", ATOMS, 1),
            distance("offset wall", THRESHOLD, 2),
            distance("compliant wall", SOFT, 3),
        ];
        let by_gap = vec![gap("hard wall", HARD, 1), gap("compliant wall", SOFT, 2)];
        let both = [
            panel_of("area-vs-distance", "Contact distance", "contact distance (Å)", by_distance)?,
            panel_of("area-vs-gap", "Gap threshold", "gap threshold (Å)", by_gap)?,
        ];
        let drawn: Vec<Markup> = both.into_iter().flatten().collect();
        let caption = html! { "Contact at p* = " (trimmed(load.p_star, 4)) @if i == 0 { ". Left: against the contact distance d_c, from 0.95 to 1.1 of "
        "the distance at which the repulsion begins, with the same criterion for the continuum’s surface atoms. Right: continuum, against the "
        "gap threshold, over the same lengths. Where the left curves are steep, the criterion determines the area." } @else { "." } };
        figures.push(figure(panels(2, &drawn), caption));
    }
    Ok(html! { @if !figures.is_empty() { h3 { "Sensitivity to the contact criterion" } @for f in &figures { (f) } } })
}

fn curve(label: &str, style: Style, points: Vec<(f64, f64)>) -> Curve {
    Curve { label: label.into(), style: style.without_marker(), points }
}

/// Common upper end of the vertical axes of both panels.
fn top(load: &LoadComparison) -> f64 {
    let rows = load.area_vs_distance.iter().flat_map(|r| &r[1..]).chain(load.area_vs_gap.iter().flat_map(|r| &r[1..]));
    100.0 * rows.copied().fold(0.0, f64::max)
}

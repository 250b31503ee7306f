//! Comparison of continuum and atoms: contact maps, agreement, gap profiles, areas.

use super::loads::{PANEL_SIDE, of_gap, setting, states};
use super::prelude::*;
use super::uncertainty::total;
use super::{criteria, model_chain};
use crate::record::downsample::DownsampledMap;
use crate::report::picture::LONGEST_SIDE;
use asperity_grid::error::Error;
use asperity_grid::units::ANGSTROM_M;

/// Relative tolerance of equal loads: solvers meet a load to 10⁻³ or better, and loads of a path differ by far more.
pub(super) const SAME_LOAD: f64 = 0.01;

/// The state at a load.
pub(super) fn at_load<T>(states: &[T], p_star: f64, value: impl Fn(&T) -> f64) -> Option<&T> {
    let distance = |s: &T| (value(s) - p_star).abs();
    states.iter().filter(|s| distance(s) <= SAME_LOAD * p_star.abs()).min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

/// The continuum's contact under a criterion.
fn under<'a>(load: &'a LoadComparison, id: &str) -> Option<&'a CriterionMatch> {
    load.continuum.iter().find(|m| m.id == id)
}

/// Criterion of pictures and summary: the distance criterion of the atoms, applied to the compliant-wall solution.
pub(super) fn matched(load: &LoadComparison) -> Option<&CriterionMatch> {
    ["compliant_wall", "offset_wall"].into_iter().find_map(|id| under(load, id))
}

/// The compliant-wall solution with the crystal's hardness, under the same criterion.
pub(super) fn yielding(load: &LoadComparison) -> Option<&CriterionMatch> {
    under(load, "yielding_wall")
}

/// Relative uncertainty of a continuum's contact area at a load.
pub(super) fn uncertainty_at(continuum: &ContinuumResults, load: &LoadComparison) -> Option<f64> {
    total(state_at(continuum, load)?, Quantity::ContactArea)
}

/// The same of the continuum that is compared with the atoms.
pub(super) fn matched_uncertainty(c: &ComparisonResults, load: &LoadComparison) -> Option<f64> {
    uncertainty_at(&c.compliant_wall, load)
}

/// Relative difference below which areas are called equal.
const LEAST_DIFFERENCE: f64 = 5e-5;

/// Whether a relative difference is more than the last digit that is shown.
pub(super) fn differs(relative: f64) -> bool {
    relative.abs() >= LEAST_DIFFERENCE
}

/// `53.3 % more`, `3.2 % less` or `as much`.
pub(super) fn more_or_less(relative: f64) -> String {
    if !differs(relative) {
        return "as much".into();
    }
    format!("{} {}", percent(relative.abs()), if relative < 0.0 { "less" } else { "more" })
}

pub(super) fn section(writer: &FigureWriter, atoms: &AtomsResults, c: &ComparisonResults) -> Result<Markup> {
    let gap = |gap: f64| with_unit(gap / ANGSTROM_M, 4, "Å");
    let one = |(i, load): (usize, &LoadComparison)| -> Result<Markup> {
        let state = at_load(&atoms.states, load.p_star, |s| s.p_star);
        let maps = state.map(|state| Maps { writer, length: atoms.length_angstrom, load, state, number: i + 1 });
        Ok(html! {
            h3 { "Maps at " (writer.loads.label(load.p_star)) }
            @if let Some(maps) = &maps { (maps.contacts()?) }
            (matches(load))
            @if let Some(maps) = &maps { (maps.gaps(&c.hard_wall)?) }
        })
    };
    let loads = c.loads.iter().enumerate().map(one).collect::<Result<Vec<_>>>()?;
    Ok(html! {
        p { "Both sides have the same heights, load and elastic body at the atoms’ scale; they differ in the method and the "
            "contact criterion. The continuum is solved twice: with a hard wall, and with a compliant wall, which is the "
            "atoms’ own repulsion law, with the compliance of single atoms, on the profile dilated by the atoms’ distance. "
            "Pictures and summary use the criterion “"
            (c.loads.first().and_then(matched).map_or("hard wall", |m| m.label())) "”." }
        (overview(c, writer.loads))
        (each(&loads))
        (model_chain::section(writer, c)?)
        (criteria::sensitivity(writer, c)?)
        (sections(writer, &c.sections)?)
        details {
            summary { "Continuum solutions: settings, solver and states" }
            @if let Some(full) = &c.full_heights { h3 { "Full heights" } (setting(full)) (states(full, writer.loads, &gap)) }
            h3 { "Hard wall" }
            (setting(&c.hard_wall)) (states(&c.hard_wall, writer.loads, &gap))
            h3 { "Compliant wall" }
            p.quiet { "Mean gaps are measured from the dilated profile; those above from the heights." }
            (setting(&c.compliant_wall)) (states(&c.compliant_wall, writer.loads, &gap))
        }
    })
}

/// Table of all loads: contact fraction under each criterion, and agreement of the maps.
fn overview(c: &ComparisonResults, loads: GivenLoads) -> Markup {
    let area = |l, id| or_dash(under(l, id).map(|m| percent(m.contact_area)));
    let off = |l: &LoadComparison, m: &CriterionMatch| Some(signed_percent(deviation(l, m)?));
    html! {
        (columns!("numbers", c.loads.iter().map(|l| (l, matched(l))), |(l, best)| {
            loads.head() => loads.value(l.p_star),
            "atoms" => html! { strong { (percent(l.atoms.contact_area)) } },
            "hard wall, zero gap" => area(l, "hard_wall"),
            "offset wall" => area(l, "offset_wall"),
            "compliant wall" => area(l, "compliant_wall"),
            "atoms / compliant wall" => or_dash(best.and_then(|m| off(l, m))),
            "κ" => or_dash(best.map(|m| significant(m.overlap.kappa, 2))),
            "κ, misaligned map" => or_dash(best.map(|m| significant(m.shifted.kappa, 2))),
        }))
        p.quiet { "Contact fraction under each criterion; the deviation of the atoms and κ are for the criterion of the pictures." }
    }
}

/// Relative deviation of the atoms' contact from that under a criterion; `None` if the latter is zero.
pub(super) fn deviation(load: &LoadComparison, m: &CriterionMatch) -> Option<f64> {
    (m.contact_area > 0.0).then(|| load.atoms.contact_area / m.contact_area - 1.0)
}

fn signed_percent(fraction: f64) -> String {
    let sign = if fraction > 0.0 { "+" } else { "" };
    format!("{sign}{}", with_unit(100.0 * fraction, 2, "%"))
}

/// The state of a continuum solution at a load.
pub(super) fn state_at<'a>(c: &'a ContinuumResults, load: &LoadComparison) -> Option<&'a State> {
    at_load(&c.states, load.p_star, |s| s.p_star)
}

/// Maps of one load, of the continuum and of the atoms.
struct Maps<'a> {
    writer: &'a FigureWriter<'a>,
    /// Width of the block, Å.
    length: f64,
    load: &'a LoadComparison,
    state: &'a AtomState,
    number: usize,
}

impl Maps<'_> {
    fn contacts(&self) -> Result<Markup> {
        let Maps { writer, load, state, number, .. } = self;
        let length_m = self.length * ANGSTROM_M;
        let touching = writer.flags(&state.contact_map, LONGEST_SIDE)?;
        let draw = |name: &str, title: &str, map: &DownsampledMap, colour: Rgb, below: Markup| -> Result<Markup> {
            let image = writer.map((&format!("{name}-{number}"), title), &picture::contact(map, colour), length_m)?;
            Ok(panel(title, image, below))
        };
        let mut drawn = Vec::new();
        let mut last = None;
        let criteria = [under(load, "hard_wall"), yielding(load), matched(load)];
        for (m, name) in criteria.into_iter().zip(["contact-plain", "contact-yielding", "contact-matched"]) {
            // Under some criteria no map is stored.
            let Some((m, file)) = m.and_then(|m| Some((m, m.map.as_deref()?))) else { continue };
            let title = match m.id.as_str() {
                "hard_wall" => "Hard wall, gap = 0".into(),
                "offset_wall" => format!("Offset wall, {}\u{a0}Å", trimmed(m.offset_angstrom, 3)),
                _ => capitalised(m.label()),
            };
            let map = writer.flags(file, LONGEST_SIDE)?;
            drawn.push(draw(name, &title, &map, ORANGE, html! { (percent(m.contact_area)) " in contact" })?);
            last = Some((map, m));
        }
        let of_atoms = html! { (percent(load.atoms.contact_area)) " in contact (" (load.atoms.criterion) ")" };
        drawn.push(draw("contact-atoms", "Atoms", &touching, BLUE, of_atoms)?);
        if let Some((map, m)) = last {
            if (map.nx, map.ny) != (touching.nx, touching.ny) {
                let found = format!("a map of {} × {} cells after reduction", touching.nx, touching.ny);
                let accepted = format!("the grid of the continuum’s map ({} × {})", map.nx, map.ny);
                return Err(Error::format(writer.field(&state.contact_map)?, found, accepted));
            }
            let (name, alt) = (format!("superposed-{number}"), "contact maps of continuum and atoms, superposed");
            let image =
                writer.map((&name, alt), &picture::superposed(&map, &touching)?.keyed(&SUPERPOSED), length_m)?;
            drawn.push(panel("Superposed", image, agreement(m)));
        }
        let n = touching.factor;
        Ok(figure(
            panels(drawn.len(), &drawn),
            html! { "Contact maps; white: no contact. x to the right, y up."
            @if n > 1 { " A picture element is drawn as contact where at least half of its " (n) " × " (n) " nodes are in contact." } },
        ))
    }

    /// The three gap maps with a common colour range.
    fn gaps(&self, hard_wall: &ContinuumResults) -> Result<Markup> {
        let Maps { writer, load, state, number, .. } = self;
        let of_hard_wall = state_at(hard_wall, load).and_then(|s| s.gap_file());
        let mut maps = Vec::new();
        for (title, name, file, id) in [
            ("Gap, hard wall", "gap-hard", of_hard_wall, "hard_wall"),
            ("Gap, compliant wall", "gap-compliant", Some(load.compliant_wall_gap.as_str()), "compliant_wall"),
        ] {
            if let (Some(file), Some(map)) = (file, under(load, id).and_then(|m| m.map.as_deref())) {
                let small = writer.load(file, PANEL_SIDE, |v| v * self.length)?;
                maps.push((title, name, small, writer.flags(map, PANEL_SIDE)?));
            }
        }
        let gap = writer.load(&state.gap_map, PANEL_SIDE, |v| v)?;
        maps.push(("Gap, atoms", "gap-atoms", gap, writer.flags(&state.contact_map, PANEL_SIDE)?));
        let range = of_gap(maps.iter().flat_map(|m| &m.2.values));
        let mut drawn = Vec::new();
        for (title, name, small, contact) in &maps {
            let gap = Values { quantity: "gap", unit: "Å", small, range, contact: Some(contact) };
            let image = writer.values((&format!("{name}-{number}"), title), &gap, self.length * ANGSTROM_M)?;
            drawn.push(panel(title, image, ""));
        }
        Ok(figure(
            panels(drawn.len(), &drawn),
            html! { "The gap at " (writer.loads.label(load.p_star)) ", in one colour range; dark is small, black is contact "
            "(hard wall: zero gap; compliant wall and atoms: by the criteria above). The atoms have one value per "
            "surface atom." },
        ))
    }
}

/// Colours of two superposed contact maps.
pub(super) const SUPERPOSED: [(Rgb, &str); 3] =
    [(BLACK, "both"), (ORANGE, "only the continuum"), (BLUE, "only the atoms")];

/// Colours with their meanings.
pub(super) fn key(entries: &[(Rgb, &str)]) -> Markup {
    html! { @for ([r, g, b], tokens) in entries { span { i style={ "background:rgb(" (r) "," (g) "," (b) ")" } {} (tokens) } } }
}

fn agreement(m: &CriterionMatch) -> Markup {
    let [here, shifted] = [&m.overlap, &m.shifted]
        .map(|o| format!("κ = {}, Jaccard {}", significant(o.kappa, 2), significant(o.jaccard, 2)));
    html! { (m.label()) " and atoms: " (here) br; (quiet(format!("misaligned map: {shifted}"))) }
}

fn matches(load: &LoadComparison) -> Markup {
    let angstrom = |v: f64| with_unit(v, 4, "Å");
    let continuum = load.continuum.iter().map(|m| (m.label(), &m.criterion, m.contact_area, Some(m)));
    let all = continuum.chain([("atoms", &load.atoms.criterion, load.atoms.contact_area, None)]);
    let gap = |m: &CriterionMatch| load.mean_gap_angstrom(&m.id).map_or_else(String::new, angstrom);
    let agreement = |m: Option<&CriterionMatch>, of: fn(&Overlap) -> f64| {
        let shifted = |m: &CriterionMatch| quiet(format!("({})", significant(of(&m.shifted), 2)));
        html! { @if let Some(m) = m { (significant(of(&m.overlap), 3)) " " (shifted(m)) } }
    };
    let [sx, sy] = load.registration;
    html! {
        (columns!("words", all, |(name, criterion, area, m)| {
            "contact criterion" => html! { strong { (name) } ": " (criterion) },
            "contact" => percent(area),
            "mean gap" => m.map_or_else(|| angstrom(load.atoms_mean_gap_angstrom), gap),
            "κ" => agreement(m, |o| o.kappa),
            "Jaccard" => agreement(m, |o| o.jaccard),
            "precision" => agreement(m, |o| o.precision),
            "recall" => agreement(m, |o| o.recall),
        }))
        p.quiet { "In brackets: the same for the misaligned map. Precision: fraction of the continuum’s contact that is also contact of the "
            "atoms; recall: fraction of the atoms’ contact that is also contact of the continuum." }
        p { "Clusters, corners connecting: " (count(load.atoms_clusters)) " in the atoms, " (count(load.compliant_wall_clusters))
            " with the compliant wall. "
            @if let Some(rms) = load.gap_rms_difference_angstrom {
                "Outside both contacts the gaps of these two differ by " (angstrom(rms)) " (rms). " }
            @if load.registration == [0, 0] { "Registration: the maps are aligned." }
            @else { "Registration: the maps agree best with the atoms shifted by (" (sx) ", " (sy)
                ") nodes; the pictures are not shifted." } }
    }
}

/// Gap profiles along x = L/2, one frame per load.
fn sections(writer: &FigureWriter, list: &[GapSection]) -> Result<Markup> {
    let one = |(i, s): (usize, &GapSection)| {
        let curves = [
            ("full heights", LABORATORY, &s.full_heights_gap_angstrom),
            ("hard wall", HARD, &s.hard_wall_gap_angstrom),
            ("compliant wall", SOFT, &s.compliant_wall_gap_angstrom),
            ("atoms", ATOMS, &s.atoms_gap_angstrom),
        ];
        let curve = |(label, style, gap): (&str, _, &Vec<f64>)| {
            Curve::line(label, style, s.y.iter().copied().zip(gap.iter().copied()))
        };
        let curves = curves.into_iter().filter(|(.., gap)| !gap.is_empty()).map(curve).collect();
        let plot = Plot { proportion: 0.42, ..Plot::new(linear("y / L"), linear("gap (Å)"), curves) };
        let caption = html! { "The gap along the line x = L/2 at " (writer.loads.label(s.p_star)) "."
        @if i == 0 { " Gaps of the atoms and of the compliant wall are measured from where the repulsion begins, so they are "
            "negative under compression. Steps are atoms: each point of the line has the gap of the nearest surface atom." } };
        Figure::new(format!("section-{}", i + 1), caption, plot)
    };
    let figures = writer.figures(list.iter().enumerate().map(one))?;
    Ok(html! { @if !figures.0.is_empty() { h3 { "Sections through the gap" } (figures) } })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_load_is_found_within_its_error_and_not_beyond() {
        let states = [0.01, 0.0201, 0.04];
        assert_eq!(at_load(&states, 0.02, |s| *s), Some(&0.0201));
        assert_eq!(at_load(&states, 0.03, |s| *s), None);
        assert_eq!(at_load(&states, 0.0, |s| *s), None);
    }
}

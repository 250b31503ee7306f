//! Comparison of continuum and atoms: contact maps, agreement, gap profiles, areas.

use maud::{Markup, html};

use super::figures::{FigureWriter, figure, numbers, panel, panels, table, text};
use super::loads::{CLIPPED, PANEL_SIDE, clipped, setting, states};
use super::uncertainty::total;
use super::{criteria, model_chain};
use crate::error::{Error, Result};
use crate::record::downsample::DownsampledMap;
use crate::record::quantity::Quantity;
use crate::record::results::{
    AtomState, AtomsResults, ComparisonResults, ContinuumResults, CriterionMatch, LoadComparison, Section, StateResults,
};
use crate::report::map::{Bar, Legend};
use crate::report::number::{count, percent, si, significant, trimmed};
use crate::report::picture::{self, BLACK, BLUE, LONGEST_SIDE, ORANGE, Range, Rgb};
use crate::report::plot::{ATOMS, Axis, Curve, HARD, LABORATORY, Plot, SOFT, Style};
use crate::units::ANGSTROM_M;

/// Relative tolerance of equal loads: solvers meet a load to 10⁻³ or better, and loads of a path differ by far more.
pub(super) const SAME_LOAD: f64 = 0.01;

/// The state at a load.
pub(super) fn at_load<T>(states: &[T], p_star: f64, of: impl Fn(&T) -> f64) -> Option<&T> {
    let distance = |s: &T| (of(s) - p_star).abs();
    states.iter().filter(|s| distance(s) <= SAME_LOAD * p_star.abs()).min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

/// Criterion of pictures and summary: the distance criterion of the atoms, applied to the compliant-wall solution.
pub(super) fn matched(load: &LoadComparison) -> Option<&CriterionMatch> {
    ["compliant_wall", "offset_wall"].iter().find_map(|id| load.continuum.iter().find(|m| m.id == *id))
}

/// The compliant-wall solution with the crystal's hardness, under the same criterion.
pub(super) fn yielding(load: &LoadComparison) -> Option<&CriterionMatch> {
    load.continuum.iter().find(|m| m.id == "yielding_wall")
}

/// Relative uncertainty of a continuum's contact area at a load.
pub(super) fn uncertainty_at(continuum: &ContinuumResults, load: &LoadComparison) -> Option<f64> {
    let state = at_load(&continuum.states, load.p_star, |s: &StateResults| s.numbers.p_star)?;
    total(state, Quantity::ContactArea)
}

/// The same of the continuum that is compared with the atoms.
pub(super) fn matched_uncertainty(c: &ComparisonResults, load: &LoadComparison) -> Option<f64> {
    uncertainty_at(&c.compliant_wall, load)
}

/// `53.3 % more` or `3.2 % less`.
pub(super) fn more_or_less(relative: f64) -> String {
    format!("{} {}", percent(relative.abs()), if relative < 0.0 { "less" } else { "more" })
}

pub(super) fn section(writer: &FigureWriter, atoms: &AtomsResults, c: &ComparisonResults) -> Result<Markup> {
    let units = |s: &StateResults| {
        let pressure = si(s.numbers.pressure * atoms.modulus_gpa * 1e9, "Pa", 3);
        [pressure, format!("{}\u{a0}Å", significant(s.mean_gap * atoms.length_angstrom, 4))]
    };
    let mut loads = Vec::new();
    for (i, load) in c.loads.iter().enumerate() {
        loads.push(one_load(writer, atoms, c, load, i + 1)?);
    }
    Ok(html! {
        p { "Both sides have the same heights, load and elastic body at the atoms’ scale; they differ in the method and the "
            "contact criterion. The continuum is solved twice: with a hard wall, and with a compliant wall, which is the "
            "atoms’ own repulsion law, with the compliance of single atoms, on the profile dilated by the atoms’ distance. "
            "Pictures and summary use the criterion “"
            (c.loads.first().and_then(matched).map_or("hard wall", |m| m.label())) "”." }
        (overview(c))
        @for l in &loads { (l) }
        (model_chain::section(writer, c)?)
        (criteria::sensitivity(writer, c)?)
        (sections(writer, &c.sections)?)
        details {
            summary { "Continuum solutions: settings, solver and states" }
            @if let Some(full) = &c.full_heights { h3 { "Full heights" } (setting(full)) (states(full, &units)) }
            h3 { "Hard wall" }
            (setting(&c.hard_wall)) (states(&c.hard_wall, &units))
            h3 { "Compliant wall" }
            p.quiet { "Mean gaps are measured from the dilated profile; those above from the heights." }
            (setting(&c.compliant_wall)) (states(&c.compliant_wall, &units))
        }
    })
}

/// Table of all loads: contact fraction under each criterion, and agreement of the maps.
fn overview(c: &ComparisonResults) -> Markup {
    let rows = c
        .loads
        .iter()
        .map(|load| {
            let area = |id: &str| {
                let found = load.continuum.iter().find(|m| m.id == id);
                text(found.map_or("–".into(), |m| percent(m.contact_area)))
            };
            let best = matched(load);
            vec![
                text(trimmed(load.p_star, 4)),
                html! { strong { (percent(load.atoms.contact_area)) } },
                area("hard_wall"),
                area("offset_wall"),
                area("compliant_wall"),
                text(best.and_then(|m| deviation(load, m)).map_or("–".into(), signed_percent)),
                text(best.map_or("–".into(), |m| significant(m.overlap.kappa, 2))),
                text(best.map_or("–".into(), |m| significant(m.shifted.kappa, 2))),
            ]
        })
        .collect();
    let head = [
        "p*",
        "atoms",
        "hard wall, zero gap",
        "offset wall",
        "compliant wall",
        "atoms / compliant wall",
        "κ",
        "κ, misaligned map",
    ];
    html! {
        (numbers(&head, rows))
        p.quiet { "Contact fraction under each criterion; the deviation of the atoms and κ are for the criterion of the pictures." }
    }
}

/// Relative deviation of the atoms' contact from that under a criterion; `None` if the latter is zero.
pub(super) fn deviation(load: &LoadComparison, m: &CriterionMatch) -> Option<f64> {
    (m.contact_area > 0.0).then(|| load.atoms.contact_area / m.contact_area - 1.0)
}

fn signed_percent(share: f64) -> String {
    let sign = if share > 0.0 { "+" } else { "" };
    format!("{sign}{}\u{a0}%", significant(100.0 * share, 2))
}

/// A downsampled contact map with the title of its panel.
struct Contact {
    title: String,
    map: DownsampledMap,
    share: f64,
}

fn one_load(
    writer: &FigureWriter,
    atoms: &AtomsResults,
    c: &ComparisonResults,
    load: &LoadComparison,
    number: usize,
) -> Result<Markup> {
    let state = at_load(&atoms.states, load.p_star, |s| s.p_star);
    Ok(html! {
        h3 { "Maps at p* = " (trimmed(load.p_star, 4)) }
        @if let Some(state) = state { (contact_maps(writer, atoms, load, state, number)?) }
        (matches(load))
        @if let Some(state) = state { (gap_maps(writer, atoms, c, load, state, number)?) }
    })
}

/// Gap file of a continuum solution at a load, if stored.
fn gap_of(c: &ContinuumResults, p_star: f64) -> Option<&str> {
    at_load(&c.states, p_star, |s: &StateResults| s.numbers.p_star)?.numbers.gap_map.as_deref()
}

/// A stored contact map, downsampled.
fn flags(writer: &FigureWriter, file: &str, longest: usize) -> Result<DownsampledMap> {
    picture::load(&writer.field(file)?, longest, |v| f64::from(u8::from(v != 0.0)))
}

/// Contact map of the continuum under a criterion, if stored.
fn continuum_contact(writer: &FigureWriter, m: &CriterionMatch) -> Result<Option<Contact>> {
    let Some(file) = &m.map else { return Ok(None) };
    let title = match m.id.as_str() {
        "hard_wall" => "Hard wall, gap = 0".into(),
        "offset_wall" => format!("Offset wall, {}\u{a0}Å", trimmed(m.offset_angstrom, 3)),
        "yielding_wall" => "Compliant wall with hardness".into(),
        _ => "Compliant wall".into(),
    };
    Ok(Some(Contact { title, map: flags(writer, file, LONGEST_SIDE)?, share: m.contact_area }))
}

fn contact_maps(
    writer: &FigureWriter,
    atoms: &AtomsResults,
    load: &LoadComparison,
    state: &AtomState,
    number: usize,
) -> Result<Markup> {
    let length_m = atoms.length_angstrom * ANGSTROM_M;
    let touching = flags(writer, &state.contact_map, LONGEST_SIDE)?;
    let plain = load.continuum.iter().find(|m| m.id == "hard_wall");
    let best = matched(load);
    let mut panels = Vec::new();
    let draw = |name: &str, title: &str, map: &DownsampledMap, colour: Rgb, below: Markup| -> Result<Markup> {
        let names = (format!("{name}-{number}"), title);
        let image = writer.map((&names.0, names.1), &picture::contact(map, colour), length_m, Legend::None)?;
        Ok(panel(title, image, below))
    };
    let mut drawn = Vec::new();
    for (m, name) in [(plain, "contact-plain"), (yielding(load), "contact-yielding"), (best, "contact-matched")] {
        let Some(m) = m else { continue };
        if let Some(contact) = continuum_contact(writer, m)? {
            panels.push(draw(
                name,
                &contact.title,
                &contact.map,
                ORANGE,
                html! { (percent(contact.share)) " in contact" },
            )?);
            drawn.push((contact, m));
        }
    }
    let atoms_share = html! { (percent(load.atoms.contact_area)) " in contact (" (load.atoms.criterion) ")" };
    panels.push(draw("contact-atoms", "Atoms", &touching, BLUE, atoms_share)?);
    if let Some((contact, m)) = drawn.last() {
        if (contact.map.nx, contact.map.ny) != (touching.nx, touching.ny) {
            let found = format!("a map of {} × {} cells after reduction", touching.nx, touching.ny);
            let accepted = format!("the grid of the continuum’s map ({} × {})", contact.map.nx, contact.map.ny);
            return Err(Error::format(writer.field(&state.contact_map)?, found, accepted));
        }
        let image = writer.map(
            (&format!("superposed-{number}"), "contact maps of continuum and atoms, superposed"),
            &picture::superposed(&contact.map, &touching),
            length_m,
            Legend::None,
        )?;
        panels.push(panel("Superposed", image, agreement(m)));
    }
    let rule = if touching.factor > 1 {
        format!(
            " A picture element is drawn as contact where at least half of its {0} × {0} nodes are in contact.",
            touching.factor
        )
    } else {
        String::new()
    };
    Ok(figure(
        html! {
            (self::panels(panels.len(), &panels))
            div.key { (key(BLACK, "both")) (key(ORANGE, "only the continuum")) (key(BLUE, "only the atoms")) }
        },
        html! { "Contact maps; white: no contact. x to the right, y up." (rule) },
    ))
}

pub(super) fn key([r, g, b]: Rgb, words: &str) -> Markup {
    html! { span { i style={ "background:rgb(" (r) "," (g) "," (b) ")" } {} (words) } }
}

fn agreement(m: &CriterionMatch) -> Markup {
    html! {
        (m.label()) " and atoms: κ = " (significant(m.overlap.kappa, 2)) ", Jaccard " (significant(m.overlap.jaccard, 2)) br;
        span.quiet { "misaligned map: κ = " (significant(m.shifted.kappa, 2)) ", Jaccard "
            (significant(m.shifted.jaccard, 2)) }
    }
}

fn matches(load: &LoadComparison) -> Markup {
    let angstrom = |v: f64| format!("{}\u{a0}Å", significant(v, 4));
    let with_misaligned = |value: f64, shifted: f64| {
        html! { (significant(value, 3)) " " span.quiet { "(" (significant(shifted, 2)) ")" } }
    };
    let rows = load
        .continuum
        .iter()
        .map(|m| {
            vec![
                html! { strong { (m.label()) } ": " (m.criterion) },
                text(percent(m.contact_area)),
                text(load.mean_gap_angstrom(&m.id).map_or_else(String::new, angstrom)),
                with_misaligned(m.overlap.kappa, m.shifted.kappa),
                with_misaligned(m.overlap.jaccard, m.shifted.jaccard),
                with_misaligned(m.overlap.precision, m.shifted.precision),
                with_misaligned(m.overlap.recall, m.shifted.recall),
            ]
        })
        .chain([vec![
            html! { strong { "atoms" } ": " (load.atoms.criterion) },
            text(percent(load.atoms.contact_area)),
            text(angstrom(load.atoms_mean_gap_angstrom)),
            html! {},
            html! {},
            html! {},
            html! {},
        ]])
        .collect();
    let [sx, sy] = load.registration;
    html! {
        (table(&["contact criterion", "contact", "mean gap", "κ", "Jaccard", "precision", "recall"], rows))
        p.quiet { "In brackets: the same for the misaligned map. Precision: fraction of the continuum’s contact that is also contact of the "
            "atoms; recall: fraction of the atoms’ contact that is also contact of the continuum." }
        p { "Clusters, corners connecting: " (count(load.atoms_patches)) " in the atoms, " (count(load.compliant_wall_patches))
            " with the compliant wall. Outside both contacts the gaps of these two differ by "
            (angstrom(load.gap_rms_difference_angstrom)) " (rms). "
            @if load.registration == [0, 0] { "Registration: the maps are aligned." }
            @else { "Registration: the maps agree best with the atoms shifted by (" (sx) ", " (sy)
                ") nodes; the pictures are not shifted." } }
    }
}

/// The three gap maps with a common colour range.
fn gap_maps(
    writer: &FigureWriter,
    atoms: &AtomsResults,
    c: &ComparisonResults,
    load: &LoadComparison,
    state: &AtomState,
    number: usize,
) -> Result<Markup> {
    let length = atoms.length_angstrom;
    let touching = |id: &str| load.continuum.iter().find(|m| m.id == id).and_then(|m| m.map.as_deref());
    let mut maps = Vec::new();
    for (title, name, file, id) in [
        ("Gap, hard wall", "gap-hard", gap_of(&c.hard_wall, load.p_star), "hard_wall"),
        ("Gap, compliant wall", "gap-compliant", Some(load.compliant_wall_gap.as_str()), "compliant_wall"),
    ] {
        if let (Some(file), Some(map)) = (file, touching(id)) {
            let small = picture::load(&writer.field(file)?, PANEL_SIDE, |v| v * length)?;
            maps.push((title, name, small, flags(writer, map, PANEL_SIDE)?));
        }
    }
    let gap = picture::load(&writer.field(&state.gap_map)?, PANEL_SIDE, |v| v)?;
    maps.push(("Gap, atoms", "gap-atoms", gap, flags(writer, &state.contact_map, PANEL_SIDE)?));
    let range = Range { low: 0.0, ..Range::of(maps.iter().flat_map(|m| &m.2.values), CLIPPED) };
    let mut panels = Vec::new();
    for (title, name, small, contact) in &maps {
        let legend = Legend::OverContact(Bar::plain("gap", range, "Å", clipped(small, range)));
        let names = (format!("{name}-{number}"), *title);
        let drawn = picture::gap(small, range, contact);
        let image = writer.map((&names.0, names.1), &drawn, length * ANGSTROM_M, legend)?;
        panels.push(panel(title, image, html! {}));
    }
    Ok(figure(
        self::panels(panels.len(), &panels),
        html! { "The gap at p* = " (trimmed(load.p_star, 4)) ", in one colour range; dark is small, black is contact "
        "(hard wall: zero gap; compliant wall and atoms: by the criteria above). The atoms have one value per "
        "surface atom." },
    ))
}

/// Gap profiles along x = L/2, one frame per load.
fn sections(writer: &FigureWriter, list: &[Section]) -> Result<Markup> {
    let mut figures = Vec::new();
    for (i, s) in list.iter().enumerate() {
        let curve = |label: &str, style: Style, gap: &[f64]| Curve {
            label: label.into(),
            style: style.without_marker(),
            points: s.y.iter().copied().zip(gap.iter().copied()).collect(),
        };
        let mut curves = vec![
            curve("hard wall", HARD, &s.hard_wall_gap_angstrom),
            curve("compliant wall", SOFT, &s.compliant_wall_gap_angstrom),
            curve("atoms", ATOMS, &s.atoms_gap_angstrom),
        ];
        if !s.full_heights_gap_angstrom.is_empty() {
            curves.insert(0, curve("full heights", LABORATORY, &s.full_heights_gap_angstrom));
        }
        let plot = Plot { proportion: 0.42, ..Plot::new((Axis::Linear, Axis::Linear), ("y / L", "gap (Å)"), curves) };
        if let Some(svg) = writer.curves(&format!("section-{}", i + 1), &plot)? {
            let caption = html! { "The gap along the line x = L/2 at p* = " (trimmed(s.p_star, 4)) "."
            @if i == 0 { " Gaps of the atoms and of the compliant wall are measured from where the repulsion begins, so they are "
                "negative under compression. Steps are atoms: each point of the line has the gap of the nearest surface atom." } };
            figures.push(figure(svg, caption));
        }
    }
    Ok(html! { @if !figures.is_empty() { h3 { "Sections through the gap" } @for f in &figures { (f) } } })
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

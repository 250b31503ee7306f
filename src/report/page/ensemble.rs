//! The page of a sweep: means over realisations with their errors, and differences between sources.

use maud::{Markup, html};
use serde_json::Value;
use std::collections::BTreeSet;

use super::document::{Section, document};
use super::figures::{FigureWriter, capitalised, figure, numbers, table, text};
use super::summary::with_subscripts;
use crate::error::Result;
use crate::load::Branch;
use crate::record::ensemble::{Difference, Ensemble, FILE, Observable, PointStatus, Sample, Statistic};
use crate::report::number::{percent, significant, trimmed, with_error};
use crate::report::picture::{BLACK, BLUE, GREEN, ORANGE, PURPLE, Rgb, VERMILION};
use crate::report::plot::{Axis, Curve, Dash, Marker, Plot, Style};

const COLOURS: [Rgb; 6] = [BLUE, ORANGE, GREEN, VERMILION, BLACK, PURPLE];

/// Quantities that are drawn, with label and axis.
const DRAWN: [(&str, &str, Axis); 3] = [
    ("contact_area", "relative contact area", Axis::Log),
    ("mean_gap", "mean gap", Axis::Log),
    ("kappa", "Cohen’s κ with the atoms", Axis::Linear),
];

/// A combination of the varied keys besides the seed.
type Group = Vec<(String, Value)>;

pub(super) fn page(writer: &FigureWriter, e: &Ensemble) -> Result<Markup> {
    let mut groups: Vec<&Group> = Vec::new();
    for s in &e.statistics {
        if !groups.contains(&&s.group) {
            groups.push(&s.group);
        }
    }
    let mut figures = Vec::new();
    for (quantity, label, axis) in DRAWN {
        figures.extend(together(writer, e, &groups, (quantity, label, axis))?);
    }
    // A point alone is no curve; those of a varied load are in the figures of all.
    let paths = groups.iter().enumerate().filter(|(_, g)| groups.len() == 1 || is_path(e, g));
    for (k, group) in paths {
        figures.push(html! { @if !group.is_empty() { h3 { (name(group)) } } });
        for (quantity, label, axis) in DRAWN {
            figures.extend(means(writer, e, (k, group), (quantity, label, axis))?);
        }
        figures.extend(differences(writer, e, (k, group))?);
    }
    let mut sections = vec![Section {
        anchor: "means",
        title: "Means over the realisations",
        body: html! { @for f in &figures { (f) } },
    }];
    // A single source has nothing to be compared with.
    if !e.differences.is_empty() {
        let body = difference_table(e);
        sections.push(Section { anchor: "differences", title: "Differences between sources", body });
    }
    sections.push(Section { anchor: "numbers", title: "All means", body: mean_table(e) });
    sections.push(Section { anchor: "points", title: "Points", body: points(e) });
    let lead = "Bars are standard errors of the means; dotted lines are the extreme realisations.";
    document((&e.name, lead), summary(e), &sections, &writer.folder.join(FILE))
}

fn summary(e: &Ensemble) -> Markup {
    let count = |status: PointStatus| e.points.iter().filter(|p| p.status == status).count();
    let largest = e.differences.iter().filter(|d| d.of.quantity == "contact_area" && d.of.branch == Branch::Loading);
    html! {
        @if let Some((d, r)) = largest.clone().filter_map(|d| Some((d, d.relative.as_ref()?))).next_back() {
            p.found { strong { "The contact area of " (d.of.source) " is " (deviation(r)) " from that of " (d.reference) } ", at p* = "
                (significant(d.p_star, 3)) ", mean ± standard error, and extremes." }
        }
        @else if !highest_loads(e).is_empty() {
            p.found {
                @for s in highest_loads(e) {
                    "Contact at p* = " (trimmed(s.p_star, 4)) @if !s.group.is_empty() { ", " (name(&s.group)) } ": "
                    strong { (of_cell(&s.sample)) } " (" (s.of.source) ", " (s.sample.realisations) " realisations, "
                    (extremes(&s.sample)) "). "
                }
                "Mean ± standard error, and extremes."
            }
        }
        p { (count(PointStatus::Done)) " of " (e.points.len()) " points over " (e.keys.join(", ")) " are done, "
            (count(PointStatus::Failed)) " failed." }
        (warnings(e))
        ul {
            @for d in largest {
                @if let Some(r) = &d.relative {
                    li { "Contact area, " (d.of.source) " over " (d.reference) " at p* = " (significant(d.p_star, 3))
                        @if !d.group.is_empty() { " (" (name(&d.group)) ")" } ": " (deviation(r)) "." }
                }
            }
        }
    }
}

/// What the errors do not contain.
fn warnings(e: &Ensemble) -> Markup {
    let list = e.warnings();
    html! {
        @if !list.is_empty() {
            details.warnings open {
                summary { (list.len()) @if list.len() == 1 { " warning" } @else { " warnings" } }
                ul { @for w in &list { li { (with_subscripts(w)) } } }
            }
        }
    }
}

/// The mean contact area at the highest load of loading, one for each source and combination of the varied keys.
fn highest_loads(e: &Ensemble) -> Vec<&Statistic> {
    let mut list: Vec<&Statistic> = Vec::new();
    for s in e.statistics.iter().filter(|s| s.of.quantity == "contact_area" && s.of.branch == Branch::Loading) {
        match list.iter_mut().find(|l| l.group == s.group && l.of.source == s.of.source) {
            Some(known) if s.p_star > known.p_star => *known = s,
            Some(_) => {}
            None => list.push(s),
        }
    }
    list
}

/// `12.1 ± 0.5 % of the cell`.
fn of_cell(s: &Sample) -> String {
    let error =
        s.standard_error.map_or((percent(s.mean), String::new()), |e| with_error(100.0 * s.mean, 100.0 * e, "%"));
    format!("{}{} of the cell", error.0, error.1)
}

/// `11.0 to 13.2 %`.
fn extremes(s: &Sample) -> String {
    format!("{} to {}\u{a0}%", significant(100.0 * s.min, 3), significant(100.0 * s.max, 3))
}

/// `+4.2 ± 0.5 % (12 realisations, −1.0 to +7.3 %)`.
fn deviation(r: &Sample) -> String {
    let signed = |v: f64| format!("{:+.1}", 100.0 * v).replace('-', "−");
    let error = r.standard_error.map_or(String::new(), |e| format!(" ± {:.1}", 100.0 * e));
    let n = r.realisations;
    format!("{}{error} % ({n} realisations, {} to {} %)", signed(r.mean), signed(r.min), signed(r.max))
}

/// End of a caption.
fn of_group(group: &Group) -> String {
    if group.is_empty() { String::new() } else { format!(", {}", name(group)) }
}

fn name(group: &Group) -> String {
    group.iter().map(|(k, v)| format!("{k} = {v}")).collect::<Vec<_>>().join(", ")
}

/// Curves of means on the loading branch with their standard errors, and dotted extremes.
fn curves<'a>(
    samples: impl Iterator<Item = (&'a Observable, String, f64, &'a Sample)>,
    factor: f64,
) -> (Vec<Curve>, Vec<Vec<f64>>) {
    let mut lists: Vec<(String, Vec<(f64, Sample)>)> = Vec::new();
    for (_, label, p_star, sample) in samples.filter(|(of, ..)| of.branch == Branch::Loading) {
        match lists.iter_mut().find(|(l, _)| *l == label) {
            Some((_, list)) => list.push((p_star, *sample)),
            None => lists.push((label, vec![(p_star, *sample)])),
        }
    }
    let (mut curves, mut errors) = (Vec::new(), Vec::new());
    for (i, (label, mut list)) in lists.into_iter().enumerate() {
        list.sort_by(|a, b| a.0.total_cmp(&b.0));
        let style = |dash, marker| Style { colour: COLOURS[i % COLOURS.len()], dash, marker };
        let line = |of: &dyn Fn(&Sample) -> f64| list.iter().map(|(p, s)| (*p, factor * of(s))).collect();
        let marker = Marker::DISTINCT[i % Marker::DISTINCT.len()];
        curves.push(Curve { label, style: style(Dash::Solid, marker), points: line(&|s| s.mean) });
        errors.push(list.iter().map(|(_, s)| factor * s.standard_error.unwrap_or(0.0)).collect());
        errors.extend([Vec::new(), Vec::new()]);
        let extreme = |points| Curve { label: String::new(), style: style(Dash::Dotted, Marker::None), points };
        curves.extend([extreme(line(&|s| s.min)), extreme(line(&|s| s.max))]);
    }
    (curves, errors)
}

fn means(
    writer: &FigureWriter,
    e: &Ensemble,
    (k, group): (usize, &Group),
    (quantity, label, axis): (&str, &str, Axis),
) -> Result<Vec<Markup>> {
    let of = |s: &&Statistic| s.group == *group && s.of.quantity == quantity;
    let mut units: Vec<&str> = Vec::new();
    for s in e.statistics.iter().filter(of) {
        if !units.contains(&s.of.unit.as_str()) {
            units.push(&s.of.unit);
        }
    }
    let mut drawn = Vec::new();
    // Gaps of the laboratory and of the atoms have their own figures.
    for (i, unit) in units.into_iter().enumerate() {
        let list = e.statistics.iter().filter(of).filter(|s| s.of.unit == unit);
        let (all, errors) = curves(list.map(|s| (&s.of, s.of.source.clone(), s.p_star, &s.sample)), 1.0);
        let label = with_unit(label, unit);
        let plot = Plot { errors, ..Plot::new((Axis::Log, axis), ("p*", &label), all) };
        let found = writer.curves(&format!("ensemble-{k}-{quantity}-{i}"), &plot)?;
        drawn.extend(found.map(|c| figure(c, html! { (capitalised(&label)) " against load" (of_group(group)) "." })));
    }
    Ok(drawn)
}

/// Whether a combination has several loads.
fn is_path(e: &Ensemble, group: &Group) -> bool {
    e.statistics.iter().any(|s| s.group == *group && s.of.load > 0)
}

/// A quantity of all combinations in one figure: that of the atoms, where they have it. Values of a varied load belong to one curve.
fn together(
    writer: &FigureWriter,
    e: &Ensemble,
    groups: &[&Group],
    (quantity, label, axis): (&str, &str, Axis),
) -> Result<Option<Markup>> {
    let all = || e.statistics.iter().filter(|s| s.of.quantity == quantity);
    let Some(Observable { source, unit, .. }) = all().find(|s| s.of.source == "atoms").or(all().next()).map(|s| &s.of)
    else {
        return Ok(None);
    };
    let differs = |(key, value): &&(String, Value)| {
        !key.starts_with("load.") && groups.iter().any(|g| g.iter().any(|(k, v)| k == key && v != value))
    };
    let named = |group: &Group| -> String {
        let parts: Vec<String> = group.iter().filter(differs).map(|(k, v)| format!("{k} = {v}")).collect();
        if parts.is_empty() { source.clone() } else { parts.join(", ") }
    };
    let names: BTreeSet<String> = groups.iter().map(|g| named(g)).collect();
    // More curves would share colours.
    if groups.len() < 2 || names.len() > COLOURS.len() {
        return Ok(None);
    }
    let list = all().filter(|s| s.of.source == *source && s.of.unit == *unit);
    let (lines, errors) = curves(list.map(|s| (&s.of, named(&s.group), s.p_star, &s.sample)), 1.0);
    let label = with_unit(label, unit);
    let plot = Plot { errors, ..Plot::new((Axis::Log, axis), ("p*", &label), lines) };
    let caption = html! { (capitalised(&label)) " (" (source) ") against load, all combinations of the varied keys." };
    Ok(writer.curves(&format!("ensemble-{quantity}"), &plot)?.map(|c| figure(c, caption)))
}

/// `mean gap (µm)`.
fn with_unit(label: &str, unit: &str) -> String {
    if unit == "1" { label.to_string() } else { format!("{label} ({})", shown(unit)) }
}

fn differences(writer: &FigureWriter, e: &Ensemble, (k, group): (usize, &Group)) -> Result<Option<Markup>> {
    let of = |d: &&Difference| d.group == *group && d.of.quantity == "contact_area";
    let relative =
        e.differences.iter().filter(of).filter_map(|d| {
            Some((&d.of, format!("{} over {}", d.of.source, d.reference), d.p_star, d.relative.as_ref()?))
        });
    let label = "deviation of the contact area (%)";
    let (all, errors) = curves(relative, 100.0);
    let plot = Plot { errors, ..Plot::new((Axis::Log, Axis::Linear), ("p*", label), all) };
    let caption = html! { "Relative differences of the contact area on the same realisations" (of_group(group)) "." };
    Ok(writer.curves(&format!("ensemble-{k}-differences"), &plot)?.map(|c| figure(c, caption)))
}

fn shown(unit: &str) -> &str {
    match unit {
        "um" => "µm",
        "um2" => "µm²",
        "angstrom" => "Å",
        "J/m2" => "J/m²",
        "MPa/um" => "MPa/µm",
        other => other,
    }
}

/// Group, source, load, quantity.
fn observable(group: &Group, of: &Observable, p_star: f64) -> Vec<Markup> {
    let branch = if of.branch == Branch::Unloading { ", unloading" } else { "" };
    let load = format!("{}{branch}", significant(p_star, 3));
    vec![text(name(group)), text(&of.source), text(load), text(of.quantity.replace('_', " "))]
}

fn mean_table(e: &Ensemble) -> Markup {
    let number = |v: Option<f64>| text(v.map_or("–".into(), |v| significant(v, 3)));
    let row = |s: &Statistic| {
        let unit = if s.of.unit == "1" { "" } else { shown(&s.of.unit) };
        let numbers = vec![
            text(significant(s.sample.mean, 4)),
            number(s.sample.standard_error),
            number(s.sample.standard_deviation),
            text(s.sample.realisations),
            text(unit),
        ];
        [observable(&s.group, &s.of, s.p_star), numbers].concat()
    };
    let head = ["", "source", "p*", "quantity", "mean", "standard error", "standard deviation", "n", "unit"];
    numbers(&head, e.statistics.iter().map(row).collect())
}

fn difference_table(e: &Ensemble) -> Markup {
    let row = |d: &Difference| {
        let relative = d.relative.as_ref().map_or("–".to_string(), deviation);
        let error = d.difference.standard_error.map_or("–".into(), |e| significant(e, 2));
        let numbers = vec![text(&d.reference), text(significant(d.difference.mean, 3)), text(error), text(relative)];
        [observable(&d.group, &d.of, d.p_star), numbers].concat()
    };
    let head =
        ["", "source", "p*", "quantity", "reference", "mean difference", "standard error", "relative difference"];
    numbers(&head, e.differences.iter().map(row).collect())
}

fn points(e: &Ensemble) -> Markup {
    let done = e.points.iter().filter(|p| p.status == PointStatus::Done).count() as f64 / e.points.len().max(1) as f64;
    let row = |p: &crate::record::ensemble::Point| {
        let status = match p.status {
            PointStatus::Done => text("done"),
            PointStatus::Waiting => text("waiting"),
            PointStatus::Failed => html! { span.bad { "failed" } },
        };
        let link = html! { a href={ "points/" (p.label) "/report.html" } { (p.label) } };
        vec![link, status, text(p.reason.as_deref().unwrap_or(""))]
    };
    html! {
        p { (percent(done)) " of the points are done." }
        (table(&["point", "status", "reason"], e.points.iter().map(row).collect()))
    }
}

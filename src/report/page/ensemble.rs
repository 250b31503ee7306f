//! The page of a sweep: means over realisations with their errors, and differences between sources. Without several realisations
//! the means are the numbers of single runs, and are called so.

use serde_json::Value;

use super::document::{PageSection, document};
use super::prelude::*;
use super::summary::warnings;
use crate::record::ensemble::{
    Difference, Ensemble, EnsembleLoad, EnsemblePoint, EnsembleStatistic, FILE, Observable, PointStatus, Sample,
};
use crate::report::number::si_with_error;

const COLOURS: [Rgb; 6] = [BLUE, ORANGE, GREEN, VERMILION, BLACK, PURPLE];

/// A quantity that is drawn: its id, its label and its axis.
type Drawn = (&'static str, &'static str, fn(String) -> AxisScale);

const DRAWN: [Drawn; 3] = [
    ("contact_area", "relative contact area", log),
    ("mean_gap", "mean gap", log),
    ("kappa", "Cohen’s κ with the atoms", linear),
];

/// A combination of the varied keys besides the seed.
type VariedValues = Vec<(String, Value)>;

pub(super) fn page(writer: &FigureWriter, e: &Ensemble) -> Result<Markup> {
    let groups: Vec<&VariedValues> = distinct(e.statistics.iter().map(|s| &s.group));
    let mut figures = vec![writer.figures(DRAWN.into_iter().filter_map(|drawn| together(e, &groups, drawn)))?];
    // A point alone is no curve; those of a varied load are in the figures of all.
    let paths = groups.iter().enumerate().filter(|(_, g)| groups.len() == 1 || is_path(e, g));
    for (k, group) in paths {
        figures.push(html! { @if !group.is_empty() { h3 { (name(group)) } } });
        let drawn = DRAWN.into_iter().flat_map(|drawn| means(e, (k, group), drawn));
        figures.push(writer.figures(drawn.chain([differences(e, (k, group))]))?);
    }
    let mut sections = Vec::new();
    let mut add = |anchor, title, body| sections.push(PageSection { anchor, title, body });
    let several = e.has_realisations();
    let (of_figures, of_table) =
        if several { ("Means over the realisations", "All means") } else { ("Contact and mean gap", "All numbers") };
    add("means", of_figures, each(&figures));
    // A single source has nothing to be compared with.
    if !e.differences.is_empty() {
        add("differences", "Differences between sources", difference_table(e));
    }
    add("numbers", of_table, mean_table(e));
    add("points", "Points", points(e));
    let lead = if several {
        "Bars are standard errors of the means; dotted lines are the extreme realisations."
    } else {
        "One run for each combination of the varied keys."
    };
    document((&e.name, lead), summary(e), &sections, &writer.folder.join(FILE))
}

fn summary(e: &Ensemble) -> Markup {
    let count = |status: PointStatus| e.points.iter().filter(|p| p.status == status).count();
    let largest = e.differences.iter().filter(|d| d.of.quantity == "contact_area" && d.of.branch == Branch::Loading);
    let explained = if e.has_realisations() { "Mean ± standard error, and extremes." } else { "" };
    html! {
        @if let Some((d, r)) = largest.clone().filter_map(|d| Some((d, d.relative.as_ref()?))).next_back() {
            p.found { strong { "The contact area of " (d.of.source) " is " (deviation(r)) " from that of " (d.reference) } " at "
                (at(e, &d.group, &d.of, &d.load)) ". " (explained) }
        }
        @else if !highest_loads(e).is_empty() {
            p.found { @for s in highest_loads(e) { (headline(e, s)) } (explained) }
        }
        p { (count(PointStatus::Done)) " of " (e.points.len()) " points over " (e.keys.join(", ")) " are done, "
            (count(PointStatus::Failed)) " failed." }
        (warnings(&e.warnings()))
        ul {
            @for d in largest {
                @if let Some(r) = &d.relative {
                    li { "Contact area, " (d.of.source) " over " (d.reference) " at " (at(e, &d.group, &d.of, &d.load))
                        @if !d.group.is_empty() { " (" (name(&d.group)) ")" } ": " (deviation(r)) "." }
                }
            }
        }
    }
}

/// What came out at the highest load: the contact, or the pressure where the contact was imposed.
fn headline(e: &Ensemble, s: &EnsembleStatistic) -> Markup {
    let pressure = |p: &&EnsembleStatistic| {
        p.of == Observable { quantity: "pressure".into(), unit: "MPa".into(), ..s.of.clone() } && p.group == s.group
    };
    let imposed = e.imposed(&s.group, &s.of).is_some_and(|i| i.of.quantity == s.of.quantity);
    let pressure = e.statistics.iter().find(pressure).filter(|_| imposed);
    let (what, sample, found) = match pressure {
        Some(p) => {
            ("Pressure", &p.sample, si_with_error(1e6 * p.sample.mean, p.sample.standard_error.map(|e| 1e6 * e), "Pa"))
        }
        None => ("Contact", &s.sample, of_cell(&s.sample)),
    };
    let extremes = if pressure.is_some() {
        let [low, high] = [sample.min, sample.max].map(|p| stress(1e6 * p, 3));
        format!("{low} to {high}")
    } else {
        extremes(sample)
    };
    html! {
        (what) " at " (at(e, &s.group, &s.of, &s.load)) @if !s.group.is_empty() { ", " (name(&s.group)) } ": "
        strong { (found) } " (" (s.of.source)
        @if sample.realisations > 1 { ", " (sample.realisations) " realisations, " (extremes) } "). "
    }
}

/// A load in a sentence: what the scene gave, also where that is no pressure.
fn at(e: &Ensemble, group: &VariedValues, of: &Observable, load: &EnsembleLoad) -> String {
    let Some(imposed) = e.imposed(group, of) else { return label(load) };
    let mean = imposed.sample.mean;
    match imposed.of.quantity.as_str() {
        "contact_area" => format!("a contact of {} of the cell", percent(mean)),
        "mean_gap" => format!("a mean gap of {}", length(1e-6 * mean, 3)),
        _ => format!("a displacement of {}", length(1e-6 * mean, 3)),
    }
}

/// The mean contact area at the highest load of loading, one for each source and combination of the varied keys.
fn highest_loads(e: &Ensemble) -> Vec<&EnsembleStatistic> {
    let mut list: Vec<&EnsembleStatistic> = Vec::new();
    for s in e.statistics.iter().filter(|s| s.of.quantity == "contact_area" && s.of.branch == Branch::Loading) {
        match list.iter_mut().find(|l| l.group == s.group && l.of.source == s.of.source) {
            Some(known) if s.load.p_star > known.load.p_star => *known = s,
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

/// `+4.2 ± 0.5 % (12 realisations, −1.0 to +7.3 %)`, of a single one `+4.2 %`.
fn deviation(r: &Sample) -> String {
    let signed = |v: f64| format!("{:+.1}", 100.0 * v).replace('-', "−");
    let error = r.standard_error.map_or(String::new(), |e| format!(" ± {:.1}", 100.0 * e));
    let n = r.realisations;
    if n == 1 {
        return format!("{} %", signed(r.mean));
    }
    format!("{}{error} % ({n} realisations, {} to {} %)", signed(r.mean), signed(r.min), signed(r.max))
}

/// End of a caption.
fn of_group(group: &VariedValues) -> String {
    if group.is_empty() { String::new() } else { format!(", {}", name(group)) }
}

fn name(group: &VariedValues) -> String {
    group.iter().map(|(k, v)| format!("{k} = {v}")).collect::<Vec<_>>().join(", ")
}

/// Curves of means with their standard errors, and dotted extremes; of both branches.
fn curves<'a>(
    samples: impl Iterator<Item = (&'a Observable, String, EnsembleLoad, &'a Sample)>,
    factor: f64,
) -> Vec<Curve> {
    let mut lists: Vec<(String, Vec<(f64, Sample)>)> = Vec::new();
    for (observable, label, load, sample) in samples {
        let label = if observable.branch == Branch::Unloading { format!("{label}, unloading") } else { label };
        match lists.iter_mut().find(|(l, _)| *l == label) {
            Some((_, list)) => list.push((load.given().1, *sample)),
            None => lists.push((label, vec![(load.given().1, *sample)])),
        }
    }
    let of_list = |(i, (label, mut list)): (usize, (String, Vec<(f64, Sample)>))| {
        list.sort_by(|a, b| a.0.total_cmp(&b.0));
        let style = |dash, marker| Style { colour: COLOURS[i % COLOURS.len()], dash, marker };
        let line = |label: &str, style, observable: fn(&Sample) -> f64| {
            Curve::new(label, style, list.iter().map(|(p, s)| (*p, factor * observable(s))))
        };
        let mut mean = line(&label, style(Dash::Solid, Marker::DISTINCT[i % Marker::DISTINCT.len()]), |s| s.mean);
        mean.errors = list.iter().map(|(_, s)| factor * s.standard_error.unwrap_or(0.0)).collect();
        // Extremes of single realisations would be drawn over the mean.
        let has_extremes = list.iter().any(|(_, s)| s.realisations > 1);
        let dotted = style(Dash::Dotted, Marker::None);
        let extremes = has_extremes.then(|| [line("", dotted, |s| s.min), line("", dotted, |s| s.max)]);
        [mean].into_iter().chain(extremes.into_iter().flatten())
    };
    lists.into_iter().enumerate().flat_map(of_list).collect()
}

fn means(e: &Ensemble, (k, group): (usize, &VariedValues), (quantity, label, axis): Drawn) -> Vec<Figure> {
    let matches = |s: &&EnsembleStatistic| s.group == *group && s.of.quantity == quantity;
    // Gaps of the laboratory and of the atoms have their own figures.
    let units = distinct(e.statistics.iter().filter(matches).map(|s| s.of.unit.as_str()));
    let one = |(i, unit): (usize, &str)| {
        let list = e.statistics.iter().filter(matches).filter(|s| s.of.unit == unit);
        let all = curves(list.map(|s| (&s.of, s.of.source.clone(), s.load, &s.sample)), 1.0);
        let label = in_unit(label, unit);
        let caption = html! { (capitalised(&label)) " against load" (of_group(group)) "." };
        Figure::new(
            format!("ensemble-{k}-{quantity}-{i}"),
            caption,
            Plot::new(log(""), axis(label), all).against_quantity(e.loads()),
        )
    };
    units.into_iter().enumerate().map(one).collect()
}

/// Whether a combination has several loads.
fn is_path(e: &Ensemble, group: &VariedValues) -> bool {
    e.statistics.iter().any(|s| s.group == *group && s.of.load > 0)
}

/// A quantity of all combinations in one figure: that of the atoms, where they have it. Values of a varied load belong to one curve.
fn together(e: &Ensemble, groups: &[&VariedValues], (quantity, label, axis): Drawn) -> Option<Figure> {
    let all = || e.statistics.iter().filter(|s| s.of.quantity == quantity);
    let Observable { source, unit, .. } = &all().find(|s| s.of.source == "atoms").or(all().next())?.of;
    let differs = |(key, value): &&(String, Value)| {
        !key.starts_with("load.") && groups.iter().any(|g| g.iter().any(|(k, v)| k == key && v != value))
    };
    let named = |group: &VariedValues| -> String {
        let parts: Vec<String> = group.iter().filter(differs).map(|(k, v)| format!("{k} = {v}")).collect();
        if parts.is_empty() { source.clone() } else { parts.join(", ") }
    };
    // More curves would share colours.
    if groups.len() < 2 || distinct(groups.iter().map(|g| named(g))).len() > COLOURS.len() {
        return None;
    }
    let list = all().filter(|s| s.of.source == *source && s.of.unit == *unit);
    let lines = curves(list.map(|s| (&s.of, named(&s.group), s.load, &s.sample)), 1.0);
    let label = in_unit(label, unit);
    let caption = html! { (capitalised(&label)) " (" (source) ") against load, all combinations of the varied keys." };
    Some(Figure::new(
        format!("ensemble-{quantity}"),
        caption,
        Plot::new(log(""), axis(label), lines).against_quantity(e.loads()),
    ))
}

/// `mean gap (µm)`.
fn in_unit(label: &str, unit: &str) -> String {
    if unit == "1" { label.to_string() } else { format!("{label} ({})", shown(unit)) }
}

fn differences(e: &Ensemble, (k, group): (usize, &VariedValues)) -> Figure {
    let list = e.differences.iter().filter(|d| d.group == *group && d.of.quantity == "contact_area");
    let relative = list
        .filter_map(|d| Some((&d.of, format!("{} over {}", d.of.source, d.reference), d.load, d.relative.as_ref()?)));
    let plot = Plot::new(log(""), linear("deviation of the contact area (%)"), curves(relative, 100.0))
        .against_quantity(e.loads());
    let same = if e.has_realisations() { " on the same realisations" } else { "" };
    let caption = html! { "Relative differences of the contact area" (same) (of_group(group)) "." };
    Figure::new(format!("ensemble-{k}-differences"), caption, plot)
}

fn shown(unit: &str) -> &str {
    match unit {
        "um" => "µm",
        "um2" => "µm²",
        "angstrom" => "Å",
        "J/m2" => "J/m²",
        "MPa/um" => "MPa/µm",
        other => of_unit(other),
    }
}

/// A load in a sentence.
fn label(load: &EnsembleLoad) -> String {
    let (quantity, value) = load.given();
    quantity.label(value)
}

/// Load and branch.
fn load(of: &Observable, load: &EnsembleLoad) -> String {
    let (quantity, value) = load.given();
    quantity.value(value) + if of.branch == Branch::Unloading { ", unloading" } else { "" }
}

fn mean_table(e: &Ensemble) -> Markup {
    let number = |v: Option<f64>| or_dash(v.map(|v| significant(v, 3)));
    let several = e.has_realisations();
    let scatter = ["mean", "standard error", "standard deviation", "n"];
    let value = if several { &scatter[..] } else { &["value"] };
    let head = [&["", "source", e.loads().head(), "quantity"], value, &["unit"]].concat();
    let row = |s: &EnsembleStatistic| {
        let quantity = s.of.quantity.replace('_', " ");
        let mut row = row![name(&s.group), s.of.source, load(&s.of, &s.load), quantity, significant(s.sample.mean, 4)];
        if several {
            let scattered = |v: Option<f64>| number(v.filter(|_| s.sample.scatters()));
            row.extend([scattered(s.sample.standard_error), scattered(s.sample.standard_deviation)]);
            row.extend(row![s.sample.realisations]);
        }
        row.extend(row![shown(&s.of.unit)]);
        row
    };
    table("numbers", &head, e.statistics.iter().map(row))
}

fn difference_table(e: &Ensemble) -> Markup {
    let several = e.has_realisations();
    let difference = if several { &["mean difference", "standard error"][..] } else { &["difference"] };
    let head =
        [&["", "source", e.loads().head(), "quantity", "reference"], difference, &["relative difference"]].concat();
    let row = |d: &Difference| {
        let (quantity, mean) = (d.of.quantity.replace('_', " "), significant(d.difference.mean, 3));
        let mut row = row![name(&d.group), d.of.source, load(&d.of, &d.load), quantity, d.reference, mean];
        row.extend(several.then(|| or_dash(d.difference.standard_error.map(|e| significant(e, 2)))));
        row.extend([or_dash(d.relative.as_ref().map(deviation))]);
        row
    };
    table("numbers", &head, e.differences.iter().map(row))
}

fn points(e: &Ensemble) -> Markup {
    let fraction_done =
        e.points.iter().filter(|p| p.status == PointStatus::Done).count() as f64 / e.points.len().max(1) as f64;
    let status = |p: &EnsemblePoint| match p.status {
        PointStatus::Done => "done".render(),
        PointStatus::Waiting => "waiting".render(),
        PointStatus::Failed => bad("failed"),
    };
    html! {
        p { (percent(fraction_done)) " of the points are done." }
        (columns!("words", &e.points, |p| {
            "point" => html! { a href={ "points/" (p.label) "/report.html" } { (p.label) } },
            "status" => status(p),
            "reason" => p.reason.as_deref().unwrap_or(""),
        }))
    }
}

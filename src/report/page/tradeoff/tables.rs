//! Tables of the cheapest settings, the references, and all settings.

use super::labels::{accuracy, dash, short, words};
use crate::compare::pareto::cheapest as least;
use crate::record::quantity::Quantity;
use crate::record::tradeoff::{Tradeoff, TradeoffPoint};
use crate::report::number::{count, duration, memory, percent, significant, trimmed};
use crate::report::page::figures::{capitalised, numbers, table, text};
use maud::{Markup, html};

/// Error classes as relative deviations. An order of magnitude is a value ten times too small: for errors in decades,
/// one.
const CLASSES: [(&str, f64); 4] = [("1 %", 0.01), ("5 %", 0.05), ("20 %", 0.2), ("an order of magnitude", 0.9)];

/// Limit of a class for a quantity.
fn limit(quantity: Quantity, share: f64) -> f64 {
    if quantity.in_decades() && share == CLASSES[3].1 { 1.0 } else { quantity.error_of_deviation(share) }
}

/// An error in its usual format.
pub(super) fn shown(quantity: Quantity, error: f64) -> String {
    if quantity.in_decades() { format!("{} dec", significant(error, 2)) } else { percent_of(error) }
}

fn percent_of(error: f64) -> String {
    // A third digit of an error is not significant.
    if error < 1e-6 { percent(error) } else { format!("{}\u{a0}%", significant(100.0 * error, 2)) }
}

/// The cheapest setting of each class.
pub(super) fn cheapest(tradeoff: &Tradeoff) -> Markup {
    let rows = Quantity::COMPARED.into_iter().filter_map(|quantity| {
        let known: Vec<(&TradeoffPoint, f64)> =
            tradeoff.points.iter().filter_map(|p| Some((p, tradeoff.error(p, quantity)?))).collect();
        let points: Vec<(f64, f64)> = known.iter().map(|(p, e)| (p.cost.cpu_seconds, *e)).collect();
        let cell = |(_, share): &(&str, f64)| match least(&points, limit(quantity, *share)) {
            None => dash(),
            Some(i) => {
                let (p, error) = known[i];
                html! {
                    (words(&p.setting)) @if p.calibrated_on.is_some() { "*" } br;
                    span.quiet { (duration(p.cost.cpu_seconds)) ", error " (shown(quantity, error)) }
                }
            }
        };
        (!points.is_empty())
            .then(|| std::iter::once(text(capitalised(quantity.name()))).chain(CLASSES.iter().map(cell)).collect())
    });
    let head: Vec<&str> = std::iter::once("quantity").chain(CLASSES.iter().map(|c| c.0)).collect();
    html! {
        p { "Processor time of all loads. For errors in decades 5 % is a factor of 1.05 and an order of magnitude a factor of "
            "ten; for other errors an order of magnitude is 90 %. *: with fitted constants." }
        (table(&head, rows.collect()))
    }
}

/// Costs up to this factor above the smallest are equal: processor times of repeated runs scatter by as much.
const EQUAL_COST: f64 = 1.25;

/// The cheapest setting for the area, and for the mean gap, within the classes that a setting meets; other methods of equal
/// cost are named.
pub(super) fn conclusion(tradeoff: &Tradeoff) -> Option<Markup> {
    let clauses = [Quantity::ContactArea, Quantity::MeanGap].into_iter().filter_map(|quantity| {
        let known: Vec<(&TradeoffPoint, f64)> =
            tradeoff.points.iter().filter_map(|p| Some((p, tradeoff.error(p, quantity)?))).collect();
        let points: Vec<(f64, f64)> = known.iter().map(|(p, e)| (p.cost.cpu_seconds, *e)).collect();
        // The class that most readers want, else the next that a setting meets.
        let (class, i) = CLASSES[1..].iter().find_map(|c| Some((*c, least(&points, limit(quantity, c.1))?)))?;
        let (p, error) = known[i];
        let mut equal: Vec<&str> = Vec::new();
        for (other, _) in known.iter().filter(|(o, e)| {
            *e <= limit(quantity, class.1) && o.cost.cpu_seconds <= EQUAL_COST * p.cost.cpu_seconds
        }) {
            let method = other.setting.method.as_str();
            if method != p.setting.method && !equal.contains(&method) {
                equal.push(method);
            }
        }
        Some(html! {
            "For the " (quantity.name()) " within " (class.0) ": " strong { (short(&p.setting)) ", " (duration(p.cost.cpu_seconds)) }
            " (error " (shown(quantity, error)) ", " (accuracy(&p.setting))
            @if p.calibrated_on.is_some() { ", with fitted constants" }
            @if !equal.is_empty() { "; as cheap: " (equal.join(", ")) }
            ")."
        })
    });
    let clauses: Vec<Markup> = clauses.collect();
    (!clauses.is_empty()).then(|| html! { @for (k, c) in clauses.iter().enumerate() { @if k > 0 { " " } (c) } })
}

/// The reference solutions, load by load.
pub(super) fn references(tradeoff: &Tradeoff) -> Markup {
    let um = tradeoff.scales.length_m * 1e6;
    html! {
        @for r in &tradeoff.references {
            h3 { (words(&r.setting))
                @if tradeoff.references.len() > 1 { (if r.setting.adhesive { ", with adhesion" } else { ", without adhesion" }) } }
            p { "Processor time " (duration(r.cost.cpu_seconds)) ", wall " (duration(r.cost.wall_seconds)) ", "
                (significant(r.cost.fft_pairs, 3)) " FFT pairs. "
                @if r.coarser.is_empty() { "Without coarser grids its convergence is not known." }
                @else { "Coarser grids: " (r.coarser.iter().map(|n| n.to_string()).collect::<Vec<_>>().join(", "))
                    " points per side. Numbers are extrapolated where three grids show an order, and their uncertainty is the extrapolated "
                    "change; otherwise the number is that of the finest grid, and its uncertainty the last change. The uncertainty of maps and \
                     distributions is the remaining error if errors continue to decrease as on these grids, at most with the second order; \
                     with one coarser grid, with the first." } }
            @let rows = r.loads.iter().map(|l| {
                let cell = |m: Quantity, unit: f64, name: &str| match l.numbers.get(&m) {
                    None => dash(),
                    Some(n) => {
                        let error = n.uncertainty.map_or(" (no error)".to_string(), |u| format!(" ± {}", significant(u * unit, 2)));
                        let order = n.order.map_or(String::new(), |o| format!(", order {}", significant(o, 2)));
                        text(format!("{}{error}{name}{order}", significant(n.value * unit, 5)))
                    }
                };
                vec![
                    text(trimmed(l.p_star, 4)),
                    cell(Quantity::ContactArea, 100.0, "\u{a0}%"),
                    cell(Quantity::MeanGap, um, "\u{a0}µm"),
                    cell(Quantity::Stiffness, 1.0, "\u{a0}E*/L"),
                ]
            });
            (numbers(&["p*", "contact", "mean gap", "stiffness"], rows.collect()))
            @let of = |m: Quantity| r.uncertainty.get(&m).map(|u| format!("{} {}", m.name(), shown(m, *u)));
            p.quiet { "Uncertainty, root mean square over the loads: " (Quantity::COMPARED.into_iter().filter_map(of).collect::<Vec<_>>().join("; ")) "." }
        }
    }
}

/// Cost and errors of blocks of atoms, relative to the scene's reference and to the solution on the heights that they
/// resolve.
pub(super) fn atoms(tradeoff: &Tradeoff) -> Markup {
    let rows = tradeoff.points.iter().filter_map(|p| {
        let (r, c) = (p.resolved.as_ref()?, p.cost.atoms.as_ref()?);
        let mut cells = vec![
            p.setting.block.map_or_else(dash, text),
            text(count(c.atoms as usize)),
            text(count(c.force_evaluations)),
            text(duration(c.lammps_cpu_seconds)),
            text(memory(c.frame_bytes)),
            text(format!("L/{}", significant(1.0 / r.shortest_wavelength, 2))),
            text(significant(r.gradient, 3)),
        ];
        for m in [
            Quantity::ContactArea,
            Quantity::MeanGap,
            Quantity::GapMap,
            Quantity::ContactMap,
            Quantity::MedianClusterArea,
        ] {
            let pair = [&p.errors, &r.errors].map(|e| e.get(&m).map_or("–".into(), |e| shown(m, *e)));
            cells.push(text(pair.join(" | ")));
        }
        Some(cells)
    });
    let head = [
        "block",
        "atoms",
        "force evaluations",
        "LAMMPS",
        "frames",
        "shortest wavelength",
        "rms gradient",
        "area",
        "mean gap",
        "gap map",
        "contact map",
        "median cluster area",
    ];
    html! {
        p { "Cells across and deep, lattice constants. Of each pair of errors the first is against the scene’s reference, the "
            "second against the half-space under the heights that the indenter resolves, which is not extrapolated: what is left "
            "there is the crystal, its finite depth and the contact by distance; what the first has beyond it are the short "
            "waves. At the nodes of the atoms’ maps the solutions are read between their own." }
        (numbers(&head, rows.collect()))
    }
}

/// Every setting with its cost and its errors.
pub(super) fn settings(tradeoff: &Tradeoff) -> Markup {
    let both = tradeoff.references.len() > 1;
    let row = |p: &TradeoffPoint| {
        let (s, c) = (&p.setting, &p.cost);
        let mut cells = vec![
            html! { (s.method) @if p.calibrated_on.is_some() { "*" } @if p.is_reference { " (reference)" }
            @if both { (if s.adhesive { ", adhesion" } else { ", without" }) } },
            s.block.map_or_else(|| text(s.nx), |b| text(format!("{b} cells"))),
            text(format!("{} {}", s.precision, trimmed(s.tolerance, 2))),
            text(duration(c.cpu_seconds)),
            text(format!("{}×", significant(c.cpu_over_reference, 2))),
            text(duration(c.wall_seconds)),
            text(count(c.fft_pairs.round() as usize)),
            text(memory(c.planned_bytes)),
            text(memory(c.measured_bytes)),
        ];
        cells.extend(Quantity::COMPARED.map(|m| p.errors.get(&m).map_or_else(dash, |e| text(shown(m, *e)))));
        cells
    };
    let head = [
        "method",
        "N (N × N grid)",
        "tolerance",
        "CPU",
        "CPU / reference",
        "wall",
        "FFT pairs",
        "planned",
        "measured",
        "area",
        "mean gap",
        "stiffness",
        "gap map",
        "contact map",
        "Pr(u)",
        "Pr(σ)",
        "CPr(a)",
        "median cluster area",
    ];
    let mut reasons: Vec<(String, Vec<&str>)> = Vec::new();
    let mut add = |why: String, method| match reasons.iter_mut().find(|r| r.0 == why) {
        Some((_, methods)) if methods.contains(&method) => {}
        Some((_, methods)) => methods.push(method),
        None => reasons.push((why, vec![method])),
    };
    for p in &tradeoff.points {
        let method = p.setting.method.as_str();
        match &p.unavailable_reason {
            Some(why) => add(why.clone(), method),
            None => p.missing.iter().for_each(|m| {
                let quantity = Quantity::COMPARED.iter().find(|q| q.output().id() == m.quantity);
                if let Some(q) = quantity {
                    add(format!("{}: {}", q.name(), m.reason), method);
                }
            }),
        }
    }
    html! {
        p { "Errors as computed, even below the uncertainty of the reference; those of the reference itself are its uncertainty. "
            "Measured memory is the growth of the resident set." }
        (numbers(&head, tradeoff.points.iter().filter(|p| p.unavailable_reason.is_none()).map(row).collect()))
        @if !reasons.is_empty() {
            h3 { "Not available" }
            ul { @for (why, methods) in &reasons { li { (methods.join(", ")) ": " (why) } } }
        }
    }
}

/// Settings that were not run, and why.
pub(super) fn skipped(tradeoff: &Tradeoff) -> Markup {
    let rows = tradeoff.skipped.iter().map(|l| vec![text(words(&l.setting)), text(&l.reason)]);
    table(&["setting", "reason"], rows.collect())
}

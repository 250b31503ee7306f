//! Tables of the cheapest settings, the references, and all settings.

use super::labels::{accuracy, short, words};
use crate::compare::pareto::cheapest_converged as least;
use crate::record::tradeoff::{Extrapolation, ResolvedErrors, TradeoffPoint, TradeoffResults};
use crate::report::page::prelude::*;

/// Error classes as relative deviations. An order of magnitude is a value ten times too small: for errors in decades,
/// one.
const CLASSES: [(&str, f64); 4] = [("1 %", 0.01), ("5 %", 0.05), ("20 %", 0.2), ("an order of magnitude", 0.9)];

/// Limit of a class for a quantity.
fn limit(quantity: Quantity, fraction: f64) -> f64 {
    if quantity.in_decades() && fraction == CLASSES[3].1 { 1.0 } else { quantity.error_of_deviation(fraction) }
}

/// An error in its usual format.
fn shown(quantity: Quantity, error: f64) -> String {
    match error {
        e if quantity.in_decades() => format!("{} dec", significant(e, 2)),
        e if e < 1e-6 => percent(e),
        // A third digit of an error is not significant.
        e => with_unit(100.0 * e, 2, "%"),
    }
}

/// Settings with a known error of a quantity, and their costs and errors.
fn known(tradeoff: &TradeoffResults, quantity: Quantity) -> (Vec<&TradeoffPoint>, Vec<(f64, f64)>) {
    let all = tradeoff.points.iter().filter_map(|p| Some((p, (p.cost.cpu_seconds, tradeoff.error(p, quantity)?))));
    all.unzip()
}

/// The index of the cheapest setting whose error is within a limit, on the finer grids of the same method, too.
fn cheapest_within(settings: &[&TradeoffPoint], points: &[(f64, f64)], limit: f64) -> Option<usize> {
    let is_finer = |i: usize, j: usize| {
        let (finer, s) = (&settings[i].setting, &settings[j].setting);
        let same = (&finer.method, &finer.precision) == (&s.method, &s.precision) && finer.adhesive == s.adhesive;
        same && finer.block == s.block && finer.tolerance == s.tolerance && finer.nx > s.nx
    };
    least(points, is_finer, limit)
}

/// The cheapest setting of each class.
pub(super) fn cheapest(tradeoff: &TradeoffResults) -> Markup {
    let rows = Quantity::COMPARED.into_iter().filter_map(|quantity| {
        let (settings, points) = known(tradeoff, quantity);
        let setting = |i: usize| {
            let (p, (seconds, error)) = (settings[i], points[i]);
            html! {
                (words(&p.setting)) @if p.calibrated_on.is_some() { "*" } br;
                (quiet(format!("{}, error {}", duration(seconds), shown(quantity, error))))
            }
        };
        let cells = CLASSES
            .map(|(_, fraction)| or_dash(cheapest_within(&settings, &points, limit(quantity, fraction)).map(setting)));
        let row = row![capitalised(quantity.name())].into_iter().chain(cells).collect();
        (!points.is_empty()).then_some(row)
    });
    let head: Vec<&str> = std::iter::once("quantity").chain(CLASSES.iter().map(|c| c.0)).collect();
    html! {
        p { "Processor time of all loads, of settings whose error stays within the class on the finer grids, too. For errors in decades 5 % is a factor of 1.05 and an order of magnitude a factor of "
            "ten; for other errors an order of magnitude is 90 %. *: with fitted constants." }
        (table("words", &head, rows))
    }
}

/// Costs up to this factor above the smallest are equal: processor times of repeated runs scatter by as much.
const EQUAL_COST: f64 = 1.25;

/// The cheapest setting for the area, and for the mean gap, within the classes that a setting meets; other methods of equal
/// cost are named.
pub(super) fn conclusion(tradeoff: &TradeoffResults) -> Option<Markup> {
    let clauses = [Quantity::ContactArea, Quantity::MeanGap].into_iter().filter_map(|quantity| {
        let (settings, points) = known(tradeoff, quantity);
        // The class that most readers want, else the next that a setting meets.
        let (class, i) = CLASSES[1..].iter().find_map(|c| Some((*c, cheapest_within(&settings, &points, limit(quantity, c.1))?)))?;
        let (p, (cost, error)) = (settings[i], points[i]);
        let close = |(seconds, error): &(f64, f64)| *error <= limit(quantity, class.1) && *seconds <= EQUAL_COST * cost;
        let close = settings.iter().zip(&points).filter(|(_, point)| close(point)).map(|(o, _)| o.setting.method.as_str());
        let equal = distinct(close.filter(|method| *method != p.setting.method));
        Some(html! {
            "For the " (quantity.name()) " within " (class.0) ": " strong { (short(&p.setting)) ", " (duration(p.cost.cpu_seconds)) }
            " (error " (shown(quantity, error)) ", " (accuracy(&p.setting))
            @if p.calibrated_on.is_some() { ", with fitted constants" }
            @if !equal.is_empty() { "; as cheap: " (equal.join(", ")) }
            ")."
        })
    });
    let clauses: Vec<Markup> = clauses.collect();
    let joined = clauses.into_iter().map(Markup::into_string).collect::<Vec<_>>().join(" ");
    (!joined.is_empty()).then_some(PreEscaped(joined))
}

/// The reference solutions, load by load.
pub(super) fn references(tradeoff: &TradeoffResults) -> Markup {
    let unit = tradeoff.scales.stiffness();
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
            (columns!("numbers", &r.loads, |l| {
                tradeoff.loads.head() => tradeoff.loads.value(l.p_star),
                "contact" => or_dash(l.numbers.get(&Quantity::ContactArea).map(|n| number(n, 100.0, "\u{a0}%"))),
                "mean gap" => or_dash(l.numbers.get(&Quantity::MeanGap).map(|n| number(n, 1e6, "\u{a0}µm"))),
                "stiffness" => or_dash(l.numbers.get(&Quantity::Stiffness).map(|n| number(n, 1.0 / unit, "\u{a0}E*/L"))),
            }))
            @let uncertainty_of = |m: Quantity| r.uncertainty.get(&m).map(|u| format!("{} {}", m.name(), shown(m, *u)));
            p.quiet { "Uncertainty, root mean square over the loads: " (Quantity::COMPARED.into_iter().filter_map(uncertainty_of).collect::<Vec<_>>().join("; ")) "." }
        }
    }
}

/// A number of the reference with its error and order.
fn number(n: &Extrapolation, unit: f64, name: &str) -> String {
    let error = n.uncertainty.map_or(" (no error)".to_string(), |u| format!(" ± {}", significant(u * unit, 2)));
    let order = n.order.map_or(String::new(), |o| format!(", order {}", significant(o, 2)));
    format!("{}{error}{name}{order}", significant(n.value * unit, 5))
}

/// Cost and errors of blocks of atoms, relative to the scene's reference and to the solution on the heights that they
/// resolve.
pub(super) fn atoms(tradeoff: &TradeoffResults) -> Markup {
    let blocks = tradeoff.points.iter().filter_map(|p| Some((p, p.resolved.as_ref()?, p.cost.atoms.as_ref()?)));
    let pair = |p: &TradeoffPoint, r: &ResolvedErrors, m: Quantity| {
        [&p.errors, &r.errors].map(|e| e.get(&m).map_or("–".into(), |e| shown(m, *e))).join(" | ")
    };
    html! {
        p { "Cells across and deep, lattice constants. Of each pair of errors the first is against the scene’s reference, the "
            "second against the half-space under the heights that the indenter resolves, which is not extrapolated: what is left "
            "there is the crystal, its finite depth and the contact by distance; what the first has beyond it are the short "
            "waves. At the nodes of the atoms’ maps the solutions are read between their own." }
        (columns!("numbers", blocks, |(p, r, c)| {
            "block" => or_dash(p.setting.block.map(|b| b.to_string())),
            "atoms" => count(c.atoms as usize),
            "force evaluations" => count(c.force_evaluations),
            "LAMMPS" => duration(c.lammps_cpu_seconds),
            "frames" => memory(c.frame_bytes),
            "shortest wavelength" => format!("L/{}", significant(1.0 / r.shortest_wavelength, 2)),
            "rms gradient" => significant(r.gradient, 3),
            "area" => pair(p, r, Quantity::ContactArea),
            "mean gap" => pair(p, r, Quantity::MeanGap),
            "gap map" => pair(p, r, Quantity::GapMap),
            "contact map" => pair(p, r, Quantity::ContactMap),
            "median cluster area" => pair(p, r, Quantity::MedianClusterArea),
        }))
    }
}

/// Every setting with its cost and its errors.
pub(super) fn settings(tradeoff: &TradeoffResults) -> Markup {
    let several_references = tradeoff.references.len() > 1;
    let error = |p: &TradeoffPoint, m: Quantity| or_dash(p.errors.get(&m).map(|e| shown(m, *e)));
    let solved = tradeoff.points.iter().filter(|p| p.unavailable_reason.is_none());
    let mut reasons: Vec<(String, Vec<&str>)> = Vec::new();
    for p in &tradeoff.points {
        let missing = p.missing.iter().map(|(q, reason)| format!("{}: {reason}", q.name()));
        let reason = p.unavailable_reason.clone().map_or_else(|| missing.collect(), |reason| vec![reason]);
        for reason in reason {
            match reasons.iter_mut().find(|r| r.0 == reason) {
                Some((_, methods)) => methods.push(&p.setting.method),
                None => reasons.push((reason, vec![&p.setting.method])),
            }
        }
    }
    html! {
        p { "Errors as computed, even below the uncertainty of the reference; those of the reference itself are its uncertainty. "
            "Measured memory is the growth of the resident set." }
        (columns!("numbers", solved.map(|p| (p, &p.setting, &p.cost)), |(p, s, c)| {
            "method" => html! { (s.method) @if p.calibrated_on.is_some() { "*" } @if p.is_reference { " (reference)" }
                @if several_references { (if s.adhesive { ", adhesion" } else { ", without" }) } },
            "N (N × N grid)" => s.block.map_or_else(|| s.nx.to_string(), |b| format!("{b} cells")),
            "tolerance" => format!("{} {}", s.precision, trimmed(s.tolerance, 2)),
            "CPU" => duration(c.cpu_seconds),
            "CPU / reference" => format!("{}×", significant(c.cpu_over_reference, 2)),
            "wall" => duration(c.wall_seconds),
            "FFT pairs" => count(c.fft_pairs.round() as usize),
            "planned" => memory(c.planned_bytes),
            "measured" => memory(c.measured_bytes),
            "area" => error(p, Quantity::ContactArea),
            "mean gap" => error(p, Quantity::MeanGap),
            "stiffness" => error(p, Quantity::Stiffness),
            "gap map" => error(p, Quantity::GapMap),
            "contact map" => error(p, Quantity::ContactMap),
            "Pr(u)" => error(p, Quantity::GapPdf),
            "Pr(σ)" => error(p, Quantity::StressPdf),
            "CPr(a)" => error(p, Quantity::ClusterArea),
            "median cluster area" => error(p, Quantity::MedianClusterArea),
        }))
        @if !reasons.is_empty() {
            h3 { "Not available" }
            ul { @for (reason, methods) in reasons { li { (distinct(methods).join(", ")) ": " (reason) } } }
        }
    }
}

/// Settings that were not run, and why.
pub(super) fn skipped(tradeoff: &TradeoffResults) -> Markup {
    columns!("words", &tradeoff.skipped, |l| { "setting" => words(&l.setting), "reason" => l.reason })
}

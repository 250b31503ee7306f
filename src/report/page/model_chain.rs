//! Stepwise comparison from the full heights to the atoms.

use maud::{Markup, html};

use super::figures::{FigureWriter, figure, numbers, panel, panels, text};
use crate::error::Result;
use crate::record::results::{ComparisonResults, LoadComparison, ModelChainStep};
use crate::report::number::{count, percent, significant, trimmed};
use crate::report::plot::{ATOMS, Axis, Curve, HARD, LABORATORY, PANEL, Plot, SOFT, Style, THRESHOLD, YIELDING};

/// Style and name of a step.
fn look(id: &str) -> (Style, &'static str) {
    match id {
        "full_heights" => (LABORATORY, "full heights, zero gap"),
        "hard_wall" => (HARD, "atoms’ heights, zero gap"),
        "offset_wall" => (THRESHOLD, "atoms’ heights, offset wall"),
        "compliant_wall" => (SOFT, "atoms’ heights, compliant wall"),
        "yielding_wall" => (YIELDING, "atoms’ heights, compliant wall with hardness"),
        _ => (ATOMS, "atoms"),
    }
}

/// Table and figures of the model chain; empty if the scene does not request distributions.
pub(super) fn section(writer: &FigureWriter, c: &ComparisonResults) -> Result<Markup> {
    let loads: Vec<&LoadComparison> = c.loads.iter().filter(|l| !l.model_chain.is_empty()).collect();
    if loads.is_empty() {
        return Ok(html! {});
    }
    let along = |of: &dyn Fn(&ModelChainStep) -> f64| -> Vec<Curve> {
        let versions = loads.iter().flat_map(|l| &l.model_chain);
        let mut ids: Vec<&str> = Vec::new();
        versions.for_each(|v| {
            if !ids.contains(&v.id.as_str()) {
                ids.push(&v.id)
            }
        });
        let points = |id: &str| -> Vec<(f64, f64)> {
            loads.iter().filter_map(|l| Some((l.p_star, of(l.model_chain.iter().find(|v| v.id == id)?)))).collect()
        };
        let curve = |id: &&str| Curve { label: look(id).1.into(), style: look(id).0, points: points(id) };
        ids.iter().map(curve).collect()
    };
    let area = Plot {
        include: vec![(0.0, 0.0)],
        ..Plot::new((Axis::Linear, Axis::Linear), ("p*", "contact (%)"), along(&|v| 100.0 * v.contact_area))
    };
    let gap = Plot::new((Axis::Log, Axis::Linear), ("p*", "mean gap (Å)"), along(&|v| v.mean_gap_angstrom));
    let mut figures = Vec::new();
    for (name, plot, caption) in [
        ("model-chain-area", area, "Contact fraction of each step at the block’s surface sites."),
        ("model-chain-gap", gap, "Mean gap of each step; the contact criterion does not change it."),
    ] {
        figures.extend(writer.curves(name, &plot)?.map(|svg| figure(svg, html! { (caption) })));
    }
    let mut each = Vec::new();
    for (i, load) in loads.iter().enumerate() {
        each.push(one_load(writer, load, i + 1)?);
    }
    Ok(html! {
        h3 { "Stepwise comparison" }
        p { "The same load and elastic layer, changed one step at a time: the heights of the scene’s grid; the heights that "
            "atoms resolve; on these, the atoms’ contact criterion; the atoms’ repulsion law in place of the hard wall; the atoms. All "
            "are evaluated at the block’s surface sites, and all stresses are smoothed by the Gaussian that turns the atoms’ "
            "forces into a field." }
        (table(&loads))
        @for f in &figures { (f) }
        @for e in &each { (e) }
    })
}

fn table(loads: &[&LoadComparison]) -> Markup {
    let mut rows = Vec::new();
    for load in loads {
        for (k, v) in load.model_chain.iter().enumerate() {
            rows.push(vec![
                text(if k == 0 { trimmed(load.p_star, 4) } else { String::new() }),
                html! { strong { (look(&v.id).1) } },
                text(percent(v.contact_area)),
                text(format!("{}\u{a0}Å", significant(v.mean_gap_angstrom, 4))),
                text(v.contact_stress_gpa.map_or("–".into(), |s| format!("{}\u{a0}GPa", significant(s, 3)))),
                text(count(v.patches)),
                text(v.median_cluster_area_nm2.map_or("–".into(), |a| format!("{}\u{a0}nm²", significant(a, 3)))),
            ]);
        }
    }
    let head = ["p*", "step", "contact", "mean gap", "contact stress", "clusters", "median cluster area"];
    html! {
        (numbers(&head, rows))
        p.quiet { "Median cluster area (area-weighted): half of the contact is in clusters up to this area." }
    }
}

/// Distributions of gap, stress and cluster area at one load.
fn one_load(writer: &FigureWriter, load: &LoadComparison, number: usize) -> Result<Markup> {
    let curves = |of: &dyn Fn(&ModelChainStep) -> Vec<(f64, f64)>, left_out: &str| -> Vec<Curve> {
        let shown = load.model_chain.iter().filter(|v| v.id != left_out);
        let curve = |v: &ModelChainStep| Curve {
            label: look(&v.id).1.into(),
            style: look(&v.id).0.without_marker(),
            points: of(v),
        };
        shown.map(curve).collect()
    };
    let log = (Axis::Linear, Axis::Log);
    let gaps = Plot::new(log, ("gap (Å)", "density (1/Å)"), curves(&|v| v.gap.density(), ""));
    // The offset wall has the stresses of the hard wall.
    let stress = Plot::new(log, ("stress (GPa)", "density (1/GPa)"), curves(&|v| v.stress.density(), "offset_wall"));
    let clusters = Plot::new(
        (Axis::Log, Axis::Linear),
        ("area of a cluster (nm²)", "fraction of the contact"),
        curves(&|v| v.patch_area.iter().map(|[a, share]| (*a, *share)).collect(), ""),
    );
    let mut drawn = Vec::new();
    for (title, name, plot) in [
        ("Gap", "model-chain-gaps", gaps),
        ("Normal stress", "model-chain-stress", stress),
        ("Cumulative cluster areas", "model-chain-clusters", clusters),
    ] {
        let plot = Plot { width: PANEL, proportion: 0.8, ..plot };
        drawn.extend(writer.curves(&format!("{name}-{number}"), &plot)?.map(|svg| panel(title, svg, html! {})));
    }
    Ok(figure(
        panels(drawn.len(), &drawn),
        html! { "Distributions at p* = " (trimmed(load.p_star, 4)) ": gap outside the contact, smoothed stress over the "
        "whole cell, and fraction of the contact in clusters up to an area." },
    ))
}

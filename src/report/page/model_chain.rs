//! Stepwise comparison from the full heights to the atoms.

use super::method_style::model_style;
use super::paper::cumulative;
use super::prelude::*;

fn name(id: &str) -> &'static str {
    match id {
        "full_heights" => "full heights, zero gap",
        "hard_wall" => "atoms’ heights, zero gap",
        "offset_wall" => "atoms’ heights, offset wall",
        "compliant_wall" => "atoms’ heights, compliant wall",
        "yielding_wall" => "atoms’ heights, compliant wall with hardness",
        _ => "atoms",
    }
}

/// Table and figures of the model chain; empty if the scene does not request distributions.
pub(super) fn section(writer: &FigureWriter, c: &ComparisonResults) -> Result<Markup> {
    let loads: Vec<&LoadComparison> = c.loads.iter().filter(|l| !l.model_chain.is_empty()).collect();
    if loads.is_empty() {
        return Ok(html! {});
    }
    let steps = || loads.iter().flat_map(|l| l.model_chain.iter().map(|v| (l.p_star, v)));
    let load_curves = |value: &dyn Fn(&ModelChainStep) -> f64| -> Vec<Curve> {
        let points = |id: &String| steps().filter(|(_, v)| v.id == *id).map(|(p, v)| (p, value(v))).collect::<Vec<_>>();
        let ids = distinct(steps().map(|(_, v)| &v.id)).into_iter();
        ids.map(|id| Curve::new(name(id), model_style(id), points(id))).collect()
    };
    let area = Plot::new(linear(""), linear("contact (%)"), load_curves(&|v| 100.0 * v.contact_area));
    let area = Plot { include: vec![(0.0, 0.0)], ..area }.against(writer.loads);
    let gap = Plot::new(log(""), linear("mean gap (Å)"), load_curves(&|v| v.mean_gap_angstrom)).against(writer.loads);
    let figures = [
        Figure::new("model-chain-area", "Contact fraction of each step at the block’s surface sites.", area),
        Figure::new("model-chain-gap", "Mean gap of each step; the contact criterion does not change it.", gap),
    ];
    let numbers = loads.iter().flat_map(|l| l.model_chain.iter().enumerate().map(move |(k, v)| (l, k, v)));
    let figures = writer.figures(figures)?;
    let of_loads =
        loads.iter().enumerate().map(|(i, load)| one_load(writer, load, i + 1)).collect::<Result<Vec<_>>>()?;
    Ok(html! {
        h3 { "Stepwise comparison" }
        p { "The same load and elastic layer, changed one step at a time: the heights of the scene’s grid; the heights that "
            "atoms resolve; on these, the atoms’ contact criterion; the atoms’ repulsion law in place of the hard wall; the atoms. All "
            "are evaluated at the block’s surface sites, and all stresses are smoothed by the Gaussian that turns the atoms’ "
            "forces into a field." }
        (columns!("numbers", numbers, |(load, k, v)| {
            writer.loads.head() => if k == 0 { writer.loads.value(load.p_star) } else { String::new() },
            "step" => html! { strong { (name(&v.id)) } },
            "contact" => percent(v.contact_area),
            "mean gap" => with_unit(v.mean_gap_angstrom, 4, "Å"),
            "contact stress" => or_dash(v.contact_stress_gpa.map(|s| with_unit(s, 3, "GPa"))),
            "clusters" => count(v.clusters),
            "median cluster area" => or_dash(v.median_cluster_area_nm2.map(|a| with_unit(a, 3, "nm²"))),
        }))
        p.quiet { "Median cluster area (area-weighted): half of the contact is in clusters up to this area." }
        (figures)
        (each(&of_loads))
    })
}

/// Distributions of gap, stress and cluster area at one load.
fn one_load(writer: &FigureWriter, load: &LoadComparison, number: usize) -> Result<Markup> {
    let curves = |value: &dyn Fn(&ModelChainStep) -> Vec<(f64, f64)>, left_out: &str| -> Vec<Curve> {
        let shown = load.model_chain.iter().filter(|v| v.id != left_out);
        shown.map(|v| Curve::line(name(&v.id), model_style(&v.id), value(v))).collect()
    };
    let gaps = curves(&|v| v.gap.density(), "");
    // The offset wall has the stresses of the hard wall.
    let stresses = curves(&|v| v.stress.density(), "offset_wall");
    let clusters = curves(&|v| cumulative(&v.cluster_area, 1.0), "");
    let clusters = Plot::new(log("area of a cluster (nm²)"), linear("fraction of the contact"), clusters);
    let name = |start: &str| format!("model-chain-{start}-{number}");
    let figures = writer.small([
        ("Gap", name("gaps"), Plot::new(linear("gap (Å)"), log("density (1/Å)"), gaps)),
        ("Normal stress", name("stress"), Plot::new(linear("stress (GPa)"), log("density (1/GPa)"), stresses)),
        ("Cumulative cluster areas", name("clusters"), clusters),
    ])?;
    Ok(figure(
        panels(figures.len(), &figures),
        html! { "Distributions at " (writer.loads.label(load.p_star)) ": gap outside the contact, smoothed stress over the "
        "whole cell, and fraction of the contact in clusters up to an area." },
    ))
}

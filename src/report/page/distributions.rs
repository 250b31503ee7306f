//! Distributions of gap, stress and cluster area, and derived quantities.

use super::loads::load;
use super::prelude::*;
use crate::challenge::SIZE_EXPONENT;
use crate::report::number::stiffness;

/// Styles of the loads drawn, first to last. Both colour and dash pattern identify a load.
pub(super) const LOOKS: [Style; 4] = [
    Style { marker: Marker::None, ..ATOMS },
    Style { marker: Marker::None, ..WITHOUT },
    Style { marker: Marker::None, ..HARD },
    Style { dash: Dash::Solid, marker: Marker::None, ..LABORATORY },
];

pub(super) fn section(writer: &FigureWriter, c: &ContinuumResults) -> Result<Markup> {
    let loading = c.states.iter().filter(|s| s.branch == Branch::Loading);
    let all: Vec<(&StateResults, &Observed)> = loading.filter_map(|s| Some((s, s.observed.as_ref()?))).collect();
    if all.is_empty() {
        return Ok(html! {});
    }
    let um = writer.scales.um();
    let modulus_pa = writer.scales.modulus_pa;
    let largest = all.iter().filter_map(|(_, o)| o.stress.edges.last()).fold(0.0, |upper: f64, edge| upper.max(*edge));
    let (unit_pa, prefix) = si_scale(largest * modulus_pa);
    let curves = |points: &dyn Fn(&Observed) -> Vec<(f64, f64)>| -> Vec<Curve> {
        let shown = LOOKS.into_iter().zip(spread(all.len(), LOOKS.len()));
        shown.map(|(look, i)| Curve::new(load_label(all[i].0.numbers.p_star), look, points(all[i].1))).collect()
    };
    let mut sizes = curves(&|o| o.patch_density.iter().map(|[a, d, _]| (a * um * um, d / (um * um))).collect());
    for (curve, i) in sizes.iter_mut().zip(spread(all.len(), LOOKS.len())) {
        // Counting errors: d/√n of n clusters.
        let error = |[_, d, n]: &[f64; 3]| d / (um * um) / n.max(1.0).sqrt();
        curve.errors = all[i].1.patch_density.iter().map(error).collect();
    }
    sizes.extend(slope(&sizes));
    let stress = (format!("stress ({prefix}Pa), compression positive"), format!("probability density (1/{prefix}Pa)"));
    let figures = [
        Figure::new(
            "gap-distribution",
            "Distribution of the gap outside the contact.",
            Plot::new(
                log("gap (µm)"),
                log("probability density (1/µm)"),
                curves(&|o| o.gap_logarithmic.density_in(um)),
            ),
        ),
        Figure::new(
            "stress-distribution",
            "Distribution of the normal stress. Without adhesion, nodes out of contact have zero stress and are not shown; with \
             adhesion they are under tension.",
            Plot::new(linear(stress.0), log(stress.1), curves(&|o| o.stress.density_in(modulus_pa / unit_pa))),
        ),
        Figure::new(
            "cluster-sizes",
            "Density of contact clusters by area; bars are counting errors, 1/√n of n clusters.",
            Plot::new(log("area of a cluster (µm²)"), log("density of clusters (1/µm²)"), sizes),
        ),
        Figure::new(
            "cluster-area",
            "Fraction of the contact in clusters up to an area; the median cluster area is at one half.",
            Plot::new(
                log("area of a cluster (µm²)"),
                linear("cumulative fraction of the contact"),
                curves(&|o| o.patch_area.iter().map(|[a, fraction]| (a * um * um, *fraction)).collect()),
            ),
        ),
    ];
    Ok(html! {
        (numbers(writer, &all))
        @if let Some([open, sealed]) = c.percolation {
            p { "The gap percolates along both axes up to p* = " (trimmed(open, 4)) " and not from p* = "
                (trimmed(sealed, 4)) " on: the percolation load, at which leakage along at least one axis ends, is between them. The effective medium, which seals "
                "at half contact, does not describe this." }
        }
        (writer.figures(figures)?)
    })
}

/// Line with the exponent of the challenge, above the distribution of the last load.
fn slope(curves: &[Curve]) -> Option<Curve> {
    let points = &curves.last()?.points;
    let (first, last) = (points.first()?, points.last()?);
    let value_at = |a: f64| (a, 3.0 * first.1 * (a / first.0).powf(SIZE_EXPONENT));
    (last.0 > first.0)
        .then(|| Curve::new("slope −1.45 (Müser et al. 2017)", EXPECTED, [value_at(first.0), value_at(last.0)]))
}

fn numbers(writer: &FigureWriter, all: &[(&StateResults, &Observed)]) -> Markup {
    let (scales, length) = (writer.scales, writer.scales.length_m);
    let axes = |[x, y]: [bool; 2]| match (x, y) {
        (true, true) => "along x and y",
        (true, false) => "along x",
        (false, true) => "along y",
        _ => "no",
    };
    let area = |a: f64| with_unit(a * length * length * 1e12, 3, "µm²");
    html! {
        (columns!("numbers", all, |(s, o)| {
            "p*" => load(s),
            "mean contact pressure" => or_dash(o.mean_contact_pressure.map(|p| scales.stress(p, 3))),
            "median cluster area" => or_dash(o.median_cluster_area.map(area)),
            "contact stiffness" => or_dash(s.numbers.stiffness.map(|k| stiffness(k * scales.modulus_pa / length, length, 3))),
            "constriction conductance" => significant(o.constriction_conductance, 3),
            "conductance from stiffness" => or_dash(s.numbers.stiffness.map(|k| significant(k, 3))),
            "equivalent hydraulic gap" =>
                if o.hydraulic_gap > 0.0 { scales.length(o.hydraulic_gap, 3) } else { "sealed".into() },
            "contact percolates" => axes(o.contact_percolates),
            "gap percolates" => axes(o.gap_percolates),
            "contact" => percent(o.gap.delta),
        }))
        p.quiet { "Median cluster area (area-weighted): half of the contact is in clusters up to this area. Contact stiffness: derivative of "
            "the mean pressure by the approach, without change of the contact. Constriction conductance: clusters as independent circular "
            "spots; conductance from stiffness: with their interaction; both relative to a cube of the cell's extent. Equivalent "
            "hydraulic gap: uniform gap with the same flow, by the effective medium, which seals at half contact. Percolates: connects "
            "around the periodic cell, contact by edges and corners, gap by edges." }
    }
}

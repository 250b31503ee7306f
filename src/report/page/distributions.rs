//! Distributions of gap, stress and cluster area, and derived quantities.

use super::paper::{cumulative, density};
use super::prelude::*;
use crate::challenge::SIZE_EXPONENT;
use crate::report::number::stiffness;

/// Styles of the loads drawn, first to last. Both colour and dash pattern identify a load.
pub(super) const LOOKS: [Style; 6] = [
    Style { marker: Marker::None, ..ATOMS },
    Style { marker: Marker::None, ..WITHOUT },
    Style { marker: Marker::None, ..HARD },
    Style { colour: GREEN, dash: Dash::Solid, marker: Marker::None },
    Style { colour: PURPLE, dash: Dash::Dashed, marker: Marker::None },
    Style { dash: Dash::Solid, marker: Marker::None, ..LABORATORY },
];

/// `is_challenge`: whether the line of the challenge is drawn for comparison.
pub(super) fn section(writer: &FigureWriter, c: &ContinuumResults, is_challenge: bool) -> Result<Markup> {
    let loading = c.states.iter().filter(|s| s.branch == Branch::Loading);
    let all: Vec<(&State, &Observed)> = loading.filter_map(|s| Some((s, s.observed.as_ref()?))).collect();
    if all.is_empty() {
        return Ok(html! {});
    }
    let um2 = UM * UM;
    let largest =
        all.iter().filter_map(|(_, o)| o.stress.as_ref()?.edges.last()).fold(0.0, |upper: f64, edge| upper.max(*edge));
    let (unit_pa, prefix) = si_scale(largest);
    let curves = |points: &dyn Fn(&Observed) -> Vec<(f64, f64)>| -> Vec<Curve> {
        let shown = LOOKS.into_iter().zip(spread(all.len(), LOOKS.len()));
        shown.map(|(look, i)| Curve::new(writer.loads.label(all[i].0.p_star), look, points(all[i].1))).collect()
    };
    let mut sizes = curves(&|o| interrupted(&o.cluster_density).iter().map(|[a, d, _]| (a * um2, d / um2)).collect());
    for (curve, i) in sizes.iter_mut().zip(spread(all.len(), LOOKS.len())) {
        // Counting errors: d/√n of n clusters. That of a single one is the value: its bar would reach the axis.
        let error = |[_, d, n]: &[f64; 3]| if *n > 1.0 { d / um2 / n.sqrt() } else { f64::NAN };
        curve.errors = interrupted(&all[i].1.cluster_density).iter().map(error).collect();
    }
    sizes.extend(slope(&sizes).filter(|_| is_challenge));
    let stress = (format!("stress ({prefix}Pa), compression positive"), format!("probability density (1/{prefix}Pa)"));
    let figures = [
        Figure::new(
            "gap-distribution",
            "Distribution of the gap outside the contact.",
            Plot::new(
                log("gap (µm)"),
                log("probability density (1/µm)"),
                curves(&|o| density(o.gap_logarithmic.as_ref(), UM)),
            ),
        ),
        Figure::new(
            "stress-distribution",
            "Distribution of the normal stress. Without adhesion, nodes out of contact have zero stress and are not shown; with \
             adhesion they are under tension.",
            Plot::new(linear(stress.0), log(stress.1), curves(&|o| density(o.stress.as_ref(), 1.0 / unit_pa))),
        ),
        Figure::new(
            "cluster-sizes",
            "Density of contact clusters by area; bars are counting errors, 1/√n of n > 1 clusters. Lines are interrupted where no cluster has the area.",
            Plot::new(log("area of a cluster (µm²)"), log("density of clusters (1/µm²)"), sizes),
        ),
        Figure::new(
            "cluster-area",
            "Fraction of the contact in clusters up to an area; the median cluster area is at one half.",
            Plot::new(
                log("area of a cluster (µm²)"),
                linear("cumulative fraction of the contact"),
                curves(&|o| cumulative(&o.cluster_area, um2)),
            ),
        ),
    ];
    Ok(html! {
        (numbers(writer, &all))
        @if let Some([open, sealed]) = c.percolation {
            p { "The gap percolates along both axes up to " (writer.loads.label(open)) " and not from "
                (writer.loads.label(sealed)) " on: the percolation load, at which leakage along at least one axis ends, is between them. The effective medium, which seals "
                "at half contact, does not describe this." }
        }
        (writer.figures(figures)?)
        @if all.len() > LOOKS.len() { p.quiet { "The figures show " (LOOKS.len()) " of " (all.len()) " loads, the lowest and the highest among them." } }
    })
}

/// Bins of equal ratio (area, density, number of clusters) with a point that is not drawn in place of each row of empty bins.
fn interrupted(bins: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let ratio = |pair: &[[f64; 3]]| pair[1][0] / pair[0][0];
    let one_bin = bins.windows(2).map(ratio).fold(f64::INFINITY, f64::min);
    let mut all: Vec<[f64; 3]> = bins.iter().take(1).copied().collect();
    for pair in bins.windows(2) {
        // Two bins have the square of the ratio of one.
        let has_empty = ratio(pair) > one_bin.powf(1.5);
        all.extend(has_empty.then(|| [(pair[0][0] * pair[1][0]).sqrt(), f64::NAN, f64::NAN]));
        all.push(pair[1]);
    }
    all
}

/// Line with the exponent of the challenge, above the distribution of the last load.
fn slope(curves: &[Curve]) -> Option<Curve> {
    let points = &curves.last()?.points;
    let (first, last) = (points.first()?, points.last()?);
    let point_at = |a: f64| (a, 3.0 * first.1 * (a / first.0).powf(SIZE_EXPONENT));
    (last.0 > first.0)
        .then(|| Curve::new("slope −1.45 (Müser et al. 2017)", EXPECTED, [point_at(first.0), point_at(last.0)]))
}

fn numbers(writer: &FigureWriter, all: &[(&State, &Observed)]) -> Markup {
    let cell = writer.scales.length_m;
    let axes = |[x, y]: [bool; 2]| match (x, y) {
        (true, true) => "along x and y",
        (true, false) => "along x",
        (false, true) => "along y",
        _ => "no",
    };
    let area = |a: f64| with_unit(a * UM * UM, 3, "µm²");
    html! {
        (columns!("numbers", all, |(s, o)| {
            writer.loads.head() => load(s, writer.loads),
            "mean contact pressure" => or_dash(o.mean_contact_pressure.map(|p| stress(p, 3))),
            "median cluster area" => or_dash(o.median_cluster_area.map(area)),
            "contact stiffness" => or_dash(s.stiffness.map(|k| stiffness(k, cell, 3))),
            "constriction conductance" => or_dash(o.constriction_conductance.map(|c| significant(c / cell, 3))),
            "conductance from stiffness" => or_dash(s.stiffness.map(|k| significant(writer.aspect * k / writer.scales.stiffness(), 3))),
            "equivalent hydraulic gap" =>
                or_dash(o.hydraulic_gap.map(|g| if g > 0.0 { length(g, 3) } else { "sealed".into() })),
            "contact percolates" => or_dash(o.contact_percolates.map(axes)),
            "gap percolates" => or_dash(o.gap_percolates.map(axes)),
        }))
        p.quiet { "Median cluster area (area-weighted): half of the contact is in clusters up to this area. Contact stiffness: derivative of "
            "the mean pressure by the approach, without change of the contact. Constriction conductance: clusters as independent circular "
            "spots; conductance from stiffness: with their interaction; both relative to a cube of the cell's extent. Equivalent "
            "hydraulic gap: uniform gap with the same flow, by the effective medium, which seals at half contact. Percolates: connects "
            "around the periodic cell, or opposite sides of a body that is not periodic; contact by edges and corners, gap by edges." }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_interrupted_at_empty_bins_and_nowhere_else() {
        let bin = |k: i32| [10f64.powi(k), 1.0, 1.0];
        let shown = interrupted(&[bin(0), bin(1), bin(4)]);
        let seen: Vec<bool> = shown.iter().map(|b| b[1].is_finite()).collect();
        assert_eq!(seen, [true, true, false, true]);
        assert_eq!(interrupted(&[bin(0), bin(1), bin(2)]).len(), 3);
        assert_eq!((interrupted(&[bin(3)]).len(), interrupted(&[]).len()), (1, 0));
    }
}

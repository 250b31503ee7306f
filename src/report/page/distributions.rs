//! Distributions of gap, stress and cluster area, and derived quantities.

use crate::load::Branch;
use maud::{Markup, html};

use super::figures::{FigureWriter, figure, numbers, text};
use super::loads::back;
use crate::challenge::SIZE_EXPONENT;
use crate::error::Result;
use crate::record::results::{ContinuumResults, Observed, StateResults};
use crate::report::number::{percent, si, si_scale, significant, stiffness, trimmed};
use crate::report::plot::{self, Axis, Curve, Dash, Marker, Plot, Style};

/// Number of plotted loads, spread over the load path.
const LOADS: usize = 4;

/// Styles of the loads, first to last. Both colour and dash pattern identify a load.
pub(super) const LOOKS: [Style; LOADS] = [
    Style { marker: Marker::None, ..plot::ATOMS },
    Style { marker: Marker::None, ..plot::WITHOUT },
    Style { marker: Marker::None, ..plot::HARD },
    Style { dash: Dash::Solid, marker: Marker::None, ..plot::LABORATORY },
];

pub(super) fn section(writer: &FigureWriter, c: &ContinuumResults) -> Result<Markup> {
    let all: Vec<(&StateResults, &Observed)> = c
        .states
        .iter()
        .filter(|s| s.branch == Branch::Loading)
        .filter_map(|s| s.observed.as_ref().map(|o| (s, o)))
        .collect();
    if all.is_empty() {
        return Ok(html! {});
    }
    let n = all.len();
    let shown: Vec<usize> =
        if n <= LOADS { (0..n).collect() } else { (0..LOADS).map(|i| i * (n - 1) / (LOADS - 1)).collect() };
    let um = writer.scales.length_m * 1e6;
    let modulus_pa = writer.scales.modulus_pa;
    let largest = all.iter().filter_map(|(_, o)| o.stress.edges.last()).fold(0.0, |most: f64, edge| most.max(*edge));
    let (unit_pa, prefix) = si_scale(largest * modulus_pa);
    let curves = |points: &dyn Fn(&Observed) -> Vec<(f64, f64)>| -> Vec<Curve> {
        let curve = |(look, &i): (&Style, &usize)| Curve {
            label: format!("p* = {}{}", trimmed(all[i].0.numbers.p_star, 4), back(all[i].0)),
            style: *look,
            points: points(all[i].1),
        };
        LOOKS.iter().zip(&shown).map(curve).collect()
    };
    let gaps = Plot::new(
        (Axis::Log, Axis::Log),
        ("gap (µm)", "probability density (1/µm)"),
        curves(&|o| o.gap_logarithmic.density_in(um)),
    );
    let stresses = Plot::new(
        (Axis::Linear, Axis::Log),
        (&format!("stress ({prefix}Pa), compression positive"), &format!("probability density (1/{prefix}Pa)")),
        curves(&|o| o.stress.density_in(modulus_pa / unit_pa)),
    );
    // Counting errors: d/√n of n clusters.
    let counting = |o: &Observed| o.patch_density.iter().map(|[_, d, n]| d / (um * um) / n.max(1.0).sqrt()).collect();
    let errors: Vec<Vec<f64>> = shown.iter().take(LOADS).map(|&i| counting(all[i].1)).collect();
    let mut sizes = curves(&|o| o.patch_density.iter().map(|[a, d, _]| (a * um * um, d / (um * um))).collect());
    sizes.extend(slope(&sizes));
    let labels = ("area of a cluster (µm²)", "density of clusters (1/µm²)");
    let sizes = Plot { errors, ..Plot::new((Axis::Log, Axis::Log), labels, sizes) };
    let shares = Plot::new(
        (Axis::Log, Axis::Linear),
        ("area of a cluster (µm²)", "cumulative fraction of the contact"),
        curves(&|o| o.patch_area.iter().map(|[a, share]| (a * um * um, *share)).collect()),
    );
    let mut figures = Vec::new();
    for (name, plot, caption) in [
        ("gap-distribution", gaps, "Distribution of the gap outside the contact."),
        (
            "stress-distribution",
            stresses,
            "Distribution of the normal stress. Without adhesion, nodes out of contact have zero stress and are not shown; with \
             adhesion they are under tension.",
        ),
        ("cluster-sizes", sizes, "Density of contact clusters by area; bars are counting errors, 1/√n of n clusters."),
        (
            "cluster-area",
            shares,
            "Fraction of the contact in clusters up to an area; the median cluster area is at one half.",
        ),
    ] {
        if let Some(curve) = writer.curves(name, &plot)? {
            figures.push(figure(curve, html! { (caption) }));
        }
    }
    Ok(html! {
        (table(writer, &all))
        @if let Some([open, sealed]) = c.percolation {
            p { "The gap percolates along both axes up to p* = " (trimmed(open, 4)) " and not from p* = "
                (trimmed(sealed, 4)) " on: the percolation load, at which leakage along at least one axis ends, is between them. The effective medium, which seals "
                "at half contact, does not describe this." }
        }
        @for f in &figures { (f) }
    })
}

/// Line with the exponent of the challenge, above the distribution of the last load.
fn slope(curves: &[Curve]) -> Option<Curve> {
    let points = &curves.last()?.points;
    let (first, last) = (points.first()?, points.last()?);
    let at = |a: f64| (a, 3.0 * first.1 * (a / first.0).powf(SIZE_EXPONENT));
    (last.0 > first.0).then(|| Curve {
        label: "slope −1.45 (Müser et al. 2017)".into(),
        style: plot::EXPECTED,
        points: vec![at(first.0), at(last.0)],
    })
}

fn table(writer: &FigureWriter, all: &[(&StateResults, &Observed)]) -> Markup {
    let length = writer.scales.length_m;
    let axes = |[x, y]: [bool; 2]| match (x, y) {
        (true, true) => "along x and y",
        (true, false) => "along x",
        (false, true) => "along y",
        _ => "no",
    };
    let rows = all
        .iter()
        .map(|(s, o)| {
            let pressure = o.mean_contact_pressure.map_or("–".into(), |p| si(p * writer.scales.modulus_pa, "Pa", 3));
            let cluster = o
                .median_cluster_area
                .map_or("–".into(), |a| format!("{}\u{a0}µm²", significant(a * length * length * 1e12, 3)));
            vec![
                html! { (trimmed(s.numbers.p_star, 4)) (back(s)) },
                text(pressure),
                text(cluster),
                text(
                    s.numbers
                        .stiffness
                        .map_or("–".into(), |k| stiffness(k * writer.scales.modulus_pa / length, length, 3)),
                ),
                text(significant(o.constriction_conductance, 3)),
                text(s.numbers.stiffness.map_or("–".into(), |k| significant(k, 3))),
                text(if o.hydraulic_gap > 0.0 { si(o.hydraulic_gap * length, "m", 3) } else { "sealed".into() }),
                text(axes(o.contact_percolates)),
                text(axes(o.gap_percolates)),
                text(percent(o.gap.delta)),
            ]
        })
        .collect();
    let head = [
        "p*",
        "mean contact pressure",
        "median cluster area",
        "contact stiffness",
        "constriction conductance",
        "conductance from stiffness",
        "equivalent hydraulic gap",
        "contact percolates",
        "gap percolates",
        "contact",
    ];
    html! {
        (numbers(&head, rows))
        p.quiet { "Median cluster area (area-weighted): half of the contact is in clusters up to this area. Contact stiffness: derivative of "
            "the mean pressure by the approach, without change of the contact. Constriction conductance: clusters as independent circular "
            "spots; conductance from stiffness: with their interaction; both relative to a cube of the cell's extent. Equivalent "
            "hydraulic gap: uniform gap with the same flow, by the effective medium, which seals at half contact. Percolates: connects "
            "around the periodic cell, contact by edges and corners, gap by edges." }
    }
}

//! Distributions, clusters and conductances of a state.

use crate::method::Equilibrium;
use crate::observe::{
    Connectivity, cluster_sizes, constriction_conductance, contact_map, cumulative_area, gap_distribution,
    hydraulic_gap, linear_edges, logarithmic_edges, median_cluster_size, median_counting_error, percolates,
    size_distribution, stress_distribution,
};
use crate::state::{Compressive, Observed};
use asperity_grid::Grid;

/// Number of bins of equal width.
const BINS: usize = 120;
/// Logarithmic gap bins per decade, over [`DECADES`] decades below the largest gap.
const PER_DECADE: usize = 12;
const DECADES: usize = 6;
/// Bins of cluster areas per decade.
pub const SIZES_PER_DECADE: usize = 5;
/// Factor on the range of bins, so that the last bin includes the largest value.
const ABOVE: f64 = 1.0 + 1e-9;

/// Edges of logarithmic bins for gaps up to `largest`.
pub fn gap_edges(largest: f64) -> Vec<f64> {
    // At full contact all gaps are zero, and the scale is arbitrary.
    let top = if largest > 0.0 { ABOVE * largest } else { 1.0 };
    logarithmic_edges(top * 10f64.powi(-(DECADES as i32)), top, PER_DECADE * DECADES)
}

/// Edges of linear bins for stresses from `smallest` to `largest`.
pub fn stress_edges(smallest: f64, largest: f64) -> Vec<f64> {
    // Without stress the width is arbitrary.
    let width = if largest > smallest { ABOVE * (largest - smallest) } else { 1.0 };
    linear_edges(smallest, smallest + width, BINS)
}

/// Counting error of the median cluster, nodes.
fn median_error(sizes: &[usize]) -> Option<f64> {
    let curve: Vec<[f64; 2]> = cumulative_area(sizes).into_iter().map(|(a, fraction)| [a as f64, fraction]).collect();
    let contact = sizes.iter().sum::<usize>() as f64;
    median_counting_error(&curve, contact, median_cluster_size(sizes)? as f64)
}

/// Distributions, contact clusters, conductances and percolation of a state. A node is in contact if its gap is at most
/// `threshold` (units of L). `contact_area`: the best value, over the area of the cell. With adhesion also the contact nodes under
/// compression over all nodes. `periodic`: nodes on opposite sides of the map are neighbours.
pub fn observed(
    grid: Grid,
    state: &Equilibrium,
    threshold: f64,
    contact_area: f64,
    (adhesive, periodic): (bool, bool),
) -> (Observed, Option<f64>) {
    let map = contact_map(state.gap, threshold);
    let sizes = cluster_sizes(&map, grid.nx, Connectivity::Eight, periodic);
    let node_area = grid.dx() * grid.dy();
    let nodes = 0..state.gap.len();
    let largest = nodes.clone().map(|i| state.gap.at(i)).fold(0.0, f64::max);
    let stresses = nodes.map(|i| state.stress.at(i));
    let (smallest, upper) = stresses.fold((0.0, 0.0), |(a, b): (f64, f64), s| (a.min(s), b.max(s)));
    let logarithmic = gap_edges(largest);
    let stress = stress_distribution(state.gap, state.stress, (threshold, adhesive), stress_edges(smallest, upper));
    let compressive = adhesive.then(|| {
        let under: Vec<u8> =
            (0..state.gap.len()).map(|i| u8::from(state.gap.at(i) <= threshold && state.stress.at(i) > 0.0)).collect();
        let sizes = cluster_sizes(&under, grid.nx, Connectivity::Eight, periodic);
        let compressive = Compressive {
            clusters: sizes.len(),
            median_cluster_area: median_cluster_size(&sizes).map(|a| a as f64 * node_area),
            median_cluster_area_error: median_error(&sizes).map(|a| a * node_area),
        };
        (compressive, sizes.iter().sum::<usize>() as f64 / grid.points() as f64)
    });
    let (compressive, nodes) = compressive.unzip();
    let observed = Observed {
        mean_contact_pressure: (contact_area > 0.0).then_some(state.pressure / contact_area),
        gap: Some(gap_distribution(state.gap, threshold, linear_edges(0.0, logarithmic[logarithmic.len() - 1], BINS))),
        gap_logarithmic: Some(gap_distribution(state.gap, threshold, logarithmic)),
        cluster_density: size_distribution(&sizes, SIZES_PER_DECADE)
            .into_iter()
            .map(|(a, density, n)| [a * node_area, density / node_area, n as f64])
            .collect(),
        cluster_area: cumulative_area(&sizes)
            .into_iter()
            .map(|(a, fraction)| [a as f64 * node_area, fraction])
            .collect(),
        median_cluster_area: median_cluster_size(&sizes).map(|a| a as f64 * node_area),
        compressive,
        constriction_conductance: Some(constriction_conductance(sizes.iter().map(|&a| a as f64 * node_area))),
        hydraulic_gap: Some(hydraulic_gap(state.gap, threshold)),
        contact_percolates: Some(percolates(&map, grid.nx, (1, true), periodic)),
        gap_percolates: Some(percolates(&map, grid.nx, (0, false), periodic)),
        ..Observed::default()
    };
    (observed.with_stress(Some(stress)), nodes)
}

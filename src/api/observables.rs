//! Observables of gap, stress and contact maps `[ny, nx]`. `periodic`: nodes on opposite sides of a map are neighbours.

use super::arrays::{flags, grid_of, map, row_major};
use asperity_contact::observe::{
    self, Connectivity, ContactArea, ContactEdges, Distribution, NO_CLUSTER, StressDistribution, median_cluster_size,
    percolates,
};
use asperity_grid::{Field, Grid};
use asperity_surface::Cell;
use ndarray::{Array2, ArrayView2};

/// Connected clusters of contact nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct Clusters {
    /// Number of each node's cluster from 1 on, `[ny, nx]`; 0 for nodes without contact.
    pub labels: Array2<usize>,
    /// Nodes of each cluster, in the order of the labels.
    pub sizes: Vec<usize>,
}

impl Clusters {
    /// Half of the contact area lies in clusters of at most this many nodes; none without contact.
    pub fn median_size(&self) -> Option<usize> {
        median_cluster_size(&self.sizes)
    }
}

/// Whether a phase percolates, that is, connects a periodic cell with its next image, or opposite sides of a map that does not repeat.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Percolation {
    /// Along x.
    pub x: bool,
    /// Along y.
    pub y: bool,
}

/// Contact area of a gap map of an elastic body under a hard wall: nodes with a gap of at most `threshold`, at 0
/// without the excess that they count along their edges. The border of a map that is not `periodic` is no edge. The perimeter is in units of one over the unit of the cell.
///
/// ```
/// use asperity::{Cell, contact_area};
/// use ndarray::Array2;
///
/// let mut gap = Array2::from_elem((8, 8), 1.0);
/// gap[(3, 3)] = 0.0;
/// let area = contact_area(gap.view(), 0.0, Cell { x: 8.0, y: 8.0 }, true);
/// assert_eq!((area.count, area.contact_nodes), (1, 1.0 / 64.0));
/// // Four edges of length 1 in a cell of area 64.
/// assert_eq!(area.perimeter, 4.0 / 64.0);
/// ```
pub fn contact_area(gap: ArrayView2<f64>, threshold: f64, cell: Cell, periodic: bool) -> ContactArea {
    let excess = if threshold > 0.0 { ContactEdges::COUNTED } else { ContactEdges::ELASTIC };
    let edges = ContactEdges { threshold, periodic, ..excess };
    let area = observe::contact_area(grid_of(cell, &gap), Field::F64(&row_major(gap)), edges);
    ContactArea { perimeter: area.perimeter / cell.x, ..area }
}

/// Connected clusters of a contact map.
///
/// ```
/// use asperity::{Connectivity, clusters};
/// use ndarray::array;
///
/// let contact = array![[true, false, true], [false, false, false], [false, true, false]];
/// let found = clusters(contact.view(), Connectivity::Four, true);
/// // The first and the third node of the first row are neighbours across the periodic boundary.
/// assert_eq!(found.sizes, [2, 1]);
/// assert_eq!(found.labels, array![[1, 0, 1], [0, 0, 0], [0, 2, 0]]);
/// ```
pub fn clusters(contact: ArrayView2<bool>, connectivity: Connectivity, periodic: bool) -> Clusters {
    let (ny, nx) = contact.dim();
    let labelled = observe::clusters(&flags(contact), nx, connectivity, periodic);
    let label = |l: u32| if l == NO_CLUSTER { 0 } else { l as usize + 1 };
    Clusters { labels: map(Grid::unit(nx, ny), labelled.label.into_iter().map(label).collect()), sizes: labelled.sizes }
}

/// Whether the contact percolates. Nodes that share an edge or a corner are neighbours.
pub fn percolation(contact: ArrayView2<bool>, periodic: bool) -> Percolation {
    let nx = contact.ncols();
    let [x, y] = percolates(&flags(contact), nx, (1, true), periodic);
    Percolation { x, y }
}

/// Distribution Pr(u) of the gap over bins with these `edges`, which must rise; nodes with a gap of at most `threshold` are its
/// delta function.
pub fn gap_distribution(gap: ArrayView2<f64>, threshold: f64, edges: &[f64]) -> Distribution {
    observe::gap_distribution(Field::F64(&row_major(gap)), threshold, edges.to_vec())
}

/// Distribution Pr(σ) of the interfacial stress over bins with these `edges`, which must rise.
///
/// # Panics
/// If the maps differ in shape.
pub fn stress_distribution(stress: ArrayView2<f64>, contact: ArrayView2<bool>, edges: &[f64]) -> StressDistribution {
    assert_eq!(stress.dim(), contact.dim(), "the maps differ in shape");
    let gap: Vec<f64> = contact.iter().map(|&c| if c { 0.0 } else { 1.0 }).collect();
    observe::stress_distribution(Field::F64(&gap), Field::F64(&row_major(stress)), (0.0, true), edges.to_vec())
}

/// Height of the uniform gap with the same pressure-driven flow, in the unit of the gap, in Bruggeman's effective-medium
/// approximation; 0 where half or more of the nodes have a gap of at most `threshold`.
pub fn hydraulic_gap(gap: ArrayView2<f64>, threshold: f64) -> f64 {
    observe::hydraulic_gap(Field::F64(&row_major(gap)), threshold)
}

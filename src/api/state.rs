//! States of a load path, with their maps as arrays.

use super::observables::{Clusters, Percolation, clusters, hydraulic_gap, percolation};
use asperity_contact::observe::Connectivity;
use asperity_contact::state::{Map, State};
use ndarray::ArrayView2;

/// Maps of a [`State`] in memory as arrays `[ny, nx]`, x fastest; none where the method does not deliver them.
///
/// # Panics
/// Its methods, where a map is stored in a file: [`FinishedRun`](crate::FinishedRun) reads those.
pub trait StateMaps {
    /// Gap between the surfaces.
    fn gap(&self) -> Option<ArrayView2<'_, f64>>;

    /// Interfacial stress, compression positive; adhesive stress is part of it. Without adhesion exactly zero where the gap is open.
    fn stress(&self) -> Option<ArrayView2<'_, f64>>;

    /// Whether a node is in contact.
    fn contact(&self) -> Option<ArrayView2<'_, bool>>;

    /// Plastic displacement of the surface since the first load; none before the first flow.
    fn plastic_displacement(&self) -> Option<ArrayView2<'_, f64>>;

    /// Contact clusters; nodes that share an edge or a corner are neighbours.
    fn clusters(&self) -> Option<Clusters>;

    /// Whether the contact percolates.
    fn percolation(&self) -> Option<Percolation>;

    /// Height of the uniform gap with the same pressure-driven flow: [`hydraulic_gap`].
    fn hydraulic_gap(&self) -> Option<f64> {
        self.gap().map(|map| hydraulic_gap(map, 0.0))
    }
}

impl StateMaps for State {
    fn gap(&self) -> Option<ArrayView2<'_, f64>> {
        self.gap_map.as_ref().map(view)
    }

    fn stress(&self) -> Option<ArrayView2<'_, f64>> {
        self.stress_map.as_ref().map(view)
    }

    fn contact(&self) -> Option<ArrayView2<'_, bool>> {
        self.contact_map.as_ref().map(view)
    }

    fn plastic_displacement(&self) -> Option<ArrayView2<'_, f64>> {
        self.plastic_map.as_ref().map(view)
    }

    fn clusters(&self) -> Option<Clusters> {
        self.contact().map(|map| clusters(map, Connectivity::Eight, !self.non_periodic))
    }

    fn percolation(&self) -> Option<Percolation> {
        self.contact().map(|map| percolation(map, !self.non_periodic))
    }
}

fn view<T>(map: &Map<T>) -> ArrayView2<'_, T> {
    match map {
        Map::Values { nx, ny, values } => {
            ArrayView2::from_shape((*ny, *nx), values).expect("a map has one value per node")
        }
        Map::File(file) => panic!("{file}: the map of a finished run, which FinishedRun reads"),
    }
}

//! States of a load path, with their maps as arrays.

use super::observables::{Clusters, Percolation, clusters, hydraulic_gap, percolation};
use asperity_contact::load::Branch;
use asperity_contact::observe::{Connectivity, WorkPoint, dissipation};
use asperity_contact::results::PullOff;
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
    fn clusters(&self) -> Option<Clusters> {
        self.contact().map(|map| clusters(map, Connectivity::Eight))
    }

    /// Whether the contact percolates.
    fn percolation(&self) -> Option<Percolation> {
        self.contact().map(percolation)
    }

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
}

fn view<T>(map: &Map<T>) -> ArrayView2<'_, T> {
    match map {
        Map::Values { nx, ny, values } => {
            ArrayView2::from_shape((*ny, *nx), values).expect("a map has one value per node")
        }
        Map::File(file) => panic!("{file}: the map of a finished run, which FinishedRun reads"),
    }
}

/// Equilibria of a load path.
#[derive(Debug, Clone)]
pub struct LoadPath {
    /// One for each load, in their order.
    pub states: Vec<State>,
    /// The largest tensile pressure, where it was requested.
    pub pull_off: Option<PullOff>,
    pub(super) is_adhesive: bool,
}

impl LoadPath {
    /// States of one branch, in the order of the loads.
    pub fn branch(&self, branch: Branch) -> impl Iterator<Item = &State> {
        self.states.iter().filter(move |s| s.branch == branch)
    }

    /// Energy per area that the path dissipates, open or closed: the work of the load less the change of the stored energy. With
    /// adhesion an estimate by trapezoids from the first load on, otherwise the plastic work since first contact.
    pub fn dissipation(&self) -> f64 {
        let path: Vec<WorkPoint> = self.states.iter().filter_map(State::work_point).collect();
        dissipation(&path, self.is_adhesive)
    }
}

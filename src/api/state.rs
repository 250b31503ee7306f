//! States of a load path.

use super::arrays::map;
use super::observables::{Clusters, Percolation, clusters, hydraulic_gap, percolation};
use asperity_contact::load::{Branch, Load, LoadStep};
use asperity_contact::observe::{Connectivity, Plasticity, WorkPoint, contact_map, dissipation};
use asperity_contact::path::Reached;
use asperity_contact::problem::Body;
use asperity_contact::results;
use asperity_surface::{Cell, Surface};
use ndarray::Array2;

/// An equilibrium. Units are those of its [`Problem`](crate::Problem).
#[derive(Debug, Clone)]
pub struct State {
    /// The load that was imposed.
    pub load: Load,
    /// Branch of the load path.
    pub branch: Branch,
    /// Extent of the cell.
    pub cell: Cell,
    /// The elastic body.
    pub body: Body,
    /// Gap between the surfaces, `[ny, nx]`, x fastest.
    pub gap: Array2<f64>,
    /// Interfacial pressure, `[ny, nx]`, compression positive; adhesive stress is part of it. Without adhesion exactly zero where
    /// the gap is open.
    pub pressure: Array2<f64>,
    /// Whether a node is in contact, `[ny, nx]`.
    pub contact: Array2<bool>,
    /// Plastic displacement of the surface since the first load, `[ny, nx]`; none before the first flow.
    pub plastic_displacement: Option<Array2<f64>>,
    /// Plastic flow up to this state; none for an elastic body.
    pub plasticity: Option<Plasticity>,
    /// Mean of the pressure.
    pub mean_pressure: f64,
    /// Mean of the gap.
    pub mean_gap: f64,
    /// Error of the mean gap; none where a part of it is not known.
    pub mean_gap_error: Option<f64>,
    /// Contact area over the area of the cell: the best value.
    pub contact_area: f64,
    /// Its error, of the same unit.
    pub contact_area_error: Option<f64>,
    /// Contact nodes over all nodes.
    pub contact_nodes: f64,
    /// Perimeter of the contact per area of the cell.
    pub perimeter: f64,
    /// Contact stiffness, the derivative of the mean pressure by the approach without change of the contact; none without contact, at
    /// full contact and where the state is unstable under an imposed pressure.
    pub stiffness: Option<f64>,
    /// Its error, of the same unit.
    pub stiffness_error: Option<f64>,
    /// Free energy per area: the elastic part, that of the interaction, and that of the load (pressure times mean gap).
    pub energy: f64,
    /// Its elastic part.
    pub elastic_energy: f64,
    /// Its part from the interaction of the surfaces.
    pub interaction_energy: f64,
    /// Relative difference between the load and the forces across the interface.
    pub load_error: f64,
    /// rms residual over the mean pressure.
    pub residual: f64,
    /// Iterations on this load.
    pub iterations: usize,
    /// Wall time of this load, s.
    pub seconds: f64,
}

impl State {
    pub(super) fn new((surface, modulus, body): (&Surface, f64, Body), step: &LoadStep, reached: &Reached) -> Self {
        let Reached { state, area, .. } = reached;
        let (grid, length) = (surface.grid(), surface.length());
        let energy_unit = modulus * length;
        let field = |field: asperity_grid::Field, unit: f64| map(grid, field.to_vec()).mapv_into(|v| v * unit);
        State {
            load: match step.target {
                Load::Pressure(p) => Load::Pressure(p * modulus),
                Load::MeanGap(g) => Load::MeanGap(g * length),
            },
            branch: step.branch,
            cell: surface.cell(),
            body,
            gap: field(state.gap, length),
            pressure: field(state.stress, modulus),
            contact: map(grid, contact_map(state.gap, 0.0)).mapv(|c| c != 0),
            plastic_displacement: state.plastic.map(|f| field(f, length)),
            plasticity: state.plasticity.map(|p| Plasticity {
                displacement: p.displacement * length,
                work: p.work * energy_unit,
                ..p
            }),
            mean_pressure: state.pressure * modulus,
            mean_gap: state.mean_gap * length,
            mean_gap_error: reached.mean_gap_error().map(|e| e * length),
            contact_area: area.contact_area,
            contact_area_error: reached.contact_area_error(),
            contact_nodes: area.contact_nodes,
            perimeter: area.perimeter / length,
            stiffness: state.stiffness.map(|k| k * modulus / length),
            stiffness_error: reached.stiffness_error().map(|e| e * modulus / length),
            energy: state.energy * energy_unit,
            elastic_energy: state.elastic_energy * energy_unit,
            interaction_energy: state.interaction_energy * energy_unit,
            load_error: state.load_error,
            residual: state.residual,
            iterations: state.iterations,
            seconds: state.seconds,
        }
    }

    /// Sets the pressure to exactly zero where the gap is open: solvers leave what their tolerance permits, of either sign.
    pub(super) fn clear_open_pressure(&mut self) {
        self.pressure.iter_mut().zip(&self.gap).filter(|(_, gap)| **gap > 0.0).for_each(|(p, _)| *p = 0.0);
    }

    /// Mean gap less the mean plastic displacement: the work conjugate of the pressure.
    fn separation(&self) -> f64 {
        self.mean_gap - self.plasticity.map_or(0.0, |p| p.displacement)
    }

    /// Contact clusters; nodes that share an edge or a corner are neighbours.
    pub fn clusters(&self) -> Clusters {
        clusters(self.contact.view(), Connectivity::Eight)
    }

    /// Whether the contact percolates.
    pub fn percolation(&self) -> Percolation {
        percolation(self.contact.view())
    }

    /// Height of the uniform gap with the same pressure-driven flow: [`hydraulic_gap`].
    pub fn hydraulic_gap(&self) -> f64 {
        hydraulic_gap(self.gap.view(), 0.0)
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
        let point = |s: &State| WorkPoint {
            pressure: s.mean_pressure,
            separation: s.separation(),
            stored: s.elastic_energy + s.interaction_energy,
            plastic_work: s.plasticity.map_or(0.0, |p| p.work),
        };
        let path: Vec<WorkPoint> = self.states.iter().map(point).collect();
        dissipation(&path, self.is_adhesive)
    }
}

/// The largest tensile pressure of an equilibrium on separation.
#[derive(Debug, Clone, PartialEq)]
pub struct PullOff {
    /// Mean pressure, negative.
    pub mean_pressure: f64,
    /// Its error; none without a pull-off on the grid of half the nodes per side.
    pub pressure_error: Option<f64>,
    /// Mean gap there.
    pub mean_gap: f64,
    /// As `pressure_error`.
    pub mean_gap_error: Option<f64>,
}

impl PullOff {
    pub(super) fn new(length: f64, modulus: f64, pull_off: &results::PullOff) -> Self {
        PullOff {
            mean_pressure: pull_off.pressure * modulus,
            pressure_error: pull_off.pressure_error.map(|e| e * modulus),
            mean_gap: pull_off.mean_gap * length,
            mean_gap_error: pull_off.mean_gap_error.map(|e| e * length),
        }
    }
}

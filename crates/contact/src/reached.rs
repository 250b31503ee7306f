//! Borrowed results of solvers and estimators as an owned [`State`].

use crate::load::LoadStep;
use crate::method::{Equilibrium, MethodEstimate, ReducedProblem};
use crate::observe::{Leakage, contact_map};
use crate::path::{Reached, is_unresolved, leakage};
use crate::state::{Discretisation, Map, State};
use asperity_grid::{Field, Grid};

impl Reached<'_> {
    /// The numbers of this state, in reduced units. `gradient`: pressure over E* at p* = 1.
    pub fn numbers(&self, step: &LoadStep, gradient: f64, criterion: &str) -> State {
        let Reached { state, area, .. } = self;
        let with_errors = step.same_on_finer_grids;
        // Without errors what is left is that the contact is not resolved, which is a warning.
        let unresolved = |d: Discretisation| {
            let unknown = Discretisation { area: None, mean_gap: None, stiffness: None, ..d };
            is_unresolved(area.contact_area, &d).then_some(unknown)
        };
        State {
            index: step.index,
            branch: step.branch,
            p_star: step.p_star_at(state.pressure, gradient),
            pressure: state.pressure,
            non_periodic: !self.periodic,
            criterion: criterion.into(),
            contact_area: area.contact_area,
            contact_area_error: self.contact_area_error().filter(|_| with_errors),
            contact_nodes: Some(area.contact_nodes),
            perimeter: Some(area.perimeter),
            mean_gap: Some(state.mean_gap),
            mean_gap_error: self.mean_gap_error().filter(|_| with_errors),
            displacement: Some(self.displacement),
            stiffness: state.stiffness,
            stiffness_error: self.stiffness_error().filter(|_| with_errors),
            energy: Some(state.energy),
            elastic_energy: Some(state.elastic_energy),
            interaction_energy: Some(state.interaction_energy),
            plasticity: state.plasticity,
            load_error: state.load_error,
            residual: Some(state.residual),
            complementarity: Some(state.complementarity),
            energy_bound: self.energy_bound,
            error_estimates: Some(state.error_estimates),
            discretisation: if with_errors { self.discretisation } else { self.discretisation.and_then(unresolved) },
            map_errors: self.map_errors.filter(|_| with_errors),
            extrapolated: self.extrapolated.filter(|_| with_errors),
            uncertainty: if with_errors { self.uncertainty.clone() } else { Vec::new() },
            stop: state.stop,
            iterations: state.iterations,
            fft_pairs: state.fft_pairs,
            seconds: state.seconds,
            ..State::default()
        }
    }
}

impl Reached<'_> {
    /// The flow through the gap, as [`path::leakage`](crate::path::leakage) finds it, with errors where a finer grid has the same load.
    pub fn leakage(&self, problem: &ReducedProblem, gap: Field, threshold: f64, step: &LoadStep) -> Option<Leakage> {
        leakage(problem, gap, threshold, self.coarser_gaps.filter(|_| step.same_on_finer_grids))
    }
}

impl State {
    /// With the maps of an equilibrium, in reduced units. Without adhesion the stress is exactly zero where the gap is open: solvers
    /// leave what their tolerance permits, of either sign.
    pub fn with_maps(self, grid: Grid, equilibrium: &Equilibrium, adhesive: bool) -> State {
        let map = |field: Field| Map::Values { nx: grid.nx, ny: grid.ny, values: field.to_vec() };
        let stress_at =
            |i: usize| if adhesive || equilibrium.gap.at(i) <= 0.0 { equilibrium.stress.at(i) } else { 0.0 };
        let stress = (0..equilibrium.stress.len()).map(stress_at).collect();
        let contact = contact_map(equilibrium.gap, 0.0).into_iter().map(|c| c != 0).collect();
        State {
            gap_map: Some(map(equilibrium.gap)),
            stress_map: Some(Map::Values { nx: grid.nx, ny: grid.ny, values: stress }),
            contact_map: Some(Map::Values { nx: grid.nx, ny: grid.ny, values: contact }),
            plastic_map: equilibrium.plastic.map(map),
            ..self
        }
    }

    /// With the maps of an estimate, in reduced units, as far as it has them.
    pub fn with_maps_of(self, grid: Grid, estimate: &MethodEstimate) -> State {
        let map = |values: &[f64]| Map::Values { nx: grid.nx, ny: grid.ny, values: values.to_vec() };
        let flags = |values: &[u8]| values.iter().map(|&c| c != 0).collect();
        State {
            gap_map: estimate.gap.map(map),
            stress_map: estimate.stress.map(map),
            contact_map: estimate.contact.map(|c| Map::Values { nx: grid.nx, ny: grid.ny, values: flags(c) }),
            ..self
        }
    }
}

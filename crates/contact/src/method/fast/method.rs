//! What the method delivers, and what it needs.

use super::level::Level;
use super::window::ComputationCell;
use super::{Fast, FastRun, ID, contact_stress, shared};
use crate::interface::{HardWall, Kernel, Law};
use crate::method::operator::{Build, dispatch};
use crate::method::plastic::PlasticFlow;
use crate::method::{
    Capabilities, ContactMethod, Criterion, Device, MethodCard, MethodKind, Needs, Observer, Precision, ReducedProblem,
    SolvePlan, SolverRun, StartedMethod, card,
};
use asperity_grid::{Real, Result};

static CARD: MethodCard = MethodCard {
    id: ID,
    paper_name: "-",
    family: "boundary value",
    kind: MethodKind::Solver,
    needs: Needs::Heights,
    criterion: Criterion::ZeroGap,
    calibrated_on: None,
    summary: "nested grids, projected Newton steps preconditioned in Fourier space; the default",
    supports: card::fields,
    capabilities: Capabilities {
        hardness: true,
        mean_gap: true,
        first_contact: true,
        non_periodic: true,
        elastic_stress: true,
        ranks: true,
        gpu: true,
        atoms: false,
    },
    dois: &["10.1007/s11249-017-0900-2"],
    papers: &[],
    measured_errors: None,
};

impl ContactMethod for Fast {
    fn card(&self) -> &'static MethodCard {
        &CARD
    }

    fn plan(&self, problem: &ReducedProblem) -> SolvePlan {
        let grid = ComputationCell::of(problem).grid;
        let (level, real) = match problem.precision {
            Precision::F32 => (Level::<f32, HardWall>::bytes(grid), size_of::<f32>()),
            Precision::F64 => (Level::<f64, HardWall>::bytes(grid), size_of::<f64>()),
        };
        // A converted series; a series through nodes is as large as a field and is made from a spectrum in f64.
        let (field, yields) = ((real * grid.points()) as u64, problem.hardness.is_some());
        let series = match problem.heights.series_bytes() {
            Some(bytes) if grid == problem.grid => {
                let waves = bytes / size_of::<f64>() as u64 * real as u64;
                // Displaced heights have all waves of the grid.
                if yields { waves.max(field) } else { waves }
            }
            _ => field,
        };
        // The continued heights of a padded cell are a field of their own.
        let continued = if yields && grid != problem.grid { size_of::<f64>() * grid.points() } else { 0 };
        let yielding = PlasticFlow::<f64>::bytes(problem) + continued as u64;
        // With a GPU the host has the heights with their half spectrum, for first contact, and then gap and stress.
        let level = match Device::of(problem, &CARD) {
            Device::Cpu => level.max(contact_stress::bytes(problem, real)),
            Device::Cuda => (2 * size_of::<f64>() * grid.points()) as u64,
        };
        // The stiffness of a body that flows is solved from a gap of its own; in a padded cell it has all fields that the state has.
        let held = match problem.stiffness && yields {
            true if grid == problem.grid => (size_of::<f64>() * grid.points()) as u64,
            true => level,
            false => 0,
        };
        let [level, held] = [level, held].map(|bytes| shared::bytes(problem.ranks, grid, bytes));
        SolvePlan { bytes: level + series + yielding + held, iterations: 20, pairs_per_iteration: 4.0, seconds: 0.0 }
    }

    fn prepare<'p>(&self, problem: &'p ReducedProblem<'p>, observer: &'p dyn Observer) -> Result<StartedMethod<'p>> {
        shared::check(problem, ID)?;
        Ok(StartedMethod::Solver(dispatch(problem, FastStart { problem, observer })?))
    }
}

struct FastStart<'p> {
    problem: &'p ReducedProblem<'p>,
    observer: &'p dyn Observer,
}

impl<'p> Build<'p> for FastStart<'p> {
    type Built = Result<Box<dyn SolverRun + 'p>>;

    fn build<T: Real, K: Kernel + 'p, L: Law + 'p>(self, _: K, law: L) -> Self::Built {
        Ok(Box::new(FastRun::<T, L>::new(self.problem, self.observer, law)?))
    }
}

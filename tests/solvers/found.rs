//! Copies of solver states for comparisons.

use asperity::contact::method::{Equilibrium, Load, NoObserver, ReducedProblem, Stop};
use asperity::contact::observe::{ContactEdges, contact_area};
use asperity::grid::Grid;
use asperity::methods;
use asperity::surface::{Modes, Spectrum};

/// A problem with the default settings of scenes and of `solve`.
pub(crate) fn problem(grid: Grid, heights: &[f64]) -> ReducedProblem<'_> {
    ReducedProblem { max_iterations: 20_000, ..ReducedProblem::new(grid, heights) }
}

/// A copied state.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Found {
    pub stop: Stop,
    pub iterations: usize,
    pub fft_pairs: f64,
    pub residual: f64,
    pub load_error: f64,
    pub area: f64,
    pub mean_gap: f64,
    pub energy: f64,
    pub interaction: f64,
    pub gap: Vec<f64>,
    pub stress: Vec<f64>,
}

impl Found {
    pub(crate) fn of(grid: Grid, s: &Equilibrium) -> Self {
        Found {
            stop: s.stop,
            iterations: s.iterations,
            fft_pairs: s.fft_pairs,
            residual: s.residual,
            load_error: s.load_error,
            area: contact_area(grid, s.gap, ContactEdges::COUNTED).contact_nodes,
            mean_gap: s.mean_gap,
            energy: s.energy,
            interaction: s.interaction_energy,
            gap: s.gap.to_vec(),
            stress: s.stress.to_vec(),
        }
    }

    pub(crate) fn is_finite(&self) -> bool {
        self.gap.iter().chain(&self.stress).chain(&[self.residual, self.energy]).all(|v| v.is_finite())
    }
}

/// States along a path of pressures.
pub(crate) fn path(problem: &ReducedProblem, id: &str, pressures: &[f64]) -> Vec<Found> {
    let mut run = methods::find(id).unwrap().start(problem, &NoObserver).unwrap().solver().unwrap();
    pressures.iter().map(|&p| Found::of(problem.grid, &run.equilibrate(Load::Pressure(p)).unwrap())).collect()
}

/// Converged state at one pressure.
pub(crate) fn solved(problem: &ReducedProblem, id: &str, pressure: f64) -> Found {
    let found = path(problem, id, &[pressure]).remove(0);
    let ReducedProblem { kernel, adhesion, wall, precision, .. } = problem;
    let what = format!("{id} {precision:?} at {pressure}, {kernel}, {adhesion}, {wall}");
    assert_eq!(found.stop, Stop::Converged, "{what}: residual {}", found.residual);
    assert!(found.is_finite(), "{what}");
    found
}

pub(crate) fn near(a: f64, b: f64, tolerance: f64) -> bool {
    (a - b).abs() <= tolerance * b.abs()
}

/// The challenge's surface with a longer cut-off wavelength; the grid resolves all waves.
pub(crate) fn rough(nx: usize, ny: usize, lambda_s: f64, seed: u64) -> (Grid, Vec<f64>) {
    let grid = Grid::unit(nx, ny);
    let spectrum = Spectrum { lambda_s, ..Spectrum::CHALLENGE };
    (grid, Modes::new(spectrum, seed, grid.ly).heights(grid, 0.0))
}

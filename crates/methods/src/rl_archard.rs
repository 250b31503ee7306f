//! Solves the long waves and models the short ones: the low-pass filtered surface is solved without adhesion on a
//! grid that just resolves it, and its contact area carries one sinusoid with the summit density and the rms
//! curvature of the waves that are left out (after Rostami & Streator, in Müser et al., Tribology Letters 65 (2017) 118).
//!
//! In the paper the sinusoid has those of the whole surface, so that the solved waves count twice. On the challenge's surface most of the
//! gradient is that of the short waves; a surface of long waves alone would lose half of its contact.
//!
//! The version in the paper solves a one-dimensional equivalent of the long waves; here the two-dimensional problem
//! is solved.

use crate::prelude::*;
use crate::sinusoid;
use asperity_contact::observe::{ContactEdges, contact_area};
use asperity_grid::{Series, Transform};
use asperity_surface::PowerSpectrum;
use std::f64::consts::PI;

pub(super) struct RlArchard;

static CARD: MethodCard = MethodCard {
    id: "rl-archard",
    paper_name: "RL-Archard",
    family: "stacked waves",
    kind: MethodKind::Estimate,
    needs: Needs::Heights,
    criterion: Criterion::Statistical,
    calibrated_on: None,
    summary: "long waves solved, those left out as one sinusoid on their contact area",
    supports,
    capabilities: Capabilities::NONE,
    dois: &["10.1007/s11249-017-0900-2"],
    papers: &[],
    measured_errors: Some(&MEASURED),
};

static ERRORS: [MeasuredError; 2] = [MeasuredError::of_area(0.22), MeasuredError::of_open_gap(0.2)];
static MEASURED: MeasuredErrors = MeasuredErrors::on_the_challenge(&ERRORS, false);

fn supports(quantity: Quantity) -> Support {
    use Quantity::*;
    match quantity {
        ContactArea => Support::NoAdhesion,
        MeanGap => Support::Only("mean gap of the long waves, without adhesion"),
        Stiffness => Support::Only("as differences between loads"),
        GapMap | StressMap | GapPdf => Support::No("the short waves are not resolved"),
        ContactMap | ClusterPdf | ClusterArea | MedianClusterArea => {
            Support::No("the contact of the short waves has no positions")
        }
        StressPdf => Support::No("only mean values are computed"),
    }
}

/// Default cut-off between solved and modelled waves.
const CUT_OFF: usize = 32;

/// Points of the coarse grid per shortest wavelength, enough for mean gaps. Contact areas are perimeter-corrected: at small loads the nodes
/// at the rim are a sixth of the contact.
const POINTS_PER_WAVE: usize = 4;

/// Number of waves along x below the Nyquist modes of both axes.
fn resolved(grid: Grid) -> usize {
    let along_y = (grid.ny as f64 - 1.0) / 2.0 * grid.lx / grid.ly;
    (grid.nx.saturating_sub(1) / 2).min(along_y as usize)
}

fn coarse(grid: Grid, modes: usize) -> Grid {
    let nx = POINTS_PER_WAVE * modes;
    Grid { nx, ny: ((nx as f64 * grid.ly / grid.lx).ceil() as usize).max(1), ..grid }
}

impl ContactMethod for RlArchard {
    fn card(&self) -> &'static MethodCard {
        &CARD
    }

    fn plan(&self, problem: &ReducedProblem) -> SolvePlan {
        let modes = problem.settings.rl_archard.cut_off_modes.unwrap_or(CUT_OFF).min(resolved(problem.grid)).max(1);
        let grid = coarse(problem.grid, modes);
        let field = |grid: Grid| 8 * grid.points() as u64;
        let solver = asperity_contact::method::Fast.plan(&ReducedProblem { grid, ..problem.clone() });
        // The series through the nodes, the spectrum it is made from, and the filtered series.
        let through_nodes = || 3 * Transform::<f64>::spectrum_bytes(problem.grid);
        let series = problem.heights.series_bytes().unwrap_or_else(through_nodes);
        // In transform pairs of the problem's grid.
        let fraction = grid.points() as f64 / problem.grid.points() as f64;
        let pairs_per_iteration = solver.pairs_per_iteration * fraction;
        SolvePlan { bytes: series.max(solver.bytes) + field(grid), pairs_per_iteration, ..solver }
    }

    fn prepare<'p>(&self, problem: &'p ReducedProblem<'p>, observer: &'p dyn Observer) -> Result<StartedMethod<'p>> {
        require::half_space(problem, CARD.id)?;
        require::hard_wall(problem, CARD.id)?;
        require::no_adhesion(problem, CARD.id)?;
        let grid = problem.grid;
        let largest = resolved(grid);
        let modes = problem.settings.rl_archard.cut_off_modes.unwrap_or(CUT_OFF.min(largest));
        if modes == 0 || modes > largest {
            let accepted = format!("1 to {largest}, the waves that {} x {} points resolve", grid.nx, grid.ny);
            return Err(require::refused(CARD.id, "rl-archard.cut_off_modes", modes, accepted));
        }
        let own;
        let series = match problem.heights {
            Heights::Nodes(nodes) => {
                own = Series::<f64>::from_nodes(grid, nodes);
                &own
            }
            Heights::Series(series) => series,
            Heights::Planned(_) => unreachable!("a solve has heights"),
        };
        let gradient = PowerSpectrum::from_series(series, grid).rms_gradient();
        if gradient.is_nan() || gradient <= 0.0 {
            return Err(require::refused(CARD.id, "heights", "no waves", "a rough surface"));
        }
        // The margin retains waves with exactly the cut-off length.
        let aspect = grid.lx / grid.ly;
        let is_long = |kx: i64, ky: i64| (kx as f64).hypot(ky as f64 * aspect) <= modes as f64 + 1e-9;
        let short = PowerSpectrum::of_waves(series, grid, |kx, ky| !is_long(kx, ky));
        let long = series.kept(is_long);
        let coarse = coarse(grid, modes);
        let transform = Transform::<f64>::new(coarse);
        let heights = long.on_nodes(&transform, &mut transform.spectrum());
        Ok(estimating(Layered { heights, grid: coarse, layer: ArchardLayer::of(&short), problem, observer }))
    }
}

/// One sinusoid D cos cos with the summit density and the rms curvature of some waves.
#[derive(Debug, Clone, Copy)]
struct ArchardLayer {
    /// Full-contact pressure, E*; 0 without waves.
    flat: f64,
}

impl ArchardLayer {
    fn of(power: &PowerSpectrum) -> Self {
        let (_, m2, m4) = power.moments();
        if m2 == 0.0 {
            return ArchardLayer { flat: 0.0 };
        }
        // Summit density of Nayak (1971); the sinusoid has two summits per wavelength squared.
        let summits = m4 / (6.0 * 3f64.sqrt() * PI * m2);
        let k2 = 2.0 * PI * PI * summits;
        // ⟨h_xx²⟩ = D² k⁴/4, rms gradient D k/√2.
        let amplitude = 2.0 * m4.sqrt() / k2;
        ArchardLayer { flat: amplitude * (0.5 * k2).sqrt() }
    }

    /// Contact fraction under a pressure on the contact of the long waves.
    fn contact_area(self, pressure: f64) -> f64 {
        if pressure >= self.flat { 1.0 } else { sinusoid::contact_area(pressure / self.flat) }
    }
}

struct Layered<'p> {
    /// Heights of the long waves on the coarse grid.
    heights: Vec<f64>,
    grid: Grid,
    layer: ArchardLayer,
    problem: &'p ReducedProblem<'p>,
    observer: &'p dyn Observer,
}

impl Estimator for Layered<'_> {
    fn estimate(&mut self, load: Load) -> Result<MethodEstimate<'_>> {
        let clock = Instant::now();
        let pressure = require::pressure(load, false, CARD.id)?;
        let problem =
            ReducedProblem { grid: self.grid, heights: Heights::Nodes(&self.heights), ..self.problem.clone() };
        let mut run = asperity_contact::method::Fast.start(&problem, self.observer)?.solver()?;
        let state = run.equilibrate(Load::Pressure(pressure))?;
        let long = contact_area(self.grid, state.gap, ContactEdges::ELASTIC).contact_area;
        // An interrupted solve may have no contact.
        let layer = if long > 0.0 { self.layer.contact_area(pressure / long) } else { 0.0 };
        let points = self.grid.points() as f64 / self.problem.grid.points() as f64;
        Ok(MethodEstimate {
            contact_area: long * layer,
            fft_pairs: state.fft_pairs * points,
            seconds: clock.elapsed().as_secs_f64(),
            ..MethodEstimate::solved(pressure, &state, self.problem.tolerance)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_surface::Spectrum;

    /// Surface of the challenge: 16.94 summits per square micrometre and 60 nm radius of curvature give 1.286 E*.
    #[test]
    fn full_contact_pressure_of_the_challenges_layer() {
        let layer = ArchardLayer::of(&PowerSpectrum::expected(&Spectrum::CHALLENGE, 1.0));
        assert!((layer.flat - 1.286).abs() < 1e-3, "{}", layer.flat);
    }

    #[test]
    fn resolved_waves_are_below_the_nyquist_modes() {
        assert_eq!(resolved(Grid::unit(64, 64)), 31);
        assert_eq!(resolved(Grid::unit(65, 65)), 32);
        assert_eq!(resolved(Grid::unit(64, 32)), 31);
        assert_eq!(resolved(Grid { nx: 64, ny: 32, lx: 1.0, ly: 1.0 }), 15);
        assert_eq!(resolved(Grid::unit(1, 1)), 0);
    }
}

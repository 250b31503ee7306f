use super::settings::Settings;
use super::snapshot::{SnapshotRef, SolverSnapshot};
use crate::interface::{AttractionLaw, Elastic, Kernel, NodalHardness, Wall};
use crate::load::Load;
use crate::observe::Plasticity;
use asperity_grid::sys::expect_memory;
use asperity_grid::sys::ranks::{ALONE, Ranks};
use asperity_grid::{Error, Result};
use asperity_grid::{Field, Grid, Series, Transform, rms};
use asperity_surface::{PowerSpectrum, non_periodic_gradient};
use rustfft::num_complex::Complex;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::ops::ControlFlow;
use std::path::PathBuf;

/// Floating-point type of the fields. Sums are in `f64`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum Precision {
    F32,
    F64,
}

impl Precision {
    /// Bytes of a value.
    pub fn bytes(self) -> u64 {
        match self {
            Precision::F32 => 4,
            Precision::F64 => 8,
        }
    }

    /// Unit round-off.
    pub fn epsilon(self) -> f64 {
        match self {
            Precision::F32 => f64::from(f32::EPSILON) / 2.0,
            Precision::F64 => f64::EPSILON / 2.0,
        }
    }
}

/// Source of the heights.
#[derive(Debug, Clone, Copy)]
pub enum Heights<'a> {
    /// On the nodes, `[ny, nx]`.
    Nodes(&'a [f64]),
    /// Modes of a Fourier series up to the Nyquist modes of the grid. A method that needs no nodal heights stores none.
    Series(&'a Series<f64>),
    /// None yet: those of a plan, with the bytes of the series that they will be, if they are one; and of a method that needs only the
    /// power spectrum.
    Planned(Option<u64>),
}

impl Heights<'_> {
    /// Root mean square about the mean, L.
    pub fn rms(&self) -> f64 {
        match self {
            Heights::Nodes(nodes) => rms(nodes),
            Heights::Series(series) => series.whole_rms(),
            Heights::Planned(_) => f64::NAN,
        }
    }

    /// Bytes of a series; `None` for nodes.
    pub fn series_bytes(&self) -> Option<u64> {
        match self {
            Heights::Nodes(_) => None,
            Heights::Series(series) => Some(series.bytes()),
            Heights::Planned(bytes) => *bytes,
        }
    }

    /// Heights `[ny, nx]` on the nodes of a grid; nodal heights are returned as they are.
    pub fn on_nodes(&self, grid: Grid) -> Cow<'_, [f64]> {
        match self {
            Heights::Nodes(nodes) => Cow::Borrowed(nodes),
            Heights::Series(series) => {
                let transform = Transform::new(grid);
                Cow::Owned(series.on_nodes(&transform, &mut transform.spectrum()))
            }
            Heights::Planned(_) => unreachable!("a solve has heights"),
        }
    }
}

impl<'a> From<&'a Vec<f64>> for Heights<'a> {
    fn from(nodes: &'a Vec<f64>) -> Self {
        Heights::Nodes(nodes)
    }
}

impl<'a> From<&'a [f64]> for Heights<'a> {
    fn from(nodes: &'a [f64]) -> Self {
        Heights::Nodes(nodes)
    }
}

/// Relative errors of a state by its iteration, as the method estimates them; absent where it has no estimate.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct ErrorEstimates {
    /// Of the contact area, from its last change and the convergence rate of the residual; for a method of many small steps, the change
    /// over the last fifth of them.
    pub area: Option<f64>,
    /// Of the mean gap, in the same way.
    pub mean_gap: Option<f64>,
}

/// A rigid rough surface over an elastic body, in reduced units (L = E* = 1).
#[derive(Debug, Clone)]
pub struct ReducedProblem<'a> {
    pub grid: Grid,
    /// Low points come into contact first; any offset. Empty for methods that need no heights.
    pub heights: Heights<'a>,
    /// Power spectrum, for methods that need it instead of heights.
    pub power: Option<&'a PowerSpectrum>,
    pub kernel: Elastic,
    pub adhesion: AttractionLaw,
    pub wall: Wall,
    /// Largest contact stress, units of E*: beyond it the body flows. `None` for an elastic body.
    pub hardness: Option<NodalHardness<'a>>,
    pub precision: Precision,
    /// Largest rms KKT residual over the pressure at which a state counts as converged.
    pub tolerance: f64,
    pub max_iterations: usize,
    /// Whether the contact stiffness of each state is found, too.
    pub stiffness: bool,
    pub settings: Settings,
    /// The ranks that share the solve; one by default. Several are accepted by the method `fast` alone.
    pub ranks: &'a Ranks,
}

/// A pressure with adhesion counts as zero if its residual cannot be reduced to this many times its rounding.
const ROUNDING_STEPS: f64 = 10.0;

/// Mean gap over the rms height from which on its rounding counts in place of that of the heights. At first contact of rough surfaces it
/// is 3 to 6.
const SPIKE: f64 = 16.0;

/// Largest residual due to rounding, over the pressure, with which a solve is begun. On 256² points (h_rms = 1e-3 L) `fast`
/// ends after 2 s at 1.9e-7, after 12 s at 3.8e-7 and at its limit of iterations at 1.9e-6.
const MOST_ROUNDING: f64 = 2e-7;

impl<'a> ReducedProblem<'a> {
    /// Heights `[ny, nx]` (units of L) or a Fourier series on a half-space with a hard wall and without adhesion, in
    /// f64, to a residual of 1e-8 of the pressure.
    pub fn new(grid: Grid, heights: impl Into<Heights<'a>>) -> Self {
        ReducedProblem {
            grid,
            heights: heights.into(),
            kernel: Elastic::HalfSpace,
            adhesion: AttractionLaw::None,
            wall: Wall::Hard,
            hardness: None,
            precision: Precision::F64,
            tolerance: 1e-8,
            max_iterations: 50_000,
            stiffness: false,
            settings: Settings::default(),
            power: None,
            ranks: &ALONE,
        }
    }

    /// The same for methods that need only the power spectrum of the surface.
    pub fn of_power(grid: Grid, power: &'a PowerSpectrum) -> Self {
        ReducedProblem { power: Some(power), ..ReducedProblem::new(grid, Heights::Planned(None)) }
    }

    /// Power spectrum of the surface, for a method that needs it.
    ///
    /// # Errors
    /// `Input` if it is missing.
    pub fn expect_power(&self, id: &str) -> Result<&'a PowerSpectrum> {
        self.power.ok_or_else(|| {
            Error::input(format!("method {id}"), "spectrum", "none", "the power spectrum of the surface")
        })
    }

    /// Number of shells of the power spectrum; those of the grid before the spectrum is computed.
    pub fn shells(&self) -> usize {
        let Grid { nx, ny, lx, ly } = self.grid;
        let modes = 0.5 * (nx as f64).hypot(ny as f64 * lx / ly) * (ly / lx).max(1.0);
        self.power.map_or(modes.ceil() as usize, |p| p.shells.len())
    }

    /// Bytes that [`ReducedProblem::power_of_heights`] allocates: for nodal heights, a half spectrum and the series made
    /// from it.
    pub fn power_bytes(&self) -> u64 {
        match self.heights {
            Heights::Series(_) | Heights::Planned(Some(_)) => 0,
            Heights::Nodes(_) | Heights::Planned(None) => 2 * Transform::<f64>::spectrum_bytes(self.grid),
        }
    }

    /// Power spectrum of the heights up to the Nyquist modes of the grid.
    ///
    /// # Errors
    /// `Memory` if the series through nodal heights does not fit.
    pub fn power_of_heights(&self) -> Result<PowerSpectrum> {
        match self.heights {
            Heights::Planned(_) => unreachable!("a solve has heights"),
            Heights::Series(series) => Ok(PowerSpectrum::from_series(series, self.grid)),
            Heights::Nodes(nodes) => {
                expect_memory("the spectrum of the heights".into(), self.power_bytes(), "a coarser grid needs less")?;
                Ok(PowerSpectrum::from_nodes(self.grid, nodes))
            }
        }
    }

    /// rms gradient of the modes that the grid resolves; for a non-periodic surface, of differences between
    /// neighbouring nodes.
    pub fn resolved_gradient(&self) -> f64 {
        let grid = self.grid;
        if !self.kernel.is_periodic() {
            return non_periodic_gradient(grid, &self.heights.on_nodes(grid));
        }
        match self.heights {
            Heights::Nodes(nodes) => Series::<f64>::from_nodes(grid, nodes).rms_gradient(grid),
            Heights::Series(series) => series.rms_gradient(grid),
            Heights::Planned(_) => unreachable!("a solve has heights"),
        }
    }

    /// Lowest mean pressure (E*) of full contact with a hard wall and without adhesion. There the body conforms to the
    /// surface, and the stress of that displacement is tensile at no node.
    pub fn full_contact_pressure(&self) -> f64 {
        let (grid, kernel) = (self.grid, self.kernel);
        let transform = Transform::<f64>::new(grid);
        let mut spectrum = transform.spectrum();
        let mut field = self.heights.on_nodes(grid).into_owned();
        let points = grid.points() as f64;
        transform.forward_filtered(&field, &mut spectrum, &|i: usize, column: &mut [Complex<f64>]| {
            for (j, c) in column.iter_mut().enumerate() {
                let (qx, qy) = (grid.qx(i), grid.qy(j));
                // The mean of the stress is the pressure, the unknown.
                *c *= if (qx, qy) == (0.0, 0.0) { 0.0 } else { kernel.stiffness(qx, qy) / points };
            }
            0.0
        });
        transform.inverse(&mut spectrum, &mut field);
        field.into_iter().fold(0.0, f64::max)
    }

    /// Accepts periodic bodies only.
    ///
    /// # Errors
    /// `Input` if the body is not periodic.
    pub fn expect_periodic(&self, id: &str) -> Result<()> {
        match self.kernel {
            Elastic::NonPeriodic(_) => Err(Error::input(
                format!("method {id}"),
                "kernel",
                "a non-periodic body",
                "a periodic body, or the method `fast`",
            )),
            _ => Ok(()),
        }
    }

    /// Stress (E*) by which residuals are divided: the mean pressure. Where it is zero but for rounding, as on a load
    /// path that passes through zero, adhesion sets the scale: the stress γ/ρ, at most 0.01 E*. Smaller pressures than
    /// rounding permits at the tolerance count as such a pressure if the adhesive stress exceeds it. Without adhesion no
    /// stress acts under zero pressure, and any scale will do.
    pub fn stress_scale(&self, rms_height: f64, pressure: f64) -> f64 {
        const NONE: f64 = 1e-12;
        const SMALL: f64 = 0.01;
        let pressure = pressure.abs();
        match self.adhesion {
            AttractionLaw::None if pressure != 0.0 => pressure,
            AttractionLaw::None => SMALL,
            law => {
                let attraction = (law.work_of_adhesion() / law.range()).min(SMALL);
                let negligible = ROUNDING_STEPS * self.rounding(Precision::F64, rms_height) / self.tolerance;
                pressure.max(if pressure < NONE { attraction } else { attraction.min(negligible) })
            }
        }
    }

    /// Stiffness (E*/L) of the softest and of the stiffest mode of the grid. Both are searched between the longest
    /// wavelength and the corner of the spectrum, since a bonded layer is stiff for long waves, too; and along the
    /// axes and the diagonal, between which the stiffness of a cubic crystal lies.
    pub fn stiffness_range(&self) -> (f64, f64) {
        const SAMPLES: i32 = 64;
        const DIAGONAL: f64 = std::f64::consts::FRAC_1_SQRT_2;
        let lowest = std::f64::consts::TAU / self.grid.lx.max(self.grid.ly);
        let ratio = (self.grid.q_max() / lowest).max(1.0);
        (0..=SAMPLES)
            .map(|k| lowest * ratio.powf(f64::from(k) / f64::from(SAMPLES)))
            .flat_map(|q| [(q, 0.0), (0.0, q), (DIAGONAL * q, DIAGONAL * q)])
            .map(|(qx, qy)| self.kernel.stiffness(qx, qy))
            .fold((f64::INFINITY, 0.0), |(softest, stiffest), k| (softest.min(k), stiffest.max(k)))
    }

    /// Factor on the iterations for adhesion that the grid does not resolve: 4 to 10 on 512² with the challenge's
    /// adhesion.
    pub fn adhesion_effort(&self) -> usize {
        if self.adhesion == AttractionLaw::None { 1 } else { 6 }
    }

    /// Stiffness (E*/L) of the stiffest mode of the grid.
    pub fn stiffest_mode(&self) -> f64 {
        self.stiffness_range().1
    }

    /// Lower bound of the rms residual (E*) due to rounding of the fields: the round-off of the displacement of the
    /// stiffest mode. The factor was measured: f32 at 512² (h_rms = 0.0159 L, p = 0.01 E*) stalls between 1.5e-4 and
    /// 3e-4 of the pressure, which is 1.4 to 2.7 times the bare product.
    fn rounding(&self, precision: Precision, rms_height: f64) -> f64 {
        3.0 * precision.epsilon() * self.stiffest_mode() * rms_height
    }

    /// The rounding of the residual over its scale under a pressure.
    pub fn rounding_floor(&self, rms_height: f64, pressure: f64) -> f64 {
        self.rounding(self.precision, rms_height) / self.stress_scale(rms_height, pressure)
    }

    /// As [`Self::rounding_floor`], where an iteration stalls. Behind a spike the gap is far larger than the rms height, and so is the
    /// rounding of the displacement, which is computed from it: under a spike of 1e6 on 48² points `fast` stalls at 0.6 to 6 times
    /// the rounding of the gap over three, and never gets below that of the heights.
    pub fn stall_floor(&self, rms_height: f64, mean_gap: f64, pressure: f64) -> f64 {
        let is_spike = mean_gap.abs() > SPIKE * rms_height;
        let height = if is_spike { mean_gap.abs() } else { rms_height };
        self.rounding(self.precision, height) / self.stress_scale(rms_height, pressure)
    }

    /// Lowest pressure (E*) above zero that presses a hard wall without adhesion with more stress than the rounding of
    /// the heights is worth. Below, a single node carries the load; zero if there is no such limit.
    pub fn least_pressure(&self, rms_height: f64) -> f64 {
        if self.adhesion != AttractionLaw::None || self.wall != Wall::Hard {
            return 0.0;
        }
        self.rounding(Precision::F64, rms_height) / MOST_ROUNDING
    }
}

/// Estimated cost of a solve.
#[derive(Debug, Clone, Copy, Serialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct SolvePlan {
    /// Bytes of fields and spectra, without the heights.
    pub bytes: u64,
    /// Expected iterations per load, an order of magnitude.
    pub iterations: usize,
    /// Transform pairs (forward and inverse) per iteration.
    pub pairs_per_iteration: f64,
    /// Processor time of a load without its transforms, s, an order of magnitude: constants times points, measured by
    /// the benchmark `measure`.
    pub seconds: f64,
}

impl SolvePlan {
    /// Cost of an estimate without transforms; `bytes` and `seconds` per point of the grid.
    pub fn per_point(problem: &ReducedProblem, bytes: u64, iterations: usize, seconds: f64) -> Self {
        let points = problem.grid.points();
        SolvePlan {
            bytes: bytes * points as u64,
            iterations,
            pairs_per_iteration: 0.0,
            seconds: seconds * points as f64,
        }
    }
}

pub use crate::load::Stop;

/// One equilibrium. The fields are borrowed from the solver: at 16384² a copy would take gigabytes.
#[derive(Debug, Clone, Copy)]
pub struct Equilibrium<'a> {
    pub load: Load,
    /// Mean pressure over E*, imposed or required by the mean gap.
    pub pressure: f64,
    /// Whose rows the fields are, in order: on several ranks each has its own, one alone has whole fields.
    pub ranks: &'a Ranks,
    /// Gap `[ny, nx]`, L: `g ≥ 0` with a hard wall, counted from the zero of the wall's force with a soft wall.
    pub gap: Field<'a>,
    /// Interfacial stress `[ny, nx]` over E*: contact plus adhesive, compression positive; its mean is the pressure.
    pub stress: Field<'a>,
    pub mean_gap: f64,
    /// Work conjugate of the pressure, L: the mean gap; of a non-periodic body, minus the rigid approach from first
    /// contact.
    pub separation: f64,
    /// Contact stiffness dp/dū, E*/L: of a change of the separation during which no node comes into contact or leaves it, and none flows.
    /// `None` if it was not requested, without contact, at full contact, and where the state is unstable under an imposed pressure.
    pub stiffness: Option<f64>,
    /// Free energy per area, E*·L: elastic + interaction + pressure times mean gap.
    pub energy: f64,
    pub elastic_energy: f64,
    pub interaction_energy: f64,
    /// Plastic displacement `[ny, nx]` of the surface since the first load, L; `None` before the first flow.
    pub plastic: Option<Field<'a>>,
    /// `None` for an elastic body.
    pub plasticity: Option<Plasticity>,
    /// Relative difference between the pressure and the forces across the interface (contact stress where the gap is
    /// zero, the adhesion law elsewhere).
    pub load_error: f64,
    /// rms over the grid of the KKT residual (stress imbalance off contact, tension on contact) over the pressure.
    pub residual: f64,
    /// Mean of |contact stress · gap| over pressure times rms height.
    pub complementarity: f64,
    pub error_estimates: ErrorEstimates,
    pub stop: Stop,
    pub iterations: usize,
    /// Transform pairs (forward and inverse) of the grid.
    pub fft_pairs: f64,
    pub seconds: f64,
}

impl Equilibrium<'_> {
    /// The error of a method (its id) that did not reach equilibrium. `why`: the reason; `partial`: the file of the last gap, if stored.
    pub fn not_converged(
        &self,
        method: &'static str,
        reason: impl ToString,
        tolerance: f64,
        partial: Option<PathBuf>,
    ) -> Error {
        let (mut reason, Equilibrium { iterations, residual, .. }) = (reason.to_string(), *self);
        if residual <= tolerance {
            reason.push_str(&format!(", load error {:.1e}", self.load_error));
        }
        if self.stop == Stop::RoundingFloor {
            reason.push_str("; accepted: a larger tolerance or load");
            reason.push_str(if let Field::F32(_) = self.gap { ", or double precision" } else { "" });
        }
        if self.stop == Stop::Detached {
            reason.push_str("; accepted: a smaller tension, with adhesion");
        }
        Error::NotConverged { method, why: reason, iterations, residual, tolerance, partial }
    }
}

/// A machine that pulls two surfaces apart through a spring, much stiffer than the contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Machine {
    /// Growth of the tension with the displacement of the grip while the surfaces are closed, E*/L; the largest that is possible.
    pub stiffness: f64,
    /// Displacement of the grip less [`Equilibrium::separation`], over the tension (L/E*). For a non-periodic body without the mean
    /// displacement of the half-space, which may exceed that of the spring.
    pub compliance: f64,
}

impl Machine {
    /// The grip's displacement in a state, L.
    pub fn grip(&self, separation: f64, pressure: f64) -> f64 {
        separation - pressure * self.compliance
    }

    /// Growth of the tension with the grip's displacement at this contact stiffness.
    pub fn rise(&self, contact: f64) -> f64 {
        1.0 / (1.0 / contact + self.compliance)
    }
}

/// The error of methods without a [`Machine`].
pub fn cannot_pull() -> Error {
    Error::input("pull-off", "method", "this one", "the method `fast`, which controls the mean gap")
}

/// Equilibria along a load path. With adhesion loading and unloading differ, so the order of the loads matters.
pub trait SolverRun {
    /// Equilibrium at the next load of the path.
    ///
    /// # Errors
    /// `Input` for a load that the method cannot impose.
    fn equilibrate(&mut self, load: Load) -> Result<Equilibrium<'_>>;

    /// The machine of [`SolverRun::pull`]; `None` for methods that cannot pull.
    fn machine(&self) -> Option<Machine> {
        None
    }

    /// Equilibrium of surfaces in a machine that pulls at them through a spring, with its grip at `grip` (L). Continues from the last
    /// state, to this tolerance of the residual. The load of the state is its mean gap, or its pressure where that is zero and with a
    /// non-periodic body.
    ///
    /// # Errors
    /// `Input` for methods that cannot pull.
    fn pull(&mut self, _grip: f64, _tolerance: f64) -> Result<Equilibrium<'_>> {
        Err(cannot_pull())
    }

    /// Continues from a snapshot of the same method and problem. The next load must be the one that was interrupted;
    /// its result is bit-identical to that of an uninterrupted solve.
    ///
    /// # Errors
    /// `Input` if the snapshot is of another method or grid.
    fn resume(&mut self, snapshot: SolverSnapshot) -> Result<()> {
        let found = format!("{} x {} points", snapshot.grid.nx, snapshot.grid.ny);
        Err(Error::input("checkpoint", "snapshot", found, "none: this method restarts an interrupted load"))
    }

    /// Starts the next load from this gap `[ny, nx]` (L) instead of the previous state.
    fn set_gap(&mut self, gap: &[f64]);

    /// Starts the next load from the surface with this plastic displacement `[ny, nx]` (L). Only for methods that model
    /// plastic flow; for others a displacement does not exist.
    fn set_plastic_displacement(&mut self, _displacement: &[f64]) {}
}

/// Report of an iteration.
#[derive(Debug, Clone, Copy)]
pub struct Iteration {
    pub iteration: usize,
    /// Residual over the stress scale, and the tolerance for it.
    pub residual: f64,
    pub tolerance: f64,
    /// Points of the present grid over those of the problem's grid.
    pub grid_fraction: f64,
}

impl Iteration {
    /// Estimated fraction of the solve that is done: residuals fall about exponentially from 1, and the cost of a
    /// grid is proportional to its points, so that all coarser grids together cost a third of it.
    pub fn progress(&self) -> f64 {
        let here = (self.residual.min(1.0).ln() / self.tolerance.ln()).clamp(0.0, 1.0);
        0.75 * self.grid_fraction * (1.0 / 3.0 + here)
    }
}

/// Report of a state of a search for the pull-off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeparationStep {
    /// Number of states so far.
    pub states: usize,
    /// Tension of this state over the largest so far.
    pub tension: f64,
    /// Estimated fraction of the search that is done.
    pub progress: f64,
}

/// State of a coarser grid in a nested iteration.
#[derive(Debug, Clone, Copy)]
pub struct CoarseState<'a> {
    pub grid: Grid,
    /// Whose rows the gap is, as in [`Equilibrium`].
    pub ranks: &'a Ranks,
    pub gap: Field<'a>,
    /// Mean pressure over E*.
    pub pressure: f64,
    pub mean_gap: f64,
    /// As of a [`Equilibrium`].
    pub stiffness: Option<f64>,
    pub energy: f64,
    /// Range of the adhesion on this grid, L.
    pub range: f64,
    /// Coarse grids are solved to a looser tolerance.
    pub error_estimates: ErrorEstimates,
}

/// Receives reports of a solver and may stop it.
pub trait Observer: Sync {
    /// Called once in each iteration; `Break` stops the solver.
    fn iteration(&self, step: Iteration) -> ControlFlow<()>;

    /// Whether the solver is to stop. Queried within iterations, too.
    fn stop_requested(&self) -> bool {
        false
    }

    /// Called when a coarser grid has converged.
    fn coarse_grid_done(&self, _state: CoarseState) {}

    /// Whether a snapshot is due. A solver that is interrupted passes one in any case.
    fn snapshot_due(&self) -> bool {
        false
    }

    /// Receives a snapshot for [`SolverRun::resume`]. Methods without snapshots restart an interrupted load.
    fn snapshot(&self, _snapshot: SnapshotRef) {}

    /// Called when a load of a path has ended, before its state is passed on.
    fn load_ended(&self) {}

    /// Called after each state of a search for the pull-off.
    fn separated(&self, _step: SeparationStep) {}

    /// Receives the iterate of an interrupted load, which is no result.
    fn interrupted(&self, _grid: Grid, _iterate: &Equilibrium) {}
}

impl<F: Fn(Iteration) -> ControlFlow<()> + Sync> Observer for F {
    fn iteration(&self, step: Iteration) -> ControlFlow<()> {
        self(step)
    }
}

/// Ignores every event and never stops a solver.
pub struct NoObserver;

impl Observer for NoObserver {
    fn iteration(&self, _step: Iteration) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

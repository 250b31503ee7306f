use super::Settings;
use crate::grid::{Field, Grid, Series, Transform, rms};
use crate::interface::{Adhesion, Elastic, Kernel, Wall};
use crate::load::Load;
use crate::surface::{PowerSpectrum, non_periodic_gradient};
use crate::{Error, Result};
use rustfft::num_complex::Complex;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::ops::ControlFlow;

/// Floating-point type of the fields. Sums are always `f64`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Precision {
    F32,
    F64,
}

impl Precision {
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

/// Where a solver takes the heights from.
#[derive(Debug, Clone, Copy)]
pub enum Heights<'a> {
    /// On the nodes, `[ny, nx]`.
    Nodes(&'a [f64]),
    /// The waves that the grid holds of a Fourier series: no field of heights is stored by a method that needs none.
    Series(&'a Series<f64>),
}

impl Heights<'_> {
    /// Root mean square about the mean.
    pub fn rms(&self) -> f64 {
        match self {
            Heights::Nodes(nodes) => rms(nodes),
            Heights::Series(series) => series.rms(),
        }
    }

    /// On the nodes of a grid: those given, if there are any.
    pub fn on_nodes(&self, grid: Grid) -> Cow<'_, [f64]> {
        match self {
            Heights::Nodes(nodes) => Cow::Borrowed(nodes),
            Heights::Series(series) => {
                let transform = Transform::new(grid);
                Cow::Owned(series.on_nodes(&transform, &mut transform.spectrum()))
            }
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

/// Accuracy in physical terms. Each that is given must be met, beside the residual.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Targets {
    /// Energy above the minimum, over the energy: what the last Newton step had in reach, times the fall of the residual
    /// since.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub energy: Option<f64>,
    /// Relative change of the contact area still to come, estimated from its last change and the rate at which the residual
    /// falls; for a method of many small steps, the change over the last fifth of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub area: Option<f64>,
    /// The same of the mean gap.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_gap: Option<f64>,
}

impl Targets {
    /// Whether all that are asked for are met.
    pub fn met(&self, error_estimates: &ErrorEstimates) -> bool {
        let within = |goal: Option<f64>, found: Option<f64>| goal.is_none_or(|g| found.is_some_and(|f| f <= g));
        within(self.energy, error_estimates.energy)
            && within(self.area, error_estimates.area)
            && within(self.mean_gap, error_estimates.mean_gap)
    }
}

/// How far a state has settled, in the terms of [`Targets`]; `None` where a method cannot tell.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct ErrorEstimates {
    pub energy: Option<f64>,
    pub area: Option<f64>,
    pub mean_gap: Option<f64>,
}

/// A rigid rough surface over an elastic body, in reduced units (L = E* = 1).
#[derive(Debug, Clone)]
pub struct Problem<'a> {
    pub grid: Grid,
    /// Low points touch first; any offset. None for methods that need none of them.
    pub heights: Heights<'a>,
    /// For methods that need this instead of heights.
    pub power: Option<&'a PowerSpectrum>,
    pub kernel: Elastic,
    pub adhesion: Adhesion,
    pub wall: Wall,
    pub precision: Precision,
    /// Largest rms KKT residual over the pressure at which a state counts as converged.
    pub tolerance: f64,
    /// What else must have settled.
    pub targets: Targets,
    pub max_iterations: usize,
    pub settings: Settings,
}

impl<'a> Problem<'a> {
    /// Heights `[ny, nx]` (units of L) or waves on a hard half-space without adhesion, in f64, to a residual of 1e-8 of the
    /// pressure.
    pub fn new(grid: Grid, heights: impl Into<Heights<'a>>) -> Self {
        Problem {
            grid,
            heights: heights.into(),
            kernel: Elastic::HalfSpace,
            adhesion: Adhesion::None,
            wall: Wall::Hard,
            precision: Precision::F64,
            tolerance: 1e-8,
            targets: Targets::default(),
            max_iterations: 50_000,
            settings: Settings::default(),
            power: None,
        }
    }

    /// The same for methods that need no more of a surface than its power by wave number.
    pub fn of_power(grid: Grid, power: &'a PowerSpectrum) -> Self {
        Problem { power: Some(power), ..Problem::new(grid, &[][..]) }
    }

    /// The power of the surface, for a method that needs it.
    ///
    /// # Errors
    /// If it was not given.
    pub fn expect_power(&self, id: &str) -> Result<&'a PowerSpectrum> {
        self.power.ok_or_else(|| Error::input(format!("method {id}"), "spectrum", "not given", "that of the surface"))
    }

    /// Shells of its power, or of that of its grid, where it is not taken yet.
    pub fn shells(&self) -> usize {
        let Grid { nx, ny, lx, ly } = self.grid;
        self.power.map_or((0.5 * (nx as f64).hypot(ny as f64 * lx / ly)).ceil() as usize, |p| p.shells.len())
    }

    /// Bytes that [`Problem::power_of_heights`] takes: of nodes a spectrum, and the series that is read from it.
    pub fn power_bytes(&self) -> u64 {
        match self.heights {
            Heights::Series(_) => 0,
            Heights::Nodes(_) => 2 * Transform::<f64>::spectrum_bytes(self.grid),
        }
    }

    /// Power by wave number of its heights, of the waves that the grid holds.
    ///
    /// # Errors
    /// `Memory` where the series through nodes would not fit.
    pub fn power_of_heights(&self) -> Result<PowerSpectrum> {
        match self.heights {
            Heights::Series(series) => Ok(PowerSpectrum::from_series(series, self.grid)),
            Heights::Nodes(nodes) => {
                let (need, have) = (self.power_bytes(), crate::sys::available_memory_bytes());
                if need > have {
                    let advice = "a coarser grid needs less".into();
                    return Err(Error::Memory { what: "the spectrum of the heights".into(), need, have, advice });
                }
                Ok(PowerSpectrum::from_nodes(self.grid, nodes))
            }
        }
    }

    /// rms gradient of the waves that the grid holds; of a surface that does not repeat, that of differences between
    /// neighbouring nodes.
    pub fn resolved_gradient(&self) -> f64 {
        let grid = self.grid;
        if let Elastic::NonPeriodic(_) = self.kernel {
            return non_periodic_gradient(grid, &self.heights.on_nodes(grid));
        }
        match self.heights {
            Heights::Nodes(nodes) => Series::<f64>::from_nodes(grid, nodes).rms_gradient(grid),
            Heights::Series(series) => series.rms_gradient(grid),
        }
    }

    /// Least mean pressure, over E*, at which a hard wall without adhesion is touched everywhere: there the body has the
    /// surface's shape, and the stress that this takes pulls at no node.
    pub fn full_contact_pressure(&self) -> f64 {
        let (grid, kernel) = (self.grid, self.kernel);
        let transform = Transform::<f64>::new(grid);
        let mut spectrum = transform.spectrum();
        let mut field = self.heights.on_nodes(grid).into_owned();
        let points = grid.points() as f64;
        transform.forward_filtered(&field, &mut spectrum, &|i: usize, column: &mut [Complex<f64>]| {
            for (j, c) in column.iter_mut().enumerate() {
                let (qx, qy) = (grid.qx(i), grid.qy(j));
                // The mean of the stress is the pressure that is asked for.
                *c *= if (qx, qy) == (0.0, 0.0) { 0.0 } else { kernel.stiffness(qx, qy) / points };
            }
            0.0
        });
        transform.inverse(&mut spectrum, &mut field);
        field.into_iter().fold(0.0, f64::max)
    }

    /// For methods that solve in one periodic cell.
    ///
    /// # Errors
    /// If the body is not periodic.
    pub fn expect_periodic(&self, id: &str) -> Result<()> {
        match self.kernel {
            Elastic::NonPeriodic(_) => {
                Err(Error::input(format!("method {id}"), "kernel", "a body that is not periodic", "method fast"))
            }
            _ => Ok(()),
        }
    }

    /// What residuals are divided by: the mean pressure, or a hundredth of E* where there is none, or no more than what
    /// rounding leaves of a load path that passes through zero.
    pub fn stress_scale(pressure: f64) -> f64 {
        const NONE: f64 = 1e-12;
        if pressure.abs() < NONE { 0.01 } else { pressure.abs() }
    }

    /// Stiffness of the grid's softest and stiffest mode. A bonded layer is stiff for long waves as well as for short
    /// ones, so both are looked for between the longest wave and the corner of the spectrum; a crystal's depends on the
    /// direction, so along the axes and the diagonal, between which a cubic one lies.
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

    /// Stiffness of the stiffest mode of the grid.
    pub fn stiffest_mode(&self) -> f64 {
        self.stiffness_range().1
    }

    /// rms residual over the pressure below which rounding of the fields alone keeps a solver: the round-off of the
    /// displacement of the stiffest mode. The factor was measured: f32 at 512² (h_rms = 0.0159 L, p = 0.01 E*) stalls
    /// between 1.5e-4 and 3e-4, which is 1.4 to 2.7 times the bare product.
    pub fn rounding_floor(&self, rms_height: f64, pressure: f64) -> f64 {
        3.0 * self.precision.epsilon() * self.stiffest_mode() * rms_height / Self::stress_scale(pressure)
    }
}

/// What a solve will take, said before it is taken.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Plan {
    /// Fields and spectra, heights excluded.
    pub bytes: u64,
    /// Expected iterations per load, an order of magnitude.
    pub iterations: usize,
    /// Transform pairs (forward and inverse) per iteration.
    pub pairs_per_iteration: f64,
    /// Processor time of a load beside its transforms, s, an order of magnitude: constants times points, as
    /// `asperity bench --methods` measures them.
    pub seconds: f64,
}

/// Why a solver stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stop {
    Converged,
    IterationLimit,
    /// The residual no longer falls and is what rounding of the fields leaves.
    RoundingFloor,
    /// No step, however short, lowers the energy, and the residual is above what rounding explains.
    NoDescent,
    /// The state is no longer finite.
    Diverged,
    /// The surfaces have parted: no equilibrium holds a pull of this size.
    Detached,
    Interrupted,
}

impl std::fmt::Display for Stop {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Stop::Converged => "converged",
            Stop::IterationLimit => "iteration limit",
            Stop::RoundingFloor => "rounding floor of the precision",
            Stop::NoDescent => "no descent",
            Stop::Diverged => "diverged",
            Stop::Detached => "detached",
            Stop::Interrupted => "interrupted",
        })
    }
}

/// One equilibrium, lent to observers: at 16384² a field is gigabytes, so nothing here is a copy.
#[derive(Debug, Clone, Copy)]
pub struct State<'a> {
    pub load: Load,
    /// Mean pressure over E*: what was imposed, or what the mean gap needs.
    pub pressure: f64,
    /// Gap `g ≥ 0` (hard wall) or `g` from the wall's zero of force (soft wall), units of L.
    pub gap: Field<'a>,
    /// Interfacial stress over E*: contact plus adhesive, compression positive; its mean is the pressure.
    pub stress: Field<'a>,
    pub mean_gap: f64,
    /// Free energy per area: elastic + interaction + pressure times mean gap, units of E*·L.
    pub energy: f64,
    pub elastic_energy: f64,
    pub interaction_energy: f64,
    /// Relative difference between the pressure and the forces that act across the interface (contact where the gap
    /// is zero, the law elsewhere).
    pub load_error: f64,
    /// rms over the grid of the KKT residual (stress imbalance off contact, tension on contact) over the pressure.
    pub residual: f64,
    /// Mean of |contact stress · gap| over pressure times rms height.
    pub complementarity: f64,
    pub error_estimates: ErrorEstimates,
    pub stop: Stop,
    pub iterations: usize,
    /// Forward and inverse transforms of the grid, in pairs.
    pub fft_pairs: f64,
    pub seconds: f64,
}

/// A load path: order matters, because compression and decompression differ with adhesion.
pub trait Run {
    /// # Errors
    /// `Input` for a load that the method cannot impose.
    fn equilibrate(&mut self, load: Load) -> Result<State<'_>>;

    /// Goes on from a snapshot of the same method and problem when the next load is equilibrated, which must be the one that
    /// was interrupted. The bits that follow are those that would have followed.
    ///
    /// # Errors
    /// `Input` when the snapshot is not this method's.
    fn resume(&mut self, snapshot: SolverSnapshot) -> Result<()> {
        let found = format!("{} x {} points", snapshot.grid.nx, snapshot.grid.ny);
        Err(Error::input("checkpoint", "snapshot", found, "none: this method begins its load anew"))
    }

    /// Starts the next load from this gap `[ny, nx]` (units of L) instead of from where the last one ended.
    fn set_gap(&mut self, gap: &[f64]);
}

/// What a watcher sees of an iteration.
#[derive(Debug, Clone, Copy)]
pub struct Iteration {
    pub iteration: usize,
    pub residual: f64,
    pub tolerance: f64,
    /// Points of the grid at work over those of the problem's.
    pub grid_fraction: f64,
}

impl Iteration {
    /// Part of a solve that is done, an estimate: residuals fall about exponentially from 1, and a grid costs what its points
    /// do, those below it together a third of it.
    pub fn progress(&self) -> f64 {
        let here = (self.residual.min(1.0).ln() / self.tolerance.ln()).clamp(0.0, 1.0);
        0.75 * self.grid_fraction * (1.0 / 3.0 + here)
    }
}

/// A solve that can be taken up again: the gap on the grid at work, and what its method knows beside it.
#[derive(Debug, Clone)]
pub struct SnapshotRef<'a> {
    pub grid: Grid,
    pub gap: Field<'a>,
    /// A second field `[ny, nx]` that the method goes on from: velocities, or a direction.
    pub auxiliary: Option<Field<'a>>,
    pub progress: serde_json::Value,
}

/// A snapshot as it was kept.
#[derive(Debug, Clone)]
pub struct SolverSnapshot {
    pub grid: Grid,
    pub gap: Vec<f64>,
    pub auxiliary: Option<Vec<f64>>,
    pub progress: serde_json::Value,
}

impl SolverSnapshot {
    /// Gap `[ny, nx]`, units of L, and the method's own.
    ///
    /// # Errors
    /// `Input` where method `id`, at work on `grid`, has not written this.
    pub fn restore<P: DeserializeOwned>(self, grid: Grid, id: &str) -> Result<(Vec<f64>, P)> {
        let progress =
            serde_json::from_value(self.progress).map_err(|e| foreign(grid, id, "progress", e.to_string()))?;
        Ok((whole(self.gap, grid, id, "gap")?, progress))
    }

    /// As [`SolverSnapshot::restore`], with the field beside the gap, `[ny, nx]`, as its second.
    ///
    /// # Errors
    /// The same, and `Input` where there is none.
    pub fn restore_pair<P: DeserializeOwned>(mut self, grid: Grid, id: &str) -> Result<(Vec<f64>, Vec<f64>, P)> {
        let auxiliary = self.auxiliary.take().ok_or_else(|| foreign(grid, id, "auxiliary", "nothing".into()))?;
        let (gap, progress) = self.restore(grid, id)?;
        Ok((gap, whole(auxiliary, grid, id, "auxiliary")?, progress))
    }
}

fn whole(field: Vec<f64>, grid: Grid, id: &str, key: &str) -> Result<Vec<f64>> {
    let len = field.len();
    if len == grid.points() { Ok(field) } else { Err(foreign(grid, id, key, format!("{len} values"))) }
}

fn foreign(grid: Grid, id: &str, key: &str, found: String) -> Error {
    let accepted = format!("what method {id} has written on {} x {} points", grid.nx, grid.ny);
    Error::input("checkpoint", key, found, accepted)
}

/// The state on a coarser grid, as a nested iteration leaves it.
#[derive(Debug, Clone, Copy)]
pub struct CoarseState<'a> {
    pub grid: Grid,
    pub gap: Field<'a>,
    pub mean_gap: f64,
    pub energy: f64,
    /// Range of the adhesion there, units of L.
    pub range: f64,
    /// A coarse grid is left early.
    pub error_estimates: ErrorEstimates,
}

/// Observes a solver and may stop it.
pub trait Observer: Sync {
    fn iteration(&self, step: Iteration) -> ControlFlow<()>;

    /// Whether the solver is to stop, asked more often than once in an iteration.
    fn stop_requested(&self) -> bool {
        false
    }

    /// A coarser grid is done.
    fn coarse_grid_done(&self, _state: CoarseState) {}

    /// Whether the time has come to keep a snapshot. One is offered before a solver stops because it was asked to, too.
    fn snapshot_due(&self) -> bool {
        false
    }

    /// Where the solve can be taken up again ([`Run::resume`]). Methods without snapshots begin their load anew.
    fn snapshot(&self, _snapshot: SnapshotRef) {}
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

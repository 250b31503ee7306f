//! `tradeoff.json` and `tradeoff.csv`: cost of settings of methods, and their errors against a reference.

use super::atomic_file::write_atomic;
use super::json;
use super::methods::Missing;
use super::quantity::Quantity;
use super::results::ScalesSi;
use crate::error::Result;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;

/// Raised when a field changes its name or meaning; a reader accepts no other.
pub const SCHEMA: u32 = 3;
pub const FILE: &str = "tradeoff.json";
pub const CSV_FILE: &str = "tradeoff.csv";

/// Errors by quantity; quantities that a method does not deliver are absent.
pub type Errors = BTreeMap<Quantity, f64>;

#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Tradeoff {
    pub schema: u32,
    pub name: String,
    pub scales: ScalesSi,
    /// Where the surface is from, its rms gradient, and its shortest wave over L.
    pub surface: String,
    pub gradient: f64,
    /// rms height over L, of a spectrum what is expected of it. Not told before schema 2, which has deviations of gaps over no less
    /// than a hundredth of it.
    pub rms_height: f64,
    pub shortest_wavelength: f64,
    /// Grid of the scene.
    pub nx: usize,
    pub ny: usize,
    /// Loads p* there; empty under control of the mean gap.
    pub p_star: Vec<f64>,
    pub kernel: String,
    pub adhesion: String,
    pub program: String,
    pub threads: usize,
    /// Runs of each setting, of which the minimum counts. Absent where the number depends on the duration: `cost.runs`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub repeats: Option<usize>,
    /// Wall time budget, and wall time spent, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub budget_seconds: Option<f64>,
    pub spent_seconds: f64,
    /// With the scene's adhesion and without, as needed by the methods.
    pub references: Vec<Reference>,
    pub points: Vec<TradeoffPoint>,
    /// Predictions from coarser grids, for methods with at least three grids.
    pub forecasts: Vec<Forecast>,
    pub skipped: Vec<SkippedSetting>,
    pub warnings: Vec<String>,
}

impl Tradeoff {
    pub fn reference(&self, adhesive: bool) -> Option<&Reference> {
        self.references.iter().find(|r| r.setting.adhesive == adhesive)
    }

    /// Error of a point, not below the uncertainty of the reference. None for a layer, which is another problem than the scene's.
    pub fn error(&self, point: &TradeoffPoint, quantity: Quantity) -> Option<f64> {
        if point.setting.layer_thickness.is_some() {
            return None;
        }
        let least = self.reference(point.setting.adhesive)?.uncertainty.get(&quantity);
        Some(point.errors.get(&quantity)?.max(least.copied().unwrap_or(0.0)))
    }

    /// Prediction of a point's cost from coarser grids.
    pub fn forecast(&self, point: &TradeoffPoint) -> Option<&Forecast> {
        self.forecasts.iter().find(|f| f.setting == point.setting)
    }

    /// Grids of a method in one precision and to one tolerance: those that it ran on most grids in, of equally many the first.
    pub fn grids(&self, method: &str) -> Vec<&TradeoffPoint> {
        let told =
            |p: &&TradeoffPoint| p.setting.method == method && p.setting.is_grid() && p.unavailable_reason.is_none();
        let how = |p: &TradeoffPoint| (p.setting.precision.clone(), p.setting.tolerance);
        let alike =
            |a: &TradeoffPoint| self.points.iter().filter(told).filter(|b| how(b) == how(a)).collect::<Vec<_>>();
        let all = self.points.iter().filter(told).map(alike);
        all.reduce(|a, b| if b.len() > a.len() { b } else { a }).unwrap_or_default()
    }

    /// Writes `tradeoff.json` and `tradeoff.csv` into a run folder.
    pub fn write(&self, folder: &Path) -> Result<()> {
        json::write(&folder.join(FILE), self)?;
        write_atomic(&folder.join(CSV_FILE), |w| {
            let errors: Vec<&str> = Quantity::COMPARED.iter().map(|m| m.id()).collect();
            writeln!(w, "{COLUMNS},{}", errors.join(","))?;
            for p in &self.points {
                let (s, c) = (&p.setting, &p.cost);
                write!(w, "{},{},{},{},{},{:?},", s.method, s.adhesive, s.nx, s.ny, s.precision, s.tolerance)?;
                write!(w, "{},", s.layer_thickness.map_or(String::new(), |t| format!("{t:?}")))?;
                write!(w, "{},", s.block.map_or(String::new(), |b| b.to_string()))?;
                write!(w, "{:?},{:?},{:?},", c.wall_seconds, c.cpu_seconds, c.cpu_over_reference)?;
                write!(w, "{:?},{},{},{}", c.fft_pairs, c.iterations, c.planned_bytes, c.measured_bytes)?;
                let foreseen = self.forecast(p).map_or(String::new(), |f| format!("{:?}", f.predicted_cpu_seconds));
                let of_atoms = c.atoms.map_or(",".into(), |a| format!("{},{}", a.atoms, a.force_evaluations));
                write!(w, ",{},{foreseen},{of_atoms}", c.runs)?;
                for m in Quantity::COMPARED {
                    write!(w, ",{}", p.errors.get(&m).map_or(String::new(), |e| format!("{e:?}")))?;
                }
                writeln!(w)?;
            }
            Ok(())
        })
    }

    /// # Errors
    /// A file that is no table of this program, or one of another schema.
    pub fn read(file: &Path) -> Result<Self> {
        json::read_schema(file, SCHEMA)
    }
}

/// Columns before those of the errors.
const COLUMNS: &str = "method,adhesive,nx,ny,precision,tolerance,layer_thickness,block,wall_seconds,cpu_seconds,cpu_over_reference,fft_pairs,\
                       iterations,planned_bytes,measured_bytes,runs,predicted_cpu_seconds,atoms,\
                       force_evaluations";

/// A method and its settings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Setting {
    pub method: String,
    /// Whether it was given the scene's adhesion.
    pub adhesive: bool,
    pub nx: usize,
    pub ny: usize,
    pub precision: String,
    pub tolerance: f64,
    /// Thickness over L of a bonded layer in place of the scene's half-space.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub layer_thickness: Option<f64>,
    /// Of `all-atom`: its block. Points are then those of the indenter, the tolerance is the force's in eV/Å.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub block: Option<BlockSize>,
}

impl Setting {
    /// Whether it belongs to the grid series of the scene's own problem.
    pub fn is_grid(&self) -> bool {
        self.layer_thickness.is_none() && self.block.is_none()
    }
}

/// A block of atoms and the elastic foundation below it, lattice constants.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct BlockSize {
    pub cells: usize,
    pub depth_cells: usize,
    #[serde(default, skip_serializing_if = "crate::record::json::is_default")]
    pub foundation_cells: usize,
}

impl std::fmt::Display for BlockSize {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}x{}", self.cells, self.depth_cells)?;
        if self.foundation_cells > 0 { write!(f, "+{}", self.foundation_cells) } else { Ok(()) }
    }
}

/// Cost of a setting for all loads, including the observables: minimum over its repeats.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    pub wall_seconds: f64,
    pub cpu_seconds: f64,
    /// Processor time over the reference's.
    pub cpu_over_reference: f64,
    /// Of all loads.
    pub fft_pairs: f64,
    pub iterations: usize,
    pub planned_bytes: u64,
    /// Growth of the peak resident set, and the resident set before.
    pub measured_bytes: u64,
    pub resident_before_bytes: u64,
    /// Number of runs that this is the minimum of.
    pub runs: usize,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub atoms: Option<AtomsCost>,
}

/// LAMMPS's part of the cost.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AtomsCost {
    /// Deformable, fixed and of the indenter.
    pub atoms: u64,
    /// Of all loads.
    pub force_evaluations: usize,
    pub lammps_cpu_seconds: f64,
    /// Its frames on the disk.
    pub frame_bytes: u64,
}

/// Relative deviation up to which a prediction of a cost holds.
pub const FORECAST_TOLERANCE: f64 = 0.3;

/// Predicted cost of a method's finest grid from its coarser ones, compared with the measured one, and that of the next grid.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Forecast {
    /// The finest grid.
    #[serde(flatten)]
    pub setting: Setting,
    /// Points per side of the coarser grids, coarse to fine.
    pub coarser: Vec<usize>,
    /// Processor time of all loads, predicted and measured, s.
    pub predicted_cpu_seconds: f64,
    pub cpu_seconds: f64,
    /// Predicted over measured.
    pub ratio: f64,
    /// Prediction for twice the points per side from all grids, s.
    pub doubled_grid_cpu_seconds: Option<f64>,
}

impl Forecast {
    /// Whether the prediction is within [`FORECAST_TOLERANCE`].
    pub fn holds(&self) -> bool {
        (self.ratio - 1.0).abs() <= FORECAST_TOLERANCE
    }
}

/// Reference solution.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reference {
    #[serde(flatten)]
    pub setting: Setting,
    pub cost: Cost,
    /// Points along x of the coarser grids that it was extrapolated from, coarse to fine.
    pub coarser: Vec<usize>,
    pub loads: Vec<ReferenceLoad>,
    /// Uncertainty, root mean square over the loads: the extrapolated change, or the change from half the points per side.
    /// Absent without coarser grids.
    pub uncertainty: Errors,
}

/// A number extrapolated from a series of grids.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Extrapolation {
    pub value: f64,
    /// Of the finest grid.
    pub finest: f64,
    /// Change from the finest grid to the value or, without extrapolation, from the grid before; none for a single grid.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub uncertainty: Option<f64>,
    /// Power of the spacing with which the changes shrink, where it is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub order: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ReferenceLoad {
    pub p_star: f64,
    /// Contact fraction, mean gap in L, stiffness in E*/L.
    pub numbers: BTreeMap<Quantity, Extrapolation>,
}

/// One setting that was run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TradeoffPoint {
    #[serde(flatten)]
    pub setting: Setting,
    pub paper_name: String,
    pub criterion: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibrated_on: Option<String>,
    /// The solution that others are held against; its errors are what is uncertain of it.
    pub is_reference: bool,
    /// Why there are no errors.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unavailable_reason: Option<String>,
    pub missing: Vec<Missing>,
    pub cost: Cost,
    /// Root mean square over the loads.
    pub errors: Errors,
    pub loads: Vec<LoadErrors>,
    /// Of atoms: against the solution on the heights that they resolve.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub resolved: Option<ResolvedErrors>,
}

/// Errors against the half-space under the heights that a block's indenter resolves, without the short waves that the block leaves
/// out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ResolvedErrors {
    /// Shortest wave of these heights over L, and their rms gradient.
    pub shortest_wavelength: f64,
    pub gradient: f64,
    /// Points per side of that solution, which is not extrapolated.
    pub nx: usize,
    pub errors: Errors,
    pub loads: Vec<LoadErrors>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LoadErrors {
    pub p_star: f64,
    pub errors: Errors,
}

/// A setting that was not run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SkippedSetting {
    #[serde(flatten)]
    pub setting: Setting,
    pub reason: String,
}

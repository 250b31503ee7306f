//! `tradeoff.json` and `tradeoff.csv`: cost of method settings and their errors against a reference.

use super::given_loads::GivenLoads;
use super::results::ScalesSi;
use asperity_atoms::job_spec::Minimizer;
use asperity_contact::quantity::Quantity;
use asperity_contact::state::Missing;
use asperity_grid::error::Result;
use asperity_surface::files::atomic_file::write_atomic;
use asperity_surface::files::json;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;

/// Schema version, increased when a field changes its name or meaning; other versions cannot be read.
pub const SCHEMA: u32 = 7;
pub const FILE: &str = super::results::TRADEOFF_FILE;
pub const CSV_FILE: &str = "tradeoff.csv";

/// Errors by quantity; quantities that a method does not provide are absent.
pub type Errors = BTreeMap<Quantity, f64>;

#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct TradeoffResults {
    pub schema: u32,
    pub name: String,
    pub scales: ScalesSi,
    /// Where the surface is from, its rms gradient, and its shortest wave over L.
    pub surface: String,
    pub gradient: f64,
    /// rms height over L; for a spectrum its ensemble average. Errors of gaps are relative to at least 1 % of it.
    pub rms_height: f64,
    pub shortest_wavelength: f64,
    /// Hurst exponent of the spectrum; `None` for a surface that is given otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hurst: Option<f64>,
    /// Grid of the scene.
    pub nx: usize,
    pub ny: usize,
    /// Loads p* of the scene; empty if the mean gap is prescribed.
    pub p_star: Vec<f64>,
    /// How loads are named.
    pub loads: GivenLoads,
    pub kernel: String,
    pub adhesion: String,
    pub program: String,
    pub threads: usize,
    /// Number of runs of each setting, of which the fastest counts. Absent if it depends on the duration: see
    /// `cost.runs`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub repeats: Option<usize>,
    /// Wall-time budget, and wall time used, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub budget_seconds: Option<f64>,
    pub spent_seconds: f64,
    /// References with and without the scene's adhesion, as needed by the methods.
    pub references: Vec<Reference>,
    pub points: Vec<TradeoffPoint>,
    pub skipped: Vec<SkippedSetting>,
    pub warnings: Vec<String>,
}

impl TradeoffResults {
    pub fn reference(&self, adhesive: bool) -> Option<&Reference> {
        self.references.iter().find(|r| r.setting.adhesive == adhesive)
    }

    /// Error of a point, at least the uncertainty of the reference.
    pub fn error(&self, point: &TradeoffPoint, quantity: Quantity) -> Option<f64> {
        let smallest = self.reference(point.setting.adhesive)?.uncertainty.get(&quantity);
        Some(point.errors.get(&quantity)?.max(smallest.copied().unwrap_or(0.0)))
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
                write!(w, "{},", s.block.map_or(String::new(), |b| b.to_string()))?;
                write!(w, "{:?},{:?},{:?},", c.wall_seconds, c.cpu_seconds, c.cpu_over_reference)?;
                write!(w, "{:?},{},{},{}", c.fft_pairs, c.iterations, c.planned_bytes, c.measured_bytes)?;
                let of_atoms = c.atoms.map_or(",".into(), |a| format!("{},{}", a.atoms, a.force_evaluations));
                write!(w, ",{},{of_atoms}", c.runs)?;
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
const COLUMNS: &str = "method,adhesive,nx,ny,precision,tolerance,block,wall_seconds,cpu_seconds,cpu_over_reference,fft_pairs,\
                       iterations,planned_bytes,measured_bytes,runs,atoms,\
                       force_evaluations";

/// A method and its settings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Setting {
    pub method: String,
    /// Whether the setting includes the scene's adhesion.
    pub adhesive: bool,
    pub nx: usize,
    pub ny: usize,
    pub precision: String,
    pub tolerance: f64,
    /// Block of `all-atom`: points are then those of the indenter, and the tolerance is that of the force, eV/Å.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub block: Option<BlockSize>,
}

/// A block of atoms and the elastic foundation below it, lattice constants, and its relaxation. The foundation moves a prescribed base unless the
/// base is elastic.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct BlockSize {
    pub cells: usize,
    pub depth_cells: usize,
    #[serde(default, skip_serializing_if = "asperity_surface::files::json::is_default")]
    pub foundation_cells: usize,
    #[serde(default, skip_serializing_if = "asperity_surface::files::json::is_default")]
    pub elastic_base: bool,
    #[serde(default, skip_serializing_if = "asperity_surface::files::json::is_default")]
    pub minimizer: Minimizer,
}

impl BlockSize {
    /// Ends the name of a block on an elastic base.
    pub const ELASTIC: &str = "-elastic";

    /// Ends of the names of blocks with these minimisers.
    pub const MINIMIZERS: [(&str, Minimizer); 2] = [("-harmonic", Minimizer::Harmonic), ("-fire", Minimizer::Fire)];
}

impl std::fmt::Display for BlockSize {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}x{}", self.cells, self.depth_cells)?;
        match self.foundation_cells {
            0 => Ok(()),
            depth => write!(f, "+{depth}{}", if self.elastic_base { BlockSize::ELASTIC } else { "" }),
        }?;
        let relaxed = BlockSize::MINIMIZERS.iter().find(|(_, minimizer)| *minimizer == self.minimizer);
        write!(f, "{}", relaxed.map_or("", |(end, _)| end))
    }
}

/// Cost of a setting for all loads, including the observables: minimum over its repeats.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct MeasuredCost {
    pub wall_seconds: f64,
    pub cpu_seconds: f64,
    /// Processor time over that of the reference.
    pub cpu_over_reference: f64,
    /// Number of all loads together.
    pub fft_pairs: f64,
    pub iterations: usize,
    pub planned_bytes: u64,
    /// Increase of the peak resident set, and resident set before, bytes.
    pub measured_bytes: u64,
    pub resident_before_bytes: u64,
    /// Number of runs, of which this is the minimum.
    pub runs: usize,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub atoms: Option<AtomsCost>,
}

/// Cost of LAMMPS.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AtomsCost {
    /// Deformable, fixed and indenter atoms.
    pub atoms: u64,
    /// Number for all loads together.
    pub force_evaluations: usize,
    pub lammps_cpu_seconds: f64,
    /// Size of the frames on disk, bytes.
    pub frame_bytes: u64,
}

/// Reference solution.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reference {
    #[serde(flatten)]
    pub setting: Setting,
    pub cost: MeasuredCost,
    /// Points along x of the coarser grids used for the extrapolation, coarse to fine.
    pub coarser: Vec<usize>,
    pub loads: Vec<ReferenceLoad>,
    /// Uncertainty, root mean square over the loads: the change by extrapolation, or the change from the grid with
    /// half the points along each side. Absent without coarser grids.
    pub uncertainty: Errors,
}

/// A value extrapolated from a series of grids.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Extrapolation {
    pub value: f64,
    /// Value on the finest grid.
    pub finest: f64,
    /// Difference between the finest grid and the extrapolated value or, without extrapolation, the next coarser
    /// grid; absent for a single grid.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub uncertainty: Option<f64>,
    /// Order of convergence in the grid spacing, if the changes have one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub order: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ReferenceLoad {
    pub p_star: f64,
    /// Contact fraction, mean gap in m, stiffness in Pa/m.
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
    /// Whether this is the reference; its errors are its uncertainty.
    pub is_reference: bool,
    /// Reason for missing errors.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unavailable_reason: Option<String>,
    pub missing: Missing,
    pub cost: MeasuredCost,
    /// Root mean square over the loads.
    pub errors: Errors,
    pub loads: Vec<LoadErrors>,
    /// For atoms: errors against the solution on the heights that they resolve.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub resolved: Option<ResolvedErrors>,
}

/// Errors against the half-space solution on the heights that the indenter of a block resolves, without shorter
/// waves.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ResolvedErrors {
    /// Shortest wavelength of these heights over L, and their rms gradient.
    pub shortest_wavelength: f64,
    pub gradient: f64,
    /// Points along each side of that solution, which is not extrapolated.
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

//! The section `[atoms]` of a scene.

use super::nvt::NvtScene;
use super::quantity::{Energy, Force, Length, Stress, Time};
use asperity_atoms::block::BaseKind;
use asperity_atoms::job_spec::{FORCE_TOLERANCE, Minimizer};
use schemars::JsonSchema;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};
use std::path::PathBuf;

/// The block of atoms, its indenter and its simulation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct AtomsScene {
    /// Cubic cells along x and along y; the cell of the profile is scaled to this many lattice constants.
    pub cells: usize,
    /// Deformable cubic cells along z. An elastic base adds moving layers below them: two cells for the shipped potential.
    pub depth_cells: usize,
    /// Cubic cells of elastic foundation between the deformable cells and the fixed plane, or "half-space". 0: the base is rigid.
    #[serde(skip_serializing_if = "asperity_surface::files::json::is_default", deserialize_with = "foundation")]
    pub foundation_cells: Foundation,
    /// The lowest layers of the block. Default: prescribed on a foundation, otherwise rigid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub base: Option<BaseKind>,
    /// Hardness of the crystal: the compliant-wall continuum is solved with it, too, as a step of the model chain.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hardness: Option<Stress>,
    /// An eam/alloy file instead of the shipped calcium-like one. Relative to the scene file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub potential: Option<PathBuf>,
    /// Element of the block in that file.
    pub element: String,
    /// Lattice constant at 0 K of another potential: within 1 % of the one that LAMMPS measures for it. Default: that one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lattice_constant: Option<Length>,
    /// Contact modulus E* of the (001) face of another potential: the harmonic mean over the directions of waves in the face, which
    /// axisymmetric and isotropically rough contacts have, not the modulus along `[100]`. Within 1 % of what LAMMPS measures. Default: that.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub modulus: Option<Stress>,
    /// Lennard-Jones energy of an indenter atom and an atom of the block. Default: the challenge's 0.2145 eV, with another potential in
    /// proportion to E* a0³.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub indenter_epsilon: Option<Energy>,
    /// Lennard-Jones length of an indenter atom and an atom of the block. Default: the challenge's 3.5927 Å, with another potential in
    /// proportion to the lattice constant.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub indenter_sigma: Option<Length>,
    /// Distance from an indenter atom within which an atom is in contact; not below the start of the repulsion, 2^(1/6) σ. Default: the
    /// challenge's 4.0354 Å, in proportion to σ.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact_distance: Option<Length>,
    /// Shortest wavelength of the indenter. Default: four spacings of its atoms.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub low_pass: Option<Length>,
    /// Treatment of the gradient that atoms cannot resolve.
    pub slope: Slope,
    /// Initial configuration of each load. Default: the continuum's solution; with adhesion, where states depend on the load history,
    /// and with `step`, first contact.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start: Option<AtomsStart>,
    /// Descent of the indenter per load step from first contact. Default: 0.3 Å.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step: Option<Length>,
    /// Largest force on any atom in an equilibrium. Above 0.002 eV/Å a load that starts from the continuum ends where no force is larger
    /// than a quarter of it and indenter and base carry the load to a thousandth.
    pub force_tolerance: Force,
    /// Relaxation of the load steps.
    pub minimizer: Minimizer,
    /// Range of the pair adhesion. The scaled range is often shorter than the repulsion of the atoms allows: see the scaling audit.
    pub adhesion_range: Length,
    /// Normal force from which an atom counts as loaded. Default: ten times the force tolerance, at most 0.02 eV/Å.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact_force: Option<Force>,
    /// Standard deviation of the Gaussian that makes a stress field of the indenter's forces. Default: the lattice constant.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stress_width: Option<Length>,
    /// Count defect atoms (centro-symmetry) at every step. Frames then contain the whole deformable block.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub plasticity: bool,
    /// Solve the matched continuum on a half-space, too, for the effect of the block's finite depth on contact and mean gap. With a target
    /// of either in accuracy.error it is solved anyway. Not with continuum.layer.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub depth_error: bool,
    /// Default: the atoms stay at 0 K.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nvt: Option<NvtScene>,
    /// MPI ranks.
    pub ranks: usize,
    /// Wall-clock limit of the LAMMPS stage.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_limit: Option<Time>,
    /// The LAMMPS program.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub program: Option<PathBuf>,
}

/// Largest elastic foundation, lattice constants: a half-space to any block.
pub const MOST_FOUNDATION_CELLS: usize = 1_000_000;

/// Depth of a half-space in edges of the block: the longest wave is as stiff as on a half-space to rounding.
pub const HALF_SPACE_EDGES: usize = 4;

/// Depth of the foundation below the deformable cells.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Foundation {
    /// Lattice constants.
    Cells(usize),
    Word(HalfSpaceWord),
}

/// A foundation that is as deep as every wave of the block needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum HalfSpaceWord {
    HalfSpace,
}

impl Default for Foundation {
    fn default() -> Self {
        Foundation::Cells(0)
    }
}

/// Reads a depth. The message of an untagged value does not say "expected".
fn foundation<'de, D: Deserializer<'de>>(from: D) -> Result<Foundation, D::Error> {
    let wrong = |_| D::Error::custom("no depth, expected lattice constants, as 12, or \"half-space\"");
    Foundation::deserialize(from).map_err(wrong)
}

impl Default for AtomsScene {
    fn default() -> Self {
        AtomsScene {
            cells: 45,
            depth_cells: 12,
            foundation_cells: Foundation::Cells(0),
            base: None,
            hardness: None,
            potential: None,
            element: "Ca".into(),
            lattice_constant: None,
            modulus: None,
            indenter_epsilon: None,
            indenter_sigma: None,
            contact_distance: None,
            low_pass: None,
            slope: Slope::Literal,
            start: None,
            step: None,
            force_tolerance: Force::new(FORCE_TOLERANCE, "eV/Å"),
            minimizer: Minimizer::Auto,
            adhesion_range: Length::new(0.5, "Å"),
            contact_force: None,
            stress_width: None,
            plasticity: false,
            depth_error: false,
            nvt: None,
            ranks: 1,
            time_limit: None,
            program: None,
        }
    }
}

impl AtomsScene {
    /// Depth of the foundation, lattice constants.
    pub fn foundation_depth(&self) -> usize {
        match self.foundation_cells {
            Foundation::Cells(cells) => cells,
            Foundation::Word(HalfSpaceWord::HalfSpace) => self.cells.saturating_mul(HALF_SPACE_EDGES),
        }
    }

    /// Å.
    pub fn step_or_default(&self) -> f64 {
        self.step.map_or(0.3, |step| step.to("Å"))
    }

    /// Where the atoms of a load start from, where the bodies attract each other or not.
    pub fn start_or_default(&self, attracts: bool) -> AtomsStart {
        let steps = attracts || self.step.is_some();
        self.start.unwrap_or(if steps { AtomsStart::Touch } else { AtomsStart::Continuum })
    }
}

/// Treatment of the gradient that atoms cannot resolve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Slope {
    /// The profile as it is, low-passed: the resolved gradient is smaller than the whole spectrum's.
    Literal,
    /// The resolved gradient is scaled back to the whole spectrum's: contact stresses exceed the crystal's strength at once.
    Renormalised,
}

/// Initial configuration of the atoms at a load.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum AtomsStart {
    /// The continuum's solution at that load. The indenter then finds its height under the load.
    Continuum,
    /// First contact: the indenter descends step by step, and the loads are interpolated between two steps.
    Touch,
}

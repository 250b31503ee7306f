//! Contact solvers behind one trait.
//!
//! A method receives a [`Problem`] (grid, heights, kernel, interaction), never a scene. A new method is one file and one
//! line in [`REGISTRY`]. States are borrowed, not copied. A quantity that a method does not support has a stated reason.

pub mod all_atom;
mod bem_bspline;
mod bicgstab;
mod bvm;
mod card;
mod estimate;
mod experiment;
mod fast;
mod fft_ia;
mod fields;
mod gfmd;
mod gfmd_fire;
mod icha;
mod iteration;
mod ms_archard;
mod operator;
mod persson;
mod problem;
mod quadrature;
mod require;
mod residuals;
mod rl_archard;
mod scgw;
mod settings;
mod sinusoid;
mod spots;
mod srgw;
mod sweep;
mod winkler;

pub use bem_bspline::BemBsplineSettings;
pub use bicgstab::BicgstabSettings;
pub use card::{Card, Criterion, Kind, Needs, Quantity, Support};
pub use estimate::{Estimate, Estimator, Started};
pub use fft_ia::FftIaSettings;
pub use problem::{
    CoarseState, ErrorEstimates, Heights, Iteration, NoObserver, Observer, Plan, Precision, Problem, Run, SnapshotRef,
    SolverSnapshot, State, Stop, Targets,
};

pub use experiment::ExperimentSettings;
pub use icha::IchaSettings;
pub use ms_archard::MsArchardSettings;
pub use persson::{PerssonForm, PerssonSettings};
pub use rl_archard::RlArchardSettings;
pub use settings::Settings;
pub use srgw::SrgwSettings;
pub use winkler::WinklerSettings;

pub use crate::load::Load;

use crate::Result;
use crate::interface::Adhesion;

/// A method for the contact problem.
pub trait ContactMethod: Sync {
    /// Properties of the method: inputs, contact criterion, supported quantities, sources.
    fn card(&self) -> &'static Card;

    /// Contact criterion with these settings; that of the card unless a setting changes it.
    fn criterion(&self, _settings: &Settings) -> Criterion {
        self.card().criterion
    }

    /// Data to which constants were fitted, with these settings; as on the card unless a setting replaces a constant.
    fn calibrated_on(&self, _settings: &Settings) -> Option<&'static str> {
        self.card().calibrated_on
    }

    /// Adhesion law that the method uses; that of the problem unless the method adapts it to the grid.
    fn adhesion(&self, problem: &Problem) -> Adhesion {
        problem.adhesion
    }

    /// Memory and iterations expected, computed before anything is allocated.
    fn plan(&self, problem: &Problem) -> Plan;

    /// Allocates the fields. The first load starts from first contact or, in `fast`, from coarser grids.
    ///
    /// # Errors
    /// `Input` for a problem that the method does not support.
    fn start<'p>(&self, problem: &'p Problem<'p>, observer: &'p dyn Observer) -> Result<Started<'p>>;
}

/// All methods, in the order of the tables.
pub const REGISTRY: &[&dyn ContactMethod] = &[
    &fast::Fast,
    &gfmd::Gfmd,
    &bvm::Bvm,
    &gfmd_fire::GfmdFire,
    &fft_ia::FftIa,
    &bicgstab::Bicgstab,
    &bem_bspline::BemBspline,
    &winkler::Winkler,
    &srgw::Srgw,
    &icha::Icha,
    &persson::Persson,
    &scgw::Scgw,
    &ms_archard::MsArchard,
    &rl_archard::RlArchard,
    &experiment::Experiment,
    &all_atom::AllAtom,
];

/// The method with this id; `auto` is the fastest field solver.
pub fn find(id: &str) -> Option<&'static dyn ContactMethod> {
    if id == "auto" {
        return Some(&fast::Fast);
    }
    REGISTRY.iter().find(|m| m.card().id == id).copied()
}

/// All ids, for error messages.
pub fn ids() -> Vec<&'static str> {
    std::iter::once("auto").chain(REGISTRY.iter().map(|m| m.card().id)).collect()
}

/// Factor on the iterations for adhesion that the grid does not resolve: 4 to 10 on 512² with the challenge's adhesion.
fn adhesion_effort(problem: &Problem) -> usize {
    if problem.adhesion == Adhesion::None { 1 } else { 6 }
}

//! Contact solvers behind one trait.
//!
//! A method sees a [`Problem`] (grid, heights, kernel, interaction), never a scene; a new method is one file and one line
//! in [`REGISTRY`]. States are lent, not copied; what a method cannot deliver is a value with a reason.

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

/// A way of solving the contact problem.
pub trait ContactMethod: Sync {
    fn card(&self) -> &'static Card;

    /// What counts as contact under these settings: what the card says, unless a setting moves it.
    fn criterion(&self, _settings: &Settings) -> Criterion {
        self.card().criterion
    }

    /// What constants were fitted to under these settings: what the card says, unless a setting takes the place of a
    /// constant.
    fn calibrated_on(&self, _settings: &Settings) -> Option<&'static str> {
        self.card().calibrated_on
    }

    /// Law of the adhesion that the method works with: the problem's, unless it changes it for the grid.
    fn adhesion(&self, problem: &Problem) -> Adhesion {
        problem.adhesion
    }

    /// Bytes and iterations, before anything is allocated.
    fn plan(&self, problem: &Problem) -> Plan;

    /// Allocates. The first load is reached from first touch, or, by methods that say so, from coarser grids.
    fn start<'p>(&self, problem: &'p Problem<'p>, observer: &'p dyn Observer) -> Result<Started<'p>>;
}

/// Every method, in the order in which tables list them.
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

/// The method of that id; `auto` is the fastest that delivers fields.
pub fn find(id: &str) -> Option<&'static dyn ContactMethod> {
    if id == "auto" {
        return Some(&fast::Fast);
    }
    REGISTRY.iter().find(|m| m.card().id == id).copied()
}

/// All ids, for messages.
pub fn ids() -> Vec<&'static str> {
    std::iter::once("auto").chain(REGISTRY.iter().map(|m| m.card().id)).collect()
}

/// How many times more iterations adhesion takes that the grid does not resolve: 4 to 10 on 512² at the challenge's.
fn adhesion_effort(problem: &Problem) -> usize {
    if problem.adhesion == Adhesion::None { 1 } else { 6 }
}

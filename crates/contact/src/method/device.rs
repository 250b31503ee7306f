use super::require::refused;
use super::{MethodCard, ReducedProblem};
use crate::interface::{AttractionLaw, Elastic, Wall};
use asperity_grid::{Error, Result};
use serde::Serialize;
use std::sync::OnceLock;

/// Processor on which the fields are solved. A choice of the process, as the number of threads is. Results agree within the
/// tolerance of the solve.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum Device {
    /// The processor's cores
    #[default]
    Cpu,
    /// An NVIDIA GPU (method `fast`; program built with the feature `cuda`)
    Cuda,
}

static CHOSEN: OnceLock<Device> = OnceLock::new();

/// Grids with fewer points stay on the processor: there starting a kernel takes longer than running it.
const SMALLEST: usize = 512 * 512;

impl Device {
    /// Chooses the device of this process; the first choice holds.
    pub fn choose(self) {
        CHOSEN.get_or_init(|| self);
    }

    pub fn chosen() -> Self {
        CHOSEN.get().copied().unwrap_or_default()
    }

    /// The device on which a method solves a problem: the chosen one, where it is supported and the grid is large enough.
    pub fn of(problem: &ReducedProblem, card: &MethodCard) -> Self {
        let large = problem.grid.points() >= SMALLEST;
        if large && Self::chosen() == Device::Cuda && on_gpu(problem, card).is_ok() {
            Device::Cuda
        } else {
            Device::Cpu
        }
    }

    /// Whether the chosen device has what the problem of a scene or command needs. Auxiliary solves that a GPU does not
    /// support run on the processor.
    ///
    /// # Errors
    /// `Input` that names what a GPU does not support.
    pub fn check(problem: &ReducedProblem, card: &MethodCard) -> Result<()> {
        match Self::chosen() {
            Device::Cpu => Ok(()),
            Device::Cuda => on_gpu(problem, card),
        }
    }

    /// Whether a grid is large enough for a GPU.
    #[cfg(feature = "cuda")]
    pub(super) fn takes(points: usize) -> bool {
        points >= SMALLEST
    }
}

/// # Errors
/// `Input` for what has no kernels.
fn on_gpu(problem: &ReducedProblem, card: &MethodCard) -> Result<()> {
    if !cfg!(feature = "cuda") {
        let accepted = "cpu: this program was built without the feature cuda (cargo build --release --features cuda)";
        return Err(Error::input("command line", "--device", "cuda", accepted));
    }
    if !card.capabilities.gpu {
        return Err(refused(card.id, "--device", "cuda", "cpu: of the solvers `fast` alone runs on a GPU"));
    }
    let (key, found, accepted) = match (problem.wall, problem.adhesion, problem.hardness) {
        (_, _, Some(hardness)) => ("hardness", format!("{:e} E*", hardness.mean()), "none"),
        (Wall::Hard, AttractionLaw::None | AttractionLaw::Exponential(_), None) => match problem.kernel {
            Elastic::NonPeriodic(_) => ("body", problem.kernel.to_string(), "a periodic cell"),
            _ => return Ok(()),
        },
        (Wall::Hard, law, None) => ("adhesion", law.to_string(), "none or the exponential law"),
        (wall, _, None) => ("wall", wall.to_string(), "a hard wall"),
    };
    Err(refused(card.id, key, found, format!("{accepted} with --device cuda; --device cpu has all")))
}

/// The GPU of this machine, or why there is none to be used.
pub fn gpu() -> String {
    #[cfg(feature = "cuda")]
    return asperity_grid::sys::gpu::card().unwrap_or_else(|reason| format!("not usable: {reason}"));
    #[cfg(not(feature = "cuda"))]
    return "not used: this program was built without the feature cuda".into();
}

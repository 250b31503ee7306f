use crate::method::Precision;
use crate::sys::gpu::{Failure, Gpu};
use crate::{Error, Result};
use std::cell::RefCell;

/// Kernels of `kernels.cu`.
const KERNELS: [&str; 14] = [
    "apply_step",
    "shifted",
    "padded",
    "clipped",
    "trial",
    "plain",
    "begin",
    "conjugate",
    "descend",
    "step_along_direction",
    "stress",
    "displaced",
    "multiplied",
    "refined",
];

/// A GPU with the kernels of a precision and a law, and its first failure.
pub(super) struct Kernels {
    pub gpu: Gpu,
    /// Work of adhesion, E* L; zero without adhesion.
    pub work_of_adhesion: f64,
    failure: RefCell<Option<Failure>>,
}

impl Kernels {
    /// Compiles the kernels for a precision of the state.
    ///
    /// # Errors
    /// `MissingProgram` without CUDA or a GPU.
    pub(super) fn compiled(precision: Precision, work_of_adhesion: f64) -> Result<Self> {
        let real = if precision == Precision::F64 { "double" } else { "float" };
        let definitions = [format!("REAL={real}"), format!("LAW={}", i32::from(work_of_adhesion != 0.0))];
        let gpu = Gpu::open(include_str!("kernels.cu"), &definitions, &KERNELS);
        let gpu = gpu.map_err(|how| Error::MissingProgram { program: "CUDA".into(), how })?;
        Ok(Kernels { gpu, work_of_adhesion, failure: RefCell::default() })
    }

    /// The value, or `otherwise` after a failure, which is kept. After the first one nothing is done.
    pub(super) fn attempt<V>(&self, otherwise: V, action: impl FnOnce() -> std::result::Result<V, Failure>) -> V {
        if self.failure.borrow().is_some() {
            return otherwise;
        }
        action().unwrap_or_else(|failure| {
            *self.failure.borrow_mut() = Some(failure);
            otherwise
        })
    }

    /// Why the GPU failed, if it did: results since then are not numbers.
    pub(super) fn failure(&self) -> Option<Error> {
        let said = self.failure.borrow_mut().take()?;
        Some(Error::Gpu { name: self.gpu.name(), said })
    }
}

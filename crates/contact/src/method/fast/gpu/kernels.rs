use crate::method::Precision;
use asperity_grid::sys::gpu::{Failure, Gpu, missing_library};
use asperity_grid::{Error, Result};
use std::cell::RefCell;

/// Kernels of `kernels.cu`.
const KERNELS: [&str; 14] = [
    "apply_step",
    "shifted",
    "copy_to_work",
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
    pub gpu: &'static Gpu,
    /// Work of adhesion, E* L; zero without adhesion.
    pub work_of_adhesion: f64,
    failure: RefCell<Option<Failure>>,
}

impl Kernels {
    /// Compiles the kernels for a precision of the state, or takes those that were.
    ///
    /// # Errors
    /// `MissingProgram` without the libraries of CUDA, `Gpu` if the card or the compilation fails.
    pub(super) fn compiled(precision: Precision, work_of_adhesion: f64) -> Result<Self> {
        if let Some(library) = missing_library() {
            let remedy = format!("{library} is missing (LD_LIBRARY_PATH names its folder)");
            return Err(Error::MissingProgram { program: "CUDA".into(), how: remedy });
        }
        let real = if precision == Precision::F64 { "double" } else { "float" };
        let definitions = format!("-DREAL={real} -DLAW={}", i32::from(work_of_adhesion != 0.0));
        let gpu = Gpu::with_kernels(include_str!("kernels.cu"), &definitions, &KERNELS);
        let gpu = gpu.map_err(|message| Error::Gpu { name: "the GPU".into(), said: message })?;
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

    pub(super) fn has_failed(&self) -> bool {
        self.failure.borrow().is_some()
    }

    /// Why the GPU failed, if it did: results since then are not numbers.
    pub(super) fn failure(&self) -> Option<Error> {
        let message = self.failure.borrow().clone()?;
        Some(Error::Gpu { name: self.gpu.name(), said: message })
    }
}

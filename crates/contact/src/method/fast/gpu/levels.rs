use super::fields::OnGpu;
use super::kernels::Kernels;
use crate::interface::Law;
use crate::method::{ContactMethod, Device, Precision, ReducedProblem};
use asperity_grid::{Error, Result};
use asperity_grid::{Grid, Real};

use super::super::fields::LevelFields;
use super::super::host::LevelProblem;

/// Makes levels on a GPU, for a problem.
pub(crate) struct GpuLevels(Kernels);

impl GpuLevels {
    /// With the GPU, if one is chosen and solves the problem.
    ///
    /// # Errors
    /// `MissingProgram` without CUDA, `Gpu` if the card or the compilation fails, `Memory` if its memory is too small.
    pub(crate) fn open(problem: &ReducedProblem) -> Result<Option<Self>> {
        if Device::of(problem, super::super::Fast.card()) == Device::Cpu {
            return Ok(None);
        }
        let kernels = Kernels::compiled(problem.precision, problem.adhesion.work_of_adhesion())?;
        let required = match problem.precision {
            Precision::F32 => OnGpu::<f32>::bytes(&kernels, problem),
            Precision::F64 => OnGpu::<f64>::bytes(&kernels, problem),
        };
        let failed = |message| Error::Gpu { name: kernels.gpu.name(), said: message };
        let (required, available) = (required.map_err(failed)?, kernels.gpu.free_bytes().map_err(failed)?);
        if required > available {
            let description = format!("the solve on {}", kernels.gpu.name());
            let advice = "a coarser grid, precision f32, or --device cpu needs less".into();
            return Err(Error::Memory { what: description, need: required, have: available, advice });
        }
        Ok(Some(GpuLevels(kernels)))
    }

    /// Whether a grid is solved on the GPU.
    pub(crate) fn takes(&self, grid: Grid) -> bool {
        Device::takes(grid.points())
    }

    pub(crate) fn with_gap<'h, T: Real, L: Law + 'h>(
        &'h self,
        grid: Grid,
        body: LevelProblem<'h, T, L>,
        gap: Vec<T>,
    ) -> Box<dyn LevelFields<T> + 'h> {
        Box::new(OnGpu::new(&self.0, grid, body, gap))
    }

    /// Fourier interpolation of the displacement of a coarser grid with this gap; overlap is set to zero.
    pub(crate) fn refined<'h, T: Real, L: Law + 'h>(
        &'h self,
        grid: Grid,
        body: LevelProblem<'h, T, L>,
        (old, gap): (Grid, &[T]),
    ) -> Box<dyn LevelFields<T> + 'h> {
        let mut fine = OnGpu::new(&self.0, grid, body, Vec::new());
        fine.interpolate(old, gap);
        Box::new(fine)
    }

    /// Why the GPU failed, if it did: results since then are not numbers.
    pub(crate) fn failure(&self) -> Option<Error> {
        self.0.failure()
    }
}

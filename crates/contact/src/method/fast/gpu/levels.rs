use super::fields::OnGpu;
use super::kernels::Kernels;
use crate::interface::Law;
use crate::method::{Device, Precision, Problem};
use asperity_grid::{Error, Result};
use asperity_grid::{Grid, Real};

use super::super::fields::Fields;
use super::super::host::Body;

/// Makes levels on a GPU, for a problem.
pub(crate) struct GpuLevels(Kernels);

impl GpuLevels {
    /// With the GPU, if one is chosen and solves the problem.
    ///
    /// # Errors
    /// `MissingProgram` without CUDA, `Gpu` if the card or the compilation fails, `Memory` if its memory is too small.
    pub(crate) fn open(problem: &Problem) -> Result<Option<Self>> {
        if Device::of(problem, &super::super::CARD) == Device::Cpu {
            return Ok(None);
        }
        let kernels = Kernels::compiled(problem.precision, problem.adhesion.work_of_adhesion())?;
        let need = match problem.precision {
            Precision::F32 => OnGpu::<f32>::bytes(&kernels, problem),
            Precision::F64 => OnGpu::<f64>::bytes(&kernels, problem),
        };
        let failed = |said| Error::Gpu { name: kernels.gpu.name(), said };
        let (need, have) = (need.map_err(failed)?, kernels.gpu.free_bytes().map_err(failed)?);
        if need > have {
            let what = format!("the solve on {}", kernels.gpu.name());
            let advice = "a coarser grid, precision f32, or --device cpu needs less".into();
            return Err(Error::Memory { what, need, have, advice });
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
        body: Body<'h, T, L>,
        gap: Vec<T>,
    ) -> Box<dyn Fields<T> + 'h> {
        Box::new(OnGpu::new(&self.0, grid, body, gap))
    }

    /// Fourier interpolation of the displacement of a coarser grid with this gap; overlap is set to zero.
    pub(crate) fn refined<'h, T: Real, L: Law + 'h>(
        &'h self,
        grid: Grid,
        body: Body<'h, T, L>,
        (old, gap): (Grid, &[T]),
    ) -> Box<dyn Fields<T> + 'h> {
        let mut fine = OnGpu::new(&self.0, grid, body, Vec::new());
        fine.interpolate(old, gap);
        Box::new(fine)
    }

    /// Why the GPU failed, if it did: results since then are not numbers.
    pub(crate) fn failure(&self) -> Option<Error> {
        self.0.failure()
    }
}

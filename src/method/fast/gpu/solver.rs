use super::super::fields::Fields;
use super::super::host::Body;
use super::fields::OnGpu;
use super::kernels::Kernels;
use crate::grid::{Grid, Real};
use crate::interface::{Adhesion, Elastic, Law, Wall};
use crate::method::require::refused;
use crate::method::{Device, Precision, Problem};
use crate::{Error, Result};

/// Grids with fewer points stay on the host: there a kernel takes less time than its start.
const SMALLEST: usize = 512 * 512;

/// A GPU with the kernels of a problem.
pub(crate) struct GpuSolver(Kernels);

impl GpuSolver {
    /// The GPU, if one is chosen.
    ///
    /// # Errors
    /// `Input` for what its kernels lack, `MissingProgram` without a GPU, `Memory` if its memory is too small.
    pub(crate) fn open(problem: &Problem) -> Result<Option<Self>> {
        if Device::chosen() == Device::Cpu {
            return Ok(None);
        }
        let refuse = |key: &str, found: String, accepted: &str| {
            Err(refused("fast", key, found, format!("{accepted} with --device cuda; --device cpu has all")))
        };
        match (problem.wall, problem.adhesion, problem.hardness) {
            (Wall::Hard, Adhesion::None | Adhesion::Exponential(_), None) => {}
            (Wall::Hard, law, None) => return refuse("adhesion", law.to_string(), "none or exponential"),
            (wall, _, None) => return refuse("wall", wall.to_string(), "a hard wall"),
            (_, _, Some(hardness)) => return refuse("hardness", format!("{:e} E*", hardness.mean()), "none"),
        }
        if let Elastic::NonPeriodic(_) = problem.kernel {
            return refuse("body", problem.kernel.to_string(), "a periodic cell");
        }
        let kernels = Kernels::compiled(problem.precision, problem.adhesion.work_of_adhesion())?;
        let need = match problem.precision {
            Precision::F32 => OnGpu::<f32>::bytes(problem),
            Precision::F64 => OnGpu::<f64>::bytes(problem),
        };
        let (have, name) = (kernels.gpu.free_bytes(), kernels.gpu.name());
        let have = have.map_err(|said| Error::Gpu { name: name.clone(), said })?;
        if need > have {
            let advice = "a coarser grid, precision f32, or --device cpu needs less".into();
            return Err(Error::Memory { what: format!("the solve on {name}"), need, have, advice });
        }
        Ok(Some(GpuSolver(kernels)))
    }

    /// Whether a grid is solved on the GPU.
    pub(crate) fn takes(&self, grid: Grid) -> bool {
        grid.points() >= SMALLEST
    }

    pub(crate) fn with_gap<'h, T: Real, L: Law + 'h>(
        &'h self,
        grid: Grid,
        body: Body<'h, T, L>,
        gap: Vec<T>,
    ) -> Box<dyn Fields<T> + 'h> {
        Box::new(OnGpu::new(&self.0, grid, body, gap))
    }

    /// Fourier interpolation of the displacement of a coarser grid, with overlap set to zero.
    pub(crate) fn refined<'h, T: Real, L: Law + 'h>(
        &'h self,
        grid: Grid,
        body: Body<'h, T, L>,
        mut coarse: Box<dyn Fields<T> + 'h>,
    ) -> Box<dyn Fields<T> + 'h> {
        let mut fine = OnGpu::new(&self.0, grid, body, Vec::new());
        let old = coarse.grid();
        let gap = std::mem::take(coarse.gap_mut());
        drop(coarse);
        fine.interpolate(old, &gap);
        Box::new(fine)
    }

    /// Why the GPU failed, if it did: results since then are not numbers.
    pub(crate) fn failure(&self) -> Option<Error> {
        self.0.failure()
    }
}

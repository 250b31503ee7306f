//! Levels on a GPU (feature `cuda`). Coarse grids stay on the host.

#[cfg(not(feature = "cuda"))]
mod absent;
#[cfg(feature = "cuda")]
mod fields;
#[cfg(feature = "cuda")]
mod kernels;
#[cfg(feature = "cuda")]
mod solver;

#[cfg(not(feature = "cuda"))]
pub(super) use absent::GpuSolver;
#[cfg(feature = "cuda")]
pub(super) use solver::GpuSolver;

//! Levels on a GPU (feature `cuda`). Coarse grids stay on the host.

#[cfg(not(feature = "cuda"))]
mod absent;
#[cfg(feature = "cuda")]
mod fields;
#[cfg(feature = "cuda")]
mod kernels;
#[cfg(feature = "cuda")]
mod levels;
#[cfg(all(test, feature = "cuda"))]
mod tests;

#[cfg(not(feature = "cuda"))]
pub(super) use absent::GpuLevels;
#[cfg(feature = "cuda")]
pub(super) use levels::GpuLevels;

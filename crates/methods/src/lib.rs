#![doc = include_str!("../README.md")]

pub mod all_atom;
mod bem_bspline;
mod bicgstab;
mod experiment;
mod fft_ia;
mod gfmd_fire;
mod icha;
mod ms_archard;
mod persson;
mod prelude;
mod quadrature;
mod registry;
mod rl_archard;
mod scgw;
mod sinusoid;
mod spots;
mod srgw;
mod winkler;

pub use asperity_grid::{Error, Result};
pub use registry::{REGISTRY, find, ids};

#![doc = include_str!("../README.md")]

pub mod estimated;
pub mod interface;
pub mod load;
pub mod measured_errors;
pub mod method;
pub mod observe;
pub mod observed;
pub mod path;
pub mod problem;
pub mod quantity;
pub mod reached;
pub mod results;
pub mod scalars;
pub mod state;
pub mod uncertainty;

pub use asperity_grid::{Error, Result};

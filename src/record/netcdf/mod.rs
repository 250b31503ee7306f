//! NetCDF-4 files of runs.

mod curves;
pub mod run;

//! Results of runs and their files: `results.json`, tables, NetCDF, XDMF, frames.
//!
//! All files are written atomically ([`asperity_surface::files::atomic_file`]): a reader finds the old file or the complete new one.

pub mod acceptance;
pub mod bibliography;
pub mod comparison;
pub mod downsample;
pub mod ensemble;
pub mod given_loads;
pub mod load_table;
pub mod methods;
pub mod netcdf;
pub mod results;
pub mod surface;
pub mod tradeoff;
pub mod written;
pub mod xdmf;
pub mod xyz;

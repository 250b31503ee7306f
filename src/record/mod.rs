//! File formats: height maps, fields, curves, atoms, recordings, and `results.json`.
//!
//! All files are written atomically ([`atomic_file`]): a reader finds the old file or the complete new one.

pub mod acceptance;
pub mod advice;
pub mod atomic_file;
pub mod atomistic;
pub mod comparison;
pub mod continuum;
pub mod csv;
pub mod declared;
pub mod downsample;
pub mod ensemble;
pub mod file_lock;
pub mod hashed;
pub mod height_map;
pub mod heights;
pub mod import;
pub mod json;
pub mod load_table;
pub mod mcap;
pub mod measured_errors;
pub mod methods;
pub mod netcdf;
pub mod npy;
pub mod provenance;
pub mod quantity;
pub mod results;
pub mod state_numbers;
pub mod surface;
pub mod tradeoff;
pub mod uncertainty;
pub mod user_cache;
pub mod xyz;
mod xyz_text;

//! File formats: height maps, fields, curves, atoms, recordings, and `results.json`.
//!
//! All files are written atomically ([`atomic_file`]): a reader finds the old file or the complete new one.

pub mod acceptance;
pub mod comparison;
pub mod downsample;
pub mod ensemble;
pub mod load_table;
pub mod mcap;
pub mod methods;
pub mod netcdf;
pub mod results;
pub mod surface;
pub mod tradeoff;
pub mod xyz;

pub use asperity_atoms::results as atomistic;
pub use asperity_contact::{measured_errors, quantity, results as continuum, state_numbers, uncertainty};
pub use asperity_surface::files::{atomic_file, csv, file_lock, hashed, json, npy, user_cache};
pub use asperity_surface::{declared, height_map, heights, import, provenance};

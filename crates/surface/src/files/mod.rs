//! Files: atomic writing, JSON, arrays of numpy, NetCDF-4, CSV, hashes, locks, folders of others, and the user's cache.
//!
//! All files are written atomically ([`atomic_file`]): a reader finds the old file or the complete new one.

pub mod atomic_file;
pub mod beneath;
pub mod csv;
pub mod file_lock;
pub mod hashed;
pub mod inside;
pub mod json;
pub mod netcdf;
pub mod npy;
pub(crate) mod number;
pub mod processes;
pub mod user_cache;

//! Files that others read: height maps, fields, curves, atoms, recordings, and `results.json`.
//!
//! Every writer lands its file by rename ([`land`]), so a reader sees the old file or the whole new one.

pub mod advice;
pub mod atomistic;
pub mod budget;
pub mod csv;
pub mod heights;
pub mod import;
pub mod json;
pub mod judged;
pub mod land;
pub mod mcap;
pub mod methods;
pub mod netcdf;
pub mod npy;
pub mod reduce;
pub mod results;
pub mod tradeoff;
mod triples;
pub mod xyz;

/// For serde: what stands at its default is left out of a file.
pub(crate) fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

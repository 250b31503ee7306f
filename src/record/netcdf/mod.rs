//! NetCDF-4 files: arrays with named dimensions, coordinates, units and attributes, which are HDF5 files as well.
//!
//! xarray opens one with `xarray.open_dataset(path, engine="h5netcdf")`, h5py as any HDF5 file with dimension scales. All
//! sizes are known before the first byte, so that a file is written from front to back and no map is held: fields come row by
//! row from the `.npy` files of a run.
//!
//! The layout follows the HDF5 file format specification, version 3.0, in its oldest form (superblock 0, object headers 1),
//! and appendix "NetCDF-4 format" of the NetCDF user's guide for dimensions.

mod file;
mod layout;
pub mod run;
mod variable;

pub use file::write;
pub use variable::{Attribute, Data, Variable};

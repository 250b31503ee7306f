//! NetCDF-4 files: arrays with named dimensions, coordinates, units and attributes. They are also HDF5 files.
//!
//! xarray opens them with `xarray.open_dataset(path, engine="h5netcdf")`, h5py as HDF5 files with dimension scales.
//! All sizes are known in advance, so a file is written sequentially without a map in memory: fields are copied row
//! by row from the `.npy` files of a run.
//!
//! The layout follows the HDF5 file format specification, version 3.0, in its oldest form (superblock 0, object
//! headers 1). Dimensions follow the appendix "NetCDF-4 format" of the NetCDF user's guide.

mod file;
mod layout;
mod variable;

pub use file::write;
pub use variable::{Attribute, Variable, VariableData, counter};

use crate::record::import::Fourier;
use crate::{Error, Result};
use std::path::Path;

/// Properties of a surface file that its contents do not contain.
#[derive(Debug, Clone, clap::Args)]
pub struct FileFlags {
    /// Name of the array in a file with several (.npz, HDF5, NetCDF).
    #[arg(long, value_name = "NAME")]
    pub dataset: Option<String>,
    /// Kind of the coefficients in four columns qX qY Re Im; required for them.
    #[arg(long, value_enum)]
    pub fourier: Option<Fourier>,
    /// Points per side of the transform's grid, with --fourier fftw.
    #[arg(long, value_name = "N")]
    pub fourier_points: Option<usize>,
}

impl FileFlags {
    pub fn are_waves(&self) -> bool {
        self.fourier.is_some_and(Fourier::are_waves)
    }
}

/// A height map has its own grid.
pub fn refuse_grid(grid: Option<usize>, file: Option<&Path>, is_map: bool) -> Result<()> {
    match (grid, file.filter(|_| is_map)) {
        (Some(n), Some(file)) => {
            let accepted = format!("none: {} is a height map with points of its own", file.display());
            Err(Error::input("command line", "--grid", n, accepted))
        }
        _ => Ok(()),
    }
}

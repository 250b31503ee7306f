use crate::error::Complaint;
use crate::record::import::{Fourier, ImportOptions};

/// What the contents of a surface file cannot tell.
#[derive(Debug, Clone, clap::Args)]
pub struct FileFlags {
    /// Name of the array, in a file that holds several (.npz, HDF5, NetCDF).
    #[arg(long, value_name = "NAME")]
    pub dataset: Option<String>,
    /// What four columns qX qY Re Im are; must be said for them.
    #[arg(long, value_enum)]
    pub fourier: Option<Fourier>,
    /// Points per side of the grid whose transform the coefficients are, with --fourier fftw.
    #[arg(long, value_name = "N")]
    pub fourier_points: Option<usize>,
}

impl FileFlags {
    pub fn asked(&self) -> ImportOptions<'_> {
        ImportOptions { dataset: self.dataset.as_deref(), fourier: self.fourier }
    }

    pub fn are_waves(&self) -> bool {
        self.fourier.is_some_and(Fourier::are_waves)
    }

    /// `file` says whether there is one that these flags could be of.
    pub fn check(&self, file: bool, list: &mut Vec<Complaint>) {
        for (key, given) in [("--dataset", self.dataset.is_some()), ("--fourier", self.fourier.is_some())] {
            if given && !file {
                list.push(Complaint::new(
                    key,
                    "given without a file",
                    "only together with a file of heights or coefficients",
                ));
            }
        }
        let transform = self.fourier == Some(Fourier::Fftw);
        let found = self.fourier_points.map_or("not given".to_string(), |n| n.to_string());
        if self.fourier_points.is_some() != transform {
            let accepted = "points per side of the transform's grid with --fourier fftw, and only with it";
            list.push(Complaint::new("--fourier-points", found, accepted));
        } else if self.fourier_points.is_some_and(|n| !(2..=65_536).contains(&n)) {
            list.push(Complaint::new("--fourier-points", found, "2 to 65536 points per side"));
        }
    }
}

#![doc = include_str!("../README.md")]

mod areal;
#[cfg(feature = "files")]
pub mod declared;
mod facing;
#[cfg(feature = "files")]
pub mod files;
mod fourier;
mod guards;
pub mod height_map;
mod height_source;
#[cfg(feature = "files")]
pub mod heights;
#[cfg(feature = "files")]
pub mod import;
mod morphology;
mod noise;
mod non_periodic;
mod power_spectrum;
mod preparation;
pub mod provenance;
mod scale_dependent;
mod scan_lines;
mod spectrum;
mod statistics;
mod summits;
mod surface;
mod synthesis;
mod tip;
#[cfg(feature = "files")]
mod xyz_text;

pub use areal::{ArealParameters, CorrelationLength, areal, correlation_length};
pub use facing::{Facing, Placement, RoughBody};
pub use fourier::{FourierModes, Wave};
pub use guards::{quality_warnings, seam_warning, slope_warnings};
pub use height_source::HeightSource;
pub use morphology::dilate_by_ball;
pub use noise::{NoiseFloor, noise_floor};
pub use non_periodic::{NonPeriodicMoments, hann_windowed, non_periodic_gradient, non_periodic_moments};
pub use power_spectrum::{PowerSpectrum, Shell};
pub use preparation::{Detrend, Edges, Fill, FilterKind, MAX_FILLED_SHARE, Preparation, PreparedMap, subtract_form};
pub use scale_dependent::{AtDistance, Axis, scale_dependent};
pub use spectrum::{Amplitudes, Expected, SHORTEST_CUT_OFF, Spectrum};
pub use statistics::{HeightRange, Moments, PowerSpectra, PsdBin, SpectralDensity, moments, power_spectra, psd, range};
pub use summits::{Summit, SummitCurvature, SummitFit, summits};
pub use surface::{Cell, MapOptions, Surface, SynthesisOptions};
pub use synthesis::{Modes, lower_to_zero, resample};
pub use tip::{Reconstruction, Tip, reconstruct, tip_cutoff};

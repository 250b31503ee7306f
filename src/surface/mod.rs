//! Rough surfaces: the self-affine spectrum, its realisations, the preparation of measured maps, statistics, and warnings.
//!
//! Heights are reduced (unit: extent of the cell in x), and low points come into contact first.

mod fourier;
mod guards;
mod morphology;
mod non_periodic;
mod power_spectrum;
mod preparation;
mod spectrum;
mod statistics;
mod summits;
mod synthesis;

pub use fourier::FourierModes;
pub use guards::{quality_warnings, seam_warning, slope_warnings};
pub use morphology::dilate_by_ball;
pub use non_periodic::{NonPeriodicMoments, hann_windowed, non_periodic_moments};
pub use power_spectrum::{PowerSpectrum, Shell};
pub use preparation::{
    Detrend, Edges, Fill, FilterKind, MAX_FILLED_SHARE, Preparation, PreparedMap, suspected_outliers,
};
pub use spectrum::{Amplitudes, Expected, Spectrum};
pub use statistics::{Moments, PsdBin, Range, moments, non_periodic_gradient, psd, range};
pub use summits::{Summit, SummitCurvature, SummitFit, summits};
pub use synthesis::{Modes, lower_to_zero, resample};

//! Rough surfaces: the self-affine spectrum, its realisation mode by mode, and what a realisation looks like in numbers.
//!
//! Heights are reduced (unit: the cell's extent in x) and low points touch first.

mod fourier;
mod morphology;
mod patch;
mod power;
mod spectrum;
mod statistics;
mod summits;
mod synthesis;

pub use fourier::FourierModes;
pub use morphology::dilate_by_ball;
pub use patch::{PatchMoments, patch_moments, windowed};
pub use power::{Power, Shell};
pub use spectrum::{Amplitudes, Expected, Spectrum};
pub use statistics::{Moments, PsdBin, Range, moments, patch_gradient, psd, quality_warnings, range};
pub use summits::{Summit, SummitCurvature, SummitFit, summits};
pub use synthesis::{Modes, lower_to_zero, resample};

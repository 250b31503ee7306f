//! What an instrument has left of a surface: the tip of a scanning probe, and noise.

use crate::report::number::trimmed;
use crate::scene::Case;
use asperity_surface::{Reconstruction, Tip, noise_floor, reconstruct, tip_cutoff};
use serde::Serialize;

#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct TipMarks {
    radius_m: f64,
    /// Length below which peaks have the shape of the tip; `None` where no peak is as sharp.
    cutoff_m: Option<f64>,
    /// Share of the points that the tip touched alone, where the surface is known.
    touched_share: f64,
    /// Largest height of the map over the surface that it may be.
    largest_correction_m: f64,
}

/// Slope of the noise between neighbours, over the rms gradient, from which on it is named: rounding of the heights is below.
const VISIBLE: f64 = 0.02;

/// White noise of the instrument.
#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct Noise {
    rms_height_m: f64,
    /// Shortest wavelength that stands out of it.
    wavelength_m: f64,
}

impl Noise {
    /// Of a measured map whose spectrum ends flat.
    pub(super) fn of(case: &Case, heights: &[f64]) -> Option<Self> {
        let (metres, grid) = (case.scales.length_m, case.model.grid);
        let floor = case.provenance().and(noise_floor(grid, heights, !case.is_non_periodic()))?;
        let steepens = floor.rms_height / grid.dx().min(grid.dy()) > VISIBLE * case.gradient;
        steepens.then_some(Noise { rms_height_m: floor.rms_height * metres, wavelength_m: floor.wavelength * metres })
    }

    pub(super) fn words(&self) -> String {
        let nm = |metres: f64| format!("{} nm", trimmed(metres * 1e9, 3));
        let (rms, shortest) = (nm(self.rms_height_m), nm(self.wavelength_m));
        format!(
            "noise: the spectrum ends flat, as white noise of rms height {rms} does; waves from {shortest} on stand out of it (--low-pass)"
        )
    }
}

impl TipMarks {
    pub(super) fn of(case: &Case, heights: &[f64], tip: Tip) -> Self {
        let (grid, metres, periodic) = (case.model.grid, case.scales.length_m, !case.is_non_periodic());
        let Reconstruction { heights: known, touched } = reconstruct(grid, heights, tip, periodic);
        let correction = known.iter().zip(heights).map(|(k, h)| k - h).fold(0.0, f64::max);
        TipMarks {
            radius_m: tip.radius * metres,
            cutoff_m: tip_cutoff(grid, heights, tip.radius, periodic).map(|length| length * metres),
            touched_share: touched.iter().filter(|t| **t).count() as f64 / grid.points() as f64,
            largest_correction_m: correction * metres,
        }
    }

    pub(super) fn words(&self) -> String {
        let nm = |metres: f64| format!("{} nm", trimmed(metres * 1e9, 3));
        let peaks = match self.cutoff_m {
            Some(length) => format!(
                "peaks narrower than {} are as sharp as half of its curvature and may be its image: --low-pass removes them",
                nm(length)
            ),
            None => "no peak is as sharp as half of its curvature".to_string(),
        };
        let touched = if self.touched_share < 1.0 {
            format!(
                "it touched {} % of the points alone; the map is up to {} too high or low, and where it did not touch by more",
                trimmed(100.0 * self.touched_share, 3),
                nm(self.largest_correction_m)
            )
        } else {
            "it touched all points".to_string()
        };
        format!("tip of radius {}: {peaks}; {touched}", nm(self.radius_m))
    }
}

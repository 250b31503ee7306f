//! What the tip of a scanning probe has left of a map.

use crate::report::number::trimmed;
use crate::scene::Case;
use asperity_surface::{Reconstruction, Tip, reconstruct, tip_cutoff};
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

//! Statistics of non-periodic heights: no difference is taken across an edge.

use crate::scale_dependent::{Axis, difference_gradient, mean_square_difference};
use asperity_grid::{Grid, mean, rms};
use std::f64::consts::TAU;

/// Moments of a non-periodic height map, from differences between neighbouring nodes (reduced units).
#[derive(Debug, Clone, Copy)]
pub struct NonPeriodicMoments {
    /// About the mean height, not about a fitted plane: a tilt is part of the surface.
    pub rms_height: f64,
    pub rms_gradient: f64,
    /// Profile moments m2 = ⟨|∇h|²⟩/2 and m4 = (⟨h_xx²⟩ + ⟨h_yy²⟩)/2.
    pub m2: f64,
    pub m4: f64,
}

pub fn non_periodic_moments(grid: Grid, heights: &[f64]) -> NonPeriodicMoments {
    let bends = |axis, pixel: f64| mean_square_difference::<2>(grid, heights, axis, 1, false) / pixel.powi(4);
    let (along_x, along_y) = (bends(Axis::X, grid.dx()), bends(Axis::Y, grid.dy()));
    let rms_gradient = non_periodic_gradient(grid, heights);
    NonPeriodicMoments {
        rms_height: rms(heights),
        rms_gradient,
        m2: rms_gradient.powi(2) / 2.0,
        m4: (along_x + along_y) / 2.0,
    }
}

/// rms gradient of non-periodic heights `[ny, nx]`, from differences between neighbouring nodes.
pub fn non_periodic_gradient(grid: Grid, heights: &[f64]) -> f64 {
    difference_gradient(grid, heights, false)
}

/// Heights minus their least-squares plane, times a Hann window along both axes with mean square one, which repeats with the number of
/// points as SurfaceTopography and SciPy have it: the spectrum is free of the step at the boundary, at the price of a resolution of one
/// to two modes.
pub fn hann_windowed(grid: Grid, heights: &[f64]) -> Vec<f64> {
    let hann = |n: usize| -> Vec<f64> {
        // A profile has no window across it.
        if n == 1 {
            return vec![1.0];
        }
        let w: Vec<f64> = (0..n).map(|i| 1.0 - (TAU * i as f64 / n as f64).cos()).collect();
        let square = w.iter().map(|v| v * v).sum::<f64>() / n as f64;
        w.into_iter().map(|v| v / square.sqrt()).collect()
    };
    // Offsets from the centre are orthogonal to each other and to a constant.
    let (mx, my) = ((grid.nx - 1) as f64 / 2.0, (grid.ny - 1) as f64 / 2.0);
    let offsets = |i: usize| ((i % grid.nx) as f64 - mx, (i / grid.nx) as f64 - my);
    let mean = mean(heights);
    let slope = |value: &dyn Fn((f64, f64)) -> f64| {
        let (top, bottom) = heights.iter().enumerate().fold((0.0, 0.0), |(t, b), (i, h)| {
            let d = value(offsets(i));
            (t + d * (h - mean), b + d * d)
        });
        if bottom > 0.0 { top / bottom } else { 0.0 }
    };
    let (sx, sy) = (slope(&|d| d.0), slope(&|d| d.1));
    let (wx, wy) = (hann(grid.nx), hann(grid.ny));
    let flat = |i: usize| heights[i] - mean - sx * offsets(i).0 - sy * offsets(i).1;
    (0..heights.len()).map(|i| wx[i % grid.nx] * wy[i / grid.nx] * flat(i)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{moments, psd};

    /// Second differences of a parabola are exact. Its periodic moments contain the step at the boundary.
    #[test]
    fn moments_of_a_tilted_paraboloid_are_exact() {
        let grid = Grid { nx: 9, ny: 7, lx: 1.0, ly: 0.7 };
        let position_of = |i: usize| ((i % 9) as f64 * grid.dx(), (i / 9) as f64 * grid.dy());
        let bowl: Vec<f64> = (0..63).map(position_of).map(|(x, y)| 0.2 * x + 1.5 * x * x + 0.5 * y * y).collect();
        let m = non_periodic_moments(grid, &bowl);
        assert!((m.m4 - (9.0 + 1.0) / 2.0).abs() < 1e-9, "{m:?}");
        assert_eq!(m.m2, m.rms_gradient.powi(2) / 2.0);
        assert!(moments(grid, &bowl).m4 > 2.0 * m.m4);
    }

    /// The windowed power of a wave stays near its mode, and that of the slope vanishes.
    #[test]
    fn the_window_removes_the_slope_and_keeps_the_wave() {
        let grid = Grid::unit(64, 64);
        let x = |i: usize| (i % 64) as f64 / 64.0;
        let wave: Vec<f64> = (0..64 * 64).map(|i| 0.3 * x(i) + 0.01 * (TAU * 8.3 * x(i)).cos()).collect();
        let power = |heights: &[f64]| -> Vec<(f64, f64)> {
            psd(grid, heights, |_| 0.0).iter().map(|b| (b.mode, b.power)).collect()
        };
        let (plain, clean) = (power(&wave), power(&hann_windowed(grid, &wave)));
        let highest = clean.iter().max_by(|a, b| a.1.total_cmp(&b.1)).expect("bins");
        assert!((7.0..10.0).contains(&highest.0), "{clean:?}");
        let last = |bins: &[(f64, f64)]| bins[bins.len() - 1].1;
        assert!(last(&clean) < 1e-4 * last(&plain), "{} {}", last(&clean), last(&plain));
    }

    /// Along a profile the window is that along x of a map of the same rows.
    #[test]
    fn a_profile_is_windowed_along_itself() {
        let heights: Vec<f64> = (0..64).map(|i| (0.7 * f64::from(i)).sin() + 0.1 * f64::from(i)).collect();
        let line = hann_windowed(Grid { ny: 1, ..Grid::unit(64, 1) }, &heights);
        let rows = hann_windowed(Grid::unit(64, 64), &heights.repeat(64));
        // The window across the middle row: 2 over the rms of 1 - cos, √(3/2).
        let across = 2.0 / 1.5_f64.sqrt();
        assert!((0..64).all(|i| (rows[32 * 64 + i] - across * line[i]).abs() < 1e-12));
    }

    /// The gradient of a tilted plane. Its Fourier series contains the step at the boundary.
    #[test]
    fn non_periodic_gradient_of_a_plane_is_its_slope() {
        let grid = Grid { nx: 7, ny: 5, lx: 1.0, ly: 0.5 };
        let plane: Vec<f64> =
            (0..35).map(|i| 0.3 * (i % 7) as f64 * grid.dx() - 0.4 * (i / 7) as f64 * grid.dy()).collect();
        assert!((non_periodic_gradient(grid, &plane) - 0.5).abs() < 1e-12);
        assert!(moments(grid, &plane).rms_gradient > 1.0);
        assert_eq!(non_periodic_gradient(Grid::unit(1, 1), &[3.0]), 0.0);
    }
}

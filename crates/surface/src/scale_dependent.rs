//! Differences of heights over a distance: the structure function, and the slope and curvature at a scale.

use asperity_grid::{Grid, sum_rows};

/// Distances per factor of ten.
const PER_DECADE: f64 = 10.0;

/// Direction of a profile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    X,
    Y,
}

/// Differences of heights at one distance along an axis, averaged over all profiles. The mean slope is part of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AtDistance {
    /// Length of the stencil, in the unit of the extents.
    pub distance: f64,
    /// Structure function ⟨(h(x + r) - h(x))²⟩: twice the height-difference autocorrelation.
    pub structure_function: f64,
    /// rms of (h(x + r) - h(x))/r (Sanner et al., Appl. Surf. Sci. Adv. 7 (2022) 100190).
    pub slope: f64,
    /// rms of the second difference over three points that are r/2 apart; `None` at odd numbers of pixels.
    pub curvature: Option<f64>,
}

/// Differences of heights `[ny, nx]` at about ten distances per decade, from a pixel to half of the extent. `periodic`: pairs across an
/// edge count.
pub fn scale_dependent(grid: Grid, heights: &[f64], axis: Axis, periodic: bool) -> Vec<AtDistance> {
    let (n, pixel) = match axis {
        Axis::X => (grid.nx, grid.dx()),
        Axis::Y => (grid.ny, grid.dy()),
    };
    let at = |pixels: usize| {
        let distance = pixels as f64 * pixel;
        let first = mean_square_difference::<1>(grid, heights, axis, pixels, periodic);
        let second = || mean_square_difference::<2>(grid, heights, axis, pixels / 2, periodic).sqrt();
        AtDistance {
            distance,
            structure_function: first,
            slope: first.sqrt() / distance,
            curvature: pixels.is_multiple_of(2).then(|| second() / (distance / 2.0).powi(2)),
        }
    };
    distances(n / 2).into_iter().map(at).collect()
}

/// One pixel, then even numbers of them.
fn distances(longest: usize) -> Vec<usize> {
    let even = |j: usize| 2 * (10f64.powf(j as f64 / PER_DECADE) / 2.0).round().max(1.0) as usize;
    let mut list: Vec<usize> = (0..).map(even).take_while(|k| *k <= longest).collect();
    list.dedup();
    list.splice(0..0, (longest > 0).then_some(1));
    list
}

/// rms gradient from differences between neighbouring nodes. `periodic`: across the edges, too.
pub(crate) fn difference_gradient(grid: Grid, heights: &[f64], periodic: bool) -> f64 {
    let slope = |axis, pixel: f64| mean_square_difference::<1>(grid, heights, axis, 1, periodic) / (pixel * pixel);
    (slope(Axis::X, grid.dx()) + slope(Axis::Y, grid.dy())).sqrt()
}

/// Mean square of the first or second difference between points that are `step` pixels apart; 0 where no points are.
pub(crate) fn mean_square_difference<const ORDER: usize>(
    grid: Grid,
    heights: &[f64],
    axis: Axis,
    step: usize,
    periodic: bool,
) -> f64 {
    let [sx, sy] = if axis == Axis::X { [step, 0] } else { [0, step] };
    let inside = |n: usize, step: usize| if periodic { n } else { n.saturating_sub(ORDER * step) };
    let (columns, rows) = (inside(grid.nx, sx), inside(grid.ny, sy));
    let [sum] = sum_rows(rows, |y| {
        let row = |j: usize| &heights[(y + j * sy) % grid.ny * grid.nx..][..grid.nx];
        let (a, b, c) = (row(0), row(1), row(ORDER));
        let square = |x: usize| {
            let (a, b, c) = (a[x], b[(x + sx) % grid.nx], c[(x + ORDER * sx) % grid.nx]);
            if ORDER == 1 { (b - a).powi(2) } else { (c - 2.0 * b + a).powi(2) }
        };
        [(0..columns).map(square).sum::<f64>()]
    });
    if columns * rows == 0 { 0.0 } else { sum / (columns * rows) as f64 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// h = A cos(qx): ⟨Δ²⟩ = A² (1 - cos qr), and the second difference is -4 sin²(qr/4) h.
    #[test]
    fn a_wave_in_closed_form() {
        let grid = Grid { nx: 48, ny: 5, lx: 3.0, ly: 1.0 };
        let (a, q) = (0.3, TAU * 2.0 / 3.0);
        let heights: Vec<f64> = (0..grid.points()).map(|i| a * (q * (i % 48) as f64 * grid.dx()).cos()).collect();
        let list = scale_dependent(grid, &heights, Axis::X, true);
        assert_eq!(list.len(), 9, "{list:?}");
        for p in &list {
            let r = p.distance;
            assert!((p.structure_function - a * a * (1.0 - (q * r).cos())).abs() < 1e-14);
            assert!((p.slope - p.structure_function.sqrt() / r).abs() < 1e-14);
            let bend = 4.0 * (q * r / 4.0).sin().powi(2) * a / 2f64.sqrt() / (r / 2.0).powi(2);
            assert!(p.curvature.is_none_or(|c| (c - bend).abs() < 1e-12), "{p:?} {bend}");
        }
        assert!(scale_dependent(grid, &heights, Axis::Y, true).iter().all(|p| p.structure_function == 0.0));
    }

    /// A patch has no pairs across its edges: a tilt is its slope at every distance, without curvature.
    #[test]
    fn a_tilted_patch() {
        let grid = Grid { nx: 9, ny: 30, lx: 0.9, ly: 6.0 };
        let heights: Vec<f64> = (0..grid.points()).map(|i| 0.25 * (i / 9) as f64 * grid.dy()).collect();
        for p in scale_dependent(grid, &heights, Axis::Y, false) {
            assert!((p.slope - 0.25).abs() < 1e-12 && p.curvature.is_none_or(|c| c < 1e-12), "{p:?}");
        }
        assert_eq!(distances(30), [1, 2, 4, 6, 8, 10, 12, 16, 20, 26]);
        assert!(scale_dependent(Grid::unit(1, 1), &[1.0], Axis::X, true).is_empty());
    }
}

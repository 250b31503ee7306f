//! The plane of most facets.

use asperity_grid::{Grid, sum_rows};

/// Square of the width of the weight over the mean square slope. Smaller ones follow the noise of few facets, larger ones the mean plane; Gwyddion's facet
/// levelling has 1/20 of the mean square slope, too (gwyddion.net, user guide, "Levelling").
const WIDTH: f64 = 0.05;

/// Change of the slopes over the rms slope at which they have converged, and iterations after which they are taken as they are.
const CONVERGED: f64 = 1e-10;
const ITERATIONS: usize = 200;

/// Slopes along x and y of the plane in which most of the surface lies: facets between four neighbouring points weigh the less the more
/// they are inclined against it. Facets with a missing point do not count.
pub(super) fn slopes(grid: Grid, heights: &[f64]) -> [f64; 2] {
    let facet = |x: usize, y: usize| {
        let i = y * grid.nx + x;
        let [a, b, c, d] = [i, i + 1, i + grid.nx, i + grid.nx + 1].map(|k| heights[k]);
        [(b - a + d - c) / (2.0 * grid.dx()), (c - a + d - b) / (2.0 * grid.dy())]
    };
    let sum = |term: &(dyn Fn([f64; 2]) -> [f64; 4] + Sync)| {
        sum_rows(grid.ny.saturating_sub(1), |y| {
            let mut sum = [0.0; 4];
            for slopes in (0..grid.nx.saturating_sub(1)).map(|x| facet(x, y)).filter(|s| !s[0].is_nan()) {
                sum.iter_mut().zip(term(slopes)).for_each(|(s, t)| *s += t);
            }
            sum
        })
    };
    let [count, x, y, _] = sum(&|[x, y]| [1.0, x, y, 0.0]);
    if count == 0.0 {
        return [0.0; 2];
    }
    let mut plane = [x / count, y / count];
    for _ in 0..ITERATIONS {
        let [px, py] = plane;
        let inclined = move |[x, y]: [f64; 2]| (x - px).powi(2) + (y - py).powi(2);
        let square = sum(&|s| [inclined(s), 0.0, 0.0, 0.0])[0] / count;
        if square == 0.0 {
            break;
        }
        let [weight, x, y, _] = sum(&|s| {
            let w = (-inclined(s) / (WIDTH * square)).exp();
            [w, w * s[0], w * s[1], 0.0]
        });
        // No facet is near the plane.
        if weight == 0.0 {
            break;
        }
        plane = [x / weight, y / weight];
        if (plane[0] - px).powi(2) + (plane[1] - py).powi(2) < CONVERGED.powi(2) * square {
            break;
        }
    }
    plane
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { nx: 60, ny: 50, lx: 6.0, ly: 10.0 };

    /// Terraces on a tilted ground, of which the mean plane follows the steps.
    #[test]
    fn terraces_are_level() {
        let tilt = [0.03, -0.02];
        let height = |i: usize| {
            let (x, y) = ((i % GRID.nx) as f64 * GRID.dx(), (i / GRID.nx) as f64 * GRID.dy());
            tilt[0] * x + tilt[1] * y + (x / 2.0).floor()
        };
        let mut heights: Vec<f64> = (0..GRID.points()).map(height).collect();
        heights[77] = f64::NAN;
        let [x, y] = slopes(GRID, &heights);
        assert!((x - tilt[0]).abs() < 1e-6 && (y - tilt[1]).abs() < 1e-6, "{x} {y}");
    }

    #[test]
    fn a_plane_is_its_own_facet_and_a_line_has_none() {
        let plane: Vec<f64> = (0..GRID.points()).map(|i| 0.5 * (i % GRID.nx) as f64 * GRID.dx()).collect();
        let [x, y] = slopes(GRID, &plane);
        assert!((x - 0.5).abs() < 1e-12 && y.abs() < 1e-12);
        assert_eq!(slopes(Grid { ny: 1, ..GRID }, &plane[..60]), [0.0; 2]);
    }
}

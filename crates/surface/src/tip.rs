//! What the tip of a scanning probe leaves of a surface.

use crate::scale_dependent::Axis;
use asperity_grid::{Grid, extent};
use rayon::prelude::*;

/// Curvature of the surface, over that of the tip, from which on a tip distorts it (Sanner et al., Appl. Surf. Sci. Adv. 7 (2022) 100190).
const SAFE: f64 = 0.5;

/// Difference of two heights of a tip, over the range of heights, below which it touches at both places: rounding.
const SAME: f64 = 1e-12;

/// A tip: a ball that goes over into a cone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tip {
    /// Radius of the ball, in the unit of the extents.
    pub radius: f64,
    /// Half of the opening angle of the cone, radians: 0 of a shaft as wide as the ball.
    pub half_angle: f64,
}

impl Tip {
    /// Height above the apex at a distance from the axis.
    fn height(&self, distance: f64) -> f64 {
        let edge = self.radius * self.half_angle.cos();
        let ball = |r: f64| self.radius - (self.radius * self.radius - r * r).max(0.0).sqrt();
        if distance <= edge { ball(distance) } else { ball(edge) + (distance - edge) / self.half_angle.tan() }
    }

    /// Offsets and heights of the pixels of the tip that are not higher than `highest`, from its apex on.
    fn pixels(&self, grid: Grid, highest: f64) -> Vec<(i64, i64, f64)> {
        let reach = |d: f64| (0..).take_while(|k| self.height(*k as f64 * d) <= highest).last().unwrap_or(0);
        // Wider than the map it touches at the edge.
        let (rx, ry) = (reach(grid.dx()).min(grid.nx as i64), reach(grid.dy()).min(grid.ny as i64));
        let all = (-ry..=ry).flat_map(|j| (-rx..=rx).map(move |i| (i, j)));
        let with_height = all.map(|(i, j)| (i, j, self.height((i as f64 * grid.dx()).hypot(j as f64 * grid.dy()))));
        let mut pixels: Vec<_> = with_height.filter(|(_, _, height)| *height <= highest).collect();
        pixels.sort_by(|a, b| a.2.total_cmp(&b.2));
        pixels
    }
}

/// What can be said of the surface that a tip has seen.
#[derive(Debug, Clone, PartialEq)]
pub struct Reconstruction {
    /// The lowest-lying surface of which the tip makes the same map (erosion of the map by the tip): with low points protruding, the
    /// true surface is nowhere lower.
    pub heights: Vec<f64>,
    /// Where the tip touched at a single point: there the true surface is the reconstructed one.
    pub touched: Vec<bool>,
}

/// Reconstructs the surface of a map `[ny, nx]` whose low points protrude (Villarrubia, J. Res. Natl. Inst. Stand. Technol. 102 (1997) 425).
pub fn reconstruct(grid: Grid, map: &[f64], tip: Tip, periodic: bool) -> Reconstruction {
    let (low, high) = extent(map);
    let pixels = tip.pixels(grid, high - low);
    let node = |k: usize, (i, j): (i64, i64)| neighbour(grid, k, (i, j), periodic);
    let over = |k: usize| pixels.iter().filter_map(move |(i, j, t)| Some((node(k, (-i, -j))?, *t)));
    let heights: Vec<f64> = (0..grid.points())
        .into_par_iter()
        .map(|k| {
            let mut best = f64::NEG_INFINITY;
            for (p, t) in over(k) {
                // No higher pixel of the tip bounds the surface more.
                if high - t <= best {
                    break;
                }
                best = best.max(map[p] - t);
            }
            best
        })
        .collect();
    let same = SAME * (high - low);
    let touching: Vec<Option<usize>> = (0..grid.points())
        .into_par_iter()
        .map(|k| {
            // Beyond the edge of a patch the tip may have touched what is not in the map.
            let is_inside = periodic || pixels.iter().all(|(i, j, _)| node(k, (*i, *j)).is_some());
            let mut places = pixels.iter().filter(|_| is_inside).filter_map(|(i, j, t)| Some((node(k, (*i, *j))?, *t)));
            // The apex stands on the first place where the surface reaches the tip.
            let reaches = |(_, t): &(usize, f64)| low + t <= map[k] + same;
            let mut touches = places.by_ref().take_while(reaches).filter(|(p, t)| heights[*p] + t <= map[k] + same);
            let (first, second) = (touches.next()?, touches.next());
            second.is_none().then_some(first.0)
        })
        .collect();
    let mut touched = vec![false; grid.points()];
    touching.into_iter().flatten().for_each(|p| touched[p] = true);
    Reconstruction { heights, touched }
}

fn neighbour(grid: Grid, node: usize, (i, j): (i64, i64), periodic: bool) -> Option<usize> {
    let (nx, ny) = (grid.nx as i64, grid.ny as i64);
    let (x, y) = ((node % grid.nx) as i64 + i, (node / grid.nx) as i64 + j);
    let inside = (0..nx).contains(&x) && (0..ny).contains(&y);
    (periodic || inside).then(|| (y.rem_euclid(ny) * nx + x.rem_euclid(nx)) as usize)
}

/// Length of the stencil (three points) below which peaks of a map are as sharp as half of the curvature of a tip, so that its shape is
/// in them. Low points protrude. `None`: nowhere. At most half of the extent.
pub fn tip_cutoff(grid: Grid, heights: &[f64], radius: f64, periodic: bool) -> Option<f64> {
    let of_axis = |axis: Axis| {
        let (n, pixel) = if axis == Axis::X { (grid.nx, grid.dx()) } else { (grid.ny, grid.dy()) };
        let curvature = |half: usize| sharpest(grid, heights, axis, half, periodic) / (half as f64 * pixel).powi(2);
        let limit = SAFE / radius;
        let longest = n / 4;
        let sharp = (1..=longest).rev().find(|half| curvature(*half) > limit)?;
        let length = |half: f64| 2.0 * half * pixel;
        if sharp == longest {
            return Some(length(sharp as f64));
        }
        let (here, next) = (curvature(sharp), curvature(sharp + 1));
        Some(length(sharp as f64 + (here - limit) / (here - next)))
    };
    [Axis::X, Axis::Y].into_iter().filter_map(of_axis).reduce(f64::max)
}

/// Largest second difference between points that are `half` pixels apart.
fn sharpest(grid: Grid, heights: &[f64], axis: Axis, half: usize, periodic: bool) -> f64 {
    let step = half as i64;
    let ahead = if axis == Axis::X { (step, 0) } else { (0, step) };
    let second = |k: usize| {
        let before = neighbour(grid, k, (-ahead.0, -ahead.1), periodic)?;
        let after = neighbour(grid, k, ahead, periodic)?;
        Some(heights[before] - 2.0 * heights[k] + heights[after])
    };
    (0..grid.points()).into_par_iter().filter_map(second).reduce(|| 0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Modes, Spectrum};
    use std::f64::consts::TAU;

    fn rough(seed: u64) -> (Grid, Vec<f64>) {
        let grid = Grid { ly: 0.75, ..Grid::unit(64, 48) };
        let spectrum = Spectrum { lambda_r: 0.5, lambda_s: 0.05, rms_gradient: 1.0, ..Spectrum::CHALLENGE };
        (grid, Modes::new(spectrum, seed, grid.ly).heights(grid, 0.0))
    }

    /// The map that a tip makes of a periodic surface.
    fn seen(grid: Grid, heights: &[f64], tip: Tip) -> Vec<f64> {
        let (low, high) = extent(heights);
        let pixels = tip.pixels(grid, high - low);
        let lowest = |k: usize| {
            let places = pixels.iter().filter_map(|(i, j, t)| Some(heights[neighbour(grid, k, (*i, *j), true)?] + t));
            places.fold(f64::INFINITY, f64::min)
        };
        (0..grid.points()).map(lowest).collect()
    }

    /// The reconstruction lies between map and surface, makes the same map, and is the surface where the tip has touched.
    #[test]
    fn touched_points_are_those_of_the_surface() {
        for seed in 0..6 {
            for tip in [
                Tip { radius: 0.05, half_angle: 0.3 },
                Tip { radius: 0.03, half_angle: 0.0 },
                Tip { radius: 0.01, half_angle: 0.6 },
            ] {
                for periodic in [true, false] {
                    let (cell, whole) = rough(seed);
                    let seen_whole = seen(cell, &whole, tip);
                    // A patch is a part of a larger surface, of which its tip has seen more.
                    let part =
                        |of: &[f64]| (0..30 * 40).map(|k| of[(k / 40 + 9) * 64 + k % 40 + 11]).collect::<Vec<f64>>();
                    let (grid, surface, map) = match periodic {
                        true => (cell, whole, seen_whole),
                        false => {
                            let grid = Grid { nx: 40, ny: 30, lx: 40.0 * cell.dx(), ly: 30.0 * cell.dy() };
                            (grid, part(&whole), part(&seen_whole))
                        }
                    };
                    let found = reconstruct(grid, &map, tip, periodic);
                    let mut count = 0;
                    for k in 0..grid.points() {
                        let (h, r, m) = (surface[k], found.heights[k], map[k]);
                        assert!(m <= r + 1e-12 && r <= h + 1e-12, "{seed} {tip:?} {k}: {m} {r} {h}");
                        assert!(!found.touched[k] || (r - h).abs() < 1e-10, "{seed} {tip:?} {k}: {r} {h}");
                        count += usize::from(found.touched[k]);
                    }
                    assert!(count > grid.points() / 100 && count < grid.points(), "{count}");
                    let again = seen(grid, &found.heights, tip);
                    assert!(!periodic || again.iter().zip(&map).all(|(a, b)| (a - b).abs() < 1e-12));
                }
            }
        }
    }

    /// A wave of amplitude A and wave number q has the largest second difference 4 A sin²(qℓ/4) over a stencil of the length ℓ.
    #[test]
    fn the_cutoff_of_a_wave() {
        let grid = Grid { nx: 512, ny: 16, lx: 1.0, ly: 0.03125 };
        let (a, q) = (0.01, TAU * 4.0);
        let wave: Vec<f64> = (0..grid.points()).map(|k| -a * (q * (k % 512) as f64 * grid.dx()).cos()).collect();
        // Sharper than half of the tip's curvature from the first pixels on, or nowhere.
        assert_eq!(tip_cutoff(grid, &wave, 0.4 / (a * q * q), true), None);
        let radius = 1.0 / (a * q * q);
        let found = tip_cutoff(grid, &wave, radius, true).expect("sharp peaks");
        let curvature = 4.0 * a * (q * found / 4.0).sin().powi(2) / (found / 2.0).powi(2);
        assert!((curvature * 2.0 * radius - 1.0).abs() < 1e-3, "{found} {curvature}");
    }
}

//! Areal parameters of ISO 25178-2.

use crate::scale_dependent::difference_gradient;
use asperity_grid::{Grid, Transform, mean, sum_rows};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Autocorrelation at which it has decayed, the default of ISO 25178-3.
const DECAYED: f64 = 0.2;

/// Roughness, over the mean height, below which it is rounding of the mean: 1e-14 with 4096 points.
const ROUNDED: f64 = 1e-12;

/// Rays on half a turn, along which the autocorrelation is followed.
const RAYS: usize = 180;

/// Height, gradient and area parameters. Heights are about their mean, all points weigh alike, and no filter is applied.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArealParameters {
    /// Root mean square height, in the unit of the heights.
    pub sq: f64,
    /// Mean of the absolute height.
    pub sa: f64,
    /// Skewness: positive where peaks towards the other body outweigh.
    pub ssk: f64,
    /// Kurtosis, 3 of a normal distribution.
    pub sku: f64,
    /// Root mean square gradient, from differences between neighbouring points.
    pub sdq: f64,
    /// Area of the surface over that of its projection, minus one: triangles between neighbouring points, mean of both diagonals. NaN of a
    /// patch of one line.
    pub sdr: f64,
}

/// Parameters of heights `[ny, nx]` of which low points touch first. `periodic`: pairs of points across an edge count.
pub fn areal(grid: Grid, heights: &[f64], periodic: bool) -> ArealParameters {
    let middle = mean(heights);
    let points = grid.points() as f64;
    let [absolute, second, third, fourth] = sum_rows(grid.ny, |y| {
        let mut sum = [0.0; 4];
        for h in &heights[y * grid.nx..(y + 1) * grid.nx] {
            let z = middle - h;
            sum.iter_mut().zip([z.abs(), z * z, z.powi(3), z.powi(4)]).for_each(|(s, t)| *s += t);
        }
        sum
    })
    .map(|sum| sum / points);
    let rounded = ROUNDED * middle.abs();
    let over = |value: f64, scale: f64| if second.sqrt() > rounded { value / scale } else { 0.0 };
    ArealParameters {
        sq: second.sqrt(),
        sa: absolute,
        ssk: over(third, second.powf(1.5)),
        sku: over(fourth, second.powi(2)),
        sdq: difference_gradient(grid, heights, periodic),
        sdr: developed_area(grid, heights, periodic),
    }
}

fn developed_area(grid: Grid, heights: &[f64], periodic: bool) -> f64 {
    let [columns, rows] = [grid.nx, grid.ny].map(|n| if periodic { n } else { n - 1 });
    let (dx, dy) = (grid.dx(), grid.dy());
    // √(1 + s²) - 1 without loss of digits.
    let excess = |sx: f64, sy: f64| {
        let square = (sx / dx).powi(2) + (sy / dy).powi(2);
        square / (1.0 + (1.0 + square).sqrt())
    };
    let [sum] = sum_rows(rows, |y| {
        let row = &heights[y * grid.nx..][..grid.nx];
        let next = &heights[(y + 1) % grid.ny * grid.nx..][..grid.nx];
        let cell = |x: usize| {
            let right = (x + 1) % grid.nx;
            let [a, b, c, d] = [row[x], row[right], next[x], next[right]];
            // Both triangles of either diagonal.
            excess(b - a, d - b) + excess(d - c, c - a) + excess(b - a, c - a) + excess(d - c, d - b)
        };
        [(0..columns).map(cell).sum::<f64>() / 4.0]
    });
    sum / (columns * rows) as f64
}

/// How far heights are correlated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CorrelationLength {
    /// Sal: distance of the fastest decay of the autocorrelation to 0.2, in the unit of the extents.
    pub fastest: f64,
    /// Str: that distance over the one of the slowest decay; `None` where some direction does not decay within half of the extents.
    pub aspect: Option<f64>,
}

/// Correlation length of heights `[ny, nx]`; `None` where no direction decays. Between points the autocorrelation is interpolated
/// linearly; that of a patch is the mean over the pairs inside it.
pub fn correlation_length(grid: Grid, heights: &[f64], periodic: bool) -> Option<CorrelationLength> {
    let (map, wide) = autocorrelation(grid, heights, periodic)?;
    let value = |x: f64, y: f64| {
        let (i, j) = (x.floor(), y.floor());
        let (u, v) = (x - i, y - j);
        let node = |a: f64, b: f64| {
            let wrapped = |k: f64, n: usize| (k as i64).rem_euclid(n as i64) as usize;
            map[wrapped(b, wide.ny) * wide.nx + wrapped(a, wide.nx)]
        };
        (1.0 - v) * ((1.0 - u) * node(i, j) + u * node(i + 1.0, j))
            + v * ((1.0 - u) * node(i, j + 1.0) + u * node(i + 1.0, j + 1.0))
    };
    let step = 0.5 * grid.dx().min(grid.dy());
    let decay = |ray: usize| {
        let (sin, cos) = (PI * ray as f64 / RAYS as f64).sin_cos();
        let at = |k: usize| value(k as f64 * step * cos / grid.dx(), k as f64 * step * sin / grid.dy());
        let longest = (0.5 * grid.lx / cos.abs()).min(0.5 * grid.ly / sin.abs());
        let mut before = 1.0;
        (1..=(longest / step) as usize).find_map(|k| {
            let now = at(k);
            let crossed = (now <= DECAYED).then(|| (k as f64 - 1.0 + (before - DECAYED) / (before - now)) * step);
            before = now;
            crossed
        })
    };
    let list: Vec<Option<f64>> = (0..RAYS).into_par_iter().map(decay).collect();
    let fastest = list.iter().flatten().copied().reduce(f64::min)?;
    let slowest: Option<Vec<f64>> = list.into_iter().collect();
    let slowest = slowest.and_then(|all| all.into_iter().reduce(f64::max));
    Some(CorrelationLength { fastest, aspect: slowest.map(|slowest| fastest / slowest) })
}

/// Normalised autocorrelation, at all distances from 0 to the extents and back, and its grid. `None` of flat heights.
fn autocorrelation(grid: Grid, heights: &[f64], periodic: bool) -> Option<(Vec<f64>, Grid)> {
    let scale = if periodic { 1 } else { 2 };
    let wide =
        Grid { nx: scale * grid.nx, ny: scale * grid.ny, lx: scale as f64 * grid.lx, ly: scale as f64 * grid.ly };
    let middle = mean(heights);
    let transform = Transform::<f64>::new(wide);
    let mut spectrum = transform.spectrum();
    // A patch lies in zeros, so that no pair wraps around.
    let fill = |y: usize, row: &mut [f64]| {
        row.fill(0.0);
        if y < grid.ny {
            row.iter_mut().zip(&heights[y * grid.nx..][..grid.nx]).for_each(|(to, h)| *to = h - middle);
        }
    };
    transform.forward_of(&fill, &mut spectrum);
    spectrum.par_iter_mut().for_each(|c| *c = c.norm_sqr().into());
    let mut map = vec![0.0; wide.points()];
    transform.inverse(&mut spectrum, &mut map);
    if !periodic {
        let pairs = |k: usize, n: usize| n.saturating_sub(k.min(2 * n - k)).max(1) as f64 / n as f64;
        for (y, row) in map.chunks_mut(wide.nx).enumerate() {
            row.iter_mut().enumerate().for_each(|(x, v)| *v /= pairs(x, grid.nx) * pairs(y, grid.ny));
        }
    }
    let variance = map[0];
    (variance > 0.0).then(|| {
        map.iter_mut().for_each(|v| *v /= variance);
        (map, wide)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn wave(grid: Grid, height: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        let place = |i: usize| ((i % grid.nx) as f64 * grid.dx(), (i / grid.nx) as f64 * grid.dy());
        (0..grid.points()).map(place).map(|(x, y)| height(x, y)).collect()
    }

    /// A sinusoid: Sa = 2A/π, Sku = 3/2; the autocorrelation cos qr is 0.2 at arccos(0.2)/q.
    #[test]
    fn a_wave_in_closed_form() {
        let grid = Grid { nx: 400, ny: 30, lx: 2.0, ly: 0.3 };
        let (a, q) = (0.05, TAU);
        let heights = wave(grid, |x, _| 3.0 + a * (q * x).cos());
        let p = areal(grid, &heights, true);
        let close = |found: f64, exact: f64, off: f64| assert!((found / exact - 1.0).abs() < off, "{found} {exact}");
        close(p.sq, a / 2f64.sqrt(), 1e-12);
        close(p.sa, 2.0 * a / PI, 1e-3);
        close(p.sku, 1.5, 1e-12);
        assert!(p.ssk.abs() < 1e-12);
        // Second order in the pixel.
        close(p.sdq, a * q / 2f64.sqrt(), 1e-3);
        let length = |x: f64| (1.0 + (a * q * x.sin()).powi(2)).sqrt() - 1.0;
        let exact = (0..4000).map(|i| length(TAU * f64::from(i) / 4000.0)).sum::<f64>() / 4000.0;
        close(p.sdr, exact, 1e-3);
        let length = correlation_length(grid, &heights, true).expect("decays");
        close(length.fastest, DECAYED.acos() / q, 1e-4);
        // Along y it never decays.
        assert_eq!(length.aspect, None);
    }

    /// Peaks towards the other body, which are low here, are positive.
    #[test]
    fn skewness_is_that_of_peaks() {
        let grid = Grid::unit(64, 64);
        let peak = wave(grid, |x, y| -(-((x - 0.5).powi(2) + (y - 0.5).powi(2)) / 0.01).exp());
        assert!(areal(grid, &peak, true).ssk > 1.0);
        assert_eq!([2.0, 0.1].map(|h| areal(grid, &vec![h; 4096], true).sku), [0.0; 2]);
        assert_eq!(correlation_length(grid, &vec![2.0; 4096], true), None);
    }

    /// Two waves under right angles, one twice as long: on the diagonals the other is constant, so that (1 + cos qr)/2 is 0.2. A patch has
    /// the same lengths but for the waves that it cuts.
    #[test]
    fn directions_and_patches() {
        let grid = Grid { nx: 240, ny: 240, lx: 6.0, ly: 6.0 };
        let heights = wave(grid, |x, y| (TAU * (x + y)).cos() + (TAU * (x - y) / 2.0).cos());
        let exact = (2.0 * DECAYED - 1.0).acos() / (TAU * 2f64.sqrt());
        // The autocorrelation is linear between points, a fortieth of a wave apart.
        const OFF: f64 = 3e-3;
        for periodic in [true, false] {
            let length = correlation_length(grid, &heights, periodic).expect("decays");
            let aspect = length.aspect.expect("decays in all directions");
            assert!(
                (length.fastest / exact - 1.0).abs() < OFF && (2.0 * aspect - 1.0).abs() < OFF,
                "{length:?} {exact}"
            );
        }
    }
}

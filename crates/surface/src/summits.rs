//! Summits of a surface and their radii. Low points come into contact first, so summits are minima of the heights.

use asperity_grid::{Grid, Transform};
use rustfft::num_complex::Complex;
use serde::{Deserialize, Serialize};
use std::collections::HashSet;

/// How the curvatures of a summit are determined.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum SummitFit {
    /// Least squares of a quadratic form through the node and its eight neighbours.
    #[default]
    NinePoints,
    /// Derivatives of the surface's Fourier series at the node: exact for waves that the grid resolves.
    Fourier,
}

/// Which mean of the two principal curvatures describes a summit.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum SummitCurvature {
    /// Geometric mean: a circular contact of this curvature approximates the elliptic one best (Greenwood, Wear 261
    /// (2006) 191).
    #[default]
    Geometric,
    /// Arithmetic mean.
    Mean,
}

/// A summit as the paraboloid `height + r²/(2 radius)` about (x, y).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Summit {
    /// Lowest node; the first one of a plateau.
    pub node: usize,
    /// Position of the vertex, within a pixel of the node, units of L.
    pub x: f64,
    pub y: f64,
    /// Height of the vertex.
    pub height: f64,
    pub radius: f64,
}

/// Second derivatives and gradient at a node.
#[derive(Debug, Clone, Copy)]
struct NodeDerivatives {
    xx: f64,
    yy: f64,
    xy: f64,
    x: f64,
    y: f64,
}

/// Summits of heights `[ny, nx]` on the periodic cell, in the order of their nodes: nodes with no lower one among their
/// eight neighbours, plateaus of equal heights counted once. A flat surface has none.
pub fn summits(grid: Grid, heights: &[f64], fit: SummitFit, curvature: SummitCurvature) -> Vec<Summit> {
    let nodes = minima(grid, heights);
    let shapes: Vec<NodeDerivatives> = match fit {
        SummitFit::NinePoints => nodes.iter().map(|&i| nine_points(grid, heights, i)).collect(),
        SummitFit::Fourier => fourier(grid, heights, &nodes),
    };
    nodes.iter().zip(shapes).map(|(&node, shape)| summit(grid, heights, node, shape, curvature)).collect()
}

fn summit(grid: Grid, heights: &[f64], node: usize, shape: NodeDerivatives, curvature: SummitCurvature) -> Summit {
    let NodeDerivatives { xx, yy, xy, x, y } = shape;
    // Mean curvature and Gauss's.
    let (mut mean, mut gauss) = (0.5 * (xx + yy), xx * yy - xy * xy);
    if mean <= 0.0 {
        // A summit narrower than the stencil, or a plateau: the mean rise of the neighbours gives the curvature.
        let z = stencil(grid, heights, node);
        let rise = |k: usize| {
            let (x, y) = ((k % 3) as f64 - 1.0, (k / 3) as f64 - 1.0);
            2.0 * (z[k] - z[4]) / ((x * grid.dx()).powi(2) + (y * grid.dy()).powi(2))
        };
        mean = (0..9).filter(|k| *k != 4).map(rise).sum::<f64>() / 8.0;
        gauss = 0.0;
    }
    let kappa = match curvature {
        SummitCurvature::Geometric if gauss > 0.0 => gauss.sqrt(),
        _ => mean,
    };
    // The vertex, if the quadratic form has one within a pixel.
    let (sx, sy) = (-(yy * x - xy * y) / gauss, -(xx * y - xy * x) / gauss);
    let near = gauss > 0.0 && sx.abs() <= grid.dx() && sy.abs() <= grid.dy();
    let (sx, sy) = if near { (sx, sy) } else { (0.0, 0.0) };
    Summit {
        node,
        x: ((node % grid.nx) as f64 * grid.dx() + sx).rem_euclid(grid.lx),
        y: ((node / grid.nx) as f64 * grid.dy() + sy).rem_euclid(grid.ly),
        height: heights[node] + 0.5 * (x * sx + y * sy),
        radius: kappa.recip(),
    }
}

/// Nodes with no lower neighbour, one of each plateau.
fn minima(grid: Grid, heights: &[f64]) -> Vec<usize> {
    let mut seen = HashSet::new();
    (0..grid.points())
        .filter(|&i| {
            let (mut lower, mut level) = (false, false);
            for j in neighbours(grid, i) {
                lower |= heights[j] < heights[i];
                level |= heights[j] == heights[i] && j != i;
            }
            !lower && (!level || (!seen.contains(&i) && is_summit_plateau(grid, heights, i, &mut seen)))
        })
        .collect()
}

/// Whether the plateau around a node is lower than all its neighbours, of which there is at least one.
fn is_summit_plateau(grid: Grid, heights: &[f64], from: usize, seen: &mut HashSet<usize>) -> bool {
    let (mut lowest, mut bounded) = (true, false);
    let mut open = vec![from];
    seen.insert(from);
    while let Some(i) = open.pop() {
        for j in neighbours(grid, i) {
            lowest &= heights[j] >= heights[from];
            bounded |= heights[j] > heights[from];
            if heights[j] == heights[from] && seen.insert(j) {
                open.push(j);
            }
        }
    }
    lowest && bounded
}

/// The node and its eight neighbours, row by row.
fn around(grid: Grid, i: usize) -> [usize; 9] {
    let (nx, ny) = (grid.nx, grid.ny);
    let (x, y) = (i % nx, i / nx);
    let columns = [(x + nx - 1) % nx, x, (x + 1) % nx];
    let rows = [(y + ny - 1) % ny, y, (y + 1) % ny];
    std::array::from_fn(|k| nx * rows[k / 3] + columns[k % 3])
}

fn neighbours(grid: Grid, i: usize) -> impl Iterator<Item = usize> {
    around(grid, i).into_iter().enumerate().filter(|(k, _)| *k != 4).map(|(_, j)| j)
}

fn stencil(grid: Grid, heights: &[f64], i: usize) -> [f64; 9] {
    around(grid, i).map(|j| heights[j])
}

/// Least squares of a quadratic form on a three by three stencil; exact for such a form.
fn nine_points(grid: Grid, heights: &[f64], node: usize) -> NodeDerivatives {
    let z = stencil(grid, heights, node);
    let (dx, dy) = (grid.dx(), grid.dy());
    // Relative to the node, so that an offset costs no digits.
    let value_at = |row: usize, column: usize| z[3 * row + column] - z[4];
    let sum = |value: &dyn Fn(usize) -> f64| (0..3).map(value).sum::<f64>();
    NodeDerivatives {
        xx: sum(&|r| value_at(r, 0) - 2.0 * value_at(r, 1) + value_at(r, 2)) / (3.0 * dx * dx),
        yy: sum(&|c| value_at(0, c) - 2.0 * value_at(1, c) + value_at(2, c)) / (3.0 * dy * dy),
        xy: (value_at(0, 0) - value_at(0, 2) - value_at(2, 0) + value_at(2, 2)) / (4.0 * dx * dy),
        x: sum(&|r| value_at(r, 2) - value_at(r, 0)) / (6.0 * dx),
        y: sum(&|c| value_at(2, c) - value_at(0, c)) / (6.0 * dy),
    }
}

/// Derivatives of the Fourier series at the nodes.
fn fourier(grid: Grid, heights: &[f64], nodes: &[usize]) -> Vec<NodeDerivatives> {
    let transform = Transform::<f64>::new(grid);
    let mut spectrum = transform.spectrum();
    let mut field = vec![0.0; grid.points()];
    let per_point = 1.0 / grid.points() as f64;
    // A Nyquist wave has no slope at the nodes.
    let odd = |q: f64, k: usize, n: usize| if 2 * k == n { 0.0 } else { q };
    let mut derivative = |factor: &(dyn Fn(usize, usize) -> Complex<f64> + Sync)| -> Vec<f64> {
        let filter = |i: usize, column: &mut [Complex<f64>]| {
            column.iter_mut().enumerate().for_each(|(j, c)| *c *= factor(i, j) * per_point);
            0.0
        };
        transform.forward_filtered(heights, &mut spectrum, &filter);
        transform.inverse(&mut spectrum, &mut field);
        nodes.iter().map(|&i| field[i]).collect()
    };
    let real = |v: f64| Complex::new(v, 0.0);
    let slope_x = |i: usize| odd(grid.qx(i), i, grid.nx);
    let slope_y = |j: usize| odd(grid.qy(j), j, grid.ny);
    let xx = derivative(&|i, _| real(-grid.qx(i).powi(2)));
    let yy = derivative(&|_, j| real(-grid.qy(j).powi(2)));
    let xy = derivative(&|i, j| real(-slope_x(i) * slope_y(j)));
    let x = derivative(&|i, _| Complex::new(0.0, slope_x(i)));
    let y = derivative(&|_, j| Complex::new(0.0, slope_y(j)));
    (0..nodes.len()).map(|k| NodeDerivatives { xx: xx[k], yy: yy[k], xy: xy[k], x: x[k], y: y[k] }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Modes, Spectrum, moments};
    use std::f64::consts::{PI, TAU};

    /// A paraboloid between nodes and across the periodic boundary: its vertex and radius to rounding, for any
    /// offset.
    #[test]
    fn a_paraboloid_is_found_exactly() {
        let grid = Grid { nx: 24, ny: 20, lx: 1.0, ly: 0.7 };
        let (x0, y0, rx, ry) = (0.985, 0.0123, 0.3, 0.7);
        let around = |a: f64, l: f64| a - l * (a / l).round();
        let heights: Vec<f64> = (0..grid.points())
            .map(|i| {
                let x = around((i % 24) as f64 * grid.dx() - x0, grid.lx);
                let y = around((i / 24) as f64 * grid.dy() - y0, grid.ly);
                5.0 + 0.5 * (x * x / rx + y * y / ry)
            })
            .collect();
        for (curvature, radius) in
            [(SummitCurvature::Mean, 2.0 / (1.0 / rx + 1.0 / ry)), (SummitCurvature::Geometric, (rx * ry).sqrt())]
        {
            let [s] = summits(grid, &heights, SummitFit::NinePoints, curvature)[..] else { panic!("one summit") };
            assert!((s.x - x0).abs() < 1e-11 && (s.y - y0).abs() < 1e-11, "{s:?}");
            assert!((s.height - 5.0).abs() < 1e-12 && (s.radius / radius - 1.0).abs() < 1e-9, "{s:?}");
        }
    }

    #[test]
    fn plateaus_count_once_and_flats_never() {
        let grid = Grid::unit(8, 8);
        let find = |h: &[f64]| summits(grid, h, SummitFit::NinePoints, SummitCurvature::Mean);
        assert!(find(&[3.0; 64]).is_empty());
        let mut heights = vec![1.0; 64];
        // Across the periodic boundary, with a step that is not a summit and a plateau next to a lower node.
        for i in [0, 7, 63] {
            heights[i] = 0.0;
        }
        heights[27] = 0.5;
        (heights[44], heights[45]) = (0.2, 0.1);
        let actual = find(&heights);
        assert_eq!(actual.iter().map(|s| s.node).collect::<Vec<_>>(), [0, 27, 45]);
        assert!(actual.iter().all(|s| s.radius > 0.0 && s.radius.is_finite()), "{actual:?}");
    }

    /// The curvature of a wave is exact with its Fourier series; the fit averages it over three nodes.
    #[test]
    fn fourier_curvature_of_waves() {
        let grid = Grid::unit(32, 32);
        let h = |x: f64, y: f64| 0.01 * (TAU * 2.0 * x).cos() + 0.02 * (TAU * y).cos() + 0.001 * (TAU * (x + y)).sin();
        let heights: Vec<f64> = (0..1024).map(|i| h((i % 32) as f64 / 32.0, (i / 32) as f64 / 32.0)).collect();
        let actual = summits(grid, &heights, SummitFit::Fourier, SummitCurvature::Mean);
        assert_eq!(actual.len(), 2);
        for s in actual {
            let (x, y) = ((s.node % 32) as f64 / 32.0, (s.node / 32) as f64 / 32.0);
            let mixed = 0.001 * (TAU * (x + y)).sin();
            let laplacian = -TAU * TAU * (0.04 * (TAU * 2.0 * x).cos() + 0.02 * (TAU * y).cos() + 2.0 * mixed);
            assert!((s.radius * 0.5 * laplacian - 1.0).abs() < 1e-11, "{s:?}");
        }
    }

    /// Nayak (J. Lubr. Technol. 93 (1971) 398): summits of a Gaussian isotropic surface have the density
    /// m4/(6π√3 m2) and, on average, the mean curvature (8/3)√(m4/π).
    #[test]
    fn a_resolved_random_surface_is_nayaks() {
        /// Standard error of about 2000 summits, plus the discretisation error with 12 nodes per shortest wavelength.
        const NUMBER: f64 = 0.06;
        /// The same of their curvatures, whose relative spread is smaller.
        const CURVATURE: f64 = 0.03;
        let grid = Grid::unit(384, 384);
        let spectrum = Spectrum { lambda_s: 1.0 / 32.0, lambda_r: 1.0 / 16.0, ..Spectrum::CHALLENGE };
        let (mut number, mut expected, mut curvature) = (0.0, 0.0, 0.0);
        for seed in 0..6 {
            let heights: Vec<f64> = Modes::new(spectrum, seed, 1.0).heights(grid, 0.0);
            let m = moments(grid, &heights);
            let actual = summits(grid, &heights, SummitFit::Fourier, SummitCurvature::Mean);
            number += actual.len() as f64;
            expected += m.m4 / (6.0 * PI * 3f64.sqrt() * m.m2);
            curvature += actual.iter().map(|s| 1.0 / s.radius).sum::<f64>() / (8.0 / 3.0 * (m.m4 / PI).sqrt());
        }
        assert!((number / expected - 1.0).abs() < NUMBER, "{number} {expected}");
        assert!((curvature / number - 1.0).abs() < CURVATURE, "{}", curvature / number);
    }
}

//! Laplace's equation on the missing points, with the measured heights as boundary values.
//!
//! Each hole, a set of missing points that are connected along the axes, is solved by itself. The equations are those of the
//! five-point formula with the pixel's sides; at the edge of a map that does not repeat, the flux vanishes. Conjugate gradients
//! are preconditioned by a multigrid cycle over aggregates of 2 x 2 points with an over-corrected coarse grid (Braess, Computing
//! 55 (1995) 379), so that the number of iterations hardly grows with the hole.

use asperity_grid::Grid;
use rayon::prelude::*;
use std::collections::HashMap;

/// Reduction of the error, in the norm of the preconditioner, at which a hole is solved: the rounding of heights.
const SOLVED: f64 = 1e-15;

/// More iterations than a hole needs: a hole of 1.6 million points takes 40.
const MOST_ITERATIONS: usize = 1000;

/// Factor of the coarse corrections. Aggregates are too stiff by 2 for smooth errors; Braess found 1.8 best.
const OVER_CORRECTION: f64 = 1.8;

const MEASURED: u32 = u32::MAX;

/// Fills the points that are NaN; at least one point is measured.
pub(super) fn harmonic(grid: Grid, heights: &mut [f64], periodic: bool) {
    let (holes, place) = holes(grid, heights, periodic);
    let filled: Vec<Vec<f64>> = holes.par_iter().map(|hole| solve(grid, heights, periodic, hole, &place)).collect();
    for (hole, values) in holes.iter().zip(filled) {
        hole.iter().zip(values).for_each(|(&node, value)| heights[node] = value);
    }
}

/// The points of each hole, and for every point of the map its place in its hole.
fn holes(grid: Grid, heights: &[f64], periodic: bool) -> (Vec<Vec<usize>>, Vec<u32>) {
    let mut place = vec![MEASURED; heights.len()];
    let mut holes = Vec::new();
    for start in 0..heights.len() {
        if !heights[start].is_nan() || place[start] != MEASURED {
            continue;
        }
        let mut hole = vec![start];
        place[start] = 0;
        let mut next = 0;
        while next < hole.len() {
            for (neighbour, _) in neighbours(grid, periodic, hole[next]) {
                if heights[neighbour].is_nan() && place[neighbour] == MEASURED {
                    place[neighbour] = hole.len() as u32;
                    hole.push(neighbour);
                }
            }
            next += 1;
        }
        holes.push(hole);
    }
    (holes, place)
}

/// The neighbours of a point along the axes and their weights, relative to that along x.
fn neighbours(grid: Grid, periodic: bool, node: usize) -> impl Iterator<Item = (usize, f64)> {
    let (nx, ny) = (grid.nx, grid.ny);
    let (x, y) = (node % nx, node / nx);
    let along_y = (grid.dx() / grid.dy()).powi(2);
    let previous = move |i: usize, n: usize| if i > 0 { Some(i - 1) } else { (periodic && n > 1).then_some(n - 1) };
    let after = move |i: usize, n: usize| if i + 1 < n { Some(i + 1) } else { (periodic && n > 1).then_some(0) };
    let in_row = [previous(x, nx), after(x, nx)].into_iter().flatten().map(move |x| (y * nx + x, 1.0));
    let in_column = [previous(y, ny), after(y, ny)].into_iter().flatten().map(move |y| (y * nx + x, along_y));
    in_row.chain(in_column)
}

/// Harmonic heights of the points of a hole.
fn solve(grid: Grid, heights: &[f64], periodic: bool, hole: &[usize], position: &[u32]) -> Vec<f64> {
    // Relative to a boundary value, so that an offset of all heights costs no digits.
    let measured = |node: usize| neighbours(grid, periodic, node).map(|(n, _)| heights[n]).find(|h| !h.is_nan());
    let offset = hole.iter().find_map(|&node| measured(node)).expect("a hole ends at measured points");
    let mut links = Vec::with_capacity(4 * hole.len());
    let (mut diagonal, mut load) = (vec![0.0; hole.len()], vec![0.0; hole.len()]);
    for (i, &node) in hole.iter().enumerate() {
        for (neighbour, weight) in neighbours(grid, periodic, node) {
            diagonal[i] += weight;
            match position[neighbour] {
                MEASURED => load[i] += weight * (heights[neighbour] - offset),
                j => links.push((i as u32, j, weight)),
            }
        }
    }
    let cells = hole.iter().map(|node| [(node % grid.nx) as u32, (node / grid.nx) as u32]).collect();
    let levels = AggregateLevel::all(diagonal, links, cells);
    conjugate_gradients(&levels, load).into_iter().map(|h| h + offset).collect()
}

fn conjugate_gradients(levels: &[AggregateLevel], load: Vec<f64>) -> Vec<f64> {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut solution = vec![0.0; load.len()];
    let mut residual = load;
    let mut direction = cycle(levels, &residual);
    let mut square = dot(&residual, &direction);
    let solved = SOLVED * SOLVED * square;
    for _ in 0..MOST_ITERATIONS {
        if square <= solved {
            break;
        }
        let image = levels[0].image(&direction);
        let step = square / dot(&direction, &image);
        solution.iter_mut().zip(&direction).for_each(|(f, d)| *f += step * d);
        residual.iter_mut().zip(&image).for_each(|(r, i)| *r -= step * i);
        let preconditioned = cycle(levels, &residual);
        let next = dot(&residual, &preconditioned);
        direction.iter_mut().zip(&preconditioned).for_each(|(d, p)| *d = p + next / square * *d);
        square = next;
    }
    solution
}

/// The equations on one grid: `diagonal[i] h[i] - Σ weight h[neighbour] = load[i]`.
struct AggregateLevel {
    diagonal: Vec<f64>,
    /// Where the links of each point start, and where those of the last one end.
    start: Vec<u32>,
    links: Vec<(u32, f64)>,
    /// The aggregate of each point; empty on the coarsest grid.
    aggregate: Vec<u32>,
}

impl AggregateLevel {
    /// The grids from the finest on, down to one without links. `links`: point, neighbour and weight, sorted by point.
    fn all(mut diagonal: Vec<f64>, mut links: Vec<(u32, u32, f64)>, mut cells: Vec<[u32; 2]>) -> Vec<AggregateLevel> {
        let mut levels = Vec::new();
        loop {
            let mut start = vec![0u32; diagonal.len() + 1];
            links.iter().for_each(|l| start[l.0 as usize + 1] += 1);
            (1..start.len()).for_each(|i| start[i] += start[i - 1]);
            let compact = links.iter().map(|l| (l.1, l.2)).collect();
            let mut level = AggregateLevel { diagonal, start, links: compact, aggregate: Vec::new() };
            if links.is_empty() {
                levels.push(level);
                return levels;
            }
            let mut numbers = HashMap::new();
            let mut coarse_cells = Vec::new();
            for [x, y] in cells {
                let cell = [x / 2, y / 2];
                level.aggregate.push(*numbers.entry(cell).or_insert_with(|| {
                    coarse_cells.push(cell);
                    coarse_cells.len() as u32 - 1
                }));
            }
            (diagonal, links) = level.coarse(coarse_cells.len(), links);
            cells = coarse_cells;
            levels.push(level);
        }
    }

    /// Diagonal and links of the aggregates: sums over their points.
    fn coarse(&self, count: usize, links: Vec<(u32, u32, f64)>) -> (Vec<f64>, Vec<(u32, u32, f64)>) {
        let mut diagonal = vec![0.0; count];
        self.aggregate.iter().zip(&self.diagonal).for_each(|(a, d)| diagonal[*a as usize] += d);
        let mut between = Vec::with_capacity(links.len() / 2);
        for (i, j, weight) in links {
            let (a, b) = (self.aggregate[i as usize], self.aggregate[j as usize]);
            if a == b {
                diagonal[a as usize] -= weight;
            } else {
                between.push((a, b, weight));
            }
        }
        // Stable: weights are added in the same order in each run.
        between.sort_by_key(|l| (l.0, l.1));
        between.dedup_by(|next, first| {
            let same = (next.0, next.1) == (first.0, first.1);
            if same {
                first.2 += next.2;
            }
            same
        });
        (diagonal, between)
    }

    /// Σ weight h over the neighbours of a point.
    fn pull(&self, i: usize, h: &[f64]) -> f64 {
        let links = &self.links[self.start[i] as usize..self.start[i + 1] as usize];
        links.iter().map(|(j, weight)| weight * h[*j as usize]).sum()
    }

    fn image(&self, h: &[f64]) -> Vec<f64> {
        (0..h.len()).map(|i| self.diagonal[i] * h[i] - self.pull(i, h)).collect()
    }
}

/// A multigrid cycle from zero: Gauss–Seidel forwards, the coarser grids, Gauss–Seidel backwards. It is symmetric and positive.
fn cycle(levels: &[AggregateLevel], load: &[f64]) -> Vec<f64> {
    let level = &levels[0];
    let mut h = vec![0.0; load.len()];
    for i in 0..h.len() {
        h[i] = (load[i] + level.pull(i, &h)) / level.diagonal[i];
    }
    if level.aggregate.is_empty() {
        return h;
    }
    let mut coarse = vec![0.0; levels[1].diagonal.len()];
    for (i, aggregate) in level.aggregate.iter().enumerate() {
        coarse[*aggregate as usize] += load[i] - (level.diagonal[i] * h[i] - level.pull(i, &h));
    }
    let correction = cycle(&levels[1..], &coarse);
    h.iter_mut().zip(&level.aggregate).for_each(|(h, a)| *h += OVER_CORRECTION * correction[*a as usize]);
    for i in (0..h.len()).rev() {
        h[i] = (load[i] + level.pull(i, &h)) / level.diagonal[i];
    }
    h
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Polynomials whose five-point Laplacian vanishes are reproduced, with rectangular pixels, an offset, and holes of one point,
    /// many points, and one that divides the map.
    #[test]
    fn harmonic_polynomials_are_reproduced() {
        /// Rounding of heights up to 60, after an offset of 1000.
        const TOLERANCE: f64 = 1e-11;
        let grid = Grid { nx: 40, ny: 30, lx: 4.0, ly: 6.0 };
        let position_of = |i: usize| ((i % 40) as f64 * grid.dx(), (i / 40) as f64 * grid.dy());
        let value_of = |i: usize| {
            let (x, y) = position_of(i);
            1000.0 + x * x - y * y + 0.7 * x * y - 2.0 * x + y
        };
        let hole = |i: usize| {
            let (x, y) = (i % 40, i / 40);
            (3..25).contains(&x) && (4..20).contains(&y) && (x + y) % 7 > 0
                || (x, y) == (35, 3)
                || (24..=26).contains(&y) && x > 0 && x < 39
        };
        let mut heights: Vec<f64> = (0..1200).map(|i| if hole(i) { f64::NAN } else { value_of(i) }).collect();
        harmonic(grid, &mut heights, false);
        let error = heights.iter().enumerate().map(|(i, h)| (h - value_of(i)).abs()).fold(0.0, f64::max);
        assert!(error < TOLERANCE, "{error:e}");
    }

    /// At the edge of a patch the slope across it vanishes; a periodic map continues there.
    #[test]
    fn edges_are_natural_or_periodic() {
        let grid = Grid::unit(6, 1);
        let ends = [f64::NAN, f64::NAN, 2.0, 3.0, f64::NAN, f64::NAN];
        let filled = |periodic| {
            let mut heights = ends;
            harmonic(grid, &mut heights, periodic);
            heights
        };
        let close = |a: [f64; 6], b: [f64; 6]| assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-14), "{a:?}");
        close(filled(false), [2.0, 2.0, 2.0, 3.0, 3.0, 3.0]);
        close(filled(true), [2.4, 2.2, 2.0, 3.0, 2.8, 2.6]);
    }

    /// The residual of a large round hole in rough heights is rounding.
    #[test]
    fn the_residual_of_large_holes_is_rounding() {
        for n in [32usize, 128] {
            let grid = Grid::unit(n, n);
            let (middle, radius) = (n as f64 / 2.0 - 0.3, 0.45 * n as f64);
            let hole = |i: usize| ((i % n) as f64 - middle).hypot((i / n) as f64 - middle) < radius;
            let rough = |i: usize| ((i * 7919) % 1009) as f64 / 1009.0;
            let mut heights: Vec<f64> = (0..n * n).map(|i| if hole(i) { f64::NAN } else { rough(i) }).collect();
            harmonic(grid, &mut heights, false);
            let unfilled: Vec<usize> = (0..n * n).filter(|&i| hole(i)).collect();
            for node in unfilled {
                let sum: f64 = neighbours(grid, false, node).map(|(j, _)| heights[j] - heights[node]).sum();
                assert!(sum.abs() < 1e-14, "{n} {node}: {sum:e}");
            }
        }
    }
}

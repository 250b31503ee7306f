//! The contact stress of a coarser grid as the initial one of the next.

use asperity_grid::{Grid, Real};
use rayon::prelude::*;

/// Contact stress (E*) of the nodes `y nx + x`, ascending; none on all others.
#[derive(Debug, Clone, Default)]
pub(in crate::method::fast) struct ContactStress {
    pub nodes: Vec<u32>,
    pub values: Vec<f64>,
}

/// Coarse pixels per side of the blocks whose loads are kept.
const BLOCK: usize = 4;

/// Least stress of a node in contact, over the mean pressure.
const LEAST: f64 = 1e-3;

/// Stress on `nodes` of a grid, in contact by the interpolated displacement, from that on a coarser grid.
pub(in crate::method::fast) fn transferred<T: Real>(
    (coarse, stress): (Grid, &[T]),
    (grid, nodes): (Grid, Vec<u32>),
    pressure: f64,
) -> ContactStress {
    let (rx, ry) = (coarse.nx as f64 / grid.nx as f64, coarse.ny as f64 / grid.ny as f64);
    let mut values: Vec<f64> = nodes
        .par_iter()
        .map(|node| {
            let (y, x) = (*node as usize / grid.nx, *node as usize % grid.nx);
            let (fy, fx) = (y as f64 * ry, x as f64 * rx);
            let (y0, x0) = (fy as usize, fx as usize);
            let (ty, tx) = (fy - y0 as f64, fx - x0 as f64);
            let at = |y: usize, x: usize| stress[(y % coarse.ny) * coarse.nx + x % coarse.nx].wide().max(0.0);
            let low = at(y0, x0) * (1.0 - tx) + at(y0, x0 + 1) * tx;
            let high = at(y0 + 1, x0) * (1.0 - tx) + at(y0 + 1, x0 + 1) * tx;
            low * (1.0 - ty) + high * ty + LEAST * pressure
        })
        .collect();
    let (high, wide) = (coarse.ny.div_ceil(BLOCK), coarse.nx.div_ceil(BLOCK));
    let block = |y: usize, x: usize, (ny, nx): (usize, usize)| (y * high / ny) * wide + x * wide / nx;
    let (mut wanted, mut present) = (vec![0.0; high * wide], vec![0.0; high * wide]);
    let share = 1.0 / coarse.points() as f64;
    for (i, v) in stress.iter().enumerate() {
        wanted[block(i / coarse.nx, i % coarse.nx, (coarse.ny, coarse.nx))] += v.wide().max(0.0) * share;
    }
    let share = 1.0 / grid.points() as f64;
    let of = |i: u32| block(i as usize / grid.nx, i as usize % grid.nx, (grid.ny, grid.nx));
    nodes.iter().zip(&values).for_each(|(i, v)| present[of(*i)] += v * share);
    nodes.iter().zip(&mut values).for_each(|(i, v)| {
        let at = of(*i);
        *v *= (wanted[at] / present[at]).clamp(0.1, 10.0);
    });
    ContactStress { nodes, values }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The load is kept for any ratio of the grids, and where the stress varies little, so is the stress.
    #[test]
    fn loads_are_kept() {
        for (coarse, fine) in [((16, 12), (32, 24)), ((15, 20), (24, 36)), ((7, 9), (14, 18))] {
            let grid = |(nx, ny): (usize, usize)| Grid { nx, ny, lx: 1.0, ly: 0.8 };
            let (coarse, fine) = (grid(coarse), grid(fine));
            let wave = |x: usize, nx: usize| 1.5 + (std::f64::consts::TAU * x as f64 / nx as f64).sin();
            let stress: Vec<f64> = (0..coarse.points()).map(|i| wave(i % coarse.nx, coarse.nx)).collect();
            let nodes: Vec<u32> = (0..fine.points() as u32).collect();
            let found = transferred((coarse, &stress), (fine, nodes), 1.5);
            let mean = found.values.iter().sum::<f64>() / fine.points() as f64;
            assert!((mean - 1.5).abs() < 1e-9, "{mean}");
            for (i, value) in found.values.iter().enumerate() {
                // Blocks of grids with other ratios hold unequal numbers of nodes.
                assert!((value - wave(i % fine.nx, fine.nx)).abs() < 0.8, "{i}: {value}");
            }
        }
    }
}

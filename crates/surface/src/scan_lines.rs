//! What scanning instruments leave in a map: steps between lines along x, and scars within them.

use crate::preparation::median;
use asperity_grid::Grid;
use rayon::prelude::*;

/// Points from which on a row of outliers is a scar.
const SCAR: usize = 8;

/// Lines that a scar is wide at most.
const WIDE: usize = 2;

/// Steps between rows, over those between columns, from which on they are probably those of scan lines. On 210 isotropic self-affine
/// surfaces (H from 0.3 to 1, 64² to 256² points, pixels of 1:4 to 2:1) the ratio was at most 1.9, on 30 with a gradient twice as large along y
/// 2.7; with offsets of 0.3 of the rms height from H = 0.8 on at least 2.8, with those of the rms height 3.2.
const OFFSET: f64 = 2.5;

/// Correlation of successive steps from which on they belong to waves along y: one of six pixels has 0.5, offsets have −0.5 and drift 0.
const SMOOTH: f64 = 0.5;

/// Rows and columns from which on steps are compared.
const LINES: usize = 32;

/// Lengths of the scars among outliers, which are in ascending order: runs along x that are long and narrow.
pub(crate) fn scars(grid: Grid, outliers: &[usize]) -> Vec<usize> {
    let is_outlier = |node: usize| outliers.binary_search(&node).is_ok();
    // Outliers above and below the middle of a run.
    let width = |middle: usize| {
        let up = (1..=WIDE).take_while(|k| is_outlier(middle + k * grid.nx)).count();
        let down = (1..=WIDE).take_while(|k| middle.checked_sub(k * grid.nx).is_some_and(is_outlier)).count();
        1 + up + down
    };
    outliers
        .chunk_by(|a, b| *b == a + 1 && b % grid.nx != 0)
        .filter(|run| run.len() >= SCAR && width(run[run.len() / 2]) <= WIDE)
        .map(<[usize]>::len)
        .collect()
}

/// Warning for rows of a map `[ny, nx]` that are offset against each other: medians of the differences between neighbouring rows scatter
/// far more than those between columns. NaN are points that were not measured.
pub(crate) fn warning(grid: Grid, heights: &[f64]) -> Option<String> {
    if grid.nx.min(grid.ny) < LINES {
        return None;
    }
    let [between_rows, between_columns] = [[0, 1], [1, 0]].map(|step| Steps::of(grid, heights, step));
    // The median over a line scatters with the root of the waves on it.
    let expected = between_columns.over_scatter() * (grid.ly / grid.lx).sqrt();
    let found = between_rows.over_scatter();
    (found > OFFSET * expected && expected > 0.0 && !between_rows.are_smooth()).then(|| {
        format!(
            "lines along x are offset against each other: medians of the steps between them scatter {:.0} times as much as those between columns, as \
             scanning leaves it: `--detrend line-median` levels the lines; marks of grinding along x look alike, and \
             are to be kept",
            found / expected
        )
    })
}

/// Differences between neighbouring rows, or columns.
struct Steps {
    /// The median over each line, about the median of all.
    medians: Vec<f64>,
    /// Typical deviation of a difference from the median of its line.
    scatter: f64,
}

impl Steps {
    /// Between rows, `[0, 1]`, or between columns, `[1, 0]`.
    fn of(grid: Grid, heights: &[f64], [dx, dy]: [usize; 2]) -> Self {
        let (lines, length) = if dy == 1 { (grid.ny, grid.nx) } else { (grid.nx, grid.ny) };
        let node = |line: usize, k: usize| if dy == 1 { line * grid.nx + k } else { k * grid.nx + line };
        let next = dx + dy * grid.nx;
        let of_line = |line: usize| {
            let difference = |k: usize| heights[node(line, k) + next] - heights[node(line, k)];
            let mut differences: Vec<f64> = (0..length).map(difference).filter(|d| !d.is_nan()).collect();
            (!differences.is_empty()).then(|| deviation(&mut differences))
        };
        let (mut medians, mut scatters): (Vec<f64>, Vec<f64>) =
            (0..lines - 1).into_par_iter().filter_map(of_line).unzip();
        if medians.is_empty() {
            return Steps { medians, scatter: 0.0 };
        }
        let (middle, scatter) = (median(&mut medians.clone()), median(&mut scatters));
        medians.iter_mut().for_each(|m| *m -= middle);
        Steps { medians, scatter }
    }

    /// Typical step, without single jumps, over the scatter of differences: the same for any unit, pixel and anisotropy of the gradient.
    fn over_scatter(&self) -> f64 {
        let mut sizes: Vec<f64> = self.medians.iter().map(|m| m.abs()).collect();
        if sizes.is_empty() || self.scatter == 0.0 { 0.0 } else { median(&mut sizes) / self.scatter }
    }

    /// Whether successive steps are alike, as those of waves.
    fn are_smooth(&self) -> bool {
        let successive: f64 = self.medians.windows(2).map(|pair| pair[0] * pair[1]).sum();
        successive > SMOOTH * self.medians.iter().map(|step| step * step).sum::<f64>()
    }
}

/// Median, and median of the deviations from it.
fn deviation(values: &mut [f64]) -> (f64, f64) {
    let middle = median(values);
    values.iter_mut().for_each(|v| *v = (*v - middle).abs());
    (middle, median(values))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Modes, Spectrum};
    use asperity_grid::rms;

    /// Pixels are `oblong` times as long along y.
    fn rough(seed: u64, hurst: f64, [nx, ny]: [usize; 2], oblong: f64) -> (Grid, Vec<f64>) {
        let grid = Grid { ly: oblong * ny as f64 / nx as f64, ..Grid::unit(nx, ny) };
        let spectrum = Spectrum { hurst, lambda_r: 0.4, lambda_s: 4.0 / nx as f64, ..Spectrum::CHALLENGE };
        (grid, Modes::new(spectrum, seed, grid.ly).heights(grid, 0.0))
    }

    /// None of 210 isotropic surfaces has offset lines; with offsets of a part of their rms height all have.
    #[test]
    fn offset_lines_and_roughness_differ() {
        for seed in 0..30 {
            for (hurst, nodes, oblong, part) in [
                (0.3, [64, 64], 1.0, 1.0),
                (0.8, [128, 96], 1.0, 0.3),
                (1.0, [128, 128], 1.0, 0.3),
                (0.5, [96, 384], 1.0, 1.0),
                (0.8, [256, 256], 1.0, 0.3),
                (0.8, [256, 64], 4.0, 1.0),
                (0.5, [64, 128], 0.5, 1.0),
            ] {
                let (grid, mut heights) = rough(seed, hurst, nodes, oblong);
                assert_eq!(warning(grid, &heights), None, "{seed} {hurst}");
                // A fixed sequence between -1 and 1.
                let offset = |y: usize| ((y * y * 7919 + 31 * y) % 101) as f64 / 50.0 - 1.0;
                let step = part * rms(&heights);
                heights.iter_mut().enumerate().for_each(|(i, h)| *h += step * offset(i / grid.nx));
                assert!(warning(grid, &heights).is_some(), "{seed} {hurst}");
            }
        }
    }

    /// Waves along y of eight pixels and more are not offsets, however few there are along x.
    #[test]
    fn waves_along_y_are_no_offsets() {
        let grid = Grid::unit(48, 64);
        for waves in 1..=8 {
            let phase = |i: usize| std::f64::consts::TAU * (waves * (i / 48)) as f64 / 64.0;
            let heights: Vec<f64> =
                (0..grid.points()).map(|i| phase(i).cos() + 0.01 * ((i % 48) as f64).sin()).collect();
            assert_eq!(warning(grid, &heights), None, "{waves}");
        }
    }

    #[test]
    fn scars_are_long_and_narrow() {
        let grid = Grid::unit(20, 10);
        let run = |y: usize, from: usize, count: usize| (0..count).map(move |k| y * 20 + from + k);
        let narrow: Vec<usize> = run(3, 5, 12).chain(run(7, 0, 3)).collect();
        assert_eq!(scars(grid, &narrow), [12]);
        let wide: Vec<usize> = (3..6).flat_map(|y| run(y, 5, 12)).collect();
        assert!(scars(grid, &wide).is_empty());
        // Runs end at the end of a line.
        let around: Vec<usize> = run(3, 14, 12).collect();
        assert!(scars(grid, &around).is_empty());
    }
}

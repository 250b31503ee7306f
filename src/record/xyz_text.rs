//! Height maps from lines of `x y h`.

use super::height_map::HeightMap;
use crate::error::{Error, Result};
use std::path::Path;

/// Tolerance of a coordinate over the spacing: rounding by the writing program.
const OFF: f64 = 1e-2;

/// A height map from lines of `x y h` without blank lines between blocks. Returns an error if the first two columns
/// are inconsistent coordinates, and `None` if they are heights.
pub(super) fn list(path: &Path, values: &[f64]) -> Option<Result<HeightMap>> {
    if values.len() < 12 {
        return None;
    }
    let columns = [0, 1].map(|k| levels(values.iter().skip(k).step_by(3).copied()));
    let stays = (0..2).find(|&k| columns[k].0[0] == columns[k].0[1]);
    let runs: Vec<usize> =
        stays.map_or(Vec::new(), |k| columns[k].0.chunk_by(|a, b| a == b).map(<[usize]>::len).collect());
    let read = if runs.is_empty() {
        let found = "coordinates of which neither stays from the first line to the second";
        Err(Error::format(path, found, "lines of x y h that run along x or along y"))
    } else {
        map(path, values, &runs)
    };
    match read {
        Err(Error::Format { file, found, accepted }) if runs_along(&runs, stays, values) || lattice(&columns) => {
            let or = "or --fourier none (surface.fourier) where all three columns are heights";
            Some(Err(Error::Format {
                file,
                found: format!("lines of x y h with {found}"),
                accepted: format!("{accepted}; {or}"),
            }))
        }
        Err(_) => None,
        whole => Some(whole),
    }
}

/// Rank of each entry among the distinct values, ascending, and the number of distinct values. Values closer than a
/// quarter of the widest difference are equal: coordinates differ by a spacing or by rounding.
fn levels(column: impl Iterator<Item = f64>) -> (Vec<usize>, usize) {
    let column: Vec<f64> = column.collect();
    let mut order: Vec<usize> = (0..column.len()).collect();
    order.sort_by(|&a, &b| column[a].total_cmp(&column[b]));
    let gaps: Vec<f64> = order.windows(2).map(|w| column[w[1]] - column[w[0]]).collect();
    let widest = gaps.iter().copied().fold(0.0, f64::max);
    let (mut of, mut level) = (vec![0; column.len()], 0);
    for (gap, &entry) in gaps.iter().zip(&order[1..]) {
        level += usize::from(*gap > 0.25 * widest);
        of[entry] = level;
    }
    (of, level + 1)
}

/// Whether one column is constant in runs while the other is monotonic in each run, which is unlikely for heights.
fn runs_along(runs: &[usize], stays: Option<usize>, values: &[f64]) -> bool {
    let Some(other) = stays.map(|k| 1 - k) else { return false };
    if runs.len() < 2 || runs[..runs.len() - 1].iter().any(|n| *n < 2) {
        return false;
    }
    let up = values[3 + other] > values[other];
    let mut line = 0;
    runs.iter().all(|n| {
        let run: Vec<f64> = (line..line + n).map(|l| values[3 * l + other]).collect();
        line += n;
        run.windows(2).all(|w| if up { w[1] > w[0] } else { w[1] < w[0] })
    })
}

/// Whether the pairs are distinct points of a lattice and fill more than half of it. Pairs of heights either coincide
/// or are on a lattice with about as many rows as there are lines.
fn lattice(columns: &[(Vec<usize>, usize); 2]) -> bool {
    let [(x, nx), (y, ny)] = columns;
    let mut pairs: Vec<_> = x.iter().zip(y).collect();
    pairs.sort_unstable();
    pairs.dedup();
    *nx > 1 && *ny > 1 && pairs.len() == x.len() && 2 * x.len() > nx * ny
}

/// A height map from lines of `x y h` in blocks separated by blank lines, the format of gnuplot and of the
/// challenge's surface. One coordinate is constant in a block; the other has constant steps, up or down, that are the
/// same in all blocks. The numbers determine which is which; in the map both increase. `blocks`: number of lines of
/// each block.
///
/// # Errors
/// Blocks of different lengths; coordinates off an even grid; different spacings along x and y.
pub(super) fn map(path: &Path, values: &[f64], blocks: &[usize]) -> Result<HeightMap> {
    let wrong = |found: String, accepted: &str| Err(Error::format(path, found, accepted));
    let (n, m) = (blocks[0], blocks.len());
    if let Some(k) = blocks.iter().position(|b| *b != n) {
        let found = format!("{} lines in block {} and {n} in the first", blocks[k], k + 1);
        return wrong(found, "blocks of x, y, h of one length (or the file is cut off)");
    }
    if n < 2 || m < 2 {
        return wrong(format!("{m} blocks of {n} lines"), "at least two blocks of two lines of x, y, h");
    }
    let at = |block: usize, line: usize, column: usize| values[3 * (block * n + line) + column];
    // Coordinate that varies within a block: 0 is x, 1 is y.
    let moves = |column: usize| (at(0, n - 1, column) - at(0, 0, column)).abs();
    let runs = usize::from(moves(0) < moves(1));
    let stays = 1 - runs;
    let (first, origin) = (at(0, 0, runs), at(0, 0, stays));
    let (step, stride) =
        ((at(0, n - 1, runs) - first) / (n - 1) as f64, (at(m - 1, 0, stays) - origin) / (m - 1) as f64);
    if ![step, stride].iter().all(|s| s.is_finite() && *s != 0.0) {
        return wrong(
            format!("coordinates that stay (steps of {step:e} in a block, {stride:e} between blocks)"),
            "x and y in even steps, one in a block, the other from block to block",
        );
    }
    if ((step / stride).abs() - 1.0).abs() > OFF {
        let found = format!("spacings of {step:e} in a block and {stride:e} between blocks");
        return wrong(found, "the same spacing along x and y");
    }
    for block in 0..m {
        for line in 0..n {
            let place = [first + line as f64 * step, origin + block as f64 * stride];
            let found = [at(block, line, runs), at(block, line, stays)];
            if (0..2).any(|k| (found[k] - place[k]).abs() > OFF * step.abs()) {
                let names = if runs == 0 { ["x", "y"] } else { ["y", "x"] };
                return wrong(
                    format!(
                        "{} = {:e}, {} = {:e} in line {} of block {}",
                        names[0],
                        found[0],
                        names[1],
                        found[1],
                        line + 1,
                        block + 1
                    ),
                    &format!("{:e} and {:e}, as even steps would have it", place[0], place[1]),
                );
            }
        }
    }
    let (nx, ny) = if runs == 0 { (n, m) } else { (m, n) };
    let up = |step: f64, i: usize, n: usize| if step > 0.0 { i } else { n - 1 - i };
    let upwards = |block: usize, line: usize| at(up(stride, block, m), up(step, line, n), 2);
    let height = |x: usize, y: usize| if runs == 0 { upwards(y, x) } else { upwards(x, y) };
    let heights = (0..nx * ny).map(|i| height(i % nx, i / nx)).collect();
    HeightMap::new(&path.display().to_string(), nx, ny, heights)
}

use super::heights::HeightMap;
use crate::error::{Error, Result};
use std::path::Path;

/// Share of a spacing by which a coordinate may be off its place: what writers round away.
const OFF: f64 = 1e-2;

/// A height map from lines of `x y h` without blank lines between its blocks, if that is what three columns are: if they lie
/// on an even grid. Heights alone do not.
pub(super) fn list(path: &Path, values: &[f64]) -> Option<HeightMap> {
    let lines = values.len() / 3;
    let stays = (0..2).find(|&k| lines > 1 && values[k] == values[3 + k])?;
    let n = (0..lines).take_while(|l| values[3 * l + stays] == values[stays]).count();
    (lines.is_multiple_of(n)).then(|| map(path, values, &vec![n; lines / n]).ok()).flatten()
}

/// A height map from lines of `x y h` in blocks apart by blank lines, as gnuplot takes them and the challenge's surface is
/// given: one coordinate is constant in a block, the other runs in even steps, upwards, the same in all blocks. Which is
/// which is seen from the numbers. `blocks` are the numbers of lines.
///
/// # Errors
/// Blocks of different lengths, coordinates off an even grid, other spacings along x than along y.
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
    // The coordinate that runs within a block: 0 is x, 1 is y.
    let runs = usize::from(at(0, 0, 0) == at(0, 1, 0));
    let stays = 1 - runs;
    let (first, origin) = (at(0, 0, runs), at(0, 0, stays));
    let (step, stride) =
        ((at(0, n - 1, runs) - first) / (n - 1) as f64, (at(m - 1, 0, stays) - origin) / (m - 1) as f64);
    if !(step > 0.0 && stride > 0.0) {
        return wrong(
            format!("coordinates that do not rise (steps of {step:e} in a block, {stride:e} between blocks)"),
            "x and y that rise in even steps, one in a block, the other from block to block",
        );
    }
    if (step / stride - 1.0).abs() > OFF {
        let found = format!("spacings of {step:e} in a block and {stride:e} between blocks");
        return wrong(found, "the same spacing along x and y");
    }
    for block in 0..m {
        for line in 0..n {
            let place = [first + line as f64 * step, origin + block as f64 * stride];
            let found = [at(block, line, runs), at(block, line, stays)];
            if (0..2).any(|k| (found[k] - place[k]).abs() > OFF * step) {
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
    let height = |x: usize, y: usize| if runs == 0 { at(y, x, 2) } else { at(x, y, 2) };
    let heights = (0..nx * ny).map(|i| height(i % nx, i / nx)).collect();
    HeightMap::new(&path.display().to_string(), nx, ny, heights)
}

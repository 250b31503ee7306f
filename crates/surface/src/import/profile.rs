//! Profiles: positions with heights, in a table of a few columns that could be read as a map.

use crate::height_map::HeightMap;
use asperity_grid::error::{Error, Result};
use std::path::Path;

/// Most columns of a table of positions and heights, and its least rows.
const COLUMNS: usize = 4;
const ROWS: usize = 8;

/// Rows from which on two columns are no map, whatever they hold.
const LONG: usize = 16;

/// Whether numbers rise, or fall, throughout. Positions with few digits may coincide.
pub(super) fn rises(numbers: &[f64]) -> bool {
    let (Some(first), Some(last)) = (numbers.first(), numbers.last()) else { return false };
    let sign = (last - first).signum();
    let steps = || numbers.windows(2).map(|pair| sign * (pair[1] - pair[0]));
    first != last
        && steps().all(|step| step >= 0.0)
        && 2 * steps().filter(|step| *step > 0.0).count() > numbers.len() - 1
}

/// # Errors
/// A table of two to four columns, or lines, of which one has positions, and a long one of two.
pub(super) fn refuse(path: &Path, map: &HeightMap) -> Result<()> {
    let column = |k: usize| -> Vec<f64> { map.heights.iter().skip(k).step_by(map.nx).copied().collect() };
    let line = |k: usize| map.heights[k * map.nx..(k + 1) * map.nx].to_vec();
    let [columns, lines] = [(map.nx, map.ny), (map.ny, map.nx)];
    let is_table = |(count, length): (usize, usize), list: &dyn Fn(usize) -> Vec<f64>| {
        let narrow = (2..=COLUMNS).contains(&count) && length >= ROWS;
        let rising = || (0..count).filter(|k| rises(&list(*k)));
        // A slope rises in all columns.
        narrow
            && (count == 2 && length >= LONG
                || if count < COLUMNS { rising().next().is_some() } else { rising().eq([0]) })
    };
    let words = if is_table(columns, &column) {
        format!("{} columns of {} numbers", map.nx, map.ny)
    } else if is_table(lines, &line) {
        format!("{} lines of {} numbers", map.ny, map.nx)
    } else {
        return Ok(());
    };
    let found = format!("{words}: probably a profile of positions and heights, which is no map");
    Err(Error::format(path, found, "a map, or --fourier none (surface.fourier) where all numbers are its heights"))
}

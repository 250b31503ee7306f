//! Profiles: positions with heights, in a table of a few columns that could be read as a map.

use super::content::{Content, ImportedFile};
use super::headings::counts;
use crate::declared::DeclaredExtent;
use crate::height_map::HeightMap;
use asperity_grid::error::{Error, Result};
use std::path::Path;

/// Most columns of a table of positions and heights, and its least rows.
const COLUMNS: usize = 4;
const ROWS: usize = 8;

/// Rows from which on two columns are no map, whatever they hold.
const LONG: usize = 16;

/// Columns of positions and heights with an index.
const WITH_INDEX: usize = 3;

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
    let accepted = "a map; --profile (surface.profile) for a surface that is uniform along y; or --fourier none (surface.fourier) where all \
                    numbers are heights";
    Err(Error::format(path, found, accepted))
}

/// Deviation of positions from equal steps, over the step, up to which the heights are taken as they are: that of positions with few digits.
const EQUAL_STEPS: f64 = 0.02;

fn refused(path: &Path, found: impl Into<String>) -> Error {
    Error::format(
        path,
        found.into(),
        "a profile: positions and heights in two columns or lines, or one line of heights. Of more columns a line above them names two: # index x z",
    )
}

/// A profile as a map of one line along x.
#[derive(Debug)]
pub(super) struct Line {
    pub(super) map: HeightMap,
    /// Extents along x and y of square pixels, in the unit of the positions, if there are any.
    pub(super) extent: Option<[f64; 2]>,
    /// Columns of the positions and of the heights, if there are columns.
    pub(super) columns: Option<[usize; 2]>,
    /// That a column was taken as an index, that heights were interpolated.
    pub(super) warnings: Vec<String>,
}

/// Whether numbers are positions: they rise throughout, or fall.
fn throughout(p: &[f64]) -> bool {
    p.len() > 1 && (p.is_sorted_by(|a, b| a < b) || p.is_sorted_by(|a, b| a > b))
}

/// Which of three lists have the positions and the heights, if the third is an index: 1, 2, 3, …. With the index.
fn without_index(lists: &[Vec<f64>]) -> Option<([usize; 2], usize)> {
    let pair = |index: usize| match [[1, 2], [0, 2], [0, 1]][index] {
        pair if throughout(&lists[pair[0]]) != throughout(&lists[pair[1]]) => Some((pair, index)),
        _ => None,
    };
    (0..WITH_INDEX).filter(|_| lists.len() == WITH_INDEX).filter(|index| counts(&lists[*index])).find_map(pair)
}

/// The line of a table of numbers. `named`: its columns of positions and heights. Otherwise two, or of three those that are no index, of which
/// the heights are those that do not rise or fall throughout, or the second.
///
/// # Errors
/// A table of other columns and lines; positions that do not rise or fall throughout; infinite heights.
pub(super) fn line(path: &Path, [nx, ny]: [usize; 2], values: Vec<f64>, named: Option<[usize; 2]>) -> Result<Line> {
    if nx == 1 || ny == 1 {
        let map = HeightMap::with_missing(&path.display().to_string(), values.len(), 1, values)?;
        return Ok(Line { map, extent: None, columns: None, warnings: Vec::new() });
    }
    let are_columns = named.is_some() || nx <= 2 || ny > 2 && nx <= WITH_INDEX;
    let (count, word) = if are_columns { (nx, "column") } else { (ny, "line") };
    let list = |k: usize| -> Vec<f64> {
        match are_columns {
            true => values.iter().skip(k).step_by(nx).copied().collect(),
            false => values[k * nx..(k + 1) * nx].to_vec(),
        }
    };
    if named.is_none() && count > WITH_INDEX {
        return Err(refused(path, format!("a map of {nx} x {ny} points")));
    }
    let mut lists: Vec<Vec<f64>> = (0..count).map(list).collect();
    let mut warnings = Vec::new();
    let pair = match (named, without_index(&lists)) {
        (Some(pair), _) => pair,
        (None, _) if count == 2 => [0, 1],
        (None, Some((pair, index))) => {
            let [a, b] = pair.map(|k| k + 1);
            warnings.push(format!(
                "{word} {} counts and is taken as an index: the profile is that of {word}s {a} and {b}",
                index + 1
            ));
            pair
        }
        (None, None) => {
            return Err(refused(
                path,
                format!("{count} {word}s, of which none is an index (1, 2, 3, …) next to positions and heights"),
            ));
        }
    };
    let swapped = named.is_none() && !throughout(&lists[pair[0]]) && throughout(&lists[pair[1]]);
    let columns = if swapped { [pair[1], pair[0]] } else { pair };
    let [positions, mut heights] = columns.map(|k| std::mem::take(&mut lists[k]));
    if !throughout(&positions) {
        return Err(refused(path, "positions that neither rise nor fall throughout"));
    }
    let n = heights.len();
    let (start, step) = (positions[0], (positions[n - 1] - positions[0]) / (n - 1) as f64);
    let off = (0..n).map(|i| ((positions[i] - start) / step - i as f64).abs()).fold(0.0, f64::max);
    if off > EQUAL_STEPS {
        warnings.push(format!(
            "the positions are not equidistant (by up to {off:.2} of the mean step): heights are interpolated linearly on {n} equal steps"
        ));
        heights = (0..n).map(|i| between(&positions, &heights, start + step * i as f64, step)).collect();
    }
    if step < 0.0 {
        heights.reverse();
    }
    let map = HeightMap::with_missing(&path.display().to_string(), n, 1, heights)?;
    let columns = are_columns.then_some(columns);
    Ok(Line { map, extent: Some([step.abs() * n as f64, step.abs()]), columns, warnings })
}

/// The profile of a file that is no text; positions have the unit of the heights.
///
/// # Errors
/// Those of [`line`], and Fourier coefficients.
pub(super) fn read(path: &Path, imported: ImportedFile) -> Result<ImportedFile> {
    let ImportedFile { content, mut declared, layout, mut warnings, not_understood } = imported;
    let Content::Map(map) = content else { return Err(refused(path, "Fourier coefficients")) };
    if map.ny == 1 {
        let content = Content::Map(map);
        return Ok(ImportedFile { content, declared, layout, warnings, not_understood });
    }
    let along_y = map.nx == 1;
    let Line { map, extent, warnings: of_line, .. } = line(path, [map.nx, map.ny], map.heights, None)?;
    let points = map.nx as f64;
    declared.extent = match (extent, declared.extent.take()) {
        (Some([x, y]), _) => Some(DeclaredExtent { x, y, unit: None }),
        (None, Some(own)) if along_y => Some(DeclaredExtent { x: own.y, y: own.y / points, ..own }),
        (None, own) => own,
    };
    warnings.extend(of_line);
    Ok(ImportedFile { content: Content::Map(map), declared, layout: layout + ", a profile", warnings, not_understood })
}

/// Linear interpolation at `x`; positions have the order of `step`.
fn between(positions: &[f64], heights: &[f64], x: f64, step: f64) -> f64 {
    let before = positions.partition_point(|p| (p - x) * step.signum() <= 0.0);
    let i = before.clamp(1, positions.len() - 1);
    let t = ((x - positions[i - 1]) / (positions[i] - positions[i - 1])).clamp(0.0, 1.0);
    // Exact at the ends, whatever is missing beside them.
    match t {
        0.0 => heights[i - 1],
        1.0 => heights[i],
        t => (1.0 - t) * heights[i - 1] + t * heights[i],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn profile(nx: usize, values: &[f64]) -> Result<Line> {
        line(Path::new("p"), [nx, values.len() / nx], values.to_vec(), None)
    }

    #[test]
    fn columns_and_lines_are_one_line_of_heights() {
        for (nx, values) in
            [(2, [0.0, 5.0, 0.5, 7.0, 1.0, 6.0, 1.5, 4.0]), (4, [1.5, 1.0, 0.5, 0.0, 4.0, 6.0, 7.0, 5.0])]
        {
            let Line { map, extent, warnings, .. } = profile(nx, &values).expect("a profile");
            assert_eq!((map.nx, map.ny, &map.heights[..]), (4, 1, &[5.0, 7.0, 6.0, 4.0][..]));
            assert_eq!((extent, warnings), (Some([2.0, 0.5]), Vec::new()));
        }
        let column = profile(1, &[1.0, 2.0, f64::NAN]).expect("heights");
        assert!((column.map.nx, column.map.missing(), column.extent) == (3, 1, None));
        let lines = profile(3, &[0.0, 1.0, 2.0, 5.0, 7.0, 6.0]).expect("three points in two lines");
        assert_eq!(lines.map.heights, [5.0, 7.0, 6.0]);
        let swapped = profile(2, &[5.0, 0.0, 7.0, 1.0, 6.0, 2.0]).expect("heights before positions");
        assert_eq!(swapped.map.heights, [5.0, 7.0, 6.0]);
    }

    /// Of three columns an index is left out, and names choose two of any number.
    #[test]
    fn an_index_is_no_position() {
        for (table, columns) in [
            ([1.0, 0.5, 7.0, 2.0, 1.0, 8.0, 3.0, 1.5, 6.0, 4.0, 2.0, 9.0], [1, 2]),
            ([7.0, 0.0, 0.5, 8.0, 1.0, 1.0, 6.0, 2.0, 1.5, 9.0, 3.0, 2.0], [2, 0]),
        ] {
            let found = profile(3, &table).expect("a profile");
            assert_eq!((found.columns, &found.map.heights[..]), (Some(columns), &[7.0, 8.0, 6.0, 9.0][..]));
            assert!(found.warnings[0].contains("taken as an index") && found.extent == Some([2.0, 0.5]));
        }
        let table = [3.0, 1.0, 5.0, 0.5, 4.0, 2.0, 5.0, 0.7].to_vec();
        let found = line(Path::new("p"), [4, 2], table, Some([1, 3])).expect("a profile");
        assert_eq!((&found.map.heights[..], found.warnings), (&[0.5, 0.7][..], Vec::new()));
    }

    /// A quadratic at unequal positions, within the error of linear interpolation, h'' d²/8.
    #[test]
    fn unequal_steps_are_interpolated() {
        let positions: Vec<f64> = (0..101).map(|i| 0.01 * f64::from(i) + 0.003 * f64::from(i).sin()).collect();
        let values: Vec<f64> = positions.iter().flat_map(|x| [*x, x * x]).collect();
        let found = profile(2, &values).expect("a profile");
        assert!(found.warnings[0].contains("not equidistant"));
        let step = (positions[100] - positions[0]) / 100.0;
        for (i, h) in found.map.heights.iter().enumerate() {
            let x = positions[0] + step * i as f64;
            assert!((h - x * x).abs() < 2.0 * 0.016f64.powi(2) / 8.0, "{i}: {h}");
        }
    }

    #[test]
    fn what_is_no_profile_is_refused() {
        let said = |nx, values: &[f64]| profile(nx, values).expect_err("refused").to_string();
        assert!(said(5, &[1.0; 25]).contains("a map of 5 x 5 points"));
        // Neither of the other columns of an index, or both, are positions; no index; two.
        for table in [
            [1.0, 5.0, 7.0, 2.0, 3.0, 8.0, 3.0, 4.0, 6.0],
            [1.0, 0.5, 7.0, 2.0, 1.0, 8.0, 3.0, 1.5, 9.0],
            [1.5, 0.5, 7.0, 2.5, 1.0, 8.0, 3.5, 1.5, 6.0],
        ] {
            assert!(said(3, &table).contains("# index x z"));
        }
        assert!(said(2, &[0.0, 1.0, 2.0, 1.0, 1.0, 1.0]).contains("neither rise nor fall"));
    }
}

//! Profiles: positions with heights, in a table of a few columns that could be read as a map.

use super::content::{Content, ImportedFile};
use crate::declared::DeclaredExtent;
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
        "a profile: positions and heights in two columns or lines, or one line of heights",
    )
}

/// A profile as a map of one line along x.
#[derive(Debug)]
pub(super) struct Line {
    pub(super) map: HeightMap,
    /// Extents along x and y of square pixels, in the unit of the positions, if there are any.
    pub(super) extent: Option<[f64; 2]>,
    /// That heights were interpolated.
    pub(super) warning: Option<String>,
}

/// The line of a table of numbers. `heights_first`: the first of two columns has the heights; otherwise that whose numbers do not rise or
/// fall throughout, or the second.
///
/// # Errors
/// A table of other columns and lines; positions that do not rise or fall throughout; infinite heights.
pub(super) fn line(path: &Path, [nx, ny]: [usize; 2], values: Vec<f64>, heights_first: Option<bool>) -> Result<Line> {
    let [first, second]: [Vec<f64>; 2] = match (nx, ny) {
        (1, _) | (_, 1) => {
            let map = HeightMap::with_missing(&path.display().to_string(), values.len(), 1, values)?;
            return Ok(Line { map, extent: None, warning: None });
        }
        (2, _) => [0, 1].map(|k| values.iter().skip(k).step_by(2).copied().collect()),
        (_, 2) => [values[..nx].to_vec(), values[nx..].to_vec()],
        _ => return Err(refused(path, format!("a map of {nx} x {ny} points"))),
    };
    let throughout = |p: &[f64]| p.len() > 1 && (p.is_sorted_by(|a, b| a < b) || p.is_sorted_by(|a, b| a > b));
    let swapped = heights_first.unwrap_or(!throughout(&first) && throughout(&second));
    let (positions, mut heights) = if swapped { (second, first) } else { (first, second) };
    if !throughout(&positions) {
        return Err(refused(path, "positions that neither rise nor fall throughout"));
    }
    let n = heights.len();
    let (start, step) = (positions[0], (positions[n - 1] - positions[0]) / (n - 1) as f64);
    let off = (0..n).map(|i| ((positions[i] - start) / step - i as f64).abs()).fold(0.0, f64::max);
    let warning = (off > EQUAL_STEPS).then(|| {
        format!(
            "the positions are not equidistant (by up to {off:.2} of the mean step): heights are interpolated linearly on {n} equal steps"
        )
    });
    if warning.is_some() {
        heights = (0..n).map(|i| between(&positions, &heights, start + step * i as f64, step)).collect();
    }
    if step < 0.0 {
        heights.reverse();
    }
    let map = HeightMap::with_missing(&path.display().to_string(), n, 1, heights)?;
    Ok(Line { map, extent: Some([step.abs() * n as f64, step.abs()]), warning })
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
    let Line { map, extent, warning } = line(path, [map.nx, map.ny], map.heights, None)?;
    let points = map.nx as f64;
    declared.extent = match (extent, declared.extent.take()) {
        (Some([x, y]), _) => Some(DeclaredExtent { x, y, unit: None }),
        (None, Some(own)) if along_y => Some(DeclaredExtent { x: own.y, y: own.y / points, ..own }),
        (None, own) => own,
    };
    warnings.extend(warning);
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
            let Line { map, extent, warning } = profile(nx, &values).expect("a profile");
            assert_eq!((map.nx, map.ny, &map.heights[..]), (4, 1, &[5.0, 7.0, 6.0, 4.0][..]));
            assert_eq!((extent, warning), (Some([2.0, 0.5]), None));
        }
        let column = profile(1, &[1.0, 2.0, f64::NAN]).expect("heights");
        assert!((column.map.nx, column.map.missing(), column.extent) == (3, 1, None));
        let swapped = profile(2, &[5.0, 0.0, 7.0, 1.0, 6.0, 2.0]).expect("heights before positions");
        assert_eq!(swapped.map.heights, [5.0, 7.0, 6.0]);
    }

    /// A quadratic at unequal positions, within the error of linear interpolation, h'' d²/8.
    #[test]
    fn unequal_steps_are_interpolated() {
        let positions: Vec<f64> = (0..101).map(|i| 0.01 * f64::from(i) + 0.003 * f64::from(i).sin()).collect();
        let values: Vec<f64> = positions.iter().flat_map(|x| [*x, x * x]).collect();
        let found = profile(2, &values).expect("a profile");
        assert!(found.warning.is_some_and(|w| w.contains("not equidistant")));
        let step = (positions[100] - positions[0]) / 100.0;
        for (i, h) in found.map.heights.iter().enumerate() {
            let x = positions[0] + step * i as f64;
            assert!((h - x * x).abs() < 2.0 * 0.016f64.powi(2) / 8.0, "{i}: {h}");
        }
    }

    #[test]
    fn what_is_no_profile_is_refused() {
        let said = |nx, values: &[f64]| profile(nx, values).expect_err("refused").to_string();
        assert!(said(3, &[1.0; 9]).contains("a map of 3 x 3 points"));
        assert!(said(2, &[0.0, 1.0, 2.0, 1.0, 1.0, 1.0]).contains("neither rise nor fall"));
    }
}

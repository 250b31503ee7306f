use super::content::{ImportOptions, ImportedFile};
use super::text::{self, TextLayout};
use crate::height_map::HeightMap;
use asperity_grid::error::{Error, Result};
use asperity_grid::extent;
use std::path::Path;

/// Tolerance of repeated edges over the range of heights: rounding by the writing program.
const OFF: f64 = 1e-5;

/// Points along x and y from a first line `#nx ny`, if present.
pub(super) fn header(start: &str) -> Option<(usize, usize)> {
    let tokens = start.lines().next()?.strip_prefix('#')?;
    let mut numbers = tokens.split_whitespace().map(|w| w.parse::<usize>().ok());
    match (numbers.next(), numbers.next(), numbers.next()) {
        (Some(Some(nx)), Some(Some(ny)), None) if nx > 0 && ny > 0 && nx.max(ny) < usize::MAX => Some((nx, ny)),
        _ => None,
    }
}

/// Reads a `konfig` file of contMech: `#nx ny`, then blocks of `x y h` lines. The last line of a block and the last
/// block repeat the first, because the cell is periodic.
pub(super) fn read(path: &Path, nx: usize, ny: usize) -> Result<ImportedFile> {
    let text_map = text::read(path, ImportOptions::default())?;
    let (map, layout) = (&text_map.map, text_map.layout);
    // Other programs write the shape before a plain matrix, in either order.
    if layout == TextLayout::Matrix && [(nx, ny), (ny, nx)].contains(&(map.nx, map.ny)) {
        return Ok(text_map.into());
    }
    if layout != TextLayout::XyzLines || (map.nx, map.ny) != (nx + 1, ny + 1) {
        let found = match layout {
            TextLayout::XyzLines => format!("{} x {} points after the header #{nx} {ny}", map.nx, map.ny),
            TextLayout::Matrix | TextLayout::Profile => {
                format!("lines of {} numbers after the header #{nx} {ny}", map.nx)
            }
        };
        let accepted =
            format!("lines of x y h on {} x {} points: the first row and column again at the end", nx + 1, ny + 1);
        return Err(Error::format(path, found, accepted));
    }
    if map.missing() > 0 {
        let found = format!("{} of {} points", map.heights.len() - map.missing(), map.heights.len());
        return Err(Error::format(path, found, "all points of a konfig file (this one is cut off)"));
    }
    let value_at = |x: usize, y: usize| map.heights[y * map.nx + x];
    let (low, high) = extent(&map.heights);
    let edges = (0..=ny).map(|y| (nx, y)).chain((0..=nx).map(|x| (x, ny)));
    for (x, y) in edges {
        let first = value_at(x % nx, y % ny);
        if (value_at(x, y) - first).abs() > OFF * (high - low) {
            let found = format!("{:e} at the repeated point x = {x}, y = {y}", value_at(x, y));
            return Err(Error::format(path, found, format!("{first:e}, the height that it repeats")));
        }
    }
    let heights = (0..nx * ny).map(|i| value_at(i % nx, i / nx)).collect();
    let map = HeightMap::new(&path.display().to_string(), nx, ny, heights)?;
    let mut declared = text_map.declared;
    if let Some(extent) = &mut declared.extent {
        // Without the repeated edges.
        extent.x *= nx as f64 / (nx + 1) as f64;
        extent.y *= ny as f64 / (ny + 1) as f64;
    }
    declared.periodic = Some(true);
    Ok(ImportedFile {
        warnings: text_map.warnings,
        ..ImportedFile::map(map, declared, "konfig of contMech, lines of x y h")
    })
}

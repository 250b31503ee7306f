//! Text of Zygo's MetroPro (`Zygo XYZ Data File`): a header up to a line `#`, lines of column, row and height in µm, and `#` at the end.

use super::content::ImportedFile;
use super::decode::TextLines;
use super::source::quoted;
use crate::declared::{Declared, DeclaredExtent};
use crate::height_map::HeightMap;
use asperity_grid::error::{Error, Result};
use std::path::Path;

const TITLE: &[u8] = b"Zygo XYZ Data File";

/// Most points along a side: those of cameras.
const MOST: usize = 1 << 16;

/// Lines of the header, from 0, and places in them.
const SIZE: (usize, usize) = (3, 2);
const ORIGIN: (usize, usize) = (3, 0);
const SPACING: (usize, usize) = (7, 6);

pub(super) fn starts(start: &[u8]) -> bool {
    start.starts_with(TITLE)
}

/// Reads the map: lines of `No Data`, and points without a line, were not measured.
///
/// # Errors
/// A header without the numbers of points; lines that are no points of it; a file that is cut off.
pub(super) fn read(path: &Path) -> Result<ImportedFile> {
    let cut =
        |found: String| Error::format(path, found, "a whole Zygo XYZ file, whose header and points end with a line #");
    let (mut lines, mut line, mut header) = (TextLines::open(path)?, String::new(), Vec::new());
    while lines.next(&mut line)? && line.trim() != "#" {
        header.push(line.clone());
        if header.len() > 64 {
            return Err(cut("more than 64 lines of a header".into()));
        }
    }
    let number = |(line, place): (usize, usize)| -> Option<f64> {
        header.get(line)?.split_whitespace().nth(place)?.parse().ok()
    };
    let count = |place: usize| {
        let n = number((SIZE.0, SIZE.1 + place)).filter(|n| n.fract() == 0.0 && *n >= 1.0 && *n <= MOST as f64);
        n.map(|n| n as usize).ok_or_else(|| cut("a header without the numbers of points on line 4".into()))
    };
    let (nx, ny) = (count(0)?, count(1)?);
    crate::files::npy::fits(path, 8 * (nx * ny) as u64)?;
    let origin = [0, 1].map(|k| number((ORIGIN.0, ORIGIN.1 + k)).unwrap_or(0.0));
    let place = |word: &str, k: usize, n: usize| -> Option<usize> {
        let index = word.parse::<f64>().ok()? - origin[k];
        (index.fract() == 0.0 && index >= 0.0 && index < n as f64).then_some(index as usize)
    };
    let (mut heights, mut taken, mut ended) = (vec![f64::NAN; nx * ny], 0, false);
    while lines.next(&mut line)? && !ended {
        let words: Vec<&str> = line.split_whitespace().collect();
        let height = match words[..] {
            ["#"] => {
                ended = true;
                continue;
            }
            [_, _, "No", "Data"] => Some(f64::NAN),
            [_, _, height] => height.parse::<f64>().ok().filter(|h| h.is_finite()),
            _ => None,
        };
        let index = words.get(..2).and_then(|w| Some(place(w[1], 1, ny)? * nx + place(w[0], 0, nx)?));
        let Some((index, height)) = index.zip(height) else {
            let found = format!("{} on line {}", quoted(&line), lines.number);
            let accepted = format!("column, row and height (or No Data) of {nx} x {ny} points");
            return Err(Error::format(path, found, accepted));
        };
        heights[index] = height;
        taken += 1;
    }
    if !ended && taken != nx * ny {
        return Err(cut(format!("{taken} of {} points", nx * ny)));
    }
    let map = HeightMap::with_missing(&path.display().to_string(), nx, ny, heights)?;
    let spacing = number(SPACING).filter(|s| *s > 0.0 && s.is_finite());
    let extent = spacing.map(|s| DeclaredExtent { x: s * nx as f64, y: s * ny as f64, unit: Some("m".into()) });
    let declared = Declared { unit: Some("µm".into()), extent, ..Declared::default() };
    Ok(ImportedFile::map(map, declared, "Zygo XYZ, lines of column, row and height"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::Content;

    const HEADER: &str = "Zygo XYZ Data File - Format 1\n0 3 0 0 \"Tue\"\n0 0 0 0 0 0\n10 20 3 2\n\"\"\n\"\"\n\"\"\n0 0.5 6e-7 0 1 0 5e-07 17\n#\n";

    fn reads(text: &str) -> Result<ImportedFile> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.xyz");
        std::fs::write(&path, text).unwrap();
        read(&path)
    }

    #[test]
    fn points_lie_where_their_indices_say() {
        let points = "10 20 1.5\n11 20 No Data\n12 20 2\n12 21 -3\n11 21 4\n10 21 5\n";
        let found = reads(&format!("{HEADER}{points}#\n")).expect("read");
        let Content::Map(map) = &found.content else { panic!("a map") };
        assert_eq!(map.heights.iter().map(f64::to_string).collect::<Vec<_>>().join(" "), "1.5 NaN 2 5 4 -3");
        let extent = found.declared.extent.clone().expect("extents");
        assert!((extent.x - 1.5e-6).abs() < 1e-18 && (extent.y - 1e-6).abs() < 1e-18);
        assert_eq!(found.declared.unit_m(), Some(1e-6));
        for (text, says) in [
            (format!("{HEADER}10 20 1\n"), "1 of 6 points"),
            (format!("{HEADER}9 20 1\n#\n"), "\"9 20 1\" on line 10"),
            (format!("{HEADER}10 20 oak\n#\n"), "on line 10; accepted: column, row and height"),
            (HEADER.replace("10 20 3 2", "10 20"), "numbers of points on line 4"),
        ] {
            let said = reads(&text).expect_err(says).to_string();
            assert!(said.contains(says), "{said}");
        }
    }
}

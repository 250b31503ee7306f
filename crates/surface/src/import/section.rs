//! One channel of a text file: from its lines of numbers to a map.

use super::content::ImportedFile;
use super::header::ChannelHeader;
use super::headings::{Corner, Headings, counts, even};
use super::source::quoted;
use crate::declared::Declared;
use crate::height_map::HeightMap;
use crate::xyz_text;
use asperity_grid::error::{Error, Result};
use std::path::Path;

/// Longest side of a matrix in text, in points: that of the largest grids. A long list in few columns is no map.
const LONGEST_SIDE: usize = 1 << 16;

/// Layout of a text file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum TextLayout {
    Matrix,
    XyzLines,
}

/// A map in text and what its header states.
pub(super) struct TextMap {
    pub(super) map: HeightMap,
    pub(super) declared: Declared,
    pub(super) layout: TextLayout,
    pub(super) warnings: Vec<String>,
    pub(super) not_understood: Vec<String>,
    /// Factor by which the numbers of the file were multiplied.
    factor: f64,
}

impl From<TextMap> for ImportedFile {
    fn from(text: TextMap) -> Self {
        let words = match text.layout {
            TextLayout::Matrix => "text, one line per y",
            TextLayout::XyzLines => "text, lines of x y h",
        };
        let factor = if text.factor == 1.0 { String::new() } else { format!(", numbers times {:e}", text.factor) };
        let layout = format!("{words}{factor}");
        let (warnings, not_understood) = (text.warnings, text.not_understood);
        ImportedFile { warnings, not_understood, ..ImportedFile::map(text.map, text.declared, layout) }
    }
}

/// A channel: its header and its numbers.
#[derive(Default)]
pub(super) struct TextChannel {
    pub(super) header: ChannelHeader,
    /// Names of the columns, and their line if it is no comment.
    pub(super) headings: Option<(Headings, Option<usize>)>,
    pub(super) values: Vec<f64>,
    pub(super) nx: usize,
    pub(super) ny: usize,
    /// Number of lines of each block; blank lines between blocks indicate lines of `x y h`.
    pub(super) blocks: Vec<usize>,
    pub(super) in_block: bool,
    pub(super) first_line: usize,
    /// Word at the corner of row and column labels.
    pub(super) corner: Option<String>,
    /// Lines whose first field is empty.
    pub(super) indented: usize,
    pub(super) channels: Vec<String>,
}

impl TextChannel {
    pub(super) fn finish(mut self, path: &Path, heights_only: bool) -> Result<TextMap> {
        self.unindent();
        let labels = self.take_labels(path, heights_only)?;
        if let Some(missing) = self.header.missing {
            self.values.iter_mut().filter(|v| **v == missing).for_each(|v| *v = f64::NAN);
        }
        let columns = self.headings.as_ref().filter(|(h, _)| h.len() == self.nx).and_then(|(h, _)| h.columns());
        if let Some(columns) = columns.filter(|_| !heights_only) {
            let headings = self.headings.take().expect("that of the columns").0;
            let unit = |k| headings.unit(k);
            self.header.take_units([unit(columns.x), unit(columns.y)], unit(columns.height));
            let points = xyz_text::Points::of(&self.values, self.nx, [columns.x, columns.y, columns.height]);
            return self.lines(path, points.grid(path)?);
        }
        if self.nx == 3 && !heights_only && labels.is_none() && self.header.points == [None; 2] {
            // Three columns with blank lines are always x y h; without, if the first two resemble coordinates.
            let points = xyz_text::Points::of(&self.values, 3, [0, 1, 2]);
            let map = if self.blocks.len() > 1 { Some(points.grid(path)) } else { points.list(path) };
            if let Some(map) = map {
                return self.lines(path, map?);
            }
        }
        self.matrix(path, labels)
    }

    /// Drops a first column that is empty on all lines: tabs as indentation.
    fn unindent(&mut self) {
        if self.indented == self.ny && self.nx > 1 && self.ny > 1 {
            let nx = self.nx;
            let mut offset = 0;
            self.values.retain(|_| {
                offset += 1;
                (offset - 1) % nx != 0
            });
            self.nx -= 1;
        }
    }

    /// Removes labels of rows and columns: evenly spaced numbers in the first line and column. Returns their spacing along x and y, if
    /// they do not just count. Heights of descending labels are reversed, as those of lines of `x y h` are.
    fn take_labels(&mut self, path: &Path, heights_only: bool) -> Result<Option<[Option<f64>; 2]>> {
        let (nx, line) = (self.nx, self.first_line);
        if self.corner.is_none() && (heights_only || nx < 4 || self.ny < 4) {
            return Ok(None);
        }
        let rows: Vec<f64> = self.values.iter().step_by(nx.max(1)).skip(1).copied().collect();
        let columns = self.values[1..nx].to_vec();
        let spacing = even(&columns).zip(even(&rows)).filter(|_| self.corner.is_some() || self.has_bare_labels());
        let Some((x, y)) = spacing else {
            let Some(corner) = &self.corner else { return Ok(None) };
            let found = format!("{} on line {line}, column 1 (counted from 1)", quoted(corner));
            return Err(Error::format(path, found, "a number, or evenly spaced labels of all rows and columns"));
        };
        match &self.corner {
            Some(word) => {
                let corner = Corner::of(word);
                self.header.take_units(corner.lateral, corner.height);
                self.header.warnings.extend(corner.warning);
            }
            None if !self.values[0].is_nan() => self.header.warnings.push(format!(
                "evenly spaced numbers on line {line} and in the first column are taken as labels, not as heights: `--fourier none` keeps \
                 them, and a word in the corner (y\\x) says that they are labels"
            )),
            None => {}
        }
        let spacings = [(x, &columns), (y, &rows)].map(|(step, labels)| (!counts(labels)).then_some(step.abs()));
        let mut inside: Vec<Vec<f64>> = self.values.chunks_exact(nx).skip(1).map(|row| row[1..].to_vec()).collect();
        if x < 0.0 {
            inside.iter_mut().for_each(|row| row.reverse());
        }
        if y < 0.0 {
            inside.reverse();
        }
        (self.values, self.nx, self.ny) = (inside.concat(), nx - 1, self.ny - 1);
        Ok(Some(spacings))
    }

    /// Whether the first line and column without a word in the corner are labels and not part of an even slope: the corner is empty, or
    /// does not continue their steps.
    fn has_bare_labels(&self) -> bool {
        let corner = self.values[0];
        let column: Vec<f64> = self.values.iter().step_by(self.nx).copied().collect();
        let slope = even(&self.values[..self.nx]).is_some() || even(&column).is_some();
        let other = self.values.chunks_exact(self.nx).skip(1).any(|row| even(&row[1..]).is_none());
        corner.is_nan() || !slope && other
    }

    fn lines(self, path: &Path, (map, extent): (HeightMap, [f64; 2])) -> Result<TextMap> {
        self.done(path, map, Some(extent), TextLayout::XyzLines)
    }

    fn matrix(mut self, path: &Path, labels: Option<[Option<f64>; 2]>) -> Result<TextMap> {
        if let Some((headings, Some(line))) = &self.headings
            && labels.is_none()
            && headings.len() != self.nx
        {
            let found = format!("{} words on line {line} and {} numbers below", headings.len(), self.nx);
            let accepted = "a name for each column, key = value, or a comment (# in front)";
            return Err(Error::format(path, found, accepted));
        }
        self.shape(path)?;
        let (nx, ny) = (self.nx, self.ny);
        let is_whole = |row: &[f64]| row.iter().all(|v| v.fract() == 0.0);
        if labels.is_none()
            && nx > 3
            && ny > 2
            && counts(&self.values[..nx])
            && !self.values.chunks_exact(nx).skip(1).all(is_whole)
        {
            let found = format!("1, 2, 3, … on line {}: numbers of the columns, not heights", self.first_line);
            return Err(Error::format(path, found, "the file without this line, or with # in front of it"));
        }
        let extent = labels.and_then(|[x, y]| Some([x? * nx as f64, y? * ny as f64]));
        let map = HeightMap::with_missing(&path.display().to_string(), nx, ny, std::mem::take(&mut self.values))?;
        self.done(path, map, extent, TextLayout::Matrix)
    }

    /// Compares the shape with the declared one; a single column or line is cut into lines of the declared length.
    fn shape(&mut self, path: &Path) -> Result<()> {
        let [x, y] = self.header.points;
        let line = self.nx == 1 || self.ny == 1;
        if let (true, Some(x), Some(y)) = (line, x, y)
            && x.checked_mul(y) == Some(self.values.len())
        {
            (self.nx, self.ny) = (x, y);
        }
        if x.is_some_and(|x| x != self.nx) || y.is_some_and(|y| y != self.ny) {
            let word = |n: Option<usize>| n.map_or("any".to_string(), |n| n.to_string());
            let found = format!("{} lines of {} numbers", self.ny, self.nx);
            let accepted = format!("{} lines of {}, as the header declares (or the file is cut off)", word(y), word(x));
            return Err(Error::format(path, found, accepted));
        }
        let column = self.nx == 1 && self.ny > 1;
        if [x, y] == [None; 2] && column {
            let found = format!("a single column of {} numbers", self.values.len());
            let accepted = "a map: one line per y, lines of x y h, or a header with x-pixels and y-pixels";
            return Err(Error::format(path, found, accepted));
        }
        if self.nx.max(self.ny) > LONGEST_SIDE {
            let found = format!("{} lines of {} numbers", self.ny, self.nx);
            let accepted =
                format!("a map of at most {LONGEST_SIDE} points along a side, or lines of x y h on an even grid");
            return Err(Error::format(path, found, accepted));
        }
        Ok(())
    }

    fn done(self, path: &Path, mut map: HeightMap, extent: Option<[f64; 2]>, layout: TextLayout) -> Result<TextMap> {
        let mut declared = self.header.declared(path, [map.nx, map.ny], extent)?;
        declared.channels = self.channels;
        let factor = self.header.factor();
        if factor != 1.0 {
            map.heights.iter_mut().for_each(|h| *h *= factor);
        }
        let ChannelHeader { warnings, not_understood, .. } = self.header;
        Ok(TextMap { map, declared, layout, warnings, not_understood, factor })
    }
}

//! One channel of a text file: from its lines of numbers to a map.

use super::content::ImportedFile;
use super::content::{Fourier, ImportOptions};
use super::fourier;
use super::header::ChannelHeader;
use super::headings::{Corner, Headings, counts, even, even_as_written};
use super::profile::{self, rises};
use super::source::{list, quoted, without_names};
use crate::declared::Declared;
use crate::height_map::HeightMap;
use crate::xyz_text;
use asperity_grid::error::{Error, Result};
use std::path::Path;

/// Longest side of a matrix in text, in points: that of the largest grids. A long list in few columns is no map.
const LONGEST_SIDE: usize = 1 << 16;

/// Numbers of a single line that may be a map.
const SHORT: usize = 4;

/// Numbers from which on positions that are not even are recognised.
const LONG: usize = 12;

/// Layout of a text file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum TextLayout {
    Matrix,
    XyzLines,
    Profile,
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
            TextLayout::Profile => "text, a profile",
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
    /// Lines that were passed over as comments or statements although all but their first field are those of a row: line, number of
    /// fields, first field.
    pub(super) passed: Vec<(usize, usize, String)>,
    /// Whether a line ends in a separator that is not before a missing height.
    pub(super) closed: bool,
    /// One or two whole numbers above the table, and their line.
    counts: Option<(Vec<f64>, usize)>,
    /// Lines whose first field is empty.
    pub(super) indented: usize,
    pub(super) channels: Vec<String>,
}

/// Selects a channel: the one requested, or the only one that has heights. `first`: the first line of the file with its number, for a message.
pub(super) fn choose(
    path: &Path,
    sections: Vec<TextChannel>,
    options: ImportOptions,
    first: Option<(usize, String)>,
) -> Result<TextChannel> {
    let mut sections: Vec<TextChannel> = sections.into_iter().filter(|s| s.ny > 0).collect();
    let name = |s: &TextChannel| s.header.channel.clone().unwrap_or_default();
    let names: Vec<String> = sections.iter().map(name).filter(|n| !n.is_empty()).collect();
    let heights: Vec<usize> = (0..sections.len()).filter(|i| sections[*i].header.no_length.is_none()).collect();
    let index = match options.dataset {
        Some(requested) => {
            sections.iter().position(|s| s.header.channel.as_deref() == Some(requested)).ok_or_else(|| {
                if names.is_empty() {
                    return without_names(path, requested);
                }
                Error::format(path, format!("no channel named {}", quoted(requested)), list(&names))
            })?
        }
        None => match (&heights[..], &sections[..]) {
            ([only], _) => *only,
            ([], []) => {
                let is_scene = path.extension().is_some_and(|end| end == "toml");
                let accepted = if is_scene { " (a scene? `asperity run` takes scenes)" } else { "" };
                let found =
                    first.map_or("the file is empty".into(), |(n, line)| format!("line {n} is {}", quoted(&line)));
                let matrix = "a matrix of numbers apart by blanks, tabs, commas or semicolons, one line per y";
                return Err(Error::format(path, format!("no heights: {found}"), format!("{matrix}{accepted}")));
            }
            // Refused below.
            ([], _) => 0,
            (several, _) => {
                let names: Vec<String> = several.iter().map(|i| name(&sections[*i])).collect();
                let found = format!("{} channels ({})", several.len(), list(&names));
                return Err(Error::format(path, found, "the name of one of them as --dataset (surface.dataset)"));
            }
        },
    };
    let candidates = heights.iter().map(|i| name(&sections[*i])).filter(|n| !n.is_empty()).collect();
    let mut chosen = sections.swap_remove(index);
    if let Some((unit, line)) = &chosen.header.no_length {
        let found = format!("values in {} on line {line}, which are no heights", quoted(unit));
        return Err(Error::format(path, found, super::unit::ACCEPTED));
    }
    chosen.channels = candidates;
    Ok(chosen)
}

impl TextChannel {
    pub(super) fn finish(mut self, path: &Path, options: ImportOptions) -> Result<TextMap> {
        self.unindent();
        self.check_counts(path, options)?;
        if options.profile {
            return self.profile(path);
        }
        let heights_only = options.fourier == Some(Fourier::None);
        // Of a line of one or two numbers, which may be the size of a table, those that are passed over are the table.
        let are_rows = |count: usize| count == self.nx && self.nx > 3 || self.ny == 1 && self.nx <= 2;
        if let Some((line, _, word)) = self.passed.iter().find(|(_, count, _)| are_rows(*count)) {
            let found = format!("{} on line {line}, column 1 (counted from 1)", quoted(word));
            return Err(Error::format(path, found, "a number, or a comment of another number of words"));
        }
        let labels = self.take_labels(path, heights_only)?;
        if let Some(missing) = self.header.missing {
            self.values.iter_mut().filter(|v| **v == missing).for_each(|v| *v = f64::NAN);
        }
        let columns = self.headings.as_ref().filter(|(h, _)| h.len() == self.nx).and_then(|(h, _)| h.columns());
        if let Some(columns) = columns.filter(|_| !heights_only) {
            let headings = self.headings.take().expect("that of the columns").0;
            self.leave_out(headings.flags(), columns.height);
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
        if labels.is_none() && !heights_only && self.header.points == [None; 2] {
            self.refuse_points(path)?;
        }
        self.matrix(path, labels, heights_only)
    }

    /// As [`TextChannel::take_counts`], of a table that is yet to begin.
    pub(super) fn take_counts_above_names(&mut self) -> bool {
        let takes = self.ny == 1 && self.take_counts(0);
        if takes {
            (self.blocks, self.in_block) = (Vec::new(), false);
        }
        takes
    }

    /// Takes the first line as the size of the table that begins on line `next`, if it can be one.
    pub(super) fn take_counts(&mut self, next: usize) -> bool {
        let first = &self.values[..self.nx];
        if self.ny != 1 || self.nx > 2 || self.counts.is_some() || !first.iter().all(|n| *n >= 1.0 && n.fract() == 0.0)
        {
            return false;
        }
        self.counts = Some((self.values.drain(..self.nx).collect(), self.first_line));
        (self.nx, self.ny, self.first_line, self.blocks) = (0, 0, next, vec![1]);
        true
    }

    /// # Errors
    /// Whole numbers above the table that are not its size: its lines, their product with its columns, or both in either order.
    fn check_counts(&self, path: &Path, options: ImportOptions) -> Result<()> {
        let (nx, ny) = (self.nx as f64, self.ny as f64);
        let is_size = |counts: &[f64], ny: f64| match *counts {
            // A list of points has both sides of its grid above it, too.
            [a, b] => [a, b] == [nx, ny] || [a, b] == [ny, nx] || nx == 3.0 && a * b == ny,
            _ => [&[ny][..], &[nx * ny]].contains(&counts),
        };
        match &self.counts {
            // A line below a 1 is rather of another length.
            Some((counts, line)) if !is_size(counts, ny) || counts[..] == [1.0] => {
                let found = format!("{nx} heights on line {}", self.first_line);
                let accepted = format!(
                    "{}, as on line {line} (or the file is cut off); or the size of the table on line {line}",
                    counts.len()
                );
                return Err(Error::format(path, found, accepted));
            }
            Some(_) => {}
            // A size as wide as its table.
            None if self.ny > 2 && self.nx <= 2 && is_size(&self.values[..self.nx], ny - 1.0) => {
                let positions: Vec<f64> = self.values.iter().step_by(self.nx).copied().collect();
                let is_whole = self.header.points == [Some(self.nx), Some(self.ny)];
                // Heights, or the first of even positions.
                if is_whole || options.fourier == Some(Fourier::None) || self.nx == 2 && even(&positions).is_some() {
                    return Ok(());
                }
                let numbers = self.values[..self.nx].iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
                let found = format!(
                    "{numbers} on line {}, the size of the lines below it, which may be a height",
                    self.first_line
                );
                let accepted = "that line with # in front, or --fourier none (surface.fourier) where it has heights";
                return Err(Error::format(path, found, accepted));
            }
            None => {}
        }
        Ok(())
    }

    /// Refuses lines of x y h in other columns than the first three, or with further ones, whose columns have no names.
    fn refuse_points(&self, path: &Path) -> Result<()> {
        /// Most columns of such a list, and its least lines.
        const COLUMNS: usize = 6;
        const LINES: usize = 8;
        // Whole numbers in the first two of four columns may be wave numbers.
        let are_waves = self.nx == 4 && fourier::may_be(&self.values);
        if !(3..=COLUMNS).contains(&self.nx) || self.ny < LINES || are_waves {
            return Ok(());
        }
        let pairs = (0..self.nx).flat_map(|y| (0..y).map(move |x| [x, y]));
        let is_grid = |[x, y]: &[usize; 2]| {
            let height = (0..self.nx).find(|k| k != x && k != y).expect("a third column");
            xyz_text::Points::of(&self.values, self.nx, [*x, *y, height]).list(path).is_some_and(|map| map.is_ok())
        };
        let Some([x, y]) = pairs.into_iter().find(is_grid) else { return Ok(()) };
        let found = format!("{} columns, of which {} and {} are coordinates of an even grid", self.nx, x + 1, y + 1);
        let accepted = "three columns x y h, names of the columns (# x y h), or --fourier none (surface.fourier) where all are heights";
        Err(Error::format(path, found, accepted))
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
            let Some(corner) = &self.corner else { return self.take_labels_alone(path) };
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

    /// Likewise of labels of the lines alone, or of the columns alone: evenly spaced numbers in the first column or on the first line,
    /// where no other column or line is even.
    ///
    /// # Errors
    /// Numbers that are not even and increase throughout, as no other column or line does.
    fn take_labels_alone(&mut self, path: &Path) -> Result<Option<[Option<f64>; 2]>> {
        let mut found = false;
        for axis in [0, 1] {
            let (nx, ny) = (self.nx, self.ny);
            let column = |k: usize| -> Vec<f64> { self.values.iter().skip(k).step_by(nx).copied().collect() };
            let row = |k: usize| self.values[k * nx..(k + 1) * nx].to_vec();
            let list = |k: usize| if axis == 0 { column(k) } else { row(k) };
            let (count, length) = if axis == 0 { (nx, ny) } else { (ny, nx) };
            if count < 4 || self.header.points[axis] == Some(count) {
                continue;
            }
            let labels = list(0);
            let alone = |is: fn(&[f64]) -> bool| is(&labels) && !(1..count).any(|k| is(&list(k)));
            let is_long = |labels: &[f64]| labels.len() >= LONG && rises(labels);
            let place = ["in the first column".to_string(), format!("on line {}", self.first_line)][axis].clone();
            // Four columns may also be Fourier coefficients, or x, y and heights behind a number.
            let points = || xyz_text::Points::of(&self.values, nx, [1, 2, 3]).list(path);
            if axis == 0 && nx == 4 && !(counts(&labels) && points().is_some_and(|map| map.is_ok())) {
                continue;
            }
            let [is_even, is_written]: [fn(&[f64]) -> bool; 2] =
                [|l| even(l).is_some(), |l| even_as_written(l).is_some()];
            // Few heights may be even by chance, or but for their last digit; hardly so from zero on.
            let from_zero = counts(&labels) || labels[0] == 0.0 || labels[length - 1] == 0.0;
            let is_sure = length >= LONG || length >= 4 && is_even(&labels) && from_zero;
            let doubtful = length >= 4 && (alone(is_even) || alone(is_written));
            if !(is_sure && alone(is_written)) {
                let last = list(count - 1);
                let ends = length >= LONG && even_as_written(&last).is_some();
                let place = match ends && !(0..count - 1).any(|k| even_as_written(&list(k)).is_some()) {
                    true => ["in the last column", "on the last line"][axis].to_string(),
                    false if doubtful || alone(is_long) => place,
                    false => continue,
                };
                let found = format!(
                    "numbers {place} that rise or fall evenly, as no others do: probably positions, not heights"
                );
                let accepted = "heights alone, or --fourier none (surface.fourier) where all are heights";
                return Err(Error::format(path, found, accepted));
            }
            let whose = ["lines", "columns"][axis];
            self.header.warnings.push(format!(
                "evenly spaced numbers {place} are taken as labels of the {whose}, not as heights: `--fourier none` keeps them"
            ));
            if axis == 0 {
                self.values = self.values.chunks_exact(nx).flat_map(|row| &row[1..]).copied().collect();
                self.nx -= 1;
                found |= nx > 4;
            } else {
                self.values.drain(..nx);
                self.ny -= 1;
                found = true;
            }
            let falls = labels[0] > labels[length - 1];
            if falls && axis == 0 {
                let rows: Vec<&[f64]> = self.values.chunks_exact(self.nx).rev().collect();
                self.values = rows.concat();
            } else if falls {
                self.values.chunks_exact_mut(nx).for_each(<[f64]>::reverse);
            }
        }
        Ok(found.then_some([None, None]))
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

    /// Heights whose flags are 0 are missing.
    fn leave_out(&mut self, flags: Option<usize>, heights: usize) {
        let Some(flags) = flags else { return };
        let rows = self.values.chunks_exact_mut(self.nx).filter(|row| row[flags] == 0.0);
        rows.for_each(|row| row[heights] = f64::NAN);
    }

    /// A table of positions and heights, whose units the names of the columns may state, or one line of heights.
    fn profile(mut self, path: &Path) -> Result<TextMap> {
        if let Some(missing) = self.header.missing {
            self.values.iter_mut().filter(|v| **v == missing).for_each(|v| *v = f64::NAN);
        }
        let headings = self.headings.take().map(|(h, _)| h).filter(|h| h.len() == self.nx);
        let varies = |k: usize| self.values.iter().skip(k).step_by(self.nx).any(|v| *v != self.values[k]);
        let named = match headings.as_ref().and_then(Headings::columns) {
            Some(c) if varies(c.x) && varies(c.y) => {
                let accepted = "a profile: positions along it in one column (s), and heights";
                return Err(Error::format(path, "positions along x and y that both vary", accepted));
            }
            Some(c) => Some([if varies(c.y) { c.y } else { c.x }, c.height]),
            None => headings.as_ref().and_then(Headings::columns_of_profile),
        };
        if let Some([_, heights]) = named {
            self.leave_out(headings.as_ref().and_then(Headings::flags), heights);
        }
        let line = profile::line(path, [self.nx, self.ny], std::mem::take(&mut self.values), named)?;
        if let (Some(headings), Some([positions, heights])) = (headings, line.columns) {
            let lateral = headings.unit(positions);
            self.header.take_units([lateral.clone(), lateral], headings.unit(heights));
        }
        let mut done = self.done(path, line.map, line.extent, TextLayout::Profile)?;
        done.warnings.extend(line.warnings);
        Ok(done)
    }

    fn lines(self, path: &Path, (map, extent): (HeightMap, [f64; 2])) -> Result<TextMap> {
        self.done(path, map, Some(extent), TextLayout::XyzLines)
    }

    fn matrix(mut self, path: &Path, labels: Option<[Option<f64>; 2]>, heights_only: bool) -> Result<TextMap> {
        if let Some((headings, Some(line))) = &self.headings
            && labels.is_none()
            && headings.len() != self.nx
        {
            let found = format!("{} words on line {line} and {} numbers below", headings.len(), self.nx);
            let accepted = "a name for each column, key = value, or a comment (# in front)";
            return Err(Error::format(path, found, accepted));
        }
        let names = self.headings.as_ref().map(|(h, _)| h).filter(|h| h.len() == self.nx);
        if names.is_some_and(|names| names.columns_of_profile().is_some()) {
            let accepted = "a map; --profile (surface.profile) for a surface that is uniform along y; or columns without these names where all are heights";
            return Err(Error::format(path, "columns of x and heights: a profile, which is no map", accepted));
        }
        if let Some(names) = names.filter(|_| !heights_only).and_then(Headings::of_quantities) {
            let found = format!("columns named {}, a table of quantities", list(names));
            let accepted = "a map; --fourier none (surface.fourier) where all columns are heights";
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
        if [x, y] == [None; 2] && line && self.values.len() > if self.nx == 1 { 1 } else { SHORT } {
            let found =
                format!("a single {} of {} numbers", ["line", "column"][usize::from(self.nx == 1)], self.values.len());
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

//! Height maps in text: matrices, with or without labels, and lines of `x y h`, with headers of other programs.
//!
//! A matrix has one line per y, from y = 0, with the heights along x separated by blanks, tabs, commas or semicolons; `#` between blanks, or `#` or `%` at the
//! start of a line, begins a comment. Several channels may follow each other, each with its header.

use super::comments::{comment_apart, fields_of};
use super::content::ImportOptions;
use super::decode::TextLines;
use super::fields::{Notation, Separator, split};
use super::header::ChannelHeader;
use super::headings::Headings;
use super::marks::is_value;
use super::section::{TextChannel, choose};
pub(super) use super::section::{TextLayout, TextMap};
use super::source::quoted;
use asperity_grid::error::{Error, Result};
use std::path::Path;

/// Reads a text file. With [`Fourier::None`] three columns are always heights, never `x y h`.
///
/// # Errors
/// Words that are neither numbers nor marks of missing heights; lines of different lengths; a size other than the declared one; headers
/// whose values are not understood; several channels without a requested name.
pub(super) fn read(path: &Path, options: ImportOptions) -> Result<TextMap> {
    let mut lines = TextLines::open(path)?;
    let mut reader = TextReader { path, notation: Notation::default(), sections: vec![TextChannel::default()] };
    let (mut line, mut previous) = (String::new(), String::new());
    let mut first = None;
    while lines.next(&mut line)? {
        if first.is_none() && !line.trim().is_empty() {
            first = Some((lines.number, line.trim().to_string()));
        }
        reader.line(lines.number, &line)?;
        if !lines.ended {
            break;
        }
        std::mem::swap(&mut line, &mut previous);
    }
    if !lines.ended && is_cut(&previous, &line) {
        let found =
            format!("line {} without a line break, and its last number is shorter than the others", lines.number);
        return Err(Error::format(path, found, "a whole file (this one is cut off)"));
    }
    let doubt = reader.notation.check(path)?;
    let mut text_map = choose(path, reader.sections, options, first)?.finish(path, options)?;
    text_map.warnings.extend(doubt);
    Ok(text_map)
}

/// Whether the last number of the last line has fewer digits than all numbers before, which have equally many.
fn is_cut(previous: &str, last: &str) -> bool {
    let digits = |word: &str| word.split_once('.').map_or(0, |(_, tail)| tail.len());
    let mut tokens: Vec<&str> = previous.split_whitespace().chain(last.split_whitespace()).collect();
    let Some(end) = tokens.pop() else { return false };
    let [first, remainder @ ..] = &tokens[..] else { return false };
    remainder.len() > 1
        && digits(first) > 0
        && remainder.iter().all(|w| digits(w) == digits(first))
        && digits(end) < digits(first)
}

struct TextReader<'a> {
    path: &'a Path,
    notation: Notation,
    sections: Vec<TextChannel>,
}

impl TextReader<'_> {
    fn line(&mut self, number: usize, line: &str) -> Result<()> {
        let (text, comment) = comment_apart(line);
        if text.is_empty() && !comment.is_empty() {
            self.pass(number, fields_of(line).0);
        }
        if !comment.trim().is_empty() {
            self.comment(number, comment.trim())?;
        }
        if let Some(statement) = text.trim_start().strip_prefix('\\') {
            // NanoScope's exports.
            return self.comment(number, statement);
        }
        if text.trim().is_empty() {
            self.section().in_block &= !line.trim().is_empty();
            return Ok(());
        }
        let (fields, separator) = split(text);
        let previous = self.section().values.len();
        for (i, field) in fields.iter().enumerate() {
            match self.notation.number(field, number) {
                Some(value) if value.is_infinite() => {
                    let found = format!("{} on line {number}, column {} (counted from 1)", quoted(field), i + 1);
                    return Err(Error::format(self.path, found, "finite numbers, and nan where nothing was measured"));
                }
                Some(value) => self.section().values.push(value),
                None => {
                    self.section().values.truncate(previous);
                    return self.words(number, text, &fields, i, separator);
                }
            }
        }
        self.notation.row(&fields, separator, number);
        self.row(number, text, &fields, separator)
    }

    fn section(&mut self) -> &mut TextChannel {
        self.sections.last_mut().expect("never empty")
    }

    /// Remembers a line that is passed over although all but its first field are those of a row.
    fn pass(&mut self, number: usize, text: &str) {
        let text = text.trim();
        let is_border = |c: char| c.is_whitespace() || matches!(c, ',' | ';');
        let (first, rest) = text.split_at(text.find(is_border).unwrap_or(text.len()));
        let rest = rest.trim_start();
        let others = split(rest.strip_prefix([',', ';']).unwrap_or(rest)).0;
        if others.len() > 1 && others.iter().all(|f| is_value(f) || *f == first) {
            self.section().passed.push((number, others.len() + 1, first.to_string()));
        }
    }

    fn comment(&mut self, number: usize, text: &str) -> Result<()> {
        if ChannelHeader::channel_of(text).is_some() && self.section().ny > 0 {
            self.sections.push(TextChannel::default());
        }
        let path = self.path;
        let section = self.section();
        if !section.header.read_key(path, number, text, false)? && section.ny <= 1 {
            let fields = split(text).0;
            let headings = Headings::of_units(&fields).unwrap_or_else(|| Headings::of(&fields));
            let are_names = headings.columns().is_some() || headings.columns_of_profile().is_some();
            if are_names && !text.contains('=') && (section.ny == 0 || section.take_counts_above_names()) {
                let headings = match &section.headings {
                    Some((above, _)) => headings.below_units(above),
                    None => headings,
                };
                section.headings = Some((headings, None));
            }
        }
        Ok(())
    }

    /// A line of numbers, whose values are stored.
    fn row(&mut self, number: usize, text: &str, fields: &[&str], separator: Separator) -> Result<()> {
        let path = self.path;
        let section = self.section();
        let mut count = fields.len();
        let closed = separator != Separator::Blank && text.trim_end_matches(' ').ends_with([',', ';', '\t']);
        if count + 1 == section.nx && closed && !section.closed {
            section.values.push(f64::NAN);
            count += 1;
        } else {
            section.closed |= closed;
        }
        if section.ny == 0 {
            section.first_line = number;
        }
        section.indented += usize::from(fields.first().is_some_and(|f| f.is_empty()));
        if !section.in_block {
            section.blocks.push(0);
            section.in_block = true;
        }
        *section.blocks.last_mut().expect("the one of this line") += 1;
        if section.nx != 0 && count != section.nx && !section.take_counts(number) {
            let found = format!("{count} heights on line {number}");
            let accepted = format!("{}, as on the lines before (or the file is cut off)", section.nx);
            return Err(Error::format(path, found, accepted));
        }
        (section.nx, section.ny) = (count, section.ny + 1);
        Ok(())
    }

    /// A line on which field `column` is no number: part of the header, names of columns, or their labels.
    fn words(&mut self, number: usize, text: &str, fields: &[&str], column: usize, separator: Separator) -> Result<()> {
        if ChannelHeader::channel_of(text).is_some() && self.section().ny > 0 {
            self.sections.push(TextChannel::default());
        }
        let (path, word) = (self.path, fields[column]);
        let notation = &mut self.notation;
        let section = self.sections.last_mut().expect("never empty");
        let wrong = || {
            let found = format!("{} on line {number}, column {} (counted from 1)", quoted(word), column + 1);
            Error::format(path, found, "a number (lines of text may be comments: # in front)")
        };
        if section.ny > 0 {
            let names = Headings::of(fields);
            let are_names = names.columns().is_some() || names.columns_of_profile().is_some();
            if !(are_names || Headings::of_units(fields).is_some()) || !section.take_counts_above_names() {
                return Err(wrong());
            }
        }
        if section.header.read_key(path, number, text, true)? {
            return Ok(());
        }
        if let Some((headings, _)) = &mut section.headings
            && headings.take_units(fields)
        {
            return Ok(());
        }
        let is_section = |name: &str| !name.is_empty() && !name.contains(['[', ']', ';', ',']);
        if text.trim().strip_prefix('[').and_then(|t| t.strip_suffix(']')).is_some_and(is_section) {
            return Ok(());
        }
        let numbers: Vec<Option<f64>> = fields.iter().map(|f| notation.number(f, number)).collect();
        let are_others_numbers = numbers.len() > 2 && numbers[1..].iter().all(Option::is_some);
        // `key = value` and `key: value` of programs whose keys have no meaning here.
        let mut signs = text.match_indices(['=', ':']).map(|(i, _)| i);
        let statement = match (signs.next(), signs.next()) {
            (Some(sign), None) => !text[sign + 1..].trim().is_empty(),
            (first, _) => first.is_some() && numbers.iter().any(Option::is_some),
        };
        if statement && text.trim_start().starts_with(char::is_alphabetic) {
            let key = text.split(['=', ':']).next().unwrap_or_default();
            if !key.trim().is_empty() {
                self.pass(number, text);
                return Ok(());
            }
        }
        if numbers.iter().zip(fields).all(|(number, field)| number.is_none() || field.is_empty()) {
            if let Some(units) = Headings::of_units(fields) {
                section.headings = Some((units, Some(number)));
                return Ok(());
            }
            if fields.len() > 1 && fields.iter().all(|f| *f == word || f.is_empty()) {
                return Err(wrong());
            }
            let names = Headings::of(fields);
            let names = match &section.headings {
                Some((above, _)) => names.below_units(above),
                None => names,
            };
            section.headings = Some((names, Some(number)));
            return Ok(());
        }
        if column == 0 && are_others_numbers {
            section.corner = Some(word.to_string());
            section.values.push(f64::NAN);
            section.values.extend(numbers[1..].iter().flatten());
            return self.row(number, text, fields, separator);
        }
        Err(wrong())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::declared::{Declared, DeclaredExtent};
    use crate::height_map::{HeightMap, Touching};
    use crate::heights;

    fn text(bytes: &[u8], options: ImportOptions) -> Result<TextMap> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.txt");
        std::fs::write(&path, bytes).unwrap();
        read(&path, options)
    }

    fn reads(tokens: &str) -> Result<TextMap> {
        text(tokens.as_bytes(), ImportOptions::default())
    }

    fn complaint(tokens: &str) -> String {
        match reads(tokens) {
            Err(e) => e.to_string(),
            Ok(actual) => panic!("{tokens}: {:?}", actual.map),
        }
    }

    /// Heights in rows, NaN as such.
    fn rows(map: &HeightMap) -> String {
        let row = |r: &[f64]| r.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
        map.heights.chunks(map.nx).map(row).collect::<Vec<_>>().join("; ")
    }

    fn extent(x: f64, y: f64, unit: Option<&str>) -> Option<DeclaredExtent> {
        Some(DeclaredExtent { x, y, unit: unit.map(str::to_string) })
    }

    #[test]
    fn what_is_written_comes_back_to_the_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.txt");
        let heights = vec![0.1, 1.0 / 3.0, -7e-300, 1e22, 5e-324, 0.0];
        let map = HeightMap::new("here", 3, 2, heights).unwrap();
        let full = Declared {
            sign: Some(Touching::HighPoints),
            unit: Some("µm".into()),
            extent: extent(0.1 + 0.2, 1e-7, Some("nm")),
            periodic: Some(false),
            channel: Some("Height forward".into()),
            channels: vec!["Height forward".into()],
            history: vec!["plane removed".into(), "low pass: 2 µm".into()],
        };
        let no_unit = Declared { unit: Some("nm".into()), extent: extent(3.0, 2.0, None), ..Declared::default() };
        for declared in [full, no_unit, Declared::default()] {
            heights::write(&path, &map, &declared).unwrap();
            let reread = read(&path, ImportOptions::default()).unwrap();
            assert_eq!((reread.map, reread.declared, reread.warnings), (map.clone(), declared, vec![]));
        }
        let holes = HeightMap::with_missing("here", 2, 2, vec![1.0, f64::NAN, 2.0, 3.0]).unwrap();
        heights::write(&path, &holes, &Declared::default()).unwrap();
        assert_eq!(rows(&read(&path, ImportOptions::default()).unwrap().map), "1 NaN; 2 3");
    }

    #[test]
    fn ascii_as_people_write_it() {
        let actual = reads("# a profile\n1 2.5e0\t3 # first\n# between\n  4,5, 6\n").unwrap();
        assert_eq!(rows(&actual.map), "1 2.5 3; 4 5 6");
        assert_eq!(actual.declared, Declared::default());
        for (text, expected) in [
            ("1,2\n3,4\n", "1 2; 3 4"),
            ("1 ,2\n3, 4,\n", "1 2; 3 4"),
            ("1,5 2,5\n3,5 4,5\n", "1.5 2.5; 3.5 4.5"),
            ("1,5\t2\n3\t4,25\n", "1.5 2; 3 4.25"),
            ("1,5;2\r\n3;-4,25\r\n", "1.5 2; 3 -4.25"),
            ("\t1\t2\n\t3\t4\n", "1 2; 3 4"),
            ("1,,3\n4,5,\n,8,9\n", "1 NaN 3; 4 5 NaN; NaN 8 9"),
            ("1 *** 3\nBad 5 nan\n", "1 NaN 3; NaN 5 NaN"),
            ("% a\n// b\n1 2\n3 4\n", "1 2; 3 4"),
        ] {
            assert_eq!(rows(&reads(text).expect(text).map), expected, "{text}");
        }
        assert!(complaint("1,234;5\n2;3\n").contains("separator of thousands"));
    }

    #[test]
    fn what_is_wrong_is_named_with_its_line() {
        for (text, says) in [
            ("1 2\n3\n", "1 heights on line 2; accepted: 2"),
            ("# nothing\n\n", "no heights: line 1 is \"# nothing\""),
            ("", "no heights: the file is empty"),
            ("\n1|2\n3|4\n", "no heights: line 2 is \"1|2\"; accepted: a matrix of numbers apart by blanks"),
            ("1 2\n3 oak\n", "\"oak\" on line 2, column 2"),
            ("# sign: both\n1 2\n", "on line 1"),
            ("1 2\n3 -inf\n", "\"-inf\" on line 2, column 2 (counted from 1); accepted: finite"),
            ("1 1e308\n-1e308 0\n", "heights from -1e308 to 1e308; accepted: heights whose range"),
            ("1\n2\n3\n", "a single column of 3 numbers"),
            ("1 2 3 1 7\n", "a single line of 5 numbers"),
            ("0 0 1\n1 0 2\n0 1 3\n1 1.#QNAN 4\n0 2 2\n1 2 7\n", "y = NaN at point 4"),
            ("# nx: 3\n1 2\n3 4\n", "2 lines of 2 numbers; accepted: any lines of 3"),
            ("# Width: 10 furlong\n1 2\n3 4\n", "Width = \"10 furlong\" on line 1; accepted: a unit of length"),
            ("# Value units: deg\n1 2\n3 4\n", "values in \"deg\" on line 1, which are no heights"),
            ("# x-length = -3 um\n1 2\n3 4\n", "x-length = \"-3 um\" on line 1; accepted: a positive"),
            ("# length: 3,5 um\n1 2\n3 4\n", "accepted: one number, or two apart by a blank"),
            ("# length: 3 um\n# width: 2 um\n1 2\n3 4\n", "width = \"2 um\" on line 2; accepted: one statement"),
            ("a b c\n1 2\n3 4\n", "3 words on line 1 and 2 numbers below"),
            ("OUT: 1 2 3\n4 5 6 7\n1 7 2 5\n", "\"OUT:\" on line 1, column 1"),
            ("1 2 3 5\n#BUSY 5 6 7\n1 7 2 5\n", "\"#BUSY\" on line 2, column 1"),
            ("1 2 3 5\n5 6 7 #BUSY\n1 7 2 5\n", "\"#BUSY\" on line 2, column 4"),
            ("x x\n1 2\n3 4\n", "\"x\" on line 1"),
            ("x[mm] z[um]\n1 2\n3 4\n", "columns of x and heights: a profile"),
            (
                "load,pressure_mpa,p_star,contact_area\n1,2,3,4\n2,5,6,7\n",
                "columns named load, pressure mpa, p star, contact area, a table of quantities",
            ),
            ("0,1,2,3\n0.5,1,1,1\n1,2,3,4\n", "numbers of the columns, not heights"),
            ("1.25 2.50\n3.75 4.00\n5.25 6.5", "line 3 without a line break"),
        ] {
            let said = complaint(text);
            assert!(said.contains(says) && said.contains("; accepted: "), "{said}");
        }
        let long = format!("1 2\n3 {}\n", "oak".repeat(300));
        assert!(complaint(&long).len() < 300);
        assert_eq!(rows(&reads("1.25 2.50\n3.75 4.00\n5.25 6.50").unwrap().map), "1.25 2.5; 3.75 4; 5.25 6.5");
    }

    #[test]
    fn columns_of_maps_are_numbered() {
        for names in ["c0,c1,c2,c3", "A,B,C,D", "Column 1,Column 2,Column 3,Column 4", "AA,AB,AC,AD"] {
            let text = format!("{names}\n1,2,3,4\n5,6,7,9\n");
            assert_eq!(rows(&reads(&text).expect(names).map), "1 2 3 4; 5 6 7 9");
        }
    }

    #[test]
    fn headers_of_other_programs() {
        let map = "1 2 3\n4 5 6\n";
        for (header, unit, stated) in [
            (
                "# Channel: Topo\n# Width: 10.00 µm\n# Height: 5.00 µm\n# Value units: m\n",
                "m",
                extent(10.0, 5.0, Some("µm")),
            ),
            (
                "# Kanal: Topo\n# Breite: 10,00 µm\n# Höhe: 5,00 µm\n# Werteinheiten: m\n",
                "m",
                extent(10.0, 5.0, Some("µm")),
            ),
            (
                "# File Format = ASCII\n# x-pixels = 3\n# y-pixels = 2\n# x-length = 300\n# y-length = 200\n# z-unit = nm\n",
                "nm",
                extent(300.0, 200.0, Some("nm")),
            ),
            (
                "x-pixels: 3\ny-pixels: 2\nx-length: 0.3\ny-length: 200\nx-unit: um\ny-unit: nm\nz-unit: nm\n",
                "nm",
                extent(0.3, 0.2, Some("um")),
            ),
            (
                "NX = 3\nNY = 2\nScale X = 0.5\nScale Y = 0.25\nUnit X = um\nUnit Data = nm\n",
                "nm",
                extent(1.5, 0.5, Some("um")),
            ),
            ("ncols 3\nnrows 2\nxllcorner 0\ncellsize 2\nunit: mm\n", "mm", extent(6.0, 4.0, None)),
            ("# unit: nm\n# length: 30 20 um\n", "nm", extent(30.0, 20.0, Some("um"))),
            ("# unit: nm\n# length: 30 um x 20 um\n", "nm", extent(30.0, 20.0, Some("um"))),
            ("# unit: nm\n# length: 30\n", "nm", extent(30.0, 20.0, None)),
            ("# pixel size = 2 nm\n# z-unit: nm\n", "nm", extent(6.0, 4.0, Some("nm"))),
            ("X-Länge: 6,5 µm\nY-Länge: 4 µm\nZ-Einheit: nm\n", "nm", extent(6.5, 4.0, Some("µm"))),
            ("Länge X [mm] = 6\nLänge Y [mm] = 4\nEinheit Höhe = µm\n", "µm", extent(6.0, 4.0, Some("mm"))),
            ("Spalten: 3\nZeilen: 2\nPixelgröße: 0,5 µm\nMaßeinheit: nm\n", "nm", extent(1.5, 1.0, Some("µm"))),
            ("# Bildbreite: 6 µm\n# Bildhöhe: 4 µm\n# Höheneinheit: nm\n", "nm", extent(6.0, 4.0, Some("µm"))),
            ("# Messfeld: 6 x 4 µm\n# Einheit der Höhen: nm\n", "nm", extent(6.0, 4.0, Some("µm"))),
            ("# XY scale: 0.5 um/px\n# Z unit: nm\n# Image size: 3 x 2 px\n", "nm", extent(1.5, 1.0, Some("um"))),
            // Several statements on a line.
            ("h=2 w=3\npixel size=0.5 um data unit=nm\n", "nm", extent(1.5, 1.0, Some("um"))),
            ("# Width: 6 µm, Height: 4 µm; Value units: nm\n", "nm", extent(6.0, 4.0, Some("µm"))),
            // Numbers of points are no extents.
            ("# Width: 3\n# Height: 2\n# dx: 2 nm\n# z-unit: nm\n", "nm", extent(6.0, 4.0, Some("nm"))),
        ] {
            let actual = reads(&format!("{header}{map}")).unwrap_or_else(|e| panic!("{header}: {e}"));
            assert_eq!(actual.declared.unit.as_deref(), Some(unit), "{header}");
            let [found_extent, stated] = [actual.declared.extent, stated].map(|e| e.unwrap());
            assert_eq!(found_extent.unit, stated.unit, "{header}");
            let deviation = |a: f64, b: f64| (a / b - 1.0).abs();
            assert!(
                deviation(found_extent.x, stated.x).max(deviation(found_extent.y, stated.y)) < 1e-14,
                "{header}: {found_extent:?}"
            );
            assert_eq!(actual.map.heights, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
            assert!(actual.warnings.is_empty(), "{:?}", actual.warnings);
        }
    }

    #[test]
    fn factors_and_marks_of_missing_heights() {
        let map = "1 2 3\n4 5 -9999\n";
        for (header, unit, first) in [
            ("# File Format = ASCII\n# Bit2nm = 0.5\n", "nm", "0.5 1 1.5"),
            ("# Bit2nm = 0.5\n# z-unit = um\n", "um", "1 2 3"),
            ("# height conversion factor (-> m) = 0.5\n", "m", "0.5 1 1.5"),
            ("# data unit=rad\n# height conversion factor (-> m)=0.5\n", "m", "0.5 1 1.5"),
            ("# height conversion factor (-> m)=0.5\n# data unit=rad\n", "m", "0.5 1 1.5"),
            ("# height conversion factor (-> m)=0.5\n# data unit=nm\n", "m", "0.5 1 1.5"),
            ("# height conversion factor (-> m)=0.5\n# units=rad\n", "m", "0.5 1 1.5"),
            ("# units=rad\n# height conversion factor (-> m)=0.5\n", "m", "0.5 1 1.5"),
            ("# data unit: 0.5 nm\n", "nm", "0.5 1 1.5"),
            ("# z scale: 0.5 nm/count\n", "nm", "0.5 1 1.5"),
            ("Skalierung: 0,5\nEinheit: nm\n", "nm", "0.5 1 1.5"),
        ] {
            let actual = reads(&format!("{header}# missing value: -9999\n{map}")).expect(header);
            assert_eq!(actual.declared.unit.as_deref(), Some(unit), "{header}");
            assert!(rows(&actual.map).starts_with(first) && rows(&actual.map).ends_with("NaN"), "{header}");
        }
        let prose =
            "# height of the sample 3 mm\n# scale 10\n# points touch first\n# size matters\n# forward\n1 2\n3 4\n";
        let actual = reads(prose).unwrap();
        assert_eq!(
            (rows(&actual.map).as_str(), actual.declared, actual.warnings),
            ("1 2; 3 4", Declared::default(), vec![])
        );
        let odd = reads("# unit: cell extent in x\n# Height: measured\n1 2\n3 4\n").unwrap();
        assert_eq!((odd.declared.unit.as_deref(), odd.warnings.len()), (Some("cell extent in x"), 2));
    }

    /// Profilers name the heights y, and mark what they did not measure.
    #[test]
    fn a_profile_of_x_and_y_has_flags() {
        let of_profile = ImportOptions { profile: true, ..ImportOptions::default() };
        let file = "X;Y;valid\n[mm];[um];[1/0]\n0;10;1\n1;11;0\n2;12;1\n3;10;1\n";
        let line = text(file.as_bytes(), of_profile).expect("a profile");
        assert_eq!(rows(&line.map), "10 NaN 12 10");
        assert_eq!((line.declared.unit.as_deref(), line.declared.extent.map(|e| e.x)), (Some("um"), Some(4.0)));
        assert!(complaint(file).contains("--profile"), "{}", complaint(file));
        let flagged = "X;Y;Z;valid\n0;0;1;1\n1;0;2;0\n0;1;3;1\n1;1;4;1\n";
        assert_eq!(rows(&reads(flagged).expect("a map").map), "1 NaN; 3 4");
        let points = "X;Y;height\n0;0;1\n1;0;2\n0;1;3\n1;1;4\n";
        assert_eq!(rows(&reads(points).expect("a map").map), "1 2; 3 4");
    }

    #[test]
    fn channels_are_chosen_by_unit_or_name() {
        let file = "# Channel: Phase\n# Value units: deg\n1 2\n3 4\n\n# Channel: Topo\n# Value units: m\n5 6\n7 8\n";
        let actual = reads(file).unwrap();
        assert_eq!((rows(&actual.map).as_str(), actual.declared.channel.as_deref()), ("5 6; 7 8", Some("Topo")));
        assert_eq!(actual.declared.channels, ["Topo"]);
        // The scale of a display makes no heights of phases.
        let said = complaint("# data unit: deg\n# Z scale: 100 nm\n1 2\n3 4\n");
        assert!(said.contains("\"deg\"") && said.contains("no heights"), "{said}");
        let two = file.replace("deg", "nm");
        assert!(complaint(&two).contains("2 channels (Phase, Topo)"), "{}", complaint(&two));
        let named = |name| text(two.as_bytes(), ImportOptions { dataset: Some(name), ..ImportOptions::default() });
        assert_eq!(named("Phase").unwrap().declared.unit.as_deref(), Some("nm"));
        assert_eq!(named("Phase").unwrap().declared.channels, ["Phase", "Topo"]);
        assert!(named("oak").err().unwrap().to_string().contains("no channel named \"oak\"; accepted: Phase, Topo"));
    }

    #[test]
    fn tables_with_labels_and_names() {
        for (text, expected, stated) in [
            ("y\\x;0,0;0,5;1,0\n0,0;1;2;3\n0,5;4;5;6\n1,0;7;8;9\n", "1 2 3; 4 5 6; 7 8 9", extent(1.5, 1.5, None)),
            (",0,1,2\n0,1,2,3\n1,4,5,6\n2,7,8,9\n", "1 2 3; 4 5 6; 7 8 9", None),
            // Descending labels, a missing corner as NumPy writes it, the number of columns as gnuplot does, units in the corner.
            ("y\\x,1,.5,0\n1,3,2,1\n.5,6,5,4\n0,9,8,7\n", "7 8 9; 4 5 6; 1 2 3", extent(1.5, 1.5, None)),
            ("nan 0 .5 1\n0 1 2 3\n2 4 5 5\n4 7 8 9\n", "1 2 3; 4 5 5; 7 8 9", extent(1.5, 6.0, None)),
            ("y (um)\\x (um),0,.5,1\n0,1,2,3\n2,4,5,6\n4,7,8,9\n", "1 2 3; 4 5 6; 7 8 9", extent(1.5, 6.0, Some("um"))),
            (
                "height [nm]\t0\t.5\t1\n0\t1\t2\t3\n2\t4\t5\t6\n4\t7\t8\t9\n",
                "1 2 3; 4 5 6; 7 8 9",
                extent(1.5, 6.0, None),
            ),
            // Labels of the lines or of the columns alone, also before x y h.
            ("1,2,3,9,3\n2,4,5,5,1\n3,7,8,0,2\n4,1,0,7,7\n", "2 3 9 3; 4 5 5 1; 7 8 0 2; 1 0 7 7", None),
            ("0 .5 1 1.5\n2 3 9 3\n4 5 5 1\n7 8 0 2\n1 0 7 7\n", "2 3 9 3; 4 5 5 1; 7 8 0 2; 1 0 7 7", None),
            ("0 0 0 5\n1 1 0 4\n2 0 1 9\n3 1 1 7\n", "5 4; 9 7", extent(2.0, 2.0, None)),
            // An even slope is no frame of labels.
            ("0 1 2 3\n1 2 3 4\n2 3 4 5\n3 4 5 7\n", "0 1 2 3; 1 2 3 4; 2 3 4 5; 3 4 5 7", None),
            ("h0,h1\n1,2\n3,4\n", "1 2; 3 4", None),
            (",x,y,z\n0,0,0,1\n1,1,0,2\n2,0,1,3\n3,1,1,4\n", "1 2; 3 4", extent(2.0, 2.0, None)),
            ("# x y z\n0 0 1\n1 0 2\n0 1 3\n1 1 4\n", "1 2; 3 4", extent(2.0, 2.0, None)),
            (
                "Y[um];valid;X[um];Z[nm]\n0;1;0;1\n0;1;0,5;2\n2;1;0;3\n2;0;0,5;\n",
                "1 2; 3 NaN",
                extent(1.0, 4.0, Some("um")),
            ),
            ("X;Y;Z\n[mm];[um];[um]\n0;0;1\n1;0;2\n0;500;3\n1;500;4\n", "1 2; 3 4", extent(2.0, 1.0, Some("mm"))),
        ] {
            let actual = reads(text).unwrap_or_else(|e| panic!("{text}: {e}"));
            assert_eq!(rows(&actual.map), expected, "{text}");
            assert_eq!(actual.declared.extent, stated, "{text}");
        }
        let gnuplot = reads("3 0 .5 1\n0 1 2 3\n2 4 5 5\n4 7 8 9\n").unwrap();
        assert_eq!(
            (rows(&gnuplot.map).as_str(), gnuplot.declared.extent),
            ("1 2 3; 4 5 5; 7 8 9", extent(1.5, 6.0, None))
        );
        assert!(gnuplot.warnings[0].contains("taken as labels") && gnuplot.warnings[0].contains("--fourier none"));
        let said = complaint("nought 2 3 7\n1 2 3 4\n2 5 6 7\n");
        assert!(said.contains("\"nought\" on line 1, column 1"), "{said}");
    }

    /// Blocks of constant y and blocks of constant x give the same map, with rows of constant y.
    #[test]
    fn triples_are_laid_by_their_coordinates() {
        let rows = "# x y h\n0 0 1\n.5 0 2\n1 0 3\n\n0 .5 4\n.5 .5 5\n1 .5 6\n";
        let columns = "2 7 1\n2 8 4\n \n3 7 2\n3 8 5\n\n4 7 3\n4 8 6\n\n";
        let bare = |text: &str| text.replace("\n \n", "\n").replace("\n\n", "\n");
        let summary = |actual: TextMap| {
            let e = actual.declared.extent.unwrap();
            (super::tests::rows(&actual.map), e.x / e.y, actual.layout)
        };
        let map = ("1 2 3; 4 5 6".to_string(), 1.5, TextLayout::XyzLines);
        for text in [rows, columns, &bare(rows), &bare(columns)] {
            assert_eq!(summary(reads(text).unwrap()), map, "{text}");
        }
        // Descending x, y or both, and different spacings.
        for text in ["0 1 4\n1 1 5\n2 1 6\n0 0 1\n1 0 2\n2 0 3\n", "2 1 6\n1 1 5\n0 1 4\n\n2 0 3\n1 0 2\n0 0 1\n"] {
            assert_eq!(summary(reads(text).unwrap()), map, "{text}");
        }
        assert_eq!(reads("0 0 1\n1 0 2\n\n0 3 3\n1 3 4\n").unwrap().declared.extent, extent(2.0, 6.0, None));
        // Absent points are missing: inside, at the end, and a whole column.
        let grid = |absent: &[usize]| -> String {
            (0..12).filter(|i| !absent.contains(i)).map(|i| format!("{} {} {}\n", i % 4, i / 4, i * i % 7)).collect()
        };
        for absent in [&[11][..], &[5], &[1, 5, 9]] {
            let actual = reads(&grid(absent)).unwrap();
            assert_eq!((actual.map.nx, actual.map.missing()), (4, absent.len()), "{absent:?}");
            assert_eq!(actual.declared.extent, extent(4.0, 3.0, None));
        }
    }

    /// Coordinates slightly off an even grid are an error, not heights; values that form no grid are heights.
    #[test]
    fn three_columns_are_a_matrix_only_where_they_are_no_coordinates() {
        let grid: String = (0..12).map(|i| format!("{} {} {}\n", i % 4, i / 4, i * i % 7)).collect();
        assert_eq!(reads(&grid).unwrap().map.nx, 4);
        for (text, says) in [
            ("0 0 1\n0 1 2\n0 3 1\n1 0 1\n".to_string(), "4 points on a grid of 2 x 4"),
            (grid.replace("2 1 ", "2.2 1 "), "x = 2.2e0 at point 7"),
            ("0 0 1\n1 1 2\n1 0 2\n0 1 4\n".into(), "neither stays"),
        ] {
            let message = complaint(&text);
            assert!(message.contains(says) && message.contains("--fourier none"), "{message}");
        }
        for text in ["1 2 3\n4 5 6\n", "0 0 1\n0 0 2\n0 1 1\n1 0 1\n", "1 5 2\n3 4 8\n2 2 1\n5 9 2\n7 1 1\n"] {
            assert_eq!(reads(text).unwrap().layout, TextLayout::Matrix, "{text}");
        }
        for (text, says) in [
            ("1 0 1\n0 0 2\n\n1 0 3\n0 0 4\n", "coordinates that stay (y = 0e0"),
            ("0 0 1\n1 0 2\n2 0 0\n\n0 1 3\n1.25 1 4\n2 1 0\n", "x = 1.25e0 at point 5 (counted from 1); accepted: "),
            ("0 0 1\n1 0 2\n2 0 0\n\n0 1 3\n1.5 1 4\n2 1 0\n", "6 points on a grid of 5 x 2"),
            ("0 0 1\n\n0 1 3\n", "coordinates that stay (x = 0e0"),
            ("0 0 1\n1 0 2\n\n0 1 3\n1 1 3\n1 1 3\n", "two heights at x = 1e0, y = 1e0"),
        ] {
            assert!(complaint(text).contains(says), "{}", complaint(text));
        }
    }
}

//! Text tables of a known map, written as instruments, spreadsheets and people write them, and changed at random: each is read as that
//! map, with the right points not measured, or it is refused; never is it another map.

#![cfg(feature = "files")]

use asperity_surface::import::{self, Content, ImportOptions, ImportedFile};
use flate2::Compression;
use flate2::write::GzEncoder;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use std::io::Write;

/// Tables of a run; `TABLES` in the environment has another number.
const TABLES: u64 = 10_000;

/// Words for what was not measured. The last ones are not known to the reader.
const MARKS: [&str; 26] = [
    "nan",
    "NaN",
    "-nan(ind)",
    "1.#QNAN",
    "-1.#IND",
    "1.#QNAN00",
    "#N/A",
    "#DIV/0!",
    "#VALUE!",
    "#WERT!",
    "#NV",
    "NA",
    "N/A",
    "--",
    "***",
    "BAD",
    "null",
    "<NA>",
    "Err:502",
    "1.#INF",
    "inf",
    "OUT",
    "#BUSY",
    "###",
    "#",
    "!",
];

/// Marks from which on the words are not known.
const UNKNOWN: usize = 19;

/// The map that the tables are of, and how one of them is written.
struct Table {
    rng: ChaCha8Rng,
    nx: usize,
    ny: usize,
    /// Heights as they are printed; `None` where nothing was measured.
    heights: Vec<Option<String>>,
    /// Pixel in µm, heights in nm.
    pixel: [f64; 2],
    separator: &'static str,
    decimal_comma: bool,
    quoted: bool,
    mark: &'static str,
    minus: &'static str,
}

impl Table {
    fn new(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (nx, ny) = (rng.random_range(5..14), rng.random_range(5..14));
        let scale = 10f64.powi(rng.random_range(0..4));
        let offset = if rng.random_bool(0.5) { 0.0 } else { 2.0 * scale };
        let (digits, phase) = (rng.random_range(0..5), rng.random_range(0.0..6.0));
        let slope: f64 = if rng.random_bool(0.2) { 2.0 } else { 0.0 };
        let exponent = rng.random_bool(0.15);
        let heights = (0..nx * ny).map(|i| {
            let (x, y) = ((i % nx) as f64 / nx as f64, (i / nx) as f64 / ny as f64);
            let wave = (6.3 * x + phase).sin() * (9.0 * y + phase).cos() + slope * (x + y);
            let h = offset + scale * (wave + rng.random_range(-0.5..0.5));
            Some(if exponent { format!("{h:.digits$e}") } else { format!("{h:.digits$}") })
        });
        let heights = heights.collect();
        let pixel = [0.5, *pick(&mut rng, &[0.5, 0.5, 0.25])];
        let separator = *pick(&mut rng, &[" ", "  ", "\t", ",", ", ", ";", "; "]);
        let decimal_comma = rng.random_bool(0.25);
        let quoted = separator.len() == 1 && separator != " " && rng.random_bool(0.1);
        let mark = *pick(&mut rng, &MARKS);
        let minus = *pick(&mut rng, &["-", "-", "-", "\u{2212}"]);
        let mut table = Table { rng, nx, ny, heights, pixel, separator, decimal_comma, quoted, mark, minus };
        table.lose();
        table
    }

    /// Some points, lines or columns were not measured.
    fn lose(&mut self) {
        let (nx, ny) = (self.nx, self.ny);
        let (x, y) = (self.rng.random_range(0..nx), self.rng.random_range(0..ny));
        let some: Vec<bool> = (0..nx * ny).map(|_| self.rng.random_bool(0.1)).collect();
        let lost: &dyn Fn(usize) -> bool = match self.rng.random_range(0..12) {
            0 => &|i| some[i],
            1 => &|i| i == y * nx + x,
            2 => &|i| i % nx == nx - 1,
            3 => &|i| i % nx == 0,
            4 => &|i| i % nx == x,
            5 => &|i| i / nx == 0,
            6 => &|i| i / nx == y,
            7 => &|i| i == 0,
            8 => &|i| i == nx * ny - 1,
            _ => &|_| false,
        };
        (0..nx * ny).filter(|i| lost(*i)).for_each(|i| self.heights[i] = None);
    }

    fn field(&self, number: &str) -> String {
        let number = if self.decimal_comma { number.replace('.', ",") } else { number.to_string() };
        let number = number.replace('-', self.minus);
        if self.quoted { format!("\"{number}\"") } else { number }
    }

    fn height(&self, i: usize) -> String {
        self.heights[i].as_ref().map_or(self.mark.to_string(), |h| self.field(h))
    }

    fn line(&self, fields: &[String]) -> String {
        fields.join(self.separator)
    }

    fn labels(&self, n: usize, step: f64) -> Vec<String> {
        (0..n).map(|i| self.field(&format!("{}", i as f64 * step))).collect()
    }

    /// A matrix, with labels at none, one or both of its sides.
    fn matrix(&mut self) -> Vec<String> {
        let (nx, ny, [dx, dy]) = (self.nx, self.ny, self.pixel);
        let steps = *pick(&mut self.rng, &[[1.0, 1.0], [dx, dy]]);
        let of_lines = self.rng.random_bool(0.15).then(|| self.labels(ny, steps[1]));
        let of_columns = self.rng.random_bool(0.15).then(|| self.labels(nx, steps[0]));
        let corner = pick(&mut self.rng, &["y\\x", "", "nan", "0"]).to_string();
        let mut lines = Vec::new();
        if let Some(labels) = &of_columns {
            let first = of_lines.iter().map(|_| corner.clone());
            lines.push(self.line(&first.chain(labels.iter().cloned()).collect::<Vec<_>>()));
        } else if self.rng.random_bool(0.1) && of_lines.is_none() {
            lines.push(self.line(&(0..nx).map(|k| format!("h{k}")).collect::<Vec<_>>()));
        }
        for y in 0..ny {
            let first = of_lines.iter().map(|labels| labels[y].clone());
            lines.push(self.line(&first.chain((0..nx).map(|x| self.height(y * nx + x))).collect::<Vec<_>>()));
        }
        lines
    }

    /// Lines of x y h, with names of the columns or without.
    fn points(&mut self) -> Vec<String> {
        let (nx, ny, [dx, dy]) = (self.nx, self.ny, self.pixel);
        let (columns, down) = (self.rng.random_bool(0.3), self.rng.random_bool(0.2));
        let names =
            pick::<&[&str]>(&mut self.rng, &[&[], &["x", "y", "z"], &["x[um]", "y[um]", "z[nm]"], &["um", "um", "nm"]]);
        let mut lines: Vec<String> = Vec::new();
        if !names.is_empty() {
            let names: Vec<String> = names.iter().map(|n| n.to_string()).collect();
            let hash = if self.rng.random_bool(0.5) { "# " } else { "" };
            lines.push(format!("{hash}{}", self.line(&names)));
        }
        for k in 0..nx * ny {
            let (x, y) = if columns { (k / ny, k % ny) } else { (k % nx, k / nx) };
            let y = if down { ny - 1 - y } else { y };
            let place = [x as f64 * dx, y as f64 * dy].map(|v| self.field(&format!("{v:.2}")));
            let [x_text, y_text] = place;
            lines.push(self.line(&[x_text, y_text, self.height(y * nx + x)]));
        }
        lines
    }

    /// A profile of positions and heights, which is no map.
    fn profile(&mut self) -> Vec<String> {
        let point = |i: usize| self.line(&[self.field(&format!("{:.2}", i as f64 * 0.25)), self.height(i)]);
        (0..self.nx * self.ny).map(point).collect()
    }

    /// Lines above the numbers.
    fn header(&mut self) -> Vec<String> {
        let [lx, ly] = [self.nx as f64 * self.pixel[0], self.ny as f64 * self.pixel[1]];
        let (nx, ny) = (self.nx, self.ny);
        let lines = match self.rng.random_range(0..10) {
            0 => vec![format!("Width: {lx} um"), format!("Height: {ly} um"), "Value units: nm".into()],
            1 => vec![format!("Width: {lx} µm, Height: {ly} µm; Value units: nm")],
            2 => vec![format!("h={ny} w={nx}"), format!("x-length={lx} um y-length={ly} um"), "data unit=nm".into()],
            3 => vec![
                format!("x-pixels = {nx}"),
                format!("y-pixels = {ny}"),
                format!("dx = {} um dy = {} um", self.pixel[0], self.pixel[1]),
            ],
            4 => vec!["[Header]".into(), "Date: 2020-01-01 12:30".into(), "Value units = nm".into(), "[Data]".into()],
            5 => vec!["\\Exported image units: nm".into()],
            6 => vec![format!("size: {lx} {ly} um")],
            _ => Vec::new(),
        };
        let hash = if self.rng.random_bool(0.6) { "# " } else { "" };
        lines
            .into_iter()
            .map(|line| if line.starts_with(['[', '\\']) { line } else { format!("{hash}{line}") })
            .collect()
    }

    /// The bytes of the file, and whether it is a map.
    fn bytes(&mut self) -> (Vec<u8>, bool) {
        let kind = self.rng.random_range(0..10);
        let body = match kind {
            0 => self.profile(),
            1..=3 => self.points(),
            _ => self.matrix(),
        };
        let mut lines = self.header();
        if self.rng.random_bool(0.1) {
            let (nx, ny) = (self.nx, self.ny);
            let sizes = [format!("{}", nx * ny), format!("{ny}"), format!("{ny} {nx}"), format!("{nx} {ny}")];
            lines.push(pick(&mut self.rng, &sizes).clone());
        }
        let first = lines.len();
        lines.extend(body);
        let last = lines.len() - 1;
        match self.rng.random_range(0..12) {
            0 => lines[last].push_str(" # the last"),
            1 => lines[first..].iter_mut().for_each(|l| l.push_str(" # a line")),
            2 => lines.insert((first + last) / 2, "# half of it".into()),
            3 if self.separator.trim() != "" => lines[first..].iter_mut().for_each(|l| l.push_str(self.separator)),
            4 => lines[first..].iter_mut().for_each(|l| l.insert(0, ' ')),
            _ => {}
        }
        let end = *pick(&mut self.rng, &["\n", "\n", "\r\n", "\r"]);
        let mut text = lines.join(end);
        if self.rng.random_bool(0.9) {
            text.push_str(end);
        }
        let bytes = match self.rng.random_range(0..20) {
            0 => [&[0xEF, 0xBB, 0xBF], text.as_bytes()].concat(),
            1 => std::iter::once(0xFEFF).chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect(),
            2 => {
                let mut packed = GzEncoder::new(Vec::new(), Compression::fast());
                packed.write_all(text.as_bytes()).expect("packed");
                packed.finish().expect("packed")
            }
            _ => text.into_bytes(),
        };
        (bytes, kind != 0)
    }

    /// Whether what was read is the map.
    fn is(&self, found: &ImportedFile) -> bool {
        let Content::Map(map) = &found.content else { return false };
        let number = |h: &Option<String>| h.as_ref().map_or(f64::NAN, |h| h.parse().expect("printed"));
        let same = |(a, b): (&f64, f64)| a.is_nan() && b.is_nan() || (a - b).abs() <= 1e-12 * b.abs();
        let near = |found: Option<f64>, right: f64| found.is_none_or(|f| (f / right - 1.0).abs() < 1e-3);
        let extent = found.declared.extent_m();
        (map.nx, map.ny) == (self.nx, self.ny)
            && map.heights.iter().zip(self.heights.iter().map(number)).all(same)
            && near(found.declared.unit_m(), 1e-9)
            && (found.declared.extent.as_ref().is_none_or(|e| e.unit.is_none())
                || near(extent.map(|e| e[0]), self.nx as f64 * self.pixel[0] * 1e-6)
                    && near(extent.map(|e| e[1]), self.ny as f64 * self.pixel[1] * 1e-6))
    }
}

fn pick<'a, T>(rng: &mut ChaCha8Rng, list: &'a [T]) -> &'a T {
    &list[rng.random_range(0..list.len())]
}

#[test]
fn a_table_is_read_as_its_map_or_refused() {
    let folder = tempfile::tempdir().expect("scratch");
    let path = folder.path().join("table");
    let tables = std::env::var("TABLES").map_or(TABLES, |n| n.parse().expect("a number"));
    let (mut read, mut plain, mut plain_read) = (0, 0, 0);
    let mut wrong = Vec::new();
    for seed in 0..tables {
        let mut table = Table::new(seed);
        let (bytes, is_map) = table.bytes();
        std::fs::write(&path, &bytes).expect("written");
        let found = import::read(&path, ImportOptions::default());
        let known = MARKS[..UNKNOWN].contains(&table.mark) || table.heights.iter().all(Option::is_some);
        let is_plain = is_map && known && !table.decimal_comma && !table.quoted;
        plain += u64::from(is_plain);
        if let Ok(found) = &found {
            read += 1;
            plain_read += u64::from(is_plain);
            if !(is_map && table.is(found)) {
                let text = String::from_utf8_lossy(&bytes).chars().take(900).collect::<String>();
                let Content::Map(map) = &found.content else { panic!("{text}") };
                let (nx, ny) = (map.nx, map.ny);
                wrong.push(format!(
                    "table {seed}, {} x {} read as {nx} x {ny} ({} missing), {:?} {:?}:\n{text}",
                    table.nx,
                    table.ny,
                    map.missing(),
                    found.declared,
                    found.warnings
                ));
            }
        }
    }
    println!("{read} of {tables} read, of {plain} plain ones {plain_read}");
    assert!(wrong.is_empty(), "{} of {tables}:\n{}", wrong.len(), wrong[..wrong.len().min(6)].join("\n\n"));
    // Refusals of everything would be no misreadings either.
    assert!(
        10 * plain_read >= 8 * plain && 10 * read >= 4 * tables,
        "{plain_read} of {plain} plain ones, {read} of {tables} were read"
    );
}

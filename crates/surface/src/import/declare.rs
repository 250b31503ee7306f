//! What attributes of arrays and coordinates of their points state of a surface: HDF5, NetCDF and `.npz`.

use super::array::{self, Order};
use super::attributes::{Attributes, Coordinate};
use super::content::ImportedFile;
use super::header::quantity;
use super::headings::counts;
use super::source::quoted;
use super::unit::{self, length_unit};
use crate::declared::{Declared, DeclaredExtent};
use crate::height_map::Touching;
use asperity_grid::error::{Error, Result};
use asperity_grid::units::metres_per;
use std::path::Path;

/// Tolerance of coordinates over their spacing, and of two statements of one extent: rounding to single precision.
const OFF: f64 = 1e-3;

/// An array of heights with all that may describe it.
pub(super) struct Described<'a> {
    pub(super) path: &'a Path,
    pub(super) channel: &'a str,
    pub(super) channels: &'a [String],
    /// Points along x and y.
    pub(super) shape: [usize; 2],
    pub(super) order: Order,
    pub(super) own: &'a Attributes,
    /// Attributes of the groups above the array; those of nearer groups first.
    pub(super) shared: &'a [Attributes],
    /// Along x and y.
    pub(super) axes: [Option<Coordinate>; 2],
}

const UNIT: [&str; 2] = ["units", "unit"];
const HEIGHT_UNIT: [&str; 6] = ["units", "unit", "height unit", "heights unit", "z unit", "data unit"];
const LATERAL_UNIT: [&str; 6] = ["length unit", "length units", "lateral unit", "lateral units", "xy unit", "x unit"];
const LENGTH: [[&str; 2]; 5] = [
    ["length x", "length y"],
    ["x length", "y length"],
    ["lx", "ly"],
    ["size x", "size y"],
    ["physical size x", "physical size y"],
];
const LENGTHS: [&str; 6] = ["physical sizes", "physical size", "lengths", "length", "extent", "extents"];
const SPACING: [[&str; 2]; 4] =
    [["dx", "dy"], ["pixel size x", "pixel size y"], ["spacing x", "spacing y"], ["x spacing", "y spacing"]];
const SPACINGS: [&str; 3] = ["pixel size", "pixel sizes", "spacing"];

/// Collects the statements, and warnings of those that could not be used.
///
/// # Errors
/// Extents that are not positive; coordinates off even steps; a sign or periodicity that is not understood; extents along x and y that
/// differ in whether they are periodic.
fn declare(array: &Described) -> Result<(Declared, Vec<String>)> {
    let mut warnings = Vec::new();
    let unit = array.words(&HEIGHT_UNIT).map(|u| length_unit(&u).unwrap_or(u)).filter(|u| !unit::is_none(u));
    if let Some(word) = unit.as_ref().filter(|u| metres_per(u).is_none()) {
        warnings.push(format!("unit {} of {} is not {}: it is not used", quoted(word), array.channel, unit::ACCEPTED));
    }
    let sign = match array.words(&["sign"]) {
        None => None,
        Some(words) => {
            let wrong = || array.wrong(format!("sign = {}", quoted(&words)), Touching::WORDS);
            Some(Touching::of_words(&words).ok_or_else(wrong)?)
        }
    };
    let extent = array.extent(&mut warnings)?;
    let lines = |text: String| text.lines().map(str::to_string).collect::<Vec<_>>();
    let history = array.words(&["preparation"]).map_or(Vec::new(), lines);
    let declared = Declared {
        sign,
        unit,
        extent,
        periodic: array.periodic()?,
        channel: Some(array.own.words_of(&["channel"]).unwrap_or_else(|| array.channel.to_string())),
        channels: array.own.words_of(&["channels"]).map_or(array.channels.to_vec(), lines),
        history,
    };
    Ok((declared, warnings))
}

impl Described<'_> {
    /// The map of `values`, with what the file states about it. `layout`: what is read.
    pub(super) fn imported(self, values: Vec<f64>, layout: String) -> Result<ImportedFile> {
        let mut map = array::map(self.path, self.shape, values, self.order)?;
        let reversed = array::reverse_descending(&mut map, &self.axes);
        let (declared, warnings) = declare(&self)?;
        Ok(ImportedFile { warnings, ..ImportedFile::map(map, declared, layout + &reversed) })
    }

    /// Points along x and y.
    fn points(&self) -> [usize; 2] {
        let [first, second] = self.shape;
        if self.order == Order::RowsOfX { [second, first] } else { [first, second] }
    }

    fn wrong(&self, found: String, accepted: &str) -> Error {
        Error::format(self.path, found, accepted)
    }

    fn all(&self) -> impl Iterator<Item = &Attributes> {
        std::iter::once(self.own).chain(self.shared)
    }

    fn words(&self, names: &[&str]) -> Option<String> {
        self.all().find_map(|a| a.words_of(names))
    }

    fn numbers(&self, names: &[&str]) -> Option<Vec<f64>> {
        self.all().find_map(|a| a.numbers_of(names))
    }

    /// One number under each of two names, or one under the first alone, which along y is `ratio` times as large.
    fn pair(&self, names: &[[&str; 2]], ratio: f64) -> Option<Vec<f64>> {
        names.iter().find_map(|[x, y]| {
            let (x, y) = (*self.numbers(&[x])?.first()?, self.numbers(&[y]).and_then(|list| list.first().copied()));
            Some(vec![x, y.unwrap_or(x * ratio)])
        })
    }

    /// Extents from the attribute `length` of both coordinates, from attributes of the array and of its groups, or from coordinates.
    fn extent(&self, warnings: &mut Vec<String>) -> Result<Option<DeclaredExtent>> {
        let [nx, ny] = self.points().map(|n| n as f64);
        let [x, y] = self.axes.each_ref().map(|a| Some(a.as_ref()?.attributes.numbers_of(&["length"])?[0]));
        let spacing = || {
            self.pair(&SPACING, 1.0).or_else(|| self.numbers(&SPACINGS).map(|list| vec![list[0], list[list.len() - 1]]))
        };
        let stated = match (x, y) {
            (Some(x), Some(y)) => Some(vec![x, y]),
            _ => self.pair(&LENGTH, ny / nx).or_else(|| self.numbers(&LENGTHS)),
        };
        let stated = match stated.as_deref() {
            Some([x]) => Some([*x, x / nx * ny]),
            Some([x, y]) => Some([*x, *y]),
            // Limits along x and y, as matplotlib takes them.
            Some([left, right, bottom, top]) => Some([(right - left).abs(), (top - bottom).abs()]),
            Some(list) => {
                return Err(self.wrong(format!("extents {list:?}"), "one number, or two: along x and along y"));
            }
            None => spacing().map(|s| [s[0] * nx, s[1] * ny]),
        };
        let coordinates = self.coordinates(warnings)?;
        let Some(extent) = stated.or(coordinates) else { return Ok(None) };
        if !extent.iter().all(|e| e.is_finite() && *e > 0.0) {
            return Err(self.wrong(format!("extents of {:e} x {:e}", extent[0], extent[1]), "positive numbers"));
        }
        if let Some(spans) = coordinates.filter(|c| (0..2).any(|k| (c[k] / extent[k] - 1.0).abs() > OFF)) {
            let [x, y] = extent;
            let text =
                format!("coordinates give {:e} x {:e}: give --length where the latter are right", spans[0], spans[1]);
            warnings.push(format!("extents of {x:e} x {y:e} are declared, but {text}"));
        }
        self.with_unit(extent, warnings)
    }

    /// Extents with their unit: that of the coordinates, or of the attributes; along y converted to that along x.
    fn with_unit(&self, [x, mut y]: [f64; 2], warnings: &mut Vec<String>) -> Result<Option<DeclaredExtent>> {
        let written = self.written_unit()?;
        let own = |k: usize| written.clone().or_else(|| self.axes[k].as_ref()?.attributes.words_of(&UNIT));
        let general = || {
            let groups = || self.shared.iter().find_map(|a| a.words_of(&UNIT));
            self.words(&LATERAL_UNIT).or_else(groups)
        };
        let mut units = [None, None];
        for (k, place) in units.iter_mut().enumerate() {
            let Some(word) = own(k).or_else(general).filter(|u| !unit::is_none(u)) else { continue };
            let Some(unit) = length_unit(&word) else {
                let (word, accepted) = (quoted(&word), unit::ACCEPTED);
                warnings.push(format!("extents in {word}, not {accepted}: they are not used, give --length"));
                return Ok(None);
            };
            *place = Some(unit);
        }
        let [x_unit, y_unit] = units;
        if let Some((to, from)) = x_unit.as_deref().and_then(metres_per).zip(y_unit.as_deref().and_then(metres_per)) {
            y *= from / to;
        }
        Ok(Some(DeclaredExtent { x, y, unit: x_unit.or(y_unit) }))
    }

    /// The unit that is written behind an extent or a spacing (`10 µm`).
    fn written_unit(&self) -> Result<Option<String>> {
        let pairs = LENGTH.iter().chain(&SPACING).flatten();
        let names: Vec<&str> = pairs.chain(&LENGTHS).chain(&SPACINGS).copied().collect();
        let mut common_unit: Option<String> = None;
        for text in self.all().flat_map(|a| names.iter().filter_map(|name| a.words_of(&[name]))) {
            let unit = quantity(&text).1;
            if unit::is_none(&unit) {
                continue;
            }
            let known = length_unit(&unit)
                .ok_or_else(|| self.wrong(format!("an extent in {}", quoted(&text)), unit::ACCEPTED))?;
            if let Some(other) = common_unit.as_ref().filter(|other| metres_per(other) != metres_per(&known)) {
                return Err(
                    self.wrong(format!("extents in {other} and {known}"), "one unit of all extents and spacings")
                );
            }
            common_unit = Some(known);
        }
        Ok(common_unit)
    }

    /// Points times spacing from the values of both coordinates.
    fn coordinates(&self, warnings: &mut Vec<String>) -> Result<Option<[f64; 2]>> {
        let mut extent = [0.0; 2];
        for (k, axis) in self.axes.iter().enumerate() {
            let n = self.points()[k];
            let Some(axis) = axis.as_ref().filter(|a| a.values.len() == n && n > 1) else { return Ok(None) };
            let values = &axis.values;
            if counts(values) && axis.attributes.words_of(&UNIT).is_none_or(|u| unit::is_none(&u)) {
                let text = format!("coordinates {} count the points and have no unit", axis.name);
                if axis.attributes.numbers_of(&["length"]).is_none() {
                    warnings.push(format!("{text}: no extent is taken from them, give --length"));
                }
                return Ok(None);
            }
            let spacing = (values[n - 1] - values[0]) / (n - 1) as f64;
            let is_close = |i: usize, v: f64| (v - values[0] - i as f64 * spacing).abs() <= OFF * spacing.abs();
            if let Some(i) = (0..n).find(|i| !is_close(*i, values[*i])) {
                let found = format!("{} = {:e} at point {} (counted from 1)", axis.name, values[i], i + 1);
                let even = values[0] + i as f64 * spacing;
                return Err(self.wrong(found, &format!("{even:e}, as even steps of {spacing:e} would have it")));
            }
            extent[k] = n as f64 * spacing.abs();
        }
        Ok(Some(extent).filter(|e| e.iter().all(|e| *e > 0.0)))
    }

    fn periodic(&self) -> Result<Option<bool>> {
        let names = ["periodic", "is periodic"];
        let read = |a: &Attributes| -> Result<Option<bool>> {
            if let Some(word) = a.words_of(&names) {
                return match word.to_ascii_lowercase().as_str() {
                    "yes" | "true" | "1" => Ok(Some(true)),
                    "no" | "false" | "0" => Ok(Some(false)),
                    _ => Err(self.wrong(format!("periodic = {}", quoted(&word)), "1 or 0, true or false")),
                };
            }
            Ok(a.numbers_of(&names).map(|list| list.iter().all(|v| *v != 0.0)))
        };
        let along = self.axes.iter().flatten().filter_map(|a| read(&a.attributes).transpose());
        let along = along.collect::<Result<Vec<bool>>>()?;
        if !along.is_empty() {
            return Ok(Some(along.iter().all(|periodic| *periodic)));
        }
        self.all().find_map(|a| read(a).transpose()).transpose()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn declared(words: &[(&str, &str)]) -> Result<(Declared, Vec<String>)> {
        let own = Attributes {
            words: words.iter().map(|(key, text)| (key.to_string(), text.to_string())).collect(),
            ..Attributes::default()
        };
        let channels = ["heights".to_string()];
        let (path, axes) = (Path::new("map.h5"), [None, None]);
        let (shape, order) = ([2, 4], Order::RowsOfX);
        let (channel, channels) = ("heights", &channels[..]);
        declare(&Described { path, channel, channels, shape, order, own: &own, shared: &[], axes })
    }

    /// Heights in nm, extents in the unit behind their number.
    #[test]
    fn a_unit_behind_an_extent_is_that_of_the_extents() {
        for (key, text, x) in [("length", "10 um", 10.0), ("length_x", "10 µm", 10.0), ("dx", "2.5um", 10.0)] {
            let (actual, warnings) = declared(&[("units", "nm"), (key, text)]).expect(text);
            let metres = actual.extent_m().expect("extents");
            assert!(
                (metres[0] / (x * 1e-6) - 1.0).abs() < 1e-12 && (metres[1] / metres[0] - 0.5).abs() < 1e-12,
                "{text}"
            );
            assert!(warnings.is_empty() && actual.unit.as_deref() == Some("nm"), "{warnings:?}");
        }
        for words in [&[("units", "nm"), ("pixel_size", "0.2 furlong")][..], &[("lx", "10 um"), ("ly", "5 nm")]] {
            assert!(declared(words).expect_err("refused").to_string().contains("map.h5: "), "{words:?}");
        }
    }
}

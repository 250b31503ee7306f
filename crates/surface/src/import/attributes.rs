use super::header::quantity;
use super::source::quoted;
use crate::files::number::{DType, NumberKind};
use asperity_grid::error::{Error, Result};
use std::collections::BTreeMap;
use std::path::Path;

/// Attributes of a NetCDF or HDF5 array, which define the conversion of stored numbers to heights, and what else they state.
#[derive(Debug, Clone, Default)]
pub(super) struct Attributes {
    pub(super) numbers: BTreeMap<String, Vec<f64>>,
    pub(super) words: BTreeMap<String, String>,
}

impl Attributes {
    /// Converts stored numbers to heights in place: missing values become NaN, then scale and offset are applied.
    /// With `unwritten`, NetCDF's default fill values count as missing, too.
    pub(super) fn unpack(&self, array: &Array, values: &mut [f64], unwritten: bool) -> Result<()> {
        let sign = self.sign(array.stored);
        let declared_numbers = |name: &str| -> Vec<f64> {
            let list = self.numbers.get(name).map_or(&[][..], Vec::as_slice);
            list.iter().map(|v| sign.apply(narrowed(*v, array.stored))).collect()
        };
        let fill = declared_numbers("_FillValue");
        let own = (unwritten && fill.is_empty()).then(|| default_fill(array.stored)).flatten();
        let missing: Vec<f64> = fill.into_iter().chain(declared_numbers("missing_value")).chain(own).collect();
        let (low, high) = match declared_numbers("valid_range")[..] {
            [low, high] => (low, high),
            _ => (
                declared_numbers("valid_min").first().copied().unwrap_or(f64::NEG_INFINITY),
                declared_numbers("valid_max").first().copied().unwrap_or(f64::INFINITY),
            ),
        };
        let (scale, offset) = (self.factor(array, "scale_factor", 1.0)?, self.factor(array, "add_offset", 0.0)?);
        for value in values {
            // By the NetCDF conventions fill values and valid ranges refer to stored numbers, before scale and
            // offset.
            let raw = sign.apply(*value);
            *value = if missing.contains(&raw) || raw < low || raw > high { f64::NAN } else { raw * scale + offset };
        }
        Ok(())
    }

    /// The numbers of the first attribute with one of these names, in lower case and with blanks for `_` and `-`; those in a text count.
    pub(super) fn numbers_of(&self, names: &[&str]) -> Option<Vec<f64>> {
        names.iter().find_map(|name| {
            let numbers = self.numbers.iter().find(|(key, _)| plain_key(key) == *name).map(|(_, list)| list.clone());
            numbers.or_else(|| Some(quantity(&self.words_of(&[name])?).0)).filter(|list| !list.is_empty())
        })
    }

    /// The text of the first attribute with one of these names, likewise.
    pub(super) fn words_of(&self, names: &[&str]) -> Option<String> {
        let find =
            |name: &&str| self.words.iter().find(|(key, _)| plain_key(key) == *name).map(|(_, text)| text.clone());
        names.iter().find_map(find)
    }

    fn factor(&self, array: &Array, name: &str, default: f64) -> Result<f64> {
        let wrong = |found: String| {
            let found = format!("{name} of {} = {found}", array.name);
            Err(Error::format(array.path, found, "one finite number, for scale_factor another than 0"))
        };
        if let Some(text) = self.words.get(name) {
            return wrong(quoted(text));
        }
        match self.numbers.get(name).map(Vec::as_slice) {
            None => Ok(default),
            Some([v]) if v.is_finite() && (*v != 0.0 || default == 0.0) => Ok(*v),
            Some(list) => wrong(format!("{list:?}")),
        }
    }

    /// The classic NetCDF format has no unsigned integers; the attribute `_Unsigned` marks them.
    fn sign(&self, dtype: DType) -> IntegerSign {
        let says = |word: &str| self.words.get("_Unsigned").is_some_and(|w| w.eq_ignore_ascii_case(word));
        let count = 2f64.powi(8 * dtype.bytes as i32);
        match dtype.kind {
            NumberKind::Signed if says("true") => IntegerSign::Unsigned(count),
            NumberKind::Unsigned if says("false") => IntegerSign::Signed(count),
            _ => IntegerSign::AsStored,
        }
    }
}

fn plain_key(key: &str) -> String {
    key.to_lowercase().replace(['_', '-'], " ")
}

/// Coordinates of the points along one axis.
#[derive(Debug, Default)]
pub(super) struct Coordinate {
    pub(super) name: String,
    pub(super) attributes: Attributes,
    pub(super) values: Vec<f64>,
}

/// The array of the attributes, with its name for error messages.
pub(super) struct Array<'a> {
    pub path: &'a Path,
    pub name: &'a str,
    pub stored: DType,
}

/// Interpretation of stored integers; the number is 2 to the power of their bits.
#[derive(Clone, Copy)]
enum IntegerSign {
    AsStored,
    Unsigned(f64),
    Signed(f64),
}

impl IntegerSign {
    fn apply(self, value: f64) -> f64 {
        match self {
            IntegerSign::Unsigned(count) if value < 0.0 => value + count,
            IntegerSign::Signed(count) if value >= count / 2.0 => value - count,
            _ => value,
        }
    }
}

/// Rounds an attribute in double precision to f32 if the array is f32, so that equal values compare equal.
fn narrowed(value: f64, dtype: DType) -> f64 {
    if (dtype.kind, dtype.bytes) == (NumberKind::Float, 4) { f64::from(value as f32) } else { value }
}

/// NetCDF default fill values `NC_FILL_…` of elements never written; single bytes have none.
fn default_fill(dtype: DType) -> Option<f64> {
    Some(match (dtype.kind, dtype.bytes) {
        (NumberKind::Float, 8) => 15.0 * 2f64.powi(119),
        (NumberKind::Float, 4) => f64::from(15.0 * 2f32.powi(119)),
        (NumberKind::Signed, 2) => -32_767.0,
        (NumberKind::Signed, 4) => -2_147_483_647.0,
        (NumberKind::Signed, 8) => -9_223_372_036_854_775_806_f64,
        (NumberKind::Unsigned, 2) => 65_535.0,
        (NumberKind::Unsigned, 4) => 4_294_967_295.0,
        (NumberKind::Unsigned, 8) => 18_446_744_073_709_551_614_f64,
        _ => return None,
    })
}

//! Quantities of a scene: numbers with a unit of one dimension. Those that come from a command line or the library are plain numbers,
//! in the caller's units.

use asperity_contact::interface::is_ordinary;
use asperity_grid::units::{Dimension, Measure, Measures, Unit};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{DeserializeSeed, Error, SeqAccess, Unexpected, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::borrow::Cow;
use std::fmt::{self, Display, Formatter, LowerExp};
use std::marker::PhantomData;

/// A dimension as a type.
pub trait Dimensional: Copy {
    const DIMENSION: Dimension;
}

macro_rules! quantities {
    ($($kind:ident)*) => {
        /// Dimensions as types.
        pub mod dimension {
            $(#[derive(Debug, Clone, Copy, PartialEq)]
            pub struct $kind;
            impl super::Dimensional for $kind {
                const DIMENSION: super::Dimension = super::Dimension::$kind;
            })*
        }
        $(pub type $kind = Quantity<dimension::$kind>;)*
    };
}

quantities! { Length Stress Force Work Energy Temperature Time Fraction Number }

/// A measure of one dimension.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantity<D> {
    measure: Measure,
    dimension: PhantomData<D>,
}

impl<D: Dimensional> Quantity<D> {
    /// A number in the caller's units.
    pub const fn plain(value: f64) -> Self {
        Quantity { measure: Measure::plain(value), dimension: PhantomData }
    }

    /// A number in a unit of this dimension.
    pub fn new(value: f64, unit: &str) -> Self {
        let unit = Some(Self::unit(unit));
        Quantity { measure: Measure { value, unit }, dimension: PhantomData }
    }

    fn unit(name: &str) -> &'static Unit {
        let found = Unit::find(name).filter(|unit| unit.dimension == D::DIMENSION);
        found.unwrap_or_else(|| unreachable!("{name} is no unit of {}", D::DIMENSION.name()))
    }

    /// Another number in the unit of this one.
    pub fn with(self, value: f64) -> Self {
        Quantity { measure: Measure { value, ..self.measure }, ..self }
    }

    /// The number as it is given.
    pub fn value(self) -> f64 {
        self.measure.value
    }

    pub fn is_plain(self) -> bool {
        self.measure.unit.is_none()
    }

    /// In SI units; a plain number as it is.
    pub fn si(self) -> f64 {
        self.measure.si()
    }

    /// In this unit; a plain number as it is.
    pub fn to(self, unit: &str) -> f64 {
        self.measure.to(Self::unit(unit))
    }

    /// As a multiple of another.
    pub fn over(self, other: Self) -> f64 {
        self.measure.over(other.measure)
    }

    /// What is written in a scene: with a unit, or plain where the dimension needs none.
    pub fn written(measure: Measure) -> Option<Self> {
        let measure = measure.of(D::DIMENSION).ok()?;
        let good = measure.unit.is_some() && measure.value.is_finite() || D::DIMENSION.may_be_plain();
        good.then_some(Quantity { measure, dimension: PhantomData })
    }
}

impl<D> Quantity<D> {
    /// With its unit, for a message: numbers that nobody writes out with a power of ten.
    pub fn in_words(&self) -> String {
        if is_ordinary(self.measure.value) { self.to_string() } else { format!("{self:e}") }
    }
}

impl<D> Display for Quantity<D> {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        self.measure.fmt(f)
    }
}

impl<D> LowerExp for Quantity<D> {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        let unit = self.measure.unit.map_or(String::new(), |unit| format!(" {unit}"));
        write!(f, "{:e}{unit}", self.measure.value)
    }
}

impl<D> Serialize for Quantity<D> {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        AnyQuantity(self.measure).serialize(to)
    }
}

impl<'de, D: Dimensional> Deserialize<'de> for Quantity<D> {
    fn deserialize<S: Deserializer<'de>>(from: S) -> Result<Self, S::Error> {
        let entry = Entry(PhantomData).deserialize(from)?;
        match entry[..] {
            [one] => Ok(one),
            _ => Err(S::Error::custom(format!("a list, expected {}", D::DIMENSION.accepted()))),
        }
    }
}

impl<D: Dimensional> JsonSchema for Quantity<D> {
    fn schema_name() -> Cow<'static, str> {
        format!("{:?}", D::DIMENSION).into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let (name, example) = (format!("{:?}", D::DIMENSION).to_lowercase(), D::DIMENSION.example());
        let kinds: &[&str] = if D::DIMENSION.may_be_plain() { &["number", "string"] } else { &["string"] };
        match kinds {
            [one] => json_schema!({ "type": one, "format": name, "examples": [example] }),
            _ => json_schema!({ "type": kinds, "format": name, "examples": [example] }),
        }
    }
}

/// A quantity of whichever dimension.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AnyQuantity(Measure);

impl AnyQuantity {
    /// In SI units, if it has this dimension and its unit; a percentage as a fraction.
    pub(super) fn of(self, dimension: Dimension) -> Option<f64> {
        let measure = self.0.of(dimension).ok().filter(|m| m.unit.is_some() || dimension.may_be_plain())?;
        Some(if dimension == Dimension::Fraction { measure.fraction() } else { measure.si() })
    }
}

impl Display for AnyQuantity {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl Serialize for AnyQuantity {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        match self.0.unit {
            Some(_) => to.collect_str(self),
            None => to.serialize_f64(self.0.value),
        }
    }
}

impl<'de> Deserialize<'de> for AnyQuantity {
    fn deserialize<S: Deserializer<'de>>(from: S) -> Result<Self, S::Error> {
        #[derive(Deserialize)]
        #[serde(untagged, expecting = "no quantity, expected a number, or a text with its unit, as \"25 MPa\"")]
        enum Written {
            Plain(f64),
            Text(String),
        }
        let measure = match Written::deserialize(from)? {
            Written::Plain(value) => Measure::plain(value),
            Written::Text(text) => {
                let wrong = |why| S::Error::custom(format!("{REASON}{why}, expected a load as it is given"));
                text.parse().map_err(wrong)?
            }
        };
        Ok(AnyQuantity(measure))
    }
}

impl JsonSchema for AnyQuantity {
    fn schema_name() -> Cow<'static, str> {
        "AnyQuantity".into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": ["number", "string"], "format": "quantity", "examples": [0.01, "25 MPa"] })
    }
}

/// Begins the message about a text that is no measure; what is wrong follows, then what is expected.
pub(super) const REASON: &str = "no measure: ";

/// Reads a measure, or the measures of a range. An untagged enum would not name the entry that is wrong.
struct Entry<D>(PhantomData<D>);

impl<'de, D: Dimensional> DeserializeSeed<'de> for Entry<D> {
    type Value = Vec<Quantity<D>>;

    fn deserialize<S: Deserializer<'de>>(self, from: S) -> Result<Self::Value, S::Error> {
        from.deserialize_any(self)
    }
}

impl<'de, D: Dimensional> Visitor<'de> for Entry<D> {
    type Value = Vec<Quantity<D>>;

    fn expecting(&self, f: &mut Formatter) -> fmt::Result {
        f.write_str(&D::DIMENSION.accepted())
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<Self::Value, E> {
        let list = match text.parse::<Measures>() {
            Err(why) if text.contains(':') => return Err(E::custom(why)),
            // More than that it is none.
            Err(why) if text.contains(|c: char| c.is_ascii_digit()) => {
                return Err(E::custom(format!("{REASON}{why}, expected {}", D::DIMENSION.accepted())));
            }
            found => found.unwrap_or_default().0,
        };
        let written: Option<Vec<_>> = list.into_iter().map(Quantity::written).collect();
        let written = written.filter(|list| !list.is_empty());
        written.ok_or_else(|| E::invalid_value(Unexpected::Str(text), &self))
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Self::Value, E> {
        let written = Quantity::written(Measure::plain(value)).map(|one| vec![one]);
        written.ok_or_else(|| E::invalid_type(Unexpected::Float(value), &self))
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Self::Value, E> {
        self.visit_f64(value as f64)
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<Self::Value, E> {
        self.visit_f64(value as f64)
    }
}

/// Reads a list, the text of one, or one value; its schema is that of all.
pub(super) struct List<D>(PhantomData<D>);

impl<D: Dimensional> List<D> {
    /// Name and unit of its values.
    const VALUES: (&str, &str) = match D::DIMENSION {
        Dimension::Length => ("lengths", "um"),
        Dimension::Stress => ("stresses", "MPa"),
        Dimension::Force => ("forces", "mN"),
        _ => ("numbers", ""),
    };

    /// A range as a person writes it.
    fn range() -> String {
        let (_, unit) = Self::VALUES;
        if unit.is_empty() { "log:0.01:0.1:5".into() } else { format!("log:1{unit}:10{unit}:5") }
    }
}

impl<D: Dimensional> JsonSchema for List<D> {
    fn schema_name() -> Cow<'static, str> {
        format!("{:?}List", D::DIMENSION).into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let items = generator.subschema_for::<Quantity<D>>();
        let range = json_schema!({ "type": "string", "format": "range", "examples": [Self::range()] });
        let list = json_schema!({ "type": "array", "items": items });
        match Self::VALUES {
            (_, "") => json_schema!({ "anyOf": [list, range, { "type": "number" }] }),
            _ => json_schema!({ "anyOf": [list, range] }),
        }
    }
}

impl<'de, D: Dimensional> Visitor<'de> for List<D> {
    type Value = Vec<Quantity<D>>;

    fn expecting(&self, f: &mut Formatter) -> fmt::Result {
        let (values, unit) = Self::VALUES;
        let list = if unit.is_empty() { "0.01, 0.03".into() } else { format!("\"1 {unit}\", \"2 {unit}\"") };
        let one = if unit.is_empty() { ", a number" } else { "" };
        write!(f, "a list of {values}, as [{list}]{one}, or a range, as \"{}\"", Self::range())
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<Self::Value, E> {
        Entry(PhantomData).visit_str(text)
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Self::Value, E> {
        let written = Quantity::written(Measure::plain(value)).map(|one| vec![one]);
        written.ok_or_else(|| E::invalid_type(Unexpected::Float(value), &self))
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Self::Value, E> {
        self.visit_f64(value as f64)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Self::Value, A::Error> {
        let mut entries = Vec::new();
        while let Some(entry) = list.next_element_seed(Entry(PhantomData))? {
            entries.extend(entry);
        }
        Ok(entries)
    }
}

/// Reads quantities: a list of them and of ranges, the text of one, or one number that needs no unit.
pub(super) fn list<'de, D: Dimensional, S: Deserializer<'de>>(from: S) -> Result<Vec<Quantity<D>>, S::Error> {
    from.deserialize_any(List(PhantomData))
}

/// Likewise plain numbers.
pub(super) fn numbers<'de, S: Deserializer<'de>>(from: S) -> Result<Vec<f64>, S::Error> {
    Ok(list::<dimension::Number, S>(from)?.into_iter().map(Quantity::value).collect())
}

/// Likewise fractions, which may be percentages.
pub(super) fn fractions<'de, S: Deserializer<'de>>(from: S) -> Result<Vec<f64>, S::Error> {
    Ok(list::<dimension::Fraction, S>(from)?.into_iter().map(|f| f.measure.fraction()).collect())
}

/// Reads a unit, alone or with a factor: `"GPa"`, `"0.1 GPa"`.
pub(super) fn unit<'de, D: Dimensional, S: Deserializer<'de>>(from: S) -> Result<Option<Quantity<D>>, S::Error> {
    let text = String::deserialize(from)?;
    let has_factor = text.trim_start().starts_with(|c: char| c.is_ascii_digit() || c == '.');
    let measure = if has_factor { text.parse() } else { format!("1 {text}").parse() };
    let accepted = D::DIMENSION.accepted();
    let measure = measure.map_err(|why| S::Error::custom(format!("{REASON}{why}, expected {accepted}")))?;
    let wrong = || S::Error::custom(format!("no unit, expected {accepted}"));
    Quantity::written(measure).map(Some).ok_or_else(wrong)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    struct Table {
        #[serde(skip_serializing_if = "Option::is_none")]
        length: Option<Length>,
        #[serde(default, deserialize_with = "list")]
        pressure: Vec<Stress>,
        #[serde(default, deserialize_with = "fractions")]
        contact: Vec<f64>,
    }

    fn read(text: &str) -> Result<Table, String> {
        toml::from_str(text).map_err(|e: toml::de::Error| e.message().to_string())
    }

    #[test]
    fn written_quantities_are_read_again() {
        let table = read("length = \"12.5 nm\"\npressure = [\"1 MPa\", \"log:2kPa:8kPa:3\"]\ncontact = [0.1, \"7 %\"]")
            .expect("good");
        assert_eq!((table.length.map(|l| l.si()), &table.contact[..]), (Some(12.5 * 1e-9), &[0.1, 0.07][..]));
        assert_eq!(table.pressure.iter().map(|p| p.si()).collect::<Vec<_>>(), [1e6, 2e3, 4e3, 8e3]);
        let again = toml::to_string(&table).expect("a table");
        assert_eq!(read(&again), Ok(table));
        assert_eq!(read("pressure = \"lin:1MPa:3MPa:3\"").map(|t| t.pressure.len()), Ok(3));
        assert_eq!(read("contact = 0.1").map(|t| t.contact), Ok(vec![0.1]));
    }

    #[test]
    fn quantities_without_unit_or_of_another_dimension_are_refused() {
        for text in [
            "length = 100",
            "length = 0.1",
            "length = \"100\"",
            "length = \"100 MPa\"",
            "length = \"100 xm\"",
            "length = \"nan um\"",
            "length = \"1e999 um\"",
            "length = \"1um,2um\"",
            "length = true",
        ] {
            let message = read(text).expect_err(text);
            assert!(message.ends_with("expected a length with its unit, as \"100 um\""), "{text}: {message}");
        }
        for text in ["pressure = [1, 2]", "pressure = [\"1 um\"]"] {
            let message = read(text).expect_err(text);
            assert!(message.ends_with("expected a stress with its unit, as \"25 MPa\""), "{text}: {message}");
        }
        assert!(read("pressure = 3").is_err_and(|e| e.contains("a list of stresses")));
        assert!(read("pressure = \"log:1MPa:2MPa\"").is_err_and(|e| e.contains("FROM:TO:COUNT")));
    }
}

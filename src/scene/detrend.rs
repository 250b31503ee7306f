//! The form that is subtracted from a map, as text: a word, or a plane through three points.

use super::Length;
use asperity_grid::units::Measure;
use asperity_surface::Detrend;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use std::borrow::Cow;
use std::fmt::{self, Display, Formatter};
use std::str::FromStr;

/// Before the points.
const THREE_POINTS: &str = "three-points=";

/// A form whose lengths are of type `L`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DetrendScene<L = Length> {
    /// A form without parameters.
    Form(Detrend),
    /// The plane through three points, along x and y from the first point of the map.
    ThreePoints([[L; 2]; 3]),
}

impl<L: Copy> DetrendScene<L> {
    /// The same with other lengths.
    ///
    /// # Errors
    /// That of `change`.
    pub fn try_map<M: Copy, E>(self, mut change: impl FnMut(L) -> Result<M, E>) -> Result<DetrendScene<M>, E> {
        Ok(match self {
            DetrendScene::Form(form) => DetrendScene::Form(form),
            DetrendScene::ThreePoints([a, b, c]) => {
                let mut both = |[x, y]: [L; 2]| Ok([change(x)?, change(y)?]);
                DetrendScene::ThreePoints([both(a)?, both(b)?, both(c)?])
            }
        })
    }

    /// Its lengths.
    pub fn lengths(&self) -> Vec<L> {
        match self {
            DetrendScene::Form(_) => Vec::new(),
            DetrendScene::ThreePoints(points) => points.concat(),
        }
    }

    /// The form with its lengths as numbers.
    pub fn form(self, number: impl Fn(L) -> f64) -> Detrend {
        match self {
            DetrendScene::Form(form) => form,
            DetrendScene::ThreePoints(points) => Detrend::ThreePoints(points.map(|both| both.map(&number))),
        }
    }
}

impl From<Detrend> for DetrendScene {
    /// Lengths are plain numbers.
    fn from(form: Detrend) -> Self {
        match form {
            Detrend::ThreePoints(points) => DetrendScene::ThreePoints(points.map(|both| both.map(Length::plain))),
            form => DetrendScene::Form(form),
        }
    }
}

fn accepted() -> String {
    let words: Vec<&str> = Detrend::FORMS.iter().map(|(_, word)| *word).collect();
    format!("{}, or {THREE_POINTS}X1,Y1;X2,Y2;X3,Y3", words.join(", "))
}

impl FromStr for DetrendScene<Measure> {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let wrong = || format!("expected {}", accepted());
        if let Some((form, _)) = Detrend::FORMS.iter().find(|(_, word)| *word == text) {
            return Ok(DetrendScene::Form(*form));
        }
        let Some(points) = text.strip_prefix(THREE_POINTS) else { return Err(wrong()) };
        let pairs: Result<Vec<[Measure; 2]>, String> = points
            .split(';')
            .map(|pair| {
                let (x, y) = pair.split_once(',').ok_or_else(wrong)?;
                Ok([x.parse()?, y.parse()?])
            })
            .collect();
        let points: [[Measure; 2]; 3] = pairs?.try_into().map_err(|_| wrong())?;
        let all = || points.iter().flatten();
        let with_unit = all().filter(|m| m.unit.is_some()).count();
        match all().find(|m| m.unit.is_none()) {
            _ if all().any(|m| !m.value.is_finite()) => Err(wrong()),
            Some(bare) if with_unit > 0 => Err(format!("{bare} has no unit: units at all lengths or at none")),
            _ => Ok(DetrendScene::ThreePoints(points)),
        }
    }
}

impl<L: Display> Display for DetrendScene<L> {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        match self {
            DetrendScene::Form(form) => f.write_str(form.word()),
            DetrendScene::ThreePoints(points) => {
                let pairs = points.iter().map(|[x, y]| format!("{x},{y}")).collect::<Vec<_>>();
                write!(f, "{THREE_POINTS}{}", pairs.join(";"))
            }
        }
    }
}

impl Serialize for DetrendScene {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for DetrendScene {
    fn deserialize<S: Deserializer<'de>>(from: S) -> Result<Self, S::Error> {
        let text = String::deserialize(from)?;
        let wrong = |why: String| de::Error::custom(format!("{text:?}, {why}"));
        let form: DetrendScene<Measure> = text.parse().map_err(wrong)?;
        let written = |m| Length::written(m).ok_or_else(|| wrong("expected lengths with their unit, as 10um".into()));
        form.try_map(written)
    }
}

impl JsonSchema for DetrendScene {
    fn schema_name() -> Cow<'static, str> {
        "DetrendScene".into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let word = generator.subschema_for::<Detrend>();
        let example = format!("{THREE_POINTS}1um,1um;9um,1um;5um,8um");
        let points = json_schema!({ "type": "string", "format": "three points", "examples": [example] });
        json_schema!({ "anyOf": [word, points] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forms_are_read_as_they_are_written() {
        for text in ["plane", "line-quadratic", "three-points=1 um,0 nm;2.5 um,1 mm;3 um,4 um"] {
            let read: DetrendScene = serde_json::from_value(text.into()).expect("a form");
            assert_eq!(read.to_string(), text);
        }
        for (text, words) in [
            ("plan", "expected mean, plane"),
            ("three-points=1um,2um;3um,4um", "expected mean, plane"),
            ("three-points=1,2;3,4;5,6", "with their unit"),
            ("three-points=1um,2xm;3um,4um;1um,1um", "xm"),
            ("three-points=1um,2um;3um,4um;1um,8", "8 has no unit"),
            ("three-points=1um;3um,4um;1um,1um", "X1,Y1;X2,Y2;X3,Y3"),
        ] {
            let said = serde_json::from_value::<DetrendScene>(text.into()).expect_err(text).to_string();
            assert!(said.contains(words), "{text}: {said}");
        }
    }
}

//! The accuracy that a scene asks for.

use super::quantity::Time;
use asperity_contact::problem::{Accuracy, ErrorTargets};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// Errors that are accepted. Grids are solved from coarse to fine until the stated errors are within them.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct AccuracyScene {
    /// Largest accepted relative error: of all quantities, as "5 %", or of each that is named, as "area = 2%, mean_gap = 1%":
    /// contact_area, mean_gap, stiffness, leakage, pull_off, and by name alone gap_map, contact_map.
    #[serde(deserialize_with = "errors", serialize_with = "written", skip_serializing_if = "ErrorTargets::is_empty")]
    #[schemars(with = "ErrorsSchema")]
    pub error: ErrorTargets,
    /// Time after which no finer grid is begun.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub budget: Option<Time>,
}

/// Schema of what [`errors`] reads.
struct ErrorsSchema;

impl JsonSchema for ErrorsSchema {
    fn schema_name() -> Cow<'static, str> {
        "Errors".into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let kinds = ["number", "string", "object"];
        json_schema!({ "type": kinds, "format": "fraction or { area = …, … }", "examples": ["5 %"] })
    }
}

/// A number, a text, or a table of the errors of quantities.
fn errors<'de, S: Deserializer<'de>>(from: S) -> Result<ErrorTargets, S::Error> {
    let one = |value: &toml::Value| match value {
        toml::Value::String(text) => Some(text.clone()),
        toml::Value::Float(number) => Some(number.to_string()),
        toml::Value::Integer(number) => Some(number.to_string()),
        _ => None,
    };
    let given = toml::Value::deserialize(from)?;
    let text = match &given {
        toml::Value::Table(named) => {
            let parts = named.iter().map(|(name, value)| Some(format!("{name}={}", one(value)?)));
            parts.collect::<Option<Vec<_>>>().map(|list| list.join(","))
        }
        value => one(value),
    };
    let text = text.ok_or_else(|| S::Error::custom("expected an error, as \"5 %\""))?;
    text.parse().map_err(|accepted| S::Error::custom(format!("{text:?}, expected {accepted}")))
}

fn written<S: Serializer>(targets: &ErrorTargets, to: S) -> Result<S::Ok, S::Error> {
    to.collect_map(BTreeMap::<String, f64>::from(targets.clone()))
}

impl AccuracyScene {
    /// What is asked for, if anything is.
    pub fn asked(&self) -> Option<Accuracy> {
        let asks = !self.error.is_empty() || self.budget.is_some();
        asks.then(|| Accuracy { errors: self.error.clone(), budget_seconds: self.budget.map(Time::si) })
    }
}

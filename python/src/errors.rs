//! Exceptions: `asperity._errors` defines one class for each exit code of the program.

use asperity::Error;
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use serde::de::DeserializeOwned;

/// Words of scenes, flags and the crate in messages, and their names in Python.
const NAMES: [(&str, &str); 21] = [
    ("`surface.edges taper|mirror`", "edges=\"taper\" or \"mirror\" in the preparation"),
    ("`surface.detrend plane`", "detrend=\"plane\""),
    ("`continuum.periodic = false`", "body=NonPeriodic()"),
    ("`--fill nearest|harmonic`", "fill=\"nearest\" or \"harmonic\" in the preparation"),
    ("`Problem::estimate`", "asperity.estimate"),
    ("`Body::NonPeriodic`", "body=NonPeriodic()"),
    ("`--edges taper|mirror`", "edges=\"taper\" or \"mirror\" in the preparation"),
    ("`--non-periodic`", "body=NonPeriodic()"),
    ("`--detrend plane`", "detrend=\"plane\""),
    ("Precision::F32", "precision=\"f32\""),
    ("--crop", "crop"),
    ("--fill", "fill"),
    ("--detrend", "detrend"),
    ("--low-pass", "low_pass"),
    ("--high-pass", "high_pass"),
    ("--resample", "resample"),
    ("--extend-to", "extend_to"),
    ("--isotropic-map", "isotropic_map"),
    ("a profile (--profile)", "a profile"),
    ("continuum.periodic = false or surface.edges take", "maps with periodic=False take"),
    ("--remove-outliers", "remove_outliers"),
];

/// A message of the crate in the words of Python.
pub(crate) fn in_python(text: &str) -> String {
    NAMES.iter().fold(text.to_string(), |text, (name, python)| text.replace(name, python))
}

/// The exception of an error, with the message of the command line.
pub(crate) fn exception(py: Python<'_>, error: &Error) -> PyErr {
    let text = in_python(&error.to_string());
    if matches!(error, Error::Interrupted) {
        return PyKeyboardInterrupt::new_err("interrupted");
    }
    let classes = py.import("asperity._errors").and_then(|m| m.getattr("CLASSES"));
    let made = classes.and_then(|c| c.get_item(error.exit_code())).and_then(|c| c.call1((text,)));
    match made {
        Ok(value) => PyErr::from_value(value),
        Err(error) => error,
    }
}

/// A result whose error is an exception.
pub(crate) trait Raise<T> {
    fn raise(self, py: Python<'_>) -> PyResult<T>;
}

impl<T> Raise<T> for asperity::Result<T> {
    fn raise(self, py: Python<'_>) -> PyResult<T> {
        self.map_err(|error| exception(py, &error))
    }
}

/// A value of an enumeration from its word.
pub(crate) fn choice<T: DeserializeOwned>(py: Python<'_>, place: &str, key: &str, word: &str) -> PyResult<T> {
    serde_json::from_value(serde_json::Value::from(word)).map_err(|error| {
        let text = error.to_string();
        let accepted = text.split_once("expected ").map_or(text.as_str(), |(_, words)| words);
        exception(py, &Error::input(place, key, format!("{word:?}"), accepted))
    })
}

/// Likewise for an optional value.
pub(crate) fn optional<T: DeserializeOwned>(
    py: Python<'_>,
    place: &str,
    key: &str,
    word: Option<&String>,
) -> PyResult<Option<T>> {
    word.map(|word| choice(py, place, key, word)).transpose()
}

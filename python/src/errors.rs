//! Exceptions: `asperity._errors` defines one class for each exit code of the program.

use asperity::Error;
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use serde::de::DeserializeOwned;

/// The exception of an error, with the message of the command line.
pub(crate) fn exception(py: Python<'_>, error: &Error) -> PyErr {
    let class = match error.exit_code() {
        2 => "InputError",
        3 => "NotConverged",
        4 => "LammpsError",
        130 => return PyKeyboardInterrupt::new_err(error.to_string()),
        _ => "ResourceError",
    };
    let made = py.import("asperity._errors").and_then(|m| m.getattr(class)).and_then(|c| c.call1((error.to_string(),)));
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

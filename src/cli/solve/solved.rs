//! Results of a solve.

use crate::{Error, Result};
use asperity_contact::state::State;
use serde::Deserialize;
use serde_json::Value;

/// Results of a solve: each state and its line of JSON, and that of the pull-off.
#[derive(Default)]
pub(super) struct Solved {
    pub states: Vec<State>,
    pub lines: Vec<Value>,
    pub pull_off: Option<Value>,
    /// Of results that were read: the time of their solve.
    pub earlier_seconds: Option<f64>,
}

impl Solved {
    /// From the lines of JSON.
    pub(super) fn read(lines: Vec<Value>, pull_off: Option<Value>) -> Result<Self> {
        let states = lines.iter().map(state_of_line).collect::<Result<_>>()?;
        Ok(Solved { states, lines, pull_off, earlier_seconds: None })
    }

    /// Relative error of the pull-off, if one was found.
    pub(super) fn pull_off_error(&self) -> Option<Option<f64>> {
        let line = self.pull_off.as_ref()?;
        let number = |key: &str| line[key].as_f64();
        Some(
            number("pull_off_pressure_error")
                .zip(number("pull_off_pressure"))
                .map(|(error, value)| error / value.abs()),
        )
    }
}

/// The state of a line of JSON.
pub(super) fn state_of_line(line: &Value) -> Result<State> {
    State::deserialize(line).map_err(|e| Error::format("results", e, "states as this program writes them"))
}

//! Progress of a run, for its caller.

use crate::record::results::StageCost;

/// Receives the progress of a run, and can request a stop. The listener formats the output.
pub trait Listener: Sync {
    fn begin(&self, stage: &str, what: &str);

    /// `done` is the completed fraction of the stage, where it is known.
    fn progress(&self, done: Option<f64>, message: &str);

    fn end(&self, cost: &StageCost);

    fn warn(&self, text: &str);

    /// Whether the user has requested a stop.
    fn stopping(&self) -> bool;
}

/// A listener without output, which never requests a stop.
pub struct Silent;

impl Listener for Silent {
    fn begin(&self, _: &str, _: &str) {}
    fn progress(&self, _: Option<f64>, _: &str) {}
    fn end(&self, _: &StageCost) {}
    fn warn(&self, _: &str) {}
    fn stopping(&self) -> bool {
        false
    }
}

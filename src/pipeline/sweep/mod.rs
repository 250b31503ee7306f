//! Sweeps: a scene with varied keys, run point by point, and the statistics of the results.

mod collect;
mod files;
mod points;
mod run;

pub use points::{ChangeScene, RANGE, Sweep, SweepPoint, whole_numbers};
pub use run::{PointFolder, PointOutcome, PointRunner, SweepListener, json_values, open, point, run, write_tables};

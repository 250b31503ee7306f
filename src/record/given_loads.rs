//! How loads were given.

use serde::{Deserialize, Serialize};

/// The quantity in which loads are named, with what p* = 1 is in it: that in which the scene gave them, and p* where atoms take part. Where a gap, a displacement or a contact area was given, loads
/// are named by the mean pressures that came out.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(tag = "quantity", content = "of_p_star", rename_all = "snake_case")]
pub enum GivenLoads {
    #[default]
    PStar,
    /// Mean pressure, Pa.
    Pressure(f64),
    /// Normal force on the map, N.
    Force(f64),
}

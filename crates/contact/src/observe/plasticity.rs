use serde::{Deserialize, Serialize};

/// Plastic flow of a load history up to a state.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Plasticity {
    /// Fraction of the nodes whose plastic displacement grows in this load; their contact stress is the hardness.
    pub flowing: f64,
    /// Fraction of the nodes with a plastic displacement.
    pub displaced: f64,
    /// Mean plastic displacement; a length, in results in L.
    pub displacement: f64,
    /// Plastic work per area since the first load; in results in E*·L.
    pub work: f64,
}

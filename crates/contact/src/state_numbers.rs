//! Numbers of one equilibrium that every method provides.

use crate::load::Stop;
use serde::{Deserialize, Serialize};

/// One load of a solver or an estimate: load, contact, convergence and cost.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StateNumbers {
    /// Index of the load step, from 0.
    pub index: usize,
    pub p_star: f64,
    /// Mean pressure over E*.
    pub pressure: f64,
    /// Contact area over the area of the cell, by the method's own criterion: the best value.
    pub contact_area: f64,
    /// Its error, of the same unit; absent where it is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact_area_error: Option<f64>,
    /// Displacement of the far field from first contact, L: of a periodic body the mean gap at first contact minus the
    /// mean gap, else the rigid approach. Absent for estimates.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub displacement: Option<f64>,
    /// Contact stiffness dp/dū, E*/L, without change of the contact; of estimates as the method defines it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<f64>,
    /// Error of the stiffness, of the same unit; absent where it is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness_error: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub patches: Option<usize>,
    /// Files of the `[ny, nx]` maps of gap (L) and stress (E*), if stored.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gap_map: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stress_map: Option<String>,
    /// Relative deviation from the target load.
    pub load_error: f64,
    pub stop: Stop,
    pub iterations: usize,
    /// Pairs of forward and inverse transforms of the full grid.
    pub fft_pairs: f64,
    pub seconds: f64,
}

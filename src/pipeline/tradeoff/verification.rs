//! Verification of advised settings on surfaces that are not in the tables.

use super::{ExactSetting, TradeoffRequest, shortest_wavelength, tradeoff};
use crate::Result;
use crate::compare::advice::{Limit, Table};
use crate::method::{self, Precision};
use crate::pipeline::{Listener, Unserved, advise};
use crate::record::advice::Advice;
use crate::record::quantity::Quantity;
use crate::record::tradeoff::{Tradeoff, TradeoffPoint};
use crate::scene::{Case, Surface};
use serde::Serialize;
use std::path::Path;

/// Nodes per shortest wavelength of the reference: twice those of the finest settings in the shipped tables.
const REFERENCE_POINTS: f64 = 32.0;

/// A requested error, and the error of the advised setting.
#[derive(Debug, Clone, Serialize)]
pub struct Verification {
    pub surface: String,
    pub quantity: Quantity,
    pub asked: f64,
    /// None if the tables do not support the request; `unavailable_reason` gives the reason.
    pub advice: Option<Advice>,
    pub unavailable_reason: Option<String>,
    /// Root mean square error over the loads; `uncertainty` is that of the reference. None if the setting does not give
    /// the quantity.
    pub found: Option<f64>,
    pub uncertainty: Option<f64>,
}

impl Verification {
    /// Whether the error of the advised setting is at most the requested error. None without an advised setting.
    pub fn met(&self) -> Option<bool> {
        self.advice.as_ref().map(|_| self.found.is_some_and(|e| e <= self.quantity.error_of_deviation(self.asked)))
    }
}

/// Requests every error for every quantity on a case's surface, runs the advised settings in a folder, and compares
/// them with a reference.
///
/// # Errors
/// As [`tradeoff`].
pub fn verify(
    case: &Case,
    tables: &[Table],
    (quantities, errors): (&[Quantity], &[f64]),
    out: &Path,
    listener: &dyn Listener,
) -> Result<Vec<Verification>> {
    let mut verifications = Vec::new();
    let mut exact: Vec<ExactSetting> = Vec::new();
    for &quantity in quantities {
        for &asked in errors {
            let served = advise(tables, case, quantity, Limit::Error(asked), false);
            let (advice, unavailable_reason) = match served {
                Ok(advice) => (Some(advice), None),
                Err(Unserved(why)) => (None, Some(why)),
            };
            if let Some(setting) = advice.as_ref().map(exact_of).filter(|s| !exact.contains(s)) {
                exact.push(setting);
            }
            let surface = case.surface.origin();
            verifications.push(Verification {
                surface,
                quantity,
                asked,
                advice,
                unavailable_reason,
                found: None,
                uncertainty: None,
            });
        }
    }
    if exact.is_empty() {
        return Ok(verifications);
    }
    let finest = exact.iter().map(|e| e.n).max().unwrap_or(0);
    let waves = (REFERENCE_POINTS / shortest_wavelength(&case.surface)).ceil() as usize;
    let reference = match case.surface {
        Surface::Imported { .. } => case.grid.nx,
        _ => waves.max(2 * finest).next_power_of_two(),
    };
    let methods = method::REGISTRY.iter().copied().filter(|m| exact.iter().any(|e| e.method == m.card().id)).collect();
    let asked = TradeoffRequest {
        methods,
        grids: None,
        reference: Some(reference),
        budget_seconds: None,
        repeats: Some(1),
        exact: Some(exact),
        slabs: Vec::new(),
        blocks: None,
    };
    let (told, _) = tradeoff(case, &asked, out, listener)?;
    for verification in &mut verifications {
        let Some(setting) = verification.advice.as_ref().map(exact_of) else { continue };
        let point = told.points.iter().find(|p| setting.is_of(p));
        verification.found = point.and_then(|p| p.errors.get(&verification.quantity).copied());
        verification.uncertainty = point.and_then(|p| uncertainty(&told, p, verification.quantity));
    }
    Ok(verifications)
}

fn uncertainty(told: &Tradeoff, point: &TradeoffPoint, quantity: Quantity) -> Option<f64> {
    told.reference(point.setting.adhesive)?.uncertainty.get(&quantity).copied()
}

fn exact_of(advice: &Advice) -> ExactSetting {
    let precision = if advice.precision == "f32" { Precision::F32 } else { Precision::F64 };
    ExactSetting { method: advice.method.clone(), n: advice.grid, precision, tolerance: advice.tolerance }
}

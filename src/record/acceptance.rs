//! Acceptance checks: statements of the challenge compared with the results, as in `results.json`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A statement of the challenge and the value found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AcceptanceCheck {
    /// Identifier such as "S07" of evidence/challenge.md.
    pub id: String,
    /// In words.
    pub statement: String,
    /// Unit for display ("µm", "%", "1").
    pub unit: String,
    /// Found; absent where it could not be.
    pub value: Option<f64>,
    /// Error of the value in the same unit, where known; evidence/challenge.md states how each is found.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<f64>,
    /// The paper's value.
    pub reference: Option<f64>,
    /// Lowest and highest accepted value, where defined.
    pub tolerance: Option<[Option<f64>; 2]>,
    /// Whether the value is within the tolerance.
    pub status: CheckStatus,
    /// What the statement is about.
    pub scope: CheckScope,
    /// Source of the tolerance, or the reason why the statement is not assessed.
    pub reason: String,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum CheckStatus {
    #[serde(rename = "pass")]
    Pass,
    #[serde(rename = "fail")]
    Fail,
    #[serde(rename = "not assessed")]
    NotAssessed,
}

/// The problem that a check refers to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum CheckScope {
    /// Follows from the set-up and cannot fail.
    #[serde(rename = "set-up")]
    Setup,
    /// The problem of the paper.
    #[serde(rename = "paper")]
    Paper,
    /// The same with a longer range of adhesion, about which the paper states nothing.
    #[serde(rename = "longer range")]
    LongerRange,
}

impl AcceptanceCheck {
    /// With an error of the value.
    pub fn with_error(self, error: Option<f64>) -> Self {
        let error = error.filter(|e| e.is_finite() && self.value.is_some());
        AcceptanceCheck { error, ..self }
    }

    /// The accepted range in words; `None` without a tolerance.
    pub fn accepted(&self, number: impl Fn(f64) -> String) -> Option<String> {
        Some(match self.tolerance? {
            [Some(low), Some(high)] => format!("{} to {}", number(low), number(high)),
            [Some(low), None] => format!("from {}", number(low)),
            [None, Some(high)] => format!("up to {}", number(high)),
            [None, None] => return None,
        })
    }
}

impl std::fmt::Display for CheckStatus {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            CheckStatus::Pass => "pass",
            CheckStatus::Fail => "fail",
            CheckStatus::NotAssessed => "not assessed",
        })
    }
}

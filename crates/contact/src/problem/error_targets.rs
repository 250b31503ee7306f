//! Errors that are accepted, by quantity.

use crate::quantity::Quantity;
use asperity_grid::units::fraction;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt::{self, Display, Formatter};
use std::str::FromStr;

/// A quantity of which errors are stated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum StatedQuantity {
    ContactArea,
    MeanGap,
    Stiffness,
    /// Flow through the gap, the larger relative error of both directions; where the leakage is solved.
    Leakage,
    /// Gap, as a map.
    GapMap,
    /// Contact, as a map.
    ContactMap,
    /// Largest tensile pressure, where it is searched for: its error is an estimate.
    PullOff,
}

impl StatedQuantity {
    pub const ALL: [StatedQuantity; 7] = [
        StatedQuantity::ContactArea,
        StatedQuantity::MeanGap,
        StatedQuantity::Stiffness,
        StatedQuantity::Leakage,
        StatedQuantity::PullOff,
        StatedQuantity::GapMap,
        StatedQuantity::ContactMap,
    ];

    /// Whether it is a map, whose errors are asked for by its name alone: they cost another solve.
    pub fn is_map(self) -> bool {
        matches!(self, StatedQuantity::GapMap | StatedQuantity::ContactMap)
    }

    /// Of the states themselves.
    pub fn quantity(self) -> Option<Quantity> {
        match self {
            StatedQuantity::ContactArea => Some(Quantity::ContactArea),
            StatedQuantity::MeanGap => Some(Quantity::MeanGap),
            StatedQuantity::Stiffness => Some(Quantity::Stiffness),
            StatedQuantity::GapMap => Some(Quantity::GapMap),
            StatedQuantity::ContactMap => Some(Quantity::ContactMap),
            StatedQuantity::Leakage | StatedQuantity::PullOff => None,
        }
    }

    /// Name in JSON and flags.
    pub fn id(self) -> &'static str {
        self.quantity().map_or(if self == StatedQuantity::PullOff { "pull_off" } else { "leakage" }, Quantity::id)
    }

    pub fn name(self) -> &'static str {
        self.quantity()
            .map_or(if self == StatedQuantity::PullOff { "pull-off pressure" } else { "leakage" }, Quantity::name)
    }
}

/// Largest relative errors that are accepted: one of all quantities but maps, or one of each that is named.
///
/// ```
/// use asperity_contact::problem::{ErrorTargets, StatedQuantity};
///
/// let targets: ErrorTargets = "5%, mean_gap = 1%".parse()?;
/// assert_eq!((targets.of(StatedQuantity::MeanGap), targets.of(StatedQuantity::ContactArea)), (Some(0.01), Some(0.05)));
/// assert!("5".parse::<ErrorTargets>().is_err_and(|why| why.contains("did you mean 5%?")));
/// # Ok::<(), String>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(try_from = "BTreeMap<String, f64>", into = "BTreeMap<String, f64>")]
pub struct ErrorTargets {
    all: Option<f64>,
    named: BTreeMap<StatedQuantity, f64>,
}

/// Key of the error of all quantities.
const ALL: &str = "all";

impl ErrorTargets {
    /// The accepted error of a quantity, if there is one.
    pub fn of(&self, quantity: StatedQuantity) -> Option<f64> {
        self.named.get(&quantity).copied().or(self.all.filter(|_| !quantity.is_map()))
    }

    /// Whether the error of a map is asked for.
    pub fn has_maps(&self) -> bool {
        self.named.keys().any(|quantity| quantity.is_map())
    }

    /// Whether an error of this very quantity is asked for.
    pub fn names(&self, quantity: StatedQuantity) -> bool {
        self.named.contains_key(&quantity)
    }

    /// Whether no error is asked for.
    pub fn is_empty(&self) -> bool {
        self.all.is_none() && self.named.is_empty()
    }

    /// The least of all accepted errors.
    pub(super) fn least(&self) -> Option<f64> {
        self.named.values().copied().chain(self.all).reduce(f64::min)
    }

    /// Sets the error of a quantity by its name.
    ///
    /// # Errors
    /// What is accepted, for an unknown name, one given twice, and an error that is none.
    pub fn set(&mut self, name: &str, error: f64) -> std::result::Result<(), String> {
        let error = accepted(error)?;
        if name == ALL {
            return match self.all.replace(error) {
                None => Ok(()),
                Some(_) => Err("one error of all quantities".into()),
            };
        }
        match self.named.insert(quantity(name)?, error) {
            None => Ok(()),
            Some(_) => Err(format!("one error of {name}")),
        }
    }
}

/// # Errors
/// What is accepted, for a number that is no error.
fn accepted(error: f64) -> std::result::Result<f64, String> {
    match error {
        e if e > 0.0 && e < 1.0 => Ok(e),
        e if (1.0..100.0).contains(&e) => {
            Err(format!("an error below 100%: {e} means {} %; did you mean {e}%?", (100.0 * e).round()))
        }
        _ => Err("an error between 0 and 100%, such as 5%".into()),
    }
}

/// # Errors
/// The names.
fn quantity(name: &str) -> std::result::Result<StatedQuantity, String> {
    let found = match name {
        "area" => Some(StatedQuantity::ContactArea),
        _ => StatedQuantity::ALL.into_iter().find(|q| q.id() == name),
    };
    let is_stress = name == "stress_map";
    let reason =
        if is_stress { ": no error of the stress map is stated (`asperity tradeoff` measures it)" } else { "" };
    let names = StatedQuantity::ALL.map(StatedQuantity::id).join(", ");
    found.ok_or_else(|| format!("errors of {names}, as area=2%,mean_gap=1%{reason}"))
}

impl FromStr for ErrorTargets {
    type Err = String;

    /// `5%`, or `area=2%,mean_gap=1%`.
    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let mut targets = ErrorTargets::default();
        for part in text.split(',') {
            let (name, value) = part.split_once('=').unwrap_or((ALL, part));
            let percent = value.trim().ends_with('%');
            let error = fraction(value.trim()).ok_or("an error such as 5%, or area=2%,mean_gap=1%")?;
            if percent && error >= 1.0 {
                return Err("an error below 100%, such as 5%".into());
            }
            targets.set(name.trim(), error)?;
        }
        Ok(targets)
    }
}

impl TryFrom<BTreeMap<String, f64>> for ErrorTargets {
    type Error = String;

    fn try_from(map: BTreeMap<String, f64>) -> std::result::Result<Self, String> {
        let mut targets = ErrorTargets::default();
        map.iter().try_for_each(|(name, error)| targets.set(name, *error))?;
        Ok(targets)
    }
}

impl From<ErrorTargets> for BTreeMap<String, f64> {
    fn from(targets: ErrorTargets) -> Self {
        let all = targets.all.map(|error| (ALL.to_string(), error));
        targets.named.iter().map(|(q, error)| (q.id().to_string(), *error)).chain(all).collect()
    }
}

impl Display for ErrorTargets {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let percent = |error: f64| match 100.0 * error {
            small if small < 1e-3 => format!("{small:.1e} %"),
            value => format!("{} %", (1e4 * value).round() / 1e4),
        };
        let named = self.named.iter().map(|(q, error)| format!("{} {}", q.name(), percent(*error)));
        f.write_str(&self.all.map(percent).into_iter().chain(named).collect::<Vec<_>>().join(", "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_read_with_their_names() {
        let targets: ErrorTargets = "area=2%, stiffness=0.05,leakage=10 %".parse().expect("errors");
        let of = |q| targets.of(q);
        assert_eq!(
            [of(StatedQuantity::ContactArea), of(StatedQuantity::Stiffness), of(StatedQuantity::MeanGap)],
            [Some(0.02), Some(0.05), None]
        );
        assert_eq!(targets.of(StatedQuantity::Leakage), Some(0.1));
        let maps: ErrorTargets = "5%,gap_map=3%".parse().expect("errors");
        let of_maps = [StatedQuantity::GapMap, StatedQuantity::ContactMap].map(|q| maps.of(q));
        assert!(of_maps == [Some(0.03), None] && maps.has_maps() && !targets.has_maps());
        let json = serde_json::to_value(&targets).expect("numbers");
        assert_eq!(serde_json::from_value::<ErrorTargets>(json).expect("the same"), targets);
        for (text, says) in [
            ("5", "did you mean 5%?"),
            ("500%", "below 100%"),
            ("0", "between 0 and 100%"),
            ("-1", "between 0 and 100%"),
            ("nan", "between 0 and 100%"),
            ("", "an error such as 5%"),
            ("volume=3%", "contact_area, mean_gap"),
            ("stress_map=3%", "no error of the stress map"),
            ("area=2%,area=3%", "one error of area"),
            ("5%,4%", "one error of all"),
        ] {
            let why = text.parse::<ErrorTargets>().expect_err(text);
            assert!(why.contains(says), "{text}: {why}");
        }
    }
}

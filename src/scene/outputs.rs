//! Requested outputs of a run, and the accuracy that can be requested in place of a grid.

use super::quantity::{Fraction, Time, fraction};
use asperity_contact::quantity::Quantity;
use schemars::JsonSchema;
use serde::de::{Deserializer, Error as _, IgnoredAny};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// One quantity to an error or within a time, instead of `surface.grid`, `continuum.method`, `precision` and `tolerance`: the
/// cheapest setting in measured tables is chosen, and outputs that the quantity does not need are left out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AccuracyScene {
    /// Quantity to which the error refers.
    #[serde(deserialize_with = "compared_quantity")]
    pub quantity: Quantity,
    /// Accepted error, as a relative deviation: 0.05 or "5%".
    #[serde(default, deserialize_with = "fraction", skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Fraction>")]
    pub error: Option<f64>,
    /// Wall time instead of an error: the most accurate setting within it is chosen.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub budget: Option<Time>,
    /// Tables of `asperity tradeoff`, relative to the scene file. Default: those that come with the program.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tables: Vec<PathBuf>,
    /// Extrapolate beyond the measured settings.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub extrapolate: bool,
}

/// Outputs of a run besides areas and mean gaps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct RequestedOutputs {
    /// Maps of heights, gaps and stresses.
    pub maps: bool,
    /// Distributions, clusters, percolation.
    pub distributions: bool,
    /// The loads once more on a coarser grid, for methods without nested grids.
    pub grid_error: bool,
    /// The surface's power spectrum and moments.
    pub spectrum: bool,
    /// Contact stiffness of each state.
    pub stiffness: bool,
}

impl RequestedOutputs {
    pub const EVERYTHING: RequestedOutputs =
        RequestedOutputs { maps: true, distributions: true, grid_error: true, spectrum: true, stiffness: true };

    /// Outputs that a quantity needs. The grid error is that of the table by which the setting was chosen.
    pub fn of(quantity: Quantity) -> RequestedOutputs {
        let maps = matches!(quantity, Quantity::GapMap | Quantity::ContactMap);
        let counted = matches!(
            quantity,
            Quantity::GapPdf | Quantity::StressPdf | Quantity::PatchArea | Quantity::MedianClusterArea
        );
        RequestedOutputs {
            maps,
            distributions: counted,
            grid_error: false,
            spectrum: false,
            stiffness: quantity == Quantity::Stiffness,
        }
    }
}

/// A quantity that is compared with references. Any other value, of any type, gives the same message.
fn compared_quantity<'de, D: Deserializer<'de>>(from: D) -> Result<Quantity, D::Error> {
    let given = TextOrOther::deserialize(from)?;
    let quantity = Quantity::COMPARED.into_iter().find(|q| matches!(&given, TextOrOther::Text(t) if t == q.id()));
    quantity.ok_or_else(|| {
        let accepted = Quantity::COMPARED.map(|q| format!("`{}`", q.id())).join(", ");
        D::Error::custom(format!("unknown variant, expected one of {accepted}"))
    })
}

#[derive(Deserialize)]
#[serde(untagged)]
enum TextOrOther {
    Text(String),
    Other(IgnoredAny),
}

#[cfg(test)]
mod tests {
    use crate::scene::Scene;
    use std::path::Path;

    fn parsed(accuracy: &str) -> crate::Result<Scene> {
        let text = format!("name = \"a\"\n[surface]\n[load]\np_star = [0.01]\n[accuracy]\n{accuracy}");
        Scene::parse(&text, Path::new("a.toml"))
    }

    #[test]
    fn an_unknown_quantity_is_one_complaint() {
        let area = "quantity = \"area\"; accepted: \"contact_area\", \"mean_gap\"";
        let number = "quantity = 3; accepted: \"contact_area\", \"mean_gap\"";
        // Outputs of methods that no error is known of.
        let output = "quantity = \"stress_map\"; accepted: \"contact_area\", \"mean_gap\"";
        for (given, begins) in [("\"area\"", area), ("3", number), ("\"stress_map\"", output)] {
            let complaint = parsed(&format!("quantity = {given}\nerror = 0.05\n")).expect_err("refused").to_string();
            assert_eq!(complaint.lines().count(), 1, "{complaint}");
            assert!(complaint.starts_with(&format!("a.toml, line 6: accuracy.{begins}")), "{complaint}");
            assert!(!complaint.contains("accepted: \"contact_area\", \"stress_map\""), "{complaint}");
        }
        let complaint = parsed("error = 0.05\n").expect_err("refused").to_string();
        assert!(complaint.ends_with("accuracy.quantity is missing and has no default"), "{complaint}");
    }

    #[test]
    fn an_error_is_a_fraction_or_a_percentage() {
        for (given, expected) in [("0.05", 0.05), ("\"5%\"", 0.05), ("\"0.05\"", 0.05), ("1", 1.0), ("\" 20 % \"", 0.2)]
        {
            let scene = parsed(&format!("quantity = \"mean_gap\"\nerror = {given}\n")).expect(given);
            let error = scene.accuracy.and_then(|a| a.error).expect("given");
            assert!((error - expected).abs() <= f64::EPSILON, "{given}: {error}");
        }
        for given in ["\"much\"", "true", "[0.05]", "\"5 percent\""] {
            let complaint =
                parsed(&format!("quantity = \"mean_gap\"\nerror = {given}\n")).expect_err(given).to_string();
            let expected = format!("accuracy.error = {given}; accepted: a fraction, as 0.05 or \"5 %\"");
            assert!(complaint.ends_with(&expected) && complaint.lines().count() == 1, "{complaint}");
        }
    }
}

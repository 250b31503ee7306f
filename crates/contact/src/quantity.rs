//! Quantities that methods provide, and quantities that are compared.

use serde::{Deserialize, Serialize};

/// A number, curve or map of a contact. Method cards declare which [`Quantity::OUTPUTS`] they provide; errors against
/// a reference are computed for [`Quantity::COMPARED`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    ContactArea,
    MeanGap,
    Stiffness,
    GapMap,
    ContactMap,
    GapPdf,
    StressPdf,
    /// CPr(a): cumulative distribution of cluster areas.
    ClusterArea,
    MedianClusterArea,
    /// Output only: stresses are compared by their distribution.
    StressMap,
    /// Pr(a): output only, compared as `cluster_area` and `median_cluster_area`.
    ClusterPdf,
}

impl Quantity {
    /// Quantities that a method may provide.
    pub const OUTPUTS: [Quantity; 9] = [
        Quantity::GapMap,
        Quantity::StressMap,
        Quantity::ContactMap,
        Quantity::ClusterPdf,
        Quantity::GapPdf,
        Quantity::StressPdf,
        Quantity::ContactArea,
        Quantity::MeanGap,
        Quantity::Stiffness,
    ];

    /// Quantities that are compared with a reference.
    pub const COMPARED: [Quantity; 9] = [
        Quantity::ContactArea,
        Quantity::MeanGap,
        Quantity::Stiffness,
        Quantity::GapMap,
        Quantity::ContactMap,
        Quantity::GapPdf,
        Quantity::StressPdf,
        Quantity::ClusterArea,
        Quantity::MedianClusterArea,
    ];

    /// Scalars, for which the reference has an extrapolated value.
    pub const NUMBERS: [Quantity; 3] = [Quantity::ContactArea, Quantity::MeanGap, Quantity::Stiffness];

    /// Name in JSON and flags.
    pub fn id(self) -> &'static str {
        match self {
            Quantity::ContactArea => "contact_area",
            Quantity::MeanGap => "mean_gap",
            Quantity::Stiffness => "stiffness",
            Quantity::GapMap => "gap_map",
            Quantity::StressMap => "stress_map",
            Quantity::ContactMap => "contact_map",
            Quantity::GapPdf => "gap_pdf",
            Quantity::StressPdf => "stress_pdf",
            Quantity::ClusterPdf => "cluster_pdf",
            Quantity::ClusterArea => "cluster_area",
            Quantity::MedianClusterArea => "median_cluster_area",
        }
    }

    pub fn name(self) -> &'static str {
        match self {
            Quantity::ContactArea => "contact area",
            Quantity::MeanGap => "mean gap",
            Quantity::Stiffness => "contact stiffness",
            Quantity::GapMap => "gap map",
            Quantity::StressMap => "stress map",
            Quantity::ContactMap => "contact map",
            Quantity::GapPdf => "gap distribution Pr(u)",
            Quantity::StressPdf => "stress distribution Pr(σ)",
            Quantity::ClusterPdf => "cluster areas Pr(a)",
            Quantity::ClusterArea => "cluster areas CPr(a)",
            Quantity::MedianClusterArea => "median cluster area",
        }
    }

    /// Definition of the error of a quantity of [`Quantity::COMPARED`].
    pub fn error_definition(self) -> &'static str {
        match self {
            Quantity::ContactArea => "relative deviation",
            Quantity::MeanGap => "deviation over the mean gap, or over a hundredth of the rms height if that is larger",
            Quantity::Stiffness => "relative deviation",
            Quantity::GapMap => {
                "root mean square difference at the nodes common to both grids, over the same scale as errors of the mean gap"
            }
            Quantity::ContactMap => "one minus the Jaccard index of the contact maps at the nodes common to both grids",
            Quantity::GapPdf => "Wasserstein distance over the same scale as errors of the mean gap",
            Quantity::StressPdf => "Wasserstein distance over E*ḡ",
            Quantity::ClusterArea => "Wasserstein distance in decades of area",
            Quantity::MedianClusterArea => "decades between the areas",
            Quantity::StressMap | Quantity::ClusterPdf => "not compared",
        }
    }

    /// Whether errors are in decades instead of relative deviations.
    pub fn in_decades(self) -> bool {
        matches!(self, Quantity::ClusterArea | Quantity::MedianClusterArea)
    }

    /// The error that corresponds to a relative deviation `fraction`.
    pub fn error_of_deviation(self, fraction: f64) -> f64 {
        if self.in_decades() { (1.0 + fraction).log10() } else { fraction }
    }

    /// The output from which the quantity is computed.
    pub fn output(self) -> Quantity {
        match self {
            Quantity::ClusterArea | Quantity::MedianClusterArea => Quantity::ClusterPdf,
            other => other,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_are_those_of_json_and_outputs_are_delivered() {
        for q in Quantity::COMPARED.into_iter().chain(Quantity::OUTPUTS) {
            assert_eq!(serde_json::to_value(q).expect("a word"), q.id());
            assert!(Quantity::OUTPUTS.contains(&q.output()), "{q:?}");
        }
        let errors = std::collections::BTreeMap::from([(Quantity::GapPdf, 0.25)]);
        assert_eq!(serde_json::to_string(&errors).expect("a map"), "{\"gap_pdf\":0.25}");
    }

    #[test]
    fn deviation_of_a_fifth_is_a_fifth_or_its_decades() {
        assert_eq!(Quantity::MeanGap.error_of_deviation(0.2), 0.2);
        assert!((Quantity::MedianClusterArea.error_of_deviation(0.2) - 1.2f64.log10()).abs() < 1e-15);
    }
}

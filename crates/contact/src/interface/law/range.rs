use super::{AttractionLaw, COHESIVE_RESOLUTION, Law};
use serde::{Deserialize, Serialize};

/// Tabor's parameter (R γ²/(E*² ρ³))^(1/3) of a curvature radius and a range, units of L, and a work of adhesion, E* L:
/// the ratio of the elastic deformation to the range of adhesion (Tabor, J. Colloid Interface Sci. 58 (1977) 2).
pub fn tabor(radius: f64, gamma: f64, rho: f64) -> f64 {
    libm::cbrt(radius) * libm::cbrt(gamma * gamma) / rho
}

/// How the range of the adhesion is chosen for a grid.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum RangeChoice {
    /// The true range, or on a coarser grid the shortest range that does not pin contact lines to the grid.
    #[default]
    Mesh,
    /// The true range on any grid. On too coarse a grid the result depends on the load path.
    True,
    /// As `mesh` on three grids, with the results extrapolated to the true range.
    Extrapolate,
}

impl RangeChoice {
    /// The law used on a grid of spacing `dx`.
    pub fn law(self, requested: AttractionLaw, dx: f64) -> AttractionLaw {
        match self {
            RangeChoice::True => requested,
            RangeChoice::Mesh | RangeChoice::Extrapolate => requested.on_mesh(dx),
        }
    }

    /// A warning if the grid does not resolve the adhesion.
    pub fn resolution_warning(self, requested: AttractionLaw, dx: f64) -> Option<String> {
        let c = requested.resolution_on(dx).filter(|c| *c < COHESIVE_RESOLUTION)?;
        let points = (COHESIVE_RESOLUTION.powi(2) * requested.softening()).ceil();
        let stretch = self.law(requested, dx).range() / requested.range();
        let what = match self {
            RangeChoice::True => {
                "below that, contact lines are pinned to the grid and the result depends on the load path".to_string()
            }
            RangeChoice::Mesh => format!("the range is enlarged {stretch:.2} times, which reaches it"),
            RangeChoice::Extrapolate => {
                format!("the range is enlarged {stretch:.2} times, which reaches it, and the true one extrapolated to")
            }
        };
        Some(format!(
            "the grid does not resolve the adhesion: cohesive resolution {c:.2}, needed {COHESIVE_RESOLUTION} \
             ({points:.0} points per side would do): {what}"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The challenge in SI units: R = 60 nm, γ = 50 mJ/m², E* = 25 MPa, ρ = 2.071 nm give 3.0007; each quantity doubled.
    #[test]
    fn tabors_parameter_has_its_powers() {
        let si = |radius: f64, gamma: f64, modulus: f64, rho: f64| tabor(radius, gamma / modulus, rho);
        let [r, g, e, rho] = [60e-9, 50e-3, 25e6, 2.071e-9];
        assert!((si(r, g, e, rho) - 3.0007).abs() < 5e-5);
        let factors = [si(2.0 * r, g, e, rho), si(r, 2.0 * g, e, rho), si(r, g, 2.0 * e, rho), si(r, g, e, 2.0 * rho)];
        for (actual, power) in factors.iter().zip([1.0 / 3.0, 2.0 / 3.0, -2.0 / 3.0, -1.0]) {
            assert!((actual / si(r, g, e, rho) / 2f64.powf(power) - 1.0).abs() < 1e-14, "{power}");
        }
    }

    /// γ = 2e-5, ρ = 2e-3 on 2 to 40 points per side: the warning has resolution, points and factor.
    #[test]
    fn warnings_state_what_a_grid_lacks() {
        let law = AttractionLaw::exponential(2e-5, 2e-3);
        // ρ/√(γ dx) is 1.4 at dx = 0.102: ten points per side are enough, nine are not.
        assert_eq!(RangeChoice::Mesh.resolution_warning(law, 0.1), None);
        let text = RangeChoice::Mesh.resolution_warning(law, 0.2).expect("too coarse");
        for part in ["resolution 1.00, needed 1.4", "(10 points per side", "enlarged 1.40 times"] {
            assert!(text.contains(part), "{text}");
        }
        assert!(RangeChoice::True.resolution_warning(law, 0.2).is_some_and(|t| t.contains("pinned")));
        assert_eq!(RangeChoice::True.law(law, 0.2), law);
        assert!((RangeChoice::Extrapolate.law(law, 0.2).range() / 2e-3 - 1.4).abs() < 1e-12);
    }
}

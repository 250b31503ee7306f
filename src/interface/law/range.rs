use super::{Adhesion, COHESIVE_RESOLUTION, Law};
use serde::{Deserialize, Serialize};

/// Tabor's parameter (R γ²/(E*² ρ³))^(1/3) of a curvature radius and a range, units of L, and a work of adhesion, E* L:
/// the ratio of the elastic deformation to the range of adhesion (Tabor, J. Colloid Interface Sci. 58 (1977) 2).
pub fn tabor(radius: f64, gamma: f64, rho: f64) -> f64 {
    libm::cbrt(radius) * libm::cbrt(gamma * gamma) / rho
}

/// How the range of the adhesion is chosen for a grid.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema, clap::ValueEnum)]
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
    pub fn law(self, requested: Adhesion, dx: f64) -> Adhesion {
        match self {
            RangeChoice::True => requested,
            RangeChoice::Mesh | RangeChoice::Extrapolate => requested.on_mesh(dx),
        }
    }

    /// A warning if the grid does not resolve the adhesion.
    pub fn resolution_warning(self, requested: Adhesion, dx: f64) -> Option<String> {
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

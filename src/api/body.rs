//! The elastic body.

use asperity_contact::interface::Base;

/// The elastic body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Body {
    /// An isotropic half-space under a periodic surface.
    HalfSpace,
    /// An isotropic layer on a rigid base.
    Layer {
        /// Thickness, in the unit of the surface's length.
        thickness: f64,
        /// Poisson's ratio.
        poisson: f64,
        /// Boundary condition at the base.
        base: Base,
    },
    /// A cubic crystal with an (001) face and x along `[100]`. Only the ratios of the constants matter.
    Cubic {
        /// Elastic constant C11.
        c11: f64,
        /// Elastic constant C12.
        c12: f64,
        /// Elastic constant C44.
        c44: f64,
    },
    /// An isotropic half-space under a surface that is not periodic, free outside of the map.
    NonPeriodic,
}

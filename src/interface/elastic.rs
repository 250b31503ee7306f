use super::cubic::CubicHalfSpace;
use super::kernel::{Base, HalfSpace, Kernel, Layer};
use super::non_periodic::NonPeriodic;

/// Any of the kernels, as selected by a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Elastic {
    HalfSpace,
    Layer(Layer),
    Cubic(CubicHalfSpace),
    NonPeriodic(NonPeriodic),
}

impl Kernel for Elastic {
    #[inline]
    fn stiffness(&self, qx: f64, qy: f64) -> f64 {
        match self {
            Elastic::HalfSpace => HalfSpace.stiffness(qx, qy),
            Elastic::Layer(layer) => layer.stiffness(qx, qy),
            Elastic::Cubic(crystal) => crystal.stiffness(qx, qy),
            Elastic::NonPeriodic(patch) => patch.stiffness(qx, qy),
        }
    }

    // Selected at run time, not by type: solvers are compiled once for all kernels.
    #[inline(always)]
    fn along(&self, qx: f64, first: f64, step: f64, stiffness: &mut [f64]) {
        match self {
            Elastic::HalfSpace => HalfSpace.along(qx, first, step, stiffness),
            Elastic::Layer(layer) => layer.along(qx, first, step, stiffness),
            Elastic::Cubic(crystal) => crystal.along(qx, first, step, stiffness),
            Elastic::NonPeriodic(patch) => patch.along(qx, first, step, stiffness),
        }
    }
}

impl std::fmt::Display for Elastic {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Elastic::HalfSpace => write!(f, "half-space"),
            Elastic::NonPeriodic(_) => write!(f, "half-space, loaded on this area alone (not periodic)"),
            Elastic::Cubic(c) => write!(f, "half-space of a cubic crystal, (001), Zener ratio {:.3}", c.zener),
            Elastic::Layer(l) => {
                let base = match l.base {
                    Base::Bonded => "bonded to a rigid base",
                    Base::ConstantStress => "on a base of constant stress",
                };
                write!(f, "layer {:.4} L thick, ν = {:.3}, {base}", l.thickness, l.poisson)
            }
        }
    }
}

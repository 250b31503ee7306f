use super::cubic::CubicHalfSpace;
use super::kernel::{Base, HalfSpace, Kernel, Layer};
use super::non_periodic::NonPeriodic;
use super::notation::{Notation, Reduced};

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

impl Elastic {
    /// Whether the body repeats with its cell.
    pub fn is_periodic(&self) -> bool {
        !matches!(self, Elastic::NonPeriodic(_))
    }

    /// The body in words, its lengths as `notation` writes them.
    pub fn described(&self, notation: &dyn Notation) -> String {
        match self {
            Elastic::HalfSpace => "half-space".into(),
            Elastic::NonPeriodic(_) => "half-space, loaded on this area alone (not periodic)".into(),
            Elastic::Cubic(c) => format!("half-space of a cubic crystal, (001), Zener ratio {:.3}", c.zener),
            Elastic::Layer(l) => {
                let base = match l.base {
                    Base::Bonded => "bonded to a rigid base",
                    Base::ConstantStress => "on a base of constant stress",
                };
                format!("layer {} thick, ν = {:.3}, {base}", notation.length(l.thickness), l.poisson)
            }
        }
    }
}

impl std::fmt::Display for Elastic {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.described(&Reduced))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Modes of a column one by one, and the whole column.
    #[test]
    fn columns_have_the_stiffness_of_their_modes() {
        let layer = |base| Elastic::Layer(Layer { thickness: 0.1, poisson: 0.3, base });
        let copper = CubicHalfSpace::new(168.4, 121.4, 75.4).expect("stable");
        for body in [
            Elastic::HalfSpace,
            layer(Base::Bonded),
            layer(Base::ConstantStress),
            Elastic::Cubic(copper),
            Elastic::NonPeriodic(NonPeriodic::of_region(1.0, 0.5)),
        ] {
            let mut column = [0.0; 9];
            body.along(3.0, -4.0, 2.5, &mut column);
            let modes: [f64; 9] = std::array::from_fn(|k| body.stiffness(3.0, 2.5 * (k as f64 - 4.0)));
            assert_eq!(column, modes, "{body}");
        }
    }
}

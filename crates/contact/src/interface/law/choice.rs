use super::{
    Dugdale, Exponential, Law, LennardJonesWall, PenaltyWall, PowerLaw93, PowerLawWall, TabulatedLaw, TabulatedWall,
};
use crate::interface::notation::{Notation, Reduced};

/// Adhesion law of a problem.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "copied once for a solve, and evaluated at every node")]
pub enum AttractionLaw {
    None,
    Exponential(Exponential),
    Dugdale(Dugdale),
    PowerLaw93(PowerLaw93),
    Tabulated(TabulatedLaw),
}

/// `$value` of the law, `$none` without adhesion.
macro_rules! of_law {
    ($self:expr, $law:ident => $value:expr, $none:expr) => {
        match $self {
            AttractionLaw::None => $none,
            AttractionLaw::Exponential($law) => $value,
            AttractionLaw::Dugdale($law) => $value,
            AttractionLaw::PowerLaw93($law) => $value,
            AttractionLaw::Tabulated($law) => $value,
        }
    };
}

/// Zero work of adhesion uses the code path without adhesion, with bit-identical results.
impl AttractionLaw {
    pub fn exponential(gamma: f64, rho: f64) -> Self {
        if gamma == 0.0 { AttractionLaw::None } else { AttractionLaw::Exponential(Exponential { gamma, rho }) }
    }

    /// With the taper [`Dugdale::TAPER`].
    pub fn dugdale(gamma: f64, rho: f64) -> Self {
        if gamma == 0.0 { AttractionLaw::None } else { AttractionLaw::Dugdale(Dugdale::new(gamma, rho)) }
    }

    pub fn power_law_93(gamma: f64, rho: f64) -> Self {
        if gamma == 0.0 { AttractionLaw::None } else { AttractionLaw::PowerLaw93(PowerLaw93 { gamma, rho }) }
    }

    /// A law of this shape.
    pub fn tabulated(law: &TabulatedLaw, gamma: f64, rho: f64) -> Self {
        if gamma == 0.0 { AttractionLaw::None } else { AttractionLaw::Tabulated(law.with(gamma, rho)) }
    }

    /// Work of adhesion γ, units of E*·L; zero without adhesion.
    pub fn work_of_adhesion(&self) -> f64 {
        match self {
            AttractionLaw::None => 0.0,
            AttractionLaw::Exponential(a) => a.gamma,
            AttractionLaw::Dugdale(a) => a.gamma,
            AttractionLaw::PowerLaw93(a) => a.gamma,
            AttractionLaw::Tabulated(a) => a.work_of_adhesion(),
        }
    }

    /// Range ρ, units of L; zero without adhesion.
    pub fn range(&self) -> f64 {
        of_law!(self, a => Law::range(a), 0.0)
    }

    /// The law with heights, gaps and stresses in multiples of `unit`, a power of two: `γ/unit²` and `ρ/unit`.
    pub fn in_units(self, unit: f64) -> Self {
        let (gamma, rho) = (self.work_of_adhesion() / unit / unit, self.range() / unit);
        match self {
            AttractionLaw::None => AttractionLaw::None,
            AttractionLaw::Exponential(_) => AttractionLaw::Exponential(Exponential { gamma, rho }),
            AttractionLaw::Dugdale(law) => AttractionLaw::Dugdale(Dugdale { gamma, rho, ..law }),
            AttractionLaw::PowerLaw93(_) => AttractionLaw::PowerLaw93(PowerLaw93 { gamma, rho }),
            AttractionLaw::Tabulated(law) => AttractionLaw::Tabulated(law.with(gamma, rho)),
        }
    }

    /// [`Law::cohesive_resolution`]; `None` without adhesion.
    pub fn resolution_on(&self, dx: f64) -> Option<f64> {
        (*self != AttractionLaw::None).then(|| self.cohesive_resolution(dx))
    }
}

/// Any of the laws, selected node by node at run time.
impl Law for AttractionLaw {
    const ACTIVE: bool = true;
    const HARD: bool = true;

    #[inline]
    fn traction(&self, g: f64) -> f64 {
        of_law!(self, a => a.traction(g), 0.0)
    }

    #[inline]
    fn energy(&self, g: f64) -> f64 {
        of_law!(self, a => a.energy(g), 0.0)
    }

    #[inline]
    fn slope(&self, g: f64) -> f64 {
        of_law!(self, a => a.slope(g), 0.0)
    }

    fn cutoff(&self) -> f64 {
        of_law!(self, a => a.cutoff(), 0.0)
    }

    fn max_slope(&self, lowest: f64) -> f64 {
        of_law!(self, a => a.max_slope(lowest), 0.0)
    }

    fn range(&self) -> f64 {
        AttractionLaw::range(self)
    }

    fn softening(&self) -> f64 {
        of_law!(self, a => a.softening(), 0.0)
    }

    fn on_mesh(&self, dx: f64) -> Self {
        match self {
            AttractionLaw::None => AttractionLaw::None,
            AttractionLaw::Exponential(a) => AttractionLaw::Exponential(a.on_mesh(dx)),
            AttractionLaw::Dugdale(a) => AttractionLaw::Dugdale(a.on_mesh(dx)),
            AttractionLaw::PowerLaw93(a) => AttractionLaw::PowerLaw93(a.on_mesh(dx)),
            AttractionLaw::Tabulated(a) => AttractionLaw::Tabulated(a.on_mesh(dx)),
        }
    }
}

impl AttractionLaw {
    /// The law in words, its work and range as `notation` writes them.
    pub fn described(&self, notation: &dyn Notation) -> String {
        let (gamma, rho) = (notation.work(self.work_of_adhesion()), notation.length(self.range()));
        let name = match self {
            AttractionLaw::None => return "none".into(),
            AttractionLaw::Exponential(_) => "exponential".into(),
            AttractionLaw::Dugdale(a) => format!("Dugdale tapered over ±{} ρ", a.taper),
            AttractionLaw::PowerLaw93(_) => "9-3 power law".into(),
            AttractionLaw::Tabulated(_) => "tabulated".to_string(),
        };
        format!("{name}, γ = {gamma}, ρ = {rho}")
    }
}

impl std::fmt::Display for AttractionLaw {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.described(&Reduced))
    }
}

/// Repulsion of a problem.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "copied once for a solve, and evaluated at every node")]
pub enum Wall {
    Hard,
    LennardJones(LennardJonesWall),
    /// The repulsive branch of [`PowerLaw93`].
    PowerLaw(PowerLawWall),
    Penalty(PenaltyWall),
    Tabulated(TabulatedWall),
}

impl Wall {
    /// The wall with heights, gaps and stresses in multiples of `unit`, a power of two. The compression of a penalty
    /// wall over the pressure has no unit.
    pub fn in_units(self, unit: f64) -> Self {
        match self {
            Wall::Hard => Wall::Hard,
            Wall::LennardJones(w) => Wall::LennardJones(LennardJonesWall { sigma: w.sigma / unit, ..w }),
            Wall::PowerLaw(w) => Wall::PowerLaw(PowerLawWall { gamma: w.gamma / unit / unit, rho: w.rho / unit }),
            Wall::Penalty(w) => Wall::Penalty(w),
            Wall::Tabulated(w) => Wall::Tabulated(w.scaled(unit, 1.0 / unit)),
        }
    }

    /// `None` for the hard wall.
    pub fn soft(self) -> Option<SoftWall> {
        match self {
            Wall::Hard => None,
            Wall::LennardJones(wall) => Some(SoftWall::LennardJones(wall)),
            Wall::PowerLaw(wall) => Some(SoftWall::PowerLaw(wall)),
            Wall::Penalty(wall) => Some(SoftWall::Penalty(wall)),
            Wall::Tabulated(wall) => Some(SoftWall::Tabulated(wall)),
        }
    }
}

impl Wall {
    /// The wall in words, its constants as `notation` writes them.
    pub fn described(&self, notation: &dyn Notation) -> String {
        let length = |over_length| notation.length(over_length);
        match self {
            Wall::Hard => "hard wall".into(),
            Wall::LennardJones(w) => format!("Lennard-Jones wall, σ = {}", length(w.sigma)),
            Wall::PowerLaw(w) => format!("9-3 power-law wall, γ = {}, ρ = {}", notation.work(w.gamma), length(w.rho)),
            Wall::Penalty(w) => format!("penalty wall, ℓ = {}", length(w.length)),
            Wall::Tabulated(w) => format!("wall from a table, E*/10 at a gap of {}", length(w.gap_at_pressure(0.1))),
        }
    }
}

impl std::fmt::Display for Wall {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.described(&Reduced))
    }
}

/// A wall of finite stiffness. It is selected node by node at run time, which costs less than evaluating the wall, so
/// that solvers are compiled once for all soft walls.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "copied once for a solve, and evaluated at every node")]
pub enum SoftWall {
    LennardJones(LennardJonesWall),
    PowerLaw(PowerLawWall),
    Penalty(PenaltyWall),
    Tabulated(TabulatedWall),
}

/// `$value` of the wall.
macro_rules! of_wall {
    ($self:expr, $wall:ident => $value:expr) => {
        match $self {
            SoftWall::LennardJones($wall) => $value,
            SoftWall::PowerLaw($wall) => $value,
            SoftWall::Penalty($wall) => $value,
            SoftWall::Tabulated($wall) => $value,
        }
    };
}

impl Law for SoftWall {
    const ACTIVE: bool = true;
    const HARD: bool = false;

    #[inline]
    fn traction(&self, g: f64) -> f64 {
        of_wall!(self, w => w.traction(g))
    }

    #[inline]
    fn energy(&self, g: f64) -> f64 {
        of_wall!(self, w => w.energy(g))
    }

    #[inline]
    fn slope(&self, g: f64) -> f64 {
        of_wall!(self, w => w.slope(g))
    }

    /// All walls vanish at zero gap.
    fn cutoff(&self) -> f64 {
        0.0
    }

    fn gap_at_pressure(&self, pressure: f64) -> f64 {
        of_wall!(self, w => w.gap_at_pressure(pressure))
    }

    #[inline]
    fn adhesion_floor(&self) -> f64 {
        of_wall!(self, w => w.adhesion_floor())
    }

    fn max_slope(&self, lowest: f64) -> f64 {
        of_wall!(self, w => w.max_slope(lowest))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A gap and a stress in multiples of a unit: the law gives the traction in it, too, to the last bit.
    #[test]
    fn laws_in_other_units_give_the_same_tractions() {
        let unit = 2f64.powi(-40);
        let table = TabulatedLaw::new(9.0, |g| (-g).exp() * (9.0 - g)).expect("a smooth law");
        let laws = [
            AttractionLaw::exponential(0.5, 0.25),
            AttractionLaw::dugdale(0.5, 0.25),
            AttractionLaw::power_law_93(0.5, 0.25),
            AttractionLaw::tabulated(&table, 0.5, 0.25),
        ];
        for law in laws {
            let tiny = law.in_units(1.0 / unit);
            for g in [0.0, 0.1, 0.24, 0.3, 1.0] {
                assert_eq!(tiny.traction(g * unit), law.traction(g) * unit, "{law} at {g}");
                assert_eq!(tiny.slope(g * unit), law.slope(g), "{law} at {g}");
            }
        }
        let table = TabulatedWall::new(0.5, |d| [d * d, 2.0 * d]);
        for wall in [
            Wall::LennardJones(LennardJonesWall { strength: 30.0, sigma: 0.25 }),
            Wall::PowerLaw(PowerLawWall { gamma: 0.5, rho: 0.25 }),
            Wall::Penalty(PenaltyWall { length: 0.5 }),
            Wall::Tabulated(table),
        ] {
            let (law, tiny) = (wall.soft().expect("soft"), wall.in_units(1.0 / unit).soft().expect("soft"));
            for g in [-0.4, -0.05, -0.01, 0.1] {
                assert_eq!(tiny.traction(g * unit), law.traction(g) * unit, "{wall} at {g}");
                assert_eq!(tiny.energy(g * unit), law.energy(g) * unit * unit, "{wall} at {g}");
            }
        }
    }
}

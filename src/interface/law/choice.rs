use super::{Dugdale, Exponential, Law, LennardJonesWall, PenaltyWall, PowerLaw93, PowerLawWall, TabulatedWall};

/// Adhesion law of a problem.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Adhesion {
    None,
    Exponential(Exponential),
    Dugdale(Dugdale),
    PowerLaw93(PowerLaw93),
}

/// `$value` of the law, `$none` without adhesion.
macro_rules! of_law {
    ($self:expr, $law:ident => $value:expr, $none:expr) => {
        match $self {
            Adhesion::None => $none,
            Adhesion::Exponential($law) => $value,
            Adhesion::Dugdale($law) => $value,
            Adhesion::PowerLaw93($law) => $value,
        }
    };
}

/// Zero work of adhesion uses the code path without adhesion, with bit-identical results.
impl Adhesion {
    pub fn exponential(gamma: f64, rho: f64) -> Self {
        if gamma == 0.0 { Adhesion::None } else { Adhesion::Exponential(Exponential { gamma, rho }) }
    }

    /// With the taper [`Dugdale::TAPER`].
    pub fn dugdale(gamma: f64, rho: f64) -> Self {
        if gamma == 0.0 { Adhesion::None } else { Adhesion::Dugdale(Dugdale::new(gamma, rho)) }
    }

    pub fn power_law_93(gamma: f64, rho: f64) -> Self {
        if gamma == 0.0 { Adhesion::None } else { Adhesion::PowerLaw93(PowerLaw93 { gamma, rho }) }
    }

    /// Work of adhesion γ, units of E*·L; zero without adhesion.
    pub fn work_of_adhesion(&self) -> f64 {
        of_law!(self, a => a.gamma, 0.0)
    }

    /// Range ρ, units of L; zero without adhesion.
    pub fn range(&self) -> f64 {
        of_law!(self, a => a.rho, 0.0)
    }

    /// [`Law::cohesive_resolution`]; `None` without adhesion.
    pub fn resolution_on(&self, dx: f64) -> Option<f64> {
        (*self != Adhesion::None).then(|| self.cohesive_resolution(dx))
    }
}

/// Any of the laws, selected node by node at run time.
impl Law for Adhesion {
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
        Adhesion::range(self)
    }

    fn softening(&self) -> f64 {
        of_law!(self, a => a.softening(), 0.0)
    }

    fn on_mesh(&self, dx: f64) -> Self {
        match self {
            Adhesion::None => Adhesion::None,
            Adhesion::Exponential(a) => Adhesion::Exponential(a.on_mesh(dx)),
            Adhesion::Dugdale(a) => Adhesion::Dugdale(a.on_mesh(dx)),
            Adhesion::PowerLaw93(a) => Adhesion::PowerLaw93(a.on_mesh(dx)),
        }
    }
}

impl std::fmt::Display for Adhesion {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (gamma, rho) = (self.work_of_adhesion(), self.range());
        let constants = format_args!("γ = {gamma:.4e} E*L, ρ = {rho:.4e} L").to_string();
        match self {
            Adhesion::None => write!(f, "none"),
            Adhesion::Exponential(_) => write!(f, "exponential, {constants}"),
            Adhesion::Dugdale(a) => write!(f, "Dugdale tapered over ±{} ρ, {constants}", a.taper),
            Adhesion::PowerLaw93(_) => write!(f, "9-3 power law, {constants}"),
        }
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

impl std::fmt::Display for Wall {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Wall::Hard => write!(f, "hard wall"),
            Wall::LennardJones(w) => write!(f, "Lennard-Jones wall, σ = {:.4e} L", w.sigma),
            Wall::PowerLaw(w) => write!(f, "9-3 power-law wall, γ = {:.4e} E*L, ρ = {:.4e} L", w.gamma, w.rho),
            Wall::Penalty(w) => write!(f, "penalty wall, ℓ = {:.4e} L", w.length),
            Wall::Tabulated(w) => write!(f, "wall from a table, E*/10 at a gap of {:.4e} L", w.gap_at_pressure(0.1)),
        }
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

impl Law for SoftWall {
    const ACTIVE: bool = true;
    const HARD: bool = false;

    #[inline]
    fn traction(&self, g: f64) -> f64 {
        match self {
            SoftWall::LennardJones(w) => w.traction(g),
            SoftWall::PowerLaw(w) => w.traction(g),
            SoftWall::Penalty(w) => w.traction(g),
            SoftWall::Tabulated(w) => w.traction(g),
        }
    }

    #[inline]
    fn energy(&self, g: f64) -> f64 {
        match self {
            SoftWall::LennardJones(w) => w.energy(g),
            SoftWall::PowerLaw(w) => w.energy(g),
            SoftWall::Penalty(w) => w.energy(g),
            SoftWall::Tabulated(w) => w.energy(g),
        }
    }

    #[inline]
    fn slope(&self, g: f64) -> f64 {
        match self {
            SoftWall::LennardJones(w) => w.slope(g),
            SoftWall::PowerLaw(w) => w.slope(g),
            SoftWall::Penalty(w) => w.slope(g),
            SoftWall::Tabulated(w) => w.slope(g),
        }
    }

    /// All walls vanish at zero gap.
    fn cutoff(&self) -> f64 {
        0.0
    }

    fn gap_at_pressure(&self, pressure: f64) -> f64 {
        match self {
            SoftWall::LennardJones(w) => w.gap_at_pressure(pressure),
            SoftWall::PowerLaw(w) => w.gap_at_pressure(pressure),
            SoftWall::Penalty(w) => w.gap_at_pressure(pressure),
            SoftWall::Tabulated(w) => w.gap_at_pressure(pressure),
        }
    }

    #[inline]
    fn adhesion_floor(&self) -> f64 {
        match self {
            SoftWall::LennardJones(w) => w.adhesion_floor(),
            SoftWall::PowerLaw(w) => w.adhesion_floor(),
            SoftWall::Penalty(w) => w.adhesion_floor(),
            SoftWall::Tabulated(w) => w.adhesion_floor(),
        }
    }

    fn max_slope(&self, lowest: f64) -> f64 {
        match self {
            SoftWall::LennardJones(w) => w.max_slope(lowest),
            SoftWall::PowerLaw(w) => w.max_slope(lowest),
            SoftWall::Penalty(w) => w.max_slope(lowest),
            SoftWall::Tabulated(w) => w.max_slope(lowest),
        }
    }
}

//! Traction between the surfaces as a function of the gap between them.
//!
//! Laws are type parameters of the solvers, so a scene without adhesion has no overhead. Gaps and ranges are in units
//! of L, tractions in E*, energies per area in E*·L.

use super::hardness::NodalHardness;

mod choice;
mod dugdale;
mod exponential;
mod hardness;
mod lennard_jones;
mod penalty;
mod power_law;
mod range;
mod tabulated;
mod tabulated_adhesion;

pub use choice::{AttractionLaw, SoftWall, Wall};
pub use dugdale::Dugdale;
pub use exponential::Exponential;
pub use hardness::{Yielding, YieldingWall};
pub use lennard_jones::LennardJonesWall;
pub use penalty::PenaltyWall;
pub use power_law::{PowerLaw93, PowerLawWall};
pub use range::{RangeChoice, tabor};
pub use tabulated::TabulatedWall;
pub use tabulated_adhesion::TabulatedLaw;

/// An interaction energy `v(g)` per area and its traction `dv/dg`: attraction is positive.
pub trait Law: Copy + Sync + Send {
    /// False if the traction is zero at all admissible gaps; solvers then do not evaluate the law.
    const ACTIVE: bool;
    /// Whether gaps are bounded below by zero. A soft wall has no bound.
    const HARD: bool;
    /// Whether the interfacial stress may be bounded by a hardness.
    const YIELDS: bool = false;

    /// Traction at gap `g`, attraction positive (negative where a compliant wall repels).
    fn traction(&self, g: f64) -> f64;

    /// Interaction energy per area.
    fn energy(&self, g: f64) -> f64;

    /// Slope of the traction, `dt/dg`: negative where attraction decreases with the gap, positive where a compliant
    /// wall repels.
    fn slope(&self, g: f64) -> f64;

    /// Gap at which the wall's repulsion equals `pressure`: zero for a hard wall.
    fn gap_at_pressure(&self, _pressure: f64) -> f64 {
        0.0
    }

    /// Gap below which an attraction combined with this wall stays constant. An exponentially growing attraction
    /// would otherwise overcome a wall whose repulsion is linear in the depth.
    fn adhesion_floor(&self) -> f64 {
        f64::NEG_INFINITY
    }

    /// Range ρ of the attraction; 0 without any.
    fn range(&self) -> f64 {
        0.0
    }

    /// Largest contact stress of the nodes, units of E*, without the attraction: the hardness plus the attraction at contact, infinite
    /// without a hardness.
    #[inline(always)]
    fn hardness(&self) -> NodalHardness<'_> {
        NodalHardness::NONE
    }

    /// Gap at and below which the contact stress is the hardness, L.
    fn yield_gap(&self) -> f64 {
        f64::NEG_INFINITY
    }

    /// Mean pressure (E*) above which no state is in equilibrium: every node carries its largest contact stress less the attraction.
    fn max_pressure(&self) -> f64 {
        match self.hardness().mean() {
            hardness if hardness < f64::INFINITY => {
                let repulsion = if Self::HARD { hardness } else { 0.0 };
                repulsion - self.traction(self.yield_gap())
            }
            _ => f64::INFINITY,
        }
    }

    /// Gap from which on traction, energy and slope are exactly zero.
    fn cutoff(&self) -> f64 {
        f64::INFINITY
    }

    /// Upper bound of `|slope|` over the gaps from `lowest` on.
    fn max_slope(&self, lowest: f64) -> f64;

    /// Upper bound of `|slope|` over the gaps at which the wall's repulsion is at most `pressure` (units of E*).
    fn max_slope_at_pressure(&self, pressure: f64) -> f64 {
        self.max_slope(self.gap_at_pressure(pressure))
    }

    /// Largest `-slope` over non-negative gaps, E*/L: the steepest decrease of the attraction. Zero without
    /// attraction.
    fn softening(&self) -> f64 {
        0.0
    }

    /// Cohesive resolution `1/√(dx · softening/E*)` of the adhesion on a mesh of spacing `dx`, to be compared with
    /// [`COHESIVE_RESOLUTION`]. For the exponential law this is `ρ/√(γ dx/E*)`.
    fn cohesive_resolution(&self, dx: f64) -> f64 {
        1.0 / (dx * self.softening()).sqrt()
    }

    /// The law with the same γ and a range enlarged, if necessary, until the cohesive resolution on a mesh of spacing
    /// `dx` is at least [`COHESIVE_RESOLUTION`]: contact lines are then not pinned to the mesh.
    fn on_mesh(&self, _dx: f64) -> Self {
        *self
    }

    /// This wall together with an attraction: a hardness bounds the sum of both.
    fn under<A: Law>(self, _attraction: &A) -> Self {
        self
    }

    /// The law with the hardness of the nodes of another grid of the same area.
    fn on_nodes(&self, _nx: usize, _ny: usize) -> Self {
        *self
    }
}

/// Cohesive resolution above which contact lines are not pinned to the grid. Below it, the attraction of a node can
/// decrease faster with the gap than the stiffest wave restores the node, which then has two equilibria. On the
/// challenge's surface at p* = 0.01 with the exponential law, areas on different load paths differ by several per
/// cent at 1.0, and by 0.1 % at 1.4. With strong adhesion or at small loads, surfaces have several branches on any
/// grid.
pub const COHESIVE_RESOLUTION: f64 = 1.4;

/// Range of a law of the form `(γ/ρ) f(g/ρ)` on a mesh of spacing `dx`; `steepness` is its softening over `γ/ρ²`.
fn range_on_mesh(gamma: f64, rho: f64, steepness: f64, dx: f64) -> f64 {
    rho.max(COHESIVE_RESOLUTION * (steepness * gamma * dx).sqrt())
}

/// Gap between `lowest` and zero at which the repulsion of a soft wall equals `pressure`, by bisection: it decreases
/// monotonically with the gap.
fn bisect_gap(wall: &impl Law, pressure: f64, lowest: f64) -> f64 {
    let (mut low, mut high) = (lowest, 0.0);
    // Sixty bisections reach the precision of f64.
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if -wall.traction(middle) > pressure { low = middle } else { high = middle }
    }
    high
}

/// Impenetrable at zero gap, no adhesion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HardWall;

impl Law for HardWall {
    const ACTIVE: bool = false;
    const HARD: bool = true;

    fn traction(&self, _: f64) -> f64 {
        0.0
    }

    fn energy(&self, _: f64) -> f64 {
        0.0
    }

    fn slope(&self, _: f64) -> f64 {
        0.0
    }

    fn cutoff(&self) -> f64 {
        0.0
    }

    fn max_slope(&self, _: f64) -> f64 {
        0.0
    }
}

/// A wall and an adhesion law acting together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WithAdhesion<W, A> {
    pub wall: W,
    pub adhesion: A,
}

impl<W: Law, A: Law> Law for WithAdhesion<W, A> {
    const ACTIVE: bool = W::ACTIVE || A::ACTIVE;
    const HARD: bool = W::HARD;
    const YIELDS: bool = W::YIELDS;

    #[inline]
    fn traction(&self, g: f64) -> f64 {
        self.wall.traction(g) + self.adhesion.traction(g.max(self.wall.adhesion_floor()))
    }

    fn energy(&self, g: f64) -> f64 {
        let end = self.wall.adhesion_floor();
        let beyond = if g < end { self.adhesion.traction(end) * (g - end) } else { 0.0 };
        self.wall.energy(g) + self.adhesion.energy(g.max(end)) + beyond
    }

    fn slope(&self, g: f64) -> f64 {
        self.wall.slope(g) + if g < self.wall.adhesion_floor() { 0.0 } else { self.adhesion.slope(g) }
    }

    fn gap_at_pressure(&self, pressure: f64) -> f64 {
        self.wall.gap_at_pressure(pressure)
    }

    fn cutoff(&self) -> f64 {
        self.wall.cutoff().max(self.adhesion.cutoff())
    }

    fn max_slope(&self, lowest: f64) -> f64 {
        // Behind a soft wall the attraction may be steeper than at zero gap.
        self.wall.max_slope(lowest) + self.adhesion.max_slope(lowest.max(self.wall.adhesion_floor()))
    }

    fn range(&self) -> f64 {
        self.adhesion.range()
    }

    fn softening(&self) -> f64 {
        self.adhesion.softening()
    }

    #[inline(always)]
    fn hardness(&self) -> NodalHardness<'_> {
        self.wall.hardness()
    }

    fn yield_gap(&self) -> f64 {
        self.wall.yield_gap()
    }

    fn on_mesh(&self, dx: f64) -> Self {
        Self::new(self.wall.on_mesh(dx), self.adhesion.on_mesh(dx))
    }
}

impl<W: Law, A: Law> WithAdhesion<W, A> {
    pub fn new(wall: W, adhesion: A) -> Self {
        WithAdhesion { wall: wall.under(&adhesion), adhesion }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn derivatives_agree(law: impl Law, gaps: &[f64]) {
        /// Central differences with a relative step of 1e-5: second-order error about 1e-9, rounding about 1e-10.
        const TOLERANCE: f64 = 1e-6;
        for &g in gaps {
            let step = 1e-5 * g.abs().max(1e-3);
            let traction = (law.energy(g + step) - law.energy(g - step)) / (2.0 * step);
            let slope = (law.traction(g + step) - law.traction(g - step)) / (2.0 * step);
            // Attraction is positive: it is the slope of the energy with the gap.
            assert!((traction - law.traction(g)).abs() <= TOLERANCE * law.traction(g).abs().max(1e-9), "t at {g}");
            assert!((slope - law.slope(g)).abs() <= TOLERANCE * law.slope(g).abs().max(1e-9), "slope at {g}");
        }
    }

    const GAMMA: f64 = 2e-5;
    const RHO: f64 = 2e-2;

    fn power_law_wall() -> PowerLawWall {
        PowerLawWall { gamma: GAMMA, rho: RHO }
    }

    fn power_law() -> PowerLaw93 {
        PowerLaw93 { gamma: GAMMA, rho: RHO }
    }

    fn tabulated() -> TabulatedLaw {
        TabulatedLaw::new(20.0 * RHO, |g| power_law().traction(g) * (-g / RHO).exp()).expect("a smooth law")
    }

    fn table() -> TabulatedWall {
        TabulatedWall::new(0.1, |d| [400.0 * d * d + 3e3 * d.powi(3), 800.0 * d + 9e3 * d * d])
    }

    #[test]
    fn tractions_are_derivatives_of_energies() {
        let adhesion = Exponential { gamma: GAMMA, rho: RHO };
        derivatives_agree(adhesion, &[0.0, 0.01, 0.05, 0.2, -0.15, -0.3]);
        let wall = LennardJonesWall { strength: 30.0, sigma: 0.3 };
        derivatives_agree(wall, &[-0.2, -0.1, -0.03, -0.005, 0.01, -0.3]);
        derivatives_agree(WithAdhesion { wall, adhesion }, &[-0.05, 0.02]);
        for taper in [0.1, Dugdale::TAPER, 1.0] {
            let dugdale = Dugdale { taper, ..Dugdale::new(GAMMA, RHO) };
            let across = [-0.9, -0.5, 0.1, 0.7].map(|u: f64| RHO * (1.0 + u * taper));
            derivatives_agree(dugdale, &across);
            derivatives_agree(dugdale, &[-0.01, -0.001, 0.07]);
        }
        derivatives_agree(power_law(), &[1e-3, 0.003, 0.01, 0.05, 1.0, -0.01]);
        // Within the first intervals, too.
        derivatives_agree(tabulated(), &[1e-5, 1e-3, 0.0143, 0.1, 0.39, 1.0, -0.01]);
        // Below the floor at half the range, too.
        derivatives_agree(power_law_wall(), &[-1e-3, -0.005, -0.009, -0.012, -0.05, 0.01]);
        derivatives_agree(
            WithAdhesion { wall: power_law_wall(), adhesion: power_law() },
            &[-0.003, -1e-4, 1e-4, 0.003],
        );
        let stiff = PenaltyWall { length: 1e-3 };
        derivatives_agree(stiff, &[-0.1, -1e-3, 0.02]);
        // Between its nodes and beyond the last.
        derivatives_agree(table(), &[-1e-3, -0.0143, -0.07, -0.2, 0.01]);
        let soft = [
            SoftWall::LennardJones(wall),
            SoftWall::PowerLaw(power_law_wall()),
            SoftWall::Penalty(stiff),
            SoftWall::Tabulated(table()),
        ];
        for wall in soft {
            derivatives_agree(WithAdhesion { wall, adhesion: Dugdale::new(GAMMA, RHO) }, &[-0.007, 0.018, 0.022]);
            derivatives_agree(WithAdhesion { wall, adhesion }, &[-0.007, 0.018, 0.022]);
        }
    }

    /// No attraction, however strong and short, pulls the bodies through a wall: deep below the surface every wall wins, and the deeper the more.
    #[test]
    fn walls_win_over_any_attraction() {
        let walls = [
            SoftWall::LennardJones(LennardJonesWall { strength: 30.0, sigma: 0.3 }),
            SoftWall::PowerLaw(power_law_wall()),
            SoftWall::Penalty(PenaltyWall { length: 1e-3 }),
            SoftWall::Tabulated(table()),
        ];
        for (gamma, rho) in [(GAMMA, RHO), (100.0 * GAMMA, RHO), (GAMMA, 1e-3 * RHO)] {
            for wall in walls {
                let adhesion = Exponential { gamma, rho };
                let law = WithAdhesion { wall, adhesion };
                let floor = wall.adhesion_floor();
                assert!(floor.is_finite() && floor <= 0.0, "{wall:?}");
                // Where the wall carries the attraction at its floor.
                let balance = wall.gap_at_pressure(adhesion.traction(floor)).min(floor);
                for times in [1.001, 1.5, 3.0, 100.0] {
                    let g = times * balance - 1e-9;
                    assert!(law.traction(g) < 0.0, "{wall:?} {gamma} {rho} {g}: {}", law.traction(g));
                    assert!(law.energy(2.0 * g) > law.energy(g), "{wall:?} {gamma} {rho} {g}");
                }
            }
        }
    }

    /// γ is the work of separation from zero gap: the integral of the traction, and minus the energy at zero gap.
    fn work_of_separation_is_gamma(law: impl Law) {
        /// Two-point Gauss-Legendre quadrature on intervals that grow by a factor of 1.001. The error, 2e-9, is at
        /// the ends of a narrow taper.
        const GROWTH: f64 = 1e-3;
        const TOLERANCE: f64 = 1e-8;
        let node = 1.0 / 3f64.sqrt();
        let (mut work, mut g) = (0.0, 0.0);
        // Beyond this gap the tail of the slowest law, 1/g³, contributes (ρ/g)² of γ.
        while g < 1e6 * RHO {
            let half = 0.5 * GROWTH * (0.1 * RHO + g);
            work += half * [-node, node].map(|x| law.traction(g + half * (1.0 + x))).iter().sum::<f64>();
            g += 2.0 * half;
        }
        assert!((work / GAMMA - 1.0).abs() < TOLERANCE, "{work}");
        assert!((law.energy(0.0) / GAMMA + 1.0).abs() < 1e-15, "{}", law.energy(0.0));
        assert!(law.energy(1e9 * RHO).abs() < 1e-15 * GAMMA);
    }

    #[test]
    fn work_of_separation_is_the_work_of_adhesion() {
        work_of_separation_is_gamma(Exponential { gamma: GAMMA, rho: RHO });
        for taper in [0.05, Dugdale::TAPER, 1.0] {
            work_of_separation_is_gamma(Dugdale { taper, ..Dugdale::new(GAMMA, RHO) });
        }
        work_of_separation_is_gamma(power_law());
    }

    /// Slopes on a scan of gaps are within their bounds, and the softening is attained.
    fn bounds_hold(law: impl Law, lowest: f64) {
        const POINTS: i32 = 20_000;
        let scan = |from: f64| (0..=POINTS).map(move |i| from + (4.0 * RHO - from) * f64::from(i) / f64::from(POINTS));
        let softest = scan(0.0).map(|g| -law.slope(g)).fold(0.0, f64::max);
        assert!(softest <= law.softening() * (1.0 + 1e-14), "{softest} {}", law.softening());
        // The scan passes the top of a parabola within a step.
        assert!(softest >= law.softening() * (1.0 - 1e-6), "{softest} {}", law.softening());
        let steepest = scan(lowest).map(|g| law.slope(g).abs()).fold(0.0, f64::max);
        assert!(steepest <= law.max_slope(lowest) * (1.0 + 1e-14), "{steepest} {}", law.max_slope(lowest));
    }

    #[test]
    fn slope_bounds_hold_and_are_tight() {
        let adhesion = Exponential { gamma: GAMMA, rho: RHO };
        let walls = [
            SoftWall::LennardJones(LennardJonesWall { strength: 30.0, sigma: 0.3 }),
            SoftWall::PowerLaw(power_law_wall()),
            SoftWall::Penalty(PenaltyWall { length: 1e-3 }),
            SoftWall::Tabulated(table()),
        ];
        for lowest in [-0.3, -0.01, 0.0, 0.01] {
            bounds_hold(adhesion, lowest);
            bounds_hold(Dugdale::new(GAMMA, RHO), lowest);
            bounds_hold(power_law(), lowest);
            for wall in walls {
                bounds_hold(wall, lowest);
                bounds_hold(WithAdhesion { wall, adhesion }, lowest);
                bounds_hold(WithAdhesion { wall, adhesion: power_law() }, lowest);
            }
        }
    }

    /// Below the floors of the walls, too.
    #[test]
    fn gap_at_pressure_inverts_the_traction() {
        let power = SoftWall::PowerLaw(power_law_wall());
        // The floor of the 9-3 wall is at 1344 γ/ρ.
        for stress in [1.0, 1e2, 1.3e3, 1.4e3, 1e5].map(|s| s * GAMMA / RHO) {
            for wall in [power, SoftWall::Penalty(PenaltyWall { length: 1e-3 })] {
                let pressure = -wall.traction(wall.gap_at_pressure(stress));
                assert!((pressure / stress - 1.0).abs() < 1e-9, "{wall:?} at {stress}: {pressure}");
            }
        }
    }

    /// An exponential attraction without a floor would overcome a repulsion that is linear in the depth.
    #[test]
    fn penalty_walls_balance_every_attraction() {
        let wall = SoftWall::Penalty(PenaltyWall { length: 0.1 });
        let law = WithAdhesion { wall, adhesion: Exponential { gamma: 1e-2, rho: 1e-2 } };
        assert!((1..1000).all(|i| law.slope(-1e-3 * f64::from(i)) > 0.0));
        assert!(law.energy(-10.0) > 0.0);
    }

    /// Müser et al. (2017): largest tension 1.0264 γ/ρ at 3^(1/6) ρ from the singularity; 16 γ/ρ² at zero force.
    #[test]
    fn power_law_has_the_published_constants() {
        let law = power_law();
        let largest = law.traction((3f64.powf(1.0 / 6.0) - 1.0) * RHO);
        assert!((largest * RHO / GAMMA - 1.0264).abs() < 5e-5, "{largest}");
        assert!(law.slope((3f64.powf(1.0 / 6.0) - 1.0) * RHO).abs() < 1e-12 * law.slope(0.0));
        assert_eq!(law.traction(0.0), 0.0);
        assert!((law.slope(0.0) * RHO * RHO / GAMMA - 16.0).abs() < 1e-12);
        assert!((law.softening() * RHO * RHO / GAMMA - 1.253).abs() < 5e-4);
        // The wall's slope just below zero gap bounds that from zero on, where trial states may step below.
        let wall = power_law_wall();
        assert!((wall.max_slope(0.0) / wall.slope(-1e-9 * RHO) - 1.0).abs() < 1e-6, "{}", wall.max_slope(0.0));
    }

    #[test]
    fn on_mesh_enlarges_the_range_to_the_cohesive_resolution() {
        fn check(law: impl Law + std::fmt::Debug + PartialEq) {
            for dx in [0.1, 1.0, 10.0, 100.0] {
                let stretched = law.on_mesh(dx);
                let (c, resolution) = (stretched.cohesive_resolution(dx), law.cohesive_resolution(dx));
                assert!(
                    (c / resolution.max(COHESIVE_RESOLUTION) - 1.0).abs() < 1e-14,
                    "{law:?} {stretched:?}: {c} {resolution}"
                );
                assert_eq!(stretched == law, resolution >= COHESIVE_RESOLUTION);
                assert_eq!(stretched.energy(0.0), law.energy(0.0));
            }
        }
        check(Exponential { gamma: GAMMA, rho: RHO });
        // Bit-identical.
        let stretched = Exponential { gamma: GAMMA, rho: RHO }.on_mesh(100.0);
        assert_eq!(stretched.rho, COHESIVE_RESOLUTION * (GAMMA * 100.0).sqrt());
        check(Dugdale::new(GAMMA, RHO));
        check(power_law());
        // Without attraction every mesh resolves the law.
        assert_eq!(HardWall.cohesive_resolution(1.0), f64::INFINITY);
        assert_eq!(AttractionLaw::None.resolution_on(1.0), None);
    }

    /// For every law, zero work of adhesion equals no adhesion.
    #[test]
    fn names_of_laws_and_no_law_without_work_of_adhesion() {
        let makers = [AttractionLaw::exponential, AttractionLaw::dugdale, AttractionLaw::power_law_93];
        for make in makers {
            assert_eq!(make(0.0, RHO), AttractionLaw::None);
            let adhesion = make(GAMMA, RHO);
            assert_eq!((adhesion.work_of_adhesion(), adhesion.range()), (GAMMA, RHO));
            assert!(adhesion.to_string().ends_with("γ = 2e-5 E*L, ρ = 2e-2 L"), "{adhesion}");
        }
        assert!(AttractionLaw::dugdale(GAMMA, RHO).to_string().starts_with("Dugdale tapered over ±0.25 ρ"));
        assert_eq!(Wall::Penalty(PenaltyWall { length: 0.5 }).to_string(), "penalty wall, ℓ = 5e-1 L");
    }

    /// For any rounding of σ, the law is finite and continuous at the end of its distance table.
    #[test]
    fn the_wall_has_no_hole_at_its_floor() {
        for k in 0..2000 {
            let wall = LennardJonesWall { strength: 30.0, sigma: 0.01 + 1e-5 * f64::from(k) };
            let floor_gap = wall.floor() - wall.minimum();
            let (above, below) = (wall.traction(floor_gap * (1.0 - 1e-9)), wall.traction(floor_gap * (1.0 + 1e-9)));
            assert!((above / below - 1.0).abs() < 1e-6 && wall.energy(floor_gap).is_finite());
        }
    }

    /// σ = 3.5927 Å, ε = 0.2145 eV, wall spacing a0·5/11, fcc(100) with a0 = 5.5884 Å: about 5 GPa at 3.66 Å.
    #[test]
    fn the_calcium_wall_at_five_gigapascal() {
        let (a0, epsilon, gpa) = (5.5884, 0.2145, 160.2176634);
        let spacing: f64 = a0 * 5.0 / 11.0;
        // Å as unit of length, GPa as unit of stress.
        let wall =
            LennardJonesWall { strength: 2.0 * PI / spacing.powi(2) * 2.0 / (a0 * a0) * epsilon * gpa, sigma: 3.5927 };
        let pressure = -wall.traction(3.66 - wall.minimum());
        assert!((pressure - 4.9).abs() < 0.1, "{pressure}");
        assert_eq!(wall.traction(0.0), 0.0);
    }
}

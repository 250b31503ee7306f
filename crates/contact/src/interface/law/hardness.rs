use super::{Law, NodalHardness, SoftWall};

/// A hard wall, with or without the attraction `law`, at which the interfacial stress is at most the hardness: where it
/// reaches it, the body flows. The gap of a load step is then negative by the depth of that flow.
///
/// What loads the body is the contact stress less the attraction, so that its flow does not depend on the range of the attraction. The
/// contact stress is bounded by the hardness plus the attraction at contact: with `H` this sum, the contact energy `H max(0, -g)` is
/// convex, and its slope at zero gap takes every value from `-H` to 0 (Almqvist, Sahlin, Larsson & Glavatskih, Tribology International 40
/// (2007) 574). Solvers add the stress of the flow themselves; the attraction is constant below zero gap.
#[derive(Debug, Clone, Copy)]
pub struct Yielding<'m, L> {
    pub law: L,
    /// Largest interfacial stress.
    pub hardness: NodalHardness<'m>,
}

impl<L: Law> Law for Yielding<'_, L> {
    const ACTIVE: bool = L::ACTIVE;
    const HARD: bool = true;
    const YIELDS: bool = true;

    #[inline(always)]
    fn traction(&self, g: f64) -> f64 {
        self.law.traction(g.max(0.0))
    }

    #[inline(always)]
    fn energy(&self, g: f64) -> f64 {
        let below = if g < 0.0 { self.law.traction(0.0) * g } else { 0.0 };
        self.law.energy(g.max(0.0)) + below
    }

    #[inline(always)]
    fn slope(&self, g: f64) -> f64 {
        if g < 0.0 { 0.0 } else { self.law.slope(g) }
    }

    fn range(&self) -> f64 {
        self.law.range()
    }

    fn cutoff(&self) -> f64 {
        self.law.cutoff()
    }

    fn max_slope(&self, lowest: f64) -> f64 {
        self.law.max_slope(lowest.max(0.0))
    }

    fn softening(&self) -> f64 {
        self.law.softening()
    }

    fn on_mesh(&self, dx: f64) -> Self {
        Yielding { law: self.law.on_mesh(dx), ..*self }
    }

    fn on_nodes(&self, nx: usize, ny: usize) -> Self {
        Yielding { hardness: self.hardness.on_nodes(nx, ny), ..*self }
    }

    #[inline(always)]
    fn hardness(&self) -> NodalHardness<'_> {
        self.hardness.raised(self.law.traction(0.0))
    }

    fn yield_gap(&self) -> f64 {
        0.0
    }
}

/// A soft wall whose repulsion, less an attraction, is at most the hardness (units of E*, infinite without one). Beyond the gap at which it
/// reaches it, the body flows at constant stress.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct YieldingWall {
    wall: SoftWall,
    /// Largest interfacial stress.
    hardness: f64,
    /// Largest repulsion, E*: the hardness and the attraction at `gap`.
    repulsion: f64,
    /// Gap at which the repulsion reaches it, L; `-∞` without one.
    gap: f64,
}

impl YieldingWall {
    pub fn new(wall: SoftWall, hardness: Option<f64>) -> Self {
        let gap = hardness.map_or(f64::NEG_INFINITY, |h| wall.gap_at_pressure(h));
        let hardness = hardness.unwrap_or(f64::INFINITY);
        YieldingWall { wall, hardness, repulsion: hardness, gap }
    }
}

impl Law for YieldingWall {
    const ACTIVE: bool = true;
    const HARD: bool = false;
    const YIELDS: bool = true;

    #[inline]
    fn traction(&self, g: f64) -> f64 {
        self.wall.traction(g.max(self.gap))
    }

    #[inline]
    fn energy(&self, g: f64) -> f64 {
        let below = if g < self.gap { self.wall.traction(self.gap) * (g - self.gap) } else { 0.0 };
        self.wall.energy(g.max(self.gap)) + below
    }

    #[inline]
    fn slope(&self, g: f64) -> f64 {
        if g < self.gap { 0.0 } else { self.wall.slope(g) }
    }

    fn cutoff(&self) -> f64 {
        self.wall.cutoff()
    }

    fn gap_at_pressure(&self, pressure: f64) -> f64 {
        self.wall.gap_at_pressure(pressure.min(self.repulsion))
    }

    #[inline]
    fn adhesion_floor(&self) -> f64 {
        self.wall.adhesion_floor().max(self.gap)
    }

    fn max_slope(&self, lowest: f64) -> f64 {
        self.wall.max_slope(lowest.max(self.gap))
    }

    #[inline(always)]
    fn hardness(&self) -> NodalHardness<'_> {
        NodalHardness::Uniform(self.repulsion)
    }

    fn yield_gap(&self) -> f64 {
        self.gap
    }

    /// The repulsion and the attraction at the gap of first flow balance the hardness. The iteration rises to that repulsion; it is
    /// accurate to rounding after a few steps, since the wall is much steeper than the attraction.
    fn under<A: Law>(self, attraction: &A) -> Self {
        const STEPS: usize = 60;
        if self.hardness == f64::INFINITY {
            return self;
        }
        let mut wall = YieldingWall::new(self.wall, Some(self.hardness));
        for _ in 0..STEPS {
            let repulsion = self.hardness + attraction.traction(wall.gap.max(self.wall.adhesion_floor()));
            if repulsion == wall.repulsion {
                break;
            }
            wall = YieldingWall { repulsion, gap: self.wall.gap_at_pressure(repulsion), ..wall };
        }
        wall
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Exponential, HardWall, LennardJonesWall, PenaltyWall, WithAdhesion};
    use super::*;

    const WALL: SoftWall = SoftWall::LennardJones(LennardJonesWall { strength: 30.0, sigma: 0.01 });

    /// Traction is the slope of the energy, above and below the gap of first flow, where it is constant.
    #[test]
    fn stress_is_bounded_by_the_hardness() {
        /// Error of a central difference of this step.
        const STEP: f64 = 1e-8;
        const TOLERANCE: f64 = 1e-6;
        let wall = YieldingWall::new(WALL, Some(0.2));
        let gap = wall.yield_gap();
        assert!((wall.traction(gap) + 0.2).abs() < 1e-12 && gap < 0.0);
        assert_eq!((wall.traction(3.0 * gap), wall.slope(3.0 * gap)), (wall.traction(gap), 0.0));
        // No work is done between two points on either side of the gap of first flow.
        let [above, below] = [1.0 - STEP, 1.0 + STEP].map(|part| wall.energy(part * gap));
        assert!((above / below - 1.0).abs() < TOLERANCE, "{above} {below}");
        let hard = Yielding { law: Exponential { gamma: 1e-4, rho: 1e-3 }, hardness: 0.2.into() };
        assert_eq!(hard.traction(-1.0), 0.1);
        for g in [3.0 * gap, 1.5 * gap, 0.5 * gap, 1e-3] {
            for (energy, traction) in [
                (wall.energy(g + STEP) - wall.energy(g - STEP), wall.traction(g)),
                (hard.energy(g + STEP) - hard.energy(g - STEP), hard.traction(g)),
            ] {
                assert!((energy / (2.0 * STEP) - traction).abs() < TOLERANCE, "{g}: {energy} {traction}");
            }
        }
    }

    /// Without a hardness the wall is the soft wall, to the last bit.
    #[test]
    fn without_hardness_the_wall_is_the_soft_wall() {
        let wall = YieldingWall::new(WALL, None);
        for g in [-0.009, -0.003, -1e-4, 0.0, 0.1] {
            assert_eq!(
                (wall.traction(g), wall.energy(g), wall.slope(g)),
                (WALL.traction(g), WALL.energy(g), WALL.slope(g))
            );
        }
        assert_eq!(Yielding { law: HardWall, hardness: 0.1.into() }.max_pressure(), 0.1);
        assert_eq!(HardWall.max_pressure(), f64::INFINITY);
        let adhesion = Exponential { gamma: 1e-4, rho: 1e-3 };
        assert!((Yielding { law: adhesion, hardness: 0.2.into() }.max_pressure() - 0.2).abs() < 1e-15);
    }

    /// The net stress of the flow is the hardness for every range of the attraction, with a hard wall and with soft ones.
    #[test]
    fn flow_stress_does_not_depend_on_the_range() {
        /// Rounding of the gap of the soft walls, times their slope.
        const ROUNDING: f64 = 1e-9;
        let soft = [WALL, SoftWall::Penalty(PenaltyWall { length: 1e-3 })];
        for rho in [1e-3, 4e-3, 2e-2] {
            let adhesion = Exponential { gamma: 1e-4, rho };
            let hard = Yielding { law: adhesion, hardness: 0.2.into() };
            // Where the body flows: the largest contact stress less the attraction.
            let net = hard.hardness().mean() - hard.traction(-1.0);
            assert!((net - 0.2).abs() < 1e-15 && (hard.max_pressure() - 0.2).abs() < 1e-15, "{rho}: {net}");
            for wall in soft {
                let both = WithAdhesion::new(YieldingWall::new(wall, Some(0.2)), adhesion);
                for depth in [1.0, 1.5, 3.0] {
                    let net = -both.traction(depth * both.yield_gap());
                    assert!((net - 0.2).abs() < ROUNDING, "{rho}, {wall:?}: {net}");
                }
                assert!((both.max_pressure() - 0.2).abs() < ROUNDING);
                // On a coarser mesh the range is larger, and the flow stress the same.
                let coarse = both.on_mesh(4.0);
                assert!(coarse.range() > rho && (-coarse.traction(2.0 * coarse.yield_gap()) - 0.2).abs() < ROUNDING);
            }
        }
    }
}

use super::{Law, bisect_gap};

/// Nodes of a table.
const NODES: usize = 65;

/// A wall with pressure and slope tabulated at equal steps of the depth: cubic Hermite interpolation between them,
/// zero for gaps from 0 on, linear extrapolation beyond the last node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TabulatedWall {
    /// Spacing of the nodes, units of L.
    step: f64,
    /// At the depths 0, 1, … steps: pressure, its slope times a step (both units of E*), and the energy over a step
    /// times E*.
    nodes: [[f64; 3]; NODES],
}

impl TabulatedWall {
    /// `law` gives the pressure (units of E*) and its slope along the depth (E*/L) at a depth up to `deepest` (units
    /// of L); the pressure increases with the depth from zero at zero.
    pub fn new(deepest: f64, mut law: impl FnMut(f64) -> [f64; 2]) -> Self {
        let step = deepest / (NODES - 1) as f64;
        let mut nodes = [[0.0; 3]; NODES];
        for k in 1..NODES {
            let [pressure, slope] = law(k as f64 * step);
            nodes[k] = [pressure, slope * step, 0.0];
            nodes[k][2] = nodes[k - 1][2] + cubic(&nodes[k - 1], &nodes[k], 1.0)[2];
        }
        TabulatedWall { step, nodes }
    }

    /// The law with pressure `pressure` P(`depth` g) at the gap g, where this one has P(g).
    pub fn scaled(&self, depth: f64, pressure: f64) -> Self {
        let step = self.step / depth;
        TabulatedWall { step, nodes: self.nodes.map(|node| node.map(|v| v * pressure)) }
    }

    /// Depth of the last node.
    fn deepest(&self) -> f64 {
        (NODES - 1) as f64 * self.step
    }

    /// Pressure, its slope and its integral along the depth at a depth above zero, in steps.
    #[inline]
    fn at(&self, depth: f64) -> [f64; 3] {
        let x = depth / self.step;
        let k = x as usize;
        if k < NODES - 1 {
            let [p, slope, energy] = cubic(&self.nodes[k], &self.nodes[k + 1], x - k as f64);
            return [p, slope, self.nodes[k][2] + energy];
        }
        let ([p, slope, energy], x) = (self.nodes[NODES - 1], x - (NODES - 1) as f64);
        [p + slope * x, slope, energy + x * (p + 0.5 * slope * x)]
    }
}

/// Value, slope and integral at `t` of the cubic with the values and slopes `a` at 0 and `b` at 1.
#[inline]
pub(super) fn cubic(a: &[f64; 3], b: &[f64; 3], t: f64) -> [f64; 3] {
    let rise = b[0] - a[0];
    let (c2, c3) = (3.0 * rise - 2.0 * a[1] - b[1], a[1] + b[1] - 2.0 * rise);
    [
        a[0] + t * (a[1] + t * (c2 + t * c3)),
        a[1] + t * (2.0 * c2 + 3.0 * t * c3),
        t * (a[0] + t * (a[1] / 2.0 + t * (c2 / 3.0 + t * c3 / 4.0))),
    ]
}

impl Law for TabulatedWall {
    const ACTIVE: bool = true;
    const HARD: bool = false;

    #[inline]
    fn traction(&self, g: f64) -> f64 {
        if g >= 0.0 { 0.0 } else { -self.at(-g)[0] }
    }

    fn energy(&self, g: f64) -> f64 {
        if g >= 0.0 { 0.0 } else { self.at(-g)[2] * self.step }
    }

    fn slope(&self, g: f64) -> f64 {
        if g >= 0.0 { 0.0 } else { self.at(-g)[1] / self.step }
    }

    fn gap_at_pressure(&self, pressure: f64) -> f64 {
        let [last, slope, _] = self.nodes[NODES - 1];
        let beyond = ((pressure - last) / slope * self.step).max(0.0);
        if beyond > 0.0 { -self.deepest() - beyond } else { bisect_gap(self, pressure, -self.deepest()) }
    }

    /// The depth to which the law is known.
    fn adhesion_floor(&self) -> f64 {
        -self.deepest()
    }

    fn max_slope(&self, lowest: f64) -> f64 {
        let upto = ((-lowest / self.step).ceil().max(0.0) as usize).min(NODES - 1);
        let bound = |pair: &[[f64; 3]]| pair[0][1].max(pair[1][1]).max(1.5 * (pair[1][0] - pair[0][0]));
        self.nodes[..=upto].windows(2).map(bound).fold(0.0, f64::max) / self.step
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interface::LennardJonesWall;

    /// Interpolation error, of fourth order in the step.
    const BETWEEN_NODES: f64 = 1e-5;

    #[test]
    fn a_tabulated_law_equals_the_law() {
        let law = LennardJonesWall { strength: 30.0, sigma: 0.01 };
        let deepest = 0.003;
        let table = TabulatedWall::new(deepest, |d| [-law.traction(-d), law.slope(-d)]);
        for k in 0..1000 {
            let g = 1e-4 - 3.1e-3 * f64::from(k) / 999.0;
            if g > -deepest {
                for (a, b, largest) in [
                    (table.traction(g), law.traction(g), law.traction(-deepest)),
                    (table.energy(g), law.energy(g), law.energy(-deepest)),
                    (table.slope(g), law.slope(g), law.slope(-deepest)),
                ] {
                    assert!(((a - b) / largest).abs() < BETWEEN_NODES, "{g}: {a} {b}");
                }
            }
            assert!(table.slope(g) <= table.max_slope(g) * (1.0 + 1e-12), "{g}");
        }
        let pressure = 0.5 * -law.traction(-deepest);
        assert!((table.gap_at_pressure(pressure) / law.gap_at_pressure(pressure) - 1.0).abs() < BETWEEN_NODES);
    }

    #[test]
    fn pressure_is_extrapolated_linearly_beyond_the_last_node() {
        let table = TabulatedWall::new(0.5, |d| [d * d, 2.0 * d]);
        for (g, p, energy) in [(-0.5, 0.25, 0.125 / 3.0), (-0.7, 0.45, 0.125 / 3.0 + 0.5 * (0.25 + 0.45) * 0.2)] {
            assert!((table.traction(g) + p).abs() < 1e-14 && (table.energy(g) - energy).abs() < 1e-14, "{g}");
            assert!((table.gap_at_pressure(p) - g).abs() < 1e-12, "{g}");
        }
        assert_eq!((table.slope(-0.7), table.traction(0.1), table.energy(0.0)), (1.0, 0.0, 0.0));
    }
}

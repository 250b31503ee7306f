//! Contact of a continuum solution under the criteria that make it comparable with atoms.

use super::overlap;
use crate::atoms::wall::Wall;
use crate::grid::{Field, Grid, bilinear};
use crate::record::results::CriterionMatch;

/// The surface sites of the block on a continuum grid, and the same after a shift that destroys all registry.
pub struct Sites {
    grid: Grid,
    positions: Vec<[f64; 2]>,
    nodes: Vec<usize>,
    shifted: Vec<usize>,
}

impl Sites {
    /// `sites` are lattice positions over the block's edge, in [0, 1).
    pub fn new(grid: Grid, sites: impl Iterator<Item = [f64; 2]>) -> Self {
        let node = |x: f64, y: f64| {
            let (i, j) = ((x / grid.dx()).round() as usize % grid.nx, (y / grid.dy()).round() as usize % grid.ny);
            j * grid.nx + i
        };
        let positions: Vec<[f64; 2]> = sites.collect();
        let (nodes, shifted) =
            positions.iter().map(|&[x, y]| (node(x, y), node((x + 1.0 / 3.0).fract(), (y + 0.2).fract()))).unzip();
        Sites { grid, positions, nodes, shifted }
    }

    /// Values of a field at the sites, between its nodes.
    pub fn sample(&self, field: Field) -> Vec<f64> {
        self.positions.iter().map(|&[x, y]| bilinear(self.grid, |n| field.at(n), x, y)).collect()
    }

    /// Which sites a gap field touches. Read at the nearest node: between a touching node and an open one no gap is zero,
    /// and interpolation would take the edge from every contact.
    pub fn touching(&self, gap: Field, threshold: f64) -> Vec<bool> {
        self.nodes.iter().map(|&n| gap.at(n) <= threshold).collect()
    }

    /// The continuum's contact (gap of at most `threshold`) against the atoms' at the same sites.
    pub fn judge(&self, gap: Field, threshold: f64, atoms: &[bool], describe: Criteria, length: f64) -> CriterionMatch {
        let here = self.touching(gap, threshold);
        let shifted: Vec<bool> = self.shifted.iter().map(|&n| gap.at(n) <= threshold).collect();
        let threshold_angstrom = threshold * length;
        CriterionMatch {
            id: describe.id().into(),
            criterion: describe.words(threshold_angstrom),
            threshold_angstrom,
            contact_fraction: here.iter().filter(|c| **c).count() as f64 / here.len() as f64,
            overlap: overlap(&here, atoms),
            shifted: overlap(&shifted, atoms),
        }
    }
}

/// The ways in which a continuum node counts as touching.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Criteria {
    /// Hard wall, zero gap.
    Plain,
    /// Hard wall, gap below what the atoms' wall yields at the mean contact stress.
    Threshold,
    /// The wall's own areal law, gap at which an atom is as likely as not to be within the contact distance.
    SoftWall,
}

impl Criteria {
    pub fn id(self) -> &'static str {
        match self {
            Criteria::Plain => "plain",
            Criteria::Threshold => "threshold",
            Criteria::SoftWall => "soft wall",
        }
    }

    fn words(self, threshold_angstrom: f64) -> String {
        match self {
            Criteria::Plain => "hard wall, zero gap".into(),
            Criteria::Threshold => format!("hard wall, gap below {threshold_angstrom:.3} Å"),
            Criteria::SoftWall => {
                format!("soft wall, gap below {threshold_angstrom:.3} Å (even odds of an indenter atom within d_c)")
            }
        }
    }
}

/// Gap below which a hard-wall solution counts as touched by atoms, Å.
///
/// A Lennard-Jones wall that carries the stress σ has been pressed in by `r_m - d(σ)`, so the bodies stand that much closer
/// than a hard wall would let them, and points with a smaller hard-wall gap touch as well. The stress is the mean over
/// what touches, which makes the threshold self-consistent: `pressure` (eV/Å³) over `fraction(threshold)`. Touching means
/// an indenter atom within the contact distance `d_c` (Å), which at random registry has even odds only at a plane distance `d_½`
/// below `r_m`: that part of the approach brings no contact. Nothing in it is fitted to the atoms.
pub fn softness_threshold(wall: &Wall, d_c: f64, pressure: f64, fraction: impl Fn(f64) -> f64) -> f64 {
    let even_odds = wall.distance_at_touch_probability(0.5, d_c);
    // A larger threshold has a larger area, hence less stress and less approach: one crossing.
    let (mut low, mut high) = (0.0, even_odds);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        let touching = fraction(middle);
        let approach = if touching > 0.0 { even_odds - wall.distance_at_pressure(pressure / touching) } else { high };
        if approach > middle { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::atoms::wall::CONTACT_DISTANCE_ANGSTROM;

    /// Where the area does not depend on the threshold, the threshold is the wall's approach at that stress.
    #[test]
    fn threshold_of_a_flat_punch() {
        let wall = Wall::new(5.5884 * 5.0 / 11.0, 5.5884).unwrap();
        let even_odds = wall.distance_at_touch_probability(0.5, CONTACT_DISTANCE_ANGSTROM);
        let (pressure, fraction) = (3e-3, 0.1);
        let found = softness_threshold(&wall, CONTACT_DISTANCE_ANGSTROM, pressure, |_| fraction);
        assert!((found - (even_odds - wall.distance_at_pressure(pressure / fraction))).abs() < 1e-9);
        // A stress that does not press the wall past even odds brings no further contact.
        assert!(softness_threshold(&wall, CONTACT_DISTANCE_ANGSTROM, 1e-9, |_| fraction) < 1e-9);
    }

    /// Contact is read at the nearest node, values between nodes; the shifted map is the map shifted by (1/3, 1/5).
    #[test]
    fn sites_read_contact_at_nodes_and_values_between() {
        let grid = Grid::unit(30, 30);
        let gap: Vec<f64> = (0..900).map(f64::from).collect();
        let sites = Sites::new(grid, [[0.0, 0.0], [0.99, 0.5], [0.51 / 30.0, 0.0]].into_iter());
        assert_eq!(sites.nodes, [0, 15 * 30, 1]);
        assert_eq!(sites.touching(Field::F64(&gap), 0.5), [true, false, false]);
        let values = sites.sample(Field::F64(&gap));
        for (found, exact) in values.iter().zip([0.0, 450.0 + 0.3 * 29.0, 0.51]) {
            assert!((found - exact).abs() < 1e-9, "{values:?}");
        }
        assert_eq!(sites.shifted[0], 6 * 30 + 10);
    }
}

//! Contact of a continuum solution at the atoms' surface sites, by several criteria.

use super::{MISALIGNMENT, overlap};
use crate::record::results::CriterionMatch;
use asperity_atoms::wall::LatticeWall;
use asperity_grid::{Field, Grid, bilinear, bisect};

/// The surface sites of the block on a continuum grid, and a permutation of them by [`MISALIGNMENT`].
pub struct SitesOnGrid {
    grid: Grid,
    positions: Vec<[f64; 2]>,
    nodes: Vec<usize>,
    shifted: Vec<usize>,
}

impl SitesOnGrid {
    /// `sites`: site positions over the length of the block along x, in the cell of the grid. `nearest(x, y)`: index of
    /// the site nearest to a position.
    pub fn new(grid: Grid, sites: impl Iterator<Item = [f64; 2]>, nearest: impl Fn(f64, f64) -> usize) -> Self {
        let node = |x: f64, y: f64| {
            let (i, j) = ((x / grid.dx()).round() as usize % grid.nx, (y / grid.dy()).round() as usize % grid.ny);
            j * grid.nx + i
        };
        let positions: Vec<[f64; 2]> = sites.collect();
        let [dx, dy] = MISALIGNMENT.map(|n| 1.0 / n as f64);
        let shift = |x: f64, y: f64| nearest((x + dx * grid.lx) % grid.lx, (y + dy * grid.ly) % grid.ly);
        let (nodes, shifted) = positions.iter().map(|&[x, y]| (node(x, y), shift(x, y))).unzip();
        SitesOnGrid { grid, positions, nodes, shifted }
    }

    /// Site positions over the length of the block.
    pub fn positions(&self) -> &[[f64; 2]] {
        &self.positions
    }

    /// Values of a field at the sites, by bilinear interpolation.
    pub fn sample(&self, field: Field) -> Vec<f64> {
        self.positions.iter().map(|&[x, y]| bilinear(self.grid, |n| field.at(n), x, y)).collect()
    }

    /// Contact at the sites, by the gap of the nearest node. Interpolated gaps are positive next to open nodes, which
    /// would remove the edge of every contact.
    pub fn touching(&self, gap: Field, threshold: f64) -> Vec<bool> {
        self.nodes.iter().map(|&n| gap.at(n) <= threshold).collect()
    }

    /// Site-by-site comparison of continuum contact `here` with the contact of `atoms`. `map`: file name of the contact
    /// map.
    pub fn compare(
        &self,
        here: &[bool],
        atoms: &[bool],
        criterion: SiteCriterion,
        map: Option<String>,
    ) -> CriterionMatch {
        let shifted: Vec<bool> = self.shifted.iter().map(|&site| here[site]).collect();
        CriterionMatch {
            id: criterion.id().into(),
            criterion: criterion.label(),
            offset_angstrom: criterion.offset_angstrom(),
            contact_area: here.iter().filter(|c| **c).count() as f64 / here.len() as f64,
            overlap: overlap(here, atoms),
            shifted: overlap(&shifted, atoms),
            map,
        }
    }
}

/// Contact criterion at a surface site of the continuum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SiteCriterion {
    /// Hard wall, zero gap.
    HardWall,
    /// Hard wall, with the atoms shifted by the wall's compression under the mean contact pressure, Å: contact if an
    /// indenter atom is within the contact distance.
    OffsetWall(f64),
    /// Compliant wall: areal repulsion with the compliance of single atoms. Atoms are placed on its solution; contact
    /// if an indenter atom is within the contact distance.
    CompliantWall,
    /// Compliant wall with a hardness, by the same criterion.
    YieldingWall,
}

impl SiteCriterion {
    pub fn id(self) -> &'static str {
        match self {
            SiteCriterion::HardWall => "hard_wall",
            SiteCriterion::OffsetWall(_) => "offset_wall",
            SiteCriterion::CompliantWall => "compliant_wall",
            SiteCriterion::YieldingWall => "yielding_wall",
        }
    }

    /// Å.
    pub fn offset_angstrom(self) -> f64 {
        if let SiteCriterion::OffsetWall(by) = self { by } else { 0.0 }
    }

    pub fn label(self) -> String {
        match self {
            SiteCriterion::HardWall => "hard wall, zero gap".into(),
            SiteCriterion::OffsetWall(by) => format!("offset wall, shifted by {by:.3} Å, within d_c of the atoms"),
            SiteCriterion::CompliantWall => "compliant wall, within d_c of the atoms".into(),
            SiteCriterion::YieldingWall => "compliant wall with hardness, within d_c of the atoms".into(),
        }
    }
}

/// Shift of atoms placed on a hard-wall solution, Å.
///
/// Under the stress σ a Lennard-Jones wall is compressed by `r_m - d(σ)`, so that the bodies are closer by this
/// distance than with a hard wall. The stress is the mean over the contact, `pressure` (eV/Å³) over `fraction(shift)`,
/// which makes the shift self-consistent. It has no parameter fitted to the atoms.
pub fn wall_offset(wall: &LatticeWall, pressure: f64, fraction: impl Fn(f64) -> f64) -> f64 {
    let largest = wall.minimum_angstrom();
    // A larger shift gives more contact, a lower stress and less compression: there is one solution.
    let approaches = |shift: f64| match fraction(shift) {
        touching if touching > 0.0 => largest - wall.distance_at_pressure(pressure / touching) > shift,
        // Without contact the bodies are not that close yet: the end of the interval lies above its middle.
        _ => true,
    };
    // The upper end: where the contact appears at once the shift is the one with it.
    bisect(0.0, largest, 40, approaches).1
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_atoms::repulsion::Repulsion;

    /// For a contact area independent of the shift, the shift is the compression of the wall at that stress.
    #[test]
    fn rise_of_a_flat_punch() {
        let wall = LatticeWall::new(Repulsion::CHALLENGE, 5.5884 * 5.0 / 11.0, 5.5884).unwrap();
        let (pressure, fraction) = (3e-3, 0.1);
        let actual = wall_offset(&wall, pressure, |_| fraction);
        assert!((actual - (wall.minimum_angstrom() - wall.distance_at_pressure(pressure / fraction))).abs() < 1e-9);
        assert!(wall_offset(&wall, 1e-12, |_| fraction) < 1e-3);
        // The first atom touches from a shift of 0.3 Å on, and carries less than presses the wall so far: it is in contact.
        let touches = |shift: f64| if shift >= 0.3 { fraction } else { 0.0 };
        let at_jump = wall_offset(&wall, 1e-6, touches);
        assert!((at_jump - 0.3).abs() < 1e-9 && touches(at_jump) == fraction, "{at_jump}");
    }

    /// Contact is that of the nearest node, values are interpolated, and the shift is (1/3, 1/5).
    #[test]
    fn sites_read_contact_at_nodes_and_values_between() {
        let grid = Grid::unit(30, 30);
        let gap: Vec<f64> = (0..900).map(f64::from).collect();
        let list = [[0.0, 0.0], [0.99, 0.5], [0.51 / 30.0, 0.0], [1.0 / 3.0, 0.2]];
        // The first site is shifted to the last, and the second across the periodic boundary to the third.
        let is_at = |x: f64, y: f64, [a, b]: [f64; 2]| (x - a).abs() < 1e-9 && (y - b).abs() < 1e-9;
        let nearest = |x: f64, y: f64| match (is_at(x, y, list[3]), is_at(x, y, [0.99 - 2.0 / 3.0, 0.7])) {
            (true, _) => 3,
            (_, true) => 2,
            _ => 1,
        };
        let sites = SitesOnGrid::new(grid, list.into_iter(), nearest);
        assert_eq!(sites.nodes, [0, 15 * 30, 1, 6 * 30 + 10]);
        assert_eq!(sites.touching(Field::F64(&gap), 0.5), [true, false, false, false]);
        assert_eq!(sites.touching(Field::F64(&gap), 1.0), [true, false, true, false]);
        let values = sites.sample(Field::F64(&gap));
        for (actual, exact) in values.iter().zip([0.0, 450.0 + 0.3 * 29.0, 0.51]) {
            assert!((actual - exact).abs() < 1e-9, "{values:?}");
        }
        assert_eq!(sites.shifted, [3, 2, 1, 1]);
        let agreement = sites.compare(
            &[true, false, false, true],
            &[true, false, false, false],
            SiteCriterion::OffsetWall(0.3),
            None,
        );
        assert_eq!((agreement.contact_area, agreement.overlap.jaccard, agreement.offset_angstrom), (0.5, 0.5, 0.3));
        assert_eq!(agreement.shifted.jaccard, 1.0);
    }
}

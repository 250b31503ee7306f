//! Contact of a continuum solution under the criteria that make it comparable with atoms.

use super::overlap;
use crate::atoms::wall::{CONTACT_DISTANCE_ANGSTROM, Wall};
use crate::grid::{Field, Grid};
use crate::record::results::CriterionMatch;

/// Nodes of a grid nearest to the surface sites of the block, and the same after a shift that destroys all registry.
pub struct Sites {
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
        let (nodes, shifted) =
            sites.map(|[x, y]| (node(x, y), node((x + 1.0 / 3.0).fract(), (y + 0.2).fract()))).unzip();
        Sites { nodes, shifted }
    }

    /// Values of a field at the sites.
    pub fn sample(&self, field: Field) -> Vec<f64> {
        self.nodes.iter().map(|&n| field.at(n)).collect()
    }

    /// The continuum's contact (gap of at most `threshold`) against the atoms' at the same sites.
    pub fn judge(&self, gap: Field, threshold: f64, atoms: &[bool], describe: Criteria, length: f64) -> CriterionMatch {
        let at = |nodes: &[usize]| nodes.iter().map(|&n| gap.at(n) <= threshold).collect::<Vec<bool>>();
        let (here, shifted) = (at(&self.nodes), at(&self.shifted));
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
/// A Lennard-Jones wall that carries the mean contact stress `pressure` (eV/Å³) has been pressed in by
/// `r_m - d(pressure)`, so the bodies stand that much closer than a hard wall would let them, and points with a smaller
/// hard-wall gap touch as well. Touching means an indenter atom within the contact distance, which at random registry
/// happens with even odds only at a plane distance `d_½` below `r_m`: that part of the approach brings no contact.
pub fn softness_threshold(wall: &Wall, pressure: f64) -> f64 {
    let even_odds = wall.distance_at_touch_probability(0.5, CONTACT_DISTANCE_ANGSTROM);
    (even_odds - wall.distance_at_pressure(pressure)).max(0.0)
}

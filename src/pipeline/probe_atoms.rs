//! Virtual surface atoms on a continuum solution: which of them are in contact by the atoms' distance criterion.

use crate::Result;
use crate::compare::{SitesOnGrid, wall_offset};
use crate::scene::{AtomsCase, Case};
use asperity_atoms::compliant_wall::CompliantWall;
use asperity_atoms::contact::clearance;
use asperity_atoms::indenter::Indenter;
use asperity_atoms::wall::LatticeWall;
use asperity_grid::{Field, Grid, bilinear};

pub(super) struct ProbeAtoms<'a> {
    sites: &'a SitesOnGrid,
    wall: &'a LatticeWall,
    compliant_wall: CompliantWall,
    indenter: Indenter,
    /// Position of each site's atom at zero gap, Å, in the order of [`Profile`]: for the atoms' own heights and for the
    /// dilated heights. The indenter is at its initial position.
    closed: [Vec<[f64; 3]>; 2],
    length: f64,
}

/// Heights of a continuum solution: the atoms' own, or these dilated by a ball of radius r_m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Profile {
    Own,
    Dilated,
}

impl<'a> ProbeAtoms<'a> {
    /// `sites`: surface sites of the block on the comparison grid.
    pub(super) fn new(case: &Case, atoms: &'a AtomsCase, sites: &'a SitesOnGrid) -> Result<Self> {
        let (touch, length) = (atoms.wall.minimum_angstrom(), atoms.block.length());
        let heights = atoms.heights_angstrom(case.surface(), Grid::unit(atoms.points, atoms.points));
        let indenter = Indenter::above(&atoms.block, atoms.points, heights, touch)?;
        let fine = atoms.heights_angstrom(case.surface(), atoms.matched);
        // Each profile has its zero at its own lowest node.
        let base = indenter.start_z() + indenter.heights()[0] - fine[0] - touch;
        let under = |profile: &[f64]| -> Vec<[f64; 3]> {
            let z = |x: f64, y: f64| base + bilinear(atoms.matched, |k| profile[k], x, y);
            sites.positions().iter().map(|&[x, y]| [x * length, y * length, z(x, y)]).collect()
        };
        let closed = [under(&fine), under(&atoms.dilated_heights_angstrom(case.surface()))];
        Ok(ProbeAtoms { sites, wall: &atoms.wall, compliant_wall: atoms.compliant_wall(), indenter, closed, length })
    }

    /// Distance by which each site's atom can rise until an indenter atom is at `distance`, Å. The surface is at the
    /// `gap` (units of L) of a continuum solution with this profile.
    pub(super) fn clearances(&self, (profile, gap): (Profile, Field), distance: f64) -> Vec<f64> {
        let gaps = self.sites.sample(gap);
        let below = |([x, y, z], gap): (&[f64; 3], f64)| [*x, *y, z - gap * self.length];
        let closed = &self.closed[profile as usize];
        closed.iter().zip(gaps).map(|p| clearance(below(p), &self.indenter, distance)).collect()
    }

    /// Self-consistent rise of atoms on a hard wall under the mean pressure `effective_pressure` (eV/Å³), Å; see
    /// [`wall_offset`]. `clearances`: those of the atoms, Å.
    pub(super) fn rise(&self, clearances: &[f64], effective_pressure: f64) -> f64 {
        let mut sorted = clearances.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        wall_offset(self.wall, effective_pressure, |by| {
            sorted.partition_point(|c| *c <= by) as f64 / sorted.len() as f64
        })
    }

    /// Height of each site's atom above the mean surface without a force on it, Å, at the `gap` (units of L).
    pub(super) fn unpressed(&self, gap: Field) -> Vec<f64> {
        self.sites.sample(gap).into_iter().map(|gap| self.compliant_wall.rise(gap * self.length)).collect()
    }
}

/// Which atoms are in contact after each site's atom is raised by `raised(site)`, Å.
pub(super) fn within(clearances: &[f64], raised: impl Fn(usize) -> f64) -> Vec<bool> {
    clearances.iter().enumerate().map(|(k, c)| *c <= raised(k)).collect()
}

pub(super) fn share(touching: &[bool]) -> f64 {
    touching.iter().filter(|t| **t).count() as f64 / touching.len() as f64
}

/// File name of the contact map of a criterion at a load.
pub(super) fn map_name(load: usize, id: &str) -> String {
    format!("load-{load}-{}.npy", id.replace(' ', "-"))
}

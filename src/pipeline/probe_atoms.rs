//! Surface atoms put where a continuum has the surface: what they would touch if they were there.

use crate::Result;
use crate::atoms::compliant_wall::CompliantWall;
use crate::atoms::contact::clearance;
use crate::atoms::indenter::Indenter;
use crate::atoms::wall::Wall;
use crate::compare::{Sites, wall_offset};
use crate::grid::{Field, Grid, bilinear};
use crate::scene::{AtomsCase, Case};

pub(super) struct ProbeAtoms<'a> {
    sites: &'a Sites,
    wall: &'a Wall,
    giving: CompliantWall,
    indenter: Indenter,
    /// Where the atom of each site stands at zero gap under the heights, and under what a ball feels of them, Å; the indenter
    /// as at the start.
    closed: [Vec<[f64; 3]>; 2],
    length: f64,
}

/// The heights that a continuum was solved on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Profile {
    Own,
    Dilated,
}

impl<'a> ProbeAtoms<'a> {
    /// `sites` are those of the block's surface on the grid of the comparison.
    pub fn new(case: &Case, atoms: &'a AtomsCase, sites: &'a Sites) -> Result<Self> {
        let (touch, length) = (atoms.wall.minimum_angstrom(), atoms.block.length());
        let heights = atoms.heights_angstrom(&case.surface, Grid::unit(atoms.points, atoms.points));
        let indenter = Indenter::above(&atoms.block, atoms.points, heights, touch)?;
        let fine = atoms.heights_angstrom(&case.surface, atoms.matched);
        // Both profiles are shifted to the lowest of their own nodes.
        let base = indenter.start_z() + indenter.heights()[0] - fine[0] - touch;
        let under = |profile: &[f64]| -> Vec<[f64; 3]> {
            let z = |x: f64, y: f64| base + bilinear(atoms.matched, |k| profile[k], x, y);
            sites.positions().iter().map(|&[x, y]| [x * length, y * length, z(x, y)]).collect()
        };
        let closed = [under(&fine), under(&atoms.dilated_heights_angstrom(&case.surface))];
        Ok(ProbeAtoms { sites, wall: &atoms.wall, giving: atoms.compliant_wall(), indenter, closed, length })
    }

    /// How far the atom of each site could rise before one of the indenter's is at `distance`, Å, with the surface where the
    /// `gap` (units of L) over that profile has it.
    pub fn clearances(&self, (profile, gap): (Profile, Field), distance: f64) -> Vec<f64> {
        let gaps = self.sites.sample(gap);
        let below = |([x, y, z], gap): (&[f64; 3], f64)| [*x, *y, z - gap * self.length];
        let closed = &self.closed[profile as usize];
        closed.iter().zip(gaps).map(|p| clearance(below(p), &self.indenter, distance)).collect()
    }

    /// How far atoms on a hard wall are to be raised under the mean pressure `effective_pressure` (eV/Å³), Å; from their clearances.
    pub fn rise(&self, clearances: &[f64], effective_pressure: f64) -> f64 {
        let mut sorted = clearances.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        wall_offset(self.wall, effective_pressure, |by| {
            sorted.partition_point(|c| *c <= by) as f64 / sorted.len() as f64
        })
    }

    /// How far the atom of each site stands above the surface if nothing presses on it, Å, at the `gap` (units of L).
    pub fn unpressed(&self, gap: Field) -> Vec<f64> {
        self.sites.sample(gap).into_iter().map(|gap| self.giving.rise(gap * self.length)).collect()
    }
}

/// Which atoms touch once each is raised.
pub(super) fn within(clearances: &[f64], raised: impl Fn(usize) -> f64) -> Vec<bool> {
    clearances.iter().enumerate().map(|(k, c)| *c <= raised(k)).collect()
}

pub(super) fn share(touching: &[bool]) -> f64 {
    touching.iter().filter(|t| **t).count() as f64 / touching.len() as f64
}

/// The name of a criterion in the name of a file.
pub(super) fn map_name(load: usize, id: &str) -> String {
    format!("load-{load}-{}.npy", id.replace(' ', "-"))
}

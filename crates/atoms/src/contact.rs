//! Contact and gap of a frame of atoms under the rigid indenter.
//!
//! An atom is in contact when an indenter atom is nearer than the contact distance. The indenter is a regular
//! periodic grid, so its points within a given distance follow from the coordinates, without a neighbour search.

use super::block::SurfaceSites;
use super::dump::DumpFrame;
use super::indenter::Indenter;
use asperity_grid::{Error, Result};

/// The atoms in contact.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactAtoms {
    /// Whether the atom of each site of the surface layer is in contact.
    pub sites: Vec<bool>,
    /// Ids of all contact atoms, ascending.
    pub ids: Vec<u32>,
    /// Contact atoms that were initially below the surface layer: more than a few indicate plastic flow.
    pub below_surface: usize,
}

impl ContactAtoms {
    /// Contact atoms of the surface layer over all atoms of that layer.
    pub fn fraction(&self) -> f64 {
        self.sites.iter().filter(|t| **t).count() as f64 / self.sites.len() as f64
    }
}

/// Atoms of `frame` nearer than `distance` (Å) to an indenter atom at the displacement `lowered` (Å).
pub fn contact(
    frame: &DumpFrame,
    indenter: &Indenter,
    lowered: f64,
    surface: &SurfaceSites,
    distance: f64,
) -> ContactAtoms {
    contact_by(frame, surface, |k| within(frame.positions[k], indenter, lowered, distance).next().is_some())
}

/// Contact atoms by a criterion on the index of an atom in the frame.
pub fn contact_by(frame: &DumpFrame, surface: &SurfaceSites, touches: impl Fn(usize) -> bool) -> ContactAtoms {
    let mut contact = ContactAtoms { sites: vec![false; surface.len()], ids: Vec::new(), below_surface: 0 };
    for (_, id) in frame.ids.iter().enumerate().filter(|(k, _)| touches(*k)) {
        contact.ids.push(*id);
        match surface.index_of(*id) {
            Some(index) => contact.sites[index] = true,
            None => contact.below_surface += 1,
        }
    }
    contact
}

/// Vectors (Å) from a point to the indenter atoms nearer than `reach` (Å), at the indenter displacement `lowered` (Å).
pub(super) fn within(
    [x, y, z]: [f64; 3],
    indenter: &Indenter,
    lowered: f64,
    reach: f64,
) -> impl Iterator<Item = [f64; 3]> + '_ {
    let base = indenter.start_z() - lowered - z;
    around([x, y], indenter, reach).filter_map(move |[dx, dy, height]| {
        let dz = base + height;
        (dx * dx + dy * dy + dz * dz < reach * reach).then_some([dx, dy, dz])
    })
}

/// Indenter atoms within `reach` of a position along both axes: their vectors from it along x and y, and their heights, Å.
fn around([x, y]: [f64; 2], indenter: &Indenter, reach: f64) -> impl Iterator<Item = [f64; 3]> + '_ {
    let (s, n) = (indenter.spacing(), indenter.points());
    let range = move |c: f64| ((c - reach) / s).ceil() as i64..=((c + reach) / s).floor() as i64;
    let wrap = move |k: i64| k.rem_euclid(n as i64) as usize;
    range(y).flat_map(move |row| {
        let heights = &indenter.heights()[wrap(row) * n..];
        range(x).map(move |column| [column as f64 * s - x, row as f64 * s - y, heights[wrap(column)]])
    })
}

/// Distance by which an atom at a point can rise until an indenter atom (at its initial position) is at `distance`
/// from it, Å: zero or negative where an indenter atom is already within `distance`, infinite where no indenter atom
/// is above.
pub fn clearance([x, y, z]: [f64; 3], indenter: &Indenter, distance: f64) -> f64 {
    let rise = |[dx, dy, height]: [f64; 3]| {
        let reach = distance * distance - (dy * dy + dx * dx);
        (reach >= 0.0).then(|| indenter.start_z() + height - z - reach.sqrt())
    };
    around([x, y], indenter, distance).filter_map(rise).fold(f64::INFINITY, f64::min)
}

/// Vertical gap per surface site, Å: height of the indenter's surface above the current position of the atom, less
/// `standoff` (the distance at which a flat wall and a flat crystal are in contact). `height` is the current height
/// of the indenter's surface at a point, Å.
///
/// # Errors
/// `Format` when an atom of the surface layer is missing from the frame.
pub fn gaps(
    frame: &DumpFrame,
    surface: &SurfaceSites,
    height: impl Fn(f64, f64) -> f64,
    standoff: f64,
) -> Result<Vec<f64>> {
    let l = surface.length();
    (0..surface.len())
        .map(|index| {
            let id = surface.first_id() + index as u32;
            let [x, y, z] = frame.position(id).ok_or_else(|| {
                Error::format(&frame.source, format!("no atom {id}"), "every atom of the surface layer")
            })?;
            Ok(height(x.rem_euclid(l), y.rem_euclid(l)) - z - standoff)
        })
        .collect()
}

pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Values per site on a `[ny, nx]` grid whose nodes belong to the sites in `owners` ([`SurfaceSites::onto_grid`]).
pub fn onto_grid<T: Copy>(values: &[T], owners: &[usize]) -> Vec<T> {
    owners.iter().map(|&site| values[site]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block::Block;

    const D_C: f64 = 4.0354;
    const R_M: f64 = 4.032_671;

    fn shaken(block: &Block) -> DumpFrame {
        let mut state = 12345u64;
        let mut noise = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 33) as f64 / (1u64 << 31) as f64 - 0.5
        };
        let l = block.length();
        let sites: Vec<_> = block.sites().filter(|s| !s.fixed).collect();
        DumpFrame {
            source: "made".into(),
            timestep: 0,
            time: None,
            bounds: [[0.0, l], [0.0, l], [0.0, 60.0]],
            periodic: [true, true, false],
            ids: sites.iter().map(|s| s.id).collect(),
            species: Vec::new(),
            has_types: true,
            elements: Vec::new(),
            // Some atoms leave the cell, as between two neighbour lists.
            positions: sites.iter().map(|s| s.position.map(|c| c + 4.0 * noise())).collect(),
            forces_z: Vec::new(),
            has_units: false,
        }
    }

    /// An atom raised by its clearance is exactly at the distance from the indenter.
    #[test]
    fn clearance_is_the_rise_to_the_contact_distance() {
        let block = Block::new(4, 2, 5.5884, 7.0).expect("valid");
        let heights_angstrom: Vec<f64> = (0..81).map(|k| ((k * 37) % 41) as f64 / 12.0).collect();
        let indenter = Indenter::above(&block, 9, heights_angstrom, R_M).expect("valid");
        for position in shaken(&block).positions {
            let [x, y, z] = position;
            let rise = clearance(position, &indenter, D_C);
            let touches = |by: f64| within([x, y, z + by], &indenter, 0.0, D_C).next().is_some();
            assert!(touches(rise + 1e-9) && !touches(rise - 1e-9), "{position:?}: {rise}");
        }
    }

    #[test]
    fn contact_agrees_with_a_search_of_all_pairs() {
        let block = Block::new(4, 2, 5.5884, 7.0).expect("valid");
        let heights_angstrom: Vec<f64> = (0..81).map(|k| ((k * 37) % 41) as f64 / 12.0).collect();
        let indenter = Indenter::above(&block, 9, heights_angstrom, R_M).expect("valid");
        let (frame, surface, l) = (shaken(&block), block.surface(), block.length());
        let mut met = 0;
        for lowered in [0.0, 1.0, 2.5, 6.0] {
            let fast = contact(&frame, &indenter, lowered, &surface, D_C);
            let mut slow = Vec::new();
            for (id, p) in frame.ids.iter().zip(&frame.positions) {
                let near = indenter.positions().any(|w| {
                    let (dx, dy, dz) = (w[0] - p[0], w[1] - p[1], w[2] - lowered - p[2]);
                    let (dx, dy) = (dx - (dx / l).round() * l, dy - (dy / l).round() * l);
                    (dx * dx + dy * dy + dz * dz).sqrt() < D_C
                });
                if near {
                    slow.push(*id);
                }
            }
            assert_eq!(fast.ids, slow);
            let on_top = slow.iter().filter(|id| surface.index_of(**id).is_some()).count();
            assert_eq!(fast.below_surface, slow.len() - on_top);
            assert_eq!(fast.fraction(), on_top as f64 / surface.len() as f64);
            met += slow.len();
        }
        assert!(met > 20, "the test saw only {met} contacts");
    }

    #[test]
    fn gaps_are_heights_above_the_atoms() {
        let block = Block::new(4, 2, 5.5884, 7.0).expect("valid");
        let mut frame = shaken(&block);
        let surface = block.surface();
        let g = gaps(&frame, &surface, |x, y| 50.0 + 0.1 * x - 0.2 * y, 3.9).expect("all there");
        let k = 5;
        let [x, y, z] = frame.position(surface.first_id() + k as u32).expect("there");
        let l = block.length();
        assert!((g[k] - (50.0 + 0.1 * x.rem_euclid(l) - 0.2 * y.rem_euclid(l) - z - 3.9)).abs() < 1e-12);
        let owners = surface.onto_grid(8, 6);
        assert_eq!(onto_grid(&g, &owners)[11], g[owners[11]]);
        assert_eq!(mean(&[1.0, 3.0]), 2.0);
        frame.ids.pop();
        frame.positions.pop();
        assert!(gaps(&frame, &surface, |_, _| 0.0, 0.0).expect_err("missing").to_string().contains("no atom"));
    }
}

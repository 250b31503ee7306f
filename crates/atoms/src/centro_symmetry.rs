//! Defect atoms by the centro-symmetry parameter of the twelve nearest neighbours (Kelchner, Plimpton & Hamilton,
//! Phys. Rev. B 58 (1998) 11085, with the pairs as in LAMMPS).
//!
//! P = Σ |r_i + r_j|² over the six most opposite pairs of the twelve nearest neighbours. A uniformly strained fcc
//! crystal has P = 0 at any strain; under a contact strains reach 0.2, for which a common-neighbour analysis with a
//! fixed cut-off reports a different crystal. In a stacking fault P = a0²/2, around a partial dislocation about
//! a0²/8, at a free (100) surface 3 a0²/2.

use super::block::Block;
use super::dump::DumpFrame;
use asperity_grid::CellList;
use asperity_grid::{Error, Result};
use rayon::prelude::*;

const NEIGHBOURS: usize = 12;

/// P over a0² above which an atom is a defect atom: half the value around a partial dislocation. Elastic load
/// histories (8 nm, resolved slope 0.21, p* up to 0.054) stay below 0.01 under the masked layers.
pub const THRESHOLD: f64 = 0.06;

/// Layers from the top that are not analysed. The first has no neighbours above, and under the second the contact
/// strain varies so strongly from atom to atom that P reaches 0.055 a0² in an elastic state (p* = 0.054 at 8 nm).
pub const MASKED_LAYERS: usize = 2;

/// Number of defect atoms up to which there is no yield: one point defect. Elastic steps have none.
pub const NOISE: usize = 3;

/// Ids of the defect atoms of a frame, ascending, among the [`analysed_atoms`].
///
/// # Errors
/// `Format` when an atom of the deformable block is missing from the frame.
pub fn defect_atoms(frame: &DumpFrame, block: &Block) -> Result<Vec<u32>> {
    let per_layer = block.atoms_per_layer() as u32;
    let first = block.fixed() as u32 + 1;
    let last = block.atoms() as u32;
    let missing = (first..=last).find(|id| frame.position(*id).is_none());
    if let Some(id) = missing {
        let accepted = "every deformable atom (atoms.plasticity = true writes them into the frames)";
        return Err(Error::format(&frame.source, format!("no atom {id}"), accepted));
    }
    // Neighbours in a rigid base are at their lattice sites. A base that moves is absent, and the layer above it is not analysed.
    let in_base = if block.foundation_cells > 0 { 0 } else { per_layer };
    let below = (first - in_base..first).filter_map(|id| block.site(id)).map(|s| s.position);
    let start = frame.ids.partition_point(|id| *id < first);
    let count = (last - first + 1) as usize;
    let points: Vec<[f64; 3]> = below.chain(frame.positions[start..start + count].iter().copied()).collect();
    let neighbours = NeighbourCells::new(&points, block.length(), block.a0);
    let limit = THRESHOLD * block.a0 * block.a0;
    let [from, to] = inner_layers(block).map(|layer| layer * per_layer as usize);
    let defects = (from..to).into_par_iter().filter(|k| {
        let index = in_base as usize + k;
        centro_symmetry(&mut neighbours.around(index)) > limit
    });
    Ok(defects.map(|k| first + k as u32).collect())
}

/// Number of atoms of a block that are analysed.
pub fn analysed_atoms(block: &Block) -> u64 {
    let [from, to] = inner_layers(block);
    (to - from) as u64 * block.atoms_per_layer()
}

/// Layers that are analysed, counted from the lowest deformable one: first, and one past the last.
fn inner_layers(block: &Block) -> [usize; 2] {
    let from = usize::from(block.foundation_cells > 0);
    [from, (2 * block.depth_cells).saturating_sub(MASKED_LAYERS).max(from)]
}

/// P of an atom from the relative positions `near` of its neighbours; infinite with fewer than twelve.
fn centro_symmetry(near: &mut [[f64; 3]]) -> f64 {
    let square = |v: &[f64; 3]| v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    if near.len() < NEIGHBOURS {
        return f64::INFINITY;
    }
    near.select_nth_unstable_by(NEIGHBOURS - 1, |a, b| square(a).total_cmp(&square(b)));
    let nearest = &near[..NEIGHBOURS];
    let mut sums = [0.0; NEIGHBOURS * (NEIGHBOURS - 1) / 2];
    let pairs = (0..NEIGHBOURS).flat_map(|i| (i + 1..NEIGHBOURS).map(move |j| (i, j)));
    for (sum, (i, j)) in sums.iter_mut().zip(pairs) {
        let (a, b) = (nearest[i], nearest[j]);
        *sum = square(&[a[0] + b[0], a[1] + b[1], a[2] + b[2]]);
    }
    sums.select_nth_unstable_by(NEIGHBOURS / 2 - 1, f64::total_cmp);
    let six = &mut sums[..NEIGHBOURS / 2];
    // Sorted, so that the sum does not depend on the selection.
    six.sort_unstable_by(f64::total_cmp);
    six.iter().sum()
}

/// Cells no narrower than a lattice constant: the twelve neighbours, at 0.71 of it, are in the 27 adjacent cells.
struct NeighbourCells<'p> {
    points: &'p [[f64; 3]],
    length: f64,
    width: f64,
    across: i64,
    /// Lowest cell along z, and number of cells.
    floor: i64,
    levels: i64,
    cells: CellList,
}

impl<'p> NeighbourCells<'p> {
    fn new(points: &'p [[f64; 3]], length: f64, smallest: f64) -> Self {
        let across = ((length / smallest).floor() as i64).max(3);
        let width = length / across as f64;
        let level = |p: &[f64; 3]| (p[2] / width).floor() as i64;
        let floor = points.iter().map(level).min().unwrap_or(0);
        let levels = points.iter().map(level).max().unwrap_or(0) - floor + 1;
        let cell = |p| cell_of(p, length, (width, across, floor)).map(|c| c as usize);
        let cells = CellList::new([across, across, levels].map(|n| n as usize), points.iter().map(cell));
        NeighbourCells { points, length, width, across, floor, levels, cells }
    }

    /// Relative positions of all points in the 27 cells around a point.
    fn around(&self, index: usize) -> Vec<[f64; 3]> {
        let centre = self.points[index];
        let [i, j, k] = cell_of(&centre, self.length, (self.width, self.across, self.floor));
        let image = |d: f64| d - (d / self.length).round() * self.length;
        let mut neighbours = Vec::with_capacity(128);
        for level in (k - 1).max(0)..(k + 2).min(self.levels) {
            for row in j - 1..=j + 1 {
                for column in i - 1..=i + 1 {
                    for other in self.cells.points([column, row], level as usize).filter(|o| *o != index) {
                        let p = self.points[other];
                        neighbours.push([image(p[0] - centre[0]), image(p[1] - centre[1]), p[2] - centre[2]]);
                    }
                }
            }
        }
        neighbours
    }
}

fn cell_of(p: &[f64; 3], length: f64, (width, across, floor): (f64, i64, i64)) -> [i64; 3] {
    let index_along = |c: f64| ((c.rem_euclid(length) / width) as i64).min(across - 1);
    [index_along(p[0]), index_along(p[1]), (p[2] / width).floor() as i64 - floor]
}

#[cfg(test)]
mod tests {
    use super::*;

    const A0: f64 = 5.5884;

    fn block() -> Block {
        Block::new(4, 5, A0, 7.0).expect("valid")
    }

    fn frame(block: &Block, moved: impl Fn(usize, [f64; 3]) -> [f64; 3]) -> DumpFrame {
        let l = block.length();
        let sites: Vec<_> = block.sites().filter(|s| !s.fixed).collect();
        DumpFrame {
            source: "made".into(),
            timestep: 0,
            time: None,
            bounds: [[0.0, l], [0.0, l], [0.0, 80.0]],
            periodic: [true, true, false],
            ids: sites.iter().map(|s| s.id).collect(),
            species: Vec::new(),
            has_types: true,
            elements: Vec::new(),
            positions: sites
                .iter()
                .map(|s| moved(block.layer_of(s.id).expect("of the block") - block.base_layers, s.position))
                .collect(),
            forces_z: Vec::new(),
            has_units: false,
        }
    }

    #[test]
    fn a_perfect_crystal_has_no_defect_atoms_below_the_masked_layers() {
        let block = block();
        assert!(defect_atoms(&frame(&block, |_, p| p), &block).expect("complete").is_empty());
        assert_eq!(analysed_atoms(&block), 8 * 32);
        // Without the mask the surface is detected: the top layer lacks four of twelve neighbours.
        let points: Vec<[f64; 3]> = block.sites().map(|s| s.position).collect();
        let neighbours = NeighbourCells::new(&points, block.length(), A0);
        let p = |index: usize| centro_symmetry(&mut neighbours.around(index)) / (A0 * A0);
        assert!(p(points.len() - 1) > 1.0, "{}", p(points.len() - 1));
        assert!(p(points.len() / 2) < 1e-20, "{}", p(points.len() / 2));
    }

    #[test]
    fn strain_gives_no_defect_atoms_and_slip_does() {
        let block = block();
        // The upper layers are compressed by 15 %: only atoms at the border have a defect environment.
        let z0 = block.layer_z(block.base_layers);
        let pressed = frame(&block, |_, [x, y, z]| [x, y, z0 + 0.85 * (z - z0)]);
        let actual = defect_atoms(&pressed, &block).expect("complete");
        assert!(actual.iter().all(|id| block.layer_of(*id) == Some(block.base_layers)), "{actual:?}");
        // Above a base that has moved, which a frame does not contain, the lowest layer is excluded.
        let gone = frame(&block, |_, [x, y, z]| [x + 0.25 * A0, y, z - 1.0]);
        let actual = defect_atoms(&gone, &block).expect("complete");
        assert!(
            actual.len() == 32 && actual.iter().all(|id| block.layer_of(*id) == Some(block.base_layers)),
            "{actual:?}"
        );
        let founded = block.on_foundation(3).expect("thick enough");
        // On a deep foundation the block sinks below the sites of its base.
        for by in [1.0, 2.2 * A0] {
            let gone = frame(&block, |_, [x, y, z]| [x + 0.25 * A0, y, z - by]);
            assert!(defect_atoms(&gone, &founded).expect("complete").is_empty());
        }
        assert_eq!(analysed_atoms(&founded), 7 * 32);
        // A slip by half a lattice vector restores fcc; a slip by a quarter does not.
        for (slip, disorder) in [(0.5, 0), (0.25, 2 * 32)] {
            let slipped = frame(&block, |layer, [x, y, z]| {
                let d = if layer >= 5 { slip * A0 } else { 0.0 };
                [x + d, y + d, z]
            });
            assert_eq!(defect_atoms(&slipped, &block).expect("complete").len(), disorder, "{slip}");
        }
        // A vacancy leaves twelve neighbours with eleven opposite ones.
        let mut hole = frame(&block, |_, p| p);
        hole.positions[5 * 32 + 7][2] += 60.0;
        assert_eq!(defect_atoms(&hole, &block).expect("complete").len(), 13);
    }

    /// The two planes of an intrinsic stacking fault in a stack of close-packed layers, ...ABCABC|BCABC...
    #[test]
    fn a_stacking_fault_has_two_planes_of_half_a_squared_lattice_constant() {
        let (n, rise) = (6i64, A0 / 3f64.sqrt());
        let near = A0 / 2f64.sqrt();
        let position_of = |layer: usize, i: i64, j: i64, stack: &[u8]| {
            let shift = f64::from(stack[layer] - b'A') / 3.0;
            let (u, v) = (i as f64 + shift, j as f64 + shift);
            [near * (u + 0.5 * v), near * v * 0.75f64.sqrt(), rise * layer as f64]
        };
        let stack = b"ABCABCBCABCA";
        let value = |layer: usize| {
            let own = position_of(layer, 0, 0, stack);
            let mut around = Vec::new();
            for l in layer - 1..=layer + 1 {
                for i in -n..=n {
                    for j in -n..=n {
                        let p = position_of(l, i, j, stack);
                        let d = [p[0] - own[0], p[1] - own[1], p[2] - own[2]];
                        if d != [0.0; 3] {
                            around.push(d);
                        }
                    }
                }
            }
            centro_symmetry(&mut around) / (A0 * A0)
        };
        let actual: Vec<f64> = (2..10).map(value).collect();
        for (layer, p) in (2..10).zip(&actual) {
            let expected = if layer == 5 || layer == 6 { 0.5 } else { 0.0 };
            assert!((p - expected).abs() < 1e-12, "{actual:?}");
        }
    }

    #[test]
    fn a_frame_without_all_deformable_atoms_is_refused() {
        let block = block();
        let mut top = frame(&block, |_, p| p);
        top.ids.drain(..32);
        top.positions.drain(..32);
        assert!(defect_atoms(&top, &block).expect_err("incomplete").to_string().contains("plasticity = true"));
    }
}

//! The block: a face-centred cubic crystal with a (100) surface, deformable cells above a rigid base.
//!
//! Lengths are in Å. No positions are stored: an id identifies a lattice site, from which position, layer and surface
//! site follow. Layers are numbered from the lowest of the base upwards, ids start at 1 and increase layer by layer.

use super::force_constants::reach;
use asperity_grid::{Error, Result, UnionFind};
use serde::{Deserialize, Serialize};

/// Height of the lowest layer above the bottom of the box, Å. Atoms exactly at the fixed boundary are lost in LAMMPS
/// as soon as one moves.
pub const FLOOR_GAP_ANGSTROM: f64 = 2.0;

/// Offset of lattice sites from the box faces in x and y, fraction of a cell. The nearest site is then a quarter cell
/// from the periodic boundary, and small displacements do not move atoms across it between frames.
const INSET_CELLS: f64 = 0.25;

/// Smallest number of cells along an edge: with fewer, the indenter has fewer than nine points across.
pub const MIN_CELLS: usize = 4;

/// Standard LAMMPS builds count atoms in 32 bits.
pub const MAX_ATOMS: u64 = i32::MAX as u64;

/// The lowest layers of a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum BaseKind {
    /// At rest.
    #[default]
    Rigid,
    /// Displaced once per load, as the continuum's solution is in an elastic foundation.
    Prescribed,
    /// Free, under the forces of the crystal that is missing below: its force constants, condensed at every wave vector.
    Elastic,
}

/// `cells` × `cells` × `depth_cells` deformable cubic cells on a base of `base_layers` layers, which is rigid or lies in a foundation of
/// `foundation_cells` cells below the deformable ones.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Block {
    pub cells: usize,
    pub depth_cells: usize,
    #[serde(default)]
    pub base: BaseKind,
    pub base_layers: usize,
    pub foundation_cells: usize,
    /// Lattice constant, Å.
    #[serde(rename = "a0_angstrom")]
    pub a0: f64,
}

/// One atom of the block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Site {
    pub id: u32,
    /// Whether it belongs to the base.
    pub fixed: bool,
    /// Lattice position, Å.
    pub position: [f64; 3],
}

impl Block {
    /// A block whose base is at least as thick as `cutoff_angstrom`, the range of the potential.
    ///
    /// # Errors
    /// `Input` for too few cells, too many atoms for LAMMPS, or a length that is not positive.
    pub fn new(cells: usize, depth_cells: usize, a0: f64, cutoff_angstrom: f64) -> Result<Self> {
        let context = "block of atoms";
        if cells < MIN_CELLS {
            return Err(Error::input(context, "atoms.cells", cells, format!("at least {MIN_CELLS}")));
        }
        if depth_cells < 1 {
            return Err(Error::input(context, "atoms.depth_cells", depth_cells, "at least 1"));
        }
        for (key, value) in [("lattice constant", a0), ("potential cut-off", cutoff_angstrom)] {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::input(context, key, value, "a positive length in angstrom"));
            }
        }
        let base_layers = (cutoff_angstrom / (0.5 * a0)).ceil() as usize;
        let block = Block { cells, depth_cells, base: BaseKind::Rigid, base_layers, foundation_cells: 0, a0 };
        let layers = depth_cells.checked_mul(2).and_then(|d| d.checked_add(base_layers));
        let per_layer = (cells as u64).checked_mul(cells as u64).and_then(|a| a.checked_mul(2));
        match layers.zip(per_layer).and_then(|(l, a)| a.checked_mul(l as u64)) {
            Some(atoms) if atoms <= MAX_ATOMS => Ok(block),
            _ => {
                let found = format!("{cells} with depth {depth_cells}");
                Err(Error::input(context, "atoms.cells", found, format!("a block of at most {MAX_ATOMS} atoms")))
            }
        }
    }

    /// The block on an elastic foundation that contains its base; 0 for a rigid base.
    ///
    /// # Errors
    /// `Input` for a foundation that is thinner than the base.
    pub fn on_foundation(self, foundation_cells: usize) -> Result<Self> {
        let smallest = self.base_layers.saturating_sub(1).div_ceil(2).max(1);
        if foundation_cells > 0 && foundation_cells < smallest {
            let accepted =
                format!("0, or at least {smallest}: the base, as thick as the potential's range, lies in it");
            return Err(Error::input("block of atoms", "atoms.foundation_cells", foundation_cells, accepted));
        }
        let base = if foundation_cells > 0 { BaseKind::Prescribed } else { BaseKind::Rigid };
        Ok(Block { foundation_cells, base, ..self })
    }

    /// The block on layers with the forces of the crystal down to a rigid plane, `foundation_cells` below the deformable cells.
    ///
    /// # Errors
    /// `Input` for a foundation that is thinner than these layers.
    pub fn on_elastic_base(self, foundation_cells: usize, cutoff_angstrom: f64) -> Result<Self> {
        let base_layers = reach(cutoff_angstrom, self.a0);
        if 2 * foundation_cells < base_layers {
            let smallest = base_layers.div_ceil(2);
            let accepted =
                format!("at least {smallest} with an elastic base: its {base_layers} layers lie in the foundation");
            return Err(Error::input("block of atoms", "atoms.foundation_cells", foundation_cells, accepted));
        }
        Ok(Block { base: BaseKind::Elastic, foundation_cells, base_layers, ..self })
    }

    /// Depth that relaxes with the atoms, lattice constants: with an elastic base the foundation too, in which waves of the block decay
    /// within half of its width.
    pub fn relaxing_cells(&self) -> usize {
        match self.base {
            BaseKind::Elastic => (self.depth_cells + self.foundation_cells).min(self.cells / 2).max(self.depth_cells),
            _ => self.depth_cells,
        }
    }

    /// Layers between an elastic base and the rigid plane.
    pub fn missing_layers(&self) -> usize {
        (2 * self.foundation_cells).saturating_sub(self.base_layers)
    }

    /// Indices of a layer's sites on the grid of half lattice constants, `[2 cells, 2 cells]` by rows of constant y, in the order of their
    /// ids.
    pub fn half_cell_indices(&self, layer: usize) -> impl Iterator<Item = usize> + use<> {
        let (n, below) = (self.cells, self.below_surface(layer));
        (0..2 * n * n).map(move |rank| {
            let (row, column) = (rank / n, rank % n);
            2 * n * row + 2 * column + (row + below) % 2
        })
    }

    pub fn layers(&self) -> usize {
        2 * self.depth_cells + self.base_layers
    }

    pub fn atoms_per_layer(&self) -> u64 {
        2 * self.cells as u64 * self.cells as u64
    }

    pub fn deformable(&self) -> u64 {
        self.atoms_per_layer() * 2 * self.depth_cells as u64
    }

    pub fn fixed(&self) -> u64 {
        self.atoms_per_layer() * self.base_layers as u64
    }

    pub fn atoms(&self) -> u64 {
        self.deformable() + self.fixed()
    }

    /// Edge of the periodic cell in x and y, Å.
    pub fn length(&self) -> f64 {
        self.cells as f64 * self.a0
    }

    /// Thickness from the top layer of the base to the surface layer, Å.
    pub fn deformable_thickness(&self) -> f64 {
        self.depth_cells as f64 * self.a0
    }

    /// Thickness of the elastic layer, from the rigid base or the ground of the foundation to the surface layer, Å.
    pub fn thickness(&self) -> f64 {
        (self.depth_cells + self.foundation_cells) as f64 * self.a0
    }

    /// Height of a layer above the rigid base or ground, Å.
    pub fn height_of(&self, layer: usize) -> f64 {
        self.thickness() + self.layer_z(layer) - self.top_z()
    }

    /// Layers above a layer.
    fn below_surface(&self, layer: usize) -> usize {
        self.layers() - 1 - layer
    }

    /// Height of a layer in the perfect lattice, Å.
    pub fn layer_z(&self, layer: usize) -> f64 {
        FLOOR_GAP_ANGSTROM + 0.5 * self.a0 * layer as f64
    }

    /// Height of the surface layer in the perfect lattice, Å.
    pub fn top_z(&self) -> f64 {
        self.layer_z(self.layers() - 1)
    }

    /// Layer of an atom, `None` for an id that is not of the block.
    pub fn layer_of(&self, id: u32) -> Option<usize> {
        let index = u64::from(id).checked_sub(1)?;
        (index < self.atoms()).then(|| (index / self.atoms_per_layer()) as usize)
    }

    /// Lattice site of an atom, `None` for an id that is not of the block.
    pub fn site(&self, id: u32) -> Option<Site> {
        let layer = self.layer_of(id)?;
        let rank = ((u64::from(id) - 1) % self.atoms_per_layer()) as usize;
        let [x, y] = self.layer_xy(layer, rank);
        Some(Site { id, fixed: layer < self.base_layers, position: [x, y, self.layer_z(layer)] })
    }

    /// All atoms in the order of their ids.
    pub fn sites(&self) -> impl Iterator<Item = Site> + '_ {
        (1..=self.atoms() as u32).filter_map(|id| self.site(id))
    }

    pub fn surface(&self) -> SurfaceSites {
        SurfaceSites { block: *self }
    }

    fn layer_xy(&self, layer: usize, rank: usize) -> [f64; 2] {
        self.lattice_xy(layer, (rank / self.cells) as i64, (rank % self.cells) as i64)
    }

    /// In-plane position of a site of the infinite layer, Å. A layer is a checkerboard of half cells: row t at y = t/2,
    /// its sites shifted by half a cell in every second row; which rows are shifted alternates from layer to layer. The surface has the
    /// same sites for any number of layers below it.
    pub(super) fn lattice_xy(&self, layer: usize, row: i64, column: i64) -> [f64; 2] {
        let shift = 0.5 * (row + self.below_surface(layer) as i64).rem_euclid(2) as f64;
        [(column as f64 + shift + INSET_CELLS) * self.a0, (0.5 * row as f64 + INSET_CELLS) * self.a0]
    }
}

/// The 2 n² lattice sites of the surface layer: a square lattice of spacing a0/√2, rotated by 45°.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceSites {
    block: Block,
}

impl SurfaceSites {
    pub fn len(&self) -> usize {
        self.block.atoms_per_layer() as usize
    }

    /// Always false: a block has at least `MIN_CELLS` cells.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Id of the first surface atom; the ids of the others are consecutive.
    pub fn first_id(&self) -> u32 {
        (self.block.atoms() - self.block.atoms_per_layer()) as u32 + 1
    }

    /// Index (0 ≤ index < len) of a surface atom's site, `None` for any other atom.
    pub fn index_of(&self, id: u32) -> Option<usize> {
        let index = id.checked_sub(self.first_id())? as usize;
        (index < self.len()).then_some(index)
    }

    /// In-plane position of a site, Å.
    pub fn xy(&self, index: usize) -> [f64; 2] {
        self.block.layer_xy(self.block.layers() - 1, index)
    }

    /// Edge of the periodic cell, Å.
    pub fn length(&self) -> f64 {
        self.block.length()
    }

    /// Index of the site nearest to a point of the periodic plane.
    ///
    /// In half cells (X, Y) the sites are the integer points with even X + Y, and hence integer points of the rotated
    /// coordinates p = (X+Y)/2, q = (X-Y)/2, whose Voronoi cells are squares along p and q.
    pub fn nearest(&self, x: f64, y: f64) -> usize {
        let half = 0.5 * self.block.a0;
        let (u, v) = (x / half - 2.0 * INSET_CELLS, y / half - 2.0 * INSET_CELLS);
        let p = (0.5 * (u + v)).round();
        let q = (0.5 * (u - v)).round();
        let across = 2 * self.block.cells as i64;
        let column = ((p + q) as i64).rem_euclid(across) as usize;
        let row = ((p - q) as i64).rem_euclid(across) as usize;
        row * self.block.cells + column / 2
    }

    /// Number of sites of each contact cluster. Sites at a0/√2 and at a0 are neighbours: across the edges and the corners
    /// of a site's square cell, as for the nodes of a continuum's contact map. `touching`: contact by site.
    pub fn cluster_sizes(&self, touching: &[bool]) -> Vec<usize> {
        let (rows, columns) = (2 * self.block.cells, self.block.cells);
        let site = |row: usize, column: usize| (row % rows) * columns + column % columns;
        let mut sets: UnionFind = UnionFind::new(touching.len());
        for index in (0..touching.len()).filter(|&i| touching[i]) {
            let (row, column) = (index / columns, index % columns);
            // Odd rows are shifted by half a cell.
            let above = column + row % 2;
            let ahead = [(row, column + 1), (row + 1, above), (row + 1, above + columns - 1), (row + 2, column)];
            for other in ahead.map(|(row, column)| site(row, column)).into_iter().filter(|&other| touching[other]) {
                sets.unite(index as u32, other as u32);
            }
        }
        let mut sizes = vec![0; touching.len()];
        for index in (0..touching.len()).filter(|&i| touching[i]) {
            sizes[sets.root(index as u32) as usize] += 1;
        }
        sizes.retain(|n| *n > 0);
        sizes
    }

    /// Area of a site's cell, Å².
    pub fn site_area(&self) -> f64 {
        0.5 * self.block.a0.powi(2)
    }

    /// Index of the nearest site for every node (x = i·L/nx, y = j·L/ny) of a periodic `[ny, nx]` grid.
    pub fn onto_grid(&self, nx: usize, ny: usize) -> Vec<usize> {
        let length = self.block.length();
        (0..nx * ny)
            .map(|k| self.nearest((k % nx) as f64 * length / nx as f64, (k / nx) as f64 * length / ny as f64))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const A0: f64 = 5.5884;
    const CUTOFF: f64 = 7.015853;

    fn small() -> Block {
        Block::new(5, 3, A0, CUTOFF).expect("a valid block")
    }

    #[test]
    fn atom_counts_of_the_challenge_block() {
        let block = Block::new(175, 25, A0, CUTOFF).expect("valid");
        assert_eq!(block.deformable(), 3_062_500);
        assert_eq!(block.base_layers, 3);
        assert!(block.base_layers as f64 * 0.5 * A0 >= CUTOFF);
        assert_eq!(block.fixed(), 183_750);
        assert_eq!(block.surface().len(), 61_250);
        assert!((block.length() - 977.97).abs() < 1e-9);
    }

    #[test]
    fn ids_positions_and_layers_agree() {
        let block = small();
        let all: Vec<Site> = block.sites().collect();
        assert_eq!(all.len() as u64, block.atoms());
        for (k, site) in all.iter().enumerate() {
            assert_eq!(site.id as usize, k + 1);
            assert!(site.position[2] >= FLOOR_GAP_ANGSTROM);
            assert!(site.position[..2].iter().all(|&c| c > 0.0 && c < block.length()));
        }
        assert_eq!(all.iter().filter(|s| s.fixed).count() as u64, block.fixed());
        let top = block.surface();
        for index in 0..top.len() {
            let site = all[top.first_id() as usize - 1 + index];
            assert_eq!(top.index_of(site.id), Some(index));
            assert_eq!([site.position[0], site.position[1]], top.xy(index));
            assert_eq!(site.position[2], block.top_z());
        }
        assert_eq!(top.index_of(top.first_id() - 1), None);
        assert_eq!(block.site(0), None);
        assert_eq!(block.site(block.atoms() as u32 + 1), None);
    }

    /// By distances alone: sites are connected up to a0, across the sides of the periodic cell, too.
    #[test]
    fn clusters_of_sites_are_those_of_their_distances() {
        let block = Block::new(9, 3, A0, CUTOFF).expect("valid");
        let (sites, edge) = (block.surface(), block.length());
        let near = |a: usize, b: usize| {
            let d = [0, 1].map(|k| sites.xy(a)[k] - sites.xy(b)[k]).map(|d| d - edge * (d / edge).round());
            d[0].hypot(d[1]) < 1.1 * A0
        };
        for (seed, share) in (0..40).zip([0.1, 0.3, 0.5, 0.7, 1.0].into_iter().cycle()) {
            let drawn = |k: usize| ((k * k * 7919 + (seed + 1) * 104_729 * (k + 3)) % 1009) as f64 / 1009.0 < share;
            let touching: Vec<bool> = (0..sites.len()).map(drawn).collect();
            let mut label: Vec<usize> = (0..sites.len()).collect();
            let mut changed = true;
            while changed {
                changed = false;
                for (a, b) in (0..sites.len()).flat_map(|a| (0..a).map(move |b| (a, b))) {
                    if touching[a] && touching[b] && label[a] != label[b] && near(a, b) {
                        let low = label[a].min(label[b]);
                        (label[a], label[b], changed) = (low, low, true);
                    }
                }
            }
            let of = |l: usize| (0..sites.len()).filter(|&k| touching[k] && label[k] == l).count();
            let expected: Vec<usize> = (0..sites.len()).map(of).filter(|n| *n > 0).collect();
            assert_eq!(sites.cluster_sizes(&touching), expected, "share {share}");
        }
        assert!((sites.len() as f64 * sites.site_area() - edge * edge).abs() < 1e-9 * edge * edge);
    }

    /// Inside a face-centred cubic crystal every atom has 12 neighbours at a0/√2, and the periodic images fit.
    #[test]
    fn every_inner_atom_has_twelve_nearest_neighbours() {
        let block = small();
        let all: Vec<Site> = block.sites().collect();
        let l = block.length();
        let image = |d: f64| d - (d / l).round() * l;
        for a in &all {
            let near = all.iter().filter(|b| {
                let d: Vec<f64> = (0..3).map(|c| a.position[c] - b.position[c]).collect();
                let r = (image(d[0]).powi(2) + image(d[1]).powi(2) + d[2] * d[2]).sqrt();
                assert!(r == 0.0 || r > 0.7 * A0, "two atoms {r} apart");
                r > 0.0 && r < 0.75 * A0
            });
            let layer = block.layer_of(a.id).expect("of the block");
            let expected = if layer == 0 || layer + 1 == block.layers() { 8 } else { 12 };
            assert_eq!(near.count(), expected);
        }
    }

    #[test]
    fn nearest_site_agrees_with_a_search_of_all_sites() {
        // Both parities of the surface layer.
        for depth_cutoff in [CUTOFF, 1.9 * A0] {
            let block = Block::new(4, 2, A0, depth_cutoff).expect("valid");
            let (top, l) = (block.surface(), block.length());
            let distance2 = |index: usize, x: f64, y: f64| {
                let [sx, sy] = top.xy(index);
                let (dx, dy) = (x - sx, y - sy);
                (dx - (dx / l).round() * l).powi(2) + (dy - (dy / l).round() * l).powi(2)
            };
            for k in 0..61 * 53 {
                let (x, y) = ((k % 61) as f64 / 61.0 * 2.0 * l - l, (k / 61) as f64 / 53.0 * l);
                let best = (0..top.len()).map(|i| distance2(i, x, y)).fold(f64::INFINITY, f64::min);
                assert!(distance2(top.nearest(x, y), x, y) <= best + 1e-9);
            }
            for index in 0..top.len() {
                let [x, y] = top.xy(index);
                assert_eq!(top.nearest(x, y), index);
            }
            // Every site owns an equal number of nodes of a fine grid.
            let mut owned = vec![0usize; top.len()];
            top.onto_grid(96, 96).into_iter().for_each(|s| owned[s] += 1);
            assert!(owned.iter().all(|&c| c.abs_diff(96 * 96 / top.len()) <= 24), "{owned:?}");
        }
    }

    #[test]
    fn a_foundation_contains_the_base() {
        // Three layers: the lowest is a lattice constant below the highest.
        let block = small();
        assert!((block.height_of(block.base_layers - 1)).abs() < 1e-12);
        let deep = block.on_foundation(1).expect("as thick as the base");
        assert!(deep.height_of(0).abs() < 1e-12 && (deep.thickness() - 4.0 * A0).abs() < 1e-12);
        assert_eq!((deep.atoms(), deep.deformable_thickness()), (block.atoms(), block.thickness()));
        let thick = Block::new(5, 3, A0, 1.9 * A0).expect("valid");
        assert!(thick.on_foundation(1).is_err() && thick.on_foundation(2).is_ok() && thick.on_foundation(0).is_ok());
    }

    #[test]
    fn bad_sizes_are_refused() {
        assert!(Block::new(3, 6, A0, CUTOFF).is_err());
        assert!(Block::new(10, 0, A0, CUTOFF).is_err());
        assert!(Block::new(10, 6, f64::NAN, CUTOFF).is_err());
        assert!(Block::new(usize::MAX, 6, A0, CUTOFF).is_err());
        assert!(Block::new(40_000, 25, A0, CUTOFF).is_err());
    }
}

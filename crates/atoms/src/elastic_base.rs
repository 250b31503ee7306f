//! Forces on the elastic base of a block: displacements of its atoms from the crystal sites at the strain of the load, and the boundary
//! that the missing layers are condensed to.

use super::block::Block;
use super::force_constants::ForceConstants;
use asperity_contact::interface::LatticeBoundary;
use asperity_grid::Result;

/// The lowest layers of a block under a mean pressure.
pub(super) struct ElasticBase {
    length: f64,
    /// Sites of the crystal under the pressure, by id from 1, Å, and their indices on the grids of `fields`.
    sites: Vec<[f64; 3]>,
    indices: Vec<usize>,
    per_layer: usize,
    boundary: LatticeBoundary,
    fields: Vec<Vec<f64>>,
}

impl ElasticBase {
    /// At the strain under `pressure`, eV/Å³. The crystal hangs from the rigid plane, which does not move; layers are closer by the strain.
    ///
    /// # Errors
    /// `Input` for a pressure beyond the measured strains, or a crystal that is not stable at its strain.
    pub(super) fn new(block: &Block, constants: &ForceConstants, pressure: f64) -> Result<Self> {
        let strain = constants.strain_at(pressure)?;
        let boundary = LatticeBoundary::new(block.cells, block.missing_layers(), &constants.at(strain))?;
        let rigid_plane = block.top_z() - block.thickness();
        let mut sites = Vec::new();
        let mut indices = Vec::new();
        for layer in 0..block.base_layers {
            let z = rigid_plane + (1.0 - strain) * block.height_of(layer);
            let first = layer as u64 * block.atoms_per_layer() + 1;
            let ids = first..first + block.atoms_per_layer();
            sites.extend(ids.filter_map(|id| block.site(id as u32)).map(|s| [s.position[0], s.position[1], z]));
            indices.extend(block.half_cell_indices(layer));
        }
        Ok(ElasticBase {
            length: block.length(),
            sites,
            indices,
            per_layer: block.atoms_per_layer() as usize,
            fields: vec![vec![0.0; 4 * block.cells * block.cells]; 3 * boundary.reach()],
            boundary,
        })
    }

    /// Number of atoms, whose ids are the first.
    pub(super) fn atoms(&self) -> usize {
        self.sites.len()
    }

    /// Forces (eV/Å) on the atoms at `positions` (Å, wrapped or not), in the order of their ids; returns the energy, eV, zero at the sites.
    pub(super) fn forces(&mut self, positions: &[[f64; 3]], forces: &mut [[f64; 3]]) -> f64 {
        self.fields.iter_mut().for_each(|f| f.fill(0.0));
        for (k, (position, site)) in positions.iter().zip(&self.sites).enumerate() {
            let layer = k / self.per_layer;
            for c in 0..3 {
                let mut u = position[c] - site[c];
                if c < 2 {
                    u -= (u / self.length).round() * self.length;
                }
                self.fields[3 * layer + c][self.indices[k]] = u;
            }
        }
        let energy = self.boundary.forces(&mut self.fields);
        for (k, force) in forces.iter_mut().enumerate() {
            let layer = k / self.per_layer;
            *force = std::array::from_fn(|c| self.fields[3 * layer + c][self.indices[k]]);
        }
        energy
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::potential::CALCIUM;

    #[test]
    fn indices_on_half_cells_follow_the_sites() {
        let block =
            Block::new(5, 3, CALCIUM.a0, CALCIUM.rc).expect("valid").on_elastic_base(4, CALCIUM.rc).expect("valid");
        assert_eq!((block.base_layers, block.missing_layers()), (4, 4));
        for layer in 0..block.layers() {
            let first = layer as u32 * block.atoms_per_layer() as u32 + 1;
            for (id, index) in (first..).zip(block.half_cell_indices(layer)) {
                let [x, y, _] = block.site(id).expect("a site").position;
                let half = |c: f64| (c / (0.5 * block.a0) - 0.5).round() as usize;
                assert_eq!(index, half(y) * 2 * block.cells + half(x), "atom {id}");
            }
        }
    }
}

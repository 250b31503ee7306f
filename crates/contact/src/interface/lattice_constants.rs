//! Force constants of a crystal and of a block that is cut at a (001) plane.

/// Force constants between an atom and one other, eV/Å²: second derivatives of the energy.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Bond {
    /// Layer of the other atom: relative to the atom's in the crystal, counted from the lowest in a cut block.
    pub layer: i32,
    /// In-plane offset, half lattice constants.
    pub dx: i32,
    pub dy: i32,
    pub phi: [[f64; 3]; 3],
}

/// Force constants of a crystal and of a block that is cut at a (001) plane.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct LatticeConstants {
    /// Layers above and below an atom to which it is coupled.
    pub reach: usize,
    /// Bonds of an atom of the crystal, its own included.
    pub bulk: Vec<Bond>,
    /// Bonds of an atom in each of the lowest `reach` layers of the cut block to atoms of these layers.
    pub cut: Vec<Vec<Bond>>,
    /// Normal force on an atom of each of these layers in the cut block with all atoms at crystal sites, eV/Å.
    pub cut_force: Vec<f64>,
}

impl LatticeConstants {
    /// Force constant of an atom of the crystal that alone is displaced along z, eV/Å².
    pub fn stiffness_of_a_site(&self) -> f64 {
        self.bulk.iter().find(|b| (b.layer, b.dx, b.dy) == (0, 0, 0)).map_or(0.0, |b| b.phi[2][2])
    }

    /// `Σ weights[k] sets[k]`: interpolation between states of strain. The sets must come from one crystal.
    #[must_use]
    pub fn combination(sets: &[&LatticeConstants], weights: &[f64]) -> LatticeConstants {
        let mut sum = sets[0].clone();
        let blend = |get: &dyn Fn(&LatticeConstants) -> f64| sets.iter().zip(weights).map(|(s, w)| w * get(s)).sum();
        let bond = |b: &mut Bond, get: &dyn Fn(&LatticeConstants) -> Bond| {
            for (i, row) in b.phi.iter_mut().enumerate() {
                row.iter_mut().enumerate().for_each(|(j, p)| *p = blend(&|s| get(s).phi[i][j]));
            }
        };
        sum.bulk.iter_mut().enumerate().for_each(|(k, b)| bond(b, &|s| s.bulk[k]));
        for (l, list) in sum.cut.iter_mut().enumerate() {
            list.iter_mut().enumerate().for_each(|(k, b)| bond(b, &|s| s.cut[l][k]));
        }
        sum.cut_force.iter_mut().enumerate().for_each(|(l, f)| *f = blend(&|s| s.cut_force[l]));
        sum
    }
}

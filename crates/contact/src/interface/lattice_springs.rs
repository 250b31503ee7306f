//! A crystal of springs between first and second neighbours, for tests of lattices.

use super::lattice_constants::{Bond, LatticeConstants};

/// Stiffness of the springs between first and second neighbours, eV/Å², and the lattice constant, Å.
pub(super) const SPRINGS: [f64; 2] = [1.3, 0.4];
pub(super) const A0: f64 = 4.0;
/// Offsets (x, y, layer) of the neighbours with springs, half lattice constants.
pub(super) fn neighbours() -> Vec<([i32; 3], f64)> {
    let mut list = Vec::new();
    for axis in 0..3 {
        for s in [-1, 1] {
            let mut second = [0; 3];
            second[axis] = 2 * s;
            list.push((second, SPRINGS[1]));
            for t in [-1, 1] {
                let mut first = [s; 3];
                (first[axis], first[(axis + 1) % 3]) = (0, t);
                list.push((first, SPRINGS[0]));
            }
        }
    }
    list
}

pub(super) fn spring([x, y, z]: [i32; 3], k: f64) -> [[f64; 3]; 3] {
    let r = [x, y, z].map(f64::from);
    let r2: f64 = r.iter().map(|c| c * c).sum();
    std::array::from_fn(|i| std::array::from_fn(|j| -k * r[i] * r[j] / r2))
}

/// Bonds of an atom whose neighbours exist in layers for which `exists` holds (relative to the atom).
pub(super) fn bonds(exists: impl Fn(i32) -> bool) -> Vec<Bond> {
    let mut own = [[0.0; 3]; 3];
    let mut list = Vec::new();
    for (r, k) in neighbours().into_iter().filter(|(r, _)| exists(r[2])) {
        let phi = spring(r, k);
        own.iter_mut().flatten().zip(phi.iter().flatten()).for_each(|(o, p)| *o -= p);
        list.push(Bond { layer: r[2], dx: r[0], dy: r[1], phi });
    }
    list.push(Bond { layer: 0, dx: 0, dy: 0, phi: own });
    list
}

pub(super) fn crystal() -> LatticeConstants {
    let cut = |l: i32| {
        let moved = bonds(|d| l + d >= 0).into_iter().map(|b| Bond { layer: l + b.layer, ..b });
        moved.filter(|b| b.layer < 2).collect()
    };
    LatticeConstants { reach: 2, bulk: bonds(|_| true), cut: vec![cut(0), cut(1)], cut_force: vec![0.0; 2] }
}

/// Sites of a layer on the grid of half lattice constants: (x, y).
pub(super) fn sites(cells: usize, layer: usize) -> Vec<[i32; 2]> {
    let across = 2 * cells as i32;
    let all = (0..across).flat_map(|y| (0..across).map(move |x| [x, y]));
    all.filter(|[x, y]| (x + y + layer as i32) % 2 == 0).collect()
}

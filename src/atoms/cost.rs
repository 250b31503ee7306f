//! What LAMMPS will take for a block: memory, force evaluations, time, from what blocks of 8 to 98 nm have taken.

/// Resident memory of one process at its largest, of which some 50 MB are the program. From the continuum: 63, 129, 399 and 2351 MB for
/// 7839, 119 151, 509 004 and 3 394 475 atoms. From first touch positions are kept for the start of the next step: 143 MB for
/// 119 151.
const MEMORY_BASE_BYTES: u64 = 50_000_000;
const MEMORY_BYTES_PER_ATOM: u64 = 680;
const MEMORY_BYTES_PER_ATOM_OF_A_LADDER: u64 = 870;

/// One core of an EPYC server, potential cut-off 7.0 Å, the `opt` variants: 0.42 to 0.43 µs over three whole ladders of
/// 119 151 atoms. Relaxing rarely rebuilds a neighbour list, so this is half of what a step of dynamics takes.
pub const SECONDS_PER_ATOM_EVALUATION: f64 = 0.45e-6;

/// Force evaluations per step of 0.3 Å: 31 at first touch, 120 to 160 in contact, up to 430 where slip begins (cell of
/// 25 nm, ladder to p/E* = 0.033).
pub const EVALUATIONS_PER_STEP: f64 = 160.0;

/// Force evaluations of one load that starts from the continuum, of a block of one lattice constant. The longest waves settle last, so
/// that they grow with extent and depth, with the exponents below: on average 71, 219, 128, 88, 358 and 1043 for 15 × 6, 45 × 12, 45 × 6,
/// 45 × 4, 90 × 13 and 175 × 25 lattice constants, where p/E* = 0.003, 0.01 and (but for the last two) 0.03 were asked.
const EVALUATIONS: f64 = 3.1;
const GROWTH_WITH_EXTENT: f64 = 0.6;
const GROWTH_WITH_DEPTH: f64 = 0.8;

/// Force evaluations of one load that starts from the continuum.
pub fn evaluations_from_continuum(cells: usize, depth_cells: usize) -> f64 {
    EVALUATIONS * (cells as f64).powf(GROWTH_WITH_EXTENT) * (depth_cells as f64).powf(GROWTH_WITH_DEPTH)
}

/// Resident memory of LAMMPS for so many atoms, all ranks together, bytes; `steps` from first touch, or loads from the continuum.
pub fn memory_bytes(atoms: u64, ranks: usize, steps: bool) -> u64 {
    let per_atom = if steps { MEMORY_BYTES_PER_ATOM_OF_A_LADDER } else { MEMORY_BYTES_PER_ATOM };
    ranks as u64 * MEMORY_BASE_BYTES + atoms * per_atom
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Those of the scenes of 8 to 98 nm, base and all.
    #[test]
    fn memory_is_what_was_measured() {
        for (atoms, measured) in [(7839, 63e6), (119_151, 129e6), (509_004, 399e6), (3_394_475, 2.351e9)] {
            let ratio = memory_bytes(atoms, 1, false) as f64 / measured;
            assert!((0.8..1.2).contains(&ratio), "{atoms}: {ratio}");
        }
    }

    /// Of the loads that were measured.
    #[test]
    fn evaluations_grow_with_extent_and_depth() {
        let measured =
            [(15, 6, 71.0), (45, 12, 219.0), (45, 6, 128.0), (45, 4, 88.0), (90, 13, 358.0), (175, 25, 1043.0)];
        for (cells, depth, found) in measured {
            let ratio = evaluations_from_continuum(cells, depth) / found;
            assert!((0.8..1.25).contains(&ratio), "{cells} x {depth}: {ratio}");
        }
    }
}

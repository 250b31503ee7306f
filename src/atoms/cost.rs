//! What LAMMPS will take for a block: memory, force evaluations, time, from what blocks of 8 to 98 nm have taken.

use super::job_spec::FORCE_TOLERANCE;

/// Resident memory of one process at its largest, of which some 50 MB are the program. From the continuum: 63, 129, 399 and 2351 MB for
/// 7839, 119 151, 509 004 and 3 394 475 atoms. From first touch positions are kept for the start of the next step: 143 MB for
/// 119 151.
const MEMORY_BASE_BYTES: u64 = 50_000_000;
const MEMORY_BYTES_PER_ATOM: u64 = 680;
const MEMORY_BYTES_PER_ATOM_OF_A_LADDER: u64 = 870;

/// One core of an EPYC server, potential cut-off 7.0 Å, the `opt` variants: 0.42 to 0.43 µs over three whole ladders of
/// 119 151 atoms. Relaxing rarely rebuilds a neighbour list, so this is half of what a step of dynamics takes. [`super::speed`]
/// measures it here.
pub const SECONDS_PER_ATOM_EVALUATION: f64 = 0.45e-6;

/// Every step clears LAMMPS, reads a state and writes one: 0.66 s for the four of 7839 atoms beyond their force evaluations.
const SECONDS_PER_STEP: f64 = 0.16;

/// Force evaluations that relax the free block: 24 for 7839 as for 3 394 475 atoms.
const FREE: f64 = 24.0;

/// Force evaluations of one load that starts from the continuum, of a block of one lattice constant. The longest waves settle last, so
/// that they grow with extent and depth, with the exponents below: on average 71, 219, 128, 88, 358 and 1043 for 15 × 6, 45 × 12, 45 × 6,
/// 45 × 4, 90 × 13 and 175 × 25 lattice constants, where p/E* = 0.003, 0.01 and (but for the last two) 0.03 were asked; 294 for 90 × 13 with
/// the script as it is. (The largest was asked for 0.05 eV/Å, before that ended loads by what indenter and base carry.)
const EVALUATIONS: f64 = 3.1;
const GROWTH_WITH_EXTENT: f64 = 0.6;
const GROWTH_WITH_DEPTH: f64 = 0.8;

/// Where a tolerance above the tight one is asked for, which ends loads by what indenter and base carry, they grow as this power of those,
/// times a number, and are no more: 152, 279 and 442 for 45 × 12, 90 × 13 and 175 × 25.
const LOOSE: (f64, f64) = (2.9, 0.75);

/// Share of them in a step of 0.3 Å from first touch: 31 there, 120 to 160 in contact, up to 430 where slip begins (45 × 12, ladder to
/// p/E* = 0.033).
const STEP: f64 = 0.72;

/// Force evaluations of one load that starts from the continuum, to a largest force in eV/Å.
pub fn evaluations_from_continuum(cells: usize, depth_cells: usize, force_tolerance: f64) -> f64 {
    let tight = EVALUATIONS * (cells as f64).powf(GROWTH_WITH_EXTENT) * (depth_cells as f64).powf(GROWTH_WITH_DEPTH);
    if force_tolerance > FORCE_TOLERANCE { tight.min(LOOSE.0 * tight.powf(LOOSE.1)) } else { tight }
}

/// What a job of LAMMPS is foreseen to do: loads from the continuum, or steps from first touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LoadingMode {
    PrescribedLoads { number: usize, force_tolerance: f64 },
    RampSteps(f64),
}

/// Force evaluations of a whole job.
pub fn evaluations(cells: usize, depth_cells: usize, way: LoadingMode) -> f64 {
    FREE + match way {
        LoadingMode::PrescribedLoads { number, force_tolerance } => {
            evaluations_from_continuum(cells, depth_cells, force_tolerance) * number as f64
        }
        LoadingMode::RampSteps(steps) => STEP * evaluations_from_continuum(cells, depth_cells, FORCE_TOLERANCE) * steps,
    }
}

/// Seconds of a job on so many ranks, where a force evaluation takes one of them `each` seconds an atom.
pub fn seconds(atoms: u64, evaluations: f64, way: LoadingMode, each: f64, ranks: usize) -> f64 {
    let steps = match way {
        LoadingMode::PrescribedLoads { number, .. } => number as f64,
        LoadingMode::RampSteps(steps) => steps,
    };
    SECONDS_PER_STEP * (1.0 + steps) + atoms as f64 * each * evaluations / ranks as f64
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

    /// Of the loads that were measured, tight and loose.
    #[test]
    fn evaluations_grow_with_extent_and_depth() {
        let tight = [
            (15, 6, 71.0),
            (45, 12, 219.0),
            (45, 6, 128.0),
            (45, 4, 88.0),
            (90, 13, 358.0),
            (90, 13, 294.0),
            (175, 25, 1043.0),
        ];
        let loose = [(45, 12, 152.0), (90, 13, 279.0), (175, 25, 442.0)];
        let measured = tight.iter().map(|m| (FORCE_TOLERANCE, m)).chain(loose.iter().map(|m| (0.4, m)));
        for (tolerance, &(cells, depth, found)) in measured {
            let ratio = evaluations_from_continuum(cells, depth, tolerance) / found;
            assert!((0.8..1.25).contains(&ratio), "{cells} x {depth}, {tolerance}: {ratio}");
        }
    }

    /// Whole stages of LAMMPS, as one idle machine took them: a factor of two is what a plan promises.
    #[test]
    fn stages_take_what_was_measured() {
        let loads = |force_tolerance| LoadingMode::PrescribedLoads { number: 3, force_tolerance };
        let measured = [
            (7839, (15, 6), loads(FORCE_TOLERANCE), 1, 1.68),
            (119_151, (45, 12), loads(FORCE_TOLERANCE), 1, 43.5),
            (3_394_475, (175, 25), loads(0.4), 2, 1883.0),
        ];
        for (atoms, (cells, depth), way, ranks, took) in measured {
            let told = seconds(atoms, evaluations(cells, depth, way), way, 0.545e-6, ranks);
            assert!((0.5..2.0).contains(&(told / took)), "{atoms} atoms: {told} s, took {took} s");
        }
    }
}

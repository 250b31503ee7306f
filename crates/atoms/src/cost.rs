//! Estimated cost of LAMMPS runs: memory, force evaluations and time, from runs of blocks of 8 to 98 nm.

use super::job_spec::FORCE_TOLERANCE;

/// Peak resident memory of one process, of which about 50 MB are the program. Prescribed loads: 63, 129, 399 and 2351
/// MB for 7839, 119 151, 509 004 and 3 394 475 atoms. A displacement ramp also stores the previous positions: 143 MB
/// for 119 151.
const MEMORY_BASE_BYTES: u64 = 50_000_000;
const MEMORY_BYTES_PER_ATOM: u64 = 680;
const MEMORY_BYTES_PER_ATOM_OF_LOAD_STEPS: u64 = 870;

/// One core of an EPYC server, potential cut-off 7.0 Å, `opt` variants: 0.42 to 0.43 µs over three displacement ramps
/// of 119 151 atoms. Relaxation rarely rebuilds a neighbour list, so this is half the time of a molecular-dynamics
/// step. [`super::speed`] measures it on this machine.
pub const SECONDS_PER_ATOM_EVALUATION: f64 = 0.45e-6;

/// Each step clears LAMMPS, reads a state and writes one: 0.66 s for the four steps of 7839 atoms beyond their force
/// evaluations.
const SECONDS_PER_STEP: f64 = 0.16;

/// Force evaluations that relax the free block: 24 for 7839 and for 3 394 475 atoms.
const FREE: f64 = 24.0;

/// Force evaluations of one prescribed load for a block of one lattice constant. The longest waves converge last, so
/// the number grows with extent and depth, with the exponents below: on average 71, 219, 128, 88, 358 and 1043 for 15
/// × 6, 45 × 12, 45 × 6, 45 × 4, 90 × 13 and 175 × 25 lattice constants at p/E* = 0.003, 0.01 and (but for the last
/// two) 0.03; 294 for 90 × 13 with the current script. (The largest block had a tolerance of 0.05 eV/Å, before loose
/// tolerances ended loads by the balance of forces.)
const EVALUATIONS: f64 = 3.1;
const GROWTH_WITH_EXTENT: f64 = 0.6;
const GROWTH_WITH_DEPTH: f64 = 0.8;

/// With a loose tolerance, which ends loads by the balance of the forces on indenter and base: factor and power of
/// the number above, which is the maximum. 152, 279 and 442 for 45 × 12, 90 × 13 and 175 × 25.
const LOOSE: (f64, f64) = (2.9, 0.75);

/// Force evaluations of a ramp step of 0.3 Å over those of a prescribed load: 31 before contact, 120 to 160 in
/// contact, up to 430 at the onset of slip (45 × 12, up to p/E* = 0.033).
const STEP: f64 = 0.72;

/// Force evaluations of one prescribed load, relaxed to a largest force in eV/Å.
pub fn evaluations_from_continuum(cells: usize, depth_cells: usize, force_tolerance: f64) -> f64 {
    let tight = EVALUATIONS * (cells as f64).powf(GROWTH_WITH_EXTENT) * (depth_cells as f64).powf(GROWTH_WITH_DEPTH);
    if force_tolerance > FORCE_TOLERANCE { tight.min(LOOSE.0 * tight.powf(LOOSE.1)) } else { tight }
}

/// Loading of a planned job: prescribed loads, or steps of a displacement ramp.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LoadingMode {
    PrescribedLoads { number: usize, force_tolerance: f64 },
    RampSteps(f64),
}

/// Force evaluations of a whole job.
pub fn evaluations(cells: usize, depth_cells: usize, mode: LoadingMode) -> f64 {
    FREE + match mode {
        LoadingMode::PrescribedLoads { number, force_tolerance } => {
            evaluations_from_continuum(cells, depth_cells, force_tolerance) * number as f64
        }
        LoadingMode::RampSteps(steps) => STEP * evaluations_from_continuum(cells, depth_cells, FORCE_TOLERANCE) * steps,
    }
}

/// Seconds of a job on `ranks` processes, where a force evaluation takes one process `each` seconds per atom.
pub fn seconds(atoms: u64, evaluations: f64, mode: LoadingMode, each: f64, ranks: usize) -> f64 {
    let steps = match mode {
        LoadingMode::PrescribedLoads { number, .. } => number as f64,
        LoadingMode::RampSteps(steps) => steps,
    };
    SECONDS_PER_STEP * (1.0 + steps) + atoms as f64 * each * evaluations / ranks as f64
}

/// Resident memory of all LAMMPS ranks together, bytes; `steps`: displacement ramp instead of prescribed loads.
pub fn memory_bytes(atoms: u64, ranks: usize, steps: bool) -> u64 {
    let per_atom = if steps { MEMORY_BYTES_PER_ATOM_OF_LOAD_STEPS } else { MEMORY_BYTES_PER_ATOM };
    // A damaged job file may claim any number of atoms.
    (ranks as u64 * MEMORY_BASE_BYTES).saturating_add(atoms.saturating_mul(per_atom))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Scenes of 8 to 98 nm, including the base.
    #[test]
    fn memory_agrees_with_the_measurements() {
        for (atoms, measured) in [(7839, 63e6), (119_151, 129e6), (509_004, 399e6), (3_394_475, 2.351e9)] {
            let ratio = memory_bytes(atoms, 1, false) as f64 / measured;
            assert!((0.8..1.2).contains(&ratio), "{atoms}: {ratio}");
        }
    }

    /// Measured loads with tight and loose tolerances.
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
        for (tolerance, &(cells, depth, actual)) in measured {
            let ratio = evaluations_from_continuum(cells, depth, tolerance) / actual;
            assert!((0.8..1.25).contains(&ratio), "{cells} x {depth}, {tolerance}: {ratio}");
        }
    }

    /// Whole LAMMPS stages on one idle machine; a plan is accurate to a factor of two.
    #[test]
    fn times_agree_with_the_measurements_to_a_factor_of_two() {
        let loads = |force_tolerance| LoadingMode::PrescribedLoads { number: 3, force_tolerance };
        let measured = [
            (7839, (15, 6), loads(FORCE_TOLERANCE), 1, 1.68),
            (119_151, (45, 12), loads(FORCE_TOLERANCE), 1, 43.5),
            (3_394_475, (175, 25), loads(0.4), 2, 1883.0),
        ];
        for (atoms, (cells, depth), mode, ranks, took) in measured {
            let planned = seconds(atoms, evaluations(cells, depth, mode), mode, 0.545e-6, ranks);
            assert!((0.5..2.0).contains(&(planned / took)), "{atoms} atoms: {planned} s, took {took} s");
        }
    }
}

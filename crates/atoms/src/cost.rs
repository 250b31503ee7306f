//! Estimated cost of LAMMPS runs: memory, force evaluations and time, from runs of blocks of 8 to 98 nm.

use super::block::{BaseKind, Block, MAX_ATOMS};
use super::job_spec::{FORCE_TOLERANCE, Minimizer};
use asperity_contact::interface::{HarmonicBlock, LatticeBoundary};

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

/// Force evaluations of one prescribed load by the harmonic relaxation, and of the free block, whatever its size. Measured: 4, 6 and 6 at the
/// loads of 15 × 6 lattice constants, and 5, 6, 6, 6 and 7 at those of 45 × 12 under a profile with a resolved rms gradient of 0.2. Where the
/// crystal slips this is a lower estimate: 10, 26 and 87 on 45 × 12 with a resolved gradient of 0.37.
const HARMONIC_LOAD: f64 = 8.0;

/// Of one ramp step by the harmonic relaxation: 103 evaluations of 34 steps of 0.3 Å and less with adhesion (`calcium-8nm-adhesion.toml`).
const HARMONIC_STEP: f64 = 3.0;

/// Time of the harmonic relaxation beyond each force evaluation, in force evaluations of one process: 0.3 to 0.6 on 25 nm, more where the crystal
/// slips. Every rank does all of it.
const HARMONIC_OVERHEAD: f64 = 0.5;

/// Measurement of the force constants before the first step, unless an earlier run has made it.
const SECONDS_OF_FORCE_CONSTANTS: f64 = 1.5;

/// Pairs of the harmonic relaxation at most and at least, and the bytes of more than the least.
const MOST_PAIRS: usize = 30;
const FEWEST_PAIRS: usize = 6;
const BYTES_OF_PAIRS: u64 = 1_000_000_000;

/// Fields of amplitudes of the harmonic relaxation besides those of the pairs: residual and response of two states, of the wall and of a step.
const HARMONIC_FIELDS: u64 = 8;

/// Step, its part that has been applied, increment, positions and forces, these twice: three numbers each.
const HARMONIC_BYTES_PER_ATOM: u64 = 7 * 24;

/// Largest range of a potential of which memory is estimated, layers: a damaged job file may have any.
const MOST_LAYERS_OF_BASE: usize = 1000;

/// What relaxes the steps of a planned job.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Relaxer {
    /// LAMMPS's own minimisers.
    #[default]
    Lammps,
    /// The harmonic relaxation.
    Harmonic,
}

impl Relaxer {
    /// `library`: whether that of LAMMPS can be loaded, on which [`Minimizer::Auto`] depends.
    pub fn of(minimizer: Minimizer, library: impl FnOnce() -> bool) -> Self {
        match minimizer {
            Minimizer::Harmonic => Relaxer::Harmonic,
            Minimizer::Auto if library() => Relaxer::Harmonic,
            Minimizer::Auto | Minimizer::Fire => Relaxer::Lammps,
        }
    }
}

/// Force evaluations of one prescribed load. LAMMPS relaxes it to a largest force in eV/Å; the harmonic relaxation takes as many for every
/// block and tolerance, and more where the crystal slips.
pub fn evaluations_from_continuum(cells: usize, depth_cells: usize, force_tolerance: f64, relaxer: Relaxer) -> f64 {
    if relaxer == Relaxer::Harmonic {
        return HARMONIC_LOAD;
    }
    let tight = EVALUATIONS * (cells as f64).powf(GROWTH_WITH_EXTENT) * (depth_cells as f64).powf(GROWTH_WITH_DEPTH);
    if force_tolerance > FORCE_TOLERANCE { tight.min(LOOSE.0 * tight.powf(LOOSE.1)) } else { tight }
}

/// Loading of a planned job: prescribed loads, or steps of a displacement ramp.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LoadingMode {
    PrescribedLoads { number: usize, force_tolerance: f64 },
    RampSteps(f64),
}

/// Force evaluations of a whole job; by the harmonic relaxation a lower estimate where the crystal slips.
pub fn evaluations(cells: usize, depth_cells: usize, mode: LoadingMode, relaxer: Relaxer) -> f64 {
    let of_load = |tolerance| evaluations_from_continuum(cells, depth_cells, tolerance, relaxer);
    let (free, step) = match relaxer {
        Relaxer::Lammps => (FREE, STEP * of_load(FORCE_TOLERANCE)),
        Relaxer::Harmonic => (HARMONIC_LOAD, HARMONIC_STEP),
    };
    free + match mode {
        LoadingMode::PrescribedLoads { number, force_tolerance } => of_load(force_tolerance) * number as f64,
        LoadingMode::RampSteps(steps) => step * steps,
    }
}

/// Seconds of a job on `ranks` processes, where a force evaluation takes one process `each` seconds per atom.
pub fn seconds(atoms: u64, evaluations: f64, (mode, relaxer): (LoadingMode, Relaxer), each: f64, ranks: usize) -> f64 {
    let steps = match mode {
        LoadingMode::PrescribedLoads { number, .. } => number as f64,
        LoadingMode::RampSteps(steps) => steps,
    };
    let (once, overhead) = match relaxer {
        Relaxer::Lammps => (0.0, 0.0),
        Relaxer::Harmonic => (SECONDS_OF_FORCE_CONSTANTS, HARMONIC_OVERHEAD),
    };
    once + SECONDS_PER_STEP * (1.0 + steps) + atoms as f64 * each * evaluations * (1.0 / ranks as f64 + overhead)
}

/// Resident memory of all LAMMPS ranks together, bytes; `steps`: displacement ramp instead of prescribed loads.
pub fn memory_bytes(atoms: u64, ranks: usize, steps: bool) -> u64 {
    let per_atom = if steps { MEMORY_BYTES_PER_ATOM_OF_LOAD_STEPS } else { MEMORY_BYTES_PER_ATOM };
    // A damaged job file may claim any number of atoms.
    (ranks as u64 * MEMORY_BASE_BYTES).saturating_add(atoms.saturating_mul(per_atom))
}

/// Pairs that the harmonic relaxation keeps, two fields of `field_bytes` each: as many as a gigabyte holds, from 6 to 30.
pub fn pairs_kept(field_bytes: u64) -> usize {
    let fit = BYTES_OF_PAIRS / field_bytes.saturating_mul(2).max(1);
    usize::try_from(fit).unwrap_or(MOST_PAIRS).clamp(FEWEST_PAIRS, MOST_PAIRS)
}

/// Memory of each rank beyond that of LAMMPS where LAMMPS is a library, bytes: an elastic base, and the harmonic relaxation of a job that
/// `relaxes` by it. The base is as thick as the range of the potential, which is not known here: an atom is taken to be coupled to twice as many
/// layers.
pub fn library_bytes(block: &Block, relaxes: bool) -> u64 {
    let elastic = block.base == BaseKind::Elastic;
    // A damaged job file may claim any block.
    let per_layer = (block.cells as u64).checked_mul(block.cells as u64).and_then(|a| a.checked_mul(2));
    let layers = block.depth_cells.checked_mul(2).and_then(|d| d.checked_add(block.base_layers));
    let atoms =
        per_layer.zip(layers).and_then(|(a, l)| a.checked_mul(l as u64)).filter(|a| (1..=MAX_ATOMS).contains(a));
    let is_block = block.depth_cells > 0 && (1..=MOST_LAYERS_OF_BASE).contains(&block.base_layers);
    let Some(atoms) = atoms.filter(|_| is_block) else {
        return if elastic || relaxes { u64::MAX } else { 0 };
    };
    let boundary = if elastic { LatticeBoundary::bytes(block.cells, block.base_layers) } else { 0 };
    let (moving, reach) =
        if elastic { (block.layers(), block.base_layers) } else { (2 * block.depth_cells, 2 * block.base_layers) };
    if !relaxes {
        return boundary;
    }
    let [matrices, field] = HarmonicBlock::<f32>::bytes(block.cells, moving, reach);
    boundary + matrices + (HARMONIC_FIELDS + 2 * pairs_kept(field) as u64) * field + HARMONIC_BYTES_PER_ATOM * atoms
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
            let ratio = evaluations_from_continuum(cells, depth, tolerance, Relaxer::Lammps) / actual;
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
            let count = evaluations(cells, depth, mode, Relaxer::Lammps);
            let planned = seconds(atoms, count, (mode, Relaxer::Lammps), 0.545e-6, ranks);
            assert!((0.5..2.0).contains(&(planned / took)), "{atoms} atoms: {planned} s, took {took} s");
        }
    }

    /// Loads that the harmonic relaxation took on one machine; at the last three the crystal slips.
    #[test]
    fn harmonic_evaluations_agree_with_the_measurements_while_the_crystal_is_elastic() {
        let elastic: [((usize, usize), &[u32]); 2] = [((15, 6), &[4, 6, 6]), ((45, 12), &[5, 6, 6, 6, 7])];
        let mode = |number| LoadingMode::PrescribedLoads { number, force_tolerance: FORCE_TOLERANCE };
        for ((cells, depth), measured) in elastic {
            for actual in measured {
                let ratio = evaluations_from_continuum(cells, depth, 0.4, Relaxer::Harmonic) / f64::from(*actual);
                assert!((1.0..=2.0).contains(&ratio), "{cells} x {depth}: {ratio}");
            }
        }
        let slip: u32 = [10, 26, 91].iter().sum();
        assert!(evaluations(45, 12, mode(3), Relaxer::Harmonic) < f64::from(slip));
        // Processor time of the five loads.
        let planned =
            |relaxer| seconds(119_151, evaluations(45, 12, mode(5), relaxer), (mode(5), relaxer), 0.545e-6, 1);
        for (relaxer, took) in [(Relaxer::Harmonic, 8.5), (Relaxer::Lammps, 52.4)] {
            let ratio = planned(relaxer) / took;
            assert!((0.5..2.0).contains(&ratio), "{relaxer:?}: {ratio}");
        }
    }

    #[test]
    fn the_harmonic_relaxation_is_expected_where_its_library_is_found() {
        let of = |minimizer, found| Relaxer::of(minimizer, || found);
        assert_eq!([true, false].map(|f| of(Minimizer::Auto, f)), [Relaxer::Harmonic, Relaxer::Lammps]);
        assert_eq!([true, false].map(|f| of(Minimizer::Harmonic, f)), [Relaxer::Harmonic; 2]);
        assert_eq!([true, false].map(|f| of(Minimizer::Fire, f)), [Relaxer::Lammps; 2]);
    }

    /// Blocks of 8 to 98 nm.
    #[test]
    fn pairs_fill_a_gigabyte_at_most() {
        for (cells, layers, pairs) in [(15, 12, 30), (45, 24, 30), (90, 26, 30), (175, 50, 12), (600, 50, 6)] {
            let [_, field] = HarmonicBlock::<f32>::bytes(cells, layers, 4);
            assert_eq!(pairs_kept(field), pairs, "{cells}");
            assert!(pairs == FEWEST_PAIRS || 2 * field * pairs as u64 <= BYTES_OF_PAIRS, "{cells}");
        }
        assert_eq!((pairs_kept(0), pairs_kept(u64::MAX)), (MOST_PAIRS, FEWEST_PAIRS));
    }

    /// 24 bytes per pair and atom, here thirty pairs, and about 370 for the rest.
    #[test]
    fn memory_of_the_harmonic_relaxation_is_that_of_its_pairs() {
        let block = Block::new(45, 12, 5.5884, 7.0).expect("a block");
        let per_atom = library_bytes(&block, true) as f64 / block.deformable() as f64;
        assert!((800.0..1200.0).contains(&per_atom), "{per_atom}");
        assert_eq!(library_bytes(&block, false), 0);
        let elastic = Block::new(45, 2, 5.5884, 7.0).and_then(|b| b.on_elastic_base(10, 7.0)).expect("a block");
        let [base, both] = [false, true].map(|relaxes| library_bytes(&elastic, relaxes));
        assert!(base == LatticeBoundary::bytes(45, 4) && both > 2 * base, "{base} {both}");
    }

    #[test]
    fn any_block_of_a_damaged_job_has_some_memory() {
        let block = Block::new(45, 12, 5.5884, 7.0).expect("a block");
        for base in [BaseKind::Rigid, BaseKind::Elastic] {
            for n in [0, 1, 2000, usize::MAX] {
                for damaged in [
                    Block { cells: n, base, ..block },
                    Block { depth_cells: n, base, ..block },
                    Block { base_layers: n, base, ..block },
                ] {
                    assert!(library_bytes(&damaged, true) > 0, "{damaged:?}");
                }
            }
        }
    }
}

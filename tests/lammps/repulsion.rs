//! Repulsion and contact distance of the indenter: scaled to another crystal, and given.

use crate::jobs::{built, case, on};
use crate::lammps::{Lammps, lammps};
use crate::similar_crystal::{self, ALUMINIUM, CALCIUM};
use asperity::atoms::engine::Finished;
use asperity::atoms::indenter::CLEARANCE_ANGSTROM;
use asperity::atoms::job::Job;
use asperity::atoms::load_history::StepRecord;
use asperity::atoms::results::AtomState;
use asperity::pipeline::read_atoms;
use asperity::scene::Case;
use std::path::Path;

/// LAMMPS at all loads of a case, and the states that are read from its frames.
fn run(lammps: &Lammps, case: &Case, folder: &Path) -> (Job, Finished, Vec<AtomState>) {
    let job = built(case, folder);
    let finished = lammps.run(&job, &mut on).expect("a clean run");
    let read = folder.join("read");
    std::fs::create_dir(&read).expect("made");
    let found = read_atoms(case, case.atoms.as_ref().expect("atoms"), &job, &read).expect("read");
    (job, finished, found.states)
}

/// Displacements over the lattice constant, and mean gaps, may differ by this share: forces are relaxed to 2e-3 eV/Å in both crystals.
const SAME_LENGTH: f64 = 2e-4;

/// A crystal similar to the shipped one in other units has the same contact at the same p*, under an indenter that is scaled to it. Under
/// calcium's indenter it has another.
#[test]
fn a_similar_crystal_under_the_scaled_indenter_is_the_same_problem() {
    let Some(lammps) = lammps(1) else { return };
    let scratch = tempfile::tempdir().expect("scratch");
    let other = similar_crystal::keys(&scratch.path().join("Al.eam.alloy"));
    let calciums = format!(
        "{other}indenter_epsilon = \"0.2145 eV\"\nindenter_sigma = \"3.5927 Å\"\ncontact_distance = \"4.0354 Å\"\n"
    );
    let of =
        |name: &str, atoms: &str| run(&lammps, &case("p_star = [0.02, 0.06]", "", atoms), &scratch.path().join(name));
    let (_, calcium, states) = of("calcium", "");
    let (_, aluminium, same) = of("aluminium", &other);
    let (_, _, wrong) = of("calciums", &calciums);
    for ((here, there), wrong) in states.iter().zip(&same).zip(&wrong) {
        assert!(
            here.contacts > 5 && here.contacts.abs_diff(there.contacts) <= 1,
            "{} {}",
            here.contacts,
            there.contacts
        );
        let gaps = [here.mean_gap_angstrom / CALCIUM.0, there.mean_gap_angstrom / ALUMINIUM.0];
        assert!((gaps[1] / gaps[0] - 1.0).abs() < SAME_LENGTH, "{gaps:?}");
        assert!(wrong.contacts > here.contacts + 1, "{} {}", wrong.contacts, here.contacts);
    }
    for (here, there) in calcium.history.steps.iter().zip(&aluminium.history.steps).skip(1) {
        // The clearance before first contact is the same length in both.
        let over = |record: &StepRecord, a0: f64| (record.displacement_angstrom - CLEARANCE_ANGSTROM) / a0;
        let down = [over(here, CALCIUM.0), over(there, ALUMINIUM.0)];
        assert!((down[1] / down[0] - 1.0).abs() < SAME_LENGTH, "{down:?}");
    }
}

/// LAMMPS has the constants that the scene gives; the contact distance changes the count and nothing else. The largest is beyond the
/// usual lists of neighbours, with which LAMMPS sums in another order: the harmonic relaxation then ends elsewhere within its tolerance (loads
/// 6e-6 apart), conjugate gradients in the same state.
#[test]
fn given_constants_reach_lammps_and_the_count() {
    let Some(lammps) = lammps(1) else { return };
    let scratch = tempfile::tempdir().expect("scratch");
    let mut earlier: Option<(f64, usize, usize)> = None;
    for d_c in [3.9, 4.4, 5.3] {
        let keys = format!(
            "indenter_epsilon = \"0.3 eV\"\nindenter_sigma = \"3.4 Å\"\ncontact_distance = \"{d_c} Å\"\nstep = \"0.8 Å\"\n\
             minimizer = \"fire\"\n"
        );
        let folder = scratch.path().join(d_c.to_string());
        let case = case("p_star = [0.03]", "", &keys);
        let (job, finished, states) = run(&lammps, &case, &folder);
        let spec = &job.spec;
        assert_eq!((spec.interaction.epsilon_ev, spec.interaction.sigma_angstrom), (0.3, 3.4));
        assert_eq!(spec.settings.contact_angstrom, d_c);
        let log = std::fs::read_to_string(folder.join("log.0")).expect("a log");
        assert!(log.contains("\npair_coeff 1 2 lj/cut 0.3 3.4 3.8163"), "the pair term of LAMMPS");
        assert!(log.contains(&format!("\ncompute neighbours block    coord/atom cutoff {d_c} 2")), "its criterion");
        // A frame holds all contact atoms of LAMMPS: their number by the positions is LAMMPS's own.
        let last = finished.history.steps.last().expect("steps");
        let counted = counted(&case, &job, last.step, last.displacement_angstrom);
        assert_eq!(counted, last.contacts, "d_c = {d_c}");
        let [state] = &states[..] else { panic!("one load") };
        let by = &state.criteria[0];
        assert_eq!((by.criterion.as_str(), by.atoms), (&*format!("an indenter atom within {d_c} Å"), state.contacts));
        if let Some((load, contacts, read)) = earlier {
            assert!(last.contacts > contacts + 3 && (last.load / load - 1.0).abs() < 1e-6, "d_c = {d_c}: {last:?}");
            assert!(state.contacts > read + 3, "d_c = {d_c}: {} {read}", state.contacts);
        }
        earlier = Some((last.load, last.contacts, state.contacts));
    }
}

/// Atoms of a step within the job's contact distance of the indenter.
fn counted(case: &Case, job: &Job, step: usize, down: f64) -> usize {
    use asperity::atoms::contact::contact;
    use asperity::atoms::dump::read_frame;
    use asperity::atoms::indenter::Indenter;
    use asperity::atoms::load_history::frame_file;
    let atoms = case.atoms.as_ref().expect("atoms");
    let heights = atoms.heights_angstrom(case.surface(), asperity::grid::Grid::unit(atoms.points, atoms.points));
    let touch = atoms.wall.minimum_angstrom();
    let indenter = Indenter::above(&atoms.block, atoms.points, heights, touch).expect("an indenter");
    let frame = read_frame(frame_file(&job.folder, step).expect("a frame")).expect("good");
    contact(&frame, &indenter, down, &atoms.block.surface(), job.spec.settings.contact_angstrom).ids.len()
}

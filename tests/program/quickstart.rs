//! The shipped quickstart scene. Atoms and continuum agree on equal contact criteria, within the limits that the
//! project states. It takes some three minutes, mostly for LAMMPS.

use crate::lammps::lammps;
use crate::program::{asperity, json_line, stderr};
use asperity::atoms::initial_configuration::LOAD_TOLERANCE;
use asperity::record::results::{CriterionMatch, LoadComparison, Results};
use std::path::Path;

/// Relative difference of the contact fractions of atoms and matched continuum. Of the 4050 surface atoms some 150 are
/// in contact at the lowest load. Measured: 4, 5 and 6 %; ten atoms more or less would be 6 % there, so that a changed
/// state shows.
const FRACTION: f64 = 0.07;

/// Difference of the mean gaps of atoms and compliant wall, Å. Measured: 0.03, 0.02 and −0.01.
const MEAN_GAP_ANGSTROM: f64 = 0.03;

/// Cohen's κ of the matched contact map. Measured: 0.947, 0.959 and 0.942.
const KAPPA: f64 = 0.93;

/// Smallest difference of κ between the matched map and the same map shifted, whose κ is about 0.
const ABOVE_CHANCE: f64 = 0.5;

/// Force balance of every continuum state.
const LOAD_BALANCE: f64 = 1e-9;

const LOADS: [f64; 3] = [0.003, 0.01, 0.03];

fn criterion<'a>(load: &'a LoadComparison, id: &str) -> &'a CriterionMatch {
    load.continuum.iter().find(|m| m.id == id).unwrap_or_else(|| panic!("no criterion {id:?}"))
}

#[test]
fn the_quickstart_gives_the_documented_results() {
    let Some(_lammps) = lammps(1) else { return };
    // Kept after the test for inspection, but never continued: every part of it is computed here.
    let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join("quickstart");
    if out.exists() {
        std::fs::remove_dir_all(&out).expect("removed");
    }
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/quickstart.toml");
    let output = asperity().arg("run").arg(scene).arg("--out").arg(&out).arg("--json").output().expect("started");
    assert!(output.status.success(), "{}", stderr(&output));
    let answer = json_line(&output);
    assert!(!stderr(&output).contains("above the force tolerance"), "{}", stderr(&output));
    let results = Results::read(&out).expect("results.json");

    let stages: Vec<&str> = results.stages.iter().filter(|s| !s.reused).map(|s| s.name.as_str()).collect();
    assert_eq!(stages, ["surface", "continuum", "matched", "lammps", "atoms", "compare"]);
    let comparison = results.comparison.as_ref().expect("a comparison");
    let laboratory = results.continuum.as_ref().expect("a continuum");
    for solved in [laboratory, &comparison.hard_wall, &comparison.compliant_wall] {
        assert_eq!(solved.states.iter().map(|s| s.p_star).collect::<Vec<_>>(), LOADS);
        assert!(
            solved
                .states
                .iter()
                .all(|s| s.stop == asperity::contact::load::Stop::Converged && s.load_error.abs() < LOAD_BALANCE)
        );
        assert!(solved.states.windows(2).all(|w| w[1].contact_area > w[0].contact_area));
        assert!(solved.states.windows(2).all(|w| w[1].mean_gap < w[0].mean_gap));
    }

    assert_eq!(comparison.loads.iter().map(|l| l.p_star).collect::<Vec<_>>(), LOADS);
    for load in &comparison.loads {
        let (atoms, matched) = (load.atoms.contact_area, criterion(load, "compliant_wall"));
        let ratio = matched.contact_area / atoms;
        println!(
            "p* = {}: atoms {atoms:.5}, matched {:.5}, κ {:.3}",
            load.p_star, matched.contact_area, matched.overlap.kappa
        );
        assert!((ratio - 1.0).abs() <= FRACTION, "p* = {}: {ratio:.3} of the atoms' contact", load.p_star);
        let apart = load.atoms_mean_gap_angstrom - load.compliant_wall_mean_gap_angstrom;
        assert!(apart.abs() <= MEAN_GAP_ANGSTROM, "p* = {}: mean gaps {apart:.3} Å apart", load.p_star);
        assert_eq!(load.registration, [0, 0], "p* = {}: the maps are out of register", load.p_star);
        assert!(matched.overlap.kappa > matched.shifted.kappa + ABOVE_CHANCE, "p* = {}: {matched:?}", load.p_star);
        assert!(matched.overlap.jaccard > matched.shifted.jaccard, "p* = {}: {matched:?}", load.p_star);
        assert!(matched.overlap.kappa >= KAPPA, "{matched:?}");
        // The agreement is due to the criterion: zero gap alone agrees less, measured: 0.70 to 0.74.
        assert!(criterion(load, "hard_wall").overlap.kappa < matched.overlap.kappa - 0.15, "{load:?}");
    }

    let atoms = results.atoms.as_ref().expect("atoms");
    assert!(atoms.load_steps.windows(2).all(|w| w[1].displacement_angstrom > w[0].displacement_angstrom));
    let last = atoms.load_steps.last().expect("steps");
    assert!((last.p_star / 0.03 - 1.0).abs() <= LOAD_TOLERANCE, "the atoms end at p* = {}", last.p_star);
    for state in &atoms.states {
        let files = [Some(&state.contact_map), Some(&state.gap_map), state.frame.as_ref()];
        for file in files.map(|f| f.expect("named")) {
            assert!(out.join(file).metadata().expect(file).len() > 0);
        }
    }

    assert_eq!(answer["report"].as_str(), out.join("report.html").to_str());
    let page = std::fs::read_to_string(out.join("report.html")).expect("a report");
    for piece in ["<svg", "data:image/png;base64,", "κ", "Jaccard"] {
        assert!(page.contains(piece), "the report lacks {piece}");
    }
}

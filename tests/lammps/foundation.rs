//! A shallow block on an elastic foundation, compared with the deep block that it replaces and with a shallow block on
//! a rigid base.

use crate::jobs::{built, case, on, surface};
use crate::lammps::lammps;
use asperity::atoms::block::Block;
use asperity::atoms::engine::{Finished, LammpsEngine};
use asperity::pipeline::{OutFolder, Silent, run};
use asperity::scene::{Case, Foundation};
use std::path::Path;

const LOADS: [f64; 2] = [0.02, 0.06];
/// Depth of the deep block, and of the deformable part of the shallow one, lattice constants.
const DEEP: usize = 6;
const SHALLOW: usize = 3;

struct LayerDisplacementField {
    block: Block,
    found: Finished,
    /// Per load: displacements of the surface atoms from their sites along x, y and z, Å.
    moved: Vec<Vec<[f64; 3]>>,
}

fn of_depth(depth_cells: usize, foundation_cells: usize, loads: &[f64]) -> Case {
    let mut scene = case(&format!("p_star = {loads:?}"), "", "").scene;
    let atoms = scene.atoms.as_mut().expect("atoms");
    (atoms.depth_cells, atoms.foundation_cells) = (depth_cells, Foundation::Cells(foundation_cells));
    Case::resolve(scene, Path::new("smooth.toml")).expect("a case")
}

fn pressed(engine: &LammpsEngine, depth_cells: usize, foundation_cells: usize) -> LayerDisplacementField {
    let case = of_depth(depth_cells, foundation_cells, &LOADS);
    let folder = tempfile::tempdir().expect("scratch");
    let job = built(&case, folder.path());
    let found = engine.run(&job, &mut on).expect("a clean run");
    assert!(found.unconverged.is_empty());
    let moved = (1..=LOADS.len()).map(|step| surface(&case, &job.folder, step)).collect();
    LayerDisplacementField { block: case.atoms.expect("atoms").block, moved, found }
}

/// Root mean square distance between two surfaces, Å.
fn apart(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let square = |(a, b): (&[f64; 3], &[f64; 3])| (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>();
    (a.iter().zip(b).map(square).sum::<f64>() / a.len() as f64).sqrt()
}

/// Displacement error of the surface on a foundation over that on a rigid base. Measured: 0.26 at the lower load. The
/// foundation is isotropic and linear, and only three cells below the contact.
const OF_RIGID: f64 = 0.4;
/// Atoms at the edge of contact, within 0.01 Å of the contact distance, that may differ.
const AT_THE_EDGE: usize = 2;

#[test]
fn a_foundation_replaces_the_missing_depth() {
    let Some(engine) = lammps(1) else { return };
    let deep = pressed(&engine, DEEP, 0);
    let founded = pressed(&engine, SHALLOW, DEEP - SHALLOW);
    let rigid = pressed(&engine, SHALLOW, 0);
    assert!(founded.block.atoms() < deep.block.atoms());
    for (k, p_star) in LOADS.iter().enumerate() {
        let of = |p: &LayerDisplacementField| p.found.history.steps[k + 1].clone();
        let [whole, with, without] = [&deep, &founded, &rigid].map(of);
        eprintln!(
            "p* = {p_star}: {}, {} and {} touch; the indenter is down by {:.4}, {:.4} and {:.4} Å; the surface is off by {:.4} and {:.4} Å",
            whole.contacts,
            with.contacts,
            without.contacts,
            whole.displacement_angstrom,
            with.displacement_angstrom,
            without.displacement_angstrom,
            apart(&founded.moved[k], &deep.moved[k]),
            apart(&rigid.moved[k], &deep.moved[k])
        );
        assert!((with.load / whole.load - 1.0).abs() < 2e-3);
        assert!(with.contacts.abs_diff(whole.contacts) <= AT_THE_EDGE);
        assert!(apart(&founded.moved[k], &deep.moved[k]) < OF_RIGID * apart(&rigid.moved[k], &deep.moved[k]));
    }
}

/// Thickness in lattice constants of a foundation whose compression at the first load, several ångström, exceeds the
/// free space below the atoms.
const FAR_DOWN: usize = 200;

#[test]
fn a_base_that_moves_down_far_stays_in_the_box() {
    let Some(engine) = lammps(1) else { return };
    let found = pressed(&engine, SHALLOW, FAR_DOWN);
    let down: Vec<f64> = found.found.history.steps.iter().map(|r| r.displacement_angstrom).collect();
    eprintln!("the indenter is down by {down:?} Å");
    // LAMMPS reports an error if atoms leave the box.
    assert!(down[1] > 5.0 && down[2] > 2.0 * down[1]);
}

/// The continuum layer of six cells equals that of three cells on a foundation of three; the atoms differ.
#[test]
fn a_run_folder_distinguishes_foundation_and_atoms() {
    let Some(_lammps) = lammps(1) else { return };
    let folder = tempfile::tempdir().expect("scratch");
    let of = |depth: usize, foundation: usize| {
        let case = of_depth(depth, foundation, &LOADS[..1]);
        let out = OutFolder { overwrite: true, ..OutFolder::from(folder.path()) };
        let (results, _) = run(&case, out, &Silent).expect("a clean run");
        let reused = results.stages.iter().filter(|s| s.reused).map(|s| s.name.clone()).collect::<Vec<_>>();
        (results.atoms.expect("atoms").deformable, reused)
    };
    let (deep, _) = of(DEEP, 0);
    let (shallow, reused) = of(SHALLOW, DEEP - SHALLOW);
    assert_eq!(2 * shallow, deep);
    assert!(
        reused.iter().any(|s| s == "matched") && !reused.iter().any(|s| s == "lammps" || s == "atoms"),
        "{reused:?}"
    );
}

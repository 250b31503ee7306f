//! Scenes with atoms that request one quantity: LAMMPS runs the same steps, and unneeded results are neither computed
//! nor stored.

use crate::alone;
use crate::lammps::lammps;
use asperity::contact::uncertainty::UncertaintySource;
use asperity::grid::transformed_nodes;
use asperity::pipeline::{self, Silent};
use asperity::record::results::Results;
use asperity::scene::{Case, Scene};
use std::path::Path;

/// A smooth surface of small slope at one load: LAMMPS takes about a second.
const SCENE: &str = "name = \"lean\"\n[surface]\nroll_off_mode = 2\ncut_off_mode = 8\nrms_gradient = 0.3\nGRID\n\
                     [load]\np_star = [0.02]\n[atoms]\ncells = 10\ndepth_cells = 6\nplasticity = true\n";

struct Counted {
    results: Results,
    nodes: u64,
    evaluations: usize,
    /// Bytes in the frames of LAMMPS, and bytes read from them.
    frame_bytes: u64,
    read_bytes: u64,
}

fn bytes(folder: &Path, wanted: impl Fn(&str) -> bool) -> u64 {
    let entries = std::fs::read_dir(folder).expect("a stage").map(|e| e.expect("readable"));
    let kept = entries.filter(|e| wanted(&e.file_name().to_string_lossy()));
    kept.map(|e| e.metadata().expect("a file").len()).sum()
}

fn run(folder: &Path, name: &str, text: &str) -> Counted {
    let file = folder.join(format!("{name}.toml"));
    std::fs::write(&file, text).expect("written");
    let out = folder.join(name);
    let before = transformed_nodes();
    let case = pipeline::resolve_accuracy(Scene::read(&file).expect("a scene"), &file).expect("a case");
    let (results, _) = pipeline::run(&case, &out, &Silent).expect("a run");
    let atoms = results.atoms.as_ref().expect("atoms");
    Counted {
        nodes: transformed_nodes() - before,
        evaluations: atoms.load_steps.iter().map(|s| s.force_evaluations).sum(),
        frame_bytes: bytes(&out.join("lammps"), |f| f.starts_with("frame.")),
        read_bytes: bytes(&out.join("atoms"), |f| f.starts_with("load-")),
        results,
    }
}

/// A table with one setting, that of the full scene, with an error of 1 %.
fn table(folder: &Path) {
    let text = SCENE.replace("GRID", "grid = 64");
    let case = Case::resolve(Scene::parse(&text, Path::new("s")).expect("a scene"), Path::new("s")).expect("a case");
    let line = r#"{"schema": 3, "provenance": "a test", "tables": [{"name": "t", "surface": "one", "shortest_wavelength": 0.125,
        "p_star": [0.001, 1.0], "kernel": "KERNEL", "adhesion": "none", "program": "", "threads": 1, "lines": [
        {"method": "fast", "adhesive": false, "nx": 64, "ny": 64, "precision": "f64", "tolerance": 1e-8, "seconds": 1.0,
         "errors": {"contact_area": [0.01, 0.01]}}]}]}"#;
    std::fs::write(folder.join("table.json"), line.replace("KERNEL", &case.kernel.to_string())).expect("written");
}

#[test]
fn atoms_compute_only_what_is_requested() {
    let _alone = alone();
    let Some(_lammps) = lammps(1) else { return };
    let folder = tempfile::tempdir().expect("scratch");
    let folder = folder.path();
    table(folder);
    let full = SCENE.replace("GRID", "grid = 64").replace("plasticity = true", "plasticity = true\ndepth_error = true");
    let full = run(folder, "full", &full);
    let requested = "[accuracy]\nquantity = \"contact_area\"\nerror = 0.02\ntables = [\"table.json\"]\n";
    let lean = run(folder, "requested", &format!("{}{requested}", SCENE.replace("GRID", "")));
    let state = |c: &Counted| c.results.atoms.as_ref().expect("atoms").states[0].clone();
    let (all, few) = (state(&full), state(&lean));
    // LAMMPS runs the same steps with bit-identical results; its frames contain three layers of the block instead of
    // twelve.
    assert_eq!(full.evaluations, lean.evaluations);
    assert_eq!((all.contact_area, all.mean_gap_angstrom), (few.contact_area, few.mean_gap_angstrom));
    assert!(2 * lean.frame_bytes < full.frame_bytes, "{} {}", lean.frame_bytes, full.frame_bytes);
    assert!(lean.results.warnings.iter().any(|w| w.contains("atoms.plasticity")), "{:?}", lean.results.warnings);
    // No stress field, no Voronoi cells, no visualisation frame, no slip analysis.
    assert!(all.stress.is_some() && all.frame.is_some() && all.criteria.len() == 4 && all.defects.is_some());
    assert!(few.stress.is_none() && few.frame.is_none() && few.criteria.is_empty() && few.defects.is_none(), "{few:?}");
    assert!(2 * lean.read_bytes < full.read_bytes, "{} {}", lean.read_bytes, full.read_bytes);
    // The continuum is not solved for the full heights; the criteria are compared nevertheless.
    let compared = |c: &Counted| c.results.comparison.clone().expect("compared");
    assert!(compared(&full).full_heights.is_some() && compared(&lean).full_heights.is_none());
    assert_eq!(compared(&lean).loads[0].continuum.len(), 3);
    // The error of area and mean gap due to the finite depth needs another solution and is given only if it is
    // requested.
    let of_depth = |c: &Counted| -> Vec<f64> {
        let budget = compared(c).hard_wall.states[0].uncertainty.clone();
        budget.iter().filter(|p| p.source == UncertaintySource::Depth).filter_map(|p| p.relative).collect()
    };
    assert!(of_depth(&lean).is_empty());
    let [area, gap] = of_depth(&full)[..] else { panic!("{:?}", of_depth(&full)) };
    assert!(area > 0.0 && area < 0.5 && gap > 0.0 && gap < 0.5, "{area} {gap}");
    let page = std::fs::read_to_string(folder.join("full/report.html")).expect("a page");
    assert!(page.contains("finite depth"));
    assert!(lean.nodes < full.nodes, "{} {}", lean.nodes, full.nodes);
}

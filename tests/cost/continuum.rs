//! A scene that requests one quantity computes only that: number of transforms and of allocated bytes.

use crate::alone;
use asperity::grid::transformed_nodes;
use asperity::pipeline::{self, Silent};
use asperity::record::results::Results;
use asperity::scene::Scene;
use std::alloc::{GlobalAlloc, Layout, System};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

/// Bytes allocated so far.
static ALLOCATED: AtomicU64 = AtomicU64::new(0);

struct Counting;

#[allow(unsafe_code, reason = "an allocator that counts")]
// SAFETY: every call is forwarded to the system allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATED.fetch_add(layout.size() as u64, Ordering::Relaxed);
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        unsafe { System.dealloc(at, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// Two loads with adhesion, whose discretisation error needs an additional solve on a coarser grid.
const SCENE: &str = "name = \"s\"\n[surface]\ncut_off = \"4.0 um\"\nGRID\n[load]\np_star = [0.01, 0.03]\n[adhesion]\n\
                     work_of_adhesion = \"50 mJ/m2\"\nrange = \"400.0 nm\"\nTAIL\n";

struct Counted {
    results: Results,
    nodes: u64,
    bytes: u64,
    files: Vec<String>,
}

fn run(folder: &Path, name: &str, text: &str) -> Counted {
    let file = folder.join(format!("{name}.toml"));
    std::fs::write(&file, text).expect("written");
    let out = folder.join(name);
    let before = (transformed_nodes(), ALLOCATED.load(Ordering::Relaxed));
    let case = pipeline::resolve_accuracy(Scene::read(&file).expect("a scene"), &file).expect("a case");
    let (results, _) = pipeline::run(&case, &out, &Silent).expect("a run");
    let (nodes, bytes) = (transformed_nodes() - before.0, ALLOCATED.load(Ordering::Relaxed) - before.1);
    let mut files = Vec::new();
    for stage in ["surface", "continuum"] {
        for entry in std::fs::read_dir(out.join(stage)).expect("a stage") {
            files.push(entry.expect("readable").file_name().to_string_lossy().into_owned());
        }
    }
    Counted { results, nodes, bytes, files }
}

/// A table with one setting, that of the full scene, with an error of 1 %.
fn table(folder: &Path) {
    let line = r#"{"schema": 3, "provenance": "a test", "tables": [{"name": "t", "surface": "one", "shortest_wavelength": 0.04,
        "p_star": [0.001, 1.0], "kernel": "KERNEL", "adhesion": "ADHESION", "program": "", "threads": 1, "lines": [
        {"method": "fast", "adhesive": true, "nx": 128, "ny": 128, "precision": "f64", "tolerance": 1e-8, "seconds": 1.0,
         "errors": {"mean_gap": [0.01, 0.01], "gap_map": [0.01, 0.01], "gap_pdf": [0.01, 0.01]}}]}]}"#;
    let full = Scene::parse(&SCENE.replace("GRID", "grid = 128").replace("TAIL", ""), Path::new("s")).expect("a scene");
    let case = asperity::scene::Case::resolve(full, Path::new("s")).expect("a case");
    let line = line.replace("KERNEL", &case.kernel.to_string()).replace("ADHESION", &case.adhesion.to_string());
    std::fs::write(folder.join("table.json"), line).expect("written");
}

#[test]
fn unrequested_results_cost_nothing() {
    let _alone = alone();
    let folder = tempfile::tempdir().expect("scratch");
    let folder = folder.path();
    table(folder);
    let full = run(folder, "full", &SCENE.replace("GRID", "grid = 128").replace("TAIL", ""));
    let requested = |quantity: &str| {
        let tail = format!("[accuracy]\nquantity = \"{quantity}\"\nerror = 0.02\ntables = [\"table.json\"]");
        run(folder, quantity, &SCENE.replace("GRID", "").replace("TAIL", &tail))
    };
    let lean = requested("mean_gap");
    let states = |c: &Counted| c.results.continuum.as_ref().expect("solved").states.clone();
    let (all, few) = (states(&full), states(&lean));
    // Bit-identical results.
    assert_eq!(few.len(), 2);
    for (a, b) in all.iter().zip(&few) {
        assert_eq!(
            (a.mean_gap, a.numbers.contact_area, a.numbers.fft_pairs),
            (b.mean_gap, b.numbers.contact_area, b.numbers.fft_pairs)
        );
        assert!(
            a.observed.is_some()
                && a.discretisation.is_some()
                && a.numbers.gap_map.is_some()
                && a.numbers.stress_map.is_some(),
            "{a:?}"
        );
        assert!(b.observed.is_none() && b.numbers.gap_map.is_none() && b.numbers.stress_map.is_none(), "{b:?}");
    }
    // No maps are written, and the number of transforms is that of the loads, apart from the start of the solver.
    let maps = |c: &Counted| c.files.iter().filter(|f| f.ends_with(".npy")).count();
    assert_eq!((maps(&full), maps(&lean)), (5, 0), "{:?} {:?}", full.files, lean.files);
    let of_loads: f64 = few.iter().map(|s| s.numbers.fft_pairs).sum::<f64>() * 2.0 * 128.0 * 128.0;
    assert!((lean.nodes as f64) < 1.1 * of_loads + 10.0 * 128.0 * 128.0, "{} of {of_loads}", lean.nodes);
    // The coarser grid has a quarter of the nodes; measured ratio: 1.14.
    assert!((full.nodes as f64) > 1.1 * lean.nodes as f64, "{} {}", full.nodes, lean.nodes);
    assert!(full.bytes as f64 > 1.5 * lean.bytes as f64, "{} {}", full.bytes, lean.bytes);
    // Requested quantities are provided.
    assert!(requested("gap_pdf").results.continuum.is_some_and(|c| c.states.iter().all(|s| s.observed.is_some())));
    let maps_requested = requested("gap_map");
    assert!(
        maps(&maps_requested) == 5
            && states(&maps_requested).iter().all(|s| s.numbers.gap_map.is_some() && s.observed.is_none())
    );
    // Without adhesion the same scene takes fewer transforms and has no interaction energy.
    let text = SCENE.replace("GRID", "grid = 128").split("[adhesion]").next().expect("a head").to_string();
    let dry = run(folder, "dry", &text);
    assert!(states(&dry).iter().all(|s| s.interaction_energy == 0.0) && dry.nodes < full.nodes);
    // The contact stiffness of every load, with its error; not where another quantity is requested.
    let known = |c: &Counted| states(c).iter().filter(|s| s.numbers.stiffness_error.is_some()).count();
    assert_eq!((known(&dry), known(&lean)), (states(&dry).len(), 0));
}

//! The benchmark of methods with the compiled program: contents of its table, continuation after an interruption, and
//! settings omitted by a time budget.

use crate::lammps::lammps;
use crate::program::{asperity, json_line, stderr};
use asperity::contact::quantity::Quantity;
use asperity::methods::REGISTRY;
use asperity::record::tradeoff::{FILE, TradeoffPoint, TradeoffResults};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Grids of 64 points per side and more resolve all waves; the loads give some contact nodes and open gaps.
const SCENE: &str =
    "name = \"benchmark\"\n[surface]\ngrid = 128\ncut_off = \"4.0 um\"\n[load]\np_star = [0.005, 0.02]\n";
const ADHESION: &str = "[adhesion]\nwork_of_adhesion = \"50 mJ/m2\"\nrange = \"100.0 nm\"\n";

/// Limit of waiting times; a benchmark here takes seconds.
const PATIENCE: Duration = Duration::from_secs(120);

struct Bench {
    folder: tempfile::TempDir,
    scene: PathBuf,
}

impl Bench {
    fn new(scene: &str) -> Self {
        let folder = tempfile::tempdir().expect("scratch");
        let file = folder.path().join("benchmark.toml");
        std::fs::write(&file, scene).expect("written");
        Bench { folder, scene: file }
    }

    fn out(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn command(&self, out: &str, flags: &[&str]) -> Command {
        let mut command = asperity();
        command.arg("tradeoff").arg(&self.scene).arg("--out").arg(self.out(out)).args(flags);
        command
    }

    fn run(&self, out: &str, flags: &[&str]) -> Output {
        self.command(out, flags).output().expect("started")
    }

    /// The table of a successful run, which is identical to that in its file.
    fn table(&self, out: &str, flags: &[&str]) -> TradeoffResults {
        let output = self.run(out, &[flags, &["--json"]].concat());
        assert!(output.status.success(), "{}", stderr(&output));
        let results: TradeoffResults = serde_json::from_value(json_line(&output)["tradeoff"].clone()).expect("a table");
        let file = TradeoffResults::read(&self.out(out).join(FILE)).expect("its file");
        assert_eq!(results.points, file.points);
        let page = std::fs::read_to_string(self.out(out).join("report.html")).expect("a page");
        assert!(page.contains("Error against cost"));
        results
    }
}

/// The point of a method on a grid, in f64 at a tolerance of 1e-8.
fn on_grid<'a>(results: &'a TradeoffResults, method: &str, n: usize) -> &'a TradeoffPoint {
    let is = |p: &&TradeoffPoint| {
        let s = &p.setting;
        s.method == method && s.nx == n && s.precision == "f64" && s.tolerance == 1e-8
    };
    results.points.iter().find(is).unwrap_or_else(|| panic!("no {method} on {n}: {:?}", results.skipped))
}

fn error(p: &TradeoffPoint, quantity: Quantity) -> f64 {
    *p.errors.get(&quantity).unwrap_or_else(|| panic!("{} has no {}", p.setting.method, quantity.name()))
}

/// Every method of the registry is in the table, with the errors that its card declares, or is left out with a reason.
#[test]
fn the_table_has_every_method() {
    let bench = Bench::new(&SCENE.replace("128", "64"));
    let results = bench.table("run", &["--methods", "all", "--grids", "64,32", "--budget", "8s", "--repeats", "1"]);
    for method in REGISTRY {
        let card = method.card();
        let points: Vec<&TradeoffPoint> = results.points.iter().filter(|p| p.setting.method == card.id).collect();
        let out: Vec<_> = results.skipped.iter().filter(|l| l.setting.method == card.id).collect();
        assert!(!points.is_empty() || !out.is_empty(), "{} is nowhere", card.id);
        assert!(out.iter().all(|l| !l.reason.is_empty()));
        for p in points {
            if p.unavailable_reason.is_some() {
                assert!(p.errors.is_empty(), "{} has errors without results", card.id);
                continue;
            }
            assert!(p.errors.values().all(|e| e.is_finite() && *e >= 0.0), "{p:?}");
            assert!(p.cost.cpu_seconds >= 0.0 && p.cost.wall_seconds > 0.0, "{p:?}");
            for quantity in Quantity::COMPARED {
                let missing = p.missing.contains_key(&quantity.output());
                assert_eq!(p.errors.contains_key(&quantity), !missing, "{}: {}", card.id, quantity.name());
            }
        }
    }
    assert_eq!(results.references.len(), 1);
    assert_eq!(results.references[0].coarser, [16, 32]);
}

/// `asperity report` draws the same page from the table alone, and refuses a table that is not as it was written.
#[test]
fn the_page_is_drawn_again_from_the_table() {
    let bench = Bench::new(SCENE);
    bench.table("run", &["--methods", "fast,persson", "--grids", "32,64", "--reference", "64", "--repeats", "1"]);
    let (page, table) = (bench.out("run").join("report.html"), bench.out("run").join(FILE));
    let report = |flags: &[&str]| asperity().arg("report").arg(bench.out("run")).args(flags).output().expect("started");
    let first = std::fs::read(&page).expect("read");
    std::fs::remove_file(&page).expect("removed");
    assert!(report(&[]).status.success());
    assert!(std::fs::read(&page).expect("drawn") == first, "the same table gave another report");
    assert!(report(&["--figures", "svg"]).status.success());
    assert!(std::fs::read_dir(bench.out("run").join("figures/84mm")).expect("figures").count() > 0);
    let compared = asperity().arg("compare").arg(bench.out("run")).output().expect("started");
    assert!(stderr(&compared).contains("that of `asperity tradeoff`"), "{}", stderr(&compared));
    let text = std::fs::read_to_string(&table).expect("read");
    std::fs::write(&table, text.replacen("\"nx\": 64", "\"nx\": 32", 1)).expect("changed");
    let refused = report(&[]);
    let said = stderr(&refused);
    assert!(refused.status.code() == Some(2) && said.contains("tradeoff.json: changed since"), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
}

/// The error of `fast` decreases with the grid; that of the reference is its uncertainty. On the same grid, f32 has a
/// smaller error than half the points per side in f64.
#[test]
fn errors_fall_with_the_grid() {
    let bench = Bench::new(SCENE);
    let results = bench.table("run", &["--methods", "fast", "--grids", "32,64,128"]);
    let [coarse, middle, fine] = [32, 64, 128].map(|n| on_grid(&results, "fast", n));
    for quantity in [Quantity::MeanGap, Quantity::GapMap, Quantity::ContactMap, Quantity::GapPdf, Quantity::StressPdf] {
        assert!(error(middle, quantity) < error(coarse, quantity), "{}: {coarse:?} {middle:?}", quantity.name());
    }
    assert!(fine.is_reference && (fine.cost.cpu_over_reference - 1.0).abs() < 1e-12);
    for quantity in Quantity::COMPARED {
        let uncertain = results.references[0].uncertainty.get(&quantity).copied();
        assert_eq!(fine.errors.get(&quantity).copied(), uncertain, "{}", quantity.name());
    }
    // Curves of both precisions over the tolerance on the scene's grid: a tighter one has smaller errors and more transforms.
    let curve = |precision: &str| -> Vec<(f64, f64, f64)> {
        let on_grid = |p: &&TradeoffPoint| p.setting.precision == precision && p.setting.nx == 128;
        let mut points: Vec<&TradeoffPoint> = results.points.iter().filter(on_grid).collect();
        points.sort_by(|a, b| b.setting.tolerance.total_cmp(&a.setting.tolerance));
        points.iter().map(|p| (p.setting.tolerance, error(p, Quantity::GapMap), p.cost.fft_pairs)).collect()
    };
    let (single, double) = (curve("f32"), curve("f64"));
    let tolerances = |curve: &[(f64, f64, f64)]| curve.iter().map(|c| c.0).collect::<Vec<f64>>();
    assert_eq!(tolerances(&single), [1e-2, 1e-3]);
    assert_eq!(tolerances(&double), [1e-2, 1e-4, 1e-6, 1e-8]);
    // The point at 1e-8 is the reference, whose error is that of the grid.
    for c in [&single[..], &double[..3]] {
        assert!(c.windows(2).all(|w| w[1].1 < w[0].1 && w[1].2 >= w[0].2), "{c:?}");
        assert!(c.iter().all(|p| p.1 < error(middle, Quantity::GapMap)), "{c:?}");
    }
    // The residual is over the pressure: errors follow it to within a factor.
    assert!(double[2].1 < 1e-2 * double[0].1, "{double:?}");
    assert_eq!(results.points.len(), 3 + 5);
    assert!(results.points.iter().all(|p| p.cost.runs >= 1));
    // Every point has one line in the CSV, and all lines have the same number of cells.
    let csv = std::fs::read_to_string(bench.out("run").join("tradeoff.csv")).expect("a CSV");
    let cells: Vec<usize> = csv.lines().map(|l| l.split(',').count()).collect();
    assert!(cells.len() == 1 + results.points.len() && cells.iter().all(|c| *c == cells[0]), "{csv}");
}

/// A reference finer than the scene's grid, with the scene's grid in the middle of the benchmark.
#[test]
fn the_reference_may_be_finer() {
    let bench = Bench::new(&SCENE.replace("128", "32"));
    let results = bench.table("run", &["--methods", "fast", "--grids", "16,32,64", "--reference", "64"]);
    assert_eq!((results.nx, results.references[0].setting.nx), (32, 64));
    // Variations of precision and tolerance are on the scene's grid.
    assert!(results.points.iter().any(|p| p.setting.precision == "f32" && p.setting.nx == 32));
    assert!(error(on_grid(&results, "fast", 32), Quantity::GapMap) > 0.0);
}

/// Blocks of atoms are in the table with the cost of LAMMPS and two errors: against the scene's reference, and against
/// the half-space under the heights that they resolve.
#[test]
fn atoms_are_settings_too() {
    let Some(_lammps) = lammps(1) else { return };
    let smooth =
        "[surface]\ngrid = 64\nroll_off_mode = 2\ncut_off_mode = 24\nrms_gradient = 0.3\n[load]\np_star = [0.02]\n";
    let bench = Bench::new(&format!("name = \"benchmark\"\n{smooth}"));
    let flags = ["--methods", "fast", "--grids", "64", "--repeats", "1", "--atoms", "10x6,10x3"];
    let results = bench.table("run", &flags);
    let blocks: Vec<&TradeoffPoint> = results.points.iter().filter(|p| p.setting.method == "all-atom").collect();
    let sizes: Vec<String> = blocks.iter().filter_map(|p| p.setting.block).map(|b| b.to_string()).collect();
    assert_eq!(sizes, ["10x3", "10x6"], "{:?}", results.skipped);
    for p in &blocks {
        let cost = p.cost.atoms.expect("what LAMMPS took");
        assert!(
            cost.force_evaluations > 0 && cost.frame_bytes > 0 && p.cost.cpu_seconds >= cost.lammps_cpu_seconds,
            "{p:?}"
        );
        let resolved = p.resolved.as_ref().expect("errors against the resolved heights");
        for quantity in [Quantity::ContactArea, Quantity::MeanGap, Quantity::GapMap, Quantity::ContactMap] {
            assert!(error(p, quantity) > 0.0 && resolved.errors.contains_key(&quantity), "{p:?}");
        }
        assert!(!p.errors.contains_key(&Quantity::StressPdf) && p.missing.contains_key(&Quantity::StressPdf));
        // Waves that the indenter does not resolve make these two errors of the gaps different.
        assert_ne!(error(p, Quantity::GapMap), resolved.errors[&Quantity::GapMap]);
        assert!(resolved.shortest_wavelength > 1.0 / 24.0 && resolved.gradient < 0.3, "{resolved:?}");
    }
    let [atoms_thin, atoms_thick] = [0, 1].map(|i| blocks[i].cost.atoms.map_or(0, |c| c.atoms));
    assert!(atoms_thin > 0 && atoms_thin < atoms_thick);
    // LAMMPS files and maps are removed, and the same command does not run anything again.
    let stage = bench.out("run").join("point-all-atom-10x6");
    assert!(stage.join("output.json").exists() && !stage.join("job").exists() && !stage.join("atoms").exists());
    assert_eq!(bench.table("run", &flags).points, results.points);
    let page = std::fs::read_to_string(bench.out("run").join("report.html")).expect("a page");
    assert!(page.contains("Blocks of atoms") && page.contains("10x6"));
}

/// Measurements finished before a kill are not repeated, and the final table is the same.
#[test]
fn a_killed_benchmark_resumes() {
    let bench = Bench::new(SCENE);
    let flags = ["--methods", "fast,gfmd", "--grids", "128,64", "--json"];
    let mut child =
        bench.command("killed", &flags).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("started");
    let done = bench.out("killed").join("point-fast-128-f64-1e-8/done.json");
    let clock = Instant::now();
    while !done.exists() {
        assert!(clock.elapsed() < PATIENCE, "no first stage");
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().expect("killed, or over");
    child.wait().expect("ended");
    let finished = |run: &str| {
        let stages = std::fs::read_dir(bench.out(run)).expect("a folder").map(|e| e.expect("readable").path());
        stages.filter(|s| s.join("done.json").exists()).count()
    };
    let before = finished("killed");
    let first = std::fs::read(&done).expect("the first stage");
    let (found, whole) = (bench.table("killed", &flags[..4]), bench.table("whole", &flags[..4]));
    assert_eq!(std::fs::read(&done).expect("the first stage"), first, "it was measured again");
    assert!(before < finished("whole"), "the benchmark was over when it was killed");
    let numbers = |t: &TradeoffResults| -> Vec<_> {
        t.points.iter().map(|p| (p.setting.clone(), p.loads.clone(), p.cost.iterations)).collect()
    };
    assert_eq!(numbers(&found), numbers(&whole));
    // Only the maps of the reference remain.
    let maps = |stage: &str| Path::exists(&bench.out("whole").join(stage).join("load-1-gap.npy"));
    assert!(maps("point-fast-128-f64-1e-8") && !maps("point-gfmd-128-f64-1e-8"));
    // Another run measures nothing and reports the same costs.
    assert_eq!(bench.table("whole", &flags[..4]).points, whole.points);
}

#[test]
fn settings_beyond_the_budget_are_listed() {
    let bench = Bench::new(SCENE);
    let flags = ["--methods", "fast,gfmd,bvm", "--budget", "1ms"];
    let results = bench.table("run", &flags);
    assert_eq!(results.budget_seconds, Some(1e-3));
    assert!(!results.skipped.is_empty());
    assert!(results.skipped.iter().all(|l| l.reason.contains("budget")));
    assert!(on_grid(&results, "fast", 128).is_reference, "the reference is solved in any case");
    let output = bench.run("run", &flags);
    let words = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(words.contains("left out: gfmd") && words.contains("budget"), "{words}");
    let page = std::fs::read_to_string(bench.out("run").join("report.html")).expect("a page");
    assert!(page.contains("Settings not run"));
    // What is finished is shown whatever the budget, and nothing more begins.
    let whole = bench.table("begun", &["--methods", "fast"]);
    let more = bench.table("begun", &flags);
    let of_fast: Vec<&TradeoffPoint> = more.points.iter().filter(|p| p.setting.method == "fast").collect();
    assert_eq!(of_fast, whole.points.iter().collect::<Vec<_>>());
    assert!(more.points.len() == of_fast.len() && more.skipped.iter().all(|l| l.setting.method != "fast"));
}

/// In a scene with adhesion, methods without adhesion are compared with the solution without it, and the table states
/// this.
#[test]
fn without_adhesion_is_compared_with_without() {
    let bench = Bench::new(&format!("{}{ADHESION}", SCENE.replace("128", "64")));
    let results = bench.table("run", &["--methods", "fast", "--grids", "64,32"]);
    assert!(results.references.len() == 1 && results.references[0].setting.adhesive);
    assert!(results.points.iter().all(|p| p.setting.adhesive));
    let mut cards = REGISTRY.iter().map(|m| m.card());
    let dry = cards.find(|c| !c.supports_adhesion() && c.id != "all-atom").expect("a method without adhesion");
    let results = bench.table("run", &["--methods", &format!("fast,{}", dry.id), "--grids", "64"]);
    assert_eq!(results.references.iter().map(|r| r.setting.adhesive).collect::<Vec<_>>(), [true, false]);
    assert!(results.points.iter().filter(|p| p.setting.method == dry.id).all(|p| !p.setting.adhesive));
    assert!(results.warnings.iter().any(|w| w.contains(dry.id) && w.contains("no adhesion")), "{:?}", results.warnings);
}

#[test]
fn bad_flags_are_refused() {
    let bench = Bench::new(SCENE);
    let refused = [
        (["--methods", "oracle"], "fast"),
        (["--methods", "all-atom"], "a scene with [atoms]"),
        (["--grids", "48"], "128"),
        (["--grids", "8"], "16"),
        (["--grids", "256"], "128"),
        (["--reference", "100"], "128"),
        (["--budget", "soon"], "10m"),
        (["--budget", "0"], "10m"),
        (["--repeats", "0"], "1 to 100"),
        (["--atoms", "10"], "15x6"),
        (["--atoms", "2x6"], "4 to 2000"),
    ];
    for (flags, accepted) in refused {
        let output = bench.run("refused", &flags);
        let results = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{flags:?}: {results}");
        assert!(
            results.contains(flags[0]) && results.contains(flags[1]) && results.contains(accepted),
            "{flags:?}: {results}"
        );
        assert!(!bench.out("refused").exists(), "{flags:?} left a folder");
    }
}

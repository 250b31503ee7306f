//! All methods of the registry in one scene: a method provides what its card declares, gives the card's reason for
//! everything else, and receives only the input that the card declares.

use crate::program::{asperity, json_line, stderr};
use asperity::Error;
use asperity::contact::method::{
    MethodCard, MethodKind, Needs, NoObserver, Quantity, ReducedProblem, StartedMethod, Support,
};
use asperity::contact::state::{Observed, State};
use asperity::grid::Grid;
use asperity::methods;
use asperity::methods::REGISTRY;
use asperity::pipeline::{self, Listener};
use asperity::record::methods::MethodResults;
use asperity::record::results::{Results, StageCost};
use asperity::scene::Case;
use asperity::surface::files::hashed;
use asperity::surface::{Modes, PowerSpectrum, Spectrum};
use std::path::Path;

/// A 128² scene whose grid resolves all waves, at loads with some contact nodes and open gaps.
const SCENE: &str = "name = \"methods\"\n[surface]\ngrid = 128\ncut_off = \"4.0 um\"\n[load]\np_star = [0.005, 0.01, 0.02]\n\
                     [continuum]\ncompare_with = [\"all\"]\n";
const ADHESION: &str = "[adhesion]\nwork_of_adhesion = \"50 mJ/m2\"\nrange = \"100.0 nm\"\nalso_nonadhesive = true\n";

/// Methods that need more input than a surface and a load; their reason names it.
const NEED_MORE: [&str; 1] = ["all-atom"];

/// Relative load balance of estimates. Sums of closed forms are accurate to rounding; the cascade of Persson's theory
/// with adhesion has an error below half a per cent of the pressure, which its own tests verify.
const LOAD_BALANCE: f64 = 5e-3;

fn run(scene: &str) -> Vec<MethodResults> {
    let folder = tempfile::tempdir().expect("scratch");
    let file = folder.path().join("methods.toml");
    std::fs::write(&file, scene).expect("written");
    let out = folder.path().join("out");
    let output = asperity().arg("run").arg(&file).arg("--out").arg(&out).arg("--json").output().expect("started");
    assert!(output.status.success(), "{}", stderr(&output));
    let json = json_line(&output)["results"]["methods"].clone();
    let found: Vec<MethodResults> = serde_json::from_value(json).expect("results of methods");
    for state in found.iter().flat_map(|m| &m.states) {
        maps_exist(&out, state);
    }
    let page = std::fs::read_to_string(out.join("report.html")).expect("a report");
    for m in &found {
        let titles = page.matches(&format!("{}: {}", m.method, m.paper_name)).count();
        // Each method is in figures 4 to 9 at each of three loads, and in figures 10 to 12.
        assert_eq!(titles, 6 * 3 + 3, "{} is in every figure or said not to be", m.method);
        // If a method is refused altogether, that reason stands in every empty cell; a contact map has no cell of its
        // own.
        let reasons = m.missing.iter().filter(|(quantity, _)| **quantity != Quantity::ContactMap);
        let reasons: Vec<&String> =
            m.unavailable_reason.as_ref().map_or(reasons.map(|(_, reason)| reason).collect(), |why| vec![why]);
        for reason in reasons {
            let escaped = reason.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;");
            assert!(page.contains(&escaped), "{}: {reason} is not said in the report", m.method);
        }
    }
    found
}

fn maps_exist(out: &Path, state: &State) {
    for map in [state.gap_file(), state.stress_file(), state.contact_file()].into_iter().flatten() {
        assert!(out.join(map).exists(), "{map}");
    }
}

fn delivers(kind: MethodKind, s: &State, quantity: Quantity) -> bool {
    let seen = |of: fn(&Observed) -> bool| s.observed.as_ref().is_some_and(of);
    match quantity {
        Quantity::GapMap => s.gap_map.is_some(),
        Quantity::StressMap => s.stress_map.is_some(),
        // For solvers contact is where the gap is closed.
        Quantity::ContactMap => s.contact_map.is_some() || kind == MethodKind::Solver && s.gap_map.is_some(),
        Quantity::ClusterPdf | Quantity::ClusterArea | Quantity::MedianClusterArea => {
            seen(|o| !o.cluster_area.is_empty() && !o.cluster_density.is_empty())
        }
        Quantity::GapPdf => seen(|o| o.gap_logarithmic.is_some()),
        Quantity::StressPdf => seen(|o| o.stress.is_some()),
        Quantity::ContactArea => s.contact_area > 0.0,
        Quantity::MeanGap => s.mean_gap.is_some_and(|g| g > 0.0),
        Quantity::Stiffness => s.stiffness.is_some_and(|k| k > 0.0),
    }
}

/// Deviations of a run from the method's card.
fn faults(card: &MethodCard, run: &MethodResults) -> Vec<String> {
    let mut faults = Vec::new();
    let name = format!("{}, adhesion {}", card.id, run.adhesive);
    if NEED_MORE.contains(&card.id) {
        if run.unavailable_reason.is_none() || !run.states.is_empty() {
            faults.push(format!("{name}: not refused"));
        }
        return faults;
    }
    if run.unavailable_reason.is_some() || run.states.len() != 3 {
        faults.push(format!("{name}: {} states, {:?}", run.states.len(), run.unavailable_reason));
    }
    for quantity in Quantity::OUTPUTS {
        let said = run.missing.get(&quantity).map(String::as_str);
        let all = run.states.iter().all(|s| delivers(card.kind, s, quantity));
        let any = run.states.iter().any(|s| delivers(card.kind, s, quantity));
        let fine = match (card.supports)(quantity) {
            Support::No(reason) => !any && said == Some(reason),
            Support::NoAdhesion if run.adhesive => !any && said.is_some(),
            _ => all && said.is_none(),
        };
        if !fine {
            faults.push(format!("{name}: {} delivered {any}/{all}, missing because {said:?}", quantity.name()));
        }
    }
    if run.measured_errors.as_ref() != card.measured_errors {
        faults.push(format!("{name}: other measured errors than on the card"));
    }
    for s in &run.states {
        if s.load_error > LOAD_BALANCE {
            faults.push(format!("{name}: load error {}", s.load_error));
        }
        let observed = s.observed.iter().flat_map(|o| o.gap_logarithmic.iter().chain(&o.stress));
        for d in observed.filter(|d| (d.total() - 1.0).abs() > 1e-9) {
            faults.push(format!("{name}: shares add up to {}", d.total()));
        }
    }
    faults
}

#[test]
fn cards_list_what_is_delivered() {
    let mut found = Vec::new();
    for (scene, adhesion) in [(SCENE.to_string(), false), (format!("{SCENE}{ADHESION}"), true)] {
        let results = run(&scene);
        // The scene's own method, `fast`, is not listed as a comparison method.
        for card in REGISTRY.iter().map(|m| m.card()).filter(|c| c.id != "fast") {
            let runs: Vec<&MethodResults> = results.iter().filter(|m| m.method == card.id).collect();
            let runs_twice = adhesion && card.supports_adhesion() && !NEED_MORE.contains(&card.id);
            let expected = if runs_twice { vec![true, false] } else { vec![false] };
            assert_eq!(runs.iter().map(|r| r.adhesive).collect::<Vec<_>>(), expected, "{}", card.id);
            found.extend(runs.into_iter().flat_map(|run| faults(card, run)));
        }
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

/// A method that needs a spectrum runs without heights, and one that needs heights runs without a spectrum. With the
/// other input only, the error names the missing one.
#[test]
fn methods_need_only_the_inputs_of_their_cards() {
    let spectrum = Spectrum { lambda_s: 1.0 / 25.0, ..Spectrum::CHALLENGE };
    let grid = Grid::unit(128, 128);
    let power = PowerSpectrum::expected(&spectrum, 1.0);
    let heights = Modes::new(spectrum, 18, 1.0).heights::<f64>(grid, 0.0);
    for method in REGISTRY.iter().filter(|m| !NEED_MORE.contains(&m.card().id)) {
        let card = method.card();
        let problem = match card.needs {
            Needs::Heights => ReducedProblem::new(grid, &heights),
            Needs::Spectrum => ReducedProblem::of_power(grid, &power),
        };
        let kind = match method.start(&problem, &NoObserver).unwrap_or_else(|e| panic!("{}: {e}", card.id)) {
            StartedMethod::Solver(_) => MethodKind::Solver,
            StartedMethod::Estimator(_) => MethodKind::Estimate,
        };
        assert_eq!(kind, card.kind, "{}", card.id);
        if card.needs == Needs::Spectrum {
            let problem = ReducedProblem::new(grid, &heights);
            let unavailable_reason =
                method.start(&problem, &NoObserver).err().map(|e| e.to_string()).unwrap_or_default();
            assert!(unavailable_reason.contains("spectrum"), "{}: {unavailable_reason}", card.id);
        }
    }
}

/// `solve` accepts estimators; options that need a solver are refused in one line that names the flag.
#[test]
fn solve_takes_methods_that_estimate() {
    for method in REGISTRY.iter().filter(|m| !NEED_MORE.contains(&m.card().id) && m.card().kind == MethodKind::Estimate)
    {
        let id = method.card().id;
        let command = ["solve", "--challenge", "128", "--cut-off", "0.04", "--pressure", "0.01", "--json", "--method"];
        let output = asperity().args(command).arg(id).output().expect("started");
        assert!(output.status.success(), "{id}: {}", stderr(&output));
        let line = json_line(&output);
        assert_eq!(line["method"], id);
        assert!(line["contact_area"].as_f64().is_some_and(|a| a > 0.0 && a < 1.0), "{id}: {line}");
        let pull = ["--pull-off", "--gamma", "1e-5", "--rho", "1e-3"];
        let output = asperity().args(command).arg(id).args(pull).output().expect("started");
        assert_eq!(output.status.code(), Some(2), "{id}");
        assert!(stderr(&output).contains("--pull-off"), "{id}: {}", stderr(&output));
    }
}

/// What a method does not give at a load is absent there, with the reason, in `solve` and in a run: no mean gap, and no stiffness from it.
#[test]
fn loads_without_a_mean_gap_say_why() {
    let command =
        ["solve", "--challenge", "128", "--cut-off", "0.1", "--seed", "6", "--method", "icha", "--p-star", "0.05,0.3"];
    let output = asperity().args(command).arg("--json").output().expect("started");
    assert!(output.status.success(), "{}", stderr(&output));
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    let lines: Vec<serde_json::Value> = text.lines().map(|l| serde_json::from_str(l).expect("JSON")).collect();
    assert!(
        lines[0]["mean_gap"].as_f64().is_some_and(|g| g > 0.0) && lines[0]["missing"]["mean_gap"].is_null(),
        "{}",
        lines[0]
    );
    assert!(
        lines[1]["mean_gap"].is_null() && lines[1]["missing"]["stiffness"] == "no mean gap at this load",
        "{}",
        lines[1]
    );
    let why = lines[1]["missing"]["mean_gap"].as_str().expect("a reason");
    assert!(why.contains("overlap between the summits"), "{why}");
    let output = asperity().args(command).output().expect("started");
    assert!(String::from_utf8_lossy(&output.stdout).contains(&format!("– ({why})")));
    let scene =
        SCENE.replace("4.0", "10.0").replace("[0.005, 0.01, 0.02]", "[0.02, 0.05, 0.3]").replace("\"all\"", "\"icha\"");
    let folder = tempfile::tempdir().expect("scratch");
    let file = folder.path().join("sparse.toml");
    std::fs::write(&file, scene).expect("written");
    let out = folder.path().join("out");
    let output = asperity().arg("run").arg(&file).arg("--out").arg(&out).arg("--json").output().expect("started");
    assert!(output.status.success(), "{}", stderr(&output));
    let found: Vec<MethodResults> =
        serde_json::from_value(json_line(&output)["results"]["methods"].clone()).expect("methods");
    let states = &found[0].states;
    assert!(states[..2].iter().all(|s| s.missing.is_empty() && s.mean_gap.is_some() && s.stiffness.is_some()));
    assert!(states[2].mean_gap.is_none() && states[2].stiffness.is_none());
    assert_eq!(states[2].missing.keys().collect::<Vec<_>>(), [&Quantity::MeanGap, &Quantity::Stiffness]);
    assert!(std::fs::read_to_string(out.join("report.html")).expect("a report").contains(why));
}

/// Errors on cards carry the surface on which they were measured: in the table, in its JSON, in `solve` and in results.
#[test]
fn measured_errors_carry_their_surface() {
    let output = asperity().args(["methods", "--json"]).output().expect("started");
    let cards = json_line(&output)["methods"].as_array().expect("cards").clone();
    let text = String::from_utf8(asperity().arg("methods").output().expect("started").stdout).expect("UTF-8");
    for card in &cards {
        let (id, errors) = (card["id"].as_str().expect("an id"), &card["measured_errors"]);
        assert_eq!(errors.is_null(), methods::find(id).expect("registered").card().measured_errors.is_none(), "{id}");
        let line = text.lines().find(|l| l.starts_with(&format!("{id}: measured errors")));
        let Some(list) = errors["errors"].as_array() else {
            assert!(line.is_none(), "{id}");
            continue;
        };
        assert!(
            list.iter().all(|e| e["error"].as_f64().is_some() && e["p_star"].as_array().is_some_and(|p| p.len() > 1)),
            "{id}"
        );
        let surface = &errors["surface"];
        assert!(
            surface["hurst"] == 0.8
                && surface["grid"] == serde_json::json!([1024, 1024])
                && surface["seeds"] == serde_json::json!([18])
        );
        let line = line.unwrap_or_else(|| panic!("{id} in the text"));
        for part in ["H = 0.8", "seed 18", "1024 x 1024", "p* = 0.001 to 1"] {
            assert!(line.contains(part), "{id}: {part}: {line}");
        }
    }
    let command =
        ["solve", "--challenge", "128", "--cut-off", "0.04", "--pressure", "0.01", "--json", "--method", "persson"];
    let output = asperity().args(command).output().expect("started");
    let persson = cards.iter().find(|c| c["id"] == "persson").expect("registered");
    assert_eq!(json_line(&output)["measured_errors"], persson["measured_errors"]);
    assert!(stderr(&output).contains("seed 18"), "{}", stderr(&output));
}

/// The method and `solve` report settings that change a criterion or replace a fitted constant.
#[test]
fn criterion_and_calibration_follow_settings() {
    let found_by = |id: &str, set: Option<&str>| {
        let command = ["solve", "--challenge", "128", "--cut-off", "0.04", "--pressure", "0.01", "--json", "--method"];
        let set = set.map(|s| ["--set".to_string(), format!("{id}.{s}")]);
        let output = asperity().args(command).arg(id).args(set.iter().flatten()).output().expect("started");
        assert!(output.status.success(), "{id}: {}", stderr(&output));
        json_line(&output)
    };
    assert!(found_by("experiment", None)["criterion"].as_str().is_some_and(|c| c.contains(" 150 nm")));
    assert!(
        found_by("experiment", Some("optical_gap=2e-6"))["criterion"].as_str().is_some_and(|c| c.contains(" 200 nm"))
    );
    for (id, given) in [
        ("winkler", "spring_length=0.005"),
        ("ms-archard", "band_ratio=2"),
        ("persson", "energy_factor=1"),
        ("srgw", ""),
    ] {
        let card = methods::find(id).expect("an id").card();
        assert_eq!(found_by(id, None)["calibrated_on"].as_str(), card.calibrated_on, "{id}");
        if !given.is_empty() {
            assert!(card.calibrated_on.is_some() && found_by(id, Some(given))["calibrated_on"].is_null(), "{id}");
        }
    }
    let to_area = found_by("winkler", Some("calibrate_to=0.05"));
    assert!(to_area["calibrated_on"].as_str().is_some_and(|c| c.contains("calibrate_to")), "{to_area}");
}

/// For a range that the grid does not resolve, `bicgstab` reports the range used, in results and in `solve`; `fft-ia`
/// reports closed area and compressed area.
#[test]
fn used_ranges_and_compressive_contact_are_reported() {
    let scene = SCENE.replace("\"all\"", "\"bicgstab\", \"fft-ia\"");
    let scene = format!(
        "{scene}[adhesion]\nwork_of_adhesion = \"50 mJ/m2\"\nrange = \"100.0 nm\"\n[methods.bicgstab]\nmin_resolution = 4\n"
    );
    let folder = tempfile::tempdir().expect("scratch");
    let file = folder.path().join("ranges.toml");
    std::fs::write(&file, scene.replace("[0.005, 0.01, 0.02]", "[0.02]")).expect("written");
    let out = folder.path().join("out");
    let output = asperity().arg("run").arg(&file).arg("--out").arg(&out).arg("--json").output().expect("started");
    assert!(output.status.success(), "{}", stderr(&output));
    let results = json_line(&output)["results"].clone();
    let found: Vec<MethodResults> = serde_json::from_value(results["methods"].clone()).expect("results of methods");
    let of = |id: &str| found.iter().find(|m| m.method == id && m.adhesive).expect("ran");
    let range = of("bicgstab").range.expect("a range");
    assert!((range.resolution_used - 4.0).abs() < 1e-9 && range.used > 1.3 * range.requested, "{range:?}");
    assert_eq!(of("bicgstab").criterion, "compressive stress");
    let taken = of("fft-ia").range.expect("a range");
    assert_eq!(taken.used, taken.requested);
    assert_eq!(results["continuum"]["range"]["used"], results["continuum"]["range"]["requested"]);
    assert_eq!(of("fft-ia").criterion, "zero gap; area under compressive stress reported as well");
    let state = &of("fft-ia").states[0];
    let presses = state.contact_nodes_compressive.expect("with adhesion");
    let nodes = state.contact_nodes.expect("counted");
    assert!(presses > 0.0 && presses < nodes, "{presses} {nodes}");
    let page = std::fs::read_to_string(out.join("report.html")).expect("a report");
    assert!(page.contains("bicgstab uses a range of adhesion of"));
    let grid = ["solve", "--challenge", "128", "--cut-off", "0.04", "--pressure", "0.02", "--gamma", "2e-5"];
    let law = ["--rho", "1e-3", "--json", "--method", "bicgstab", "--set", "bicgstab.min_resolution=4"];
    let output = asperity().args(grid).args(law).output().expect("started");
    assert!(output.status.success(), "{}", stderr(&output));
    let line = json_line(&output);
    let [requested, used] = ["requested", "used"].map(|k| line["range"][k].as_f64().expect("a length"));
    let length = results["scales"]["length_m"].as_f64().expect("a length");
    let [of_used, of_requested] = [used / range.used, requested / range.requested].map(|r| r * length - 1.0);
    assert!(of_used.abs() < 1e-9 && of_requested.abs() < 1e-9, "{line}");
    assert!(line["contact_nodes_compressive"].as_f64().is_some_and(|c| c > 0.0), "{line}");
}

/// A listener that ignores progress and stops the run once a file exists.
struct Until(std::path::PathBuf);

impl Listener for Until {
    fn begin(&self, _: &str, _: &str) {}
    fn progress(&self, _: Option<f64>, _: &str) {}
    fn end(&self, _: &StageCost) {}
    fn warn(&self, _: &str) {}
    fn stopping(&self) -> bool {
        self.0.exists()
    }
}

/// A stopped run continues after the last load that an estimator has finished, and is bit-identical to an uninterrupted
/// one, also with adhesion, where a load depends on the previous one.
#[test]
fn finished_loads_of_estimates_are_kept() {
    let scene = SCENE.replace("\"all\"", "\"srgw\"").replace("= 128", "= 64").replace("4.0", "8.0") + ADHESION;
    let folder = tempfile::tempdir().expect("scratch");
    let file = folder.path().join("kept.toml");
    std::fs::write(&file, scene).expect("written");
    let case = Case::read(&file).expect("a case");
    let never = Until(folder.path().join("never"));
    let (whole, _) = pipeline::run(&case, &folder.path().join("whole"), &never).expect("a run");
    let out = folder.path().join("stopped");
    let second = out.join("method-srgw").join("load-2.json");
    let stopped = pipeline::run(&case, &out, &Until(second.clone()));
    assert!(matches!(stopped, Err(Error::Interrupted)), "{:?}", stopped.map(|_| ()));
    // The final results contain the stored states of finished loads.
    let mark = |name: &str| {
        let path = second.with_file_name(name);
        let mut state: State = hashed::read(&path, true).valid().expect("kept");
        state.seconds = 1234.5;
        hashed::write(&path, &state, &[]).expect("written");
    };
    ["load-1.json", "load-2.json"].into_iter().for_each(mark);
    let (found, _) = pipeline::run(&case, &out, &never).expect("a run");
    let states = |r: &Results| r.methods[0].states.clone();
    let seconds: Vec<bool> = states(&found).iter().map(|s| s.seconds == 1234.5).collect();
    assert_eq!(seconds, [true, true, false]);
    let timeless = |r: &Results| {
        let mut all = states(r);
        all.iter_mut().for_each(|s| s.seconds = 0.0);
        all
    };
    assert!(found.methods[0].adhesive && timeless(&found) == timeless(&whole));
    assert!(!second.exists(), "loads are in the results now");
}

/// The table in docs/methods.md is the output of `asperity methods --markdown`.
#[test]
fn the_documentation_has_the_table_of_methods() {
    let output = asperity().args(["methods", "--markdown"]).output().expect("started");
    let table = String::from_utf8(output.stdout).expect("UTF-8");
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/methods.md");
    let document = std::fs::read_to_string(path).expect("the document");
    assert!(output.status.success() && document.contains(table.trim()), "put this into docs/methods.md:\n{table}");
}

//! Loads are named by the quantity in which they were given.

use crate::program::asperity;
use crate::scratch::Scratch;
use serde_json::Value;
use std::fs;

/// A small surface whose rms gradient differs between seeds, under `loads`.
fn scene(files: &Scratch, name: &str, loads: &str, more: &str) {
    let text = format!(
        "name = \"{name}\"\n[laboratory]\nlength = \"20 um\"\nmodulus = \"2 GPa\"\n[surface]\ngrid = 32\nroll_off = \"20 um\"\ncut_off = \"3 um\"\n\
         rms_gradient = 0.1\nseed = 1\n[load]\n{loads}\n{more}"
    );
    fs::write(files.path(&format!("{name}.toml")), text).expect("written");
}

/// What a run prints, and its report.
fn run(files: &Scratch, name: &str) -> (String, String) {
    let out = files.path(name);
    let ran = asperity()
        .arg("run")
        .arg(files.path(&format!("{name}.toml")))
        .arg("--out")
        .arg(&out)
        .output()
        .expect("started");
    let said = String::from_utf8_lossy(&ran.stderr).into_owned();
    assert!(ran.status.success(), "{said}");
    (String::from_utf8(ran.stdout).expect("UTF-8"), fs::read_to_string(out.join("report.html")).expect("a report"))
}

/// On the terminal, in the sentences, tables and axes of the report, and in the tables for programs.
#[test]
fn loads_are_named_as_they_were_given() {
    let files = Scratch::new();
    let adhesion = "unload = true\n[adhesion]\nwork_of_adhesion = \"5 mJ/m2\"\nrange = \"500 nm\"\n[continuum]\ncompare_with = [\"winkler\"]";
    // 20 µm squared: 4e-10 m².
    for (name, loads, head, shown, axis) in [
        ("pressure", "pressure = [\"2 MPa\", \"10 MPa\"]", "pressure", "10\u{a0}MPa", "mean pressure (MPa)"),
        ("force", "force = [\"0.8 mN\", \"4 mN\"]", "force", "4\u{a0}mN", "normal force (mN)"),
        ("reduced", "p_star = [0.01, 0.05]", "p*", "p* = 0.05", "reduced load p*"),
    ] {
        scene(&files, name, loads, adhesion);
        let (printed, page) = run(&files, name);
        assert!(printed.lines().any(|l| l.trim_start().starts_with(head)), "{name}: {printed}");
        assert!(printed.contains("γ = 5\u{a0}mJ/m², ρ = 500\u{a0}nm"), "{name}: {printed}");
        assert!(printed.contains(shown.trim_start_matches("p* = ")) && page.contains(shown), "{name}: {printed}");
        let [area, gap] = ["area", "mean-gap"]
            .map(|figure| fs::read_to_string(files.path(name).join(format!("figures/{figure}.svg"))).expect("drawn"));
        assert!(area.contains(axis) && gap.contains(axis), "{name}");
        // The definition of p*, and where the constants of winkler were fitted, are on every page.
        let count = page.matches("p* = ").count();
        assert!(if name == "reduced" { count > 2 } else { count == 2 }, "{name}: {count}");
        assert_eq!(page.contains("reduced load p*"), name == "reduced", "{name}");
        let curve = fs::read_to_string(files.path(name).join("curve.csv")).expect("a table");
        assert_eq!(curve.starts_with("load,force_N,"), name == "force", "{curve}");
    }
}

/// Methods without fields have their stiffness from neighbouring loads, in `solve` and in `run`.
#[test]
fn estimates_have_the_same_stiffness_in_solve_and_run() {
    let files = Scratch::new();
    let path = |name: &str| files.path(name).to_str().expect("UTF-8").to_string();
    let number_of = |value: &Value, key: &str| value[key].as_f64().expect("a number");
    let scene = "name = \"s\"\n[surface]\ngrid = 64\ncut_off_mode = 16\n[load]\np_star = [0.01, 0.02, 0.04]\n[continuum]\nmethod = \"srgw\"\n";
    fs::write(path("s.toml"), scene).expect("written");
    let run = asperity().args(["run", &path("s.toml"), "--json", "--out", &path("run")]).output().expect("started");
    let results = serde_json::from_slice::<Value>(&run.stdout).expect("JSON")["results"].clone();
    let [length, modulus] = ["length_m", "modulus_pa"].map(|key| number_of(&results["scales"], key));
    let states = results["methods"][0]["states"].as_array().expect("states");
    let flags = ["--cut-off", "0.0625", "--p-star", "0.01,0.02,0.04", "--method", "srgw", "--out", &path("solve")];
    let solved = asperity().args(["solve", "--challenge", "64", "--json"]).args(flags).output().expect("started");
    let lines = String::from_utf8(solved.stdout).expect("UTF-8");
    let lines: Vec<Value> = lines.lines().map(|l| serde_json::from_str(l).expect("JSON")).collect();
    assert_eq!((lines.len(), states.len()), (3, 3));
    for (line, state) in lines.iter().zip(states) {
        let (found, expected) = (number_of(line, "stiffness"), number_of(state, "stiffness") * length / modulus);
        assert!((found / expected - 1.0).abs() < 1e-6, "{found} {expected}");
    }
    let table = fs::read_to_string(path("solve") + "/curve.csv").expect("a table");
    assert!(table.lines().next().is_some_and(|head| head.contains("stiffness")), "{table}");
}

/// Contact areas and displacements are other pressures on other grids: no number of `solve` and `run` has an error there. Pressures have.
#[test]
fn loads_that_differ_between_grids_have_no_errors() {
    let files = Scratch::new();
    let kinds = [
        ("pressure", "pressure = [\"20 MPa\"]", "--pressure=0.01", true),
        ("contact", "contact = [0.2]", "--contact=0.2", false),
        ("displacement", "displacement = [\"0.3 um\"]", "--displacement=0.03", false),
    ];
    let adhesion = "[adhesion]\nwork_of_adhesion = \"5 mJ/m2\"\nrange = \"50 nm\"\nresolution = \"extrapolate\"";
    for (name, loads, flag, has_errors) in kinds {
        // With adhesion several states have one contact area.
        let more = format!("[continuum]\nleakage = true\n{}", if name == "contact" { "" } else { adhesion });
        scene(&files, name, loads, &more);
        run(&files, name);
        let results = fs::read_to_string(files.path(name).join("results.json")).expect("results");
        let results: Value = serde_json::from_str(&results).expect("JSON");
        let solved = asperity()
            .args(["solve", "--challenge", "64", "--seed", "1", "--cut-off", "0.05", "--leakage", "--json", flag])
            .output()
            .expect("started");
        let solved: Value = serde_json::from_slice(&solved.stdout).expect("one line");
        for state in [&results["continuum"]["states"][0], &solved] {
            let stated =
                ["contact_area_error", "mean_gap_error", "stiffness_error", "extrapolated"].map(|key| &state[key]);
            let of_flow =
                [&state["leakage"]["gap_errors"], &state["hydraulic_gap_x_error"], &state["discretisation"]["area"]];
            let known = stated.into_iter().chain(of_flow).filter(|value| !value.is_null()).count();
            assert_eq!(known > 0, has_errors, "{name}: {state}");
        }
    }
}

/// Maps of loads that are named as they are given.
#[test]
fn maps_are_kept_at_loads_of_every_kind() {
    let files = Scratch::new();
    for (name, loads, at) in [
        ("pressure", "pressure = [\"2 MPa\", \"10 MPa\"]", "\"10000 kPa\""),
        ("force", "force = [\"0.8 mN\", \"4 mN\"]", "\"4 mN\""),
        ("gap", "mean_gap = [\"0.1 um\", \"50 nm\"]", "\"50 nm\""),
        ("contact", "contact = [0.05, \"10 %\"]", "0.1"),
        ("reduced", "p_star = [0.01, 0.05]", "0.05"),
    ] {
        scene(&files, name, &format!("{loads}\nmaps_at = [{at}]"), "");
        run(&files, name);
        let results = fs::read_to_string(files.path(name).join("results.json")).expect("read");
        let results: Value = serde_json::from_str(&results).expect("JSON");
        let kept = |load: usize| results["continuum"]["states"][load]["gap_map"].is_string();
        assert_eq!([kept(0), kept(1)], [false, true], "{name}");
    }
    scene(&files, "other", "pressure = [\"2 MPa\"]\nmaps_at = [\"2 mN\"]", "");
    let refused = asperity().arg("run").arg(files.path("other.toml")).output().expect("started");
    let said = String::from_utf8_lossy(&refused.stderr);
    assert!(said.contains("load.maps_at[0] = 2 mN; accepted: one of the loads: 2 MPa"), "{said}");
}

/// The plan of a run has the memory of flow and of stress below the surface.
#[test]
fn plans_have_what_is_computed_from_the_states() {
    let files = Scratch::new();
    let planned = |more: &str| {
        scene(&files, "plan", "pressure = \"2 MPa\"", more);
        let plan =
            asperity().args(["run", "--dry-run", "--json"]).arg(files.path("plan.toml")).output().expect("started");
        let plan: Value = serde_json::from_slice(&plan.stdout).expect("JSON");
        let stage =
            plan["stages"].as_array().expect("stages").iter().find(|s| s["name"] == "continuum").expect("it is one");
        stage["bytes"].as_u64().expect("a number")
    };
    let own = planned("");
    // Both directions, eleven vectors on the 32² points and the coarser ones.
    assert_eq!(planned("[continuum]\nleakage = true") - own, 2 * 11 * 8 * 32 * 32 * 4 / 3);
    assert!(planned("[continuum.subsurface]\ndepths = [\"1 um\"]\npoisson = 0.3") > own);
}

/// Flow, leakage and stress below the surface are in the terminal and in the report, whose maps are those of the highest load.
#[test]
fn what_a_scene_asks_for_is_shown() {
    let files = Scratch::new();
    let more = "unload = true\n[continuum]\nhardness = \"0.2 GPa\"\nleakage = true\n\
                [continuum.subsurface]\ndepths = [\"0.5 um\", \"1 um\"]\npoisson = 0.3";
    scene(&files, "asked", "pressure = [\"2 MPa\", \"10 MPa\"]", more);
    let (printed, page) = run(&files, "asked");
    for column in ["flowing", "flow gap x", "flow gap y"] {
        assert!(printed.contains(column), "{column}: {printed}");
    }
    for part in ["Plastic flow", "Flow through the gap", "Stress below the surface", "at-load\">10\u{a0}MPa"] {
        assert!(page.contains(part), "{part}");
    }
    for figure in ["plastic-flow", "hydraulic-gap", "stress-below"] {
        assert!(files.path("asked").join(format!("figures/{figure}.svg")).is_file(), "{figure}");
    }
    // Their sources are in the report and in what is to be cited, and those of what the run does not have are not.
    let cited = asperity().arg("cite").arg(files.path("asked")).output().expect("started");
    let cited = String::from_utf8_lossy(&cited.stdout).into_owned();
    for (key, doi) in [
        ("Almqvist2007", "10.1016/j.triboint.2005.11.008"),
        ("Reynolds1886", "10.1098/rstl.1886.0005"),
        ("Johnson1985", "10.1017/CBO9781139171731"),
    ] {
        assert!(cited.contains(&format!("{{{key},")) && page.contains(doi), "{key}: {cited}");
    }
    assert!(!cited.contains("Love1929") && !cited.contains("Thompson2022"), "{cited}");
    // ParaView reads the maps of all three states from results.nc.
    let maps = fs::read_to_string(files.path("asked").join("results.xdmf")).expect("written");
    for (part, count) in [
        ("<Topology TopologyType=\"3DCoRectMesh\" Dimensions=\"1 32 32\"/>", 3),
        ("<Geometry GeometryType=\"ORIGIN_DXDYDZ\"><DataItem Dimensions=\"3\" Format=\"XML\">0 0 0</DataItem>", 3),
        ("Format=\"HDF\">results.nc:/stress<", 3),
        ("<Time Value=\"3\"/>", 1),
        ("2 0 0  1 1 1  1 32 32", 3),
    ] {
        assert_eq!(maps.matches(part).count(), count, "{part}: {maps}");
    }
    // 20 µm over 32 points.
    let spacing = maps.split("0 0 0</DataItem><DataItem Dimensions=\"3\" Format=\"XML\">").nth(1).expect("the spacing");
    let spacing: Vec<f64> = spacing.split(['<', ' ']).take(3).map(|number| number.parse().expect("a number")).collect();
    assert!(spacing.iter().all(|d| (d / 6.25e-7 - 1.0).abs() < 1e-12), "{spacing:?}");
    // Times are numbers of loads, also where only some have maps.
    scene(&files, "some", "pressure = [\"2 MPa\", \"10 MPa\"]\nmaps_at = [\"10 MPa\"]", "");
    run(&files, "some");
    let maps = fs::read_to_string(files.path("some").join("results.xdmf")).expect("written");
    assert!(maps.contains("<Time Value=\"2\"/>") && maps.contains("0 0 0  1 1 1  1 32 32"), "{maps}");
    assert!(!maps.contains("<Time Value=\"1\"/>"), "{maps}");
}

/// The plan of a trade-off has its reference, its settings, and no folder.
#[test]
fn a_trade_off_has_a_plan() {
    let files = Scratch::new();
    scene(&files, "plan", "pressure = \"2 MPa\"", "");
    let mut command = asperity();
    command.args(["tradeoff", "--dry-run", "--json", "--methods", "fast,persson"]);
    command.arg(files.path("plan.toml")).arg("--out").arg(files.path("out"));
    let planned = command.output().expect("started");
    let plan: Value = serde_json::from_slice(&planned.stdout).expect("JSON");
    let names: Vec<&str> =
        plan["stages"].as_array().expect("stages").iter().filter_map(|s| s["name"].as_str()).collect();
    // The reference on two grids (32 and 16), which are settings, too; the estimate on both; other precisions and tolerances of the solver.
    assert_eq!((names.iter().filter(|n| **n == "reference").count(), names.len()), (2, 2 + 2 + 5), "{names:?}");
    assert!(plan["bytes"].as_u64() > Some(0) && !files.path("out").exists());
}

/// Means over surfaces of different gradients have one pressure, and different p*.
#[test]
fn means_over_surfaces_are_at_the_given_load() {
    let files = Scratch::new();
    scene(&files, "pressure", "pressure = [\"2 MPa\", \"10 MPa\"]", "");
    let out = files.path("seeds");
    let ran = asperity()
        .arg("ensemble")
        .arg(files.path("pressure.toml"))
        .args(["--seeds", "1..3", "--out"])
        .arg(&out)
        .output();
    let printed = String::from_utf8(ran.expect("started").stdout).expect("UTF-8");
    assert!(printed.contains("10\u{a0}MPa") && !printed.contains("p*"), "{printed}");
    let text = fs::read_to_string(out.join("ensemble.json")).expect("read");
    let ensemble: Value = serde_json::from_str(&text).expect("JSON");
    let loads = ensemble["statistics"].as_array().expect("a list").iter();
    for statistic in loads {
        let pascal = [2e6, 1e7][statistic["load"].as_u64().expect("a load") as usize];
        assert!((statistic["pressure"].as_f64().expect("a pressure") / pascal - 1.0).abs() < 1e-12, "{statistic}");
    }
    let csv = fs::read_to_string(out.join("statistics.csv")).expect("read");
    assert!(csv.starts_with("source,load,branch,quantity,unit,p_star,pressure_Pa,"), "{csv}");
    let drawing = fs::read_to_string(out.join("figures/ensemble-0-contact_area-0.svg")).expect("drawn");
    assert!(drawing.contains("mean pressure (MPa)"), "{drawing}");
}

/// Under one gap each surface has a pressure of its own.
#[test]
fn the_pressure_of_imposed_gaps_has_a_scatter() {
    let files = Scratch::new();
    scene(&files, "gap", "mean_gap = [\"50 nm\"]", "");
    let out = files.path("seeds");
    let ran =
        asperity().arg("ensemble").arg(files.path("gap.toml")).args(["--seeds", "1..3", "--out"]).arg(&out).output();
    let printed = String::from_utf8(ran.expect("started").stdout).expect("UTF-8");
    let is_row = |line: &&str| line.trim_start().starts_with("continuum") && line.contains(" pressure ");
    let row = printed.lines().find(is_row).expect("a row");
    let text = fs::read_to_string(out.join("ensemble.json")).expect("read");
    let ensemble: Value = serde_json::from_str(&text).expect("JSON");
    let of_points = (1..=3).map(|seed| {
        let results = fs::read_to_string(out.join(format!("points/seed-{seed}/results.json"))).expect("read");
        let results: Value = serde_json::from_str(&results).expect("JSON");
        results["continuum"]["states"][0]["pressure"].as_f64().expect("a pressure")
    });
    let of_points: Vec<f64> = of_points.collect();
    let mean = of_points.iter().sum::<f64>() / 3e6;
    let statistics = ensemble["statistics"].as_array().expect("a list").iter();
    let pressure = statistics.clone().find(|s| s["quantity"] == "pressure").expect("it is observed");
    assert!((pressure["mean"].as_f64().expect("a mean") / mean - 1.0).abs() < 1e-12, "{pressure}");
    let deviation = (of_points.iter().map(|p| (p / 1e6 - mean).powi(2)).sum::<f64>() / 2.0).sqrt();
    let stated = pressure["standard_deviation"].as_f64().expect("a scatter");
    assert!((stated / deviation - 1.0).abs() < 1e-9 && stated > 0.01 * mean, "{stated} {deviation}");
    assert!(row.ends_with("MPa  "), "{printed}");
    let page = fs::read_to_string(out.join("report.html")).expect("drawn");
    assert!(page.contains("Contact at a mean gap of 50.0\u{a0}nm: "), "the first sentence names the gap");
    // Of an imposed contact the pressure is what came out.
    scene(&files, "contact", "contact = [0.1]", "");
    let out = files.path("contacts");
    let mut ran = asperity();
    ran.arg("ensemble").arg(files.path("contact.toml")).args(["--seeds", "1..3", "--out"]).arg(&out);
    assert!(ran.output().expect("started").status.success());
    let page = fs::read_to_string(out.join("report.html")).expect("drawn");
    assert!(page.contains("Pressure at a contact of "), "the first sentence names the contact");
}

/// Atoms are under load control: a pressure is the p* that it is on this surface, a gap is refused.
#[test]
fn atoms_take_pressures_and_forces() {
    let files = Scratch::new();
    let atoms = "[atoms]\ncells = 8\ndepth_cells = 6";
    // E* times the rms gradient is 200 MPa.
    let planned = ["p_star = [0.01, 0.05]", "pressure = [\"2 MPa\", \"10 MPa\"]", "force = [\"0.8 mN\", \"4 mN\"]"]
        .map(|loads| {
            scene(&files, "atoms", loads, atoms);
            let out = asperity().args(["run", "--dry-run"]).arg(files.path("atoms.toml")).output().expect("started");
            assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
            let plan = String::from_utf8(out.stdout).expect("UTF-8");
            plan.lines().find(|l| l.starts_with(" load ")).expect("the scaled load").to_string()
        });
    assert!(planned[0].contains("0.05000") && planned[1] == planned[0] && planned[2] == planned[0], "{planned:?}");
    scene(&files, "atoms", "mean_gap = [\"50 nm\"]", atoms);
    let refused = asperity().arg("run").arg(files.path("atoms.toml")).output().expect("started");
    let said = String::from_utf8_lossy(&refused.stderr);
    assert!(
        refused.status.code() == Some(2)
            && said.contains("load.mean_gap = given with atoms; accepted: load.p_star, load.pressure"),
        "{said}"
    );
}

/// Not as the number that they are in the units of the solve.
#[test]
fn refused_values_are_named_as_they_were_given() {
    let files = Scratch::new();
    let file = files.path("wave.npy");
    let surface = ["surface", "--grid", "32", "--cut-off", "20um", "--length", "100um", "--out"];
    assert!(asperity().args(surface).arg(&file).output().expect("started").status.success());
    for (flags, says) in [
        (&["--pressure", "-5kPa"][..], "--pressure = -5kPa;"),
        (&["--pressure=1kPa,-5kPa"], "--pressure = 1kPa,-5kPa;"),
        (&["--force", "-1 mN"], "--force = -1 mN;"),
        (&["--mean-gap=-30nm"], "--mean-gap = -30nm;"),
        (&["--pressure", "1kPa", "--low-pass", "1mm"], "--low-pass = 1mm; accepted: 6.25 um (2 points) to 100 um"),
        (&["--pressure", "1kPa", "--gamma=-3mJ/m2", "--rho", "1um"], "--work-of-adhesion = -3mJ/m2;"),
        (&["--p-star", "0.01,-0.02"], "--p-star = -0.02;"),
        (&["--pressure", "1kPa", "--thickness", "0nm", "--poisson", "0.3"], "--thickness = 0nm;"),
    ] {
        let output =
            asperity().arg("solve").arg(&file).args(["--modulus", "5MPa"]).args(flags).output().expect("started");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(2) && said.contains(says), "{flags:?}: {said}");
    }
}

/// Ends with this exit code; what it says on stderr.
fn ends(files: &Scratch, arguments: &[&str], code: i32) -> String {
    let ran = asperity().args(arguments).current_dir(files.path("")).output().expect("started");
    let said = String::from_utf8_lossy(&ran.stderr).into_owned();
    assert_eq!(ran.status.code(), Some(code), "{arguments:?}: {said}");
    said
}

/// Solvers know reduced units alone, and people none of them: the same complaints of a scene and of flags.
#[test]
fn solvers_complain_in_the_units_of_the_loads() {
    let files = Scratch::new();
    let heights: Vec<String> = (0..32)
        .map(|y| (0..32).map(|x| ((x * 7 + y * 11) % 13 * 10).to_string()).collect::<Vec<_>>().join(" "))
        .collect();
    fs::write(files.path("heights.txt"), heights.join("\n")).expect("written");
    let flags =
        ["solve", "heights.txt", "--touching", "high-points", "--unit", "nm", "--length", "20um", "--modulus", "2GPa"];
    for (load, keys, more, says) in [
        (
            "30 kPa",
            "[continuum]\nhardness = \"0.02 MPa\"",
            &["--hardness", "0.02MPa"][..],
            &["pressure = 30 kPa; accepted: less than 20 kPa, at which every node flows"][..],
        ),
        (
            "1e-20 Pa",
            "",
            &[],
            &["pressure", "; accepted: at least ", "times", "modulus, as a pressure: rounding of the heights"],
        ),
        ("1e200 MPa", "", &[], &["pressure = 1e200 MPa; accepted: at most 1e140 times"]),
        (
            "1.9 GPa",
            "[continuum]\nmethod = \"srgw\"",
            &["--method", "srgw"],
            &["pressure = 1.9 GPa; accepted: a lower pressure"],
        ),
    ] {
        let text = format!(
            "name = \"n\"\n[laboratory]\nlength = \"20 um\"\nmodulus = \"2 GPa\"\n[surface]\nheights = \"heights.txt\"\nunit = \"nm\"\n\
             touching = \"high-points\"\n[load]\npressure = [\"{load}\"]\n{keys}\n"
        );
        fs::write(files.path("scene.toml"), text).expect("written");
        // An estimate that is not delivered is no error of a run, but a warning.
        let code = if keys.contains("srgw") { 0 } else { 2 };
        let of_run = ends(&files, &["run", "scene.toml", "--out", "out", "--overwrite"], code);
        let pressure = format!("--pressure={}", load.replace(' ', ""));
        let of_solve = ends(&files, &[&flags, more, &[&pressure]].concat(), 2);
        for said in [of_run, of_solve] {
            assert!(says.iter().all(|part| said.contains(part)), "{load}: {said}");
            assert!(!said.contains(" E*"), "{load}: {said}");
        }
    }
    // Neither do warnings.
    let far = ends(&files, &[&flags[..], &["--pressure=1e9GPa"]].concat(), 0);
    assert!(far.contains("the highest load, a mean pressure of 1e9 GPa, is ") && !far.contains(" E*"), "{far}");
}

/// A tension that separates the surfaces ends a run with an error, after the results and the report of the loads before it. So does the
/// same run from its finished stages.
#[test]
fn a_tension_beyond_the_pull_off_keeps_the_loads_before_it() {
    let files = Scratch::new();
    let adhesion = "[adhesion]\nwork_of_adhesion = \"5 mJ/m2\"\nrange = \"500 nm\"\n";
    let (held, lost) = ("\"2 MPa\", \"10 MPa\", \"-1 kPa\"", "\"-500 MPa\", \"1 MPa\"");
    scene(&files, "lost", &format!("pressure = [{held}, {lost}]"), adhesion);
    scene(&files, "held", &format!("pressure = [{held}]"), adhesion);
    run(&files, "held");
    let states = |name: &str| -> Vec<Value> {
        let text = fs::read_to_string(files.path(name).join("results.json")).expect("results");
        let results: Value = serde_json::from_str(&text).expect("JSON");
        results["continuum"]["states"].as_array().expect("states").clone()
    };
    for attempt in ["solved", "taken from the run before"] {
        let said = ends(&files, &["run", "lost.toml", "--out", "lost"], 3);
        let last = said.trim_end().lines().last().expect("an error");
        let why = "contact is lost at load 4 of 5, a pressure of -500 MPa; accepted: a smaller tension; the loads before it are in lost/report.html";
        assert!(last.ends_with(why), "{attempt}: {said}");
        let numbers = |name: &str| -> Vec<Value> {
            states(name).iter().map(|s| serde_json::json!([s["pressure"], s["contact_area"], s["mean_gap"]])).collect()
        };
        assert_eq!(numbers("lost"), numbers("held"), "{attempt}");
    }
    let page = fs::read_to_string(files.path("lost/report.html")).expect("a report");
    assert_eq!(page.matches("contact is lost at load 4 of 5").count(), 1);
    assert_eq!(fs::read_to_string(files.path("lost/curve.csv")).expect("a table").lines().count(), 1 + 3);
    let left = fs::read_dir(files.path("lost/continuum")).expect("a folder").map(|e| e.expect("an entry").file_name());
    assert!(left.into_iter().all(|name| !name.to_string_lossy().contains("partial")));
    // A sweep has the loads of every realisation.
    let sweep = "scene = \"lost.toml\"\nname = \"lost\"\n[over]\nsurface.seed = [1, 2]\n";
    fs::write(files.path("sweep.toml"), sweep).expect("written");
    ends(&files, &["sweep", "sweep.toml", "--out", "sweep"], 3);
    let text = fs::read_to_string(files.path("sweep/ensemble.json")).expect("an ensemble");
    let ensemble: Value = serde_json::from_str(&text).expect("JSON");
    for point in ensemble["points"].as_array().expect("points") {
        assert_eq!(point["status"], "done");
        assert!(point["warnings"].to_string().contains("contact is lost at load 4 of 5"), "{point}");
    }
    let areas =
        ensemble["statistics"].as_array().expect("statistics").iter().filter(|s| s["quantity"] == "contact_area");
    assert_eq!(areas.map(|s| s["realisations"].as_u64()).collect::<Vec<_>>(), [Some(2); 3]);
    // Of the grids that are solved for an accuracy none reaches an error without the last loads, and the last one has those before.
    let within = ends(&files, &["run", "lost.toml", "--out", "within", "--error", "50%"], 3);
    assert!(within.contains("an error of 50 % is not reached") && within.contains("contact is lost at load 4 of 5"));
    assert_eq!(states("within").len(), 3);
    // Without a load before it there is nothing to report.
    scene(&files, "none", "pressure = [\"-500 MPa\"]", adhesion);
    assert!(ends(&files, &["run", "none.toml", "--out", "none"], 3).contains("load 1: detached"));
    assert!(!files.path("none/report.html").exists());
}

/// A flat surface has no p*, and no contact fraction or displacement in between; pressures, forces and mean gaps it has.
#[test]
fn loads_of_a_flat_surface() {
    let files = Scratch::new();
    // The mean of these heights is not 0.1 to the last digit.
    fs::write(files.path("flat.txt"), "0.1 0.1 0.1 0.1 0.1\n".repeat(7)).expect("written");
    for (flags, refused) in [
        (["--p-star", "0.01"], true),
        (["--contact", "5%"], true),
        (["--displacement", "0.01"], true),
        (["--pressure", "0.01"], false),
        (["--force", "0.01"], false),
        (["--mean-gap", "0.01"], false),
    ] {
        let mut command = asperity();
        command.arg("solve").arg(files.path("flat.txt")).args(["--touching", "high-points"]);
        let ran = command.args(["--length", "1", "--modulus", "1"]).args(flags).output().expect("started");
        let said = String::from_utf8_lossy(&ran.stderr);
        assert_eq!(ran.status.code(), Some(if refused { 2 } else { 0 }), "{flags:?}: {said}");
        let reason = format!("{} = ", flags[0]);
        assert_eq!(said.contains(&reason) && said.contains("mean gaps: the surface is flat"), refused, "{said}");
    }
}

/// Atoms are pressed to the highest load and unloaded once: other orders are refused, as the states at their loads would be of another path.
#[test]
fn loads_of_atoms_rise() {
    let files = Scratch::new();
    for (loads, falls) in [("[0.03, 0.01]", Some(1)), ("[0.01, 0.05, 0.02]", Some(2)), ("[0.01, 0.03, 0.01]", None)] {
        let scene = format!(
            "name = \"t\"\n[surface]\ngrid = 32\ncut_off_mode = 8\n[load]\np_star = {loads}\n[atoms]\ncells = 10\ndepth_cells = 6\n"
        );
        fs::write(files.path("scene.toml"), scene).expect("written");
        let said = ends(&files, &["run", "scene.toml", "--dry-run"], if falls.is_some() { 2 } else { 0 });
        if let Some(i) = falls {
            assert!(said.contains(&format!("load.p_star[{i}]")) && said.contains("load.unload"), "{said}");
        }
    }
}

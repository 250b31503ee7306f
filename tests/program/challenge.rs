//! `asperity challenge`: solution, acceptance checks and figures; statements that the grid cannot test are not
//! assessed.

use crate::program::{asperity, json_line, stderr};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;

fn challenge(out: &Path, flags: &[&str]) -> (Option<i32>, Value) {
    let output = asperity().args(["challenge", "--json", "--out"]).arg(out).args(flags).output().expect("started");
    assert!(matches!(output.status.code(), Some(0 | 1)), "{}", stderr(&output));
    (output.status.code(), json_line(&output))
}

fn verdicts(said: &Value) -> BTreeMap<String, (String, Option<f64>)> {
    let list = said["acceptance"].as_array().expect("a list");
    list.iter()
        .map(|j| {
            assert!(!j["reason"].as_str().expect("a reason").is_empty() || j["status"] == "pass", "{j}");
            let text = |key: &str| j[key].as_str().expect("text").to_string();
            (text("id"), (text("status"), j["value"].as_f64()))
        })
        .collect()
}

/// Statements that do not depend on adhesion and can be tested on any grid.
const ALWAYS: [&str; 10] = ["S01", "S02", "S03", "S04a", "S04c", "S07a", "S07b", "S09", "S12", "S24"];
/// Statements that need a grid that resolves adhesion; and those that also need the shortest waves of the surface.
const OF_ADHESION: [&str; 4] = ["S21a", "S21b", "S23a", "S23b"];
const OF_BOTH: [&str; 8] = ["S05", "S06", "S08", "S10", "S15", "S17a", "S17b", "S18"];

#[test]
fn a_grid_that_resolves_the_adhesion_is_assessed() {
    let out = tempfile::tempdir().expect("a folder");
    let folder = out.path().join("run");
    let (code, said) = challenge(&folder, &["--grid", "256", "--regularise"]);
    let found = verdicts(&said);
    assert_eq!(found["MESH"].0, "pass");
    for id in ALWAYS {
        assert_eq!(found[id].0, "pass", "{id}: {:?}", found[id]);
    }
    for id in OF_ADHESION {
        assert_ne!(found[id].0, "not assessed", "{id}");
    }
    // Half of the gradient is in waves that the grid does not resolve, and the lowest point may be between its nodes.
    for id in ["S04b", "S04d", "S11a", "S11b", "S13", "S16", "S22"].iter().chain(&OF_BOTH) {
        assert_eq!(found[*id].0, "not assessed", "{id}");
    }
    assert_eq!(code == Some(1), found.values().any(|(v, _)| v == "fail"), "the exit code is 1 for failures");

    let results: Value = serde_json::from_str(&std::fs::read_to_string(folder.join("results.json")).unwrap()).unwrap();
    let states = |of: &str| results[of]["states"].as_array().expect("states").clone();
    let (with, without) = (states("continuum"), states("non_adhesive"));
    assert_eq!((with.len(), without.len()), (23, 12), "there and back with adhesion, there without");
    assert!(with.iter().skip(12).all(|s| s["branch"] == "unloading" && s["hysteresis"]["area"].is_number()));
    assert!(with.iter().take(12).all(|s| s["branch"] == "loading" && s["hysteresis"].is_null()));
    assert!(results["continuum"]["dissipation"].is_number());
    let kept = with.iter().filter(|s| s["gap_map"].is_string()).map(|s| s["p_star"].as_f64().unwrap());
    assert!(kept.clone().count() == 2 && kept.clone().all(|p| p == 0.01), "maps at the reference load, both ways");
    for (with, without) in with.iter().zip(&without) {
        let nodes = |s: &Value| s["contact_nodes"].as_f64().unwrap();
        assert!(nodes(with) >= nodes(without), "adhesion takes no contact away");
        assert!(without["observed"]["compressive"].is_null());
        assert!(with["contact_nodes_compressive"].as_f64().unwrap() <= nodes(with));
    }
    for number in [1, 4, 5, 6, 7, 8, 9, 10, 11, 12] {
        let figure = folder.join(format!("figures/figure-{number:02}.svg"));
        let text = std::fs::read_to_string(&figure).unwrap_or_else(|e| panic!("{}: {e}", figure.display()));
        assert!(text.starts_with("<svg") && text.contains("</svg>"));
    }
    let page = std::fs::read_to_string(folder.join("report.html")).unwrap();
    assert!(page.contains("Acceptance checks of the challenge") && page.contains("The paper’s figure 12"));
    std::fs::remove_file(folder.join("report.html")).expect("removed");
    let drawn = asperity().arg("report").arg(&folder).output().expect("started");
    assert!(drawn.status.success(), "{}", stderr(&drawn));
    assert!(std::fs::read_to_string(folder.join("report.html")).unwrap() == page, "the same results, another report");
}

#[test]
fn a_grid_that_pins_contact_lines_judges_no_adhesion() {
    let out = tempfile::tempdir().expect("a folder");
    let (_, said) = challenge(&out.path().join("run"), &["--grid", "128", "--seed", "2"]);
    let found = verdicts(&said);
    for id in OF_ADHESION.iter().chain(&OF_BOTH).chain(&["MESH"]) {
        assert_eq!(found[*id].0, "not assessed", "{id}");
    }
    assert_eq!(found["S14"].0, "pass", "a bound that holds on any grid");
    assert!(said["surface"].as_str().unwrap().contains("seed 2"));
}

/// A coarse file of the challenge's surface is loaded with the challenge's loads; statements about short waves are not
/// assessed.
#[test]
fn a_coarse_file_is_not_the_whole_surface() {
    let out = tempfile::tempdir().expect("a folder");
    let file = out.path().join("heights.npy");
    let made = asperity().args(["surface", "--grid", "64", "--out"]).arg(&file).output().expect("started");
    assert!(made.status.success(), "{}", stderr(&made));
    let heights = file.to_str().unwrap();
    let (_, said) = challenge(&out.path().join("run"), &["--heights", heights, "--unit", "1 um", "--regularise"]);
    let found = verdicts(&said);
    assert_eq!(found["S02"].0, "pass", "{:?}", found["S02"]);
    for id in ["S04a", "S04b", "S04c", "S04d", "S13"].iter().chain(&OF_BOTH) {
        assert_eq!(found[*id].0, "not assessed", "{id}");
    }
    for (args, expected) in [
        (vec!["--heights", "nowhere.h5"], "--heights = nowhere.h5 (no such file)"),
        (vec!["--heights", heights, "--grid", "128"], "--grid = 128; accepted: none: "),
        (vec!["--fourier", "series"], "--fourier = given; accepted: only together with a file, --heights"),
    ] {
        let refused = asperity().arg("challenge").args(&args).output().expect("started");
        assert_eq!(refused.status.code(), Some(2), "{args:?}");
        assert!(stderr(&refused).contains(expected), "{args:?}: {}", stderr(&refused));
    }
}

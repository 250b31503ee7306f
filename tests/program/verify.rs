//! Finished runs repeated, and as RO-Crates.

use crate::program::{asperity, json_line, stderr};
use crate::scratch::Scratch;
use asperity::surface::files::hashed::{CHECKSUMS, file_hash, write_checksums};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Output;

/// A run of a map in a folder of its own, in which the scene names it.
fn run(files: &Scratch) {
    let measured = files.map("measured.npy", [32, 32], |x, y| ((x * x + 3 * y) % 13) as f64 + ((5 * y + x) % 7) as f64);
    // With a sidecar, which declares unit, extents and sign.
    let declared = ["--unit", "nm", "--length", "3um", "--touching", "high-points", "--out"];
    let written =
        asperity().args(["surface", &measured]).args(declared).arg(files.path("map.npy")).output().expect("started");
    assert!(written.status.success() && files.path("map.npy.json").exists(), "{}", stderr(&written));
    let scene = "name = \"small\"\n[laboratory]\nmodulus = \"2 GPa\"\n[surface]\nheights = \"map.npy\"\n[load]\n\
                 pressure = [\"1 MPa\", \"4 MPa\"]\n";
    fs::write(files.path("small.toml"), scene).expect("written");
    let ran = asperity().arg("run").arg(files.path("small.toml")).arg("--out").arg(files.path("run")).output();
    let ran = ran.expect("started");
    assert!(ran.status.success(), "{}", stderr(&ran));
}

fn verify(folder: &Path, more: &[&str]) -> Output {
    asperity().arg("verify").arg(folder).args(more).output().expect("started")
}

fn read(file: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(file).expect("a file")).expect("JSON")
}

/// Number of files of a folder and those below.
fn files_of(folder: &Path) -> usize {
    let entries = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path());
    entries.map(|path| if path.is_dir() { files_of(&path) } else { 1 }).sum()
}

/// A repetition has the same bits, a number that is another one is named, and a damaged field is not used.
#[test]
fn a_run_comes_out_again_to_the_bit() {
    let files = Scratch::new();
    run(&files);
    let out = files.path("run");
    let found = json_line(&verify(&out, &["--json"]));
    assert_eq!(found["agrees"], true, "{found}");
    let repetition = &found["repetition"];
    // Gap and stress of two loads, the heights.
    assert_eq!((&repetition["fields"], &repetition["changed_numbers"]), (&Value::from(5), &Value::from(0)));
    assert!(repetition["numbers"].as_u64().is_some_and(|n| n > 100), "{repetition}");
    // Another number, as of another processor.
    let mut results = read(&out.join("results.json"));
    let gap = results["continuum"]["states"][1]["mean_gap"].as_f64().expect("a gap");
    results["continuum"]["states"][1]["mean_gap"] = (gap * (1.0 + 1e-7)).into();
    fs::write(out.join("results.json"), results.to_string()).expect("written");
    let listed = fs::read_to_string(out.join(CHECKSUMS)).expect("a list");
    let names: Vec<&str> = listed.lines().filter_map(|line| Some(line.split_once("  ")?.1)).collect();
    write_checksums(&out, &names).expect("listed");
    let other = verify(&out, &[]);
    let said = String::from_utf8_lossy(&other.stdout);
    assert_eq!(other.status.code(), Some(1), "{said}");
    assert!(said.contains("of continuum.states[1].mean_gap") && said.contains("NOT verified to the bit"), "{said}");
    assert!(verify(&out, &["--tolerance", "1e-6"]).status.success());
    assert_eq!(verify(&out, &["--tolerance", "1e-8"]).status.code(), Some(1));
    for damaged in ["curve.csv", "continuum/load-1-gap.npy"] {
        fs::write(out.join(damaged), "damaged").expect("written");
        let refused = verify(&out, &[]);
        assert!(refused.status.code() == Some(2) && stderr(&refused).contains(damaged), "{}", stderr(&refused));
        fs::remove_file(out.join(damaged)).expect("removed");
    }
}

/// The metadata list every file with size and hash, and the copies of the inputs are enough for a repetition.
#[test]
fn a_crate_has_what_a_repetition_needs() {
    let files = Scratch::new();
    run(&files);
    let out = files.path("run");
    let made = asperity().arg("crate").arg(&out).args(["--license", "CC-BY-4.0"]).output().expect("started");
    assert!(made.status.success(), "{}", stderr(&made));
    let metadata = read(&out.join("ro-crate-metadata.json"));
    let graph = metadata["@graph"].as_array().expect("entities");
    let entity = |id: &str| graph.iter().find(|e| e["@id"] == id).unwrap_or_else(|| panic!("no {id}"));
    assert_eq!(entity("./")["license"]["@id"], "https://spdx.org/licenses/CC-BY-4.0");
    let parts = entity("./")["hasPart"].as_array().expect("files");
    for name in parts.iter().map(|part| part["@id"].as_str().expect("a name")) {
        let (file, described) = (out.join(name), entity(name));
        assert_eq!(described["contentSize"], fs::metadata(&file).expect(name).len().to_string(), "{name}");
        assert_eq!(described["identifier"], format!("blake3:{}", file_hash(&file).expect(name)), "{name}");
    }
    for name in [
        "results.json",
        "scene.toml",
        "report.html",
        "inputs/surface.heights.npy",
        "inputs/surface.heights.npy.json",
        "continuum/load-2-gap.npy",
    ] {
        assert!(parts.iter().any(|part| part["@id"] == name), "{name}");
    }
    // All files of the folder, so that these alone can be verified.
    assert_eq!(parts.len(), files_of(&out) - 2, "all but the metadata and the lock");
    // In another place, without the file that the scene names.
    let moved = files.path("moved");
    fs::rename(&out, &moved).expect("moved");
    ["map.npy", "map.npy.json"].iter().for_each(|name| fs::remove_file(files.path(name)).expect("removed"));
    let found = verify(&moved, &[]);
    assert!(found.status.success(), "{}", stderr(&found));
    assert!(String::from_utf8_lossy(&found.stdout).contains("verified to the bit"));
    // A copy that is another file is not used, and metadata do not outlive the files that they describe.
    fs::write(moved.join("inputs/surface.heights.npy"), "another").expect("written");
    let refused = verify(&moved, &[]);
    assert!(refused.status.code() == Some(2) && stderr(&refused).contains("surface.heights"), "{}", stderr(&refused));
    let drawn = asperity().arg("report").arg(&moved).output().expect("started");
    assert!(drawn.status.success() && !moved.join("ro-crate-metadata.json").exists(), "{}", stderr(&drawn));
}

#[test]
fn what_cannot_be_repeated_is_refused() {
    let files = Scratch::new();
    run(&files);
    let [out, here] = [files.word("run"), files.word("here")];
    fs::create_dir(&here).expect("a folder");
    for (arguments, words) in [
        (&["verify", &here][..], "not a run folder"),
        (&["verify", &out, "--out", &here], "--out = "),
        (&["verify", &out, "--tolerance", "-1"], "--tolerance = -1; accepted: zero, or a number below 1"),
        (&["crate", &here, "--license", "CC0-1.0"], "not a run folder"),
        (&["crate", &out, "--license", "of my own"], "--license = \"of my own\"; accepted: an SPDX identifier"),
        (&["crate", &out], "--license"),
    ] {
        let refused = asperity().args(arguments).output().expect("started");
        assert_eq!(refused.status.code(), Some(2), "{arguments:?}");
        assert!(stderr(&refused).contains(words), "{arguments:?}: {}", stderr(&refused));
    }
    // Another map in the place of that of the run.
    files.map("map.npy", [32, 32], |x, y| (x + y) as f64);
    for arguments in [&["verify", &out][..], &["crate", &out, "--license", "CC0-1.0"]] {
        let refused = asperity().args(arguments).output().expect("started");
        let said = stderr(&refused);
        assert!(refused.status.code() == Some(2) && said.contains("another file than the run read"), "{said}");
    }
    // A map that is not there any more, and of which there is no copy.
    fs::remove_file(files.path("map.npy")).expect("removed");
    let missing = verify(Path::new(&out), &[]);
    assert!(missing.status.code() == Some(2) && stderr(&missing).contains("map.npy"), "{}", stderr(&missing));
}

//! Repulsion and contact distance of the indenter in scenes: the challenge's, scaled to another crystal, given, refused.

use crate::program::{asperity, json_line, stderr};
use crate::similar_crystal::{self, ALUMINIUM, CALCIUM};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Output;

/// The challenge's ε (eV), σ and d_c (Å).
const CHALLENGE: [f64; 3] = [0.2145, 3.5927, 4.0354];

fn scene(folder: &Path, atoms: &str) -> PathBuf {
    let text = format!(
        "name = \"a\"\n[surface]\ngrid = 32\nroll_off_mode = 2\ncut_off_mode = 8\nrms_gradient = 0.3\n[load]\np_star = [0.01]\n\
         [atoms]\ncells = 10\ndepth_cells = 6\nstep = \"0.3 Å\"\n{atoms}"
    );
    let file = folder.join("scene.toml");
    std::fs::write(&file, text).expect("written");
    file
}

fn dry_run(folder: &Path, atoms: &str) -> Output {
    asperity().arg("run").arg(scene(folder, atoms)).arg("--dry-run").output().expect("started")
}

/// The plan, with its warnings.
fn planned(folder: &Path, atoms: &str) -> String {
    let plan = dry_run(folder, atoms);
    assert!(plan.status.success(), "{}", stderr(&plan));
    String::from_utf8_lossy(&plan.stdout).into_owned()
}

/// ε, σ and d_c of the job of a scene, by `job.json`, and the scaling audit.
fn job(folder: &Path, atoms: &str) -> ([f64; 3], Value) {
    let out = folder.join("job");
    let mut command = asperity();
    command.args(["atoms", "build"]).arg(scene(folder, atoms)).arg("--out").arg(&out).arg("--json");
    let built = command.output().expect("started");
    assert!(built.status.success(), "{}", stderr(&built));
    let is_warned = stderr(&built).contains("set other values");
    assert_eq!(is_warned, atoms.contains("Al.eam.alloy"), "{}", stderr(&built));
    let text = std::fs::read_to_string(out.join("job.json")).expect("a job");
    let spec: Value = serde_json::from_str(&text).expect("JSON");
    let (pair, settings) = (&spec["interaction"], &spec["settings"]);
    let variables = std::fs::read_to_string(out.join("in.vars")).expect("variables");
    let constants = [&pair["epsilon_ev"], &pair["sigma_angstrom"], &settings["contact_angstrom"]];
    for (name, value) in ["epsilon", "sigma", "contact"].into_iter().zip(constants) {
        assert!(variables.contains(&format!("-var {name} {value}\n")), "{name} in {variables}");
    }
    (constants.map(|v| v.as_f64().expect("a number")), json_line(&built)["audit"].clone())
}

fn status<'a>(audit: &'a Value, group: &str) -> &'a str {
    let lines = audit.as_array().expect("lines");
    lines.iter().find(|l| l["group"] == group).and_then(|l| l["status"].as_str()).expect("a line")
}

const GROUPS: [&str; 3] = ["repulsion energy", "repulsion range", "contact distance"];

/// σ and d_c in proportion to the lattice constant, ε to E* a0³.
#[test]
fn another_crystal_gets_the_scaled_constants_and_a_warning() {
    let scratch = tempfile::tempdir().expect("scratch");
    let keys = similar_crystal::keys(&scratch.path().join("Al.eam.alloy"));
    let said = planned(scratch.path(), &keys);
    for word in [
        "scaled to this Al (a0 = 4.05 Å, E* = 80 GPa): epsilon = 0.22862 eV, sigma = 2.6037 Å, contact distance d_c = 2.9245 Å",
        "atoms.indenter_epsilon, atoms.indenter_sigma, atoms.contact_distance set other values",
    ] {
        assert!(said.contains(word), "{said}");
    }
    let (found, audit) = job(scratch.path(), &keys);
    let length = ALUMINIUM.0 / CALCIUM.0;
    let expected = [ALUMINIUM.1 / CALCIUM.1 * length.powi(3), length, length];
    for k in 0..3 {
        assert!((found[k] / CHALLENGE[k] / expected[k] - 1.0).abs() < 1e-12, "{found:?}");
        assert_eq!(status(&audit, GROUPS[k]), "kept");
    }
}

/// Nothing is scaled and nothing is said for the challenge's crystal, also where a file has it.
#[test]
fn the_challenges_crystal_has_the_challenges_constants() {
    let scratch = tempfile::tempdir().expect("scratch");
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("potentials/Ca.eam.alloy");
    let other = format!("potential = {file:?}\nlattice_constant = \"5.5884 Å\"\nmodulus = \"28.57 GPa\"\n");
    for keys in ["", &other] {
        let said = planned(scratch.path(), keys);
        assert!(!said.contains("set other values") && !said.contains("is the challenge's"), "{said}");
        let (found, audit) = job(scratch.path(), keys);
        assert_eq!(found, CHALLENGE);
        assert!(GROUPS.iter().all(|g| status(&audit, g) == "kept"), "{audit}");
    }
}

/// Given constants are used as they are; d_c follows a given σ; calcium's for another element are warned of.
#[test]
fn given_constants_are_used() {
    let scratch = tempfile::tempdir().expect("scratch");
    let given = "indenter_epsilon = \"0.3 eV\"\nindenter_sigma = \"3.4 Å\"\ncontact_distance = \"4.2 Å\"\n";
    let (found, audit) = job(scratch.path(), given);
    assert_eq!(found, [0.3, 3.4, 4.2]);
    assert!(GROUPS.iter().all(|g| status(&audit, g) == "changed"), "{audit}");
    let (found, audit) = job(scratch.path(), "indenter_sigma = \"3.4 Å\"\n");
    assert_eq!(found[..2], [0.2145, 3.4]);
    assert!((found[2] / 3.4 - CHALLENGE[2] / CHALLENGE[1]).abs() < 1e-12, "{found:?}");
    assert_eq!(GROUPS.map(|g| status(&audit, g)), ["kept", "changed", "kept"]);
    let keys = similar_crystal::keys(&scratch.path().join("Al.eam.alloy"));
    let calciums = format!("{keys}indenter_sigma = \"3.5927 Å\"\ncontact_distance = \"4.1 Å\"\n");
    let said = planned(scratch.path(), &calciums);
    let word = "atoms.indenter_sigma = 3.5927 Å is the challenge's for calcium; scaled to this Al it is 2.6037 Å";
    assert!(said.contains(word), "{said}");
    assert!(
        said.contains("GPa): epsilon = 0.22862 eV; atoms.indenter_epsilon set")
            && !said.contains("contact distance d_c ="),
        "{said}"
    );
}

/// Refused values are named with their key and with what is accepted.
#[test]
fn bad_constants_are_refused() {
    let scratch = tempfile::tempdir().expect("scratch");
    for (keys, said) in [
        ("indenter_epsilon = \"0.0 eV\"", "atoms.indenter_epsilon = 0 eV; accepted: a positive number"),
        ("indenter_sigma = \"-1.0 Å\"", "atoms.indenter_sigma = -1 Å; accepted: a positive number"),
        ("contact_distance = \"nan Å\"", "atoms.contact_distance = \"nan Å\"; accepted: a length with its unit"),
        ("indenter_epsilon = \"1e9 eV\"", "atoms.indenter_epsilon = 1000000000 eV; accepted: 0.0002145 to 214.5 eV"),
        ("indenter_sigma = \"1e-6 Å\"", "atoms.indenter_sigma = 0.000001 Å; accepted: 0.55884 to 6.2461 Å"),
        ("indenter_sigma = \"6.3 Å\"", "atoms.indenter_sigma = 6.3 Å; accepted: 0.55884 to 6.2461 Å"),
        (
            "contact_distance = \"4.0 Å\"",
            "atoms.contact_distance = 4 Å; accepted: 4.0327 to 7.0158 Å: from where the repulsion begins",
        ),
        ("contact_distance = \"4.0 Å\"", "atoms would carry load without being in contact"),
        ("contact_distance = \"7.1 Å\"", "atoms.contact_distance = 7.1 Å; accepted: 4.0327 to 7.0158 Å"),
    ] {
        let output = dry_run(scratch.path(), keys);
        assert_eq!(output.status.code(), Some(2), "{keys}");
        assert!(stderr(&output).contains(said), "{keys}: {}", stderr(&output));
    }
    // The printed limit is accepted.
    assert!(dry_run(scratch.path(), "contact_distance = \"4.0327 Å\"").status.success());
}

//! Scenes with an accuracy target: the chosen setting meets it and is reported; a target out of reach gives a one-line
//! error.

use crate::program::{asperity, json_line, stderr};
use std::path::{Path, PathBuf};
use std::process::Output;

const SURFACE: &str = "name = \"asked\"\n[surface]\ncut_off_um = 4.0\nseed = 3\n";
const LOADS: &str = "[load]\np_star = [0.005, 0.02]\n";

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Folder(tempfile::tempdir().expect("scratch"))
    }

    fn file(&self, name: &str, text: &str) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, text).expect("written");
        path
    }

    fn run(&self, scene: &Path, flags: &[&str]) -> Output {
        asperity()
            .arg("run")
            .arg(scene)
            .arg("--out")
            .arg(self.0.path().join("out"))
            .args(flags)
            .output()
            .expect("started")
    }
}

/// The mean gap of the chosen setting is within the target, against a grid of eight times the points per side. The
/// choice is in results and manifest, and the stages cost no more than it needs.
#[test]
fn the_chosen_setting_keeps_what_was_asked() {
    let folder = Folder::new();
    let reference = folder.file("fine.toml", &format!("{SURFACE}grid = 1024\n{LOADS}"));
    let fine = json_line(&folder.run(&reference, &["--json"]));
    let gap = |told: &serde_json::Value, i: usize| {
        told["results"]["continuum"]["states"][i]["mean_gap"].as_f64().expect("a mean gap")
    };
    for share in [0.05, 0.005] {
        let text = format!("{SURFACE}{LOADS}[accuracy]\nquantity = \"mean_gap\"\nerror = {share}\n");
        let output = folder.run(&folder.file("asked.toml", &text), &["--json"]);
        assert!(output.status.success(), "{}", stderr(&output));
        let told = json_line(&output);
        let chosen = &told["results"]["accuracy"];
        let expected = chosen["advice"]["expected_error"].as_f64().expect("an error");
        assert!(expected <= share && chosen["error"] == share, "{chosen}");
        assert!(stderr(&output).contains("mean gap within"), "{}", stderr(&output));
        let manifest = std::fs::read_to_string(folder.0.path().join("out/manifest.json")).expect("a manifest");
        let manifest: serde_json::Value = serde_json::from_str(&manifest).expect("JSON");
        assert_eq!(manifest["accuracy"], *chosen);
        if chosen["advice"]["method"] == "fast" {
            for i in 0..2 {
                let error = (gap(&told, i) / gap(&fine, i) - 1.0).abs();
                // The target applies to the root mean square over two loads: a single error may be √2 times as large.
                assert!(error <= 2f64.sqrt() * share, "{error} of {share}");
            }
            assert_eq!(told["results"]["continuum"]["nx"], chosen["advice"]["grid"]);
        }
    }
}

#[test]
fn what_cannot_be_served_is_refused() {
    let folder = Folder::new();
    let asks = "[accuracy]\nquantity = \"mean_gap\"\n";
    let refused = [
        (format!("{SURFACE}{LOADS}{asks}"), "accuracy", "one of error"),
        (format!("{SURFACE}{LOADS}{asks}error = 0.1\nbudget_s = 3.0\n"), "accuracy", "one of error"),
        (format!("{SURFACE}{LOADS}{asks}error = -0.1\n"), "accuracy.error", "positive"),
        (format!("{SURFACE}{LOADS}{asks}error = 1e-12\n"), "accuracy.error", "at least"),
        (format!("{SURFACE}{LOADS}{asks}budget_s = 1e-9\n"), "accuracy.budget_s", "at least"),
        (format!("{SURFACE}grid = 256\n{LOADS}{asks}error = 0.1\n"), "surface.grid", "[accuracy]"),
        (
            format!("{SURFACE}{LOADS}{asks}error = 0.1\n[continuum]\nmethod = \"bvm\"\n"),
            "continuum.method",
            "[accuracy]",
        ),
        (format!("{SURFACE}{LOADS}{asks}error = 0.1\ntables = [\"none.json\"]\n"), "accuracy.tables", "tradeoff"),
        (format!("{SURFACE}[load]\np_star = [7.0]\n{asks}error = 0.1\n"), "accuracy.error", "were measured"),
        (format!("{SURFACE}{LOADS}[accuracy]\nquantity = \"beauty\"\nerror = 0.1\n"), "beauty", "contact_area"),
    ];
    for (text, key, accepted) in refused {
        let output = folder.run(&folder.file("refused.toml", &text), &[]);
        let told = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{text}: {told}");
        assert!(told.contains(key) && told.contains(accepted) && told.contains("refused.toml"), "{text}: {told}");
        assert!(!folder.0.path().join("out").exists(), "{text} left a folder");
    }
    let good = folder.file("good.toml", &format!("{SURFACE}{LOADS}{asks}error = 0.1\n"));
    let output = folder.run(&good, &["--grid", "64"]);
    assert!(output.status.code() == Some(2) && stderr(&output).contains("--grid"), "{}", stderr(&output));
}

/// On a surface that is not in the tables the recommended setting is run and compared with a reference.
#[test]
fn advice_is_proved() {
    let folder = Folder::new();
    let scene = folder.file("unseen.toml", &format!("{SURFACE}{LOADS}"));
    let mut command = asperity();
    command.arg("advise").arg(&scene).args(["--quantity", "contact_area,mean_gap", "--error", "5%,20%", "--verify"]);
    command.args(["--seeds", "41", "--json", "--out"]).arg(folder.0.path().join("proof"));
    let output = command.output().expect("started");
    assert!(output.status.success(), "{} {}", stderr(&output), String::from_utf8_lossy(&output.stdout));
    let told = json_line(&output);
    assert_eq!(told["asked"], 4);
    for trial in told["trials"].as_array().expect("trials") {
        assert!(trial["advice"].is_object() && trial["found"].is_f64(), "{trial}");
        assert!(trial["surface"].as_str().is_some_and(|s| s.contains("41")), "{trial}");
    }
}

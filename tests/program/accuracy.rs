//! Scenes with an accuracy target: the chosen setting meets it and is reported; a target out of reach gives a one-line
//! error.

use crate::program::{asperity, json_line, stderr};
use std::path::{Path, PathBuf};
use std::process::Output;

const SURFACE: &str = "name = \"requested\"\n[surface]\ncut_off = \"4.0 um\"\nseed = 3\n";
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
            .arg("--overwrite")
            .args(flags)
            .output()
            .expect("started")
    }
}

/// The mean gap of the chosen setting is within the target, against a grid of eight times the points per side. The
/// choice is in results and manifest, and the stages cost no more than it needs.
#[test]
fn the_chosen_setting_meets_the_requested_error() {
    let folder = Folder::new();
    let reference = folder.file("fine.toml", &format!("{SURFACE}grid = 1024\n{LOADS}"));
    let fine = json_line(&folder.run(&reference, &["--json"]));
    let gap = |answer: &serde_json::Value, i: usize| {
        answer["results"]["continuum"]["states"][i]["mean_gap"].as_f64().expect("a mean gap")
    };
    for share in [0.05, 0.005] {
        let text = format!("{SURFACE}{LOADS}[accuracy]\nquantity = \"mean_gap\"\nerror = {share}\n");
        let output = folder.run(&folder.file("requested.toml", &text), &["--json"]);
        assert!(output.status.success(), "{}", stderr(&output));
        let answer = json_line(&output);
        let chosen = &answer["results"]["accuracy"];
        let expected = chosen["advice"]["expected_error"].as_f64().expect("an error");
        assert!(expected <= share && chosen["error"] == share, "{chosen}");
        assert!(stderr(&output).contains("mean gap within"), "{}", stderr(&output));
        let manifest = std::fs::read_to_string(folder.0.path().join("out/manifest.json")).expect("a manifest");
        let manifest: serde_json::Value = serde_json::from_str(&manifest).expect("JSON");
        assert_eq!(manifest["accuracy"], *chosen);
        if chosen["advice"]["method"] == "fast" {
            for i in 0..2 {
                let error = (gap(&answer, i) / gap(&fine, i) - 1.0).abs();
                // The target applies to the root mean square over two loads: a single error may be √2 times as large.
                assert!(error <= 2f64.sqrt() * share, "{error} of {share}");
            }
            assert_eq!(answer["results"]["continuum"]["nx"], chosen["advice"]["grid"]);
        }
    }
}

/// The shipped scenes get advice from the shipped tables, without extrapolation. A height map has only its own grid, whose
/// errors are larger.
#[test]
fn shipped_scenes_get_advice() {
    let scenes = [
        ("quickstart", "contact_area", 0.25, "persson"),
        ("quickstart", "mean_gap", 0.05, "fast"),
        ("challenge", "mean_gap", 0.2, "fast"),
        ("own-surface", "mean_gap", 0.15, "fast"),
        ("measured-surface", "mean_gap", 0.25, "fast"),
    ];
    for (scene, quantity, share, method) in scenes {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("configs/{scene}.toml"));
        let mut command = asperity();
        command.arg("advise").arg(file).args(["--quantity", quantity, "--json", "--error"]).arg(share.to_string());
        let output = command.output().expect("started");
        assert!(output.status.success(), "{scene}: {}", stderr(&output));
        let advice = json_line(&output);
        assert_eq!(advice["method"], method, "{scene}: {advice}");
        assert_eq!(advice["extrapolated"], serde_json::json!([]), "{scene}");
        assert!(advice["expected_error"].as_f64().is_some_and(|e| e <= share), "{scene}: {advice}");
    }
}

#[test]
fn unsupported_requests_are_refused() {
    let folder = Folder::new();
    let asks = "[accuracy]\nquantity = \"mean_gap\"\n";
    let refused = [
        (format!("{SURFACE}{LOADS}{asks}"), "accuracy", "one of error"),
        (format!("{SURFACE}{LOADS}{asks}error = 0.1\nbudget = \"3.0 s\"\n"), "accuracy", "one of error"),
        (format!("{SURFACE}{LOADS}{asks}error = -0.1\n"), "accuracy.error", "positive"),
        (format!("{SURFACE}{LOADS}{asks}error = 1e-12\n"), "accuracy.error", "at least"),
        (format!("{SURFACE}{LOADS}{asks}budget = \"1e-9 s\"\n"), "accuracy.budget", "at least"),
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
        let answer = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{text}: {answer}");
        assert!(
            answer.contains(key) && answer.contains(accepted) && answer.contains("refused.toml"),
            "{text}: {answer}"
        );
        assert!(!folder.0.path().join("out").exists(), "{text} left a folder");
    }
    let good = folder.file("good.toml", &format!("{SURFACE}{LOADS}{asks}error = 0.1\n"));
    let output = folder.run(&good, &["--grid", "64"]);
    assert!(output.status.code() == Some(2) && stderr(&output).contains("--grid"), "{}", stderr(&output));
}

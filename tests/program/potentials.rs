//! Constants of another potential: measured, kept, and compared with those that a scene gives.

use crate::lammps::lammps;
use crate::program::{asperity, json_line, stderr};
use crate::similar_crystal::{self, ALUMINIUM};
use crate::{pair_crystal, tools};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Output;

/// A folder with a scene, a potential like aluminium and a cache of its own.
struct Bench {
    folder: tempfile::TempDir,
}

impl Bench {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        similar_crystal::keys(&folder.path().join("Al.eam.alloy"));
        Bench { folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// A scene with these keys of `[atoms]`.
    fn scene(&self, keys: &str) -> PathBuf {
        let file = self.path("scene.toml");
        let text = "name = \"al\"\n[surface]\ngrid = 64\ncut_off_mode = 8\n[load]\np_star = [0.01]\n[atoms]\ncells = 10\ndepth_cells = 4\n";
        std::fs::write(&file, format!("{text}{keys}")).expect("written");
        file
    }

    fn ask(&self, args: &[&str]) -> Output {
        let mut command = asperity();
        command.env("XDG_CACHE_HOME", self.path("cache")).args(args).current_dir(self.folder.path());
        command.output().expect("started")
    }

    /// A dry run of a scene of the potential of aluminium with further keys, by the LAMMPS of the search path, or by none.
    fn plan(&self, keys: &str, flags: &[&str]) -> Output {
        let file = self.scene(&format!("potential = \"Al.eam.alloy\"\nelement = \"Al\"\n{keys}"));
        self.ask(&[&["run", file.to_str().expect("UTF-8"), "--dry-run"], flags].concat())
    }

    /// Files of the cache.
    fn kept(&self) -> Vec<PathBuf> {
        let Ok(list) = std::fs::read_dir(self.path("cache/asperity/crystals")) else { return Vec::new() };
        list.map(|entry| entry.expect("an entry").path()).collect()
    }
}

/// Modulus of the potential like aluminium: that of the shipped one is 28.575 GPa, which the scale to aluminium takes as 28.57.
const MODULUS_GPA: f64 = 80.01;

/// No program of the search path has this name.
const WITHOUT: [&str; 2] = ["--lammps", "no-such-lammps"];

fn refusal(output: &Output, code: i32) -> String {
    let said = stderr(output);
    assert_eq!(output.status.code(), Some(code), "{said}");
    said
}

fn success(output: &Output) -> String {
    refusal(output, 0)
}

/// Both constants, one, the other, and none that a scene gives: all are the same scene, and what is measured is said. Wrong ones are refused.
#[test]
fn constants_are_measured_and_compared() {
    let Some(_lammps) = lammps(1) else { return };
    let bench = Bench::new();
    let (lattice, modulus) = ("lattice_constant = \"4.05 Å\"\n", "modulus = \"80.01 GPa\"\n");
    let mut plans = Vec::new();
    for (keys, says) in
        [(String::new(), true), (lattice.into(), true), (modulus.into(), true), (format!("{lattice}{modulus}"), false)]
    {
        let output = bench.plan(&keys, &["--json"]);
        let said = success(&output);
        assert_eq!(
            said.contains("a0 = 4.05 Å, E* = 80.01 GPa (harmonic mean over directions in (001)), measured"),
            says,
            "{said}"
        );
        plans.push(json_line(&output));
    }
    assert_eq!(bench.kept().len(), 1, "measured once");
    let of_atoms = |plan: &Value| (plan["audit"].clone(), plan["atoms"]["deformable"].clone());
    assert!(!plans[0]["audit"].is_null() && plans.iter().all(|p| of_atoms(p) == of_atoms(&plans[0])), "{plans:?}");
    for (keys, parts) in [
        ("modulus = \"70.0 GPa\"\n", ["atoms.modulus = 70 GPa; accepted: 80.01 GPa", "Al of ", "12.5 % apart"]),
        (
            "lattice_constant = \"3.9 Å\"\n",
            ["atoms.lattice_constant = 3.9 Å; accepted: 4.05 Å", "scene.toml", "leave the key out"],
        ),
        ("modulus = \"80000.0 GPa\"\n", ["a factor of 1000 apart", "80.01 GPa", "check the unit"]),
        ("lattice_constant = \"0.405 Å\"\n", ["a factor of 10 apart", "4.05 Å", "check the unit"]),
    ] {
        let said = refusal(&bench.plan(keys, &[]), 2);
        assert!(said.trim_end().lines().count() == 1 && parts.iter().all(|part| said.contains(part)), "{said}");
    }
    let strained = bench.plan("lattice_constant = \"4.03 Å\"\n", &[]);
    success(&strained);
    let printed = String::from_utf8_lossy(&strained.stdout).into_owned();
    assert!(printed.contains("warning: atoms.lattice_constant = 4.03 Å is 0.494 % from the 4.05 Å"), "{printed}");
}

/// What is kept serves where there is no LAMMPS; a damaged file does not, and another potential under the same name is another one.
#[test]
fn what_was_measured_is_kept_by_the_contents_of_the_potential() {
    let Some(_lammps) = lammps(1) else { return };
    let bench = Bench::new();
    assert!(success(&bench.plan("", &[])).contains(", measured with LAMMPS"));
    assert!(success(&bench.plan("", &WITHOUT)).contains(", measured earlier with LAMMPS"));
    assert!(refusal(&bench.plan("modulus = \"70.0 GPa\"\n", &WITHOUT), 2).contains("accepted: 80.01 GPa"));
    let kept = bench.kept();
    assert_eq!(kept.len(), 1);
    let text = std::fs::read_to_string(&kept[0]).expect("readable");
    for damaged in [text.replacen("4.0", "5.0", 1), text[..100].to_string()] {
        assert_ne!(damaged, text);
        std::fs::write(&kept[0], damaged).expect("written");
        refusal(&bench.plan("", &WITHOUT), 5);
        assert!(success(&bench.plan("", &[])).contains(", measured with LAMMPS"));
        assert_eq!(std::fs::read_to_string(&kept[0]).expect("readable"), text);
    }
    // Another potential: distances are shorter by a twentieth.
    let file = bench.path("Al.eam.alloy");
    let table = std::fs::read_to_string(&file).expect("readable");
    let sizes = table.lines().nth(4).expect("sizes").to_string();
    let words: Vec<f64> = sizes.split_whitespace().map(|w| w.parse().expect("a number")).collect();
    let [rows, density, points, step, cutoff] = words[..] else { panic!("{sizes}") };
    let shorter = format!("{rows} {density:e} {points} {:e} {:e}", 0.95 * step, 0.95 * cutoff);
    std::fs::write(&file, table.replace(&sizes, &shorter)).expect("written");
    let said = success(&bench.plan("", &[]));
    assert!(said.contains(", measured with LAMMPS") && !said.contains("a0 = 4.05 Å"), "{said}");
    assert_eq!(bench.kept().len(), 2);
}

/// Without LAMMPS nothing is compared: given constants are taken with a warning, absent ones are missed.
#[test]
fn without_lammps_constants_must_be_given() {
    let bench = Bench::new();
    let given = bench.plan("lattice_constant = \"4.05 Å\"\nmodulus = \"70.0 GPa\"\n", &WITHOUT);
    success(&given);
    let printed = String::from_utf8_lossy(&given.stdout).into_owned();
    assert!(
        printed.contains("atoms.modulus are not checked against") && printed.contains("no-such-lammps"),
        "{printed}"
    );
    let said = refusal(&bench.plan("lattice_constant = \"4.05 Å\"\n", &WITHOUT), 5);
    for part in ["no-such-lammps was not found", "it measures atoms.modulus, which ", "asperity potential --measure"] {
        assert!(said.contains(part) && said.trim_end().lines().count() == 1, "{said}");
    }
    assert!(refusal(&bench.plan("", &WITHOUT), 5).contains("lattice_constant and atoms.modulus"));
    assert!(bench.kept().is_empty());
    // Nothing is measured where no atoms run.
    success(&bench.plan("", &[&WITHOUT[..], &["--no-atoms"]].concat()));
    // An element that the file lacks, and a file that is none, are found without LAMMPS.
    let other = bench.scene("potential = \"Al.eam.alloy\"\nelement = \"Cu\"\n");
    let said = refusal(&bench.ask(&["run", other.to_str().expect("UTF-8"), "--dry-run"]), 2);
    assert!(said.contains("table of Al, without Cu"), "{said}");
}

/// The block is fcc: potentials of other crystals are refused with what was found, and `potential` states it.
#[test]
fn crystals_that_are_not_fcc_are_refused() {
    let Some(_lammps) = lammps(1) else { return };
    let bench = Bench::new();
    for (name, second, properties) in [("bcc", pair_crystal::BCC, true), ("hcp", pair_crystal::HCP, false)] {
        let file = bench.path(&format!("{name}.eam.alloy"));
        pair_crystal::write(&file, "Xx", second);
        let table = file.to_str().expect("UTF-8");
        let measured = bench.ask(&["potential", "--potential", table, "--element", "Xx", "--measure", "--json"]);
        success(&measured);
        let found = json_line(&measured);
        assert_eq!(found["crystal"]["structure"], name, "{found}");
        assert_eq!(found["properties"].is_object(), properties, "{found}");
        // The measurement is kept: the run needs no LAMMPS to refuse.
        for keys in ["", "lattice_constant = \"2.887 Å\"\nmodulus = \"80.0 GPa\"\n"] {
            let scene = bench.scene(&format!("potential = {table:?}\nelement = \"Xx\"\n{keys}"));
            let run = bench.ask(&[&["run", scene.to_str().expect("UTF-8"), "--out", "out"], &WITHOUT[..]].concat());
            let said = refusal(&run, 2);
            assert!(said.contains("atoms.potential = ") && said.contains(&format!("(Xx: {name}, a0 = ")), "{said}");
            assert!(said.contains("a potential whose crystal is fcc") && !bench.path("out").exists(), "{said}");
        }
    }
}

/// Jobs of atoms and points of sweeps contain the constants: they do not depend on a cache.
#[test]
fn jobs_and_points_contain_what_was_measured() {
    let Some(_lammps) = lammps(1) else { return };
    let bench = Bench::new();
    let potential = "potential = \"Al.eam.alloy\"\nelement = \"Al\"\n";
    let text = |path: &Path| std::fs::read_to_string(path).expect("readable");
    let built = |keys: &str, out: &str| {
        let scene = bench.scene(&format!("{potential}start = \"touch\"\n{keys}"));
        let output = bench.ask(&["atoms", "build", scene.to_str().expect("UTF-8"), "--out", out]);
        success(&output);
        [bench.path(out).join("in.vars"), bench.path(out).join("block.data")].map(|file| text(&file))
    };
    let given = format!("lattice_constant = \"{} Å\"\nmodulus = \"{MODULUS_GPA} GPa\"\n", ALUMINIUM.0);
    assert!(built("", "absent") == built(&given, "given"), "jobs differ");
    let scene = bench.scene(&format!("{potential}modulus = \"70.0 GPa\"\n"));
    let said = refusal(&bench.ask(&["atoms", "build", scene.to_str().expect("UTF-8"), "--out", "wrong"]), 2);
    assert!(said.contains("accepted: 80.01 GPa") && !bench.path("wrong").exists(), "{said}");

    bench.scene(potential);
    let sweep = bench.path("sweep.toml");
    std::fs::write(&sweep, "scene = \"scene.toml\"\n[over]\natoms.depth_cells = [4, 5]\n").expect("written");
    let exported = bench.ask(&["sweep", "sweep.toml", "--out", "points", "--export", "snakemake"]);
    let said = success(&exported);
    assert_eq!(said.matches("a0 = 4.05 Å").count(), 1, "said once: {said}");
    for label in ["depth-cells-4", "depth-cells-5"] {
        let text = text(&bench.path(&format!("points/scenes/{label}.toml")));
        let [lattice, modulus] = [ALUMINIUM.0, MODULUS_GPA];
        assert!(text.contains(&format!("lattice_constant = \"{lattice} Å\"\n")), "{text}");
        assert!(text.contains(&format!("modulus = \"{modulus} GPa\"\n")), "{text}");
    }
    std::fs::write(&sweep, "scene = \"scene.toml\"\n[over]\natoms.modulus = [\"80.0 GPa\", \"70.0 GPa\"]\n")
        .expect("written");
    let said = refusal(&bench.ask(&["sweep", "sweep.toml", "--dry-run"]), 2);
    assert!(said.contains("atoms.modulus = 70 GPa") && said.contains("80.01 GPa"), "{said}");
}

/// `E*` says of which directions it is. Of the shipped potential the values of the card are 28.57, 27.05 and 30.53 GPa.
#[test]
fn the_modulus_of_the_face_says_of_which_directions_it_is() {
    if tools::program(&["lmp", "lammps"]).is_none() {
        return tools::skip("lammps", "LAMMPS is not installed");
    }
    let bench = Bench::new();
    let output = bench.ask(&["potential", "--measure"]);
    success(&output);
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    for (key, value, meaning) in [
        ("contact_modulus_gpa", "28.5", "harmonic mean over the directions of waves in it"),
        ("contact_modulus_100_gpa", "27.0", "for waves along [100]"),
        ("contact_modulus_110_gpa", "30.5", "for waves along [110]"),
    ] {
        let row =
            printed.lines().find(|l| l.split_whitespace().any(|w| w == key)).unwrap_or_else(|| panic!("{printed}"));
        assert!(row.contains(value) && row.contains(meaning), "{row}");
    }
    assert!(printed.contains("fcc, a0 = 5.5884"), "{printed}");
    assert!(printed.contains("every property is as potentials/Ca.toml states"), "{printed}");
}

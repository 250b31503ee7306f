//! A run's `results.nc` in h5py, xarray and netCDF4, and its frames in ASE and OVITO: the files open, and their contents agree with
//! the other files of the run.
//!
//! `scripts/setup.sh --tests` creates the environments `target/python` and `target/ovito`. A module that it lacks is a failure.

use crate::lammps::lammps;
use crate::program::{asperity, json_line, stderr};
use crate::tools;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The Python of `target/NAME`, which has these modules.
fn python_of(name: &str, modules: &str) -> Option<PathBuf> {
    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).parent()?;
    let path = target.join(name).join("bin/python");
    if !path.exists() {
        let reason = "does not exist; scripts/setup.sh --tests creates it where PyPI can be reached";
        tools::skip(name, &format!("target/{name} {reason}"));
        return None;
    }
    let imports = Command::new(&path).args(["-c", &format!("import {modules}")]).output().expect("started");
    assert!(imports.status.success(), "run scripts/setup.sh --tests: {}", stderr(&imports));
    Some(path)
}

fn python() -> Option<PathBuf> {
    python_of("python", "ase, h5py, xarray, h5netcdf, netCDF4")
}

fn check(python: &Path, script: &str, run: &Path) -> String {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/readers").join(script);
    let checked = Command::new(python).arg(script).arg(run).output().expect("started");
    assert!(checked.status.success(), "{}", stderr(&checked));
    String::from_utf8_lossy(&checked.stdout).trim().to_string()
}

#[test]
fn a_run_opens_in_h5py_xarray_and_netcdf4() {
    let Some(python) = python() else { return };
    let adhesion = "[adhesion]\nwork_of_adhesion = \"50 mJ/m2\"\nrange = \"900 nm\"\nalso_nonadhesive = true\nother_ranges = [\"1200 nm\"]\n";
    // Maps of all loads, maps of one load, and the additional solutions of a scene with adhesion.
    for maps in ["", "maps_at = [0.05]\n", adhesion] {
        let scratch = tempfile::tempdir().expect("scratch");
        let scene = scratch.path().join("small.toml");
        let text = format!(
            "name = \"small\"\ndescription = \"Ünïcode\"\n[laboratory]\nlength = \"50 um\"\nmodulus = \"10 MPa\"\n\
             [surface]\ngrid = 32\ncut_off_mode = 8\n[load]\np_star = [0.01, 0.05, 0.02]\n{maps}"
        );
        std::fs::write(&scene, text).expect("written");
        let out = scratch.path().join("run");
        let output = asperity().arg("run").arg(&scene).arg("--out").arg(&out).arg("--json").output().expect("started");
        assert!(output.status.success(), "{}", stderr(&output));
        assert_eq!(json_line(&output)["results"]["continuum"]["states"].as_array().expect("states").len(), 3);
        assert_eq!(check(&python, "check_results.py", &out), "checked: h5py, xarray, netCDF4", "{maps}");
    }
}

#[test]
fn frames_open_in_ase_and_ovito() {
    let Some(python) = python() else { return };
    let Some(_lammps) = lammps(1) else { return };
    let scratch = tempfile::tempdir().expect("scratch");
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/tiny.toml");
    let out = scratch.path().join("run");
    let output = asperity().arg("run").arg(scene).arg("--out").arg(&out).output().expect("started");
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(check(&python, "check_frames.py", &out), "checked: ASE");
    let Some(ovito) = python_of("ovito", "ovito.io") else { return };
    assert_eq!(check(&ovito, "check_frames_ovito.py", &out), "checked: OVITO");
}

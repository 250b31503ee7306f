//! A run's `results.nc` in h5py, xarray and netCDF4: the files open, and their contents agree with the other files of
//! the run.
//!
//! `scripts/setup.sh --tests` creates the environment `target/python`. Without it this test prints a warning and
//! passes.

use crate::program::{asperity, json_line, stderr};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

fn python() -> Option<PathBuf> {
    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).parent()?;
    let path = target.join("python/bin/python");
    let ready = path.exists()
        && Command::new(&path)
            .args(["-c", "import h5py, xarray, h5netcdf, netCDF4"])
            .output()
            .is_ok_and(|o| o.status.success());
    if !ready {
        // Direct writes to standard error are not captured by the harness.
        let _ = writeln!(
            std::io::stderr(),
            "\n***** {} lacks h5py, xarray, h5netcdf or netCDF4: results.nc IS NOT CHECKED *****\n***** scripts/setup.sh --tests makes it where PyPI can be reached *****\n",
            path.display()
        );
    }
    ready.then_some(path)
}

#[test]
fn a_run_opens_in_h5py_xarray_and_netcdf4() {
    let Some(python) = python() else { return };
    let adhesion =
        "[adhesion]\nwork_of_adhesion_mj_m2 = 50\nrange_nm = 900\nalso_nonadhesive = true\nother_ranges_nm = [1200]\n";
    // Maps of all loads, maps of one load, and the additional solutions of a scene with adhesion.
    for maps in ["", "maps_at = [0.05]\n", adhesion] {
        let scratch = tempfile::tempdir().expect("scratch");
        let scene = scratch.path().join("small.toml");
        let text = format!(
            "name = \"small\"\ndescription = \"Ünïcode\"\n[laboratory]\nlength_um = 50\ncontact_modulus_mpa = 10\n\
             [surface]\ngrid = 32\ncut_off_mode = 8\n[load]\np_star = [0.01, 0.05, 0.02]\n{maps}"
        );
        std::fs::write(&scene, text).expect("written");
        let out = scratch.path().join("run");
        let output = asperity().arg("run").arg(&scene).arg("--out").arg(&out).arg("--json").output().expect("started");
        assert!(output.status.success(), "{}", stderr(&output));
        assert_eq!(json_line(&output)["results"]["continuum"]["states"].as_array().expect("states").len(), 3);
        let check = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/readers/check_results.py");
        let checked = Command::new(&python).arg(check).arg(&out).output().expect("started");
        assert!(checked.status.success(), "{maps}{}", stderr(&checked));
        assert_eq!(String::from_utf8_lossy(&checked.stdout).trim(), "checked: h5py, xarray, netCDF4");
    }
}

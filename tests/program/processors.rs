//! Results on other processors, whose instructions qemu emulates: which bits agree.
#![cfg(target_arch = "x86_64")]

use crate::program::{asperity, stderr};
use crate::tools::{program, skip};
use asperity::surface::files::npy;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Largest difference of gaps between processors over the largest gap: both are solved to residuals of 1e-8, and differed by 1.4e-11.
const SAME_STATE: f64 = 1e-9;

/// A surface, a solve without and one with adhesion, in a folder; on the processor itself or as qemu emulates one.
fn results(folder: &Path, emulated: Option<(&Path, &str)>) -> Vec<Vec<f64>> {
    let call = |arguments: &[&str], out: PathBuf| {
        let program = asperity();
        let mut command = match emulated {
            Some((qemu, processor)) => {
                let mut command = Command::new(qemu);
                command.args(["-cpu", processor]).arg(program.get_program());
                command
            }
            None => program,
        };
        let output = command.args(arguments).arg("--out").arg(&out).output().expect("started");
        assert!(output.status.success(), "{emulated:?}: {}", stderr(&output));
        out
    };
    let read = |path: PathBuf| npy::read(&path).expect("a field").values;
    let waves = ["--cut-off", "0.0625", "--p-star", "0.02"];
    let solve = ["solve", "--challenge", "64"];
    let adhesion = ["--work-of-adhesion", "1e-4", "--range", "0.01"];
    vec![
        read(call(&["surface", "--grid", "64", "--cut-off", "6um"], folder.join("surface.npy"))),
        read(call(&[&solve[..], &waves].concat(), folder.join("hard")).join("gap.npy")),
        read(call(&[&solve[..], &waves, &adhesion].concat(), folder.join("adhesive")).join("gap.npy")),
    ]
}

/// With AVX2 and FMA (Haswell) the bits are the same, without (Nehalem) states differ by rounding, and contact is at the same nodes.
#[test]
fn processors_with_the_same_instructions_agree_to_the_bit() {
    let Some(qemu) = program(&["qemu-x86_64", "qemu-x86_64-static"]) else {
        return skip("qemu", "qemu-x86_64 is not installed");
    };
    let scratch = tempfile::tempdir().expect("scratch");
    let of = |name: &str, processor: Option<&str>| {
        let folder = scratch.path().join(name);
        std::fs::create_dir(&folder).expect("created");
        results(&folder, processor.map(|p| (qemu.as_path(), p)))
    };
    let [haswell, nehalem] = ["Haswell", "Nehalem"].map(|p| of(p, Some(p)));
    if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
        assert!(of("own", None) == haswell, "a processor with AVX2 and FMA has other bits");
    }
    for (field, (a, b)) in haswell.iter().zip(&nehalem).enumerate() {
        let largest = a.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).abs() <= SAME_STATE * largest, "field {field}: {a} {b}");
            assert!(field == 0 || (*a == 0.0) == (*b == 0.0), "field {field}: a node touches on one processor only");
        }
    }
}

//! Files that SurfaceTopography reads: what the program makes of its converter, here a script in its place. `python/tests/test_convert.py` has the
//! converter itself.

use crate::program::{asperity, json_line, stderr};
use asperity::surface::files::hashed::file_hash;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Output;

/// A map of 6 x 4 points with unit, extents and a sign.
const MAP: &str = "# sign: high points touch first\n# unit: nm\n# length: 6 4 um\n# channel: Height\n# history: read from map.ibw\n\
                   1 2 4 3 2 2\n2 5 3 1 0 1\n3 2 2 4 5 3\n0 1 2 2 3 1\n";

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        let folder = Folder(tempfile::tempdir().expect("scratch"));
        std::fs::write(folder.path("map.ibw"), b"\0\x01\x02").expect("written");
        std::fs::write(folder.path("map.txt"), MAP).expect("written");
        std::fs::create_dir(folder.path("temporary")).expect("made");
        folder
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// A program in place of Python: its arguments are `-m asperity.convert FILE OUT.nc` and options.
    fn python(&self, script: &str) -> PathBuf {
        let path = self.path("python");
        std::fs::write(&path, format!("#!/bin/sh\n{script}\n")).expect("written");
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).expect("set");
        path
    }

    fn call(&self, python: &Path, arguments: &[&str]) -> Output {
        let mut command = asperity();
        command.args(arguments).env("ASPERITY_PYTHON", python).env("TMPDIR", self.path("temporary"));
        command.current_dir(self.0.path()).output().expect("started")
    }
}

#[test]
fn a_converted_map_has_the_name_and_hash_of_its_file() {
    let folder = Folder::new();
    let python = folder.python("cp \"${3%.ibw}.txt\" \"$4\"; echo \"warning: $5 $6\" >&2");
    let answer = json_line(&folder.call(&python, &["surface", "map.ibw", "--via-python", "--dataset=-Z", "--json"]));
    assert_eq!((answer["format"].as_str(), answer["nx"].as_u64()), (Some("through SurfaceTopography"), Some(6)));
    assert_eq!(answer["hash"].as_str(), file_hash(&folder.path("map.ibw")).ok().as_deref());
    assert!(answer["file"].as_str().is_some_and(|file| file.ends_with("map.ibw")), "{answer}");
    assert_eq!((answer["channel"].as_str(), answer["touching"].as_str()), (Some("Height"), Some("high-points")));
    assert_eq!(answer["preparation"][0], "read from map.ibw");
    assert_eq!(answer["warnings"][0], "--dataset=-Z --touching=high-points", "{answer}");
    assert_eq!(std::fs::read_dir(folder.path("temporary")).expect("listed").count(), 0, "temporary files remain");
    // The same in a scene, in flags of `solve`, and in a scene that `init` writes.
    let scene = "name = \"a\"\nsurface = { heights = \"map.ibw\", via_python = true }\n\
                 laboratory.modulus = \"1 GPa\"\nload.p_star = [0.1]\n";
    std::fs::write(folder.path("scene.toml"), scene).expect("written");
    for arguments in [
        &["run", "scene.toml", "--dry-run"][..],
        &["solve", "map.ibw", "--via-python", "--modulus", "1GPa", "--p-star", "0.1"],
        &["init", "map.ibw", "--via-python", "--modulus", "1GPa", "--out", "made.toml"],
        &["run", "made.toml", "--dry-run"],
    ] {
        let output = folder.call(&python, arguments);
        assert!(output.status.success(), "{arguments:?}: {}", stderr(&output));
    }
    // The converter gets the sign, and its file declares it.
    let python = folder
        .python("sed 's/high points/low points/' \"${3%.ibw}.txt\" > \"$4\"; test \"$5\" = --touching=low-points");
    let low = ["surface", "map.ibw", "--via-python", "--touching", "low-points", "--json"];
    assert_eq!(json_line(&folder.call(&python, &low))["touching"].as_str(), Some("low-points"));
}

#[test]
fn failures_of_the_converter_are_one_line() {
    let folder = Folder::new();
    let refused = |script: &str, code: i32, said: &str| {
        let output = folder.call(&folder.python(script), &["surface", "map.ibw", "--via-python"]);
        let line = stderr(&output);
        assert!(output.status.code() == Some(code) && line.trim_end().lines().count() == 1, "{line}");
        assert!(line.contains(said), "{line}");
        assert_eq!(std::fs::read_dir(folder.path("temporary")).expect("listed").count(), 0, "temporary files remain");
    };
    refused("echo \"error: $3: no reader; accepted: another\" >&2; exit 2", 2, "map.ibw: no reader; accepted: another");
    for said in ["No module named asperity.convert", "Error while finding it (No module named 'asperity')"] {
        refused(&format!("echo \"python: {said}\" >&2; exit 1"), 5, "python was not found; pip install");
    }
    refused(
        "echo \"error: SurfaceTopography in $0 was not found; x\" >&2; exit 5",
        5,
        "python was not found; pip install \"asperity[files]\"",
    );
    refused(
        "echo Traceback >&2; echo 'KeyError: 3' >&2; exit 1",
        2,
        "ended with exit status: 1: KeyError: 3; accepted: ",
    );
    refused("exit 0", 2, "map.ibw: ");
    let missing = folder.call(Path::new("/nowhere/python"), &["surface", "map.ibw", "--via-python"]);
    assert_eq!(missing.status.code(), Some(5));
    assert!(stderr(&missing).contains("/nowhere/python was not found; "), "{}", stderr(&missing));
    let none = folder.call(Path::new("python3"), &["surface", "--via-python"]);
    assert!(stderr(&none).contains("only together with a file"), "{}", stderr(&none));
}

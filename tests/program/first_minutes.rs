//! What a new user does first: a scene by `init`, completions and manual pages by `make install`, keys in the documents.

use crate::program::{asperity, json_line, stderr};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn repository() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn init(folder: &Path, args: &[&str]) -> Output {
    asperity().current_dir(folder).arg("init").args(args).arg("--json").output().expect("started")
}

fn dry_run(folder: &Path, scene: &str) -> Output {
    asperity().current_dir(folder).args(["run", scene, "--dry-run"]).output().expect("started")
}

fn fill_in(output: &Output) -> Vec<String> {
    serde_json::from_value(json_line(output)["fill_in"].clone()).expect("keys")
}

/// A matrix of 8 × 8 heights after the lines of `head`.
fn write_map(file: &Path, head: &str) {
    let height = |x: usize, y: usize| ((3 * x + 5 * y) % 7) as f64 * 0.01;
    let row = |y: usize| (0..8).map(|x| format!("{} ", height(x, y))).collect::<String>() + "\n";
    std::fs::write(file, head.to_string() + &(0..8).map(row).collect::<String>()).expect("written");
}

/// A file of an instrument declares unit and extents; which points touch and the modulus are never in one.
#[test]
fn a_file_that_declares_unit_and_extents_gives_a_scene_that_runs() {
    let scratch = tempfile::tempdir().expect("scratch");
    let folder = scratch.path();
    let file = repository().join("tests/fixtures/surfaces/float32.x3p");
    std::fs::copy(file, folder.join("measured map.x3p")).expect("copied");
    let output = init(folder, &["measured map.x3p", "--touching", "high-points", "--modulus", "25MPa"]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(fill_in(&output), Vec::<String>::new());
    let text = std::fs::read_to_string(folder.join("scene.toml")).expect("a scene");
    for line in [
        "heights = \"measured map.x3p\"",
        "length = \"36 um\"",
        "length_y = \"20.4 um\"",
        "unit = \"m\"",
        "touching = \"high-points\"",
        "modulus = \"25 MPa\"",
    ] {
        assert!(text.lines().any(|l| l == line), "{line} is missing:\n{text}");
    }
    let plan = dry_run(folder, "scene.toml");
    assert!(plan.status.success(), "{}", stderr(&plan));

    let again = init(folder, &["measured map.x3p"]);
    assert_eq!(again.status.code(), Some(2));
    assert!(stderr(&again).contains("--out = scene.toml (exists)") && stderr(&again).contains("--overwrite"));
    assert_eq!(std::fs::read_to_string(folder.join("scene.toml")).expect("a scene"), text);
    let open = fill_in(&init(folder, &["measured map.x3p", "--overwrite"]));
    assert_eq!(open, ["laboratory.modulus", "surface.touching"]);
}

/// The sign that a file declares is filled in.
#[test]
fn a_declared_sign_and_unit_are_filled_in() {
    let scratch = tempfile::tempdir().expect("scratch");
    write_map(&scratch.path().join("map.txt"), "# sign: low points touch first\n# unit: um\n");
    let open = fill_in(&init(scratch.path(), &["map.txt", "--modulus", "2MPa"]));
    assert_eq!(open, ["laboratory.length"]);
    let text = std::fs::read_to_string(scratch.path().join("scene.toml")).expect("a scene");
    assert!(text.contains("\ntouching = \"low-points\"\n") && text.contains("\nunit = \"um\"\n"), "{text}");
}

/// What the file does not declare comes from flags, and these do not contradict it.
#[test]
fn flags_complete_what_a_file_declares() {
    let scratch = tempfile::tempdir().expect("scratch");
    write_map(&scratch.path().join("map.txt"), "# sign: low points touch first\n");
    let given = ["map.txt", "--modulus", "2MPa", "--unit", "nm", "--length", "20um"];
    assert!(fill_in(&init(scratch.path(), &given)).is_empty());
    let text = std::fs::read_to_string(scratch.path().join("scene.toml")).expect("a scene");
    assert!(text.contains("\nunit = \"nm\"\n") && text.contains("\nlength = \"20 um\"\n"), "{text}");
    let all = "# sign: low points touch first\n# unit: um\n# width: 20 um\n# height: 5 um\n";
    write_map(&scratch.path().join("all.txt"), all);
    // The extent along y stays that of the file.
    assert!(
        fill_in(&init(scratch.path(), &["all.txt", "--modulus", "2MPa", "--length", "20um", "--out", "all.toml"]))
            .is_empty()
    );
    let own = std::fs::read_to_string(scratch.path().join("all.toml")).expect("a scene");
    assert!(own.contains("length_y = \"5 um\""), "{own}");
    let contradictions =
        [("--touching", "high-points", "low-points"), ("--unit", "nm", "um"), ("--length", "30 um", "20 um")];
    for (flag, value, declared) in contradictions {
        let refused = init(scratch.path(), &["all.txt", flag, value, "--overwrite"]);
        let said = String::from_utf8_lossy(&refused.stderr);
        let expected = format!("{flag} = {value}; accepted: {declared}, as all.txt declares");
        assert!(refused.status.code() == Some(2) && said.contains(&expected), "{said}");
    }
    let kept = std::fs::read_to_string(scratch.path().join("scene.toml")).expect("a scene");
    assert_eq!(kept, text, "a refused scene replaces none");
}

/// A tilted map is levelled and mirrored, in lines that can be changed; it has no seam any more.
#[test]
fn a_map_that_does_not_repeat_is_prepared() {
    let scratch = tempfile::tempdir().expect("scratch");
    let folder = scratch.path();
    let row =
        |y: usize| (0..40).map(|x| format!("{} ", 0.1 * x as f64 + ((3 * x + 5 * y) % 7) as f64 * 0.01)).collect();
    let rows: Vec<String> = (0..40).map(row).collect();
    let scene_of = |head: &str| {
        std::fs::write(folder.join("map.txt"), format!("# unit: um\n{head}{}\n", rows.join("\n"))).expect("written");
        let output = init(folder, &["map.txt", "--modulus", "2MPa", "--touching", "high-points", "--overwrite"]);
        assert_eq!(fill_in(&output), ["laboratory.length"]);
        std::fs::read_to_string(folder.join("scene.toml")).expect("a scene")
    };
    // The periodicity that a file declares needs no edges.
    for declared in ["# periodic: 0\n", "# periodic: 1\n"] {
        assert!(scene_of(declared).contains("\n# edges = \"mirror\"\n"), "{declared}");
    }
    let text = scene_of("").replace("# length = \"20 um\"", "length = \"20 um\"");
    assert!(text.contains("\ndetrend = \"plane\"\n") && text.contains("\nedges = \"mirror\"\n"), "{text}");
    for (seam, text) in
        [(false, text.clone()), (true, text.replace("\nedges", "\n# edges").replace("\ndetrend", "\n# detrend"))]
    {
        std::fs::write(folder.join("scene.toml"), text).expect("written");
        let plan = dry_run(folder, "scene.toml");
        assert!(plan.status.success(), "{}", stderr(&plan));
        let said = String::from_utf8_lossy(&plan.stdout).into_owned() + &stderr(&plan);
        assert_eq!(said.contains("does not repeat"), seam, "{said}");
    }
}

/// The keys that a message complains about.
fn complaints(output: &Output) -> Vec<String> {
    let said = stderr(output);
    let keys = said.lines().filter_map(|l| Some(l.split_once("scene.toml: ")?.1.split(' ').next()?.to_string()));
    keys.collect()
}

/// The optional lines of the scene are keys of their tables, too.
#[test]
fn a_plain_matrix_gives_a_scene_that_asks_for_exactly_what_is_missing() {
    let scratch = tempfile::tempdir().expect("scratch");
    let folder = scratch.path();
    write_map(&folder.join("plain.txt"), "");
    let output = init(folder, &["plain.txt"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let mut keys = fill_in(&output);
    let refused = dry_run(folder, "scene.toml");
    assert_eq!(refused.status.code(), Some(2), "{}", stderr(&refused));
    let mut named = complaints(&refused);
    keys.sort();
    named.sort();
    assert_eq!(named, keys, "{}", stderr(&refused));
    assert_eq!(keys.len(), 4);

    // With the examples of these lines the scene runs.
    let text = std::fs::read_to_string(folder.join("scene.toml")).expect("a scene");
    let lines: Vec<&str> = text.lines().collect();
    let required = |i: usize| i > 0 && lines[i - 1].starts_with("# FILL IN");
    let filled: Vec<&str> =
        lines.iter().enumerate().map(|(i, l)| if required(i) { l.trim_start_matches("# ") } else { l }).collect();
    std::fs::write(folder.join("filled.toml"), filled.join("\n")).expect("written");
    let plan = dry_run(folder, "filled.toml");
    assert!(plan.status.success(), "{}", stderr(&plan));

    // Each optional key alone, in the table that is above it.
    let key = |l: &str| Some(l.strip_prefix("# ")?.split_once(" = ")?.0.to_string()).filter(|k| !k.contains(' '));
    let mut tried = 0;
    for (i, line) in filled.iter().enumerate().take_while(|(_, l)| **l != "# [adhesion]") {
        if key(line).is_some() {
            let mut one: Vec<&str> = filled.clone();
            one[i] = line.trim_start_matches("# ");
            std::fs::write(folder.join("one.toml"), one.join("\n")).expect("written");
            let said = stderr(&dry_run(folder, "one.toml"));
            assert!(!said.contains("no key of a scene") && !said.contains("one.toml, line"), "{line}: {said}");
            tried += 1;
        }
    }
    assert!(tried >= 10, "{tried} keys");
}

/// Values that are negative, incomplete or of another kind are refused by their flag, in one line that names it and what is accepted.
#[test]
fn wrong_values_are_named_by_their_flag() {
    let scratch = tempfile::tempdir().expect("scratch");
    write_map(&scratch.path().join("map.txt"), "");
    let surface = ["--touching", "high-points", "--length", "1um", "--unit", "um"];
    let solve = |flags: &[&'static str]| [&["solve", "map.txt"][..], flags, &surface].concat();
    let of_bodies = |body: &'static str| solve(&["--pressure", "1MPa", "--body", body]);
    for (arguments, complaint) in [
        (solve(&["--modulus", "2GPa", "--pressure", "1MPa,,2MPa"]), "a value before and after every comma"),
        (
            solve(&["--modulus", "2GPa", "--pressure", "1MPa", "--crop", "0,0,-5,5"]),
            "--crop = \"-5\"; accepted: a whole number, zero or above, for each of X,Y,NX,NY",
        ),
        (
            solve(&["--modulus", "2GPa", "--contact", "5"]),
            "--contact = 5; accepted: a fraction of the cell between 0 and 1: 5 means 500 %; did you mean 5%?",
        ),
        (of_bodies("-2MPa,0.3"), "--body = -2MPa,0.3; accepted: a positive number"),
        (of_bodies("2MPa,0.9"), "--body = 2MPa,0.9; accepted: a Poisson's ratio from 0 to 0.5"),
        (
            vec!["init", "map.txt", "--touching", "high-points", "--modulus", "-5MPa"],
            "--modulus = -5MPa; accepted: a positive stress",
        ),
    ] {
        let refused = asperity().current_dir(scratch.path()).args(&arguments).output().expect("started");
        let said = stderr(&refused);
        assert!(refused.status.code() == Some(2) && said.lines().count() == 1, "{arguments:?}: {said}");
        assert!(said.contains(complaint), "{said}");
    }
}

#[test]
fn points_that_were_not_measured_and_other_folders() {
    let scratch = tempfile::tempdir().expect("scratch");
    let folder = scratch.path();
    let file = repository().join("tests/fixtures/surfaces/text.sdf");
    let output = init(folder, &[file.to_str().expect("UTF-8"), "--modulus", "25MPa"]);
    assert_eq!(fill_in(&output), ["surface.touching", "surface.fill"], "{}", stderr(&output));
    let text = std::fs::read_to_string(folder.join("scene.toml")).expect("a scene");
    assert!(
        text.contains(&format!("heights = \"{}\"", file.display())) && text.contains("length_y = \"20.4 um\"\n"),
        "{text}"
    );
}

#[test]
fn scenes_without_a_file_run_as_they_are() {
    let scratch = tempfile::tempdir().expect("scratch");
    for (name, args) in [("made.toml", &[][..]), ("challenge.toml", &["--challenge"])] {
        let output = init(scratch.path(), &[args, &["--out", name]].concat());
        assert!(output.status.success(), "{}", stderr(&output));
        let text = std::fs::read_to_string(scratch.path().join(name)).expect("a scene");
        assert!(text.starts_with("#:schema scene.schema.json\n") && text.matches("#:schema").count() == 1, "{text}");
        let plan = dry_run(scratch.path(), name);
        assert!(plan.status.success(), "{}", stderr(&plan));
    }
}

/// Every file under a folder, relative to it.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut open = vec![folder.to_path_buf()];
    let mut found = Vec::new();
    while let Some(at) = open.pop() {
        for entry in std::fs::read_dir(at).expect("a folder") {
            let path = entry.expect("readable").path();
            if path.is_dir() { open.push(path) } else { found.push(path.strip_prefix(folder).expect("inside").into()) }
        }
    }
    found.sort();
    found
}

#[test]
fn an_installation_has_program_pages_and_completions() {
    let scratch = tempfile::tempdir().expect("scratch");
    let prefix = scratch.path().join("with a blank");
    let script = repository().join("scripts/install.sh");
    let output = Command::new(script).arg(env!("CARGO_BIN_EXE_asperity")).arg(&prefix).output().expect("started");
    assert!(output.status.success(), "{}", stderr(&output));
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    let found = files(&prefix);
    for file in ["bin/asperity", "share/bash-completion/completions/asperity", "share/zsh/site-functions/_asperity"] {
        assert!(found.contains(&file.into()), "{found:?}");
        assert!(said.contains(&prefix.join(file).display().to_string()), "{said}");
    }
    let page = std::fs::read_to_string(prefix.join("share/man/man1/asperity-run.1")).expect("a page");
    assert!(page.contains(".TH") && page.contains("dry\\-run"), "{page}");
    for page in ["asperity.1", "asperity-solve.1", "asperity-init.1", "asperity-atoms-build.1"] {
        assert!(found.contains(&Path::new("share/man/man1").join(page)), "{found:?}");
    }
    let bash = std::fs::read_to_string(prefix.join("share/bash-completion/completions/asperity")).expect("completions");
    assert!(bash.contains("--dry-run") && bash.contains("complete -F"));
    let file = prefix.join("share/bash-completion/completions/asperity");
    assert!(Command::new("bash").arg("-n").arg(file).status().expect("bash starts").success());
}

/// What a document in docs/ must contain: the output of a command. `make docs` writes them.
#[test]
fn schema_and_table_of_keys_in_the_documents_are_current() {
    for (file, args) in [("scene.schema.json", &["schema"][..]), ("keys.md", &["schema", "--keys"])] {
        let output = asperity().args(args).output().expect("started");
        let document = std::fs::read_to_string(repository().join("docs").join(file)).expect("a document");
        assert!(document.as_bytes() == output.stdout, "docs/{file} is not current: run `make docs`");
    }
}

#[test]
fn the_table_of_keys_is_complete() {
    let document = std::fs::read_to_string(repository().join("docs/keys.md")).expect("keys");
    let rows: Vec<Vec<&str>> =
        document.lines().filter(|l| l.starts_with("| `")).map(|l| l.trim_matches('|').split(" | ").collect()).collect();
    assert!(rows.len() > 100, "{} keys", rows.len());
    for row in &rows {
        let [key, kind, default, description] = row[..] else { panic!("not four columns: {row:?}") };
        for cell in [key, kind, default, description] {
            assert!(!cell.trim().is_empty(), "{row:?}");
        }
    }
    for line in [
        "## [methods.fft-ia]",
        "## [continuum.layer]",
        "| `length` | length, as `\"100 um\"` | – | ",
        "| `grid` | whole number | `512` | ",
        "| `work_of_adhesion` | work, as `\"50 mJ/m2\"` | required | ",
        "| `mean_gap` | list of lengths or range, as `\"log:1um:10um:5\"` | – | ",
    ] {
        assert!(document.contains(line), "{line}");
    }
}

/// Scenes of the repository name the schema relative to themselves.
#[test]
fn shipped_scenes_name_the_schema() {
    let configs = repository().join("configs");
    let is_sweep = |p: &Path| p.components().any(|c| c.as_os_str() == "sweeps");
    let scenes: Vec<PathBuf> =
        files(&configs).into_iter().filter(|p| p.extension().is_some_and(|e| e == "toml") && !is_sweep(p)).collect();
    assert!(scenes.len() > 10);
    for scene in scenes {
        let path = configs.join(scene);
        let text = std::fs::read_to_string(&path).expect("a scene");
        let schema = text.lines().next().and_then(|l| l.strip_prefix("#:schema ")).expect("a schema");
        let named = path.parent().expect("a folder").join(schema).canonicalize().expect("a file");
        assert_eq!(named, repository().join("docs/scene.schema.json").canonicalize().expect("the schema"));
    }
}

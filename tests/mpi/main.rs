//! The program on several ranks, started by mpirun as a user starts it. Needs the feature `mpi`: `scripts/test-mpi.sh`.
//!
//! What ranks compute is tested without MPI, on threads in their place (`--lib slab`, `--lib fast::shared`); here the exchange itself, files,
//! messages and exit codes.

#[path = "../common/folder.rs"]
mod folder;
#[path = "../common/program.rs"]
mod program;

use program::{asperity, json_line, stderr};
use serde_json::Value;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// `asperity` with these arguments on some ranks; without a launcher for none.
fn on(ranks: usize, arguments: &[&str]) -> Command {
    let program = asperity();
    let mut command = match ranks {
        0 => program,
        n => {
            let mut launcher = Command::new("mpirun");
            launcher.args(["--oversubscribe", "--bind-to", "none", "-np"]);
            launcher.arg(n.to_string()).arg(program.get_program());
            launcher.env("OMPI_ALLOW_RUN_AS_ROOT", "1").env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1");
            launcher
        }
    };
    command.args(["--threads", "1"]).args(arguments);
    command
}

fn solved(ranks: usize, arguments: &[&str], out: &Path) -> Output {
    let out = out.to_str().expect("UTF-8");
    let mut command = on(ranks, &["solve", "--json", "--out", out]);
    command.args(arguments).output().expect("started")
}

/// Lines of results without what differs between two runs, and the bytes of all fields.
fn results(output: &Output, out: &Path) -> (Vec<Value>, Vec<(std::path::PathBuf, Vec<u8>)>) {
    assert!(output.status.success(), "{}", stderr(output));
    let text = String::from_utf8_lossy(&output.stdout);
    let line = |line: &str| {
        let mut value = folder::of_the_scene(&serde_json::from_str(line).expect("a line of JSON"));
        value.as_object_mut().expect("an object").remove("ranks");
        value
    };
    (text.lines().map(line).collect(), folder::fields(out))
}

/// The same bytes of results and fields as without a launcher: f32 and f64, with and without adhesion, and with a load that continues on the
/// branch of another, and quantities that need whole fields. On 1024² points the two finest grids are shared, on 512² one.
#[test]
fn results_have_the_same_bytes_on_any_number_of_ranks() {
    let adhesion = ["--work-of-adhesion", "2e-5", "--range", "2e-3"];
    let whole = ["--leakage", "--elastic-stress", "--subsurface", "0.001", "--poisson", "0.3"];
    let cases: [([&str; 3], &[&str], &[usize]); 6] = [
        (["512", "f32", "0.05"], &whole, &[3]),
        (["1024", "f32", "0.05"], &[], &[1, 2, 4]),
        (["1024", "f64", "0.05"], &[], &[2]),
        // Held whole by each rank.
        (["256", "f64", "0.05"], &[], &[2]),
        (["1024", "f32", "0.02,0.05"], &adhesion, &[3]),
        (["1024", "f64", "0.05"], &adhesion, &[2]),
    ];
    let scratch = tempfile::tempdir().expect("scratch");
    for (case, ([points, precision, loads], more, counts)) in cases.into_iter().enumerate() {
        let mut arguments = vec!["--challenge", points, "--precision", precision, "--p-star", loads, "--tol", "1e-2"];
        arguments.extend(more);
        let run = |ranks: usize| {
            let out = scratch.path().join(format!("{case}-{ranks}"));
            results(&solved(ranks, &arguments, &out), &out)
        };
        let (lines, fields) = run(0);
        assert!(!fields.is_empty());
        for &ranks in counts {
            let found = run(ranks);
            assert_eq!(found.0, lines, "{arguments:?} on {ranks} ranks");
            assert!(found.1 == fields, "{arguments:?} on {ranks} ranks: fields");
        }
    }
}

/// The process of the first rank that writes into this folder; none after its end. To the launcher's own signals processes have a second to
/// react, which does not depend on the load of the machine.
fn first_rank(out: &Path) -> Option<u32> {
    let has = |pid: u32, file: &str, text: &str| {
        let bytes = std::fs::read(format!("/proc/{pid}/{file}")).unwrap_or_default();
        bytes.split(|b| *b == 0).any(|entry| entry == text.as_bytes())
    };
    let pids =
        std::fs::read_dir("/proc").expect("processes").flatten().filter_map(|e| e.file_name().to_str()?.parse().ok());
    pids.into_iter()
        .find(|&pid| has(pid, "cmdline", out.to_str().expect("UTF-8")) && has(pid, "environ", "OMPI_COMM_WORLD_RANK=0"))
}

/// Interrupted on two ranks, resumed on three: as an uninterrupted solve on one.
#[test]
fn an_interrupted_solve_resumes_on_another_number_of_ranks() {
    let arguments = ["--challenge", "512", "--precision", "f64", "--p-star", "0.05", "--tol", "1e-4"];
    let scratch = tempfile::tempdir().expect("scratch");
    let [whole, out] = ["whole", "parts"].map(|name| scratch.path().join(name));
    let expected = results(&solved(0, &arguments, &whole), &whole);
    let mut command = on(2, &["solve", "--json", "--out", out.to_str().expect("UTF-8")]);
    let mut running = command.args(arguments).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("started");
    let mut lines = BufReader::new(running.stderr.take().expect("a pipe")).lines().map_while(Result::ok);
    assert!(lines.any(|line| line.contains("fast on 512 x 512 points")), "the solve has not begun");
    first_rank(&out).into_iter().for_each(asperity::grid::sys::group::terminate);
    lines.for_each(drop);
    running.wait().expect("ended");
    // One that had finished before the signal is read again, with the same results.
    assert!(out.join("checkpoint.json").exists() || out.join("gap.npy").exists(), "neither a checkpoint nor results");
    let mut found = results(&solved(3, &arguments, &out), &out);
    let mut expected = expected;
    for line in found.0.iter_mut().chain(&mut expected.0) {
        // A resumed solve counts the step that was interrupted.
        line.as_object_mut().expect("an object").remove("fft_pairs");
    }
    assert_eq!(found.0, expected.0);
    assert!(found.1 == expected.1, "fields");
}

/// Exit code and message, once and not once for each rank.
#[test]
fn errors_end_all_ranks_with_one_message() {
    let scratch = tempfile::tempdir().expect("scratch");
    let absent = scratch.path().join("absent.npy");
    let solve = ["solve", "--challenge", "64", "--p-star", "0.05"];
    let adhesion = ["--work-of-adhesion", "2e-5", "--range", "2e-3"];
    for (arguments, code, part) in [
        ([&solve[..], &adhesion, &["--pull-off"]].concat(), 2, "--pull-off = given on 2 ranks; accepted: "),
        ([&solve[..], &["--method", "bvm"]].concat(), 2, "--method = given on 2 ranks; accepted: fast"),
        ([&solve[..], &["--hardness", "0.1"]].concat(), 2, "--hardness"),
        ([&solve[..], &["--max-iterations", "1"]].concat(), 3, "without converging"),
        (vec!["solve", absent.to_str().expect("UTF-8"), "--modulus", "1", "--pressure", "1"], 2, "absent.npy"),
        (vec!["run", "scene.toml"], 2, "accepted: `solve` with the method `fast`, or one rank"),
    ] {
        let output = on(2, &arguments).output().expect("started");
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {text}");
        assert_eq!(text.matches("asperity: error").count(), 1, "{arguments:?}: {text}");
        assert!(text.contains(part), "{arguments:?}: {text}");
        assert!(output.stdout.is_empty() || code == 3, "{arguments:?}");
    }
}

#[test]
fn only_the_first_rank_prints() {
    let arguments = ["solve", "--challenge", "128", "--p-star", "0.05", "--json"];
    let alone = json_line(&on(0, &arguments).output().expect("started"));
    let shared = json_line(&on(2, &arguments).output().expect("started"));
    assert_eq!(alone["mean_gap"], shared["mean_gap"]);
    assert!(shared["ranks"] == 2 && alone.get("ranks").is_none());
}

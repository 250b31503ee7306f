//! A job folder by hand: `run.sh` gives the engine's numbers.

use crate::jobs::{built, case, on};
use crate::lammps::lammps;
use asperity::atoms::job::Job;
use asperity::atoms::progress::Progress;
use std::ops::ControlFlow;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Output};

fn run_by_hand(job: &Job, program: &Path) -> Output {
    Command::new("bash").arg(job.folder.join("run.sh")).env("LMP", program).output().expect("bash starts")
}

/// Energies that LAMMPS prints at the end of each minimisation.
fn energies(job: &Job) -> Vec<String> {
    let log = std::fs::read_to_string(job.folder.join("log.0")).expect("a log");
    let lines: Vec<&str> = log.lines().collect();
    let heads = lines.windows(2).filter(|l| l[0].contains("Energy initial, next-to-last, final"));
    heads.map(|l| l[1].trim().to_string()).collect()
}

/// A LAMMPS by hand that runs when the engine begins, and the other way round.
#[test]
fn a_run_by_hand_and_one_of_the_engine_do_not_mix() {
    let Some(lammps) = lammps(1) else { return };
    let scratch = tempfile::tempdir().expect("scratch");
    let job = built(&case("p_star = [0.01]", "", "minimizer = \"fire\""), &scratch.path().join("job"));
    let waiting = scratch.path().join("lmp");
    std::fs::write(&waiting, "#!/bin/sh\n[ \"$1\" = -h ] || exec sleep 60\n").expect("written");
    std::fs::set_permissions(&waiting, std::fs::Permissions::from_mode(0o755)).expect("executable");
    let mut hand = Command::new("bash");
    let mut hand = hand.arg(job.folder.join("run.sh")).env("LMP", &waiting).spawn().expect("bash starts");
    let name = format!("/proc/{}/comm", hand.id());
    while std::fs::read_to_string(&name).expect("it runs") != "sleep\n" {
        assert!(hand.try_wait().expect("waited").is_none(), "run.sh has ended");
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    let message = lammps.run(&job, &mut on).expect_err("in use").to_string();
    assert!(message.contains(&format!("process {} (sleep) is writing or running this job", hand.id())), "{message}");
    hand.kill().and_then(|()| hand.wait()).expect("killed");
    let mut again = None;
    let mut watch = |_: Progress| {
        again.get_or_insert_with(|| run_by_hand(&job, lammps.program()));
        ControlFlow::Continue(())
    };
    lammps.run(&job, &mut watch).expect("runs");
    let again = again.expect("watched");
    let message = String::from_utf8_lossy(&again.stderr);
    assert!(again.status.code() == Some(2) && message.contains("another program"), "{message}");
}

/// Prescribed loads, and a ramp that unloads. One rank and the same variables: every digit is the same.
#[test]
fn run_sh_gives_the_numbers_of_the_engine() {
    let Some(lammps) = lammps(1) else { return };
    for (load, atoms) in [("p_star = [0.01, 0.03]", ""), ("p_star = [0.01]\nunload = true", "start = \"touch\"")] {
        let scratch = tempfile::tempdir().expect("scratch");
        let case = case(load, "", &format!("minimizer = \"fire\"\n{atoms}"));
        let [engine, hand] = ["engine", "hand"].map(|name| built(&case, &scratch.path().join(name)));
        lammps.run(&engine, &mut on).expect("runs");
        let output = run_by_hand(&hand, lammps.program());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let steps = |job: &Job| std::fs::read_to_string(job.folder.join("load_steps.csv")).expect("load steps");
        assert!(steps(&hand).lines().count() > 2);
        assert_eq!(steps(&hand), steps(&engine), "{load}");
        assert!(!energies(&hand).is_empty());
        assert_eq!(energies(&hand), energies(&engine), "{load}");
        // The engine finds the finished job.
        let found = lammps.run(&hand, &mut on).expect("finished");
        assert_eq!(found.resumed_from, Some(steps(&hand).lines().count() - 2));
        // A second run would overwrite it.
        let again = run_by_hand(&hand, lammps.program());
        assert_eq!(again.status.code(), Some(2), "{}", String::from_utf8_lossy(&again.stderr));
    }
}

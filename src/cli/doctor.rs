use super::machine::{LammpsFlags, MachineFlags, submits};
use super::output;
use super::point::PointCommand;
use crate::cluster::{Machine, shell_quoted};
use crate::report::number::memory;
use crate::{Error, Result};
use asperity_atoms::engine::LammpsEngine;
use asperity_atoms::lammps_host::find_library;
use serde::Serialize;
use std::process::{Command, ExitCode};

#[derive(Debug, clap::Args)]
pub(super) struct DoctorArgs {
    #[command(flatten)]
    machine: MachineFlags,
    #[command(flatten)]
    lammps: LammpsFlags,
    /// Ranks run on other nodes than this one.
    #[arg(long, hide = true)]
    elsewhere: bool,
    /// One line of JSON on stdout.
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Finding {
    what: &'static str,
    good: bool,
    found: String,
    /// What it is for, and how to get it where it is missing.
    advice: &'static str,
}

impl DoctorArgs {
    /// Exit code 5 when something that scenes with atoms need is missing.
    pub(super) fn execute(self) -> Result<ExitCode> {
        let (_, machine) = self.machine.find(&self.lammps)?;
        if submits(&machine) && !machine.setup.is_empty() {
            return self.after_setup(&machine);
        }
        let findings = findings(&machine, self.elsewhere || submits(&machine));
        let good = findings.iter().all(|f| f.good);
        if self.json {
            output::json_line(&serde_json::json!({ "good": good, "findings": findings }))?;
        } else {
            let word = |good: bool| if good { "ok" } else { "MISSING" };
            let row = |f: &Finding| vec![word(f.good).into(), f.what.into(), f.found.clone(), f.advice.into()];
            output::print(&output::table(&["", "what", "found", "advice"], findings.iter().map(row)));
        }
        Ok(ExitCode::from(if good { 0 } else { 5 }))
    }

    /// Runs this command in a login shell after the set-up lines of the machine, as its jobs do.
    fn after_setup(&self, machine: &Machine) -> Result<ExitCode> {
        let program = std::env::current_exe().map_err(Error::io("find", "this program"))?;
        let mut arguments = vec![program.display().to_string(), "doctor".into(), "--elsewhere".into()];
        arguments.extend(PointCommand::of_lammps(&machine.lammps));
        arguments.extend(self.json.then(|| "--json".into()));
        let arguments: Vec<String> = arguments.iter().map(|word| shell_quoted(word)).collect();
        // What the lines print is none of the findings.
        let script = format!("set -e\n{{\n{}\n}} >&2\nexec {}", machine.setup.join("\n"), arguments.join(" "));
        let status = Command::new("bash").args(["-l", "-c", &script]).status().map_err(Error::io("start", "bash"))?;
        Ok(ExitCode::from(status.code().and_then(|c| u8::try_from(c).ok()).unwrap_or(1)))
    }
}

fn finding(what: &'static str, good: bool, found: impl Into<String>, advice: &'static str) -> Finding {
    Finding { what, good, found: found.into(), advice }
}

/// What this machine has, with LAMMPS as a machine of machines.toml starts it.
fn findings(machine: &Machine, elsewhere: bool) -> Vec<Finding> {
    let engine = LammpsEngine::find(machine.lammps.program.as_deref());
    let (lammps, styles) = match &engine {
        Ok(e) => (e.describe().to_string(), e.missing_styles()),
        Err(e) => (e.to_string(), Vec::new()),
    };
    let mpirun =
        std::env::var_os("PATH").is_some_and(|p| std::env::split_paths(&p).any(|d| d.join("mpirun").is_file()));
    let start = match &engine {
        // The cores of this node do not count.
        Ok(e) if elsewhere => e.check_accelerator(&machine.lammps).map(|()| machine.lammps.line(e.program())),
        Ok(e) => e.clone().with_command(machine.lammps.clone()).map(|_| machine.lammps.line(e.program())),
        Err(_) => Ok("not found".into()),
    };
    let has_styles = engine.is_ok() && styles.is_empty();
    let styles =
        if styles.is_empty() { "all that scenes use".into() } else { format!("missing: {}", styles.join(", ")) };
    let library = match engine.as_ref().map(|e| find_library(e.program())) {
        Ok(Ok(library)) => library.display().to_string(),
        Ok(Err(why)) => format!("not usable: {why}"),
        Err(_) => "not found".into(),
    };
    let accelerators = engine.as_ref().map_or("not found".into(), LammpsEngine::accelerators);
    let cores = std::thread::available_parallelism().map_or("unknown".into(), |n| n.to_string());
    let memory = format!("{} available", memory(asperity_grid::sys::available_memory_bytes()));
    vec![
        finding("LAMMPS", engine.is_ok(), lammps, "for scenes with [atoms]; on Debian: apt-get install lammps"),
        finding(
            "LAMMPS styles",
            has_styles,
            styles,
            "eam/alloy needs the MANYBODY package, yukawa EXTRA-PAIR; Debian's build has both",
        ),
        finding(
            "LAMMPS packages",
            true,
            accelerators,
            "OPT is used by itself, others by --lammps-args, as \"-sf omp -pk omp 4\"",
        ),
        finding(
            "LAMMPS command",
            start.is_ok(),
            start.unwrap_or_else(|e| e.to_string()),
            "--ranks, --launcher and --lammps-args, or a machine of machines.toml",
        ),
        finding(
            "LAMMPS library",
            true,
            library,
            "for the harmonic relaxation, without which LAMMPS relaxes by FIRE, and for atoms.base = \"elastic\"; on Debian it comes with lammps",
        ),
        finding(
            "mpirun",
            true,
            if mpirun { "found" } else { "not found" },
            "only for atoms.ranks above 1; on Debian it comes with lammps",
        ),
        finding("cores", true, cores, "--threads limits what is used"),
        finding(
            "GPU",
            true,
            asperity_contact::method::gpu(),
            "only for --device cuda, which solves large grids with `fast`",
        ),
        finding("memory", true, memory, "--dry-run prints what a scene needs"),
    ]
}

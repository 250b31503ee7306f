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
            output::print(&output::table(
                &["", "what", "found", "advice"],
                findings.iter().map(|f| {
                    vec![if f.good { "ok" } else { "MISSING" }.into(), f.what.into(), f.found.clone(), f.advice.into()]
                }),
            ));
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
    vec![
        Finding {
            what: "LAMMPS",
            good: engine.is_ok(),
            found: lammps,
            advice: "for scenes with [atoms]; on Debian: apt-get install lammps",
        },
        Finding {
            what: "LAMMPS styles",
            good: engine.is_ok() && styles.is_empty(),
            found: if styles.is_empty() {
                "all that scenes use".into()
            } else {
                format!("missing: {}", styles.join(", "))
            },
            advice: "eam/alloy needs the MANYBODY package, yukawa EXTRA-PAIR; Debian's build has both",
        },
        Finding {
            what: "LAMMPS packages",
            good: true,
            found: engine.as_ref().map_or("not found".into(), LammpsEngine::accelerators),
            advice: "OPT is used by itself, others by --lammps-args, as \"-sf omp -pk omp 4\"",
        },
        Finding {
            what: "LAMMPS command",
            good: start.is_ok(),
            found: start.unwrap_or_else(|e| e.to_string()),
            advice: "--ranks, --launcher and --lammps-args, or a machine of machines.toml",
        },
        Finding {
            what: "LAMMPS library",
            good: true,
            found: match engine.as_ref().map(|e| find_library(e.program())) {
                Ok(Ok(library)) => library.display().to_string(),
                Ok(Err(why)) => format!("not usable: {why}"),
                Err(_) => "not found".into(),
            },
            advice: "only for atoms.base = \"elastic\"; on Debian it comes with lammps",
        },
        Finding {
            what: "mpirun",
            good: true,
            found: if mpirun { "found" } else { "not found" }.into(),
            advice: "only for atoms.ranks above 1; on Debian it comes with lammps",
        },
        Finding {
            what: "cores",
            good: true,
            found: std::thread::available_parallelism().map_or("unknown".into(), |n| n.to_string()),
            advice: "--threads limits what is used",
        },
        Finding {
            what: "GPU",
            good: true,
            found: asperity_contact::method::gpu(),
            advice: "only for --device cuda, which solves large grids with `fast`",
        },
        Finding {
            what: "memory",
            good: true,
            found: format!("{} available", memory(asperity_grid::sys::available_memory_bytes())),
            advice: "--dry-run prints what a scene needs",
        },
    ]
}

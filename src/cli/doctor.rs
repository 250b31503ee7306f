use super::output;
use crate::Result;
use crate::atoms::engine::LammpsEngine;
use crate::atoms::lammps_host::find_library;
use crate::report::number::memory;
use serde::Serialize;
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
pub(super) struct Doctor {
    /// LAMMPS program to check. Default: lmp in the search path.
    #[arg(long, value_name = "FILE")]
    lammps: Option<PathBuf>,
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

impl Doctor {
    /// Exit code 5 when something that scenes with atoms need is missing.
    pub(super) fn execute(self) -> Result<ExitCode> {
        let engine = LammpsEngine::find(self.lammps.as_deref());
        let (lammps, styles) = match &engine {
            Ok(e) => (e.describe().to_string(), e.missing_styles()),
            Err(e) => (e.to_string(), Vec::new()),
        };
        let mpirun =
            std::env::var_os("PATH").is_some_and(|p| std::env::split_paths(&p).any(|d| d.join("mpirun").is_file()));
        let findings = [
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
                found: crate::method::gpu(),
                advice: "only for --device cuda, which solves large grids with `fast`",
            },
            Finding {
                what: "memory",
                good: true,
                found: format!("{} available", memory(crate::sys::available_memory_bytes())),
                advice: "--dry-run prints what a scene needs",
            },
        ];
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
}

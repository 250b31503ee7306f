//! Commands: plain arguments, resolved once; results on stdout, everything else on stderr.

mod advise;
mod atoms;
mod bench;
mod challenge;
mod doctor;
mod file;
mod merge_tables;
mod methods;
mod output;
mod potential;
mod progress;
mod run;
mod solve;
mod surface;
mod tradeoff;

use crate::{Error, Result};
use clap::error::{ContextKind, ContextValue};
use clap::{Parser, Subcommand};
use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;

/// Rough-surface contact from a profile to atoms and back.
///
/// Exit codes: 0 ok, 1 a statement of the challenge failed or an advice did not hold, 2 bad input, 3 not converged, 4 LAMMPS failed, 5 not possible on this machine, 130 interrupted.
#[derive(Debug, Parser)]
#[command(name = "asperity", version, max_term_width = 110)]
struct Arguments {
    /// Threads for solvers and surfaces; 0 is all cores. Results do not depend on it.
    #[arg(long, global = true, default_value_t = 0, value_name = "N")]
    threads: usize,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run a scene: surface, continuum, atoms, comparison, report. The same command goes on where a killed one stopped.
    Run(run::Run),
    /// Make or read a surface; statistics, expected against realised.
    Surface(surface::Surface),
    /// Solve the contact of one height map under one load.
    Solve(Box<solve::Solve>),
    /// Solve the contact-mechanics challenge's problem and hold its paper's statements against what is found.
    Challenge(challenge::Challenge),
    /// Measure what accuracy costs: methods, grids, precisions and tolerances against one reference, on a scene.
    Tradeoff(tradeoff::Tradeoff),
    /// Say which setting is the cheapest that is accurate enough, or the most accurate within a time, from measured tables.
    Advise(advise::Advise),
    MergeTables(merge_tables::MergeTables),
    /// Write, measure or check an EAM potential.
    Potential(potential::Potential),
    /// Build, run or read the block of atoms of a scene.
    #[command(subcommand)]
    Atoms(atoms::Atoms),
    /// Compare atoms and continuum of a run folder again, and draw its report.
    Compare(RunFolder),
    /// Draw the report of a run folder from its results.json.
    Report(RunFolder),
    /// List the methods and what each delivers.
    Methods(methods::Methods),
    /// Print the JSON Schema of scene files.
    Schema,
    /// Say what is installed, what is missing and how to get it.
    Doctor(doctor::Doctor),
    /// Time transforms and solves of the challenge's surface on this machine.
    Bench(bench::Bench),
}

#[derive(Debug, clap::Args)]
struct RunFolder {
    /// Folder of a finished run.
    folder: PathBuf,
    /// One line of JSON on stdout.
    #[arg(long)]
    json: bool,
}

/// Runs the command line `arguments` (the program's name first).
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> Result<ExitCode> {
    let arguments = match Arguments::try_parse_from(arguments) {
        Ok(a) => a,
        Err(e) => {
            if let Some(complaint) = no_number(&e) {
                return Err(complaint);
            }
            // Help and version are answers; everything else is bad input, told in clap's words.
            let _ = e.print();
            return Ok(ExitCode::from(if e.use_stderr() { 2 } else { 0 }));
        }
    };
    rayon::ThreadPoolBuilder::new().num_threads(arguments.threads).build_global().map_err(|e| {
        Error::input("command line", "--threads", arguments.threads, format!("a number of threads ({e})"))
    })?;
    match arguments.command {
        Command::Run(c) => return c.execute(),
        Command::Surface(c) => c.execute()?,
        Command::Solve(c) => c.execute()?,
        Command::Challenge(c) => return c.execute(),
        Command::Tradeoff(c) => return c.execute(),
        Command::Advise(c) => return c.execute(),
        Command::MergeTables(c) => c.execute()?,
        Command::Potential(c) => c.execute()?,
        Command::Atoms(c) => c.execute()?,
        Command::Compare(c) => {
            let (results, page) = crate::pipeline::rebuild_comparison(&c.folder)?;
            if c.json {
                output::json_line(&serde_json::json!({ "report": page, "comparison": results.comparison }))?;
            } else {
                output::comparison(&results);
                output::print(&format!("report: {}", page.display()));
            }
        }
        Command::Report(c) => {
            let page = crate::report::write(&c.folder)?;
            if c.json {
                output::json_line(&serde_json::json!({ "report": page }))?;
            } else {
                output::print(&page.display().to_string());
            }
        }
        Command::Methods(c) => c.execute()?,
        Command::Schema => output::print(&format!("{:#}", crate::scene::Scene::schema())),
        Command::Doctor(c) => return c.execute(),
        Command::Bench(c) => return c.execute(),
    }
    Ok(ExitCode::SUCCESS)
}

/// What is said of an argument that is to be a number and is none: clap tells what it stumbled over, not what it accepts.
fn no_number(e: &clap::Error) -> Option<Error> {
    use std::error::Error as _;
    use std::num::{IntErrorKind, ParseFloatError, ParseIntError};
    let why = e.source()?;
    let accepted = match why.downcast_ref::<ParseIntError>().map(ParseIntError::kind) {
        Some(IntErrorKind::PosOverflow | IntErrorKind::NegOverflow) => "a whole number that is not so large",
        Some(_) => "a whole number, zero or above",
        None => why.downcast_ref::<ParseFloatError>().map(|_| "a number, as 0.01 or 1e-8")?,
    };
    let told = |kind| match e.get(kind)? {
        ContextValue::String(text) => Some(text.as_str()),
        _ => None,
    };
    let (argument, value) = (told(ContextKind::InvalidArg)?, told(ContextKind::InvalidValue)?);
    let key = argument.split(' ').next().unwrap_or(argument);
    Some(Error::input("command line", key, format!("{value:?}"), accepted))
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn what_is_no_number_is_told_what_is_one() {
        for (given, accepted) in [
            (["--pressure", "0,o1", "--grid", "8"], "a number"),
            (["--pressure", "0.01", "--grid", "8.5"], "a whole number"),
            (["--pressure", "0.01", "--grid", "99999999999999999999999"], "not so large"),
        ] {
            let line = ["asperity", "solve", "map.txt"].into_iter().chain(given);
            let complaint = Arguments::try_parse_from(line).err().and_then(|e| no_number(&e)).expect("no number");
            let text = complaint.to_string();
            assert!(text.contains("--") && text.contains(accepted), "{text}");
            assert_eq!(complaint.exit_code(), 2);
        }
        let unknown = Arguments::try_parse_from(["asperity", "solve", "--never"]).expect_err("refused");
        assert!(no_number(&unknown).is_none());
    }

    /// Arguments without help, as `command argument`, of a command and all below it.
    fn mute(command: &clap::Command, path: &str) -> Vec<String> {
        let path = format!("{path} {}", command.get_name());
        let own = command.get_arguments().filter(|a| a.get_help().is_none_or(|h| h.to_string().trim().is_empty()));
        let mut list: Vec<String> = own.map(|a| format!("{path} {}", a.get_id())).collect();
        list.extend(command.get_about().is_none().then(|| path.clone()));
        list.extend(command.get_subcommands().flat_map(|c| mute(c, &path)));
        list
    }

    #[test]
    fn every_argument_has_help() {
        let mut all = Arguments::command();
        all.build();
        assert_eq!(mute(&all, ""), Vec::<String>::new());
        assert!(all.find_subcommand("atoms").is_some_and(|c| c.find_subcommand("run").is_some()), "nothing was walked");
    }
}

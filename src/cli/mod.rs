//! Commands: arguments become a scene once; results go to stdout, everything else to stderr.

mod advise;
mod atoms;
mod bench;
mod challenge;
mod doctor;
mod file;
mod flag_names;
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

/// Contact of rough surfaces: continuum methods, atoms, and their comparison.
///
/// Exit codes: 0 ok, 1 an acceptance check or an advice failed, 2 bad input, 3 not converged, 4 LAMMPS failed, 5 not possible on this machine, 130 interrupted.
#[derive(Debug, Parser)]
#[command(name = "asperity", version, max_term_width = 110)]
struct Arguments {
    /// Threads; 0 for all cores. Results do not depend on it.
    #[arg(long, global = true, default_value_t = 0, value_name = "N")]
    threads: usize,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run a scene: surface, continuum, atoms, comparison, report. The same command resumes an interrupted run.
    Run(run::Run),
    /// Synthesise or read a surface; print its statistics.
    Surface(surface::Surface),
    /// Solve one surface under one load path, without a scene file.
    Solve(Box<solve::Solve>),
    /// Solve the contact-mechanics challenge's problem and check the statements of its paper.
    Challenge(challenge::Challenge),
    /// Measure cost and error of methods, grids, precisions and tolerances against one reference.
    Tradeoff(tradeoff::Tradeoff),
    /// Predict the cheapest setting for an error, or the most accurate for a time, from measured tables.
    Advise(advise::Advise),
    MergeTables(merge_tables::MergeTables),
    /// Write, measure or check an EAM potential.
    Potential(potential::Potential),
    /// Build, run or analyse the atoms of a scene.
    #[command(subcommand)]
    Atoms(atoms::Atoms),
    /// Repeat the comparison of atoms and continuum in a run folder, and its report.
    Compare(RunFolder),
    /// Write the report of a run folder from its results.json.
    Report(RunFolder),
    /// List the methods and their outputs.
    Methods(methods::Methods),
    /// Print the JSON Schema of scene files.
    Schema,
    /// Check the installation: what is missing, and how to install it.
    Doctor(doctor::Doctor),
    /// Time transforms and solves on this machine.
    Bench(bench::Bench),
}

#[derive(Debug, clap::Args)]
struct RunFolder {
    /// Run folder.
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
            // Help and version are answers; everything else is bad input, with clap's message.
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

/// The complaint about an argument that should be a number: clap's own does not say what is accepted.
fn no_number(e: &clap::Error) -> Option<Error> {
    use std::error::Error as _;
    use std::num::{IntErrorKind, ParseFloatError, ParseIntError};
    let why = e.source()?;
    let accepted = match why.downcast_ref::<ParseIntError>().map(ParseIntError::kind) {
        Some(IntErrorKind::PosOverflow | IntErrorKind::NegOverflow) => "a whole number that is not so large",
        Some(_) => "a whole number, zero or above",
        None => why.downcast_ref::<ParseFloatError>().map(|_| "a number, as 0.01 or 1e-8")?,
    };
    let context = |kind| match e.get(kind)? {
        ContextValue::String(text) => Some(text.as_str()),
        _ => None,
    };
    let (argument, value) = (context(ContextKind::InvalidArg)?, context(ContextKind::InvalidValue)?);
    let key = argument.split(' ').next().unwrap_or(argument);
    Some(Error::input("command line", key, format!("{value:?}"), accepted))
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn arguments_that_are_no_numbers_are_refused_with_what_is_accepted() {
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

    /// Arguments without help, as `command argument`, of a command and its subcommands.
    fn without_help(command: &clap::Command, path: &str) -> Vec<String> {
        let path = format!("{path} {}", command.get_name());
        let own = command.get_arguments().filter(|a| a.get_help().is_none_or(|h| h.to_string().trim().is_empty()));
        let mut list: Vec<String> = own.map(|a| format!("{path} {}", a.get_id())).collect();
        list.extend(command.get_about().is_none().then(|| path.clone()));
        list.extend(command.get_subcommands().flat_map(|c| without_help(c, &path)));
        list
    }

    #[test]
    fn every_argument_has_help() {
        let mut all = Arguments::command();
        all.build();
        assert_eq!(without_help(&all, ""), Vec::<String>::new());
        assert!(all.find_subcommand("atoms").is_some_and(|c| c.find_subcommand("run").is_some()), "nothing was walked");
    }
}

//! Commands: arguments become a scene once; results go to stdout, everything else to stderr.

mod atoms;
mod body;
pub mod bug;
mod cancel;
mod challenge;
mod cite;
mod cluster;
mod completions;
mod crystals;
mod doctor;
mod file;
mod init;
mod keys;
mod lammps_host;
mod machine;
mod methods;
pub mod output;
mod own_run;
mod point;
mod potential;
mod programs;
pub mod progress;
mod ranks;
mod report;
mod run;
mod solve;
mod surface;
mod surface_functions;
mod surface_instrument;
mod surface_survey;
mod sweep;
mod sweep_table;
mod tradeoff;
mod verify;

use crate::{Error, Result};
use asperity_contact::method::Device;
use asperity_contact::problem::ErrorTargets;
use asperity_grid::sys::threads;
use asperity_grid::units::{Measure, Measures};
use body::BodyFlag;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{ArgMatches, CommandFactory, FromArgMatches, Parser, Subcommand};
use std::any::TypeId;
use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;

/// Contact of rough surfaces: continuum methods, atoms, and their comparison.
///
/// Exit codes: 0 ok, 1 an acceptance check failed, 2 bad input, 3 not converged, 4 LAMMPS failed, 5 not possible on this machine, 70 a bug, 130 interrupted.
#[derive(Debug, Parser)]
#[command(name = "asperity", version, max_term_width = 110)]
struct Cli {
    /// Threads (of each rank); 0 for all cores. Results do not depend on it.
    #[arg(long, global = true, default_value_t = 0, value_name = "N")]
    threads: usize,
    /// Processor that the method `fast` solves on. Results agree within the tolerance of the solve.
    #[arg(long, global = true, value_enum, default_value = "cpu", env = "ASPERITY_DEVICE")]
    device: Device,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Write a commented scene: of a surface file, of the challenge, or of a synthesised surface.
    Init(init::InitArgs),
    /// Run a scene: surface, continuum, atoms, comparison, report. The same command resumes an interrupted run.
    Run(run::RunArgs),
    /// Run a scene for many values of its keys: seeds, loads, sizes, methods. Statistics, tables and one report.
    Sweep(sweep::SweepArgs),
    /// Run a scene for many seeds of its surface: means with standard errors.
    Ensemble(sweep::EnsembleArguments),
    /// Show the state of a sweep or command on a cluster: done, running, waiting, failed with the reason; core hours.
    Status(cluster::StatusArgs),
    /// Write tables and report of a sweep that a cluster runs, of the points that are done.
    Collect(cluster::CollectArgs),
    /// Cancel the tasks of a sweep or command that wait or run. What is finished is kept.
    Cancel(cancel::CancelArgs),
    /// One turn of a task. Batch scripts call it.
    #[command(hide = true)]
    SlurmTask(cluster::SlurmTaskArgs),
    /// LAMMPS as a library, for a job on an elastic base.
    #[command(hide = true)]
    LammpsHost(lammps_host::LammpsHostArgs),
    /// Synthesise or read a surface; print its statistics.
    Surface(Box<surface::SurfaceArgs>),
    /// Solve one surface under one load path, without a scene file.
    Solve(Box<solve::SolveArgs>),
    /// Solve the contact-mechanics challenge's problem and check the statements of its paper.
    Challenge(challenge::ChallengeArgs),
    /// Measure cost and error of methods, grids, precisions and tolerances against one reference.
    Tradeoff(tradeoff::TradeoffArgs),
    /// Write, measure or check an EAM potential.
    Potential(potential::PotentialArgs),
    /// Build, run or analyse the atoms of a scene.
    #[command(subcommand)]
    Atoms(atoms::AtomsArgs),
    /// Repeat the comparison of atoms and continuum in a run folder, and its report.
    Compare(RunFolderArgs),
    /// Repeat a finished run in a scratch folder, and compare its numbers and fields.
    Verify(verify::VerifyArgs),
    /// Make a run folder an RO-Crate: copies of its inputs, and ro-crate-metadata.json with the hashes of its files.
    Crate(verify::CrateArgs),
    /// Print what to cite for a run, as BibTeX.
    Cite(cite::CiteArgs),
    /// Write the report of a folder of results again: a run, a challenge, a trade-off or a sweep.
    Report(report::ReportArgs),
    /// List the methods and their outputs.
    Methods(methods::MethodsArgs),
    /// Print the JSON Schema of scene files or of results.json, or tables of their keys.
    Schema {
        /// Markdown tables of the keys.
        #[arg(long)]
        keys: bool,
        /// Of results.json instead of scenes.
        #[arg(long)]
        results: bool,
    },
    /// Check the installation: what is missing, and how to install it.
    Doctor(doctor::DoctorArgs),
    /// Print the completions of a shell.
    Completions(completions::CompletionsArgs),
    /// Write manual pages.
    Man(completions::ManArgs),
}

#[derive(Debug, clap::Args)]
struct RunFolderArgs {
    /// Run folder.
    folder: PathBuf,
    /// One line of JSON on stdout.
    #[arg(long)]
    json: bool,
}

/// The command line, on which a negative value is refused by the check of its flag, not taken for a flag.
fn command_line() -> clap::Command {
    takes_negative_values(Cli::command())
}

fn takes_negative_values(command: clap::Command) -> clap::Command {
    let is_number = |argument: &clap::Arg| {
        let kind = argument.get_value_parser().type_id();
        let numbers = [
            TypeId::of::<f64>(),
            TypeId::of::<usize>(),
            TypeId::of::<u64>(),
            TypeId::of::<Measure>(),
            TypeId::of::<Measures>(),
            TypeId::of::<BodyFlag>(),
            TypeId::of::<ErrorTargets>(),
        ];
        numbers.iter().any(|number| kind == *number)
    };
    let command = command.mut_args(|argument| match is_number(&argument) {
        true => argument.allow_hyphen_values(true),
        false => argument,
    });
    command.mut_subcommands(takes_negative_values)
}

/// Runs the command line `arguments` (the program's name first).
///
/// # Errors
/// Those of the command; `Output` if it succeeded, but stdout could not be written.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> Result<ExitCode> {
    let ended = execute(arguments)?;
    output::written().map(|()| ended)
}

/// With refused values of flags as they were given: `-5kPa`, where they were refused as the number that it is in another unit.
fn as_given(mut error: Error, given: &ArgMatches) -> Error {
    let (mut matches, mut command) = (given, &command_line());
    while let Some((name, inner)) = matches.subcommand() {
        (matches, command) = (inner, command.find_subcommand(name).expect("a command that was read"));
    }
    let text_of = |flag: &str| -> Option<String> {
        let argument =
            command.get_arguments().find(|a| a.get_long().is_some_and(|long| flag.strip_prefix("--") == Some(long)))?;
        let values = matches.get_raw(argument.get_id().as_str())?.map(|value| value.to_string_lossy());
        Some(values.collect::<Vec<_>>().join(","))
    };
    // Lists of numbers without a unit are refused by their entry.
    let has_units = |text: &String| text.split(',').any(|part| part.parse::<f64>().is_err());
    let is_number = |text: &str| text.split(' ').next().is_some_and(|number| number.parse::<f64>().is_ok());
    if let Error::Input { list, .. } = &mut error {
        for complaint in list.iter_mut().filter(|c| is_number(&c.found)) {
            if let Some(text) = text_of(&complaint.key).filter(has_units) {
                complaint.found = text;
            }
        }
    }
    error
}

/// Stack of the threads, bytes: that of the first thread of a process, since commands run on one of the pool.
const STACK: usize = 8 << 20;

fn execute(arguments: impl IntoIterator<Item = OsString>) -> Result<ExitCode> {
    let read = command_line().try_get_matches_from(arguments);
    let (arguments, given) = match read.and_then(|given| Cli::from_arg_matches(&given).map(|read| (read, given))) {
        Ok(both) => both,
        Err(e) => {
            if let Some(complaint) = no_number(&e) {
                return Err(complaint);
            }
            // Help and version are answers; everything else is bad input.
            if !e.use_stderr() {
                output::note_failure(e.print());
                return Ok(ExitCode::SUCCESS);
            }
            let text = e.render().to_string();
            let help_only = e.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand;
            output::eprint(&if help_only { text } else { format!("asperity: error: {}", one_line(&text)) });
            return Ok(ExitCode::from(2));
        }
    };
    let pool = threads::pool("command line", "--threads", arguments.threads)?.stack_size(STACK);
    pool.build_global().map_err(|error| threads::not_started(&error))?;
    arguments.device.choose();
    if !matches!(arguments.command, Command::Solve(_) | Command::SlurmTask(_) | Command::LammpsHost(_)) {
        ranks::expect_one()?;
    }
    let command = arguments.command;
    // On a thread of the pool: on another one each parallel loop wakes the pool and waits for it, half of the time of a solve of 64²
    // points (evidence/performance.md). Sweeps wait for threads of their own, which might need that thread.
    let waits = matches!(command, Command::Sweep(_) | Command::Ensemble(_) | Command::SlurmTask(_));
    let done = if waits { run_command(command) } else { rayon::scope(|_| run_command(command)) };
    done.map_err(|error| as_given(error, &given))
}

fn run_command(command: Command) -> Result<ExitCode> {
    match command {
        Command::Init(c) => c.execute()?,
        Command::Run(c) => return c.execute(),
        Command::Sweep(c) => return c.execute(),
        Command::Ensemble(c) => return c.execute(),
        Command::Status(c) => c.execute()?,
        Command::Collect(c) => return c.execute(),
        Command::Cancel(c) => c.execute()?,
        Command::SlurmTask(c) => return c.execute(),
        Command::LammpsHost(c) => return c.execute(),
        Command::Surface(c) => c.execute()?,
        Command::Solve(c) => ranks::share(|ranks| c.execute(ranks))?,
        Command::Challenge(c) => return c.execute(),
        Command::Tradeoff(c) => return c.execute(),
        Command::Potential(c) => c.execute()?,
        Command::Atoms(c) => c.execute()?,
        Command::Compare(c) => {
            let (results, page) = crate::pipeline::rebuild_comparison(&c.folder)?;
            if c.json {
                output::json_line(
                    &serde_json::json!({ "report": output::path(&page), "comparison": results.comparison }),
                )?;
            } else {
                output::comparison(&results);
                output::print(&format!("report: {}", page.display()));
            }
        }
        Command::Verify(c) => return c.execute(),
        Command::Crate(c) => c.execute()?,
        Command::Cite(c) => c.execute()?,
        Command::Report(c) => c.execute()?,
        Command::Methods(c) => c.execute()?,
        Command::Schema { keys, results } => {
            let schema =
                if results { crate::record::results::Results::schema() } else { crate::scene::Scene::schema() };
            output::print(&match (keys, results) {
                (false, _) => format!("{schema:#}"),
                (true, false) => keys::markdown(&schema),
                (true, true) => keys::markdown_of_results(&schema),
            });
        }
        Command::Doctor(c) => return c.execute(),
        Command::Completions(c) => c.execute(command_line()),
        Command::Man(c) => c.execute(command_line())?,
    }
    Ok(ExitCode::SUCCESS)
}

/// The message of clap without its usage, in one line.
fn one_line(text: &str) -> String {
    let said =
        text.lines().map(str::trim).take_while(|line| !line.starts_with("Usage:") && !line.starts_with("For more"));
    let said: Vec<&str> = said.filter(|line| !line.is_empty()).collect();
    format!("command line: {}; see --help", said.join("; ").trim_start_matches("error: ").replace(":; ", ": "))
}

/// The complaint about an argument that should be a number: clap's own does not say what is accepted.
fn no_number(e: &clap::Error) -> Option<Error> {
    use std::error::Error as _;
    use std::num::{IntErrorKind, ParseFloatError, ParseIntError};
    let reason = e.source()?;
    let accepted = match reason.downcast_ref::<ParseIntError>().map(ParseIntError::kind) {
        Some(IntErrorKind::PosOverflow | IntErrorKind::NegOverflow) => "a whole number that is not so large",
        Some(_) => "a whole number, zero or above",
        None => reason.downcast_ref::<ParseFloatError>().map(|_| "a number, as 0.01 or 1e-8")?,
    };
    let context = |kind| match e.get(kind)? {
        ContextValue::String(text) => Some(text.as_str()),
        _ => None,
    };
    let (argument, value) = (context(ContextKind::InvalidArg)?, context(ContextKind::InvalidValue)?);
    let (key, names) = argument.split_once(' ').unwrap_or((argument, ""));
    let accepted = match names.contains(',') {
        true => format!("{accepted}, for each of {}", names.trim_matches(['<', '>'])),
        false => accepted.into(),
    };
    Some(Error::input("command line", key, format!("{value:?}"), accepted))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arguments_that_are_no_numbers_are_refused_with_what_is_accepted() {
        for (given, accepted) in [
            (["--pressure", "0.01", "--tol", "o1"], "a number"),
            (["--pressure", "0.01", "--grid", "8.5"], "a whole number"),
            (["--pressure", "0.01", "--grid", "99999999999999999999999"], "not so large"),
        ] {
            let line = ["asperity", "solve", "map.txt"].into_iter().chain(given);
            let complaint = Cli::try_parse_from(line).err().and_then(|e| no_number(&e)).expect("no number");
            let text = complaint.to_string();
            assert!(text.contains("--") && text.contains(accepted), "{text}");
            assert_eq!(complaint.exit_code(), 2);
        }
        let said = |arguments: &[&str]| {
            let e = Cli::try_parse_from(arguments).expect_err("refused");
            assert!(no_number(&e).is_none());
            one_line(&e.render().to_string())
        };
        let unknown = said(&["asperity", "solve", "map.npy", "--pressre", "1"]);
        assert!(unknown.starts_with("command line: unexpected argument '--pressre' found; tip: "), "{unknown}");
        let missing = said(&["asperity", "solve"]);
        assert!(missing.contains("not provided: <") && missing.contains("--p-star"), "{missing}");
        assert!(!(missing + &unknown).contains('\n'));
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
        let mut all = Cli::command();
        all.build();
        assert_eq!(without_help(&all, ""), Vec::<String>::new());
        assert!(all.find_subcommand("atoms").is_some_and(|c| c.find_subcommand("run").is_some()), "nothing was walked");
    }
}

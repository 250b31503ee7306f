use super::own_run::{self, OwnRunArgs};
use super::{crystals, output, progress::TerminalProgress};
use crate::pipeline::{self, Listener, OwnRun};
use crate::report::number::{count, percent, significant, trimmed};
use crate::scene::{AtomsCase, Case, Scene};
use crate::{Error, Result};
use asperity_atoms::engine::{LammpsEngine, ranks_warning};
use asperity_atoms::job::Job;
use asperity_atoms::lammps_command::LammpsCommand;
use asperity_grid::units::MAX_SECONDS;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::Duration;

#[derive(Debug, clap::Subcommand)]
pub(super) enum AtomsArgs {
    /// Write a LAMMPS job folder: data file, script, potential, variables (lammps-inputs/README.md).
    Build {
        /// Scene with [atoms].
        scene: PathBuf,
        /// The job folder to write.
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
        /// One line of JSON on stdout.
        #[arg(long)]
        json: bool,
    },
    /// Run or resume a job folder with LAMMPS.
    Run {
        /// Folder that `atoms build` wrote.
        job: PathBuf,
        /// The LAMMPS program.
        #[arg(long, value_name = "FILE")]
        lammps: Option<PathBuf>,
        /// MPI processes, at most one per core.
        #[arg(long, default_value_t = 1, value_name = "N")]
        ranks: usize,
        /// Time limit in seconds; the same command resumes the run.
        #[arg(long, value_name = "S")]
        time_limit: Option<f64>,
        /// One line of JSON on stdout.
        #[arg(long)]
        json: bool,
    },
    /// Analyse a finished job folder, or dumps of a LAMMPS run of your own, of the block of this scene or of any substrate under its
    /// surface: contact, gap, stress and maps.
    Read {
        /// The scene that the job was built from, or whose surface the indenter has; with [atoms] theirs, low-passed, on their elastic layer.
        scene: PathBuf,
        /// Finished job folder.
        #[arg(long, value_name = "DIR", conflicts_with = "frames", required_unless_present = "frames")]
        job: Option<PathBuf>,
        /// LAMMPS text dumps (plain, gzip, zstd) in the order of the run, with the block's surface layer and one indenter atom. Another
        /// substrate needs --indenter-z or --indenter-types.
        #[arg(long, value_name = "FILE", num_args = 1..)]
        frames: Vec<PathBuf>,
        #[command(flatten)]
        own: OwnRunArgs,
        /// Folder for maps and frames. Default: JOB/read, or read in the first dump's folder.
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
        /// One line of JSON on stdout.
        #[arg(long)]
        json: bool,
    },
}

fn resolved(scene: &Path) -> Result<Case> {
    let mut read = Scene::read(scene)?;
    let warnings = crystals::settle(&mut read, scene, &LammpsCommand::default(), false)?;
    let mut case = Case::resolve(read, scene)?;
    case.warnings.extend(warnings);
    case.warnings.iter().for_each(|w| output::eprint(&format!("warning: {w}")));
    Ok(case)
}

/// The block of a scene.
fn block(case: &Case) -> Result<AtomsCase> {
    let accepted = "an [atoms] table (an empty one takes the defaults)";
    case.atoms.clone().ok_or_else(|| Error::input(case.file.display(), "atoms", "not given", accepted))
}

impl AtomsArgs {
    pub(super) fn execute(self) -> Result<()> {
        match self {
            AtomsArgs::Build { scene, out, json } => build(&scene, &out, json),
            AtomsArgs::Run { job, lammps, ranks, time_limit, json } => {
                if let Some(s) = time_limit.filter(|s| !(*s > 0.0 && *s <= MAX_SECONDS)) {
                    let accepted = format!("a positive number of seconds, at most {MAX_SECONDS}");
                    return Err(Error::input("command line", "--time-limit", s, accepted));
                }
                let job = Job::open(&job)?;
                job.check_scripts()?;
                let engine = LammpsEngine::find(lammps.as_deref())?
                    .with_ranks(ranks)?
                    .with_time_limit(time_limit.map(Duration::from_secs_f64));
                run(&engine, &job, ranks, json)
            }
            AtomsArgs::Read { scene, job, frames, own, out, json } => {
                let frames_folder = || frames[0].parent().map_or(PathBuf::new(), Path::to_path_buf);
                let out = out.unwrap_or_else(|| job.clone().unwrap_or_else(frames_folder).join("read"));
                let case = resolved(&scene)?;
                match own.resolve(&case)? {
                    Some(run) => read_own(&case, &run, &frames, &out, json),
                    None => read(&case, job.as_deref(), &frames, &out, json),
                }
            }
        }
    }
}

fn build(scene: &Path, out: &Path, json: bool) -> Result<()> {
    let case = resolved(scene)?;
    let atoms = block(&case)?;
    let progress = TerminalProgress::new();
    let job = pipeline::build_job(&case, &atoms, out, &progress)?;
    drop(progress);
    if json {
        return output::json_line(&json!({ "out": output::path(out), "job": job.spec, "audit": atoms.audit }));
    }
    let r = &job.spec;
    output::print(&format!(
        "{}: {} deformable, {} base, {} indenter atoms",
        out.display(),
        count(r.deformable as usize),
        count(r.fixed as usize),
        count(r.indenter as usize)
    ));
    output::print(&output::audit(&atoms.audit));
    Ok(())
}

fn run(engine: &LammpsEngine, job: &Job, ranks: usize, json: bool) -> Result<()> {
    let progress = TerminalProgress::new();
    ranks_warning(ranks, job.atoms()).iter().for_each(|text| progress.warn(text));
    let outcome = pipeline::run_lammps(engine, job, &progress)?;
    drop(progress);
    if json {
        return output::json_line(&outcome);
    }
    let rows = outcome.steps.iter().map(|s| {
        vec![
            s.step.to_string(),
            format!("{:.2}", s.displacement_angstrom),
            significant(s.load_ev_per_angstrom, 5),
            significant(s.p_star, 4),
            s.contacts.to_string(),
            s.force_evaluations.to_string(),
            s.minimizer.word().into(),
        ]
    });
    let head = ["step", "down / Å", "load / eV/Å", "p*", "contacts", "evaluations", "minimiser"];
    output::print(&output::table(&head, rows));
    Ok(())
}

fn read_own(case: &Case, run: &OwnRun, frames: &[PathBuf], out: &Path, json: bool) -> Result<()> {
    let progress = TerminalProgress::new();
    let (states, failure) = pipeline::read_own_run(case, run, frames, out, &progress)?;
    drop(progress);
    if json {
        output::json_line(&json!({ "out": output::path(out), "states": states }))?;
    } else {
        output::print("atoms against the continuum on the same surface (in brackets: misaligned map)");
        output::print(&own_run::table(&states));
        output::print(&format!("maps and frames: {}", out.display()));
    }
    match failure {
        Some(why) => Err(Error::AuxiliarySolve { why: why.to_string(), kept: out.to_path_buf() }),
        None => Ok(()),
    }
}

fn read(case: &Case, job: Option<&Path>, frames: &[PathBuf], out: &Path, json: bool) -> Result<()> {
    let atoms = block(case)?;
    let make = || std::fs::create_dir_all(out).map_err(Error::io("create", out));
    let results = match job {
        Some(job) => {
            let job = Job::open(job)?;
            make()?;
            pipeline::read_atoms(case, &atoms, &job, out)?
        }
        None => {
            make()?;
            let progress = TerminalProgress::new();
            let (places, results) = pipeline::read_frames(case, &atoms, frames, out, &mut |w| progress.warn(w))?;
            drop(progress);
            if !json {
                let loads = places.places.iter().map(|p| {
                    let file = p.file.display().to_string();
                    let down = format!("{:.4}", p.displacement_angstrom);
                    let p_star = significant(p.load / atoms.load_unit, 4);
                    vec![file, p.timestep.to_string(), down, significant(p.load, 6), p_star]
                });
                output::print(&output::table(&["file", "timestep", "down / Å", "load / eV/Å", "p*"], loads));
            }
            results
        }
    };
    if json {
        return output::json_line(&json!({ "out": output::path(out), "states": results.states }));
    }
    let rows = results.states.iter().map(|s| {
        vec![
            trimmed(s.p_star, 4),
            s.contacts.to_string(),
            percent(s.contact_area),
            significant(s.mean_gap_angstrom, 4),
            significant(s.contact_stress_gpa, 3),
            s.criteria.iter().map(|w| format!("{} {}", w.id, percent(w.contact_area))).collect::<Vec<_>>().join(", "),
        ]
    });
    output::print(&output::table(
        &["p*", "contacts", "fraction", "mean gap / Å", "contact stress / GPa", "by criterion"],
        rows,
    ));
    output::print(&format!("maps and frames: {}", out.display()));
    Ok(())
}

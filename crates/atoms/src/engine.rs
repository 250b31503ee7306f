//! Runs a job: LAMMPS runs as a child process, is monitored and can be stopped. Its result is accepted only after all
//! checks.

use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use super::block::BaseKind;
use super::cost::Relaxer;
use super::damage;
use super::job::Job;
use super::job_files::lock;
use super::job_spec::Minimizer;
use super::lammps_command::{LammpsCommand, without_relative_libraries};
use super::lammps_host::{self, HostCommand};
use super::load_history::{self, LoadHistory, StepRecord};
use super::minimizer_checkpoint;
use super::progress::{SCREEN_FILE, Watch, Watcher, silence_limit};
use super::search_path::{find_lammps, search_path};
use super::styles::Styles;
use crate::results::LoadStepResults;
use asperity_grid::error::LammpsFailure;
use asperity_grid::sys::group::{self, LONGEST_LINE, ProcessGroup};
use asperity_grid::{Error, Result, sys};
use asperity_surface::files::atomic_file::{self, list, read_bytes};
use asperity_surface::files::beneath::reach_folder;

/// Polling interval of the load steps: short compared with the shortest step (0.1 s for three thousand atoms), at
/// negligible cost.
const POLL: Duration = Duration::from_millis(40);

/// Limits of `lmp -h`, which takes 0.1 s and prints 30 KB.
const PROBE_LIMIT: Duration = Duration::from_secs(10);
const MOST_PROBE_BYTES: u64 = 4 << 20;

/// Forces are printed with three digits; a converged force may exceed the tolerance by this factor.
const FORCE_ROUNDING: f64 = 1.001;

/// Smallest number of atoms for a second rank. Waiting ranks spin: with 25 000 atoms on a busy machine two ranks took
/// 17 s of processor time instead of 6 s; from 800 000 atoms on they took no more than one.
const FEWEST_ATOMS_FOR_RANKS: u64 = 200_000;

/// Warning for a number of ranks that is too large for the number of atoms.
pub fn ranks_warning(ranks: usize, atoms: u64) -> Option<String> {
    (ranks > 1 && atoms < FEWEST_ATOMS_FOR_RANKS).then(|| {
        format!("{ranks} MPI ranks for {atoms} atoms: below {FEWEST_ATOMS_FOR_RANKS} atoms one is as fast, and faster on a busy machine")
    })
}

/// A finished job.
#[derive(Debug, Clone)]
pub struct Finished {
    pub history: LoadHistory,
    pub steps: Vec<LoadStepResults>,
    /// The step after which an earlier run was continued.
    pub resumed_from: Option<usize>,
    /// Steps whose largest force exceeds the tolerance, or whose load was not reached.
    pub unconverged: Vec<usize>,
    /// Peak resident memory of LAMMPS in this call, bytes; 0 if unknown, as for several ranks.
    pub peak_bytes: u64,
    /// Why LAMMPS's own minimisers relaxed all steps although the harmonic relaxation may be used, one line.
    pub not_harmonic: Option<String>,
}

/// How LAMMPS runs a job.
enum WayToRun {
    /// As a library of the host.
    Host(HostCommand),
    /// As a program, and why not as a library, where that was wanted.
    Program { reason: Option<String> },
}

impl WayToRun {
    fn reason(self) -> Option<String> {
        match self {
            WayToRun::Host(_) => None,
            WayToRun::Program { reason } => reason,
        }
    }
}

impl Finished {
    fn collect(job: &Job, resumed_from: Option<usize>) -> Result<Finished> {
        let history = LoadHistory::read(&job.folder)?;
        let evaluations = read_evaluations(&job.folder)?;
        let settings = &job.spec.settings;
        let steps = history.steps.iter().map(|r| r.to_results(settings.load_unit, &evaluations)).collect();
        let loose = |r: &&StepRecord| !r.load_converged || r.max_force > FORCE_ROUNDING * settings.force_tolerance;
        let unconverged = history.steps.iter().filter(loose).map(|r| r.step).collect();
        Ok(Finished { history, steps, resumed_from, unconverged, peak_bytes: 0, not_harmonic: None })
    }
}

/// LAMMPS with its styles.
#[derive(Debug, Clone)]
pub struct LammpsEngine {
    program: PathBuf,
    description: String,
    styles: Styles,
    start: LammpsCommand,
    time_limit: Option<Duration>,
    host: Option<PathBuf>,
    checkpoint_interval: Duration,
    silence_limit: Option<Duration>,
}

impl LammpsEngine {
    /// Finds the given program, or `lmp` or `lammps` in the search path.
    ///
    /// # Errors
    /// `MissingProgram` when there is none or it is not LAMMPS.
    pub fn find(value: Option<&Path>) -> Result<Self> {
        let remedy = "install LAMMPS (Debian: apt install lammps) or give its path with --lammps";
        let missing = |program: &str| Error::MissingProgram { program: program.into(), how: remedy.into() };
        let program = match value {
            Some(path) if path.as_os_str().as_encoded_bytes().first() == Some(&b'-') => {
                let accepted = "a program whose name does not begin with a dash; a path may begin with ./";
                return Err(Error::input("LAMMPS", "program", path.display(), accepted));
            }
            Some(path) if path.components().count() > 1 => {
                path.is_file().then(|| path.to_path_buf()).ok_or_else(|| missing(&path.display().to_string()))?
            }
            Some(name) => search_path(name).ok_or_else(|| missing(&name.display().to_string()))?,
            None => find_lammps().ok_or_else(|| missing("LAMMPS (lmp or lammps)"))?,
        };
        // The run has another working folder.
        let program = std::path::absolute(&program).map_err(Error::io("find", &program))?;
        let unusable = |said: String| {
            let how = "run it with -h, or give another LAMMPS with --lammps".into();
            Error::Program { program: program.display().to_string(), said, how }
        };
        let mut probe = Command::new(&program);
        probe.arg("-h").env("OMP_NUM_THREADS", "1").env("PAGER", "cat");
        let output = group::probe(probe, Some(PROBE_LIMIT), MOST_PROBE_BYTES).map_err(|e| match e.kind() {
            ErrorKind::TimedOut => unusable("with -h it took more than 10 s".into()),
            _ => unusable(format!("with -h: {e}")),
        })?;
        let styles = Styles::parse(&String::from_utf8_lossy(&output.stdout));
        if styles.lists.is_empty() {
            let why = output.complaint().unwrap_or_else(|| output.status.to_string());
            return Err(unusable(format!("with -h it lists no styles of LAMMPS ({why})")));
        }
        let description = format!("LAMMPS {}", styles.version);
        Ok(LammpsEngine {
            program,
            description,
            styles,
            start: LammpsCommand::default(),
            time_limit: None,
            host: None,
            checkpoint_interval: minimizer_checkpoint::INTERVAL,
            silence_limit: None,
        })
    }

    /// Sets the number of MPI processes. Two are no faster than one below some hundred thousand atoms, and far slower
    /// on a busy machine: waiting ranks spin.
    ///
    /// # Errors
    /// `Input` for more ranks than cores, `MissingProgram` without mpirun.
    pub fn with_ranks(self, ranks: usize) -> Result<Self> {
        self.with_command(LammpsCommand { ranks: Some(ranks), ..LammpsCommand::default() })
    }

    /// Sets ranks, launcher and arguments. The program is that of [`LammpsEngine::find`].
    ///
    /// # Errors
    /// `Input` for more ranks than cores without a launcher, `MissingProgram` without the launcher.
    pub fn with_command(mut self, command: LammpsCommand) -> Result<Self> {
        command.check()?;
        self.check_accelerator(&command)?;
        self.start = command;
        Ok(self)
    }

    /// Whether jobs can run with the accelerator that the arguments choose.
    ///
    /// # Errors
    /// `Input` with what is missing.
    pub fn check_accelerator(&self, command: &LammpsCommand) -> Result<()> {
        command.check_accelerator(&self.styles)
    }

    /// Limits the time of one call of `run`; finished steps are kept and the next call continues.
    pub fn with_time_limit(mut self, limit: Option<Duration>) -> Self {
        self.time_limit = limit;
        self
    }

    /// Sets the `asperity` program that runs LAMMPS as a library for blocks on an elastic base. The default is this program, or that of
    /// the search path.
    pub fn with_host(mut self, program: PathBuf) -> Self {
        self.host = Some(program);
        self
    }

    /// Sets the time between two checkpoints of a load; the default is [`minimizer_checkpoint::INTERVAL`].
    pub fn with_checkpoint_interval(mut self, interval: Duration) -> Self {
        self.checkpoint_interval = interval;
        self
    }

    /// Sets the time without a word of LAMMPS after which [`Progress::silent_s`](super::progress::Progress) has it; the default is [`silence_limit`].
    pub fn with_silence_limit(mut self, limit: Duration) -> Self {
        self.silence_limit = Some(limit);
        self
    }

    /// What would relax the steps of a job with this minimiser.
    pub fn relaxer(&self, minimizer: Minimizer) -> Relaxer {
        let version = &self.styles.version;
        let found = || lammps_host::find_own_library(&self.program, version).is_ok();
        Relaxer::of(minimizer, || !self.start.chooses_styles() && found())
    }

    /// Path of the program.
    pub fn program(&self) -> &Path {
        &self.program
    }

    /// Names of the installed packages that accelerate styles.
    pub fn accelerators(&self) -> String {
        let known = ["OPT", "OPENMP", "INTEL", "GPU", "KOKKOS"];
        let available: Vec<&str> = known.into_iter().filter(|name| self.styles.has("package", name)).collect();
        if available.is_empty() { "none that accelerates styles".into() } else { available.join(", ") }
    }

    /// Styles that jobs with adhesion need and this LAMMPS lacks.
    pub fn missing_styles(&self) -> Vec<String> {
        self.missing(true, true).map(|(kind, name)| format!("the {kind} style {name}")).collect()
    }

    fn missing(&self, adhesion: bool, nvt: bool) -> impl Iterator<Item = (&'static str, &'static str)> {
        let needed = [
            ("pair", "hybrid/overlay eam/alloy lj/cut"),
            ("minimize", "cg fire"),
            ("compute", "coord/atom property/atom reduce"),
            ("fix", "setforce aveforce store/state"),
        ];
        let adhesive = adhesion.then_some(("pair", "yukawa"));
        let warm = [("fix", "nve langevin viscous ave/atom ave/time"), ("compute", "temp")];
        let warm = warm.into_iter().filter(move |_| nvt);
        let all = needed.into_iter().chain(adhesive).chain(warm);
        all.flat_map(|(kind, names)| names.split(' ').map(move |name| (kind, name)))
            .filter(|(kind, name)| !self.styles.has(kind, name))
    }

    fn check_styles(&self, job: &Job) -> Result<()> {
        match self.missing(job.spec.interaction.adhesion.is_some(), job.spec.protocol.nvt().is_some()).next() {
            None => Ok(()),
            Some((kind, name)) => {
                Err(failed(job, LammpsFailure::MissingStyle { missing: format!("the {kind} style {name}") }))
            }
        }
    }

    /// How LAMMPS runs the job; measures what a host needs. `watch` and the time limit end it before.
    fn way_to_run(&self, job: &Job, watcher: &mut Watcher, watch: &mut Watch) -> Result<WayToRun> {
        let elastic = job.spec.block.base == BaseKind::Elastic;
        if !elastic && !job.relaxes_harmonically() {
            return Ok(WayToRun::Program { reason: None });
        }
        // What a scene leaves open has a second way.
        let is_open = !elastic && job.spec.settings.minimizer == Minimizer::Auto;
        let program = |e: Error| Ok(WayToRun::Program { reason: Some(e.to_string()) });
        let found = HostCommand::find(
            self.host.as_deref(),
            &self.program,
            &self.styles.version,
            &self.start,
            (elastic, is_open),
        )
        .and_then(|host| expect_memory(job, job.memory_bytes(self.start.ranks())).map(|()| host));
        let host = match found {
            Err(e @ (Error::MissingProgram { .. } | Error::Memory { .. })) if is_open => return program(e),
            found => found?,
        };
        let history = LoadHistory::read(&job.folder)?;
        let measured = lammps_host::prepare(job, &self.program, &self.styles.version, &mut || {
            if watcher.report(&history, watch).is_break() {
                return Err(Error::Interrupted);
            }
            self.check_time(job, watcher.begun)
        });
        match measured {
            // A table whose crystal has no force constants at these pressures still has forces.
            Err(e @ (Error::Input { .. } | Error::Lammps { .. } | Error::Format { .. })) if is_open => {
                self.check_time(job, watcher.begun)?;
                program(e)
            }
            measured => measured.map(|()| WayToRun::Host(host)),
        }
    }

    fn check_time(&self, job: &Job, started: Instant) -> Result<()> {
        match self.time_limit.filter(|limit| started.elapsed() > *limit) {
            Some(limit) => Err(failed(job, LammpsFailure::TimeLimit { seconds: limit.as_secs_f64() })),
            None => Ok(()),
        }
    }

    fn command(&self, job: &Job, way: &WayToRun, finished_steps: &[StepRecord]) -> Result<Command> {
        let mut command = match way {
            WayToRun::Host(host) => {
                let mut command = self.start.start(&host.program);
                command.args(&host.arguments);
                command
            }
            WayToRun::Program { .. } => {
                let mut command = self.start.start(&self.program);
                command.args(["-in", job.script().file]);
                command
            }
        };
        command.args(["-nocite", "-log", &log_name(finished_steps.last().map(|r| r.step))]);
        command.args(&self.start.args);
        if self.styles.has("pair", "eam/alloy/opt") && !self.start.chooses_styles() {
            // The `opt` variants are 8 to 10 % faster.
            command.args(["-sf", "opt"]);
        }
        for (name, value) in job.variables(finished_steps, self.styles.has("dump", "custom/zstd")) {
            command.args(["-var", &name, &value]);
        }
        if job.spec.protocol.prescribed().is_some() {
            let often = minimizer_checkpoint::iterations(self.checkpoint_interval, job.atoms(), self.start.ranks());
            command.args(["-var", "restart_every", &often.to_string()]);
            let start: usize = finished_steps.iter().map(|r| r.iterations).sum();
            let newest = minimizer_checkpoint::newest(&job.folder, finished_steps.len(), (start + often) as u64);
            if let Some(file) = newest.as_deref().and_then(Path::file_name) {
                command.args(["-var", "resume_mid", "1", "-var", "first_iteration", &start.to_string()]);
                command.args(["-var", "checkpoint"]).arg(file);
            }
        }
        without_relative_libraries(&mut command);
        command.env("OMP_NUM_THREADS", "1").stdin(Stdio::null());
        Ok(command)
    }
}

impl LammpsEngine {
    /// Program and version, one line.
    pub fn describe(&self) -> &str {
        &self.description
    }

    /// Runs the job, or continues it after the last finished step, to its end. `watch` is called for every finished
    /// step in order and repeatedly in between; `Break` stops the run.
    ///
    /// # Errors
    /// `Interrupted` after `Break`, `Lammps` with the failure, `Memory`, `MissingProgram`, `Io`.
    pub fn run(&self, job: &Job, watch: &mut Watch) -> Result<Finished> {
        let started = Instant::now();
        let lock = lock(&job.folder)?;
        self.check_styles(job)?;
        job.check_inputs()?;
        if is_complete(job)? {
            let all = LoadHistory::read(&job.folder)?.last().map(|r| r.step);
            return Finished::collect(job, all);
        }
        expect_memory(job, job.lammps_bytes(self.start.ranks()))?;
        let finished = load_history::prepare_resume(&job.folder)?;
        minimizer_checkpoint::keep_only(&job.folder, finished.map_or(0, |k| k + 1))?;
        let screen_file = job.folder.join(SCREEN_FILE);
        let screen = atomic_file::create(&screen_file)?;
        let both = screen.try_clone().map_err(Error::io("create", &screen_file))?;
        let limit = self.silence_limit.unwrap_or_else(|| silence_limit(job.atoms()));
        let mut watcher = Watcher::new(job, started, finished, limit);
        let way = self.way_to_run(job, &mut watcher, watch)?;
        let mut command = self.command(job, &way, &LoadHistory::read(&job.folder)?.steps)?;
        group::inherit(&mut command, &lock);
        // LAMMPS opens its files in the folder that was looked at, also if another is in its place now.
        let place = reach_folder(&job.folder).map_err(Error::io("open", &job.folder))?;
        command.current_dir(&place);
        let mut group = ProcessGroup::start(command.stdout(screen).stderr(both), self.start.end())
            .map_err(Error::io("start", &self.program))?;
        let mut verified_steps = load_history::seen_steps(&job.folder, finished.map_or(0, |k| k + 1));
        let mut peak_bytes = 0;
        let status = loop {
            if self.start.ranks() == 1 {
                peak_bytes = sys::peak_rss_bytes_of(group.id()).max(peak_bytes);
            }
            // In this order, so that a step finished just before the end is still reported.
            let ended = group.try_wait().map_err(Error::io("wait for", &self.program))?;
            let history = match LoadHistory::read(&job.folder) {
                Err(e @ Error::Format { .. }) => {
                    drop(group);
                    damage::repair(&job.folder)?;
                    return Err(failed(job, format!("its load steps cannot be read: {e}")));
                }
                other => other?,
            };
            let is_further = history.steps.len() > verified_steps;
            for record in history.steps.iter().skip(verified_steps) {
                if let Err(e) = load_history::verify_step(&job.folder, record.step) {
                    drop(group);
                    load_history::roll_back(&job.folder, record.step)?;
                    let description =
                        format!("what step {} left is not complete ({e}); is the disk full?", record.step);
                    return Err(failed(job, description));
                }
                verified_steps = record.step + 1;
            }
            if is_further {
                minimizer_checkpoint::keep_only(&job.folder, verified_steps)?;
            }
            watcher.read_progress(&history, &job.folder.join(log_name(finished)));
            if watcher.report(&history, watch).is_break() {
                return Err(Error::Interrupted);
            }
            if let Some(status) = ended {
                break status;
            }
            self.check_time(job, started)?;
            std::thread::sleep(POLL);
        };
        let read = |name: &str| read_bytes(&job.folder.join(name)).unwrap_or_default();
        let (log, screen) = (read(&log_name(finished)), read(SCREEN_FILE));
        run_status(status, &String::from_utf8_lossy(&log), &String::from_utf8_lossy(&screen))
            .map_err(|f| failed(job, f))?;
        // A program in place of LAMMPS may change what it has finished; the stage would then list it as whole.
        if let Some(damage) = damage::repair(&job.folder)? {
            return Err(failed(job, format!("{damage}; the same command computes it again")));
        }
        check_load_steps(job)?;
        let not_harmonic = way.reason();
        Ok(Finished { peak_bytes, not_harmonic, ..Finished::collect(job, finished)? })
    }
}

/// Whether a job fits into the memory.
fn expect_memory(job: &Job, need: u64) -> Result<()> {
    sys::expect_memory(format!("LAMMPS with {} atoms", job.atoms()), need, "use fewer cells or a thinner block")
}

fn failed(job: &Job, failure: impl Into<LammpsFailure>) -> Error {
    Error::lammps(&job.folder, failure)
}

/// Whether the job has ended and its last frame exists.
fn is_complete(job: &Job) -> Result<bool> {
    let history = LoadHistory::read(&job.folder)?;
    let ended = job.end(&history.steps).is_some();
    Ok(ended && history.last().is_some_and(|r| load_history::frame_file(&job.folder, r.step).is_ok()))
}

/// Checks that the load steps end where the job specifies, and that no atoms are missing.
fn check_load_steps(job: &Job) -> Result<()> {
    let history = LoadHistory::read(&job.folder)?;
    let previous = job.atoms();
    if let Some(record) = history.steps.iter().find(|r| r.atoms != previous) {
        // Otherwise every later run would find it again.
        load_history::roll_back(&job.folder, record.step)?;
        return Err(failed(job, LammpsFailure::AtomCount { before: previous, after: record.atoms }));
    }
    if !is_complete(job)? {
        let reached = history.last().map_or("before its first step".to_string(), |r| format!("at step {}", r.step));
        return Err(failed(job, format!("it ended regularly, but its load history stops {reached}")));
    }
    Ok(())
}

/// Classifies the end of a run by exit status, log and screen output.
fn run_status(status: ExitStatus, log: &str, screen: &str) -> std::result::Result<(), LammpsFailure> {
    // Other errors are consequences of the time limit; the interrupted step is not finished.
    if log.contains("Wall time limit reached") {
        let text = "its script's time limit (timer timeout) was reached; the same command resumes at the last step";
        return Err(text.into());
    }
    if let Some(failure) = error_line(log).or_else(|| error_line(screen)) {
        return Err(failure);
    }
    if let Some(signal) = status.signal() {
        return Err(LammpsFailure::Signal(signal));
    }
    match status.code() {
        Some(0) if log.contains("Total wall time") => Ok(()),
        Some(0) => Err(LammpsFailure::Unfinished),
        // Launchers and the dynamic loader say why, not LAMMPS.
        code => Err(match screen.lines().rfind(|l| !l.trim().is_empty()) {
            Some(last) => LammpsFailure::Output(format!(
                "it ended with exit status {} and no error message of LAMMPS; log.screen ends with: {}",
                code.unwrap_or(-1),
                last.trim().chars().take(LONGEST_LINE).collect::<String>()
            )),
            None => LammpsFailure::Status(code.unwrap_or(-1)),
        }),
    }
}

/// Text of `ERROR: ...` or `ERROR on proc 3: ...` with the command; lost atoms are a separate failure.
fn error_line(text: &str) -> Option<LammpsFailure> {
    let mut lines = text.lines().skip_while(|l| !l.starts_with("ERROR"));
    let line = lines.next()?.trim();
    if let Some(counts) = line.split_once("Lost atoms: original ").map(|(_, remainder)| remainder) {
        let numbers: Vec<u64> = counts.split_whitespace().filter_map(|w| w.parse().ok()).collect();
        if let [before, after, ..] = numbers[..] {
            return Some(LammpsFailure::AtomCount { before, after });
        }
    }
    let message = line.split_once(": ").map_or(line, |(_, remainder)| remainder);
    let command = lines.find_map(|l| l.strip_prefix("Last command: "));
    Some(LammpsFailure::Message(match command {
        Some(command) => format!("{message}; last command: {}", command.trim()),
        None => message.to_string(),
    }))
}

fn log_name(finished: Option<usize>) -> String {
    format!("log.{}", finished.map_or(0, |k| k + 1))
}

/// Force evaluations from all logs of a folder; later runs override earlier ones.
fn read_evaluations(folder: &Path) -> Result<BTreeMap<usize, usize>> {
    let mut logs: Vec<(usize, PathBuf)> = Vec::new();
    for (name, path) in list(folder)? {
        if let Some(first) = name.strip_prefix("log.").and_then(|n| n.parse().ok()) {
            logs.push((first, path));
        }
    }
    logs.sort();
    let mut counts = BTreeMap::new();
    for (_, path) in logs {
        let text = read_bytes(&path)?;
        counts.extend(load_history::evaluations(&String::from_utf8_lossy(&text)));
    }
    Ok(counts)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn status(code: i32) -> ExitStatus {
        ExitStatus::from_raw(code << 8)
    }

    #[test]
    fn several_ranks_for_few_atoms_give_a_warning() {
        assert!(ranks_warning(2, 100_000).is_some_and(|c| c.contains("2 MPI ranks")));
        assert_eq!((ranks_warning(1, 100), ranks_warning(2, 3_000_000)), (None, None));
    }

    #[test]
    fn only_a_regular_end_is_accepted() {
        let good = "Loop time\nTotal wall time: 0:00:03\n";
        assert_eq!(run_status(status(0), good, ""), Ok(()));
        assert_eq!(run_status(status(0), "Loop time\n", ""), Err(LammpsFailure::Unfinished));
        assert_eq!(run_status(status(3), good, ""), Err(LammpsFailure::Status(3)));
        assert_eq!(run_status(ExitStatus::from_raw(9), "", ""), Err(LammpsFailure::Signal(9)));
        let launcher = run_status(status(1), "", "srun: error: Invalid MPI type 'pmix'\n\n").expect_err("a failure");
        assert!(
            launcher.to_string().ends_with("log.screen ends with: srun: error: Invalid MPI type 'pmix'"),
            "{launcher}"
        );
        let lost = "ERROR: Lost atoms: original 792 current 710 (src/thermo.cpp:439)\nLast command: run 5\n";
        assert_eq!(run_status(status(1), lost, ""), Err(LammpsFailure::AtomCount { before: 792, after: 710 }));
        let forms = [
            "ERROR: Unknown command: x (a.cpp:1)\nLast command: x\n",
            "ERROR on proc 0: Unknown command: x (a.cpp:1)\nLast command: x\n",
        ];
        for text in forms {
            let expected = LammpsFailure::Message("Unknown command: x (a.cpp:1); last command: x".into());
            assert_eq!(run_status(status(1), "", text), Err(expected.clone()));
            // Even with exit status 0 and the line of a regular end.
            assert_eq!(run_status(status(0), &format!("{text}{good}"), ""), Err(expected));
        }
    }

    #[test]
    fn missing_styles_are_reported() {
        for name in ["no-such-lammps", "/no/such/lammps", "true"] {
            let error = LammpsEngine::find(Some(Path::new(name))).expect_err("missing");
            assert_eq!(error.exit_code(), 5);
            assert!(error.to_string().contains(name) && error.to_string().contains("--lammps"), "{error}");
        }
        let dash = LammpsEngine::find(Some(Path::new("-in"))).expect_err("refused");
        assert!(dash.exit_code() == 2 && dash.to_string().contains("dash"), "{dash}");
    }
}

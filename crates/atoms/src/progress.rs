//! Progress of a running job, read from its load steps and the end of its log.

use asperity_surface::files::atomic_file::open_regular;
use std::io::{Read, Seek, SeekFrom};
use std::ops::ControlFlow;
use std::path::Path;
use std::time::{Duration, Instant};

use super::job::Job;
use super::load_history::{LOAD_STEPS_FILE, LoadHistory, StepRecord};

/// What LAMMPS prints.
pub(super) const SCREEN_FILE: &str = "log.screen";

/// Progress of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Progress {
    /// The last finished step, and whether this is the first call with it.
    pub record: Option<StepRecord>,
    pub is_new: bool,
    /// Iterations of the current step, from its log.
    pub iterations: usize,
    /// Mean pressure over E* times rms gradient.
    pub p_star: f64,
    /// Time since the start of `run`, seconds.
    pub elapsed_s: f64,
    /// Time since LAMMPS last wrote something, seconds, once it is longer than [`silence_limit`].
    pub silent_s: Option<f64>,
}

/// Time without a word of LAMMPS after which it may hang: ten minutes, or 1 ms for each atom. It writes at least every 25 iterations, in the
/// run at constant temperature every 100 by default, of 2 to 4 µs for each atom: more than twice the longest pause.
pub fn silence_limit(atoms: u64) -> Duration {
    Duration::from_secs(600).max(Duration::from_millis(atoms))
}

/// How long the files of a run have kept their size.
struct Silence {
    limit: Duration,
    bytes: u64,
    since: Instant,
}

impl Silence {
    fn observe(&mut self, bytes: u64, now: Instant) {
        if bytes != self.bytes {
            (self.bytes, self.since) = (bytes, now);
        }
    }

    fn seconds(&self, now: Instant) -> Option<f64> {
        let silent = now.duration_since(self.since);
        (silent > self.limit).then_some(silent.as_secs_f64())
    }
}

/// Receives progress; `Break` stops the run.
pub type Watch<'a> = dyn FnMut(Progress) -> ControlFlow<()> + 'a;

/// Calls `watch` for finished steps.
pub(super) struct Watcher<'a> {
    job: &'a Job,
    pub(super) begun: Instant,
    seen: usize,
    iterations: usize,
    silence: Silence,
}

impl<'a> Watcher<'a> {
    pub(super) fn new(job: &'a Job, begun: Instant, finished: Option<usize>, limit: Duration) -> Self {
        let silence = Silence { limit, bytes: 0, since: begun };
        Watcher { job, begun, seen: finished.map_or(0, |k| k + 1), iterations: 0, silence }
    }

    /// Reads the iteration count from the end of a log. LAMMPS counts iterations over all steps, across restarts.
    pub(super) fn read_progress(&mut self, history: &LoadHistory, log: &Path) {
        let earlier: usize = history.steps.iter().map(|r| r.iterations).sum();
        self.iterations = last_iteration(log).map_or(0, |all| all.saturating_sub(earlier));
        let folder = &self.job.folder;
        let files = [log.to_path_buf(), folder.join(SCREEN_FILE), folder.join(LOAD_STEPS_FILE)];
        let bytes = files.iter().filter_map(|file| open_regular(file).ok()).map(|(_, bytes)| bytes).sum();
        self.silence.observe(bytes, Instant::now());
    }

    /// One call per new step, or a single call without a new step.
    pub(super) fn report(&mut self, history: &LoadHistory, watch: &mut Watch) -> ControlFlow<()> {
        if history.steps.len() <= self.seen {
            return watch(self.progress(history.last(), false));
        }
        for record in &history.steps[self.seen..] {
            self.seen += 1;
            watch(self.progress(Some(record), true))?;
        }
        ControlFlow::Continue(())
    }

    fn progress(&self, record: Option<&StepRecord>, is_new: bool) -> Progress {
        let settings = &self.job.spec.settings;
        Progress {
            record: record.cloned(),
            is_new,
            iterations: self.iterations,
            p_star: record.map_or(0.0, |r| r.load / settings.load_unit),
            elapsed_s: self.begun.elapsed().as_secs_f64(),
            silent_s: self.silence.seconds(Instant::now()),
        }
    }
}

/// Bytes read from the end of a log; longer than any line of numbers that the scripts print.
const LOG_TAIL: u64 = 400;

/// First column of the last complete line of numbers at the end of a log, if there is one.
fn last_iteration(log: &Path) -> Option<usize> {
    let (mut file, length) = open_regular(log).ok()?;
    file.seek(SeekFrom::Start(length.saturating_sub(LOG_TAIL))).ok()?;
    let mut tail = Vec::new();
    file.read_to_end(&mut tail).ok()?;
    iteration_of(&String::from_utf8_lossy(&tail))
}

fn iteration_of(tail: &str) -> Option<usize> {
    // The first line of the tail may lack its start, the last line its end.
    let mut lines: Vec<&str> = tail.split_inclusive('\n').skip(1).filter(|l| l.ends_with('\n')).collect();
    lines.reverse();
    lines.iter().find_map(|line| {
        let tokens: Vec<&str> = line.split_whitespace().collect();
        let numbers = tokens.len() > 2 && tokens.iter().all(|w| w.parse::<f64>().is_ok());
        if numbers { tokens[0].parse().ok() } else { None }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn silence_begins_with_the_last_change_of_the_files() {
        assert_eq!(silence_limit(1000), Duration::from_secs(600));
        assert_eq!(silence_limit(20_000_000), Duration::from_secs(20_000));
        let begun = Instant::now();
        let after = |seconds| begun + Duration::from_secs(seconds);
        let mut silence = Silence { limit: Duration::from_secs(600), bytes: 0, since: begun };
        assert_eq!([silence.seconds(after(600)), silence.seconds(after(601))], [None, Some(601.0)]);
        silence.observe(10, after(601));
        silence.observe(10, after(1000));
        assert_eq!([silence.seconds(after(1201)), silence.seconds(after(1202))], [None, Some(601.0)]);
    }

    #[test]
    fn the_iteration_is_read_from_the_end_of_a_log() {
        let text = "100 -5.5 0.1 3\n     125   -1200.5  0.002 11.1\n     150   -1200.6  0.0";
        assert_eq!(iteration_of(text), Some(125));
        assert_eq!(iteration_of(&format!("{text}01 11.2\nLoop time of 3 on 1 procs\n")), Some(150));
        assert_eq!((iteration_of(""), iteration_of("x\nno numbers here\n3\n")), (None, None));
    }
}

//! Progress for people: bars on a terminal, plain lines elsewhere; and Ctrl-C.

use super::output;
use crate::pipeline::Listener;
use crate::record::results::StageCost;
use crate::report::number::{duration, memory};
use indicatif::{ProgressBar, ProgressStyle};
use std::collections::HashSet;
use std::io::IsTerminal;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, Once};
use std::time::{Duration, Instant};

static STOPPING: AtomicBool = AtomicBool::new(false);
static HANDLER: Once = Once::new();

/// Plain lines come no more often than this.
const QUIET: Duration = Duration::from_secs(5);

/// Resolution of the bar.
const STEPS: u64 = 1000;

/// Progress of a stage.
struct StageProgress {
    name: String,
    /// Time and text of the last line.
    last: (Instant, String),
    /// Time and progress of the first report.
    first: Option<(Instant, f64)>,
}

impl StageProgress {
    fn new(name: &str) -> Self {
        StageProgress { name: name.into(), last: (Instant::now(), String::new()), first: None }
    }

    /// Remaining time at the mean speed so far, s.
    fn remaining(&mut self, fraction: f64) -> Option<f64> {
        let (since, from) = *self.first.get_or_insert((Instant::now(), fraction));
        let (seen, seconds) = (fraction - from, since.elapsed().as_secs_f64());
        (seen > LEAST_SEEN && seconds > 1.0).then(|| seconds * (1.0 - fraction) / seen)
    }
}

/// Progress from which the remaining time is printed.
const LEAST_SEEN: f64 = 0.02;

/// Prints progress to stderr: a bar on a terminal, lines elsewhere.
pub struct TerminalProgress {
    bar: ProgressBar,
    terminal: bool,
    stage: Mutex<StageProgress>,
    warned: Mutex<HashSet<String>>,
}

/// Whether a computation has begun, which a stop lets reach its next step.
static COMPUTING: AtomicBool = AtomicBool::new(false);

/// Whether the user has requested a stop. The first Ctrl-C or SIGTERM requests it, or ends the program if nothing has
/// begun to compute; the second ends the program at once.
pub fn stopping() -> bool {
    HANDLER.call_once(|| {
        // Failing to install a handler leaves the default behaviour, which stops the program.
        let _ = ctrlc::set_handler(|| {
            if STOPPING.swap(true, Ordering::Relaxed) || !COMPUTING.load(Ordering::Relaxed) {
                std::process::exit(130);
            }
            output::eprint("stopping after the current step (once more: at once)");
        });
    });
    STOPPING.load(Ordering::Relaxed)
}

/// Says that a computation has begun, and installs the handler of Ctrl-C and SIGTERM.
pub fn compute() {
    stopping();
    COMPUTING.store(true, Ordering::Relaxed);
}

impl Default for TerminalProgress {
    fn default() -> Self {
        Self::new()
    }
}

impl TerminalProgress {
    pub fn new() -> Self {
        stopping();
        let terminal = std::io::stderr().is_terminal();
        let bar = if terminal { ProgressBar::new(STEPS) } else { ProgressBar::hidden() };
        if let Ok(style) = ProgressStyle::with_template("{prefix:>10} [{bar:24}] {elapsed:>4} {wide_msg}") {
            bar.set_style(style.progress_chars("=> "));
        }
        TerminalProgress { bar, terminal, stage: Mutex::new(StageProgress::new("")), warned: Mutex::default() }
    }

    /// Prints a line of its own.
    pub fn note(&self, text: &str) {
        self.line(&format!("      note  {text}"));
    }

    fn line(&self, text: &str) {
        if self.terminal {
            self.bar.suspend(|| output::eprint(text));
        } else {
            output::eprint(text);
        }
    }
}

impl Listener for TerminalProgress {
    fn begin(&self, stage: &str, description: &str) {
        COMPUTING.store(true, Ordering::Relaxed);
        *self.stage.lock().unwrap_or_else(|e| e.into_inner()) = StageProgress::new(stage);
        self.bar.reset();
        self.bar.set_prefix(stage.to_string());
        self.bar.set_message(output::printable(description).into_owned());
        if !self.terminal {
            self.line(&format!("{stage:>10}  {description}"));
        }
    }

    fn progress(&self, progress: Option<f64>, message: &str) {
        let mut stage = self.stage.lock().unwrap_or_else(|e| e.into_inner());
        let to_go = progress.and_then(|d| stage.remaining(d));
        let message = to_go.map_or(message.to_string(), |s| format!("{message}, {} to go", duration(s)));
        if self.terminal {
            if let Some(fraction) = progress {
                self.bar.set_position((fraction * STEPS as f64) as u64);
            }
            self.bar.set_message(output::printable(&message).into_owned());
            return;
        }
        if stage.last.0.elapsed() >= QUIET && stage.last.1 != message {
            self.line(&format!("{:>10}  {message}", stage.name));
            stage.last = (Instant::now(), message);
        }
    }

    fn end(&self, cost: &StageCost) {
        let how = if cost.reused { "done before in" } else { "done in" };
        let peak = memory(cost.peak_rss_bytes);
        let parts = match cost.earlier_seconds {
            0.0 => String::new(),
            s => format!(" ({} of it in earlier parts)", duration(s)),
        };
        self.line(&format!("{:>10}  {how} {}{parts}, peak memory {peak}", cost.name, duration(cost.seconds)));
    }

    /// A text that several loads or settings have is printed once.
    fn warn(&self, text: &str) {
        if self.warned.lock().unwrap_or_else(|e| e.into_inner()).insert(text.to_string()) {
            self.line(&format!("   warning  {text}"));
        }
    }

    fn stopping(&self) -> bool {
        stopping()
    }
}

impl Drop for TerminalProgress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

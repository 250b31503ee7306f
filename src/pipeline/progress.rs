use super::Listener;
use crate::pipeline::checkpoint::CheckpointWriter;
use asperity_contact::method::{Equilibrium, Iteration, Observer, SeparationStep, SnapshotRef};
use asperity_grid::Grid;
use std::ops::ControlFlow;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Reports the progress of a load path to a listener, and writes its checkpoints.
pub struct ProgressReporter<'a> {
    listener: &'a dyn Listener,
    writer: Option<&'a CheckpointWriter>,
    /// Prefix of each message.
    prefix: &'a str,
    done: AtomicUsize,
    /// Loads of the path.
    total: usize,
    /// The last state of a search for the pull-off.
    separation: Mutex<Option<SeparationStep>>,
}

impl<'a> ProgressReporter<'a> {
    /// `(done, total)`: number of finished loads, and number of loads of the path.
    pub fn new(
        listener: &'a dyn Listener,
        writer: Option<&'a CheckpointWriter>,
        prefix: &'a str,
        (done, total): (usize, usize),
    ) -> Self {
        ProgressReporter { listener, writer, prefix, done: AtomicUsize::new(done), total, separation: Mutex::default() }
    }

    fn separation(&self) -> Option<SeparationStep> {
        *self.separation.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// The part of the path that is being solved.
    fn part(&self) -> String {
        match (self.done.load(Ordering::Relaxed), self.separation()) {
            (load, _) if load < self.total => format!("load {} of {}", load + 1, self.total),
            (_, None) => "pulling off".to_string(),
            (_, Some(SeparationStep { states, tension, .. })) => {
                format!(
                    "pulling off, state {}, last tension {:.0} % of the largest",
                    states + 1,
                    100.0 * tension.max(0.0)
                )
            }
        }
    }

    /// Counts a load as finished.
    pub fn next(&self) {
        self.done.fetch_add(1, Ordering::Relaxed);
    }
}

impl Observer for ProgressReporter<'_> {
    fn iteration(&self, step: Iteration) -> ControlFlow<()> {
        let on = if step.grid_fraction < 1.0 { " on a coarser grid" } else { "" };
        let message =
            format!("{}{}, iteration {}{on}, residual {:.1e}", self.prefix, self.part(), step.iteration, step.residual);
        let (load, total) = (self.done.load(Ordering::Relaxed), self.total);
        let done = match load < total {
            true => Some((load as f64 + step.progress()) / total as f64),
            false => self.separation().map(|step| step.progress),
        };
        self.listener.progress(done, &message);
        if let Some(e) = self.writer.and_then(CheckpointWriter::take_error) {
            self.listener.warn(&format!("no checkpoint: {e}"));
        }
        if self.stop_requested() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn stop_requested(&self) -> bool {
        self.listener.stopping()
    }

    fn snapshot_due(&self) -> bool {
        self.writer.is_some_and(CheckpointWriter::is_due)
    }

    fn snapshot(&self, snapshot: SnapshotRef) {
        if let Some(writer) = self.writer {
            writer.write(&snapshot);
        }
    }

    fn load_ended(&self) {
        self.next();
    }

    fn separated(&self, step: SeparationStep) {
        *self.separation.lock().unwrap_or_else(|e| e.into_inner()) = Some(step);
        self.listener.progress(Some(step.progress), &format!("{}{}", self.prefix, self.part()));
    }

    fn interrupted(&self, grid: Grid, iterate: &Equilibrium) {
        if let Some(writer) = self.writer {
            writer.write_interrupted(grid, iterate);
        }
    }
}

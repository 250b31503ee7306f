use super::Listener;
use crate::pipeline::checkpoint::CheckpointWriter;
use asperity_contact::method::{Equilibrium, Iteration, Observer, SnapshotRef};
use asperity_grid::Grid;
use std::ops::ControlFlow;
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
}

impl<'a> ProgressReporter<'a> {
    /// `(done, total)`: number of finished loads, and number of loads of the path.
    pub fn new(
        listener: &'a dyn Listener,
        writer: Option<&'a CheckpointWriter>,
        prefix: &'a str,
        (done, total): (usize, usize),
    ) -> Self {
        ProgressReporter { listener, writer, prefix, done: AtomicUsize::new(done), total }
    }

    /// Counts a load as finished.
    pub fn next(&self) {
        self.done.fetch_add(1, Ordering::Relaxed);
    }
}

impl Observer for ProgressReporter<'_> {
    fn iteration(&self, step: Iteration) -> ControlFlow<()> {
        let (load, total) = (self.done.load(Ordering::Relaxed), self.total);
        let on = if step.grid_fraction < 1.0 { " on a coarser grid" } else { "" };
        let part = if load < total { format!("load {} of {total}", load + 1) } else { "pulling off".to_string() };
        let message =
            format!("{}{part}, iteration {}{on}, residual {:.1e}", self.prefix, step.iteration, step.residual);
        let done = (load < total).then(|| (load as f64 + step.progress()) / total as f64);
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

    fn interrupted(&self, grid: Grid, iterate: &Equilibrium) {
        if let Some(writer) = self.writer {
            writer.write_interrupted(grid, iterate);
        }
    }
}

use super::Listener;
use crate::method::{Iteration, Observer, SnapshotRef};
use crate::path::CheckpointWriter;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Tells a listener how far a load path is, and keeps checkpoints of it.
pub struct Progress<'a> {
    listener: &'a dyn Listener,
    writer: Option<&'a CheckpointWriter>,
    /// What goes before the words.
    said: &'a str,
    done: AtomicUsize,
    of: usize,
}

impl<'a> Progress<'a> {
    /// `done` loads `of` a path are.
    pub fn new(
        listener: &'a dyn Listener,
        writer: Option<&'a CheckpointWriter>,
        said: &'a str,
        (done, of): (usize, usize),
    ) -> Self {
        Progress { listener, writer, said, done: AtomicUsize::new(done), of }
    }

    /// A load is done.
    pub fn next(&self) {
        self.done.fetch_add(1, Ordering::Relaxed);
    }
}

impl Observer for Progress<'_> {
    fn iteration(&self, step: Iteration) -> ControlFlow<()> {
        let (load, of) = (self.done.load(Ordering::Relaxed), self.of);
        let on = if step.grid_fraction < 1.0 { " on a coarser grid" } else { "" };
        let part = if load < of { format!("load {} of {of}", load + 1) } else { "pulling off".to_string() };
        let message = format!("{}{part}, iteration {}{on}, residual {:.1e}", self.said, step.iteration, step.residual);
        let done = (load < of).then(|| (load as f64 + step.progress()) / of as f64);
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
}

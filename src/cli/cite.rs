//! `asperity cite`: what to cite for a run, as BibTeX.

use super::output;
use crate::Result;
use crate::pipeline::FinishedRun;
use crate::record::bibliography::{Entry, entries};
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(super) struct CiteArgs {
    /// Run folder.
    folder: PathBuf,
}

impl CiteArgs {
    pub(super) fn execute(&self) -> Result<()> {
        let run = FinishedRun::open(&self.folder)?;
        output::print(&software(&run.program));
        let sources = run.sources();
        let is_cited = |entry: &Entry| sources.iter().any(|source| entry.is_named(source));
        entries().filter(is_cited).for_each(|entry| output::print(&format!("\n{}", entry.0)));
        // What has no entry is a comment: the reader finds it by its DOI.
        let has_entry = |source: &str| entries().any(|entry| entry.is_named(source));
        // A method names several papers, some of them without a DOI.
        let others = sources.iter().filter(|source| !source.split("; ").all(has_entry));
        others.for_each(|source| output::print(&format!("\n% {source}")));
        Ok(())
    }
}

/// `program`: name and version.
fn software(program: &str) -> String {
    let (name, version) = program.split_once(' ').unwrap_or((program, ""));
    let (title, maintainers) = (env!("CARGO_PKG_DESCRIPTION"), "{asperity maintainers}");
    format!(
        "@software{{asperity,\n  author  = {{{maintainers}}},\n  title   = {{{name}: {title}}},\n  version = {{{version}}},\n  license = {{{}}}\n}}",
        env!("CARGO_PKG_LICENSE")
    )
}

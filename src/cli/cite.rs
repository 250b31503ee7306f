//! `asperity cite`: what to cite for a run, as BibTeX.

use super::output;
use crate::Result;
use crate::pipeline::FinishedRun;
use std::path::PathBuf;

/// Entries of what runs are based on. The paper on asperity has the same file.
const REFERENCES: &str = include_str!("../references.bib");

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
        let is_cited = |entry: &&str| sources.iter().any(|source| is_named(entry, source));
        entries().filter(is_cited).for_each(|entry| output::print(&format!("\n{entry}")));
        // What has no entry is a comment: the reader finds it by its DOI.
        let has_entry = |source: &str| entries().any(|entry| is_named(entry, source));
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

/// The entries, each from its `@` to its closing brace.
fn entries() -> impl Iterator<Item = &'static str> {
    REFERENCES.split("\n\n").map(str::trim).filter(|entry| entry.starts_with('@'))
}

/// Whether a source has the DOI or the preprint of an entry.
fn is_named(entry: &str, source: &str) -> bool {
    let field = |name: &str| {
        let line = entry.lines().find(|line| line.trim_start().starts_with(name))?;
        Some(line.split_once('{')?.1.trim_end_matches(['}', ',']))
    };
    let preprint = field("eprint").is_some_and(|number| source.contains(&format!("arXiv:{number}")));
    preprint || field("doi").is_some_and(|doi| dois(source).any(|named| named == doi))
}

/// The DOIs of a source.
fn dois(source: &str) -> impl Iterator<Item = &str> {
    source.split("doi:").skip(1).map(|rest| {
        let end = rest.find([' ', ';', ',']).unwrap_or(rest.len());
        let doi = rest[..end].trim_end_matches([':', '.']);
        // A bracket around it is not part of it.
        if doi.matches(')').count() > doi.matches('(').count() { doi.trim_end_matches(')') } else { doi }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_find_their_entries() {
        let found = |source: &str| entries().filter(|entry| is_named(entry, source)).count();
        for source in [
            "Müser et al., Tribology Letters 65 (2017) 118, doi:10.1007/s11249-017-0900-2: the problem.",
            "Method fft-ia (x): doi:10.1016/S0043-1648(99)00113-1; Medina & Dini, Int. J. Solids Struct. 51 (2014) 2620.",
            "Yastrebov, Anciaux & Molinari, J. Mech. Phys. Solids 107 (2017) 469, arXiv:1701.02727: perimeter.",
        ] {
            assert_eq!(found(source), 1, "{source}");
        }
        assert_eq!(found("The potential is that of Al.alloy."), 0);
        let two = "Method p (q): doi:10.1063/1.1388626; doi:10.1103/PhysRevLett.99.125502.";
        assert_eq!(dois(two).collect::<Vec<_>>(), ["10.1063/1.1388626", "10.1103/PhysRevLett.99.125502"]);
        assert_eq!(found(two), 2);
        assert_eq!(dois("(doi:10.1063/1.1388626)").collect::<Vec<_>>(), ["10.1063/1.1388626"]);
    }

    #[test]
    fn entries_are_complete() {
        for entry in entries() {
            let is_whole =
                entry.ends_with('}') && ["author", "title", "year"].iter().all(|field| entry.contains(field));
            assert!(is_whole || entry.starts_with("@misc"), "{entry}");
        }
    }
}

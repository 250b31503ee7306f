//! Styles and packages of a LAMMPS program.

use std::collections::{BTreeMap, BTreeSet};

/// Lists of `lmp -h` by the first word of their section in lower case ("pair", "compute").
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Styles {
    pub version: String,
    pub lists: BTreeMap<String, BTreeSet<String>>,
}

impl Styles {
    pub(super) fn parse(help: &str) -> Styles {
        let mut styles = Styles::default();
        let mut section: Option<String> = None;
        for line in help.lines() {
            if let Some(version) = line.split_once("Parallel Simulator - ").map(|(_, v)| v) {
                styles.version = version.trim().to_string();
            } else if let Some(title) = line.strip_prefix("* ") {
                section = title.split_whitespace().next().map(str::to_lowercase);
            } else if line.starts_with("Installed packages") {
                section = Some("package".into());
            } else if line.starts_with("List of") {
                section = None;
            } else if let Some(name) = &section {
                styles.lists.entry(name.clone()).or_default().extend(line.split_whitespace().map(str::to_string));
            }
        }
        styles
    }

    pub(super) fn has(&self, kind: &str, name: &str) -> bool {
        self.lists.get(kind).is_some_and(|list| list.contains(name))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HELP: &str = "\nLarge-scale Atomic/Molecular Massively Parallel Simulator - 29 Sep 2021 - Update 2\n\n\
                        Installed packages:\n\nMANYBODY OPT \n\nList of individual style options\n\n* Minimize styles:\n\n\
                        cg              fire\n\n* Pair styles:\n\neam/alloy       hybrid/overlay  lj/cut\n";

    #[test]
    fn styles_are_read_from_the_help_text() {
        let styles = Styles::parse(HELP);
        assert_eq!(styles.version, "29 Sep 2021 - Update 2");
        assert!(styles.has("pair", "hybrid/overlay") && styles.has("minimize", "cg") && styles.has("package", "OPT"));
        assert!(!styles.has("pair", "yukawa") && !styles.has("compute", "coord/atom"));
    }
}

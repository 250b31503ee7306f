//! Licences, sources and maintenance of the crates that the program is built from, with all features. Advisories are not read: their
//! database is elsewhere (`make deny`).

use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;
use std::sync::LazyLock;

/// Licences that allow a program under the MIT licence.
static LICENCES: LazyLock<Vec<String>> = LazyLock::new(|| {
    let deny: toml::Table = include_str!("../deny.toml").parse().expect("TOML");
    let allowed = deny["licenses"]["allow"].as_array().expect("a list");
    allowed.iter().map(|licence| licence.as_str().expect("a name").to_string()).collect()
});

/// Crates without a maintainer, those that need them, and why they stay.
const UNMAINTAINED: [(&str, &[&str], &str); 3] = [
    ("paste", &["pulp"], "a macro at build time; pulp needs it in its newest version"),
    ("conv", &["mpi"], "conversions between integers, with the feature mpi only; rsmpi needs it in its newest version"),
    ("custom_derive", &["conv"], "a macro at build time, with the feature mpi only"),
];

fn metadata() -> Value {
    let read = |more: &[&str]| {
        let mut cargo = Command::new(env!("CARGO"));
        cargo.args(["metadata", "--locked", "--all-features", "--format-version", "1"]).args(more);
        cargo.current_dir(env!("CARGO_MANIFEST_DIR")).output().expect("cargo starts")
    };
    // Crates of features that were never built are fetched.
    let output = Some(read(&["--offline"])).filter(|o| o.status.success()).unwrap_or_else(|| read(&[]));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

fn list<'a>(value: &'a Value, key: &str) -> &'a Vec<Value> {
    value[key].as_array().expect("a list")
}

fn word<'a>(value: &'a Value, key: &str) -> &'a str {
    value[key].as_str().unwrap_or_default()
}

/// Whether one alternative consists of accepted licences. The `/` of older crates means OR; parentheses group alternatives before AND.
fn is_accepted(expression: &str) -> bool {
    let expression = expression.replace('/', " OR ");
    let any = |group: &str| {
        group.trim_matches(['(', ')', ' ']).split(" OR ").any(|l| LICENCES.iter().any(|accepted| accepted == l.trim()))
    };
    match expression.contains('(') {
        true => expression.split(" AND ").all(any),
        false => expression.split(" OR ").any(|alternative| alternative.split(" AND ").all(any)),
    }
}

#[test]
fn alternatives_of_licences_are_told_apart() {
    for expression in ["MIT", "MIT/Apache-2.0", "GPL-3.0 OR MIT", "(MIT OR Apache-2.0) AND Unicode-3.0", "MIT AND ISC"]
    {
        assert!(is_accepted(expression), "{expression}");
    }
    for expression in ["", "GPL-3.0", "MIT AND GPL-3.0", "(MIT OR Apache-2.0) AND GPL-3.0", "LGPL-2.1-or-later"] {
        assert!(!is_accepted(expression), "{expression}");
    }
}

#[test]
fn crates_have_known_sources_and_licences_and_those_without_a_maintainer_a_reason() {
    let metadata = metadata();
    let mut names = BTreeMap::new();
    for package in list(&metadata, "packages") {
        let name = word(package, "name");
        names.insert(word(package, "id"), name);
        assert!(is_accepted(word(package, "license")), "{name}: licence {}", package["license"]);
        let source = package["source"].as_str();
        assert!(source.is_none_or(|s| s.ends_with("crates.io-index")), "{name}: source {source:?}");
    }
    for (name, accepted, reason) in UNMAINTAINED {
        let needs =
            |node: &&Value| list(node, "dependencies").iter().any(|d| names[d.as_str().expect("an id")] == name);
        let found: BTreeSet<&str> =
            list(&metadata["resolve"], "nodes").iter().filter(needs).map(|node| names[word(node, "id")]).collect();
        assert_eq!(found, accepted.iter().copied().collect(), "crates that need {name} ({reason})");
    }
}

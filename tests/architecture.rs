//! Rooms import from rooms below them, as docs/architecture.md says.

use std::collections::BTreeMap;
use std::path::Path;

/// What opens the chain of rooms in the document.
const FIRST: &str = "cli → ";

/// Rank of each room, the lowest 0; rooms of one rank do not import each other.
fn ranks(text: &str) -> BTreeMap<String, usize> {
    let chain = text.lines().find(|l| l.starts_with(FIRST)).expect("the document has a chain of rooms");
    let tiers: Vec<&str> = chain.split('→').collect();
    let of = |(k, tier): (usize, &&str)| -> Vec<(String, usize)> {
        tier.split(',').map(|room| (room.trim().to_string(), tiers.len() - 1 - k)).collect()
    };
    tiers.iter().enumerate().flat_map(of).collect()
}

fn visit(folder: &Path, found: &mut dyn FnMut(&Path)) {
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() { visit(&path, found) } else { found(&path) }
    }
}

/// Names that stand after `crate::` in code that is not a test's.
fn imports(text: &str) -> Vec<String> {
    let code = text.split("#[cfg(test)]\nmod tests").next().unwrap_or(text);
    let code: Vec<&str> = code.lines().filter(|l| !l.trim_start().starts_with("//")).collect();
    let mut names = Vec::new();
    for rest in code.join("\n").split("crate::").skip(1) {
        let group = rest.strip_prefix('{').and_then(|r| r.split_once('}')).map(|(inside, _)| inside);
        let one = rest.split(|c: char| !c.is_alphanumeric() && c != '_').next();
        let words = group.map_or(one.into_iter().collect(), |g| g.split(',').collect::<Vec<_>>());
        names.extend(words.iter().filter_map(|w| w.trim().split("::").next()).map(str::to_string));
    }
    names
}

#[test]
fn imports_run_downwards_only() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let document = std::fs::read_to_string(root.join("docs/architecture.md")).expect("the document");
    let ranks = ranks(&document);
    let mut looked_at = 0;
    visit(&root.join("src"), &mut |file| {
        let inside = file.strip_prefix(root.join("src")).expect("of the crate");
        let room = inside.iter().next().and_then(|c| c.to_str()).expect("UTF-8").trim_end_matches(".rs").to_string();
        if ["lib", "main"].contains(&room.as_str()) || file.extension().is_none_or(|e| e != "rs") {
            return;
        }
        let own = ranks.get(&room).unwrap_or_else(|| panic!("the document has no room {room}"));
        let text = std::fs::read_to_string(file).expect("read");
        for name in imports(&text).iter().filter(|n| **n != room) {
            if let Some(other) = ranks.get(name) {
                assert!(other < own, "{} imports {name}, which is not below {room}", inside.display());
                looked_at += 1;
            }
        }
    });
    assert!(looked_at > 100, "{looked_at} imports");
}

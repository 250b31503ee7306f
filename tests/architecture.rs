//! Module rules: modules of the program import only from lower ones, files of a crate have no circular imports, files and functions
//! are short. There are no exceptions.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Start of the line in docs/architecture.md that lists the modules from the highest to the lowest.
const FIRST_ROOM: &str = "cli → ";

/// Largest number of lines of a file, and of a function.
const FILE_LINES: usize = 600;
const FUNCTION_LINES: usize = 80;

/// Path of a module from the crate root.
type Module = Vec<String>;

/// A source file without tests and comments.
struct Source {
    /// Path relative to the repository.
    file: String,
    lines: usize,
    code: String,
    /// Absolute paths of imports, and whether they are re-exported. A glob ends in `*`.
    uses: Vec<(Module, bool)>,
}

struct Crate {
    sources: BTreeMap<Module, Source>,
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// The code above the unit tests, without comments.
fn without_tests(text: &str) -> String {
    let code = text.split("#[cfg(test)]\nmod tests").next().unwrap_or(text);
    let kept = code.lines().filter(|l| !l.trim_start().starts_with("//"));
    kept.map(|l| l.split(" // ").next().unwrap_or(l)).collect::<Vec<_>>().join("\n")
}

/// The paths of a use tree such as `a::{b, c::{d as e, self}, *}`.
fn expand(tree: &str, prefix: &[String], found: &mut Vec<Module>) {
    let tree = tree.trim();
    if let Some((head, inside)) = tree.split_once('{') {
        let mut prefix = prefix.to_vec();
        prefix.extend(head.split("::").map(str::trim).filter(|s| !s.is_empty()).map(str::to_string));
        let inside = &inside[..inside.rfind('}').expect("a closed group")];
        let (mut depth, mut start) = (0, 0);
        for (i, c) in inside.char_indices().chain([(inside.len(), ',')]) {
            match c {
                '{' => depth += 1,
                '}' => depth -= 1,
                ',' if depth == 0 => {
                    expand(&inside[start..i], &prefix, found);
                    start = (i + 1).min(inside.len());
                }
                _ => {}
            }
        }
    } else if !tree.is_empty() {
        let path = tree.split(" as ").next().expect("a path");
        let segments = path.split("::").map(str::trim).filter(|s| !s.is_empty() && *s != "self").map(str::to_string);
        let first_self = (path.starts_with("self::")).then(|| "self".to_string());
        found.push(prefix.iter().cloned().chain(first_self).chain(segments).collect());
    }
}

impl Source {
    /// Reads a file. `modules`: all modules of the crate.
    fn read(root: &Path, file: &str, module: &Module, modules: &BTreeSet<Module>) -> Self {
        let text = std::fs::read_to_string(root.join(file)).expect("read");
        let (mut code, mut uses) = (String::new(), Vec::new());
        let mut statement = String::new();
        for line in without_tests(&text).lines() {
            let trimmed = line.trim_start();
            let begins =
                ["use ", "pub use ", "pub(crate) use ", "pub(super) use "].iter().any(|s| trimmed.starts_with(s));
            if statement.is_empty() && !begins {
                code += line;
                code.push('\n');
                continue;
            }
            statement += trimmed;
            if trimmed.ends_with(';') {
                let (visibility, tree) = statement.split_once("use ").expect("a use statement");
                let mut paths = Vec::new();
                expand(tree.trim_end_matches(';'), &[], &mut paths);
                uses.extend(
                    paths.iter().filter_map(|p| Some((absolute(p, module, modules)?, visibility.starts_with("pub")))),
                );
                statement.clear();
            }
        }
        Source { file: file.to_string(), lines: text.lines().count(), code, uses }
    }
}

/// The path from the crate root of a path used in `module`; `None` for other crates and local names.
fn absolute(path: &[String], module: &Module, modules: &BTreeSet<Module>) -> Option<Module> {
    let mut base = module.clone();
    let mut rest = path;
    match rest.first()?.as_str() {
        "crate" => {
            base.clear();
            rest = &rest[1..];
        }
        "self" => rest = &rest[1..],
        "super" => {
            while rest.first().is_some_and(|s| s == "super") {
                base.pop();
                rest = &rest[1..];
            }
        }
        child => {
            base.push(child.to_string());
            if !modules.contains(&base) {
                return None;
            }
            rest = &rest[1..];
        }
    }
    base.extend_from_slice(rest);
    Some(base)
}

fn visit(folder: &Path, found: &mut dyn FnMut(&Path)) {
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() { visit(&path, found) } else { found(&path) }
    }
}

impl Crate {
    /// The crate in this folder of the repository.
    fn read(root: &Path, folder: &str) -> Self {
        let mut files = BTreeMap::new();
        let sources = root.join(folder).join("src");
        visit(&sources, &mut |path| {
            let inside = path.strip_prefix(&sources).expect("of the crate").with_extension("");
            let mut module: Module = inside.iter().map(|c| c.to_str().expect("UTF-8").to_string()).collect();
            if path.extension().is_none_or(|e| e != "rs") || module[0] == "main" {
                return;
            }
            if module.last().is_some_and(|m| m == "mod" || m == "lib") {
                module.pop();
            }
            files.insert(module, path.strip_prefix(root).expect("inside").to_str().expect("UTF-8").to_string());
        });
        let modules: BTreeSet<Module> = files.keys().cloned().collect();
        let read = |(module, file): (&Module, &String)| (module.clone(), Source::read(root, file, module, &modules));
        Crate { sources: files.iter().map(read).collect() }
    }

    /// The program and the crates it is made of.
    fn all(root: &Path) -> Vec<Self> {
        let of = |name: std::ffi::OsString| format!("crates/{}", name.to_str().expect("UTF-8"));
        let folders =
            std::fs::read_dir(root.join("crates")).expect("a folder").map(|e| of(e.expect("an entry").file_name()));
        folders.chain([".".to_string()]).map(|folder| Self::read(root, &folder)).collect()
    }

    /// The module that defines the item of an absolute path, following re-exports.
    fn definition(&self, path: &[String], depth: usize) -> Option<Module> {
        let length = (0..=path.len()).rev().find(|&n| self.sources.contains_key(&path[..n]))?;
        let (module, rest) = path.split_at(length);
        let Some(name) = rest.first() else { return Some(module.to_vec()) };
        let source = &self.sources[module];
        let follow = |(target, _): &&(Module, bool)| target.last() == Some(name) && target[..] != path[..];
        if depth > 0
            && let Some((target, _)) = source.uses.iter().find(follow)
            && let Some(found) = self.definition(target, depth - 1)
        {
            return Some(found);
        }
        let defines = |source: &Source| {
            ["fn", "struct", "enum", "trait", "type", "const", "static", "union"].iter().any(|kind| {
                source
                    .code
                    .match_indices(&format!("{kind} {name}"))
                    .any(|(i, m)| !source.code[i + m.len()..].starts_with(is_word))
            })
        };
        if !defines(source) {
            let globs = source.uses.iter().filter(|(t, _)| t.last().is_some_and(|l| l == "*"));
            let mut targets = globs.map(|(t, _)| &t[..t.len() - 1]);
            if let Some(found) = targets.find(|t| self.sources.get(*t).is_some_and(defines)) {
                return Some(found.to_vec());
            }
        }
        Some(module.to_vec())
    }

    /// Modules used by a module: imports that are not re-exported, and paths in its code.
    fn imports(&self, module: &Module) -> BTreeSet<Module> {
        let source = &self.sources[module];
        let modules: BTreeSet<Module> = self.sources.keys().cloned().collect();
        let mut paths: Vec<Module> = source.uses.iter().filter(|(_, again)| !again).map(|(p, _)| p.clone()).collect();
        for word in source.code.split(|c: char| !is_word(c) && c != ':').filter(|w| w.contains("::")) {
            let path: Module = word.split("::").filter(|s| !s.is_empty()).map(str::to_string).collect();
            if word.starts_with(is_word) {
                paths.extend(absolute(&path, module, &modules));
            }
        }
        paths.iter().filter_map(|p| self.definition(p, 8)).filter(|m| m != module).collect()
    }

    /// Groups of files with circular imports.
    fn circles(&self) -> BTreeSet<BTreeSet<Module>> {
        let imports: BTreeMap<&Module, BTreeSet<Module>> = self.sources.keys().map(|m| (m, self.imports(m))).collect();
        let reach = |from: &Module| {
            let (mut seen, mut open) = (BTreeSet::new(), vec![from.clone()]);
            while let Some(at) = open.pop() {
                for next in &imports[&at] {
                    if seen.insert(next.clone()) {
                        open.push(next.clone());
                    }
                }
            }
            seen
        };
        let reached: BTreeMap<&Module, BTreeSet<Module>> = self.sources.keys().map(|m| (m, reach(m))).collect();
        let circle = |m: &&Module| reached[*m].iter().filter(|o| reached[o].contains(*m)).cloned().collect();
        self.sources.keys().filter(|m| reached[m].contains(*m)).map(|m| circle(&m)).collect()
    }
}

/// Rank of each top-level module, the lowest 0; modules of equal rank do not import each other.
fn ranks(chain: &str) -> BTreeMap<String, usize> {
    let tiers: Vec<&str> = chain.split('→').collect();
    let of = |(k, tier): (usize, &&str)| -> Vec<(String, usize)> {
        tier.split(',').map(|room| (room.trim().to_string(), tiers.len() - 1 - k)).collect()
    };
    tiers.iter().enumerate().flat_map(of).collect()
}

fn repository() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn rooms_import_from_rooms_below_them() {
    let document = std::fs::read_to_string(repository().join("docs/architecture.md")).expect("the document");
    let chain = document.lines().find(|l| l.starts_with(FIRST_ROOM)).expect("the document has a chain of rooms");
    let ranks = ranks(chain);
    let sources = Crate::read(repository(), ".");
    let mut checked = 0;
    for (module, source) in sources.sources.iter().filter(|(m, _)| !m.is_empty()) {
        let own = ranks.get(&module[0]).unwrap_or_else(|| panic!("the chain has no room {}", module[0]));
        for other in sources.imports(module).iter().filter(|m| m.first().is_some_and(|room| *room != module[0])) {
            let rank = ranks.get(&other[0]).unwrap_or_else(|| panic!("the chain has no room {}", other[0]));
            assert!(rank < own, "{} imports {}, which is not below {}", source.file, other.join("::"), module[0]);
            checked += 1;
        }
    }
    assert!(checked > 100, "{checked} imports");
}

/// The solver is a library of its own: few packages, without flags, scenes and files of instruments.
#[test]
fn the_solver_needs_few_packages() {
    /// At most, without other versions of the same package.
    const PACKAGES: usize = 60;
    let tree = ["tree", "--locked", "--offline", "-p", "asperity-contact", "-e", "normal", "--prefix", "none"];
    let cargo =
        std::process::Command::new(env!("CARGO")).args(tree).current_dir(repository()).output().expect("started");
    assert!(cargo.status.success(), "{}", String::from_utf8_lossy(&cargo.stderr));
    let text = String::from_utf8(cargo.stdout).expect("UTF-8");
    let packages: BTreeSet<&str> = text.lines().filter_map(|l| l.split(' ').next()).collect();
    assert!(packages.contains("rustfft") && packages.len() <= PACKAGES, "{}: {packages:?}", packages.len());
    for other in ["clap", "schemars", "toml", "tempfile", "zip", "hdf5-reader", "asperity-atoms", "asperity"] {
        assert!(!packages.contains(other), "{other}");
    }
}

/// A `mod.rs` that re-exports its children is in no circle with them, unless it uses a child that uses items defined in
/// it.
#[test]
fn files_do_not_import_each_other_in_a_circle() {
    let edges = |sources: &Crate| -> Vec<String> {
        let circles = sources.circles();
        let between = |circle: &BTreeSet<Module>, m: &Module| -> Vec<String> {
            let others = sources.imports(m).into_iter().filter(|o| circle.contains(o));
            others.map(|o| format!("{} imports {}", sources.sources[m].file, sources.sources[&o].file)).collect()
        };
        circles.iter().flat_map(|circle| circle.iter().flat_map(|m| between(circle, m)).collect::<Vec<_>>()).collect()
    };
    let found: Vec<String> = Crate::all(repository()).iter().flat_map(edges).collect();
    assert!(found.is_empty(), "circles of imports:\n{}", found.join("\n"));
}

/// Name and number of lines of each function, from its signature to its closing brace.
fn functions(code: &str) -> Vec<(String, usize)> {
    let lines: Vec<&str> = code.lines().collect();
    let mut found = Vec::new();
    for (start, line) in lines.iter().enumerate() {
        let indent = line.len() - line.trim_start().len();
        let words = line.trim_start().split("fn ").collect::<Vec<_>>();
        let is_signature = words.len() > 1
            && words[0].split_whitespace().all(|w| w.starts_with("pub") || ["const", "unsafe", "async"].contains(&w));
        if !is_signature {
            continue;
        }
        let closing = format!("{}}}", " ".repeat(indent));
        if let Some(end) = lines[start..]
            .iter()
            .position(|l| *l == closing || l.ends_with(';') && l.len() - l.trim_start().len() == indent)
        {
            let name = words[1].split(|c| !is_word(c)).next().unwrap_or_default();
            found.push((name.to_string(), end + 1));
        }
    }
    found
}

#[test]
fn files_and_functions_are_short() {
    let crates = Crate::all(repository());
    let sources = || crates.iter().flat_map(|c| c.sources.values());
    let mut long: Vec<String> = Vec::new();
    let mut others = Vec::new();
    for folder in ["tests", "python"] {
        visit(&repository().join(folder), &mut |path| {
            if path.extension().is_some_and(|e| e == "rs" || e == "py") {
                let lines = std::fs::read_to_string(path).expect("read").lines().count();
                others.push((path.strip_prefix(repository()).expect("inside").display().to_string(), lines));
            }
        });
    }
    let files = sources().map(|s| (s.file.clone(), s.lines)).chain(others);
    long.extend(files.filter(|(_, n)| *n > FILE_LINES).map(|(f, n)| format!("{f}: {n} lines")));
    for source in sources() {
        let functions = functions(&source.code).into_iter().filter(|(_, n)| *n > FUNCTION_LINES);
        long.extend(functions.map(|(name, lines)| format!("{}: {name}: {lines} lines", source.file)));
    }
    assert!(
        long.is_empty(),
        "more than {FILE_LINES} lines in a file or {FUNCTION_LINES} in a function:\n{}",
        long.join("\n")
    );
}

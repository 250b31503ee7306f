use asperity::record::import::{self, Content, ImportOptions, ImportedFile};
use asperity::sys::peak_rss_bytes;
use asperity::{Error, Result};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use rayon::prelude::*;
use std::io::{Cursor, Read, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use zip::write::SimpleFileOptions;
use zip::{ZipArchive, ZipWriter};

/// Longest time that one damaged file may take, of [`ATTEMPTS`]: on a busy machine a thread may wait for seconds.
const LIMIT: Duration = Duration::from_secs(2);

const ATTEMPTS: usize = 3;

/// Largest resident memory of the program, bytes: the files of the fixtures have at most 24 kB, which deflate expands 1032-fold, and a map
/// is held a few times by each thread.
const MOST_MEMORY: u64 = 512 << 20;

/// Most changes in one file.
const MOST_CHANGES: usize = 8;

/// Read randomly damaged copies of surface files: each must end in a map or one error.
#[derive(clap::Args)]
pub(super) struct Damage {
    /// Damaged copies of each file.
    #[arg(long, default_value_t = 1000, value_name = "N")]
    inputs: u64,
    /// Files, or folders of files. Default: the fixtures of the tests.
    files: Vec<PathBuf>,
}

/// What became of the copies of one file.
struct Outcome {
    file: PathBuf,
    read: u64,
    refused: u64,
    slowest: Duration,
}

impl Damage {
    /// # Errors
    /// A copy that took longer than [`LIMIT`], whose message has several lines, or whose map has another number of heights than points, or
    /// extents that are not positive. A panic ends the program.
    pub(super) fn execute(self) -> Result<()> {
        let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures");
        let given = if self.files.is_empty() {
            vec![fixtures.clone(), fixtures.join("declared"), fixtures.join("surfaces")]
        } else {
            self.files.clone()
        };
        let mut files = Vec::new();
        for path in given {
            if path.is_dir() {
                let entries = std::fs::read_dir(&path).map_err(Error::io("read", &path))?;
                files.extend(entries.flatten().map(|e| e.path()).filter(|p| p.is_file()));
            } else {
                files.push(path);
            }
        }
        files.sort();
        files.retain(|f| !f.extension().is_some_and(|e| e == "py" || e == "json"));
        let outcomes: Vec<Outcome> = files.par_iter().map(|f| damaged(f, self.inputs)).collect::<Result<_>>()?;
        for o in &outcomes {
            let name = o.file.file_name().unwrap_or_default().to_string_lossy();
            println!(
                "{name:>24} {:>9} read {:>9} refused, slowest {:.3} s",
                o.read,
                o.refused,
                o.slowest.as_secs_f64()
            );
        }
        let all: u64 = outcomes.iter().map(|o| o.read + o.refused).sum();
        let peak = peak_rss_bytes();
        println!("{all} damaged copies of {} files, largest resident memory {} MiB", outcomes.len(), peak >> 20);
        if peak > MOST_MEMORY {
            let found = format!("{} MiB", peak >> 20);
            return Err(Error::input("damage", "memory", found, format!("{} MiB", MOST_MEMORY >> 20)));
        }
        Ok(())
    }
}

fn damaged(file: &Path, inputs: u64) -> Result<Outcome> {
    let whole = std::fs::read(file).map_err(Error::io("read", file))?;
    let scratch = tempfile::tempdir().map_err(Error::io("create", "a scratch folder"))?;
    let copy = scratch.path().join("copy");
    let mut outcome = Outcome { file: file.to_path_buf(), read: 0, refused: 0, slowest: Duration::ZERO };
    for seed in 0..inputs {
        let repacked = if seed % 2 == 1 { repacked(&whole, seed) } else { None };
        let bytes = repacked.unwrap_or_else(|| changed(&whole, seed));
        std::fs::write(&copy, bytes).map_err(Error::io("write", &copy))?;
        let wrong = |found: String, accepted: &str| Error::format(file, format!("seed {seed}: {found}"), accepted);
        let mut taken = Duration::MAX;
        let mut found = None;
        for _ in 0..ATTEMPTS {
            let begun = Instant::now();
            found = Some(import::read(&copy, ImportOptions::default()));
            taken = taken.min(begun.elapsed());
            if taken <= LIMIT {
                break;
            }
        }
        outcome.slowest = outcome.slowest.max(taken);
        if taken > LIMIT {
            return Err(wrong(format!("{taken:?}"), "an answer within 2 s"));
        }
        match found.expect("attempted") {
            Ok(found) if is_sound(&found) => outcome.read += 1,
            Ok(found) => return Err(wrong(found.layout, "as many heights as points, and positive extents")),
            Err(e) if e.to_string().lines().count() == 1 => outcome.refused += 1,
            Err(e) => return Err(wrong(e.to_string(), "an error of one line")),
        }
    }
    Ok(outcome)
}

fn is_sound(found: &ImportedFile) -> bool {
    let positive = |e: [f64; 2]| e.iter().all(|e| e.is_finite() && *e > 0.0);
    let whole = match &found.content {
        Content::Map(map) => map.heights.len() == map.nx * map.ny && !map.heights.iter().any(|h| h.is_infinite()),
        Content::Waves(_) => true,
    };
    whole && found.declared.extent.as_ref().is_none_or(|e| positive([e.x, e.y]))
}

/// An archive with a change inside of one of its files, without the list of checksums: the checksums of the archive would reveal
/// changes of its bytes. `None` for other files.
fn repacked(whole: &[u8], seed: u64) -> Option<Vec<u8>> {
    let mut archive = ZipArchive::new(Cursor::new(whole)).ok()?;
    let mut target = ZipWriter::new(Cursor::new(Vec::new()));
    let chosen = (seed / 2) as usize % archive.len();
    for i in 0..archive.len() {
        let mut entry = archive.by_index(i).ok()?;
        let name = entry.name().ok()?.into_owned();
        let mut content = Vec::new();
        entry.read_to_end(&mut content).ok()?;
        if i == chosen {
            content = changed(&content, seed);
        }
        if !name.ends_with(".hex") {
            target.start_file(name, SimpleFileOptions::default()).ok()?;
            target.write_all(&content).ok()?;
        }
    }
    Some(target.finish().ok()?.into_inner())
}

/// A copy with bytes replaced, bits flipped, a part removed or repeated, or the end cut off.
fn changed(whole: &[u8], seed: u64) -> Vec<u8> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut bytes = whole.to_vec();
    for _ in 0..random.random_range(1..=MOST_CHANGES) {
        if bytes.is_empty() {
            break;
        }
        let at = random.random_range(0..bytes.len());
        let end = random.random_range(at..bytes.len().min(at + 64)) + 1;
        match random.random_range(0..6) {
            0 => bytes[at] = random.random(),
            1 => bytes[at] ^= 1 << random.random_range(0..8),
            2 => bytes.truncate(at),
            3 => drop(bytes.drain(at..end)),
            4 => {
                let part = bytes[at..end].to_vec();
                bytes.splice(at..at, part);
            }
            _ => bytes[at..end].fill(if random.random() { 0xff } else { 0 }),
        }
    }
    bytes
}

use asperity::record::import::{self, ImportOptions};
use asperity::{Error, Result};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Longest time that one damaged file may take.
const LIMIT: Duration = Duration::from_secs(2);

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
    /// A copy that took longer than [`LIMIT`], or whose message has several lines. A panic ends the program.
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
        println!("{all} damaged copies of {} files", outcomes.len());
        Ok(())
    }
}

fn damaged(file: &Path, inputs: u64) -> Result<Outcome> {
    let whole = std::fs::read(file).map_err(Error::io("read", file))?;
    let scratch = tempfile::tempdir().map_err(Error::io("create", "a scratch folder"))?;
    let copy = scratch.path().join("copy");
    let mut outcome = Outcome { file: file.to_path_buf(), read: 0, refused: 0, slowest: Duration::ZERO };
    for seed in 0..inputs {
        std::fs::write(&copy, changed(&whole, seed)).map_err(Error::io("write", &copy))?;
        let begun = Instant::now();
        let found = import::read(&copy, ImportOptions::default());
        let taken = begun.elapsed();
        outcome.slowest = outcome.slowest.max(taken);
        match found {
            Ok(_) => outcome.read += 1,
            Err(e) if e.to_string().lines().count() == 1 && taken <= LIMIT => outcome.refused += 1,
            Err(e) => return Err(Error::format(file, format!("seed {seed}, {taken:?}: {e}"), "one line within 2 s")),
        }
        if taken > LIMIT {
            return Err(Error::format(file, format!("seed {seed} took {taken:?}"), "an answer within 2 s"));
        }
    }
    Ok(outcome)
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

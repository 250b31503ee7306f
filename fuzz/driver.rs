//! Random changes of valid inputs, read one after the other on one thread: a panic, a late answer or too much memory is
//! found. The program that runs this has [`PeakAlloc`] as its global allocator.

use super::targets::{Reading, Target};
use asperity::grid::sys;
use asperity::{Error, Result};
use peak_alloc::PeakAlloc;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use std::path::Path;
use std::time::Duration;

/// Most changes of one input.
const MOST_CHANGES: usize = 8;

/// Longest part that is removed, repeated or filled, bytes.
const LONGEST_PART: usize = 64;

/// Numbers that sizes and values are replaced by, as text and as binary numbers.
const NUMBERS: [&str; 14] = [
    "0",
    "-1",
    "1",
    "255",
    "65536",
    "4294967295",
    "9223372036854775807",
    "18446744073709551616",
    "1e308",
    "-1e-320",
    "nan",
    "inf",
    "0.5",
    "1e9",
];

/// A copy of `whole` with bytes replaced, bits flipped, parts removed, repeated, filled, taken from `other`, or the end
/// cut off; numbers of a text are replaced by others. The same seed gives the same copy.
fn changed(whole: &[u8], other: &[u8], seed: u64) -> Vec<u8> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut bytes = whole.to_vec();
    for _ in 0..random.random_range(1..=MOST_CHANGES) {
        if bytes.is_empty() {
            break;
        }
        // Half of the changes in the first bytes, where headers are.
        let within = if random.random() { bytes.len() } else { bytes.len().min(600) };
        let at = random.random_range(0..within);
        let end = random.random_range(at..bytes.len().min(at + LONGEST_PART)) + 1;
        match random.random_range(0..9) {
            0 => bytes[at] = random.random(),
            1 => bytes[at] ^= 1 << random.random_range(0..8),
            2 => bytes.truncate(at),
            3 => drop(bytes.drain(at..end)),
            4 => {
                let part = bytes[at..end].to_vec();
                bytes.splice(at..at, part);
            }
            5 => bytes[at..end].fill(if random.random() { 0xff } else { 0 }),
            6 if !other.is_empty() => {
                let from = random.random_range(0..other.len());
                let part = other[from..other.len().min(from + LONGEST_PART)].to_vec();
                bytes.splice(at..end, part);
            }
            7 => {
                let number: u64 = [0, 1, 0xff, 0x7fff_ffff, 0xffff_ffff, 1 << 40, u64::MAX][random.random_range(0..7)];
                let width = (1_usize << random.random_range(0..4)).min(bytes.len() - at);
                let big = random.random();
                let raw = if big { number.to_be_bytes() } else { number.to_le_bytes() };
                let part = if big { &raw[8 - width..] } else { &raw[..width] };
                bytes[at..at + width].copy_from_slice(part);
            }
            _ => {
                // The next number of a text.
                let digit = |b: &u8| b.is_ascii_digit() || matches!(b, b'.' | b'-' | b'e' | b'E' | b'+');
                let Some(start) = bytes[at..].iter().position(u8::is_ascii_digit).map(|k| at + k) else { continue };
                let length = bytes[start..].iter().take_while(|b| digit(b)).count();
                let number = NUMBERS[random.random_range(0..NUMBERS.len())];
                bytes.splice(start..start + length, number.bytes());
            }
        }
    }
    bytes
}

/// What became of the changed copies of a target's corpus.
pub(crate) struct Outcome {
    pub(crate) read: u64,
    pub(crate) refused: u64,
    pub(crate) slowest: Duration,
    /// Most bytes that a reader allocated.
    pub(crate) most_bytes: usize,
}

/// Reads the corpus of a target, and `inputs` changed copies with the seeds from `first` on, in turn of each file.
///
/// # Errors
/// The first input that takes more processor time than `limit`, more memory than the target allows, or has a message of several
/// lines; it is written to `failures`. A panic ends the program, which names the input's seed before.
pub(crate) fn run(
    target: &'static Target,
    first: u64,
    inputs: u64,
    limit: Duration,
    failures: &Path,
) -> Result<Outcome> {
    let corpus = target.corpus()?;
    let mut reading = Reading::new(target)?;
    let mut outcome = Outcome { read: 0, refused: 0, slowest: Duration::ZERO, most_bytes: 0 };
    let keep = |input: &[u8], seed: Option<u64>, what: String| {
        let file = failures.join(format!("{}-{}", target.name, seed.map_or("corpus".into(), |s| s.to_string())));
        std::fs::write(&file, input).map_err(Error::io("write", &file))?;
        Err(Error::format(file, what, "an answer in time and in proportion"))
    };
    let mut check = |input: &[u8], seed: Option<u64>| -> Result<()> {
        let _named = Named { target: target.name, seed };
        PeakAlloc.reset_peak_usage();
        let (before, begun) = (PeakAlloc.current_usage(), sys::cpu_seconds());
        let answer = reading.check(input);
        // Processor time: a busy machine pauses this process.
        let taken = Duration::from_secs_f64((sys::cpu_seconds() - begun).max(0.0));
        let bytes = PeakAlloc.peak_usage().saturating_sub(before);
        match answer {
            Err(e) => return keep(input, seed, e.to_string()),
            Ok(a) if taken > limit + a.delivery => return keep(input, seed, format!("an answer after {taken:?}")),
            Ok(a) if bytes > a.allowed_bytes => {
                return keep(input, seed, format!("{bytes} bytes for {}, {} allowed", input.len(), a.allowed_bytes));
            }
            Ok(a) if a.read => outcome.read += 1,
            Ok(_) => outcome.refused += 1,
        }
        outcome.slowest = outcome.slowest.max(taken);
        outcome.most_bytes = outcome.most_bytes.max(bytes);
        Ok(())
    };
    corpus.iter().try_for_each(|(_, whole)| check(whole, None))?;
    for seed in first..first + inputs {
        let of = |n: u64| &corpus[(n % corpus.len() as u64) as usize].1;
        check(&changed(of(seed), of(seed / 7), seed), Some(seed))?;
    }
    Ok(outcome)
}

/// Names the input while a panic unwinds.
struct Named {
    target: &'static str,
    seed: Option<u64>,
}

impl Drop for Named {
    fn drop(&mut self) {
        if std::thread::panicking() {
            eprintln!("panic: target {}, seed {:?}", self.target, self.seed);
        }
    }
}

//! Threads of a computation: those of a flag or an argument, those of the environment, or the cores that this process may use.

use crate::error::{Error, Result};

/// Largest number of threads: more than any machine that this program was run on has cores.
pub const MOST_THREADS: usize = 1024;

/// The variable that counts where no number is given.
const VARIABLE: &str = "RAYON_NUM_THREADS";

/// A pool of `given` threads, of `place` and `key` in errors; at 0 of `RAYON_NUM_THREADS` threads, and without that one for each core
/// that affinity and control groups leave to this process.
///
/// # Errors
/// `Input` for more than [`MOST_THREADS`], and a variable that is no number.
pub fn pool(place: &str, key: &str, given: usize) -> Result<rayon::ThreadPoolBuilder> {
    count(place, key, given, std::env::var_os(VARIABLE)).map(|n| rayon::ThreadPoolBuilder::new().num_threads(n))
}

/// The error of a pool whose threads cannot be started: each needs memory for its stack.
pub fn not_started(error: &rayon::ThreadPoolBuildError) -> Error {
    let how = "fewer threads, or more memory and threads for this process, are needed".to_string();
    Error::Program { program: "threads".to_string(), said: error.to_string(), how }
}

fn count(place: &str, key: &str, given: usize, variable: Option<std::ffi::OsString>) -> Result<usize> {
    let accepted = || format!("0 for all cores, or up to {MOST_THREADS}");
    let all = || std::thread::available_parallelism().map_or(1, |n| n.get().min(MOST_THREADS));
    match (given, variable.filter(|text| !text.is_empty())) {
        (0, None) => Ok(all()),
        (0, Some(text)) => match text.to_str().and_then(|text| text.trim().parse().ok()) {
            Some(0) => Ok(all()),
            Some(n @ 1..=MOST_THREADS) => Ok(n),
            _ => Err(Error::input("environment", VARIABLE, format!("{text:?}"), accepted())),
        },
        (1..=MOST_THREADS, _) => Ok(given),
        _ => Err(Error::input(place, key, given, accepted())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threads_are_those_of_argument_environment_or_cores_and_at_most_1024() {
        let of = |given, variable: Option<&str>| count("command line", "--threads", given, variable.map(Into::into));
        let cores = of(0, None).expect("cores");
        assert!((1..=MOST_THREADS).contains(&cores));
        for (given, variable, expected) in [
            (3, Some("7"), 3),
            (0, Some("7"), 7),
            (0, Some("0"), cores),
            (1024, None, 1024),
            (2, Some("many"), 2),
            (0, Some(""), cores),
        ] {
            assert_eq!(of(given, variable).expect("accepted"), expected, "{given} {variable:?}");
        }
        for (given, variable) in
            [(1025, None), (0, Some("1025")), (0, Some("100000")), (0, Some("many")), (0, Some("-1"))]
        {
            let text = of(given, variable).expect_err("refused").to_string();
            let key = if given == 0 { "environment: RAYON_NUM_THREADS" } else { "command line: --threads" };
            assert!(text.starts_with(key) && text.contains("up to 1024"), "{text}");
        }
    }
}

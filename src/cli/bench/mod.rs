mod methods;

use super::output;
use crate::error::Complaint;
use crate::grid::{Grid, Real, Transform};
use crate::interface::COHESIVE_RESOLUTION;
use crate::method;
use crate::report::number::{memory, percent, significant};
use crate::scene::ALL_METHODS;
use crate::sys;
use crate::{Error, Result};
use rayon::prelude::*;
use rustfft::num_complex::Complex;
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::process::{Command, ExitCode, Stdio};
use std::time::Instant;

/// Work of adhesion and range of the challenge, in E*L and L.
const GAMMA: f64 = 2e-5;
const RHO: f64 = 2.071e-5;

/// The surface that docs/performance.md was measured on.
const SEED: &str = "1";

/// Load of every solve, over E*.
const PRESSURE: &str = "0.01";

/// Pairs are repeated for this long before their mean is taken.
const PAIRS_FOR_SECONDS: f64 = 0.3;

const SMALLEST: usize = 64;
const LARGEST: usize = 65_536;

/// Times of transform pairs and of whole solves at p* = 0.01, without and with adhesion, in both precisions. Adhesion has the
/// challenge's work and, where a grid does not resolve the challenge's range, the shortest range that it resolves.
///
/// Each solve is `asperity solve --challenge N --seed 1` in a process of its own, so that its processor time and its peak memory are
/// nobody else's. What is compared runs in turns.
#[derive(Debug, clap::Args)]
#[command(allow_negative_numbers = true)]
pub struct Bench {
    /// Points per side.
    #[arg(long, value_name = "N,N,...", value_delimiter = ',', num_args = 1, default_values_t = [512, 1024, 2048])]
    sizes: Vec<usize>,
    /// Methods instead: time, planned and measured memory of each on the challenge's surface at p* = 0.01 without adhesion,
    /// and how the time grows with the points; ids from `asperity methods`, or all.
    #[arg(long, value_name = "ID,ID,...", value_delimiter = ',', num_args = 1)]
    methods: Vec<String>,
    /// With --methods: shortest wave of the surface over the cell.
    #[arg(long, value_name = "LAMBDA", default_value_t = 0.001, requires = "methods")]
    cut_off: f64,
    /// Rounds, of which medians are taken.
    #[arg(long, value_name = "N", default_value_t = 3)]
    repeats: usize,
    /// One line of JSON on stdout.
    #[arg(long)]
    json: bool,
}

/// Seconds on the clock, and of all processors together.
#[derive(Debug, Clone, Copy, Default)]
struct Time {
    wall: f64,
    cpu: f64,
}

/// What `solve --json` says that is of interest here.
#[derive(Debug, Clone, Deserialize)]
struct Solved {
    contact_fraction: f64,
    iterations: usize,
    fft_pairs: f64,
    seconds: f64,
    cpu_seconds: f64,
    planned_bytes: u64,
    peak_rss_bytes: u64,
    stop: String,
}

/// One transform pair: rows forward, columns forward and back, rows back.
#[derive(Debug, Serialize)]
struct PairLine {
    size: usize,
    precision: &'static str,
    threads: usize,
    seconds: f64,
    cpu_seconds: f64,
}

#[derive(Debug, Serialize)]
struct SolveLine {
    size: usize,
    precision: &'static str,
    /// Range of the adhesion, `None` without.
    rho: Option<f64>,
    contact_fraction: f64,
    iterations: usize,
    /// In pairs of the finest grid.
    fft_pairs: f64,
    /// One thread.
    cpu_seconds: f64,
    seconds: f64,
    /// All threads.
    seconds_all: Option<f64>,
    /// Time on one thread over that on all.
    speed_up: Option<f64>,
    /// Share of the processor time on one thread that as many transform pairs alone take: if all are as fast as f32 ones,
    /// and if all are as slow as ones of the state's precision. The linear problems are in f32 whatever the state is in.
    fft_share: [f64; 2],
    planned_bytes: u64,
    /// Of the process, one thread.
    peak_rss_bytes: u64,
    /// Why the solver stopped.
    stop: String,
}

impl Bench {
    fn check(&self) -> Result<()> {
        let accepted = format!("points per side from {SMALLEST} to {LARGEST}");
        let mut list: Vec<_> = (self.sizes.iter())
            .filter(|n| !(SMALLEST..=LARGEST).contains(*n))
            .map(|n| Complaint::new("--sizes", n, accepted.clone()))
            .collect();
        if self.repeats == 0 {
            list.push(Complaint::new("--repeats", self.repeats, "1 or more"));
        }
        let unknown = |id: &&String| *id != ALL_METHODS && method::find(id).is_none();
        list.extend(
            self.methods
                .iter()
                .filter(unknown)
                .map(|id| Complaint::new("--methods", id, format!("{ALL_METHODS}, {}", method::ids().join(", ")))),
        );
        if list.is_empty() { Ok(()) } else { Err(Error::Input { place: "command line".into(), list }) }
    }

    pub fn execute(self) -> Result<ExitCode> {
        self.check()?;
        if !self.methods.is_empty() {
            return methods::measure(&self);
        }
        let all = rayon::current_num_threads();
        let (mut pairs, mut solves) = (Vec::new(), Vec::new());
        for &n in &self.sizes {
            let have = sys::available_memory_bytes();
            let grid = Grid::unit(n, n);
            let need = Transform::<f64>::spectrum_bytes(grid) + 8 * grid.points() as u64;
            if need > have {
                let what = format!("a transform of {n} x {n} points");
                return Err(Error::Memory { what, need, have, advice: "smaller --sizes need less".into() });
            }
            if let Err(code) = self.size(n, all, &mut pairs, &mut solves)? {
                return Ok(code);
            }
        }
        if self.json {
            output::json_line(&json!({
                "version": env!("CARGO_PKG_VERSION"),
                "threads": all,
                "repeats": self.repeats,
                "pressure": 0.01,
                "gamma": GAMMA,
                "pairs": pairs,
                "solves": solves,
            }))?;
        } else {
            tell(&pairs, &solves, all);
        }
        Ok(ExitCode::SUCCESS)
    }

    /// All of one grid. The inner error is the exit code of a solve that failed and has said why.
    fn size(
        &self,
        n: usize,
        all: usize,
        pairs: &mut Vec<PairLine>,
        solves: &mut Vec<SolveLine>,
    ) -> Result<std::result::Result<(), ExitCode>> {
        let grid = Grid::unit(n, n);
        let counts: &[usize] = if all > 1 { &[1, all] } else { &[1] };
        // [precision][threads], a time per round.
        let mut times = [[(); 2]; 2].map(|p| p.map(|()| Vec::new()));
        // [adhesion][precision][threads]
        let mut solved = [[[(); 2]; 2]; 2].map(|a| a.map(|p| p.map(|()| Vec::new())));
        let rhos = [None, Some(range(grid.dx()))];
        for round in 1..=self.repeats {
            for (t, &threads) in counts.iter().enumerate() {
                eprintln!("{n}²: round {round} of {}, transforms, threads: {threads}", self.repeats);
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().map_err(|e| {
                    Error::input("command line", "--threads", threads, format!("a number of threads ({e})"))
                })?;
                times[0][t].push(pool.install(|| pair::<f32>(grid)));
                times[1][t].push(pool.install(|| pair::<f64>(grid)));
            }
            for (a, rho) in rhos.iter().enumerate() {
                for (p, precision) in ["f32", "f64"].into_iter().enumerate() {
                    for (t, &threads) in counts.iter().enumerate() {
                        let law = if rho.is_some() { "adhesive" } else { "without adhesion" };
                        eprintln!("{n}²: round {round} of {}, {precision} {law}, threads: {threads}", self.repeats);
                        match solve(n, precision, *rho, threads)? {
                            Ok(s) => solved[a][p][t].push(s),
                            Err(code) => return Ok(Err(code)),
                        }
                    }
                }
            }
        }
        let pair_cpu = [0, 1].map(|p: usize| median(times[p][0].iter().map(|t| t.cpu)));
        for (p, precision) in ["f32", "f64"].into_iter().enumerate() {
            pairs.extend(counts.iter().zip(&times[p]).map(|(&threads, times)| PairLine {
                size: n,
                precision,
                threads,
                seconds: median(times.iter().map(|t| t.wall)),
                cpu_seconds: median(times.iter().map(|t| t.cpu)),
            }));
        }
        for (rho, solved) in rhos.into_iter().zip(&solved) {
            for (p, precision) in ["f32", "f64"].into_iter().enumerate() {
                let [single, many] = &solved[p];
                let first = &single[0];
                let cpu_seconds = median(single.iter().map(|s| s.cpu_seconds));
                let seconds = median(single.iter().map(|s| s.seconds));
                let seconds_all = (all > 1).then(|| median(many.iter().map(|s| s.seconds)));
                solves.push(SolveLine {
                    size: n,
                    precision,
                    rho,
                    contact_fraction: first.contact_fraction,
                    iterations: first.iterations,
                    fft_pairs: first.fft_pairs,
                    cpu_seconds,
                    seconds,
                    seconds_all,
                    speed_up: seconds_all.map(|s| seconds / s),
                    fft_share: [pair_cpu[0], pair_cpu[p]].map(|pair| first.fft_pairs * pair / cpu_seconds),
                    planned_bytes: first.planned_bytes,
                    peak_rss_bytes: single.iter().map(|s| s.peak_rss_bytes).max().unwrap_or(0),
                    stop: first.stop.clone(),
                });
            }
        }
        Ok(Ok(()))
    }
}

/// Range of the adhesion on a grid of spacing `dx`: the challenge's, or the shortest one that the grid resolves.
fn range(dx: f64) -> f64 {
    // A trace more, so that rounding does not put it below what is warned of.
    RHO.max(COHESIVE_RESOLUTION * (GAMMA * dx).sqrt() * (1.0 + 1e-9))
}

/// Mean time of a pair on the current pool.
fn pair<T: Real>(grid: Grid) -> Time {
    let transform = Transform::<T>::new(grid);
    let mut field: Vec<T> = (0..grid.points()).map(|i| T::of(((i * 7) % 101) as f64 / 50.0 - 1.0)).collect();
    let mut spectrum = transform.spectrum();
    let (nx, pitch, scale) = (grid.nx, grid.pitch(), T::of(1.0 / grid.points() as f64));
    let mut once = || {
        spectrum.par_chunks_mut(pitch).zip(field.par_chunks(nx)).for_each_init(
            || transform.worker(),
            |worker, (spectrum, row)| {
                worker.row.copy_from_slice(row);
                worker.forward(spectrum);
            },
        );
        transform.filter_columns(&mut spectrum, &|_: usize, _: &mut [Complex<T>]| 0.0);
        spectrum.par_chunks_mut(pitch).zip(field.par_chunks_mut(nx)).for_each_init(
            || transform.worker(),
            |worker, (spectrum, row)| {
                worker.inverse(spectrum);
                row.iter_mut().zip(&worker.row).for_each(|(to, from)| *to = *from * scale);
            },
        );
    };
    // The first touches the memory.
    once();
    let (clock, cpu) = (Instant::now(), sys::cpu_seconds());
    let mut count = 0.0;
    while clock.elapsed().as_secs_f64() < PAIRS_FOR_SECONDS {
        once();
        count += 1.0;
    }
    Time { wall: clock.elapsed().as_secs_f64() / count, cpu: (sys::cpu_seconds() - cpu) / count }
}

/// One solve in a process of its own. The inner error is its exit code; why, it has said on stderr.
fn solve(n: usize, precision: &str, rho: Option<f64>, threads: usize) -> Result<std::result::Result<Solved, ExitCode>> {
    let program = std::env::current_exe().map_err(Error::io("find", "the program itself"))?;
    let mut command = Command::new(&program);
    command.args(["solve", "--challenge", &n.to_string(), "--seed", SEED, "--pressure", PRESSURE]);
    command.args(["--precision", precision]);
    command.args(["--json", "--threads", &threads.to_string()]);
    if let Some(rho) = rho {
        command.args(["--gamma", &GAMMA.to_string(), "--rho", &rho.to_string()]);
    }
    command.stdin(Stdio::null()).stderr(Stdio::inherit());
    sys::die_with_parent(&mut command);
    let output = command.output().map_err(Error::io("start", &program))?;
    // One that stopped short of its tolerance (3) has told its numbers all the same: f32 on large grids may.
    if !matches!(output.status.code(), Some(0 | 3)) {
        return Ok(Err(ExitCode::from(output.status.code().and_then(|c| u8::try_from(c).ok()).unwrap_or(1))));
    }
    serde_json::from_slice(&output.stdout).map(Ok).map_err(|e| Error::format(&program, e, "the JSON of a solve"))
}

/// Of an even number, the mean of the middle two.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    match sorted.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => sorted[middle],
        _ => 0.5 * (sorted[middle - 1] + sorted[middle]),
    }
}

fn tell(pairs: &[PairLine], solves: &[SolveLine], all: usize) {
    output::print("transform pairs");
    output::print(&output::table(
        &["points", "precision", "threads", "wall / ms", "CPU / ms"],
        pairs.iter().map(|p| {
            let ms = |s: f64| significant(1e3 * s, 3);
            vec![format!("{}²", p.size), p.precision.into(), p.threads.to_string(), ms(p.seconds), ms(p.cpu_seconds)]
        }),
    ));
    output::print(&format!(
        "\nsolves of the challenge's surface at p* = {PRESSURE}: CPU and wall time of one thread, wall time of {all}"
    ));
    let optional = |v: Option<f64>, n: usize| v.map_or("-".into(), |v| significant(v, n));
    output::print(&output::table(
        &[
            "points",
            "precision",
            "ρ / L",
            "contact",
            "FFT pairs",
            "CPU / s",
            "wall / s",
            "wall, all / s",
            "speed-up",
            "share of FFT",
            "plan",
            "peak memory",
            "stop",
        ],
        solves.iter().map(|s| {
            // On grids that fit into the cache f32 is not always the faster one.
            let [a, b] = s.fft_share;
            let [low, high] = [a.min(b), a.max(b)].map(percent);
            vec![
                format!("{}²", s.size),
                s.precision.into(),
                optional(s.rho, 3),
                percent(s.contact_fraction),
                format!("{:.1}", s.fft_pairs),
                significant(s.cpu_seconds, 3),
                significant(s.seconds, 3),
                optional(s.seconds_all, 3),
                optional(s.speed_up, 3),
                if low == high { low } else { format!("{low} to {high}") },
                memory(s.planned_bytes),
                memory(s.peak_rss_bytes),
                s.stop.clone(),
            ]
        }),
    ));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(sizes: Vec<usize>, repeats: usize) -> Bench {
        Bench { sizes, repeats, methods: Vec::new(), cut_off: 0.001, json: true }
    }

    #[test]
    fn bad_arguments_are_told_together() {
        let refused = asked(vec![512, 0, 63, 65_537], 0).check().unwrap_err();
        assert_eq!(refused.exit_code(), 2);
        let said = refused.to_string();
        for line in ["--sizes = 0;", "--sizes = 63;", "--sizes = 65537;", "--repeats = 0; accepted: 1 or more"] {
            assert!(said.contains(line), "{said}");
        }
        assert!(!said.contains("512;"), "{said}");
        assert!(asked(vec![64, 65_536], 1).check().is_ok());
    }

    /// The challenge's own range from the grid on that resolves it, which is between 91 000 and 92 000 points per side.
    #[test]
    fn every_grid_resolves_its_range() {
        for n in [64.0, 4096.0, 65_536.0, 91_000.0] {
            let rho = range(1.0 / n);
            assert!(rho > RHO && rho / (GAMMA / n).sqrt() >= COHESIVE_RESOLUTION, "{n}: {rho}");
        }
        assert_eq!(range(1.0 / 92_000.0), RHO);
    }

    #[test]
    fn medians() {
        assert_eq!(median([3.0, 1.0, 2.0].into_iter()), 2.0);
        assert_eq!(median([4.0, 1.0, 2.0, 3.0].into_iter()), 2.5);
    }
}

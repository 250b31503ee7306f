use super::{PRESSURE, median, solve};
use asperity::cli::output::{print, table};
use asperity::contact::interface::COHESIVE_RESOLUTION;
use asperity::grid::sys;
use asperity::grid::{Grid, Real, Transform};
use asperity::report::number::{memory, percent, significant};
use asperity::{Error, Result};
use rayon::prelude::*;
use rustfft::num_complex::Complex;
use serde::Deserialize;
use std::time::Instant;

/// Work of adhesion and range of the challenge, in E*L and L.
const GAMMA: f64 = 2e-5;
const RHO: f64 = 2.071e-5;

/// Pairs are repeated for this long before their mean is taken, s.
const PAIRS_FOR_SECONDS: f64 = 0.3;

const PRECISIONS: [&str; 2] = ["f32", "f64"];

/// Time transform pairs and whole solves, without and with adhesion, in both precisions.
///
/// Adhesion has the challenge's work and, where a grid does not resolve the challenge's range, the shortest range that
/// it resolves. Settings that are compared run alternately.
#[derive(clap::Args)]
pub(super) struct Times {
    /// Points per side, powers of two.
    #[arg(long, value_name = "N,N,...", value_delimiter = ',', default_values_t = [512, 1024, 2048])]
    sizes: Vec<usize>,
    /// Rounds, of which medians are taken.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u16).range(1..))]
    repeats: u16,
}

/// Wall time, and processor time of all threads together, s.
#[derive(Clone, Copy)]
struct Time {
    wall: f64,
    cpu: f64,
}

/// Output of `solve --json`.
#[derive(Deserialize)]
struct Solved {
    contact_area: f64,
    fft_pairs: f64,
    seconds: f64,
    cpu_seconds: f64,
    planned_bytes: u64,
    peak_rss_bytes: u64,
    stop: String,
}

/// Measurements of one precision.
#[derive(Default)]
struct Measured {
    /// By number of threads: one, all.
    pairs: [Vec<Time>; 2],
    /// Without and with adhesion, by number of threads.
    solves: [[Vec<Solved>; 2]; 2],
}

impl Times {
    pub(super) fn execute(self) -> Result<()> {
        let (mut pairs, mut solves) = (Vec::new(), Vec::new());
        for &n in &self.sizes {
            let rhos = [None, Some(range(1.0 / n as f64))];
            let found = self.measure(n, rhos)?;
            let pair_cpu = [0, 1].map(|p: usize| median(found[p].pairs[0].iter().map(|t| t.cpu)));
            for (p, (precision, of)) in PRECISIONS.into_iter().zip(&found).enumerate() {
                let named = |cells: Vec<String>| [vec![format!("{n}²"), precision.into()], cells].concat();
                pairs.extend(counts().iter().zip(&of.pairs).map(|(threads, times)| {
                    let ms = |of: fn(&Time) -> f64| significant(1e3 * median(times.iter().map(of)), 3);
                    named(vec![threads.to_string(), ms(|t| t.wall), ms(|t| t.cpu)])
                }));
                for (rho, solved) in rhos.into_iter().zip(&of.solves) {
                    // If all transforms are as fast as f32 ones, and if all are as slow as those of the state's
                    // precision: the linear problems are in f32 in either case.
                    solves.push(named(cells(rho, solved, [pair_cpu[0], pair_cpu[p]])));
                }
            }
        }
        print("transform pairs");
        print(&table(&["points", "precision", "threads", "wall / ms", "CPU / ms"], pairs));
        let all = rayon::current_num_threads();
        print(&format!("\nsolves of the challenge's surface at p = {PRESSURE} E*, on one thread and on {all}"));
        let head = ["points", "precision", "ρ / L", "contact", "FFT pairs", "CPU / s", "wall / s", "wall, all / s"];
        let more = ["speed-up", "fraction in FFT", "planned", "peak memory", "stop"];
        print(&table(&[&head[..], &more].concat(), solves));
        Ok(())
    }

    /// All settings of one grid, by precision.
    fn measure(&self, n: usize, rhos: [Option<f64>; 2]) -> Result<[Measured; 2]> {
        let mut found = [Measured::default(), Measured::default()];
        for round in 1..=self.repeats {
            eprintln!("{n}²: round {round} of {}", self.repeats);
            for (t, &threads) in counts().iter().enumerate() {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
                let pool = pool.map_err(|e| Error::input("threads", "number", threads, e.to_string()))?;
                found[0].pairs[t].push(pool.install(|| pair::<f32>(Grid::unit(n, n))));
                found[1].pairs[t].push(pool.install(|| pair::<f64>(Grid::unit(n, n))));
            }
            for (a, rho) in rhos.iter().enumerate() {
                let law = rho.map(|r| (GAMMA.to_string(), r.to_string()));
                let law: Vec<&str> = law.iter().flat_map(|(g, r)| ["--gamma", g.as_str(), "--rho", r]).collect();
                for (precision, found) in PRECISIONS.into_iter().zip(&mut found) {
                    for (t, &threads) in counts().iter().enumerate() {
                        let flags = [&["--precision", precision], &law[..]].concat();
                        found.solves[a][t].extend(solve::<Solved>(n, &flags, threads)?);
                    }
                }
            }
        }
        Ok(found)
    }
}

/// Numbers of threads.
fn counts() -> Vec<usize> {
    let all = rayon::current_num_threads();
    if all > 1 { vec![1, all] } else { vec![1] }
}

/// Cells of a row of the solves. `pair_cpu`: processor time of a transform pair, lowest and highest.
fn cells(rho: Option<f64>, [single, all]: &[Vec<Solved>; 2], pair_cpu: [f64; 2]) -> Vec<String> {
    let rho = rho.map_or("-".into(), |r| significant(r, 3));
    let Some(first) = single.first() else { return vec![rho, "failed".into()] };
    let seconds = median(single.iter().map(|s| s.seconds));
    let cpu_seconds = median(single.iter().map(|s| s.cpu_seconds));
    let seconds_all = (!all.is_empty()).then(|| median(all.iter().map(|s| s.seconds)));
    // On grids that fit into the cache, f32 is not always the faster one.
    let [a, b] = pair_cpu.map(|pair| first.fft_pairs * pair / cpu_seconds);
    let [low, high] = [a.min(b), a.max(b)].map(percent);
    let optional = |v: Option<f64>| v.map_or("-".into(), |v| significant(v, 3));
    vec![
        rho,
        percent(first.contact_area),
        format!("{:.1}", first.fft_pairs),
        significant(cpu_seconds, 3),
        significant(seconds, 3),
        optional(seconds_all),
        optional(seconds_all.map(|s| seconds / s)),
        if low == high { low } else { format!("{low} to {high}") },
        memory(first.planned_bytes),
        memory(single.iter().map(|s| s.peak_rss_bytes).max().unwrap_or(0)),
        first.stop.clone(),
    ]
}

/// Range of the adhesion on a grid of spacing `dx`: the challenge's, or the shortest one that the grid resolves.
fn range(dx: f64) -> f64 {
    // Slightly longer, so that rounding does not put it below the limit of the warning.
    RHO.max(COHESIVE_RESOLUTION * (GAMMA * dx).sqrt() * (1.0 + 1e-9))
}

/// Mean time of a pair on the current pool: rows forward, columns forward and back, rows back.
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
    // The first one allocates the memory.
    once();
    let (clock, cpu) = (Instant::now(), sys::cpu_seconds());
    let mut count = 0.0;
    while clock.elapsed().as_secs_f64() < PAIRS_FOR_SECONDS {
        once();
        count += 1.0;
    }
    Time { wall: clock.elapsed().as_secs_f64() / count, cpu: (sys::cpu_seconds() - cpu) / count }
}

#[cfg(test)]
mod tests {
    use super::*;

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
    fn transforms_and_solves_are_timed() {
        const N: usize = 64;
        let times = Times { sizes: vec![N], repeats: 1 };
        let threads = counts().len();
        for found in times.measure(N, [None, Some(range(1.0 / N as f64))]).expect("measured") {
            assert!(found.pairs.iter().flatten().all(|t| t.wall > 0.0 && t.cpu > 0.0));
            assert_eq!(found.pairs.iter().flatten().count(), threads);
            let solves: Vec<&Solved> = found.solves.iter().flatten().flatten().collect();
            assert_eq!(solves.len(), 2 * threads, "without and with adhesion");
            assert!(solves.iter().all(|s| s.fft_pairs > 1.0 && s.peak_rss_bytes > 1_000_000));
            let row = cells(None, &found.solves[0], [0.5, 0.25]);
            assert!(row.len() == 11 && row[7].contains(" to "), "{row:?}");
        }
    }
}

//! Adhesive contact against closed forms: Johnson's wave, the sphere of Johnson, Kendall & Roberts and of Maugis, Kendall's
//! flat punch. Under loads that rise and fall: with adhesion it is the path that says where a contact jumps.

use asperity::grid::Grid;
use asperity::interface::{Adhesion, Elastic, Wall};
use asperity::method::{self, Goals, Load, Precision, Problem, Run, State, Stop, unwatched};
use asperity::observe::contact_area;
use std::f64::consts::PI;

fn problem(grid: Grid, heights: &[f64]) -> Problem<'_> {
    Problem {
        grid,
        heights: heights.into(),
        kernel: Elastic::HalfSpace,
        adhesion: Adhesion::None,
        wall: Wall::Hard,
        precision: Precision::F64,
        tolerance: 1e-7,
        goals: Goals::default(),
        max_iterations: 5_000,
    }
}

fn start<'p>(problem: &'p Problem<'p>, id: &str) -> Box<dyn Run + 'p> {
    method::find(id).unwrap().start(problem, &unwatched).unwrap()
}

/// A load of the path that must have its equilibrium.
fn hold<R>(run: &mut dyn Run, load: Load, look: impl FnOnce(&State) -> R) -> R {
    let state = run.equilibrate(load).unwrap();
    assert_eq!(state.stop, Stop::Converged, "{load:?}: residual {}", state.residual);
    look(&state)
}

/// Johnson's adhesive wave h = A cos(2πx) (Int. J. Solids Struct. 32 (1995) 423), pressures over p_fc = π E* A/λ and
/// lengths over A: with contact half-width a and s = sin²(πa), p = s - α (s/(1 - s))^(1/4) and a mean gap of
/// 1 - s + p ln s.
#[derive(Clone, Copy)]
struct Wave {
    alpha: f64,
}

impl Wave {
    const AMPLITUDE: f64 = 0.01;

    /// Pressure and mean gap where a share of the cell touches.
    fn at(self, fraction: f64) -> (f64, f64) {
        let s = (0.5 * PI * fraction).sin().powi(2);
        let p = s - self.alpha * (s / (1.0 - s)).powf(0.25);
        (p, 1.0 - s + p * s.ln())
    }

    /// Pressures beyond which there is no equilibrium: pull-off and jump to full contact.
    fn jumps(self) -> (f64, f64) {
        let curve: Vec<f64> = (1..10_000).map(|k| self.at(f64::from(k) * 1e-4).0).collect();
        let highest = curve.iter().copied().fold(f64::MIN, f64::max);
        let before = curve.iter().position(|&p| p == highest).unwrap();
        (curve[..before].iter().copied().fold(f64::MAX, f64::min), highest)
    }

    fn work(self) -> f64 {
        0.5 * (self.alpha * PI * Self::AMPLITUDE).powi(2)
    }

    fn grid(n: usize) -> Grid {
        Grid { nx: n, ny: 1, lx: 1.0, ly: 1.0 / n as f64 }
    }

    fn heights(n: usize) -> Vec<f64> {
        (0..n).map(|i| Self::AMPLITUDE * (2.0 * PI * i as f64 / n as f64).cos()).collect()
    }

    /// Exponential attraction of cohesive resolution `c` on the grid.
    fn problem(self, heights: &[f64], c: f64) -> Problem<'_> {
        let range = c * (self.work() / heights.len() as f64).sqrt();
        let adhesion = Adhesion::exponential(self.work(), range);
        Problem { adhesion, ..problem(Self::grid(heights.len()), heights) }
    }

    fn pressure(p: f64) -> Load {
        Load::Pressure(p * PI * Self::AMPLITUDE)
    }

    fn fraction(state: &State) -> f64 {
        contact_area(Self::grid(state.gap.len()), state.gap, 0.0).fraction
    }
}

/// The closed form's own jumps, as the paper's curves give them.
#[test]
fn johnsons_jumps() {
    /// Half a unit of the last digit given.
    const PRINTED: f64 = 6e-5;
    for (alpha, jump, pull) in [
        (0.1, 0.7414, -0.0220),
        (0.2, 0.5537, -0.0556),
        (0.3, 0.3877, -0.0959),
        (0.4, 0.2356, -0.1416),
        (0.5, 0.0939, -0.1919),
    ] {
        let (off, full) = Wave { alpha }.jumps();
        assert!((off - pull).abs() < PRINTED && (full - jump).abs() < PRINTED, "α = {alpha}: {off} {full}");
    }
}

#[test]
fn johnsons_curve() {
    for alpha in [0.2, 0.4] {
        let wave = Wave { alpha };
        for (n, c) in [(256, 1.4), (1024, 1.4), (1024, 2.0), (4096, 2.0), (4096, 4.0)] {
            let heights = Wave::heights(n);
            let problem = wave.problem(&heights, c);
            let mut run = start(&problem, "fast");
            let t = std::time::Instant::now();
            let found: Vec<_> = [0.7, 0.6, 0.5, 0.4, 0.3, 0.2]
                .map(|fraction| {
                    let (p, gap) = wave.at(fraction);
                    hold(&mut *run, Load::MeanGap(gap * Wave::AMPLITUDE), |s| {
                        (s.pressure / (PI * Wave::AMPLITUDE) - p, Wave::fraction(s) - fraction)
                    })
                })
                .into();
            let mut least = 0f64;
            for k in 0..16 {
                let (_, gap) = wave.at(0.23 - 0.01 * f64::from(k));
                least = least.min(hold(&mut *run, Load::MeanGap(gap * Wave::AMPLITUDE), |s| {
                    s.pressure / (PI * Wave::AMPLITUDE)
                }));
            }
            println!("alpha {alpha} n {n} c {c} {found:.4?} least {least:.5} {:?} {:?}", wave.jumps(), t.elapsed());
        }
    }
}

#[test]
fn johnsons_loads() {
    for alpha in [0.2, 0.4] {
        let wave = Wave { alpha };
        let (off, jump) = wave.jumps();
        for (n, c) in [(512, 1.4), (512, 2.0), (2048, 2.8), (2048, 4.0)] {
            let heights = Wave::heights(n);
            let problem = wave.problem(&heights, c);
            let t = std::time::Instant::now();
            let mut run = start(&problem, "fast");
            let mut found = vec![];
            for x in [
                -0.2, -0.1, -0.05, -0.03, -0.02, -0.015, -0.01, -0.007, -0.005, -0.003, 0.0, 0.003, 0.005, 0.007, 0.01,
                0.015, 0.02, 0.03, 0.05,
            ] {
                let f = hold(&mut *run, Wave::pressure(jump + x), Wave::fraction);
                found.push((x, f));
                if f == 1.0 {
                    break;
                }
            }
            let up = format!("{:?}", &found[found.len() - 2..]);
            let mut run = start(&problem, "fast");
            hold(&mut *run, Wave::pressure(0.0), |_| ());
            hold(&mut *run, Wave::pressure(off * 0.5), |_| ());
            hold(&mut *run, Wave::pressure(off * 0.8), |_| ());
            hold(&mut *run, Wave::pressure(off * 0.9), |_| ());
            let mut x = 0.95;
            let down = loop {
                let s = run.equilibrate(Wave::pressure(off * x)).unwrap();
                if s.stop != Stop::Converged {
                    break format!("{} {} it {}", s.stop, x, s.iterations);
                }
                x += 0.005;
            };
            println!("alpha {alpha} n {n} c {c} up {up} down {down} {:?}", t.elapsed());
        }
    }
}

#[test]
fn a_load_path_stays_on_its_branch() {
    for (id, alpha, n, c, steps) in [
        ("fast", 0.2, 512, 2.0, [0.02, 0.011]),
        ("fast", 0.4, 512, 1.4, [0.02, 0.011]),
        ("fast", 0.4, 1024, 2.0, [0.02, 0.005]),
        ("bvm", 0.2, 512, 2.0, [0.02, 0.02]),
        ("bvm", 0.4, 1024, 2.0, [0.02, 0.005]),
    ] {
        let wave = Wave { alpha };
        let (_, jump) = wave.jumps();
        let heights = Wave::heights(n);
        let problem = wave.problem(&heights, c);
        for step in steps {
            let t = std::time::Instant::now();
            let mut run = start(&problem, id);
            let mut load = jump - 0.24;
            while hold(&mut *run, Wave::pressure(load), Wave::fraction) < 1.0 {
                load += step;
            }
            println!("{id} {alpha} {n} {c} {step}: {} {:?}", load - jump, t.elapsed());
        }
    }
}

/// The paraboloid r²/2R with R = 1.
fn paraboloid(n: usize) -> Vec<f64> {
    let offset = |i: usize| i as f64 / n as f64 - 0.5;
    (0..n * n).map(|i| 0.5 * (offset(i % n).powi(2) + offset(i / n).powi(2))).collect()
}

/// Images flatten a sphere under a force (compression positive): 1/R_eff = 1/R + 9.03362 F/(2π E* L³).
fn flattened(force: f64) -> f64 {
    1.0 / (1.0 + 9.03362 * force / (2.0 * PI))
}

#[test]
fn jkr() {
    let s = 0.1f64;
    let gamma = s.powi(3);
    for (n, c) in [(128usize, 1.4), (256, 1.4), (256, 2.0), (512, 1.4), (512, 2.0)] {
        let grid = Grid::unit(n, n);
        let heights = paraboloid(n);
        let plane = heights.iter().sum::<f64>() / heights.len() as f64;
        let range = c * (gamma / n as f64).sqrt();
        let p = Problem { adhesion: Adhesion::exponential(gamma, range), tolerance: 1e-6, ..problem(grid, &heights) };
        let t = std::time::Instant::now();
        let mut run = start(&p, "fast");
        let radius = |s: &State| (contact_area(grid, s.gap, 0.0).corrected / PI).sqrt();
        let zero = hold(&mut *run, Load::Pressure(0.0), radius) / s;
        let mut run = start(&p, "fast");
        let curve: Vec<_> = (0..8)
            .map(|k| {
                let gap = plane + s * s * (-0.1 + 0.07 * k as f64);
                hold(&mut *run, Load::MeanGap(gap), |st| {
                    (st.pressure / (PI * gamma * flattened(st.pressure)), radius(st) / s)
                })
            })
            .collect();
        println!(
            "n {n} c {c} mu {:.3} zero load {zero:.4} {curve:.4?} {:?}",
            gamma.powf(2.0 / 3.0) / range,
            t.elapsed()
        );
    }
}

#[test]
fn kendalls_punch() {
    let a = 0.2f64;
    let gamma = 1e-4f64;
    for depth in [0.02, 0.1, 1.0] {
        for (n, c) in [(320usize, 1.4), (320, 2.0), (1280, 1.4), (1280, 2.8), (5120, 1.4)] {
            let grid = Grid { nx: n, ny: 1, lx: 1.0, ly: 1.0 / n as f64 };
            let half = (a * n as f64).round() as usize;
            let heights: Vec<f64> = (0..n).map(|i| if i < half || i >= n - half { 0.0 } else { depth }).collect();
            let rho = c * (gamma / n as f64).sqrt();
            let p = Problem { adhesion: Adhesion::exponential(gamma, rho), ..problem(grid, &heights) };
            let exact = (2.0 * gamma * (PI * a).tan()).sqrt();
            let t = std::time::Instant::now();
            let mut run = start(&p, "fast");
            let mut x = 0.205;
            let end = loop {
                let s = run.equilibrate(Load::Pressure(-x * exact)).unwrap();
                let f = contact_area(grid, s.gap, 0.0).fraction;
                if s.stop != Stop::Converged || f < 0.1 {
                    break format!("{} {f} at {x:.3} res {:.1e} it {}", s.stop, s.residual, s.iterations);
                }
                x += if x < 0.8 { 0.1 } else { 0.01 };
            };
            println!(
                "depth {depth} n {n} c {c} bound stress {:.2}: {end} {:?}",
                2.0 * a * gamma / rho / exact,
                t.elapsed()
            );
        }
    }
}

//! Methods that know a surface by its statistics, and one that knows its long waves: against closed forms, against a solver
//! and against what the challenge paper says of them.

use asperity::grid::Grid;
use asperity::interface::{Adhesion, Base, Elastic, Layer, PenaltyWall, Wall};
use asperity::method::{self, Estimate, Load, NoObserver, PerssonForm, Problem, Settings, Stop};
use asperity::observe::{Distribution, StressDistribution, contact_area};
use asperity::surface::{Modes, PowerSpectrum, Spectrum};

const SPECTRAL: [&str; 3] = ["persson", "scgw", "ms-archard"];

/// The challenge's adhesion, over E*·L and L.
const GAMMA: f64 = 2e-5;
const RHO: f64 = 2.071e-5;

/// An estimate, as these tests look at it.
#[derive(Debug, Clone)]
struct Told {
    share: f64,
    gap: f64,
    stiffness: Option<f64>,
    gaps: Option<Distribution>,
    stresses: Option<StressDistribution>,
    load_error: f64,
    iterations: usize,
}

fn told_at(problem: &Problem, id: &str, pressures: &[f64]) -> Vec<Told> {
    let mut run = method::find(id).unwrap().start(problem, &NoObserver).unwrap().estimator().unwrap();
    let mut one = |&p: &f64| {
        let e: Estimate = run.estimate(Load::Pressure(p)).unwrap();
        assert_eq!((e.stop, e.pressure, e.load), (Stop::Converged, p, Load::Pressure(p)), "{id}");
        Told {
            share: e.contact_fraction,
            gap: e.mean_gap.unwrap(),
            stiffness: e.stiffness,
            gaps: e.gap_distribution,
            stresses: e.stress_distribution,
            load_error: e.load_error,
            iterations: e.iterations,
        }
    };
    pressures.iter().map(&mut one).collect()
}

fn told(problem: &Problem, id: &str, pressure: f64) -> Told {
    told_at(problem, id, &[pressure]).remove(0)
}

fn near(a: f64, b: f64, tolerance: f64) -> bool {
    (a - b).abs() <= tolerance * b.abs()
}

/// The challenge's surface with a longer cut-off, of which a grid holds every wave.
fn rough(n: usize, lambda_s: f64) -> (Grid, Vec<f64>) {
    let grid = Grid::unit(n, n);
    let spectrum = Spectrum { lambda_s, ..Spectrum::CHALLENGE };
    (grid, Modes::new(spectrum, 18, 1.0).heights(grid, 0.0))
}

/// What the solver `bvm` finds without adhesion.
struct Solved {
    /// Corrected for what the grid overcounts.
    area: f64,
    touching: f64,
    mean_gap: f64,
    gap: Vec<f64>,
    stress: Vec<f64>,
}

fn solved((grid, heights): (Grid, &[f64]), pressure: f64) -> Solved {
    let problem = Problem::new(grid, heights);
    let mut run = method::find("bvm").unwrap().start(&problem, &NoObserver).unwrap().solver().unwrap();
    let state = run.equilibrate(Load::Pressure(pressure)).unwrap();
    assert_eq!(state.stop, Stop::Converged);
    let area = contact_area(grid, state.gap, 0.0);
    Solved {
        area: area.corrected,
        touching: area.fraction,
        mean_gap: state.mean_gap,
        gap: state.gap.to_vec(),
        stress: state.stress.to_vec(),
    }
}

fn challenge() -> PowerSpectrum {
    PowerSpectrum::expected(&Spectrum::CHALLENGE, 1.0)
}

fn of(power: &PowerSpectrum) -> Problem<'_> {
    Problem::of_power(Grid::unit(64, 64), power)
}

fn sticky<'p>(problem: &Problem<'p>) -> Problem<'p> {
    Problem { adhesion: Adhesion::exponential(GAMMA, RHO), ..problem.clone() }
}

fn in_form<'p>(problem: &Problem<'p>, form: PerssonForm) -> Problem<'p> {
    let mut problem = problem.clone();
    problem.settings.persson.form = form;
    problem
}

fn in_bands<'p>(problem: &Problem<'p>, ratio: f64) -> Problem<'p> {
    let mut problem = problem.clone();
    problem.settings.ms_archard.band_ratio = ratio;
    problem
}

/// erf by its series.
fn erf(x: f64) -> f64 {
    let (mut term, mut sum) = (x, x);
    for n in 1..60 {
        term *= -x * x / f64::from(n);
        sum += term / f64::from(2 * n + 1);
    }
    2.0 / std::f64::consts::PI.sqrt() * sum
}

/// A resolved rough surface: 8 points along the shortest wave.
const SHORTEST: f64 = 1.0 / 32.0;

fn resolved() -> (Grid, Vec<f64>, PowerSpectrum) {
    let (grid, heights) = rough(256, SHORTEST);
    let power = PowerSpectrum::from_nodes(grid, &heights);
    (grid, heights, power)
}

/// What no method here can do is refused in one line that names the key.
#[test]
fn what_cannot_be_done_is_refused() {
    let (grid, heights, power) = resolved();
    let dry = Problem { power: Some(&power), ..Problem::new(grid, &heights) };
    let says = |id: &str, problem: &Problem, load: Load| {
        let started = method::find(id).unwrap().start(problem, &NoObserver);
        let error = started.and_then(|s| s.estimator()?.estimate(load).map(|_| ())).unwrap_err().to_string();
        assert_eq!(error.lines().count(), 1, "{error}");
        assert!(error.contains(&format!("method {id}")), "{error}");
        error
    };
    let press = Load::Pressure(0.01);
    let layer = Elastic::Layer(Layer { thickness: 0.1, poisson: 0.3, base: Base::Bonded });
    for id in SPECTRAL.iter().chain(&["rl-archard"]) {
        assert!(says(id, &Problem { kernel: layer, ..dry.clone() }, press).contains("kernel"));
        let wall = Wall::Penalty(PenaltyWall { length: 1e-3 });
        assert!(says(id, &Problem { wall, ..dry.clone() }, press).contains("wall"));
        for p in [0.0, -0.1, f64::NAN] {
            assert!(says(id, &dry, Load::Pressure(p)).contains("pressure"), "{id}");
        }
        assert!(says(id, &dry, Load::MeanGap(0.01)).contains("mean gap"));
    }
    // Ridges, as their nodes say.
    let ridges: Vec<f64> =
        (0..grid.points()).map(|i| 0.01 * (std::f64::consts::TAU * 3.0 * (i % 256) as f64 / 256.0).cos()).collect();
    let ridges = PowerSpectrum::from_nodes(grid, &ridges);
    let flat = PowerSpectrum { shells: Vec::new(), anisotropy: 0.0 };
    for id in SPECTRAL {
        assert!(says(id, &Problem { power: Some(&ridges), ..dry.clone() }, press).contains("anisotropy"));
        assert!(says(id, &Problem { power: Some(&flat), ..dry.clone() }, press).contains("no power"));
        assert!(says(id, &Problem { power: None, ..dry.clone() }, press).contains("spectrum"));
    }
    assert!(says("rl-archard", &Problem::new(grid, &vec![0.0; grid.points()]), press).contains("no waves"));
    let told = |change: &dyn Fn(&mut Settings)| {
        let mut settings = Settings::default();
        change(&mut settings);
        Problem { settings, ..dry.clone() }
    };
    for factor in [0.0, 1.1, f64::NAN] {
        assert!(says("persson", &told(&|s| s.persson.energy_factor = factor), press).contains("energy_factor"));
    }
    for ratio in [1.0, 0.5, f64::NAN] {
        assert!(says("ms-archard", &told(&|s| s.ms_archard.band_ratio = ratio), press).contains("ratio"));
    }
    for modes in [0, 128] {
        let error = says("rl-archard", &told(&|s| s.rl_archard.cut_off_modes = Some(modes)), press);
        assert!(error.contains("1 to 127"), "{error}");
    }
    for id in ["scgw", "rl-archard"] {
        assert!(says(id, &sticky(&dry), press).contains("adhesion"));
    }
    let power_law = Problem { adhesion: Adhesion::power_law_93(GAMMA, RHO), ..dry.clone() };
    assert!(says("ms-archard", &power_law, press).contains("adhesion"));
}

/// Realisations are isotropic enough on the grids that are used, down to waves of which a cell holds few.
#[test]
fn realisations_pass_as_isotropic() {
    for (n, seeds) in [(128, 12), (256, 6), (512, 2)] {
        for seed in 1..=seeds {
            let modes = Modes::new(Spectrum { lambda_s: 4.0 / n as f64, ..Spectrum::CHALLENGE }, seed, 1.0);
            let power = PowerSpectrum::from_series(&modes.series(), Grid::unit(n, n));
            assert!(power.anisotropy < 0.2, "{n}, {seed}: {}", power.anisotropy);
            told(&of(&power), "persson", 0.01);
        }
    }
}

/// Asked twice, or on one thread, an estimate is the same to the bit.
#[test]
fn estimates_repeat_to_the_bit() {
    let (grid, heights, power) = resolved();
    let dry = Problem { power: Some(&power), ..Problem::new(grid, &heights) };
    for id in SPECTRAL.iter().chain(&["rl-archard"]) {
        let bits = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                told_at(&dry, id, &[0.02, 0.1, 0.02])
                    .iter()
                    .map(|t| (t.share.to_bits(), t.gap.to_bits()))
                    .collect::<Vec<_>>()
            })
        };
        let found = bits(1);
        assert_eq!(found[0], found[2], "{id}");
        assert_eq!(found, bits(2), "{id}");
    }
}

/// erf(√2 p*) and erf(√π p*), p* with the surface's own gradient; the challenge's printed digits among them.
#[test]
fn persson_areas_are_error_functions() {
    let half = PowerSpectrum::expected(&Spectrum { rms_gradient: 0.5, lambda_s: 0.01, ..Spectrum::CHALLENGE }, 1.0);
    for (power, gradient) in [(challenge(), 1.0), (half, 0.5)] {
        for (form, c) in [(PerssonForm::Pure, 2f64.sqrt()), (PerssonForm::Kappa2, std::f64::consts::PI.sqrt())] {
            let problem = in_form(&of(&power), form);
            for p in [1e-6, 1e-3, 0.01, 0.1, 0.2, 1.0] {
                let found = told(&problem, "persson", p * gradient).share;
                assert!(near(found, erf(c * p), 1e-10), "{form:?} {p}: {found} {}", erf(c * p));
            }
        }
    }
    let power = challenge();
    for (form, printed) in [(PerssonForm::Pure, 0.1585194), (PerssonForm::Kappa2, 0.197925)] {
        assert!(near(told(&in_form(&of(&power), form), "persson", 0.1).share, printed, 3e-6));
    }
}

/// Mean gaps on the challenge's spectrum in µm, by an independent quadrature of the published integral (its digits), with its
/// original energy and with the fitted one.
#[test]
fn persson_gaps_are_those_of_the_integral() {
    let power = challenge();
    let fitted =
        [(0.001, 2.120), (0.01, 1.129), (0.03, 0.669), (0.1, 0.232), (0.2, 0.0756), (0.4, 0.01265), (1.0, 0.00015)];
    for (p, um) in fitted {
        let found = told(&of(&power), "persson", p);
        assert!(near(100.0 * found.gap, um, 0.012), "{p}: {} {um}", 100.0 * found.gap);
    }
    let mut original = of(&power);
    original.settings.persson.energy_factor = 1.0;
    assert!(near(100.0 * told(&original, "persson", 0.01).gap, 1.434, 0.012));
}

/// The stiffness is the slope of the mean gap.
#[test]
fn persson_and_scgw_stiffness_is_the_slope_of_the_gap() {
    let power = challenge();
    for id in ["persson", "scgw"] {
        for p in [1e-3, 0.05, 0.4] {
            let [low, here, high] = [p * (1.0 - 1e-4), p, p * (1.0 + 1e-4)].map(|p| told(&of(&power), id, p));
            let slope = 2e-4 * p / (low.gap - high.gap);
            assert!(near(here.stiffness.unwrap(), slope, 1e-4), "{id} {p}: {:?} {slope}", here.stiffness);
        }
    }
}

/// Pr(σ): two Gaussians, of which the contact has all but the delta; their mean is the pressure.
#[test]
fn persson_stresses() {
    let (_, _, power) = resolved();
    let gradient = power.rms_gradient();
    for form in [PerssonForm::Pure, PerssonForm::Kappa2] {
        for p in [1e-3, 0.05, 0.5, 3.0] {
            let found = told(&in_form(&of(&power), form), "persson", p * gradient);
            let stresses = found.stresses.unwrap();
            assert!((stresses.all.total() - 1.0).abs() < 1e-12, "{form:?} {p}: {}", stresses.all.total());
            assert!((stresses.contact.total() - found.share).abs() < 1e-12);
            assert!((stresses.all.delta + found.share - 1.0).abs() < 1e-15);
            let first: f64 =
                stresses.contact.density().iter().zip(&stresses.contact.fractions).map(|((s, _), w)| s * w).sum();
            // A middle is not a bin's mean.
            assert!(near(first, p * gradient, 2e-3), "{form:?} {p}: {first}");
        }
    }
}

/// Largest difference between a distribution, over its total, and the values.
fn apart(told: &Distribution, total: f64, values: &[f64]) -> f64 {
    let mut below = told.delta;
    let mut apart: f64 = 0.0;
    for (edge, share) in told.edges[1..].iter().zip(&told.fractions) {
        below += share;
        let count = values.iter().filter(|v| *v < edge).count();
        apart = apart.max((below / total - count as f64 / values.len() as f64).abs());
    }
    apart
}

/// S22: the stresses of what touches are a solver's, by the largest difference of the cumulative distributions; narrower ones,
/// with which areas are larger, are nearer.
#[test]
fn persson_stresses_against_a_solver() {
    let (grid, heights, power) = resolved();
    for p in [0.02, 0.2] {
        let p = p * power.rms_gradient();
        let solved = solved((grid, &heights), p);
        let values: Vec<f64> =
            solved.gap.iter().zip(&solved.stress).filter(|(g, _)| **g == 0.0).map(|(_, s)| *s).collect();
        assert_eq!(values.len() as f64, solved.touching * grid.points() as f64);
        let [pure, twice] = [PerssonForm::Pure, PerssonForm::Kappa2].map(|form| {
            let found = told(&in_form(&of(&power), form), "persson", p);
            apart(&found.stresses.unwrap().contact, found.share, &values)
        });
        println!("{p:.4}: stresses apart by {pure:.3} pure, {twice:.3} kappa2");
        assert!(pure < 0.35 && twice < 0.25 && twice < pure);
    }
}

/// Pr(u): all of the area, what touches a delta; by the mirror its mean is above the mean gap; its shape is a solver's.
#[test]
fn persson_gap_distribution() {
    let (grid, heights, power) = resolved();
    for (power, p) in [(&challenge(), 1e-3), (&challenge(), 0.01), (&challenge(), 0.2), (&power, 0.01), (&power, 5.0)] {
        let found = told(&of(power), "persson", p);
        let gaps = found.gaps.unwrap();
        assert!((gaps.total() - 1.0).abs() < 1e-12, "{p}: {}", gaps.total());
        assert!((gaps.delta - found.share).abs() < 1e-15 && gaps.fractions.iter().all(|s| *s >= -1e-15));
        let mean: f64 = gaps.density().iter().zip(&gaps.fractions).map(|((u, _), w)| u * w).sum();
        println!("{p}: mean of the distribution {mean:.4e}, mean gap {:.4e}", found.gap);
        // A middle is at most half a bin from the bin's mean.
        let most = 0.5 * (gaps.edges[1] - gaps.edges[0]) * (1.0 - gaps.delta) + 1e-4 * found.gap;
        assert!((mean - found.gap).abs() <= most, "{p}: {mean} {}", found.gap);
    }
    for p in [0.02, 0.1, 0.2] {
        let p = p * power.rms_gradient();
        let solved = solved((grid, &heights), p);
        let gaps = told(&of(&power), "persson", p).gaps.unwrap();
        let values = |sizes: &[f64]| sizes.iter().copied().filter(|g| *g > 0.0).collect::<Vec<_>>();
        let open = Distribution { delta: 0.0, ..gaps.clone() };
        let found = apart(&open, 1.0 - gaps.delta, &values(&solved.gap));
        println!("{p:.4}: gaps apart by {found:.3}");
        assert!(found < 0.2, "{found}");
    }
}

/// S34: the mean gap within a fifth of a solver's above p* = 5e-3, by the realised power. Areas: a fifth to a third low as the
/// theory stands (contact pressures are high, S33), within a fifth in the form that begins with 2 p* (S07).
#[test]
fn persson_against_a_solver() {
    let (grid, heights, power) = resolved();
    for p in [0.006, 0.02, 0.05, 0.1, 0.2] {
        let pressure = p * power.rms_gradient();
        let solved = solved((grid, &heights), pressure);
        let [pure, twice] =
            [PerssonForm::Pure, PerssonForm::Kappa2].map(|f| told(&in_form(&of(&power), f), "persson", pressure));
        let [gap, other] = [&pure, &twice].map(|t| t.gap / solved.mean_gap);
        let [area, larger] = [&pure, &twice].map(|t| t.share / solved.area);
        println!(
            "p* {p}: gap x{gap:.3} pure, x{other:.3} kappa2; area {:.4}, x{area:.3} pure, x{larger:.3} kappa2",
            solved.area
        );
        assert!(near(gap, 1.0, 0.2), "{p}: {gap}");
        assert!(area > 0.6 && area < 0.9, "{p}: {area}");
        assert!(near(larger, 1.0, 0.2), "{p}: {larger}");
    }
}

/// Adhesion raises the area and hardly moves the gap; in proportion to p at small ones (no slope of its own, S33); it knows
/// no range; and it goes to nothing with its work.
#[test]
fn persson_with_adhesion() {
    let power = challenge();
    let dry = of(&power);
    let wet = sticky(&dry);
    let pressures = [1e-6, 1e-3, 0.01, 0.1];
    let (with, without) = (told_at(&wet, "persson", &pressures), told_at(&dry, "persson", &pressures));
    for ((p, w), d) in pressures.iter().zip(&with).zip(&without) {
        println!(
            "p* {p}: area x{:.4}, gap x{:.4}, load error {:.1e}, {} sweeps",
            w.share / d.share,
            w.gap / d.gap,
            w.load_error,
            w.iterations
        );
        assert!(w.share > 1.1 * d.share && w.share < 1.7 * d.share);
        assert!(w.gap < d.gap && w.gap > 0.95 * d.gap);
        assert!(w.load_error < 5e-3);
    }
    assert!(near(with[0].share / pressures[0], with[1].share / pressures[1], 1e-3));
    let elsewhere = Problem { adhesion: Adhesion::dugdale(GAMMA, 10.0 * RHO), ..dry.clone() };
    assert_eq!(told(&elsewhere, "persson", 0.01).share, with[2].share);
    let mut last = f64::INFINITY;
    for gamma in [2e-5, 4e-6, 8e-7, 1e-12] {
        let less = Problem { adhesion: Adhesion::exponential(gamma, RHO), ..dry.clone() };
        let raised = told(&less, "persson", 0.01).share / without[2].share;
        assert!(raised < last);
        last = raised;
    }
    assert!((last - 1.0).abs() < 1e-3, "{last}");
}

/// S25: mean contact pressures above 0.8 E*ḡ at all loads, areas low by up to a factor of three beside 2 p*.
#[test]
fn scgw_contacts_are_small_and_hard() {
    let power = challenge();
    let pressures = [1e-6, 1e-5, 1e-4, 1e-3, 0.01, 0.1, 0.3];
    for (p, t) in pressures.iter().zip(told_at(&of(&power), "scgw", &pressures)) {
        println!("p* {p}: area {:.5}, kappa {:.4}, p_c {:.3}, gap {:.4e}", t.share, t.share / p, p / t.share, t.gap);
        assert!(p / t.share > 0.8);
        assert!(t.load_error < 1e-9);
    }
    // Independent sums at the reference load: 2.331 rms heights, 0.693 p*, 1.83 µm.
    let reference = told(&of(&power), "scgw", 0.01);
    assert!(near(reference.share, 0.00693, 0.002) && near(100.0 * reference.gap, 1.83, 0.003), "{reference:?}");
}

/// S25 against a solver: too little area. On few wavelengths the gap is a solver's within a fifth at small loads.
#[test]
fn scgw_against_a_solver() {
    let (grid, heights, power) = resolved();
    for p in [0.003, 0.02, 0.1] {
        let pressure = p * power.rms_gradient();
        let solved = solved((grid, &heights), pressure);
        let found = told(&of(&power), "scgw", pressure);
        let (area, gap) = (found.share / solved.area, found.gap / solved.mean_gap);
        println!("p* {p}: area x{area:.3}, gap x{gap:.3}");
        assert!(area < 0.9 && area > 0.5, "{area}");
        assert!(p > 0.05 || near(gap, 1.0, 0.2), "{gap}");
    }
}

/// Octaves without adhesion: κ about 2.3; the load is borne to the last band.
#[test]
fn ms_archard_in_octaves() {
    let power = challenge();
    for (ratio, low, high) in [(1.5, 2.6, 3.0), (2.0, 2.2, 2.45), (3.0, 2.0, 2.2), (5.0, 2.0, 2.2)] {
        let problem = in_bands(&of(&power), ratio);
        for t in [1e-3, 0.01].map(|p| (p, told(&problem, "ms-archard", p))) {
            let (p, t) = t;
            println!("ratio {ratio}: p* {p}: kappa {:.3}, gap {:.4e}", t.share / p, t.gap);
            assert!(t.share / p > low && t.share / p < high, "{ratio} {p}: {}", t.share / p);
            assert!(t.load_error < 1e-12);
        }
        assert!(told(&sticky(&problem), "ms-archard", 1e-3).load_error < 1e-12);
    }
}

/// S29: with adhesion the area is a little high, and jumps into full contact from somewhat above 30 %.
#[test]
fn ms_archard_jumps_into_full_contact() {
    let power = challenge();
    let jump = |ratio: f64| {
        let problem = sticky(&in_bands(&of(&power), ratio));
        let (mut low, mut high) = (1e-3, 1.0);
        for _ in 0..40 {
            let middle = f64::sqrt(low * high);
            if told(&problem, "ms-archard", middle).share < 1.0 { low = middle } else { high = middle }
        }
        (low, told(&problem, "ms-archard", low).share, told(&problem, "ms-archard", high))
    };
    for ratio in [2.0, 4.0, 5.0, 6.0] {
        let (p, before, after) = jump(ratio);
        println!("ratio {ratio}: from {before:.4} at p* {p:.4}");
        assert_eq!((after.share, after.gap), (1.0, 0.0));
    }
    let (_, before, _) = jump(Settings::default().ms_archard.band_ratio);
    assert!(before > 0.3 && before < 0.4, "{before}");
    let reference = [sticky(&of(&power)), of(&power)].map(|p| told(&p, "ms-archard", 0.01).share);
    println!("reference load: {reference:?}");
    assert!(reference[0] > 1.3 * reference[1] && reference[0] > 0.025 && reference[0] < 0.04);
}

/// S30: without adhesion the gap is closed at p* = 0.8 and below, by the steepest band.
#[test]
fn ms_archard_closes() {
    let power = challenge();
    let (mut low, mut high) = (0.01, 2.0);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if told(&of(&power), "ms-archard", middle).gap > 0.0 { low = middle } else { high = middle }
    }
    println!("closed at p* {high:.4}");
    assert!(high < 0.8 && told(&of(&power), "ms-archard", high).share == 1.0);
}

/// S31: the long waves' mean gap is the surface's within a fifth at small loads, whatever the cut-off; the area of both
/// layers is of the solver's order.
#[test]
fn rl_archard_against_a_solver() {
    let (grid, heights) = rough(256, 1.0 / 64.0);
    let gradient = PowerSpectrum::from_nodes(grid, &heights).rms_gradient();
    for p in [0.002, 0.01, 0.03] {
        let p = p * gradient;
        let solved = solved((grid, &heights), p);
        for modes in [None, Some(16), Some(24)] {
            let mut problem = Problem::new(grid, &heights);
            problem.settings.rl_archard.cut_off_modes = modes;
            let found = told(&problem, "rl-archard", p);
            println!(
                "{p:.4}, {modes:?}: gap x{:.3}, area x{:.3}",
                found.gap / solved.mean_gap,
                found.share / solved.area
            );
            assert!(near(found.gap, solved.mean_gap, 0.2));
            assert!(found.share < 1.2 * solved.area && found.share > 0.4 * solved.area);
        }
    }
}

/// A surface without short waves is solved as it is, but for the layer: gaps are the solver's. Nodes and series are the same.
#[test]
fn rl_archard_keeps_its_long_waves() {
    let (grid, heights) = rough(128, SHORTEST);
    let solved = solved((grid, &heights), 0.05);
    let of_nodes = told(&Problem::new(grid, &heights), "rl-archard", 0.05);
    // Both grids have four points along the shortest wave: to what the solvers leave.
    assert!(near(of_nodes.gap, solved.mean_gap, 1e-5), "{} {}", of_nodes.gap, solved.mean_gap);
    let series = Modes::new(Spectrum { lambda_s: SHORTEST, ..Spectrum::CHALLENGE }, 18, 1.0).series();
    let of_series = told(&Problem::new(grid, method::Heights::Series(&series)), "rl-archard", 0.05);
    assert!(near(of_series.gap, of_nodes.gap, 1e-6) && near(of_series.share, of_nodes.share, 1e-6));
}

/// S30, on the challenge's own surface: closed below p* = 0.8.
#[test]
fn rl_archard_closes() {
    let series = Modes::new(Spectrum::CHALLENGE, 18, 1.0).series();
    let problem = Problem::new(Grid::unit(2048, 2048), method::Heights::Series(&series));
    let found = told_at(&problem, "rl-archard", &[0.01, 0.8]);
    println!(
        "reference: area {:.4}, gap {:.4e}; at 0.8: {:.4} {:.4e}",
        found[0].share, found[0].gap, found[1].share, found[1].gap
    );
    assert_eq!(found[1].gap, 0.0);
    // The ensemble's reference gap, 0.97 to 0.99 µm with a scatter of 0.03.
    assert!(found[0].gap > 0.0085 && found[0].gap < 0.0115);
    // S28: asperities that know nothing of each other leave a gap that is far too large.
    let power = challenge();
    assert!(told(&of(&power), "scgw", 0.01).gap > 1.5 * found[0].gap);
}

/// What the challenge's whole spectrum takes, counted: terms of quadrature, halvings, balances tried. All are within a
/// second by far.
#[test]
fn the_challenges_spectrum_is_little_work() {
    let power = challenge();
    assert!(told(&of(&power), "persson", 0.01).iterations < 2_000_000);
    assert!(told(&sticky(&of(&power)), "persson", 1e-3).iterations < 400);
    assert!(told(&of(&power), "scgw", 0.01).iterations <= 60);
    assert!(told(&sticky(&of(&power)), "ms-archard", 0.01).iterations < 5000);
}

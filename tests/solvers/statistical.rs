//! Estimators based on surface statistics, and one based on the long waves, against closed forms, a solver and the
//! challenge paper.

use asperity::contact::interface::{AttractionLaw, Base, Elastic, Layer, PenaltyWall, Wall};
use asperity::contact::method::{self, Load, MethodEstimate, NoObserver, PerssonForm, ReducedProblem, Settings, Stop};
use asperity::contact::observe::{ContactEdges, Distribution, StressDistribution, contact_area};
use asperity::grid::Grid;
use asperity::methods;
use asperity::surface::{Modes, PowerSpectrum, Spectrum};

const SPECTRAL: [&str; 3] = ["persson", "scgw", "ms-archard"];

/// Work of adhesion over E*·L and range over L of the challenge.
const GAMMA: f64 = 2e-5;
const RHO: f64 = 2.071e-5;

/// A copied estimate.
#[derive(Debug, Clone)]
struct Estimated {
    contact_area: f64,
    gap: f64,
    stiffness: Option<f64>,
    gaps: Option<Distribution>,
    stresses: Option<StressDistribution>,
    load_error: f64,
    iterations: usize,
}

fn estimates(problem: &ReducedProblem, id: &str, pressures: &[f64]) -> Vec<Estimated> {
    let mut run = methods::find(id).unwrap().start(problem, &NoObserver).unwrap().estimator().unwrap();
    let mut one = |&p: &f64| {
        let e: MethodEstimate = run.estimate(Load::Pressure(p)).unwrap();
        assert_eq!((e.stop, e.pressure, e.load), (Stop::Converged, p, Load::Pressure(p)), "{id}");
        Estimated {
            contact_area: e.contact_area,
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

fn estimated(problem: &ReducedProblem, id: &str, pressure: f64) -> Estimated {
    estimates(problem, id, &[pressure]).remove(0)
}

fn near(a: f64, b: f64, tolerance: f64) -> bool {
    (a - b).abs() <= tolerance * b.abs()
}

/// The challenge's surface with a longer cut-off wavelength; the grid resolves all waves.
fn rough(n: usize, lambda_s: f64) -> (Grid, Vec<f64>) {
    let grid = Grid::unit(n, n);
    let spectrum = Spectrum { lambda_s, ..Spectrum::CHALLENGE };
    (grid, Modes::new(spectrum, 18, 1.0).heights(grid, 0.0))
}

/// Solution of `bvm` without adhesion.
struct Solved {
    /// Perimeter-corrected contact fraction.
    area: f64,
    touching: f64,
    mean_gap: f64,
    gap: Vec<f64>,
    stress: Vec<f64>,
}

fn solved((grid, heights): (Grid, &[f64]), pressure: f64) -> Solved {
    let problem = ReducedProblem::new(grid, heights);
    let mut run = methods::find("bvm").unwrap().start(&problem, &NoObserver).unwrap().solver().unwrap();
    let state = run.equilibrate(Load::Pressure(pressure)).unwrap();
    assert_eq!(state.stop, Stop::Converged);
    let area = contact_area(grid, state.gap, ContactEdges::ELASTIC);
    Solved {
        area: area.contact_area,
        touching: area.contact_nodes,
        mean_gap: state.mean_gap,
        gap: state.gap.to_vec(),
        stress: state.stress.to_vec(),
    }
}

fn challenge() -> PowerSpectrum {
    PowerSpectrum::expected(&Spectrum::CHALLENGE, 1.0)
}

fn of(power: &PowerSpectrum) -> ReducedProblem<'_> {
    ReducedProblem::of_power(Grid::unit(64, 64), power)
}

fn adhesive<'p>(problem: &ReducedProblem<'p>) -> ReducedProblem<'p> {
    ReducedProblem { adhesion: AttractionLaw::exponential(GAMMA, RHO), ..problem.clone() }
}

fn in_form<'p>(problem: &ReducedProblem<'p>, form: PerssonForm) -> ReducedProblem<'p> {
    let mut problem = problem.clone();
    problem.settings.persson.form = form;
    problem
}

fn in_bands<'p>(problem: &ReducedProblem<'p>, ratio: f64) -> ReducedProblem<'p> {
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

/// Unsupported problems give a one-line error that names the key.
#[test]
fn unsupported_problems_are_errors() {
    let (grid, heights, power) = resolved();
    let dry = ReducedProblem { power: Some(&power), ..ReducedProblem::new(grid, &heights) };
    let error_of = |id: &str, problem: &ReducedProblem, load: Load| {
        let started = methods::find(id).unwrap().start(problem, &NoObserver);
        let error = started.and_then(|s| s.estimator()?.estimate(load).map(|_| ())).unwrap_err().to_string();
        assert_eq!(error.lines().count(), 1, "{error}");
        assert!(error.contains(&format!("method {id}")), "{error}");
        error
    };
    let press = Load::Pressure(0.01);
    let layer = Elastic::Layer(Layer { thickness: 0.1, poisson: 0.3, base: Base::Bonded });
    for id in SPECTRAL.iter().chain(&["rl-archard"]) {
        assert!(error_of(id, &ReducedProblem { kernel: layer, ..dry.clone() }, press).contains("kernel"));
        let wall = Wall::Penalty(PenaltyWall { length: 1e-3 });
        assert!(error_of(id, &ReducedProblem { wall, ..dry.clone() }, press).contains("wall"));
        for p in [0.0, -0.1, f64::NAN] {
            assert!(error_of(id, &dry, Load::Pressure(p)).contains("pressure"), "{id}");
        }
        assert!(error_of(id, &dry, Load::MeanGap(0.01)).contains("mean gap"));
    }
    // Parallel ridges.
    let ridges: Vec<f64> =
        (0..grid.points()).map(|i| 0.01 * (std::f64::consts::TAU * 3.0 * (i % 256) as f64 / 256.0).cos()).collect();
    let ridges = PowerSpectrum::from_nodes(grid, &ridges);
    let flat = PowerSpectrum { shells: Vec::new(), anisotropy: 0.0 };
    for id in SPECTRAL {
        assert!(error_of(id, &ReducedProblem { power: Some(&ridges), ..dry.clone() }, press).contains("anisotropy"));
        assert!(error_of(id, &ReducedProblem { power: Some(&flat), ..dry.clone() }, press).contains("no power"));
        assert!(error_of(id, &ReducedProblem { power: None, ..dry.clone() }, press).contains("spectrum"));
    }
    assert!(error_of("rl-archard", &ReducedProblem::new(grid, &vec![0.0; grid.points()]), press).contains("no waves"));
    let with_settings = |change: &dyn Fn(&mut Settings)| {
        let mut settings = Settings::default();
        change(&mut settings);
        ReducedProblem { settings, ..dry.clone() }
    };
    for factor in [0.0, 1.1, f64::NAN] {
        assert!(
            error_of("persson", &with_settings(&|s| s.persson.energy_factor = factor), press).contains("energy_factor")
        );
    }
    for ratio in [1.0, 0.5, f64::NAN] {
        assert!(error_of("ms-archard", &with_settings(&|s| s.ms_archard.band_ratio = ratio), press).contains("ratio"));
    }
    for modes in [0, 128] {
        let error = error_of("rl-archard", &with_settings(&|s| s.rl_archard.cut_off_modes = Some(modes)), press);
        assert!(error.contains("1 to 127"), "{error}");
    }
    for id in ["scgw", "rl-archard"] {
        assert!(error_of(id, &adhesive(&dry), press).contains("adhesion"));
    }
    let power_law = ReducedProblem { adhesion: AttractionLaw::power_law_93(GAMMA, RHO), ..dry.clone() };
    assert!(error_of("ms-archard", &power_law, press).contains("adhesion"));
}

/// Realisations on the usual grids count as isotropic, including their longest waves.
#[test]
fn realisations_pass_as_isotropic() {
    for (n, seeds) in [(128, 12), (256, 6), (512, 2)] {
        for seed in 1..=seeds {
            let modes = Modes::new(Spectrum { lambda_s: 4.0 / n as f64, ..Spectrum::CHALLENGE }, seed, 1.0);
            let power = PowerSpectrum::from_series(modes.series(), Grid::unit(n, n));
            assert!(power.anisotropy < 0.2, "{n}, {seed}: {}", power.anisotropy);
            estimated(&of(&power), "persson", 0.01);
        }
    }
}

/// Repeated estimates are bit-identical, on one and two threads.
#[test]
fn estimates_are_bit_identical() {
    let (grid, heights, power) = resolved();
    let dry = ReducedProblem { power: Some(&power), ..ReducedProblem::new(grid, &heights) };
    for id in SPECTRAL.iter().chain(&["rl-archard"]) {
        let bits = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                estimates(&dry, id, &[0.02, 0.1, 0.02])
                    .iter()
                    .map(|t| (t.contact_area.to_bits(), t.gap.to_bits()))
                    .collect::<Vec<_>>()
            })
        };
        let found = bits(1);
        assert_eq!(found[0], found[2], "{id}");
        assert_eq!(found, bits(2), "{id}");
    }
}

/// erf(√2 p*) and erf(√π p*), with the gradient of the surface in p*; two values are printed in the paper.
#[test]
fn persson_areas_are_error_functions() {
    let half = PowerSpectrum::expected(&Spectrum { rms_gradient: 0.5, lambda_s: 0.01, ..Spectrum::CHALLENGE }, 1.0);
    for (power, gradient) in [(challenge(), 1.0), (half, 0.5)] {
        for (form, c) in [(PerssonForm::Pure, 2f64.sqrt()), (PerssonForm::Kappa2, std::f64::consts::PI.sqrt())] {
            let problem = in_form(&of(&power), form);
            for p in [1e-6, 1e-3, 0.01, 0.1, 0.2, 1.0] {
                let found = estimated(&problem, "persson", p * gradient).contact_area;
                assert!(near(found, erf(c * p), 1e-10), "{form:?} {p}: {found} {}", erf(c * p));
            }
        }
    }
    let power = challenge();
    for (form, printed) in [(PerssonForm::Pure, 0.1585194), (PerssonForm::Kappa2, 0.197925)] {
        assert!(near(estimated(&in_form(&of(&power), form), "persson", 0.1).contact_area, printed, 3e-6));
    }
}

/// Mean gaps for the challenge's spectrum, µm, against an independent quadrature of the published integral, with the
/// original and the fitted energy factor.
#[test]
fn persson_mean_gaps_agree_with_quadrature() {
    let power = challenge();
    let fitted =
        [(0.001, 2.120), (0.01, 1.129), (0.03, 0.669), (0.1, 0.232), (0.2, 0.0756), (0.4, 0.01265), (1.0, 0.00015)];
    for (p, um) in fitted {
        let found = estimated(&of(&power), "persson", p);
        assert!(near(100.0 * found.gap, um, 0.012), "{p}: {} {um}", 100.0 * found.gap);
    }
    let mut original = of(&power);
    original.settings.persson.energy_factor = 1.0;
    assert!(near(100.0 * estimated(&original, "persson", 0.01).gap, 1.434, 0.012));
}

/// The stiffness equals a difference quotient of the mean gap.
#[test]
fn persson_and_scgw_stiffness_is_the_slope_of_the_gap() {
    let power = challenge();
    for id in ["persson", "scgw"] {
        for p in [1e-3, 0.05, 0.4] {
            let [low, here, high] = [p * (1.0 - 1e-4), p, p * (1.0 + 1e-4)].map(|p| estimated(&of(&power), id, p));
            let slope = 2e-4 * p / (low.gap - high.gap);
            assert!(near(here.stiffness.unwrap(), slope, 1e-4), "{id} {p}: {:?} {slope}", here.stiffness);
        }
    }
}

/// Pr(σ): normalisation, delta function of open area, mean pressure.
#[test]
fn persson_stress_distribution_has_the_mean_pressure() {
    let (_, _, power) = resolved();
    let gradient = power.rms_gradient();
    for form in [PerssonForm::Pure, PerssonForm::Kappa2] {
        for p in [1e-3, 0.05, 0.5, 3.0] {
            let found = estimated(&in_form(&of(&power), form), "persson", p * gradient);
            let stresses = found.stresses.unwrap();
            assert!((stresses.all.total() - 1.0).abs() < 1e-12, "{form:?} {p}: {}", stresses.all.total());
            assert!((stresses.contact.total() - found.contact_area).abs() < 1e-12);
            assert!((stresses.all.delta + found.contact_area - 1.0).abs() < 1e-15);
            let first: f64 =
                stresses.contact.density().iter().zip(&stresses.contact.fractions).map(|((s, _), w)| s * w).sum();
            // The centre of a bin differs from its mean.
            assert!(near(first, p * gradient, 2e-3), "{form:?} {p}: {first}");
        }
    }
}

/// Largest difference between the cumulative distributions of a histogram and of values.
fn apart(distribution: &Distribution, total: f64, values: &[f64]) -> f64 {
    let mut below = distribution.delta;
    let mut apart: f64 = 0.0;
    for (edge, share) in distribution.edges[1..].iter().zip(&distribution.fractions) {
        below += share;
        let count = values.iter().filter(|v| *v < edge).count();
        apart = apart.max((below / total - count as f64 / values.len() as f64).abs());
    }
    apart
}

/// S22: largest difference of the cumulative distributions of contact stress from those of `bvm`. The narrower
/// distribution of the form with larger areas has a smaller difference.
#[test]
fn persson_stress_distribution_agrees_with_bvm() {
    let (grid, heights, power) = resolved();
    // Measured: 0.304 and 0.182, 0.159 and 0.074.
    for (p, most) in [(0.02, [0.32, 0.19]), (0.2, [0.17, 0.08])] {
        let p = p * power.rms_gradient();
        let solved = solved((grid, &heights), p);
        let values: Vec<f64> =
            solved.gap.iter().zip(&solved.stress).filter(|(g, _)| **g == 0.0).map(|(_, s)| *s).collect();
        assert_eq!(values.len() as f64, solved.touching * grid.points() as f64);
        let [pure, twice] = [PerssonForm::Pure, PerssonForm::Kappa2].map(|form| {
            let found = estimated(&in_form(&of(&power), form), "persson", p);
            apart(&found.stresses.unwrap().contact, found.contact_area, &values)
        });
        println!("{p:.4}: stresses apart by {pure:.3} pure, {twice:.3} kappa2");
        assert!(pure < most[0] && twice < most[1]);
    }
}

/// Pr(u): normalisation, delta function of contact, mean gap; its shape agrees with `bvm`.
#[test]
fn persson_gap_distribution_has_the_mean_gap() {
    let (grid, heights, power) = resolved();
    for (power, p) in [(&challenge(), 1e-3), (&challenge(), 0.01), (&challenge(), 0.2), (&power, 0.01), (&power, 5.0)] {
        let found = estimated(&of(power), "persson", p);
        let gaps = found.gaps.unwrap();
        assert!((gaps.total() - 1.0).abs() < 1e-12, "{p}: {}", gaps.total());
        assert!((gaps.delta - found.contact_area).abs() < 1e-15 && gaps.fractions.iter().all(|s| *s >= -1e-15));
        let mean: f64 = gaps.density().iter().zip(&gaps.fractions).map(|((u, _), w)| u * w).sum();
        println!("{p}: mean of the distribution {mean:.4e}, mean gap {:.4e}", found.gap);
        // The centre of a bin is at most half a bin from its mean.
        let most = 0.5 * (gaps.edges[1] - gaps.edges[0]) * (1.0 - gaps.delta) + 1e-4 * found.gap;
        assert!((mean - found.gap).abs() <= most, "{p}: {mean} {}", found.gap);
    }
    // Measured: 0.048, 0.075, 0.108.
    for (p, most) in [(0.02, 0.051), (0.1, 0.08), (0.2, 0.115)] {
        let p = p * power.rms_gradient();
        let solved = solved((grid, &heights), p);
        let gaps = estimated(&of(&power), "persson", p).gaps.unwrap();
        let values = |sizes: &[f64]| sizes.iter().copied().filter(|g| *g > 0.0).collect::<Vec<_>>();
        let open = Distribution { delta: 0.0, ..gaps.clone() };
        let found = apart(&open, 1.0 - gaps.delta, &values(&solved.gap));
        println!("{p:.4}: gaps apart by {found:.3}");
        assert!(found < most, "{found}");
    }
}

/// S34: the mean gap is near that of `bvm` above p* = 5e-3, for the realised spectrum. The original theory
/// underestimates areas by 20 to 30 % (S33: contact pressures are high); the form with 2 p* at small loads does so less
/// (S07).
#[test]
fn persson_area_and_gap_agree_with_bvm() {
    let (grid, heights, power) = resolved();
    // Ratios to `bvm`, as evidence/validation-other-methods.md has them: mean gap, area of the pure form, area of the form
    // with 2 p*.
    const RATIOS: [(f64, [f64; 3]); 5] = [
        (0.006, [1.09, 0.66, 0.82]),
        (0.02, [1.03, 0.70, 0.87]),
        (0.05, [1.00, 0.74, 0.93]),
        (0.1, [1.02, 0.78, 0.98]),
        (0.2, [1.01, 0.84, 1.03]),
    ];
    // They are printed to two digits.
    const PRINTED: f64 = 6e-3;
    for (p, ratios) in RATIOS {
        let pressure = p * power.rms_gradient();
        let solved = solved((grid, &heights), pressure);
        let [pure, twice] =
            [PerssonForm::Pure, PerssonForm::Kappa2].map(|f| estimated(&in_form(&of(&power), f), "persson", pressure));
        let [gap, other] = [&pure, &twice].map(|t| t.gap / solved.mean_gap);
        let [area, larger] = [&pure, &twice].map(|t| t.contact_area / solved.area);
        println!(
            "p* {p}: gap x{gap:.3} pure, x{other:.3} kappa2; area {:.4}, x{area:.3} pure, x{larger:.3} kappa2",
            solved.area
        );
        for (found, expected) in [gap, area, larger].into_iter().zip(ratios) {
            assert!((found - expected).abs() < PRINTED, "{p}: {found} {expected}");
        }
    }
}

/// Adhesion increases the area and hardly changes the mean gap. The area remains proportional to small pressures (S33),
/// does not depend on the range, and tends to the area without adhesion as the work of adhesion vanishes.
#[test]
fn persson_with_adhesion() {
    let power = challenge();
    let dry = of(&power);
    let wet = adhesive(&dry);
    let pressures = [1e-6, 1e-3, 0.01, 0.1];
    let (with, without) = (estimates(&wet, "persson", &pressures), estimates(&dry, "persson", &pressures));
    for ((p, w), d) in pressures.iter().zip(&with).zip(&without) {
        println!(
            "p* {p}: area x{:.4}, gap x{:.4}, load error {:.1e}, {} sweeps",
            w.contact_area / d.contact_area,
            w.gap / d.gap,
            w.load_error,
            w.iterations
        );
        // The paper has 1.3 to 1.7.
        assert!(near(w.contact_area / d.contact_area, 1.138, 3e-3));
        assert!(w.gap < d.gap && w.gap > 0.97 * d.gap);
        assert!(w.load_error < 5e-3);
    }
    assert!(near(with[0].contact_area / pressures[0], with[1].contact_area / pressures[1], 1e-3));
    let elsewhere = ReducedProblem { adhesion: AttractionLaw::dugdale(GAMMA, 10.0 * RHO), ..dry.clone() };
    assert_eq!(estimated(&elsewhere, "persson", 0.01).contact_area, with[2].contact_area);
    let mut last = f64::INFINITY;
    for gamma in [2e-5, 4e-6, 8e-7, 1e-12] {
        let less = ReducedProblem { adhesion: AttractionLaw::exponential(gamma, RHO), ..dry.clone() };
        let raised = estimated(&less, "persson", 0.01).contact_area / without[2].contact_area;
        assert!(raised < last);
        last = raised;
    }
    assert!((last - 1.0).abs() < 1e-3, "{last}");
}

/// S25: mean contact pressures above 0.8 E*ḡ at all loads; areas up to a factor of three below 2 p*.
#[test]
fn scgw_contact_pressure_is_high() {
    let power = challenge();
    let pressures = [1e-6, 1e-5, 1e-4, 1e-3, 0.01, 0.1, 0.3];
    for (p, t) in pressures.iter().zip(estimates(&of(&power), "scgw", &pressures)) {
        println!(
            "p* {p}: area {:.5}, kappa {:.4}, p_c {:.3}, gap {:.4e}",
            t.contact_area,
            t.contact_area / p,
            p / t.contact_area,
            t.gap
        );
        assert!(p / t.contact_area > 0.8);
        assert!(t.load_error < 1e-9);
    }
    // Independent sums at the reference load: separation of 2.331 rms heights, area 0.693 p*, mean gap 1.83 µm.
    let reference = estimated(&of(&power), "scgw", 0.01);
    assert!(near(reference.contact_area, 0.00693, 0.002) && near(100.0 * reference.gap, 1.83, 0.003), "{reference:?}");
}

/// S25: the area is too small. For a narrow spectrum the mean gap is within 20 % of `bvm` at small loads.
#[test]
fn scgw_underestimates_the_area_of_bvm() {
    /// Areas and mean gaps over those of `bvm`, as evidence/validation-other-methods.md has the areas, printed to two
    /// digits.
    const RATIOS: [(f64, f64, f64); 3] = [(0.003, 0.75, 0.99), (0.02, 0.71, 0.91), (0.1, 0.67, 0.74)];
    const PRINTED: f64 = 6e-3;
    let (grid, heights, power) = resolved();
    for (p, area_ratio, gap_ratio) in RATIOS {
        let pressure = p * power.rms_gradient();
        let solved = solved((grid, &heights), pressure);
        let found = estimated(&of(&power), "scgw", pressure);
        let (area, gap) = (found.contact_area / solved.area, found.gap / solved.mean_gap);
        println!("p* {p}: area x{area:.3}, gap x{gap:.3}");
        assert!((area - area_ratio).abs() < PRINTED && (gap - gap_ratio).abs() < PRINTED, "{area} {gap}");
    }
}

/// Octaves without adhesion give a κ of about 2.3; the load is balanced in all bands.
#[test]
fn ms_archard_area_by_band_ratio() {
    /// κ at p* = 0.001 and 0.01, as measured.
    const KAPPA: [(f64, [f64; 2]); 4] =
        [(1.5, [2.782, 2.782]), (2.0, [2.374, 2.374]), (3.0, [2.084, 2.074]), (5.0, [2.115, 2.088])];
    const PRINTED: f64 = 6e-4;
    let power = challenge();
    for (ratio, kappa) in KAPPA {
        let problem = in_bands(&of(&power), ratio);
        for (p, expected) in [1e-3, 0.01].into_iter().zip(kappa) {
            let t = estimated(&problem, "ms-archard", p);
            println!("ratio {ratio}: p* {p}: kappa {:.3}, gap {:.4e}", t.contact_area / p, t.gap);
            assert!((t.contact_area / p - expected).abs() < PRINTED, "{ratio} {p}: {}", t.contact_area / p);
            assert!(t.load_error < 1e-12);
        }
        assert!(estimated(&adhesive(&problem), "ms-archard", 1e-3).load_error < 1e-12);
    }
}

/// S29: with adhesion the area is slightly high, and jumps to full contact from somewhat above 30 %.
#[test]
fn ms_archard_jumps_into_full_contact() {
    let power = challenge();
    let jump = |ratio: f64| {
        let problem = adhesive(&in_bands(&of(&power), ratio));
        let (mut low, mut high) = (1e-3, 1.0);
        for _ in 0..40 {
            let middle = f64::sqrt(low * high);
            if estimated(&problem, "ms-archard", middle).contact_area < 1.0 { low = middle } else { high = middle }
        }
        (low, estimated(&problem, "ms-archard", low).contact_area, estimated(&problem, "ms-archard", high))
    };
    for ratio in [2.0, 4.0, 5.0, 6.0] {
        let (p, before, after) = jump(ratio);
        println!("ratio {ratio}: from {before:.4} at p* {p:.4}");
        assert_eq!((after.contact_area, after.gap), (1.0, 0.0));
    }
    let (_, before, _) = jump(Settings::default().ms_archard.band_ratio);
    // Measured: 0.359.
    assert!((before - 0.359).abs() < 2e-3, "{before}");
    let reference = [adhesive(&of(&power)), of(&power)].map(|p| estimated(&p, "ms-archard", 0.01).contact_area);
    println!("reference load: {reference:?}");
    // Measured: 3.06 and 2.09 %.
    assert!(near(reference[0], 0.0306, 5e-3) && near(reference[1], 0.0209, 5e-3), "{reference:?}");
}

/// S30: without adhesion full contact is reached below p* = 0.8, determined by the steepest band.
#[test]
fn ms_archard_full_contact_pressure() {
    let power = challenge();
    let (mut low, mut high) = (0.01, 2.0);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if estimated(&of(&power), "ms-archard", middle).gap > 0.0 { low = middle } else { high = middle }
    }
    println!("closed at p* {high:.4}");
    // Measured: 0.691.
    assert!((high - 0.691).abs() < 1e-3 && estimated(&of(&power), "ms-archard", high).contact_area == 1.0);
}

/// S31: at small loads the mean gap of the long waves is within 20 % of that of the surface for all cut-offs; the area
/// is of the order of that of `bvm`.
#[test]
fn rl_archard_gap_agrees_with_bvm() {
    let (grid, heights) = rough(256, 1.0 / 64.0);
    let gradient = PowerSpectrum::from_nodes(grid, &heights).rms_gradient();
    for p in [0.002, 0.01, 0.03] {
        let p = p * gradient;
        let solved = solved((grid, &heights), p);
        for modes in [None, Some(16), Some(24)] {
            let mut problem = ReducedProblem::new(grid, &heights);
            problem.settings.rl_archard.cut_off_modes = modes;
            let found = estimated(&problem, "rl-archard", p);
            println!(
                "{p:.4}, {modes:?}: gap x{:.3}, area x{:.3}",
                found.gap / solved.mean_gap,
                found.contact_area / solved.area
            );
            // Measured: 0.86 to 0.97; the paper has 20 %.
            let gap = found.gap / solved.mean_gap;
            assert!(gap > 0.85 && gap < 0.98, "{gap}");
            // Measured: 0.736 to 0.887.
            assert!(found.contact_area < 0.90 * solved.area && found.contact_area > 0.72 * solved.area);
        }
    }
}

/// For a surface without short waves the mean gap is that of `bvm`. Nodes and series give the same result.
#[test]
fn rl_archard_gap_is_that_of_the_long_waves() {
    let (grid, heights) = rough(128, SHORTEST);
    let solved = solved((grid, &heights), 0.05);
    let of_nodes = estimated(&ReducedProblem::new(grid, &heights), "rl-archard", 0.05);
    // Both grids have four points per shortest wave: agreement to the tolerance of the solvers.
    assert!(near(of_nodes.gap, solved.mean_gap, 1e-5), "{} {}", of_nodes.gap, solved.mean_gap);
    let series = Modes::new(Spectrum { lambda_s: SHORTEST, ..Spectrum::CHALLENGE }, 18, 1.0).series().clone();
    let of_series = estimated(&ReducedProblem::new(grid, method::Heights::Series(&series)), "rl-archard", 0.05);
    assert!(near(of_series.gap, of_nodes.gap, 1e-6) && near(of_series.contact_area, of_nodes.contact_area, 1e-6));
}

/// S30, on the challenge's surface: full contact below p* = 0.8.
#[test]
fn rl_archard_full_contact_pressure() {
    let series = Modes::new(Spectrum::CHALLENGE, 18, 1.0).series().clone();
    let problem = ReducedProblem::new(Grid::unit(2048, 2048), method::Heights::Series(&series));
    let found = estimates(&problem, "rl-archard", &[0.01, 0.8]);
    println!(
        "reference: area {:.4}, gap {:.4e}; at 0.8: {:.4} {:.4e}",
        found[0].contact_area, found[0].gap, found[1].contact_area, found[1].gap
    );
    assert_eq!(found[1].gap, 0.0);
    // Mean gap of the ensemble at the reference load: 0.97 to 0.99 µm with a scatter of 0.03 µm.
    assert!(found[0].gap > 0.0085 && found[0].gap < 0.0115);
    // S28: the mean gap of independent asperities is far too large.
    let power = challenge();
    assert!(estimated(&of(&power), "scgw", 0.01).gap > 1.5 * found[0].gap);
}

/// Numbers of evaluations for the whole spectrum of the challenge, which take far less than a second.
#[test]
fn challenge_spectrum_needs_few_evaluations() {
    let power = challenge();
    assert!(estimated(&of(&power), "persson", 0.01).iterations < 2_000_000);
    assert!(estimated(&adhesive(&of(&power)), "persson", 1e-3).iterations < 400);
    assert!(estimated(&of(&power), "scgw", 0.01).iterations <= 60);
    assert!(estimated(&adhesive(&of(&power)), "ms-archard", 0.01).iterations < 5000);
}

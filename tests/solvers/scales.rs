//! The same contact at heights and pressures of any size, loads of any size, and what is refused.

use crate::found::{near, rough};
use crate::program::{asperity, stderr};
use asperity::contact::interface::{AttractionLaw, Base, Elastic, Layer, NonPeriodic, PenaltyWall, RangeChoice, Wall};
use asperity::contact::method::{
    ContactMethod, ExperimentSettings, Load, MethodKind, NoObserver, Precision, ReducedProblem, Settings, Stop,
};
use asperity::contact::path::{EstimatorInput, LoadPathSolver};
use asperity::methods::{REGISTRY, find};

/// Powers of two from 7e-301 to 1e150. Below, gaps of a millionth of the rms height are subnormal; above, the energy, a
/// product of two heights, overflows.
const EXPONENTS: [i32; 6] = [-995, -300, -40, 30, 200, 498];
/// With adhesion, whose work is a product of two lengths, from 1e-120 to 1e120.
const ADHESIVE_EXPONENTS: [i32; 2] = [-400, 400];
/// Heights that a decimal factor rounds differ by 1e-16. The iterates then differ by the tolerance, 1e-8 of the pressure.
const DECIMAL: f64 = 1e-8;

/// Estimates end at residuals of up to 1e-7 (`icha`, of the approach; measured: 2e-7 of the mean gap), and `srgw` starts
/// its search elsewhere in another unit.
const ESTIMATE: f64 = 1e-6;

/// Mean gaps under pressures of zero and below 1e-9 E* of the same adhesive contact: the residual under zero pressure is 1e-8
/// of the adhesive stress.
const SMALL_LOADS: f64 = 1e-6;

/// Contact fraction, mean gap, largest pressure, all in multiples of the factor.
#[derive(Debug, Clone, PartialEq)]
struct Contact {
    fraction: f64,
    mean_gap: Option<f64>,
    highest: Option<f64>,
}

impl Contact {
    fn is_near(&self, other: &Contact, tolerance: f64) -> bool {
        let same = |a: Option<f64>, b: Option<f64>| a.zip(b).map_or(a == b, |(a, b)| near(a, b, tolerance));
        near(self.fraction, other.fraction, tolerance)
            && same(self.mean_gap, other.mean_gap)
            && same(self.highest, other.highest)
    }
}

/// The contact of a problem whose heights, pressure, adhesion and optical gap are multiplied by a factor.
fn contact(problem: &ReducedProblem, method: &'static dyn ContactMethod, pressure: f64, factor: f64) -> Contact {
    let heights: Vec<f64> = problem.heights.on_nodes(problem.grid).iter().map(|h| h * factor).collect();
    let experiment = ExperimentSettings::default();
    let experiment = ExperimentSettings { optical_gap: experiment.optical_gap * factor, ..experiment };
    let scaled = ReducedProblem {
        heights: (&heights).into(),
        adhesion: problem.adhesion.in_units(1.0 / factor),
        settings: Settings { experiment, ..problem.settings },
        ..problem.clone()
    };
    let loads = [Load::Pressure(pressure * factor)];
    let what = format!("{} at {factor:e}", method.card().id);
    let mut found = None;
    if method.card().kind == MethodKind::Solver {
        let path = LoadPathSolver::new(scaled, method, RangeChoice::Mesh, 0.0, &loads).without_error();
        let ended = path.walk(None, false, &NoObserver, |_, reached| {
            let state = reached.state;
            assert_eq!(state.stop, Stop::Converged, "{what}: {} {}", state.residual, state.load_error);
            assert_eq!((state.load, state.pressure), (loads[0], pressure * factor), "{what}");
            let highest = (0..state.stress.len()).map(|i| state.stress.at(i)).fold(0.0, f64::max);
            let mean_gap = Some(state.mean_gap / factor);
            found = Some(Contact { fraction: reached.area.contact_nodes, mean_gap, highest: Some(highest / factor) });
            Ok(())
        });
        assert!(ended.is_ok(), "{what}: {}", ended.err().map(|e| e.to_string()).unwrap_or_default());
    } else {
        let input = EstimatorInput::new(scaled, method).unwrap_or_else(|e| panic!("{what}: {e}"));
        let ended = input.walk((&loads, 0), &NoObserver, |_, _, e| {
            assert_eq!((e.load, e.pressure), (loads[0], pressure * factor), "{what}");
            let highest = e.stress.map(|s| s.iter().copied().fold(0.0, f64::max) / factor);
            found = Some(Contact { fraction: e.contact_area, mean_gap: e.mean_gap.map(|g| g / factor), highest });
            Ok(())
        });
        assert!(ended.is_ok(), "{what}: {}", ended.err().map(|e| e.to_string()).unwrap_or_default());
    }
    found.unwrap_or_else(|| panic!("{what}: a load"))
}

fn methods() -> impl Iterator<Item = &'static dyn ContactMethod> {
    REGISTRY.iter().copied().filter(|m| !m.card().capabilities.atoms)
}

/// Every registered method finds the same contact, to the last bit for powers of two.
#[test]
fn contact_depends_on_pressure_over_gradient_alone() {
    let (grid, heights) = rough(32, 32, 1.0 / 8.0, 5);
    let problem = ReducedProblem::new(grid, &heights);
    for method in methods() {
        let id = method.card().id;
        let plain = contact(&problem, method, 0.1, 1.0);
        assert!(plain.fraction > 0.05 && plain.fraction < 0.5, "{id}: {plain:?}");
        for exponent in EXPONENTS {
            let other = contact(&problem, method, 0.1, 2f64.powi(exponent));
            match method.card().kind {
                MethodKind::Solver => assert_eq!(other, plain, "{id}: 2^{exponent}"),
                MethodKind::Estimate => {
                    assert!(other.is_near(&plain, ESTIMATE), "{id}: 2^{exponent}: {other:?} {plain:?}")
                }
            }
        }
        for factor in [1e-300, 1e-11, 1e150] {
            let other = contact(&problem, method, 0.1, factor);
            assert!(
                other.is_near(&plain, if method.card().kind == MethodKind::Solver { DECIMAL } else { ESTIMATE }),
                "{id}: {factor:e}: {other:?} {plain:?}"
            );
        }
    }
}

/// Adhesion, soft walls, layers, bodies that are not periodic, and single precision.
#[test]
fn every_kind_of_problem_is_solved_in_its_own_unit() {
    let (grid, heights) = rough(32, 32, 1.0 / 8.0, 5);
    let plain = ReducedProblem::new(grid, &heights);
    let layer = Layer { thickness: 0.1, poisson: 0.3, base: Base::Bonded };
    let body = NonPeriodic::of_region(grid.lx, grid.ly);
    let problems = [
        (ReducedProblem { adhesion: AttractionLaw::exponential(2e-3, 2e-2), ..plain.clone() }, &ADHESIVE_EXPONENTS[..]),
        (ReducedProblem { adhesion: AttractionLaw::dugdale(1e-3, 3e-2), ..plain.clone() }, &ADHESIVE_EXPONENTS[..]),
        (ReducedProblem { wall: Wall::Penalty(PenaltyWall { length: 0.02 }), ..plain.clone() }, &EXPONENTS[..]),
        (ReducedProblem { kernel: Elastic::Layer(layer), ..plain.clone() }, &EXPONENTS[..]),
        (ReducedProblem { kernel: Elastic::NonPeriodic(body), ..plain.clone() }, &EXPONENTS[..]),
        (ReducedProblem { precision: Precision::F32, tolerance: 1e-3, ..plain.clone() }, &EXPONENTS[..]),
    ];
    for (problem, exponents) in problems {
        let mut solved = 0;
        for method in methods().filter(|m| m.card().kind == MethodKind::Solver) {
            // Refused by methods that do not support this kind of problem.
            if method.start(&problem, &NoObserver).is_err() {
                continue;
            }
            solved += 1;
            let what = format!("{} {} {} {}", method.card().id, problem.kernel, problem.adhesion, problem.wall);
            let plain = contact(&problem, method, 0.1, 1.0);
            for &exponent in exponents {
                assert_eq!(contact(&problem, method, 0.1, 2f64.powi(exponent)), plain, "{what}: 2^{exponent}");
            }
        }
        assert!(solved >= 1);
    }
}

/// The mean gap from a millionth of a millionth of the rms height to ten: imposed to the relative error that the load
/// has, and the pressure falls as it grows.
#[test]
fn mean_gaps_of_any_size_are_imposed() {
    /// Relative error of an imposed mean gap at the default tolerance, and the slack of the check.
    const IMPOSED: f64 = 1.1e-9;
    let (grid, heights) = rough(32, 32, 1.0 / 8.0, 5);
    let problem = ReducedProblem { max_iterations: 20_000, ..ReducedProblem::new(grid, &heights) };
    let rms = problem.heights.rms();
    for factor in [1.0, 2f64.powi(-40)] {
        let heights: Vec<f64> = heights.iter().map(|h| h * factor).collect();
        let scaled = ReducedProblem { heights: (&heights).into(), ..problem.clone() };
        let gaps = [1e-12, 1e-10, 1e-8, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 0.5, 1.0, 3.0, 10.0];
        let loads = gaps.map(|g| Load::MeanGap(g * rms * factor));
        let mut last = f64::INFINITY;
        LoadPathSolver::new(scaled, find("fast").unwrap(), RangeChoice::Mesh, 0.0, &loads)
            .without_error()
            .walk(None, false, &NoObserver, |i, reached| {
                let state = reached.state;
                let Load::MeanGap(target) = loads[i] else { unreachable!("mean gaps") };
                assert_eq!(state.stop, Stop::Converged, "{}: {}", gaps[i], state.residual);
                assert!(near(state.mean_gap, target, IMPOSED), "{}: {}", gaps[i], state.mean_gap);
                assert!(state.load_error <= IMPOSED, "{}: {}", gaps[i], state.load_error);
                assert!(state.pressure <= last * (1.0 + DECIMAL), "{}: {} {last}", gaps[i], state.pressure);
                last = state.pressure;
                Ok(())
            })
            .expect("solved");
    }
}

/// Loads so small that rounding of the heights hides them are never reported as solved with another pressure.
#[test]
fn small_loads_are_solved_or_reported() {
    let (grid, heights) = rough(16, 16, 1.0 / 4.0, 5);
    let body = Elastic::NonPeriodic(NonPeriodic::of_region(grid.lx, grid.ly));
    for kernel in [Elastic::HalfSpace, body] {
        let problem = ReducedProblem { kernel, max_iterations: 300, ..ReducedProblem::new(grid, &heights) };
        for method in methods().filter(|m| m.card().kind == MethodKind::Solver) {
            let Ok(started) = method.start(&problem, &NoObserver) else { continue };
            let mut run = started.solver().expect("a solver");
            for pressure in [1e-9, 1e-13, 1e-15, 1e-30] {
                let state = run.equilibrate(Load::Pressure(pressure)).expect("solved");
                let carried = state.stress.to_vec().iter().sum::<f64>() / grid.points() as f64;
                let what = format!("{} {kernel} {pressure:e}: {}, {carried:e}", method.card().id, state.stop);
                assert!(state.stop != Stop::Converged || near(carried, pressure, DECIMAL), "{what}");
                assert!(state.stop == Stop::Converged || state.residual.is_nan() || state.residual > 1e-8, "{what}");
            }
        }
    }
}

/// A pressure whose stress the rounding of the heights exceeds is refused before the solve; above the limit it is solved
/// to a tolerance that rounding permits.
#[test]
fn pressures_below_rounding_are_refused() {
    let (grid, heights) = rough(32, 32, 1.0 / 8.0, 5);
    let body = Elastic::NonPeriodic(NonPeriodic::of_region(grid.lx, grid.ly));
    for kernel in [Elastic::HalfSpace, body] {
        let problem = ReducedProblem { kernel, tolerance: 1e-5, ..ReducedProblem::new(grid, &heights) };
        let least = problem.least_pressure(problem.heights.rms());
        let walk = |pressure: f64| {
            let loads = [Load::Pressure(pressure)];
            let path = LoadPathSolver::new(problem.clone(), find("fast").unwrap(), RangeChoice::Mesh, 0.0, &loads);
            path.walk(None, false, &NoObserver, |_, reached| {
                assert_eq!(reached.state.stop, Stop::Converged, "{kernel}: {}", reached.state.residual);
                Ok(())
            })
        };
        walk(1.01 * least).unwrap_or_else(|e| panic!("{kernel}: {e}"));
        walk(0.0).unwrap_or_else(|e| panic!("{kernel}: {e}"));
        let error = walk(0.5 * least).expect_err("refused").to_string();
        assert!(error.starts_with("problem: pressure = ") && error.contains("at least"), "{kernel}: {error}");
    }
}

/// With adhesion the contact under small pressures of either sign is that of no pressure.
#[test]
fn small_loads_on_adhesive_contact_are_solved() {
    let (grid, heights) = rough(32, 32, 1.0 / 8.0, 5);
    let problem =
        ReducedProblem { adhesion: AttractionLaw::exponential(2e-3, 2e-2), ..ReducedProblem::new(grid, &heights) };
    for id in ["fast", "bvm"] {
        let mean_gaps = [0.0, 1e-14, 1e-12, -1e-11, 1e-10, 1e-9, -1e-9].map(|pressure| {
            let started = find(id).unwrap().start(&problem, &NoObserver).expect("started");
            let mut run = started.solver().expect("a solver");
            let state = run.equilibrate(Load::Pressure(pressure)).expect("solved");
            assert_eq!(state.stop, Stop::Converged, "{id} {pressure:e}: {}", state.residual);
            state.mean_gap
        });
        assert!(mean_gaps.iter().all(|g| near(*g, mean_gaps[0], SMALL_LOADS)), "{id}: {mean_gaps:?}");
    }
}

/// Values that over- or underflow in reduced units: one line that names the flag.
#[test]
fn values_out_of_range_are_refused() {
    let scratch = tempfile::tempdir().expect("scratch");
    let map = scratch.path().join("map.txt");
    std::fs::write(&map, "0 1 0\n1 2 1\n0 1 3\n").expect("written");
    let cases: [(&[&str], &str); 9] = [
        (&["--pressure", "1e-18", "--modulus", "1"], "pressure = 1e-18;"),
        (&["--pressure", "1e308", "--modulus", "1e-10"], "--pressure = 1e308"),
        (&["--pressure", "1e-308", "--modulus", "1e10"], "--pressure = 1e-308"),
        (&["--pressure", "1", "--modulus", "5e-324"], "--modulus = 5e-324"),
        (&["--pressure", "1", "--modulus", "1e200", "--length", "1e200"], "--modulus = 1e200"),
        (&["--mean-gap", "1.7e308", "--modulus", "1"], "mean gap = 1.7e308"),
        (&["--mean-gap", "1.7e308", "--modulus", "1", "--length", "1e-3"], "--mean-gap = 1.7e308"),
        (&["--pressure", "1e200", "--modulus", "1"], "pressure = 1e200"),
        (
            &["--pressure", "1", "--modulus", "1e200", "--work-of-adhesion", "1e-200", "--range", "1"],
            "--work-of-adhesion = 1e-200",
        ),
    ];
    for (flags, says) in cases {
        let length: &[&str] = if flags.contains(&"--length") { &[] } else { &["--length", "1"] };
        let mut command = asperity();
        command.arg("solve").arg(&map).args(["--touching", "low-points"]).args(length).args(flags);
        let output = command.output().expect("started");
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{flags:?}: {text}");
        let errors: Vec<&str> = text.lines().filter(|l| l.contains("error")).collect();
        assert!(errors.len() == 1 && errors[0].contains(says) && errors[0].contains("accepted"), "{flags:?}: {text}");
    }
}

/// Heights that are no numbers.
#[test]
fn heights_that_are_none_are_refused() {
    for heights in [[0.0, f64::NAN], [0.0, f64::INFINITY]] {
        let problem = ReducedProblem::new(asperity::grid::Grid::unit(2, 1), &heights[..]);
        let loads = [Load::Pressure(0.1)];
        let path = LoadPathSolver::new(problem, find("fast").unwrap(), RangeChoice::Mesh, 0.0, &loads);
        let error = path.walk(None, false, &NoObserver, |_, _| Ok(())).expect_err("refused").to_string();
        assert!(error.starts_with("problem: heights = an rms of"), "{heights:?}: {error}");
    }
}

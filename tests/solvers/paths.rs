//! Load paths: branches, discretisation errors, pull-off, and continuation after an interruption.

use asperity::contact::interface::{
    AttractionLaw, COHESIVE_RESOLUTION, HardnessMap, Law, NodalHardness, PenaltyWall, RangeChoice, Wall,
};
use asperity::contact::method::{
    Heights, Iteration, Load, NoObserver, Observer, Precision, ReducedProblem, SnapshotRef, SolverSnapshot, Stop,
};
use asperity::contact::path::{InitialState, LoadPathSolver};
use asperity::contact::results::PullOff;
use asperity::grid::Grid;
use asperity::grid::sys::ranks::on_threads;
use asperity::methods;
use asperity::surface::{Modes, Spectrum};
use std::f64::consts::PI;
use std::ops::ControlFlow;
use std::sync::Mutex;
use std::sync::atomic::{AtomicI64, Ordering};

/// Challenge-like adhesion for a surface with waves down to L/16.
const GAMMA: f64 = 9e-4;

fn spectrum(short: f64) -> Spectrum {
    Spectrum { lambda_s: short, ..Spectrum::CHALLENGE }
}

fn problem(grid: Grid, heights: Heights<'_>, adhesion: AttractionLaw) -> ReducedProblem<'_> {
    ReducedProblem { adhesion, tolerance: 1e-6, max_iterations: 5_000, ..ReducedProblem::new(grid, heights) }
}

/// Results that the tests compare.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Found {
    area: f64,
    mean_gap: f64,
    pressure: f64,
    energy: f64,
    discretisation: Option<(f64, f64)>,
    /// Value and error.
    true_area: Option<(f64, f64)>,
    true_gap: Option<(f64, f64)>,
}

fn walk(
    problem: &ReducedProblem,
    id: &str,
    range: RangeChoice,
    loads: &[Load],
    pulls: bool,
) -> (Vec<Found>, Option<PullOff>) {
    let path = LoadPathSolver::new(problem.clone(), methods::find(id).expect("a method"), range, 0.0, loads);
    let mut found = Vec::new();
    let pulled = path.walk(None, pulls, &NoObserver, |_, reached| {
        let state = &reached.state;
        assert_eq!(state.stop, Stop::Converged, "{id} at {:?}", state.load);
        found.push(Found {
            area: reached.area.contact_area,
            mean_gap: state.mean_gap,
            pressure: state.pressure,
            energy: state.energy,
            discretisation: reached.discretisation.and_then(|d| Some((d.area?, d.mean_gap.unwrap_or(0.0)))),
            true_area: reached.extrapolated.map(|e| (e.area.value, e.area.error)),
            true_gap: reached.extrapolated.and_then(|e| e.mean_gap).map(|g| (g.value, g.error)),
        });
        Ok(())
    });
    (found, pulled.expect("the path is walked"))
}

/// The error by the grid with half the points per side has the magnitude of the discretisation error, for all
/// methods, with and without adhesion, at every load.
#[test]
fn the_error_of_the_grid_is_reported() {
    /// Smallest ratio of change to error. The change may exceed the error if the error decreases fast. The next finer
    /// grid, which serves as reference, has an error itself.
    const AT_LEAST: f64 = 0.5;
    let modes = Modes::new(spectrum(1.0 / 16.0), 3, 1.0).series().clone();
    let loads = [0.01, 0.05].map(Load::Pressure);
    let adhesion = AttractionLaw::exponential(GAMMA, COHESIVE_RESOLUTION * (GAMMA / 64.0).sqrt());
    for (adhesion, ids) in [(AttractionLaw::None, &["fast", "bvm"][..]), (adhesion, &["fast", "gfmd"][..])] {
        for id in ids {
            let on = |n: usize| {
                let p = problem(Grid::unit(n, n), Heights::Series(&modes), adhesion);
                walk(&p, id, RangeChoice::Mesh, &loads, false).0
            };
            for (coarse, fine) in on(128).iter().zip(on(512)) {
                let (area, gap) = coarse.discretisation.expect("both grids converge");
                let error = ((coarse.area / fine.area - 1.0).abs(), (coarse.mean_gap / fine.mean_gap - 1.0).abs());
                // The error of the gap is at least twice its change.
                assert!(area < 0.3 && gap / 2.0 < 0.0145, "{id}: {area} {gap}");
                assert!(error.0 * AT_LEAST < area, "{id}: area {error:?} {area}");
                assert!(error.1 * AT_LEAST < gap, "{id}: mean gap {error:?} {gap}");
            }
        }
    }
}

/// The extrapolation from three grids, each with the range that it resolves, agrees with a grid that resolves the
/// requested range.
#[test]
fn the_true_range_is_extrapolated_to() {
    let modes = Modes::new(spectrum(1.0 / 16.0), 3, 1.0).series().clone();
    // A grid of 1024 points resolves the range; 256, 128 and 64 points use 2, 2.8 and 4 times the range.
    let rho = COHESIVE_RESOLUTION * (GAMMA / 1024.0).sqrt();
    let adhesion = AttractionLaw::exponential(GAMMA, rho);
    let load = [Load::Pressure(0.02)];
    let on = |n: usize, range: RangeChoice| {
        let p = problem(Grid::unit(n, n), Heights::Series(&modes), adhesion);
        walk(&p, "fast", range, &load, false).0[0]
    };
    let fine_grid = on(1024, RangeChoice::Extrapolate);
    assert_eq!(fine_grid.true_area, None, "a grid that resolves the range has nothing to extrapolate");
    let (coarse, mesh) = (on(256, RangeChoice::Extrapolate), on(256, RangeChoice::Mesh));
    assert_eq!((coarse.area, coarse.mean_gap), (mesh.area, mesh.mean_gap));
    for (name, found, finest, fine_grid) in [
        ("area", coarse.true_area, coarse.area, fine_grid.area),
        ("mean gap", coarse.true_gap, coarse.mean_gap, fine_grid.mean_gap),
    ] {
        let (value, error) = found.expect("it is extrapolated");
        // The value is closer to the reference than the finest grid, and its error covers the deviation.
        assert!((value - fine_grid).abs() < 0.5 * (finest - fine_grid).abs(), "{name}: {value} {finest} {fine_grid}");
        assert!((value - fine_grid).abs() < error, "{name}: {value} ± {error}, {fine_grid}");
    }
}

/// With adhesion, unloading gives more contact at the same load than loading, in the less stable state of higher
/// energy. Without adhesion the branches coincide.
#[test]
fn branches_are_followed() {
    let modes = Modes::new(spectrum(1.0 / 8.0), 3, 1.0).series().clone();
    let grid = Grid::unit(64, 64);
    let loads = [0.005, 0.1, 0.005].map(Load::Pressure);
    let adhesion = AttractionLaw::exponential(2e-3, 3e-3);
    let p = problem(grid, Heights::Series(&modes), adhesion);
    let (sticky, _) = walk(&p, "fast", RangeChoice::True, &loads, false);
    assert!(sticky[2].area > 2.0 * sticky[0].area && sticky[0].energy < sticky[2].energy, "{sticky:?}");
    let p = problem(grid, Heights::Series(&modes), AttractionLaw::None);
    let (dry, _) = walk(&p, "fast", RangeChoice::True, &loads, false);
    assert_eq!(dry[0].area, dry[2].area);
}

/// After these loads, 97 % of a pull-off is sustained, and 103 % is not.
fn bounds_the_load(problem: &ReducedProblem, pulled: &PullOff, path: &[f64]) {
    for (share, expected) in [(0.97, Stop::Converged), (1.03, Stop::Detached)] {
        let mut run = methods::find("fast")
            .expect("it is there")
            .start(problem, &NoObserver)
            .expect("it starts")
            .solver()
            .expect("it starts");
        let loads = path.iter().map(|load| (*load, Stop::Converged)).chain([(share * pulled.pressure, expected)]);
        for (load, expected) in loads {
            let state = run.equilibrate(Load::Pressure(load)).expect("a load");
            assert_eq!(state.stop, expected, "{load} {pulled:?}");
        }
    }
}

/// Surfaces that attraction has closed everywhere open where the contact stress is lowest: the pull-off lies between the tension at
/// which the first node opens, the attraction at contact less the highest stress that the roughness needs, and that attraction.
#[test]
fn closed_surfaces_are_pulled_off() {
    let (grid, gamma) = (Grid::unit(48, 48), 4e-3);
    let law = AttractionLaw::exponential(gamma, COHESIVE_RESOLUTION * (gamma / 48.0f64).sqrt());
    let attraction = law.traction(0.0);
    let wave = |i: usize, amplitude: f64| amplitude * (2.0 * PI * (i % 48) as f64 / 48.0).cos();
    for amplitude in [0.0, 0.001, 0.005] {
        let heights: Vec<f64> = (0..grid.points()).map(|i| wave(i, amplitude)).collect();
        let p = problem(grid, Heights::Nodes(&heights), law);
        let (found, pulled) = walk(&p, "fast", RangeChoice::Mesh, &[Load::Pressure(0.0)], true);
        let pulled = pulled.expect("it was requested for");
        let tension = -pulled.pressure / attraction;
        let first = 1.0 - PI * amplitude / attraction;
        /// What the search leaves unresolved.
        const RESOLVED: f64 = 1e-3;
        assert_eq!(found[0].mean_gap, 0.0, "{amplitude}");
        assert!((first - RESOLVED..=1.0 + RESOLVED).contains(&tension), "{amplitude}: {tension}, {first}");
        bounds_the_load(&p, &pulled, &[0.0]);
    }
}

/// Nodes behind a soft wall are never closed, and its gaps may be negative.
#[test]
fn soft_walls_are_pulled_off() {
    let (grid, gamma) = (Grid::unit(48, 48), 4e-3);
    let modes = Modes::new(spectrum(1.0 / 8.0), 3, 1.0).series().clone();
    let law = AttractionLaw::exponential(gamma, COHESIVE_RESOLUTION * (gamma / 48.0f64).sqrt());
    for length in [0.3, 0.02] {
        let wall = Wall::Penalty(PenaltyWall { length });
        let p = ReducedProblem { wall, ..problem(grid, Heights::Series(&modes), law) };
        let (_, pulled) = walk(&p, "fast", RangeChoice::Mesh, &[Load::Pressure(0.3)], true);
        let pulled = pulled.expect("it was requested for");
        bounds_the_load(&p, &pulled, &[0.3, 0.1, 0.0, 0.5 * pulled.pressure]);
    }
}

/// Nearly all nodes of a compressed soft wall are in contact, and none is held there.
#[test]
fn gaps_of_a_compressed_soft_wall_are_imposed() {
    /// Of the pressure at an imposed mean gap, over that from which it came: the tolerance of the residual.
    const TOLERANCE: f64 = 1e-5;
    let (grid, gamma, pressure) = (Grid::unit(48, 48), 4e-3, 0.08);
    let modes = Modes::new(spectrum(1.0 / 8.0), 3, 1.0).series().clone();
    let law = AttractionLaw::exponential(gamma, COHESIVE_RESOLUTION * (gamma / 48.0f64).sqrt());
    for length in [0.02, 0.01] {
        let wall = Wall::Penalty(PenaltyWall { length });
        let p = ReducedProblem { wall, ..problem(grid, Heights::Series(&modes), law) };
        let loads = |gap: Option<f64>| [Some(Load::Pressure(pressure)), gap.map(Load::MeanGap)].into_iter().flatten();
        let pressed = walk(&p, "fast", RangeChoice::Mesh, &loads(None).collect::<Vec<_>>(), false).0[0];
        // Further apart by a tenth, and back.
        let path: Vec<Load> = [1.1, 1.0].iter().flat_map(|f| loads(Some(f * pressed.mean_gap))).collect();
        let held = walk(&p, "fast", RangeChoice::Mesh, &path, false).0;
        assert!(pressed.area > 0.5 && pressed.mean_gap > 0.0, "{pressed:?}");
        let last = held[held.len() - 1].pressure;
        assert!((last / pressure - 1.0).abs() < TOLERANCE, "{length}: {last}");
    }
}

/// A long range and a small work of adhesion: contacts carry far more than the attraction, and the tension stays close to its maximum
/// long after the last contact has opened. The search still ends.
#[test]
fn a_long_range_needs_few_states() {
    /// Measured: 159. The search ends by force at 400.
    const MOST: usize = 250;
    let grid = Grid::unit(48, 48);
    let modes = Modes::new(spectrum(1.0 / 8.0), 3, 1.0).series().clone();
    let p = problem(grid, Heights::Series(&modes), AttractionLaw::exponential(1e-7, 0.05));
    let (_, pulled) = walk(&p, "fast", RangeChoice::Mesh, &[Load::Pressure(0.01)], true);
    let pulled = pulled.expect("it was requested for");
    assert!(pulled.curve.len() < MOST, "{}", pulled.curve.len());
    bounds_the_load(&p, &pulled, &[0.01, 0.001, 0.5 * pulled.pressure]);
}

/// The maximum tension is confirmed by load control: there is an equilibrium just below it, and the surfaces separate
/// just above.
#[test]
fn pulled_apart() {
    let modes = Modes::new(spectrum(1.0 / 8.0), 3, 1.0).series().clone();
    let grid = Grid::unit(64, 64);
    let gamma = 4e-3;
    let adhesion = AttractionLaw::exponential(gamma, COHESIVE_RESOLUTION * (gamma / 64.0f64).sqrt());
    let p = problem(grid, Heights::Series(&modes), adhesion);
    let (found, pulled) = walk(&p, "fast", RangeChoice::Mesh, &[Load::Pressure(0.01)], true);
    let pulled = pulled.expect("it was requested for");
    assert!(pulled.pressure < 0.0 && pulled.mean_gap > found[0].mean_gap, "{pulled:?}");
    assert!(pulled.curve.iter().all(|[_, p]| *p >= pulled.pressure));
    assert!(pulled.curve.windows(2).all(|w| w[0][0] < w[1][0]));
    // The error follows from the grid with half the points per side.
    assert_eq!(pulled.coarser, Some([32, 32]));
    let fine = |n: usize| {
        let adhesion = AttractionLaw::exponential(gamma, COHESIVE_RESOLUTION * (gamma / n as f64).sqrt());
        let p = problem(Grid::unit(n, n), Heights::Series(&modes), adhesion);
        walk(&p, "fast", RangeChoice::Mesh, &[Load::Pressure(0.01)], true).1.expect("requested for")
    };
    let (coarser, finer) = (fine(32), fine(128));
    // Three times the change, and what the search leaves.
    let error = pulled.pressure_error.expect("a coarser grid");
    let change = (pulled.pressure - coarser.pressure).abs();
    assert!((error / (3.0 * change) - 1.0).abs() < 1e-2, "{error} {coarser:?}");
    assert!((pulled.pressure - finer.pressure).abs() < error, "{} ± {error}, {}", pulled.pressure, finer.pressure);
    bounds_the_load(&p, &pulled, &[0.01, 0.5 * pulled.pressure]);
    // A load next to the maximum tension, closer than the first step of the mean gap, gives the same result. Beyond the
    // maximum the search is refused.
    let near = [0.01, 0.5 * pulled.pressure, 0.97 * pulled.pressure, 0.99 * pulled.pressure].map(Load::Pressure);
    let (_, again) = walk(&p, "fast", RangeChoice::Mesh, &near, true);
    assert!((again.expect("requested for").pressure / pulled.pressure - 1.0).abs() < 0.01);
    let behind = [0.0, 3.0 * (pulled.mean_gap - found[0].mean_gap)].map(|d| Load::MeanGap(found[0].mean_gap + d));
    let path =
        LoadPathSolver::new(p.clone(), methods::find("fast").expect("it is there"), RangeChoice::Mesh, 0.0, &behind);
    let refused = path.walk(None, true, &NoObserver, |_, _| Ok(())).expect_err("refused").to_string();
    assert!(refused.contains("from which on it falls"), "{refused}");
    // Without adhesion there is no pull-off.
    let p = problem(grid, Heights::Series(&modes), AttractionLaw::None);
    let path = LoadPathSolver::new(p, methods::find("fast").expect("it is there"), RangeChoice::Mesh, 0.0, &[]);
    assert!(path.walk(None, true, &NoObserver, |_, _| Ok(())).expect("no load, no search").is_none());
}

/// Once armed, stops after a number of iterations and stores the snapshot.
#[derive(Default)]
struct Stopper {
    /// Remaining iterations; negative if not armed.
    left: AtomicI64,
    kept: Mutex<Option<SolverSnapshot>>,
}

impl Observer for Stopper {
    fn iteration(&self, _: Iteration) -> ControlFlow<()> {
        match self.left.load(Ordering::Relaxed) {
            0 => return ControlFlow::Break(()),
            1.. => self.left.fetch_sub(1, Ordering::Relaxed),
            _ => 0,
        };
        ControlFlow::Continue(())
    }

    fn snapshot(&self, s: SnapshotRef) {
        let (gap, auxiliary) = (s.gap.to_vec(), s.auxiliary.map(|b| b.to_vec()));
        let plastic = s.plastic.map(|p| p.to_vec());
        // Numbers pass through JSON text, as in a checkpoint.
        let progress = serde_json::from_str(&s.progress.to_string()).expect("JSON");
        *self.kept.lock().expect("one thread") =
            Some(SolverSnapshot { grid: s.grid, gap, auxiliary, plastic, progress });
    }
}

/// Asks to stop from a number of iterations on, but lets them go on.
struct Late {
    seen: AtomicI64,
    after: i64,
}

impl Observer for Late {
    fn iteration(&self, _: Iteration) -> ControlFlow<()> {
        self.seen.fetch_add(1, Ordering::Relaxed);
        ControlFlow::Continue(())
    }

    fn stop_requested(&self) -> bool {
        self.seen.load(Ordering::Relaxed) >= self.after
    }
}

/// A stop while the stiffness or the errors of a converged load are computed leaves no load without them.
#[test]
fn a_load_is_complete_or_not_there() {
    let modes = Modes::new(spectrum(1.0 / 32.0), 3, 1.0).series().clone();
    let grid = Grid { nx: 128, ny: 96, lx: 1.0, ly: 0.75 };
    for id in ["fast", "bvm"] {
        let heights = Heights::Series(&modes);
        let p = ReducedProblem { stiffness: true, tolerance: 1e-3, ..problem(grid, heights, AttractionLaw::None) };
        let loads = [0.02, 0.03].map(Load::Pressure);
        let path = LoadPathSolver::new(p, methods::find(id).expect("it is there"), RangeChoice::Mesh, 0.0, &loads);
        let visited = |after: i64| {
            let (late, mut complete) = (Late { seen: AtomicI64::new(0), after }, Vec::new());
            let _ = path.walk(None, false, &late, |_, reached| {
                let converged = reached.state.stop == Stop::Converged;
                complete
                    .extend(converged.then_some(reached.state.stiffness.is_some() && reached.discretisation.is_some()));
                Ok(())
            });
            (complete, late.seen.into_inner())
        };
        let (whole, iterations) = visited(i64::MAX);
        assert_eq!(whole, [true, true], "{id}");
        // The last iterations of the second load are followed by its stiffness and errors.
        for left in 0..4 {
            let (complete, _) = visited(iterations - left);
            assert_eq!(complete, [true], "{id}: stopped {left} iterations before the end");
        }
    }
}

/// Requests a stop after it was polled some times.
struct Polled {
    polls: AtomicI64,
    after: i64,
}

impl Observer for Polled {
    fn iteration(&self, _: Iteration) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    fn stop_requested(&self) -> bool {
        self.polls.fetch_add(1, Ordering::Relaxed) >= self.after
    }
}

/// Likewise on several ranks, of which the first one's stop counts, at any time: none goes on where another ends.
#[test]
fn a_load_is_complete_on_every_rank_or_on_none() {
    let modes = Modes::new(spectrum(1.0 / 32.0), 3, 1.0).series().clone();
    let (grid, loads) = (Grid { nx: 128, ny: 96, lx: 1.0, ly: 0.75 }, [Load::Pressure(0.03)]);
    let fast = methods::find("fast").expect("it is there");
    let visited = |stops: [i64; 2]| {
        on_threads(2, |ranks| {
            let polled = Polled { polls: AtomicI64::new(0), after: stops[ranks.own()] };
            let heights = Heights::Series(&modes);
            let p = ReducedProblem { stiffness: true, tolerance: 1e-3, ..problem(grid, heights, AttractionLaw::None) };
            let p = ReducedProblem { ranks: &ranks, ..p };
            let mut complete = Vec::new();
            let path = LoadPathSolver::new(p, fast, RangeChoice::Mesh, 0.0, &loads);
            let _ = path.walk(None, false, &polled, |_, reached| {
                let converged = reached.state.stop == Stop::Converged;
                complete
                    .extend(converged.then_some(reached.state.stiffness.is_some() && reached.discretisation.is_some()));
                Ok(())
            });
            (complete, polled.polls.into_inner())
        })
    };
    let whole = visited([i64::MAX; 2]);
    assert!(whole.iter().all(|(complete, _)| *complete == [true]), "{whole:?}");
    for stop in 0..whole[0].1 {
        let stopped = visited([stop, i64::MAX]);
        assert!(stopped.iter().all(|(complete, _)| complete.is_empty()), "at poll {stop}: {stopped:?}");
    }
    // That of another rank does not count.
    assert!(visited([i64::MAX, 3]).iter().all(|(complete, _)| *complete == [true]));
}

/// Errors by the grid are those of both directions, also of oblong grids, and of every method alike.
#[test]
fn the_coarser_grid_has_half_the_points_along_both_sides() {
    let modes = Modes::new(spectrum(1.0 / 16.0), 3, 0.5).series().clone();
    for (nx, ny) in [(128, 64), (256, 32), (64, 160), (128, 16)] {
        let grid = Grid { nx, ny, lx: 1.0, ly: 0.5 };
        for id in ["fast", "gfmd"] {
            let p = ReducedProblem { tolerance: 1e-6, ..problem(grid, Heights::Series(&modes), AttractionLaw::None) };
            let loads = [Load::Pressure(0.02)];
            let path = LoadPathSolver::new(p, methods::find(id).expect("it is there"), RangeChoice::Mesh, 0.0, &loads);
            let visited = path.walk(None, false, &NoObserver, |_, reached| {
                let coarser = reached.discretisation.expect("errors by the grid").coarser;
                assert_eq!(coarser, [nx / 2, ny / 2], "{id}: {nx} x {ny}");
                Ok(())
            });
            visited.expect("a path");
        }
    }
}

/// A solve continued from a snapshot that was written and read as JSON is bit-identical to an uninterrupted one: for
/// all points of interruption, under pressure and mean-gap control, in both precisions, in the first and in a later
/// load of a path.
#[test]
fn a_resumed_solve_has_the_same_bits() {
    let modes = Modes::new(spectrum(1.0 / 32.0), 3, 1.0).series().clone();
    let grid = Grid { nx: 256, ny: 192, lx: 1.0, ly: 0.75 };
    let gamma: f64 = 4e-4;
    let sticky = AttractionLaw::exponential(gamma, COHESIVE_RESOLUTION * (gamma / 256.0).sqrt());
    let elastic = [
        ("fast", AttractionLaw::None, Precision::F64, vec![Load::Pressure(0.02)]),
        ("fast", sticky, Precision::F64, vec![Load::Pressure(0.03), Load::Pressure(0.01)]),
        ("fast", sticky, Precision::F32, vec![Load::Pressure(0.02)]),
        ("fast", sticky, Precision::F64, vec![Load::MeanGap(0.02), Load::MeanGap(0.03)]),
        ("bvm", AttractionLaw::None, Precision::F64, vec![Load::Pressure(0.02)]),
        ("bvm", sticky, Precision::F64, vec![Load::Pressure(0.03), Load::Pressure(0.01)]),
        ("bvm", AttractionLaw::None, Precision::F32, vec![Load::Pressure(0.02)]),
        ("gfmd", AttractionLaw::None, Precision::F64, vec![Load::Pressure(0.03), Load::Pressure(0.02)]),
        ("gfmd", sticky, Precision::F32, vec![Load::Pressure(0.02)]),
    ];
    let two = (0..grid.points()).map(|i| if i % grid.nx < 100 { 0.25 } else { 0.35 }).collect();
    let map = HardnessMap::new(grid.nx, grid.ny, two).expect("positive");
    let yielding =
        [("fast", 0.3.into()), ("bvm", 0.3.into()), ("gfmd", 0.3.into()), ("fast", NodalHardness::from(&map))].map(
            |(id, h)| (Some(h), (id, AttractionLaw::None, Precision::F64, [0.03, 0.04].map(Load::Pressure).to_vec())),
        );
    for (hardness, (id, adhesion, precision, path)) in elastic.map(|case| (None, case)).into_iter().chain(yielding) {
        let method = methods::find(id).expect("it is there");
        // The paper's own methods take hundreds of iterations; a comparison of bits does not need the last ones.
        let tolerance = if precision == Precision::F32 || id != "fast" { 1e-2 } else { 1e-7 };
        let p = ReducedProblem { precision, tolerance, hardness, ..problem(grid, Heights::Series(&modes), adhesion) };
        let mut run = method.start(&p, &NoObserver).expect("it starts").solver().expect("it starts");
        let (last, before) = path.split_last().expect("a load");
        for load in before {
            run.equilibrate(*load).expect("a load");
        }
        let whole = run.equilibrate(*last).expect("a load");
        let (gap, stress, iterations) = (whole.gap.to_vec(), whole.stress.to_vec(), whole.iterations);
        let work = (iterations, whole.fft_pairs);
        let plastic = whole.plastic.map(|p| p.to_vec());
        assert_eq!(plastic.is_some(), hardness.is_some());
        for share in [0.0, 0.3, 0.6, 0.9] {
            let after = (share * iterations as f64) as i64;
            let stopper = Stopper { left: AtomicI64::new(-1), ..Stopper::default() };
            let mut run = method.start(&p, &stopper).expect("it starts").solver().expect("it starts");
            for load in before {
                run.equilibrate(*load).expect("a load");
            }
            stopper.left.store(after, Ordering::Relaxed);
            let stopped = run.equilibrate(*last).expect("a load");
            assert_eq!(stopped.stop, Stop::Interrupted, "{id} {adhesion:?} {last:?} after {after}");
            drop(run);
            let kept = stopper.kept.into_inner().expect("one thread").expect("a snapshot");
            let mut run = method.start(&p, &NoObserver).expect("it starts").solver().expect("it starts");
            run.resume(kept).expect("its own snapshot");
            let state = run.equilibrate(*last).expect("a load");
            assert_eq!(state.stop, Stop::Converged);
            assert!(
                state.gap.to_vec() == gap
                    && state.stress.to_vec() == stress
                    && state.plastic.map(|p| p.to_vec()) == plastic,
                "{id} {adhesion:?} {last:?} after {after}"
            );
            assert_eq!((state.iterations, state.fft_pairs), work, "{id} {adhesion:?} {last:?} after {after}");
        }
    }
}

/// The stated errors of a load that was interrupted, on any grid, are those of an uninterrupted one: the results of coarser grids are
/// in the snapshot.
#[test]
fn errors_do_not_change_by_an_interruption() {
    let modes = Modes::new(spectrum(1.0 / 32.0), 3, 1.0).series().clone();
    let grid = Grid { nx: 256, ny: 192, lx: 1.0, ly: 0.75 };
    let gamma: f64 = 4e-4;
    let sticky = AttractionLaw::exponential(gamma, COHESIVE_RESOLUTION * (gamma / 256.0).sqrt());
    let fast = methods::find("fast").expect("it is there");
    let soft = Wall::Penalty(PenaltyWall { length: 1e-4 });
    for (adhesion, wall, hardness, load) in [
        (AttractionLaw::None, Wall::Hard, None, 0.02),
        (AttractionLaw::None, Wall::Hard, Some(0.3.into()), 0.04),
        (AttractionLaw::None, soft, None, 0.02),
        (sticky, Wall::Hard, None, 0.02),
    ] {
        let p = ReducedProblem {
            tolerance: 1e-6,
            wall,
            hardness,
            stiffness: true,
            ..problem(grid, Heights::Series(&modes), adhesion)
        };
        let loads = [Load::Pressure(load)];
        let path = LoadPathSolver::new(p, fast, RangeChoice::Mesh, 0.0, &loads);
        let stated = |begin: Option<InitialState>, observer: &dyn Observer| {
            let mut found = None;
            let ended = path.walk(begin, false, observer, |_, reached| {
                let errors = format!("{:?} {:?}", reached.discretisation, reached.uncertainty);
                let bits = (reached.state.gap.to_vec(), reached.state.error_estimates);
                found = Some((errors, reached.state.iterations, bits));
                Ok(())
            });
            (found, ended.is_ok())
        };
        let (whole, _) = stated(None, &NoObserver);
        let (errors, iterations, bits) = whole.expect("a state");
        assert!(errors.contains("Some"), "{errors}");
        for share in [0.05, 0.3, 0.6, 0.8, 0.95] {
            let left = AtomicI64::new((share * iterations as f64) as i64);
            let stopper = Stopper { left, ..Stopper::default() };
            let (_, ended) = stated(None, &stopper);
            // Behind a stiff wall not every iteration reports.
            assert!(!ended || wall != Wall::Hard && share > 0.9, "{adhesion} {wall} {load}, {share}: not interrupted");
            if ended {
                continue;
            }
            // The coarsest grid behind a stiff wall begins anew.
            let kept = stopper.kept.into_inner().expect("one thread");
            assert!(kept.is_some() || wall != Wall::Hard && share < 0.2, "{adhesion} {wall}, {share}: no snapshot");
            let begin = kept.map(|kept| InitialState::Snapshot { finished: 0, snapshot: Box::new(kept) });
            let (again, _) = stated(begin, &NoObserver);
            let (found, _, same) = again.expect("a state");
            assert_eq!(found, errors, "{adhesion} {wall} {load}, after {share}");
            assert!(same == bits, "{adhesion} {wall} {load}, after {share}: other bits");
        }
    }
}

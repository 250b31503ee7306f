//! The stated errors of maps, against grids with four times the points along each side.

use asperity::contact::interface::{AttractionLaw, COHESIVE_RESOLUTION, RangeChoice};
use asperity::contact::method::{Heights, Load, NoObserver, ReducedProblem, Stop};
use asperity::contact::path::LoadPathSolver;
use asperity::contact::state::MapErrors;
use asperity::grid::Grid;
use asperity::methods;
use asperity::surface::{Modes, Spectrum};

/// Points per side of the judged grid and of the truth.
const JUDGED: usize = 64;
const FINE: usize = 256;

/// Surfaces of which the errors of both maps are judged; one of either may be missed, as an error covers the truth in 19 of 20 cases.
const CASES: u64 = 20;
const MISSED: usize = 1;

/// Gap, mean gap and stated errors on a grid.
fn solved(modes: &Modes, n: usize, adhesion: AttractionLaw, load: Load) -> (Vec<f64>, f64, Option<MapErrors>) {
    let problem = ReducedProblem::new(Grid::unit(n, n), Heights::Series(modes.series()));
    let problem = ReducedProblem { adhesion, tolerance: 1e-6, max_iterations: 5_000, ..problem };
    let (fast, loads) = (methods::find("fast").expect("it is there"), [load]);
    let path = LoadPathSolver::new(problem, fast, RangeChoice::True, 0.0, &loads).with_map_errors(true);
    let mut found = None;
    let walked = path.walk(None, false, &NoObserver, |_, reached| {
        assert_eq!(reached.state.stop, Stop::Converged);
        found = Some((reached.state.gap.to_vec(), reached.state.mean_gap, reached.map_errors));
        Ok(())
    });
    walked.expect("a path");
    found.expect("a state")
}

#[test]
fn stated_errors_of_maps_cover_the_truth() {
    let (mut missed, mut judged, mut ratios) = ([Vec::new(), Vec::new()], 0, [0.0; 2]);
    for seed in 1..=CASES {
        let cut = [6.0, 10.0, 14.0, 16.0][seed as usize % 4];
        let spectrum = Spectrum { lambda_s: 1.0 / cut, hurst: 0.3 + 0.035 * seed as f64, ..Spectrum::CHALLENGE };
        let modes = Modes::new(spectrum, 400 + seed, 1.0);
        let pressure = [0.01, 0.03, 0.1, 0.2, 0.05][seed as usize % 5];
        let gamma = if seed % 4 == 0 { 1e-3 } else { 0.0 };
        let range = 2.0 * COHESIVE_RESOLUTION * (1e-3 / JUDGED as f64).sqrt();
        let adhesion = if gamma > 0.0 { AttractionLaw::exponential(gamma, range) } else { AttractionLaw::None };
        let (gap, mean_gap, errors) = solved(&modes, JUDGED, adhesion, Load::Pressure(pressure));
        let (truth, ..) = solved(&modes, FINE, adhesion, Load::Pressure(pressure));
        let Some(errors) = errors else { continue };
        judged += 1;
        let (every, mut squares, mut both, mut any) = (FINE / JUDGED, 0.0, 0, 0);
        for (k, here) in gap.iter().enumerate() {
            let there = truth[every * (k / JUDGED) * FINE + every * (k % JUDGED)];
            squares += (here - there) * (here - there);
            both += usize::from(*here <= 0.0 && there <= 0.0);
            any += usize::from(*here <= 0.0 || there <= 0.0);
        }
        let off =
            [(squares / gap.len() as f64).sqrt() / mean_gap, 1.0 - f64::from(both as u32) / f64::from(any as u32)];
        for (i, stated) in [errors.gap, errors.contact].into_iter().enumerate() {
            ratios[i] += off[i] / stated;
            if off[i] > stated {
                missed[i].push((seed, off[i], stated));
            }
        }
    }
    let means = ratios.map(|sum| sum / f64::from(judged));
    println!("{judged} judged; true over stated error of gap and contact, mean: {means:.2?}; missed: {missed:?}");
    assert!(judged >= 18 && missed.iter().all(|list| list.len() <= MISSED), "{judged}, {missed:?}");
    // Errors that are far too large would be no statement.
    assert!(means.iter().all(|mean| *mean > 0.05), "{means:?}");
}

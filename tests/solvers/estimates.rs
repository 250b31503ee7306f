//! Where estimates hold: what a method does not deliver at a load, what it refuses, and which waves it counts.

use crate::found::{near, path, problem, rough};
use asperity::contact::method::{Estimator, Heights, Load, NoObserver, Quantity, ReducedProblem, Stop};
use asperity::contact::observe::{ContactEdges, contact_area};
use asperity::grid::Field;
use asperity::methods;
use asperity::surface::{Modes, PowerSpectrum, Spectrum, moments};

fn estimator<'p>(problem: &'p ReducedProblem<'p>, id: &str) -> Box<dyn Estimator + 'p> {
    methods::find(id).unwrap().start(problem, &NoObserver).unwrap().estimator().unwrap()
}

/// On surfaces with 5 to 24 points per shortest wave and on all loads: either a mean gap near that of `fast`, or none and the reason. The
/// approach passes the mean height at high loads, and its difference was zero there.
#[test]
fn icha_gives_a_mean_gap_or_the_reason() {
    /// Measured: 1 to 24 % too small.
    const SMALLER: f64 = 0.3;
    let (mut with, mut without) = (0, 0);
    for (lambda_s, seed) in [(0.04, 5), (0.1, 6), (1.0 / 24.0, 2)] {
        let (grid, heights) = rough(128, 128, lambda_s, seed);
        let p = problem(grid, &heights);
        let loads = [0.02, 0.05, 0.1, 0.2, 0.3, 0.6].map(|p| p * moments(grid, &heights).rms_gradient);
        let solved = path(&p, "fast", &loads);
        let mut run = estimator(&p, "icha");
        for (&load, exact) in loads.iter().zip(solved) {
            let found = run.estimate(Load::Pressure(load)).unwrap();
            assert_eq!(found.stop, Stop::Converged);
            let why: Vec<&str> = found.undelivered.iter().map(|(_, why)| *why).collect();
            match found.mean_gap {
                Some(gap) => {
                    with += 1;
                    assert!(gap > (1.0 - SMALLER) * exact.mean_gap && gap < exact.mean_gap, "{gap} {}", exact.mean_gap);
                    assert!(why.is_empty(), "{why:?}");
                }
                None => {
                    without += 1;
                    assert!(why.len() == 1 && found.undelivered[0].0 == Quantity::MeanGap, "{why:?}");
                }
            }
        }
    }
    assert!(with >= 6 && without >= 6, "{with} {without}");
}

/// Where the spots of single asperities add up to more than the cell, their sum is no contact fraction: refused, not cut off at 1.
#[test]
fn contact_of_spots_beyond_the_cell_is_refused() {
    let (grid, heights) = rough(128, 128, 0.1, 6);
    let p = problem(grid, &heights);
    for id in ["srgw", "icha"] {
        let mut run = estimator(&p, id);
        let mut share = 0.0;
        for k in 1..200 {
            match run.estimate(Load::Pressure(0.1 * f64::from(k) * moments(grid, &heights).rms_gradient)) {
                Ok(found) => {
                    assert!(found.contact_area > share && found.contact_area <= 1.0, "{id}");
                    share = found.contact_area;
                }
                Err(error) => {
                    let text = error.to_string();
                    assert!(
                        text.contains(&format!("method {id}: pressure")) && text.contains("a lower pressure"),
                        "{text}"
                    );
                    break;
                }
            }
        }
        assert!(share > 0.8 && share < 1.0, "{id}: {share}");
    }
}

/// Only waves that are not solved are modelled. A surface of long waves alone has the contact of `fast`, in the series and in a map of it;
/// a lower cut-off leaves some of them to the model, which takes contact away.
#[test]
fn rl_archard_counts_waves_once() {
    /// Of perimeter-corrected areas on half of the points. Measured: 0.6 %.
    const HALF_OF_THE_POINTS: f64 = 0.02;
    let (grid, heights) = rough(256, 256, 1.0 / 16.0, 18);
    let series = Modes::new(Spectrum { lambda_s: 1.0 / 16.0, ..Spectrum::CHALLENGE }, 18, 1.0).series().clone();
    let of = |problem: &ReducedProblem, p: f64| {
        estimator(problem, "rl-archard").estimate(Load::Pressure(p)).unwrap().contact_area
    };
    for p in [0.01, 0.1, 0.3].map(|p| p * moments(grid, &heights).rms_gradient) {
        let own = problem(grid, &heights);
        let exact =
            contact_area(grid, Field::F64(&path(&own, "fast", &[p])[0].gap), ContactEdges::ELASTIC).contact_area;
        let found = of(&own, p);
        println!("{p}: {}", found / exact);
        assert!(near(found, exact, HALF_OF_THE_POINTS), "{p}: {found} {exact}");
        assert!(near(of(&ReducedProblem::new(grid, Heights::Series(&series)), p), found, 1e-6));
        let mut cut = problem(grid, &heights);
        cut.settings.rl_archard.cut_off_modes = Some(8);
        let cut = of(&cut, p);
        assert!(cut < 0.95 * found, "{cut} {found}");
    }
}

/// Independent asperities that would cover more than the cell are refused.
#[test]
fn scgw_refuses_more_contact_than_the_cell_has() {
    let (grid, heights) = rough(256, 256, 1.0 / 32.0, 18);
    let power = PowerSpectrum::from_nodes(grid, &heights);
    let problem = ReducedProblem { power: Some(&power), ..ReducedProblem::new(grid, &[][..]) };
    let mut run = estimator(&problem, "scgw");
    let sparse = run.estimate(Load::Pressure(0.3 * power.rms_gradient())).unwrap().contact_area;
    assert!(sparse > 0.1 && sparse < 1.0, "{sparse}");
    let refused =
        run.estimate(Load::Pressure(4.0 * power.rms_gradient())).map(|e| e.contact_area).unwrap_err().to_string();
    assert!(refused.contains("times the cell") && refused.contains("a lower pressure"), "{refused}");
}

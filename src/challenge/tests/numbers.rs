//! Numbers of the statements: values that depend on the grid, and the errors of values.

use super::*;
use asperity_contact::observe::{effective_clusters, median_counting_error, share_counting_error};
use asperity_contact::uncertainty::{UncertaintyComponent, UncertaintySource};

/// Rounding.
const ROUNDING: f64 = 1e-12;

/// Rounding of bins, whose edges are differences.
const BINS: f64 = 1e-9;

fn check(list: &[AcceptanceCheck], id: &str) -> AcceptanceCheck {
    list.iter().find(|j| j.id == id).unwrap_or_else(|| panic!("no {id}")).clone()
}

/// Contact of a state, in its distribution of the gap, m².
fn counted_area(o: &Observed) -> f64 {
    o.gap.as_ref().expect("made up").delta * LENGTH * LENGTH
}

/// Mean gap, µm.
fn um(s: &State) -> f64 {
    s.mean_gap.expect("made up") * 1e6
}

/// Value and error of a statement.
fn found(results: &Results, id: &str) -> [f64; 2] {
    let check = check(&assess(results), id);
    [check.value.expect("a value"), check.error.expect("an error")]
}

fn assert_near(actual: f64, expected: f64, description: &str) {
    assert!((actual / expected - 1.0).abs() < ROUNDING, "{description}: {actual} instead of {expected}");
}

/// Components of a state add up; a ratio of two areas has the errors of both.
#[test]
fn errors_are_those_of_the_states() {
    let component = |quantity, source, relative| UncertaintyComponent {
        quantity,
        source,
        relative: Some(relative),
        is_bound: false,
    };
    let mut results = agreeing();
    for solved in [&mut results.continuum, &mut results.non_adhesive] {
        for s in &mut solved.as_mut().expect("made up").states {
            s.uncertainty = vec![
                component(Quantity::ContactArea, UncertaintySource::Grid, 0.01),
                component(Quantity::ContactArea, UncertaintySource::Solver, 0.02),
                component(Quantity::MeanGap, UncertaintySource::Grid, 0.005),
            ];
            (s.stiffness_error, s.residual) = (Some(0.2 * MODULUS / LENGTH), Some(0.03));
        }
    }
    let ratios = [("S05", 0.06), ("S08", 0.06)];
    let areas = ["S06", "S07a", "S07b", "S09", "S10"].map(|id| (id, 0.03));
    for (id, relative) in ratios.into_iter().chain(areas).chain([("A01", 0.005), ("A02", 0.2 / 2.785)]) {
        let [value, error] = found(&results, id);
        assert_near(error, relative * value, id);
    }
    // The residual is relative to the pressure, 0.01 here.
    assert_near(found(&results, "S14")[1], 0.03 * 0.01 / PULL, "S14");
}

/// Errors of n = 3000 independent clusters, and of the distribution of their areas.
#[test]
fn errors_of_clusters_are_counting_errors() {
    let results = agreeing();
    // The first of bins with a ratio of 10^(1/6), at 500 nm²; the next is less probable by 43 %, with errors of 10 %.
    assert_near(found(&results, "S16")[1], 0.5 * 500.0 * (10f64.powf(1.0 / 6.0) - 1.0), "S16");
    assert_near(found(&results, "S18")[1], 0.1, "S18");
    for id in ["S21b", "S23b"] {
        let [ratio, error] = found(&results, id);
        assert_near(error, ratio * (2.0f64 / 3000.0).sqrt(), id);
    }
    let [share, error] = found(&results, "S23a");
    assert_near(error, (share * (100.0 - share) / 3000.0).sqrt(), "S23a");
    let o = results.continuum.as_ref().and_then(|c| c.states[3].observed.as_ref()).expect("made up");
    let counted = share_counting_error(&o.cluster_area, counted_area(o), 1e-12).expect("clusters on both sides");
    assert_near(found(&results, "S17b")[1], counted, "S17b");
    // A tenth of the contact in clusters of the same areas: shares of one half within the error are reached at more than one area.
    let mut few = agreeing();
    let o = seen(with(&mut few));
    of(&mut o.gap).delta *= 0.1;
    let median = median_counting_error(&o.cluster_area, counted_area(o), 3e-12).expect("clusters on both sides");
    assert_near(found(&few, "S17a")[1], median * 1e12, "S17a");
    // Clusters of a quarter of the area are four times as many, with half of the error.
    let mut finer = agreeing();
    let number = |o: &Observed| effective_clusters(&o.cluster_area, counted_area(o)).expect("contact");
    let previous = number(seen(without(&mut finer)));
    seen(without(&mut finer)).cluster_area.iter_mut().for_each(|a| a[0] *= 0.25);
    assert_near(number(seen(without(&mut finer))), 4.0 * previous, "number");
    assert_near(found(&finer, "S22")[1], 0.5 * found(&results, "S22")[1], "S22");
}

/// The scatter of one load, one size of clusters and one wave.
#[test]
fn errors_of_fits_are_standard_errors() {
    let mut scattered = agreeing();
    widen(at(with(&mut scattered), 0.4), 1.1);
    let states = with(&mut scattered).states.iter().filter(|s| s.p_star > 0.137);
    let loads: Vec<(f64, f64)> = states.map(|s| (s.p_star, um(s).ln())).collect();
    let fit = line(&loads).expect("five loads");
    assert_near(found(&scattered, "S11a")[1], fit.slope_error, "S11a");
    assert_near(found(&scattered, "S11b")[1], fit.intercept.exp() * fit.intercept_error, "S11b");
    widen(at(with(&mut scattered), 0.02), 1.1);
    let states = with(&mut scattered).states.iter().filter(|s| s.p_star < 0.137);
    let loads: Vec<(f64, f64)> = states.map(|s| (s.p_star.ln(), um(s))).collect();
    assert_near(found(&scattered, "S12")[1], jackknife(&loads, |l| l.r2).expect("seven loads"), "S12");
    // From 16 nodes to the median cluster of 3 µm².
    let sizes = &mut seen(with(&mut scattered)).cluster_density;
    sizes[5][1] *= 1.1;
    let area = |a: f64| (16.0 * (LENGTH / 32768.0).powi(2)..=3e-12).contains(&a);
    let sizes: Vec<(f64, f64)> =
        sizes.iter().filter(|[a, ..]| area(*a)).map(|[a, density, _]| (a.ln(), density.ln())).collect();
    assert_near(found(&scattered, "S15")[1], line(&sizes).expect("many sizes").slope_error, "S15");
    // The spectrum falls as q^(-2 - 2H).
    scattered.surface.psd[2].realised *= 1.1;
    let waves: Vec<(f64, f64)> = scattered.surface.psd[1..].iter().map(|p| (p.mode.ln(), p.realised.ln())).collect();
    let error = 0.5 * line(&waves).expect("three waves").slope_error;
    assert_near(found(&scattered, "A03")[1], error, "A03");
    let [low, high] = check(&assess(&scattered), "A03").tolerance.expect("a range").map(|end| end.expect("finite"));
    assert_near(high - low, 2.0 * (0.05 + 2.0 * error), "A03");
}

/// Waves that the grid does not resolve carry no load: pressures are those over the resolved gradient.
#[test]
fn loads_are_relative_to_the_resolved_gradient() {
    let mut part = agreeing();
    let whole = assess(&part);
    without(&mut part).resolved_gradient = Some(0.98);
    without(&mut part).states.iter_mut().for_each(|s| s.pressure *= 0.98);
    for id in ["S07a", "S07b", "S09"] {
        let [part, whole] = [&assess(&part), &whole].map(|list| check(list, id).value.expect("a value"));
        assert_near(part, whole, id);
    }
}

/// dx γ/(ρ² E*) on a grid of 32768 points per side.
#[test]
fn the_mesh_criterion_is_that_of_the_spacing() {
    let value = check(&assess(&agreeing()), "MESH").value.expect("a value");
    assert_near(value, 2e-5 / (32768.0 * 2.071e-5 * 2.071e-5), "MESH");
}

/// Tension outside contact has a density of e^(8σ), in bins; one just below zero over that of half of the largest tension.
#[test]
fn the_peak_of_tension_is_relative_to_half_of_the_largest() {
    let mut results = agreeing();
    let edges = of(&mut seen(with(&mut results)).stress).edges.clone();
    let zero = edges.iter().position(|e| *e > 0.0).expect("compression") - 2;
    let half = edges.iter().position(|e| *e >= -0.5 * PULL * MODULUS).expect("tension") - 1;
    let ratio = (8.0 * (edges[zero] - edges[half]) / MODULUS).exp();
    assert!((found(&results, "S23b")[0] / ratio - 1.0).abs() < BINS, "{ratio}");
}

/// Waves between half and all of the points per side are those along the diagonals alone.
#[test]
fn the_hurst_exponent_ends_at_the_shortest_wave_along_an_axis() {
    let mut results = agreeing();
    with(&mut results).nx = 160;
    let realised = |mode: f64| if mode < 80.0 { mode.powf(-3.6) } else { 1.0 };
    results.surface.psd =
        [12.0, 20.0, 40.0, 90.0].map(|mode| PsdPoint { mode, realised: realised(mode), expected: None }).to_vec();
    assert_near(found(&results, "A03")[0], 0.8, "A03");
}

/// Twice the range: tension over half of the stress, and gaps up to it.
#[test]
fn stresses_and_gaps_are_relative_to_the_range_used() {
    let mut longer = agreeing();
    let used = 2.0 * 2.071e-5 * LENGTH;
    with(&mut longer).range.as_mut().expect("adhesion").used = used;
    assert_near(found(&longer, "S14")[0], 2.0, "S14");
    // A range of ten bins.
    let used = 2.5e-3 * LENGTH;
    with(&mut longer).range.as_mut().expect("adhesion").used = used;
    let below = |o: &Observed| o.gap_logarithmic.as_ref().expect("made up").fractions[..10].iter().sum::<f64>();
    let ratio = below(seen(with(&mut longer))) / below(seen(without(&mut longer)));
    assert!((found(&longer, "S21b")[0] / ratio - 1.0).abs() < BINS, "{ratio}");
}

/// Heights of nodes are exact, extrema lie between them; the reason on a coarse grid states the points that find them.
#[test]
fn errors_of_extrema_are_those_between_nodes() {
    let results = agreeing();
    let between = (UM / 32768.0).powi(2) / (4.0 * 0.04);
    for id in ["S04b", "S04c", "S13"] {
        assert_near(found(&results, id)[1], between, id);
    }
    assert_eq!(found(&results, "S04a")[1], 0.0);
    let mut few = agreeing();
    with(&mut few).nx = 128;
    // 100 µm over √(4 · 0.04 µm · w) of the widths 0.8 and 1.17 µm.
    for (id, points) in [("S04b", "280 points"), ("S04c", "232 points")] {
        let reason = check(&assess(&few), id).reason;
        assert!(reason.contains(points), "{id}: {reason}");
    }
}

//! Mean gap, stiffness and the distribution of gaps.

use super::{ChallengeData, LineFit, Statement, cover, jackknife, line, reference, setting, share_below, uncertainty};
use crate::record::acceptance::AcceptanceCheck;
use crate::record::results::FIRST_TOUCH;
use asperity_contact::quantity::Quantity;

/// Micrometres of a metre.
const UM: f64 = 1e6;

/// Mean gap at the reference load, µm, and three standard deviations: 100 realisations by independent code,
/// scripts/challenge-ranges.py.
const MEAN_GAP: [f64; 2] = [1.04, 0.154];
/// Contact stiffness at the reference load, E* ḡ/L, and three standard deviations of the same realisations.
const STIFFNESS: [f64; 2] = [2.794, 0.62];
/// Loads p* of the exponential law.
const EXPONENTIAL: std::ops::Range<f64> = 0.137..1.002;
/// Loads p* of the logarithmic law.
const LOGARITHMIC: std::ops::Range<f64> = 9.9e-4..0.101;
/// Gap above which adhesion does not change the distribution, µm.
const FAR_UM: f64 = 0.1;
/// Tolerance for "equal" curves in a plot of probabilities.
const EQUAL: f64 = 0.05;

/// Reason of the limits from other realisations of the spectrum.
const OTHER_SURFACES: &str = "three standard deviations of surfaces with this spectrum";

pub(super) fn assess(data: &ChallengeData) -> Vec<AcceptanceCheck> {
    let mut list = at_reference_load(data).to_vec();
    list.extend(over_load(data));
    list.push(first_touch(data));
    list.extend(distributions(data));
    list
}

fn at_reference_load(data: &ChallengeData) -> [AcceptanceCheck; 2] {
    let state = reference(data.plain);
    let mean_gap = state.and_then(|s| s.mean_gap).map(|gap| gap * UM);
    let unit = data.modulus_pa / (data.length_um / UM);
    [
        Statement::new("A01", "mean gap at the reference load, without adhesion", "µm")
            .near(mean_gap, MEAN_GAP[0], MEAN_GAP[1], OTHER_SURFACES)
            .with_error(mean_gap.and_then(|gap| Some(uncertainty(state?, Quantity::MeanGap)? * gap))),
        Statement::new("A02", "contact stiffness at the reference load, without adhesion", "E* ḡ/L")
            .near(state.and_then(|s| s.stiffness).map(|k| k / unit), STIFFNESS[0], STIFFNESS[1], OTHER_SURFACES)
            .with_error(state.and_then(|s| s.stiffness_error).map(|e| e / unit)),
    ]
}

/// The mean gap as a function of the load, with adhesion where the grid resolves it.
fn over_load(data: &ChallengeData) -> [AcceptanceCheck; 3] {
    let results = if data.unresolved.is_none() { data.adhesive } else { data.plain };
    // None if the loads do not extend over the range.
    let points = |span: &std::ops::Range<f64>, value: fn(f64, f64) -> (f64, f64)| -> Vec<(f64, f64)> {
        let loads = results.loading().map(|s| s.p_star);
        let gaps = results.loading().filter_map(|s| Some((s.p_star, s.mean_gap.filter(|gap| *gap > 0.0)?)));
        let points = gaps.filter(|(p, _)| span.contains(p)).map(|(p, gap)| value(p, gap * UM));
        if cover(loads, [span.start, 0.99 * span.end]) { points.collect() } else { Vec::new() }
    };
    let exponential = line(&points(&EXPONENTIAL, |p, u| (p, u.ln())));
    let logarithmic = points(&LOGARITHMIC, |p, u| (p.ln(), u));
    let fitted = |value: fn(&LineFit) -> f64| exponential.as_ref().map(value);
    let slope = "slope of ln ū over p*, p* = 0.137 … 1, with adhesion where the grid resolves it";
    let checks = [
        data.of_roughness(Statement::new("S11a", slope, "1"), |item| {
            let check = item.near(fitted(|l| l.slope), -8.0, 1.0, "\"exp(-8 p*)\", to its digit");
            check.with_error(fitted(|l| l.slope_error))
        }),
        data.of_roughness(Statement::new("S11b", "prefactor of exp(-8 p*)", "µm"), |item| {
            let prefactor = fitted(|l| l.intercept.exp());
            let check = item.within(prefactor, 0.3, [0.2, 0.45], "\"0.3 µm\", to a factor of 1.5");
            check.with_error(fitted(|l| l.intercept.exp() * l.intercept_error))
        }),
        Statement::new("S12", "ū against ln p*, p* = 0.001 … 0.1: coefficient of determination", "1")
            .within(line(&logarithmic).map(|l| l.r2), 1.0, [0.98, 1.0], "\"roughly logarithmic\"")
            .with_error(jackknife(&logarithmic, |l| l.r2)),
    ];
    checks.map(|check| if data.unresolved.is_none() { data.at_range(check) } else { check })
}

fn first_touch(data: &ChallengeData) -> AcceptanceCheck {
    let item = Statement::new("S13", "mean gap at first contact: the mean height", "µm");
    let tolerance = setting::HALF_A_DIGIT + setting::sampling(data);
    match data.results.surface.statistic(FIRST_TOUCH).map(|s| s.realised) {
        Some(h) if data.is_imported() => data.of_roughness(item, |item| {
            let reason = "the paper's arrow, to its last digit and the height between nodes";
            item.near(Some(h), 2.633, tolerance, reason).with_error(Some(setting::sampling(data)))
        }),
        Some(h) => item.not_assessed(format!("the paper's arrow is its own surface's; this surface's is {h:.3} µm")),
        None => item.not_assessed("the surface has no such statistic"),
    }
}

/// Distributions of the gaps, with adhesion against without.
fn distributions(data: &ChallengeData) -> [AcceptanceCheck; 2] {
    let pair = data.observed().and_then(|[a, b]| Some([a.gap_logarithmic.as_ref()?, b.gap_logarithmic.as_ref()?]));
    let far = pair.map(|[with, without]| {
        let (shares, edges) = ((share_below(with, FAR_UM / UM), share_below(without, FAR_UM / UM)), &without.edges);
        let beyond = edges.iter().filter(|e| **e * UM > FAR_UM);
        let difference = |x: f64| ((share_below(with, x) - shares.0) - (share_below(without, x) - shares.1)).abs();
        beyond.map(|e| difference(*e)).fold(0.0, f64::max)
    });
    let near = pair.zip(data.adhesive.range).map(|([with, without], range)| {
        share_below(with, range.used) / share_below(without, range.used).max(f64::MIN_POSITIVE)
    });
    let large_gaps = "Pr(u) with adhesion against without, u > 0.1 µm: largest difference of fractions";
    [
        data.of_adhesion(Statement::new("S21a", large_gaps, "1"), |item| {
            item.within(far, 0.0, [0.0, EQUAL], "the curves lie on each other")
        }),
        data.of_adhesion(Statement::new("S21b", "gaps below the range ρ, with adhesion over without", "1"), |item| {
            // The smallest gaps are at the edges of the clusters, which are independent.
            let clusters = reference(data.adhesive).and_then(|s| s.clusters).filter(|n| *n > 0);
            let error = near.zip(clusters).map(|(fraction, n)| fraction * (2.0 / n as f64).sqrt());
            item.within(near, 0.0, [0.0, 1.0], "adhesion suppresses the smallest gaps").with_error(error)
        }),
    ]
}

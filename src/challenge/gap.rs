//! Mean gap, stiffness and the distribution of gaps.

use super::{ChallengeData, Statement, cover, line, reference, setting, share_below};
use crate::record::acceptance::AcceptanceCheck;
use crate::record::results::FIRST_TOUCH;

/// Mean gap at the reference load, µm, and three standard deviations: seeds 1 to 24 on 512² (`docs/challenge.md`).
const MEAN_GAP: [f64; 2] = [1.037, 0.105];
/// Contact stiffness at the reference load, E* ḡ/L, and three standard deviations of the same seeds.
const STIFFNESS: [f64; 2] = [2.785, 0.47];
/// Loads p* of the exponential law.
const EXPONENTIAL: std::ops::Range<f64> = 0.137..1.002;
/// Loads p* of the logarithmic law.
const LOGARITHMIC: std::ops::Range<f64> = 9.9e-4..0.101;
/// Gap above which adhesion does not change the distribution, µm.
const FAR_UM: f64 = 0.1;
/// Tolerance for "equal" curves in a plot of probabilities.
const EQUAL: f64 = 0.05;

pub(super) fn judge(data: &ChallengeData) -> Vec<AcceptanceCheck> {
    let um = data.length_um;
    let held = if data.unresolved.is_none() { data.adhesive } else { data.plain };
    let points = |within: &std::ops::Range<f64>, of: &dyn Fn(f64, f64) -> (f64, f64)| -> Vec<(f64, f64)> {
        let held = ChallengeData::there(held).filter(|s| within.contains(&s.numbers.p_star) && s.mean_gap > 0.0);
        held.map(|s| of(s.numbers.p_star, s.mean_gap * um)).collect()
    };
    let covered = |span: &std::ops::Range<f64>| {
        cover(ChallengeData::there(held).map(|s| s.numbers.p_star), [span.start, 0.99 * span.end])
    };
    let falling = covered(&EXPONENTIAL).then(|| line(&points(&EXPONENTIAL, &|p, u| (p, u.ln())))).flatten();
    let logarithmic = covered(&LOGARITHMIC).then(|| line(&points(&LOGARITHMIC, &|p, u| (p.ln(), u)))).flatten();
    let first_touch = data.results.surface.statistic(FIRST_TOUCH).map(|s| s.realised);
    let reference = reference(data.plain);
    let s13 = Statement::new("S13", "mean gap at first touch: the mean height", "µm");
    let s13 = match first_touch {
        Some(h) if data.is_imported() => data.of_roughness(s13, |item| {
            item.near(
                Some(h),
                2.633,
                setting::HALF_A_DIGIT + setting::sampling(data),
                "the paper's arrow, to its last digit and what lies between nodes",
            )
        }),
        Some(h) => s13.not_judged(format!("the paper's arrow is its own surface's; this surface's is {h:.3} µm")),
        None => s13.not_judged("the surface has no such statistic"),
    };
    let distributions = data.observed().map(|pair| pair.map(|o| &o.gap_logarithmic));
    let far = distributions.map(|[with, without]| {
        let (shares, edges) = ((share_below(with, FAR_UM / um), share_below(without, FAR_UM / um)), &without.edges);
        let beyond = edges.iter().filter(|e| **e * um > FAR_UM);
        let apart = |x: f64| ((share_below(with, x) - shares.0) - (share_below(without, x) - shares.1)).abs();
        beyond.map(|e| apart(*e)).fold(0.0, f64::max)
    });
    let near = distributions.zip(data.adhesive.range).map(|([with, without], range)| {
        share_below(with, range.used) / share_below(without, range.used).max(f64::MIN_POSITIVE)
    });
    vec![
        Statement::new("A01", "mean gap at the reference load, without adhesion", "µm").near(
            reference.map(|s| s.mean_gap * um),
            MEAN_GAP[0],
            MEAN_GAP[1],
            "three standard deviations of surfaces with this spectrum",
        ),
        Statement::new("A02", "contact stiffness at the reference load, without adhesion", "E* ḡ/L").near(
            reference.and_then(|s| s.numbers.stiffness),
            STIFFNESS[0],
            STIFFNESS[1],
            "three standard deviations of surfaces with this spectrum",
        ),
        data.of_roughness(
            Statement::new(
                "S11a",
                "slope of ln ū over p*, p* = 0.137 … 1, with adhesion where the grid carries it",
                "1",
            ),
            |item| item.near(falling.map(|l| l.0), -8.0, 1.0, "\"exp(-8 p*)\", to its digit"),
        ),
        data.of_roughness(Statement::new("S11b", "prefactor of exp(-8 p*)", "µm"), |item| {
            item.within(falling.map(|l| l.1.exp()), 0.3, [0.2, 0.45], "\"0.3 µm\", to a factor of 1.5")
        }),
        Statement::new("S12", "ū against ln p*, p* = 0.001 … 0.1: coefficient of determination", "1").within(
            logarithmic.map(|l| l.2),
            1.0,
            [0.98, 1.0],
            "\"roughly logarithmic\"",
        ),
        s13,
        data.of_adhesion(
            Statement::new(
                "S21a",
                "Pr(u) with adhesion against without, u > 0.1 µm: largest difference of shares",
                "1",
            ),
            |item| item.within(far, 0.0, [0.0, EQUAL], "the curves lie on each other"),
        ),
        data.of_adhesion(Statement::new("S21b", "gaps below the range ρ, with adhesion over without", "1"), |item| {
            item.within(near, 0.0, [0.0, 1.0], "adhesion suppresses the smallest gaps")
        }),
    ]
}

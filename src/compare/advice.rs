//! Which setting to take for a scene, from what was measured on others.

use super::frontier::growth;
use crate::record::tradeoff::{Measure, Point, Tradeoff};
use serde::Serialize;

/// Exponent of a cost in the number of points where a table has one grid of a method: that of the paper's own figures (1 min at
/// 1k points a side, 1 h at 4k, three weeks at 32k).
const GROWTH: f64 = 1.5;

/// Share by which points or loads may lie beyond those measured and count as the same.
const SAME: f64 = 1e-6;

/// The scene that is to be solved.
#[derive(Debug, Clone)]
pub struct Target {
    /// Shortest wave of its surface over L.
    pub shortest_wave: f64,
    /// Points a side of a surface that has its own grid.
    pub own_grid: Option<usize>,
    /// Extent in y over that in x.
    pub aspect: f64,
    pub adhesive: bool,
    pub kernel: String,
    pub p_star: Vec<f64>,
}

/// What is asked for: an error, as a relative deviation, or a time, s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Limit {
    Error(f64),
    Seconds(f64),
}

/// A setting, and what is to be expected of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Advice {
    pub method: String,
    /// Points a side.
    pub grid: usize,
    pub precision: String,
    pub tolerance: f64,
    pub expected_error: f64,
    /// Over the loads that were measured.
    pub error_range: [f64; 2],
    /// What is uncertain of the reference that it was measured against.
    pub reference_uncertainty: Option<f64>,
    /// Wall time of all loads, on the machine and the threads that the table was measured on.
    pub expected_seconds: f64,
    /// One standard error of the exponent with which cost grows, either way; none where it rests on two grids or on none.
    pub seconds_range: Option<[f64; 2]>,
    pub exponent: Option<f64>,
    pub threads: usize,
    /// What of this lies beyond what was measured.
    pub extrapolated: Vec<String>,
}

/// All that the tables know of a quantity, for a target: points per shortest wave are kept.
pub fn candidates(tables: &[Tradeoff], target: &Target, measure: Measure) -> Vec<Advice> {
    let of =
        |told: &Tradeoff| told.points.iter().filter_map(|p| candidate(told, p, target, measure)).collect::<Vec<_>>();
    tables.iter().flat_map(of).collect()
}

fn candidate(told: &Tradeoff, p: &Point, target: &Target, measure: Measure) -> Option<Advice> {
    let s = &p.setting;
    if p.refusal.is_some() || s.adhesive != target.adhesive {
        return None;
    }
    let error = told.error(p, measure)?;
    let exact = s.nx as f64 * told.shortest_wave / target.shortest_wave;
    let same = |a: f64, b: f64| (a / b - 1.0).abs() < SAME;
    let grid = match target.own_grid {
        Some(own) => own,
        None if same(exact, s.nx as f64) => s.nx,
        None => transformable(exact * (1.0 - SAME)),
    };
    // A grid that is given may have more points a wave than was measured, and none fewer.
    if (grid as f64) < exact * (1.0 - SAME) {
        return None;
    }
    let points = |nx: f64, aspect: f64| nx * nx * aspect;
    let asked = points(grid as f64, target.aspect);
    let here = points(s.nx as f64, s.ny as f64 / s.nx as f64);
    let grids = told.grids(&s.method);
    let sizes: Vec<(f64, f64)> =
        grids.iter().map(|g| ((g.setting.nx * g.setting.ny) as f64, g.cost.wall_seconds)).collect();
    let grows = growth(&sizes);
    let mut extrapolated = Vec::new();
    let all = || told.points.iter().filter(|q| q.setting.method == s.method && q.refusal.is_none());
    let measured = || all().map(|q| (q.setting.nx * q.setting.ny) as f64);
    let (least, most) = (measured().fold(f64::INFINITY, f64::min), measured().fold(0.0, f64::max));
    if asked > most * (1.0 + SAME) || asked < least * (1.0 - SAME) {
        let sides = [least, most].map(|n| n.sqrt().round());
        extrapolated.push(format!(
            "{grid} points a side, where {} was measured on {} to {} a side",
            s.method, sides[0], sides[1]
        ));
    }
    if grows.is_none() && !same(asked, here) {
        extrapolated
            .push(format!("{} was measured on one grid: its cost is taken to grow as the paper's did", s.method));
    }
    let loads = |of: &[f64]| of.iter().fold((f64::INFINITY, 0.0f64), |(a, b), p| (a.min(*p), b.max(*p)));
    let (low, high) = loads(&told.p_star);
    if target.p_star.iter().any(|p| *p < low * (1.0 - SAME) || *p > high * (1.0 + SAME)) {
        let (from, to) = loads(&target.p_star);
        extrapolated.push(format!("loads p* of {from} to {to}, where {low} to {high} were measured"));
    }
    if told.kernel != target.kernel {
        extrapolated.push(format!("{}, where {} was measured", target.kernel, told.kernel));
    }
    let step = asked / here;
    let part = target.p_star.len().max(1) as f64 / told.p_star.len().max(1) as f64;
    let expected = p.cost.wall_seconds * part * step.powf(grows.map_or(GROWTH, |g| g.exponent));
    let spread = if same(step, 1.0) { Some(1.0) } else { grows.and_then(|g| g.error).map(|e| step.powf(e)) };
    let each = || p.loads.iter().filter_map(|l| l.errors.get(&measure).copied());
    let (worst, uncertain) = (each().fold(error, f64::max), told.reference(s.adhesive)?.uncertainty.get(&measure));
    Some(Advice {
        method: s.method.clone(),
        grid,
        precision: s.precision.clone(),
        tolerance: s.tolerance,
        expected_error: error,
        error_range: [each().fold(error, f64::min), worst],
        reference_uncertainty: uncertain.copied(),
        expected_seconds: expected,
        seconds_range: spread.map(|f| [expected / f.max(1.0 / f), expected * f.max(1.0 / f)]),
        exponent: grows.map(|g| g.exponent),
        threads: told.threads,
        extrapolated,
    })
}

/// The cheapest within an error, or of least error within a time; of equal ones the cheaper.
pub fn choose(candidates: &[Advice], measure: Measure, limit: Limit) -> Option<&Advice> {
    let cheaper = |a: &&Advice, b: &&Advice| a.expected_seconds.total_cmp(&b.expected_seconds);
    match limit {
        Limit::Error(share) => {
            let within = measure.like_relative(share) * (1.0 + SAME);
            candidates.iter().filter(|a| a.expected_error <= within).min_by(cheaper)
        }
        Limit::Seconds(s) => candidates
            .iter()
            .filter(|a| a.expected_seconds <= s)
            .min_by(|a, b| a.expected_error.total_cmp(&b.expected_error).then(cheaper(a, b))),
    }
}

/// The next whole even number from `least` on whose only factors are 2, 3 and 5: what transforms are fast on.
fn transformable(least: f64) -> usize {
    let smooth = |n: &usize| {
        let mut rest = *n;
        for factor in [2, 3, 5] {
            while rest.is_multiple_of(factor) {
                rest /= factor;
            }
        }
        rest == 1 && n.is_multiple_of(2)
    };
    (least.ceil().max(2.0) as usize..).find(smooth).expect("powers of two have no end")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::results::ScalesSi;
    use crate::record::tradeoff::{Cost, Errors, Reference, SCHEMA, Setting};

    /// Errors that fall with the grid's points a side, costs that grow as its points to the power of 1.2.
    fn table() -> Tradeoff {
        let setting = |nx: usize, method: &str| Setting {
            method: method.into(),
            adhesive: false,
            nx,
            ny: nx,
            precision: "f64".into(),
            tolerance: 1e-8,
        };
        let point = |nx: usize, method: &str, factor: f64| Point {
            setting: setting(nx, method),
            paper_name: String::new(),
            criterion: String::new(),
            calibrated_on: None,
            is_reference: false,
            refusal: None,
            missing: Vec::new(),
            cost: Cost { wall_seconds: factor * ((nx * nx) as f64).powf(1.2) / 1e4, ..Cost::default() },
            errors: Errors::from([(Measure::MeanGap, 6.4 / nx as f64)]),
            loads: Vec::new(),
        };
        let points =
            [64, 128, 256].iter().flat_map(|&n| [point(n, "fast", 1.0), point(n, "slow", 10.0)]).collect::<Vec<_>>();
        Tradeoff {
            schema: SCHEMA,
            name: "t".into(),
            scales: ScalesSi { length_m: 1e-4, modulus_pa: 2.5e7 },
            surface: String::new(),
            gradient: 1.0,
            shortest_wave: 0.04,
            nx: 256,
            ny: 256,
            p_star: vec![0.01, 0.1],
            kernel: "half-space".into(),
            adhesion: "none".into(),
            program: String::new(),
            threads: 2,
            repeats: 1,
            budget_seconds: None,
            spent_seconds: 0.0,
            references: vec![Reference {
                setting: setting(256, "fast"),
                cost: Cost::default(),
                coarser: Vec::new(),
                loads: Vec::new(),
                uncertainty: Errors::from([(Measure::MeanGap, 0.03)]),
            }],
            points,
            left_out: Vec::new(),
            warnings: Vec::new(),
        }
    }

    fn target(shortest_wave: f64) -> Target {
        Target {
            shortest_wave,
            own_grid: None,
            aspect: 1.0,
            adhesive: false,
            kernel: "half-space".into(),
            p_star: vec![0.02],
        }
    }

    /// On the measured surface the cheapest setting is that of the table, at half its cost for half of the loads.
    #[test]
    fn the_cheapest_within_an_error_and_the_best_within_a_time() {
        let all = candidates(&[table()], &target(0.04), Measure::MeanGap);
        let best = choose(&all, Measure::MeanGap, Limit::Error(0.06)).expect("one");
        assert_eq!((best.method.as_str(), best.grid, best.expected_error), ("fast", 128, 0.05));
        let cost = 0.5 * 16384f64.powf(1.2) / 1e4;
        assert!((best.expected_seconds / cost - 1.0).abs() < 1e-12 && best.extrapolated.is_empty(), "{best:?}");
        // What is uncertain of the reference is a floor of errors.
        assert!(choose(&all, Measure::MeanGap, Limit::Error(0.029)).is_none());
        assert_eq!(choose(&all, Measure::MeanGap, Limit::Error(0.03)).map(|a| a.grid), Some(256));
        let within = choose(&all, Measure::MeanGap, Limit::Seconds(1.01 * cost)).expect("one");
        assert_eq!((within.method.as_str(), within.grid), ("fast", 128));
        assert!(choose(&all, Measure::MeanGap, Limit::Seconds(1e-3)).is_none());
        assert!(candidates(&[table()], &target(0.04), Measure::Stiffness).is_empty());
    }

    /// Waves of half the length need twice the points a side, and cost what the fitted exponent says.
    #[test]
    fn points_per_wave_are_kept() {
        let all = candidates(&[table()], &target(0.02), Measure::MeanGap);
        let best = choose(&all, Measure::MeanGap, Limit::Error(0.06)).expect("one");
        assert_eq!((best.grid, best.extrapolated.len()), (256, 0));
        assert!((best.expected_seconds / (0.5 * 65536f64.powf(1.2) / 1e4) - 1.0).abs() < 1e-9, "{best:?}");
        assert!(best.exponent.is_some_and(|e| (e - 1.2).abs() < 1e-9));
        // Beyond the finest grid that was measured it is an extrapolation, and says so.
        let finest = choose(&all, Measure::MeanGap, Limit::Error(0.03)).expect("one");
        assert!(finest.grid == 512 && finest.extrapolated[0].contains("512"), "{finest:?}");
        let far = Target { p_star: vec![0.5], kernel: "layer".into(), ..target(0.04) };
        assert!(candidates(&[table()], &far, Measure::MeanGap).iter().all(|a| a.extrapolated.len() == 2));
        // A scene with adhesion has no measure in a table without.
        let sticky = Target { adhesive: true, ..target(0.04) };
        assert!(candidates(&[table()], &sticky, Measure::MeanGap).is_empty());
    }

    #[test]
    fn grids_suit_transforms() {
        assert_eq!([127.9, 129.0, 2.0, 256.0, 257.0].map(transformable), [128, 144, 2, 256, 270]);
    }
}

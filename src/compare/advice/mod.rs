//! Choice of a method, grid, precision and tolerance for a scene from measurements on other scenes.

mod table;

pub use table::{Line, Table, Tables};

use super::accuracy::rms;
use super::pareto::growth;
use crate::record::advice::Advice;
use crate::record::tradeoff::Setting;
use asperity_contact::method::Kind;
use asperity_contact::quantity::Quantity;
use asperity_grid::next_fast_len;
use asperity_methods::find;

/// Exponent of the cost in the number of points for methods measured on one grid only. It follows from the challenge
/// paper (1 min at 1024² points, 1 h at 4096², three weeks at 32768²).
pub const GROWTH: f64 = 1.5;

/// Relative tolerance of point numbers and loads at the limits of the measured range.
const SAME: f64 = 1e-6;

/// Largest ratio of the shortest wavelengths of target and measured surface, and largest inverse ratio. Errors are
/// transferred at equal points per shortest wavelength. This preserves errors of areas. Errors of gaps depend on the
/// long waves: they are bounds if the measured surface has a narrower spectrum; from a wider one they are transferred
/// at equal points per side.
const LIKE_WAVES: f64 = 4.0;

/// Largest difference of the Hurst exponents of target and measured surface. Measured with tables of 0.8: advice for 0.5
/// keeps what it promises (`make verify-advice`), for 0.3 three of six promises were broken.
const LIKE_HURST: f64 = 0.3;

/// The scene to be solved.
#[derive(Debug, Clone)]
pub struct Target {
    /// Shortest wavelength of the surface over L.
    pub shortest_wavelength: f64,
    /// Hurst exponent of a spectrum.
    pub hurst: Option<f64>,
    /// Points per side of a surface that is given on a grid.
    pub own_grid: Option<usize>,
    /// Cell size along y over that along x.
    pub aspect: f64,
    pub kernel: String,
    /// Description of the adhesion law; `None` without adhesion.
    pub adhesion: Option<String>,
    pub p_star: Vec<f64>,
}

/// Upper limit: an error as relative deviation, or a time, s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Limit {
    Error(f64),
    Seconds(f64),
}

/// All measured settings that provide the quantity, transferred to the target at equal points per shortest wavelength.
/// For settings measured on several surfaces the largest error and cost are taken.
pub fn candidates(tables: &[Table], target: &Target, quantity: Quantity) -> Vec<Advice> {
    let mut found: Vec<Advice> = Vec::new();
    let each = tables.iter().flat_map(|t| t.lines.iter().map(move |l| (t, l)));
    for advice in each.filter_map(|(t, l)| candidate((tables, t), l, target, quantity)) {
        match found.iter_mut().find(|a| alike(a, &advice)) {
            Some(earlier) => join(earlier, &advice),
            None => found.push(advice),
        }
    }
    found
}

/// Whether two candidates have the same setting, both within the measured range or both outside.
fn alike(a: &Advice, b: &Advice) -> bool {
    (&a.method, a.grid, &a.precision, a.extrapolated.is_empty())
        == (&b.method, b.grid, &b.precision, b.extrapolated.is_empty())
        && a.tolerance == b.tolerance
}

fn join(a: &mut Advice, b: &Advice) {
    let ends = |a: [f64; 2], b: [f64; 2]| [a[0].min(b[0]), a[1].max(b[1])];
    a.expected_error = a.expected_error.max(b.expected_error);
    a.error_range = ends(a.error_range, b.error_range);
    if b.expected_seconds > a.expected_seconds {
        (a.expected_seconds, a.exponent, a.threads) = (b.expected_seconds, b.exponent, b.threads);
    }
    a.seconds_range = a.seconds_range.zip(b.seconds_range).map(|(a, b)| ends(a, b));
    a.surfaces += b.surfaces;
    for why in &b.extrapolated {
        if !a.extrapolated.contains(why) {
            a.extrapolated.push(why.clone());
        }
    }
}

/// A measured setting (`line`) transferred to the target; `None` if the measurement does not apply to it.
fn candidate((tables, table): (&[Table], &Table), line: &Line, target: &Target, quantity: Quantity) -> Option<Advice> {
    let s = &line.setting;
    // In a scene with adhesion, methods without adhesion were compared with a different reference solution.
    if s.adhesive != target.adhesion.is_some() || table.is_adhesive() != s.adhesive {
        return None;
    }
    // The model error of an estimate does not depend on the grid: measurements apply only to the same spectrum.
    let is_same_spectrum = same(table.shortest_wavelength, target.shortest_wavelength)
        && target.hurst.zip(table.hurst).is_none_or(|(a, b)| same(a, b));
    if !is_same_spectrum && find(&s.method).is_some_and(|m| m.card().kind == Kind::Estimate) {
        return None;
    }
    let errors = at_loads(table, line.errors.get(&quantity)?, &target.p_star)?;
    let grid = transferred_grid(table, s.nx, target, quantity)?;
    let points = grid as f64 * grid as f64 * target.aspect;
    let sizes: Vec<(f64, f64)> = table.grids(&s.method, s.adhesive).iter().map(|l| (l.points(), l.seconds)).collect();
    let grows = growth(&sizes);
    let mut extrapolated: Vec<String> = beyond_grids(tables, s, grid, points).into_iter().collect();
    extrapolated.extend(beyond_surface(table, s, target));
    if grows.is_none() && !same(points, line.points()) {
        extrapolated
            .push(format!("{} was measured on one grid: its cost is assumed to grow as in the paper", s.method));
    }
    extrapolated.extend(beyond_problem(table, target));
    let step = points / line.points();
    let part = target.p_star.len().max(1) as f64 / table.p_star.len().max(1) as f64;
    let expected = line.seconds * part * step.powf(grows.map_or(GROWTH, |g| g.exponent));
    let spread = if same(step, 1.0) { Some(1.0) } else { grows.and_then(|g| g.error).map(|e| step.powf(e)) };
    Some(Advice {
        method: s.method.clone(),
        grid,
        precision: s.precision.clone(),
        tolerance: s.tolerance,
        expected_error: rms(&errors)?,
        error_range: errors.iter().fold([f64::INFINITY, 0.0], |[a, b], e| [a.min(*e), b.max(*e)]),
        expected_seconds: expected,
        seconds_range: spread.map(|f| [expected / f.max(1.0 / f), expected * f.max(1.0 / f)]),
        exponent: grows.map(|g| g.exponent),
        threads: table.threads,
        surfaces: 1,
        extrapolated,
    })
}

fn same(a: f64, b: f64) -> bool {
    (a / b - 1.0).abs() < SAME
}

/// Points per side of the target with as many points per shortest wavelength as `nx` on the measured surface, and for
/// gaps no fewer points than there. `None` if the target's own grid has fewer.
fn transferred_grid(table: &Table, nx: usize, target: &Target, quantity: Quantity) -> Option<usize> {
    let of_gaps = matches!(quantity, Quantity::MeanGap | Quantity::Stiffness | Quantity::GapMap | Quantity::GapPdf);
    let ratio = table.shortest_wavelength / target.shortest_wavelength;
    let exact = nx as f64 * if of_gaps { ratio.max(1.0) } else { ratio };
    let grid = match target.own_grid {
        Some(own) => own,
        None if same(exact, nx as f64) => nx,
        None => next_fast_len((exact * (1.0 - SAME)).ceil() as usize),
    };
    (grid as f64 >= exact * (1.0 - SAME)).then_some(grid)
}

/// Whether the method was measured only on smaller or larger grids than that of the target, with `points` points.
fn beyond_grids(tables: &[Table], s: &Setting, grid: usize, points: f64) -> Option<String> {
    let is_same_method = |l: &&Line| l.setting.method == s.method && l.setting.adhesive == s.adhesive;
    let measured = || tables.iter().flat_map(|t| &t.lines).filter(is_same_method).map(Line::points);
    let (least, most) = (measured().fold(f64::INFINITY, f64::min), measured().fold(0.0, f64::max));
    let is_beyond = points > most * (1.0 + SAME) || points < least * (1.0 - SAME);
    let [least, most] = [least, most].map(|n| n.sqrt().round());
    is_beyond.then(|| format!("{grid} points per side, where {} was measured on {least} to {most} per side", s.method))
}

/// Differences of the target's spectrum.
fn beyond_surface(table: &Table, s: &Setting, target: &Target) -> Vec<String> {
    let ratio = table.shortest_wavelength / target.shortest_wavelength;
    let [requested, measured] = [target.shortest_wavelength, table.shortest_wavelength].map(|w| (1.0 / w).round());
    let mut list = Vec::new();
    if ratio.max(1.0 / ratio) > LIKE_WAVES * (1.0 + SAME) {
        list.push(format!("waves down to L/{requested}, where L/{measured} was measured"));
    }
    if let Some((requested, measured)) = target.hurst.zip(table.hurst)
        && (requested - measured).abs() > LIKE_HURST * (1.0 + SAME)
    {
        list.push(format!("a spectrum with Hurst exponent {requested}, where {measured} was measured"));
    }
    // With adhesion the error also depends on the resolution of its range, which is an independent length.
    if !same(ratio, 1.0) && target.adhesion.is_some() {
        list.push(format!(
            "{}, with adhesion, on waves down to L/{requested}, where L/{measured} was measured",
            s.method
        ));
    }
    list
}

/// Differences of the target's loads, elastic body and adhesion.
fn beyond_problem(table: &Table, target: &Target) -> Vec<String> {
    let ends = |of: &[f64]| of.iter().fold((f64::INFINITY, 0.0f64), |(a, b), p| (a.min(*p), b.max(*p)));
    let (low, high) = ends(&table.p_star);
    let mut list = Vec::new();
    if target.p_star.iter().any(|p| *p < low * (1.0 - SAME) || *p > high * (1.0 + SAME)) {
        let (from, to) = ends(&target.p_star);
        list.push(format!("loads p* of {from} to {to}, where {low} to {high} were measured"));
    }
    if table.kernel != target.kernel {
        list.push(format!("{}, where {} was measured", target.kernel, table.kernel));
    }
    if let Some(adhesion) = target.adhesion.as_ref().filter(|a| **a != table.adhesion) {
        list.push(format!("{adhesion}, where {} was measured", table.adhesion));
    }
    list
}

/// Errors at the target's loads: the larger one of the two neighbouring measured loads. `None` if one of these has no
/// error.
fn at_loads(table: &Table, errors: &[Option<f64>], loads: &[f64]) -> Option<Vec<f64>> {
    let known: Vec<(f64, Option<f64>)> = table.p_star.iter().copied().zip(errors.iter().copied()).collect();
    if known.is_empty() || loads.is_empty() {
        return errors.iter().copied().collect();
    }
    let at = |&p: &f64| {
        let below = known.iter().filter(|k| k.0 <= p * (1.0 + SAME)).max_by(|a, b| a.0.total_cmp(&b.0));
        let above = known.iter().filter(|k| k.0 >= p * (1.0 - SAME)).min_by(|a, b| a.0.total_cmp(&b.0));
        let about = [below.or(above)?.1?, above.or(below)?.1?];
        Some(about[0].max(about[1]))
    };
    loads.iter().map(at).collect()
}

/// The cheapest candidate within an error limit, or the most accurate one within a time limit and the cheaper of two
/// equal ones.
pub fn choose(candidates: &[Advice], quantity: Quantity, limit: Limit) -> Option<&Advice> {
    let cheaper = |a: &&Advice, b: &&Advice| a.expected_seconds.total_cmp(&b.expected_seconds);
    match limit {
        Limit::Error(share) => {
            let within = quantity.error_of_deviation(share) * (1.0 + SAME);
            candidates.iter().filter(|a| a.expected_error <= within).min_by(cheaper)
        }
        Limit::Seconds(s) => candidates
            .iter()
            .filter(|a| a.expected_seconds <= s)
            .min_by(|a, b| a.expected_error.total_cmp(&b.expected_error).then(cheaper(a, b))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    /// Errors inversely proportional to the points per side and increasing with load; costs proportional to the number
    /// of points to the power of 1.2.
    fn table() -> Table {
        let line = |nx: usize, method: &str, factor: f64| Line {
            setting: Setting {
                method: method.into(),
                adhesive: false,
                nx,
                ny: nx,
                precision: "f64".into(),
                tolerance: 1e-8,
                layer_thickness: None,
                block: None,
            },
            seconds: factor * ((nx * nx) as f64).powf(1.2) / 1e4,
            errors: BTreeMap::from([(Quantity::MeanGap, vec![Some(3.2 / nx as f64), Some(6.4 / nx as f64)])]),
        };
        Table {
            name: "t".into(),
            surface: String::new(),
            shortest_wavelength: 0.04,
            hurst: Some(0.8),
            p_star: vec![0.01, 0.1],
            kernel: "half-space".into(),
            adhesion: "none".into(),
            program: String::new(),
            threads: 2,
            lines: [64, 128, 256].iter().flat_map(|&n| [line(n, "fast", 1.0), line(n, "slow", 10.0)]).collect(),
        }
    }

    fn target(shortest_wavelength: f64) -> Target {
        Target {
            shortest_wavelength,
            hurst: None,
            own_grid: None,
            aspect: 1.0,
            kernel: "half-space".into(),
            adhesion: None,
            p_star: vec![0.02],
        }
    }

    /// For the measured surface the table's own setting is chosen. Half the number of loads takes half the time; the
    /// error is that of the worse of the two neighbouring loads.
    #[test]
    fn the_cheapest_within_an_error_and_the_best_within_a_time() {
        let all = candidates(&[table()], &target(0.04), Quantity::MeanGap);
        let best = choose(&all, Quantity::MeanGap, Limit::Error(0.06)).expect("one");
        assert_eq!((best.method.as_str(), best.grid, best.expected_error), ("fast", 128, 0.05));
        let cost = 0.5 * 16384f64.powf(1.2) / 1e4;
        assert!((best.expected_seconds / cost - 1.0).abs() < 1e-12 && best.extrapolated.is_empty(), "{best:?}");
        assert!(choose(&all, Quantity::MeanGap, Limit::Error(0.024)).is_none());
        assert_eq!(choose(&all, Quantity::MeanGap, Limit::Error(0.025)).map(|a| a.grid), Some(256));
        let light = Target { p_star: vec![0.01], ..target(0.04) };
        let all_light = candidates(&[table()], &light, Quantity::MeanGap);
        assert_eq!(choose(&all_light, Quantity::MeanGap, Limit::Error(0.03)).map(|a| a.grid), Some(128));
        let within = choose(&all, Quantity::MeanGap, Limit::Seconds(1.01 * cost)).expect("one");
        assert_eq!((within.method.as_str(), within.grid), ("fast", 128));
        assert!(choose(&all, Quantity::MeanGap, Limit::Seconds(1e-3)).is_none());
        // Of two with the same error the cheaper.
        let most = choose(&all, Quantity::MeanGap, Limit::Seconds(1e9)).expect("one");
        assert_eq!((most.method.as_str(), most.grid), ("fast", 256));
        assert!(candidates(&[table()], &target(0.04), Quantity::Stiffness).is_empty());
    }

    /// Half the shortest wavelength needs twice the points per side; the cost follows the fitted exponent.
    #[test]
    fn points_per_wave_are_kept() {
        let all = candidates(&[table()], &target(0.02), Quantity::MeanGap);
        let best = choose(&all, Quantity::MeanGap, Limit::Error(0.06)).expect("one");
        assert_eq!((best.grid, best.extrapolated.len()), (256, 0));
        assert!((best.expected_seconds / (0.5 * 65536f64.powf(1.2) / 1e4) - 1.0).abs() < 1e-9, "{best:?}");
        assert!(best.exponent.is_some_and(|e| (e - 1.2).abs() < 1e-9));
        // A grid finer than all measured ones is marked as an extrapolation.
        let finest = choose(&all, Quantity::MeanGap, Limit::Error(0.03)).expect("one");
        assert!(finest.grid == 512 && finest.extrapolated[0].contains("512"), "{finest:?}");
        let far = Target { p_star: vec![0.5], kernel: "layer".into(), ..target(0.04) };
        assert!(candidates(&[table()], &far, Quantity::MeanGap).iter().all(|a| a.extrapolated.len() == 2));
        // Model errors of an estimate are not transferred to another spectrum.
        let mut estimate = table();
        estimate.lines.iter_mut().for_each(|l| l.setting.method = "persson".into());
        let advised = |wave: f64| candidates(&[estimate.clone()], &target(wave), Quantity::MeanGap);
        assert!(advised(0.04)[0].extrapolated.is_empty() && advised(0.02).is_empty());
        let rougher = Target { hurst: Some(0.7), ..target(0.04) };
        assert!(candidates(&[estimate.clone()], &rougher, Quantity::MeanGap).is_empty());
        // Twice the shortest wavelength needs half the points for an area, and as many for a gap.
        let mut areas = table();
        areas.lines.iter_mut().for_each(|l| l.errors = BTreeMap::from([(Quantity::ContactArea, vec![Some(0.1); 2])]));
        let coarse = candidates(&[areas], &target(0.08), Quantity::ContactArea).swap_remove(0);
        assert_eq!(coarse.grid, 32);
        assert_eq!(coarse.extrapolated, ["32 points per side, where fast was measured on 64 to 256 per side"]);
        assert_eq!(candidates(&[table()], &target(0.08), Quantity::MeanGap)[0].grid, 64);
        // A very different shortest wavelength is marked as an extrapolation.
        let own_grid = Some(256);
        let other = Target { own_grid, ..target(0.2) };
        assert!(candidates(&[table()], &other, Quantity::MeanGap)[0].extrapolated[0].contains("waves"));
        for (ratio, is_like) in [(0.24, false), (0.26, true), (3.9, true), (4.1, false)] {
            let found = candidates(&[table()], &target(0.04 * ratio), Quantity::MeanGap);
            assert_ne!(found[0].extrapolated.iter().any(|why| why.starts_with("waves")), is_like, "{ratio}");
        }
    }

    /// An oblong cell of half the points takes less time by the fitted exponent. The range of the time has it in the middle,
    /// for larger and smaller grids.
    #[test]
    fn costs_follow_the_number_of_points() {
        let seconds = |table: &Table, target: &Target, quantity: Quantity| {
            let all = candidates(std::slice::from_ref(table), target, quantity);
            let found = all.iter().find(|a| a.method == "fast").expect("one");
            (found.expected_seconds, found.seconds_range.expect("three grids"))
        };
        let half = Target { aspect: 0.5, ..target(0.04) };
        let (square, strip) =
            (seconds(&table(), &target(0.04), Quantity::MeanGap).0, seconds(&table(), &half, Quantity::MeanGap).0);
        assert!((strip / square / 0.5f64.powf(1.2) - 1.0).abs() < 1e-9, "{strip} {square}");
        let mut noisy = table();
        for line in &mut noisy.lines {
            line.seconds *= if line.setting.nx == 128 { 2.0 } else { 1.0 };
            line.errors.insert(Quantity::ContactArea, vec![Some(0.1); 2]);
        }
        for wave in [0.02, 0.08] {
            let (expected, [from, to]) = seconds(&noisy, &target(wave), Quantity::ContactArea);
            assert!(from < 0.9 * expected && to > 1.1 * expected, "{wave}: {from} {expected} {to}");
            assert!((from * to / expected.powi(2) - 1.0).abs() < 1e-9);
        }
    }

    /// Grids have at least as many points per wave; on one measured grid the cost grows with the points to the power of 1.5.
    #[test]
    fn one_grid_is_transferred_with_the_growth_of_the_paper() {
        let mut single = table();
        single.lines.truncate(1);
        // 64.5 points per side would do; transforms are fast for 72.
        let advised = |wave: f64| candidates(std::slice::from_ref(&single), &target(wave), Quantity::MeanGap).remove(0);
        assert_eq!((advised(0.04).grid, advised(0.0397).grid), (64, 72));
        let finer = advised(0.02);
        assert!(finer.grid == 128 && finer.extrapolated.iter().any(|why| why.contains("one grid")), "{finer:?}");
        assert!((finer.expected_seconds / advised(0.04).expected_seconds - 8.0).abs() < 1e-9, "{finer:?}");
    }

    /// A spectrum of another Hurst exponent is marked as an extrapolation; one that is similar, or of a map, is not.
    #[test]
    fn other_spectra_are_extrapolations() {
        let beyond = |hurst: Option<f64>| {
            let found = candidates(&[table()], &Target { hurst, ..target(0.04) }, Quantity::MeanGap);
            found.iter().map(|a| a.extrapolated.concat()).collect::<Vec<String>>()
        };
        assert!(
            beyond(Some(0.3)).iter().all(|why| why.contains("Hurst exponent 0.3, where 0.8")),
            "{:?}",
            beyond(Some(0.3))
        );
        for similar in [None, Some(0.5), Some(0.8), Some(1.0)] {
            assert!(beyond(similar).iter().all(String::is_empty), "{similar:?}");
        }
    }

    /// A scene with adhesion uses only measurements with adhesion, and a scene without adhesion only those without.
    /// Another law or another shortest wavelength is marked as an extrapolation.
    #[test]
    fn adhesive_scenes_need_adhesive_tables() {
        let with = |word: &str, wave: f64| Target { adhesion: Some(word.into()), ..target(wave) };
        assert!(candidates(&[table()], &with("exponential", 0.04), Quantity::MeanGap).is_empty());
        let mut adhesive = Table { adhesion: "exponential".into(), ..table() };
        let dry = adhesive.lines.clone();
        adhesive.lines.iter_mut().for_each(|l| l.setting.adhesive = true);
        adhesive.lines.extend(dry);
        let beyond = |target: &Target| -> Vec<usize> {
            let found = candidates(&[table(), adhesive.clone()], target, Quantity::MeanGap);
            found.iter().map(|a| a.extrapolated.len()).collect()
        };
        assert_eq!(beyond(&with("exponential", 0.04)), [0; 6]);
        assert_eq!(beyond(&with("another", 0.04)), [1; 6]);
        assert_eq!(beyond(&with("exponential", 0.02))[..4], [1; 4]);
        // Without adhesion: the six settings of the first table, each measured on one surface.
        let dry = candidates(&[table(), adhesive], &target(0.04), Quantity::MeanGap);
        assert!(dry.len() == 6 && dry.iter().all(|a| a.surfaces == 1), "{dry:?}");
    }

    /// For two surfaces the larger error and the larger cost are taken.
    #[test]
    fn surfaces_join() {
        let mut worse = table();
        for line in &mut worse.lines {
            line.seconds *= 2.0;
            line.errors.values_mut().flatten().flatten().for_each(|e| *e *= 1.5);
        }
        let all = candidates(&[table(), worse], &target(0.04), Quantity::MeanGap);
        let one = all.iter().find(|a| a.grid == 128 && a.method == "fast").expect("one");
        assert_eq!((all.len(), one.surfaces), (6, 2));
        let [from, to] = one.seconds_range.expect("of the measured grid");
        assert!((to / from - 2.0).abs() < 1e-12 && (to / one.expected_seconds - 1.0).abs() < 1e-12, "{one:?}");
        assert!((one.error_range[0] - 0.05).abs() < 1e-12 && (one.error_range[1] - 0.075).abs() < 1e-12, "{one:?}");
        assert!(
            (one.expected_error - 0.075).abs() < 1e-12
                && (one.expected_seconds - 16384f64.powf(1.2) / 1e4).abs() < 1e-9
        );
    }
}

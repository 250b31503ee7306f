//! All acceptance checks, on synthetic results that agree with the paper. Changing one number must change a status.

mod numbers;

use super::*;
use crate::record::given_loads::GivenLoads;
use crate::record::results::{
    CURVATURE_RADIUS, FIRST_TOUCH, HEIGHT_RANGE, PsdPoint, RMS_HEIGHT, ScalesSi, SurfaceResults, SurfaceStatistic,
};
use asperity_contact::results::RangeResults;
use asperity_contact::state::Compressive;
use std::f64::consts::PI;

/// Loads p* of configs/challenge.toml.
const LOADS: [f64; 12] = [1e-3, 2e-3, 5e-3, 0.01, 0.02, 0.05, 0.1, 0.14, 0.2, 0.4, 0.7, 1.0];
/// Length of the cell, µm.
const UM: f64 = 100.0;
/// The same in m, and E* in Pa: units of the results.
const LENGTH: f64 = 1e-4;
const MODULUS: f64 = 25e6;
/// γ/ρ of the challenge, E*.
const PULL: f64 = 2e-5 / 2.071e-5;

/// Mean gap of the paper, µm: exponential in the load at high loads, logarithmic below.
fn mean_gap_um(p: f64) -> f64 {
    let turn: f64 = 0.137;
    let there = 0.3 * (-8.0 * turn).exp();
    if p >= turn { 0.3 * (-8.0 * p).exp() } else { there + (1.037 - there) * (turn / p).ln() / (turn / 0.01).ln() }
}

fn distribution(from: f64, to: f64, delta: f64, density: impl Fn(f64) -> f64) -> Distribution {
    let edges = asperity_contact::observe::linear_edges(from, to, 200);
    let raw: Vec<f64> = edges.windows(2).map(|e| density(0.5 * (e[0] + e[1])).max(0.0)).collect();
    let whole: f64 = raw.iter().sum();
    let fractions = raw.iter().map(|r| r * (1.0 - delta) / whole).collect();
    Distribution { edges, fractions, delta, below: 0.0, above: 0.0 }
}

/// Observables for a contact fraction `area`.
fn observed(area: f64, adhesive: bool) -> Observed {
    let um2 = UM * UM;
    // Persson's form at small loads, with the variance that gives the area erf(√π p*).
    let contact = |s: f64| if s > 0.0 { s * (-PI * s * s).exp() } else { 0.0 };
    let mut contact_stress = distribution(-PULL, 4.0, 1.0 - area, contact);
    contact_stress.delta = 0.0;
    // Outside contact there is only tension, with a density that increases towards zero.
    let open = distribution(-PULL, 4.0, 0.0, |s| if s < 0.0 { (8.0 * s).exp() } else { 0.0 });
    let mut stress = contact_stress.clone();
    stress.fractions.iter_mut().zip(&open.fractions).for_each(|(all, o)| *all += (1.0 - area) * o);
    // Adhesion reduces the probability of the smallest gaps.
    let gap = |u: f64| (-u / 1e-2).exp() * if adhesive { 1.0 - 0.5 * (-u / 5e-5).exp() } else { 1.0 };
    let linear = distribution(0.0, 0.05, area, gap);
    let sizes: Vec<f64> = (0..30).map(|k| 5e-4 * 10f64.powf(f64::from(k) / 6.0)).collect();
    let cumulative = |a: f64| if a <= 3.0 { 0.5 * (a / 3.0).powf(0.83) } else { 1.0 - 0.5 * (3.0 / a) };
    Observed {
        mean_contact_pressure: Some(0.5),
        gap: Some(linear.clone()),
        gap_logarithmic: Some(linear),
        stress: Some(stress),
        contact_stress: Some(contact_stress),
        cluster_density: sizes.iter().map(|a| [a / um2, a.powf(SIZE_EXPONENT) * um2, 100.0]).collect(),
        cluster_area: sizes.iter().map(|&a| [a / um2, cumulative(a)]).collect(),
        median_cluster_area: Some(3.0 / um2),
        compressive: adhesive.then_some(Compressive {
            clusters: 10,
            median_cluster_area: Some(1.0 / um2),
            median_cluster_area_error: Some(0.1 / um2),
        }),
        ..Observed::default()
    }
}

fn solved(adhesive: bool) -> ContinuumResults {
    let states = LOADS.map(|p| {
        let plain = libm::erf(PI.sqrt() * p);
        let area = if adhesive { (1.5 * plain).min(1.0) } else { plain };
        let state = State {
            index: LOADS.iter().position(|l| *l == p).expect("one of the loads"),
            p_star: p,
            pressure: p,
            contact_area: area,
            contact_nodes: Some(area),
            contact_nodes_compressive: adhesive.then_some(0.6 * area),
            clusters: Some(3000),
            mean_gap: Some(mean_gap_um(p) / UM),
            stiffness: Some(2.785),
            residual: Some(0.0),
            observed: Some(observed(area, adhesive)),
            ..State::default()
        };
        state.in_units(LENGTH, MODULUS)
    });
    let rho = 2.071e-5;
    let range =
        RangeResults { gamma: 2e-5, requested: rho, used: rho, resolution_requested: 1.4, resolution_used: 1.4 };
    ContinuumResults {
        hardness: None,
        hardness_map: None,
        method: "fast".into(),
        kernel: "half-space".into(),
        adhesion: String::new(),
        wall: "hard wall".into(),
        nx: 1 << 15,
        ny: 1 << 15,
        range: adhesive.then_some(range.in_units(LENGTH, MODULUS)),
        resolved_gradient: Some(1.0),
        states: states.into(),
        dissipation: None,
        percolation: None,
        onset: Default::default(),
        pull_off: None,
        contact_lost: None,
        pull_off_failure: None,
    }
}

/// A run on the paper's surface with all results as stated there.
fn agreeing() -> Results {
    let statistic = |symbol: &str, realised: f64| SurfaceStatistic {
        name: symbol.into(),
        symbol: symbol.into(),
        unit: String::new(),
        expected: None,
        expected_on_grid: None,
        realised,
        band: None,
    };
    let heights = [(RMS_HEIGHT, 0.762), (FIRST_TOUCH, 2.633), (HEIGHT_RANGE, 5.642), (CURVATURE_RADIUS, 60.0)];
    Results {
        schema: 1,
        name: String::new(),
        description: String::new(),
        scales: ScalesSi { length_m: LENGTH, modulus_pa: MODULUS },
        loads: GivenLoads::P_STAR,
        surface: SurfaceResults {
            origin: String::new(),
            provenance: None,
            nx: 1 << 15,
            ny: 1 << 15,
            aspect: 1.0,
            periodic: true,
            note: String::new(),
            heights: None,
            statistics: heights.map(|(symbol, value)| statistic(symbol, value)).into(),
            psd: [1.0_f64, 16.0, 64.0, 256.0]
                .map(|mode| PsdPoint { mode, realised: mode.powf(-3.6), expected: None })
                .to_vec(),
        },
        continuum: Some(solved(true)),
        accuracy: None,
        non_adhesive: Some(solved(false)),
        other_ranges: Vec::new(),
        cross_check: Some(solved(false)).map(|c| ContinuumResults { states: c.states[3..4].to_vec(), ..c }),
        methods: Vec::new(),
        failures: Vec::new(),
        acceptance: Vec::new(),
        atoms: None,
        comparison: None,
        stages: Vec::new(),
        warnings: Vec::new(),
        sources: Vec::new(),
    }
}

fn status(results: &Results, id: &str) -> CheckStatus {
    assess(results).into_iter().find(|j| j.id == id).unwrap_or_else(|| panic!("no {id}")).status
}

#[test]
fn results_that_agree_with_the_paper_pass() {
    let list = assess(&agreeing());
    assert!(list.iter().all(|j| j.status == CheckStatus::Pass), "{list:?}");
    let exact = list.iter().find(|j| j.id == "A03").and_then(|j| j.error).expect("an error");
    assert!(exact < 1e-6, "{exact}");
    // Differences of two solutions of one surface have no error (evidence/challenge.md); the synthetic states have none of their own.
    let errors: Vec<&str> = list.iter().filter(|j| j.error.is_some()).map(|j| j.id.as_str()).collect();
    for id in ["S12", "S16", "S17a", "S17b", "S18", "S21b", "S22", "S23a", "S23b"] {
        assert!(errors.contains(&id), "{id}: {errors:?}");
    }
    assert!(!errors.contains(&"S21a") && !errors.contains(&"S24"), "{errors:?}");
    let passed = list.len() - OF_THE_SETTING.len();
    assert_eq!(summary(&list), format!("{passed} pass, 0 fail; 0 not assessed; 4 hold by set-up"));
}

/// All statements about adhesion are judged at a longer range, and counted separately.
#[test]
fn statements_at_a_longer_range_are_separate() {
    let mut longer = agreeing();
    with(&mut longer).range.as_mut().unwrap().used *= 6.7;
    of(&mut seen(with(&mut longer)).stress).edges[0] /= 6.7; // The largest tension is γ/ρ.
    let of_adhesion = [
        "S05", "S06", "S08", "S10", "S11a", "S11b", "S12", "S14", "S15", "S16", "S17a", "S17b", "S18", "S21a", "S21b",
        "S23a", "S23b",
    ];
    for j in assess(&longer) {
        assert_eq!(j.scope == CheckScope::LongerRange, of_adhesion.contains(&j.id.as_str()), "{j:?}");
    }
    seen(with(&mut longer)).compressive.as_mut().unwrap().median_cluster_area = Some(2.2e-12);
    let list = assess(&longer);
    assert!(
        !has_failed(&list) && summary(&list).contains("with the longer range of adhesion: 1"),
        "{}",
        summary(&list)
    );
    assert!(summary(&list).contains("fail (S18"), "{}", summary(&list));
    let mut own = agreeing();
    seen(with(&mut own)).compressive.as_mut().unwrap().median_cluster_area = Some(2.2e-12);
    assert!(has_failed(&assess(&own)));
}

type Change = fn(&mut Results);

fn with(r: &mut Results) -> &mut ContinuumResults {
    r.continuum.as_mut().expect("made up")
}

fn without(r: &mut Results) -> &mut ContinuumResults {
    r.non_adhesive.as_mut().expect("made up")
}

fn at(c: &mut ContinuumResults, p: f64) -> &mut State {
    c.states.iter_mut().find(|s| s.p_star == p).expect("one of the loads")
}

fn seen(c: &mut ContinuumResults) -> &mut Observed {
    at(c, 0.01).observed.as_mut().expect("made up")
}

fn widen(s: &mut State, factor: f64) {
    s.mean_gap = s.mean_gap.map(|gap| factor * gap);
}

/// A distribution that every state of these has.
fn of(d: &mut Option<Distribution>) -> &mut Distribution {
    d.as_mut().expect("made up")
}

fn grow(c: &mut ContinuumResults, factor: f64) {
    c.states.iter_mut().for_each(|s| s.contact_area *= factor);
}

fn steepen(r: &mut Results, slope: f64) {
    with(r).states.iter_mut().for_each(|s| widen(s, (-slope * s.p_star).exp()));
}

#[test]
fn one_number_changed_fails_a_statement() {
    let changes: &[(&str, Change)] = &[
        ("S01", |r| with(r).range.as_mut().unwrap().requested *= 1.001),
        ("S02", |r| at(with(r), 0.01).pressure *= 1.00001),
        ("S03", |r| with(r).range.as_mut().unwrap().requested *= 0.999),
        ("S04a", |r| r.surface.statistics[0].realised += 0.001),
        // The tolerance includes the sampling between nodes, 0.06 nm here.
        ("S04b", |r| r.surface.statistics[1].realised += 0.001),
        ("S04c", |r| r.surface.statistics[2].realised += 0.001),
        ("S04d", |r| r.surface.statistics[3].realised += 0.6),
        ("S05", |r| grow(with(r), 1.15)),
        ("S06", |r| at(with(r), 0.01).contact_area = 0.036),
        ("S07a", |r| at(without(r), 5e-3).contact_area *= 1.25),
        ("S07b", |r| at(without(r), 0.4).contact_area *= 0.75),
        ("S08", |r| at(with(r), 0.1).contact_area *= 0.6),
        ("S09", |r| at(without(r), 2e-3).contact_area *= 1.25),
        ("S10", |r| at(with(r), 1e-3).contact_area *= 1.6),
        ("A01", |r| widen(at(without(r), 0.01), 1.17)),
        ("A02", |r| at(without(r), 0.01).stiffness = Some(3.5 * MODULUS / LENGTH)),
        ("A03", |r| r.surface.psd.iter_mut().for_each(|p| p.realised *= p.mode.powf(0.2))),
        ("S11a", |r| steepen(r, 1.1)),
        ("S11b", |r| with(r).states.iter_mut().for_each(|s| widen(s, 1.6))),
        ("S12", |r| widen(at(with(r), 0.02), 1.6)),
        ("S13", |r| r.surface.statistics[1].realised += 0.001),
        ("S14", |r| of(&mut seen(with(r)).stress).edges[0] *= 1.02),
        ("S15", |r| seen(with(r)).cluster_density.iter_mut().for_each(|[a, d, _]| *d *= a.powf(-0.2))),
        ("S16", |r| seen(with(r)).cluster_density.iter_mut().for_each(|[_, d, _]| *d = d.recip())),
        ("S17a", |r| seen(with(r)).median_cluster_area = Some(5e-12)),
        ("S17b", |r| seen(with(r)).cluster_area.iter_mut().for_each(|[_, fraction]| *fraction *= 0.5)),
        ("S18", |r| seen(with(r)).compressive.as_mut().unwrap().median_cluster_area = Some(2.2e-12)),
        ("S21a", |r| {
            // Moves a tenth of the gaps from large to small values.
            let d = of(&mut seen(with(r)).gap_logarithmic);
            let far = d.edges.iter().position(|e| *e > 1e-6).unwrap();
            d.fractions[far] += 0.1;
            d.fractions[far + 60] -= 0.1;
        }),
        ("S21b", |r| of(&mut seen(with(r)).gap_logarithmic).fractions[0] *= 3.0),
        ("S22", |r| {
            of(&mut seen(without(r)).contact_stress).fractions.rotate_right(12);
        }),
        ("S23a", |r| at(with(r), 0.01).contact_nodes_compressive = Some(0.0)),
        ("S23b", |r| {
            let stress = of(&mut seen(with(r)).stress);
            let zero = stress.edges.iter().rposition(|e| *e <= 0.0).unwrap();
            stress.fractions[zero - 1] = 1e-9;
        }),
        ("S24", |r| {
            let o = r.cross_check.as_mut().unwrap().states[0].observed.as_mut().unwrap();
            of(&mut o.contact_stress).fractions.rotate_right(12);
        }),
    ];
    for (id, change) in changes {
        let mut results = agreeing();
        assert_eq!(status(&results, id), CheckStatus::Pass, "{id}");
        change(&mut results);
        assert_eq!(status(&results, id), CheckStatus::Fail, "{id} does not notice");
    }
    let assessed: Vec<String> = assess(&agreeing()).into_iter().map(|j| j.id).collect();
    for id in assessed.iter().filter(|id| *id != "MESH") {
        assert!(changes.iter().any(|(known, _)| known == id), "{id} has no change that it must notice");
    }
}

/// Accepted ranges of evidence/challenge.md, for the paper's own surface.
#[test]
fn accepted_ranges_are_those_of_the_documents() {
    /// The range of A03 holds two standard errors of its fit, which are below 1e-6 here.
    const SMALL: f64 = 1e-5;
    const TENSION: f64 = f64::INFINITY;
    // Half of the last printed digit, and the height of an extremum above the highest of the nodes, which are 3.05 nm apart.
    let digit = 5e-4 + (UM / 32768.0).powi(2) / (4.0 * 0.04);
    let ranges = [
        ("MESH", 0.0, PI / 2.0),
        ("S01", 2.9997, 3.0017),
        ("S02", 249.99975, 250.00025),
        ("S03", 0.96562, 0.96582),
        ("S04a", 0.7615, 0.7625),
        ("S04b", 2.633 - digit, 2.633 + digit),
        ("S04c", 5.642 - digit, 5.642 + digit),
        ("S04d", 59.5, 60.5),
        ("S05", 1.3, 1.7),
        ("S06", 2.5, 3.5),
        ("S07a", 1.6, 2.4),
        ("S07b", 0.8, 1.2),
        ("S08", 1.0, 1.5),
        ("S09", 0.425, 0.575),
        ("S10", 0.2, 0.45),
        ("A01", 0.886, 1.194),
        ("A02", 2.174, 3.414),
        ("A03", 0.75, 0.85),
        ("S11a", -9.0, -7.0),
        ("S11b", 0.2, 0.45),
        ("S12", 0.98, 1.0),
        ("S13", 2.633 - digit, 2.633 + digit),
        ("S14", 0.0, 1.01),
        ("S15", 1.3, 1.6),
        ("S16", 100.0, 1000.0),
        ("S17a", 2.0, 4.5),
        ("S17b", 0.13, 0.27),
        ("S18", 0.5, 2.0),
        ("S21a", 0.0, 0.05),
        ("S21b", 0.0, 1.0),
        ("S22", 0.0, 0.1),
        ("S23a", 10.0, 200.0 / 3.0),
        ("S23b", 1.0, TENSION),
        ("S24", 0.0, 0.1),
    ];
    let list = assess(&agreeing());
    assert_eq!(list.len(), ranges.len());
    for (id, low, high) in ranges {
        let actual = list.iter().find(|j| j.id == id).unwrap_or_else(|| panic!("no {id}")).tolerance.expect("a range");
        let ends = actual.map(|end| end.unwrap_or(f64::INFINITY));
        assert!((ends[0] - low).abs() < SMALL && (ends[1] == high || (ends[1] - high).abs() < SMALL), "{id}: {ends:?}");
    }
}

/// Moves a fraction of the gaps with adhesion from one bin to another; bins are 25 nm wide.
fn move_gaps(r: &mut Results, from: usize, to: usize, fraction: f64) {
    let d = of(&mut seen(with(r)).gap_logarithmic);
    d.fractions[from] -= fraction;
    d.fractions[to] += fraction;
}

/// Adds clusters of an area (µm²) with a density that is a millionth of that of the power law.
fn sparse_clusters(r: &mut Results, um2: f64, clusters: f64) {
    let density = 1e-6 * um2.powf(SIZE_EXPONENT) * 1e12;
    seen(with(r)).cluster_density.push([um2 * 1e-12, density, clusters]);
}

/// Each statement uses the loads, gaps and clusters that it names: a change outside leaves it passing, the same change
/// inside fails it.
#[test]
fn statements_use_the_loads_and_sizes_that_they_name() {
    let changes: &[(&str, Change, Change)] = &[
        // Below 20 % of contact: 19.8 % at p* = 0.1, 27 % at 0.14. On either side of 2 p*.
        ("S07a", |r| area_of(without(r), 0.14, 1.3), |r| area_of(without(r), 0.1, 0.75)),
        ("S07a", |r| area_of(without(r), 0.14, 1.3), |r| area_of(without(r), 1e-3, 1.25)),
        // Loads up to 1.
        (
            "S07b",
            |r| {
                area_of(without(r), 1.0, 0.75);
                at(without(r), 1.0).p_star = 1.01;
            },
            |r| area_of(without(r), 1.0, 0.75),
        ),
        // Up to p* = 0.01, on either side of half.
        ("S09", |r| area_of(without(r), 0.02, 1.25), |r| area_of(without(r), 0.01, 1.25)),
        ("S09", |r| area_of(without(r), 0.02, 0.85), |r| area_of(without(r), 1e-3, 0.85)),
        // 1 to 5 % of contact: 0.53, 1.3, 2.7 and 5.3 % at p* = 0.002 to 0.02.
        ("S05", |r| area_of(with(r), 2e-3, 1.3), |r| area_of(with(r), 5e-3, 1.3)),
        ("S05", |r| area_of(with(r), 0.02, 1.3), |r| area_of(with(r), 0.01, 1.3)),
        // p* = 0.001 to 0.1.
        ("S08", |r| area_of(with(r), 0.14, 0.6), |r| area_of(with(r), 0.1, 0.6)),
        ("S08", |r| area_of(with(r), 0.14, 2.0), |r| area_of(with(r), 1e-3, 2.0)),
        // From p* = 0.137 on.
        ("S11a", |r| widen(at(with(r), 0.1), 20.0), |r| widen(at(with(r), 0.14), 20.0)),
        ("S11b", |r| widen(at(with(r), 0.1), 20.0), |r| widen(at(with(r), 0.14), 20.0)),
        // Up to p* = 0.1.
        ("S12", |r| widen(at(with(r), 0.14), 3.0), |r| widen(at(with(r), 0.1), 3.0)),
        // From 16 nodes (1.5e-4 µm²) to the median cluster of 3 µm², bins of five clusters and more.
        ("S15", |r| sparse_clusters(r, 1.4e-4, 100.0), |r| sparse_clusters(r, 1.6e-4, 100.0)),
        ("S15", |r| sparse_clusters(r, 3.1, 100.0), |r| sparse_clusters(r, 2.9, 100.0)),
        ("S15", |r| sparse_clusters(r, 2.9, 4.0), |r| sparse_clusters(r, 2.9, 5.0)),
        // Clusters up to 1 µm².
        (
            "S17b",
            |r| seen(with(r)).cluster_area.iter_mut().filter(|a| a[0] * 1e12 > 1.0).for_each(|a| a[1] = 1.0),
            |r| seen(with(r)).cluster_area.iter_mut().filter(|a| a[0] * 1e12 > 0.7).for_each(|a| a[1] = 0.3),
        ),
        // Gaps above 0.1 µm, the edge of the fourth bin.
        ("S21a", |r| move_gaps(r, 3, 1, 0.06), |r| move_gaps(r, 7, 5, 0.06)),
    ];
    for (k, (id, outside, inside)) in changes.iter().enumerate() {
        let status_after = |change: &Change| {
            let mut results = agreeing();
            change(&mut results);
            status(&results, id)
        };
        assert_eq!(
            (status_after(outside), status_after(inside)),
            (CheckStatus::Pass, CheckStatus::Fail),
            "{id}, change {k}"
        );
    }
}

fn area_of(c: &mut ContinuumResults, p: f64, factor: f64) {
    at(c, p).contact_area *= factor;
}

/// Between nodes 49 nm apart an extremum of radius 40 nm is up to 14.9 nm higher than the highest node.
#[test]
fn extrema_may_lie_between_the_nodes() {
    let status_after = |id: &str, change: f64| {
        let mut results = agreeing();
        with(&mut results).nx = 2048;
        let index = if id == "S04c" { 2 } else { 1 };
        results.surface.statistics[index].realised += change;
        status(&results, id)
    };
    for id in ["S04b", "S04c", "S13"] {
        for sign in [-1.0, 1.0] {
            assert_eq!(status_after(id, sign * 0.0152), CheckStatus::Pass, "{id}");
            assert_eq!(status_after(id, sign * 0.0156), CheckStatus::Fail, "{id}");
        }
    }
}

/// Reasons state the Tabor parameter at the range used, which is inversely proportional to it.
#[test]
fn reasons_state_the_tabor_parameter_of_the_range() {
    let mut longer = agreeing();
    with(&mut longer).range.as_mut().unwrap().used *= 2.5;
    let list = assess(&longer);
    let reason = |id: &str| &list.iter().find(|j| j.id == id).expect("a statement").reason;
    assert!(reason("S06").ends_with("at Tabor parameter 1.20"), "{}", reason("S06"));
    assert_eq!(reason("S01"), "at the range used on this grid: 1.20");
    assert_eq!(reason("S03"), "at the range used on this grid: 0.3863");
}

/// The most probable cluster needs nodes 5 nm apart, whatever the range.
#[test]
fn small_clusters_need_a_fine_grid() {
    for (nx, assessed) in [(20_000, true), (19_990, false)] {
        let mut longer = agreeing();
        with(&mut longer).range.as_mut().unwrap().used *= 2.0;
        (with(&mut longer).nx, with(&mut longer).ny) = (nx, nx);
        assert_eq!(status(&longer, "S16") != CheckStatus::NotAssessed, assessed, "{nx}");
    }
}

/// Areas of fewer than 500 nodes do not count.
#[test]
fn areas_of_few_nodes_do_not_count() {
    // At p* = 0.001 0.2 % of the nodes are in contact without adhesion; the statement fails there alone.
    for (nx, expected) in [(502, CheckStatus::Fail), (498, CheckStatus::Pass)] {
        let mut few = agreeing();
        (without(&mut few).nx, without(&mut few).ny) = (nx, nx);
        area_of(without(&mut few), 1e-3, 1.25);
        assert_eq!(status(&few, "S09"), expected, "{nx}");
    }
}

/// A grid that pins contact lines cannot test statements about adhesion; one that resolves too little of the roughness
/// cannot test those about short waves.
#[test]
fn statements_below_the_grid_spacing_are_not_assessed() {
    // The most probable cluster needs a fine grid as well.
    let of_adhesion =
        ["MESH", "S16", "S05", "S06", "S08", "S10", "S15", "S17a", "S17b", "S18", "S21a", "S21b", "S23a", "S23b"];
    let mut coarse = agreeing();
    with(&mut coarse).nx = 2048;
    for j in assess(&coarse) {
        let expected = of_adhesion.contains(&j.id.as_str());
        assert_eq!(j.status == CheckStatus::NotAssessed, expected, "{j:?}");
    }
    let of_roughness =
        ["S04a", "S04d", "S05", "S06", "S08", "S10", "S11a", "S11b", "S13", "S15", "S17a", "S17b", "S18"];
    let mut smooth = agreeing();
    without(&mut smooth).resolved_gradient = Some(0.9);
    for id in of_roughness {
        assert_eq!(status(&smooth, id), CheckStatus::NotAssessed, "{id}");
    }
    // The value is reported with the reason.
    let reported = assess(&smooth).into_iter().find(|j| j.id == "S06").expect("S06");
    assert!(reported.value.is_some_and(|v| (v - 3.0).abs() < 0.1) && reported.reason.contains("0.90"), "{reported:?}");
    // Extrema between the nodes.
    let mut few = agreeing();
    with(&mut few).nx = 128;
    for id in ["S04b", "S04c"] {
        assert_eq!(status(&few, id), CheckStatus::NotAssessed, "{id}");
    }
    let mut one = agreeing();
    one.cross_check = None;
    assert_eq!(status(&one, "S24"), CheckStatus::NotAssessed);
}

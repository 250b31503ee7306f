//! Acceptance checks of the contact-mechanics challenge (Müser et al. 2017): statements of the paper against results of
//! a run.
//!
//! Statements are numbered as in `evidence/challenge.md`. A statement that the grid or the run cannot test is not assessed,
//! with the reason.

mod area;
mod clusters;
mod gap;
mod setting;
mod stress;
#[cfg(test)]
mod tests;

use crate::record::acceptance::{AcceptanceCheck, CheckScope, CheckStatus};
use crate::record::results::{Results, ScalesSi};
use crate::scene::REFERENCE_LOAD;
use asperity_contact::observe::Distribution;
use asperity_contact::quantity::Quantity;
use asperity_contact::results::ContinuumResults;
use asperity_contact::state::{Observed, State};

/// Largest dx γ/(ρ² E*) at which the stiffness of adhesion is at most that of the stiffest wave of the grid along an
/// axis.
pub const MESH_LIMIT: f64 = std::f64::consts::FRAC_PI_2;

/// Smallest resolved fraction of the rms gradient for statements that depend on the shortest waves.
const RESOLVED: f64 = 0.97;

/// Smallest number of contact nodes for an area that is not dominated by single nodes.
const ENOUGH_NODES: f64 = 500.0;

/// Exponent of the number density of contact clusters over their area.
pub const SIZE_EXPONENT: f64 = -1.45;

/// Statements that follow from the set-up. MESH passes or is not assessed.
const OF_THE_SETTING: [&str; 4] = ["MESH", "S01", "S02", "S03"];

/// Number of checks of each status, as text. Checks that cannot fail and those at a longer range of adhesion are counted
/// separately.
pub fn summary(list: &[AcceptanceCheck]) -> String {
    let ids = |status: CheckStatus, scope: Option<CheckScope>| -> Vec<&str> {
        let is = |j: &&AcceptanceCheck| j.status == status && scope.is_none_or(|s| s == j.scope);
        list.iter().filter(is).map(|j| j.id.as_str()).collect()
    };
    let counts = |scope| {
        let failed = ids(CheckStatus::Fail, Some(scope));
        let which = if failed.is_empty() { String::new() } else { format!(" ({})", failed.join(", ")) };
        format!("{} pass, {} fail{which}", ids(CheckStatus::Pass, Some(scope)).len(), failed.len())
    };
    let longer = match list.iter().any(|j| j.scope == CheckScope::LongerRange && j.status != CheckStatus::NotAssessed) {
        true => format!("; with the longer range of adhesion: {}", counts(CheckScope::LongerRange)),
        false => String::new(),
    };
    format!(
        "{}{longer}; {} not assessed; {} hold by set-up",
        counts(CheckScope::Paper),
        ids(CheckStatus::NotAssessed, None).len(),
        ids(CheckStatus::Pass, Some(CheckScope::Setup)).len()
    )
}

/// Whether a statement about the paper's own problem failed.
pub fn has_failed(list: &[AcceptanceCheck]) -> bool {
    list.iter().any(|j| j.status == CheckStatus::Fail && j.scope != CheckScope::LongerRange)
}

/// Evaluates all statements for a run of a scene with `[challenge]`.
pub fn assess(results: &Results) -> Vec<AcceptanceCheck> {
    let Some(data) = ChallengeData::of(results) else { return Vec::new() };
    [setting::assess, area::assess, gap::assess, stress::assess, clusters::assess]
        .into_iter()
        .flat_map(|of_data| of_data(&data))
        .collect()
}

/// The state at the challenge's reference load on the loading branch.
pub fn reference(c: &ContinuumResults) -> Option<&State> {
    c.loading().find(|s| (s.p_star / REFERENCE_LOAD - 1.0).abs() < 1e-6)
}

/// Results of a run, for the evaluation of the statements.
struct ChallengeData<'a> {
    results: &'a Results,
    /// Results with adhesion. `unresolved`: why the grid does not resolve it, if so.
    adhesive: &'a ContinuumResults,
    unresolved: Option<String>,
    /// Results without adhesion.
    plain: &'a ContinuumResults,
    length_um: f64,
    modulus_pa: f64,
    /// Range of the adhesion over L, requested and used, and dx γ/(ρ² E*) for the two.
    ranges: [f64; 2],
    mesh: [f64; 2],
}

impl<'a> ChallengeData<'a> {
    fn of(results: &'a Results) -> Option<Self> {
        let (adhesive, plain) = (results.continuum.as_ref()?, results.non_adhesive.as_ref()?);
        let range = adhesive.range?;
        let dx = 1.0 / adhesive.nx as f64;
        let ScalesSi { length_m, modulus_pa } = results.scales;
        let ranges = [range.requested, range.used].map(|rho| rho / length_m);
        let mesh = ranges.map(|rho| dx * setting::GAMMA / (rho * rho));
        let unresolved = (mesh[1] > MESH_LIMIT).then(|| {
            format!(
                "the grid pins contact lines: dx γ/(ρ² E*) = {:.1}, at most π/2 would do; `--regularise` gives the grid a range \
                 that it resolves",
                mesh[1]
            )
        });
        let length_um = length_m * 1e6;
        Some(ChallengeData { results, adhesive, unresolved, plain, length_um, modulus_pa, ranges, mesh })
    }

    /// Whether the surface was read from a file, as the challenge's own surface is.
    fn is_imported(&self) -> bool {
        self.results.surface.psd.iter().all(|p| p.expected.is_none())
    }

    /// States of the loading branch with enough contact nodes.
    fn touching(c: &ContinuumResults) -> impl Iterator<Item = &State> {
        let nodes = (c.nx * c.ny) as f64;
        c.loading().filter(move |s| s.contact_nodes.is_some_and(|n| n * nodes >= ENOUGH_NODES) && s.contact_area > 0.0)
    }

    /// Observables at the reference load, with and without adhesion.
    fn observed(&self) -> Option<[&Observed; 2]> {
        let observed_of = |c| reference(c)?.observed.as_ref();
        Some([observed_of(self.adhesive)?, observed_of(self.plain)?])
    }

    /// Contact nodes of a state on the challenge's square cell, m².
    fn counted_area(&self, o: &Observed) -> Option<f64> {
        let length_m = self.results.scales.length_m;
        Some(o.gap.as_ref()?.delta * length_m * length_m)
    }

    /// Pascals of the largest adhesive stress γ/ρ of the range used.
    fn adhesive_stress(&self) -> f64 {
        setting::GAMMA / self.ranges[1] * self.modulus_pa
    }

    /// Checks a statement about adhesion if the grid resolves it; otherwise the value is only reported.
    fn of_adhesion(&self, item: Statement, assess: impl FnOnce(Statement) -> AcceptanceCheck) -> AcceptanceCheck {
        match &self.unresolved {
            Some(reason) => reported(assess(item), reason),
            None => self.at_range(assess(item)),
        }
    }

    /// Marks a check of results with adhesion if the range used exceeds the challenge's; the reason then states the Tabor
    /// parameter.
    fn at_range(&self, check: AcceptanceCheck) -> AcceptanceCheck {
        match self.ranges {
            [requested, used] if used > requested => AcceptanceCheck {
                reason: format!("{}; at Tabor parameter {:.2}", check.reason, setting::tabor(used)),
                scope: CheckScope::LongerRange,
                ..check
            },
            _ => check,
        }
    }

    /// Checks a statement about the shortest waves if the grid resolves them; otherwise the value is only reported.
    fn of_roughness(&self, item: Statement, assess: impl FnOnce(Statement) -> AcceptanceCheck) -> AcceptanceCheck {
        match self.plain.resolved_gradient {
            Some(g) if g < RESOLVED => {
                let reason =
                    format!("the grid resolves {g:.2} of the rms gradient: 2002 points per side resolve all of it");
                reported(assess(item), &reason)
            }
            _ => assess(item),
        }
    }

    /// Checks a statement about adhesion and the shortest waves if the grid resolves both.
    fn of_both(&self, item: Statement, assess: impl FnOnce(Statement) -> AcceptanceCheck) -> AcceptanceCheck {
        self.of_adhesion(item, |item| self.of_roughness(item, assess))
    }
}

/// A check whose value is not assessed.
fn reported(check: AcceptanceCheck, reason: &str) -> AcceptanceCheck {
    AcceptanceCheck { status: CheckStatus::NotAssessed, reason: reason.into(), ..check }
}

/// Relative uncertainty of a quantity at a load: the sum of the known components; `None` if none is known.
fn uncertainty(state: &State, quantity: Quantity) -> Option<f64> {
    let known = state.uncertainty.iter().filter(|u| u.quantity == quantity).filter_map(|u| u.relative);
    known.fold(None, |sum, r| Some(sum.unwrap_or(0.0) + r))
}

/// A statement of the paper.
#[derive(Clone, Copy)]
struct Statement {
    id: &'static str,
    text: &'static str,
    unit: &'static str,
}

impl Statement {
    fn new(id: &'static str, text: &'static str, unit: &'static str) -> Self {
        Statement { id, text, unit }
    }

    fn with_status(self, status: CheckStatus, reason: impl Into<String>) -> AcceptanceCheck {
        AcceptanceCheck {
            id: self.id.into(),
            statement: self.text.into(),
            unit: self.unit.into(),
            value: None,
            error: None,
            reference: None,
            tolerance: None,
            status,
            scope: if OF_THE_SETTING.contains(&self.id) { CheckScope::Setup } else { CheckScope::Paper },
            reason: reason.into(),
        }
    }

    fn not_assessed(self, reason: impl Into<String>) -> AcceptanceCheck {
        self.with_status(CheckStatus::NotAssessed, reason)
    }

    /// Passes between `low` and `high`; not assessed without a finite value.
    fn within(
        self,
        value: Option<f64>,
        reference: f64,
        [low, high]: [f64; 2],
        reason: impl Into<String>,
    ) -> AcceptanceCheck {
        let Some(value) = value.filter(|v| v.is_finite()) else {
            return self.not_assessed("too few loads, or too little contact, in this run");
        };
        let status = if (low..=high).contains(&value) { CheckStatus::Pass } else { CheckStatus::Fail };
        let finite = |end: f64| Some(end).filter(|e| e.is_finite());
        AcceptanceCheck {
            value: Some(value),
            reference: Some(reference),
            tolerance: Some([finite(low), finite(high)]),
            ..self.with_status(status, reason)
        }
    }

    /// Passes at or above `reference`.
    fn at_least(self, value: Option<f64>, reference: f64, reason: impl Into<String>) -> AcceptanceCheck {
        self.within(value, reference, [reference, f64::INFINITY], reason)
    }

    /// Passes within `reference` ± `width`.
    fn near(self, value: Option<f64>, reference: f64, width: f64, reason: impl Into<String>) -> AcceptanceCheck {
        self.within(value, reference, [reference - width, reference + width], reason)
    }
}

/// Fraction of the counted nodes with values below `x`, without the delta function; linear interpolation within a bin.
fn share_below(d: &Distribution, x: f64) -> f64 {
    let within = |i: usize| {
        let (a, b) = (d.edges[i], d.edges[i + 1]);
        d.fractions[i] * ((x - a) / (b - a)).clamp(0.0, 1.0)
    };
    d.below + (0..d.fractions.len()).map(within).sum::<f64>()
}

/// Whether the loads extend from `from` to `to`, within 5 %.
fn cover(loads: impl Iterator<Item = f64>, [from, to]: [f64; 2]) -> bool {
    let few_per_cent = 1.05;
    let (smallest, largest) = loads.fold((f64::INFINITY, 0.0_f64), |(l, m), p| (l.min(p), m.max(p)));
    smallest <= from * few_per_cent && largest * few_per_cent >= to
}

/// A least-squares line with standard errors.
struct LineFit {
    slope: f64,
    intercept: f64,
    /// Coefficient of determination.
    r2: f64,
    slope_error: f64,
    intercept_error: f64,
}

/// The least-squares line; `None` for fewer than three points.
fn line(points: &[(f64, f64)]) -> Option<LineFit> {
    if points.len() < 3 {
        return None;
    }
    let n = points.len() as f64;
    let mean = |value: fn(&(f64, f64)) -> f64| points.iter().map(value).sum::<f64>() / n;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for p in points {
        xx += (p.0 - x).powi(2);
        xy += (p.0 - x) * (p.1 - y);
        yy += (p.1 - y).powi(2);
    }
    (xx > 0.0).then(|| {
        let slope = xy / xx;
        let variance = (yy - slope * xy).max(0.0) / (n - 2.0);
        LineFit {
            slope,
            intercept: y - slope * x,
            r2: if yy > 0.0 { xy * xy / (xx * yy) } else { 1.0 },
            slope_error: (variance / xx).sqrt(),
            intercept_error: (variance * (1.0 / n + x * x / xx)).sqrt(),
        }
    })
}

/// Standard error of a number of a line by leaving out one point after the other (jackknife): (n − 1)/n times the sum of
/// the squared deviations from the mean of the n numbers.
fn jackknife(points: &[(f64, f64)], number: impl Fn(&LineFit) -> f64) -> Option<f64> {
    let without = |k: usize| -> Option<f64> {
        let others: Vec<_> = points.iter().enumerate().filter(|(i, _)| *i != k).map(|(_, p)| *p).collect();
        line(&others).map(|l| number(&l))
    };
    let actual: Vec<f64> = (0..points.len()).map(without).collect::<Option<_>>()?;
    let n = actual.len() as f64;
    let mean = actual.iter().sum::<f64>() / n;
    (n > 0.0).then(|| ((n - 1.0) / n * actual.iter().map(|v| (v - mean).powi(2)).sum::<f64>()).sqrt())
}

#[cfg(test)]
mod arithmetic {
    use super::*;

    #[test]
    fn lines_are_found() {
        let exact = line(&[(0.0, 1.0), (1.0, 3.0), (3.0, 7.0)]).unwrap();
        assert!(
            (exact.slope - 2.0).abs() < 1e-12
                && (exact.intercept - 1.0).abs() < 1e-12
                && (exact.r2 - 1.0).abs() < 1e-12
        );
        assert!(exact.slope_error < 1e-7 && exact.intercept_error < 1e-7);
        // Residuals -1, 2, -1 around 1 + x: variance 6, sums of squares 2; standard errors √3 and √5.
        let scattered = line(&[(0.0, 0.0), (1.0, 4.0), (2.0, 2.0)]).unwrap();
        assert!((scattered.slope - 1.0).abs() < 1e-12 && (scattered.slope_error - 3f64.sqrt()).abs() < 1e-12);
        assert!((scattered.intercept_error - 5f64.sqrt()).abs() < 1e-12 && (scattered.r2 - 0.25).abs() < 1e-12);
        assert!(line(&[(0.0, 1.0), (1.0, 3.0)]).is_none());
        assert!(line(&[(1.0, 1.0), (1.0, 3.0), (1.0, 2.0)]).is_none());
    }

    /// Four points with slopes 1.5, 1, 1 and 0.5 without the first, second, third and last: deviations of ±0.5.
    #[test]
    fn the_jackknife_is_the_spread_without_one_point() {
        let points = [(0.0, 0.0), (1.0, 0.0), (2.0, 1.0), (3.0, 3.0)];
        let slopes: Vec<f64> =
            (0..4).map(|k| line(&[&points[..k], &points[k + 1..]].concat()).expect("three points").slope).collect();
        let mean = slopes.iter().sum::<f64>() / 4.0;
        let expected = (0.75 * slopes.iter().map(|s| (s - mean).powi(2)).sum::<f64>()).sqrt();
        let actual = jackknife(&points, |l| l.slope).expect("four points");
        assert!((actual - expected).abs() < 1e-12 && actual > 0.1, "{actual} {expected}");
        assert!(jackknife(&points[..3], |l| l.slope).is_none());
        // On a line, no point matters.
        assert!(jackknife(&[(0.0, 1.0), (1.0, 3.0), (2.0, 5.0), (4.0, 9.0)], |l| l.r2).expect("four points") < 1e-12);
    }

    #[test]
    fn loads_cover_a_range_to_five_per_cent() {
        for (least, most, covers) in
            [(1.04e-3, 0.0953, true), (1.06e-3, 0.1, false), (1e-3, 0.095, false), (1e-4, 1.0, true)]
        {
            assert_eq!(cover([0.01, least, most].into_iter(), [1e-3, 0.1]), covers, "{least} {most}");
        }
    }

    #[test]
    fn shares_run_from_none_to_all() {
        let d =
            Distribution { edges: vec![0.0, 1.0, 3.0], fractions: vec![0.2, 0.4], delta: 0.4, below: 0.0, above: 0.0 };
        for (x, fraction) in [(-1.0, 0.0), (0.5, 0.1), (1.0, 0.2), (2.0, 0.4), (9.0, 0.6)] {
            assert!((share_below(&d, x) - fraction).abs() < 1e-12, "{x}");
            // Values below the first edge count everywhere.
            assert!((share_below(&Distribution { below: 0.1, ..d.clone() }, x) - fraction - 0.1).abs() < 1e-12, "{x}");
        }
    }

    #[test]
    fn statements_without_a_value_do_not_pass() {
        let item = Statement::new("S00", "nothing", "1");
        assert_eq!(item.near(None, 1.0, 0.1, "").status, CheckStatus::NotAssessed);
        assert_eq!(item.near(Some(f64::NAN), 1.0, 0.1, "").status, CheckStatus::NotAssessed);
        assert_eq!(item.near(Some(1.05), 1.0, 0.1, "").status, CheckStatus::Pass);
        assert_eq!(item.near(Some(1.2), 1.0, 0.1, "").status, CheckStatus::Fail);
    }
}

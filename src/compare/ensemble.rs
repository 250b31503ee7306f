//! Statistics over realisations: mean, scatter and confidence of each number, and differences of sources on the same
//! realisations.

use crate::record::ensemble::{
    Difference, Ensemble, EnsembleLoad, EnsemblePoint, EnsembleStatistic, Observable, Observation, PointStatus, Sample,
};
use serde_json::Value;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// The key over which statistics are taken.
pub const SEED: &str = "surface.seed";

/// Probability of the confidence interval.
const CONFIDENCE: f64 = 0.95;

/// Pairs of sources whose differences are computed: the first relative to the second.
const PAIRS: [[&str; 2]; 6] = [
    ["atoms", "compliant wall"],
    ["atoms", "compliant wall with hardness"],
    ["atoms", "offset wall"],
    ["atoms", "hard wall"],
    ["continuum", "without adhesion"],
    ["cross check", "without adhesion"],
];

/// The source that other methods are compared with.
pub const CONTINUUM: &str = "continuum";

/// Statistics of a sample; `None` without values.
pub fn sample(values: &[f64]) -> Option<Sample> {
    let (n, first) = (values.len(), *values.first()?);
    // Relative to the first, so that the mean of equal values is that value.
    let mean = first + values.iter().map(|v| v - first).sum::<f64>() / n as f64;
    let standard_deviation =
        (n > 1).then(|| (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1) as f64).sqrt());
    let standard_error = standard_deviation.map(|s| s / (n as f64).sqrt());
    let confidence = standard_error.map(|e| {
        let half = student(n - 1) * e;
        [mean - half, mean + half]
    });
    let [min, max] = values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, m], v| [l.min(*v), m.max(*v)]);
    Some(Sample { realisations: n, mean, standard_deviation, standard_error, confidence, min, max })
}

/// Two-sided quantile of Student's t for the confidence interval.
fn student(freedom: usize) -> f64 {
    let t = StudentsT::new(0.0, 1.0, freedom as f64).expect("at least one degree of freedom");
    t.inverse_cdf(0.5 * (1.0 + CONFIDENCE))
}

/// Fills in statistics and differences from the points that are done.
pub fn evaluate(ensemble: &mut Ensemble) {
    let (mut statistics, mut differences) = (Vec::new(), Vec::new());
    for (group, points) in groups(&ensemble.keys, &ensemble.points) {
        for observable in observables(&points) {
            let observations: Vec<&Observation> = points.iter().filter_map(|p| find(p, &observable)).collect();
            let values =
                |observable: fn(&Observation) -> f64| observations.iter().map(|o| observable(o)).collect::<Vec<f64>>();
            if let (Some(sample), Some(load)) = (sample(&values(|o| o.value)), mean_load(&observations)) {
                statistics.push(EnsembleStatistic { group: group.clone(), of: observable.clone(), load, sample });
            }
            differences
                .extend(references(&observable.source).filter_map(|r| difference(&group, &points, &observable, r)));
        }
    }
    (ensemble.statistics, ensemble.differences) = (statistics, differences);
}

/// A combination of the varied keys besides the seed, with its realisations.
type RealisationGroup<'a> = (Vec<(String, Value)>, Vec<&'a EnsemblePoint>);

fn groups<'a>(keys: &[String], points: &'a [EnsemblePoint]) -> Vec<RealisationGroup<'a>> {
    let mut groups: Vec<RealisationGroup> = Vec::new();
    for point in points.iter().filter(|p| p.status == PointStatus::Done) {
        let others = keys.iter().zip(&point.values).filter(|(k, _)| *k != SEED);
        let values: Vec<(String, Value)> = others.map(|(k, v)| (k.clone(), v.clone())).collect();
        match groups.iter_mut().find(|(g, _)| *g == values) {
            Some((_, members)) => members.push(point),
            None => groups.push((values, vec![point])),
        }
    }
    groups
}

/// What any of the points has, in the order of the first that has it.
fn observables(points: &[&EnsemblePoint]) -> Vec<Observable> {
    let mut list: Vec<Observable> = Vec::new();
    for o in points.iter().flat_map(|p| &p.numbers) {
        if !list.contains(&o.of) {
            list.push(o.of.clone());
        }
    }
    list
}

fn mean_load(observations: &[&Observation]) -> Option<EnsembleLoad> {
    EnsembleLoad::mean(observations.iter().map(|o| &o.load), |values| sample(values).map(|s| s.mean))
}

fn find<'a>(point: &'a EnsemblePoint, observable: &Observable) -> Option<&'a Observation> {
    point.numbers.iter().find(|o| o.of == *observable)
}

/// The sources with which one is compared.
fn references(source: &str) -> impl Iterator<Item = &'static str> {
    let is_method = asperity_methods::find(source).is_some().then_some(CONTINUUM);
    let pairs: Vec<&str> = PAIRS.iter().filter(|[of, _]| *of == source).map(|[_, reference]| *reference).collect();
    pairs.into_iter().chain(is_method)
}

fn difference(
    group: &[(String, Value)],
    points: &[&EnsemblePoint],
    observable: &Observable,
    reference: &str,
) -> Option<Difference> {
    let other = Observable { source: reference.into(), ..observable.clone() };
    let pairs: Vec<(&Observation, f64)> =
        points.iter().filter_map(|p| Some((find(p, observable)?, find(p, &other)?.value))).collect();
    let difference: Vec<f64> = pairs.iter().map(|(a, b)| a.value - b).collect();
    let relative: Vec<f64> = pairs.iter().filter(|(_, b)| *b != 0.0).map(|(a, b)| a.value / b - 1.0).collect();
    let first: Vec<&Observation> = pairs.iter().map(|(a, _)| *a).collect();
    Some(Difference {
        group: group.to_vec(),
        of: observable.clone(),
        reference: reference.into(),
        load: mean_load(&first)?,
        difference: sample(&difference)?,
        relative: sample(&relative).filter(|r| r.realisations == pairs.len()),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::given_loads::{GivenLoads, LoadQuantity};

    #[test]
    fn the_mean_of_equal_values_is_that_value() {
        for n in 1..20 {
            let sample = sample(&vec![0.003; n]).expect("values");
            assert_eq!((sample.mean, sample.standard_deviation.unwrap_or(0.0)), (0.003, 0.0));
        }
        assert!(sample(&[]).is_none());
    }
    use asperity_contact::load::Branch;

    /// Quantiles of Student's t of printed tables, to their last digit.
    const LAST_DIGIT: f64 = 6e-4;

    #[test]
    fn quantiles_are_those_of_tables() {
        for (freedom, t) in [(1, 12.706), (2, 4.303), (5, 2.571), (11, 2.201), (30, 2.042), (120, 1.980)] {
            assert!((student(freedom) - t).abs() < LAST_DIGIT, "{freedom}: {}", student(freedom));
        }
    }

    #[test]
    fn samples_have_mean_scatter_and_confidence() {
        let s = sample(&[1.0, 2.0, 4.0, 5.0]).expect("values");
        // Deviations -2, -1, 1, 2: sum of squares 10 over 3.
        let sd = (10.0_f64 / 3.0).sqrt();
        assert_eq!((s.realisations, s.mean, s.min, s.max), (4, 3.0, 1.0, 5.0));
        assert!((s.standard_deviation.expect("scatter") - sd).abs() < 1e-15);
        assert!((s.standard_error.expect("scatter") - sd / 2.0).abs() < 1e-15);
        let [low, high] = s.confidence.expect("an interval");
        assert!((0.5 * (high - low) / (sd / 2.0) - 3.182).abs() < LAST_DIGIT && (low + high - 6.0).abs() < 1e-12);
        let one = sample(&[7.0]).expect("a value");
        assert_eq!((one.standard_deviation, one.standard_error, one.confidence), (None, None, None));
        assert!(sample(&[]).is_none());
    }

    /// A pressure of 100 MPa is p* = 1.
    fn at(p_star: f64) -> EnsembleLoad {
        EnsembleLoad::of(GivenLoads { quantity: LoadQuantity::Pressure, of_p_star: 1e8, imposed: None }, p_star)
    }

    fn number(source: &str, value: f64) -> Observation {
        let observable = Observable {
            source: source.into(),
            load: 0,
            branch: Branch::Loading,
            quantity: "contact_area".into(),
            unit: "1".into(),
        };
        Observation { of: observable, load: at(0.01), value }
    }

    /// Differences are paired by realisation: their scatter is not that of the realisations. Failed points do not count.
    #[test]
    fn differences_are_paired_and_groups_are_separate() {
        let point = |seed: u64, hurst: f64, atoms: f64, wall: f64, status| EnsemblePoint {
            label: String::new(),
            values: vec![seed.into(), hurst.into()],
            status,
            reason: None,
            warnings: Vec::new(),
            area_uncertainty: None,
            numbers: vec![
                Observation { load: at(0.01 * seed as f64), ..number("atoms", atoms) },
                number("compliant wall", wall),
            ],
        };
        let points = vec![
            point(1, 0.8, 0.11, 0.10, PointStatus::Done),
            point(2, 0.8, 0.22, 0.20, PointStatus::Done),
            point(3, 0.8, 0.33, 0.30, PointStatus::Done),
            point(1, 0.3, 0.5, 0.4, PointStatus::Done),
            point(2, 0.3, 9.0, 1.0, PointStatus::Failed),
        ];
        let mut ensemble = Ensemble::new("test".into(), vec![SEED.into(), "surface.hurst".into()], None, points);
        evaluate(&mut ensemble);
        let wide: Vec<_> = ensemble.differences.iter().filter(|d| d.difference.realisations == 3).collect();
        assert_eq!(wide.len(), 1);
        let relative = wide[0].relative.expect("a positive reference");
        assert!((relative.mean - 0.1).abs() < 1e-12 && relative.standard_deviation.expect("scatter") < 1e-12);
        assert!((wide[0].difference.mean - 0.02).abs() < 1e-15);
        // The mean load of the first of both sources.
        let loads = [wide[0].load, ensemble.statistics[0].load];
        assert!(loads.iter().all(|l| (l.p_star - 0.02).abs() < 1e-15), "{loads:?}");
        assert!(
            loads.iter().all(|l| l.given().0 == LoadQuantity::Pressure && (l.given().1 - 2e6).abs() < 1e-6),
            "{loads:?}"
        );
        assert_eq!(wide[0].group, [("surface.hurst".to_string(), Value::from(0.8))]);
        assert_eq!(ensemble.statistics.len(), 4);
        assert_eq!(ensemble.statistics[2].sample.realisations, 1);
    }
}

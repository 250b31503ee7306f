use crate::grid::Field;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Shares of the nodes by value, the contact's delta and what lies beyond the bins counted apart: all together one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Distribution {
    /// Borders of the bins, rising; one more than there are bins.
    pub edges: Vec<f64>,
    /// Shares of all nodes, bin by bin; a value on a border belongs to the bin above it.
    pub fractions: Vec<f64>,
    /// Share of the nodes whose value is a delta: no gap where the surfaces touch, no stress where they do not.
    pub delta: f64,
    pub below: f64,
    /// From the last border on.
    pub above: f64,
}

/// Of the interfacial stress, compression positive.
#[derive(Debug, Clone, PartialEq)]
pub struct StressDistribution {
    pub all: Distribution,
    /// Of the nodes in contact alone, as shares of all nodes.
    pub contact: Distribution,
}

impl Distribution {
    /// Probability density in the middle of each bin: middle, density. The middle is the arithmetic one.
    pub fn density(&self) -> Vec<(f64, f64)> {
        let bin = |(e, share): (&[f64], &f64)| (0.5 * (e[0] + e[1]), share / (e[1] - e[0]));
        self.edges.windows(2).zip(&self.fractions).map(bin).collect()
    }

    /// The same with values in a unit of which one of this distribution's is `unit`.
    pub fn density_in(&self, unit: f64) -> Vec<(f64, f64)> {
        self.density().into_iter().map(|(middle, density)| (middle * unit, density / unit)).collect()
    }

    /// What all shares add up to: one.
    pub fn total(&self) -> f64 {
        self.fractions.iter().sum::<f64>() + self.delta + self.below + self.above
    }
}

/// Borders of `n` bins of equal width.
pub fn linear_edges(from: f64, to: f64, n: usize) -> Vec<f64> {
    (0..=n).map(|k| from + (to - from) * k as f64 / n as f64).collect()
}

/// Borders of `n` bins of equal ratio; both ends positive.
pub fn logarithmic_edges(from: f64, to: f64, n: usize) -> Vec<f64> {
    (0..=n).map(|k| from * (to / from).powf(k as f64 / n as f64)).collect()
}

/// Pr(u): gaps of at most `threshold` are contact, the delta.
pub fn gap_distribution(gap: Field, threshold: f64, edges: Vec<f64>) -> Distribution {
    count(gap.len(), edges, |i| {
        let g = gap.at(i);
        if g <= threshold { Value::Delta } else { Value::At(g) }
    })
}

/// Pr(σ), with the fraction of the contact. Without adhesion what is not in contact has no stress: that is the delta, and not
/// what a solver leaves there.
pub fn stress_distribution(
    gap: Field,
    stress: Field,
    (threshold, adhesive): (f64, bool),
    edges: Vec<f64>,
) -> StressDistribution {
    let touches = |i: usize| gap.at(i) <= threshold;
    let value = |i: usize| if touches(i) || adhesive { Value::At(stress.at(i)) } else { Value::Delta };
    let contact = |i: usize| if touches(i) { Value::At(stress.at(i)) } else { Value::None };
    StressDistribution { all: count(gap.len(), edges.clone(), value), contact: count(gap.len(), edges, contact) }
}

enum Value {
    At(f64),
    Delta,
    /// Not counted.
    None,
}

fn count(len: usize, edges: Vec<f64>, value: impl Fn(usize) -> Value + Sync) -> Distribution {
    const BLOCK: usize = 1 << 16;
    let bins = edges.len() - 1;
    // Below, the bins, above, delta. Whole numbers add up to the same sums in any order.
    let counts = (0..len.div_ceil(BLOCK))
        .into_par_iter()
        .fold(
            || vec![0u64; bins + 3],
            |mut counts, block| {
                for i in block * BLOCK..len.min((block + 1) * BLOCK) {
                    match value(i) {
                        Value::At(v) => counts[edges.partition_point(|e| *e <= v)] += 1,
                        Value::Delta => counts[bins + 2] += 1,
                        Value::None => {}
                    }
                }
                counts
            },
        )
        .reduce(|| vec![0; bins + 3], |a, b| a.iter().zip(b).map(|(a, b)| a + b).collect());
    let share = |k: usize| counts[k] as f64 / len as f64;
    Distribution {
        fractions: (1..=bins).map(share).collect(),
        delta: share(bins + 2),
        below: share(0),
        above: share(bins + 1),
        edges,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All shares together; rounding of sums of some hundred.
    const WHOLE: f64 = 1e-12;

    #[test]
    fn every_node_is_counted_once() {
        let gap: Vec<f64> = (0..1000).map(|i| if i % 4 == 0 { 0.0 } else { f64::from(i) * 1e-3 }).collect();
        let found = gap_distribution(Field::F64(&gap), 0.0, linear_edges(0.1, 0.9, 8));
        assert_eq!((found.delta, found.below, found.above), (0.25, 0.075, 0.075));
        assert!(found.fractions.iter().all(|s| (s - 0.075).abs() < WHOLE), "{found:?}");
        assert!((found.total() - 1.0).abs() < WHOLE);
        let logarithmic = gap_distribution(Field::F64(&gap), 0.0, logarithmic_edges(1e-3, 1.0, 30));
        assert!((logarithmic.total() - 1.0).abs() < WHOLE && logarithmic.above == 0.0, "{logarithmic:?}");
        let (middle, density) = found.density()[0];
        assert!((middle - 0.15).abs() < WHOLE && (density - 0.75).abs() < WHOLE);
    }

    #[test]
    fn stress_is_split_by_contact() {
        let gap = [0.0, 0.0, 1.0, 2.0];
        let stress = [0.3, -0.1, -0.2, 1e-9];
        let (gap, stress) = (Field::F64(&gap), Field::F64(&stress));
        let edges = linear_edges(-0.25, 0.35, 6);
        let sticky = stress_distribution(gap, stress, (0.0, true), edges.clone());
        assert_eq!(sticky.all.fractions, [0.25, 0.25, 0.25, 0.0, 0.0, 0.25]);
        assert_eq!(sticky.contact.fractions, [0.0, 0.25, 0.0, 0.0, 0.0, 0.25]);
        assert_eq!((sticky.all.delta, sticky.contact.total()), (0.0, 0.5));
        let dry = stress_distribution(gap, stress, (0.0, false), edges);
        assert_eq!(dry.all.delta, 0.5);
        assert_eq!(dry.all.total(), 1.0);
    }
}

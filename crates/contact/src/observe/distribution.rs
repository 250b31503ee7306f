use asperity_grid::Field;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Histogram of nodal values as fractions of all nodes, with a delta function and the values outside the bins. The sum
/// is one; of the contribution of the contact it is the share of the contact.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Distribution {
    /// Edges of the bins in increasing order, one more than bins.
    pub edges: Vec<f64>,
    /// Fraction of nodes in each bin; a value on an edge belongs to the bin above it.
    pub fractions: Vec<f64>,
    /// Fraction of nodes in the delta function: zero gap in contact, zero stress outside.
    pub delta: f64,
    /// Fraction of nodes below the first edge.
    pub below: f64,
    /// Values from the last edge on.
    pub above: f64,
}

/// Distribution of the interfacial stress, compression positive.
#[derive(Debug, Clone, PartialEq)]
pub struct StressDistribution {
    pub all: Distribution,
    /// Contact nodes only, as fractions of all nodes.
    pub contact: Distribution,
}

impl Distribution {
    /// Probability density in each bin: arithmetic mean of the bin edges, density.
    pub fn density(&self) -> Vec<(f64, f64)> {
        let bin = |(e, fraction): (&[f64], &f64)| (0.5 * (e[0] + e[1]), fraction / (e[1] - e[0]));
        self.edges.windows(2).zip(&self.fractions).map(bin).collect()
    }

    /// The density in another unit, of which one unit of this distribution is `unit`.
    pub fn density_in(&self, unit: f64) -> Vec<(f64, f64)> {
        self.density().into_iter().map(|(middle, density)| (middle * unit, density / unit)).collect()
    }

    /// With values in multiples of `unit`.
    pub(crate) fn in_units(self, unit: f64) -> Self {
        Distribution { edges: self.edges.into_iter().map(|e| e * unit).collect(), ..self }
    }

    /// Sum of all fractions, which is one for a distribution of all nodes.
    pub fn total(&self) -> f64 {
        self.fractions.iter().sum::<f64>() + self.delta + self.below + self.above
    }
}

/// Edges of `n` bins of equal width.
pub fn linear_edges(from: f64, to: f64, n: usize) -> Vec<f64> {
    (0..=n).map(|k| from + (to - from) * k as f64 / n as f64).collect()
}

/// Edges of `n` bins of equal ratio; `from` and `to` are positive.
pub fn logarithmic_edges(from: f64, to: f64, n: usize) -> Vec<f64> {
    (0..=n).map(|k| from * (to / from).powf(k as f64 / n as f64)).collect()
}

/// Pr(u): gaps of at most `threshold` are contact and belong to the delta function.
pub fn gap_distribution(gap: Field, threshold: f64, edges: Vec<f64>) -> Distribution {
    count(gap.len(), edges, |i| {
        let g = gap.at(i);
        if g <= threshold { BinnedValue::Delta } else { BinnedValue::At(g) }
    })
}

/// Pr(σ) of all nodes and of contact. Without adhesion, open nodes belong to the delta function at zero stress, because
/// the values of a solver there are its residual.
pub fn stress_distribution(
    gap: Field,
    stress: Field,
    (threshold, adhesive): (f64, bool),
    edges: Vec<f64>,
) -> StressDistribution {
    let touches = |i: usize| gap.at(i) <= threshold;
    let value = |i: usize| if touches(i) || adhesive { BinnedValue::At(stress.at(i)) } else { BinnedValue::Delta };
    let contact = |i: usize| if touches(i) { BinnedValue::At(stress.at(i)) } else { BinnedValue::None };
    StressDistribution { all: count(gap.len(), edges.clone(), value), contact: count(gap.len(), edges, contact) }
}

enum BinnedValue {
    At(f64),
    Delta,
    /// Not counted.
    None,
}

fn count(len: usize, edges: Vec<f64>, value: impl Fn(usize) -> BinnedValue + Sync) -> Distribution {
    const BLOCK: usize = 1 << 16;
    let bins = edges.len() - 1;
    // Below, the bins, above, delta. Sums of integers do not depend on the order.
    let counts = (0..len.div_ceil(BLOCK))
        .into_par_iter()
        .fold(
            || vec![0u64; bins + 3],
            |mut counts, block| {
                for i in block * BLOCK..len.min((block + 1) * BLOCK) {
                    match value(i) {
                        BinnedValue::At(v) => counts[edges.partition_point(|e| *e <= v)] += 1,
                        BinnedValue::Delta => counts[bins + 2] += 1,
                        BinnedValue::None => {}
                    }
                }
                counts
            },
        )
        .reduce(|| vec![0; bins + 3], |a, b| a.iter().zip(b).map(|(a, b)| a + b).collect());
    let fraction = |k: usize| counts[k] as f64 / len as f64;
    Distribution {
        fractions: (1..=bins).map(fraction).collect(),
        delta: fraction(bins + 2),
        below: fraction(0),
        above: fraction(bins + 1),
        edges,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding of the sum of all fractions.
    const WHOLE: f64 = 1e-12;

    #[test]
    fn every_node_is_counted_once() {
        let gap: Vec<f64> = (0..1000).map(|i| if i % 4 == 0 { 0.0 } else { f64::from(i) * 1e-3 }).collect();
        let actual = gap_distribution(Field::F64(&gap), 0.0, linear_edges(0.1, 0.9, 8));
        assert_eq!((actual.delta, actual.below, actual.above), (0.25, 0.075, 0.075));
        assert!(actual.fractions.iter().all(|s| (s - 0.075).abs() < WHOLE), "{actual:?}");
        assert!((actual.total() - 1.0).abs() < WHOLE);
        let logarithmic = gap_distribution(Field::F64(&gap), 0.0, logarithmic_edges(1e-3, 1.0, 30));
        assert!((logarithmic.total() - 1.0).abs() < WHOLE && logarithmic.above == 0.0, "{logarithmic:?}");
        let edges = logarithmic_edges(1e-3, 1.0, 3);
        assert!(edges.iter().zip([1e-3, 1e-2, 0.1, 1.0]).all(|(e, x)| (e / x - 1.0).abs() < WHOLE), "{edges:?}");
        let (middle, density) = actual.density()[0];
        assert!((middle - 0.15).abs() < WHOLE && (density - 0.75).abs() < WHOLE);
    }

    /// A value on an edge belongs to the bin above it; a density in another unit has the same fractions.
    #[test]
    fn edges_belong_to_the_bin_above() {
        let actual = gap_distribution(Field::F64(&[0.1, 0.2, 0.2, 0.3]), 0.0, vec![0.1, 0.2, 0.3]);
        assert_eq!((&actual.fractions[..], actual.below, actual.above), (&[0.25, 0.5][..], 0.0, 0.25));
        let (here, there) = (actual.density(), actual.density_in(4.0));
        assert!(here.iter().zip(there).all(|(a, b)| b == (4.0 * a.0, a.1 / 4.0)));
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

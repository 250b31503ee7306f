/// Areas of contact clusters as real numbers, as provided by methods of single asperities.
#[derive(Debug, Clone, PartialEq)]
pub struct ClusterAreas {
    /// In increasing order, all positive.
    areas: Vec<f64>,
    total: f64,
}

impl ClusterAreas {
    /// From areas in any order; areas that are not positive are discarded.
    pub fn new(areas: impl IntoIterator<Item = f64>) -> Self {
        let mut areas: Vec<f64> = areas.into_iter().filter(|a| *a > 0.0).collect();
        areas.sort_unstable_by(f64::total_cmp);
        let total = areas.iter().sum();
        ClusterAreas { areas, total }
    }

    pub fn count(&self) -> usize {
        self.areas.len()
    }

    /// CPr(a): pairs of area and fraction of the contact in clusters up to this area.
    pub fn cumulative(&self) -> Vec<[f64; 2]> {
        let mut sum = 0.0;
        self.areas.iter().map(|a| [*a, (sum += a, sum / self.total).1]).collect()
    }

    /// Area-weighted median: half of the contact is in clusters up to this area. `None` without contact.
    pub fn median(&self) -> Option<f64> {
        self.cumulative().into_iter().find(|[_, fraction]| *fraction >= 0.5).map(|[area, _]| area)
    }

    /// Pr(a): number density of clusters over their area, in bins of equal ratio from the smallest area on. Entries:
    /// geometric mean of the bin edges, density, number of clusters. Empty bins are omitted.
    pub fn distribution(&self, per_decade: usize) -> Vec<[f64; 3]> {
        let (Some(smallest), Some(largest)) = (self.areas.first(), self.areas.last()) else { return Vec::new() };
        let edge = |k: usize| smallest * 10f64.powf(k as f64 / per_decade as f64);
        (0..)
            .map(|k| (edge(k), edge(k + 1)))
            .take_while(|(from, _)| from <= largest)
            .filter_map(|(from, to)| {
                let n = self.areas.iter().filter(|a| (from..to).contains(*a)).count() as f64;
                (n > 0.0).then(|| [(from * to).sqrt(), n / ((to - from) * self.areas.len() as f64), n])
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_weigh_by_area() {
        let spots = ClusterAreas::new([4.0, 1.0, 0.0, 2.0, 1.0]);
        assert_eq!(spots.count(), 4);
        assert_eq!(spots.cumulative(), [[1.0, 0.125], [1.0, 0.25], [2.0, 0.5], [4.0, 1.0]]);
        assert_eq!(spots.median(), Some(2.0));
        assert_eq!(ClusterAreas::new([]).median(), None);
        // Less than half of the area is in the smaller one.
        assert_eq!(ClusterAreas::new([4.5, 5.5]).median(), Some(5.5));
        // Clusters per area and over all clusters, at the geometric means of the edges 1, 10 and 100.
        let actual = ClusterAreas::new([1.0, 1.0, 10.0]).distribution(1);
        assert!(
            (actual[0][0] / 10f64.sqrt() - 1.0).abs() < 1e-12 && (actual[1][0] / 1e3f64.sqrt() - 1.0).abs() < 1e-12
        );
        let density: Vec<f64> = actual.iter().map(|d| d[1]).collect();
        assert!((density[0] - 2.0 / 27.0).abs() < 1e-12 && (density[1] - 1.0 / 270.0).abs() < 1e-12, "{density:?}");
    }

    /// The distribution reproduces the exponent of the challenge, and each cluster is counted once.
    #[test]
    fn a_power_law_keeps_its_exponent() {
        let n = 40_000;
        // Quantiles of a Pareto distribution with a density exponent of -1.45.
        let spots = ClusterAreas::new((0..n).map(|i| (1.0 - (f64::from(i) + 0.5) / f64::from(n)).powf(-1.0 / 0.45)));
        let density = spots.distribution(10);
        let counted: f64 = density.iter().map(|d| d[2]).sum();
        assert_eq!(counted, f64::from(n));
        let (first, later) = (density[0], density[20]);
        let slope = (later[1] / first[1]).ln() / (later[0] / first[0]).ln();
        assert!((slope + 1.45).abs() < 0.02, "{slope}");
    }
}

use super::runs::Runs;
use asperity_grid::UnionFind;

/// Neighbours that belong to the same contact cluster.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Connectivity {
    /// Edge neighbours.
    Four,
    /// Edge and corner neighbours.
    Eight,
}

/// Label of nodes without contact.
pub const NO_CLUSTER: u32 = u32::MAX;

/// Contact clusters of a map.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ClusterLabels {
    /// Index of the cluster of each node, `[ny, nx]`; [`NO_CLUSTER`] without contact. Clusters are numbered by their first
    /// node.
    pub label: Vec<u32>,
    /// Number of nodes of each cluster.
    pub sizes: Vec<usize>,
}

/// Connected contact clusters of a map `[ny, nx]` (nonzero = contact). `periodic`: nodes on opposite sides of the map are neighbours.
pub fn clusters(map: &[u8], nx: usize, connectivity: Connectivity, periodic: bool) -> ClusterLabels {
    let (runs, mut sets) = connected(map, nx, connectivity, periodic);
    let mut label = vec![NO_CLUSTER; map.len()];
    // The root is the first run of the set.
    let mut number = vec![NO_CLUSTER; runs.len()];
    let mut sizes = Vec::new();
    for (run, (columns, y)) in runs.iter().enumerate() {
        let r = sets.root(run as u32) as usize;
        if number[r] == NO_CLUSTER {
            number[r] = sizes.len() as u32;
            sizes.push(0);
        }
        sizes[number[r] as usize] += runs.nodes(run);
        label[y * nx..][columns].fill(number[r]);
    }
    ClusterLabels { label, sizes }
}

/// Number of nodes of each cluster of [`clusters`], in the order of the first nodes.
pub fn cluster_sizes(map: &[u8], nx: usize, connectivity: Connectivity, periodic: bool) -> Vec<usize> {
    let (runs, mut sets) = connected(map, nx, connectivity, periodic);
    let mut size = vec![0; runs.len()];
    for run in 0..runs.len() {
        size[sets.root(run as u32) as usize] += runs.nodes(run);
    }
    size.retain(|s| *s > 0);
    size
}

/// Runs of contact nodes, and their connected sets.
fn connected(map: &[u8], nx: usize, connectivity: Connectivity, periodic: bool) -> (Runs, UnionFind) {
    let runs = Runs::of(map, nx, |m| m != 0);
    let sets = runs.connected((connectivity == Connectivity::Eight, periodic), |_, _| (), |()| ());
    (runs, sets)
}

/// CPr: fraction of the contact area in clusters of at most each size (Müser et al. 2017, eq. 4: weighted by area).
/// Pairs of size in nodes and fraction, in increasing order.
pub fn cumulative_area(sizes: &[usize]) -> Vec<(usize, f64)> {
    let mut sorted = sizes.to_vec();
    sorted.sort_unstable();
    let total = sorted.iter().sum::<usize>() as f64;
    let mut curve: Vec<(usize, f64)> = Vec::new();
    let mut sum = 0;
    for size in sorted {
        sum += size;
        match curve.last_mut() {
            Some(last) if last.0 == size => last.1 = sum as f64 / total,
            _ => curve.push((size, sum as f64 / total)),
        }
    }
    curve
}

/// Area-weighted median size of the clusters, in nodes: the size at which [`cumulative_area`] reaches one half. `None`
/// without contact.
pub fn median_cluster_size(sizes: &[usize]) -> Option<usize> {
    cumulative_area(sizes).into_iter().find(|(_, fraction)| *fraction >= 0.5).map(|(size, _)| size)
}

/// Sum over the clusters of (area/contact area)², from CPr: a step of height s at the area a consists of clusters that hold
/// a/`contact` of the contact each. `curve` and `contact` have one unit of area.
fn squared_shares(curve: impl IntoIterator<Item = [f64; 2]>, contact: f64) -> f64 {
    let mut previous = 0.0;
    curve.into_iter().map(|[a, fraction]| (fraction - std::mem::replace(&mut previous, fraction)) * a / contact).sum()
}

/// Number of equal clusters with the counting errors of these: (Σ a)²/Σ a², from the CPr of a contact area `contact`.
pub fn effective_clusters(curve: &[[f64; 2]], contact: f64) -> Option<f64> {
    let sum = squared_shares(curve.iter().copied(), contact);
    (contact > 0.0 && sum > 0.0).then(|| 1.0 / sum)
}

/// Counting error of the share F of the contact in clusters up to `area`: with independent clusters of area a,
/// δF² = (1 − F)² Σ a² below + F² Σ a² above, over the whole contact squared. `None` without clusters on both sides.
pub fn share_counting_error(curve: &[[f64; 2]], contact: f64, area: f64) -> Option<f64> {
    let fraction = curve.iter().take_while(|[a, _]| *a <= area).last().map_or(0.0, |[_, s]| *s);
    let below = squared_shares(curve.iter().copied().take_while(|[a, _]| *a <= area), contact);
    let above = squared_shares(curve.iter().copied(), contact) - below;
    (contact > 0.0 && fraction > 0.0 && fraction < 1.0)
        .then(|| ((1.0 - fraction).powi(2) * below + fraction * fraction * above).sqrt())
}

/// Counting error of the area-weighted median cluster: half the range of areas whose cumulative share is within the
/// error of one half.
pub fn median_counting_error(curve: &[[f64; 2]], contact: f64, median: f64) -> Option<f64> {
    let error = share_counting_error(curve, contact, median)?;
    let area_at = |fraction: f64| curve.iter().find(|[_, s]| *s >= fraction).map(|[a, _]| *a);
    Some(0.5 * (area_at((0.5 + error).min(1.0))? - area_at(0.5 - error)?))
}

/// Pr(a): number density of clusters over their area in nodes, in bins of equal ratio from one node on. Entries:
/// geometric mean of the smallest and largest number of nodes in the bin, density, number of clusters. Empty bins are omitted.
pub fn size_distribution(sizes: &[usize], per_decade: usize) -> Vec<(f64, f64, usize)> {
    let largest = sizes.iter().copied().max().unwrap_or(0);
    // The first edge is at 1/2; a bin of small sizes contains one whole number or none.
    let edge = |k: usize| 10f64.powf(k as f64 / per_decade as f64) - 0.5;
    (0..)
        .map(|k| (edge(k), edge(k + 1)))
        .take_while(|(from, _)| *from < largest as f64)
        .filter_map(|(from, to)| {
            // Whole numbers in [from, to).
            let (smallest, values) = (from.ceil(), to.ceil() - from.ceil());
            let n = sizes.iter().filter(|s| (**s as f64) >= from && (**s as f64) < to).count();
            (n > 0)
                .then(|| ((smallest * (smallest + values - 1.0)).sqrt(), n as f64 / (values * sizes.len() as f64), n))
        })
        .collect()
}

/// Constriction conductance of clusters of the given areas (units of L²) times the resistivity of the bodies (equal for
/// both), units of L: circular spots of radius a without interaction, 2a each (Holm, Electric Contacts (1967)).
/// Interacting spots conduct less: K/E* with the contact stiffness K, force over length (Barber, Proc. R. Soc. A 459
/// (2003) 53).
pub fn constriction_conductance(areas: impl IntoIterator<Item = f64>) -> f64 {
    areas.into_iter().map(|a| 2.0 * (a / std::f64::consts::PI).sqrt()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observe::drawn;

    /// Clusters of 1, 1, 2 and 4 of 8: squares 22/64, below 2 (2 included) 6/64 of half of the contact.
    #[test]
    fn counting_errors_are_those_of_independent_clusters() {
        let curve = [[1.0, 0.25], [2.0, 0.5], [4.0, 1.0]];
        assert!((effective_clusters(&curve, 8.0).expect("contact") - 64.0 / 22.0).abs() < 1e-12);
        let fraction = share_counting_error(&curve, 8.0, 2.5).expect("both sides");
        assert!((fraction - (0.25 * 22.0 / 64.0_f64).sqrt()).abs() < 1e-12, "{fraction}");
        // Shares of 0.5 ± 0.29 are reached at areas of 1 and 4.
        assert_eq!(median_counting_error(&curve, 8.0, 2.0), Some(1.5));
        assert_eq!(share_counting_error(&curve, 8.0, 0.5), None);
        assert_eq!(share_counting_error(&curve, 8.0, 4.0), None);
        assert_eq!(effective_clusters(&[], 0.0), None);
        // A hundred clusters of 1 and a hundred of 2 count as 300²/500.
        let many = [[1.0, 1.0 / 3.0], [2.0, 1.0]];
        let n = effective_clusters(&many, 300.0).expect("contact");
        assert!((n - 180.0).abs() < 1e-9, "{n}");
    }

    #[test]
    fn patches_join_across_the_seam_and_at_corners() {
        let (m, nx) = drawn("#...# ..... .##.. ...#. #....");
        let mut four = cluster_sizes(&m, nx, Connectivity::Four, true);
        four.sort();
        // The two corner nodes are connected across x, and the node below them across y; the diagonal pair is not
        // connected.
        assert_eq!(four, [1, 2, 3]);
        let mut eight = cluster_sizes(&m, nx, Connectivity::Eight, true);
        eight.sort();
        assert_eq!(eight, [3, 3]);
        // Corners across x alone, along either diagonal.
        for corners in ["#.... ....# .....", "....# #.... ....."] {
            let (m, nx) = drawn(corners);
            assert_eq!(cluster_sizes(&m, nx, Connectivity::Four, true), [1, 1]);
            assert_eq!(cluster_sizes(&m, nx, Connectivity::Eight, true), [2]);
        }
    }

    #[test]
    fn checkerboard_stripe_and_full() {
        let (m, nx) = drawn("#.#. .#.# #.#. .#.#");
        assert_eq!(cluster_sizes(&m, nx, Connectivity::Four, true), [1; 8]);
        assert_eq!(cluster_sizes(&m, nx, Connectivity::Eight, true), [8]);
        let (m, nx) = drawn(".... #### .... ....");
        assert_eq!(cluster_sizes(&m, nx, Connectivity::Four, true), [4]);
        assert_eq!(cluster_sizes(&[1; 12], 3, Connectivity::Four, true), [12]);
        assert!(cluster_sizes(&[0; 12], 3, Connectivity::Four, true).is_empty());
    }

    /// Labels are consistent with sizes; nodes without contact have no label.
    #[test]
    fn labels_number_the_patches() {
        let (m, nx) = drawn("#...# ..... .##.. ...#. #....");
        let actual = clusters(&m, nx, Connectivity::Eight, true);
        assert_eq!(actual.sizes, cluster_sizes(&m, nx, Connectivity::Eight, true));
        for (cluster, size) in actual.sizes.iter().enumerate() {
            assert_eq!(actual.label.iter().filter(|l| **l == cluster as u32).count(), *size);
        }
        assert!(actual.label.iter().zip(&m).all(|(l, m)| (*l == NO_CLUSTER) == (*m == 0)));
        // Nodes at corners are connected across the periodic boundary; the second cluster has a diagonal connection.
        assert_eq!((actual.label[0], actual.label[4], actual.label[20]), (0, 0, 0));
        assert_eq!((actual.label[11], actual.label[18]), (1, 1));
    }

    #[test]
    fn areas_add_up_by_size() {
        let sizes = [4, 1, 1, 2, 8];
        let curve = cumulative_area(&sizes);
        assert_eq!(curve, [(1, 0.125), (2, 0.25), (4, 0.5), (8, 1.0)]);
        assert_eq!((median_cluster_size(&sizes), median_cluster_size(&[])), (Some(4), None));
        assert_eq!(median_cluster_size(&[3]), Some(3));
    }

    /// A power law with an exponent of -3/2, and the density of a small sample.
    #[test]
    fn sizes_have_a_density() {
        /// Tolerance of the exponent, due to whole numbers in bins of equal ratio.
        const SLOPE: f64 = 0.03;
        let number = |a: usize| (1e7 * (a as f64).powf(-1.5)).round() as usize;
        let sizes: Vec<usize> = (1..=1000).flat_map(|a| std::iter::repeat_n(a, number(a))).collect();
        let actual = size_distribution(&sizes, 5);
        assert_eq!(actual.iter().map(|b| b.2).sum::<usize>(), sizes.len());
        let (first, last) = (actual[3], actual[actual.len() - 2]);
        let slope = (last.1 / first.1).ln() / (last.0 / first.0).ln();
        assert!((slope + 1.5).abs() < SLOPE, "{slope} {actual:?}");
        let single = size_distribution(&[1, 1, 1, 2], 5);
        assert_eq!((single[0].1, single[0].2, single.last().unwrap().2), (0.75, 3, 1));
        // Bins of one number are at this number, those of 4 and 5 and of 6 to 9 nodes at the geometric mean.
        assert_eq!([single[0].0, single[1].0], [1.0, 2.0]);
        let wide: Vec<f64> = size_distribution(&[3, 4, 6], 5).into_iter().map(|b| b.0).collect();
        assert_eq!(wide, [3.0, 20f64.sqrt(), 54f64.sqrt()]);
        assert!(size_distribution(&[], 5).is_empty());
    }

    #[test]
    fn one_spot_has_the_conductance_of_holm() {
        assert!((constriction_conductance([std::f64::consts::PI * 0.04]) - 0.4).abs() < 1e-15);
        assert_eq!(constriction_conductance([]), 0.0);
    }
}

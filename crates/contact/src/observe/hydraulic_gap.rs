use super::runs::Runs;
use asperity_grid::Field;
use rayon::prelude::*;

/// Equivalent hydraulic gap, in units of the gap: the uniform gap with the same leakage. Pressure-driven flow with the
/// lubrication conductivity u³ at each node, in Bruggeman's effective-medium theory (Ann. Phys. 416 (1935) 636; for
/// leakage Lorenz & Persson, Eur. Phys. J. E 31 (2010) 159): ⟨(u³ - c)/(u³ + c)⟩ = 0 in two dimensions. Zero if at
/// least half of the nodes have a gap of at most `threshold`, where the effective medium has no conductivity.
pub fn hydraulic_gap(gap: Field, threshold: f64) -> f64 {
    let open = Classes::of(gap, threshold);
    if 2 * open.count() <= gap.len() as u64 {
        return 0.0;
    }
    let closed = (gap.len() as u64 - open.count()) as f64;
    // Decreases with c, from the number of open minus closed nodes to a negative value.
    let balance = |c: f64| open.0.iter().map(|&(n, k)| n as f64 * (k - c) / (k + c)).sum::<f64>() - closed;
    let conductivities = open.0.iter().map(|c| c.1);
    let (mut low, mut high) = (0.0, conductivities.fold(0.0, f64::max));
    // Bisection in the logarithm once the lower bound is positive; 200 steps reach full precision from any scale.
    for _ in 0..200 {
        let middle = if low > 0.0 { (low * high).sqrt() } else { high * 1e-3 };
        if balance(middle) > 0.0 {
            low = middle
        } else {
            high = middle
        }
        if high <= f64::MIN_POSITIVE {
            break;
        }
    }
    high.cbrt()
}

/// Open nodes in classes of nearly equal gap: number of nodes and mean of u³.
struct Classes(Vec<(u64, f64)>);

impl Classes {
    /// Classes per factor of two of the gap. The error of the result is of second order in the width of a class.
    const PER_OCTAVE: usize = 64;

    fn of(gap: Field, threshold: f64) -> Self {
        const BLOCK: usize = 1 << 16;
        let largest = (0..gap.len()).into_par_iter().map(|i| gap.at(i)).reduce(|| 0.0, f64::max);
        // Gaps below 2^-60 of the largest have no conductivity but count as open.
        let classes = 60 * Self::PER_OCTAVE;
        let class = |g: f64| ((largest / g).log2() * Self::PER_OCTAVE as f64).min(classes as f64) as usize;
        let blocks: Vec<Vec<(usize, u64, f64)>> = (0..gap.len().div_ceil(BLOCK))
            .into_par_iter()
            .map(|b| {
                let mut here = vec![(0u64, 0.0); classes + 1];
                for g in (b * BLOCK..gap.len().min((b + 1) * BLOCK)).map(|i| gap.at(i)).filter(|g| *g > threshold) {
                    let (n, sum) = &mut here[class(g)];
                    *n += 1;
                    *sum += g.powi(3);
                }
                here.into_iter().enumerate().filter(|(_, (n, _))| *n > 0).map(|(k, (n, sum))| (k, n, sum)).collect()
            })
            .collect();
        let mut all = vec![(0, 0.0); classes + 1];
        for (k, n, sum) in blocks.into_iter().flatten() {
            all[k].0 += n;
            all[k].1 += sum;
        }
        Classes(all.into_iter().filter(|(n, _)| *n > 0).map(|(n, sum)| (n, sum / n as f64)).collect())
    }

    fn count(&self) -> u64 {
        self.0.iter().map(|c| c.0).sum()
    }
}

/// Whether the nodes of a map `[ny, nx]` with the value `what` (0: open, 1: contact) percolate along x and along y: around a periodic
/// cell, otherwise from one side of the map to the opposite one. `corners`: whether corner neighbours are connected.
pub fn percolates(map: &[u8], nx: usize, (what, corners): (u8, bool), periodic: bool) -> [bool; 2] {
    let mut around = [false; 2];
    let runs = Runs::of(map, nx, |m| (m != 0) == (what != 0));
    // Offsets in columns and rows; that of a closed loop is zero unless it winds around the cell.
    let mut sets = runs.connected(
        (corners, periodic),
        |along, down| [along as i32, down],
        |winding: [i32; 2]| around = [around[0] || winding[0] != 0, around[1] || winding[1] != 0],
    );
    if periodic {
        return around;
    }
    // The sides that each connected set touches: left, right, first row, last row.
    let mut sides = vec![[false; 4]; runs.len()];
    let ny = map.len() / nx.max(1);
    for (run, (columns, y)) in runs.iter().enumerate() {
        let here = [columns.start == 0, columns.end == nx, y == 0, y + 1 == ny];
        let all = &mut sides[sets.find(run as u32).0 as usize];
        *all = std::array::from_fn(|k| all[k] || here[k]);
    }
    [0, 2].map(|first| sides.iter().any(|touched| touched[first] && touched[first + 1]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observe::drawn;

    #[test]
    fn paths_around_the_cell() {
        for (text, contact) in [
            (".... #### .... ....", [true, false]),
            ("..#. ..#. ..#. ..#.", [false, true]),
            ("..#. ..#. .... ..#.", [false, false]),
            // A closed loop and a contact across the periodic boundary do not percolate.
            ("##.. ##.. .... ....", [false, false]),
            ("#..# .... .... #..#", [false, false]),
            // A staircase percolates in both directions.
            ("##.. .##. ..## #..#", [true, true]),
        ] {
            let (m, nx) = drawn(text);
            assert_eq!(percolates(&m, nx, (1, false), true), contact, "{text}");
        }
        for diagonal in ["#... .#.. ..#. ...#", "...# ..#. .#.. #..."] {
            let (m, nx) = drawn(diagonal);
            assert_eq!(percolates(&m, nx, (1, false), true), [false, false]);
            assert_eq!(percolates(&m, nx, (1, true), true), [true, true]);
        }
        let (m, nx) = drawn("#### .... #### ....");
        assert_eq!(percolates(&m, nx, (0, false), true), [true, false]);
    }

    #[test]
    fn paths_from_side_to_side() {
        for (text, contact) in [
            (".### .... .... ....", [false, false]),
            // Neighbours across a side lead no further.
            (".### #... .... ....", [false, false]),
            ("#### .... .... ....", [true, false]),
            // From side to side, and not around the cell.
            ("##.. .#.. .### ....", [true, false]),
            (".#.. ##.. #... #...", [false, true]),
            ("#..# #..# #..# #..#", [false, true]),
        ] {
            let (m, nx) = drawn(text);
            assert_eq!(percolates(&m, nx, (1, false), false), contact, "{text}");
        }
        let (m, nx) = drawn("#... .#.. ..#. ...#");
        assert_eq!(percolates(&m, nx, (1, false), false), [false, false]);
        assert_eq!(percolates(&m, nx, (1, true), false), [true, true]);
        assert_eq!(percolates(&[], 0, (1, true), false), [false, false]);
    }

    /// Gaps over a factor of two, one of a kind: ⟨(u³ - c)/(u³ + c)⟩ = 0 of the nodes themselves.
    #[test]
    fn classes_of_gaps_have_the_effective_medium_of_the_nodes() {
        /// Second order in the width of a class, 3.3 % of u³.
        const TOLERANCE: f64 = 1e-4;
        let gap: Vec<f64> = (0..1000).map(|i| 1.0 + 1e-3 * f64::from(i)).collect();
        let c = hydraulic_gap(Field::F64(&gap), 0.0).powi(3);
        let balance = gap.iter().map(|u| (u.powi(3) - c) / (u.powi(3) + c)).sum::<f64>() / 1000.0;
        assert!(balance.abs() < TOLERANCE, "{balance}");
    }

    #[test]
    fn leakage_of_parallel_plates_and_of_two_heights_is_exact() {
        /// Error of the class means: zero for one gap, second order in their width of 1 % otherwise.
        const TOLERANCE: f64 = 1e-9;
        for g in [1.0, 1e-6, 3e7] {
            assert!((hydraulic_gap(Field::F64(&[g; 100]), 0.0) / g - 1.0).abs() < TOLERANCE);
        }
        // Two conductivities with equal area: √(c₁c₂) (Keller, Dykhne).
        let halves: Vec<f64> = (0..100).map(|i| if i % 2 == 0 { 1.0 } else { 4.0 }).collect();
        assert!((hydraulic_gap(Field::F64(&halves), 0.0) / 2.0 - 1.0).abs() < TOLERANCE);
        // A fraction x of closed nodes leaves a conductivity of 1 - 2x.
        let closed: Vec<f64> = (0..100).map(|i| if i % 5 == 0 { 0.0 } else { 2.0 }).collect();
        assert!((hydraulic_gap(Field::F64(&closed), 0.0) / (8.0f64 * 0.6).cbrt() - 1.0).abs() < TOLERANCE);
        // The same with gaps at a positive threshold.
        let near: Vec<f64> = closed.iter().map(|g| g.max(0.5)).collect();
        assert!((hydraulic_gap(Field::F64(&near), 0.5) / (8.0f64 * 0.6).cbrt() - 1.0).abs() < TOLERANCE);
        let sealed: Vec<f64> = (0..100).map(|i| if i % 2 == 0 { 0.0 } else { 2.0 }).collect();
        assert_eq!(hydraulic_gap(Field::F64(&sealed), 0.0), 0.0);
    }
}

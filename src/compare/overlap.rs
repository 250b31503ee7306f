use crate::record::results::Overlap;

/// Misaligned maps are displaced by the cell over these numbers, along x and y: no correlation with the other map remains.
pub const MISALIGNMENT: [usize; 2] = [3, 5];

/// Agreement of two boolean maps of equal length; precision and recall are relative to `reference`. A ratio with a zero
/// denominator is 1 (no contact in either map: the maps agree).
pub fn overlap(map: &[bool], reference: &[bool]) -> Overlap {
    assert_eq!(map.len(), reference.len());
    let mut count = [[0.0; 2]; 2];
    for (&m, &r) in map.iter().zip(reference) {
        count[usize::from(m)][usize::from(r)] += 1.0;
    }
    let [[neither, missed], [false_contact, both]] = count;
    let ratio = |part: f64, whole: f64| if whole == 0.0 { 1.0 } else { part / whole };
    let total = map.len() as f64;
    let observed = (both + neither) / total;
    let chance =
        ((both + false_contact) * (both + missed) + (missed + neither) * (false_contact + neither)) / total.powi(2);
    Overlap {
        jaccard: ratio(both, both + missed + false_contact),
        precision: ratio(both, both + false_contact),
        recall: ratio(both, both + missed),
        kappa: ratio(observed - chance, 1.0 - chance),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Textbook 2 × 2 table: 20 yes/yes, 5 yes/no, 10 no/yes, 15 no/no gives κ = 0.4.
    #[test]
    fn cohens_kappa_of_a_known_table() {
        let table = [(true, true, 20), (true, false, 5), (false, true, 10), (false, false, 15)];
        let (a, b): (Vec<bool>, Vec<bool>) = table.iter().flat_map(|&(a, b, n)| vec![(a, b); n]).unzip();
        let o = overlap(&a, &b);
        assert!((o.kappa - 0.4).abs() < 1e-12);
        assert!((o.jaccard - 20.0 / 35.0).abs() < 1e-12);
        assert!((o.precision - 0.8).abs() < 1e-12 && (o.recall - 20.0 / 30.0).abs() < 1e-12);
    }

    #[test]
    fn empty_and_equal_maps_agree() {
        for map in [[false; 4], [true; 4]] {
            let o = overlap(&map, &map);
            assert_eq!((o.jaccard, o.kappa, o.precision, o.recall), (1.0, 1.0, 1.0, 1.0));
        }
    }
}

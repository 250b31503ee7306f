//! Motion of the atoms of a block relative to each other and to the indenter.

/// Largest relative motion in a step, Å. In the first load of 25 nm it is smooth up to 2.4 Å.
pub(super) const LONGEST_STEP: f64 = 4.0;

/// Largest displacement of an atom relative to the mean of its layer, of the means of neighbouring layers relative to each other, and of the
/// indenter, which moves along z, relative to that of the highest layer. A block that moves down together with the indenter, as on a deep base,
/// has none: neither crystal nor contact change.
pub(super) fn relative_motion(displacements: &[[f64; 3]], per_layer: usize, lift: f64) -> f64 {
    let apart = |a: &[f64; 3], b: &[f64; 3]| (0..3).fold(0.0, |m: f64, c| m.max((a[c] - b[c]).abs()));
    let (mut largest, mut below): (f64, Option<[f64; 3]>) = (0.0, None);
    for layer in displacements.chunks(per_layer) {
        let mean = [0, 1, 2].map(|c| layer.iter().map(|d| d[c]).sum::<f64>() / layer.len() as f64);
        largest = layer.iter().fold(largest, |m, d| m.max(apart(d, &mean)));
        largest = below.map_or(largest, |below| largest.max(apart(&mean, &below)));
        below = Some(mean);
    }
    below.map_or(largest, |highest| largest.max(apart(&highest, &[0.0, 0.0, lift])))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_that_sinks_with_the_indenter_has_no_relative_motion() {
        let sinks = vec![[0.0, 0.0, -20.0]; 8];
        assert_eq!(relative_motion(&sinks, 4, -20.0), 0.0);
        assert_eq!(relative_motion(&sinks, 4, -21.0), 1.0);
        let compressed = [vec![[0.0, 0.0, -20.0]; 4], vec![[0.0, 0.0, -22.0]; 4]].concat();
        assert_eq!(relative_motion(&compressed, 4, -22.0), 2.0);
        let aside = vec![[0.5, 0.0, -20.0]; 8];
        assert_eq!(relative_motion(&aside, 4, -20.0), 0.5);
        let mut one = sinks;
        one[0][1] = 4.0;
        assert_eq!(relative_motion(&one, 4, -20.0), 3.0);
    }
}

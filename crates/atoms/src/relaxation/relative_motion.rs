//! Motion of the atoms of a block relative to each other and to the indenter.

/// Largest relative motion in a step, Å. In the first load of 25 nm it is smooth up to 2.4 Å.
pub(super) const LONGEST_STEP: f64 = 4.0;

/// Largest displacement of an atom relative to the mean of its layer, and of the indenter relative to that of the highest layer: a block that
/// moves down as a whole, as on a deep base, changes neither crystal nor contact.
pub(super) fn relative_motion(displacements: &[[f64; 3]], per_layer: usize, lift: f64) -> f64 {
    let mut largest: f64 = 0.0;
    let mut mean = [0.0; 3];
    for layer in displacements.chunks(per_layer) {
        mean = [0, 1, 2].map(|c| layer.iter().map(|d| d[c]).sum::<f64>() / layer.len() as f64);
        largest = layer.iter().fold(largest, |m, d| (0..3).fold(m, |m, c| m.max((d[c] - mean[c]).abs())));
    }
    largest.max((lift - mean[2]).abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The means of layers are not part of a relative motion; the indenter is compared with the highest layer.
    #[test]
    fn a_block_that_moves_as_a_whole_has_no_relative_motion() {
        let mut displacements = vec![[1.0, 0.0, -20.0]; 8];
        displacements[4..].fill([0.0, 0.0, -22.0]);
        assert_eq!(relative_motion(&displacements, 4, -22.0), 0.0);
        assert_eq!(relative_motion(&displacements, 4, -21.0), 1.0);
        displacements[0][1] = 4.0;
        assert_eq!(relative_motion(&displacements, 4, -22.0), 3.0);
    }
}

//! Rigid indenter: atoms on a square grid that follow the height profile, above the block.
//!
//! Lengths are in Å. Point (i, j) is at x = i·s, y = j·s, a node of the height map, so maps of continuum and atoms
//! use the same grid. Low points come into contact first.

use super::block::Block;
use super::potential::CALCIUM;
use super::repulsion::Repulsion;
use asperity_grid::{Error, Result};

/// Maximum spacing of the indenter atoms on calcium: block atoms pass between atoms of a wider spacing. At rms gradient 1 and four times
/// the reference load, 78 of 980 contact atoms had passed a spacing of 5.1 Å, four one of 4.0 Å, none one of 2.54 Å
/// (lattice constant 5.5884 Å).
const MAX_SPACING_ANGSTROM: f64 = 2.6;

/// Minimum number of different registries along an edge. In a grid commensurate with the lattice every point has the
/// same registry, and adhesion then differs by a factor of 17 between atop and hollow sites. With this many
/// registries the average is accurate to 1 %.
pub const MIN_REGISTRIES: usize = 7;

/// Initial clearance between the first contact distance and the indenter, Å: more than the rounding of a data file,
/// less than a load step.
pub const CLEARANCE_ANGSTROM: f64 = 0.05;

/// Maximum spacing of the indenter atoms, Å, on a crystal of lattice constant `a0` whose atoms they repel from the distance
/// `touch_angstrom` on: calcium's in proportion to the smaller of the two lengths.
pub fn max_spacing(a0: f64, touch_angstrom: f64) -> f64 {
    MAX_SPACING_ANGSTROM * (a0 / CALCIUM.a0).min(touch_angstrom / Repulsion::CHALLENGE.minimum_angstrom())
}

/// Points along an edge of the indenter over a block of `cells` cells. If 5 divides `cells` and the spacing is within
/// [`max_spacing`]: 11 per 5 cells (s = 5/11 a0 = 2.5402 Å for a0 = 5.5884 Å). Otherwise: the coarsest grid within it with at least
/// `MIN_REGISTRIES` registries.
pub fn grid_points(cells: usize, a0: f64, touch_angstrom: f64) -> usize {
    let (preferred, max) = (cells / 5 * 11, max_spacing(a0, touch_angstrom));
    if cells.is_multiple_of(5) && 5.0 / 11.0 * a0 <= max {
        return preferred;
    }
    let mut points = (cells as f64 * a0 / max).ceil() as usize;
    while points / gcd(points, cells) < MIN_REGISTRIES {
        points += 1;
    }
    points
}

pub(super) fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// Rigid atoms at z = `start_z` + height.
#[derive(Debug, Clone, PartialEq)]
pub struct Indenter {
    points: usize,
    /// Spacing of the grid, Å.
    spacing: f64,
    /// Row-major `[points, points]`, x fastest, Å.
    heights: Vec<f64>,
    /// Height at which `heights` is zero, at the initial position, Å.
    start_z: f64,
}

impl Indenter {
    /// Places the profile (row-major `[points, points]`, x fastest, Å, low points in contact first) above the block.
    /// The closest pair of an indenter atom and a block atom is `touch_angstrom` + `CLEARANCE_ANGSTROM` apart.
    ///
    /// # Errors
    /// `Input` when the number of heights is not points² or the grid is too coarse; `Height` for a height that is not
    /// finite.
    pub fn above(block: &Block, points: usize, heights: Vec<f64>, touch_angstrom: f64) -> Result<Self> {
        let context = "indenter";
        if points == 0 || heights.len() != points * points {
            return Err(Error::input(context, "heights", heights.len(), format!("{points} x {points} heights")));
        }
        if let Some((k, &value)) = heights.iter().enumerate().find(|(_, h)| !h.is_finite()) {
            return Err(Error::Height { place: context.into(), row: k / points, column: k % points, value });
        }
        let spacing = block.length() / points as f64;
        let max = max_spacing(block.a0, touch_angstrom);
        if spacing > max {
            let accepted = format!("a spacing of at most {max} angstrom, or atoms pass between");
            return Err(Error::input(context, "spacing", spacing, accepted));
        }
        let start_z = first_touch(block, points, &heights, touch_angstrom) + CLEARANCE_ANGSTROM;
        Ok(Indenter { points, spacing, heights, start_z })
    }

    pub fn points(&self) -> usize {
        self.points
    }

    pub fn atoms(&self) -> u64 {
        self.heights.len() as u64
    }

    pub fn spacing(&self) -> f64 {
        self.spacing
    }

    pub fn heights(&self) -> &[f64] {
        &self.heights
    }

    pub fn start_z(&self) -> f64 {
        self.start_z
    }

    /// Height of the lowest atom at the initial position, Å.
    pub fn lowest_z(&self) -> f64 {
        self.start_z + self.heights.iter().copied().fold(f64::INFINITY, f64::min)
    }

    pub fn highest_z(&self) -> f64 {
        self.start_z + self.heights.iter().copied().fold(f64::NEG_INFINITY, f64::max)
    }

    /// Atoms at the initial position, rows of constant y, x fastest.
    pub fn positions(&self) -> impl Iterator<Item = [f64; 3]> + '_ {
        self.heights.iter().enumerate().map(|(k, h)| {
            let (row, column) = (k / self.points, k % self.points);
            [column as f64 * self.spacing, row as f64 * self.spacing, self.start_z + h]
        })
    }
}

/// The `start_z` at which the closest pair of an indenter atom and an atom of the perfect lattice is `touch` apart.
/// Layers deeper than `touch` cannot come into contact first.
fn first_touch(block: &Block, points: usize, heights: &[f64], touch: f64) -> f64 {
    let spacing = block.length() / points as f64;
    let deep = ((2.0 * touch / block.a0).ceil() as usize).min(block.layers());
    let reach = (touch / block.a0).ceil() as i64 + 1;
    let mut start = f64::NEG_INFINITY;
    for (k, h) in heights.iter().enumerate() {
        let (x, y) = ((k % points) as f64 * spacing, (k / points) as f64 * spacing);
        let cell = |c: f64| (c / block.a0).floor() as i64;
        for layer in block.layers() - deep..block.layers() {
            for row in 2 * (cell(y) - reach)..=2 * (cell(y) + reach) + 1 {
                for column in cell(x) - reach..=cell(x) + reach {
                    let [sx, sy] = block.lattice_xy(layer, row, column);
                    let lift2 = touch * touch - (sx - x).powi(2) - (sy - y).powi(2);
                    if lift2 >= 0.0 {
                        start = start.max(block.layer_z(layer) + lift2.sqrt() - h);
                    }
                }
            }
        }
    }
    start
}

#[cfg(test)]
mod tests {
    use super::*;

    const A0: f64 = 5.5884;
    const R_M: f64 = 4.032_671;
    /// Rounding of a distance of 4 Å computed from coordinates of 1000 Å.
    const ROUNDING: f64 = 1e-9;

    #[test]
    fn grids_are_fine_and_incommensurate() {
        assert_eq!(grid_points(175, A0, R_M), 385);
        assert_eq!(grid_points(45, A0, R_M), 99);
        assert_eq!(grid_points(10, A0, R_M), 22);
        for cells in 4..200 {
            let points = grid_points(cells, A0, R_M);
            assert!(cells as f64 * A0 / points as f64 <= MAX_SPACING_ANGSTROM, "{cells}");
            assert!(points / gcd(points, cells) >= MIN_REGISTRIES, "{cells}: {points}");
        }
    }

    /// Smallest distance between the indenter and the periodic block.
    fn closest(block: &Block, indenter: &Indenter) -> f64 {
        let l = block.length();
        let mut best = f64::INFINITY;
        for p in indenter.positions() {
            for site in block.sites() {
                let d: Vec<f64> = (0..3).map(|c| p[c] - site.position[c]).collect();
                let (dx, dy) = (d[0] - (d[0] / l).round() * l, d[1] - (d[1] / l).round() * l);
                best = best.min((dx * dx + dy * dy + d[2] * d[2]).sqrt());
            }
        }
        best
    }

    #[test]
    fn the_first_contact_distance_is_exact() {
        for (cells, seed) in [(4usize, 1u64), (5, 2), (6, 3)] {
            let block = Block::new(cells, 2, A0, 7.015853).expect("valid");
            let points = grid_points(cells, A0, R_M);
            // Steep and irregular heights: a multiplicative sequence over 6 Å.
            let heights: Vec<f64> =
                (1..=points * points).map(|k| ((k as u64 * 7919 * seed) % 1009) as f64 / 168.0).collect();
            let indenter = Indenter::above(&block, points, heights.clone(), R_M).expect("valid");
            assert!(closest(&block, &indenter) > R_M);
            let touching = Indenter { start_z: indenter.start_z - CLEARANCE_ANGSTROM, ..indenter };
            assert!((closest(&block, &touching) - R_M).abs() < ROUNDING, "{}", closest(&block, &touching));
        }
    }

    #[test]
    fn low_points_are_nearest_to_the_block() {
        let block = Block::new(5, 2, A0, 7.0).expect("valid");
        let mut heights = vec![3.0; 121];
        heights[12] = 0.0;
        let indenter = Indenter::above(&block, 11, heights, R_M).expect("valid");
        let lowest = indenter.positions().min_by(|a, b| a[2].total_cmp(&b[2])).expect("atoms");
        assert!((lowest[0] - A0 * 5.0 / 11.0).abs() < 1e-12 && (lowest[1] - lowest[0]).abs() < 1e-12);
        assert_eq!(indenter.lowest_z(), lowest[2]);
    }

    #[test]
    fn bad_profiles_are_refused() {
        let block = Block::new(5, 2, A0, 7.0).expect("valid");
        assert!(Indenter::above(&block, 11, vec![0.0; 120], R_M).is_err());
        assert!(Indenter::above(&block, 10, vec![0.0; 100], R_M).is_err());
        let mut heights = vec![0.0; 121];
        heights[13] = f64::NAN;
        let error = Indenter::above(&block, 11, heights, R_M).expect_err("NaN");
        assert!(error.to_string().contains("row 2, column 3"), "{error}");
    }
}

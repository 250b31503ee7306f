//! Neighbours of points in a periodic plane.

use asperity_grid::CellList;

/// Limit of the cells along an axis, so that points that nearly coincide do not need more memory than they are worth.
const MOST_CELLS: f64 = 4096.0;

/// Points of a periodic rectangle in cells about one spacing wide.
pub struct PlanarCells {
    /// Edges of the rectangle.
    lengths: [f64; 2],
    counts: [usize; 2],
    /// In the rectangle.
    points: Vec<[f64; 2]>,
    cells: CellList,
}

/// A point, or its image, in the rectangle.
fn wrapped([x, y]: [f64; 2], lengths: [f64; 2]) -> [f64; 2] {
    [x.rem_euclid(lengths[0]), y.rem_euclid(lengths[1])]
}

impl PlanarCells {
    /// Points may lie outside the rectangle from 0 to `lengths`.
    pub fn new(points: &[[f64; 2]], lengths: [f64; 2], spacing: f64) -> Self {
        let counts = lengths.map(|length| (length / spacing).floor().clamp(1.0, MOST_CELLS) as usize);
        let points: Vec<[f64; 2]> = points.iter().map(|p| wrapped(*p, lengths)).collect();
        let along = |c: f64, a: usize| ((c / lengths[a] * counts[a] as f64) as usize).min(counts[a] - 1);
        let cells =
            CellList::new([counts[0], counts[1], 1], points.iter().map(|[x, y]| [along(*x, 0), along(*y, 1), 0]));
        PlanarCells { lengths, counts, points, cells }
    }

    /// Indices and relative positions of all points and their images within `reach` of `site`.
    pub fn within(&self, site: [f64; 2], reach: f64) -> Vec<(usize, [f64; 2])> {
        let [x, y] = wrapped(site, self.lengths);
        let range = |c: f64, a: usize| {
            let width = self.lengths[a] / self.counts[a] as f64;
            ((c - reach) / width).floor() as i64..=((c + reach) / width).floor() as i64
        };
        let images = |index: i64, a: usize| index.div_euclid(self.counts[a] as i64) as f64 * self.lengths[a];
        let mut neighbours = Vec::new();
        for row in range(y, 1) {
            for column in range(x, 0) {
                let shift = [images(column, 0), images(row, 1)];
                for k in self.cells.points([column, row], 0) {
                    let [px, py] = self.points[k];
                    let d = [px + shift[0] - x, py + shift[1] - y];
                    if d[0].hypot(d[1]) <= reach {
                        neighbours.push((k, d));
                    }
                }
            }
        }
        neighbours
    }

    /// Index of the point nearest to `site`.
    ///
    /// # Panics
    /// Without any point.
    pub fn nearest(&self, site: [f64; 2]) -> usize {
        assert!(!self.points.is_empty(), "a nearest point of none");
        let mut reach = (self.lengths[0] * self.lengths[1] / self.points.len() as f64).sqrt();
        loop {
            let square = |d: [f64; 2]| d[0] * d[0] + d[1] * d[1];
            let found = self.within(site, reach);
            if let Some(best) = found.iter().min_by(|a, b| square(a.1).total_cmp(&square(b.1))) {
                return best.0;
            }
            reach *= 2.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_point_is_that_of_all_images() {
        let lengths = [7.0, 4.0];
        let points: Vec<[f64; 2]> =
            (0..23).map(|k| [f64::from(k * 37 % 71) / 5.0 - 3.0, f64::from(k * 17 % 41) / 8.0]).collect();
        let cells = PlanarCells::new(&points, lengths, 1.1);
        for k in 0..200 {
            let site = [f64::from(k * 53 % 97) / 9.0 - 2.0, f64::from(k * 29 % 83) / 9.0 - 3.0];
            let distance = |p: &[f64; 2]| {
                let d = [p[0] - site[0], p[1] - site[1]];
                let d = [d[0] - (d[0] / 7.0).round() * 7.0, d[1] - (d[1] / 4.0).round() * 4.0];
                d[0].hypot(d[1])
            };
            let best = points.iter().map(distance).fold(f64::INFINITY, f64::min);
            assert!(distance(&points[cells.nearest(site)]) <= best + 1e-12);
        }
    }
}

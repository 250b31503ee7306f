//! Cell lists for neighbour searches.

/// Indices of points by the cells of a box that contain them.
pub struct CellList {
    /// Cells along x, y and z.
    counts: [usize; 3],
    /// Start of each cell in `order`, and the end of the last.
    starts: Vec<usize>,
    order: Vec<u32>,
}

impl CellList {
    /// `cells`: the cell of each point, x first.
    pub fn new(counts: [usize; 3], cells: impl Iterator<Item = [usize; 3]> + Clone) -> Self {
        let mut starts = vec![0; counts.iter().product::<usize>() + 1];
        let place = |[i, j, k]: [usize; 3]| (k * counts[1] + j) * counts[0] + i;
        cells.clone().for_each(|cell| starts[place(cell) + 1] += 1);
        (1..starts.len()).for_each(|c| starts[c] += starts[c - 1]);
        let (mut next, mut order) = (starts.clone(), vec![0; starts[starts.len() - 1]]);
        for (point, cell) in cells.enumerate() {
            let slot = &mut next[place(cell)];
            order[*slot] = point as u32;
            *slot += 1;
        }
        CellList { counts, starts, order }
    }

    /// The points of a cell, ascending. Along x and y the box is periodic.
    pub fn points(&self, [i, j]: [i64; 2], k: usize) -> impl Iterator<Item = usize> + '_ {
        let [nx, ny, _] = self.counts;
        let [i, j] = [i.rem_euclid(nx as i64), j.rem_euclid(ny as i64)].map(|c| c as usize);
        let cell = (k * ny + j) * nx + i;
        self.order[self.starts[cell]..self.starts[cell + 1]].iter().map(|&point| point as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_have_their_points_in_ascending_order() {
        let cells = [[2, 0, 1], [0, 1, 0], [2, 0, 1], [1, 1, 1]];
        let list = CellList::new([3, 2, 2], cells.into_iter());
        let points_in = |ij, k| list.points(ij, k).collect::<Vec<_>>();
        assert_eq!((points_in([2, 0], 1), points_in([-1, 2], 1)), (vec![0, 2], vec![0, 2]));
        assert_eq!((points_in([3, -1], 0), points_in([1, 3], 1), points_in([0, 0], 0)), (vec![1], vec![3], vec![]));
    }
}

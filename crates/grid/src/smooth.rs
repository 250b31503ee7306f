use super::Grid;

/// Truncation of a Gaussian in units of its width, at 1.5e-8 of its maximum.
const REACH: f64 = 6.0;

/// Distributes values at points of the plane over the periodic grid by a Gaussian of standard deviation `width`: a
/// density per area. The weights of a point add up to one along each axis, so the sum over nodes times the area of a
/// node is the sum of the values for any width.
pub fn spread(grid: Grid, points: impl Iterator<Item = ([f64; 2], f64)>, width: f64) -> Vec<f64> {
    let mut field = vec![0.0; grid.points()];
    let node_area = grid.dx() * grid.dy();
    for ([x, y], value) in points {
        let along_x = weights(x / grid.dx(), width / grid.dx(), grid.nx);
        for (j, wy) in weights(y / grid.dy(), width / grid.dy(), grid.ny) {
            let row = &mut field[j * grid.nx..(j + 1) * grid.nx];
            for &(i, wx) in &along_x {
                row[i] += value * wy * wx / node_area;
            }
        }
    }
    field
}

/// A field of the periodic grid, smoothed by the Gaussian of [`spread`].
pub fn smoothed(grid: Grid, field: &[f64], width: f64) -> Vec<f64> {
    // The weights are the same for all nodes.
    let along_x = weights(0.0, width / grid.dx(), grid.nx);
    let along_y = weights(0.0, width / grid.dy(), grid.ny);
    let mut rows = vec![0.0; field.len()];
    for (from, to) in field.chunks(grid.nx).zip(rows.chunks_mut(grid.nx)) {
        for (i, value) in to.iter_mut().enumerate() {
            *value = along_x.iter().map(|(k, w)| w * from[(i + k) % grid.nx]).sum();
        }
    }
    let mut smoothed_along_both = vec![0.0; field.len()];
    for (j, to) in smoothed_along_both.chunks_mut(grid.nx).enumerate() {
        for (k, w) in &along_y {
            let from = (j + k) % grid.ny * grid.nx;
            to.iter_mut().zip(&rows[from..from + grid.nx]).for_each(|(t, r)| *t += w * r);
        }
    }
    smoothed_along_both
}

/// Node and weight of a Gaussian around `centre`, both in node spacings, on a periodic line of `n` nodes. The weights
/// add up to one.
fn weights(centre: f64, width: f64, n: usize) -> Vec<(usize, f64)> {
    let (low, high) = ((centre - REACH * width).ceil() as i64, (centre + REACH * width).floor() as i64);
    let mut list: Vec<(usize, f64)> = (low..=high)
        .map(|k| {
            let d = (k as f64 - centre) / width;
            (k.rem_euclid(n as i64) as usize, (-0.5 * d * d).exp())
        })
        .collect();
    let sum: f64 = list.iter().map(|l| l.1).sum();
    // A Gaussian that is too narrow for the grid is replaced by the nearest node.
    if sum.is_nan() || sum <= 0.0 {
        return vec![((centre.round() as i64).rem_euclid(n as i64) as usize, 1.0)];
    }
    list.iter_mut().for_each(|l| l.1 /= sum);
    list
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding of sums of some thousand terms.
    const ROUNDING: f64 = 1e-12;

    #[test]
    fn smoothing_keeps_the_sum_and_has_the_given_width() {
        let grid = Grid { nx: 60, ny: 48, lx: 1.0, ly: 0.8 };
        let points = [([0.31, 0.77], 2.5), ([-0.01, 0.4], -1.0), ([0.999, 0.01], 0.25)];
        for width in [0.0, 1e-4, 0.01, 0.05, 0.3] {
            let field = spread(grid, points.iter().copied(), width);
            let sum = field.iter().sum::<f64>() * grid.dx() * grid.dy();
            assert!((sum - 1.75).abs() < ROUNDING, "{width}: {sum}");
        }
        let field = spread(grid, [([0.5, 0.4], 1.0)].into_iter(), 0.05);
        let second: f64 =
            (0..grid.points()).map(|k| ((k % 60) as f64 / 60.0 - 0.5).powi(2) * field[k] * grid.dx() * grid.dy()).sum();
        // The truncation at six widths changes the second moment by 7e-8; sampling with three nodes per width does
        // not change it.
        assert!((second.sqrt() / 0.05 - 1.0).abs() < 1e-6, "{second}");
    }

    #[test]
    fn smoothing_a_field_is_spreading_its_nodes() {
        let grid = Grid { nx: 30, ny: 20, lx: 1.0, ly: 0.7 };
        let field: Vec<f64> = (0..600).map(|k| f64::from((k * 37) % 101)).collect();
        let smooth = smoothed(grid, &field, 0.06);
        let node_area = grid.dx() * grid.dy();
        let points =
            (0..600).map(|k| ([(k % 30) as f64 * grid.dx(), (k / 30) as f64 * grid.dy()], field[k] * node_area));
        for (a, b) in smooth.iter().zip(spread(grid, points, 0.06)) {
            assert!((a - b).abs() < 1e-9, "{a} {b}");
        }
        let mean = |f: &[f64]| f.iter().sum::<f64>() / f.len() as f64;
        assert!((mean(&smooth) - mean(&field)).abs() < ROUNDING * mean(&field));
        assert!(smooth.iter().fold(0.0, |a: f64, v| a.max(*v)) < 90.0);
    }
}

use asperity_grid::Grid;
use rayon::prelude::*;

/// Dilation of a periodic surface by a ball of `radius` (ISO 16610-41 for profiles and disks), heights `[ny, nx]`
/// with the low points protruding: for each node the highest position of the top of a ball that is centred below the
/// node and touches the surface from below. A flat is unchanged, a slope s becomes lower by r (√(1 + s²) − 1), a tip
/// of radius R becomes one of R + r, and valleys narrower than the ball are bridged.
///
/// Only contacts at nodes are considered. Where the ball touches between nodes, the result is too high by up to
/// dx² (1 + s²)^(3/2)/4r, on average by a third of that.
pub fn dilate_by_ball(grid: Grid, heights: &[f64], radius: f64) -> Vec<f64> {
    let reach = |step: f64| (radius / step).floor() as i64;
    let mut cap = Vec::new();
    for j in -reach(grid.dy())..=reach(grid.dy()) {
        for i in -reach(grid.dx())..=reach(grid.dx()) {
            let height_squared = radius * radius - (i as f64 * grid.dx()).powi(2) - (j as f64 * grid.dy()).powi(2);
            if height_squared >= 0.0 {
                cap.push((i, j, radius - height_squared.sqrt()));
            }
        }
    }
    let (nx, ny) = (grid.nx as i64, grid.ny as i64);
    let mut dilated = vec![0.0; grid.points()];
    dilated.par_chunks_mut(grid.nx).enumerate().for_each(|(row, line)| {
        for (column, value) in line.iter_mut().enumerate() {
            let height_of_ball = |&(i, j, below): &(i64, i64, f64)| {
                let (x, y) = ((column as i64 + i).rem_euclid(nx), (row as i64 + j).rem_euclid(ny));
                heights[(y * nx + x) as usize] + below
            };
            *value = cap.iter().map(height_of_ball).fold(f64::INFINITY, f64::min);
        }
    });
    dilated
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    const GRID: Grid = Grid { nx: 240, ny: 200, lx: 24.0, ly: 20.0 };
    const RADIUS: f64 = 1.5;

    /// Discretisation error on slopes up to 0.65 with a curvature of a quarter of 1/RADIUS.
    fn discretisation_error() -> f64 {
        2.0 * GRID.dx().powi(2) / (4.0 * RADIUS)
    }

    fn on(height: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        (0..GRID.points()).map(|k| height((k % 240) as f64 * GRID.dx(), (k / 240) as f64 * GRID.dy())).collect()
    }

    #[test]
    fn a_flat_is_unchanged_and_the_radius_of_a_tip_grows_by_that_of_the_ball() {
        assert!(dilate_by_ball(GRID, &vec![0.7; GRID.points()], RADIUS).iter().all(|h| *h == 0.7));
        // A tip of radius 4 whose surroundings are too high for the ball to touch.
        let ball = |r: f64, x: f64, y: f64| r - (r * r - (x - 12.0).powi(2) - (y - 10.0).powi(2)).max(0.0).sqrt();
        let actual = dilate_by_ball(GRID, &on(|x, y| ball(4.0, x, y)), RADIUS);
        let grown = on(|x, y| ball(4.0 + RADIUS, x, y));
        for (k, (actual, grown)) in actual.iter().zip(grown).enumerate() {
            let (x, y) = ((k % 240) as f64 * 0.1 - 12.0, (k / 240) as f64 * 0.1 - 10.0);
            if x.hypot(y) < 3.0 {
                assert!((0.0..discretisation_error()).contains(&(actual - grown + 1e-12)), "{x} {y}: {actual} {grown}");
            }
        }
    }

    /// At the steepest point of a wave, where its curvature vanishes, and at its lowest point, across the periodic
    /// boundary.
    #[test]
    fn a_slope_is_lowered_by_its_secant_and_low_points_are_unchanged() {
        let (k, amplitude) = (TAU / 24.0, 2.0);
        let heights = on(|x, _| -amplitude * (k * x).cos());
        let actual = dilate_by_ball(GRID, &heights, RADIUS);
        let slope: f64 = k * amplitude;
        let lower = RADIUS * ((1.0 + slope * slope).sqrt() - 1.0);
        let steep = 60 + 240 * 17;
        // Third derivatives bend the slope under the ball.
        assert!(
            (heights[steep] - actual[steep] - lower).abs() < 0.03 * lower + discretisation_error(),
            "{} {lower}",
            heights[steep] - actual[steep]
        );
        assert_eq!(actual[0], heights[0]);
        assert!(actual.iter().zip(&heights).all(|(f, h)| f <= h));
    }
}

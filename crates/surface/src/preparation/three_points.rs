//! The plane through three points of a map.

use super::digits::{digits, exact, in_unit};
use super::trend::Trend;
use asperity_grid::{Error, Grid, Result};

/// Radius of the neighbourhood whose mean is taken, in points: 21 points, so that noise and single asperities count little.
const RADIUS: f64 = 2.5;

/// Distance of a point from the line through the others, over their distance, below which they are on one line: an error of a height would be
/// that of the tilt a hundredfold.
const ON_ONE_LINE: f64 = 0.01;

/// Centre and mean height of the measured points about a place, and their number.
struct Place {
    x: f64,
    y: f64,
    height: f64,
    count: usize,
}

fn place(grid: Grid, heights: &[f64], [x, y]: [f64; 2]) -> Option<Place> {
    let nearest = |v: f64, step: f64, n: usize| ((v / step).round() as usize).min(n - 1);
    let (i, j) = (nearest(x, grid.dx(), grid.nx), nearest(y, grid.dy(), grid.ny));
    let reach = RADIUS as usize;
    let mut sum = [0.0; 3];
    let mut count = 0;
    for row in j.saturating_sub(reach)..=(j + reach).min(grid.ny - 1) {
        for column in i.saturating_sub(reach)..=(i + reach).min(grid.nx - 1) {
            let h = heights[row * grid.nx + column];
            if !h.is_nan() && (row.abs_diff(j) as f64).hypot(column.abs_diff(i) as f64) <= RADIUS {
                let of_point = [column as f64 * grid.dx(), row as f64 * grid.dy(), h];
                sum.iter_mut().zip(of_point).for_each(|(s, v)| *s += v);
                count += 1;
            }
        }
    }
    let [x, y, height] = sum.map(|s| s / count as f64);
    (count > 0).then_some(Place { x, y, height, count })
}

/// With six digits: the unit of the map may be another than that of the places.
fn pair(place: [f64; 2]) -> String {
    place.map(|v| format!("{v:.5e}").parse::<f64>().map_or(String::new(), exact)).join(",")
}

/// From the first point to the others.
fn sides([[ax, ay], b, c]: [[f64; 2]; 3]) -> [[f64; 2]; 2] {
    [b, c].map(|[x, y]| [x - ax, y - ay])
}

fn are_on_one_line(points: [[f64; 2]; 3]) -> bool {
    let [[ux, uy], [vx, vy]] = sides(points);
    let longest = [[ux, uy], [vx, vy], [vx - ux, vy - uy]].iter().map(|[x, y]| x * x + y * y).fold(0.0, f64::max);
    (ux * vy - uy * vx).abs() <= ON_ONE_LINE * longest
}

/// The plane through the means of the measured points about three places, in lengths along x and y from the first point of the map, and what
/// was averaged.
///
/// # Errors
/// Places outside of the map, where nothing was measured, or on one line.
pub(super) fn plane((grid, unit): (Grid, &str), heights: &[f64], points: [[f64; 2]; 3]) -> Result<(Trend, String)> {
    let refused = |found: String, accepted: String| Err(Error::input("preparation", "--detrend", found, accepted));
    let words = |[x, y]: [f64; 2]| format!("three-points, {}", in_unit(pair([x, y]), unit));
    let mut found = Vec::new();
    for [x, y] in points {
        if !((0.0..=grid.lx).contains(&x) && (0.0..=grid.ly).contains(&y)) {
            let [lx, ly] = [grid.lx, grid.ly].map(|length| in_unit(digits(length), unit));
            let accepted = format!("points of the map: 0 to {lx} along x, 0 to {ly} along y");
            return refused(words([x, y]), accepted);
        }
        match place(grid, heights, [x, y]) {
            Some(place) => found.push(place),
            None => return refused(words([x, y]), "a point near which heights were measured".into()),
        }
    }
    let [a, b, c] = &found[..] else { unreachable!("three points") };
    // Places next to an edge or a hole have other centres than what was given.
    let centres = [a, b, c].map(|p| [p.x, p.y]);
    if are_on_one_line(points) || are_on_one_line(centres) {
        return refused("three-points on one line".into(), "three points that are the corners of a triangle".into());
    }
    let [[ux, uy], [vx, vy]] = sides(centres);
    let area = ux * vy - uy * vx;
    let (du, dv) = (b.height - a.height, c.height - a.height);
    let slopes = [(du * vy - dv * uy) / area, (dv * ux - du * vx) / area];
    let counts = found.iter().map(|p| p.count.to_string()).collect::<Vec<_>>().join(", ");
    let places = in_unit(points.map(pair).join("; "), unit);
    Ok((
        Trend::plane_through(slopes, [a.x, a.y], a.height, grid),
        format!("through {places}, means of {counts} points"),
    ))
}

#[cfg(test)]
mod tests {
    use super::super::detrend::{Detrend, subtract_form};
    use super::*;

    const GRID: Grid = Grid { nx: 40, ny: 30, lx: 4.0, ly: 6.0 };

    /// A step on a tilted ground, at whose foot the points are: levelled to rounding, next to an edge and a hole, too.
    #[test]
    fn the_ground_of_a_step_is_level() {
        let height = |i: usize| {
            let (x, y) = ((i % 40) as f64 * GRID.dx(), (i / 40) as f64 * GRID.dy());
            5.0 + 0.3 * x - 0.2 * y + if x > 2.0 { 1.0 } else { 0.0 }
        };
        let mut heights: Vec<f64> = (0..GRID.points()).map(height).collect();
        heights[41] = f64::NAN;
        let kind = Detrend::ThreePoints([[0.0, 0.0], [1.5, 0.4], [0.7, 6.0]]);
        let line = subtract_form(kind, GRID, &mut heights, "um").expect("a plane");
        let off = |i: usize| (heights[i] - if i % 40 > 20 { 1.0 } else { 0.0 }).abs();
        assert!((0..GRID.points()).filter(|i| *i != 41).all(|i| off(i) < 1e-12));
        assert!(line.starts_with("detrend three-points: slopes 0.3 in x, -0.2 in y, through 0,0; 1.5,0.4; 0.7,6 um, means of 7, 21, 13 points"), "{line}");
    }

    #[test]
    fn points_that_give_no_plane_are_refused() {
        let mut heights = vec![0.0; GRID.points()];
        heights[..400].fill(f64::NAN);
        for (points, words) in [
            ([[0.0, 3.0], [5.0, 3.0], [1.0, 5.0]], "three-points, 5,3 um; accepted: points of the map: 0 to 4 um"),
            ([[0.0, 3.0], [1.0, -0.1], [1.0, 5.0]], "1,-0.1"),
            ([[0.0, 0.1], [1.0, 3.0], [1.0, 5.0]], "near which heights were measured"),
            ([[0.0, 3.0], [1.0, 4.0], [2.0, 5.0]], "on one line"),
            ([[1.0, 4.0], [1.0, 4.0], [2.0, 5.0]], "on one line"),
        ] {
            let said =
                subtract_form(Detrend::ThreePoints(points), GRID, &mut heights, "um").expect_err("refused").to_string();
            assert!(said.contains(words), "{said}");
        }
    }
}

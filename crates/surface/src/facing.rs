//! Two rough surfaces that face each other. Only the sum of their heights matters to the contact of elastic half-spaces with small
//! slopes (Johnson, Contact Mechanics, 1985, sec. 4.1): it is the surface of one of them on a flat other.

use crate::lower_to_zero;
use crate::preparation::{digits, exact, in_unit, regrid, sampled, shifted};
use crate::scale_dependent::difference_gradient;
use asperity_grid::{Error, Grid, Result, rms};

/// How the other of two rough bodies lies on the first. Its map, seen from outside as it was measured, is turned over, then turned, then
/// shifted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Whether the map is turned over about its y axis, as one that is laid face down: x is mirrored.
    pub turned_over: bool,
    /// Quarter turns from x towards y, 0 to 3.
    pub quarter_turns: u8,
    /// Shift along x and y, in the unit of the heights.
    pub shift: [f64; 2],
}

impl Default for Placement {
    /// Face down, the corners with the smallest coordinates above each other.
    fn default() -> Self {
        Placement { turned_over: true, quarter_turns: 0, shift: [0.0, 0.0] }
    }
}

/// Heights `[ny, nx]` of a body, of which low points touch first, with the extents of its map in the same unit.
#[derive(Debug, Clone, PartialEq)]
pub struct RoughBody {
    pub grid: Grid,
    pub heights: Vec<f64>,
}

/// The sum of the heights of two bodies.
#[derive(Debug, Clone, PartialEq)]
pub struct Facing {
    /// Over the common grid; the lowest height is 0.
    pub sum: RoughBody,
    /// What was done, and statistics of both parts, in a line for people.
    pub line: String,
}

/// Words of the line of [`Facing`].
pub(crate) const LINE: &str = "sum with the other body";
pub(crate) const SHARE: &str = " of the first map";

/// Largest relative difference of the extents of two cells that are taken as one: that of extents which are written with five digits.
const SAME_EXTENT: f64 = 1e-4;

/// Offsets of two grids, in pixels, below which their nodes coincide.
const SAME_NODE: f64 = 1e-6;

/// Fewest nodes of the common part along an axis.
const FEWEST: usize = 2;

/// Names of the arguments, for messages.
const PLACE: &str = "the other body";

impl RoughBody {
    /// Sum of the heights of two bodies. The finer of their grids is used along each axis.
    ///
    /// `periodic`: both repeat, in one cell; the other is shifted by its Fourier coefficients. Otherwise the sum is over the part where one map lies on
    /// the other, at the nodes of the first; the other is interpolated by cubic convolution. `unit`: of the lengths, for people; it may be empty.
    ///
    /// # Errors
    /// `Input`: periodic cells of different extents, maps that do not overlap, a placement that is not finite, no memory.
    pub fn facing(self, other: RoughBody, placement: &Placement, periodic: bool, unit: &str) -> Result<Facing> {
        let Placement { turned_over, quarter_turns, shift } = *placement;
        if let Some(value) = shift.iter().find(|s| !s.is_finite()) {
            return Err(Error::input(PLACE, "shift", value, "two finite lengths"));
        }
        if quarter_turns > 3 {
            return Err(Error::input(PLACE, "quarter_turns", quarter_turns, "0, 1, 2 or 3"));
        }
        let (parts, area) = ([&self, &other].map(|body| body.statistics(unit)), self.grid.lx * self.grid.ly);
        let other = other.placed(turned_over, quarter_turns, periodic);
        let mut sum = if periodic { self.cell(other, shift)? } else { self.overlap(other, shift, unit)? };
        lower_to_zero(&mut sum.heights);
        let Grid { nx, ny, .. } = sum.grid;
        let how = [
            turned_over.then(|| "turned over".to_string()),
            (quarter_turns > 0).then(|| format!("turned by {}°", 90 * u32::from(quarter_turns))),
            (shift != [0.0, 0.0])
                .then(|| format!("shifted by {}", in_unit(format!("{} x {}", exact(shift[0]), exact(shift[1])), unit))),
        ];
        let how: String = how.into_iter().flatten().map(|text| text + ", ").collect();
        let [first, other] = parts;
        let share = (1e6 * sum.grid.lx * sum.grid.ly / area).round() / 1e6;
        let line = format!("{LINE}: {how}{nx} x {ny} points on {share}{SHARE}; first: {first}; other: {other}");
        Ok(Facing { sum, line })
    }

    fn statistics(&self, unit: &str) -> String {
        let gradient = difference_gradient(self.grid, &self.heights, false);
        format!("rms height {}, rms gradient {}", in_unit(digits(rms(&self.heights)), unit), digits(gradient))
    }

    /// Turned over and turned. Nodes of a map that repeats are mirrored about the first, pixels of another about its middle.
    fn placed(self, turned_over: bool, quarter_turns: u8, periodic: bool) -> RoughBody {
        let mirrored = |i: usize, n: usize| if periodic { (n - i) % n } else { n - 1 - i };
        let map = |grid: Grid, from: &dyn Fn(usize, usize) -> f64| RoughBody {
            grid,
            heights: (0..grid.points()).map(|i| from(i % grid.nx, i / grid.nx)).collect(),
        };
        let mut body = self;
        if turned_over {
            let Grid { nx, .. } = body.grid;
            body = map(body.grid, &|x, y| body.heights[y * nx + mirrored(x, nx)]);
        }
        for _ in 0..quarter_turns {
            let Grid { nx, ny, lx, ly } = body.grid;
            // A point (x, y) goes to (-y, x).
            let turned = Grid { nx: ny, ny: nx, lx: ly, ly: lx };
            body = map(turned, &|x, y| body.heights[mirrored(x, ny) * nx + y]);
        }
        body
    }

    /// On `points` nodes of the same extents.
    fn on(self, points: [usize; 2], periodic: bool) -> Result<RoughBody> {
        if points == [self.grid.nx, self.grid.ny] {
            return Ok(self);
        }
        let (grid, heights) = regrid(self.grid, self.heights, points, periodic)?;
        Ok(RoughBody { grid, heights })
    }

    /// Two bodies in one periodic cell.
    fn cell(self, other: RoughBody, shift: [f64; 2]) -> Result<RoughBody> {
        let (a, b) = (self.grid, other.grid);
        let differ = |a: f64, b: f64| (a / b - 1.0).abs() > SAME_EXTENT;
        // Of two profiles the extent along y is any.
        let lines = a.ny == 1 && b.ny == 1;
        if differ(a.lx, b.lx) || differ(a.ly, b.ly) && !lines {
            let found = format!("a cell of {} x {}", digits(b.lx), digits(b.ly));
            let accepted = format!(
                "that of the first body, {} x {}, as both repeat; continuum.periodic = false or surface.edges take the part where one \
                 map lies on the other",
                digits(a.lx),
                digits(a.ly)
            );
            return Err(Error::input(PLACE, "length", found, accepted));
        }
        let points = [a.nx.max(b.nx), a.ny.max(b.ny)];
        let (mut sum, other) = (self.on(points, true)?, other.on(points, true)?);
        let Grid { nx, ny, .. } = sum.grid;
        let nodes = [shift[0] / sum.grid.dx(), shift[1] / sum.grid.dy()];
        let whole = nodes.map(f64::round);
        let heights = match [0, 1].iter().all(|k| (nodes[*k] - whole[*k]).abs() < SAME_NODE) {
            true => {
                let [sx, sy] = [(whole[0], nx), (whole[1], ny)].map(|(s, n)| s.rem_euclid(n as f64) as usize);
                let from = |i: usize| (i / nx + ny - sy) % ny * nx + (i % nx + nx - sx) % nx;
                (0..nx * ny).map(|i| other.heights[from(i)]).collect()
            }
            false => shifted(shift, sum.grid, &other.heights),
        };
        sum.heights.iter_mut().zip(&heights).for_each(|(h, other)| *h += other);
        Ok(sum)
    }

    /// The part where one map lies on the other, at nodes of the first.
    fn overlap(self, other: RoughBody, shift: [f64; 2], unit: &str) -> Result<RoughBody> {
        let (a, b) = (self.grid, other.grid);
        let lines = a.ny == 1 && b.ny == 1;
        // Pixels that differ by rounding are equal.
        let finest = |n: usize, length: f64, pixel: f64| n.max((length / pixel * (1.0 - SAME_EXTENT)).ceil() as usize);
        let rows = if lines { 1 } else { finest(a.ny, a.ly, b.dy()) };
        let first = self.on([finest(a.nx, a.lx, b.dx()), rows], false)?;
        let grid = first.grid;
        // Centres of the first's pixels, in pixels of the other from its first centre.
        let places = |n: usize, pixel: f64, of_other: f64, shift: f64, n_other: usize| {
            let place = |i: usize| ((i as f64 + 0.5) * pixel - shift) / of_other - 0.5;
            let exact = |u: f64| if (u - u.round()).abs() < SAME_NODE { u.round() } else { u };
            let last = n_other as f64 - 1.0;
            let inside = |u: f64| u >= -SAME_EXTENT * last && u <= last * (1.0 + SAME_EXTENT);
            let list = (0..n).map(|i| (i, exact(place(i)))).filter(|(_, u)| inside(*u));
            list.unzip::<usize, f64, Vec<_>, Vec<_>>()
        };
        let (columns, ux) = places(grid.nx, grid.dx(), b.dx(), shift[0], b.nx);
        let (rows, uy) = if lines { (vec![0], vec![0.0]) } else { places(grid.ny, grid.dy(), b.dy(), shift[1], b.ny) };
        let (nx, ny) = (columns.len(), rows.len());
        if nx < FEWEST || ny < FEWEST && !lines {
            let found = format!(
                "{} x {}: the maps have {nx} x {ny} points in common",
                digits(shift[0]),
                in_unit(digits(shift[1]), unit)
            );
            return Err(Error::input(PLACE, "shift", found, "a shift after which the maps lie on each other"));
        }
        let (x0, y0) = (columns[0], rows[0]);
        let mut heights = sampled(b, &other.heights, [&ux, &uy]);
        for (k, row) in heights.chunks_mut(nx).enumerate() {
            let own = &first.heights[(y0 + k) * grid.nx + x0..][..nx];
            row.iter_mut().zip(own).for_each(|(h, own)| *h += own);
        }
        let common = Grid { nx, ny, lx: nx as f64 * grid.dx(), ly: ny as f64 * grid.dy() };
        Ok(RoughBody { grid: common, heights })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// Rounding of heights up to 10.
    const ROUNDING: f64 = 1e-13;

    fn body(grid: Grid, value: impl Fn(f64, f64) -> f64) -> RoughBody {
        let centre = |i: usize, d: f64| (i as f64 + 0.5) * d;
        let heights = (0..grid.points()).map(|i| value(centre(i % grid.nx, grid.dx()), centre(i / grid.nx, grid.dy())));
        RoughBody { grid, heights: heights.collect() }
    }

    fn equal(sum: &RoughBody, mut exact: Vec<f64>) {
        lower_to_zero(&mut exact);
        let largest = sum.heights.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(sum.heights.len() == exact.len() && largest < ROUNDING, "{largest}");
    }

    /// A surface is the sum of two of half its heights, however the second is turned before.
    #[test]
    fn two_halves_of_a_surface_give_the_surface() {
        let grid = Grid { nx: 7, ny: 5, lx: 1.4, ly: 1.0 };
        let whole: Vec<f64> = (0..35).map(|i: u32| f64::from(i * i % 17)).collect();
        let half = RoughBody { grid, heights: whole.iter().map(|h| h / 2.0).collect() };
        for periodic in [true, false] {
            for (turned_over, quarter_turns) in [(true, 0), (false, 0), (true, 1), (true, 2), (false, 3)] {
                // The turns that undo it: a map that was turned over turns the other way.
                let back = if turned_over { quarter_turns } else { (4 - quarter_turns) % 4 };
                let other = half.clone().placed(turned_over, back, periodic);
                let placement = Placement { turned_over, quarter_turns, shift: [0.0, 0.0] };
                let facing = half.clone().facing(other, &placement, periodic, "").unwrap();
                assert_eq!(facing.sum.grid, grid);
                equal(&facing.sum, whole.clone());
            }
        }
    }

    /// Waves of a cell on other nodes, turned over and shifted, by closed form.
    #[test]
    fn waves_of_one_cell_add_up() {
        let on = |nx: usize, ny: usize, value: &dyn Fn(f64, f64) -> f64| RoughBody {
            grid: Grid { nx, ny, lx: 2.0, ly: 1.0 },
            heights: (0..nx * ny)
                .map(|i| value(2.0 * (i % nx) as f64 / nx as f64, (i / nx) as f64 / ny as f64))
                .collect(),
        };
        let first = |x: f64, y: f64| (TAU * x / 2.0).cos() + 0.5 * (TAU * y).sin();
        let other = |x: f64, y: f64| (TAU * (x + y) + 0.3).cos();
        for shift in [[0.51, -0.27], [0.5, -0.25]] {
            let placement = Placement { shift, ..Placement::default() };
            let facing = on(8, 16, &first).facing(on(16, 8, &other), &placement, true, "").unwrap();
            let line =
                format!("turned over, shifted by {} x {}, 16 x 16 points on 1 of the first map", shift[0], shift[1]);
            assert!(facing.line.contains(&line), "{}", facing.line);
            let exact = on(16, 16, &|x, y| first(x, y) + other(-(x - shift[0]), y - shift[1]));
            equal(&facing.sum, exact.heights);
        }
    }

    /// Quadratic heights of maps with other extents, pixels and a shift are exact where both maps are.
    #[test]
    fn patches_add_up_where_they_lie_on_each_other() {
        let first = body(Grid { nx: 12, ny: 8, lx: 2.4, ly: 1.6 }, |x, y| 1.0 + x - x * x + 0.3 * x * y);
        let other = body(Grid { nx: 30, ny: 8, lx: 1.5, ly: 2.0 }, |x, y| y * y - 0.5 * x * y + 0.2 * x);
        let placement = Placement { turned_over: true, quarter_turns: 1, shift: [0.13, 0.21] };
        let Facing { sum, .. } = first.facing(other, &placement, false, "").unwrap();
        // Turned over (x to 1.5 - x), then turned: (x, y) to (2 - y, x), on pixels of 0.25 x 0.05.
        let exact = |x: f64, y: f64| {
            let (u, v) = (x - 0.13, y - 0.21);
            let (x2, y2) = (1.5 - v, 2.0 - u);
            1.0 + x - x * x + 0.3 * x * y + y2 * y2 - 0.5 * x2 * y2 + 0.2 * x2
        };
        let Grid { nx, ny, .. } = sum.grid;
        assert_eq!([sum.grid.dx(), sum.grid.dy()].map(|d| (d * 1e9).round()), [2e8, 5e7]);
        // First centres of the first body that are within the centres of the other.
        let (x0, y0) = (0.3, 0.275);
        let heights = (0..nx * ny).map(|i| exact(x0 + 0.2 * (i % nx) as f64, y0 + 0.05 * (i / nx) as f64));
        equal(&sum, heights.collect());
        assert_eq!((nx, ny), (9, 27));
    }

    /// Extents that differ by rounding neither smooth nor crop a map; profiles have any extent along y.
    #[test]
    fn extents_that_differ_by_rounding_are_equal() {
        let rough = |n: usize, ny: usize, length: f64, ly: f64| RoughBody {
            grid: Grid { nx: n, ny, lx: length, ly },
            heights: (0..n * ny).map(|i| f64::from((i * i % 17) as u32)).collect(),
        };
        let flat = |n: usize, ny: usize, length: f64, ly: f64| RoughBody {
            heights: vec![0.0; n * ny],
            ..rough(n, ny, length, ly)
        };
        for (first, other) in [
            (rough(20, 20, 1.0, 1.0), flat(20, 20, 0.99999, 0.99999)),
            (rough(20, 20, 1.0, 1.0), flat(20, 20, 1.00001, 1.00001)),
            (rough(40, 1, 1.0, 0.025), flat(20, 1, 1.0, 0.05)),
        ] {
            for periodic in [false, true] {
                let facing = first.clone().facing(other.clone(), &Placement::default(), periodic, "").unwrap();
                if periodic || first.grid.ny > 1 {
                    assert_eq!((facing.sum.grid, &facing.sum.heights), (first.grid, &first.heights));
                } else {
                    // Without the half pixel of the other at each end.
                    assert_eq!((facing.sum.grid.nx, facing.sum.grid.ny), (38, 1));
                }
            }
        }
    }

    #[test]
    fn bodies_that_do_not_fit_are_refused() {
        let flat = |n: usize, length: f64| RoughBody {
            grid: Grid { nx: n, ny: n, lx: length, ly: length },
            heights: vec![0.0; n * n],
        };
        let message = |other: RoughBody, placement: Placement, periodic: bool| {
            flat(8, 1.0).facing(other, &placement, periodic, "").unwrap_err().to_string()
        };
        let usual = Placement::default();
        assert!(message(flat(8, 1.01), usual, true).contains("that of the first body, 1 x 1"));
        let far = Placement { shift: [0.95, 0.0], ..usual };
        assert!(message(flat(8, 1.0), far, false).contains("have 0 x 8 points in common"));
        assert!(message(flat(8, 1.0), Placement { quarter_turns: 4, ..usual }, true).contains("0, 1, 2 or 3"));
        assert!(message(flat(8, 1.0), Placement { shift: [f64::NAN, 0.0], ..usual }, true).contains("finite"));
    }
}

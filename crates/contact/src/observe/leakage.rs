//! Pressure-driven flow through the gap: Reynolds' equation ∇·(u³∇p) = 0, solved on the nodes.

use super::hydraulic_gap::{hydraulic_gap, percolates};
use asperity_grid::{Field, Grid};
use serde::{Deserialize, Serialize};

/// Effective conductivity of the gap along x and y, units of the gap cubed: that of a uniform gap u is u³. A volume
/// flow per width is this conductivity times the pressure gradient over 12 times the viscosity.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Leakage {
    /// Exactly zero where no open path leads along the direction.
    pub conductivity: [f64; 2],
    /// The same in Bruggeman's effective medium, the cube of [`hydraulic_gap`].
    pub effective_medium: f64,
    /// Effective medium over the mean of both directions; absent without flow.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ratio: Option<f64>,
    /// Conjugate-gradient iterations of both directions.
    pub iterations: [usize; 2],
    /// Errors of the hydraulic gaps along x and y, units of the gap; absent where they are not known, as of a gap without flow.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gap_errors: Option<[f64; 2]>,
}

impl Leakage {
    /// Uniform gaps with the solved conductivity along x and y.
    pub fn hydraulic_gaps(&self) -> [f64; 2] {
        self.conductivity.map(f64::cbrt)
    }

    /// With the errors that follow from the hydraulic gaps on the grid with half the points along each side, and from the relative
    /// change of the mean gap: twice the change, and the share of the mean gap. Where a direction is sealed on one of the grids, none.
    pub fn with_errors_from(self, coarser: Option<([f64; 2], f64)>) -> Self {
        let gaps = self.hydraulic_gaps();
        let errors = |(coarse, fraction): ([f64; 2], f64)| {
            let flows = gaps.iter().chain(&coarse).all(|gap| *gap > 0.0);
            flows.then(|| std::array::from_fn(|i| CHANGES * (gaps[i] - coarse[i]).abs() + fraction * gaps[i]))
        };
        Leakage { gap_errors: coarser.and_then(errors), ..self }
    }
}

/// Changes of a hydraulic gap from the coarser grid that are its error: with the share of the mean gap they cover 96 % of 343 cases.
const CHANGES: f64 = 2.0;

/// Largest remaining energy error over the energy, as the preconditioner measures it. The conductivity is the energy
/// under a unit pressure difference, and its relative error is of this size.
const TOLERANCE: f64 = 1e-9;

const MOST_ITERATIONS: usize = 2_000;

/// Nodes below which a grid is not coarsened, and sweeps that solve it.
const COARSEST: usize = 16;
const COARSEST_SWEEPS: usize = 20;

/// Factor on the conductances of a coarser grid. Corrections that are constant on 2 × 2 nodes count the energy of a
/// linear pressure twice (Braess, Computing 55 (1995) 379).
const COARSE: f64 = 0.5;

/// Leakage of a gap field `[ny, nx]`. A node whose gap is at most `threshold` is closed. Finite volumes with the harmonic
/// mean of u³ between neighbours: exact for stripes, second order in the spacing for smooth gaps. Conjugate gradients,
/// preconditioned by multigrid with aggregates of 2 × 2 nodes (Notay, Electron. Trans. Numer. Anal. 37 (2010) 123).
/// `None` if an iteration does not converge. `periodic`: under a mean pressure gradient; otherwise between constant pressures on two
/// opposite sides half a node outside the map, without flow through the other two.
pub fn leakage(grid: Grid, gap: Field, threshold: f64, periodic: bool) -> Option<Leakage> {
    let closed: Vec<u8> = (0..gap.len()).map(|i| u8::from(gap.at(i) <= threshold)).collect();
    let flow_along = |axis: usize| {
        if !percolates(&closed, grid.nx, (0, false), periodic)[axis] {
            return Some((0.0, 0));
        }
        let flow = Flow::new(grid, gap, threshold, periodic, axis);
        flow.conductance().map(|(conductance, iterations)| {
            let shape = if axis == 0 { grid.lx / grid.ly } else { grid.ly / grid.lx };
            (conductance * shape, iterations)
        })
    };
    let (x, y) = rayon::join(|| flow_along(0), || flow_along(1));
    let ((kx, x), (ky, y)) = (x?, y?);
    let (effective_medium, mean) = (hydraulic_gap(gap, threshold).powi(3), 0.5 * (kx + ky));
    let ratio = (mean > 0.0).then(|| effective_medium / mean);
    Some(Leakage { conductivity: [kx, ky], effective_medium, ratio, iterations: [x, y], gap_errors: None })
}

/// Bytes of [`leakage`] on a grid: both directions, each with conductances and diagonal, right-hand side and four vectors
/// of the iteration, and three vectors of a cycle, on all grids (4/3 of the finest).
pub fn leakage_bytes(grid: Grid) -> u64 {
    const VECTORS: usize = 2 * 11 * size_of::<f64>();
    (VECTORS * grid.points() * 4 / 3) as u64
}

/// Conductances of a grid: from each node to the next along x and along y (periodic), and the sum at each node.
struct Network {
    nx: usize,
    ny: usize,
    along_x: Vec<f64>,
    along_y: Vec<f64>,
    diagonal: Vec<f64>,
}

impl Network {
    /// `outside`: conductance of each node to a fixed pressure.
    fn new(nx: usize, along_x: Vec<f64>, along_y: Vec<f64>, outside: &[f64]) -> Self {
        let mut network = Network { nx, ny: along_x.len() / nx, along_x, along_y, diagonal: Vec::new() };
        // A node is no neighbour of itself across the periodic boundary.
        let (no_x, no_y) = (network.nx == 1, network.ny == 1);
        let sum = |i: usize| {
            let [left, _, below, _] = network.neighbours(i);
            let x = if no_x { 0.0 } else { network.along_x[i] + network.along_x[left] };
            let y = if no_y { 0.0 } else { network.along_y[i] + network.along_y[below] };
            outside[i] + x + y
        };
        network.diagonal = (0..network.along_x.len()).map(sum).collect();
        network
    }

    /// Previous and next node along x, previous and next along y.
    fn neighbours(&self, i: usize) -> [usize; 4] {
        let (x, y) = (i % self.nx, i / self.nx);
        let left = if x == 0 { i + self.nx - 1 } else { i - 1 };
        let right = if x + 1 == self.nx { i + 1 - self.nx } else { i + 1 };
        let rows = self.nx * (self.ny - 1);
        let below = if y == 0 { i + rows } else { i - self.nx };
        let above = if y + 1 == self.ny { i - rows } else { i + self.nx };
        [left, right, below, above]
    }

    /// Flow into node `i` from its neighbours, if its own pressure is zero.
    fn inflow(&self, i: usize, p: &[f64]) -> f64 {
        let [left, right, below, above] = self.neighbours(i);
        let x = if self.nx == 1 { 0.0 } else { self.along_x[i] * p[right] + self.along_x[left] * p[left] };
        let y = if self.ny == 1 { 0.0 } else { self.along_y[i] * p[above] + self.along_y[below] * p[below] };
        x + y
    }

    fn apply(&self, i: usize, p: &[f64]) -> f64 {
        self.diagonal[i] * p[i] - self.inflow(i, p)
    }

    /// A sweep of Gauss and Seidel over the nodes in the given order.
    fn sweep(&self, order: impl Iterator<Item = usize>, p: &mut [f64], b: &[f64]) {
        for i in order.filter(|&i| self.diagonal[i] > 0.0) {
            p[i] = (b[i] + self.inflow(i, p)) / self.diagonal[i];
        }
    }

    /// The aggregate of a node among 2 × 2 nodes.
    fn aggregate(&self, i: usize) -> usize {
        (i / self.nx / 2) * self.nx.div_ceil(2) + i % self.nx / 2
    }

    /// The network of aggregates.
    fn coarser(&self) -> Network {
        let (nx, ny) = (self.nx.div_ceil(2), self.ny.div_ceil(2));
        let [mut along_x, mut along_y, mut outside] = [0; 3].map(|_| vec![0.0; nx * ny]);
        for i in 0..self.diagonal.len() {
            let (to, [left, right, below, above]) = (self.aggregate(i), self.neighbours(i));
            let (x, y) = (i % self.nx, i / self.nx);
            let own = self.diagonal[i]
                - if self.nx == 1 { 0.0 } else { self.along_x[i] + self.along_x[left] }
                - if self.ny == 1 { 0.0 } else { self.along_y[i] + self.along_y[below] };
            // Rounding of the difference is no conductance to a fixed pressure.
            if own > f64::EPSILON * 8.0 * self.diagonal[i] {
                outside[to] += COARSE * own;
            }
            if self.aggregate(right) != to && (x % 2 == 1 || x + 1 == self.nx) {
                along_x[to] += COARSE * self.along_x[i];
            }
            if self.aggregate(above) != to && (y % 2 == 1 || y + 1 == self.ny) {
                along_y[to] += COARSE * self.along_y[i];
            }
        }
        Network::new(nx, along_x, along_y, &outside)
    }
}

/// Flow under a unit pressure difference along one axis.
struct Flow {
    /// From fine to coarse.
    levels: Vec<Network>,
    /// Right-hand side, and the conductance at a uniform gradient.
    b: Vec<f64>,
    base: f64,
}

impl Flow {
    fn new(grid: Grid, gap: Field, threshold: f64, periodic: bool, axis: usize) -> Self {
        let Grid { nx, ny, .. } = grid;
        let (aspect, n) = (grid.dy() / grid.dx(), grid.points());
        let conductivity = |i: usize| if gap.at(i) <= threshold { 0.0 } else { gap.at(i).powi(3) };
        let between = |i: usize, j: usize| {
            let (a, b) = (conductivity(i), conductivity(j));
            if a == 0.0 || b == 0.0 { 0.0 } else { 2.0 / (1.0 / a + 1.0 / b) }
        };
        let face_x = |i: usize| match i % nx + 1 == nx {
            true if periodic => aspect * between(i, i + 1 - nx),
            true => 0.0,
            false => aspect * between(i, i + 1),
        };
        let face_y = |i: usize| match i / nx + 1 == ny {
            true if periodic => between(i, i % nx) / aspect,
            true => 0.0,
            false => between(i, i + nx) / aspect,
        };
        let (along_x, along_y): (Vec<f64>, Vec<f64>) = ((0..n).map(face_x).collect(), (0..n).map(face_y).collect());
        let (mut outside, mut b, mut base) = (vec![0.0; n], vec![0.0; n], 0.0);
        if periodic {
            let (faces, e) = if axis == 0 { (&along_x, 1.0 / nx as f64) } else { (&along_y, 1.0 / ny as f64) };
            for i in 0..n {
                let (x, y) = (i % nx, i / nx);
                let next = if axis == 0 { y * nx + (x + 1) % nx } else { (y + 1) % ny * nx + x };
                b[i] -= faces[i] * e;
                b[next] += faces[i] * e;
                base += faces[i] * e * e;
            }
        } else {
            let shape = if axis == 0 { aspect } else { 1.0 / aspect };
            for i in 0..n {
                let (position, count) = if axis == 0 { (i % nx, nx) } else { (i / nx, ny) };
                let side = 2.0 * shape * conductivity(i);
                if position == 0 {
                    (b[i], base) = (side, base + side);
                }
                outside[i] +=
                    f64::from(u8::from(position == 0)) * side + f64::from(u8::from(position + 1 == count)) * side;
            }
        }
        let mut levels = vec![Network::new(nx, along_x, along_y, &outside)];
        while levels[levels.len() - 1].diagonal.len() > COARSEST {
            levels.push(levels[levels.len() - 1].coarser());
        }
        Flow { levels, b, base }
    }

    /// Conductance and number of iterations; `None` without convergence.
    fn conductance(&self) -> Option<(f64, usize)> {
        let network = &self.levels[0];
        let n = self.b.len();
        let (mut p, mut r, mut z, mut d, mut ad) =
            (vec![0.0; n], self.b.clone(), vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        let (mut conductance, mut rz) = (self.base, 0.0);
        for iteration in 0..MOST_ITERATIONS {
            let old = rz;
            z.fill(0.0);
            self.cycle(0, &mut z, &r);
            rz = dot(&r, &z);
            // A uniform gap has no residual; the energy decreases by rz at least.
            if rz <= TOLERANCE * conductance {
                return Some((conductance, iteration));
            }
            let beta = if iteration == 0 { 0.0 } else { rz / old };
            d.iter_mut().zip(&z).for_each(|(d, z)| *d = z + beta * *d);
            (0..n).for_each(|i| ad[i] = network.apply(i, &d));
            let alpha = rz / dot(&d, &ad);
            if !alpha.is_finite() {
                return None;
            }
            for i in 0..n {
                p[i] += alpha * d[i];
                r[i] -= alpha * ad[i];
            }
            // base - 2 b·p + p·Ap, with Ap = b - r.
            conductance = self.base - dot(&self.b, &p) - dot(&r, &p);
        }
        None
    }

    /// Solves level `k` approximately by a W-cycle, from zero; symmetric.
    fn cycle(&self, k: usize, p: &mut [f64], b: &[f64]) {
        let (network, n) = (&self.levels[k], b.len());
        let Some(coarse) = self.levels.get(k + 1) else {
            for _ in 0..COARSEST_SWEEPS {
                network.sweep(0..n, p, b);
                network.sweep((0..n).rev(), p, b);
            }
            return;
        };
        network.sweep(0..n, p, b);
        let rounds = if k == 0 { 1 } else { 2 };
        for round in 1..=rounds {
            let (mut residual, mut correction) = (vec![0.0; coarse.diagonal.len()], vec![0.0; coarse.diagonal.len()]);
            (0..n).for_each(|i| residual[network.aggregate(i)] += b[i] - network.apply(i, p));
            self.cycle(k + 1, &mut correction, &residual);
            let open = |i: &usize| network.diagonal[*i] > 0.0;
            (0..n).filter(open).for_each(|i| p[i] += correction[network.aggregate(i)]);
            network.sweep((0..n).rev(), p, b);
            if round < rounds {
                network.sweep(0..n, p, b);
            }
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative error of conductivities: [`TOLERANCE`] and its amplification by the preconditioner.
    const SOLVED: f64 = 1e-6;

    fn conductivity(grid: Grid, gap: &[f64], periodic: bool) -> [f64; 2] {
        let actual = leakage(grid, Field::F64(gap), 0.0, periodic).expect("converges");
        assert!(actual.iterations.iter().all(|n| *n < 100), "{actual:?}");
        actual.conductivity
    }

    fn assert_near(actual: f64, expected: f64, tolerance: f64) {
        assert!((actual / expected - 1.0).abs() < tolerance, "{actual} {expected}");
    }

    /// Flow along stripes has the arithmetic, across them the harmonic mean of u³; any shape of cell and pixels.
    #[test]
    fn stripes_in_both_directions() {
        for grid in [Grid { nx: 24, ny: 10, lx: 1.0, ly: 0.7 }, Grid { nx: 33, ny: 1, lx: 2.0, ly: 0.1 }] {
            let value_of = |x: usize| if x.is_multiple_of(3) { 0.3 } else { 1.0 + 0.1 * x as f64 };
            let cubes: Vec<f64> = (0..grid.nx).map(|x| value_of(x).powi(3)).collect();
            let n = grid.nx as f64;
            let (along, across) = (cubes.iter().sum::<f64>() / n, n / cubes.iter().map(|c| 1.0 / c).sum::<f64>());
            let gap: Vec<f64> = (0..grid.points()).map(|i| value_of(i % grid.nx)).collect();
            for periodic in [true, false] {
                let actual = conductivity(grid, &gap, periodic);
                assert_near(actual[0], across, SOLVED);
                assert_near(actual[1], along, SOLVED);
            }
        }
        // A closed stripe stops the flow across it alone.
        let grid = Grid::unit(16, 16);
        let gap: Vec<f64> = (0..256).map(|i| if i % 16 == 5 { 0.0 } else { 2.0 }).collect();
        for periodic in [true, false] {
            let actual = conductivity(grid, &gap, periodic);
            assert_eq!(actual[0], 0.0);
            assert_near(actual[1], 8.0 * 15.0 / 16.0, SOLVED);
        }
        assert_eq!(conductivity(grid, &[0.0; 256], true), [0.0; 2]);
    }

    /// Stripes of gaps 1 and 4 in equal parts: the effective medium has √(1·64), the flow 2/(1 + 1/64) across and (1 + 64)/2
    /// along them.
    #[test]
    fn the_effective_medium_is_compared_with_the_mean_of_both_directions() {
        let gap: Vec<f64> = (0..64).map(|i| if i % 2 == 0 { 1.0 } else { 4.0 }).collect();
        let actual = leakage(Grid::unit(8, 8), Field::F64(&gap), 0.0, true).expect("converges");
        assert_near(actual.effective_medium, 8.0, SOLVED);
        let (across, along): (f64, f64) = (2.0 / (1.0 + 1.0 / 64.0), 32.5);
        assert_near(actual.ratio.expect("a flow"), 8.0 / (0.5 * (across + along)), SOLVED);
        assert_near(actual.hydraulic_gaps()[1], along.cbrt(), SOLVED);
    }

    /// A checkerboard has the geometric mean (Dykhne, Sov. Phys. JETP 32 (1970) 63). The flow is singular at the corners
    /// of the squares, so that the order of convergence is below two.
    #[test]
    fn a_checkerboard_has_the_geometric_mean() {
        let errors = [8, 16, 32, 64].map(|per_square| {
            let n = 2 * per_square;
            let gap: Vec<f64> = (0..n * n)
                .map(|i| if (i % n / per_square + i / n / per_square) % 2 == 0 { 1.0 } else { 2.0 })
                .collect();
            let [x, y] = conductivity(Grid::unit(n, n), &gap, true);
            assert_near(x, y, SOLVED);
            (x / 8f64.sqrt() - 1.0).abs()
        });
        assert!(errors.windows(2).all(|e| e[1] < 0.6 * e[0]) && errors[3] < 0.02, "{errors:?}");
    }

    /// Second order for a smooth gap; the conductivity at 128² extrapolates those of 32² and 64².
    #[test]
    fn second_order_in_the_spacing() {
        let conductivity_on = |n: usize| {
            let wave = |i: usize| (std::f64::consts::TAU * (i as f64 + 0.5) / n as f64).sin();
            let gap: Vec<f64> = (0..n * n).map(|i| 1.0 + 0.4 * wave(i % n) * wave(i / n) + 0.3 * wave(i / n)).collect();
            conductivity(Grid::unit(n, n), &gap, true)
        };
        let [a, b, c] = [32, 64, 128].map(conductivity_on);
        for axis in 0..2 {
            let ratio = (a[axis] - b[axis]) / (b[axis] - c[axis]);
            assert!((ratio - 4.0).abs() < 0.2, "{ratio}");
        }
    }

    /// The only open path runs in all four directions; without one of its nodes nothing flows. It is a row of 15 nodes, and ends on
    /// other rows at the two sides, so that it does not lead around a periodic cell.
    #[test]
    fn paths_between_two_sides_may_wind() {
        let (map, nx) = crate::observe::drawn("##..... ##.#### ##...## ####.## .....##");
        let gap: Vec<f64> = map.iter().map(|closed| 1.0 - f64::from(*closed)).collect();
        let grid = Grid { nx: 7, ny: 5, lx: 7.0, ly: 5.0 };
        assert_eq!(conductivity(grid, &gap, true)[0], 0.0);
        let [along, across] = conductivity(grid, &gap, false);
        assert_near(along, 7.0 / 5.0 / 15.0, SOLVED);
        assert!(across > 0.0);
        let transposed: Vec<u8> = (0..map.len()).map(|i| map[i % 5 * nx + i / 5]).collect();
        let mirrored: Vec<u8> = map.iter().rev().copied().collect();
        for (map, nx, axis) in [(map, nx, 0), (mirrored, nx, 0), (transposed, 5, 1)] {
            assert!(percolates(&map, nx, (0, false), false)[axis]);
            for i in (0..map.len()).filter(|i| map[*i] == 0) {
                let mut blocked = map.clone();
                blocked[i] = 1;
                assert!(!percolates(&blocked, nx, (0, false), false)[axis], "{i}");
            }
        }
    }

    /// Of both directions, eleven vectors on each grid.
    #[test]
    fn planned_memory_counts_all_grids() {
        let grid = Grid::unit(64, 64);
        let flow = Flow::new(grid, Field::F64(&[1.0; 64 * 64]), 0.0, true, 0);
        let nodes: usize = flow.levels.iter().map(|level| level.diagonal.len()).sum();
        let ratio = leakage_bytes(grid) as f64 / (2 * 11 * 8 * nodes) as f64;
        assert!((1.0..1.01).contains(&ratio), "{ratio}");
    }

    /// An irregular gap with closed nodes and gaps over four decades, against a direct solution of the pressures.
    #[test]
    fn equal_to_a_direct_solution() {
        let (nx, ny) = (13, 11);
        let grid = Grid { nx, ny, lx: 1.3, ly: 2.2 };
        let gap: Vec<f64> = (0..nx * ny)
            .map(|i| match (i * 7919 + 13 * i * i) % 101 {
                k if k < 22 => 0.0,
                k => 10f64.powf(-4.0 * k as f64 / 101.0),
            })
            .collect();
        let actual = conductivity(grid, &gap, false);
        let ratio = grid.dy() / grid.dx();
        let k = |i: usize| gap[i].powi(3);
        let mean = |i: usize, j: usize| if k(i) * k(j) == 0.0 { 0.0 } else { 2.0 * k(i) * k(j) / (k(i) + k(j)) };
        let n = nx * ny;
        let mut matrix = vec![vec![0.0; n + 1]; n];
        for i in 0..n {
            let (x, y) = (i % nx, i / nx);
            let mut join = |j: usize, g: f64| {
                matrix[i][i] += g;
                matrix[j][j] += g;
                matrix[i][j] -= g;
                matrix[j][i] -= g;
            };
            if x + 1 < nx {
                join(i + 1, ratio * mean(i, i + 1));
            }
            if y + 1 < ny {
                join(i + nx, mean(i, i + nx) / ratio);
            }
            // Nodes without flow have any pressure.
            matrix[i][i] += 1e-18;
            if x == 0 {
                matrix[i][i] += 2.0 * ratio * k(i);
                matrix[i][n] = 2.0 * ratio * k(i);
            }
            if x + 1 == nx {
                matrix[i][i] += 2.0 * ratio * k(i);
            }
        }
        for c in 0..n {
            let pivot = matrix[c].clone();
            for (_, row) in matrix.iter_mut().enumerate().filter(|(r, _)| *r != c) {
                let factor = row[c] / pivot[c];
                row.iter_mut().zip(&pivot).for_each(|(a, b)| *a -= factor * b);
            }
        }
        let flow: f64 =
            (0..ny).map(|y| 2.0 * ratio * k(y * nx) * (1.0 - matrix[y * nx][n] / matrix[y * nx][y * nx])).sum();
        assert!(actual[0] > 0.0);
        assert_near(actual[0], flow * grid.lx / grid.ly, 1e-5);
    }
}

//! Displacement of the periodic half-space by many loads at many positions, in a time proportional to their number:
//! particle mesh Ewald summation of 1/r with near pairs one by one and the smooth part on a mesh with splines
//! (Essmann et al., J. Chem. Phys. 103 (1995) 8577).
//!
//! The displacement by a load F on a Hertzian spot of radius a is F·(2/q)·f(qa) in Fourier space, f = 1 - (qa)²/10 +
//! O((qa)⁴). The mesh carries its part with the factor erfc(q/2α), smooth on the scale 1/α; the rest decays as
//! erfc(αr). E* = 1; the mean displacement is zero.

use asperity_grid::{CellList, Grid, HalfSpectrum, Transform, next_fast_len};
use std::f64::consts::PI;

/// Average number of neighbours within the cutoff; between 8 and 40 both parts take about the same time.
const NEIGHBOURS: f64 = 16.0;
/// α times the cutoff, beyond which 3e-6 of a load is neglected.
const CUT: f64 = 3.3;
/// Mesh spacing times α; the error of splines of order 8 is then below that of the cutoff (test
/// `displacements_do_not_depend_on_the_cutoff`).
const SPACING: f64 = 0.35;
const ORDER: usize = 8;
/// Largest cutoff over the shorter side; below one half each load counts once.
const WIDEST: f64 = 0.45;

/// Spline weights of a position on the mesh, from node `first` on along each axis.
pub(super) struct Weights {
    first: [usize; 2],
    along: [[f64; ORDER]; 2],
}

/// Mesh for the smooth part of the displacement.
pub(super) struct EwaldMesh {
    grid: Grid,
    /// Cutoff: distance beyond which loads act through the mesh only.
    pub reach: f64,
    alpha: f64,
    transform: Transform<f64>,
    spectrum: HalfSpectrum<f64>,
    second: HalfSpectrum<f64>,
    field: Vec<f64>,
    /// Half spectrum of the displacement by a unit load, divided by that of the splines.
    response: Vec<f64>,
    /// Transform pairs times points since they were last taken.
    transformed: f64,
}

impl EwaldMesh {
    /// A mesh for about `spots` loads in a cell.
    pub(super) fn new(cell: Grid, spots: usize) -> Self {
        let Grid { lx, ly, .. } = cell;
        Self::with_reach(cell, (NEIGHBOURS * lx * ly / (PI * spots.max(1) as f64)).sqrt().min(WIDEST * lx.min(ly)))
    }

    pub(super) fn with_reach(cell: Grid, reach: f64) -> Self {
        let Grid { lx, ly, .. } = cell;
        let alpha = CUT / reach;
        // At least the support of a spline.
        let nodes = |l: f64| next_fast_len(((l * alpha / SPACING).ceil() as usize).max(ORDER));
        let grid = Grid { nx: nodes(lx), ny: nodes(ly), lx, ly };
        let transform = Transform::new(grid);
        let sinc = |m: f64, n: usize| {
            let x = PI * m / n as f64;
            if x == 0.0 { 1.0 } else { (x.sin() / x).powi(ORDER as i32) }
        };
        let pitch = grid.pitch();
        let response = (0..grid.ny * pitch).map(|k| {
            let (qx, qy) = (grid.qx(k % pitch), grid.qy(k / pitch));
            let q = qx.hypot(qy);
            if q == 0.0 {
                return 0.0;
            }
            let splines = sinc(qx * lx / (2.0 * PI), grid.nx) * sinc(qy * ly / (2.0 * PI), grid.ny);
            2.0 * libm::erfc(0.5 * q / alpha) / (q * lx * ly * splines * splines)
        });
        EwaldMesh {
            reach,
            alpha,
            response: response.collect(),
            spectrum: transform.spectrum(),
            second: transform.spectrum(),
            field: vec![0.0; grid.points()],
            transformed: 0.0,
            transform,
            grid,
        }
    }

    pub(super) fn weights(&self, (x, y): (f64, f64)) -> Weights {
        let weights_along = |x: f64, dx: f64, n: usize| {
            let u = x / dx;
            let base = u.floor();
            // Centre the spline on the position.
            let first = base as i64 - (ORDER as i64 / 2 - 1);
            (first.rem_euclid(n as i64) as usize, spline(u - base))
        };
        let (i, wx) = weights_along(x, self.grid.dx(), self.grid.nx);
        let (j, wy) = weights_along(y, self.grid.dy(), self.grid.ny);
        Weights { first: [i, j], along: [wx, wy] }
    }

    /// Sets the field to the smooth displacement by loads F, with their second moments F·a²/10 if given.
    pub(super) fn load(&mut self, weights: &[Weights], loads: &[f64], second: Option<&[f64]>) {
        self.spread(weights, loads);
        self.transform.forward(&self.field, &mut self.spectrum);
        if let Some(second) = second {
            self.spread(weights, second);
            self.transform.forward(&self.field, &mut self.second);
            let pitch = self.grid.pitch();
            for (k, (one, two)) in self.spectrum.iter_mut().zip(&*self.second).enumerate() {
                let (qx, qy) = (self.grid.qx(k % pitch), self.grid.qy(k / pitch));
                *one -= two * (qx * qx + qy * qy);
            }
        }
        self.spectrum.iter_mut().zip(&self.response).for_each(|(s, r)| *s *= r);
        self.transform.inverse(&mut self.spectrum, &mut self.field);
        let pairs = if second.is_some() { 1.5 } else { 1.0 };
        self.transformed += pairs * self.grid.points() as f64;
    }

    /// Transform pairs times points since the last call.
    pub(super) fn take_transformed(&mut self) -> f64 {
        std::mem::take(&mut self.transformed)
    }

    fn spread(&mut self, weights: &[Weights], loads: &[f64]) {
        let Grid { nx, ny, .. } = self.grid;
        self.field.fill(0.0);
        for (w, load) in weights.iter().zip(loads).filter(|(_, load)| **load != 0.0) {
            for (j, wy) in w.along[1].iter().enumerate() {
                let row = &mut self.field[(w.first[1] + j) % ny * nx..][..nx];
                let mut i = w.first[0];
                for wx in &w.along[0] {
                    row[i] += load * wy * wx;
                    i = if i + 1 == nx { 0 } else { i + 1 };
                }
            }
        }
    }

    /// Interpolated field at a position.
    pub(super) fn read(&self, w: &Weights) -> f64 {
        let Grid { nx, ny, .. } = self.grid;
        let mut sum = 0.0;
        for (j, wy) in w.along[1].iter().enumerate() {
            let row = &self.field[(w.first[1] + j) % ny * nx..][..nx];
            let (mut i, mut line) = (w.first[0], 0.0);
            for wx in &w.along[0] {
                line += wx * row[i];
                i = if i + 1 == nx { 0 } else { i + 1 };
            }
            sum += wy * line;
        }
        sum
    }

    /// Contribution of the mesh to the displacement by a unit load on a spot of radius `a` at the distance `r`.
    pub(super) fn smooth(&self, r: f64, a: f64) -> f64 {
        let alpha = self.alpha;
        let gauss = 2.0 * alpha / PI.sqrt() * (-(alpha * r).powi(2)).exp();
        // erf(αr)/r and its Laplacian in the plane, as a series near the centre, where the closed form cancels.
        let (value, laplacian) = if alpha * r < 1e-3 {
            (gauss * (1.0 + 2.0 / 3.0 * (alpha * r).powi(2)), -4.0 / 3.0 * gauss * alpha * alpha)
        } else {
            let value = libm::erf(alpha * r) / r;
            (value, (value - gauss) / (r * r) - 2.0 * alpha * alpha * gauss)
        };
        (value + 0.1 * a * a * laplacian) / PI
    }

    /// Constant per unit load that makes the mean displacement zero.
    pub(super) fn level(&self) -> f64 {
        -2.0 / (PI.sqrt() * self.alpha * self.grid.lx * self.grid.ly)
    }
}

/// Cardinal B-spline of order [`ORDER`] on the nodes at the fraction `f` of a spacing behind the central one (de
/// Boor's recursion).
fn spline(f: f64) -> [f64; ORDER] {
    let mut w = [0.0; ORDER];
    w[0] = 1.0;
    for order in 2..=ORDER {
        for k in (0..order).rev() {
            let previous = if k > 0 { w[k - 1] } else { 0.0 };
            w[k] = ((f + (order - 1 - k) as f64) * previous + (1.0 - f + k as f64) * w[k]) / (order - 1) as f64;
        }
    }
    w
}

/// Cells at least as wide as a cutoff.
struct Cells {
    columns: [usize; 2],
    extents: [f64; 2],
    list: CellList,
}

impl Cells {
    fn new(cell: Grid, reach: f64, points: impl Iterator<Item = (f64, f64)> + Clone) -> Self {
        let extents = [cell.lx, cell.ly];
        let columns = extents.map(|l| ((l / reach).floor() as usize).clamp(1, 2048));
        let index_along = |axis: usize, x: f64| column(x, extents[axis], columns[axis]);
        let list =
            CellList::new([columns[0], columns[1], 1], points.map(|(x, y)| [index_along(0, x), index_along(1, y), 0]));
        Cells { columns, extents, list }
    }

    /// Candidates within the cell width of a position: those of the cell and of its neighbours.
    fn around(&self, (x, y): (f64, f64)) -> impl Iterator<Item = usize> + '_ {
        let near = |axis: usize, x: f64| {
            let (n, k) = (self.columns[axis] as i64, column(x, self.extents[axis], self.columns[axis]) as i64);
            // With fewer than three columns each is visited once.
            (0..n.min(3)).map(move |d| k + d - 1)
        };
        let columns = near(0, x);
        near(1, y).flat_map(move |j| columns.clone().flat_map(move |i| self.list.points([i, j], 0)))
    }
}

fn column(x: f64, extent: f64, n: usize) -> usize {
    ((x / extent * n as f64) as usize).min(n - 1)
}

/// Neighbour search for positions with individual cutoffs: one cell list for each class of cutoffs.
pub(super) struct NeighbourSearch {
    /// Indices and cell lists; the cutoff doubles from class to class.
    classes: Vec<(Vec<usize>, Cells)>,
}

impl NeighbourSearch {
    /// A search over positions with their cutoffs; cutoffs below `smallest` are raised to it.
    pub(super) fn new(cell: Grid, smallest: f64, all: &[((f64, f64), f64)]) -> Self {
        let mut members: Vec<Vec<usize>> = Vec::new();
        for (k, (_, reach)) in all.iter().enumerate() {
            // A diverging step may give any cutoff; the cell bounds it.
            let class = (reach.min(cell.lx + cell.ly) / smallest).log2().ceil().max(0.0) as usize;
            members.resize_with(members.len().max(class + 1), Vec::new);
            members[class].push(k);
        }
        let class = |(k, members): (usize, Vec<usize>)| {
            let cells = Cells::new(cell, smallest * 2f64.powi(k as i32), members.iter().map(|&k| all[k].0));
            (members, cells)
        };
        let occupied = members.into_iter().enumerate().filter(|(_, m)| !m.is_empty());
        NeighbourSearch { classes: occupied.map(class).collect() }
    }

    /// Candidates whose cutoff may include a position.
    pub(super) fn around(&self, point: (f64, f64)) -> impl Iterator<Item = usize> + '_ {
        self.classes.iter().flat_map(move |(members, cells)| cells.around(point).map(|i| members[i]))
    }
}

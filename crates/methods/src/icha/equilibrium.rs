//! Equilibrium of interacting contact spots under a load, by Newton's method.
//!
//! The approach δ of a summit, negative without contact, is `depth - height - Σ C·F(δ)` with all loads F =
//! 4/3·√(Rδ³). The Jacobian `I + C'·2a` of these smooth equations contains displacements by flat punches in C'.

use super::ewald::{EwaldMesh, NeighbourSearch, Weights};
use super::spots::{Asperity, Spots};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Summits without contact are included up to this distance over the largest approach.
const ACTIVE_MARGIN: f64 = 0.02;
/// Relative residual of a linear system; 1e-3 did not reduce the number of Newton steps.
const LINEAR: f64 = 1e-2;
const LINEAR_STEPS: usize = 200;
/// Shortest fraction of a Newton step, accepted in any case.
const SHORTEST: f64 = 1.0 / 16.0;

/// Newton iteration for the equilibrium of spots under a load.
pub(super) struct EquilibriumSolver {
    target: f64,
    mesh: EwaldMesh,
    /// Summits in contact or close to it.
    active: Vec<usize>,
    weights: Vec<Weights>,
    /// δ minus `depth - height - Σ C·F(δ)`.
    excess: Vec<f64>,
    scale: f64,
}

/// Derivatives of the displacements at the active summits by the loads on them: near pairs one by one.
struct SpotMatrix {
    starts: Vec<usize>,
    pairs: Vec<(usize, f64)>,
    own: f64,
    /// dF/dδ of each spot.
    stiffness: Vec<f64>,
}

impl EquilibriumSolver {
    /// Starts at the present spots, with new displacements.
    pub(super) fn new(spots: &mut Spots, target: f64) -> Self {
        let touching = spots.all.iter().filter(|s| s.approach > 0.0).count();
        let mut mesh = EwaldMesh::new(spots.grid, touching);
        if touching == 0 {
            spots.first_touch(target);
        }
        let candidates = spots.candidates(target);
        let displaced = spots.displacements(&mut mesh, &candidates);
        spots.transformed += mesh.take_transformed();
        let largest = spots.all.iter().map(|s| s.approach).fold(0.0, f64::max);
        let (mut active, mut excess) = (Vec::new(), Vec::new());
        for (&k, displaced) in candidates.iter().zip(displaced) {
            let left = spots.depth - spots.all[k].height - displaced;
            if spots.all[k].approach <= 0.0 {
                spots.all[k].approach = left.min(0.0);
            }
            if spots.all[k].approach.max(left) > -ACTIVE_MARGIN * largest {
                active.push(k);
                excess.push(spots.all[k].approach - left);
            }
        }
        let weights = active.iter().map(|&k| mesh.weights(spots.all[k].place())).collect();
        EquilibriumSolver { target, mesh, active, weights, excess, scale: largest }
    }

    /// Relative residual: the larger of the errors of the approaches, over the largest, and of the load.
    pub(super) fn residual(&self, spots: &Spots) -> f64 {
        let excess = self.excess.iter().map(|e| e.abs()).fold(0.0, f64::max) / self.scale;
        excess.max((spots.pressure() / self.target - 1.0).abs())
    }

    /// One Newton step, shortened while the residual does not decrease.
    pub(super) fn step(&mut self, spots: &mut Spots) {
        let asperities: Vec<Asperity> = self.active.iter().map(|&k| spots.all[k]).collect();
        let matrix = SpotMatrix::new(spots, &self.mesh, &asperities);
        let correction = self.solve(&matrix, &self.excess.iter().map(|e| -e).collect::<Vec<_>>());
        let sink = self.solve(&matrix, &vec![1.0; self.active.len()]);
        let missing = (self.target - spots.pressure()) * spots.area();
        let deeper = (missing - dot(&matrix.stiffness, &correction)) / dot(&matrix.stiffness, &sink);

        let (depth, previous) = (spots.depth, self.residual(spots));
        let mut part = 1.0;
        loop {
            spots.depth = depth + part * deeper;
            for ((&k, s), change) in self.active.iter().zip(&asperities).zip(correction.iter().zip(&sink)) {
                spots.all[k].approach = s.approach + part * (change.0 + deeper * change.1);
            }
            let displaced = spots.displacements(&mut self.mesh, &self.active);
            for ((&k, displaced), excess) in self.active.iter().zip(displaced).zip(&mut self.excess) {
                *excess = spots.all[k].approach - (spots.depth - spots.all[k].height - displaced);
            }
            self.scale = self.active.iter().map(|&k| spots.all[k].approach).fold(0.0, f64::max);
            if self.residual(spots) < (1.0 - 0.1 * part) * previous || part <= SHORTEST {
                break;
            }
            part *= 0.5;
        }
        spots.transformed += self.mesh.take_transformed();
    }

    /// Stabilised bi-conjugate gradients (van der Vorst, SIAM J. Sci. Stat. Comput. 13 (1992) 631) for `J x = b`,
    /// starting from b.
    fn solve(&mut self, matrix: &SpotMatrix, b: &[f64]) -> Vec<f64> {
        let mut x = b.to_vec();
        let mut r = self.apply(matrix, &x);
        r.iter_mut().zip(b).for_each(|(r, b)| *r = b - *r);
        let shadow = r.clone();
        let mut p = r.clone();
        let mut rho = dot(&r, &r);
        let enough = LINEAR * LINEAR * dot(b, b);
        for _ in 0..LINEAR_STEPS {
            let v = self.apply(matrix, &p);
            let alpha = rho / dot(&shadow, &v);
            r.iter_mut().zip(&v).for_each(|(r, v)| *r -= alpha * v);
            let t = self.apply(matrix, &r);
            let omega = dot(&t, &r) / dot(&t, &t);
            if !alpha.is_finite() || !omega.is_finite() || omega == 0.0 {
                break;
            }
            x.iter_mut().zip(p.iter().zip(&r)).for_each(|(x, (p, r))| *x += alpha * p + omega * r);
            r.iter_mut().zip(&t).for_each(|(r, t)| *r -= omega * t);
            if dot(&r, &r) <= enough {
                break;
            }
            let next = dot(&shadow, &r);
            let beta = next / rho * alpha / omega;
            rho = next;
            p.iter_mut().zip(r.iter().zip(&v)).for_each(|(p, (r, v))| *p = r + beta * (*p - omega * v));
        }
        x
    }

    /// The Jacobian times changes of approach.
    fn apply(&mut self, matrix: &SpotMatrix, change: &[f64]) -> Vec<f64> {
        let loads: Vec<f64> = change.iter().zip(&matrix.stiffness).map(|(d, s)| s * d).collect();
        self.mesh.load(&self.weights, &loads, None);
        let level = self.mesh.level() * loads.iter().sum::<f64>();
        let mesh = &self.mesh;
        let row = |(k, w): (usize, &Weights)| {
            let pairs = &matrix.pairs[matrix.starts[k]..matrix.starts[k + 1]];
            let near: f64 = pairs.iter().map(|&(j, c)| c * loads[j]).sum();
            change[k] + mesh.read(w) + near + level - matrix.own * loads[k]
        };
        self.weights.par_iter().enumerate().map(row).collect()
    }
}

impl SpotMatrix {
    fn new(spots: &Spots, mesh: &EwaldMesh, asperities: &[Asperity]) -> Self {
        let touching: Vec<usize> = (0..asperities.len()).filter(|&k| asperities[k].approach > 0.0).collect();
        let all: Vec<_> =
            touching.iter().map(|&k| (asperities[k].place(), Spots::reach(&asperities[k], mesh))).collect();
        let neighbours = NeighbourSearch::new(spots.grid, mesh.reach, &all);
        let row = |k: usize| {
            let position = asperities[k].place();
            let own = asperities[k].spot();
            // Overlapping spots, which are to be merged, are treated as tangent: one inside another would make the
            // Jacobian singular.
            let coefficient = |j: usize, r: f64| {
                let a = asperities[j].spot();
                (j, punch_displacement(r.max(own + a), a) - mesh.smooth(r, 0.0))
            };
            let others = neighbours.around(position).filter(|&i| touching[i] != k);
            let near_pairs = others.map(|i| (i, spots.distance(position, all[i].0))).filter(|&(i, r)| r < all[i].1);
            near_pairs.map(|(i, r)| coefficient(touching[i], r)).collect::<Vec<_>>()
        };
        let rows: Vec<Vec<(usize, f64)>> = (0..asperities.len()).into_par_iter().map(row).collect();
        let mut starts = vec![0];
        for row in &rows {
            starts.push(starts[starts.len() - 1] + row.len());
        }
        let stiffness = asperities.iter().map(|s| 2.0 * s.spot()).collect();
        SpotMatrix { starts, pairs: rows.concat(), own: mesh.smooth(0.0, 0.0), stiffness }
    }
}

/// Displacement at the distance `r` by a unit increment of the load on a spot of radius `a`: that of a flat punch
/// (Johnson, Contact Mechanics (1985), eqs 3.36 and 3.37).
fn punch_displacement(r: f64, a: f64) -> f64 {
    if r <= a {
        0.5 / a
    } else if a == 0.0 {
        1.0 / (PI * r)
    } else {
        (a / r).asin() / (PI * a)
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::super::images::images;
    use super::super::spots::displacement;
    use super::*;
    use asperity_grid::Grid;
    use asperity_surface::Summit;

    fn spots(grid: Grid, summits: &[(f64, f64, f64, f64)]) -> Spots {
        let summit = |&(x, y, height, radius): &(f64, f64, f64, f64)| Summit { node: 0, x, y, height, radius };
        Spots::new(grid, &summits.iter().map(summit).collect::<Vec<_>>())
    }

    fn settle(spots: &mut Spots, pressure: f64) {
        for _ in 0..5 {
            let mut solver = EquilibriumSolver::new(spots, pressure);
            for step in 0.. {
                if solver.residual(spots) <= 1e-12 {
                    break;
                }
                assert!(step < 40, "{}", solver.residual(spots));
                solver.step(spots);
            }
        }
    }

    fn three() -> Spots {
        let list = [(0.97, 0.5, 0.0, 0.2), (0.03, 0.5, 0.001, 0.3), (0.5, 0.2, 0.0, 0.25)];
        let mut spots = spots(Grid::unit(8, 8), &list);
        settle(&mut spots, 6e-4);
        spots
    }

    /// Merging across the cell boundary conserves area and load to rounding, and the merged spot is in equilibrium.
    #[test]
    fn merging_conserves_area_and_load() {
        let mut spots = three();
        let sums = |s: &Spots| s.all.iter().fold((0.0, 0.0), |(a, f), s| (a + s.area(), f + s.load()));
        let previous = sums(&spots);
        assert!(spots.merge() && spots.all.len() == 2 && !spots.clone().merge());
        let after = sums(&spots);
        assert!((after.0 / previous.0 - 1.0).abs() < 1e-13 && (after.1 / previous.1 - 1.0).abs() < 1e-13);
        let merged = spots.all[1];
        assert!(merged.x < 0.03 || merged.x > 0.97, "{merged:?}");
        let others = spots.displacements(&mut EwaldMesh::new(spots.grid, 3), &[1])[0];
        assert!(((spots.depth - merged.height - others) / merged.approach - 1.0).abs() < 1e-12);
    }

    /// Many spots, some as wide as the cutoff, in a rectangular cell: displacements do not depend on the cutoff and
    /// equal direct sums over all pairs with point loads as images.
    #[test]
    fn displacements_do_not_depend_on_the_cutoff() {
        /// Errors over the largest displacement: of the cutoff (3e-6 of a load), and of point loads as images of a
        /// spot whose radius is a twelfth of the cell.
        const SPLIT: f64 = 1e-5;
        const POINTS: f64 = 5e-3;
        /// Cancellation of the mesh terms inside a wide spot.
        const OWN: f64 = 2e-4;
        let grid = Grid { nx: 12, ny: 8, lx: 1.5, ly: 1.0 };
        let chance = |k: usize, n: u64| (((k as u64 * 2 + 1) * n) % 1009) as f64 / 1009.0;
        let list: Vec<_> =
            (0..300).map(|k| (1.5 * chance(k, 137), chance(k, 419), 0.1 * chance(k, 61), 0.02)).collect();
        let mut spots = spots(grid, &list);
        for (k, s) in spots.all.iter_mut().enumerate() {
            s.approach = if k == 7 { 0.3 } else { 0.01 * (chance(k, 733) - 0.3) };
        }
        let all: Vec<usize> = (0..300).collect();
        let actual =
            [0.12, 0.2, 0.44, 0.04].map(|reach| spots.displacements(&mut EwaldMesh::with_reach(grid, reach), &all));
        let largest = actual[0].iter().map(|f| f.abs()).fold(0.0, f64::max);
        for &k in &all {
            let asperity = spots.all[k];
            let by = |s: &Asperity| {
                let r = spots.distance(asperity.place(), s.place());
                let own = if r == 0.0 { 0.0 } else { displacement(r, s.spot(), s.radius) };
                own + s.load() * images(1.5, 1.0, spots.shortest((asperity.x - s.x, asperity.y - s.y)))
            };
            let direct: f64 = spots.all.iter().filter(|s| s.approach > 0.0).map(by).sum();
            assert!((actual[0][k] - direct).abs() < POINTS * largest, "{k}: {} {direct}", actual[0][k]);
            for (n, other) in actual[1..].iter().enumerate() {
                // At the centre of the wide spot, whose radius is twice the last cutoff.
                let bound = if n == 2 && k == 7 { OWN } else { SPLIT };
                assert!((actual[0][k] - other[k]).abs() < bound * largest, "{k}: {} {}", actual[0][k], other[k]);
            }
        }
    }
}

//! Hertzian spots that feel each other and merge.

use super::super::spots::hertz_load;
use crate::grid::Grid;
use crate::interface::Images;
use crate::surface::Summit;
use std::f64::consts::PI;

/// A summit, or what summits have merged to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Asperity {
    pub x: f64,
    pub y: f64,
    /// Of the vertex.
    pub height: f64,
    /// Of curvature.
    pub radius: f64,
    /// Radius of the spot; 0 where nothing touches.
    pub spot: f64,
    /// Displacement of the body by all others.
    pub lowered: f64,
}

impl Asperity {
    pub fn load(&self) -> f64 {
        hertz_load(self.spot, self.radius)
    }

    pub fn area(&self) -> f64 {
        PI * self.spot * self.spot
    }
}

/// Displacement of the half-space at a distance `r` from the middle of a Hertzian spot of radius `a` on a summit of radius
/// `radius`, by it alone (Johnson, Contact Mechanics (1985), eqs 3.41 and 3.42a).
pub(super) fn displacement(r: f64, a: f64, radius: f64) -> f64 {
    let x = a / r;
    if x >= 1.0 {
        a * a / radius * (1.0 - 0.5 * (r / a).powi(2))
    } else if x > FAR {
        a * a / (PI * radius) * ((2.0 - (r / a).powi(2)) * x.asin() + ((r / a).powi(2) - 1.0).sqrt())
    } else {
        // The same as a series: the next term is below 4e-6 of the sum.
        let x2 = x * x;
        hertz_load(a, radius) / (PI * r) * (1.0 + x2 * (0.1 + x2 * 9.0 / 280.0))
    }
}

/// Spot's radius over distance below which a spot is nearly a point.
const FAR: f64 = 0.25;

/// How a sweep moved the spots: the largest change of a radius over the largest radius, and the load over the cell's area.
#[derive(Debug, Clone, Copy)]
pub(super) struct Moved {
    pub change: f64,
    pub pressure: f64,
}

#[derive(Debug, Clone)]
pub(super) struct Spots {
    pub grid: Grid,
    images: Images,
    /// From the first to touch on, but for what merged.
    pub all: Vec<Asperity>,
    /// Approach: plane of the rigid surface's lowest node, in whose frame the body's displacements have no mean.
    pub depth: f64,
}

impl Spots {
    pub fn new(grid: Grid, summits: &[Summit]) -> Self {
        let asperity = |s: &Summit| {
            let Summit { x, y, height, radius, .. } = *s;
            Asperity { x, y, height, radius, spot: 0.0, lowered: 0.0 }
        };
        let all: Vec<Asperity> = summits.iter().map(asperity).collect();
        Spots { grid, images: Images::new(grid.lx, grid.ly), depth: all[0].height, all }
    }

    fn area(&self) -> f64 {
        self.grid.lx * self.grid.ly
    }

    /// Displacement at one place by a spot at another, its periodic images included.
    fn by(&self, spot: &Asperity, (x, y): (f64, f64)) -> f64 {
        if spot.spot == 0.0 {
            return 0.0;
        }
        let d = self.images.shortest((x - spot.x, y - spot.y));
        let r = (d.0 * d.0 + d.1 * d.1).sqrt();
        displacement(r, spot.spot, spot.radius) + spot.load() * self.images.displacement(d)
    }

    /// What the change of a spot adds to [`Spots::by`].
    fn change(&self, old: &Asperity, new: &Asperity, (x, y): (f64, f64)) -> f64 {
        let d = self.images.shortest((x - new.x, y - new.y));
        let r = (d.0 * d.0 + d.1 * d.1).sqrt();
        let before = if old.spot == 0.0 { 0.0 } else { displacement(r, old.spot, old.radius) };
        let after = if new.spot == 0.0 { 0.0 } else { displacement(r, new.spot, new.radius) };
        after - before + (new.load() - old.load()) * self.images.displacement(d)
    }

    /// Displacement by all spots at the place of one, but its own; by its own images, too.
    fn lowered(&self, k: usize) -> f64 {
        let place = (self.all[k].x, self.all[k].y);
        let others = self.all.iter().enumerate().filter(|(j, _)| *j != k).map(|(_, s)| self.by(s, place));
        others.sum::<f64>() + self.all[k].load() * self.images.displacement((0.0, 0.0))
    }

    /// How far below the summit heights that touch others may come to touch, since displacements have no mean: a bound on
    /// what a pressure lifts.
    fn reach(&self, pressure: f64) -> f64 {
        let Grid { lx, ly, .. } = self.grid;
        let corner = (0.5 * lx, 0.5 * ly);
        let least = self.images.displacement(corner) + 1.0 / (PI * corner.0.hypot(corner.1));
        // Loads in one place raise the farthest one most.
        pressure * self.area() * least.min(0.0).abs()
    }

    /// One sweep of Gauss and Seidel: each spot in turn follows its own approach by the share `relaxation`, and the others
    /// feel it at once. Then the approach follows the load, by the stiffness of spots that do not feel each other, which
    /// no stiffness exceeds.
    pub fn sweep(&mut self, target: f64, relaxation: f64) -> Moved {
        let bound = self.depth + self.reach(target);
        let candidates: Vec<usize> =
            (0..self.all.len()).filter(|&k| self.all[k].height < bound || self.all[k].spot > 0.0).collect();
        let own = self.images.displacement((0.0, 0.0));
        let (mut change, mut largest) = (0.0f64, 0.0f64);
        for &k in &candidates {
            let old = self.all[k];
            let approach = self.depth - old.height - old.lowered;
            let goal = (old.radius * approach).max(0.0).sqrt();
            let mut new = Asperity { spot: old.spot + relaxation * (goal - old.spot), ..old };
            if goal == 0.0 && new.spot < SPENT * goal.max(largest) {
                new.spot = 0.0;
            }
            largest = largest.max(new.spot);
            if new.spot == old.spot {
                continue;
            }
            change = change.max((new.spot - old.spot).abs());
            new.lowered += own * (new.load() - old.load());
            self.all[k] = new;
            for &j in &candidates {
                if j != k {
                    let by = self.change(&old, &new, (self.all[j].x, self.all[j].y));
                    self.all[j].lowered += by;
                }
            }
        }
        let load: f64 = self.all.iter().map(Asperity::load).sum();
        let stiffness: f64 = self.all.iter().map(|s| 2.0 * s.spot).sum();
        let missing = target * self.area() - load;
        if stiffness > 0.0 {
            self.depth += missing / stiffness;
        } else {
            // Nothing touches: what the first summit alone needs.
            let first = self
                .all
                .iter()
                .map(|s| (s.height + s.lowered, s.radius))
                .fold((f64::INFINITY, 1.0), |a, b| if b.0 < a.0 { b } else { a });
            let a = (0.75 * missing * first.1).cbrt();
            self.depth = first.0 + a * a / first.1;
        }
        Moved { change: if largest > 0.0 { change / largest } else { 1.0 }, pressure: load / self.area() }
    }

    /// Displacements of all places anew: sums that sweeps have carried along lose digits, and leave out who was out of reach.
    pub fn refresh(&mut self) {
        for k in 0..self.all.len() {
            self.all[k].lowered = self.lowered(k);
        }
    }

    /// Merges spots that overlap to spots of the same area and load, each at the centre of the loads of its parts, with a
    /// height that has it in equilibrium at this approach. Returns whether any did.
    pub fn merge(&mut self) -> bool {
        let touching: Vec<usize> = (0..self.all.len()).filter(|&k| self.all[k].spot > 0.0).collect();
        let mut parent: Vec<usize> = (0..touching.len()).collect();
        fn root(parent: &[usize], mut k: usize) -> usize {
            while parent[k] != k {
                k = parent[k];
            }
            k
        }
        for i in 0..touching.len() {
            for j in 0..i {
                let (a, b) = (&self.all[touching[i]], &self.all[touching[j]]);
                let d = self.images.shortest((a.x - b.x, a.y - b.y));
                if d.0 * d.0 + d.1 * d.1 < (a.spot + b.spot).powi(2) {
                    let (a, b) = (root(&parent, i), root(&parent, j));
                    parent[a.max(b)] = a.min(b);
                }
            }
        }
        let mut merged = Vec::new();
        for first in 0..touching.len() {
            let parts: Vec<usize> = (first..touching.len()).filter(|&k| root(&parent, k) == first).collect();
            if parts.len() > 1 {
                merged.push(self.together(parts.into_iter().map(|k| touching[k]).collect()));
            }
        }
        if merged.is_empty() {
            return false;
        }
        let gone: std::collections::HashSet<usize> =
            merged.iter().flat_map(|(parts, _)| parts.iter().copied()).collect();
        let mut k = 0;
        self.all.retain(|_| {
            k += 1;
            !gone.contains(&(k - 1))
        });
        let from = self.all.len();
        self.all.extend(merged.into_iter().map(|(_, spot)| spot));
        self.refresh();
        for s in &mut self.all[from..] {
            s.height = self.depth - s.lowered - s.spot * s.spot / s.radius;
        }
        true
    }

    fn together(&self, parts: Vec<usize>) -> (Vec<usize>, Asperity) {
        let first = self.all[parts[0]];
        let mut sums = [0.0; 4];
        for &k in &parts {
            let s = &self.all[k];
            let d = self.images.shortest((s.x - first.x, s.y - first.y));
            for (sum, v) in sums.iter_mut().zip([s.spot * s.spot, s.load(), s.load() * d.0, s.load() * d.1]) {
                *sum += v;
            }
        }
        let [square, load, x, y] = sums;
        let spot = square.sqrt();
        let x = (first.x + x / load).rem_euclid(self.grid.lx);
        let y = (first.y + y / load).rem_euclid(self.grid.ly);
        (parts, Asperity { x, y, height: 0.0, radius: hertz_load(spot, 1.0) / load, spot, lowered: 0.0 })
    }
}

/// Share of the largest spot below which one that no longer touches is gone, since relaxation alone never ends.
const SPENT: f64 = 1e-3;

#[cfg(test)]
mod tests {
    use super::*;

    /// The closed form is continuous where the spot ends and where the series begins, and the series is a point's far away.
    #[test]
    fn displacement_of_one_spot() {
        let (a, radius) = (0.02, 0.3);
        assert!((displacement(0.0, a, radius) - a * a / radius).abs() < 1e-18);
        for r in [a, a / FAR] {
            let (below, above) = (displacement(r * (1.0 - 1e-9), a, radius), displacement(r * (1.0 + 1e-9), a, radius));
            assert!((below / above - 1.0).abs() < 5e-6, "{below} {above}");
        }
        assert!((displacement(3.0, a, radius) * PI * 3.0 / hertz_load(a, radius) - 1.0).abs() < 1e-5);
    }

    fn three() -> Spots {
        let grid = Grid::unit(8, 8);
        let summit = |x: f64, y: f64, height: f64, radius: f64| Summit { node: 0, x, y, height, radius };
        let mut spots = Spots::new(
            grid,
            &[summit(0.97, 0.5, 0.0, 0.2), summit(0.03, 0.5, 0.001, 0.3), summit(0.5, 0.2, 0.0, 0.25)],
        );
        for _ in 0..400 {
            spots.sweep(0.02, 0.7);
        }
        spots
    }

    /// Merging across the seam keeps area and load to rounding, and the merged spot in equilibrium where it is.
    #[test]
    fn merging_keeps_area_and_load() {
        let mut spots = three();
        let sums = |s: &Spots| s.all.iter().fold((0.0, 0.0), |(a, f), s| (a + s.area(), f + s.load()));
        let before = sums(&spots);
        assert!(spots.merge() && spots.all.len() == 2 && !spots.clone().merge());
        let after = sums(&spots);
        assert!((after.0 / before.0 - 1.0).abs() < 1e-13 && (after.1 / before.1 - 1.0).abs() < 1e-13);
        let merged = spots.all[1];
        assert!(merged.x < 0.03 || merged.x > 0.97, "{merged:?}");
        let approach = spots.depth - merged.height - merged.lowered;
        assert!(((merged.radius * approach).sqrt() / merged.spot - 1.0).abs() < 1e-12);
    }

    /// At rest, what sweeps carried along is what a sum over all says.
    #[test]
    fn sweeps_carry_displacements_along() {
        let mut spots = three();
        let carried: Vec<f64> = spots.all.iter().map(|s| s.lowered).collect();
        spots.refresh();
        for (s, carried) in spots.all.iter().zip(carried) {
            assert!((s.lowered - carried).abs() < 1e-14, "{} {carried}", s.lowered);
            let approach = spots.depth - s.height - s.lowered;
            assert!(((s.radius * approach).sqrt() / s.spot - 1.0).abs() < 1e-10);
        }
    }
}

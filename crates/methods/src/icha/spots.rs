//! Hertzian contact spots that interact and merge.

use super::ewald::{EwaldMesh, NeighbourSearch, Weights};
use super::images::images;
use crate::spots::hertz_load;
use asperity_grid::{Grid, UnionFind};
use asperity_surface::Summit;
use rayon::prelude::*;
use std::f64::consts::PI;

/// A summit or several merged summits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Asperity {
    pub x: f64,
    pub y: f64,
    /// Height of the vertex.
    pub height: f64,
    /// Radius of curvature.
    pub radius: f64,
    /// Distance by which the surface displaced by all other spots overlaps the vertex; negative without contact.
    pub approach: f64,
}

impl Asperity {
    /// Contact radius; 0 without contact.
    pub(super) fn spot(&self) -> f64 {
        (self.radius * self.approach.max(0.0)).sqrt()
    }

    pub(super) fn load(&self) -> f64 {
        hertz_load(self.spot(), self.radius)
    }

    pub(super) fn area(&self) -> f64 {
        PI * self.radius * self.approach.max(0.0)
    }

    pub(super) fn place(&self) -> (f64, f64) {
        (self.x, self.y)
    }
}

/// Displacement of the half-space by a Hertz contact of radius `a` on a summit of radius `radius`, at the distance
/// `r` from its centre (Johnson, Contact Mechanics (1985), eqs 3.41 and 3.42a).
pub(super) fn displacement(r: f64, a: f64, radius: f64) -> f64 {
    let x = a / r;
    if x >= 1.0 {
        a * a / radius * (1.0 - 0.5 * (r / a).powi(2))
    } else if x > FAR {
        a * a / (PI * radius) * ((2.0 - (r / a).powi(2)) * x.asin() + ((r / a).powi(2) - 1.0).sqrt())
    } else {
        // Series; the next term is below 4e-6 of the sum.
        let x2 = x * x;
        hertz_load(a, radius) / (PI * r) * (1.0 + x2 * (0.1 + x2 * 9.0 / 280.0))
    }
}

/// Radius over distance below which the displacement is expanded about a point load.
const FAR: f64 = 0.25;

/// Distance over contact radius beyond which the mesh represents a spot: the terms of the expansion beyond its two
/// are then below 5e-6 of the largest displacement. At the centre of a spot wider than the cutoff the two terms
/// cancel, with an error of 1e-4 at a radius of twice and 4e-3 at six times the cutoff (test
/// `displacements_do_not_depend_on_the_cutoff`).
const WIDTHS: f64 = 5.0;

#[derive(Debug, Clone)]
pub(super) struct Spots {
    pub grid: Grid,
    /// Largest upward displacement by a unit load and its images, at the farthest position.
    uplift: f64,
    /// In the order of first contact; merged spots at the end.
    pub all: Vec<Asperity>,
    /// Approach: height of the undeformed elastic surface, whose displacement has no mean, above the lowest node.
    pub depth: f64,
    /// Transform pairs times mesh points so far.
    pub transformed: f64,
}

impl Spots {
    pub(super) fn new(grid: Grid, summits: &[Summit]) -> Self {
        let asperity = |s: &Summit| {
            let Summit { x, y, height, radius, .. } = *s;
            Asperity { x: x.rem_euclid(grid.lx), y: y.rem_euclid(grid.ly), height, radius, approach: f64::MIN }
        };
        let all: Vec<Asperity> = summits.iter().map(asperity).collect();
        let corner = (0.5 * grid.lx, 0.5 * grid.ly);
        let uplift = -(images(grid.lx, grid.ly, corner) + 1.0 / (PI * corner.0.hypot(corner.1)));
        Spots { grid, uplift: uplift.max(0.0), depth: all[0].height, all, transformed: 0.0 }
    }

    pub(super) fn area(&self) -> f64 {
        self.grid.lx * self.grid.ly
    }

    pub(super) fn pressure(&self) -> f64 {
        self.all.iter().map(Asperity::load).sum::<f64>() / self.area()
    }

    pub(super) fn distance(&self, a: (f64, f64), b: (f64, f64)) -> f64 {
        let (dx, dy) = self.shortest((a.0 - b.0, a.1 - b.1));
        (dx * dx + dy * dy).sqrt()
    }

    /// Minimum-image vector.
    pub(super) fn shortest(&self, (dx, dy): (f64, f64)) -> (f64, f64) {
        let Grid { lx, ly, .. } = self.grid;
        (dx - lx * (dx / lx).round(), dy - ly * (dy / ly).round())
    }

    /// Cutoff of the pair sum for a spot.
    pub(super) fn reach(spot: &Asperity, mesh: &EwaldMesh) -> f64 {
        mesh.reach.max(WIDTHS * spot.spot())
    }

    /// Initial state: the approach at which the first summit alone carries the pressure.
    pub(super) fn first_touch(&mut self, pressure: f64) {
        let first = self.all.iter_mut().min_by(|a, b| a.height.total_cmp(&b.height)).expect("there are summits");
        let a = (0.75 * pressure * self.grid.lx * self.grid.ly * first.radius).cbrt();
        first.approach = a * a / first.radius;
        self.depth = first.height + first.approach;
    }

    /// Summits that are or may come into contact under a pressure; the largest upward displacement bounds their height.
    pub(super) fn candidates(&self, pressure: f64) -> Vec<usize> {
        let bound = self.depth + pressure * self.area() * self.uplift;
        (0..self.all.len()).filter(|&k| self.all[k].height < bound || self.all[k].approach > 0.0).collect()
    }

    /// Displacement at some summits by all other spots and all periodic images.
    pub(super) fn displacements(&self, mesh: &mut EwaldMesh, places: &[usize]) -> Vec<f64> {
        let touching: Vec<(usize, &Asperity)> = self.all.iter().enumerate().filter(|(_, s)| s.approach > 0.0).collect();
        let loads: Vec<f64> = touching.iter().map(|(_, s)| s.load()).collect();
        let second: Vec<f64> = touching.iter().map(|(_, s)| 0.1 * s.radius * s.approach * s.load()).collect();
        let weights: Vec<Weights> = touching.iter().map(|(_, s)| mesh.weights(s.place())).collect();
        mesh.load(&weights, &loads, Some(&second));
        let level = mesh.level() * loads.iter().sum::<f64>();
        let all: Vec<_> = touching.iter().map(|(_, s)| (s.place(), Self::reach(s, mesh))).collect();
        let neighbours = NeighbourSearch::new(self.grid, mesh.reach, &all);
        let mesh = &*mesh;
        let by_all = |k: &usize| {
            let place = self.all[*k].place();
            let mut sum = mesh.read(&mesh.weights(place)) + level;
            for i in neighbours.around(place) {
                let (j, s) = touching[i];
                let r = self.distance(place, s.place());
                if r < all[i].1 {
                    let own = if j == *k { 0.0 } else { displacement(r, s.spot(), s.radius) };
                    sum += own - loads[i] * mesh.smooth(r, s.spot());
                }
            }
            sum
        };
        places.par_iter().map(by_all).collect()
    }

    /// Merges overlapping spots into spots with their total area and load, at their centre of load, with heights in
    /// equilibrium at the present approach. Returns whether any were merged.
    pub(super) fn merge(&mut self) -> bool {
        let touching: Vec<usize> = (0..self.all.len()).filter(|&k| self.all[k].approach > 0.0).collect();
        // The distance of overlapping spots is at most twice the larger radius.
        let all: Vec<_> = touching.iter().map(|&k| (self.all[k].place(), 2.0 * self.all[k].spot())).collect();
        let narrow = (self.area() / touching.len().max(1) as f64).sqrt();
        let neighbours = NeighbourSearch::new(self.grid, narrow, &all);
        let mut merged = UnionFind::new(touching.len());
        for i in 0..touching.len() {
            let a = &self.all[touching[i]];
            for j in neighbours.around(a.place()).filter(|j| *j != i) {
                let b = &self.all[touching[j]];
                if self.distance(a.place(), b.place()) < a.spot() + b.spot() {
                    merged.unite(i as u32, j as u32);
                }
            }
        }
        let mut groups = vec![Vec::new(); touching.len()];
        for k in 0..touching.len() {
            groups[merged.root(k as u32) as usize].push(touching[k]);
        }
        groups.retain(|parts| parts.len() > 1);
        if groups.is_empty() {
            return false;
        }
        let merged: Vec<Asperity> = groups.iter().map(|parts| self.merged(parts)).collect();
        let mut gone = vec![false; self.all.len()];
        groups.iter().flatten().for_each(|&k| gone[k] = true);
        let mut gone = gone.into_iter();
        self.all.retain(|_| !gone.next().expect("one for each"));
        let from = self.all.len();
        self.all.extend(merged);
        let places: Vec<usize> = (from..self.all.len()).collect();
        let mut mesh = EwaldMesh::new(self.grid, touching.len());
        let displaced = self.displacements(&mut mesh, &places);
        self.transformed += mesh.take_transformed();
        for (s, displaced) in self.all[from..].iter_mut().zip(displaced) {
            s.height = self.depth - displaced - s.approach;
        }
        true
    }

    fn merged(&self, parts: &[usize]) -> Asperity {
        let first = self.all[parts[0]];
        let mut sums = [0.0; 4];
        for &k in parts {
            let s = &self.all[k];
            let d = self.shortest((s.x - first.x, s.y - first.y));
            for (sum, v) in sums.iter_mut().zip([s.radius * s.approach, s.load(), s.load() * d.0, s.load() * d.1]) {
                *sum += v;
            }
        }
        let [square, load, x, y] = sums;
        let spot = square.sqrt();
        let x = (first.x + x / load).rem_euclid(self.grid.lx);
        let y = (first.y + y / load).rem_euclid(self.grid.ly);
        let radius = hertz_load(spot, 1.0) / load;
        Asperity { x, y, height: 0.0, radius, approach: square / radius }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The closed form is continuous at the edge of the spot and at the changeover to the series, which tends to a
    /// point load.
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
}

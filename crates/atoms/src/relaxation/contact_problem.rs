//! The contact of the surface layers with the rigid wall, the crystal being harmonic: the step of one iteration.
//!
//! Minimises `½ p·G p + W(s, Z) + F Z` over the forces p of the wall on the surface layers and the lift Z of the indenter, with the positions
//! `s = a + G p` and G the surface's Green function. p is counted from the present forces w₀, so that a has small corrections only. Newton's
//! method; its linear systems by conjugate gradients preconditioned by G, one application of G for each.

use asperity_contact::interface::SurfaceResponse;
use asperity_grid::Real;
use nalgebra::DVector;
use rayon::prelude::*;

use super::pairs::{Pairs, add_scaled, dot};
use super::relative_motion::{LONGEST_STEP, relative_motion};
use super::rigid_wall::{RigidWall, WallAction};

type Vectors = Vec<[f64; 3]>;

/// Largest relative motion in one Newton iteration, Å: beyond, the wall's Hessian is another one.
const LARGEST_STEP: f64 = 0.4;
/// Distance over which the force on an indenter without contacts is supposed to change, Å.
const STIFFENING: f64 = 0.3;
/// Smallest stiffness of the wall as a whole, eV/Å².
const SMALLEST_STIFFNESS: f64 = 1e-3;
const NEWTON_STEPS: usize = 60;
const CONJUGATE_GRADIENTS: usize = 80;
/// Tolerance of the load, relative, and at least, eV/Å.
const LOAD_TOLERANCE: f64 = 2e-5;
const SMALLEST_LOAD_TOLERANCE: f64 = 1e-9;
/// Part of the tolerances to which a linear system is solved. With exact systems there are as many Newton iterations, and twice as many conjugate
/// gradients.
const SOLVED: f64 = 0.5;

/// What holds the indenter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Control {
    /// A load, eV/Å: the indenter moves along z.
    Load(f64),
    /// Its height.
    Height,
}

/// Surface layers: the indices of their atoms on the grid of half lattice constants, layer by layer.
pub(super) struct SurfaceProblem<'a, T: Real> {
    pub response: SurfaceResponse<'a, T>,
    pub pairs: &'a Pairs<T>,
    pub wall: &'a RigidWall,
    pub indices: &'a [Vec<usize>],
    fields: Vec<Vec<T>>,
}

/// The wall's action on the surface layers.
struct WallState {
    energy: f64,
    forces: Vectors,
    /// Atoms within reach.
    touched: Vec<(usize, WallAction)>,
}

/// Solution: forces in excess of w₀, positions, and lift.
pub(super) struct SurfaceStep {
    pub excess: Vectors,
    pub lift: f64,
}

impl<'a, T: Real> SurfaceProblem<'a, T> {
    pub(super) fn new(
        response: SurfaceResponse<'a, T>,
        pairs: &'a Pairs<T>,
        wall: &'a RigidWall,
        indices: &'a [Vec<usize>],
        points: usize,
    ) -> Self {
        let fields = vec![vec![T::default(); points]; 3 * indices.len()];
        SurfaceProblem { response, pairs, wall, indices, fields }
    }

    /// `G p` of forces on the atoms `active`, on the grid of half lattice constants, without the part of the pairs: of the layers from `lowest`
    /// on, below which no force acts.
    fn harmonic_response(&mut self, active: &[usize], forces: &[[f64; 3]], lowest: usize) {
        self.fields[3 * lowest..].iter_mut().for_each(|field| field.fill(T::default()));
        for (k, f) in active.iter().zip(forces) {
            let (layer, index) = self.place(*k);
            (0..3).for_each(|c| self.fields[3 * layer + c][index] = T::of(f[c]));
        }
        self.response.apply(&mut self.fields[3 * lowest..]);
    }

    /// Layer of an atom of the surface layers, and its index on the grid.
    fn place(&self, atom: usize) -> (usize, usize) {
        let per_layer = self.indices[0].len();
        (atom / per_layer, self.indices[atom / per_layer][atom % per_layer])
    }

    fn displacement(&self, atom: usize) -> [f64; 3] {
        let (layer, index) = self.place(atom);
        std::array::from_fn(|c| self.fields[3 * layer + c][index].wide())
    }

    /// G p on the atoms on which the forces act: `columns` is the part of the pairs' columns there.
    fn green(&mut self, active: &[usize], columns: &ActiveColumns, forces: &[[f64; 3]]) -> Vectors {
        // Mostly the highest layer alone touches the wall.
        let lowest = active.first().map_or(0, |k| self.place(*k).0);
        self.harmonic_response(active, forces, lowest);
        let mut displaced: Vectors = active.iter().map(|k| self.displacement(*k)).collect();
        columns.add(&self.pairs.coefficients(&columns.project(forces)), &mut displaced);
        displaced
    }

    /// G p on all atoms of the surface layers.
    fn green_everywhere(&mut self, active: &[usize], columns: &ActiveColumns, forces: &[[f64; 3]]) -> Vectors {
        self.harmonic_response(active, forces, 0);
        let atoms = self.indices.len() * self.indices[0].len();
        let mut displaced: Vectors = (0..atoms).map(|k| self.displacement(k)).collect();
        self.pairs.add_surface(&self.pairs.coefficients(&columns.project(forces)), &mut displaced);
        displaced
    }

    fn wall_state(&self, positions: &[[f64; 3]], lift: f64) -> WallState {
        let touched: Vec<(usize, WallAction)> =
            positions.par_iter().enumerate().filter_map(|(k, x)| Some((k, self.wall.action(*x, lift)?))).collect();
        let mut forces = vec![[0.0; 3]; positions.len()];
        touched.iter().for_each(|(k, action)| forces[*k] = action.force);
        WallState { energy: touched.iter().map(|(_, a)| a.energy).sum(), forces, touched }
    }

    /// Minimum from the positions `start` at the lift `lift`, where the wall's forces are `present`; `load`: on the surface layers, without what deeper atoms
    /// carry.
    pub(super) fn solve(
        &mut self,
        start: &[[f64; 3]],
        present: &[[f64; 3]],
        mut lift: f64,
        control: Control,
        tolerance: f64,
    ) -> SurfaceStep {
        let load = if let Control::Load(load) = control { Some(load) } else { None };
        let load_tolerance = LOAD_TOLERANCE * load.unwrap_or(0.0).abs() + SMALLEST_LOAD_TOLERANCE;
        let from = lift;
        let mut excess = vec![[0.0; 3]; start.len()];
        let mut positions = start.to_vec();
        let mut wall = self.wall_state(&positions, lift);
        let energy_of = |excess: &[[f64; 3]], positions: &[[f64; 3]], wall: &WallState, lift: f64| {
            let moved: Vectors =
                positions.iter().zip(start).map(|(x, a)| [x[0] - a[0], x[1] - a[1], x[2] - a[2]]).collect();
            0.5 * dot(excess, &moved) + dot(present, &moved) + wall.energy + load.unwrap_or(0.0) * lift
        };
        let mut energy = energy_of(&excess, &positions, &wall, lift);
        for _ in 0..NEWTON_STEPS {
            let residual: Vectors = (0..start.len())
                .map(|k| std::array::from_fn(|c| wall.forces[k][c] - present[k][c] - excess[k][c]))
                .collect();
            let on_indenter = -wall.forces.iter().map(|f| f[2]).sum::<f64>();
            let unbalanced = load.map_or(0.0, |load| on_indenter - load);
            if is_within(&residual, unbalanced, [tolerance, load_tolerance]) {
                break;
            }
            let step = self.newton_step(&wall, &residual, unbalanced, load, [tolerance, load_tolerance]);
            let longest = relative_motion(&step.displacement, self.indices[0].len(), step.lift);
            let mut t = (LARGEST_STEP / longest).min(1.0);
            let slope = -dot(&residual, &step.displacement) - unbalanced * step.lift;
            // Backtracking; the last trial is taken as it is.
            for trial in 0..12 {
                let moved = |from: &[[f64; 3]], by: &[[f64; 3]]| -> Vectors {
                    from.iter().zip(by).map(|(a, b)| std::array::from_fn(|c| a[c] + t * b[c])).collect()
                };
                let new_positions = moved(&positions, &step.displacement);
                let new_excess = moved(&excess, &step.force);
                let new_lift = lift + t * step.lift;
                let new_wall = self.wall_state(&new_positions, new_lift);
                let new_energy = energy_of(&new_excess, &new_positions, &new_wall, new_lift);
                if new_energy <= energy + 1e-4 * t * slope + 1e-10 * energy.abs() || trial == 11 {
                    (positions, excess, lift, wall, energy) =
                        (new_positions, new_excess, new_lift, new_wall, new_energy);
                    break;
                }
                t *= 0.4;
            }
            let moved = positions.iter().zip(start).map(|(x, a)| std::array::from_fn(|c| x[c] - a[c]));
            let moved: Vectors = moved.collect();
            // The step may be shortened.
            if relative_motion(&moved, self.indices[0].len(), lift - from) > LONGEST_STEP {
                break;
            }
        }
        SurfaceStep { excess, lift }
    }

    /// Solves `(G⁻¹ + K) ds - K z dZ = r`, `-z·K ds + z·K z dZ = r_Z`, to an accuracy that suits the residual. All forces act on the atoms in contact
    /// now or before, on which alone the conjugate gradients work.
    fn newton_step(
        &mut self,
        wall: &WallState,
        residual: &[[f64; 3]],
        unbalanced: f64,
        load: Option<f64>,
        tolerances: [f64; 2],
    ) -> NewtonStep {
        let mut is_active: Vec<bool> = residual.iter().map(|r| *r != [0.0; 3]).collect();
        wall.touched.iter().for_each(|(k, _)| is_active[*k] = true);
        let active: Vec<usize> = (0..residual.len()).filter(|k| is_active[*k]).collect();
        let columns = ActiveColumns(self.pairs.at(&active));
        let touched: Vec<(usize, &WallAction)> =
            wall.touched.iter().filter_map(|(k, a)| Some((active.binary_search(k).ok()?, a))).collect();
        let stiffness: f64 = touched.iter().map(|(_, a)| a.hessian[2]).sum();
        let kappa = stiffness.max(load.unwrap_or(0.0).abs() / STIFFENING).max(SMALLEST_STIFFNESS);
        let lifted = |r: f64| if load.is_some() { r / kappa } else { 0.0 };
        let largest = largest(residual);
        let mut sum = NewtonStep::zero(active.len());
        let (mut r, mut r_lift): (Vectors, f64) = (active.iter().map(|k| residual[*k]).collect(), unbalanced);
        let mut z = self.green(&active, &columns, &r);
        let mut direction = NewtonStep { displacement: z.clone(), force: r.clone(), lift: lifted(r_lift) };
        let mut product = dot(&r, &z) + r_lift * lifted(r_lift);
        let first = product;
        for k in 0..CONJUGATE_GRADIENTS {
            let mut image = direction.force.clone();
            let mut image_lift = 0.0;
            for (atom, action) in &touched {
                let mut d = direction.displacement[*atom];
                d[2] -= direction.lift;
                let f = action.stiffness_times(d);
                (0..3).for_each(|c| image[*atom][c] += f[c]);
                image_lift -= f[2];
            }
            if load.is_none() {
                image_lift = 0.0;
            }
            let curvature = dot(&direction.displacement, &image) + direction.lift * image_lift;
            if curvature <= 1e-12 * product.abs() {
                // Along a direction of negative curvature the backtracking finds the step.
                if k == 0 {
                    sum = direction;
                }
                break;
            }
            let alpha = product / curvature;
            sum.add(alpha, &direction);
            r.as_flattened_mut().iter_mut().zip(image.as_flattened()).for_each(|(r, a)| *r -= alpha * a);
            r_lift -= alpha * image_lift;
            if is_within(&r, r_lift, tolerances.map(|t| SOLVED * t)) {
                break;
            }
            z = self.green(&active, &columns, &r);
            let next = dot(&r, &z) + r_lift * lifted(r_lift);
            if next < 1e-4 * first * largest.min(1.0) || next < 1e-16 {
                break;
            }
            let beta = next / product;
            product = next;
            direction.scale_and_add(beta, &z, &r, lifted(r_lift));
        }
        let displacement = self.green_everywhere(&active, &columns, &sum.force);
        let mut force = vec![[0.0; 3]; residual.len()];
        active.iter().zip(sum.force).for_each(|(k, f)| force[*k] = f);
        NewtonStep { displacement, force, lift: sum.lift }
    }
}

/// Largest magnitude of a vector.
fn largest(vectors: &[[f64; 3]]) -> f64 {
    vectors.iter().map(|r| r.iter().map(|c| c * c).sum::<f64>()).fold(0.0, f64::max).sqrt()
}

/// Whether the forces on atoms and indenter that are left are within their tolerances.
fn is_within(residual: &[[f64; 3]], unbalanced: f64, [force, load]: [f64; 2]) -> bool {
    unbalanced.abs() < load && largest(residual) < force
}

/// The parts of the pairs on some atoms of the surface layers.
struct ActiveColumns(Vec<[Vectors; 2]>);

impl ActiveColumns {
    fn project(&self, forces: &[[f64; 3]]) -> Vec<[f64; 2]> {
        self.0.iter().map(|[s, q]| [dot(s, forces), dot(q, forces)]).collect()
    }

    /// Adds `X c`.
    fn add(&self, coefficients: &DVector<f64>, to: &mut [[f64; 3]]) {
        let (s, q) = (self.0.iter().map(|x| &x[0]), self.0.iter().map(|x| &x[1]));
        s.chain(q).zip(coefficients.iter()).for_each(|(x, c)| add_scaled(to, *c, x));
    }
}

/// Displacements of atoms, the forces that bring them, and the lift of the indenter.
struct NewtonStep {
    displacement: Vectors,
    force: Vectors,
    lift: f64,
}

impl NewtonStep {
    fn zero(atoms: usize) -> Self {
        NewtonStep { displacement: vec![[0.0; 3]; atoms], force: vec![[0.0; 3]; atoms], lift: 0.0 }
    }

    fn add(&mut self, factor: f64, other: &NewtonStep) {
        add_scaled(&mut self.displacement, factor, &other.displacement);
        add_scaled(&mut self.force, factor, &other.force);
        self.lift += factor * other.lift;
    }

    fn scale_and_add(&mut self, factor: f64, displacement: &[[f64; 3]], force: &[[f64; 3]], lift: f64) {
        let combine = |to: &mut Vectors, from: &[[f64; 3]]| {
            to.as_flattened_mut().iter_mut().zip(from.as_flattened()).for_each(|(a, b)| *a = factor * *a + b);
        };
        combine(&mut self.displacement, displacement);
        combine(&mut self.force, force);
        self.lift = factor * self.lift + lift;
    }
}

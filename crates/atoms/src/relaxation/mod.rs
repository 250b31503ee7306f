//! Relaxation of a block under the rigid indenter with one force evaluation per iteration: a proximal quasi-Newton method in the metric of the
//! harmonic crystal.
//!
//! Between two evaluations nearly everything is known: the harmonic crystal ([`HarmonicBlock`]) and the potential of the rigid wall. An iteration
//! minimises their sum ([`contact_problem`]), moves all atoms there, and asks for the true forces once. What the crystal does beyond its force
//! constants is learnt from pairs of displacements and changes of its own forces ([`pairs`]): contacts that open and close do not spoil
//! them. Where the crystal slips the energy that the model predicts and the true one part; the relaxation then ends without convergence and
//! leaves the lowest state that it found.
//!
//! Units: Å, eV, eV/Å.

mod contact_problem;
mod pairs;
mod relative_motion;
mod rigid_wall;
#[cfg(test)]
mod spring_block;

use rayon::prelude::*;

use asperity_contact::interface::{Amplitudes, HarmonicBlock, SurfaceResponse};
use asperity_grid::Real;

pub(crate) use contact_problem::Control;
use contact_problem::{SurfaceProblem, SurfaceStep};
use pairs::{Pair, Pairs};
use relative_motion::{LONGEST_STEP, relative_motion};
pub(crate) use rigid_wall::RigidWall;

/// Layers whose forces from the wall are unknowns of the contact problem. With one, a contact in which the second layer touches (25 nm, p* = 0.03) did not
/// converge.
const SURFACE_LAYERS: usize = 2;
/// Rise of the energy that is rounding: relative to the load times 1 Å and to the wall's energy, eV, and to the total energy.
const ROUNDING: [f64; 2] = [2e-8, 1e-13];
/// Tolerance of the contact problem: at least, in the first iteration, and relative to the largest force and to its cap, eV/Å.
const CONTACT_TOLERANCE: [f64; 4] = [2e-5, 1e-3, 0.2, 0.02];
/// Trials of one iteration, the first included.
const TRIALS: usize = 6;
/// Iterations in a row that needed more than this many trials end a relaxation: the model says nothing about the crystal any more. (50 nm,
/// p* = 0.03: 39 trials of 10 iterations, with energies of 1e14 eV between.)
const HARD: (usize, usize) = (4, 2);
/// So many states with forces that no crystal has, before a load is near, end a relaxation: the crystal yields on the way. (98 nm on a half-space,
/// p* = 0.003: 49 evaluations in which the load rose to a fifth.)
const YIELDING: usize = 3;
/// Relative error of a prescribed load up to which a state is one to go on from; heights are always near.
const NEAR: f64 = 0.1;
/// Evaluations in which the predicted decrease must have halved: where the crystal slips it rises tenfold for some forty, and falls again.
const PATIENCE: usize = 45;
/// The wall's energy to which a predicted decrease is compared, at least, eV: of a block without contact.
const SMALLEST_WALL_ENERGY: f64 = 1e-3;
/// Sum of the wall's forces to which a residual one is compared, at least, eV/Å.
const SMALLEST_FORCE: f64 = 1e-6;
/// Factor on a step whose direction has been tried.
const SHORTER: f64 = 0.3;

/// True forces at a state of the block.
pub(crate) trait ForceField {
    /// Moves the free atoms by `displacements` (in the order of their ids) and the indenter by `lift`, and evaluates. `None`: they would leave the
    /// box, and nothing has moved.
    ///
    /// # Errors
    /// One line: why there are no forces.
    fn evaluate(&mut self, displacements: &[[f64; 3]], lift: f64) -> Result<Option<Evaluation>, String>;
}

/// What an evaluation gives; vectors are in the order of the ids of the free atoms.
#[derive(Debug, Clone, Default)]
pub(crate) struct Evaluation {
    /// Potential energy, eV.
    pub energy: f64,
    /// Å, wrapped or not.
    pub positions: Vec<[f64; 3]>,
    /// Total forces, eV/Å.
    pub forces: Vec<[f64; 3]>,
    /// Force on the indenter along z, and on the base, eV/Å.
    pub on_indenter: f64,
    pub on_base: f64,
}

/// When a state is relaxed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Criteria {
    /// Largest force on a free atom, eV/Å.
    pub force: f64,
    /// Relative error of the forces on indenter and base: of the load, at a given height of all repulsion and attraction.
    pub balance: f64,
    /// Decrease of energy that the harmonic crystal predicts, over the energy of the wall.
    pub energy: f64,
    pub evaluations: usize,
}

/// The state at which a relaxation ended.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Relaxed {
    pub converged: bool,
    pub evaluations: usize,
    pub rejected: usize,
    /// Of these, states with forces that no crystal has.
    pub beyond_crystal: usize,
    /// Decrease of energy that the harmonic crystal predicts from there, the indenter at rest, eV.
    pub predicted_decrease: f64,
    pub largest_force: f64,
    pub load_error: f64,
    pub base_error: f64,
}

impl Relaxed {
    /// Whether the load is about that which was asked for.
    pub(crate) fn is_near(&self) -> bool {
        self.load_error.abs() <= NEAR
    }
}

impl std::fmt::Display for Relaxed {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let Relaxed { evaluations, largest_force, load_error, base_error, predicted_decrease, .. } = self;
        write!(
            f,
            "{evaluations} evaluations, largest force {largest_force:.1e} eV/Å, errors of the forces on indenter and base {load_error:.1e} and \
             {base_error:.1e}, predicted decrease {predicted_decrease:.1e} eV"
        )
    }
}

/// The model of a block at one state of strain.
pub(crate) struct Relaxation<T: Real> {
    crystal: HarmonicBlock<T>,
    wall: RigidWall,
    /// Lowest layers on which the wall does not act.
    without_wall: usize,
    /// By layer from the lowest: indices of its atoms on the grid of half lattice constants.
    indices: Vec<Vec<usize>>,
    per_layer: usize,
    points: usize,
    /// Pairs that are kept.
    memory: usize,
    /// Largest force on an atom of a crystal, eV/Å: states with larger ones are not those of one. (A load on 98 nm at which the crystal yields: an
    /// elastic step presses the indenter through it, and the energy may fall.)
    force_limit: f64,
}

/// An evaluated state.
struct State<T> {
    /// Energy with the work of the load.
    energy: f64,
    /// Sum of the magnitudes of the wall's energies of atoms: repulsion and adhesion may cancel in the total.
    wall_energy: f64,
    lift: f64,
    positions: Vec<[f64; 3]>,
    /// Of the wall on the surface layers.
    wall_forces: Vec<[f64; 3]>,
    /// Force of atoms below these layers on the indenter.
    deep_load: f64,
    residual: Amplitudes<T>,
    response: Amplitudes<T>,
    /// Of the residual on the kept pairs.
    projections: Vec<[f64; 2]>,
    status: Relaxed,
}

impl<T: Real> Relaxation<T> {
    /// `indices` of the free layers from the lowest, on `cells` × `cells` lattice constants; the wall does not act on the lowest `without_wall`.
    pub(crate) fn new(
        crystal: HarmonicBlock<T>,
        indices: Vec<Vec<usize>>,
        cells: usize,
        (wall, without_wall): (RigidWall, usize),
        (memory, force_limit): (usize, f64),
    ) -> Self {
        let per_layer = indices.first().map_or(0, Vec::len);
        Relaxation { crystal, wall, without_wall, indices, per_layer, points: 4 * cells * cells, memory, force_limit }
    }

    fn surface_layers(&self) -> usize {
        SURFACE_LAYERS.min(self.crystal.layers())
    }

    /// Layers of the surface problem.
    fn surface(&self) -> std::ops::Range<usize> {
        self.crystal.layers() - self.surface_layers()..self.crystal.layers()
    }

    /// Atoms below these.
    fn deep_atoms(&self) -> usize {
        self.surface().start * self.per_layer
    }

    /// Relaxes from the state in which `forces` is, and leaves it in the state that is returned.
    ///
    /// # Errors
    /// Those of `forces`.
    pub(crate) fn relax(
        &self,
        forces: &mut dyn ForceField,
        control: Control,
        criteria: Criteria,
    ) -> Result<Relaxed, String> {
        let free = self.indices.len() * self.per_layer;
        let Some(first) = forces.evaluate(&vec![[0.0; 3]; free], 0.0)? else { return Ok(Relaxed::default()) };
        let mut state = self.state(first, 0.0, control, criteria);
        state.status.evaluations = 1;
        let mut pairs = Pairs::new(self.memory);
        let (mut hard, mut lowest) = (0, (state.status.predicted_decrease, 1));
        while !state.status.converged {
            let status = state.status;
            // A new load alone leaves no residual force in the crystal.
            if status.predicted_decrease < 0.5 * lowest.0 || status.evaluations <= 2 {
                lowest = (status.predicted_decrease, status.evaluations);
            }
            let stalled = status.evaluations > lowest.1 + PATIENCE || hard >= HARD.1;
            let yields = status.beyond_crystal >= YIELDING && !status.is_near();
            if stalled || yields || !status.predicted_decrease.is_finite() || status.evaluations >= criteria.evaluations
            {
                break;
            }
            let trials = self.iterate(forces, &mut state, &mut pairs, (control, criteria))?;
            hard = if trials > HARD.0 { hard + 1 } else { 0 };
        }
        Ok(state.status)
    }

    /// One iteration: moves `state` to a state of lower energy. Returns the number of trials; the state is unchanged where none succeeds.
    fn iterate(
        &self,
        forces: &mut dyn ForceField,
        state: &mut State<T>,
        pairs: &mut Pairs<T>,
        (control, criteria): (Control, Criteria),
    ) -> Result<usize, String> {
        let status = state.status;
        let tolerance = match status.evaluations {
            1 => CONTACT_TOLERANCE[1],
            _ => CONTACT_TOLERANCE[0].max(CONTACT_TOLERANCE[2] * status.largest_force.min(CONTACT_TOLERANCE[3])),
        };
        let mut step = self.step(state, pairs, control, tolerance);
        let mut factor = step.within(self.per_layer, LONGEST_STEP);
        let (mut applied, mut raised) = (vec![[0.0; 3]; step.displacements.len()], 0.0);
        for trial in 1..=TRIALS {
            let increments = step.displacements.iter().zip(&applied);
            let increments: Vec<[f64; 3]> =
                increments.map(|(d, a)| std::array::from_fn(|c| factor * d[c] - a[c])).collect();
            let lift = factor * step.lift;
            let Some(evaluation) = forces.evaluate(&increments, lift - raised)? else {
                factor *= SHORTER;
                continue;
            };
            applied.iter_mut().zip(&increments).for_each(|(a, i)| (0..3).for_each(|c| a[c] += i[c]));
            raised = lift;
            let mut reached = self.state(evaluation, state.lift + lift, control, criteria);
            let rounding =
                ROUNDING[0] * (state.wall_energy + control.load().abs()).max(1.0) + ROUNDING[1] * state.energy.abs();
            // `f64::max` skips what is no number; the predicted decrease does not.
            let crystalline = reached.status.predicted_decrease.is_finite()
                && reached.status.largest_force <= self.force_limit.max(status.largest_force);
            let fell = crystalline && reached.energy <= state.energy + rounding;
            state.status.evaluations += 1;
            state.status.rejected += usize::from(!fell);
            reached.status.evaluations = state.status.evaluations;
            state.status.beyond_crystal += usize::from(!crystalline);
            reached.status.rejected = state.status.rejected;
            reached.status.beyond_crystal = state.status.beyond_crystal;
            if fell && reached.status.converged {
                *state = reached;
                return Ok(trial);
            }
            let learnt = crystalline && self.learn(pairs, state, &mut reached, &step, factor);
            if fell {
                *state = reached;
                return Ok(trial);
            }
            if learnt && trial == 1 {
                // The trial has taught the curvature: a new step from the old state.
                step = self.step(state, pairs, control, tolerance);
                factor = step.within(self.per_layer, LONGEST_STEP);
            } else {
                factor *= SHORTER;
            }
        }
        let back: Vec<[f64; 3]> = applied.iter().map(|a| a.map(|a| -a)).collect();
        if forces.evaluate(&back, -raised)?.is_none() {
            return Err("atoms outside of the box after a step back".into());
        }
        state.status.evaluations += 1;
        Ok(TRIALS + 1)
    }

    /// The model's parts of an evaluated state.
    fn state(&self, evaluation: Evaluation, lift: f64, control: Control, criteria: Criteria) -> State<T> {
        let touched = evaluation.positions.par_iter().enumerate().skip(self.without_wall * self.per_layer);
        let touched: Vec<_> = touched.filter_map(|(k, x)| Some((k, self.wall.action(*x, lift)?))).collect();
        let wall_energy: f64 = touched.iter().map(|(_, a)| a.energy.abs()).sum();
        let (mut deep_load, mut wall_forces) = (0.0, vec![[0.0; 3]; evaluation.positions.len() - self.deep_atoms()]);
        for (k, action) in &touched {
            match k.checked_sub(self.deep_atoms()) {
                Some(k) => wall_forces[k] = action.force,
                None => deep_load -= action.force[2],
            }
        }
        let square = |f: &[f64; 3]| f.iter().map(|c| c * c).sum::<f64>();
        let largest_force = evaluation.forces.par_iter().map(square).reduce(|| 0.0, f64::max).sqrt();
        let load = control.load();
        let pressing: f64 = touched.iter().map(|(_, a)| a.force[2].abs()).sum();
        let over = |error: f64, whole: f64| if whole > 0.0 { error / whole } else { 0.0 };
        let (load_error, base_error) = match control {
            Control::Load(load) => (over(evaluation.on_indenter - load, load), over(evaluation.on_base + load, load)),
            Control::Height => (0.0, over(evaluation.on_base + evaluation.on_indenter, pressing.max(SMALLEST_FORCE))),
        };
        let residual = self.analyse(0..self.indices.len(), &evaluation.forces);
        let mut response = residual.clone();
        let predicted_decrease = self.crystal.eliminate(&mut response);
        self.crystal.substitute(&mut response);
        let converged = largest_force <= criteria.force
            && load_error.abs().max(base_error.abs()) <= criteria.balance
            && predicted_decrease <= criteria.energy * wall_energy.max(SMALLEST_WALL_ENERGY);
        State {
            energy: evaluation.energy + load * lift,
            wall_energy,
            lift,
            positions: evaluation.positions[self.deep_atoms()..].to_vec(),
            wall_forces,
            deep_load,
            residual,
            response,
            projections: Vec::new(),
            status: Relaxed {
                converged,
                predicted_decrease,
                largest_force,
                load_error,
                base_error,
                ..Relaxed::default()
            },
        }
    }

    /// Amplitudes of the vectors of the atoms of some layers.
    fn analyse(&self, layers: std::ops::Range<usize>, vectors: &[[f64; 3]]) -> Amplitudes<T> {
        let first = layers.start;
        let fill = |layer: usize, c: usize, grid: &mut [T]| {
            let own = &vectors[(layer - first) * self.per_layer..][..self.per_layer];
            self.indices[layer].iter().zip(own).for_each(|(i, v)| grid[*i] = T::of(v[c]));
        };
        self.crystal.analyse(layers, fill)
    }

    /// Vectors of the atoms of some layers.
    fn synthesise(&self, layers: std::ops::Range<usize>, from: &Amplitudes<T>) -> Vec<[f64; 3]> {
        let read =
            |layer: usize, _: usize, grid: &[T]| -> Vec<T> { self.indices[layer].iter().map(|i| grid[*i]).collect() };
        let parts = self.crystal.synthesise(from, layers, read);
        let vectors =
            parts.chunks(3).flat_map(|xyz| (0..self.per_layer).map(move |k| std::array::from_fn(|c| xyz[c][k].wide())));
        vectors.collect()
    }

    /// The step to the minimum of the model.
    fn step(&self, state: &State<T>, pairs: &Pairs<T>, control: Control, tolerance: f64) -> Step<T> {
        let mut start = self.synthesise(self.surface(), &state.response);
        start.iter_mut().zip(&state.positions).for_each(|(a, x)| (0..3).for_each(|c| a[c] += x[c]));
        pairs.add_surface(&pairs.coefficients(&state.projections), &mut start);
        let response = SurfaceResponse::new(&self.crystal, self.surface_layers());
        let mut problem = SurfaceProblem::new(response, pairs, &self.wall, &self.indices[self.surface()], self.points);
        let control = control.less(state.deep_load);
        let SurfaceStep { excess, lift } = problem.solve(&start, &state.wall_forces, state.lift, control, tolerance);
        // These forces are within the highest group: there is nothing to eliminate below.
        let mut amplitudes = self.analyse(self.surface(), &excess);
        self.crystal.substitute(&mut amplitudes);
        let projections = state.projections.iter().zip(pairs.project_surface(&excess));
        let projections: Vec<[f64; 2]> = projections.map(|(a, b)| [a[0] + b[0], a[1] + b[1]]).collect();
        amplitudes.add(&[1.0], std::iter::once(&state.response));
        pairs.add(&pairs.coefficients(&projections), &mut amplitudes);
        let displacements = self.synthesise(0..self.indices.len(), &amplitudes);
        Step { amplitudes, displacements, lift: lift - state.lift }
    }

    /// Learns the change of the crystal's forces between two states; whether the pair is used.
    fn learn(&self, pairs: &mut Pairs<T>, from: &mut State<T>, to: &mut State<T>, step: &Step<T>, factor: f64) -> bool {
        let change = from.wall_forces.iter().zip(&to.wall_forces);
        let change: Vec<[f64; 3]> = change.map(|(a, b)| std::array::from_fn(|c| a[c] - b[c])).collect();
        let mut wall = self.analyse(self.surface(), &change);
        self.crystal.substitute(&mut wall);
        let response = from.response.less(&to.response, &wall);
        let scaled = |v: &[f64; 3]| v.map(|v| factor * v);
        let pair = Pair {
            displacement: step.amplitudes.scaled(factor),
            displacement_surface: step.displacements[self.deep_atoms()..].iter().map(scaled).collect(),
            response_surface: self.synthesise(self.surface(), &response),
            response,
        };
        // The change of the crystal's forces is that of the residual but for the wall's.
        let less = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| [a[0] - b[0] - c[0], a[1] - b[1] - c[1]];
        let [own_from, own_to] = [&from.residual, &to.residual].map(|residual| {
            let own = self.crystal.products([&pair.displacement, &pair.response].into_iter(), residual);
            [own[0], own[1]]
        });
        let own = less(own_from, own_to, pair.project_surface(&change));
        let accepted = pairs.accepts(own);
        if accepted && pairs.make_room() {
            from.projections.remove(0);
        }
        to.projections = pairs.project(&self.crystal, &to.residual);
        if accepted {
            let projections = from.projections.iter().zip(&to.projections).zip(pairs.project_surface(&change));
            let mut products: Vec<[f64; 2]> = projections.map(|((a, b), c)| less(*a, *b, c)).collect();
            products.push(own);
            pairs.push(pair, &products);
            from.projections.push(own_from);
            to.projections.push(own_to);
        }
        accepted
    }
}

/// A step of all free atoms and of the indenter.
struct Step<T> {
    amplitudes: Amplitudes<T>,
    displacements: Vec<[f64; 3]>,
    lift: f64,
}

impl<T> Step<T> {
    /// The factor, at most 1, with which no relative motion is larger than `largest`.
    fn within(&self, per_layer: usize, largest: f64) -> f64 {
        let motion = relative_motion(&self.displacements, per_layer, self.lift);
        if motion > largest { largest / motion } else { 1.0 }
    }
}

impl Control {
    /// 0 at a given height.
    fn load(self) -> f64 {
        if let Control::Load(load) = self { load } else { 0.0 }
    }

    /// Without a part of the load that other atoms carry.
    fn less(self, part: f64) -> Control {
        match self {
            Control::Load(load) => Control::Load(load - part),
            Control::Height => Control::Height,
        }
    }
}

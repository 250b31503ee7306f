//! Relaxations of a block of springs, whose forces need no LAMMPS.

use super::*;
use crate::interaction::Interaction;
use asperity_contact::interface::{Bond, LatticeConstants, LayerBase};

const CELLS: usize = 4;
const LAYERS: usize = 6;
/// Lattice constant, Å.
const A0: f64 = 5.6;
/// Springs between nearest neighbours, equal in all directions: eV/Å², and eV/Å⁴ of the fourth power of their length.
const SPRING: f64 = 0.4;
const HARDENING: f64 = 0.2;
const LOAD: f64 = 3.0;
const CRITERIA: Criteria = Criteria { force: 1e-4, balance: 1e-3, energy: 1e-5, evaluations: 60 };
/// A load of a block without defects.
const FEW: usize = 12;

/// In-plane offsets, half lattice constants, and layers of the twelve nearest neighbours.
fn neighbours() -> impl Iterator<Item = [i32; 3]> {
    let signs = || [-1, 1].into_iter().flat_map(|s| [-1, 1].map(|t| [s, t]));
    signs().flat_map(|[s, t]| [[s, t, 0], [s, 0, t], [0, s, t]])
}

fn bonds(exists: impl Fn(i32) -> bool) -> Vec<Bond> {
    let times = |k: f64| std::array::from_fn(|i| std::array::from_fn(|j| if i == j { k } else { 0.0 }));
    let bond = |[dx, dy, layer]: [i32; 3], k| Bond { layer, dx, dy, phi: times(k) };
    let mut list: Vec<Bond> = neighbours().filter(|r| exists(r[2])).map(|r| bond(r, -SPRING)).collect();
    list.push(bond([0; 3], SPRING * list.len() as f64));
    list
}

fn crystal() -> HarmonicBlock<f32> {
    let cut = |l: i32| {
        let moved = bonds(|d| l + d >= 0).into_iter().map(|b| Bond { layer: l + b.layer, ..b });
        moved.filter(|b| b.layer < 2).collect()
    };
    let constants =
        LatticeConstants { reach: 2, bulk: bonds(|_| true), cut: vec![cut(0), cut(1)], cut_force: vec![0.0; 2] };
    HarmonicBlock::new(CELLS, LAYERS, &constants, LayerBase::Rigid).expect("stable")
}

/// Indices of the atoms of a layer on the grid of half lattice constants.
fn layer(l: usize) -> Vec<usize> {
    (0..4 * CELLS * CELLS).filter(|k| (k % (2 * CELLS) + k / (2 * CELLS) + l).is_multiple_of(2)).collect()
}

/// An indenter with one asperity.
fn wall() -> RigidWall {
    let points = 8;
    let spacing = CELLS as f64 * A0 / points as f64;
    let height = |k: usize| {
        let wave = |i: usize| (std::f64::consts::TAU * i as f64 / points as f64).cos();
        0.5 * (LAYERS - 1) as f64 * A0 + 4.9 - 0.4 * (wave(k % points) + wave(k / points))
    };
    let repulsion = Interaction { epsilon_ev: 0.2, sigma_angstrom: 3.6, adhesion: None };
    RigidWall::new(points, spacing, repulsion, (0..points * points).map(height).collect())
}

fn relaxation(force_limit: f64) -> Relaxation<f32> {
    keeping(30, force_limit)
}

fn keeping(pairs: usize, force_limit: f64) -> Relaxation<f32> {
    let indices = (0..LAYERS).map(layer).collect();
    Relaxation::new(crystal(), indices, CELLS, (wall(), 0), (pairs, force_limit))
}

/// The block, its present state, and what it does to a state before it is returned.
struct Springs<'a> {
    wall: RigidWall,
    sites: Vec<[f64; 3]>,
    positions: Vec<[f64; 3]>,
    lift: f64,
    /// Pairs of atoms; one at rest below the block is `None`.
    springs: Vec<(usize, Option<usize>)>,
    spoil: &'a dyn Fn(f64, Evaluation) -> Option<Evaluation>,
}

impl<'a> Springs<'a> {
    fn new(spoil: &'a dyn Fn(f64, Evaluation) -> Option<Evaluation>) -> Self {
        let across = 2 * CELLS as i32;
        let all: Vec<[i32; 3]> = (0..LAYERS)
            .flat_map(|l| layer(l).into_iter().map(move |k| [k as i32 % across, k as i32 / across, l as i32]))
            .collect();
        let find = |[x, y, l]: [i32; 3]| all.iter().position(|s| *s == [x.rem_euclid(across), y.rem_euclid(across), l]);
        let mut springs = Vec::new();
        for (k, s) in all.iter().enumerate() {
            for r in neighbours().map(|r| std::array::from_fn(|c| s[c] + r[c])) {
                match find(r) {
                    Some(other) if other > k => springs.push((k, Some(other))),
                    None if r[2] < 0 => springs.push((k, None)),
                    _ => {}
                }
            }
        }
        let sites: Vec<[f64; 3]> = all.iter().map(|s| s.map(|c| 0.5 * A0 * f64::from(c))).collect();
        Springs { wall: wall(), positions: sites.clone(), sites, lift: 0.0, springs, spoil }
    }

    fn displacement(&self, atom: usize) -> [f64; 3] {
        std::array::from_fn(|c| self.positions[atom][c] - self.sites[atom][c])
    }
}

impl ForceField for Springs<'_> {
    fn evaluate(&mut self, displacements: &[[f64; 3]], lift: f64) -> Result<Option<Evaluation>, String> {
        let before = (self.positions.clone(), self.lift);
        self.positions.iter_mut().zip(displacements).for_each(|(x, d)| (0..3).for_each(|c| x[c] += d[c]));
        self.lift += lift;
        let mut evaluation = Evaluation { positions: self.positions.clone(), ..Evaluation::default() };
        evaluation.forces = vec![[0.0; 3]; self.positions.len()];
        for (k, x) in self.positions.iter().enumerate() {
            let Some(action) = self.wall.action(*x, self.lift) else { continue };
            evaluation.energy += action.energy;
            evaluation.on_indenter -= action.force[2];
            evaluation.forces[k] = action.force;
        }
        for (k, other) in &self.springs {
            let (a, b) = (self.displacement(*k), other.map_or([0.0; 3], |o| self.displacement(o)));
            let d: [f64; 3] = std::array::from_fn(|c| a[c] - b[c]);
            let square: f64 = d.iter().map(|c| c * c).sum();
            evaluation.energy += 0.5 * SPRING * square + 0.25 * HARDENING * square * square;
            let force = d.map(|c| (SPRING + HARDENING * square) * c);
            (0..3).for_each(|c| evaluation.forces[*k][c] -= force[c]);
            match other {
                Some(o) => (0..3).for_each(|c| evaluation.forces[*o][c] += force[c]),
                None => evaluation.on_base += force[2],
            }
        }
        let spoilt = (self.spoil)(self.lift, evaluation);
        if spoilt.is_none() {
            (self.positions, self.lift) = before;
        }
        Ok(spoilt)
    }
}

/// The block, relaxed under a load.
fn relaxed(
    spoil: &dyn Fn(f64, Evaluation) -> Option<Evaluation>,
    control: Control,
    force_limit: f64,
) -> (Relaxed, Vec<[f64; 3]>, f64) {
    let mut springs = Springs::new(spoil);
    let relaxed = relaxation(force_limit).relax(&mut springs, control, CRITERIA).expect("no error");
    (relaxed, springs.positions, springs.lift)
}

fn as_it_is(_: f64, evaluation: Evaluation) -> Option<Evaluation> {
    Some(evaluation)
}

#[test]
fn a_load_takes_few_evaluations_and_its_height_has_the_same_state() {
    let (loaded, positions, lift) = relaxed(&as_it_is, Control::Load(LOAD), 5.0);
    assert!(loaded.converged && loaded.evaluations <= FEW && loaded.rejected == 0, "{loaded:?}");
    let mut springs = Springs::new(&as_it_is);
    springs.lift = lift;
    let held = relaxation(50.0).relax(&mut springs, Control::Height, CRITERIA).expect("no error");
    // The block at rest overlaps with it.
    assert!(held.converged && held.evaluations <= 2 * FEW, "{held:?}");
    let apart = positions.iter().zip(&springs.positions).flat_map(|(a, b)| [0, 1, 2].map(|c| (a[c] - b[c]).abs()));
    // The forces that are left, over the stiffness of the block.
    let largest = apart.fold(0.0, f64::max);
    assert!(largest < 1e-3, "{largest} Å");
}

/// Of projections that are differences, in f32, relative to the largest.
const ROUNDING: f64 = 1e-4;

/// After every iteration the projections of the state are those of its residual on the pairs that are kept, of which the oldest is dropped.
#[test]
fn projections_follow_the_pairs() {
    let mut springs = Springs::new(&as_it_is);
    let relaxation = keeping(2, 50.0);
    let control = Control::Load(20.0 * LOAD);
    let first = springs.evaluate(&vec![[0.0; 3]; springs.sites.len()], 0.0).expect("no error").expect("a state");
    let mut state = relaxation.state(first, 0.0, control, CRITERIA);
    let (mut pairs, mut kept) = (Pairs::new(2), Vec::new());
    for _ in 0..FEW {
        relaxation.iterate(&mut springs, &mut state, &mut pairs, (control, CRITERIA)).expect("no error");
        kept.push(state.projections.len());
        if state.status.converged {
            break;
        }
        let exact = pairs.project(&relaxation.crystal, &state.residual);
        assert_eq!(exact.len(), state.projections.len());
        let largest = exact.as_flattened().iter().fold(0.0f64, |m, p| m.max(p.abs()));
        for (a, b) in exact.as_flattened().iter().zip(state.projections.as_flattened()) {
            assert!((a - b).abs() <= ROUNDING * largest, "{a} {b}");
        }
    }
    assert!(kept.len() > 4 && kept.ends_with(&[2, 2]), "{kept:?}");
}

/// The lowest layers feel no wall: the model's load on the indenter is that of the others.
#[test]
fn layers_without_the_wall_have_none_of_its_forces() {
    let mut springs = Springs::new(&as_it_is);
    let evaluation = springs.evaluate(&vec![[0.0; 3]; springs.sites.len()], -6.0).expect("no error").expect("a state");
    let all = relaxation(50.0);
    let (indices, without) = ((0..LAYERS).map(layer).collect(), LAYERS - SURFACE_LAYERS);
    let some = Relaxation::new(crystal(), indices, CELLS, (wall(), without), (30, 50.0));
    let [all, some] = [&all, &some].map(|r| r.state(evaluation.clone(), -6.0, Control::Height, CRITERIA));
    assert!(all.deep_load > 0.0 && some.deep_load == 0.0 && some.wall_energy < all.wall_energy);
    assert_eq!(all.wall_forces, some.wall_forces);
}

/// Forces that are no numbers, and atoms that would leave the box, beyond some height of the indenter.
#[test]
fn states_that_cannot_be_are_left_on_shorter_steps() {
    let (_, positions, lift) = relaxed(&as_it_is, Control::Load(LOAD), 5.0);
    let beyond = |z: f64| z < lift - 0.02;
    let nan = |z: f64, mut e: Evaluation| {
        if beyond(z) {
            (e.energy, e.forces[0][0]) = (f64::NAN, f64::NAN);
        }
        Some(e)
    };
    let lone_nan = |z: f64, mut e: Evaluation| {
        if beyond(z) {
            (e.energy, e.forces[0][0]) = (-1e9, f64::NAN);
        }
        Some(e)
    };
    let outside = |z: f64, e: Evaluation| (!beyond(z)).then_some(e);
    for spoil in [&nan as &dyn Fn(f64, Evaluation) -> Option<Evaluation>, &lone_nan, &outside] {
        let (found, actual, _) = relaxed(spoil, Control::Load(LOAD), 5.0);
        assert!(found.converged, "{found:?}");
        let apart = positions.iter().zip(&actual).map(|(a, b)| (a[2] - b[2]).abs()).fold(0.0, f64::max);
        assert!(apart < 1e-3, "{apart} Å");
    }
}

/// Energies that rise whatever is tried: the block stays where it was.
#[test]
fn a_block_that_the_model_does_not_describe_is_left_as_it_was() {
    let worse = std::cell::Cell::new(0.0);
    let rising = |_: f64, mut e: Evaluation| {
        worse.set(worse.get() + 1.0);
        e.energy = worse.get();
        Some(e)
    };
    let mut springs = Springs::new(&rising);
    springs.lift = -0.5;
    let before = (springs.positions.clone(), springs.lift);
    let found = relaxation(5.0).relax(&mut springs, Control::Height, CRITERIA).expect("no error");
    assert!(!found.converged && found.rejected == HARD.1 * TRIALS, "{found:?}");
    let moved = before.0.iter().zip(&springs.positions).flat_map(|(a, b)| [0, 1, 2].map(|c| (a[c] - b[c]).abs()));
    assert!(moved.fold((before.1 - springs.lift).abs(), f64::max) < 1e-12);
}

/// No state with forces beyond those of a crystal is taken, and few are tried.
#[test]
fn a_load_under_which_the_crystal_yields_ends_early() {
    let (found, _, _) = relaxed(&as_it_is, Control::Load(400.0 * LOAD), 0.3);
    assert!(!found.converged && !found.is_near(), "{found:?}");
    assert!(found.beyond_crystal >= YIELDING && found.evaluations <= FEW && found.largest_force <= 0.3, "{found:?}");
}

#[test]
fn a_first_state_without_numbers_ends_at_once() {
    let nan = |_: f64, mut e: Evaluation| {
        e.forces[3][1] = f64::NAN;
        Some(e)
    };
    let (found, _, _) = relaxed(&nan, Control::Load(LOAD), 5.0);
    assert!(!found.converged && found.evaluations == 1, "{found:?}");
}

//! Plastic flow of a load history: where the contact stress reaches the hardness, the surface of the body is displaced
//! for good. The next load starts from the displaced surface, so that unloading is elastic and reloading follows it.

use super::residuals::Residuals;
use super::{CoarseState, Iteration, Observer, Problem, SnapshotRef};
use crate::grid::{Field, Real, mean};
use crate::interface::Law;
use crate::observe::Plasticity;
use std::ops::ControlFlow;

/// Plastic displacement `[ny, nx]` of the finished loads, L.
#[derive(Debug, Default)]
pub(super) struct PlasticFlow<T> {
    /// Empty before the first flow.
    displacement: Vec<T>,
}

impl<T: Real> PlasticFlow<T> {
    /// `None` before the first flow.
    pub(super) fn lend(&self) -> Option<Field<'_>> {
        (!self.displacement.is_empty()).then(|| T::lend(&self.displacement))
    }

    /// Bytes of the displacement, of the displaced heights, and of the nodes in f64 from which they are made; 0 without a
    /// hardness.
    pub(super) fn bytes(problem: &Problem) -> u64 {
        let each = 2 * problem.precision.bytes() + size_of::<f64>() as u64;
        if problem.hardness.is_some() { each * problem.grid.points() as u64 } else { 0 }
    }

    pub(super) fn set(&mut self, displacement: &[f64]) {
        self.displacement = displacement.iter().map(|&d| T::of(d)).collect();
    }

    /// Mean plastic displacement, L.
    pub(super) fn mean(&self) -> f64 {
        if self.displacement.is_empty() { 0.0 } else { mean(&self.displacement) }
    }

    /// Heights `[ny, nx]` of the displaced surface, L; `None` before the first flow.
    pub(super) fn heights(&self, problem: &Problem) -> Option<Vec<f64>> {
        if self.displacement.is_empty() {
            return None;
        }
        let mut nodes = problem.heights.on_nodes(problem.grid).into_owned();
        nodes.iter_mut().zip(&self.displacement).for_each(|(h, d)| *h += d.wide());
        Some(nodes)
    }

    /// Moves the flow of a load from its gap, of which the first `width` of `nx` nodes per row face the surface, to the
    /// plastic displacement, and its energy from the interaction. The flow of a state that has not `converged` is dropped:
    /// it is part of no history. `None` without a hardness.
    pub(super) fn take<L: Law>(
        &mut self,
        law: &L,
        gap: &mut [T],
        ([width, nx, points], converged): ([usize; 3], bool),
        residuals: &mut Residuals,
    ) -> Option<Plasticity> {
        let (stress, first) = (law.max_pressure(), T::of(law.yield_gap()));
        if stress == f64::INFINITY {
            return None;
        }
        let mut flowing = 0_usize;
        residuals.interaction -= stress * residuals.flow;
        if residuals.flow > 0.0 && converged {
            self.displacement.resize(points, T::zero());
        }
        for (y, gap) in gap.chunks_mut(nx).take(points / width).enumerate() {
            for (x, g) in gap[..width].iter_mut().enumerate() {
                if *g < first {
                    flowing += 1;
                    if converged {
                        self.displacement[y * width + x] += first - *g;
                    }
                }
                // A zero with a negative sign, too.
                *g = if *g <= first { first } else { *g };
            }
        }
        let displaced = self.displacement.iter().filter(|d| **d > T::zero()).count();
        let displacement = self.mean();
        Some(Plasticity {
            flowing: flowing as f64 / points as f64,
            displaced: displaced as f64 / points as f64,
            displacement,
            work: stress * displacement,
        })
    }
}

/// Adds the plastic displacement of the loads before to the snapshots of a solve.
pub(super) struct WithPlastic<'a> {
    pub observer: &'a dyn Observer,
    pub plastic: Option<Field<'a>>,
}

impl Observer for WithPlastic<'_> {
    fn iteration(&self, step: Iteration) -> ControlFlow<()> {
        self.observer.iteration(step)
    }

    fn stop_requested(&self) -> bool {
        self.observer.stop_requested()
    }

    fn coarse_grid_done(&self, state: CoarseState) {
        self.observer.coarse_grid_done(state);
    }

    fn snapshot_due(&self) -> bool {
        self.observer.snapshot_due()
    }

    fn snapshot(&self, snapshot: SnapshotRef) {
        self.observer.snapshot(SnapshotRef { plastic: self.plastic, ..snapshot });
    }
}

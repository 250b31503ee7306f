//! Plastic flow of a load history: where the contact stress reaches the hardness, the surface of the body is displaced
//! for good. The next load starts from the displaced surface, so that unloading is elastic and reloading follows it.

use super::residuals::Residuals;
use super::{CoarseState, Iteration, Observer, ReducedProblem, SnapshotRef};
use crate::interface::{HardnessMap, Law};
use crate::observe::Plasticity;
use asperity_grid::{Field, Real, mean};
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
        self.has_begun().then(|| T::lend(&self.displacement))
    }

    /// Bytes of the displacement and of a map's restrictions; 0 without a hardness.
    pub(super) fn bytes(problem: &ReducedProblem) -> u64 {
        let Some(hardness) = problem.hardness else { return 0 };
        let points = problem.grid.points();
        let restrictions = hardness.map().map_or(0, |_| HardnessMap::restriction_bytes(points));
        problem.precision.bytes() * points as u64 + restrictions
    }

    /// Bytes of the displaced heights on nodes: in working precision, or in f64 while they are made from a series.
    pub(super) fn nodes_bytes(problem: &ReducedProblem) -> u64 {
        let each = match (problem.hardness, problem.heights.series_bytes()) {
            (None, _) => 0,
            (Some(_), None) => problem.precision.bytes(),
            (Some(_), Some(_)) => 2 * size_of::<f64>() as u64,
        };
        each * problem.grid.points() as u64
    }

    pub(super) fn displacement(&self) -> &[T] {
        &self.displacement
    }

    pub(super) fn set(&mut self, displacement: &[f64]) {
        self.displacement = displacement.iter().map(|&d| T::of(d)).collect();
    }

    /// Mean plastic displacement, L.
    pub(super) fn mean(&self) -> f64 {
        if self.has_begun() { mean(&self.displacement) } else { 0.0 }
    }

    /// Whether there was any flow.
    pub(super) fn has_begun(&self) -> bool {
        !self.displacement.is_empty()
    }

    /// Height of node `i` of the displaced surface, L, of which `nodes` are the undeformed heights.
    #[inline]
    pub(super) fn height(&self, nodes: &[f64], i: usize) -> f64 {
        nodes[i] + self.displacement[i].wide()
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
        let (mean, first, hardness) = (law.max_pressure(), T::of(law.yield_gap()), law.hardness());
        if mean == f64::INFINITY {
            return None;
        }
        // The stress at which a node flows: its largest contact stress less the attraction.
        let stress = |i: usize| hardness.at(i) - law.traction(law.yield_gap());
        let (mut flowing, mut energy, is_map) = (0_usize, 0.0, hardness.map().is_some());
        if residuals.flow > 0.0 && converged {
            self.displacement.resize(points, T::zero());
        }
        for (y, gap) in gap.chunks_mut(nx).take(points / width).enumerate() {
            for (x, g) in gap[..width].iter_mut().enumerate() {
                if *g < first {
                    let (i, depth) = (y * width + x, first - *g);
                    flowing += 1;
                    energy += if is_map { stress(i) * depth.wide() } else { 0.0 };
                    if converged {
                        self.displacement[i] += depth;
                    }
                }
                // A zero with a negative sign, too.
                *g = if *g <= first { first } else { *g };
            }
        }
        residuals.interaction -= if is_map { energy / points as f64 } else { mean * residuals.flow };
        let displaced = self.displacement.iter().filter(|d| **d > T::zero()).count();
        let displacement = self.mean();
        let work = match is_map {
            true => {
                self.displacement.iter().enumerate().map(|(i, d)| stress(i) * d.wide()).sum::<f64>() / points as f64
            }
            false => mean * displacement,
        };
        Some(Plasticity {
            flowing: flowing as f64 / points as f64,
            displaced: displaced as f64 / points as f64,
            displacement,
            work,
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

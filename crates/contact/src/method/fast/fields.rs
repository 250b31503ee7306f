//! Arrays of a level and the sweeps over them: the part of the iteration that depends on where the arrays are.

use crate::method::Precision;
use crate::method::residuals::KKT;
use asperity_grid::{Grid, Real};

/// Multiplication of a spectrum of the linear problem.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Metric {
    /// `K`, with this stiffness of the mean mode.
    Stiffness { mean_stiffness: f64 },
    /// `K⁻¹`, with this stiffness of the mean mode.
    Compliance { mean_stiffness: f64 },
}

/// Spring that controls the mean gap; zero stiffness under load control.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Spring {
    pub stiffness: f64,
    pub target: f64,
}

/// Sums over a state: those of [`rows::trial`](super::rows::trial), and the elastic energy per area of the cell.
pub(super) type StateSums = (f64, [f64; KKT + 1]);

/// Gap, step, gradient and direction on the nodes of a grid, and their sweeps. `pending` is the multiple of the step
/// that a sweep adds to the gap first, stopped by the wall. Energies and products of spectra are means over the cell,
/// other sums are over its nodes. On several ranks, fields and spectra have the rows of this one, sums those of all.
pub(super) trait LevelFields<T: Real> {
    fn grid(&self) -> Grid;

    /// Gap `[ny, nx]`, units of L.
    fn gap(&mut self) -> &[T];

    /// The gap to be changed.
    fn gap_mut(&mut self) -> &mut Vec<T>;

    /// The gap without the other arrays.
    fn into_gap(self: Box<Self>) -> Vec<T>;

    /// Whether the device failed: nothing that was returned since then is a result.
    fn has_failed(&self) -> bool {
        false
    }

    /// Allocates the working arrays: all but the gap.
    fn allocate(&mut self);

    /// Whether trials in f32 are faster where the state has another precision.
    fn tries_in_f32(&self) -> bool {
        true
    }

    /// Adds the pending step to the gap.
    fn apply(&mut self, pending: f64);

    fn clear_step(&mut self);

    /// Sums of the state at the gap plus `scale` times the step under a pressure on every node, without changing the gap;
    /// its gradient replaces the last one. One transform pair, in `precision` if trials have it ([`LevelFields::tries_in_f32`]).
    fn trial(&mut self, scale: f64, pressure: f64, spring: Spring, precision: Precision) -> StateSums;

    /// Sets direction and step to `-t + β d` on the free nodes (steepest descent or conjugate gradients in the plain
    /// metric). Returns `Σ t d`, `Σ v'' d²` and `⟨d K d⟩`. Half a transform pair.
    fn plain(&mut self, pending: f64, beta: f64, spring: f64) -> ([f64; 2], f64);

    /// Sets the residual of the linear problem to `-t` on the free nodes; step and direction become zero. Returns `Σ r²`, and `Σ r c r` with
    /// the nodes' own compliance in the preconditioner of a soft wall.
    fn begin(&mut self, pending: f64) -> [f64; 2];

    /// Sets the gradient `t` to this value on all nodes.
    fn set_gradient(&mut self, value: f32);

    /// Multiplies the residual of [`LevelFields::begin`] or [`LevelFields::descend`], or the direction of [`LevelFields::conjugate`], and
    /// returns its product with the result, for the next of these. The transforms before and after it are parts of either.
    fn multiply(&mut self, metric: Metric) -> f64;

    /// Sets `d = z + β d` on the free nodes, with the preconditioned residual `z`. Returns `Σ v'' d²`.
    fn conjugate(&mut self, beta: f64) -> f64;

    /// Sets `x += α d` and `r -= α H d` on the free nodes, with `K d`. Returns the sums of [`LevelFields::begin`].
    fn descend(&mut self, alpha: f64) -> [f64; 2];

    /// Sets the step to the direction.
    fn step_along_direction(&mut self);

    /// Releases the working arrays. Returns the sums of the state under a pressure on every node, and the interfacial
    /// stress `p + K(g - h)`. One transform pair.
    fn stress(&mut self, pressure: f64, spring: Spring) -> (StateSums, Vec<T>);
}

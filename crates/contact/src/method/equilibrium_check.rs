//! The one place that declares a state converged. Solvers report that their criteria are met; the final fields and
//! the residuals evaluated on them decide.

use super::residuals::{LOAD_BALANCE, LOAD_SHARE};
use super::{Equilibrium, Estimator, Load, MethodEstimate, ReducedProblem, StartedMethod, Stop};
use crate::interface::NodalHardness;
use asperity_grid::Result;
use asperity_grid::sys::ranks::Ranks;
use asperity_grid::{CHUNK, Grid, Real, dot, sharing, sums_of_ranks, total, vectorised};
use rayon::prelude::*;

/// How an iteration ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// The solver's criteria are met.
    Met,
    Stopped(Stop),
}

/// Conditions of equilibrium of a solve.
#[derive(Debug, Clone, Copy)]
pub struct EquilibriumCheck<'m> {
    /// Gaps are not negative.
    pub hard: bool,
    /// Tractions act on open nodes, or the wall is compliant.
    pub law: bool,
    /// Tolerance of the residual over the stress scale.
    pub tolerance: f64,
    /// Relative residual due to rounding.
    pub floor: f64,
    /// rms height of the surface, L.
    pub rms_height: f64,
    /// Stress by which residuals are divided, E*.
    pub scale: f64,
    /// Largest contact stress, E*; infinite without a hardness.
    pub hardness: NodalHardness<'m>,
    pub grid: Grid,
    /// Whose rows the fields are.
    pub ranks: &'m Ranks,
}

/// Sums over the nodes of the final fields.
#[derive(Debug, Clone, Copy, PartialEq)]
struct FieldSums {
    gap: f64,
    gap_square: f64,
    stress: f64,
    /// Squares of the stress on open nodes, and of the tension and the excess over the hardness on closed ones.
    residual_square: f64,
    /// Stress times gap.
    work: f64,
    lowest_gap: f64,
}

/// Difference between the final evaluation and that of the last iteration: they add in another order.
const SLACK: f64 = 1.01;

impl FieldSums {
    /// Collective. Sums are those of rows, the same on any number of ranks.
    fn of<T: Real>(gap: &[T], stress: &[T], check: &EquilibriumCheck) -> Self {
        let EquilibriumCheck { ranks, grid, .. } = *check;
        let first = ranks.share(grid.ny).start;
        let rows: Vec<([f64; 5], f64)> = gap
            .par_chunks(grid.nx)
            .zip(stress.par_chunks(grid.nx))
            .enumerate()
            .map(|(row, (gap, stress))| {
                vectorised(
                    #[inline(always)]
                    || Self::of_row(gap, stress, check.hardness.from_node((first + row) * grid.nx)),
                )
            })
            .collect();
        let lowest_gap = ranks.lowest(rows.iter().map(|b| b.1).fold(f64::INFINITY, f64::min));
        let sums: Vec<[f64; 5]> = rows.into_iter().map(|b| b.0).collect();
        let [gap, gap_square, stress, residual_square, work] = sums_of_ranks(ranks, grid.ny, &sums);
        FieldSums { gap, gap_square, stress, residual_square, work, lowest_gap }
    }

    #[inline(always)]
    fn of_row<T: Real>(gap: &[T], stress: &[T], hardness: NodalHardness) -> ([f64; 5], f64) {
        let (mut sums, mut lowest) = ([0.0; 5], [f64::INFINITY; CHUNK]);
        for (k, (gap, stress)) in gap.chunks(CHUNK).zip(stress.chunks(CHUNK)).enumerate() {
            let (n, hardness) = (gap.len(), hardness.chunk(k * CHUNK));
            let (mut g, mut s, mut r, mut w) = ([0.0; CHUNK], [0.0; CHUNK], [0.0; CHUNK], [0.0; CHUNK]);
            g.iter_mut().zip(gap).for_each(|(to, v)| *to = v.wide());
            s.iter_mut().zip(stress).for_each(|(to, v)| *to = v.wide());
            for i in 0..CHUNK {
                let tension = if s[i] < 0.0 { s[i] } else { 0.0 };
                let excess = if s[i] > hardness[i] { s[i] - hardness[i] } else { 0.0 };
                r[i] = if g[i] > 0.0 { s[i] } else { tension + excess };
                w[i] = (s[i] * g[i]).abs();
            }
            for (l, g) in lowest.iter_mut().zip(&g[..n]) {
                *l = if *g < *l { *g } else { *l };
            }
            for (sum, part) in
                sums.iter_mut().zip([total(&g[..n]), dot(&g[..n], &g[..n]), total(&s[..n]), dot(&r, &r), total(&w)])
            {
                *sum += part;
            }
        }
        (sums, lowest.into_iter().fold(f64::INFINITY, f64::min))
    }
}

impl EquilibriumCheck<'_> {
    /// Tolerance of the load balance over the stress scale, and of an imposed mean gap over it.
    pub fn load_tolerance(tolerance: f64) -> f64 {
        LOAD_BALANCE.max(LOAD_SHARE * tolerance)
    }

    /// A tolerance plus the rounding of an evaluation, at most as large again.
    fn allowed(&self, tolerance: f64) -> f64 {
        SLACK * tolerance + self.floor.min(tolerance)
    }

    /// The stop reason of a state with these fields `[ny, nx]`: `Converged` if the solver's criteria are met and the
    /// state satisfies them. One pass over the fields.
    pub fn decide<T: Real>(&self, ending: Ending, state: &Equilibrium, gap: &[T], stress: &[T]) -> Stop {
        match ending {
            Ending::Stopped(stop) => stop,
            Ending::Met => self.verdict(state, &FieldSums::of(gap, stress, self), self.grid.points() as f64),
        }
    }

    fn verdict(&self, state: &Equilibrium, sums: &FieldSums, points: f64) -> Stop {
        let FieldSums { gap, gap_square, stress, residual_square, work, lowest_gap } = *sums;
        let numbers = [
            state.pressure,
            state.mean_gap,
            state.energy,
            state.residual,
            state.load_error,
            state.complementarity,
            gap,
            gap_square,
            stress,
            residual_square,
            work,
            lowest_gap,
        ];
        if numbers.iter().any(|v| !v.is_finite()) {
            return Stop::Diverged;
        }
        let residual_limit = self.allowed(self.tolerance);
        let load_limit = self.allowed(Self::load_tolerance(self.tolerance));
        let imposed = match state.load {
            Load::Pressure(p) => state.pressure == p,
            Load::MeanGap(target) => (gap / points - target).abs() <= load_limit * self.gap_scale(target),
        };
        // The stress has the mean of the pressure; of a body that is not periodic, up to the residual of its free
        // surface.
        let carried = (stress / points - state.pressure).abs() / self.scale;
        if !imposed || carried > load_limit + residual_limit || state.load_error > load_limit {
            return Stop::Rejected;
        }
        // Without a law the fields alone give the residual.
        let of_fields = if self.law { 0.0 } else { (residual_square / points).sqrt() / self.scale };
        let residual = state.residual.max(of_fields);
        let of_fields = if self.law { 0.0 } else { work / points / self.work_scale() };
        let complementarity = state.complementarity.max(of_fields);
        // Cauchy and Schwarz: an imbalance on open nodes times their gap.
        let relative_gap = (gap_square / points).sqrt() / self.rms_height.max(f64::MIN_POSITIVE);
        if self.hard && lowest_gap < 0.0 {
            return Stop::Rejected;
        }
        if residual <= residual_limit && complementarity <= residual_limit * relative_gap.max(1.0) {
            Stop::Converged
        } else if residual <= 10.0 * self.floor {
            Stop::RoundingFloor
        } else {
            Stop::Rejected
        }
    }

    fn work_scale(&self) -> f64 {
        self.scale * self.rms_height.max(f64::MIN_POSITIVE)
    }

    /// Length by which the error of an imposed mean gap is divided: the gap, or behind a soft wall, where it passes
    /// through zero, at least a thousandth of the rms height.
    pub fn gap_scale(&self, target: f64) -> f64 {
        const PASSING: f64 = 1e-3;
        if self.hard { target.abs() } else { target.abs().max(PASSING * self.rms_height) }
    }
}

/// An estimator, whose estimates are judged.
pub fn estimating<'p>(run: impl Estimator + 'p) -> StartedMethod<'p> {
    StartedMethod::Estimator(Box::new(CheckedEstimator(run)))
}

struct CheckedEstimator<E>(E);

impl<E: Estimator> Estimator for CheckedEstimator<E> {
    fn estimate(&mut self, load: Load) -> Result<MethodEstimate<'_>> {
        let estimate = self.0.estimate(load)?;
        Ok(MethodEstimate { stop: of_estimate(&estimate), ..estimate })
    }

    fn replay(&mut self, load: Load) -> Result<()> {
        self.0.replay(load)
    }
}

/// The stop reason of an estimate: its numbers are finite, its contact fraction is one, and the method's own residual
/// is within its tolerance.
fn of_estimate(estimate: &MethodEstimate) -> Stop {
    if estimate.stop != Stop::Converged {
        return estimate.stop;
    }
    let scalars = [estimate.pressure, estimate.contact_area, estimate.load_error, estimate.residual];
    let lengths = [estimate.mean_gap, estimate.stiffness].into_iter().flatten();
    let fields = [estimate.gap, estimate.stress].into_iter().flatten();
    let finite = scalars.into_iter().chain(lengths).all(f64::is_finite)
        && fields.into_iter().all(|field| field.par_iter().all(|v| v.is_finite()));
    // That of a field solver within may be as far above the tolerance as the check allows.
    let met = estimate.residual <= (SLACK + 1.0) * estimate.tolerance;
    match () {
        () if !finite => Stop::Diverged,
        () if !(0.0..=1.0).contains(&estimate.contact_area) || !met => Stop::Rejected,
        () => Stop::Converged,
    }
}

/// Conditions of a problem at a stress scale, for a method with a hard wall or without (`hard`).
pub fn equilibrium_check<'m>(
    problem: &ReducedProblem<'m>,
    hard: bool,
    rms_height: f64,
    scale: f64,
) -> EquilibriumCheck<'m> {
    EquilibriumCheck {
        hard,
        law: !hard || problem.adhesion != crate::interface::AttractionLaw::None,
        tolerance: problem.tolerance,
        floor: problem.rounding_floor(rms_height, scale),
        rms_height,
        scale,
        hardness: problem.hardness.unwrap_or(NodalHardness::NONE),
        grid: problem.grid,
        ranks: sharing(problem.ranks, problem.grid),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method::NoObserver;
    use crate::method::{ContactMethod, Fast};
    use asperity_grid::{Field, Grid};
    use std::f64::consts::TAU;

    const PRESSURE: f64 = 0.02;

    /// A state of `fast` on a wave, its fields changed by `damage`, and the verdict.
    fn verdict(damage: impl Fn(&mut Equilibrium, &mut Vec<f64>, &mut Vec<f64>)) -> Stop {
        let grid = Grid::unit(32, 32);
        let wave = |i: usize| 0.02 * (TAU * (i % 32) as f64 / 32.0).cos() * (TAU * (i / 32) as f64 / 32.0).cos();
        let heights: Vec<f64> = (0..grid.points()).map(wave).collect();
        let problem = ReducedProblem::new(grid, &heights);
        let mut run = Fast.start(&problem, &NoObserver).expect("starts").solver().unwrap();
        let state = run.equilibrate(Load::Pressure(PRESSURE)).expect("solved");
        let (mut gap, mut stress) = (state.gap.to_vec(), state.stress.to_vec());
        let mut state = Equilibrium { gap: Field::F64(&[]), stress: Field::F64(&[]), ..state };
        damage(&mut state, &mut gap, &mut stress);
        let rms = problem.heights.rms();
        let check = equilibrium_check(&problem, true, rms, problem.stress_scale(rms, PRESSURE));
        check.decide(Ending::Met, &state, &gap, &stress)
    }

    fn open(gap: &[f64]) -> usize {
        gap.iter().position(|g| *g > 0.0).expect("an open node")
    }

    /// The iterate itself is accepted. Whatever is wrong with it, it is not: whether the scalars of the solver or only
    /// the fields show it.
    #[test]
    fn damaged_iterates_are_not_accepted() {
        assert_eq!(verdict(|_, _, _| {}), Stop::Converged);
        // The load: reported, imposed, and carried.
        assert_eq!(verdict(|s, _, _| s.load_error = 1e-6), Stop::Rejected);
        assert_eq!(verdict(|s, _, _| s.load = Load::Pressure(2.0 * PRESSURE)), Stop::Rejected);
        assert_eq!(verdict(|_, _, t| t.iter_mut().for_each(|t| *t *= 1.0 + 1e-6)), Stop::Rejected);
        // A mean gap that is not the imposed one.
        assert_eq!(verdict(|s, _, _| s.load = Load::MeanGap(s.mean_gap)), Stop::Converged);
        assert_eq!(verdict(|s, _, _| s.load = Load::MeanGap(s.mean_gap * (1.0 + 1e-6))), Stop::Rejected);
        assert_eq!(verdict(|s, _, _| s.load = Load::MeanGap(1e-6 * s.mean_gap)), Stop::Rejected);
        // A negative gap.
        assert_eq!(verdict(|_, g, _| g[5] = -1e-12), Stop::Rejected);
        // Tension without adhesion, at a closed and at an open node, and compression of an open node, each with the
        // load in balance.
        let shift = |t: &mut Vec<f64>, from: usize, to: usize, by: f64| (t[from], t[to]) = (t[from] - by, t[to] + by);
        let closed = |g: &[f64]| g.iter().position(|g| *g == 0.0).expect("a closed node");
        for by in [10.0 * PRESSURE, -10.0 * PRESSURE] {
            assert_eq!(verdict(|_, g, t| shift(t, open(g), closed(g), by)), Stop::Rejected, "{by}");
        }
        assert_eq!(
            verdict(|_, g, t| {
                let tension = t[closed(g)] + PRESSURE;
                let other = g.iter().rposition(|g| *g == 0.0).expect("another");
                shift(t, closed(g), other, tension);
            }),
            Stop::Rejected
        );
        // Residual and complementarity as reported.
        assert_eq!(verdict(|s, _, _| s.residual = 1e-6), Stop::Rejected);
        assert_eq!(verdict(|s, _, _| s.complementarity = 1e-6), Stop::Rejected);
        // What is no number.
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(verdict(|s, _, _| s.residual = value), Stop::Diverged);
            assert_eq!(verdict(|s, _, _| s.energy = value), Stop::Diverged);
            assert_eq!(verdict(|_, g, _| g[7] = value), Stop::Diverged);
            assert_eq!(verdict(|_, _, t| t[7] = value), Stop::Diverged);
        }
    }

    /// A solver that stopped for another reason has not converged, however good its fields are.
    #[test]
    fn a_solver_that_stopped_has_not_converged() {
        let problem = ReducedProblem::new(Grid::unit(1, 1), &[0.0][..]);
        let check = equilibrium_check(&problem, true, 0.0, 1.0);
        let mut run = Fast.start(&problem, &NoObserver).expect("starts").solver().unwrap();
        let state = run.equilibrate(Load::Pressure(1.0)).expect("solved");
        assert_eq!(check.decide(Ending::Met, &state, &[0.0], &[1.0]), Stop::Converged);
        for stop in [Stop::IterationLimit, Stop::Detached, Stop::Interrupted] {
            assert_eq!(check.decide(Ending::Stopped(stop), &state, &[0.0], &[1.0]), stop);
        }
    }

    /// An estimate that is no number, no fraction, or beyond its own tolerance is not accepted.
    #[test]
    fn damaged_estimates_are_not_accepted() {
        let good = MethodEstimate { contact_area: 0.5, ..MethodEstimate::at(0.1) };
        assert_eq!(of_estimate(&good), Stop::Converged);
        let gap = [0.0, f64::NAN];
        for (bad, stop) in [
            (MethodEstimate { contact_area: f64::NAN, ..good.clone() }, Stop::Diverged),
            (MethodEstimate { mean_gap: Some(f64::INFINITY), ..good.clone() }, Stop::Diverged),
            (MethodEstimate { gap: Some(&gap), ..good.clone() }, Stop::Diverged),
            (MethodEstimate { contact_area: 1.5, ..good.clone() }, Stop::Rejected),
            (MethodEstimate { contact_area: -0.1, ..good.clone() }, Stop::Rejected),
            (MethodEstimate { residual: 1e-3, tolerance: 1e-4, ..good.clone() }, Stop::Rejected),
            (MethodEstimate { stop: Stop::IterationLimit, ..good.clone() }, Stop::IterationLimit),
        ] {
            assert_eq!(of_estimate(&bad), stop, "{bad:?}");
        }
    }
}

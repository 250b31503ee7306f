//! A bound of the energy above its minimum, from a gap and a pressure that are both feasible.

use crate::interface::{AttractionLaw, Elastic, Kernel, Wall};
use crate::method::{Equilibrium, Load, MethodCard, ReducedProblem};
use asperity_grid::{Grid, sums_of_ranks};
use rayon::prelude::*;

/// Stiffness of the softest wave of a grid, E*/L.
fn softest(kernel: Elastic, grid: Grid) -> f64 {
    let of_column = |i: usize| {
        let waves = (0..grid.ny).filter(|j| (i, *j) != (0, 0));
        waves.map(|j| kernel.stiffness(grid.qx(i), grid.qy(j))).fold(f64::INFINITY, f64::min)
    };
    (0..grid.half()).into_par_iter().map(of_column).reduce(|| f64::INFINITY, f64::min)
}

/// The energy above its minimum over the elastic energy, at most: under a pressure, without adhesion or flow, with a hard wall and a periodic
/// body.
///
/// The gap is nowhere negative, and the compression of the closed nodes, scaled to the load, is feasible in the complementary problem. The
/// energies of both bound the minimum from either side; their difference is `½⟨r K⁻¹ r⟩` with `r` what was taken from the stress: that of
/// open nodes, and tension. Here `K` is replaced by its least value, which saves a transform. The displacement deviates from the
/// exact one by at most the root of twice the difference, in the norm of the elastic energy.
pub(super) struct EnergyBound {
    softest: f64,
}

impl EnergyBound {
    /// `None` where a state has no bound, or the stress of the method's states is another than that of their displacement.
    pub(super) fn of(problem: &ReducedProblem, card: &MethodCard) -> Option<Self> {
        let elastic = problem.adhesion == AttractionLaw::None && problem.hardness.is_none();
        let applies =
            problem.kernel.is_periodic() && elastic && problem.wall == Wall::Hard && card.capabilities.elastic_stress;
        applies.then(|| EnergyBound { softest: softest(problem.kernel, problem.grid) })
    }

    pub(super) fn at(&self, grid: Grid, state: &Equilibrium) -> Option<f64> {
        let Load::Pressure(imposed) = state.load else { return None };
        let ranks = state.ranks;
        let in_row = |y: usize| {
            (y * grid.nx..(y + 1) * grid.nx).fold([0.0; 3], |[sum, square, taken], i| {
                let stress = state.stress.at(i);
                let pressure = if state.gap.at(i) <= 0.0 { stress.max(0.0) } else { 0.0 };
                [sum + pressure, square + pressure * pressure, taken + (stress - pressure).powi(2)]
            })
        };
        let rows: Vec<[f64; 3]> = (0..state.gap.len() / grid.nx).into_par_iter().map(in_row).collect();
        let sums = sums_of_ranks(ranks, grid.ny, &rows);
        let [mean, square, taken] = sums.map(|sum| sum / grid.points() as f64);
        let taken = taken + (1.0 - imposed / mean).powi(2) * square;
        let bound = 0.5 * taken / self.softest / state.elastic_energy;
        bound.is_finite().then_some(bound)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interface::{Base, CubicHalfSpace, Layer};
    use crate::method::{Bvm, ContactMethod, Fast, Gfmd, NoObserver};
    use asperity_surface::{Modes, Spectrum};

    /// Energy and elastic energy of a state, and the bound.
    fn solved(problem: &ReducedProblem, method: &dyn ContactMethod, pressure: f64) -> (f64, f64, f64) {
        let mut run = method.start(problem, &NoObserver).expect("a problem").solver().expect("a solver");
        let state = run.equilibrate(Load::Pressure(pressure)).expect("solved");
        let bound = EnergyBound::of(problem, method.card()).and_then(|bound| bound.at(problem.grid, &state));
        (state.energy, state.elastic_energy, bound.expect("a bound"))
    }

    /// Energies of states that stop early are above that of an accurate one by no more than the bound, which falls as the square of the
    /// residual.
    #[test]
    fn the_bound_holds_for_every_body_and_is_of_second_order() {
        /// Bound over the excess. Measured: up to 48 on half-spaces, whose softest wave is far softer than those of the residual.
        const CLOSE: f64 = 60.0;
        /// Of the energies, from which the excess is a difference.
        const ROUNDING: f64 = 1e-12;
        let grid = Grid::unit(128, 128);
        let spectrum = Spectrum { lambda_s: 1.0 / 32.0, ..Spectrum::CHALLENGE };
        let heights = Modes::new(spectrum, 3, 1.0).heights(grid, 0.0);
        let layer = |poisson| Elastic::Layer(Layer { thickness: 0.05, poisson, base: Base::Bonded });
        let crystal = Elastic::Cubic(CubicHalfSpace::new(1.7, 1.2, 0.75).expect("a stable crystal"));
        for kernel in [Elastic::HalfSpace, layer(0.3), layer(0.5), crystal] {
            let problem = ReducedProblem { kernel, tolerance: 1e-10, ..ReducedProblem::new(grid, &heights) };
            for pressure in [0.005, 0.1] {
                let (exact, _, tight) = solved(&problem, &Fast, pressure);
                for tolerance in [3e-2, 1e-3, 1e-5] {
                    let loose = ReducedProblem { tolerance, ..problem.clone() };
                    let (energy, elastic, bound) = solved(&loose, &Fast, pressure);
                    let excess = (energy - exact) / elastic;
                    assert!(excess <= bound + tight, "{kernel} {pressure} {tolerance}: {excess:e} {bound:e}");
                    assert!(
                        bound <= CLOSE * excess + ROUNDING,
                        "{kernel} {pressure} {tolerance}: {excess:e} {bound:e}"
                    );
                    assert!(bound <= tolerance.powi(2), "{kernel} {pressure} {tolerance}: {bound:e}");
                }
                assert!(tight < 1e-16, "{kernel} {pressure}: {tight:e}");
            }
        }
    }

    /// It holds for every method whose card says so, and adhesion has none.
    #[test]
    fn the_bound_holds_for_every_method_with_elastic_stress() {
        let grid = Grid::unit(64, 64);
        let spectrum = Spectrum { lambda_s: 1.0 / 16.0, ..Spectrum::CHALLENGE };
        let heights = Modes::new(spectrum, 3, 1.0).heights(grid, 0.0);
        let problem = ReducedProblem { tolerance: 1e-10, ..ReducedProblem::new(grid, &heights) };
        let (exact, _, tight) = solved(&problem, &Fast, 0.02);
        for method in [&Fast as &dyn ContactMethod, &Gfmd, &Bvm] {
            for tolerance in [3e-2, 1e-3] {
                let (energy, elastic, bound) = solved(&ReducedProblem { tolerance, ..problem.clone() }, method, 0.02);
                let (excess, id) = ((energy - exact) / elastic, method.card().id);
                assert!(excess <= bound + tight && bound <= 1.0, "{id} {tolerance}: {excess:e} {bound:e}");
            }
        }
        let sticky = ReducedProblem { adhesion: AttractionLaw::exponential(1e-4, 1e-2), ..problem };
        assert!(EnergyBound::of(&sticky, Fast.card()).is_none());
    }
}

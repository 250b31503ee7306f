//! The free energy that the field methods minimise, and its gradient, evaluated in one transform pair.
//!
//! With gap `g`, heights `h`, stiffness `K`, pressure `p` and interaction `v(g)`, the free energy per area is
//!
//! ```text
//! F(g) = ½⟨(g-h) K (g-h)⟩ + p⟨g⟩ + ⟨v(g)⟩,   t = dF/dg = K(g-h) + p + v'(g)
//! ```
//!
//! In equilibrium `t = 0` where the gap is open and `t ≥ 0`, the contact stress, where a hard wall closes it. `K` has
//! no mean mode, so the mean of `t - v'` is the pressure for any gap, and load balance is a condition on `t`.

use super::iteration::{IterationControl, LoadCase};
use super::plastic::PlasticFlow;
use super::residuals::{Residuals, RowLaw, kkt_row};
use super::sweep::{sweep, sweep_sums};
use super::{Heights, Load, Observer, Precision, ReducedProblem, require};
use crate::interface::{AttractionLaw, HardWall, Kernel, Law, NodalHardness, WithAdhesion, Yielding, YieldingWall};
use crate::observe::Plasticity;
use asperity_grid::Result;
use asperity_grid::{Grid, HalfSpectrum, Real, SpectralFilter, Transform, block_sums, lowest, mean_of, rms};
use rayon::prelude::*;
use rustfft::num_complex::Complex;
use std::borrow::Cow;

/// Multiplication by the kernel and by the `1/N` of the transform. Sums `Σ w K |c|²/N² = ⟨f K f⟩`.
pub(super) struct Stiffness<K> {
    pub grid: Grid,
    pub kernel: K,
}

impl<T: Real, K: Kernel> SpectralFilter<T> for Stiffness<K> {
    fn apply(&self, i: usize, column: &mut [Complex<T>]) -> f64 {
        let per_point = 1.0 / self.grid.points() as f64;
        let qx = self.grid.qx(i);
        let mut sum = 0.0;
        for (j, c) in column.iter_mut().enumerate() {
            let qy = self.grid.qy(j);
            let k = self.kernel.stiffness(qx, qy) * per_point;
            sum += k * c.norm_sqr().wide();
            *c = c.scale(T::of(k));
        }
        self.grid.column_weight(i) * per_point * sum
    }
}

/// Energy and gradient for the solvers: heights in working precision, transform, kernel, law and the present pressure.
pub(super) struct Operator<'p, T: Real, K, L> {
    pub problem: &'p ReducedProblem<'p>,
    pub transform: Transform<T>,
    /// Allocated when first used ([`Operator::allocate_spectrum`]).
    pub spectrum: HalfSpectrum<T>,
    pub stiffness: Stiffness<K>,
    pub law: L,
    pub heights: Cow<'p, [T]>,
    /// Subtracted from the heights, since an offset would cost digits in the transform.
    pub offset: T,
    pub rms_height: f64,
    pub lowest: T,
    pub pressure: f64,
    /// Transform pairs so far.
    pub fft_pairs: f64,
}

impl<'p, T: Real, K: Kernel, L: Law> Operator<'p, T, K, L> {
    pub(super) fn new(problem: &'p ReducedProblem<'p>, kernel: K, law: L) -> Self {
        let grid = problem.grid;
        let transform = Transform::new(grid);
        let (heights, offset) = match problem.heights {
            Heights::Nodes(nodes) => T::heights(nodes, asperity_grid::mean(nodes)),
            Heights::Series(series) => (Cow::Owned(series.on_nodes(&transform, &mut transform.spectrum())), T::zero()),
            Heights::Planned(_) => unreachable!("a solve has heights"),
        };
        let lowest = lowest(&heights);
        let rms_height = rms(&heights);
        let stiffness = Stiffness { grid, kernel };
        Operator {
            problem,
            transform,
            spectrum: HalfSpectrum::default(),
            stiffness,
            law,
            heights,
            offset,
            rms_height,
            lowest,
            pressure: 0.0,
            fft_pairs: 0.0,
        }
    }

    /// Imposes a load and prepares its iteration.
    ///
    /// # Errors
    /// `Input` for a mean gap, for a tensile pressure without adhesion.
    pub(super) fn control<'o>(
        &mut self,
        load: Load,
        observer: &'o dyn Observer,
        id: &str,
    ) -> Result<IterationControl<'o, 'p>> {
        let range = self.law.range();
        self.pressure = require::pressure(load, range > 0.0, id)?;
        require::below_hardness(load, self.law.max_pressure(), id)?;
        let case = LoadCase { pressure: self.pressure, range, rms_height: self.rms_height, hard: L::HARD };
        Ok(IterationControl::new(self.problem, observer, case))
    }

    /// The heights of the surface after plastic flow.
    pub(super) fn displace(&mut self, flow: &PlasticFlow<T>) {
        if flow.has_begun() {
            self.heights = Cow::default();
            let nodes = self.problem.heights.on_nodes(self.problem.grid);
            let height = |i: usize| flow.height(&nodes, i);
            let mean = mean_of(nodes.len(), height);
            self.heights = (0..nodes.len()).map(|i| T::of(height(i) - mean)).collect();
            (self.offset, self.lowest) = (T::zero(), lowest(&self.heights));
        }
    }

    /// Moves the flow of a load from its gap to the heights of the next.
    pub(super) fn yielded(
        &mut self,
        flow: &mut PlasticFlow<T>,
        (gap, converged): (&mut [T], bool),
        residuals: &mut Residuals,
    ) -> Option<Plasticity> {
        residuals.mean_separation -= flow.mean();
        let layout = [self.problem.grid.nx, self.problem.grid.nx, gap.len()];
        let plasticity = flow.take(&self.law, gap, (layout, converged), residuals)?;
        if residuals.flow > 0.0 && converged {
            self.displace(flow);
        }
        Some(plasticity)
    }

    /// Allocates the spectrum.
    pub(super) fn allocate_spectrum(&mut self) {
        if self.spectrum.is_empty() {
            self.spectrum = self.transform.spectrum();
        }
    }

    /// Gap at first contact, without displacement.
    pub(super) fn first_touch(&self) -> Vec<T> {
        self.heights.iter().map(|&h| h - self.lowest).collect()
    }

    /// Gradient `t` at `gap`, one transform pair. For each row `update` may first change the gap; then `visit`
    /// receives law, gap and `t`, may write to `store`, and returns sums in addition to [`Residuals`].
    pub(super) fn evaluate<const M: usize>(
        &mut self,
        gap: &mut [T],
        store: &mut [T],
        update: impl Fn(usize, &mut [T]) + Sync,
        visit: impl Fn(RowLaw<L>, &[T], &[T], &mut [T]) -> [f64; M] + Sync,
    ) -> (Residuals, [f64; M]) {
        self.allocate_spectrum();
        let grid = self.transform.grid();
        let (nx, offset) = (grid.nx, self.offset);
        let fields = gap.par_chunks_mut(nx).zip(self.heights.par_chunks(nx));
        sweep(&self.transform, &mut self.spectrum, fields, |worker, y, spectrum, (gap, heights)| {
            update(y, gap);
            for ((w, &g), &h) in worker.row.iter_mut().zip(gap.iter()).zip(heights) {
                *w = g - (h - offset);
            }
            worker.forward(spectrum);
        });
        let elastic = 0.5 * self.transform.filter_columns(&mut self.spectrum, &self.stiffness);
        let (law, pressure) = (&self.law, T::of(self.pressure));
        let fields = gap.par_chunks(nx).zip(store.par_chunks_mut(nx));
        let rows = sweep(&self.transform, &mut self.spectrum, fields, |worker, y, spectrum, (gap, store)| {
            worker.inverse(spectrum);
            worker.row.iter_mut().for_each(|t| *t += pressure);
            let law = RowLaw::of(law, y, nx);
            (kkt_row(law, gap, &mut worker.row), visit(law, gap, &worker.row, store))
        });
        self.fft_pairs += 1.0;
        let (sums, more): (Vec<_>, Vec<_>) = rows.into_iter().unzip();
        (Residuals::new(grid.points(), elastic, &block_sums(&sums)), block_sums(&more))
    }

    /// `⟨d K d⟩`, half a transform pair. `update` first sets each row of `d` and returns sums.
    pub(super) fn curvature<const M: usize>(
        &mut self,
        direction: &mut [T],
        update: impl Fn(usize, &mut [T]) -> [f64; M] + Sync,
    ) -> (f64, [f64; M]) {
        let fields = direction.par_chunks_mut(self.transform.grid().nx);
        let sums = sweep_sums(&self.transform, &mut self.spectrum, fields, |worker, y, spectrum, direction| {
            let sums = update(y, direction);
            worker.row.copy_from_slice(direction);
            worker.forward(spectrum);
            sums
        });
        let curvature = self.transform.sum_columns(&mut self.spectrum, &self.stiffness);
        self.fft_pairs += 0.5;
        (curvature, sums)
    }

    /// Writes the interfacial stress `p + K(g-h)` to `stress` and returns the residuals.
    pub(super) fn stress(&mut self, gap: &mut [T], stress: &mut [T]) -> Residuals {
        let law = self.law;
        let (residuals, _) = self.evaluate(
            gap,
            stress,
            |_, _| {},
            |row, gap, t, stress| {
                for (i, ((s, &t), &g)) in stress.iter_mut().zip(t).zip(gap).enumerate() {
                    *s = if L::ACTIVE { t - T::of(law.traction(g.wide())) } else { t };
                    if L::HARD && L::YIELDS && g.is_sign_negative() {
                        *s += T::of(row.hardness.at(i));
                    }
                }
                [0.0; 0]
            },
        );
        residuals
    }

    /// Pressure over the approach (E*/L) of a contact of one node.
    pub(super) fn stiffness_of_one_node(&self) -> f64 {
        let Stiffness { grid, kernel } = &self.stiffness;
        let compliance = |i: usize, j: usize| match kernel.stiffness(grid.qx(i), grid.qy(j)) {
            0.0 => 0.0,
            stiffness => grid.column_weight(i) / stiffness,
        };
        1.0 / (0..grid.half()).map(|i| (0..grid.ny).map(|j| compliance(i, j)).sum::<f64>()).sum::<f64>()
    }

    /// Upper bound of the curvature of the energy around `gap`, the inverse of a safe gradient step. The stiffness of
    /// a soft wall is taken at a stress of E* or four times the mean pressure, above that of contact spots of slope
    /// one, or at the present smallest gap if the wall is stiffer there.
    pub(super) fn stiffest(&self, gap: &[T]) -> f64 {
        let law = if L::HARD {
            self.law.max_slope_at_pressure(0.0)
        } else {
            let lowest = lowest(gap).wide();
            self.law.max_slope_at_pressure(4.0 * self.pressure.max(0.25)).max(self.law.slope(lowest).abs())
        };
        self.problem.stiffest_mode() + law
    }
}

/// Constructs a solver for precision, kernel and law of a problem.
pub(super) trait Build<'p> {
    type Built;

    fn build<T: Real, K: Kernel + 'p, L: Law + 'p>(self, kernel: K, law: L) -> Self::Built;
}

/// Selects the types: precision and law are type parameters of the inner loops, not branches in them.
pub(super) fn dispatch<'p, B: Build<'p>>(problem: &'p ReducedProblem<'p>, builder: B) -> B::Built {
    match problem.precision {
        Precision::F32 => with_law::<f32, B>(problem, builder),
        Precision::F64 => with_law::<f64, B>(problem, builder),
    }
}

fn with_law<'p, T: Real, B: Build<'p>>(problem: &'p ReducedProblem<'p>, builder: B) -> B::Built {
    let kernel = problem.kernel;
    // The most frequent laws have their own solver instances. The others share two instances, in which the law is
    // selected node by node and the hardness may be infinite, since every instance increases the build time.
    match (problem.wall.soft(), problem.adhesion, problem.hardness) {
        (None, AttractionLaw::None, None) => builder.build::<T, _, _>(kernel, HardWall),
        (None, AttractionLaw::None, Some(hardness)) => {
            builder.build::<T, _, _>(kernel, Yielding { law: HardWall, hardness })
        }
        (None, AttractionLaw::Exponential(law), None) => builder.build::<T, _, _>(kernel, law),
        (None, law, hardness) => {
            let hardness = hardness.unwrap_or(NodalHardness::NONE);
            builder.build::<T, _, _>(kernel, Yielding { law, hardness })
        }
        (Some(wall), adhesion, hardness) => {
            // A map is refused with a soft wall.
            let wall = YieldingWall::new(wall, hardness.map(|h| h.mean()));
            builder.build::<T, _, _>(kernel, WithAdhesion::new(wall, adhesion))
        }
    }
}

use super::fields::{LevelFields, Metric, Spring, StateSums};
use super::gpu::GpuLevels;
use super::host::{Host, LevelProblem};
use super::window::{ComputationCell, Window};
use crate::interface::Law;
use crate::method::Precision;
use crate::method::residuals::{KKT, Residuals, curvature_of};
use crate::method::sweep::{each_row, shift, weight_below, weighted_quantile};
use asperity_grid::sys::ranks::Ranks;
use asperity_grid::{Grid, Real, lowest};

/// Right side of the linear problem of the contact stiffness, over the lowest hardness up to E*.
const TANGENT_GRADIENT: f64 = 0.25;

/// Two gains in succession below this share of the compliance end its linear problem: for a stiffness that is a result, and for one that
/// bounds a tension.
pub(super) const TANGENT_ACCURACY: f64 = 1e-4;
pub(super) const TANGENT_BOUND: f64 = 1e-2;

/// Iterations of that problem at most; it takes 8 to 20.
const TANGENT_LIMIT: usize = 200;

/// One grid of the hierarchy with its state and working arrays.
pub(super) struct Level<'h, T: Real, L> {
    fields: Box<dyn LevelFields<T> + 'h>,
    gpu: Option<&'h GpuLevels>,
    body: LevelProblem<'h, T, L>,
    cell: ComputationCell,
    pub pressure: f64,
    pub spring: Spring,
    /// Accepted multiple of the step that the next sweep adds to the gap.
    pub pending: f64,
    /// Transform pairs on this grid so far.
    pub fft_pairs: f64,
    /// Residuals of the final state of the last solve.
    pub last: Residuals,
}

/// A trial state: residuals, and the inner products of its KKT residual with itself and with the previous one.
pub(super) struct Trial {
    pub residuals: Residuals,
    pub rr: f64,
    pub rr_old: f64,
}

impl<'h, T: Real, L: Law + 'h> Level<'h, T, L> {
    fn of(
        fields: Box<dyn LevelFields<T> + 'h>,
        gpu: Option<&'h GpuLevels>,
        body: LevelProblem<'h, T, L>,
        cell: ComputationCell,
    ) -> Self {
        Level {
            fields,
            gpu,
            body,
            cell,
            pressure: 0.0,
            spring: Spring::default(),
            pending: 0.0,
            fft_pairs: 0.0,
            last: Residuals::default(),
        }
    }

    /// A level at first contact, without displacement.
    pub(super) fn at_first_contact(
        grid: Grid,
        body: LevelProblem<'h, T, L>,
        cell: ComputationCell,
        gpu: Option<&'h GpuLevels>,
    ) -> Self {
        let mut undeformed = Host::undeformed(grid, body);
        let (nx, window, gap) = (grid.nx, body.window, undeformed.gap_mut());
        let rows = gap.chunks(nx).enumerate();
        let smallest = rows.map(|(y, gap)| lowest(&gap[..window.inside(y, nx)])).fold(T::infinity(), T::min);
        shift(gap, -T::of(body.sharing(grid).lowest(smallest.wide())));
        match gpu.filter(|gpu| gpu.takes(grid)) {
            Some(gpu) => Self::of(gpu.with_gap(grid, body, std::mem::take(gap)), Some(gpu), body, cell),
            None => Self::of(Box::new(undeformed), gpu, body, cell),
        }
    }

    /// A level with this gap.
    pub(super) fn with_gap(
        grid: Grid,
        body: LevelProblem<'h, T, L>,
        cell: ComputationCell,
        gpu: Option<&'h GpuLevels>,
        gap: Vec<T>,
    ) -> Self {
        let fields = match gpu.filter(|gpu| gpu.takes(grid)) {
            Some(gpu) => gpu.with_gap(grid, body, gap),
            None => Box::new(Host::new(grid, body, gap)),
        };
        Self::of(fields, gpu, body, cell)
    }

    /// Fourier interpolation of the displacement of a coarser level to this grid.
    pub(super) fn refined(grid: Grid, law: L, coarse: Level<'h, T, L>) -> Self {
        let Level { mut fields, gpu, body, cell, pressure, spring, last, .. } = coarse;
        let old = fields.grid();
        let window = cell.window(grid);
        let body = LevelProblem { law, window, ..body };
        let mut level = if let Some(gpu) = gpu.filter(|gpu| gpu.takes(grid)) {
            Self::of(gpu.refined(grid, body, (old, &fields.into_gap())), Some(gpu), body, cell)
        } else {
            let flows: Vec<bool> = match L::HARD && L::YIELDS {
                true => fields.gap().iter().map(|g| *g < T::zero()).collect(),
                false => Vec::new(),
            };
            let mut fine = Host::refined(grid, body, (old, fields.into_gap()));
            if L::HARD {
                close(fine.gap_mut(), grid, window, (&flows, old));
            }
            Self::of(Box::new(fine), gpu, body, cell)
        };
        (level.pressure, level.spring) = (pressure, spring);
        // Interpolation over a steep edge may lift all contact. The fraction in contact is kept.
        if L::HARD && pressure > 0.0 && level.is_padded() && !level.touches() {
            level.approach((last.contact * window.points() as f64).round() as usize);
        }
        level
    }
}

impl<'h, T: Real, L: Law> Level<'h, T, L> {
    pub(super) fn grid(&self) -> Grid {
        self.fields.grid()
    }

    pub(super) fn window(&self) -> Window {
        self.body.window
    }

    pub(super) fn law(&self) -> &L {
        &self.body.law
    }

    /// Whether the device of the fields failed.
    pub(super) fn has_failed(&self) -> bool {
        self.fields.has_failed()
    }

    /// Whether trials in f32 are faster where the state has another precision.
    pub(super) fn tries_in_f32(&self) -> bool {
        self.fields.tries_in_f32()
    }

    /// Gap `[ny, nx]` after the pending step, units of L; on several ranks, the rows of this one.
    pub(super) fn gap(&mut self) -> &[T] {
        self.apply_pending();
        self.fields.gap()
    }

    /// The ranks of whose rows the gap is.
    pub(super) fn ranks(&self) -> &'h Ranks {
        self.body.sharing(self.grid())
    }

    /// The same of this rank, to be changed.
    pub(super) fn gap_mut(&mut self) -> &mut Vec<T> {
        self.apply_pending();
        self.fields.gap_mut()
    }

    /// Whether only a part of the cell faces the rigid surface.
    pub(super) fn is_padded(&self) -> bool {
        self.window().points() < self.grid().points()
    }

    /// Whether a facing node is closed.
    fn touches(&mut self) -> bool {
        let (nx, window) = (self.grid().nx, self.window());
        let mut rows = self.gap().chunks(nx).enumerate();
        rows.any(|(y, gap)| gap[..window.inside(y, nx)].iter().any(|g| *g <= T::zero()))
    }

    /// Shifts the gap rigidly so that (at least) `nodes` facing nodes close, without overlap.
    pub(super) fn approach(&mut self, nodes: usize) {
        let (grid, nx, window, body) = (self.grid(), self.grid().nx, self.window(), self.body);
        let gap = self.gap_mut();
        let by = if nodes <= 1 {
            // Of all ranks.
            let rows = gap.chunks(nx).enumerate();
            let own = rows.map(|(y, gap)| lowest(&gap[..window.inside(y, nx)])).fold(T::infinity(), T::min);
            T::of(body.sharing(grid).lowest(own.wide()))
        } else {
            let mut facing = window.cut(gap, nx);
            let last = nodes.min(facing.len()) - 1;
            *facing.select_nth_unstable_by(last, |a, b| a.wide().total_cmp(&b.wide())).1
        };
        each_row(gap, nx, |y, gap| {
            let (facing, padding) = gap.split_at_mut(window.inside(y, nx));
            facing.iter_mut().for_each(|g| *g = (*g - by).max(T::zero()));
            padding.iter_mut().for_each(|g| *g -= by);
        });
    }

    /// Exact line search along the rigid approach of a periodic body that yields: only the flow resists it, so that at the
    /// minimum the flowing nodes carry at most the load, and with the closed ones at least the load. True if the gap moved.
    pub(super) fn balance_flow(&mut self) -> bool {
        if !(L::HARD && L::YIELDS) || L::ACTIVE || self.is_padded() || self.spring.stiffness > 0.0 {
            return false;
        }
        let (nx, law, pressure) = (self.grid().nx, self.body.law, self.pressure);
        let hardness = law.hardness();
        // Loads in multiples of that of a node of mean hardness.
        let (mean, uniform) = (hardness.mean(), hardness.map().is_none());
        let weight = |i: usize| if uniform { 1.0 } else { hardness.at(i) / mean };
        let gap = self.gap_mut();
        let carrying = pressure / mean * gap.len() as f64;
        let [flowing, closed] = weight_below((gap, nx), T::zero(), weight);
        if carrying < 1.0 || flowing <= carrying && carrying <= closed {
            return false;
        }
        let by = weighted_quantile(gap, weight, carrying);
        shift(gap, -by);
        by != T::zero()
    }

    /// Allocates the working arrays.
    pub(super) fn prepare(&mut self) {
        self.fields.allocate();
    }

    /// Bytes of a level without the series of the heights.
    pub(super) fn bytes(grid: Grid) -> u64 {
        Host::<T, L>::bytes(grid)
    }

    /// Direction `-t + β d` on the free nodes, also the step. Returns `⟨t d⟩` and `⟨d H d⟩`; half a transform pair.
    pub(super) fn plain(&mut self, beta: f64) -> (f64, f64) {
        let pending = std::mem::take(&mut self.pending);
        let ([td, law_curvature], elastic) = self.fields.plain(pending, beta, self.spring.stiffness);
        self.fft_pairs += 0.5;
        let n = self.grid().points() as f64;
        (td / n, curvature_of(elastic, law_curvature / n))
    }

    /// Solves `H x = -t` on the free nodes for the step with conjugate gradients, preconditioned with the inverse
    /// stiffness restricted to these nodes, until the residual is `forcing` times its first value or at most `limit`
    /// iterations of two transform pairs. `mean_stiffness` is that of the mean mode in the preconditioner. Ends at
    /// negative curvature with the present iterate. `false` if stopped, with an unusable step.
    pub(super) fn newton(
        &mut self,
        (mean_stiffness, forcing, limit): (f64, f64, usize),
        stopping: &dyn Fn() -> bool,
    ) -> bool {
        let n = self.grid().points() as f64;
        let stiffness = Metric::Stiffness { mean_stiffness: self.spring.stiffness };
        let inverse = Metric::Compliance { mean_stiffness };
        let [first, own] = self.fields.begin(std::mem::take(&mut self.pending));
        let mut rz = self.fields.multiply(inverse) + own / n;
        let mut beta = 0.0;
        for iteration in 1..=limit {
            if stopping() {
                return false;
            }
            let law_curvature = self.fields.conjugate(beta);
            let elastic = self.fields.multiply(stiffness);
            let curvature = curvature_of(elastic, law_curvature / n);
            self.fft_pairs += 2.0;
            // Neither is a number after an overflow.
            if curvature <= 0.0 || rz <= 0.0 || curvature.is_nan() || rz.is_nan() {
                if iteration == 1 {
                    // The preconditioned gradient is a descent direction; the line search finds the length.
                    self.fields.step_along_direction();
                }
                break;
            }
            let alpha = rz / curvature;
            let [rr, own] = self.fields.descend(alpha);
            if rr.sqrt() <= forcing * first.sqrt() || iteration == limit {
                break;
            }
            let old = rz;
            rz = self.fields.multiply(inverse) + own / n;
            beta = rz / old;
        }
        true
    }

    /// Contact stiffness of the present gap, E*/L: the closed nodes stay closed, the others are free. The change `x` of the gap under a
    /// change of the mean stress by one solves `H x = 1` on the free nodes; its mean, a product of right side and solution, is a sum
    /// over the steps of conjugate gradients that converges twice as fast as `x`, from below, until two steps add less than `accuracy` of
    /// it. `mean_stiffness` is the stiffness of the mean mode in the preconditioner. `None` without free nodes or without contact, at negative curvature, and if stopped. Needs the working arrays.
    pub(super) fn stiffness(
        &mut self,
        (mean_stiffness, accuracy): (f64, f64),
        stopping: &dyn Fn() -> bool,
    ) -> Option<f64> {
        self.apply_pending();
        // Below every hardness, so that no closed node counts as flowing.
        let gradient = self.law().max_pressure().min(1.0) * TANGENT_GRADIENT;
        self.fields.set_gradient(gradient as f32);
        let gradient = f64::from(gradient as f32);
        let n = self.grid().points() as f64;
        let [first, own] = self.fields.begin(0.0);
        if first == 0.0 {
            return None;
        }
        let inverse = Metric::Compliance { mean_stiffness };
        let mut rz = self.fields.multiply(inverse) + own / n;
        let (mut beta, mut compliance, mut small) = (0.0, 0.0, 0);
        for _ in 0..TANGENT_LIMIT {
            if stopping() {
                return None;
            }
            let law_curvature = self.fields.conjugate(beta);
            let elastic = self.fields.multiply(Metric::Stiffness { mean_stiffness: 0.0 });
            let curvature = curvature_of(elastic, law_curvature / n);
            if curvature <= 0.0 || rz <= 0.0 || curvature.is_nan() || rz.is_nan() {
                return None;
            }
            let gain = rz * rz / curvature;
            compliance += gain;
            small = if gain <= accuracy * compliance { small + 1 } else { 0 };
            if small == 2 {
                let per_facing = n / self.window().points() as f64;
                let stiffness = per_facing / (compliance / (gradient * gradient) + self.cell.mean_compliance());
                return stiffness.is_finite().then_some(stiffness);
            }
            let [_, own] = self.fields.descend(rz / curvature);
            let old = rz;
            rz = self.fields.multiply(inverse) + own / n;
            beta = rz / old;
        }
        None
    }

    /// The pressure on the facing nodes averaged over the whole cell, the mean of the elastic stress.
    fn spread(&self) -> f64 {
        self.pressure * self.window().points() as f64 / self.grid().points() as f64
    }

    /// Residuals and gradient at the gap plus `scale` times the step, without changing the gap. One transform pair,
    /// in f32 where that suffices.
    pub(super) fn trial(&mut self, scale: f64, precision: Precision) -> Trial {
        let sums = self.fields.trial(scale, self.spread(), self.spring, precision);
        self.fft_pairs += 1.0;
        let n = self.grid().points() as f64;
        Trial { residuals: self.residuals(&sums), rr: sums.1[0] / n, rr_old: sums.1[KKT - 1] / n }
    }

    /// Evaluates the present gap: residuals of the last solve on this grid.
    pub(super) fn evaluate(&mut self, precision: Precision) {
        self.prepare();
        self.last = self.trial(0.0, precision).residuals;
    }

    /// Residuals per area of the facing nodes, from the sums over these and over the padding.
    fn residuals(&self, (elastic, sums): &StateSums) -> Residuals {
        let (facing, all) = (self.window().points(), self.grid().points());
        let (per_facing, mean) = (all as f64 / facing as f64, self.cell.mean_mode(self.pressure));
        let residuals = Residuals::new(facing, per_facing * elastic, &sums[..KKT]);
        if all == facing {
            return residuals;
        }
        let mean_separation = (sums[3] + sums[KKT]) / all as f64 - mean.1;
        Residuals { elastic: residuals.elastic + mean.0, mean_separation, ..residuals }
    }

    /// Discards the step.
    pub(super) fn clear_step(&mut self) {
        self.fields.clear_step();
    }

    /// Applies the pending step to the gap.
    pub(super) fn apply_pending(&mut self) {
        let pending = std::mem::take(&mut self.pending);
        if pending != 0.0 {
            self.fields.apply(pending);
        }
    }

    /// Residuals and interfacial stress `p + K(g - h)` at the present gap; one transform pair. Releases the working
    /// arrays.
    pub(super) fn stress(&mut self) -> (Residuals, Vec<T>) {
        self.apply_pending();
        let (sums, stress) = self.fields.stress(self.spread(), self.spring);
        self.fft_pairs += 1.0;
        (self.residuals(&sums), stress)
    }
}

/// Sets overlap after an interpolation to zero. `flows`: which nodes of the coarse grid flow; none if empty.
fn close<T: Real>(gap: &mut [T], grid: Grid, window: Window, (flows, old): (&[bool], Grid)) {
    each_row(gap, grid.nx, |y, gap| {
        let facing = &mut gap[..window.inside(y, grid.nx)];
        if flows.is_empty() {
            return facing.iter_mut().for_each(|g| *g = g.max(T::zero()));
        }
        // Nodes flow where the coarse grid's next node does.
        let row = (y * old.ny / grid.ny) * old.nx;
        for (x, g) in facing.iter_mut().enumerate() {
            *g = if flows[row + x * old.nx / grid.nx] { -(-*g).max(T::zero()) } else { g.max(T::zero()) };
        }
    });
}

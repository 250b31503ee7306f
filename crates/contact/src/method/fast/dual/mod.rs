//! Solution for the contact stress of a linear or hard wall without attraction.
//!
//! The unknown is the stress `σ ≥ 0` of the nodes in contact. Its product with the compliance `C = K⁻¹`, one transform
//! pair, gives the gap `h + Cσ + δ` everywhere: `-ℓσ` in contact with a wall of compliance ℓ, positive elsewhere. The step of an iteration comes from a sparse model of `C⁻¹` on the nodes in contact ([`InverseFactor`]), whose
//! products take no transform. It is combined with the last step so that both together minimise the energy.

mod factor;
mod hierarchy;
mod step;
mod transfer;

use super::column::{Factor, multiply};
use super::descent::remaining;
use super::host::first_bytes;
use super::window::Window;
use crate::interface::Elastic;
use crate::method::ErrorEstimates;
use crate::method::iteration::relative_change;
use crate::method::sweep::sweep;
use asperity_grid::{Grid, HalfSpectrum, Real, Series, SpectralFilter, Transform, mean};
use factor::{ComplianceTable, InverseFactor, MOST_ENTRIES};
use rayon::prelude::*;
use rustfft::num_complex::Complex;
use std::ops::ControlFlow;
use step::{ModelStep, dot, model_step};

pub(in crate::method::fast) use transfer::{ContactStress, transferred};

/// Iterations at most, and in succession without a decrease of the residual by a tenth: the solver for the gap continues from the best
/// state.
pub(in crate::method::fast) const LIMIT: usize = 80;
const PATIENCE: usize = 10;

/// Initial scale of the model's steps, and the factors by which the length of a step may change it.
const SCALE: f64 = 0.6;
const RESCALED: [f64; 2] = [0.3, 3.0];

/// Length of a step that is not combined with the last one; it is 1 where nodes lose their stress and the minimum is this near.
const LENGTH: [f64; 2] = [0.1, 1.5];
const WHOLE: [f64; 2] = [0.55, 2.0];

/// Tension over the size of a combined step up to which it is accepted; tension is cut off.
const TENSION: f64 = 3e-4;

/// Cut-off stress over the size of a step above which the displacement is computed anew.
const CUT: f64 = 1e-3;

/// Share of nodes that joined the factor, and of nodes without stress in it, above which it is built anew.
const JOINED: f64 = 0.1;
const WITHOUT_STRESS: f64 = 0.25;

/// A rigid rough surface on an elastic body under a mean pressure.
pub(in crate::method::fast) struct Contact<'h, T> {
    pub grid: Grid,
    /// Nodes that may be in contact.
    pub facing: Window,
    pub kernel: &'h Elastic,
    pub heights: &'h Series<T>,
    /// Compliance of the wall, L/E*.
    pub wall: f64,
    /// Mean pressure over the cell, E*.
    pub pressure: f64,
}

/// Result of a solve.
pub(in crate::method::fast) struct Solved<T> {
    /// `h + Cσ + δ`, L.
    pub gap: Vec<T>,
    pub stress: ContactStress,
    pub error_estimates: ErrorEstimates,
    pub fft_pairs: f64,
    pub iterations: usize,
    /// Whether the solve was stopped.
    pub stopped: ControlFlow<()>,
}

/// The displacement `Cσ` plus the heights, given the transform of the stress.
struct Deformed<'h, T> {
    grid: Grid,
    kernel: &'h Elastic,
    heights: &'h Series<T>,
}

impl<T: Real> SpectralFilter<T> for Deformed<'_, T> {
    fn apply(&self, i: usize, column: &mut [Complex<T>]) -> f64 {
        let sum = multiply((self.kernel, Factor::Compliance, 0.0), self.grid, i, column);
        self.heights.add_to(i, self.grid, column, T::one());
        sum
    }
}

/// The last step: change of the stress, its product with the compliance on all nodes, without that of the wall, and its curvature.
struct LastStep {
    change: Vec<f64>,
    displacement: Vec<f32>,
    curvature: f64,
}

struct Solve<'s, 'h, T: Real> {
    contact: &'s Contact<'h, T>,
    factor: InverseFactor<'s>,
    /// Index `y nx + x` and number of each node of the factor, ascending.
    order: Vec<(u32, u32)>,
    /// By the numbers of the nodes, E*.
    stress: Vec<f64>,
    gap: Vec<T>,
    /// Of steps, in f32, and of the stress.
    narrow: Transform<f32>,
    transform: Transform<T>,
    /// Shared by both: that in f32 takes its first bytes.
    spectrum: HalfSpectrum<T>,
    last: Option<LastStep>,
    /// Scale of the model's steps.
    omega: f64,
    /// Whether the gap was computed from the present stress; else the stress that was cut off since then, and the size of the last step.
    is_exact: bool,
    cut: f64,
    size: f64,
    fft_pairs: f64,
}

/// Transforms the rows of a field that is zero but on these nodes, of which `value` has those of their numbers.
fn forward<T: Real>(transform: &Transform<T>, spectrum: &mut [Complex<T>], order: &[(u32, u32)], values: &[f64]) {
    let nx = transform.grid().nx;
    sweep(transform, spectrum, (0..transform.grid().ny).into_par_iter(), |worker, y, spectrum, _| {
        let before = |row: usize| order.partition_point(|(index, _)| (*index as usize) < row * nx);
        let row = &order[before(y)..before(y + 1)];
        if row.is_empty() {
            spectrum.fill(Complex::default());
            return;
        }
        worker.row.fill(T::zero());
        row.iter().for_each(|(index, number)| worker.row[*index as usize - y * nx] = T::of(values[*number as usize]));
        worker.forward(spectrum);
    });
}

impl<T: Real> Contact<'_, T> {
    /// Bytes of a solve a point, without gap and spectrum: displacement of the last step, table, marks and cells; and of a node in contact:
    /// 17 entries of the factor while it is built, of its parts and of its transpose, and the vectors.
    pub(in crate::method::fast) const BYTES: f64 = 6.6;
    pub(in crate::method::fast) const BYTES_OF_CONTACT: f64 = 550.0;

    /// Most nodes in contact, whose entries have 32-bit numbers.
    pub(in crate::method::fast) const MOST_NODES: f64 = (u32::MAX as usize / MOST_ENTRIES) as f64;

    /// Solves from an initial stress until the rms error of the stress of the facing nodes is estimated at `tolerance` of their pressure, in
    /// `limit` iterations at most. `watch` receives the number of iterations and this estimate, and may stop the solve.
    pub(in crate::method::fast) fn solve(
        &self,
        start: &ContactStress,
        (tolerance, limit): (f64, usize),
        watch: &mut dyn FnMut(usize, f64) -> ControlFlow<()>,
    ) -> Solved<T> {
        let table = ComplianceTable::new(self.grid, self.kernel, self.wall);
        let mut solve = Solve::new(self, &table, start);
        let points = self.grid.points() as f64;
        let share = self.facing.points() as f64 / points;
        let (mut iterations, mut level, mut stopped) = (0, 0.0, ControlFlow::Continue(()));
        // Residual, nodes with stress and common displacement of the last two states.
        let mut history = [[f64::NAN; 3]; 2];
        let (mut best, mut since, mut kept) = (f64::INFINITY, 0, start.clone());
        loop {
            let r = solve.misfit();
            let deficit = self.pressure * points - solve.stress.iter().sum::<f64>();
            let step = model_step(&solve.factor, (&r, level), &solve.stress, solve.omega, deficit);
            level = step.level;
            // The scale is that of long waves; the model is exact in short ones.
            let residual = (step.square * share / points).sqrt() / (solve.omega.min(1.0) * self.pressure);
            if residual <= tolerance {
                let overlapping = solve.overlapping(-level);
                let complete = overlapping.is_empty();
                solve.admit(&table, overlapping);
                if complete && solve.is_exact || iterations == limit {
                    break;
                }
                if !solve.is_exact {
                    solve.deform();
                }
                iterations += 1;
                continue;
            }
            history = [history[1], [residual, solve.contact_nodes() as f64, level]];
            since += 1;
            if residual < 0.9 * best {
                (best, since, kept) = (residual, 0, solve.contact_stress());
            }
            if since > PATIENCE || iterations == limit || !residual.is_finite() {
                let fft_pairs = solve.fft_pairs;
                (solve, level) = Solve::restored(self, &table, &kept);
                solve.fft_pairs += fft_pairs;
                break;
            }
            stopped = watch(iterations, residual);
            if stopped.is_break() {
                break;
            }
            let entering = solve.advance(step, &r);
            solve.admit(&table, entering);
            if solve.cut > CUT * solve.size {
                solve.deform();
            }
            iterations += 1;
        }
        let stress = solve.contact_stress();
        let Solve { mut gap, fft_pairs, .. } = solve;
        gap.par_iter_mut().for_each(|g| *g += T::of(level));
        let mean_gap = match share < 1.0 {
            true => mean(&self.facing.cut(&gap, self.grid.nx)),
            false => mean(&gap),
        };
        let error_estimates = error_estimates(history, mean_gap);
        Solved { gap, stress, error_estimates, fft_pairs, iterations, stopped }
    }
}

/// Remaining changes, from the last two states.
fn error_estimates([then, now]: [[f64; 3]; 2], mean_gap: f64) -> ErrorEstimates {
    let factor = remaining(now[0], then[0]);
    let rest = |change: Option<f64>| change.map(|c| c * factor).filter(|change| change.is_finite());
    let gap_then = mean_gap + then[2] - now[2];
    ErrorEstimates { area: rest(relative_change(now[1], then[1])), mean_gap: rest(relative_change(mean_gap, gap_then)) }
}

impl<'s, 'h, T: Real> Solve<'s, 'h, T> {
    fn new(contact: &'s Contact<'h, T>, table: &'s ComplianceTable, start: &ContactStress) -> Self {
        let transform = Transform::<T>::new(contact.grid);
        let mut solve = Solve {
            contact,
            factor: InverseFactor::new(table, contact.grid, &start.nodes),
            order: start.nodes.iter().copied().zip(0..).collect(),
            stress: start.values.clone(),
            gap: vec![T::zero(); contact.grid.points()],
            spectrum: transform.spectrum(),
            narrow: Transform::new(contact.grid),
            transform,
            last: None,
            omega: SCALE,
            is_exact: false,
            cut: 0.0,
            size: 0.0,
            fft_pairs: 0.0,
        };
        solve.deform();
        solve
    }

    /// An earlier state, and its common displacement.
    fn restored(contact: &'s Contact<'h, T>, table: &'s ComplianceTable, stress: &ContactStress) -> (Self, f64) {
        let solve = Solve::new(contact, table, stress);
        let step = model_step(&solve.factor, (&solve.misfit(), 0.0), &solve.stress, solve.omega, 0.0);
        (solve, step.level)
    }

    /// The nodes outside of the factor with a gap below `limit`.
    fn overlapping(&self, limit: f64) -> Vec<u32> {
        let (nx, facing, limit) = (self.contact.grid.nx, self.contact.facing, T::of(limit));
        let of_row = |(y, row): (usize, &[T])| {
            let below = row[..facing.inside(y, nx)]
                .iter()
                .zip((y * nx) as u32..)
                .filter(|(g, _)| **g < limit)
                .map(|(_, index)| index);
            below.filter(|index| !self.factor.nodes.contains(*index)).collect::<Vec<u32>>()
        };
        let rows: Vec<Vec<u32>> = self.gap.par_chunks(nx).enumerate().map(of_row).collect();
        rows.concat()
    }

    /// Meets the load and computes the gap from the stress.
    fn deform(&mut self) {
        let Contact { grid, kernel, heights, pressure, .. } = *self.contact;
        let scale = pressure * grid.points() as f64 / self.stress.iter().sum::<f64>();
        self.stress.iter_mut().for_each(|s| *s *= scale);
        let Solve { transform, spectrum, order, stress, .. } = self;
        forward(transform, spectrum, order, stress);
        transform.filter_columns(spectrum, &Deformed { grid, kernel, heights });
        sweep(transform, spectrum, self.gap.par_chunks_mut(grid.nx), |worker, _, spectrum, gap| {
            worker.inverse(spectrum);
            gap.copy_from_slice(&worker.row);
        });
        self.fft_pairs += 1.0;
        (self.cut, self.size, self.is_exact) = (0.0, 0.0, true);
    }

    /// `-(h + Cσ + ℓσ)` on the nodes of the factor: the displacement that is missing but for a constant.
    fn misfit(&self) -> Vec<f64> {
        let mut r = vec![0.0; self.stress.len()];
        for (index, number) in &self.order {
            let number = *number as usize;
            r[number] = -(self.gap[*index as usize].wide() + self.contact.wall * self.stress[number]);
        }
        r
    }

    /// Changes the stress by a step and the last one. Returns the nodes outside of the factor that overlap.
    fn advance(&mut self, step: ModelStep, r: &[f64]) -> Vec<u32> {
        let Contact { grid, kernel, wall, .. } = *self.contact;
        let ModelStep { change, empties, level, .. } = step;
        forward(&self.narrow, first_bytes(&mut self.spectrum), &self.order, &change);
        let compliance =
            |i: usize, column: &mut [Complex<f32>]| multiply((kernel, Factor::Compliance, 0.0), grid, i, column);
        let elastic = grid.points() as f64 * self.narrow.filter_columns(first_bytes(&mut self.spectrum), &compliance);
        let own = elastic + wall * dot(&change, &change);
        let slope = |d: &[f64]| d.iter().zip(r).map(|(d, r)| d * (r - level)).sum::<f64>();
        let descent = slope(&change);
        let alone = descent / own;
        let with = self.last.as_ref().map_or(0.0, |last| {
            let moved =
                |(index, number): &(u32, u32)| change[*number as usize] * f64::from(last.displacement[*index as usize]);
            self.order.iter().map(moved).sum::<f64>() + wall * dot(&change, &last.change)
        });
        let joint = self.last.as_ref().and_then(|last| {
            let (determinant, other) = (own * last.curvature - with * with, slope(&last.change));
            let factors =
                [descent * last.curvature - other * with, other * own - descent * with].map(|f| f / determinant);
            let accepted = factors[0] > 0.0 && factors.iter().all(|f| f.is_finite()) && {
                let total = |i: usize| factors[0] * change[i] + factors[1] * last.change[i];
                let tension: f64 = (0..r.len()).map(|i| (self.stress[i] + total(i)).min(0.0)).sum();
                -tension <= TENSION * (0..r.len()).map(|i| total(i).abs()).sum::<f64>()
            };
            accepted.then_some(factors)
        });
        let whole = empties.iter().any(|e| *e) && alone > WHOLE[0] && alone < WHOLE[1];
        let single = if whole { 1.0 } else { alone.clamp(LENGTH[0], LENGTH[1]) };
        let [new, old] = joint.unwrap_or([single, 0.0]);
        if alone > 0.0 {
            let by = alone.clamp(RESCALED[0], RESCALED[1]);
            self.omega *= if self.last.is_some() { by.sqrt() } else { by };
        }
        let last = self.last.take();
        let earlier = last.as_ref().map_or(0.0, |last| last.curvature);
        let (mut total, displacement) = match last {
            Some(last) => (last.change, last.displacement),
            None => (vec![0.0; r.len()], vec![0.0; grid.points()]),
        };
        total.iter_mut().zip(&change).for_each(|(t, d)| *t = new * d + old * *t);
        let curvature = new * new * own + 2.0 * new * old * with + old * old * earlier;
        self.size = total.iter().map(|t| t.abs()).sum();
        for ((stress, change), empty) in self.stress.iter_mut().zip(&total).zip(&empties) {
            let to = *stress + change;
            self.cut += (-to).max(0.0);
            *stress = if to <= 0.0 || *empty && to < 1e-6 * *stress { 0.0 } else { to };
        }
        self.is_exact = false;
        self.last = Some(LastStep { change: total, displacement, curvature });
        self.displace((new as f32, old as f32), -level)
    }

    /// Adds the displacement of the new step to the gap. Returns the nodes outside of the factor with a gap below `limit`.
    fn displace(&mut self, (new, old): (f32, f32), limit: f64) -> Vec<u32> {
        let (nx, facing) = (self.contact.grid.nx, self.contact.facing);
        let (limit, nodes) = (T::of(limit), &self.factor.nodes);
        let Some(LastStep { displacement, .. }) = &mut self.last else { return Vec::new() };
        let fields = self.gap.par_chunks_mut(nx).zip(displacement.par_chunks_mut(nx));
        let overlapping =
            sweep(&self.narrow, first_bytes(&mut self.spectrum), fields, |worker, y, spectrum, (gap, moved)| {
                worker.inverse(spectrum);
                moved.iter_mut().zip(&worker.row).for_each(|(d, q)| *d = new * q + old * *d);
                gap.iter_mut().zip(&*moved).for_each(|(g, d)| *g += T::of(f64::from(*d)));
                let below = gap[..facing.inside(y, nx)].iter().zip((y * nx) as u32..).filter(|(g, _)| **g < limit);
                below.map(|(_, index)| index).filter(|index| !nodes.contains(*index)).collect::<Vec<u32>>()
            });
        self.fft_pairs += 1.0;
        overlapping.concat()
    }

    /// Takes nodes into the factor, which is built anew where many have joined it or lost their stress.
    fn admit(&mut self, table: &'s ComplianceTable, entering: Vec<u32>) {
        let count = self.stress.len() as f64;
        let without = count - self.contact_nodes() as f64;
        let joined = (self.factor.later() + entering.len()) as f64;
        let contact = self.contact_stress();
        if joined > JOINED * count || without > WITHOUT_STRESS * count {
            let mut nodes: Vec<(u32, f64)> = contact.nodes.iter().copied().zip(contact.values).collect();
            nodes.extend(entering.iter().map(|index| (*index, 0.0)));
            nodes.sort_by_key(|(index, _)| *index);
            self.stress = nodes.iter().map(|(_, stress)| *stress).collect();
            let indices: Vec<u32> = nodes.iter().map(|(index, _)| *index).collect();
            self.order = indices.iter().copied().zip(0..).collect();
            self.last = None;
            // Released before the new one is built.
            self.factor = InverseFactor::new(table, Grid { nx: 1, ny: 1, ..self.contact.grid }, &[]);
            self.factor = InverseFactor::new(table, self.contact.grid, &indices);
        } else if !entering.is_empty() {
            self.order.extend(entering.iter().copied().zip(self.stress.len() as u32..));
            self.order.sort();
            self.factor.extend(&entering);
            self.stress.resize(self.order.len(), 0.0);
            if let Some(last) = &mut self.last {
                last.change.resize(self.order.len(), 0.0);
            }
        }
    }

    fn contact_nodes(&self) -> usize {
        self.stress.iter().filter(|s| **s > 0.0).count()
    }

    fn contact_stress(&self) -> ContactStress {
        let closed = self.order.iter().filter(|(_, number)| self.stress[*number as usize] > 0.0);
        let (nodes, values) = closed.map(|(index, number)| (*index, self.stress[*number as usize])).unzip();
        ContactStress { nodes, values }
    }
}

//! Residuals of the optimality conditions: `t = 0` where the gap may change, `t ≥ 0` where a hard wall closes it.
//!
//! A wall with hardness also bounds the contact stress from above. A node is then open (positive gap, stress 0), closed
//! (zero gap, stress between 0 and the hardness) or flowing (negative gap, stress equal to the hardness). The sign of a
//! zero gap says from which side the node may leave it: `+0` opens, `-0` flows. `t` of nodes whose gap has a negative
//! sign is the stress minus the hardness.

use crate::interface::{Law, NodalHardness};
use asperity_grid::{CHUNK, Real, dot, total, vectorised};
use serde::{Deserialize, Serialize};

/// Tolerance of the load balance over the pressure: the larger of this, for the default tolerance of 1e-8, and
/// `LOAD_SHARE` times the tolerance of the residual.
pub const LOAD_BALANCE: f64 = 1e-9;
pub const LOAD_SHARE: f64 = 0.1;

/// Energies, mean gap and residuals of one evaluation, as means over the grid.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct Residuals {
    /// Energies per area, E*·L.
    pub elastic: f64,
    pub interaction: f64,
    pub mean_gap: f64,
    /// Mean gap of the whole cell, the work conjugate of the pressure; equals `mean_gap` unless part of the cell is
    /// padding.
    pub mean_separation: f64,
    /// Fraction of closed nodes.
    pub contact: f64,
    /// rms of the KKT residual.
    pub residual: f64,
    /// Mean of the KKT residual: the error of the load balance.
    pub imbalance: f64,
    /// Mean of |t g|.
    pub complementarity: f64,
    /// Mean depth of the plastic flow, L.
    #[serde(default)]
    pub flow: f64,
}

/// Surfaces under tension count as separated where the attraction, estimated as energy over range, is below this
/// fraction of the tension; in equilibrium the two are of the same size.
const SEPARATED: f64 = 1e-2;

/// Curvature of the energy along a line over that of the elastic body alone, at and below which it counts as none.
/// Near the jumps of an adhesive wave (tests `adhesive_analytic`) steps left the branch with 0 but not with 0.01;
/// 0.05 costs half as many steps again.
const SOFTENED: f64 = 0.01;

/// Curvature along a line, or none where attraction cancels nearly all of the elastic curvature: the minimum of such
/// a flat parabola is far away, often in another valley, and a step there leaves the branch of the load path.
pub fn curvature_of(elastic: f64, law: f64) -> f64 {
    let curvature = elastic + law;
    if curvature <= SOFTENED * elastic { curvature.min(0.0) } else { curvature }
}

/// Number of sums of [`Nodes::add_to`].
pub const KKT: usize = 8;

/// A law and the hardness of the nodes of a row.
#[derive(Clone, Copy)]
pub struct RowLaw<'l, L> {
    pub law: &'l L,
    pub hardness: NodalHardness<'l>,
}

impl<'l, L: Law> RowLaw<'l, L> {
    /// Of row `y` of fields with `width` facing nodes per row.
    #[inline(always)]
    pub fn of(law: &'l L, y: usize, width: usize) -> Self {
        RowLaw { law, hardness: law.hardness().from_node(y * width) }
    }

    /// Hardness of the chunk of nodes from `i` on.
    #[inline(always)]
    pub fn hardness(&self, i: usize) -> [f64; CHUNK] {
        if L::YIELDS { self.hardness.chunk(i) } else { [f64::INFINITY; CHUNK] }
    }
}

/// Residual of the optimality conditions at one node: the imbalance where the gap may change, else its tensile part
/// and the excess over the `hardness`.
#[inline(always)]
pub fn kkt<L: Law, T: Real>(gap: T, t: T, hardness: f64) -> T {
    if !L::HARD || gap > T::zero() {
        return t;
    }
    if !L::YIELDS {
        return t.min(T::zero());
    }
    if gap < T::zero() {
        return t;
    }
    let hardness = T::of(hardness);
    let stress = if gap.is_sign_negative() { t + hardness } else { t };
    stress.min(T::zero()) + (stress - hardness).max(T::zero())
}

/// Gap after `scale` times a step: a wall stops it at zero, from either side.
#[inline(always)]
pub fn moved<L: Law, T: Real>(g: T, scale: T, step: T) -> T {
    let to = g + scale * step;
    match () {
        () if !L::HARD => to,
        // The sum makes any zero positive: the maximum of two zeros may be either.
        () if L::YIELDS && g.is_sign_negative() => -((-to).max(T::zero()) + T::zero()),
        () => to.max(T::zero()),
    }
}

/// Sets the side on which a closed node may leave the wall, and `t` accordingly: `-0` above the hardness, else `+0`.
#[inline(always)]
pub fn choose_sides<L: Law, T: Real, R: Real>(row: &RowLaw<L>, gap: &mut [T], t: &mut [R]) {
    #[inline(always)]
    fn choose<T: Real, R: Real>(gap: &mut [T], t: &mut [R], hardness: impl Fn(usize) -> f64) {
        for (i, (g, t)) in gap.iter_mut().zip(t).enumerate() {
            let hardness = R::of(hardness(i));
            if *g == T::zero() {
                let stress = if g.is_sign_negative() { *t + hardness } else { *t };
                let flows = stress > hardness;
                *t = if flows { stress - hardness } else { stress };
                *g = if flows { -T::zero() } else { T::zero() };
            }
        }
    }
    if !(L::HARD && L::YIELDS) {
        return;
    }
    match row.hardness {
        NodalHardness::Uniform(value) => choose(gap, t, |_| value),
        map => choose(gap, t, |i| map.at(i)),
    }
}

/// Values of a law at the gaps of a chunk; zeros without evaluation where all gaps are beyond its cutoff.
#[inline(always)]
pub fn each<L: Law>(law: &L, gaps: &[f64; CHUNK], value: impl Fn(&L, f64) -> f64) -> [f64; CHUNK] {
    let mut values = [0.0; CHUNK];
    let end = law.cutoff();
    if L::ACTIVE && gaps.iter().any(|g| *g < end) {
        values.iter_mut().zip(gaps).for_each(|(v, g)| *v = value(law, *g));
    }
    values
}

/// A chunk of nodes (the last of a row has fewer) whose sums are taken. Elements past the end are ignored.
pub struct Nodes<T> {
    pub gap: [T; CHUNK],
    /// Elastic stress plus pressure, to which [`Nodes::add_to`] adds the traction of the law.
    pub imbalance: [T; CHUNK],
    /// Residual of an earlier state, for the product of the two.
    pub old: [f64; CHUNK],
    pub hardness: [f64; CHUNK],
}

impl<T: Real> Nodes<T> {
    #[inline(always)]
    pub fn new(hardness: [f64; CHUNK]) -> Self {
        Nodes { gap: [T::zero(); CHUNK], imbalance: [T::zero(); CHUNK], old: [0.0; CHUNK], hardness }
    }

    /// Adds, for the first `n` nodes, residual², residual, |t g|, g, v(g), closed nodes, depth of flow, residual times
    /// the old one.
    #[inline(always)]
    pub fn add_to<L: Law>(&mut self, n: usize, law: &L, sums: &mut [f64; KKT]) {
        let gap = self.gap.map(
            #[inline(always)]
            |g| g.wide(),
        );
        if L::ACTIVE {
            let traction = each(
                law,
                &gap,
                #[inline(always)]
                |law, g| law.traction(g),
            );
            self.imbalance.iter_mut().zip(traction).for_each(|(t, traction)| *t += T::of(traction));
            sums[4] += total(
                &each(
                    law,
                    &gap,
                    #[inline(always)]
                    |law, g| law.energy(g),
                )[..n],
            );
        }
        if L::YIELDS {
            self.yielding(n, law, &gap, sums);
        }
        let (mut residual, mut work, mut closed) = ([0.0; CHUNK], [0.0; CHUNK], [0.0; CHUNK]);
        for i in 0..CHUNK {
            let t = self.imbalance[i].wide();
            residual[i] = kkt::<L, _>(gap[i], t, self.hardness[i]);
            work[i] = (t * gap[i]).abs();
            closed[i] = if gap[i] <= 0.0 { 1.0 } else { 0.0 };
        }
        sums[0] += dot(&residual[..n], &residual[..n]);
        sums[1] += total(&residual[..n]);
        sums[2] += total(&work[..n]);
        sums[3] += total(&gap[..n]);
        sums[5] += total(&closed[..n]);
        sums[7] += dot(&residual[..n], &self.old[..n]);
    }

    /// Depth of the flow, and for a hard wall its stress and energy, which the law leaves out.
    #[inline(always)]
    fn yielding<L: Law>(&mut self, n: usize, law: &L, gap: &[f64; CHUNK], sums: &mut [f64; KKT]) {
        let first = law.yield_gap();
        let mut depth = [0.0; CHUNK];
        for i in 0..CHUNK {
            depth[i] = (first - gap[i]).max(0.0);
            if L::HARD && gap[i].is_sign_negative() {
                self.imbalance[i] -= T::of(self.hardness[i]);
            }
        }
        let whole = total(&depth[..n]);
        sums[6] += whole;
        if L::HARD && whole > 0.0 {
            sums[4] += match law.hardness() {
                NodalHardness::Uniform(value) => value * whole,
                NodalHardness::Map { .. } => dot(&self.hardness[..n], &depth[..n]),
            };
        }
    }
}

/// Sums of one row. On return `t`, the elastic stress plus pressure, contains the traction of the law as well.
pub fn kkt_row<L: Law, T: Real>(row: RowLaw<L>, gap: &[T], t: &mut [T]) -> [f64; KKT] {
    vectorised(
        #[inline(always)]
        || {
            let mut sums = [0.0; KKT];
            for (k, (gap, t)) in gap.chunks(CHUNK).zip(t.chunks_mut(CHUNK)).enumerate() {
                let mut nodes = Nodes::new(row.hardness(k * CHUNK));
                nodes.gap[..gap.len()].copy_from_slice(gap);
                nodes.imbalance[..t.len()].copy_from_slice(t);
                nodes.add_to(t.len(), row.law, &mut sums);
                t.copy_from_slice(&nodes.imbalance[..t.len()]);
            }
            sums
        },
    )
}

impl Residuals {
    pub fn new(points: usize, elastic: f64, sums: &[f64]) -> Self {
        let mean = |i: usize| sums[i] / points as f64;
        // The clamp of a hard wall turns a NaN into a closed gap without a residual; the elastic energy remains NaN.
        let residual = if elastic.is_finite() { mean(0).sqrt() } else { f64::NAN };
        Residuals {
            elastic,
            residual,
            imbalance: mean(1),
            complementarity: mean(2),
            mean_gap: mean(3) + mean(6),
            mean_separation: mean(3),
            interaction: mean(4),
            contact: mean(5),
            flow: mean(6),
        }
    }

    /// Sum of the magnitudes of the energy terms: the scale of the rounding error of the energy.
    pub fn magnitude(&self, pressure: f64) -> f64 {
        self.elastic.abs() + self.interaction.abs() + (pressure * self.mean_separation).abs()
    }

    /// Whether the residual is within the tolerance and the forces balance, both over `scale`.
    pub fn meets(&self, tolerance: f64, scale: f64) -> bool {
        let load = LOAD_BALANCE.max(LOAD_SHARE * tolerance);
        self.residual <= tolerance * scale && self.imbalance.abs() <= load * scale
    }

    /// Whether a tensile pressure has separated the surfaces, for a law of this range.
    pub fn separated(&self, pressure: f64, range: f64) -> bool {
        pressure < 0.0 && self.interaction.abs() < SEPARATED * -pressure * range
    }

    /// Free energy per area at a pressure.
    pub fn energy(&self, pressure: f64) -> f64 {
        self.elastic + self.interaction + pressure * self.mean_separation
    }
}

//! Vectorised loops of the sweeps over a row of nodes, between its inverse and its next forward transform.
//!
//! With a non-periodic body only the first nodes of the first rows face the rigid surface. The rest of the periodic
//! cell is padding with a free surface: the same loops with the law [`FreeSurface`].

use crate::interface::Law;
use crate::method::residuals::{KKT, Nodes, RowLaw, choose_sides, each, kkt, kkt_row, moved};
use asperity_grid::{CHUNK, Real, dot, vectorised};
use half::bf16;

/// Neither wall nor attraction.
#[derive(Clone, Copy)]
struct FreeSurface;

impl Law for FreeSurface {
    const ACTIVE: bool = false;
    const HARD: bool = false;

    fn traction(&self, _: f64) -> f64 {
        0.0
    }

    fn energy(&self, _: f64) -> f64 {
        0.0
    }

    fn slope(&self, _: f64) -> f64 {
        0.0
    }

    fn max_slope(&self, _: f64) -> f64 {
        0.0
    }
}

/// Mark of closed nodes in a direction.
const CLOSED: bf16 = bf16::NEG_ZERO;

#[inline(always)]
fn is_closed(d: bf16) -> bool {
    d.to_bits() == CLOSED.to_bits()
}

/// Rounds a direction to a value other than the mark. `bf16::from_f32` also handles NaN, at four times the cost.
#[inline(always)]
fn rounded_direction(d: f32) -> bf16 {
    let bits = d.to_bits();
    let rounded = (bits.wrapping_add(0x7fff + (bits >> 16 & 1)) >> 16) as u16;
    bf16::from_bits(if rounded == CLOSED.to_bits() { 0 } else { rounded })
}

#[inline(always)]
pub(super) fn wide(d: bf16) -> f32 {
    f32::from_bits(u32::from(d.to_bits()) << 16)
}

/// Whether a node is free: open or flowing, or closed under tension or above the hardness ([`choose_sides`]).
#[inline(always)]
fn is_free<L: Law, T: Real>(g: T, t: f32) -> bool {
    if L::HARD && L::YIELDS {
        return g != T::zero() || if g.is_sign_negative() { t > 0.0 } else { t < 0.0 };
    }
    !L::HARD || g > T::zero() || t < 0.0
}

/// `v''` at the nodes of a chunk; 0 without a law.
#[inline(always)]
fn slopes<T: Real, L: Law>(law: &L, gap: &[T]) -> [f64; CHUNK] {
    if !L::ACTIVE {
        return [0.0; CHUNK];
    }
    let mut gaps = [f64::INFINITY; CHUNK];
    gaps.iter_mut().zip(gap).for_each(|(wide, g)| *wide = g.wide());
    each(
        law,
        &gaps,
        #[inline(always)]
        |law, g| law.slope(g),
    )
}

/// `v'' d` at the nodes of a chunk.
#[inline(always)]
fn forces(slopes: &[f64; CHUNK], direction: &[f32; CHUNK]) -> [f64; CHUNK] {
    let mut forces = *slopes;
    forces.iter_mut().zip(direction).for_each(|(f, &d)| *f *= f64::from(d));
    forces
}

/// `Σ v'' d²`: contribution of the law to the curvature along a direction.
#[inline(always)]
fn law_curvature<T: Real, L: Law>(law: &L, gap: &[T], direction: &[f32]) -> f64 {
    if !L::ACTIVE {
        return 0.0;
    }
    let mut sum = 0.0;
    for (gap, direction) in gap.chunks(CHUNK).zip(direction.chunks(CHUNK)) {
        let mut d = [0.0; CHUNK];
        d[..direction.len()].copy_from_slice(direction);
        sum += dot(&forces(&slopes(law, gap), &d), &d);
    }
    sum
}

/// Weights of a chunk of nodes in the preconditioner of a soft wall: `w = √(k/(k + v''))`, with which the compliance of the waves is
/// multiplied on both sides, and a node's own compliance `v''/(k + v'')²`. `k` is the stiffness of a node whose neighbours rest.
#[inline(always)]
fn weights(slopes: &[f64; CHUNK], k: f64) -> ([f32; CHUNK], [f32; CHUNK]) {
    let (mut shared, mut own) = ([1.0; CHUNK], [0.0; CHUNK]);
    // Most chunks are open.
    if slopes.iter().all(|slope| *slope <= 0.0) {
        return (shared, own);
    }
    for ((w, c), slope) in shared.iter_mut().zip(&mut own).zip(slopes) {
        let (slope, all) = (slope.max(0.0), k + slope.max(0.0));
        (*w, *c) = ((k / all).sqrt() as f32, (slope / (all * all)) as f32);
    }
    (shared, own)
}

/// Whether nodes have weights in the preconditioner. A hard wall has none: its closed nodes are not free.
#[inline(always)]
fn is_weighted<L: Law>() -> bool {
    L::ACTIVE && !L::HARD
}

/// The residual of a chunk, weighted for the compliance of the waves, into `row`. Returns `Σ r c r` with the nodes' own compliance.
#[inline(always)]
fn weighted<L: Law>(slopes: &[f64; CHUNK], k: f64, residual: &[f32], row: &mut [f32]) -> f64 {
    if !is_weighted::<L>() {
        row.copy_from_slice(residual);
        return 0.0;
    }
    let (shared, own) = weights(slopes, k);
    let (mut r, mut scaled) = ([0.0; CHUNK], [0.0; CHUNK]);
    r[..residual.len()].copy_from_slice(residual);
    scaled.iter_mut().zip(&own).zip(&r).for_each(|((s, c), r)| *s = f64::from(c * r));
    row.iter_mut().zip(&r).zip(&shared).for_each(|((to, r), w)| *to = w * r);
    dot(&scaled, &r)
}

/// Adds `scale` times a step to the gap, of which the first `inside` nodes face the rigid surface.
pub(super) fn apply_step<L: Law, T: Real>(inside: usize, gap: &mut [T], scale: T, step: &[f32]) {
    #[inline(always)]
    fn part<L: Law, T: Real>(gap: &mut [T], scale: T, step: &[f32]) {
        gap.iter_mut().zip(step).for_each(|(g, &s)| *g = moved::<L, T>(*g, scale, T::of(f64::from(s))));
    }
    vectorised(
        #[inline(always)]
        || {
            part::<L, T>(&mut gap[..inside], scale, &step[..inside]);
            part::<FreeSurface, T>(&mut gap[inside..], scale, &step[inside..]);
        },
    );
}

/// As [`apply_step`], written to `row`.
pub(super) fn shifted<L: Law, T: Real, W: Real>(inside: usize, gap: &[T], scale: T, step: &[f32], row: &mut [W]) {
    #[inline(always)]
    fn part<L: Law, T: Real, W: Real>(gap: &[T], scale: T, step: &[f32], row: &mut [W]) {
        row.iter_mut()
            .zip(gap)
            .zip(step)
            .for_each(|((to, &g), &s)| *to = W::of(moved::<L, T>(g, scale, T::of(f64::from(s))).wide()));
    }
    vectorised(
        #[inline(always)]
        || {
            part::<L, T, W>(&gap[..inside], scale, &step[..inside], &mut row[..inside]);
            part::<FreeSurface, T, W>(&gap[inside..], scale, &step[inside..], &mut row[inside..]);
        },
    )
}

/// Sums of a trial state: [`KKT`] sums over the facing nodes, of which the first two and the last include the
/// padding, and the gap of the padding. `elastic_stress` is `K(g - h)`; `residual` is that of the last state and is
/// replaced.
pub(super) fn trial<L: Law, T: Real, W: Real>(
    law: RowLaw<L>,
    inside: usize,
    (gap, scale, step): (&[T], T, &[f32]),
    (elastic_stress, pressure): (&[W], T),
    residual: &mut [f32],
) -> [f64; KKT + 1] {
    #[inline(always)]
    fn part<L: Law, T: Real, W: Real>(
        law: RowLaw<L>,
        (gap, scale, step): (&[T], T, &[f32]),
        (elastic_stress, pressure): (&[W], T),
        residual: &mut [f32],
    ) -> [f64; KKT] {
        let mut sums = [0.0; KKT];
        let chunks = gap.chunks(CHUNK).zip(step.chunks(CHUNK)).zip(elastic_stress.chunks(CHUNK));
        for (k, (((gap, step), elastic_stress), residual)) in chunks.zip(residual.chunks_mut(CHUNK)).enumerate() {
            let mut nodes = Nodes::new(law.hardness(k * CHUNK));
            for ((to, &g), &s) in nodes.gap.iter_mut().zip(gap).zip(step) {
                *to = moved::<L, T>(g, scale, T::of(f64::from(s)));
            }
            for (((old, g), r), h) in nodes.old.iter_mut().zip(gap).zip(&*residual).zip(&nodes.hardness) {
                *old = f64::from(kkt::<L, _>(g.wide() as f32, *r, *h));
            }
            nodes.imbalance.iter_mut().zip(elastic_stress).for_each(|(t, &r)| *t = T::of(r.wide()) + pressure);
            nodes.add_to(gap.len(), law.law, &mut sums);
            residual.iter_mut().zip(&nodes.imbalance).for_each(|(r, t)| *r = t.wide() as f32);
        }
        sums
    }
    let (facing, padding) = residual.split_at_mut(inside);
    vectorised(
        #[inline(always)]
        || {
            let facing_nodes = (&gap[..inside], scale, &step[..inside]);
            let sums = part(law, facing_nodes, (&elastic_stress[..inside], pressure), facing);
            if padding.is_empty() {
                return with_free(sums, None);
            }
            let in_padding = (&gap[inside..], scale, &step[inside..]);
            with_free(
                sums,
                Some(part(RowLaw::of(&FreeSurface, 0, 0), in_padding, (&elastic_stress[inside..], pressure), padding)),
            )
        },
    )
}

/// Combines the sums over the facing nodes with those over the padding.
fn with_free(facing: [f64; KKT], free: Option<[f64; KKT]>) -> [f64; KKT + 1] {
    let mut sums = [0.0; KKT + 1];
    sums[..KKT].copy_from_slice(&facing);
    if let Some(free) = free {
        for k in [0, 1, KKT - 1] {
            sums[k] += free[k];
        }
        sums[KKT] = free[3];
    }
    sums
}

/// Applies the `pending` step, then sets the direction `-t + β d` on the free nodes and copies it to step and `row`.
/// Returns `Σ t d` and `Σ v'' d²`.
pub(super) fn plain<L: Law, T: Real>(
    law: RowLaw<L>,
    inside: usize,
    (gap, pending, step): (&mut [T], T, &mut [f32]),
    (direction, beta, t): (&mut [bf16], f32, &mut [f32]),
    row: &mut [f32],
) -> [f64; 2] {
    #[inline(always)]
    fn part<L: Law, T: Real>(
        (gap, step): (&[T], &mut [f32]),
        (direction, beta, t): (&mut [bf16], f32, &[f32]),
        row: &mut [f32],
    ) {
        let chunks = direction.chunks_mut(CHUNK).zip(step.chunks_mut(CHUNK)).zip(t.chunks(CHUNK));
        for ((((direction, step), t), gap), row) in chunks.zip(gap.chunks(CHUNK)).zip(row.chunks_mut(CHUNK)) {
            let (mut to, mut marked) = ([0.0; CHUNK], [CLOSED; CHUNK]);
            for ((((to, m), &d), &t), &g) in to.iter_mut().zip(&mut marked).zip(&*direction).zip(t).zip(gap) {
                let moves = is_free::<L, T>(g, t);
                *to = if moves { beta * wide(d) - t } else { 0.0 };
                *m = if moves { rounded_direction(*to) } else { CLOSED };
            }
            let n = row.len();
            direction.copy_from_slice(&marked[..n]);
            step.copy_from_slice(&to[..n]);
            row.copy_from_slice(&to[..n]);
        }
    }
    apply_step::<L, T>(inside, gap, pending, step);
    vectorised(
        #[inline(always)]
        || {
            choose_sides(&law, &mut gap[..inside], &mut t[..inside]);
            let ((d, d_free), (s, s_free)) = (direction.split_at_mut(inside), step.split_at_mut(inside));
            let (facing, padding) = row.split_at_mut(inside);
            part::<L, T>((&gap[..inside], s), (d, beta, &t[..inside]), facing);
            part::<FreeSurface, T>((&gap[inside..], s_free), (d_free, beta, &t[inside..]), padding);
            [dot(t, row), law_curvature(law.law, &gap[..inside], &row[..inside])]
        },
    )
}

/// Applies the `pending` step, sets the residual of the linear problem to `-t` on the free nodes, and step and
/// direction to zero. Returns `Σ r²` and [`weighted`] sum; `row` becomes the weighted residual.
pub(super) fn begin<L: Law, T: Real>(
    (law, node_stiffness): (RowLaw<L>, f64),
    inside: usize,
    (gap, pending, step): (&mut [T], T, &mut [f32]),
    (residual, direction): (&mut [f32], &mut [bf16]),
    row: &mut [f32],
) -> [f64; 2] {
    #[inline(always)]
    fn part<L: Law, T: Real>(gap: &[T], residual: &mut [f32], direction: &mut [bf16]) {
        for ((r, d), &g) in residual.iter_mut().zip(direction).zip(gap) {
            let moves = is_free::<L, T>(g, *r);
            *r = if moves { -*r } else { 0.0 };
            *d = if moves { bf16::ZERO } else { CLOSED };
        }
    }
    apply_step::<L, T>(inside, gap, pending, step);
    step.fill(0.0);
    vectorised(
        #[inline(always)]
        || {
            choose_sides(&law, &mut gap[..inside], &mut residual[..inside]);
            let ((r, r_free), (d, d_free)) = (residual.split_at_mut(inside), direction.split_at_mut(inside));
            part::<L, T>(&gap[..inside], r, d);
            part::<FreeSurface, T>(&gap[inside..], r_free, d_free);
            row[inside..].copy_from_slice(r_free);
            let mut own = 0.0;
            let chunks = gap[..inside].chunks(CHUNK).zip(r.chunks(CHUNK)).zip(row[..inside].chunks_mut(CHUNK));
            for ((gap, r), row) in chunks {
                let slopes = if is_weighted::<L>() { slopes(law.law, gap) } else { [0.0; CHUNK] };
                own += weighted::<L>(&slopes, node_stiffness, r, row);
            }
            [dot(residual, residual), own]
        },
    )
}

/// `d = z + β d` on the free nodes, with the preconditioned residual z: the compliance of the waves times the weighted residual, in `row`,
/// which becomes d. Returns `Σ v'' d²`.
pub(super) fn conjugate<L: Law, T: Real>(
    (law, node_stiffness): (&L, f64),
    inside: usize,
    (gap, residual): (&[T], &[f32]),
    (direction, beta): (&mut [bf16], f32),
    row: &mut [f32],
) -> f64 {
    #[inline(always)]
    fn part((direction, beta): (&mut [bf16], f32), row: &mut [f32]) {
        for (d, r) in direction.iter_mut().zip(row) {
            let closed = is_closed(*d);
            let to = rounded_direction(*r + beta * wide(*d));
            (*d, *r) = if closed { (CLOSED, 0.0) } else { (to, wide(to)) };
        }
    }
    vectorised(
        #[inline(always)]
        || {
            let ((d, d_free), (z, z_free)) = (direction.split_at_mut(inside), row.split_at_mut(inside));
            part((d_free, beta), z_free);
            if !is_weighted::<L>() {
                part((d, beta), z);
                return law_curvature(law, &gap[..inside], z);
            }
            let mut sum = 0.0;
            let nodes = gap[..inside].chunks(CHUNK).zip(residual[..inside].chunks(CHUNK));
            for ((gap, residual), (direction, row)) in nodes.zip(d.chunks_mut(CHUNK).zip(z.chunks_mut(CHUNK))) {
                let slopes = slopes(law, gap);
                let (shared, own) = weights(&slopes, node_stiffness);
                let weights = shared.iter().zip(&own);
                row.iter_mut().zip(residual).zip(weights).for_each(|((z, r), (w, c))| *z = w * *z + c * r);
                part((direction, beta), row);
                let mut d = [0.0; CHUNK];
                d[..row.len()].copy_from_slice(row);
                sum += dot(&forces(&slopes, &d), &d);
            }
            sum
        },
    )
}

/// `x += α d` and `r -= α H d` on the free nodes, with `K d` in `row`, which becomes the weighted residual. Returns `Σ r²` and
/// [`weighted`] sum.
pub(super) fn descend<L: Law, T: Real>(
    (law, node_stiffness): (&L, f64),
    inside: usize,
    gap: &[T],
    (direction, alpha): (&[bf16], f32),
    (step, residual): (&mut [f32], &mut [f32]),
    row: &mut [f32],
) -> [f64; 2] {
    #[inline(always)]
    fn part<L: Law, T: Real>(
        (law, k): (&L, f64),
        gap: &[T],
        (direction, alpha): (&[bf16], f32),
        (step, residual): (&mut [f32], &mut [f32]),
        row: &mut [f32],
    ) -> f64 {
        let mut own = 0.0;
        let chunks = step.chunks_mut(CHUNK).zip(residual.chunks_mut(CHUNK)).zip(direction.chunks(CHUNK));
        for ((((step, residual), direction), gap), row) in chunks.zip(gap.chunks(CHUNK)).zip(row.chunks_mut(CHUNK)) {
            let mut d = [0.0; CHUNK];
            d.iter_mut().zip(direction).for_each(|(d, stored)| *d = wide(*stored));
            step.iter_mut().zip(&d).for_each(|(s, d)| *s += alpha * d);
            let slopes = slopes(law, gap);
            let softened = if L::ACTIVE { forces(&slopes, &d) } else { [0.0; CHUNK] };
            for (((r, &stored), &stress), &soft) in residual.iter_mut().zip(direction).zip(&*row).zip(&softened) {
                let left = *r - alpha * (stress + soft as f32);
                *r = if is_closed(stored) { 0.0 } else { left };
            }
            own += weighted::<L>(&slopes, k, residual, row);
        }
        own
    }
    vectorised(
        #[inline(always)]
        || {
            let ((s, s_free), (r, r_free)) = (step.split_at_mut(inside), residual.split_at_mut(inside));
            let ((d, d_free), (row, row_free)) = (direction.split_at(inside), row.split_at_mut(inside));
            let own = part((law, node_stiffness), &gap[..inside], (d, alpha), (s, r), row);
            part((&FreeSurface, node_stiffness), &gap[inside..], (d_free, alpha), (s_free, r_free), row_free);
            [dot(residual, residual), own]
        },
    )
}

/// Sums of a state, as in [`trial`]. On return `stress`, the elastic stress plus pressure, contains the traction of
/// the law as well.
pub(super) fn residuals<L: Law, T: Real>(law: RowLaw<L>, inside: usize, gap: &[T], stress: &mut [T]) -> [f64; KKT + 1] {
    let (facing, padding) = stress.split_at_mut(inside);
    let free =
        if padding.is_empty() { None } else { Some(kkt_row(RowLaw::of(&FreeSurface, 0, 0), &gap[inside..], padding)) };
    with_free(kkt_row(law, &gap[..inside], facing), free)
}

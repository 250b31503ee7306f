//! A step of the contact stress that keeps it compressive, by the sparse model of the compliance alone.

use super::factor::InverseFactor;

/// Changes of the set of emptied nodes per step.
const ROUNDS: usize = 3;

/// Iterations of each of its linear problems, and their tolerance.
const ITERATIONS: usize = 40;
const TOLERANCE: f64 = 0.1;

/// Stress over the largest one that counts as none, by rounding.
const ROUNDING: f64 = 1e-13;

/// A change of the stress.
pub(super) struct ModelStep {
    pub change: Vec<f64>,
    /// Nodes that lose their stress.
    pub empties: Vec<bool>,
    /// The displacement that the remaining nodes have in common.
    pub level: f64,
    /// `Σ d²`.
    pub square: f64,
}

/// The change `d` that minimises `½ d S⁻¹ d/ω - r d` with `stress + d ≥ 0` and `Σ d = load`, by a primal-dual active
/// set: a node stays empty while its multiplier is positive. Nodes without stress begin as empty, with a multiplier that cancels
/// their distance from `level`, the last common displacement; only what is missing is then solved for.
pub(super) fn model_step(
    s: &InverseFactor,
    (r, level): (&[f64], f64),
    stress: &[f64],
    omega: f64,
    load: f64,
) -> ModelStep {
    let n = r.len();
    let projected = |product: Vec<f64>, load: f64| {
        let level = (product.iter().sum::<f64>() - load / omega) / s.ones_sum;
        let z: Vec<f64> = product.iter().zip(&s.ones).map(|(z, one)| omega * (z - level * one)).collect();
        (z, level)
    };
    let known: Vec<f64> =
        r.iter().zip(stress).map(|(r, stress)| if *stress == 0.0 { (level - r).max(0.0) } else { 0.0 }).collect();
    let driving: Vec<f64> = r.iter().zip(&known).map(|(r, known)| r + known).collect();
    let (free, free_level) = projected(s.product(&driving), load);
    let least = -ROUNDING * stress.iter().copied().fold(0.0, f64::max);
    let mut empties = vec![false; n];
    let mut multiplier = known.clone();
    let (mut z, mut level) = (free.clone(), free_level);
    let (mut work, mut all) = (vec![0.0; n], vec![0.0; 2 * n]);
    for round in 0..ROUNDS {
        let next: Vec<bool> =
            (0..n).map(|i| (empties[i] || round == 0) && multiplier[i] > 0.0 || stress[i] + z[i] < least).collect();
        if next == empties {
            break;
        }
        empties = next;
        let subset: Vec<u32> = (0..n as u32).filter(|i| empties[*i as usize]).collect();
        let missing: Vec<f64> = subset.iter().map(|&i| -stress[i as usize] - free[i as usize]).collect();
        let ones: Vec<f64> = subset.iter().map(|&i| s.ones[i as usize]).collect();
        let solution = conjugate_gradients(&missing, |v| {
            let mut product = s.product_on(&subset, v, (&mut work, &mut all));
            let level = dot(&ones, v) / s.ones_sum;
            product.iter_mut().zip(&ones).for_each(|(p, one)| *p = omega * (*p - level * one));
            product
        });
        let mut added = vec![0.0; n];
        subset.iter().zip(&solution).for_each(|(i, v)| added[*i as usize] = *v);
        let (change, shift) = projected(s.product(&added), 0.0);
        z = change.iter().zip(&free).map(|(z, free)| z + free).collect();
        level = free_level + shift;
        multiplier = added.iter().zip(&known).map(|(added, known)| added + known).collect();
    }
    finish(s, (stress, z, empties), load, level)
}

/// Empties the nodes that would lose more than their stress, and meets the load exactly.
fn finish(
    s: &InverseFactor,
    (stress, mut z, mut empties): (&[f64], Vec<f64>, Vec<bool>),
    load: f64,
    level: f64,
) -> ModelStep {
    for ((z, empty), stress) in z.iter_mut().zip(&mut empties).zip(stress) {
        *empty |= stress + *z < 0.0;
        *z = if *empty { -stress } else { *z };
    }
    let miss = z.iter().sum::<f64>() - load;
    let kept: f64 = s.ones.iter().zip(&empties).filter(|(_, empty)| !**empty).map(|(one, _)| one).sum();
    let by = if kept > 0.0 { miss / kept } else { 0.0 };
    let square = dot(&z, &z);
    for (i, z) in z.iter_mut().enumerate().filter(|(i, _)| !empties[*i]) {
        *z = (*z - by * s.ones[i]).max(-stress[i]);
    }
    ModelStep { change: z, empties, level, square }
}

pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn conjugate_gradients(b: &[f64], mut product: impl FnMut(&[f64]) -> Vec<f64>) -> Vec<f64> {
    let (mut x, mut r, mut d) = (vec![0.0; b.len()], b.to_vec(), b.to_vec());
    let first = dot(&r, &r);
    let mut rr = first;
    for _ in 0..ITERATIONS {
        if rr <= TOLERANCE * TOLERANCE * first {
            break;
        }
        let q = product(&d);
        let curvature = dot(&d, &q);
        if curvature <= 0.0 {
            break;
        }
        let alpha = rr / curvature;
        x.iter_mut().zip(&d).for_each(|(x, d)| *x += alpha * d);
        r.iter_mut().zip(&q).for_each(|(r, q)| *r -= alpha * q);
        let old = rr;
        rr = dot(&r, &r);
        d.iter_mut().zip(&r).for_each(|(d, r)| *d = r + rr / old * *d);
    }
    x
}

#[cfg(test)]
mod tests {
    use super::super::factor::ComplianceTable;
    use super::*;
    use crate::interface::Elastic;
    use asperity_grid::Grid;

    /// Against the conditions of the minimum: the load, no tension, the same remaining displacement of all nodes with stress, and a larger one
    /// of those without, which the others' multipliers must not pull into contact.
    #[test]
    fn steps_meet_the_conditions_of_the_model() {
        /// Of the displacement of emptied nodes: that of the linear problems, [`TOLERANCE`], and of a set that may still change by a node.
        const REMAINING: f64 = 0.2;
        let grid = Grid::unit(16, 16);
        let table = ComplianceTable::new(grid, &Elastic::HalfSpace, 0.0);
        let nodes: Vec<u32> = (0..256).filter(|i| i * 7919 % 7 < 2).collect();
        let factor = InverseFactor::new(&table, grid, &nodes);
        let n = nodes.len();
        let stress: Vec<f64> = (0..n).map(|i| ((i * 31) % 5) as f64 * 0.2).collect();
        let r: Vec<f64> = (0..n).map(|i| 0.02 * (i as f64 * 2.3).sin()).collect();
        let load = 0.3;
        let step = model_step(&factor, (&r, 0.0), &stress, 1.0, load);
        assert!((step.change.iter().sum::<f64>() - load).abs() < 1e-9);
        assert!(step.change.iter().zip(&stress).all(|(d, s)| s + d >= 0.0));
        // x = S⁻¹ d by conjugate gradients.
        let (mut x, mut r_x) = (vec![0.0; n], step.change.clone());
        let mut d = r_x.clone();
        for _ in 0..500 {
            let q = factor.product(&d);
            let (rr, alpha) = (dot(&r_x, &r_x), dot(&r_x, &r_x) / dot(&d, &q));
            x.iter_mut().zip(&d).for_each(|(x, d)| *x += alpha * d);
            r_x.iter_mut().zip(&q).for_each(|(r, q)| *r -= alpha * q);
            let beta = dot(&r_x, &r_x) / rr;
            if beta == 0.0 || dot(&r_x, &r_x) < 1e-24 {
                break;
            }
            d.iter_mut().zip(&r_x).for_each(|(d, r)| *d = r + beta * *d);
        }
        let apart: Vec<f64> = (0..n).map(|i| x[i] - (r[i] - step.level)).collect();
        let [emptied, kept]: [Vec<f64>; 2] =
            [true, false].map(|empty| (0..n).filter(|i| step.empties[*i] == empty).map(|i| apart[i]).collect());
        let mean = emptied.iter().sum::<f64>() / emptied.len() as f64;
        assert!(emptied.len() > 3 && mean > 0.0, "{emptied:?}");
        assert!(emptied.iter().all(|a| *a > -REMAINING * mean), "{emptied:?}");
        assert!(kept.iter().all(|a| a.abs() < REMAINING * mean), "{mean}: {kept:?}");
    }
}

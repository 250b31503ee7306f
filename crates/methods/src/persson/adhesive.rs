//! Diffusion of the contact stress with adhesion: contact is lost at the tension at which a crack opens (Persson,
//! Eur. Phys. J. E 8 (2002) 385; Persson & Scaraggi, J. Chem. Phys. 141 (2014) 124701), the JKR limit of adhesion
//! without range.
//!
//! The stress distribution broadens as its variance increases with the added waves, and is zero at the detachment
//! tension -σ_a. It is represented on a grid of stresses above that tension, which moves. The tension of area that
//! detaches is redistributed to the remaining contact, so that the contact carries exactly the pressure; in the
//! published theory it is lost.

use super::roughening::{SpectralBand, contact_area, full_contact_energy, relaxed};
use asperity_contact::method::Stop;
use std::f64::consts::SQRT_2;

/// Resolution: relative increase of the variance per step, and stress spacing over the rms stress of full contact.
#[derive(Debug, Clone, Copy)]
pub(super) struct Resolution {
    pub growth: f64,
    pub stress: f64,
}

impl Resolution {
    /// Areas without adhesion are within 1e-3 of their closed form.
    pub(super) const DEFAULT: Resolution = Resolution { growth: 0.06, stress: 0.012 };
}

/// rms stress over the grid spacing at which the grid replaces the closed form.
const RESOLVED: f64 = 6.0;

/// Extent of the grid above the mean, in rms stresses of full contact.
const REACH: f64 = 6.0;

/// Pressure over the rms stress of full contact above which the contact is complete: the tail of the Gaussian is
/// below 1e-22.
const CLOSED: f64 = 10.0;

/// Fixed-point iterations for tensions and areas, and the relative change of the area at which they end.
const MOST_ROUNDS: usize = 60;
pub(super) const TOLERANCE: f64 = 1e-7;

/// Consecutive bands that are added in one step.
struct CascadeStep {
    /// Variance of the full-contact stress with all waves up to this step.
    variance: f64,
    q: f64,
    /// Elastic energy per area of full contact.
    energy: f64,
}

pub(super) struct Cascade {
    steps: Vec<CascadeStep>,
    c: f64,
    gamma: f64,
    relaxed: f64,
    mesh: Resolution,
}

/// Contact at a pressure.
#[derive(Debug, Clone)]
pub(super) struct CascadeSolution {
    pub contact_area: f64,
    /// Relative error of the mean stress.
    pub load_error: f64,
    /// Relative change of the contact fraction in the last sweep.
    pub residual: f64,
    /// Elastic energy minus adhesive energy per area, E*·L.
    pub energy: f64,
    pub stop: Stop,
    /// Sweeps through the waves.
    pub sweeps: usize,
    /// Detachment tension of each step: initial values for the next pressure.
    tension: Vec<f64>,
}

/// One sweep: contact fraction after each step, and the final mean stress.
struct CascadeSweep {
    fractions: Vec<f64>,
    load: f64,
}

impl Cascade {
    /// `gamma` is the work of adhesion, `relaxation` the factor of the elastic energy.
    pub(super) fn new(bands: &[SpectralBand], c: f64, gamma: f64, relaxation: f64, mesh: Resolution) -> Self {
        let mut steps: Vec<CascadeStep> = Vec::new();
        for band in bands {
            let (variance, energy) = (0.5 * band.after() / (c * c), full_contact_energy(band));
            let joins = steps.len() > 1 && variance < steps[steps.len() - 2].variance * (1.0 + mesh.growth);
            match steps.last_mut().filter(|_| joins) {
                Some(last) => {
                    last.q = (last.q * last.energy + band.q * energy) / (last.energy + energy);
                    last.energy += energy;
                    last.variance = variance;
                }
                None => steps.push(CascadeStep { variance, q: band.q, energy }),
            }
        }
        Cascade { steps, c, gamma, relaxed: relaxation, mesh }
    }

    fn total(&self) -> f64 {
        self.steps.last().map_or(0.0, |s| s.variance.sqrt())
    }

    /// Bytes of a sweep.
    pub(super) fn bytes(bands: usize) -> u64 {
        const FIELDS: u64 = 4;
        let nodes = ((REACH + 8.0) / Resolution::DEFAULT.stress) as u64;
        8 * (FIELDS * nodes + 8 * bands as u64)
    }

    /// Contact at a pressure, starting from the tensions found at another.
    pub(super) fn solve(
        &self,
        pressure: f64,
        guess: Option<&CascadeSolution>,
        stopping: &impl Fn() -> bool,
    ) -> CascadeSolution {
        let mut tension = guess.map_or_else(|| vec![0.0; self.steps.len()], |c| c.tension.clone());
        let mut sweep = self.sweep(pressure, &tension);
        let (mut stop, mut sweeps, mut residual) = (Stop::Converged, 1, 0.0);
        if self.gamma > 0.0 {
            stop = Stop::IterationLimit;
            while sweeps < MOST_ROUNDS {
                if stopping() {
                    stop = Stop::Interrupted;
                    break;
                }
                let target = self.tension(&sweep);
                // Under-relaxation: areas and tensions are strongly coupled.
                tension.iter_mut().zip(&target).for_each(|(t, a)| *t = 0.5 * (*t + a));
                let previous = *sweep.fractions.last().expect("bands are not empty");
                sweep = self.sweep(pressure, &tension);
                sweeps += 1;
                let after = *sweep.fractions.last().expect("bands are not empty");
                if !after.is_finite() {
                    stop = Stop::Diverged;
                    break;
                }
                residual = if after == previous { 0.0 } else { (after - previous).abs() / after };
                if residual <= TOLERANCE {
                    stop = Stop::Converged;
                    break;
                }
            }
        }
        let touching = *sweep.fractions.last().expect("bands are not empty");
        let elastic = self.elastic_beyond(&sweep)[0];
        CascadeSolution {
            contact_area: touching,
            load_error: (sweep.load / pressure - 1.0).abs(),
            residual,
            energy: elastic - self.gamma * touching,
            stop,
            sweeps,
            tension,
        }
    }

    /// Elastic energy of the waves from each step on, per area in contact before that step.
    fn elastic_beyond(&self, sweep: &CascadeSweep) -> Vec<f64> {
        let before = |k: usize| if k == 0 { 1.0 } else { sweep.fractions[k - 1] };
        let energy = |from: usize| {
            let whole = before(from).max(f64::MIN_POSITIVE);
            let part = |k: usize| {
                let contact_area = 0.5 * (before(k) + sweep.fractions[k]);
                self.steps[k].energy * contact_area * relaxed(self.relaxed, contact_area / whole)
            };
            (from..self.steps.len()).map(part).sum::<f64>()
        };
        (0..self.steps.len()).map(energy).collect()
    }

    /// Tension at which a crack as wide as a step's wavelength opens, `√(γ_eff E* q/2)`, with the work of adhesion
    /// γ_eff reduced by the elastic energy of the shorter waves.
    fn tension(&self, sweep: &CascadeSweep) -> Vec<f64> {
        let gained = self.gamma * sweep.fractions.last().expect("bands are not empty");
        let beyond = self.elastic_beyond(sweep);
        self.steps
            .iter()
            .enumerate()
            .map(|(k, step)| {
                let shorter = beyond.get(k + 1).copied().unwrap_or(0.0);
                let effective = ((gained - shorter) / sweep.fractions[k].max(f64::MIN_POSITIVE)).max(0.0);
                (0.5 * effective * step.q).sqrt()
            })
            .collect()
    }

    /// From the longest waves to the shortest.
    ///
    /// The first steps are in closed form, a Gaussian minus its mirror image. The grid starts when it resolves the
    /// distribution: starting from a single node it would broaden the stress by its spacing and overestimate the area
    /// at small pressures.
    fn sweep(&self, pressure: f64, tension: &[f64]) -> CascadeSweep {
        let total = self.total();
        if pressure > CLOSED * total {
            // Complete contact; a grid up to such a pressure would be large.
            return CascadeSweep { fractions: vec![1.0; self.steps.len()], load: pressure };
        }
        let ds = self.mesh.stress * total;
        let first = (0..self.steps.len()).find(|&k| self.steps[k].variance.sqrt() >= RESOLVED * ds);
        let first = first.unwrap_or(self.steps.len() - 1);
        let mut fractions: Vec<f64> = (0..=first)
            .map(|k| contact_area(self.c, pressure + tension[k], 2.0 * self.c * self.c * self.steps[k].variance))
            .collect();
        let start = pressure + tension[first];
        let largest = tension[first..].iter().copied().fold(0.0, f64::max);
        let nodes = ((start + largest + REACH * total) / ds) as usize + 2;
        // Node k at k·ds above the tension; the distribution is zero at node 0.
        let spread = SQRT_2 * self.steps[first].variance.sqrt();
        let norm = (spread * std::f64::consts::PI.sqrt()).recip();
        let gauss = |s: f64| (-(s / spread).powi(2)).exp();
        let mut density: Vec<f64> =
            (0..nodes).map(|k| k as f64 * ds).map(|s| norm * (gauss(s - start) - gauss(s + start))).collect();
        let mut thomas = vec![[0.0; 2]; nodes];
        let (mut touching, mut lost) = (fractions[first], 0.0);
        let sums = |density: &[f64]| {
            density.iter().enumerate().fold([0.0; 2], |[a, b], (k, d)| [a + d * ds, b + d * ds * (k as f64 * ds)])
        };
        // The closed form loses tension, which the grid redistributes from its first step on.
        let mut load = sums(&density)[1] - tension[first] * touching;
        for k in first + 1..self.steps.len() {
            let time = 0.5 * (self.steps[k].variance - self.steps[k - 1].variance);
            let pulled = 0.5 * (tension[k] + tension[k - 1]);
            // Redistributed tension, including the load error of the last step.
            let redistributed = (pulled * lost + load - pressure) / touching;
            let shift = tension[k] - tension[k - 1] - redistributed;
            advance(&mut density, &mut thomas, time / (ds * ds), shift / ds);
            let [area, moment] = sums(&density);
            lost = touching - area;
            touching = area;
            load = moment - tension[k] * area;
            fractions.push(touching);
        }
        CascadeSweep { fractions, load }
    }
}

/// Diffusion by `r` and a shift by `s`, both in grid units, of a density that is zero at both ends (Crank-Nicolson).
fn advance(density: &mut [f64], thomas: &mut [[f64; 2]], r: f64, s: f64) {
    let n = density.len();
    let (down, up) = (0.5 * (r + 0.5 * s), 0.5 * (r - 0.5 * s));
    let mut previous = density[0];
    thomas[0] = [0.0, 0.0];
    for k in 1..n {
        let right = if k + 1 < n { density[k + 1] } else { 0.0 };
        let rhs = down * previous + (1.0 - r) * density[k] + up * right;
        previous = density[k];
        let pivot = 1.0 + r + down * thomas[k - 1][0];
        thomas[k] = [-up / pivot, (rhs + down * thomas[k - 1][1]) / pivot];
    }
    let mut next = 0.0;
    for k in (1..n).rev() {
        next = thomas[k][1] - thomas[k][0] * next;
        density[k] = next;
    }
    density[0] = 0.0;
}

#[cfg(test)]
mod tests {
    use super::super::roughening::{PURE, bands};
    use super::*;
    use asperity_surface::{PowerSpectrum, Spectrum};

    const FINE: Resolution = Resolution { growth: 0.03, stress: 0.006 };

    fn cascade(gamma: f64, mesh: Resolution) -> Cascade {
        Cascade::new(&bands(&PowerSpectrum::expected(&Spectrum::CHALLENGE, 1.0)), PURE, gamma, 0.45, mesh)
    }

    fn never() -> bool {
        false
    }

    /// Diffusion with drift from a point source to an absorbing wall: the remaining fraction is
    /// (erfc(-(s+vt)/2√t) - exp(-vs) erfc((s-vt)/2√t))/2.
    #[test]
    fn diffusion_with_drift_to_an_absorbing_wall() {
        let (ds, start, t0, t1) = (0.02, 1.0, 0.05, 0.6);
        let left = |v: f64, t: f64| {
            let root = 2.0 * f64::sqrt(t);
            0.5 * (libm::erfc(-(start + v * t) / root) - (-v * start).exp() * libm::erfc((start - v * t) / root))
        };
        for v in [-1.0, 0.0, 0.8] {
            // Density at t0: a Gaussian minus its weighted mirror image.
            let gauss = |s: f64, centre: f64| {
                (-(s - centre - v * t0).powi(2) / (4.0 * t0)).exp() / (4.0 * std::f64::consts::PI * t0).sqrt()
            };
            let mut density: Vec<f64> = (0..400)
                .map(|k| k as f64 * ds)
                .map(|s| gauss(s, start) - (-v * start).exp() * gauss(s, -start))
                .collect();
            let mut thomas = vec![[0.0; 2]; density.len()];
            let steps = 200;
            let dt = (t1 - t0) / f64::from(steps);
            for _ in 0..steps {
                advance(&mut density, &mut thomas, dt / (ds * ds), v * dt / ds);
            }
            let actual: f64 = density.iter().sum::<f64>() * ds;
            assert!((actual / left(v, t1) - 1.0).abs() < 1e-3, "{v}: {actual} {}", left(v, t1));
        }
    }

    /// Without adhesion the grid reproduces the error function, also at pressures far below its spacing: areas are
    /// proportional to small pressures on any grid.
    #[test]
    fn area_is_proportional_to_small_pressures() {
        for (gamma, mesh) in [(0.0, Resolution::DEFAULT), (0.0, FINE), (2e-5, Resolution::DEFAULT), (2e-5, FINE)] {
            let cascade = cascade(gamma, mesh);
            let estimate_at = |p: f64| cascade.solve(p, None, &never);
            let [tiny, small] = [1e-6, 1e-3].map(|p| estimate_at(p).contact_area / p);
            assert!((tiny / small - 1.0).abs() < 1e-3, "{gamma}, {mesh:?}: {tiny} {small}");
            if gamma == 0.0 {
                for p in [1e-5, 1e-3, 0.01, 0.1, 0.5, 2.0] {
                    let exact = libm::erf(2f64.sqrt() * p);
                    assert!(
                        (estimate_at(p).contact_area / exact - 1.0).abs() < 1e-3,
                        "{mesh:?}, {p}: {} {exact}",
                        estimate_at(p).contact_area
                    );
                }
            }
        }
    }

    /// Far above the rms stress of full contact the contact is complete.
    #[test]
    fn contact_is_complete_at_large_pressures() {
        for p in [6.0, 1e6] {
            let actual = cascade(2e-5, Resolution::DEFAULT).solve(p, None, &never);
            assert_eq!((actual.contact_area, actual.load_error, actual.stop), (1.0, 0.0, Stop::Converged), "{p}");
        }
    }

    /// Half the steps in stress and in variance.
    #[test]
    fn adhesive_area_does_not_depend_on_the_resolution() {
        for p in [1e-4, 0.01, 0.1] {
            let [usual, fine] = [Resolution::DEFAULT, FINE].map(|mesh| cascade(2e-5, mesh).solve(p, None, &never));
            assert_eq!((usual.stop, fine.stop), (Stop::Converged, Stop::Converged));
            assert!(
                (usual.contact_area / fine.contact_area - 1.0).abs() < 3e-3,
                "{p}: {} {}",
                usual.contact_area,
                fine.contact_area
            );
        }
    }

    /// The tension of detached area is redistributed, so that the contact carries the pressure.
    #[test]
    fn load_is_conserved() {
        for p in [1e-3, 0.03] {
            let actual = cascade(2e-5, Resolution::DEFAULT).solve(p, None, &never);
            assert!(actual.load_error < 5e-3, "{}", actual.load_error);
        }
    }
}

//! Pair interaction between the atoms of the indenter and those of the block.

use serde::{Deserialize, Serialize};

/// Pair interaction of indenter atoms with block atoms.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Interaction {
    /// Lennard-Jones repulsion, cut off at the minimum and shifted to zero there.
    pub epsilon_ev: f64,
    pub sigma_angstrom: f64,
    pub adhesion: Option<Yukawa>,
}

impl Interaction {
    /// Lennard-Jones minimum 2^(1/6) σ, the cut-off of the repulsion, Å.
    pub fn touch_angstrom(&self) -> f64 {
        2f64.powf(1.0 / 6.0) * self.sigma_angstrom
    }

    /// Cut-off of the whole interaction, Å.
    pub fn reach_angstrom(&self) -> f64 {
        self.adhesion.map_or(0.0, |y| y.cutoff_angstrom).max(self.touch_angstrom())
    }

    /// Pair force divided by the distance, eV/Å², repulsion positive; `square` is the squared distance, Å².
    pub fn force_over_distance(&self, square: f64) -> f64 {
        -self.derivatives(square)[1]
    }

    /// Energy V (eV, zero at each term's cut-off), V'/r (eV/Å²) and (V'' - V'/r)/r² (eV/Å⁴) at the squared distance, Å²: the Hessian of a pair is
    /// the third times the dyad of the distance plus the second times the identity.
    pub fn derivatives(&self, square: f64) -> [f64; 3] {
        let (touch, mut sum) = (self.touch_angstrom(), [0.0; 3]);
        if square < touch * touch {
            let s6 = (self.sigma_angstrom * self.sigma_angstrom / square).powi(3);
            let epsilon = self.epsilon_ev;
            sum[0] += 4.0 * epsilon * s6 * (s6 - 1.0) + epsilon;
            sum[1] -= 24.0 * epsilon * (2.0 * s6 * s6 - s6) / square;
            sum[2] += 4.0 * epsilon * s6 * (168.0 * s6 - 48.0) / (square * square);
        }
        if let Some(y) = self.adhesion.filter(|y| square < y.cutoff_angstrom * y.cutoff_angstrom) {
            let (r, kappa, cutoff) = (square.sqrt(), y.kappa_per_angstrom, y.cutoff_angstrom);
            let value = y.amplitude_ev_angstrom * (-kappa * r).exp() / r;
            let slope = value * (kappa + 1.0 / r) / r;
            sum[0] += value - y.amplitude_ev_angstrom * (-kappa * cutoff).exp() / cutoff;
            sum[1] -= slope;
            sum[2] += (value * ((kappa + 1.0 / r).powi(2) + 1.0 / square) + slope) / square;
        }
        sum
    }
}

/// Yukawa term `amplitude` e^(-κr)/r; its sum over a plane of atoms is an exponential.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Yukawa {
    /// Negative for attraction, eV·Å.
    pub amplitude_ev_angstrom: f64,
    pub kappa_per_angstrom: f64,
    pub cutoff_angstrom: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Slope and curvature of the energy by central differences, with and without adhesion.
    #[test]
    fn derivatives_are_those_of_the_energy() {
        let adhesion = Yukawa { amplitude_ev_angstrom: -40.0, kappa_per_angstrom: 2.0, cutoff_angstrom: 7.0 };
        for adhesion in [None, Some(adhesion)] {
            let pair = Interaction { epsilon_ev: 0.2145, sigma_angstrom: 3.5927, adhesion };
            let energy = |r: f64| pair.derivatives(r * r)[0];
            for r in [2.9, 3.6, 4.0, 4.5, 6.5] {
                let h = 1e-4;
                let [_, over, bending] = pair.derivatives(r * r);
                let slope = (energy(r + h) - energy(r - h)) / (2.0 * h);
                let curvature = (energy(r + h) - 2.0 * energy(r) + energy(r - h)) / (h * h);
                // Errors of the differences: h² times the next derivatives, and rounding over h².
                assert!((over * r - slope).abs() < 1e-5 * (slope.abs() + 1e-3), "{r}: {} {slope}", over * r);
                assert!(
                    (bending * r * r + over - curvature).abs() < 1e-4 * (curvature.abs() + 1e-2),
                    "{r}: {curvature}"
                );
            }
            assert_eq!(pair.derivatives(49.0 + 1e-9), [0.0; 3]);
        }
    }
}

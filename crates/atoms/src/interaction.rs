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
        let touch = self.touch_angstrom();
        let mut force = 0.0;
        if square < touch * touch {
            let s6 = (self.sigma_angstrom * self.sigma_angstrom / square).powi(3);
            force += 24.0 * self.epsilon_ev * (2.0 * s6 * s6 - s6) / square;
        }
        if let Some(y) = self.adhesion.filter(|y| square < y.cutoff_angstrom * y.cutoff_angstrom) {
            let r = square.sqrt();
            let value = y.amplitude_ev_angstrom * (-y.kappa_per_angstrom * r).exp() / r;
            force += value * (y.kappa_per_angstrom + 1.0 / r) / r;
        }
        force
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

//! Loads of a path.

use crate::scene::{Dimensional, LoadScene, Quantity};

/// Loads of one kind, in the order in which they are applied.
#[derive(Debug, Clone, PartialEq)]
pub enum Loads {
    /// Mean pressures, in the unit of the modulus; compression is positive.
    Pressure(Vec<f64>),
    /// Mean pressures over E* times the rms gradient.
    PStar(Vec<f64>),
    /// Mean gaps, in the unit of the surface's length. They reach states that are unstable under a prescribed pressure.
    MeanGap(Vec<f64>),
    /// Displacements from first contact, in the unit of the surface's length: mean gap at first contact minus mean gap.
    Displacement(Vec<f64>),
    /// Contact fractions. The pressures that give them are found first.
    ContactFraction(Vec<f64>),
}

impl Loads {
    pub(super) fn scene(&self) -> LoadScene {
        let none = LoadScene::default();
        match self.clone() {
            Loads::Pressure(list) => LoadScene { pressure: plain(list), ..none },
            Loads::PStar(list) => LoadScene { p_star: list, ..none },
            Loads::MeanGap(list) => LoadScene { mean_gap: plain(list), ..none },
            Loads::Displacement(list) => LoadScene { displacement: plain(list), ..none },
            Loads::ContactFraction(list) => LoadScene { contact: list, ..none },
        }
    }
}

fn plain<D: Dimensional>(list: Vec<f64>) -> Vec<Quantity<D>> {
    list.into_iter().map(Quantity::plain).collect()
}

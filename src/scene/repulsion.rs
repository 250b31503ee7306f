//! Repulsion of the indenter in a scene: as given, otherwise the challenge's, scaled to the crystal of the block.

use super::AtomsScene;
use crate::{Error, Result};
use asperity_atoms::repulsion::Repulsion;
use asperity_grid::error::Complaint;

/// Keys of the constants, with names and units for messages.
const CONSTANTS: [(&str, &str, &str); 3] = [
    ("atoms.indenter_epsilon", "epsilon", "eV"),
    ("atoms.indenter_sigma", "sigma", "Å"),
    ("atoms.contact_distance", "contact distance d_c", "Å"),
];

/// Smallest σ over the lattice constant; calcium's ratio is 0.64. The number of indenter atoms increases as 1/σ².
const LEAST_SIGMA: f64 = 0.1;

/// Accepted ε over the one that is scaled to the crystal.
const EPSILON_RANGE: [f64; 2] = [1e-3, 1e3];

/// Relative deviation of calcium's value from the scaled one above which it is warned of.
const CALCIUMS: f64 = 0.01;

/// The crystal of the block: lattice constant and range of its potential, Å, and contact modulus, GPa.
#[derive(Debug, Clone, Copy)]
pub(super) struct BlockCrystal<'a> {
    pub element: &'a str,
    pub a0: f64,
    pub modulus_gpa: f64,
    pub cutoff_angstrom: f64,
}

fn values(r: &Repulsion) -> [f64; 3] {
    [r.epsilon_ev, r.sigma_angstrom, r.contact_distance_angstrom]
}

fn given(a: &AtomsScene) -> [Option<f64>; 3] {
    [a.indenter_epsilon.map(|e| e.to("eV")), a.indenter_sigma.map(|s| s.to("Å")), a.contact_distance.map(|d| d.to("Å"))]
}

/// Five significant digits; `round` is `f64::round`, or up or down for the ends of a range.
fn digits(value: f64, round: fn(f64) -> f64) -> f64 {
    let unit = 10f64.powf(value.log10().floor() - 4.0);
    // Rounding of the quotient must not count as a digit.
    let scaled = (1e6 * value / unit).round() / 1e6;
    format!("{:.4e}", round(scaled) * unit).parse().unwrap_or(value)
}

impl BlockCrystal<'_> {
    fn scaled(&self) -> Repulsion {
        Repulsion::of_crystal(self.a0, self.modulus_gpa)
    }

    /// The repulsion of a scene. A d_c that is not given is in proportion to σ.
    ///
    /// # Errors
    /// `Input` at `place` for values out of range.
    pub(super) fn repulsion(&self, a: &AtomsScene, context: &str) -> Result<Repulsion> {
        let scaled = self.scaled();
        let [epsilon_ev, sigma_angstrom, contact_distance_angstrom] = given(a);
        let sigma_angstrom = sigma_angstrom.unwrap_or(scaled.sigma_angstrom);
        let in_proportion = scaled.contact_distance_angstrom * (sigma_angstrom / scaled.sigma_angstrom);
        let repulsion = Repulsion {
            epsilon_ev: epsilon_ev.unwrap_or(scaled.epsilon_ev),
            sigma_angstrom,
            contact_distance_angstrom: contact_distance_angstrom.unwrap_or(in_proportion),
        };
        let cutoff = self.cutoff_angstrom;
        let largest_sigma =
            cutoff * Repulsion::CHALLENGE.sigma_angstrom / Repulsion::CHALLENGE.contact_distance_angstrom;
        let limits = [
            (
                EPSILON_RANGE.map(|f| f * scaled.epsilon_ev),
                "a thousandth to a thousand times the one scaled to the crystal".into(),
            ),
            (
                [LEAST_SIGMA * self.a0, largest_sigma],
                format!(
                    "from a tenth of the lattice constant to where d_c is the range of the potential, {} Å",
                    digits(cutoff, f64::round)
                ),
            ),
            (
                [repulsion.minimum_angstrom(), cutoff],
                "from where the repulsion begins, 2^(1/6) sigma (with less, atoms would carry load without being in contact), to the range \
                 of the potential, in which LAMMPS has the neighbours"
                    .into(),
            ),
        ];
        let mut list = Vec::new();
        for (k, ([low, high], reason)) in limits.into_iter().enumerate() {
            let ((key, _, unit), value) = (CONSTANTS[k], values(&repulsion)[k]);
            if !(low..=high).contains(&value) {
                let accepted = format!("{} to {} {unit}: {reason}", digits(low, f64::ceil), digits(high, f64::floor));
                list.push(Complaint::new(key, format!("{value} {unit}"), accepted));
            }
        }
        if list.is_empty() { Ok(repulsion) } else { Err(Error::Input { place: context.into(), list }) }
    }

    /// Warnings about constants that are scaled from calcium, and about calcium's that are given for another crystal.
    pub(super) fn warnings(&self, a: &AtomsScene, used: &Repulsion) -> Vec<String> {
        let (challenge, scaled) = (values(&Repulsion::CHALLENGE), values(&self.scaled()));
        let (used, given, mut list) = (values(used), given(a), Vec::new());
        let derived: Vec<usize> = (0..3).filter(|k| given[*k].is_none() && scaled[*k] != challenge[*k]).collect();
        if !derived.is_empty() {
            let each =
                |value: &dyn Fn(usize) -> String| derived.iter().map(|k| value(*k)).collect::<Vec<_>>().join(", ");
            list.push(format!(
                "the challenge's indenter for calcium is scaled to this {} (a0 = {} Å, E* = {} GPa): {}; {} set other values",
                self.element,
                self.a0,
                self.modulus_gpa,
                each(&|k| format!("{} = {} {}", CONSTANTS[k].1, digits(used[k], f64::round), CONSTANTS[k].2)),
                each(&|k| CONSTANTS[k].0.into())
            ));
        }
        let is_calciums =
            |k: &usize| given[*k] == Some(challenge[*k]) && (scaled[*k] / challenge[*k] - 1.0).abs() > CALCIUMS;
        list.extend((0..3).filter(is_calciums).map(|k| {
            let ((key, _, unit), own) = (CONSTANTS[k], digits(scaled[k], f64::round));
            format!(
                "{key} = {} {unit} is the challenge's for calcium; scaled to this {} it is {own} {unit}",
                used[k], self.element
            )
        }));
        list
    }
}

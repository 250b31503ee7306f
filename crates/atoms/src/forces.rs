//! Forces of the rigid indenter on the atoms of a frame, nearest distances, and the indenter position at a given load.
//!
//! The pair terms of the scripts are evaluated from positions alone, so the load of a frame from any LAMMPS run can
//! be computed. Units: Å, eV.

use super::contact::within;
use super::dump::DumpFrame;
use super::indenter::Indenter;
use super::interaction::Interaction;
use asperity_grid::{Error, Result};

/// Relative tolerance of the load when the indenter is displaced. Rounding of a sum over several thousand atoms is
/// 1e-13.
pub const LOAD_BALANCE: f64 = 1e-10;

/// Maximum displacement of the indenter to balance a load, Å. Measured: 0.02 Å between steps of 0.4 Å, up to 0.1 Å
/// between steps of 0.8 Å.
const MOST_MOVED: f64 = 0.5;

/// Forces of the indenter on the atoms of a frame, in the frame's order.
#[derive(Debug, Clone, PartialEq)]
pub struct IndenterForces {
    /// Distance to the nearest indenter atom, Å; infinite beyond the requested reach.
    pub nearest: Vec<f64>,
    /// Downward force of the indenter on the atom, eV/Å: repulsion positive.
    pub normal: Vec<f64>,
}

impl IndenterForces {
    /// Normal force on the indenter, repulsion positive, eV/Å.
    pub fn load(&self) -> f64 {
        self.normal.iter().sum()
    }
}

/// Forces of the indenter at the displacement `lowered` (Å) on every atom of `frame`, and distances up to at least
/// `reach` (Å).
pub fn indenter_forces(
    frame: &DumpFrame,
    indenter: &Indenter,
    lowered: f64,
    interaction: &Interaction,
    reach: f64,
) -> IndenterForces {
    let reach = reach.max(interaction.reach_angstrom());
    let mut forces =
        IndenterForces { nearest: Vec::with_capacity(frame.len()), normal: Vec::with_capacity(frame.len()) };
    for position in &frame.positions {
        let (mut nearest, mut normal) = (f64::INFINITY, 0.0);
        for [dx, dy, dz] in within(*position, indenter, lowered, reach) {
            let square = dx * dx + dy * dy + dz * dz;
            nearest = square.min(nearest);
            normal += interaction.force_over_distance(square) * dz;
        }
        forces.nearest.push(nearest.sqrt());
        forces.normal.push(normal);
    }
    forces
}

/// Displacement of the indenter near `lowered` (Å) at which the force on the fixed atoms of `frame` is `load` (eV/Å).
///
/// Positions interpolated between two steps give less than the interpolated load, because the repulsion is convex: 3
/// to 5 % less between steps of 0.4 Å at the lowest load of the quickstart.
///
/// # Errors
/// `Format` when no displacement within half an ångström gives the load.
pub fn lowered_to(
    frame: &DumpFrame,
    indenter: &Indenter,
    lowered: f64,
    interaction: &Interaction,
    load: f64,
) -> Result<f64> {
    let excess = |down: f64| indenter_forces(frame, indenter, down, interaction, 0.0).load() - load;
    let first_excess = excess(lowered);
    // Search in growing steps on both sides: with adhesion the load may decrease with displacement.
    let (mut near, mut step) = ([lowered; 2], 0.005);
    let (mut low, mut high) = 'found: loop {
        for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
            let far = lowered + sign * step;
            if (excess(far) < 0.0) != (first_excess < 0.0) {
                break 'found if first_excess < 0.0 { (near[side], far) } else { (far, near[side]) };
            }
            near[side] = far;
        }
        if step > MOST_MOVED {
            let found = format!("atoms that carry {:.4} eV/angstrom under the indenter", first_excess + load);
            return Err(Error::format(&frame.source, found, format!("a frame that carries about {load:.4}")));
        }
        step *= 2.0;
    };
    // `low` carries less than the load, `high` at least the load; either may be the larger displacement.
    loop {
        let middle = 0.5 * (low + high);
        let over = excess(middle);
        if over.abs() <= LOAD_BALANCE * load.abs() || middle == low || middle == high {
            return Ok(middle);
        }
        if over < 0.0 { low = middle } else { high = middle }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block::Block;
    use crate::interaction::Yukawa;

    const YUKAWA: Yukawa = Yukawa { amplitude_ev_angstrom: -300.0, kappa_per_angstrom: 2.0, cutoff_angstrom: 7.5 };

    fn interaction(adhesion: Option<Yukawa>) -> Interaction {
        Interaction { epsilon_ev: 0.2145, sigma_angstrom: 3.5927, adhesion }
    }

    fn setting() -> (DumpFrame, Indenter) {
        let block = Block::new(5, 2, 5.5884, 7.0).expect("valid");
        let heights: Vec<f64> = (0..121).map(|k| f64::from((k * 37) % 41) / 30.0).collect();
        let indenter = Indenter::above(&block, 11, heights, 4.0327).expect("valid");
        let sites: Vec<_> = block.sites().filter(|s| !s.fixed).collect();
        let l = block.length();
        let frame = DumpFrame {
            source: "made".into(),
            timestep: 0,
            time: None,
            bounds: [[0.0, l], [0.0, l], [0.0, 60.0]],
            periodic: [true, true, false],
            ids: sites.iter().map(|s| s.id).collect(),
            species: Vec::new(),
            has_types: true,
            elements: Vec::new(),
            positions: sites.iter().map(|s| s.position).collect(),
            forces_z: Vec::new(),
            has_units: false,
        };
        (frame, indenter)
    }

    /// Energy of all pairs as in LAMMPS: cut and shifted.
    fn energy(frame: &DumpFrame, indenter: &Indenter, lowered: f64, interaction: &Interaction) -> f64 {
        let l = frame.length(0);
        let lj = |r: f64| {
            let s = (interaction.sigma_angstrom / r).powi(6);
            if r < interaction.touch_angstrom() {
                4.0 * interaction.epsilon_ev * (s * s - s) + interaction.epsilon_ev
            } else {
                0.0
            }
        };
        let yukawa = |r: f64| match interaction.adhesion {
            Some(y) if r < y.cutoff_angstrom => {
                let value_at = |r: f64| y.amplitude_ev_angstrom * (-y.kappa_per_angstrom * r).exp() / r;
                value_at(r) - value_at(y.cutoff_angstrom)
            }
            _ => 0.0,
        };
        let mut sum = 0.0;
        for w in indenter.positions() {
            for p in &frame.positions {
                let image = |d: f64| d - (d / l).round() * l;
                let (dx, dy, dz) = (image(w[0] - p[0]), image(w[1] - p[1]), w[2] - lowered - p[2]);
                let r = (dx * dx + dy * dy + dz * dz).sqrt();
                sum += lj(r) + yukawa(r);
            }
        }
        sum
    }

    #[test]
    fn the_load_is_the_derivative_of_the_pair_energy() {
        let (frame, indenter) = setting();
        for adhesion in [None, Some(YUKAWA)] {
            let pair_interaction = interaction(adhesion);
            for lowered in [0.2, 0.7, 1.1] {
                let h = 1e-4;
                let slope = (energy(&frame, &indenter, lowered + h, &pair_interaction)
                    - energy(&frame, &indenter, lowered - h, &pair_interaction))
                    / (2.0 * h);
                let load = indenter_forces(&frame, &indenter, lowered, &pair_interaction, 0.0).load();
                // Pairs that enter at the cut-off between the two energies contribute 1e-6.
                assert!((slope - load).abs() < 1e-5 * load.abs().max(1.0), "{slope} {load}");
            }
        }
    }

    #[test]
    fn the_indenter_is_moved_until_it_carries_the_load() {
        let (frame, indenter) = setting();
        let pair_interaction = interaction(None);
        for (lowered, load) in [(0.7, 1.05), (0.7, 0.9), (0.9, 1.0)] {
            let load_down = load * indenter_forces(&frame, &indenter, lowered, &pair_interaction, 0.0).load();
            let down = lowered_to(&frame, &indenter, lowered, &pair_interaction, load_down).expect("found");
            assert_eq!(down > lowered, load > 1.0);
            let carried = indenter_forces(&frame, &indenter, down, &pair_interaction, 0.0).load();
            assert!((carried / load_down - 1.0).abs() <= LOAD_BALANCE, "{carried} {load_down}");
        }
        let refused = lowered_to(&frame, &indenter, 0.1, &pair_interaction, 1e6).expect_err("too much");
        assert!(refused.to_string().contains("carries about 1000000"), "{refused}");
    }

    #[test]
    fn nearest_distances_are_infinite_beyond_the_reach() {
        let (frame, indenter) = setting();
        let near = indenter_forces(&frame, &indenter, 0.7, &interaction(None), 4.6).nearest;
        let counted = near.iter().filter(|d| **d < 4.5).count();
        assert!(counted > 5);
        for (distance, p) in near.iter().zip(&frame.positions) {
            assert_eq!(*distance < 4.5, within(*p, &indenter, 0.7, 4.5).next().is_some());
        }
    }
}

//! Potential of the rigid indenter for single atoms of the block: energy, force and Hessian from the pair interaction.

use crate::interaction::Interaction;

/// Indenter atoms on a square grid that moves along z as one body.
#[derive(Debug, Clone)]
pub(crate) struct RigidWall {
    points: usize,
    /// Distance of neighbouring atoms, Å.
    spacing: f64,
    interaction: Interaction,
    /// Heights of the atoms at lift 0, `[points, points]` by rows of constant y, Å.
    heights: Vec<f64>,
    /// Lowest height among the atoms that an atom of the block in a cell of the grid may reach, Å.
    lowest: Vec<f64>,
    /// Neighbours of a cell on either side that may be within reach.
    window: i64,
}

/// The wall's action on one atom.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct WallAction {
    /// eV.
    pub energy: f64,
    /// On the atom, eV/Å.
    pub force: [f64; 3],
    /// Second derivatives of the energy (xx, yy, zz, yz, xz, xy), eV/Å².
    pub hessian: [f64; 6],
}

impl WallAction {
    /// The Hessian times a displacement.
    pub(super) fn stiffness_times(&self, d: [f64; 3]) -> [f64; 3] {
        let [xx, yy, zz, yz, xz, xy] = self.hessian;
        [xx * d[0] + xy * d[1] + xz * d[2], xy * d[0] + yy * d[1] + yz * d[2], xz * d[0] + yz * d[1] + zz * d[2]]
    }
}

impl RigidWall {
    /// Atoms of these heights at x = i · `spacing`, y = j · `spacing`.
    pub(crate) fn new(points: usize, spacing: f64, interaction: Interaction, heights: Vec<f64>) -> Self {
        let window = (interaction.reach_angstrom() / spacing).ceil() as i64 - 1;
        let mut wall = RigidWall { points, spacing, interaction, heights, lowest: Vec::new(), window };
        let lowest = |cell: usize| {
            let around = wall.around((cell % points) as i64, (cell / points) as i64);
            around.map(|(_, _, k)| wall.heights[k]).fold(f64::INFINITY, f64::min)
        };
        wall.lowest = (0..points * points).map(lowest).collect();
        wall
    }

    /// Grid indices, not wrapped, and numbers of the atoms that an atom in the cell (i, j) may reach.
    fn around(&self, i: i64, j: i64) -> impl Iterator<Item = (i64, i64, usize)> + use<> {
        let (n, window) = (self.points as i64, self.window);
        (j - window..=j + window + 1).flat_map(move |j| {
            (i - window..=i + window + 1).map(move |i| (i, j, (j.rem_euclid(n) * n + i.rem_euclid(n)) as usize))
        })
    }

    /// The action on an atom at `position`, with the indenter raised by `lift`; `None` out of reach.
    pub(super) fn action(&self, position: [f64; 3], lift: f64) -> Option<WallAction> {
        let [i, j] = [0, 1].map(|c| (position[c] / self.spacing).floor() as i64);
        let n = self.points as i64;
        let cell = (j.rem_euclid(n) * n + i.rem_euclid(n)) as usize;
        let reach = self.interaction.reach_angstrom();
        if self.lowest[cell] + lift - position[2] >= reach {
            return None;
        }
        let (mut action, mut touched) = (WallAction::default(), false);
        for (i, j, k) in self.around(i, j) {
            let d = [
                position[0] - i as f64 * self.spacing,
                position[1] - j as f64 * self.spacing,
                position[2] - (self.heights[k] + lift),
            ];
            let square = d.iter().map(|c| c * c).sum::<f64>();
            if square >= reach * reach {
                continue;
            }
            let [energy, over, bending] = self.interaction.derivatives(square);
            touched = true;
            action.energy += energy;
            (0..3).for_each(|c| action.force[c] -= over * d[c]);
            for (entry, (a, b)) in action.hessian.iter_mut().zip([(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]) {
                *entry += bending * d[a] * d[b] + if a == b { over } else { 0.0 };
            }
        }
        touched.then_some(action)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAIR: Interaction = Interaction { epsilon_ev: 0.2145, sigma_angstrom: 3.5927, adhesion: None };

    fn wall() -> RigidWall {
        let heights = (0..81).map(|k| 20.0 + (0.3 * f64::from(k * k % 17)).sin()).collect();
        RigidWall::new(9, 2.54, PAIR, heights)
    }

    /// All pairs with all periodic images of the indenter.
    fn energy(wall: &RigidWall, position: [f64; 3], lift: f64) -> f64 {
        let n = wall.points as i64;
        let all = (-n..2 * n).flat_map(|j| (-n..2 * n).map(move |i| (i, j)));
        all.map(|(i, j)| {
            let k = (j.rem_euclid(n) * n + i.rem_euclid(n)) as usize;
            let d =
                [position[0] - i as f64 * 2.54, position[1] - j as f64 * 2.54, position[2] - wall.heights[k] - lift];
            PAIR.derivatives(d.iter().map(|c| c * c).sum())[0]
        })
        .sum()
    }

    #[test]
    fn energy_is_that_of_all_pairs_and_its_derivatives_are_force_and_hessian() {
        let (wall, h) = (wall(), 1e-5);
        for position in [[0.3, 22.5, 16.4], [11.2, 0.02, 16.1], [5.0, 7.5, 16.1], [-0.4, 23.9, 16.0]] {
            let action = wall.action(position, 0.1).expect("within reach");
            assert!((action.energy - energy(&wall, position, 0.1)).abs() < 1e-12, "{position:?}");
            for c in 0..3 {
                let at = |by: f64| {
                    let mut moved = position;
                    moved[c] += by;
                    wall.action(moved, 0.1).expect("within reach")
                };
                let slope = (at(h).energy - at(-h).energy) / (2.0 * h);
                assert!((action.force[c] + slope).abs() < 1e-7, "{position:?}: {slope}");
                let mut unit = [0.0; 3];
                unit[c] = 1.0;
                let column = action.stiffness_times(unit);
                for (d, entry) in column.into_iter().enumerate() {
                    let bend = -(at(h).force[d] - at(-h).force[d]) / (2.0 * h);
                    assert!((entry - bend).abs() < 1e-6, "{position:?}: {entry} {bend}");
                }
            }
        }
        assert_eq!(wall.action([5.0, 5.0, 14.0], 2.0), None);
    }
}

//! `[atoms.nvt]`: the atoms at a temperature.

use super::{AtomsScene, Scene, Start};
use crate::atoms::nvt::{FREE_LAYERS, LEAST_AVERAGED_PS, NvtSettings};
use crate::atoms::potential::{HOTTEST_K, calcium_lattice_constant};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// At each asked load the relaxed atoms are held at a temperature, and how often each touches is counted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NvtScene {
    pub temperature_k: f64,
    /// Time at each load, ps.
    pub time_ps: f64,
    /// Share of the time that passes before anything is averaged.
    #[serde(default = "fifth")]
    pub equilibration: f64,
    /// Lattice constant at the temperature and no pressure, Å; must be given with another potential.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lattice_constant_angstrom: Option<f64>,
}

fn fifth() -> f64 {
    0.2
}

/// Strain of the crystal's expansion beyond which another unit or another crystal is more likely.
const MOST_EXPANSION: f64 = 0.1;

impl NvtScene {
    pub(super) fn settings(&self) -> NvtSettings {
        NvtSettings {
            temperature_k: self.temperature_k,
            time_ps: self.time_ps,
            equilibration: self.equilibration,
            lattice_constant_angstrom: self
                .lattice_constant_angstrom
                .unwrap_or_else(|| calcium_lattice_constant(self.temperature_k)),
        }
    }

    /// What is wrong with it: whether a value is good, its key, the value, what would be accepted.
    pub(super) fn checks(&self, scene: &Scene, atoms: &AtomsScene) -> Vec<(bool, &'static str, String, String)> {
        let (t, shipped) = (self.temperature_k, atoms.potential.is_none());
        let a0 = atoms.lattice_constant_angstrom;
        let attracts = scene.adhesion.as_ref().is_some_and(|a| a.work_of_adhesion_mj_m2 > 0.0);
        let from_touch = attracts || atoms.start_or_default(attracts) == Start::Touch;
        let least_depth = FREE_LAYERS / 2 + 1;
        let expanded = self.lattice_constant_angstrom;
        let is_share = (0.0..=0.9).contains(&self.equilibration);
        let shortest = LEAST_AVERAGED_PS / if is_share { 1.0 - self.equilibration } else { 1.0 };
        let near = expanded.zip(a0).is_none_or(|(a, a0)| (a / a0 - 1.0).abs() <= MOST_EXPANSION);
        vec![
            (
                t.is_finite() && t > 0.0 && (t <= HOTTEST_K || !shipped),
                "atoms.nvt.temperature_k",
                t.to_string(),
                format!("a positive number, with the shipped potential up to {HOTTEST_K}: its expansion is measured so far"),
            ),
            (
                self.time_ps.is_finite() && self.time_ps >= shortest,
                "atoms.nvt.time_ps",
                self.time_ps.to_string(),
                format!("at least {shortest:.2}, of which {LEAST_AVERAGED_PS} are averaged over"),
            ),
            (
                is_share,
                "atoms.nvt.equilibration",
                self.equilibration.to_string(),
                "a share from 0 to 0.9".into(),
            ),
            (
                expanded.is_some() != shipped,
                "atoms.nvt.lattice_constant_angstrom",
                expanded.map_or("not given".into(), |a| a.to_string()),
                "the value at the temperature with atoms.potential (lammps-inputs/expansion.in finds it), and only with it".into(),
            ),
            (
                near,
                "atoms.nvt.lattice_constant_angstrom",
                expanded.map_or(String::new(), |a| a.to_string()),
                format!("a lattice constant within {MOST_EXPANSION} of atoms.lattice_constant_angstrom"),
            ),
            (
                !from_touch,
                "atoms.nvt",
                "given with atoms that start from first touch".into(),
                "atoms.start = \"continuum\" without adhesion: the steps of a displacement ramp are between the loads".into(),
            ),
            (
                atoms.depth_cells >= least_depth,
                "atoms.depth_cells",
                format!("{} with atoms.nvt", atoms.depth_cells),
                format!("at least {least_depth}: the thermostat acts below the uppermost {FREE_LAYERS} layers"),
            ),
        ]
    }
}

//! The LAMMPS scripts of a job; `lammps-inputs/README.md` documents their variables.

/// A LAMMPS input script.
#[derive(Debug, PartialEq, Eq)]
pub struct Script {
    pub file: &'static str,
    pub text: &'static str,
}

/// Displacement-controlled loading, and unloading where requested.
pub const DISPLACEMENT_RAMP: Script =
    Script { file: "displacement_ramp.in", text: include_str!("../../lammps-inputs/displacement_ramp.in") };

/// Load-controlled steps, each started from the continuum's displacement field.
pub const PRESCRIBED_LOAD: Script =
    Script { file: "prescribed_load.in", text: include_str!("../../lammps-inputs/prescribed_load.in") };

/// Relaxed states at constant temperature.
pub const NVT: Script = Script { file: "nvt.in", text: include_str!("../../lammps-inputs/nvt.in") };

/// Scripts that the three above include.
pub(super) const INCLUDED: [Script; 2] = [
    Script { file: "setup.in", text: include_str!("../../lammps-inputs/setup.in") },
    Script { file: "end_of_step.in", text: include_str!("../../lammps-inputs/end_of_step.in") },
];

impl Script {
    /// BLAKE3 hash of the script and the scripts that it includes.
    pub fn hash(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        for part in [self.text].into_iter().chain(INCLUDED.map(|s| s.text)) {
            hasher.update(part.as_bytes());
        }
        hasher.finalize().to_hex().to_string()
    }
}

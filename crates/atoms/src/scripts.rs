//! The LAMMPS scripts of a job; `lammps-inputs/README.md` documents their variables.

/// A LAMMPS input script.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Script {
    pub file: &'static str,
    pub text: &'static str,
}

/// Displacement-controlled loading, and unloading where requested.
pub const DISPLACEMENT_RAMP: Script =
    Script { file: "displacement_ramp.in", text: include_str!("../lammps-inputs/displacement_ramp.in") };

/// Load-controlled steps, each started from the continuum's displacement field.
pub const PRESCRIBED_LOAD: Script =
    Script { file: "prescribed_load.in", text: include_str!("../lammps-inputs/prescribed_load.in") };

/// Relaxed states at constant temperature.
pub const NVT: Script = Script { file: "nvt.in", text: include_str!("../lammps-inputs/nvt.in") };

/// Start of every step of the three above.
pub(super) const SETUP: Script = Script { file: "setup.in", text: include_str!("../lammps-inputs/setup.in") };

/// One step of each of the first two.
pub const DISPLACEMENT_RAMP_STEP: Script =
    Script { file: "displacement_ramp_step.in", text: include_str!("../lammps-inputs/displacement_ramp_step.in") };
pub const PRESCRIBED_LOAD_STEP: Script =
    Script { file: "prescribed_load_step.in", text: include_str!("../lammps-inputs/prescribed_load_step.in") };

/// Scripts that the three above include.
pub(super) const INCLUDED: [Script; 4] = [
    SETUP,
    Script { file: "end_of_step.in", text: include_str!("../lammps-inputs/end_of_step.in") },
    DISPLACEMENT_RAMP_STEP,
    PRESCRIBED_LOAD_STEP,
];

impl Script {
    /// BLAKE3 hash of the script and the scripts that it includes.
    pub fn hash(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        for part in [self.text].into_iter().chain(self.included().iter().map(|s| s.text)) {
            hasher.update(part.as_bytes());
        }
        hasher.finalize().to_hex().to_string()
    }

    /// Scripts that it includes, and that these include.
    pub(super) fn included(&self) -> Vec<Script> {
        let mut list: Vec<Script> = Vec::new();
        for line in self.text.lines() {
            if let Some(script) = INCLUDED.iter().find(|s| line.strip_prefix("include ") == Some(s.file)) {
                list.push(*script);
                list.extend(script.included());
            }
        }
        list
    }

    /// The script of one step, for scripts that are a loop of steps.
    pub(super) fn step(&self) -> Option<Script> {
        self.included().into_iter().find(|s| s.file.ends_with("_step.in"))
    }
}

//! The LAMMPS scripts of a job; `lammps-inputs/README.md` documents their variables.

/// A LAMMPS input script.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Script {
    pub file: &'static str,
    pub text: &'static str,
}

macro_rules! script {
    ($file:literal) => {
        Script { file: $file, text: include_str!(concat!("../lammps-inputs/", $file)) }
    };
}

/// Displacement-controlled loading, and unloading where requested.
pub const DISPLACEMENT_RAMP: Script = script!("displacement_ramp.in");

/// Load-controlled steps, each started from the continuum's displacement field or from the previous step.
pub const PRESCRIBED_LOAD: Script = script!("prescribed_load.in");

/// Relaxed states at constant temperature.
pub const NVT: Script = script!("nvt.in");

/// Start of every step of the three above.
pub(super) const SETUP: Script = script!("setup.in");

/// One step of each of the first two.
pub const DISPLACEMENT_RAMP_STEP: Script = script!("displacement_ramp_step.in");
pub const PRESCRIBED_LOAD_STEP: Script = script!("prescribed_load_step.in");

/// Relaxation of a step by LAMMPS's own minimisers.
pub const DISPLACEMENT_RAMP_RELAX: Script = script!("displacement_ramp_relax.in");
pub const PRESCRIBED_LOAD_RELAX: Script = script!("prescribed_load_relax.in");

/// Scripts that the three above include.
pub(super) const INCLUDED: [Script; 10] = [
    SETUP,
    script!("end_of_step.in"),
    DISPLACEMENT_RAMP_STEP,
    script!("displacement_ramp_start.in"),
    DISPLACEMENT_RAMP_RELAX,
    script!("displacement_ramp_end.in"),
    PRESCRIBED_LOAD_STEP,
    script!("prescribed_load_start.in"),
    PRESCRIBED_LOAD_RELAX,
    script!("prescribed_load_end.in"),
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

    /// Start, relaxation and end of a step that this script is.
    pub(super) fn parts(&self) -> Option<[Script; 3]> {
        let part = |end: &str| self.included().into_iter().find(|s| s.file.ends_with(end));
        Some([part("_start.in")?, part("_relax.in")?, part("_end.in")?])
    }

    /// The script of one step, for scripts that are a loop of steps.
    pub(super) fn step(&self) -> Option<Script> {
        self.included().into_iter().find(|s| s.file.ends_with("_step.in"))
    }
}

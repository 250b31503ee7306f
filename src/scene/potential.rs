//! What a scene says of its potential and of LAMMPS, before it is resolved.

use super::Scene;
use super::check::{complaints, missing_files};
use super::model::relative_to;
use asperity_atoms::lammps_command::LammpsCommand;
use std::path::{Path, PathBuf};

impl Scene {
    /// The potential that replaces the shipped one. `file`: of the scene.
    pub fn potential(&self, file: &Path) -> Option<PathBuf> {
        let path = self.atoms.as_ref()?.potential.as_ref()?;
        Some(relative_to(file, path))
    }

    /// Whether there are no complaints about its values and the files that it names.
    pub fn is_sound(&self, file: &Path) -> bool {
        complaints(self).is_empty() && missing_files(self, file).is_empty()
    }

    /// How LAMMPS is started: as the scene says, unless `machine_lammps` says otherwise.
    pub fn lammps_command(&self, file: &Path, machine_lammps: &LammpsCommand) -> LammpsCommand {
        let Some(atoms) = &self.atoms else { return machine_lammps.clone() };
        let path = |p: &PathBuf| if p.components().count() > 1 { relative_to(file, p) } else { p.clone() };
        let program = atoms.program.as_ref().map(path);
        LammpsCommand { program, ranks: Some(atoms.ranks), ..LammpsCommand::default() }.overruled_by(machine_lammps)
    }
}

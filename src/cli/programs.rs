//! Programs that a scene names. A scene may come from somebody else, so they are executed only on request.

use crate::scene::{Case, Scene};
use crate::{Error, Result};
use asperity_atoms::lammps_command::LammpsCommand;
use asperity_atoms::search_path::{find_lammps, search_path};
use std::fs::canonicalize;
use std::path::Path;

/// Refuses a program that the scene names, unless it is `allowed` or the LAMMPS of the search path, which `doctor` shows.
///
/// # Errors
/// `Input`, which names the key and the flag.
pub(super) fn check(case: &Case, allowed: bool) -> Result<()> {
    check_scene((&case.scene, &case.file), &case.lammps, allowed)
}

/// The same before a scene is resolved. `machine_lammps`: how LAMMPS is started on this machine.
///
/// # Errors
/// Those of [`check`].
pub(super) fn check_scene((scene, file): (&Scene, &Path), machine_lammps: &LammpsCommand, allowed: bool) -> Result<()> {
    // A program that the machine names replaces that of the scene.
    let replaced = machine_lammps.program.is_some();
    let named = scene.atoms.as_ref().and_then(|a| a.program.as_ref()).filter(|_| !replaced);
    let Some(program) = named.filter(|_| !allowed) else { return Ok(()) };
    let is_path = program.components().count() > 1;
    let program_path = if is_path { scene.lammps_command(file, machine_lammps).program } else { search_path(program) };
    // A program that does not exist is reported as missing, with the remedy.
    let Some(program_path) = program_path.filter(|p| p.exists()) else { return Ok(()) };
    let same = |a: &Path, b: &Path| canonicalize(a).is_ok_and(|a| canonicalize(b).is_ok_and(|b| a == b));
    if find_lammps().is_some_and(|usual| same(&usual, &program_path)) {
        return Ok(());
    }
    let accepted = "lmp or lammps of the search path; --allow-program executes this one, so read the scene first";
    Err(Error::input(file.display(), "atoms.program", program_path.display(), accepted))
}

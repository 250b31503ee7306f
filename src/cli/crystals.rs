//! Constants of the crystal of a scene, compared with those of its potential before the scene is resolved.

use super::{output, programs};
use crate::Result;
use crate::pipeline::Crystals;
use crate::scene::Scene;
use asperity_atoms::lammps_command::LammpsCommand;
use std::path::Path;

/// Compares and fills in the constants of one scene. Returns warnings. `allowed`: whether the program that it names may be executed.
///
/// # Errors
/// Those of [`Crystals::settle`].
pub(super) fn settle(
    scene: &mut Scene,
    file: &Path,
    default_lammps: &LammpsCommand,
    allowed: bool,
) -> Result<Vec<String>> {
    settle_with(
        &Crystals::new(default_lammps, &|s, f| programs::check_scene((s, f), default_lammps, allowed)),
        scene,
        file,
    )
}

/// The same for one of several scenes.
///
/// # Errors
/// Those of [`Crystals::settle`].
pub(super) fn settle_with(crystals: &Crystals, scene: &mut Scene, file: &Path) -> Result<Vec<String>> {
    let said = crystals.settle(scene, file)?;
    said.used.iter().for_each(|text| output::eprint(text));
    Ok(said.warnings)
}

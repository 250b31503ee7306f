//! Initial configurations of the atoms at each load, from the continuum solution.

use super::continuum::start;
use crate::scene::{AtomsCase, Case};
use crate::{Error, Result};
use asperity_atoms::block::Block;
use asperity_atoms::indenter::Indenter;
use asperity_atoms::initial_configuration::{InitialConfiguration, LayerDisplacementField};
use asperity_contact::load::{LoadStep, at_step};
use asperity_contact::results::ContinuumResults;
use asperity_contact::state::State;
use std::path::Path;

/// Initial configurations at the distinct loads in rising order, followed by those of the unloading branch. `solved` is
/// the compliant-wall solution; its gap maps are stored under `root`.
pub(super) fn initial_configurations(
    case: &Case,
    atoms: &AtomsCase,
    indenter: &Indenter,
    (solved, root): (&ContinuumResults, &Path),
) -> Result<Vec<InitialConfiguration>> {
    let (grid, block): (_, &Block) = (atoms.matched, &atoms.block);
    let length = block.length();
    let fine = atoms.heights_angstrom(case.surface(), grid);
    // Each profile has its zero at its own lowest node.
    let offset = fine[0] - indenter.heights()[0];
    // The gaps of the compliant wall refer to the dilated heights.
    let heights: Vec<f64> = atoms.dilated_heights_angstrom(case.surface()).iter().map(|h| h / length).collect();
    let order = case.rising_steps().into_iter().chain(case.unloading_steps());
    let approach = |step: &LoadStep| {
        let file = at_step(&solved.states, step.index).and_then(State::gap_file);
        let file = file.ok_or_else(|| Error::format(root, "a load without its gap", "the gaps of every load"))?;
        let gap = start(&root.join(file), grid)?;
        let pressure = step.imposed_p_star() * case.gradient;
        let body = (atoms.layer(), atoms.compression());
        let pressed = LayerDisplacementField::under(block, body, grid, (&gap, &heights), pressure);
        let standoff = (atoms.wall.minimum_angstrom(), offset);
        Ok(InitialConfiguration::new(block, indenter, (atoms.load(step), pressed), (&gap, &heights), standoff))
    };
    order.map(approach).collect()
}

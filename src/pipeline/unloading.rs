//! The unloading branch of the atoms.

use super::frame_analysis::FrameAnalyzer;
use crate::Result;
use crate::scene::{AtomsCase, Case};
use asperity_atoms::job::Job;
use asperity_atoms::load_history::LoadHistory;
use asperity_atoms::results::{AtomState, BranchChange, Unloading};
use asperity_atoms::unloading::pull_off;
use asperity_contact::load::at_step;

/// Results of the unloading branch, if the job has one: states at the unloading loads of the path, and their changes
/// from the loading states `loading`. A displacement ramp that ends with separation also gives the pull-off.
pub(super) fn unloading(
    case: &Case,
    atoms: &AtomsCase,
    job: &Job,
    history: &LoadHistory,
    (reader, loading): (&FrameAnalyzer, &[AtomState]),
) -> Result<Option<Unloading>> {
    let Some(turn) = job.reversal_step(&history.steps) else { return Ok(None) };
    let (mut states, mut changes) = (Vec::new(), Vec::new());
    for step in case.unloading_steps() {
        let state = reader.state(step, &job.at_load_unloading(history, atoms.load(step))?)?;
        if let Some(previous) = step.counterpart.and_then(|k| at_step(loading, k)) {
            changes.push(BranchChange {
                p_star: state.p_star,
                contact_area_loading: previous.contact_area,
                contact_area_unloading: state.contact_area,
                mean_gap_angstrom: state.mean_gap_angstrom - previous.mean_gap_angstrom,
            });
        }
        states.push(state);
    }
    let end = job.unloading_state(&history.steps).and_then(|w| w.end);
    let separated = end.map(|k| history.steps[k].contacts == 0);
    Ok(Some(Unloading {
        reversal_step: turn,
        states,
        changes,
        separated,
        pull_off: end.and_then(|k| pull_off(&history.steps[..=k], turn, atoms.load_unit)),
    }))
}

//! The unloading branch of a displacement ramp: reversal, refinement, end and pull-off force.
//!
//! Unloading takes the same steps as loading, until the surfaces are separated. With adhesion the steps are refined
//! before the load passes zero, where the pull-off force is found.

use super::load_history::StepRecord;
use crate::results::AtomPullOff;
use asperity_grid::units::NN_PER_EV_A;

/// Unloading step over refined step: 0.3 Å becomes 0.075 Å, an eighth of the displacement (0.6 Å with a range of 0.5
/// Å) from zero load to pull-off.
pub const STEP_REFINEMENT: usize = 4;

/// Unloading ends when there is no contact and the pull has decayed to this fraction of its maximum, as in the
/// continuum.
pub const PULL_FRACTION: f64 = 0.3;

/// Unloading ends at the latest when the indenter is this far above its initial position, Å: beyond the range of the
/// adhesion the surfaces can be connected only by material transfer.
pub const MAX_RISE_ANGSTROM: f64 = 7.0;

/// State of an unloading branch, which a continued run needs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnloadingState {
    /// The step with the peak load, after which the indenter rises.
    pub reversal_step: usize,
    /// The step after which steps are refined.
    pub refined_from: Option<usize>,
    /// Lowest load of the branch, eV/Å; zero without tensile load.
    pub min_load: f64,
    /// The last step of a finished branch.
    pub end: Option<usize>,
}

impl UnloadingState {
    /// The unloading branch of a ramp that reversed at step `reversal_step`, up to the last of `records`. Steps are
    /// refined with `adhesion` only, from where the load would pass zero within the next step.
    pub(super) fn of(records: &[StepRecord], reversal_step: usize, adhesion: bool) -> Self {
        let mut state = UnloadingState { reversal_step, refined_from: None, min_load: 0.0, end: None };
        for pair in records[reversal_step..].windows(2) {
            let [before, now] = pair else { continue };
            let separated = now.contacts == 0 && now.load >= PULL_FRACTION * state.min_load;
            state.min_load = state.min_load.min(now.load);
            if separated || now.displacement_angstrom <= -MAX_RISE_ANGSTROM {
                state.end = Some(now.step);
                break;
            }
            if state.refined_from.is_none() && adhesion && 2.0 * now.load < before.load {
                state.refined_from = Some(now.step);
            }
        }
        state
    }
}

/// `-var` pairs of `displacement_ramp.in` for unloading; `resumed` is the unloading branch and the last finished step
/// of a job that continues on it.
pub(super) fn variables(resumed: Option<(UnloadingState, &StepRecord)>) -> Vec<(&'static str, String)> {
    let mut list = vec![
        ("unload", "1".to_string()),
        ("step_refinement", STEP_REFINEMENT.to_string()),
        ("pull_fraction", PULL_FRACTION.to_string()),
        ("max_rise", MAX_RISE_ANGSTROM.to_string()),
    ];
    if let Some((state, last)) = resumed {
        list.push(("reversal_step", state.reversal_step.to_string()));
        list.push(("refined_from", state.refined_from.map_or("-1".to_string(), |k| k.to_string())));
        list.push(("previous_load", last.load.to_string()));
        list.push(("min_load", state.min_load.to_string()));
    }
    list
}

/// Pull-off force: the largest tensile load among the steps from `turn` on; `None` without tensile load. `load_unit`
/// is the load at p* = 1, eV/Å.
///
/// The slope of the tensile load decreases towards the maximum, so its increase over the step to the maximum bounds
/// the error.
pub fn pull_off(records: &[StepRecord], turn: usize, load_unit: f64) -> Option<AtomPullOff> {
    let back = records.get(turn..)?;
    let k = (0..back.len()).min_by(|&a, &b| back[a].load.total_cmp(&back[b].load)).filter(|&k| k > 0)?;
    let (previous, separated) = (&back[k - 1], &back[k]);
    (separated.load < 0.0).then(|| AtomPullOff {
        step: separated.step,
        force_ev_per_angstrom: separated.load,
        error_ev_per_angstrom: previous.load - separated.load,
        force_nn: separated.load * NN_PER_EV_A,
        p_star: separated.load / load_unit,
        displacement_angstrom: separated.displacement_angstrom,
        step_angstrom: previous.displacement_angstrom - separated.displacement_angstrom,
        contacts: separated.contacts,
    })
}

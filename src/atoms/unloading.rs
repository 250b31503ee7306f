//! The way back: where a job turns, where it ends, and the largest pull on it.
//!
//! A ladder from first touch goes back in the steps that it came in, until nothing touches. With adhesion the steps are
//! shortened before the load passes zero, where the largest pull is to be found. PrescribedLoads from the continuum go back load by load.

use super::initial_configuration::PrescribedLoad;
use super::job::Job;
use super::load_history::{Between, Bracket, LoadHistory, StepRecord};
use crate::Result;
use crate::record::results::AtomPullOff;
use crate::units::NN_PER_EV_A;

/// Steps on the way back over the shorter ones in which a pull is followed: a step of 0.3 Å becomes 0.075 Å, an eighth of the
/// way (0.6 Å with a range of 0.5 Å) from no load to the largest pull.
pub const STEP_REFINEMENT: usize = 4;

/// The way back ends where nothing touches and the pull has fallen to this part of its largest, as that of the continuum.
pub const PASSED: f64 = 0.3;

/// It ends in any case when the indenter is as far above where it started, Å: beyond the reach of the adhesion it would be
/// pulling material after it.
pub const MOST_RISEN_ANGSTROM: f64 = 7.0;

/// What the script has to know of a way back that it goes on with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnloadingState {
    /// The step from which on the indenter rises.
    pub reversal_step: usize,
    /// The step from which on it does so in shorter steps.
    pub refined_from: Option<usize>,
    /// Lowest load on the way back, eV/Å; zero where nothing pulls.
    pub min_load: f64,
    /// The step with which the way back has ended.
    pub end: Option<usize>,
}

impl Job {
    /// The step at which the indenter is to turn, if it has come so far: the one with the highest load.
    pub fn reversal_step(&self, records: &[StepRecord]) -> Option<usize> {
        let settings = &self.record.settings;
        match &self.record.loads {
            Some(asked) => {
                let peak = asked.peak();
                (peak < asked.loads.len() && records.len() > peak).then_some(peak)
            }
            None if settings.unload => self.bottom(records),
            None => None,
        }
    }

    /// The step with which a ladder has reached its load, or as many steps as it may have.
    fn bottom(&self, records: &[StepRecord]) -> Option<usize> {
        let settings = &self.record.settings;
        records.iter().find(|r| r.load >= settings.max_load || r.step >= settings.max_steps).map(|r| r.step)
    }

    /// The step with which the job has come to its end.
    pub fn end(&self, records: &[StepRecord]) -> Option<usize> {
        if let Some(hold) = &self.record.nvt {
            return (records.len() >= hold.loads.len()).then(|| hold.loads.len() - 1);
        }
        match &self.record.loads {
            Some(asked) => (records.len() > asked.loads.len()).then_some(asked.loads.len()),
            None if self.record.settings.unload => self.unloading_state(records)?.end,
            None => self.bottom(records),
        }
    }

    /// The atoms at a load, eV/Å, of the way there: at the step that was asked for it, or, from first touch, between the steps of the
    /// ladder down around it.
    ///
    /// # Errors
    /// `Format` when the ladder does not reach the load or a frame is damaged; `Io` when a frame is missing.
    pub fn at_load(&self, history: &LoadHistory, load: f64) -> Result<Between> {
        let bracket = match &self.record.loads {
            Some(asked) => own_step(history, 1, &asked.loads[..asked.peak()], load),
            None => history.bracket(load, self.reversal_step(&history.steps)),
        };
        history.at(&self.folder, bracket, load)
    }

    /// The same on the way back.
    ///
    /// # Errors
    /// As [`Self::at_load`].
    pub fn at_load_unloading(&self, history: &LoadHistory, load: f64) -> Result<Between> {
        let bracket = match &self.record.loads {
            Some(asked) => own_step(history, 1 + asked.peak(), &asked.loads[asked.peak()..], load),
            None => self.reversal_step(&history.steps).and_then(|turn| history.bracket_unloading(load, turn)),
        };
        history.at(&self.folder, bracket, load)
    }

    /// The way back of a ladder from first touch, as far as it has come.
    pub fn unloading_state(&self, records: &[StepRecord]) -> Option<UnloadingState> {
        let turn = self.reversal_step(records).filter(|_| self.record.loads.is_none())?;
        let mut unloading = UnloadingState { reversal_step: turn, refined_from: None, min_load: 0.0, end: None };
        for pair in records[turn..].windows(2) {
            let [before, now] = pair else { continue };
            let separated = now.contacts == 0 && now.load >= PASSED * unloading.min_load;
            unloading.min_load = unloading.min_load.min(now.load);
            if separated || now.displacement_angstrom <= -MOST_RISEN_ANGSTROM {
                unloading.end = Some(now.step);
                break;
            }
            if unloading.refined_from.is_none()
                && self.record.interaction.adhesion.is_some()
                && 2.0 * now.load < before.load
            {
                unloading.refined_from = Some(now.step);
            }
        }
        Some(unloading)
    }

    /// `-var` pairs of the script for a way back that goes on after `done`.
    pub(super) fn unloading_variables(&self, done: &[StepRecord]) -> Vec<(&'static str, String)> {
        let mut list = vec![
            ("unload", "1".to_string()),
            ("step_refinement", STEP_REFINEMENT.to_string()),
            ("pull_fraction", PASSED.to_string()),
            ("max_rise", MOST_RISEN_ANGSTROM.to_string()),
        ];
        if let Some((unloading, last)) = self.unloading_state(done).zip(done.last()) {
            list.push(("reversal_step", unloading.reversal_step.to_string()));
            list.push(("refined_from", unloading.refined_from.map_or("-1".to_string(), |k| k.to_string())));
            list.push(("previous_load", last.load.to_string()));
            list.push(("min_load", unloading.min_load.to_string()));
        }
        list
    }
}

/// The step of a load among those that were asked for from step `first` on, if it has been run. Both numbers come from one p*.
fn own_step(history: &LoadHistory, first: usize, asked: &[PrescribedLoad], load: f64) -> Option<Bracket> {
    let lower = first + asked.iter().position(|a| (a.load - load).abs() <= 1e-9 * load.abs())?;
    (lower < history.steps.len()).then_some(Bracket { lower, weight: 0.0 })
}

/// The largest pull among the steps from `turn` on; none where nothing pulls. `load_unit` is the load at p* = 1, eV/Å.
///
/// The pull grows ever more slowly towards its largest value, so that it grew by less after the step found than on the step to it:
/// that change is the error.
pub fn pull_off(records: &[StepRecord], turn: usize, load_unit: f64) -> Option<AtomPullOff> {
    let back = records.get(turn..)?;
    let k = (0..back.len()).min_by(|&a, &b| back[a].load.total_cmp(&back[b].load)).filter(|&k| k > 0)?;
    let (before, found) = (&back[k - 1], &back[k]);
    (found.load < 0.0).then(|| AtomPullOff {
        step: found.step,
        force_ev_per_angstrom: found.load,
        error_ev_per_angstrom: before.load - found.load,
        force_nn: found.load * NN_PER_EV_A,
        p_star: found.load / load_unit,
        displacement_angstrom: found.displacement_angstrom,
        step_angstrom: before.displacement_angstrom - found.displacement_angstrom,
        contacts: found.contacts,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::atoms::block::Block;
    use crate::atoms::indenter::Indenter;
    use crate::atoms::job::{Interaction, RunSettings, Yukawa};

    fn job(adhesion: bool, unload: bool) -> (tempfile::TempDir, Job) {
        let folder = tempfile::tempdir().expect("scratch");
        let block = Block::new(5, 1, 5.5884, 7.0).expect("valid");
        let indenter = Indenter::above(&block, 11, vec![0.5; 121], 4.0327).expect("valid");
        let table = folder.path().join("table");
        std::fs::write(&table, "a table").expect("written");
        let yukawa = Yukawa { amplitude_ev_angstrom: -60.0, kappa_per_angstrom: 2.0, cutoff_angstrom: 7.0 };
        let interaction =
            Interaction { epsilon_ev: 0.2145, sigma_angstrom: 3.5927, adhesion: adhesion.then_some(yukawa) };
        let history = RunSettings {
            step_angstrom: 0.3,
            max_load: 5.0,
            max_steps: 10,
            force_tolerance: 2e-3,
            load_unit: 100.0,
            contact_angstrom: 4.0354,
            frame_layers: 3,
            unload,
            keep: false,
        };
        let crystal = (table.as_path(), "Ca", 40.078);
        let job = Job::write(folder.path().join("job"), &block, &indenter, crystal, interaction, history, None);
        (folder, job.expect("written"))
    }

    /// Steps with these displacements, loads and contacts.
    fn records(list: &[(f64, f64, usize)]) -> Vec<StepRecord> {
        let record = |(step, &(displacement_angstrom, load, contacts)): (usize, &(f64, f64, usize))| StepRecord {
            step,
            displacement_angstrom,
            load,
            energy_ev: -1.0,
            iterations: 3,
            max_force: 1e-3,
            contacts,
            indenter_low_angstrom: 40.0 - displacement_angstrom,
            indenter_mean_angstrom: 41.0,
            atoms: 9,
            load_converged: true,
        };
        list.iter().enumerate().map(record).collect()
    }

    #[test]
    fn a_way_down_ends_at_its_load_and_a_way_back_where_nothing_touches() {
        let way = records(&[(0.0, 0.0, 0), (0.3, 2.0, 3), (0.6, 5.5, 8), (0.3, 2.0, 3), (0.0, 0.1, 1), (-0.3, 0.0, 0)]);
        let (_folder, down) = job(false, false);
        assert_eq!((down.reversal_step(&way), down.end(&way), down.end(&way[..2])), (None, Some(2), None));
        let (_folder, both) = job(false, true);
        assert_eq!((both.reversal_step(&way), both.reversal_step(&way[..2])), (Some(2), None));
        assert_eq!((both.end(&way), both.end(&way[..5])), (Some(5), None));
        assert_eq!(both.unloading_state(&way[..2]), None);
        // Without adhesion no step is shortened.
        assert_eq!(
            both.unloading_state(&way[..5]),
            Some(UnloadingState { reversal_step: 2, refined_from: None, min_load: 0.0, end: None })
        );
        assert_eq!(pull_off(&way, 2, 100.0), None);
    }

    /// PrescribedLoads that were asked for are found at their own steps, those of the way back not at those of the way there, and none between.
    #[test]
    fn a_load_that_was_asked_for_is_at_its_own_step() {
        let asked = |load| PrescribedLoad { load, dz_angstrom: 1.0, move_hash: String::new() };
        let [there, back] = [[asked(1.0), asked(3.0)], [asked(1.0), asked(0.5)]];
        let history = LoadHistory { steps: records(&[(0.0, 0.0, 0), (0.1, 1.0, 1), (0.2, 2.9, 2), (0.1, 1.0, 1)]) };
        let at = |bracket: Option<Bracket>| bracket.map(|b| (b.lower, b.weight));
        assert_eq!(at(own_step(&history, 1, &there, 1.0)), Some((1, 0.0)));
        // It missed its load: that is told, and the state is its own all the same.
        assert_eq!(at(own_step(&history, 1, &there, 3.0)), Some((2, 0.0)));
        assert_eq!(at(own_step(&history, 1, &there, 2.0)), None);
        assert_eq!(at(own_step(&history, 3, &back, 1.0)), Some((3, 0.0)));
        // Not reached yet.
        assert_eq!(at(own_step(&history, 3, &back, 0.5)), None);
    }

    #[test]
    fn with_adhesion_the_pull_is_followed_in_shorter_steps_until_it_has_faded() {
        let way = records(&[
            (0.0, -0.2, 0),
            (0.3, 5.5, 8),
            (0.0, 3.0, 4),
            (-0.3, 1.0, 2),
            (-0.375, -0.5, 1),
            (-0.45, -1.5, 1),
            (-0.525, -2.0, 1),
            (-0.6, -1.9, 0),
            (-0.675, -0.5, 0),
        ]);
        let (_folder, job) = job(true, true);
        let found = job.unloading_state(&way).expect("a way back");
        assert_eq!(found, UnloadingState { reversal_step: 1, refined_from: Some(3), min_load: -2.0, end: Some(8) });
        // Nothing touches already where much of the pull is left.
        assert_eq!(job.end(&way[..8]), None);
        let pull = pull_off(&way, 1, 100.0).expect("a pull");
        assert_eq!((pull.step, pull.force_ev_per_angstrom, pull.contacts), (6, -2.0, 1));
        assert!((pull.error_ev_per_angstrom - 0.5).abs() < 1e-12 && (pull.step_angstrom - 0.075).abs() < 1e-12);
        assert!((pull.p_star + 0.02).abs() < 1e-12);
        // What a script that goes on is told.
        let told = job.variables(&way[..6], false);
        for (key, value) in [
            ("start", "5"),
            ("reversal_step", "1"),
            ("refined_from", "3"),
            ("previous_load", "-1.5"),
            ("min_load", "-1.5"),
        ] {
            assert!(told.contains(&(key.into(), value.into())), "{key} in {told:?}");
        }
        for (key, _) in told {
            assert!(job.script().text.contains(&format!("\nvariable {key} ")), "{key}");
        }
    }

    #[test]
    fn a_pull_that_does_not_let_go_ends_beyond_its_reach() {
        let (_folder, job) = job(true, true);
        let way = records(&[(0.0, 0.0, 0), (0.3, 6.0, 2), (-6.9, -3.0, 2), (-7.05, -3.1, 2)]);
        assert_eq!((job.end(&way), job.end(&way[..3])), (Some(3), None));
    }
}

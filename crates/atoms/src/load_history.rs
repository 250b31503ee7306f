//! The load steps of a job: their table, the interpolation of frames at a load, and the preparation of a continued run.
//!
//! `load_steps.csv` has one line per finished step, written after the frame and the restart file of the step. Files
//! of a step without a complete line belong to an interrupted step.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

use super::dump::{DumpFrame, read_frame};
use super::minimizer_checkpoint;
use crate::results::{LoadStepResults, StepMinimizer};
use asperity_grid::{Error, Result};
use asperity_surface::files::atomic_file::{
    list, open_kept, open_regular, read_bytes, read_text, remove, write_atomic,
};
use asperity_surface::files::hashed::file_hash;

pub const LOAD_STEPS_FILE: &str = "load_steps.csv";

/// First line of the file, as `end_of_step.in` and `nvt.in` write it.
pub const HEADER: &str = "step,displacement_angstrom,load_ev_per_angstrom,energy_ev,iterations,max_force_ev_per_angstrom,\
                          contacts,indenter_min_angstrom,indenter_mean_angstrom,atoms,load_converged,minimizer,rejected,\
                          predicted_decrease_ev";

/// One finished step.
#[derive(Debug, Clone, PartialEq)]
pub struct StepRecord {
    pub step: usize,
    pub displacement_angstrom: f64,
    /// Normal force on the indenter, repulsion positive, eV/Å.
    pub load: f64,
    pub energy_ev: f64,
    pub iterations: usize,
    /// Largest residual force component on a free atom, eV/Å.
    pub max_force: f64,
    pub contacts: usize,
    pub indenter_low_angstrom: f64,
    pub indenter_mean_angstrom: f64,
    pub atoms: u64,
    /// False if the forces on indenter and base did not converge to the prescribed load.
    pub load_converged: bool,
    pub minimizer: StepMinimizer,
    /// Steps that the harmonic relaxation rejected.
    pub rejected: usize,
    /// Decrease of the energy that the harmonic crystal still predicts, eV: half the work of the residual forces in the displacements that
    /// they cause. `None` where it is not known.
    pub predicted_decrease_ev: Option<f64>,
}

impl StepRecord {
    /// `load_unit` is the load at p* = 1, eV/Å; `evaluations` are the counts of the log ([`evaluations`]).
    pub fn to_results(&self, load_unit: f64, evaluations: &BTreeMap<usize, usize>) -> LoadStepResults {
        LoadStepResults {
            step: self.step,
            displacement_angstrom: self.displacement_angstrom,
            load_ev_per_angstrom: self.load,
            p_star: self.load / load_unit,
            contacts: self.contacts,
            energy_ev: self.energy_ev,
            // Without a log only the iterations are known, and they exclude those before a checkpoint; the minimiser
            // needs at least one force evaluation per iteration.
            force_evaluations: evaluations.get(&self.step).copied().unwrap_or(0).max(self.iterations),
            max_force_ev_per_angstrom: self.max_force,
            minimizer: self.minimizer,
            rejected: self.rejected,
            predicted_decrease_ev: self.predicted_decrease_ev,
        }
    }

    pub(super) fn parse(line: &str) -> Option<Self> {
        let tokens: Vec<&str> = line.trim_end().split(',').collect();
        if tokens.len() != HEADER.split(',').count() {
            return None;
        }
        let real = |k: usize| tokens[k].parse::<f64>().ok().filter(|v| v.is_finite());
        Some(StepRecord {
            step: tokens[0].parse().ok()?,
            // Rounded output may contain a negative zero.
            displacement_angstrom: real(1)? + 0.0,
            load: real(2)?,
            energy_ev: real(3)?,
            iterations: tokens[4].parse().ok()?,
            max_force: real(5)?,
            contacts: tokens[6].parse().ok()?,
            indenter_low_angstrom: real(7)?,
            indenter_mean_angstrom: real(8)?,
            atoms: tokens[9].parse().ok()?,
            load_converged: tokens[10] != "0",
            minimizer: StepMinimizer::of_word(tokens[11])?,
            rejected: tokens[12].parse().ok()?,
            predicted_decrease_ev: if tokens[13].is_empty() { None } else { Some(real(13)?) },
        })
    }
}

/// The finished steps 0, 1, 2, ..., without gaps.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LoadHistory {
    pub steps: Vec<StepRecord>,
}

/// Position of a load between two steps: linear interpolation with `weight` of step `lower` + 1 and 1 - `weight` of
/// step `lower`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bracket {
    pub lower: usize,
    pub weight: f64,
}

/// Atoms and indenter displacement at a load.
#[derive(Debug, Clone, PartialEq)]
pub struct Between {
    pub bracket: Bracket,
    pub frame: DumpFrame,
    /// Displacement of the indenter from its initial position, downwards, Å.
    pub displacement_angstrom: f64,
}

impl LoadHistory {
    /// Parses the table. An incomplete last line is ignored; any other damage is an error.
    ///
    /// # Errors
    /// `Format`, naming the line.
    pub fn parse(text: &str, file: &Path) -> Result<Self> {
        let mut records = Vec::new();
        let damaged = |k: usize, line: &str| {
            let found = format!("line {}: {}", k + 1, line.trim_end());
            Error::format(file, found, format!("a table with the columns {HEADER}"))
        };
        for (k, line) in text.split_inclusive('\n').enumerate().take_while(|(_, line)| line.ends_with('\n')) {
            match StepRecord::parse(line) {
                _ if k == 0 && line.trim_end() == HEADER => {}
                Some(record) if record.step + 1 == k => records.push(record),
                _ => return Err(damaged(k, line)),
            }
        }
        Ok(LoadHistory { steps: records })
    }

    /// Reads the table of a job folder; it is empty before the first step is finished.
    ///
    /// # Errors
    /// `Io` and `Format`.
    pub fn read(folder: &Path) -> Result<Self> {
        let file = folder.join(LOAD_STEPS_FILE);
        match read_text(&file) {
            Ok(text) => LoadHistory::parse(&text, &file),
            Err(Error::Io { source, .. }) if source.kind() == std::io::ErrorKind::NotFound => {
                Ok(LoadHistory::default())
            }
            Err(e) => Err(e),
        }
    }

    pub fn last(&self) -> Option<&StepRecord> {
        self.steps.last()
    }

    /// The first decrease through `load` on the unloading branch, which starts at step `turn`.
    pub fn bracket_unloading(&self, load: f64, turn: usize) -> Option<Bracket> {
        let loads: Vec<f64> = self.steps.get(turn..)?.iter().map(|r| r.load).collect();
        let k = loads.windows(2).position(|pair| pair[0] >= load && load >= pair[1])?;
        Some(Bracket { lower: turn + k, weight: weight(loads[k], loads[k + 1], load) })
    }

    /// The first increase through `load`, up to step `turn`, as under load control. `None` if the load is not
    /// reached.
    pub fn bracket(&self, load: f64, turn: Option<usize>) -> Option<Bracket> {
        let there = &self.steps[..turn.map_or(self.steps.len(), |k| (k + 1).min(self.steps.len()))];
        bracket(&there.iter().map(|r| r.load).collect::<Vec<f64>>(), load)
    }

    /// Linear interpolation of atom positions and indenter height at a bracket of `load` (eV/Å). Load steps are a
    /// fraction of an ångström, so atoms that do not slip move by far less than the contact distance.
    ///
    /// # Errors
    /// `Format` without a bracket (the load is not reached) or for a damaged frame; `Io` for a missing frame.
    pub(super) fn at(&self, folder: &Path, bracket: Option<Bracket>, load: f64) -> Result<Between> {
        let bracket = bracket.ok_or_else(|| {
            let reached = self.steps.iter().map(|r| r.load).fold(0.0, f64::max);
            let found = format!(
                "a load history from {:.4} to {reached:.4} eV/angstrom",
                self.steps.first().map_or(0.0, |r| r.load)
            );
            Error::format(folder.join(LOAD_STEPS_FILE), found, format!("one that passes {load:.4} eV/angstrom"))
        })?;
        let a = &self.steps[bracket.lower];
        let below = read_frame(frame_file(folder, a.step)?)?;
        if bracket.weight == 0.0 {
            return Ok(Between { bracket, frame: below, displacement_angstrom: a.displacement_angstrom });
        }
        let b = &self.steps[bracket.lower + 1];
        let above = read_frame(frame_file(folder, b.step)?)?;
        Ok(between(bracket, &below, &above, [a.displacement_angstrom, b.displacement_angstrom]))
    }
}

/// The first interval of `loads`, in their order, in which they increase through `load`.
pub fn bracket(loads: &[f64], load: f64) -> Option<Bracket> {
    let lower = loads.windows(2).position(|pair| pair[0] <= load && load <= pair[1])?;
    Some(Bracket { lower, weight: weight(loads[lower], loads[lower + 1], load) })
}

/// The interpolated frame at `bracket`; `ends` are the displacements of the indenter in both frames, Å.
pub fn between(bracket: Bracket, below: &DumpFrame, above: &DumpFrame, ends: [f64; 2]) -> Between {
    let frame = interpolate(below, above, bracket.weight);
    Between { bracket, frame, displacement_angstrom: ends[0] + bracket.weight * (ends[1] - ends[0]) }
}

/// Interpolation weight at `load` between steps with loads `a` and `b`. Compressive loads rise approximately as the
/// square of the displacement; with a tensile load the interpolation is linear. Measured on the quickstart without
/// every second step: the indenter height is off by 0.01 Å, with a linear load by 0.04 Å.
pub fn weight(a: f64, b: f64, load: f64) -> f64 {
    let (a, b, load) = if a.min(b) >= 0.0 { (a.sqrt(), b.sqrt(), load.sqrt()) } else { (a, b, load) };
    if b == a { 0.0 } else { (load - a) / (b - a) }
}

/// Interpolates the positions of two frames of one run by the minimum image. An atom that is in only one frame keeps
/// its position.
pub fn interpolate(below: &DumpFrame, above: &DumpFrame, weight: f64) -> DumpFrame {
    let mut frame = DumpFrame {
        ids: Vec::new(),
        species: Vec::new(),
        positions: Vec::new(),
        forces_z: Vec::new(),
        ..below.clone()
    };
    let (mut i, mut j) = (0, 0);
    let mut take = |from: &DumpFrame, k: usize, position: [f64; 3]| {
        frame.ids.push(from.ids[k]);
        frame.species.extend(from.species.get(k));
        frame.positions.push(position);
    };
    while i < below.len() || j < above.len() {
        let (a, b) = (below.ids.get(i).copied().unwrap_or(u32::MAX), above.ids.get(j).copied().unwrap_or(u32::MAX));
        if a == b && i < below.len() && j < above.len() {
            let (from, to) = (below.positions[i], above.positions[j]);
            let mut position = from;
            for axis in 0..3 {
                let mut step = to[axis] - from[axis];
                if below.periodic[axis] {
                    step -= (step / below.length(axis)).round() * below.length(axis);
                }
                position[axis] += weight * step;
            }
            take(below, i, position);
            i += 1;
            j += 1;
        } else if j >= above.len() || (i < below.len() && a < b) {
            take(below, i, below.positions[i]);
            i += 1;
        } else {
            take(above, j, above.positions[j]);
            j += 1;
        }
    }
    frame
}

/// The frame file of a step, compressed or not.
///
/// # Errors
/// `Io` when there is no frame file.
pub fn frame_file(folder: &Path, step: usize) -> Result<PathBuf> {
    let plain = folder.join(format!("frame.{step}.dump"));
    let packed = folder.join(format!("frame.{step}.dump.zst"));
    if packed.is_file() {
        return Ok(packed);
    }
    if plain.is_file() {
        return Ok(plain);
    }
    Err(Error::io("open", &plain)(std::io::ErrorKind::NotFound.into()))
}

/// Force evaluations per step, from the log: the sum over all minimisations after the line `load step 3` of
/// `Iterations, force evaluations = 12 24`. A step that was started twice counts once.
pub fn evaluations(log: &str) -> BTreeMap<usize, usize> {
    let mut counts = BTreeMap::new();
    let mut step = None;
    for line in log.lines() {
        if let Some(number) = line.strip_prefix("load step ") {
            step = number.trim().parse::<usize>().ok();
            step.map(|s| counts.remove(&s));
        } else if let Some(step) = step
            && let Some(remainder) = line.trim_start().strip_prefix("Iterations, force evaluations =")
            && let Some(count) = remainder.split_whitespace().nth(1).and_then(|w| w.parse::<usize>().ok())
        {
            *counts.entry(step).or_insert(0) += count;
        }
    }
    counts
}

/// Verifies the frame of a finished step: LAMMPS does not detect a frame truncated by a full disk. The hashes of the
/// frame and of the step's line are stored in `frame.K.b3`, that of the restart file in `restart.K.b3`, so that later
/// damage is detected before a run continues from it.
///
/// # Errors
/// `Format` for an incomplete frame; `Io`.
pub fn verify_step(folder: &Path, step: usize) -> Result<()> {
    let frame = frame_file(folder, step)?;
    read_frame(&frame)?;
    let table = folder.join(LOAD_STEPS_FILE);
    let text = read_bytes(&table)?;
    let line = text.split_inclusive(|b| *b == b'\n').nth(1 + step).unwrap_or_default();
    let hashes = hashes_of_step(&frame, line)?;
    // With short steps LAMMPS may have removed the file already; two later files exist then.
    if let Some(hash) = hash_of(&folder.join(format!("restart.{step}")))? {
        write_atomic(&hash_file(folder, step), |w| w.write_all(hash.as_bytes()))?;
    }
    if let Some(old) = step.checked_sub(2) {
        remove(&hash_file(folder, old))?;
    }
    // Last: it says that the step is verified.
    write_atomic(&verified_file(folder, step), |w| w.write_all(hashes.as_bytes()))
}

/// Hashes of the frame and the line of a step that [`verify_step`] found whole.
pub(super) fn verified_file(folder: &Path, step: usize) -> PathBuf {
    folder.join(format!("frame.{step}.b3"))
}

/// Number of steps up to the last one that [`verify_step`] found whole, of the first `steps`. LAMMPS may have finished others behind it
/// before it was stopped.
pub(super) fn seen_steps(folder: &Path, steps: usize) -> usize {
    (0..steps).rev().find(|step| verified_file(folder, *step).exists()).map_or(0, |last| last + 1)
}

/// Hashes of a frame and of its line in the table.
pub(super) fn hashes_of_step(frame: &Path, line: &[u8]) -> Result<String> {
    let frame = hash_of(frame)?.unwrap_or_default();
    Ok(format!("{frame} {}", blake3::hash(line).to_hex()))
}

/// Removes all steps from `step` on.
///
/// # Errors
/// As [`prepare_resume`].
pub fn roll_back(folder: &Path, step: usize) -> Result<()> {
    let frame = ["dump", "dump.zst", "b3"].map(|end| format!("frame.{step}.{end}"));
    for kept in frame.into_iter().chain([format!("restart.{step}")]) {
        remove(&folder.join(kept))?;
    }
    shorten(folder, step)?;
    prepare_resume(folder).map(drop)
}

fn hash_file(folder: &Path, step: usize) -> PathBuf {
    folder.join(format!("restart.{step}.b3"))
}

/// BLAKE3 hash of a file, if it exists.
fn hash_of(file: &Path) -> Result<Option<String>> {
    match file_hash(file) {
        Err(Error::Io { source, .. }) if source.kind() == std::io::ErrorKind::NotFound => Ok(None),
        hash => hash.map(Some),
    }
}

/// Keeps the first `steps` steps of a folder and removes later checkpoints. A damaged table stays damaged: `damage::remove_damaged`
/// repairs it, and says so.
///
/// # Errors
/// `Io`.
pub(super) fn keep_first(folder: &Path, steps: usize) -> Result<()> {
    if shorten(folder, steps)? {
        remove_after(folder, steps.checked_sub(1))?;
    }
    minimizer_checkpoint::keep_first(folder, steps)
}

/// Truncates the table to its first `steps` steps. Whether it had more.
fn shorten(folder: &Path, steps: usize) -> Result<bool> {
    let file = folder.join(LOAD_STEPS_FILE);
    if file.is_file() {
        let text = read_bytes(&file)?;
        let lines = if steps == 0 { 0 } else { 1 + steps };
        let keep: usize = text.split_inclusive(|b| *b == b'\n').take(lines).map(<[u8]>::len).sum();
        if keep < text.len() {
            let handle = open_kept(&file)?;
            handle.set_len(keep as u64).map_err(Error::io("shorten", &file))?;
            return Ok(true);
        }
    }
    Ok(false)
}

/// Removes frames and restart files of the steps after `last`, of all steps without it.
fn remove_after(folder: &Path, last: Option<usize>) -> Result<()> {
    for (name, path) in list(folder)? {
        let step = name
            .strip_prefix("frame.")
            .or(name.strip_prefix("restart."))
            .and_then(|remainder| remainder.split('.').next())
            .and_then(|number| number.parse::<usize>().ok());
        if step.is_some_and(|s| last.is_none_or(|last| s > last)) {
            remove(&path)?;
        }
    }
    Ok(())
}

/// Prepares a folder for a continued run: keeps the steps up to the last one with a readable frame and an undamaged
/// restart file (one without a stored hash counts as undamaged), removes later files, and returns that step. `None`:
/// the run starts at step 0.
///
/// # Errors
/// `Io`; `Format` for a damaged table, unless only its last line is incomplete.
pub fn prepare_resume(folder: &Path) -> Result<Option<usize>> {
    let history = LoadHistory::read(folder)?;
    let intact = |record: &&StepRecord| {
        let restart = folder.join(format!("restart.{}", record.step));
        let written = read_text(&hash_file(folder, record.step)).ok();
        let sound = || written.is_none_or(|hash| hash_of(&restart).is_ok_and(|stored| stored == Some(hash)));
        open_regular(&restart).is_ok_and(|(_, bytes)| bytes > 0)
            && sound()
            && frame_file(folder, record.step).and_then(read_frame).is_ok()
    };
    let last = history.steps.iter().rev().find(intact).map(|r| r.step);
    remove_after(folder, last)?;
    shorten(folder, last.map_or(0, |l| l + 1))?;
    Ok(last)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(step: usize, load: f64) -> String {
        format!("{step},{:.6},{load},-100.5,12,1.5e-03,{step},44.5,45.5,200,1,fire,0,\n", step as f64 * 0.3)
    }

    fn table(lines: &str) -> String {
        format!("{HEADER}\n{lines}")
    }

    fn history(loads: &[f64]) -> LoadHistory {
        let text: String = loads.iter().enumerate().map(|(k, l)| line(k, *l)).collect();
        LoadHistory::parse(&table(&text), Path::new("load_steps.csv")).expect("good")
    }

    fn frame(atoms: &[(u32, [f64; 3])]) -> DumpFrame {
        DumpFrame {
            source: "test".into(),
            timestep: 0,
            time: None,
            bounds: [[0.0, 10.0], [0.0, 10.0], [0.0, 50.0]],
            periodic: [true, true, false],
            ids: atoms.iter().map(|a| a.0).collect(),
            species: vec![1; atoms.len()],
            has_types: true,
            elements: Vec::new(),
            positions: atoms.iter().map(|a| a.1).collect(),
            forces_z: Vec::new(),
            has_units: false,
        }
    }

    fn dump(folder: &Path, step: usize, z: f64) {
        let text = format!(
            "ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ATOMS\n1\nITEM: BOX BOUNDS pp pp ff\n0 10\n0 10\n0 50\n\
             ITEM: ATOMS id type x y z\n1 1 5 5 {z}\n"
        );
        std::fs::write(folder.join(format!("frame.{step}.dump")), text).expect("written");
    }

    #[test]
    fn an_incomplete_last_line_is_ignored_and_other_damage_is_an_error() {
        let text = table(&(line(0, 0.0) + &line(1, 1.0)));
        for cut in table(&line(0, 0.0)).len()..text.len() {
            let history = LoadHistory::parse(&text[..cut], Path::new("l")).expect("good");
            assert_eq!(history.steps.len(), 1, "cut at {cut}");
        }
        assert!(LoadHistory::parse(&table(&line(1, 0.0)), Path::new("l")).is_err());
        assert!(LoadHistory::parse(&table(&line(0, f64::NAN)), Path::new("l")).is_err());
        assert!(LoadHistory::parse("what\n", Path::new("l")).expect_err("bad").to_string().contains("line 1"));
    }

    #[test]
    fn a_step_says_how_it_was_relaxed() {
        let of = |relaxed: &str| StepRecord::parse(&line(0, 1.0).replace("fire,0,", relaxed));
        let words = |r: StepRecord| (r.minimizer, r.rejected, r.predicted_decrease_ev);
        assert_eq!(of("harmonic+fire,3,1.5e-06").map(words), Some((StepMinimizer::HarmonicFire, 3, Some(1.5e-6))));
        assert_eq!(of("cg,0,").map(words), Some((StepMinimizer::Cg, 0, None)));
        for damaged in ["sd,0,", "fire,-1,", "fire,0,nan", "fire,0", "fire,0,,"] {
            assert_eq!(of(damaged), None, "{damaged}");
        }
        // The words are those of `results.json`.
        for minimizer in StepMinimizer::ALL {
            assert_eq!(serde_json::to_value(minimizer).expect("a word"), minimizer.word());
        }
    }

    #[test]
    fn loads_are_bracketed_at_the_first_increase() {
        // Adhesion causes a tensile load first, and a yield event decreases the load.
        let l = history(&[0.0, -1.0, 2.0, 1.5, 4.0]);
        assert_eq!(l.bracket(1.0, None), Some(Bracket { lower: 1, weight: 2.0 / 3.0 }));
        assert_eq!(l.bracket(1.8, None).map(|b| b.lower), Some(1));
        // A later step with exactly this load does not matter.
        assert_eq!(l.bracket(1.5, None).map(|b| b.lower), Some(1));
        assert_eq!(l.bracket(3.0, None).map(|b| b.lower), Some(3));
        assert_eq!((l.bracket(4.1, None), l.bracket(3.0, Some(2))), (None, None));
        assert_eq!(LoadHistory::default().bracket(0.0, Some(0)), None);
    }

    #[test]
    fn unloading_loads_are_bracketed_at_the_first_decrease() {
        let l = history(&[0.0, 2.0, 6.0, 4.0, 1.0, -1.0, 0.5, 0.0]);
        assert_eq!(l.bracket_unloading(4.0, 2), Some(Bracket { lower: 2, weight: 1.0 }));
        // On the loading branch the bracket lies between the loading steps.
        assert_eq!(l.bracket(4.0, Some(2)).map(|b| b.lower), Some(1));
        let actual = l.bracket_unloading(2.0, 2).expect("passed");
        assert_eq!(actual.lower, 3);
        assert!((actual.weight - (2.0 - 2f64.sqrt())).abs() < 1e-12, "{}", actual.weight);
        assert_eq!(l.bracket_unloading(0.2, 2).map(|b| (b.lower, (b.weight * 100.0).round())), Some((4, 40.0)));
        assert_eq!((l.bracket_unloading(7.0, 2), l.bracket_unloading(1.0, 9)), (None, None));
    }

    #[test]
    fn positions_are_interpolated_by_the_minimum_image() {
        let below = frame(&[(1, [9.9, 5.0, 20.0]), (2, [1.0, 1.0, 18.0]), (9, [3.0, 3.0, 21.0])]);
        let above = frame(&[(1, [0.3, 5.4, 19.0]), (4, [2.0, 2.0, 17.0]), (9, [3.0, 3.0, 20.0])]);
        let between = interpolate(&below, &above, 0.25);
        assert_eq!(between.ids, [1, 2, 4, 9]);
        let expected = [10.0, 5.1, 19.75];
        assert!(between.positions[0].iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12));
        assert_eq!(between.positions[2], [2.0, 2.0, 17.0]);
        assert_eq!(between.positions[3], [3.0, 3.0, 20.75]);
        assert_eq!(interpolate(&below, &above, 0.0).position(1), below.position(1));
    }

    #[test]
    fn atoms_are_interpolated_between_two_load_steps() {
        let folder = tempfile::tempdir().expect("scratch");
        (0..3).for_each(|k| dump(folder.path(), k, 20.0 - k as f64));
        let l = history(&[0.0, 2.0, 6.0]);
        let at = l.at(folder.path(), l.bracket(3.0, None), 3.0).expect("reached");
        let w = (3f64.sqrt() - 2f64.sqrt()) / (6f64.sqrt() - 2f64.sqrt());
        let [_, _, z] = at.frame.position(1).expect("there");
        assert!((z - (19.0 - w)).abs() < 1e-12 && (w - 0.307).abs() < 1e-3);
        assert!((at.displacement_angstrom - 0.3 * (1.0 + w)).abs() < 1e-12);
        let error = l.at(folder.path(), l.bracket(7.0, None), 7.0).expect_err("not reached").to_string();
        assert!(error.contains("passes 7.0000"), "{error}");
    }

    #[test]
    fn a_continued_run_removes_unfinished_steps() {
        let folder = tempfile::tempdir().expect("scratch");
        let path = folder.path();
        assert_eq!(prepare_resume(path).expect("empty"), None);
        let whole = table(&(0..3).map(|k| line(k, k as f64)).collect::<String>());
        std::fs::write(path.join(LOAD_STEPS_FILE), format!("{whole}3,0.9,3.")).expect("written");
        (0..4).for_each(|k| dump(path, k, 20.0));
        for k in 1..4 {
            std::fs::write(path.join(format!("restart.{k}")), "state").expect("written");
        }
        assert_eq!(prepare_resume(path).expect("good"), Some(2));
        assert_eq!(std::fs::read_to_string(path.join(LOAD_STEPS_FILE)).expect("read"), whole);
        assert!(!path.join("frame.3.dump").exists() && !path.join("restart.3").exists());
        assert!(path.join("frame.2.dump").exists() && path.join("restart.1").exists());
        // A missing restart file: the previous step.
        std::fs::remove_file(path.join("restart.2")).expect("removed");
        assert_eq!(prepare_resume(path).expect("good"), Some(1));
        assert_eq!(LoadHistory::read(path).expect("good").steps.len(), 2);
        // A restart file that differs from the stored hash is not used.
        verify_step(path, 1).expect("whole");
        assert_eq!(prepare_resume(path).expect("good"), Some(1));
        std::fs::write(path.join("restart.0"), "older").expect("written");
        std::fs::write(path.join("restart.1"), "stale").expect("written");
        assert_eq!(prepare_resume(path).expect("good"), Some(0));
        assert!(!path.join("restart.1.b3").exists());
        std::fs::remove_file(path.join("restart.0")).expect("removed");
        assert_eq!(prepare_resume(path).expect("good"), None);
        assert!(!path.join("frame.0.dump").exists());
        assert_eq!(std::fs::read(path.join(LOAD_STEPS_FILE)).expect("read"), b"");
    }

    #[test]
    fn force_evaluations_are_assigned_to_their_step() {
        let log = "print \"load step $k\"\nload step 0\n  Iterations, force evaluations = 6 14\n  Iterations, force evaluations = 6 10\nload step 1\n\
                   load step 1\n  Iterations, force evaluations = 3 5\nload step 2\n";
        assert_eq!(evaluations(log), BTreeMap::from([(0, 24), (1, 5)]));
    }
}

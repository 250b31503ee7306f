//! Constant-temperature (NVT) runs of the relaxed state at each load.

use super::Listener;
use super::frame_analysis::FrameAnalyzer;
use crate::scene::{AtomsCase, Case};
use crate::{Error, Result};
use asperity_atoms::damage;
use asperity_atoms::engine::LammpsEngine;
use asperity_atoms::job::Job;
use asperity_atoms::nvt::{BLOCKS, NvtRun, NvtSamples, NvtSettings, mean};
use asperity_atoms::progress::Progress;
use asperity_atoms::results::{NvtResults, NvtState};
use asperity_contact::load::LoadStep;
use std::ops::ControlFlow;
use std::path::Path;

/// Name of the stage and of its folder.
pub(super) const STAGE: &str = "nvt";

/// Runs the relaxed states of the job `relaxed` at constant temperature, and reads the averages. Files are written into
/// `folder`.
pub(super) fn run_nvt(
    case: &Case,
    atoms: &AtomsCase,
    (engine, relaxed): (&LammpsEngine, &Job),
    settings: &NvtSettings,
    folder: &Path,
    listener: &dyn Listener,
) -> Result<NvtResults> {
    let job = Job::write_nvt(folder, relaxed, &atoms.block, settings)?;
    let lost = || Error::format(folder, "a job without an NVT run", "the NVT job that was written");
    let nvt = job.spec.protocol.nvt().cloned().ok_or_else(lost)?;
    run(engine, &job, &nvt, listener)?;
    let reader = FrameAnalyzer::new(case, atoms, folder, STAGE)?;
    let steps = case.rising_steps();
    let states = (0..nvt.loads.len()).map(|k| state(steps[k], &reader, (&job, &nvt), k));
    Ok(NvtResults {
        temperature_k: nvt.temperature_k,
        lattice_constant_angstrom: settings.lattice_constant_angstrom,
        equilibration_ps: nvt.equilibration_ps(),
        averaging_ps: nvt.averaging_ps(),
        timestep_ps: nvt.timestep_ps,
        blocks: BLOCKS,
        states: states.collect::<Result<_>>()?,
    })
}

fn run(engine: &LammpsEngine, job: &Job, nvt: &NvtRun, listener: &dyn Listener) -> Result<()> {
    let total = nvt.loads.len();
    let mut watch = |p: Progress| {
        let ended = p.record.as_ref().map_or(0, |r| r.step + 1);
        let within = if ended == total || p.is_new { 0.0 } else { (p.iterations as f64 / nvt.steps() as f64).min(1.0) };
        let ps = within * nvt.steps() as f64 * nvt.timestep_ps;
        let caption = format!("{ended} of {total} loads sampled at {} K, {ps:.1} ps of the next", nvt.temperature_k);
        listener.progress(Some((ended as f64 + within) / total as f64), &caption);
        if listener.stopping() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    if let Some(damage) = damage::remove_damaged(&job.folder)? {
        listener.warn(&format!("{damage}; LAMMPS computes the loads from there on again"));
    }
    let finished = engine.run(job, &mut watch)?;
    if let Some(step) = finished.resumed_from.filter(|s| s + 1 < total) {
        listener.warn(&format!("resumed at load {} of an earlier NVT run", step + 1));
    }
    Ok(())
}

/// Averages at load `k` of the NVT run, which is the load of `step`. Writes the maps of the contact probability.
fn state(step: &LoadStep, reader: &FrameAnalyzer, (job, nvt): (&Job, &NvtRun), k: usize) -> Result<NvtState> {
    let samples = NvtSamples::read(&job.folder, nvt, k)?;
    let load = nvt.loads[k];
    let gap = |b: &asperity_atoms::nvt::BlockAverage| {
        let gaps = reader.gaps_expanded((nvt.expansion, samples.bounds), &b.positions, b.low_angstrom);
        gaps.iter().sum::<f64>() / gaps.len() as f64
    };
    let sites = samples.probabilities();
    let fraction = |value: fn(f64) -> bool| sites.iter().filter(|s| value(s.value)).count() as f64 / sites.len() as f64;
    let name = |description: &str| format!("load-{}-{description}.npy", step.number());
    let write = |description: &str, values: Vec<f64>| {
        reader.write_sites(&values, &name(description), &name(&format!("site-{description}")))
    };
    let [probability_map, site_probability] = write("probability", sites.iter().map(|s| s.value).collect())?;
    let [_, site_error] = write("probability-error", sites.iter().map(|s| s.error).collect())?;
    Ok(NvtState {
        index: step.index,
        p_star: step.imposed_p_star(),
        temperature_k: samples.mean(|b| b.temperature_k),
        load: samples.mean(|b| b.load / load),
        contact_area: samples.mean(|b| b.contact_probability.iter().sum::<f64>() / b.contact_probability.len() as f64),
        mean_gap_angstrom: mean(&samples.blocks.iter().map(gap).collect::<Vec<f64>>()),
        majority_contact: fraction(|p| p > 0.5),
        any_contact: fraction(|p| p > 0.0),
        probability_map,
        site_probability,
        site_error,
    })
}

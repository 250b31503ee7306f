//! Blocks of atoms as settings of a benchmark. LAMMPS runs each block at the scene's loads; frames are analysed as in a
//! run.

use super::benchmark_point::{BenchmarkPoint, LowPass, bare, halves};
use super::measured::MeasuredPoint;
use crate::pipeline::methods::{self, MethodRun};
use crate::pipeline::plan::planned_by;
use crate::pipeline::stage::StageContext;
use crate::pipeline::{StageKey, atomistic, matched};
use crate::record::tradeoff::{AtomsCost, BlockSize, MeasuredCost};
use crate::scene::{AtomsCase, AtomsScene, AtomsStart, Case, Foundation, LoadScene, highest_p_star};
use crate::{Error, Result};
use asperity_atoms::block::{BaseKind, Block};
use asperity_atoms::engine::LammpsEngine;
use asperity_atoms::job_spec::Minimizer;
use asperity_atoms::lammps_host::find_library;
use asperity_contact::interface::AttractionLaw;
use asperity_contact::method::Precision;
use asperity_grid::sys;
use asperity_methods::all_atom;
use asperity_surface::HeightSource;
use asperity_surface::files::atomic_file::{create_folder, list, open_regular, remove_folder};
use std::path::Path;
use std::time::Instant;

/// Nodes per shortest wavelength of the continuum solution on the heights that a block resolves; the same number as in
/// its matched continuum.
const NODES_PER_WAVE: f64 = 16.0;

/// Highest load of blocks, p*. At contact fractions of one half the crystal has long yielded. A ramp that ends before
/// its last load gives no result at any load: the challenge's ramp to p* = 1 ended at 0.85 with 10 cells.
const HIGHEST: f64 = 0.3;

/// Smallest cells across and deep of the additional blocks when no sizes are requested.
const LEAST: (usize, usize) = (10, 3);

/// Deformable cells of an additional block on an elastic base: with its layers of free atoms below, the contacts at 8 and 25 nm are nearly
/// those of the full depth (evidence/validation-elastic-base.md).
const ELASTIC_DEPTH: usize = 2;

/// Subfolders of a setting: LAMMPS job, and analysis of its frames.
const JOB: &str = "job";
pub(super) const ANALYSIS: &str = "atoms";

/// Blocks of a benchmark in the order of their size, and the engine that runs them.
pub(super) struct Blocks {
    list: Vec<(BenchmarkPoint, Case)>,
    pub engine: std::result::Result<LammpsEngine, String>,
}

impl Blocks {
    /// Blocks of the requested sizes. Default for a scene with atoms: its own block, one with half the cells, one with
    /// half the depth, the latter on a foundation that replaces the missing depth, the shallowest on an elastic base, and its own block
    /// relaxed by LAMMPS alone. None without requested sizes if the scene has no atoms or its first load exceeds `HIGHEST`.
    ///
    /// # Errors
    /// `Input` for invalid sizes, scenes or loads; `MissingProgram` if sizes are requested and LAMMPS is not found.
    pub(super) fn of(case: &Case, requested: Option<&[BlockSize]>) -> Result<Option<Blocks>> {
        let base = match (&case.scene.atoms, requested) {
            (None, None) => return Ok(None),
            (own, _) => own.clone().unwrap_or_default(),
        };
        let own = BlockSize {
            cells: base.cells,
            depth_cells: base.depth_cells,
            foundation_cells: base.foundation_depth(),
            elastic_base: base.base == Some(BaseKind::Elastic),
            minimizer: base.minimizer,
        };
        let from_continuum = case.atoms.as_ref().is_some_and(|a| a.start == AtomsStart::Continuum);
        let sizes = requested.map_or_else(|| related_blocks(own, from_continuum), <[_]>::to_vec);
        let mut list: Vec<(BenchmarkPoint, Case)> = Vec::new();
        for mut size in sizes {
            if size.minimizer == Minimizer::Auto {
                size.minimizer = base.minimizer;
            }
            if list.iter().any(|(point, _)| point.block == Some(size)) {
                continue;
            }
            let mut scene = bare(case);
            // Blocks are only loaded, and compared at every load. Loads are compared by index, so only leading loads are kept.
            let highest = HIGHEST.min(highest_p_star(case.gradient));
            let p_star: Vec<f64> = case.loading_p_star().into_iter().take_while(|p| *p <= highest).collect();
            if p_star.is_empty() && requested.is_none() {
                return Ok(None);
            }
            if p_star.is_empty() {
                let accepted = format!("a scene whose first load p* is at most {highest:.3}");
                return Err(Error::input(case.file.display(), "load.p_star", "loads of atoms", accepted));
            }
            scene.load = LoadScene { p_star, ..LoadScene::default() };
            // The cost of a setting is that of the relaxed states, without constant-temperature runs.
            let BlockSize { cells, depth_cells, foundation_cells, elastic_base, minimizer } = size;
            let foundation_cells = Foundation::Cells(foundation_cells);
            let kind = elastic_base.then_some(BaseKind::Elastic);
            let sized = AtomsScene { cells, depth_cells, foundation_cells, base: kind, ..base.clone() };
            let atoms = AtomsScene { minimizer, nvt: None, ..sized };
            let tolerance = atoms.force_tolerance.to("eV/Å");
            scene.atoms = Some(atoms);
            let resolved = match Case::resolve(scene, &case.file) {
                // A potential of a longer range needs a deeper foundation.
                Err(_) if size.elastic_base && requested.is_none() && size != own => continue,
                resolved => Case { lammps: case.lammps.clone(), ..resolved? },
            };
            let method = asperity_methods::find(all_atom::ID).expect("it is registered");
            let points = resolved.atoms.as_ref().map_or(0, |a| a.points);
            let method_run = MethodRun { method, adhesive: case.model.adhesion != AttractionLaw::None };
            let point = BenchmarkPoint {
                block: Some(size),
                ..BenchmarkPoint::on_grid(method_run, points, Precision::F64, tolerance)
            };
            list.push((point, resolved));
        }
        list.sort_by_key(|(_, c)| c.atoms.as_ref().map_or(0, AtomsCase::atoms));
        let Some((_, first)) = list.first() else { return Ok(None) };
        let engine = match atomistic::engine(first) {
            Err(e) if requested.is_some() => return Err(e),
            other => other.map_err(|e| e.to_string()),
        };
        Ok(Some(Blocks { list, engine }))
    }

    /// Why a block cannot run on this machine.
    pub(super) fn refusal(&self, point: &BenchmarkPoint) -> Option<String> {
        let needs_library = |b: BlockSize| b.elastic_base || b.minimizer == Minimizer::Harmonic;
        let in_library = point.block.is_some_and(needs_library);
        match &self.engine {
            Err(reason) => Some(reason.clone()),
            Ok(engine) if in_library => {
                find_library(engine.program()).err().map(|reason| format!("no shared library of LAMMPS: {reason}"))
            }
            Ok(_) => None,
        }
    }

    pub(super) fn points(&self) -> Vec<BenchmarkPoint> {
        self.list.iter().map(|(point, _)| *point).collect()
    }

    pub(super) fn case(&self, point: &BenchmarkPoint) -> Option<&Case> {
        self.list.iter().find(|(p, _)| p.block == point.block).map(|(_, case)| case)
    }

    /// Each block with its estimated memory (bytes) and time (s), or why it cannot run on this machine.
    pub(super) fn planned(&self) -> impl Iterator<Item = (BenchmarkPoint, std::result::Result<(u64, f64), String>)> {
        self.list.iter().map(|(point, case)| {
            let refused = self.refusal(point).map_or(Ok(()), Err);
            let engine = refused.and_then(|()| self.engine.as_ref().map_err(String::clone));
            (*point, engine.and_then(|engine| planned(case, engine).map_err(|e| e.to_string())))
        })
    }

    /// Dependencies of a block's results in addition to the scene: atoms section, potential and engine.
    pub(super) fn depends_on(&self, point: &BenchmarkPoint) -> Result<impl serde::Serialize> {
        let case = self.case(point);
        let file = case.and_then(|c| c.atoms.as_ref()).and_then(|a| a.potential.as_ref());
        let potential = file.map(|path| StageKey::of_file(path)).transpose()?;
        let engine = self.engine.as_ref().map(|e| format!("{:?}", e.describe())).ok();
        Ok((case.and_then(|c| c.scene.atoms.clone()), potential, engine))
    }
}

/// A block, and further blocks that show the effect of extent, depth and minimiser. A block on a foundation requires a start
/// from the continuum.
fn related_blocks(own: BlockSize, from_continuum: bool) -> Vec<BlockSize> {
    // Blocks with a multiple of five cells have the same indenter spacing.
    let narrower = BlockSize { cells: own.cells / 10 * 5, ..own };
    let shallower = BlockSize { depth_cells: own.depth_cells / 2, ..own };
    let fit = |s: &BlockSize| s.cells >= LEAST.0 && s.depth_cells >= LEAST.1;
    let missing = own.depth_cells - shallower.depth_cells;
    let founded = BlockSize { foundation_cells: own.foundation_cells + missing, ..shallower };
    let founded = Some(founded).filter(|_| from_continuum);
    let below = (own.depth_cells + own.foundation_cells).saturating_sub(ELASTIC_DEPTH);
    let elastic = BlockSize { depth_cells: ELASTIC_DEPTH, foundation_cells: below, elastic_base: true, ..own };
    let elastic = Some(elastic).filter(|_| own.depth_cells > 2 * ELASTIC_DEPTH && !own.elastic_base);
    let by_lammps = BlockSize { minimizer: Minimizer::Fire, ..own };
    let by_lammps = Some(by_lammps).filter(|b| *b != own);
    let smaller = [narrower, shallower].into_iter().chain(founded).filter(fit);
    std::iter::once(own).chain(smaller).chain(elastic).chain(by_lammps).collect()
}

/// Estimated memory (bytes) and time (s) of a block.
pub(super) fn planned(case: &Case, engine: &LammpsEngine) -> Result<(u64, f64)> {
    let minimizer = case.scene.atoms.as_ref().map_or(Minimizer::Fire, |a| a.minimizer);
    let plan = planned_by(case, rayon::current_num_threads(), None, engine.relaxer(minimizer))?;
    let atom_stages = plan.stages.iter().filter(|s| ["matched", "lammps", "atoms"].contains(&s.name.as_str()));
    Ok(atom_stages.fold((0, 0.0), |(bytes, seconds), s| (bytes.max(s.bytes), seconds + s.seconds)))
}

/// The second reference of a block: the same problem on heights with only the wavelengths that its indenter resolves.
pub(super) fn on_resolved_heights(reference: &BenchmarkPoint, case: &Case) -> BenchmarkPoint {
    let (low_pass, stretch) = case.atoms.as_ref().map_or((0.0, 1.0), |a| (a.low_pass, a.stretch));
    let enough = |n: &usize| *n as f64 * low_pass >= NODES_PER_WAVE;
    let n = match case.surface() {
        HeightSource::Imported { .. } => reference.n,
        _ => halves(reference.n, usize::BITS as usize).into_iter().rev().find(enough).unwrap_or(reference.n),
    };
    BenchmarkPoint { n, filter: Some(LowPass { low_pass, stretch }), ..*reference }
}

/// Runs a block at every load, and analyses it. The maps are kept; the LAMMPS job folder is removed.
pub(super) fn run_block(case: &Case, engine: &LammpsEngine, context: &StageContext) -> Result<MeasuredPoint> {
    let atoms = case.atoms.as_ref().expect("a block is resolved");
    let &StageContext { folder: dir, stage, listener, .. } = context;
    let root = dir.parent().unwrap_or(dir);
    let [job_folder, read_folder] = [JOB, ANALYSIS].map(|name| dir.join(name));
    for folder in [&job_folder, &read_folder] {
        create_folder(folder)?;
    }
    let growth = sys::MemoryGrowth::begin();
    let largest_child = sys::children_peak_rss_bytes();
    let (clock, own, children) = (Instant::now(), sys::cpu_seconds(), sys::children_cpu_seconds());
    let solved = match atoms.start {
        AtomsStart::Continuum => {
            let in_stage = format!("{stage}/{JOB}");
            let context = StageContext { folder: &job_folder, stage: &in_stage, ..*context };
            Some(matched::compliant_wall(case, atoms, &context)?)
        }
        AtomsStart::Touch => None,
    };
    let job = atomistic::write_job(case, atoms, &job_folder, solved.as_ref().map(|s| (s, root)))?;
    let outcome = atomistic::run_lammps(engine, &job, listener)?;
    let lammps_cpu_seconds = sys::children_cpu_seconds() - children;
    let in_stage = format!("{stage}/{ANALYSIS}");
    let atoms_results = atomistic::read(case, atoms, &job, &outcome, &read_folder, &in_stage)?;
    let mut results = methods::of_atoms(case, &atoms_results, lammps_cpu_seconds, (root, dir, stage))?;
    results.planned_bytes = planned(case, engine)?.0;
    // The kernel reports the peak of the largest child process so far. Blocks run in the order of size, so an increase
    // comes from this block.
    let largest_rank = Some(sys::children_peak_rss_bytes()).filter(|c| *c > largest_child).unwrap_or(0);
    let child = outcome.peak_bytes.max(largest_rank);
    let cost = MeasuredCost {
        wall_seconds: clock.elapsed().as_secs_f64(),
        cpu_seconds: sys::cpu_seconds() - own + lammps_cpu_seconds,
        cpu_over_reference: 1.0,
        fft_pairs: solved.iter().flat_map(|s| &s.states).map(|s| s.fft_pairs).sum(),
        iterations: outcome.steps.iter().map(|s| s.force_evaluations).sum(),
        planned_bytes: results.planned_bytes,
        measured_bytes: growth.bytes().max(child),
        resident_before_bytes: growth.before_bytes(),
        runs: 1,
        atoms: Some(AtomsCost {
            atoms: job.atoms(),
            force_evaluations: outcome.steps.iter().map(|s| s.force_evaluations).sum(),
            lammps_cpu_seconds,
            frame_bytes: frame_bytes(&job.folder)?,
        }),
    };
    remove_folder(&job.folder)?;
    let Block { cells, depth_cells, foundation_cells, base, .. } = atoms.block;
    let elastic_base = base == BaseKind::Elastic;
    let minimizer = job.spec.settings.minimizer;
    let size = BlockSize { cells, depth_cells, foundation_cells, elastic_base, minimizer };
    let name = format!("all-atom, {size}");
    let notes = outcome
        .unconverged
        .iter()
        .map(|step| format!("{name}: load step {step} stopped above the force tolerance or off its load"));
    Ok(MeasuredPoint::new(atoms.points, results, cost, notes.collect()))
}

/// Bytes of the frames in a job folder.
pub(super) fn frame_bytes(folder: &Path) -> Result<u64> {
    let frames = list(folder)?.into_iter().filter(|(name, _)| name.starts_with("frame."));
    frames.map(|(_, path)| Ok(open_regular(&path)?.1)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_vary_in_extent_and_depth() {
        let size = |cells, depth_cells| BlockSize {
            cells,
            depth_cells,
            foundation_cells: 0,
            elastic_base: false,
            minimizer: Minimizer::Auto,
        };
        let elastic = |cells, below| BlockSize { foundation_cells: below, elastic_base: true, ..size(cells, 2) };
        let fire = |own: BlockSize| BlockSize { minimizer: Minimizer::Fire, ..own };
        let founded = BlockSize { foundation_cells: 6, ..size(45, 6) };
        let on_rigid = [size(45, 12), size(20, 12), size(45, 6), elastic(45, 10), fire(size(45, 12))];
        assert_eq!(related_blocks(size(45, 12), false), on_rigid);
        let from_continuum = [size(45, 12), size(20, 12), size(45, 6), founded, elastic(45, 10), fire(size(45, 12))];
        assert_eq!(related_blocks(size(45, 12), true), from_continuum);
        assert_eq!(
            related_blocks(founded, true),
            [
                founded,
                BlockSize { cells: 20, ..founded },
                BlockSize { foundation_cells: 6, ..size(45, 3) },
                BlockSize { foundation_cells: 9, ..size(45, 3) },
                elastic(45, 10),
                fire(founded)
            ]
        );
        assert_eq!(related_blocks(size(15, 6), false), [size(15, 6), size(15, 3), elastic(15, 4), fire(size(15, 6))]);
        assert_eq!(related_blocks(fire(size(10, 4)), true), [fire(size(10, 4))]);
        assert_eq!(related_blocks(elastic(10, 8), true)[..], [elastic(10, 8), fire(elastic(10, 8))]);
    }
}

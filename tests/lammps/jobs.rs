//! Jobs for tests with LAMMPS: scenes whose block stays elastic, and jobs written without a scene.

use asperity::atoms::block::Block;
use asperity::atoms::dump::read_frame;
use asperity::atoms::engine::LammpsEngine;
use asperity::atoms::indenter::{Indenter, grid_points};
use asperity::atoms::interaction::{Interaction, Yukawa};
use asperity::atoms::job::{Job, JobCrystal, Loading};
use asperity::atoms::job_spec::{DisplacementRamp, FRAME_LAYERS, Minimizer, RelaxationSettings};
use asperity::atoms::load_history::frame_file;
use asperity::atoms::progress::Progress;
use asperity::atoms::run_script::LmpCommand;
use asperity::pipeline::{Silent, build_job};
use asperity::scene::{Case, Scene};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// A smooth surface of small slope on 10 × 10 × 6 cells, which stay elastic: LAMMPS takes seconds. `load`: text of
/// `[load]`; `tables`: further tables; `atoms`: further keys of `[atoms]`.
pub(crate) fn case(load: &str, tables: &str, atoms: &str) -> Case {
    let text = format!(
        "name = \"smooth\"\n[surface]\ngrid = 32\nroll_off_mode = 2\ncut_off_mode = 8\nrms_gradient = 0.3\n\
         [load]\n{load}\n{tables}\n[atoms]\ncells = 10\ndepth_cells = 6\n{atoms}"
    );
    let file = Path::new("smooth.toml");
    Case::resolve(Scene::parse(&text, file).expect("a scene"), file).expect("a case")
}

/// The engine with two ranks, where they can be started.
pub(crate) fn on_two_ranks(engine: &LammpsEngine) -> Option<LammpsEngine> {
    let two = engine.clone().with_ranks(2).ok();
    if two.is_none() {
        crate::tools::skip("mpi", "mpirun cannot start two ranks");
    }
    two
}

/// The job that the pipeline writes for a case.
pub(crate) fn built(case: &Case, folder: &Path) -> Job {
    build_job(case, case.atoms.as_ref().expect("atoms"), folder, &Silent).expect("a job")
}

/// Displacements of the surface atoms from their sites at a step along x, y and z, Å.
pub(crate) fn surface(case: &Case, folder: &Path, step: usize) -> Vec<[f64; 3]> {
    let block = case.atoms.as_ref().expect("atoms").block;
    let (sites, l) = (block.surface(), block.length());
    let frame = read_frame(frame_file(folder, step).expect("a frame")).expect("good");
    let one = |index: usize| {
        let at = frame.position(sites.first_id() + index as u32).expect("in the frame");
        let [x, y] = sites.xy(index);
        let image = |d: f64| d - (d / l).round() * l;
        [image(at[0] - x), image(at[1] - y), at[2] - block.top_z()]
    };
    (0..sites.len()).map(one).collect()
}

/// Ignores progress; the run continues.
pub(crate) fn on(_: Progress) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// Lattice constant and cut-off of the shipped potential, Å; distance below which atoms are in contact, Å.
pub(crate) const A0: f64 = 5.5884;
pub(crate) const CUTOFF: f64 = 7.015853;
pub(crate) const D_C: f64 = 4.0354;

/// A written job with its block and indenter.
pub(crate) struct Setting {
    pub block: Block,
    pub indenter: Indenter,
    pub job: Job,
}

/// Default loading and relaxation of the tests.
pub(crate) const RAMP: DisplacementRamp =
    DisplacementRamp { step_angstrom: 0.3, max_load: 1e9, max_steps: 40, unload: false };
pub(crate) const RELAXATION: RelaxationSettings = RelaxationSettings {
    force_tolerance: 2e-3,
    minimizer: Minimizer::Fire,
    load_unit: 100.0,
    contact_angstrom: D_C,
    frame_layers: FRAME_LAYERS,
    keep_restarts: false,
};

/// The displacement ramp of a job, for changes.
pub(crate) fn ramp(job: &mut Job) -> &mut DisplacementRamp {
    job.spec.protocol.ramp_mut().expect("a displacement ramp")
}

/// Writes a job for `block` under an indenter. `height` gives its heights (Å) at grid point (x, y) of `points` ×
/// `points`.
pub(crate) fn written(
    folder: &Path,
    block: Block,
    height: impl Fn(usize, usize, usize) -> f64,
    adhesion: Option<Yukawa>,
    ramp: DisplacementRamp,
    settings: RelaxationSettings,
) -> Setting {
    let interaction = Interaction { epsilon_ev: 0.2145, sigma_angstrom: 3.5927, adhesion };
    let points = grid_points(block.cells, block.a0, interaction.touch_angstrom());
    let heights = (0..points * points).map(|k| height(k % points, k / points, points)).collect();
    let indenter = Indenter::above(&block, points, heights, interaction.touch_angstrom()).expect("valid");
    let potential = potential();
    let crystal = JobCrystal { potential: &potential, element: "Ca", mass_u: 40.078 };
    let job = Job::write(folder, &block, &indenter, crystal, interaction, settings, Loading::Ramp(ramp))
        .expect("a written job");
    Setting { block, indenter, job }
}

/// The shipped potential.
pub(crate) fn potential() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("potentials/Ca.eam.alloy")
}

/// LAMMPS as a command for scripts of `lammps-inputs`.
pub(crate) fn command(engine: &LammpsEngine) -> LmpCommand {
    LmpCommand { program: engine.program().to_path_buf() }
}

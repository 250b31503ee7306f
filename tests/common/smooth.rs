//! A smooth gentle surface on 10 × 10 × 6 cells, which stay elastic under it: LAMMPS is done in seconds.

use asperity::atoms::engine::Progress;
use asperity::atoms::job::Job;
use asperity::pipeline::{Silent, build_job};
use asperity::scene::{Case, Scene};
use std::ops::ControlFlow;
use std::path::Path;

/// `load` is what `[load]` holds, `atoms` more of `[atoms]`; `tables` stand between them.
pub fn case(load: &str, tables: &str, atoms: &str) -> Case {
    let text = format!(
        "name = \"smooth\"\n[surface]\ngrid = 32\nroll_off_mode = 2\ncut_off_mode = 8\nrms_gradient = 0.3\n\
         [load]\n{load}\n{tables}\n[atoms]\ncells = 10\ndepth_cells = 6\n{atoms}"
    );
    let file = Path::new("smooth.toml");
    Case::resolve(Scene::parse(&text, file).expect("a scene"), file).expect("a case")
}

pub fn built(case: &Case, folder: &Path) -> Job {
    build_job(case, case.atoms.as_ref().expect("atoms"), folder, &Silent).expect("a job")
}

/// Lets a run go on.
pub fn on(_: Progress) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

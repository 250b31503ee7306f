//! The stages of a case in their order: one list, which is planned or executed.

use super::atom_stages::{AtomStages, CompareStage, FramesStage, LAMMPS, LammpsStage};
use super::findings::few_contact_atoms;
use super::folder::StageKey;
use super::given_loads::given_loads;
use super::laboratory::{SolveStage, SolvedHeights, Variant, variants};
use super::methods::{self, MethodStage};
use super::stage::Stage;
use super::surface::SurfaceStage;
use crate::record::methods::MethodResults;
use crate::record::results::{ComparisonResults, SurfaceResults};
use crate::report::accuracy::missed_by_depth;
use crate::scene::Case;
use crate::{Error, Result};
use asperity_atoms::results::AtomsResults;
use asperity_contact::path::unresolved_contact;
use asperity_contact::results::ContinuumResults;
use asperity_contact::state::TrivialLoads;
use std::path::Path;

/// Output of a stage, with its key. A plan has none.
pub(super) type Made<T> = Option<(T, StageKey)>;

/// What is done with the stages.
pub(super) trait Visitor {
    /// Plans a stage, or executes it with its `input`. `after`: keys of the stages that it depends on.
    fn visit<S: Stage>(
        &mut self,
        stage: &S,
        after: &[&StageKey],
        input: Option<S::Input<'_>>,
    ) -> Result<Made<S::Output>>;

    fn warn(&mut self, _text: String) {}

    /// An auxiliary problem that has no solution.
    fn failed(&mut self, _text: String) {}

    /// Computing time of a stage that was executed.
    fn seconds(&self, _stage: &str) -> f64 {
        0.0
    }
}

/// Outputs of the stages.
#[derive(Default)]
pub(super) struct Outputs {
    pub surface: Option<SurfaceResults>,
    pub primary: Option<ContinuumResults>,
    pub non_adhesive: Option<ContinuumResults>,
    pub other_ranges: Vec<ContinuumResults>,
    pub cross_check: Option<ContinuumResults>,
    pub methods: Vec<MethodResults>,
    pub atoms: Option<AtomsResults>,
    pub comparison: Option<ComparisonResults>,
}

fn output<T>(made: Made<T>) -> Option<T> {
    made.map(|(output, _)| output)
}

fn keys<'k>(list: &[Option<&'k StageKey>]) -> Vec<&'k StageKey> {
    list.iter().copied().flatten().collect()
}

fn key_of<T>(made: &Made<T>) -> Option<&StageKey> {
    made.as_ref().map(|(_, key)| key)
}

/// Visits the stages of a case. `root`: the run folder; `geometry`: key of the heights, independent of the requested statistics; a plan needs
/// neither.
///
/// # Errors
/// Those of the stages.
pub(super) fn visit(
    (case, atoms): (&Case, Option<AtomStages>),
    root: &Path,
    geometry: Option<&StageKey>,
    visitor: &mut impl Visitor,
) -> Result<Outputs> {
    let surface = visitor.visit(&SurfaceStage { case }, &keys(&[geometry]), Some(()))?;
    let mut outputs = laboratory(case, key_of(&surface), visitor)?;
    if let Some(stages) = atoms {
        visit_atoms(stages, root, (geometry, key_of(&surface)), visitor, &mut outputs)?;
    }
    Ok(Outputs { surface: output(surface), ..outputs })
}

/// Solves the scene's problem and its variants, and runs the comparison methods.
fn laboratory(case: &Case, surface: Option<&StageKey>, visitor: &mut impl Visitor) -> Result<Outputs> {
    let (heights, after) = (SolvedHeights::new(case), keys(&[surface]));
    let mut outputs = Outputs::default();
    if case.solves() {
        outputs.primary =
            output(visitor.visit(&SolveStage { case, variant: Variant::Primary }, &after, Some(&heights))?);
        let states = outputs.primary.iter().flat_map(|solved| &solved.states);
        let named = given_loads(case);
        let loads = states.map(|s| (named.value(s.p_star), s.contact_area, s.discretisation.as_ref()));
        let unresolved = unresolved_contact(named.quantity.symbol(), loads);
        let trivial = TrivialLoads::of(outputs.primary.iter().flat_map(|solved| &solved.states)).warnings();
        let solved = outputs.primary.as_ref();
        let lost = solved.and_then(|solved| solved.contact_lost.clone());
        let no_pull_off = solved.and_then(|solved| solved.pull_off_failure.as_ref());
        let ended = lost.into_iter().chain(no_pull_off.map(|why| format!("the pull-off was not found: {why}")));
        unresolved.into_iter().chain(trivial).chain(ended).for_each(|text| visitor.warn(text));
    }
    let (variants, left_out) = variants(case);
    left_out.into_iter().for_each(|text| visitor.warn(text));
    for stage in variants {
        let solved = match visitor.visit(&stage, &after, Some(&heights)) {
            // A variant without convergence does not invalidate the solution of the scene's own problem.
            Err(e @ Error::NotConverged { .. }) => {
                visitor.failed(format!("{}: {e}", stage.label()));
                continue;
            }
            solved => output(solved?),
        };
        match stage.variant {
            Variant::NonAdhesive => outputs.non_adhesive = solved,
            Variant::Range(_) => outputs.other_ranges.extend(solved),
            Variant::CrossCheck => outputs.cross_check = solved,
            Variant::Primary | Variant::Comparison(..) => {}
        }
    }
    for method_run in methods::all(case) {
        let made = visitor.visit(&MethodStage { case, method_run }, &after, Some(&heights))?;
        outputs.methods.extend(output(made));
    }
    Ok(outputs)
}

/// Runs the atoms, and compares them with the matched continuum. If requested, lists the atoms among the comparison
/// methods.
fn visit_atoms(
    stages: AtomStages,
    root: &Path,
    (geometry, surface): (Option<&StageKey>, Option<&StageKey>),
    visitor: &mut impl Visitor,
    outputs: &mut Outputs,
) -> Result<()> {
    let mut matched = visitor.visit(&stages.matched(), &keys(&[surface]), Some(()))?;
    if stages.case.has_target_of_depth() && !stages.case.judges_depth() {
        visitor.warn("the depth of the atoms' block is not judged: continuum.layer is no half-space".into());
    }
    let errors = stages.case.scene.accuracy().map(|accuracy| accuracy.errors);
    let judged = matched.iter().filter_map(|(matched, _)| missed_by_depth(errors.as_ref()?, &matched.hard));
    judged.for_each(|text| visitor.warn(text));
    let input = matched.as_ref().map(|(matched, _)| (matched, root));
    let lammps = visitor.visit(&LammpsStage(stages), &keys(&[geometry, key_of(&matched)]), input)?;
    for step in lammps.iter().flat_map(|(outcome, _)| &outcome.unconverged) {
        visitor.warn(format!(
            "load step {step} of the atoms stopped above the force tolerance or off its load; states taken from it are not equilibria"
        ));
    }
    let after = keys(&[key_of(&lammps)]);
    let input = lammps.as_ref().map(|(outcome, _)| (outcome, root));
    let mut frames = visitor.visit(&FramesStage(stages), &after, input)?;
    if let Some(stage) = stages.nvt() {
        let nvt = output(visitor.visit(&stage, &after, Some(root))?);
        frames.iter_mut().for_each(|(atoms, _)| atoms.nvt = nvt.clone());
    }
    for text in frames.iter().filter_map(|(atoms, _)| few_contact_atoms(&atoms.states, given_loads(stages.case))) {
        visitor.warn(text);
    }
    let mut yielding_key = None;
    if let Some(stage) = stages.yielding()
        && let Some((solved, key)) = visitor.visit(&stage, &keys(&[key_of(&matched)]), Some(()))?
    {
        matched.iter_mut().for_each(|(matched, _)| matched.yielding = solved.clone());
        yielding_key = Some(key);
    }
    let after = keys(&[key_of(&matched), key_of(&frames), yielding_key.as_ref()]);
    let input = frames.as_ref().zip(matched.as_ref()).map(|((atoms, _), (matched, _))| (atoms, matched, root));
    outputs.comparison = output(visitor.visit(&CompareStage(stages), &after, input)?);
    if let Some(stage) = stages.all_atom() {
        let seconds = visitor.seconds(LAMMPS);
        let input = frames.as_ref().map(|(atoms, _)| (atoms, seconds, root));
        outputs.methods.extend(output(visitor.visit(&stage, &keys(&[key_of(&frames)]), input)?));
    }
    outputs.atoms = output(frames);
    Ok(())
}

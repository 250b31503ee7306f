use super::atomistic::{self, LammpsOutcome};
use super::comparison::{self, Matched};
use super::continuum::Variant;
use super::folder::{Key, ResumePolicy, RunFolder};
use super::frame_analysis::INDENTER_SPECIES;
use super::nvt::{self, STAGE as NVT_STAGE};
use super::{Listener, continuum, engine, methods};
use crate::atoms::engine::Engine;
use crate::atoms::job::Job;
use crate::atoms::potential::CALCIUM;
use crate::atoms::scripts::{DISPLACEMENT_RAMP, NVT, PRESCRIBED_LOAD};
use crate::method::{Heights, all_atom};
use crate::record::advice::AccuracyChoice;
use crate::record::mcap::{CloudAtom, GapMap, LoadScalars, LoadState, Recorder, Scene as Recorded};
use crate::record::methods::MethodResults;
use crate::record::results::{
    self, AtomsResults, ComparisonResults, ContinuumResults, MANIFEST_FILE, Results, SCHEMA, ScalesSi, SurfaceResults,
};
use crate::record::{netcdf, npy};
use crate::scene::{AdhesionScene, AtomsCase, Case, ContinuumScene, Start, Surface};
use crate::{Error, Result, challenge, report};
use std::cell::OnceCell;
use std::path::{Path, PathBuf};

/// Stage that compares atoms and continuum.
const COMPARE: &str = "compare";

const RECORDING_FILE: &str = "run.mcap";

/// Runs a case into a folder, all stages, and writes its report. Returns the report's path.
pub fn run(case: &Case, out: &Path, listener: &dyn Listener) -> Result<(Results, PathBuf)> {
    // What the atoms need is asked for first: a missing program should not cost a solved continuum, nor leave a folder.
    let engine = match &case.atoms {
        Some(_) => Some(engine(case)?),
        None => None,
    };
    super::plan(case, rayon::current_num_threads(), None)?.fits()?;
    let mut folder = RunFolder::open(out)?;
    case.warnings.iter().for_each(|w| listener.warn(w));
    keep_scene(case, out)?;
    // A ladder of LAMMPS outlives a new build of this program, whose job folder decides what is still good; results do not.
    let geometry = Key::new("geometry", &(&case.scene.laboratory, &case.scene.surface, heights_hash(case)?), &[])?;
    let surface_key = Key::new("surface", &(Key::of_program()?, case.requested_outputs()), &[&geometry])?;
    let surface = folder.stage(
        listener,
        ("surface", "heights and their statistics"),
        &surface_key,
        ResumePolicy::Restart,
        |dir| continuum::surface(case, &case.surface.heights(case.grid, 0.0), dir, "surface"),
    )?;
    let start = case.scene.continuum.initial_gap.as_ref().map(|p| Key::of_file(&case.resolve_path(p))).transpose()?;
    let scene = &case.scene;
    let (nx, ny) = (case.grid.nx, case.grid.ny);
    // What is solved beside the asked problem changes nothing in it.
    let alone = scene.adhesion.clone().map(|a| AdhesionScene { also_nonadhesive: false, other_ranges_nm: vec![], ..a });
    let there = (case.loading_p_star(), &scene.load.mean_gap_um, &scene.load.maps_at);
    // Methods beside it change nothing in it either.
    let own = ContinuumScene { compare_with: Vec::new(), ..scene.continuum.clone() };
    // What p* = 1 is: with [challenge] not what a file's own gradient makes of it.
    let unit = (case.gradient, case.requested_outputs());
    // Made or read by the first stage that solves, if any does.
    let (series, nodes) = (OnceCell::new(), OnceCell::new());
    let heights = || -> Result<Heights> {
        Ok(match &case.surface {
            // Its waves are the heights, and most often less to hold.
            Surface::Synthesised { modes, .. } => Heights::Series(series.get_or_init(|| modes.series())),
            Surface::Fourier { modes, .. } => Heights::Series(modes.series()),
            Surface::Imported { .. } => {
                if nodes.get().is_none() {
                    let _ = nodes.set(stored_heights(out, &surface)?);
                }
                Heights::Nodes(nodes.get().expect("just set"))
            }
        })
    };
    let solve = |folder: &mut RunFolder, name: &str, tag: &str, method: &str, variant: Variant| {
        let key = match variant {
            Variant::Primary => {
                Key::new(name, &(&scene.load, &alone, &own, &scene.methods, &start, unit), &[&surface_key])
            }
            Variant::NonAdhesive => Key::new(name, &(&there, &own, &scene.methods, unit), &[&surface_key]),
            Variant::Range(nm) => {
                let of_range = alone.clone().map(|a| AdhesionScene { range_nm: nm, ..a });
                Key::new(name, &(&there, of_range, &own, &scene.methods, unit), &[&surface_key])
            }
            Variant::Comparison(..) => unreachable!("methods beside have stages of their own"),
            Variant::CrossCheck => Key::new(name, &(&scene.challenge, &own, &scene.methods, unit), &[&surface_key]),
        }?;
        let what = match tag {
            "" => format!("{method} on {nx} x {ny} points"),
            tag => format!("{method} on {nx} x {ny} points, {tag}"),
        };
        folder.stage(listener, (name, &what), &key, ResumePolicy::ContinueFrom(&key), |dir| {
            continuum::laboratory(case, variant, heights()?, (dir, name, ""), &key, listener)
        })
    };
    let method = case.method().id;
    let solved = case.solves().then(|| solve(&mut folder, "continuum", "", method, Variant::Primary)).transpose()?;
    let mut failures = Vec::new();
    // What does not converge beside the asked problem takes nothing from it.
    let mut beside = |folder: &mut RunFolder, name: &str, tag: &str, method: &str, variant: Variant| match solve(
        folder, name, tag, method, variant,
    ) {
        Ok(found) => Ok(Some(found)),
        Err(e @ Error::NotConverged { .. }) => {
            let failure = format!("{tag}: {e}");
            listener.warn(&failure);
            failures.push(failure);
            Ok(None)
        }
        Err(e) => Err(e),
    };
    let mut non_adhesive = None;
    if case.solves() && case.solves_nonadhesive() {
        non_adhesive = beside(&mut folder, "non-adhesive", "without adhesion", method, Variant::NonAdhesive)?;
    }
    let mut other_ranges: Vec<ContinuumResults> = Vec::new();
    let mut alike = Vec::new();
    let mut used: Vec<f64> = vec![case.range_used(case.adhesion)];
    for &nm in scene.adhesion.iter().flat_map(|a| &a.other_ranges_nm) {
        let range = case.range_used(case.adhesion_of_range(nm));
        if used.contains(&range) {
            let text =
                format!("range {nm} nm: this grid is given the same range for it as for another; it is solved once");
            listener.warn(&text);
            alike.push(text);
            continue;
        }
        used.push(range);
        let name = format!("range-{nm}-nm");
        other_ranges.extend(beside(&mut folder, &name, &format!("range {nm} nm"), method, Variant::Range(nm))?);
    }
    let mut cross_check = None;
    if let Some(challenge) = &scene.challenge {
        let tag = "the reference load without adhesion";
        cross_check = beside(&mut folder, "cross-check", tag, &challenge.cross_check_method, Variant::CrossCheck)?;
    }
    let mut told = Vec::new();
    for other in methods::all(case) {
        let stage = other.stage();
        let key = Key::new(&stage, &(&there, &alone, &own, &scene.methods, unit), &[&surface_key])?;
        let what = format!("{} on {nx} x {ny} points", other.words());
        told.push(folder.stage(listener, (&stage, &what), &key, ResumePolicy::ContinueFrom(&key), |dir| {
            methods::run(case, other, heights()?, (dir, &stage), &key, listener)
        })?);
    }
    let mut warnings: Vec<String> = case.warnings.iter().chain(&alike).chain(&failures).cloned().collect();
    let (mut atoms, mut compared) = (None, None);
    if let (Some(a), Some(engine)) = (&case.atoms, &engine) {
        let keys = [&geometry, &surface_key];
        let (found, comparison, as_method) =
            atomistic_stages(case, a, engine, &mut folder, keys, listener, &mut warnings)?;
        atoms = Some(found);
        compared = Some(comparison);
        told.extend(as_method);
    }
    let mut results = Results {
        schema: SCHEMA,
        name: case.scene.name.clone(),
        description: case.scene.description.clone(),
        scales: ScalesSi { length_m: case.scales.length_m, modulus_pa: case.scales.modulus_pa },
        surface,
        accuracy: case.chosen.clone(),
        continuum: solved,
        non_adhesive,
        other_ranges,
        cross_check,
        methods: told,
        failures,
        acceptance: Vec::new(),
        atoms,
        comparison: compared,
        stages: folder.costs.clone(),
        warnings,
        sources: sources(case),
    };
    if scene.challenge.is_some() {
        results.acceptance = challenge::judge(&results);
    }
    results.write(out)?;
    let manifest = Manifest::of(case, &results, engine.as_ref().map(|e| e.describe()));
    crate::record::json::write(&out.join(MANIFEST_FILE), &manifest)?;
    netcdf::run::write_run(out, &results)?;
    record(case, &results, out)?;
    let page = report::write(out)?;
    Ok((results, page))
}

/// Writes the scene into the run folder. Results of another scene that stand there go: `report` and `compare` would
/// take them for this one's.
pub(super) fn keep_scene(case: &Case, out: &Path) -> Result<()> {
    let text = toml::to_string_pretty(&case.portable_scene())
        .map_err(|e| Error::format("scene", e, "a scene that TOML can hold"))?;
    let file = out.join("scene.toml");
    if std::fs::read_to_string(&file).is_ok_and(|earlier| earlier == text) {
        return Ok(());
    }
    for name in [results::FILE, MANIFEST_FILE, netcdf::run::FILE, RECORDING_FILE, report::PAGE] {
        let path = out.join(name);
        match std::fs::remove_file(&path) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => return Err(Error::io("remove", &path)(e)),
            _ => {}
        }
    }
    crate::record::atomic_file::write_atomic(&file, |w| std::io::Write::write_all(w, text.as_bytes()))
}

fn atomistic_stages(
    case: &Case,
    a: &AtomsCase,
    engine: &dyn Engine,
    folder: &mut RunFolder,
    [geometry, surface_key]: [&Key; 2],
    listener: &dyn Listener,
    warnings: &mut Vec<String>,
) -> Result<(AtomsResults, ComparisonResults, Option<MethodResults>)> {
    let root = folder.path().to_path_buf();
    let scene = case.scene.atoms.as_ref().expect("an atoms case comes from a scene with atoms");
    let profile = (scene.cells, scene.slope, scene.low_pass_angstrom, scene.adhesion_range_angstrom);
    // A continuum knows no more of a foundation than that it adds to the depth.
    let layer = (profile, scene.depth_cells + scene.foundation_cells);
    let block = (profile, scene.depth_cells, scene.foundation_cells);
    // As resolved: the potential decides them where the scene does not.
    let crystal = (&scene.element, a.block.a0, a.modulus_gpa);
    let continuum = &case.scene.continuum;
    // The atoms' own range is in `profile`; of the scene's adhesion they have the work, and the ratio of the ranges is audited.
    let pair = case.scene.adhesion.as_ref().map(|a| (a.work_of_adhesion_mj_m2, a.range_nm, a.law));
    let how = (&continuum.method, &case.scene.methods, continuum.max_iterations);
    let matched_key = Key::new(
        "matched",
        &(&case.scene.load, pair, how, layer, crystal, (case.requested_outputs(), scene.depth_error)),
        &[surface_key],
    )?;
    let what = format!("{} on the atoms' heights, {1} x {1} points", case.method().id, a.matched.nx);
    let matched: Matched =
        folder.stage(listener, ("matched", &what), &matched_key, ResumePolicy::ContinueFrom(&matched_key), |dir| {
            comparison::matched(case, a, dir, "matched", &matched_key, listener)
        })?;
    let potential = match &a.potential {
        Some(path) => Key::of_file(path)?,
        None => format!("{CALCIUM:?}"),
    };
    // The job folder knows which of its steps serve other loads than they were made for.
    let (script, step) = match a.start {
        Start::Continuum => (PRESCRIBED_LOAD, None),
        Start::Touch => (DISPLACEMENT_RAMP, Some(scene.step_or_default())),
    };
    let ladder_key = Key::new(
        "ladder",
        &(
            (block, crystal, potential, engine.describe(), script.hash()),
            (step, scene.force_tolerance_ev_per_angstrom, scene.plasticity, pair),
        ),
        &[geometry],
    )?;
    let total = a.block.atoms() + (a.points * a.points) as u64;
    let (lammps_key, what) = match a.start {
        Start::Continuum => (
            Key::new("lammps", &(case.scene.load.p_star_path(), a.nvt.is_some()), &[&ladder_key, &matched_key])?,
            format!("loads of {total} atoms, each from the continuum's solution"),
        ),
        Start::Touch => {
            // Of the loads only the highest counts, and only for where the ladder ends or turns.
            let highest = case.highest_p_star();
            let way = if a.unload { ", there and back" } else { "" };
            let key = Key::new("lammps", &(highest, a.unload), &[&ladder_key])?;
            (key, format!("displacement ladder of {total} atoms{way}"))
        }
    };
    let outcome: LammpsOutcome =
        folder.stage(listener, ("lammps", &what), &lammps_key, ResumePolicy::ContinueFrom(&ladder_key), |dir| {
            let solved = (a.start == Start::Continuum).then_some((&matched.soft, root.as_path()));
            let job = atomistic::write_job(case, a, dir, solved)?;
            atomistic::run_lammps(engine, &job, listener)
        })?;
    for step in &outcome.unconverged {
        let text = format!(
            "load step {step} of the atoms stopped above the force tolerance or off its load; states taken from it are not equilibria"
        );
        listener.warn(&text);
        warnings.push(text);
    }
    let atoms_key = Key::new(
        "atoms",
        &(&case.scene.load, a.contact_force, a.stress_width_angstrom, case.requested_outputs(), Key::of_program()?),
        &[&lammps_key],
    )?;
    let mut found: AtomsResults = folder.stage(
        listener,
        ("atoms", "contact and gap at the asked loads"),
        &atoms_key,
        ResumePolicy::Restart,
        |dir| atomistic::read(case, a, &Job::open(root.join("lammps"))?, &outcome, dir, "atoms"),
    )?;
    if let Some(settings) = &a.nvt {
        let nvt_key = Key::new(NVT_STAGE, &(settings, NVT.hash(), engine.describe()), &[&lammps_key])?;
        let nvt_results_key = Key::new("held", &Key::of_program()?, &[&nvt_key])?;
        let what = format!("the loads held at {} K, {} ps each", settings.temperature_k, settings.time_ps);
        let held = folder.stage(
            listener,
            (NVT_STAGE, &what),
            &nvt_results_key,
            ResumePolicy::ContinueFrom(&nvt_key),
            |dir| nvt::run_nvt(case, a, (engine, &Job::open(root.join("lammps"))?), settings, dir, listener),
        )?;
        found.nvt = Some(held);
    }
    let compare_key = Key::new(COMPARE, &(), &[&matched_key, &atoms_key])?;
    let compared = folder.stage(
        listener,
        (COMPARE, "maps, areas and gaps side by side"),
        &compare_key,
        ResumePolicy::Restart,
        |_| comparison::compare(case, a, &found, &matched, &root, COMPARE),
    )?;
    let told = match methods::wants_atoms(case) {
        false => None,
        true => {
            let seconds = folder.costs.iter().filter(|c| c.name == "lammps").map(|c| c.seconds).sum();
            let stage = format!("method-{}", all_atom::ID);
            let key = Key::new(&stage, &(), &[&atoms_key])?;
            Some(folder.stage(
                listener,
                (&stage, "the atoms as one of the methods"),
                &key,
                ResumePolicy::Restart,
                |dir| methods::of_atoms(case, &found, seconds, (&root, dir, &stage)),
            )?)
        }
    };
    Ok((found, compared, told))
}

/// Compares again what a run folder holds, without solving or running anything, and writes results and report.
pub fn rebuild_comparison(out: &Path) -> Result<(Results, PathBuf)> {
    let mut results = Results::read(out)?;
    let _locked = RunFolder::lock(out)?;
    let case = Case::read(&out.join("scene.toml"))?;
    let lacking = || Error::format(out, "a run without atoms", "the folder of a run whose scene has [atoms]");
    let (a, found) = case.atoms.as_ref().zip(results.atoms.as_ref()).ok_or_else(lacking)?;
    let earlier = results.comparison.as_ref().ok_or_else(lacking)?;
    let matched = Matched {
        full: earlier.full_heights.clone(),
        hard: earlier.hard_wall.clone(),
        soft: earlier.compliant_wall.clone(),
    };
    results.comparison = Some(comparison::compare(&case, a, found, &matched, out, COMPARE)?);
    results.write(out)?;
    let page = report::write(out)?;
    Ok((results, page))
}

pub(super) fn heights_hash(case: &Case) -> Result<Option<String>> {
    case.scene.surface.heights.as_ref().map(|p| Key::of_file(&case.resolve_path(p))).transpose()
}

fn stored_heights(out: &Path, surface: &SurfaceResults) -> Result<Vec<f64>> {
    let file = surface.heights.as_ref().expect("maps that were read are kept");
    Ok(npy::read(&out.join(file))?.values)
}

/// What ran, on what, for how long: `manifest.json`.
#[derive(serde::Serialize)]
struct Manifest<'a> {
    program: String,
    scene: &'a crate::scene::Scene,
    engine: Option<&'a str>,
    /// How the scene's accuracy chose grid, method, precision and tolerance.
    accuracy: Option<&'a AccuracyChoice>,
    threads: usize,
    peak_rss_bytes: u64,
    stages: &'a [crate::record::results::StageCost],
    stops: Vec<&'a str>,
    warnings: &'a [String],
}

impl<'a> Manifest<'a> {
    fn of(case: &'a Case, results: &'a Results, engine: Option<&'a str>) -> Self {
        Manifest {
            program: format!("asperity {}", env!("CARGO_PKG_VERSION")),
            scene: &case.scene,
            engine,
            accuracy: results.accuracy.as_ref(),
            threads: rayon::current_num_threads(),
            peak_rss_bytes: results.stages.iter().map(|s| s.peak_rss_bytes).max().unwrap_or(0),
            stages: &results.stages,
            stops: results.continuum.iter().flat_map(|c| &c.states).map(|s| s.numbers.stop.as_str()).collect(),
            warnings: &results.warnings,
        }
    }
}

fn sources(case: &Case) -> Vec<String> {
    let mut list = vec![
        "Müser et al., Meeting the contact-mechanics challenge, Tribology Letters 65 (2017) 118, \
         doi:10.1007/s11249-017-0900-2: the problem, its surface, methods and units."
            .to_string(),
        "Yastrebov, Anciaux & Molinari, J. Mech. Phys. Solids 107 (2017) 469, arXiv:1701.02727: perimeter correction of \
         the contact area."
            .to_string(),
    ];
    let second = case.scene.challenge.as_ref().and_then(|c| crate::method::find(&c.cross_check_method));
    let beside = case.comparison_methods();
    let cards = std::iter::once(case.method()).chain(second.map(|m| m.card())).chain(beside.iter().map(|m| m.card()));
    let mut named: Vec<&str> = Vec::new();
    for card in cards {
        if named.contains(&card.id) {
            continue;
        }
        named.push(card.id);
        list.push(if card.paper_name == "-" {
            format!(
                "Method {}: asperity's own (version {}), described in docs/methods.md; its equations are those of the \
                 challenge.",
                card.id,
                env!("CARGO_PKG_VERSION")
            )
        } else {
            let dois = card.dois.iter().map(|d| format!("doi:{d}"));
            let named = dois.chain(card.papers.iter().map(|p| p.to_string())).collect::<Vec<_>>().join("; ");
            format!("Method {} ({}): {named}.", card.id, card.paper_name)
        });
    }
    if case.atoms.is_some() {
        list.push(
            "Carbone, Lorenz, Persson & Wohlers, Eur. Phys. J. E 29 (2009) 275, doi:10.1140/epje/i2009-10484-8: elastic \
             layer of finite thickness."
                .to_string(),
        );
        list.push(
            "Thompson et al., LAMMPS, Comput. Phys. Commun. 271 (2022) 108171, doi:10.1016/j.cpc.2021.108171: the \
             molecular statics."
                .to_string(),
        );
        list.push(
            "The calcium-like potential is asperity's own; potentials/README.md describes fit and properties."
                .to_string(),
        );
    }
    list
}

/// The MCAP recording of a run: gaps and scalars per load, the touching atoms as a cloud.
fn record(case: &Case, results: &Results, out: &Path) -> Result<()> {
    let length = results.atoms.as_ref().map_or(case.scales.length_m * 1e6, |a| a.length_angstrom);
    let unit = if results.atoms.is_some() { "Å" } else { "µm" };
    let scene = Recorded {
        name: results.name.clone(),
        length_unit: unit.into(),
        cell: [length, length * case.grid.ly / case.grid.lx],
        notes: [("program".to_string(), format!("asperity {}", env!("CARGO_PKG_VERSION")))].into(),
    };
    let mut recorder = Recorder::create(&out.join(RECORDING_FILE), scene)?;
    // With atoms, the continuum that is recorded beside them is the one on their own profile and scale.
    let continuum = results.comparison.as_ref().map(|c| &c.compliant_wall).or(results.continuum.as_ref());
    for (i, state) in continuum.iter().flat_map(|c| &c.states).enumerate() {
        let gap = state.numbers.gap_map.as_ref().map(|g| npy::read(&out.join(g))).transpose()?;
        let scaled: Option<(usize, Vec<f64>)> = gap.map(|g| (g.nx, g.values.iter().map(|v| v * length).collect()));
        recorder.state(&LoadState {
            source: "continuum",
            index: i as u32,
            scalars: LoadScalars {
                p_star: state.numbers.p_star,
                contact_fraction: state.numbers.contact_fraction,
                criterion: state.criterion.clone(),
                mean_gap: state.mean_gap * length,
                patches: state.numbers.patches,
                energy: Some(state.energy),
                residual: Some(state.residual),
            },
            gap: scaled.as_ref().map(|(nx, gap)| GapMap { nx: *nx, gap }),
            atoms: &[],
        })?;
    }
    for (i, state) in results.atoms.iter().flat_map(|a| &a.states).enumerate() {
        let gap = npy::read(&out.join(&state.gap_map))?;
        let cloud = match &state.frame {
            Some(frame) => cloud(&out.join(frame))?,
            None => Vec::new(),
        };
        recorder.state(&LoadState {
            source: "atoms",
            index: i as u32,
            scalars: LoadScalars {
                p_star: state.p_star,
                contact_fraction: state.contact_fraction,
                criterion: "indenter atom within d_c".into(),
                mean_gap: state.mean_gap_angstrom,
                ..LoadScalars::default()
            },
            gap: Some(GapMap { nx: gap.nx, gap: &gap.values }),
            atoms: &cloud,
        })?;
    }
    recorder.finish()
}

/// Block atoms of a frame, with their contact flag.
fn cloud(frame: &Path) -> Result<Vec<CloudAtom>> {
    let atoms = crate::record::xyz::read(frame)?;
    let block = atoms.into_iter().filter(|a| a.species != INDENTER_SPECIES);
    Ok(block.map(|a| CloudAtom { position: a.position_angstrom.map(|c| c as f32), contact: a.contact }).collect())
}

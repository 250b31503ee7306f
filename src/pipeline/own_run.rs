//! Analysis of the frames of an own LAMMPS run: any substrate under a rigid indenter with the scene's surface.

use super::Listener;
use super::own_continuum::{Common, OwnContinuum, solve};
use super::own_frame::{AnalysedFrame, FORCES, OwnFrames, OwnLoad, OwnRun, wrong_count};
use crate::compare::{SiteCriterion, SitesOnGrid};
use crate::record::results::CriterionMatch;
use crate::record::xyz;
use crate::report::number::significant;
use crate::scene::Case;
use crate::{Error, Result};
use asperity_atoms::contact::{mean, onto_grid};
use asperity_atoms::dump::DumpFrame;
use asperity_atoms::external_dump::for_each_frame;
use asperity_contact::interface::{AttractionLaw, Wall};
use asperity_contact::load::Load;
use asperity_contact::problem::LoadKind;
use asperity_grid::units::GPA_PER_EV_A3;
use asperity_grid::{Field, Grid};
use asperity_surface::files::atomic_file::{list, remove};
use asperity_surface::files::npy;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Maps of a frame.
const MAPS: [&str; 6] = ["contact", "gap", "site-contact", "site-gap", "continuum-contact", "continuum-gap"];

/// Relative difference between the edges of the box and of the scene's surface beyond that of a thermal expansion.
const OTHER_LENGTH: f64 = 0.02;

const ANGSTROM_PER_M: f64 = 1e10;

/// Contact and gap in one frame of an own run. File names are relative to the folder of the maps.
#[derive(Debug, Clone, Serialize)]
pub struct OwnState {
    pub file: PathBuf,
    pub timestep: u64,
    /// Height of the mean plane of the indenter's surface, Å.
    pub indenter_z_angstrom: f64,
    /// Of the load, where it is known.
    pub p_star: Option<f64>,
    /// Sum of the forces fz on the indenter.
    pub load_ev_per_angstrom: Option<f64>,
    /// Contact atoms of the surface layer over all atoms of that layer.
    pub contact_area: f64,
    pub contacts: usize,
    /// Contact atoms that are not of the surface layer of the first frame.
    pub contacts_below_surface: usize,
    pub mean_gap_angstrom: f64,
    /// u8 and f64 `[ny, nx]` on the grid of the continuum; gaps in Å.
    pub contact_map: String,
    pub gap_map: String,
    /// Extended XYZ file of the frame.
    pub frame: String,
    /// Contact distance d_c (Å) and the contact fraction with it.
    pub sensitivity: Vec<[f64; 2]>,
    /// None without contact, where the load is not known, and where the continuum has no state of the frame's load or contact area.
    pub continuum: Option<OwnMatch>,
}

/// The continuum at the load of a frame, or at its contact area.
#[derive(Debug, Clone, Serialize)]
pub struct OwnMatch {
    pub at: &'static str,
    pub p_star: f64,
    /// Of the nodes, over the area of the box; `contact` has that of the surface atoms on it.
    pub contact_area: f64,
    pub mean_gap_angstrom: f64,
    /// rms difference of the gaps outside both contacts, Å. None where no atom is.
    pub gap_rms_difference_angstrom: Option<f64>,
    pub gap_map: String,
    pub contact: CriterionMatch,
}

/// Analyses the frames of an own run, and writes maps and frames into `out` when all are analysed. Returns the states, and why the continuum has
/// none of some of them.
///
/// # Errors
/// Those of the dumps; `Input` for values that do not fit to them.
pub fn read_own_run(
    case: &Case,
    run: &OwnRun,
    files: &[PathBuf],
    out: &Path,
    listener: &dyn Listener,
) -> Result<(Vec<OwnState>, Option<Error>)> {
    if case.is_non_periodic() {
        let accepted = "true with frames of an own run, whose box is periodic";
        return Err(Error::input(case.file.display(), "continuum.periodic", false, accepted));
    }
    let (mut frames, mut analysed): (Option<OwnFrames>, Vec<AnalysedFrame>) = (None, Vec::new());
    let mut has_units = true;
    for_each_frame(files, &mut |text| listener.warn(text), &mut |_, frame| {
        let of_run = match &mut frames {
            Some(known) => known,
            none => none.insert(OwnFrames::begin(case, run, &frame)?),
        };
        analysed.push(of_run.analyse(analysed.len(), &frame)?);
        has_units &= frame.has_units;
        Ok(())
    })?;
    let frames = frames.expect("at least one frame");
    if run.indenter_z.len() > 1 && run.indenter_z.len() != analysed.len() {
        return Err(wrong_count(run.indenter_z.len(), analysed.len()));
    }
    if analysed.iter().all(|a| a.contact.ids.is_empty()) {
        listener.warn(&format!("no atom of the substrate is within d_c = {} Å of the indenter", run.contact_distance));
    }
    let wanted = wanted(case, run.load, &analysed, frames.edges)?;
    warn_of_assumptions(case, (run, has_units), &frames, listener);
    let (solved, failure) = solve_all(case, &frames, &wanted, listener)?;
    std::fs::create_dir_all(out).map_err(Error::io("create", out))?;
    remove_earlier(out)?;
    let states = write(case, (&frames, &analysed), (&wanted, &solved), (files, out))?;
    Ok((states, failure))
}

/// What is taken for granted of an own run: the unit of its forces, adhesion that is scaled with the surface, and its hard wall.
fn warn_of_assumptions(case: &Case, (run, has_units): (&OwnRun, bool), frames: &OwnFrames, listener: &dyn Listener) {
    if run.load == Some(OwnLoad::Fz) && !has_units {
        listener.warn(
            "the dumps name no units: forces are taken to be eV/Å (metal); `dump_modify ID units yes` writes them",
        );
    }
    let own = case.atoms.as_ref().map_or(case.scales.length_m * ANGSTROM_PER_M, |atoms| atoms.block.length());
    let ratio = frames.edges[0] / own;
    let is_known = case.atoms.is_some() || !case.scene.laboratory.is_plain();
    if is_known && case.scene.adhesion.is_some() && (ratio - 1.0).abs() > OTHER_LENGTH {
        listener.warn(&format!(
            "the box is {} times as long as the scene's surface: heights, work and range of adhesion are scaled with it",
            significant(ratio, 4)
        ));
    }
    if case.planned_problem().wall != Wall::Hard {
        listener.warn("the continuum of own frames has a hard wall at d_c, and not the wall of the scene");
    }
}

/// Solves the continuum of the frames that have something in common with it. Frames without a solution, and with adhesion or plastic flow, which
/// have a history, those after them, have none; the listener is told why. Returns the last reason, too.
fn solve_all(
    case: &Case,
    frames: &OwnFrames,
    wanted: &[WantedFrame],
    listener: &dyn Listener,
) -> Result<(Vec<Option<OwnContinuum>>, Option<Error>)> {
    let surface = (&frames.profile, frames.run.contact_distance / frames.edges[0]);
    let problem = case.planned_problem();
    let has_history = problem.hardness.is_some() || problem.adhesion != AttractionLaw::None;
    let mut solved: Vec<Option<OwnContinuum>> = wanted.iter().map(|_| None).collect();
    let mut failure = None;
    let mut waiting: Vec<usize> = (0..wanted.len()).filter(|k| wanted[*k].common.is_some()).collect();
    // Each failure ends a path; what is left begins another one, first alone, as the loads of a path are checked together.
    let mut together = true;
    while !waiting.is_empty() {
        let count = if together { waiting.len() } else { 1 };
        let common: Vec<Common> = waiting[..count].iter().filter_map(|k| wanted[*k].common).collect();
        let (states, why) = solve(case, surface, &common, listener)?;
        let reached = states.len();
        for (k, state) in waiting.drain(..reached).zip(states) {
            solved[k] = Some(state);
        }
        let Some(why) = why else { continue };
        if count > 1 && reached == 0 && !has_history {
            together = false;
            continue;
        }
        let rest = if has_history { " and of those after it" } else { "" };
        listener.warn(&format!("no continuum of frame {}{rest}: {why}", waiting[0] + 1));
        failure = Some(why);
        waiting.drain(..if has_history { waiting.len() } else { 1 });
    }
    Ok((solved, failure))
}

/// Removes maps and frames of an earlier analysis, which may be of more frames.
fn remove_earlier(out: &Path) -> Result<()> {
    let is_ours = |name: &str| {
        let Some(rest) = name.strip_prefix("frame-") else { return false };
        let rest = rest.trim_start_matches(|c: char| c.is_ascii_digit());
        rest == ".xyz" || MAPS.iter().any(|map| rest.strip_prefix('-').is_some_and(|r| r == format!("{map}.npy")))
    };
    for (name, path) in list(out)? {
        if is_ours(&name) {
            remove(&path)?;
        }
    }
    Ok(())
}

/// The load of a frame, and what the continuum is to have in common with it.
#[derive(Debug, Clone, Copy, Default)]
struct WantedFrame {
    /// Where it is known.
    p_star: Option<f64>,
    common: Option<Common>,
}

/// What is wanted of each frame.
fn wanted(case: &Case, load: Option<OwnLoad>, analysed: &[AnalysedFrame], edges: [f64; 2]) -> Result<Vec<WantedFrame>> {
    let of_load = |load: Load| {
        let Load::Pressure(pressure) = load else { return WantedFrame::default() };
        WantedFrame { p_star: Some(pressure / case.gradient), common: Some(Common::Load(load)) }
    };
    match load {
        None => {
            if case.scene.adhesion.is_some() {
                let accepted = "scene or fz: with adhesion several loads have the same contact area";
                return Err(Error::input("command line", "--load", "not given", accepted));
            }
            let of_area = |a: &AnalysedFrame| Some(a.contact.fraction()).filter(|f| *f > 0.0 && *f < 1.0);
            let frame = |a| WantedFrame { p_star: None, common: of_area(a).map(Common::ContactArea) };
            Ok(analysed.iter().map(frame).collect())
        }
        Some(OwnLoad::Scene) => {
            let (steps, loads) = (case.loading_steps(), case.scene.load.loads());
            let key = match loads.kind {
                LoadKind::PStar | LoadKind::Pressure | LoadKind::Force => None,
                LoadKind::MeanGap => Some("load.mean_gap"),
                LoadKind::Displacement => Some("load.displacement"),
                LoadKind::Contact => Some("load.contact"),
            };
            let place = case.file.display();
            if let Some(key) = key {
                return Err(Error::input(
                    place,
                    key,
                    "given",
                    "with --load scene a pressure, force or p_star for each frame",
                ));
            }
            if steps.len() != analysed.len() {
                let found = format!("{} loads for {} frames", steps.len(), analysed.len());
                return Err(Error::input(place, "load", found, "with --load scene a load for each frame"));
            }
            Ok(steps.iter().map(|step| of_load(step.target)).collect())
        }
        Some(OwnLoad::Fz) => {
            if analysed.iter().all(|a| a.force == Some(0.0)) {
                let found = "forces fz of the indenter's atoms that are zero in all frames";
                return Err(Error::format(&analysed[0].file, found, FORCES));
            }
            let zeroed = analysed.iter().find(|a| a.force == Some(0.0) && !a.contact.ids.is_empty());
            if let Some(frame) = zeroed {
                let found = format!(
                    "timestep {}: contact, and forces fz of the indenter's atoms that are zero",
                    frame.timestep
                );
                return Err(Error::format(&frame.file, found, FORCES));
            }
            let unit = load_unit(case)? * edges[0] * edges[1];
            // Before contact there is no load.
            let frame = |a: &AnalysedFrame| match a.force {
                Some(0.0) => WantedFrame { p_star: Some(0.0), common: None },
                force => force.map_or(WantedFrame::default(), |force| of_load(Load::Pressure(force / unit))),
            };
            Ok(analysed.iter().map(frame).collect())
        }
    }
}

/// E* of the substrate, eV/Å³.
fn load_unit(case: &Case) -> Result<f64> {
    let lab = &case.scene.laboratory;
    let given = lab.modulus.is_some() || !lab.bodies.is_empty();
    let modulus = case.atoms.as_ref().map(|a| a.modulus_gpa).or_else(|| given.then(|| lab.modulus().to("GPa")));
    let accepted = "with --load fz the E* of the substrate";
    let missing = || Error::input(case.file.display(), "laboratory.modulus", "not given", accepted);
    Ok(modulus.ok_or_else(missing)? / GPA_PER_EV_A3)
}

/// Writes maps and frames; the frames are read again.
fn write(
    case: &Case,
    (frames, analysed): (&OwnFrames, &[AnalysedFrame]),
    (wanted, solved): (&[WantedFrame], &[Option<OwnContinuum>]),
    (files, out): (&[PathBuf], &Path),
) -> Result<Vec<OwnState>> {
    let (grid, layer) = (frames.profile.grid, &frames.layer);
    let site = |x: f64, y: f64| layer.cells.nearest([x, y].map(|c| c * frames.edges[0]));
    let owners = (0..grid.points()).map(|k| site((k % grid.nx) as f64 * grid.dx(), (k / grid.nx) as f64 * grid.dy()));
    let owners: Vec<usize> = owners.collect();
    let maps =
        OwnMaps { frames, grid, sites: SitesOnGrid::new(grid, layer.positions.iter().copied(), site), owners, out };
    let mut states = Vec::new();
    for_each_frame(files, &mut |_| (), &mut |_, frame| {
        let number = states.len() + 1;
        let (Some(a), Some(wanted)) = (analysed.get(number - 1), wanted.get(number - 1)) else {
            return Err(Error::format(&frame.source, "more frames than before", "a file that stays as it is"));
        };
        states.push(maps.state(number, a, (wanted, solved[number - 1].as_ref()))?);
        write_frame(case, &maps, number, (&frame, a), wanted.p_star)
    })?;
    Ok(states)
}

/// Folder, grid and sites of the maps.
struct OwnMaps<'a> {
    frames: &'a OwnFrames<'a>,
    grid: Grid,
    sites: SitesOnGrid,
    /// Surface atom of each node.
    owners: Vec<usize>,
    out: &'a Path,
}

impl OwnMaps<'_> {
    /// Writes the maps of a frame.
    fn state(
        &self,
        number: usize,
        a: &AnalysedFrame,
        (wanted, solved): (&WantedFrame, Option<&OwnContinuum>),
    ) -> Result<OwnState> {
        let Grid { nx, ny, .. } = self.grid;
        let name = |what: &str| format!("frame-{number}-{what}.npy");
        let path = |what: &str| self.out.join(name(what));
        let flags = |sites: &[bool]| sites.iter().map(|t| u8::from(*t)).collect::<Vec<u8>>();
        let touching = flags(&a.contact.sites);
        npy::write(&path("contact"), nx, ny, onto_grid(&touching, &self.owners))?;
        npy::write(&path("gap"), nx, ny, onto_grid(&a.gaps, &self.owners))?;
        npy::write(&path("site-contact"), touching.len(), 1, touching.iter().copied())?;
        npy::write(&path("site-gap"), a.gaps.len(), 1, a.gaps.iter().copied())?;
        let continuum = match solved {
            None => None,
            Some(c) => {
                let edge = self.frames.edges[0];
                let here = self.sites.touching(Field::F64(&c.touching_gap), 0.0);
                npy::write(&path("continuum-contact"), nx, ny, onto_grid(&flags(&here), &self.owners))?;
                npy::write(&path("continuum-gap"), nx, ny, c.gap.iter().map(|g| g * edge))?;
                let map = Some(name("continuum-contact"));
                let gaps = self.sites.sample(Field::F64(&c.gap));
                let open = (0..here.len()).filter(|&s| !here[s] && !a.contact.sites[s]);
                let squares: Vec<f64> = open.map(|s| (a.gaps[s] - gaps[s] * edge).powi(2)).collect();
                Some(OwnMatch {
                    at: if matches!(wanted.common, Some(Common::Load(_))) { "load" } else { "contact area" },
                    p_star: c.p_star,
                    contact_area: c.contact_area,
                    mean_gap_angstrom: c.mean_gap() * edge,
                    gap_rms_difference_angstrom: (!squares.is_empty()).then(|| mean(&squares).sqrt()),
                    gap_map: name("continuum-gap"),
                    contact: self.sites.compare(&here, &a.contact.sites, SiteCriterion::HardWall, map),
                })
            }
        };
        Ok(OwnState {
            file: a.file.clone(),
            timestep: a.timestep,
            indenter_z_angstrom: a.indenter_z,
            p_star: wanted.p_star,
            load_ev_per_angstrom: a.force,
            contact_area: a.contact.fraction(),
            contacts: a.contact.ids.len(),
            contacts_below_surface: a.contact.below_surface,
            mean_gap_angstrom: mean(&a.gaps),
            contact_map: name("contact"),
            gap_map: name("gap"),
            frame: format!("frame-{number}.xyz"),
            sensitivity: a.sensitivity.clone(),
            continuum,
        })
    }
}

/// Writes the atoms of both bodies as extended XYZ, from the lower corner of the box along x and y.
fn write_frame(
    case: &Case,
    maps: &OwnMaps,
    number: usize,
    (frame, a): (&DumpFrame, &AnalysedFrame),
    p_star: Option<f64>,
) -> Result<()> {
    let bodies = maps.frames.run.types.of(frame)?;
    let [[x0, _], [y0, _], _] = frame.bounds;
    let element = case.atoms.as_ref().map_or(xyz::DUMMY, |atoms| atoms.element.as_str());
    let atom = |k: usize, indenter: bool| {
        let named = frame.species.get(k).and_then(|s| frame.element(*s));
        let [x, y, z] = frame.positions[k];
        xyz::Atom {
            id: u64::from(frame.ids[k]),
            species: if indenter { xyz::DUMMY } else { named.unwrap_or(element) },
            position_angstrom: [x - x0, y - y0, z],
            contact: !indenter && a.contact.ids.binary_search(&frame.ids[k]).is_ok(),
            indenter,
        }
    };
    let atoms = bodies.substrate.len() + bodies.indenter.len();
    let header = xyz::XyzHeader { cell_angstrom: [0, 1, 2].map(|axis| frame.length(axis)), p_star, atoms };
    let substrate = bodies.substrate.iter().map(|&k| atom(k, false));
    let indenter = bodies.indenter.iter().map(|&k| atom(k, true));
    xyz::write(&maps.out.join(format!("frame-{number}.xyz")), header, substrate.chain(indenter))
}

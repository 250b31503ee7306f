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
use asperity_contact::load::Load;
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

/// Analyses the frames of an own run, and writes maps and frames into `out` when all are analysed.
///
/// # Errors
/// Those of the dumps; `Input` for values that do not fit to them; those of the continuum.
pub fn read_own_run(
    case: &Case,
    run: &OwnRun,
    files: &[PathBuf],
    out: &Path,
    listener: &dyn Listener,
) -> Result<Vec<OwnState>> {
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
    let mut common = commons(case, run.load, &analysed, frames.edges)?;
    warn_of_units(case, (run, has_units), &frames, listener);
    let solved = solve_all(case, &frames, &mut common, listener)?;
    std::fs::create_dir_all(out).map_err(Error::io("create", out))?;
    remove_earlier(out)?;
    write(case, (&frames, &analysed), (&common, &solved), (files, out))
}

/// Units that are taken for granted: those of forces, and those of an adhesion whose lengths are scaled with the surface.
fn warn_of_units(case: &Case, (run, has_units): (&OwnRun, bool), frames: &OwnFrames, listener: &dyn Listener) {
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
}

/// Solves the continuum of the frames that have something in common with it. If a frame has none, each is solved alone, and those without a
/// solution are left out of `common` with a warning.
fn solve_all(
    case: &Case,
    frames: &OwnFrames,
    common: &mut [Option<Common>],
    listener: &dyn Listener,
) -> Result<Vec<OwnContinuum>> {
    let surface = (&frames.profile, frames.run.contact_distance / frames.edges[0]);
    let wanted: Vec<Common> = common.iter().flatten().copied().collect();
    let one =
        |wanted: &[Common]| solve(case, surface, wanted, listener).map_err(|error| case.given_units().rewrite(error));
    let joint = one(&wanted);
    // Plastic flow and adhesion depend on the loads before.
    let depends_on_history = case.planned_problem().hardness.is_some() || case.scene.adhesion.is_some();
    if depends_on_history || wanted.len() < 2 || !matches!(joint, Err(Error::NotConverged { .. } | Error::Input { .. }))
    {
        return joint;
    }
    let mut solved = Vec::new();
    for (number, place) in (1..).zip(common) {
        let Some(wanted) = *place else { continue };
        match one(&[wanted]) {
            Ok(found) => solved.extend(found),
            Err(why @ (Error::NotConverged { .. } | Error::Input { .. })) => {
                listener.warn(&format!("frame {number}: no continuum: {why}"));
                *place = None;
            }
            Err(other) => return Err(other),
        }
    }
    if solved.is_empty() { joint } else { Ok(solved) }
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

/// What the continuum is to have in common with each frame.
fn commons(
    case: &Case,
    load: Option<OwnLoad>,
    analysed: &[AnalysedFrame],
    edges: [f64; 2],
) -> Result<Vec<Option<Common>>> {
    let place = case.file.display();
    match load {
        None => Ok(analysed
            .iter()
            .map(|a| Some(a.contact.fraction()).filter(|f| *f > 0.0 && *f < 1.0).map(Common::ContactArea))
            .collect()),
        Some(OwnLoad::Scene) => {
            let steps = case.loading_steps();
            let are_pressures = steps.iter().all(|step| matches!(step.target, Load::Pressure(_)));
            if !case.scene.load.contact.is_empty() || !are_pressures || steps.len() != analysed.len() {
                let kind = if are_pressures { "loads" } else { "gaps" };
                let found = format!("{} {kind} for {} frames", steps.len(), analysed.len());
                let accepted = "with --load scene a pressure, force or p_star for each frame";
                return Err(Error::input(place, "load", found, accepted));
            }
            Ok(steps.iter().map(|step| Some(Common::Load(step.target))).collect())
        }
        Some(OwnLoad::Fz) => {
            if analysed.iter().all(|a| a.force == Some(0.0)) {
                let found = "forces fz of the indenter's atoms that are zero in all frames";
                return Err(Error::format(&analysed[0].file, found, FORCES));
            }
            let lab = &case.scene.laboratory;
            let given = lab.modulus.is_some() || !lab.bodies.is_empty();
            let modulus = case.atoms.as_ref().map(|a| a.modulus_gpa);
            let modulus = modulus.or_else(|| given.then(|| lab.modulus().to("GPa")));
            let missing =
                || Error::input(place, "laboratory.modulus", "not given", "with --load fz the E* of the substrate");
            let unit = modulus.ok_or_else(missing)? / GPA_PER_EV_A3 * edges[0] * edges[1];
            // Before contact there is no load.
            let load = |a: &AnalysedFrame| {
                a.force.filter(|force| *force != 0.0).map(|force| Common::Load(Load::Pressure(force / unit)))
            };
            Ok(analysed.iter().map(load).collect())
        }
    }
}

/// Writes maps and frames; the frames are read again.
fn write(
    case: &Case,
    (frames, analysed): (&OwnFrames, &[AnalysedFrame]),
    (common, solved): (&[Option<Common>], &[OwnContinuum]),
    (files, out): (&[PathBuf], &Path),
) -> Result<Vec<OwnState>> {
    let (grid, layer) = (frames.profile.grid, &frames.layer);
    let site = |x: f64, y: f64| layer.cells.nearest([x, y].map(|c| c * frames.edges[0]));
    let owners = (0..grid.points()).map(|k| site((k % grid.nx) as f64 * grid.dx(), (k / grid.nx) as f64 * grid.dy()));
    let owners: Vec<usize> = owners.collect();
    let maps =
        OwnMaps { frames, grid, sites: SitesOnGrid::new(grid, layer.positions.iter().copied(), site), owners, out };
    let (mut states, mut solved) = (Vec::new(), solved.iter());
    for_each_frame(files, &mut |_| (), &mut |_, frame| {
        let number = states.len() + 1;
        let (Some(a), Some(&common)) = (analysed.get(number - 1), common.get(number - 1)) else {
            return Err(Error::format(&frame.source, "more frames than before", "a file that stays as it is"));
        };
        states.push(maps.state(number, a, common.and_then(|common| Some((common, solved.next()?))))?);
        write_frame(case, &maps, number, (&frame, a), states[number - 1].p_star)
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
    fn state(&self, number: usize, a: &AnalysedFrame, solved: Option<(Common, &OwnContinuum)>) -> Result<OwnState> {
        let Grid { nx, ny, .. } = self.grid;
        let name = |what: &str| format!("frame-{number}-{what}.npy");
        let path = |what: &str| self.out.join(name(what));
        let flags = |sites: &[bool]| sites.iter().map(|t| u8::from(*t)).collect::<Vec<u8>>();
        let touching = flags(&a.contact.sites);
        npy::write(&path("contact"), nx, ny, onto_grid(&touching, &self.owners))?;
        npy::write(&path("gap"), nx, ny, onto_grid(&a.gaps, &self.owners))?;
        npy::write(&path("site-contact"), touching.len(), 1, touching.iter().copied())?;
        npy::write(&path("site-gap"), a.gaps.len(), 1, a.gaps.iter().copied())?;
        let of_load = |(common, c): (Common, &OwnContinuum)| matches!(common, Common::Load(_)).then_some(c.p_star);
        let continuum = match solved {
            None => None,
            Some((common, c)) => {
                let edge = self.frames.edges[0];
                let here = self.sites.touching(Field::F64(&c.touching_gap), 0.0);
                npy::write(&path("continuum-contact"), nx, ny, onto_grid(&flags(&here), &self.owners))?;
                npy::write(&path("continuum-gap"), nx, ny, c.gap.iter().map(|g| g * edge))?;
                let map = Some(name("continuum-contact"));
                let gaps = self.sites.sample(Field::F64(&c.gap));
                let open = (0..here.len()).filter(|&s| !here[s] && !a.contact.sites[s]);
                let squares: Vec<f64> = open.map(|s| (a.gaps[s] - gaps[s] * edge).powi(2)).collect();
                Some(OwnMatch {
                    at: if matches!(common, Common::Load(_)) { "load" } else { "contact area" },
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
            p_star: solved.and_then(of_load),
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
        let named = frame.species.get(k).and_then(|s| frame.elements.get(*s as usize));
        let [x, y, z] = frame.positions[k];
        xyz::Atom {
            id: u64::from(frame.ids[k]),
            species: if indenter { xyz::DUMMY } else { named.map_or(element, String::as_str) },
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

//! The continuum on the atoms' own heights, layer and load, and what the two say about each other.

use super::atomistic::site_positions;
use super::continuum::{Asked, Keep, load_path};
use super::findings::{effective_pressure, findings};
use super::probe_atoms::{ProbeAtoms, Profile, map_name, share, within};
use super::versions::{Side, Solved, Units, versions};
use super::{Key, Listener};
use crate::atoms::contact::onto_grid;
use crate::atoms::wall::CONTACT_DISTANCE_ANGSTROM;
use crate::compare::{SiteCriterion, Sites, registration};
use crate::grid::{Field, Grid, bilinear, mean};
use crate::interface::{Elastic, RangeChoice, Wall};
use crate::method::{Precision, Problem};
use crate::observe::{Connectivity, along_y, column_at, patch_sizes};
use crate::record::npy;
use crate::record::quantity::Quantity;
use crate::record::results::{
    AtomState, AtomsResults, ComparisonResults, ContinuumResults, CriterionArea, CriterionMatch, LoadComparison,
    Section, StateResults,
};
use crate::record::uncertainty::{UncertaintyComponent, UncertaintySource};
use crate::scene::{AtomsCase, Case};
use crate::units::GPA_PER_EV_A3;
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Position of the section over the cell's extent in x.
const SECTION: f64 = 0.5;

/// rms KKT residual over the pressure of the matched solutions: gaps to a thousandth of an ångström.
const MATCHED_TOLERANCE: f64 = 1e-8;

/// Continuum solutions of the atoms' load on their layer: on the full heights, on the atoms' heights with a hard wall, and with
/// the atoms' own wall.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Matched {
    /// None in a run folder of an earlier version.
    #[serde(default)]
    pub full: Option<ContinuumResults>,
    pub hard: ContinuumResults,
    pub soft: ContinuumResults,
}

pub(super) fn matched(
    case: &Case,
    atoms: &AtomsCase,
    folder: &Path,
    stage: &str,
    key: &Key,
    listener: &dyn Listener,
) -> Result<Matched> {
    let (kernel, wall) = (atoms.kernel(), Wall::Hard);
    let hard = Matching { kernel, wall, soft: false, tag: "hard wall", criterion: "zero gap" };
    // The scene's own grid, which holds more of the spectrum than atoms do; neither low-passed nor scaled up.
    let whole = case.surface.heights(case.grid, 0.0);
    let full = Matching { tag: "full heights", ..hard };
    let asked = case
        .requested_outputs()
        .distributions
        .then(|| solve(case, atoms, (case.grid, &whole), full, (folder, stage), key, listener));
    let full = match asked.transpose() {
        // MethodRun the others: what does not converge here takes nothing from them.
        Err(e @ Error::NotConverged { .. }) => {
            listener.warn(&format!("the continuum on the full heights is left out: {e}"));
            None
        }
        other => other?,
    };
    let heights = reduced(atoms, atoms.heights_angstrom(&case.surface, atoms.matched));
    let mut found = solve(case, atoms, (atoms.matched, &heights), hard, (folder, stage), key, listener)?;
    if case.scene.atoms.as_ref().is_some_and(|a| a.depth_error) {
        let deep = Matching { kernel: Elastic::HalfSpace, tag: "half-space", ..hard };
        let deep = solve(case, atoms, (atoms.matched, &heights), deep, (folder, stage), key, listener)?;
        found
            .states
            .iter_mut()
            .zip(&deep.states)
            .for_each(|(state, deep)| state.uncertainty.extend(of_depth(state, deep)));
    }
    Ok(Matched { full, hard: found, soft: soft(case, atoms, (folder, stage), key, listener)? })
}

/// What the finite depth of a block makes of contact and mean gap: the way from the half-space, over the value.
fn of_depth(state: &StateResults, deep: &StateResults) -> [UncertaintyComponent; 2] {
    let part = |quantity, found: f64, deep: f64| {
        let relative = Some((found / deep - 1.0).abs()).filter(|r| r.is_finite());
        UncertaintyComponent { quantity, source: UncertaintySource::Depth, relative, is_bound: false }
    };
    [
        part(Quantity::ContactArea, state.contact_fraction_corrected, deep.contact_fraction_corrected),
        part(Quantity::MeanGap, state.mean_gap, deep.mean_gap),
    ]
}

/// The continuum with the atoms' own wall, at every load; its gaps are stored in the folder.
pub(super) fn soft(
    case: &Case,
    atoms: &AtomsCase,
    place: (&Path, &str),
    key: &Key,
    listener: &dyn Listener,
) -> Result<ContinuumResults> {
    let matching = Matching {
        kernel: atoms.kernel(),
        wall: Wall::Tabulated(atoms.soft_wall()),
        soft: true,
        tag: "compliant wall",
        criterion: "the wall pushes",
    };
    // The law acts straight up: on what a ball feels it acts where, and as soon as, an atom would be met on a slope.
    let heights = reduced(atoms, atoms.dilated_heights_angstrom(&case.surface));
    solve(case, atoms, (atoms.matched, &heights), matching, place, key, listener)
}

/// Å in units of L.
fn reduced(atoms: &AtomsCase, mut heights: Vec<f64>) -> Vec<f64> {
    heights.iter_mut().for_each(|h| *h /= atoms.block.length());
    heights
}

/// What is solved for the comparison, and what it calls contact.
#[derive(Clone, Copy)]
struct Matching {
    kernel: Elastic,
    wall: Wall,
    soft: bool,
    tag: &'static str,
    criterion: &'static str,
}

fn solve(
    case: &Case,
    atoms: &AtomsCase,
    (grid, heights): (Grid, &[f64]),
    matching: Matching,
    (folder, stage): (&Path, &str),
    key: &Key,
    listener: &dyn Listener,
) -> Result<ContinuumResults> {
    let problem = Problem {
        kernel: matching.kernel,
        adhesion: atoms.matched_adhesion(matching.soft),
        wall: matching.wall,
        precision: Precision::F64,
        tolerance: MATCHED_TOLERANCE,
        max_iterations: case.scene.continuum.max_iterations,
        ..Problem::new(grid, heights)
    };
    let asked = Asked {
        problem,
        method: &case.scene.continuum.method,
        // The pair adhesion is what the atoms have, whatever the grid.
        range: RangeChoice::True,
        steps: case.load_steps(),
        pull_off: false,
        start: None,
        gradient: case.gradient,
        hysteresis: false,
        threshold: 0.0,
        criterion: matching.criterion.into(),
        keep: &|_| Keep { gap: true, stress: case.requested_outputs().distributions },
        wants: case.requested_outputs(),
    };
    load_path(asked, (folder, stage, matching.tag), key, listener)
}

/// A stored field of the run folder.
struct Stored(npy::Field<f64>);

/// Shares of a gap field up to any threshold, after one sort.
struct Shares(Vec<f64>);

impl Shares {
    fn of(gap: &Stored) -> Self {
        let mut sorted = gap.0.values.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        Shares(sorted)
    }

    fn up_to(&self, threshold: f64) -> f64 {
        self.0.partition_point(|g| *g <= threshold) as f64 / self.0.len() as f64
    }
}

impl Stored {
    fn read(root: &Path, file: Option<&String>) -> Result<Self> {
        let file =
            file.ok_or_else(|| Error::format(root, "a state without its gap field", "a run that stores gaps"))?;
        Ok(Stored(npy::read(&root.join(file))?))
    }

    /// The gap over heights that are so much higher.
    fn over(mut self, higher: &[f64]) -> Stored {
        self.0.values.iter_mut().zip(higher).for_each(|(g, h)| *g += h);
        self
    }

    fn field(&self) -> Field<'_> {
        Field::F64(&self.0.values)
    }
}

/// The comparison at every load. `root` is the run folder that the results' file names are relative to; contact maps are
/// written into its folder `stage`.
pub(super) fn compare(
    case: &Case,
    atoms: &AtomsCase,
    found: &AtomsResults,
    matched: &Matched,
    root: &Path,
    stage: &str,
) -> Result<ComparisonResults> {
    let folder = root.join(stage);
    std::fs::create_dir_all(&folder).map_err(Error::io("create", &folder))?;
    let grid = atoms.matched;
    let length = atoms.block.length();
    let surface = atoms.block.surface();
    let owners = surface.onto_grid(grid.nx, grid.ny);
    let nearest = |x: f64, y: f64| surface.nearest(x * length, y * length);
    let sites = Sites::new(grid, site_positions(&surface), nearest);
    let places = ProbeAtoms::new(case, atoms, &sites)?;
    let fine = Sites::new(case.grid, site_positions(&surface), nearest);
    let bridged = bridged(case, atoms);
    let (mut loads, mut sections) = (Vec::new(), Vec::new());
    for (i, state) in found.states.iter().enumerate() {
        let (hard, soft) = (&matched.hard.states[i], &matched.soft.states[i]);
        let (hard_wall_gap, felt_gap) =
            (Stored::read(root, hard.numbers.gap_map.as_ref())?, Stored::read(root, soft.numbers.gap_map.as_ref())?);
        let compliant_wall_gap = Stored::read(root, soft.numbers.gap_map.as_ref())?.over(&bridged);
        let soft_gap_file = format!("{stage}/{}", map_name(i + 1, "soft gap"));
        npy::write(&root.join(&soft_gap_file), grid.nx, grid.ny, compliant_wall_gap.0.values.iter().copied())?;
        let per_site = |what: &str| root.join(state.contact_map.replace("contact.npy", what));
        let touching: Vec<bool> =
            npy::read_flags(&per_site("site-contact.npy"))?.values.iter().map(|v| *v != 0).collect();
        let site_gap = npy::read(&per_site("site-gap.npy"))?.values;
        let (hard_shares, soft_shares) = (Shares::of(&hard_wall_gap), Shares::of(&felt_gap));
        let effective_pressure = effective_pressure(atoms, hard) * atoms.modulus_gpa / GPA_PER_EV_A3;
        let raised_at = |distance: f64| {
            let clear = places.clearances((Profile::Own, hard_wall_gap.field()), distance);
            let rise = places.rise(&clear, effective_pressure);
            (within(&clear, |_| rise), rise)
        };
        let unpressed = places.unpressed(felt_gap.field());
        let soft_at = |distance: f64| {
            within(&places.clearances((Profile::Dilated, felt_gap.field()), distance), |site| unpressed[site])
        };
        let (raised_flags, rise) = raised_at(CONTACT_DISTANCE_ANGSTROM);
        let soft_flags = soft_at(CONTACT_DISTANCE_ANGSTROM);
        let plain_flags = sites.touching(hard_wall_gap.field(), 0.0);
        let judged = |flags: &[bool], criterion: SiteCriterion| -> Result<CriterionMatch> {
            let name = map_name(i + 1, criterion.id());
            let flags_on_grid: Vec<u8> = flags.iter().map(|t| u8::from(*t)).collect();
            npy::write(&folder.join(&name), grid.nx, grid.ny, onto_grid(&flags_on_grid, &owners))?;
            Ok(sites.compare(flags, &touching, criterion, Some(format!("{stage}/{name}"))))
        };
        let continuum = vec![
            judged(&plain_flags, SiteCriterion::HardWall)?,
            judged(&raised_flags, SiteCriterion::OffsetWall(rise))?,
            judged(&soft_flags, SiteCriterion::CompliantWall)?,
        ];
        let area_vs_distance =
            state.sensitivity.iter().map(|&[d, fraction]| [d, fraction, share(&raised_at(d).0), share(&soft_at(d))]);
        let area_vs_gap = state.sensitivity.iter().map(|&[d, _]| {
            let gap = (d - atoms.wall.minimum_angstrom()) / length;
            [gap * length, hard_shares.up_to(gap), soft_shares.up_to(gap)]
        });
        let touching_in = [raised_flags.as_slice(), &soft_flags];
        let solutions = Solutions { sites: [&fine, &sites], touching: touching_in, rise, bridged: &bridged };
        let sides = sides(case, atoms, matched, (i, state), solutions, root)?;
        let atoms_map = npy::read_flags(&root.join(&state.contact_map))?.values;
        // At the atoms' resolution: a finer map would have more and smaller patches.
        let soft_map: Vec<u8> = owners.iter().map(|&site| u8::from(soft_flags[site])).collect();
        let soft_sites = sites.sample(compliant_wall_gap.field());
        let open: Vec<f64> = (0..touching.len())
            .filter(|&s| !touching[s] && !soft_flags[s])
            .map(|s| site_gap[s] - soft_sites[s] * length)
            .collect();
        let rms = (open.iter().map(|d| d * d).sum::<f64>() / open.len().max(1) as f64).sqrt();
        loads.push(LoadComparison {
            p_star: state.p_star,
            registration: registration(grid, &atoms_map, &soft_map),
            atoms: CriterionArea {
                criterion: format!("an indenter atom within {CONTACT_DISTANCE_ANGSTROM} Å"),
                contact_fraction: state.contact_fraction,
            },
            continuum,
            atoms_mean_gap_angstrom: state.mean_gap_angstrom,
            hard_wall_mean_gap_angstrom: hard.mean_gap * length,
            compliant_wall_mean_gap_angstrom: mean(&compliant_wall_gap.0.values) * length,
            atoms_patches: patch_sizes(&atoms_map, grid.nx, Connectivity::Eight).len(),
            hard_wall_patches: patch_sizes(&soft_map, grid.nx, Connectivity::Eight).len(),
            gap_rms_difference_angstrom: rms,
            compliant_wall_gap: soft_gap_file,
            model_chain: versions(sides, (grid, &owners), hard.numbers.pressure * atoms.modulus_gpa, length),
            area_vs_distance: area_vs_distance.collect(),
            area_vs_gap: area_vs_gap.collect(),
        });
        let column = column_at(grid, SECTION);
        let atoms_gap = Stored::read(root, Some(&state.gap_map))?;
        let line = |field: Field, scale: f64| along_y(grid, field, column).iter().map(|p| p.1 * scale).collect();
        sections.push(Section {
            p_star: state.p_star,
            y: (0..grid.ny).map(|j| j as f64 * grid.dy() / grid.lx).collect(),
            atoms_gap_angstrom: line(atoms_gap.field(), 1.0),
            hard_wall_gap_angstrom: line(hard_wall_gap.field(), length),
            compliant_wall_gap_angstrom: line(compliant_wall_gap.field(), length),
            full_heights_gap_angstrom: match &matched.full {
                Some(full) => {
                    full_section(case.grid, &Stored::read(root, full.states[i].numbers.gap_map.as_ref())?, grid, length)
                }
                None => Vec::new(),
            },
        });
    }
    let findings = findings(case, atoms, found, matched, &loads);
    Ok(ComparisonResults {
        full_heights: matched.full.clone(),
        hard_wall: matched.hard.clone(),
        compliant_wall: matched.soft.clone(),
        loads,
        sections,
        findings,
    })
}

/// What the atoms' heights are above what a ball feels of them, units of L, on the grid of the comparison.
fn bridged(case: &Case, atoms: &AtomsCase) -> Vec<f64> {
    let (own, felt) =
        (atoms.heights_angstrom(&case.surface, atoms.matched), atoms.dilated_heights_angstrom(&case.surface));
    reduced(atoms, own.iter().zip(felt).map(|(own, felt)| own - felt).collect())
}

/// The gap of the full heights along the section, at the nodes of the comparison grid, Å.
fn full_section(own: Grid, gap: &Stored, grid: Grid, length: f64) -> Vec<f64> {
    let at = |j: usize| bilinear(own, |k| gap.field().at(k), SECTION, j as f64 * grid.dy()) * length;
    (0..grid.ny).map(at).collect()
}

/// The solutions of one load, read at the sites of the block's surface.
struct Solutions<'a> {
    /// On the scene's own grid, and on that of the comparison.
    sites: [&'a Sites; 2],
    /// Sites that touch: hard wall with raised atoms, soft wall.
    touching: [&'a [bool]; 2],
    /// How far they were raised, Å.
    rise: f64,
    /// What is to be added to gaps over what a ball feels, units of L, so that they are read as the atoms' are: up to the heights.
    bridged: &'a [f64],
}

/// Every version of the problem at the load `i`. Versions whose stress was not kept (run folders of an earlier version) are
/// left out.
fn sides(
    case: &Case,
    atoms: &AtomsCase,
    matched: &Matched,
    (i, state): (usize, &AtomState),
    solutions: Solutions,
    root: &Path,
) -> Result<Vec<Side>> {
    let units = Units {
        length_angstrom: atoms.block.length(),
        modulus_gpa: atoms.modulus_gpa,
        width_angstrom: atoms.stress_width_angstrom,
    };
    let mut list = Vec::new();
    let ([fine, sites], [raised, soft]) = (solutions.sites, solutions.touching);
    let criteria = [
        (matched.full.as_ref(), fine, case.grid, None, vec![("full_heights", SiteCriterion::HardWall, None)]),
        (
            Some(&matched.hard),
            sites,
            atoms.matched,
            None,
            vec![
                ("hard_wall", SiteCriterion::HardWall, None),
                ("offset_wall", SiteCriterion::OffsetWall(solutions.rise), Some(raised)),
            ],
        ),
        (
            Some(&matched.soft),
            sites,
            atoms.matched,
            Some(solutions.bridged),
            vec![("compliant_wall", SiteCriterion::CompliantWall, Some(soft))],
        ),
    ];
    for (of, sites, grid, higher, criteria) in criteria {
        let Some(found) = of.map(|c| &c.states[i]).filter(|s| s.numbers.stress_map.is_some()) else { continue };
        let (gap, stress) = (
            Stored::read(root, found.numbers.gap_map.as_ref())?,
            Stored::read(root, found.numbers.stress_map.as_ref())?,
        );
        let gap = match higher {
            Some(by) => gap.over(by),
            None => gap,
        };
        let solved = Solved { sites, grid, gap: gap.field(), stress: stress.field(), mean_gap: mean(&gap.0.values) };
        let smooth = solved.smooth(units);
        for (id, criterion, touching) in criteria {
            let touching = touching.map_or_else(|| sites.touching(gap.field(), 0.0), <[bool]>::to_vec);
            list.push(solved.side(id, criterion.words(), touching, smooth.clone(), units));
        }
    }
    if let Some(stress) = &state.stress {
        let per_site = |what: &str| root.join(state.contact_map.replace("contact.npy", what));
        list.push(Side {
            id: "atoms",
            criterion: format!("an indenter atom within {CONTACT_DISTANCE_ANGSTROM} Å"),
            touching: npy::read_flags(&per_site("site-contact.npy"))?.values.iter().map(|v| *v != 0).collect(),
            gap: npy::read(&per_site("site-gap.npy"))?.values,
            mean_gap_angstrom: state.mean_gap_angstrom,
            stress: npy::read(&root.join(&stress.map))?.values,
        });
    }
    Ok(list)
}

//! The continuum on the atoms' own heights, layer and load, and what the two say about each other.

use super::atomistic::site_positions;
use super::continuum::{Asked, Keep, load_path};
use super::versions::{Side, Solved, Units, versions};
use super::{Key, Listener};
use crate::atoms::contact::onto_grid;
use crate::atoms::wall::CONTACT_DISTANCE_ANGSTROM;
use crate::compare::{Criteria, Sites, registration, softness_threshold};
use crate::grid::{Field, Grid, bilinear};
use crate::interface::{Elastic, Kernel, RangeChoice, Wall};
use crate::method::{Precision, Problem};
use crate::observe::{Connectivity, along_y, column_at, patch_sizes};
use crate::record::budget::{Part, Source};
use crate::record::npy;
use crate::record::results::{
    AtomState, AtomsResults, ComparisonResults, ContinuumResults, CriterionArea, LoadComparison, PlasticityResults,
    Section, StateResults,
};
use crate::record::tradeoff::Measure;
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
    let hard = Matching { kernel, wall, soft: false, tag: "hard wall", threshold: 0.0, criterion: "zero gap" };
    // The scene's own grid, which holds more of the spectrum than atoms do; neither low-passed nor scaled up.
    let whole = case.surface.heights(case.grid, 0.0);
    let full = Matching { tag: "full heights", ..hard };
    let asked = case
        .wants()
        .distributions
        .then(|| solve(case, atoms, (case.grid, &whole), full, (folder, stage), key, listener));
    let full = match asked.transpose() {
        // Beside the others: what does not converge here takes nothing from them.
        Err(e @ Error::NotConverged { .. }) => {
            listener.warn(&format!("the continuum on the full heights is left out: {e}"));
            None
        }
        other => other?,
    };
    let heights = atoms_heights(case, atoms);
    let mut found = solve(case, atoms, (atoms.matched, &heights), hard, (folder, stage), key, listener)?;
    if case.scene.atoms.as_ref().is_some_and(|a| a.depth_error) {
        let deep = Matching { kernel: Elastic::HalfSpace, tag: "half-space", ..hard };
        let deep = solve(case, atoms, (atoms.matched, &heights), deep, (folder, stage), key, listener)?;
        found.states.iter_mut().zip(&deep.states).for_each(|(state, deep)| state.budget.extend(of_depth(state, deep)));
    }
    Ok(Matched { full, hard: found, soft: soft(case, atoms, (folder, stage), key, listener)? })
}

/// What the finite depth of a block makes of contact and mean gap: the way from the half-space, over the value.
fn of_depth(state: &StateResults, deep: &StateResults) -> [Part; 2] {
    let part = |quantity, found: f64, deep: f64| {
        let relative = Some((found / deep - 1.0).abs()).filter(|r| r.is_finite());
        Part { quantity, source: Source::Depth, relative, is_bound: false }
    };
    [
        part(Measure::ContactArea, state.contact_fraction_corrected, deep.contact_fraction_corrected),
        part(Measure::MeanGap, state.mean_gap, deep.mean_gap),
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
        wall: Wall::LennardJones(atoms.soft_wall()),
        soft: true,
        tag: "soft wall",
        threshold: even_odds_gap(atoms, CONTACT_DISTANCE_ANGSTROM) / atoms.block.length(),
        criterion: "even odds of an indenter atom within d_c",
    };
    solve(case, atoms, (atoms.matched, &atoms_heights(case, atoms)), matching, place, key, listener)
}

/// Heights that the atoms resolve, units of L, on the grid of the comparison.
fn atoms_heights(case: &Case, atoms: &AtomsCase) -> Vec<f64> {
    let length = atoms.block.length();
    atoms.heights_angstrom(&case.surface, atoms.matched).into_iter().map(|h| h / length).collect()
}

/// What is solved for the comparison, and what it calls contact.
#[derive(Clone, Copy)]
struct Matching {
    kernel: Elastic,
    wall: Wall,
    soft: bool,
    tag: &'static str,
    threshold: f64,
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
        loads: case.loads(),
        pull_off: false,
        start: None,
        gradient: case.gradient,
        p_star: &case.p_star,
        there: None,
        threshold: matching.threshold,
        criterion: matching.criterion.into(),
        keep: &|_| Keep { gap: true, stress: case.wants().distributions },
        wants: case.wants(),
    };
    load_path(asked, (folder, stage, matching.tag), key, listener)
}

/// Gap, from the wall's zero of force, at which a randomly registered atom has an indenter atom within `d_c` (Å) with even
/// odds, Å (negative: the wall pushes there already).
fn even_odds_gap(atoms: &AtomsCase, d_c: f64) -> f64 {
    atoms.wall.distance_at_touch_probability(0.5, d_c) - atoms.wall.minimum_angstrom()
}

/// What presses the bodies together, over E*: the load and the mean attraction of the hard-wall solution, which for an
/// exponential is its energy over its range.
fn squeeze(atoms: &AtomsCase, hard: &StateResults) -> f64 {
    hard.pressure + atoms.adhesion.map_or(0.0, |a| -hard.interaction_energy / a.rho)
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

    fn field(&self) -> Field<'_> {
        Field::F64(&self.0.values)
    }
}

/// The comparison at every load. `root` is the run folder that the results' file names are relative to.
pub(super) fn compare(
    case: &Case,
    atoms: &AtomsCase,
    found: &AtomsResults,
    matched: &Matched,
    root: &Path,
) -> Result<ComparisonResults> {
    let grid = atoms.matched;
    let length = atoms.block.length();
    let surface = atoms.block.surface();
    let sites = Sites::new(grid, site_positions(&surface));
    let owners = surface.onto_grid(grid.nx, grid.ny);
    let (mut loads, mut sections) = (Vec::new(), Vec::new());
    for (i, state) in found.states.iter().enumerate() {
        let (hard, soft) = (&matched.hard.states[i], &matched.soft.states[i]);
        let (hard_gap, soft_gap) = (Stored::read(root, hard.gap.as_ref())?, Stored::read(root, soft.gap.as_ref())?);
        let per_site = |what: &str| root.join(state.contact_map.replace("contact.npy", what));
        let touching: Vec<bool> =
            npy::read_flags(&per_site("site-contact.npy"))?.values.iter().map(|v| *v != 0).collect();
        let site_gap = npy::read(&per_site("site-gap.npy"))?.values;
        let (hard_shares, soft_shares) = (Shares::of(&hard_gap), Shares::of(&soft_gap));
        let squeezed = squeeze(atoms, hard) * atoms.modulus_gpa / GPA_PER_EV_A3;
        let share = |threshold: f64| hard_shares.up_to(threshold / length);
        let threshold_at = |d_c: f64| softness_threshold(&atoms.wall, d_c, squeezed, share);
        let threshold = threshold_at(CONTACT_DISTANCE_ANGSTROM);
        let even_odds = even_odds_gap(atoms, CONTACT_DISTANCE_ANGSTROM) / length;
        let continuum = vec![
            sites.judge(hard_gap.field(), 0.0, &touching, Criteria::Plain, length),
            sites.judge(hard_gap.field(), threshold / length, &touching, Criteria::Threshold, length),
            sites.judge(soft_gap.field(), even_odds, &touching, Criteria::SoftWall, length),
        ];
        // Read at the sites, as the atoms are.
        let site_share = |gap: Field, threshold: f64| {
            let touching = sites.touching(gap, threshold / length);
            touching.iter().filter(|t| **t).count() as f64 / touching.len() as f64
        };
        let against_distance = state.sensitivity.iter().map(|&[d, fraction]| {
            let soft = site_share(soft_gap.field(), even_odds_gap(atoms, d));
            [d, fraction, site_share(hard_gap.field(), threshold_at(d)), soft]
        });
        let against_gap = state.sensitivity.iter().map(|&[d, _]| {
            let gap = d - atoms.wall.minimum_angstrom();
            [gap, share(gap), soft_shares.up_to(gap / length)]
        });
        let sides = sides(case, atoms, matched, (i, state), (&sites, threshold, even_odds), root)?;
        let atoms_map = npy::read_flags(&root.join(&state.contact_map))?.values;
        // At the atoms' resolution: a finer map would have more and smaller patches.
        let soft_flags: Vec<u8> = sites.touching(soft_gap.field(), even_odds).iter().map(|t| u8::from(*t)).collect();
        let soft_map: Vec<u8> = onto_grid(&soft_flags, &owners);
        let soft_sites = sites.sample(soft_gap.field());
        let open: Vec<f64> = (0..touching.len())
            .filter(|&s| !touching[s] && soft_sites[s] > even_odds)
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
            continuum_mean_gap_angstrom: hard.mean_gap * length,
            soft_mean_gap_angstrom: soft.mean_gap * length,
            atoms_patches: patch_sizes(&atoms_map, grid.nx, Connectivity::Eight).len(),
            continuum_patches: patch_sizes(&soft_map, grid.nx, Connectivity::Eight).len(),
            gap_rms_difference_angstrom: rms,
            versions: versions(sides, (grid, &owners), hard.pressure * atoms.modulus_gpa, length),
            against_distance: against_distance.collect(),
            against_gap: against_gap.collect(),
        });
        let column = column_at(grid, SECTION);
        let atoms_gap = Stored::read(root, Some(&state.gap_map))?;
        let line = |field: Field, scale: f64| along_y(grid, field, column).iter().map(|p| p.1 * scale).collect();
        sections.push(Section {
            p_star: state.p_star,
            y: (0..grid.ny).map(|j| j as f64 * grid.dy() / grid.lx).collect(),
            atoms_gap_angstrom: line(atoms_gap.field(), 1.0),
            hard_gap_angstrom: line(hard_gap.field(), length),
            soft_gap_angstrom: line(soft_gap.field(), length),
            full_gap_angstrom: match &matched.full {
                Some(full) => full_section(case.grid, &Stored::read(root, full.states[i].gap.as_ref())?, grid, length),
                None => Vec::new(),
            },
        });
    }
    let findings = findings(case, atoms, found, matched, &loads);
    let full = matched.full.clone();
    Ok(ComparisonResults { full, hard: matched.hard.clone(), soft: matched.soft.clone(), loads, sections, findings })
}

/// The gap of the full heights along the section, at the nodes of the comparison grid, Å.
fn full_section(own: Grid, gap: &Stored, grid: Grid, length: f64) -> Vec<f64> {
    let at = |j: usize| bilinear(own, |k| gap.field().at(k), SECTION, j as f64 * grid.dy()) * length;
    (0..grid.ny).map(at).collect()
}

/// Every version of the problem at the load `i`. Versions whose stress was not kept (run folders of an earlier version) are
/// left out.
fn sides(
    case: &Case,
    atoms: &AtomsCase,
    matched: &Matched,
    (i, state): (usize, &AtomState),
    (sites, threshold, even_odds): (&Sites, f64, f64),
    root: &Path,
) -> Result<Vec<Side>> {
    let units = Units {
        length_angstrom: atoms.block.length(),
        modulus_gpa: atoms.modulus_gpa,
        width_angstrom: atoms.stress_width_angstrom,
    };
    let mut list = Vec::new();
    let fine = Sites::new(case.grid, site_positions(&atoms.block.surface()));
    let (hard, soft) = (threshold / units.length_angstrom, even_odds);
    let below = |wall: &str, gap: f64| format!("{wall} wall, gap below {gap:.3} Å");
    let zero = || "hard wall, zero gap".to_string();
    let criteria = [
        (matched.full.as_ref(), &fine, case.grid, vec![("full heights", zero(), 0.0)]),
        (
            Some(&matched.hard),
            sites,
            atoms.matched,
            vec![("hard wall", zero(), 0.0), ("matched", below("hard", threshold), hard)],
        ),
        (
            Some(&matched.soft),
            sites,
            atoms.matched,
            vec![("soft wall", below("soft", soft * units.length_angstrom), soft)],
        ),
    ];
    for (of, sites, grid, criteria) in criteria {
        let Some(found) = of.map(|c| &c.states[i]).filter(|s| s.stress.is_some()) else { continue };
        let (gap, stress) = (Stored::read(root, found.gap.as_ref())?, Stored::read(root, found.stress.as_ref())?);
        let solved = Solved { sites, grid, gap: gap.field(), stress: stress.field(), mean_gap: found.mean_gap };
        let smooth = solved.smooth(units);
        for (id, criterion, at) in criteria {
            list.push(solved.side(id, criterion, at, smooth.clone(), units));
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

fn below_surface(p: &PlasticityResults) -> String {
    match p.first_yield {
        None => {
            format!("Nor has the crystal slipped below it: at no step have more than {} atoms left its order.", p.noise)
        }
        Some(load) => {
            format!("Below it the crystal first yields at p* = {load:.4}: from there on elasticity is not its law.")
        }
    }
}

/// Deviation of the matched area up to which the criterion is said to explain the difference.
const EXPLAINED: f64 = 0.15;

fn explanation(plain: f64, matched: f64) -> &'static str {
    if matched.abs() > EXPLAINED {
        "Matching the criterion leaves a difference: here the mechanics differ, too"
    } else if matched.abs() < 0.5 * plain.abs() {
        "Most of the difference is the criterion, not the mechanics"
    } else {
        "The difference is small under either criterion"
    }
}

/// Share of contact atoms from below the surface layer from which material is said to have flowed.
const FLOWED: f64 = 0.02;

/// Why atoms and continuum differ, in sentences with their numbers.
fn findings(
    case: &Case,
    atoms: &AtomsCase,
    found: &AtomsResults,
    matched: &Matched,
    loads: &[LoadComparison],
) -> Vec<String> {
    let mut list = Vec::new();
    // A true minus sign, as everywhere in the report.
    let percent = |x: f64| format!("{:.1} %", 100.0 * x).replace('-', "−");
    for (load, state) in loads.iter().zip(&matched.hard.states) {
        let [plain, threshold, soft] = &load.continuum[..] else { continue };
        let stress = squeeze(atoms, state) * atoms.modulus_gpa / threshold.contact_fraction.max(f64::MIN_POSITIVE);
        let deviation = |c: f64| percent(load.atoms.contact_fraction / c - 1.0);
        let matched_deviation = load.atoms.contact_fraction / threshold.contact_fraction - 1.0;
        list.push(format!(
            "p* = {}: {} of the surface atoms touch. A hard wall at zero gap has {} (the atoms deviate by {}). The \
             Lennard-Jones wall gives way by {:.2} Å under the mean stress of {:.1} GPa on what touches; counting gaps \
             below {:.2} Å the hard wall has {} (deviation {}), κ = {:.2} against {:.2} for a shifted map. {}. With the \
             atoms' own wall law the continuum has {} (deviation {}).",
            load.p_star,
            percent(load.atoms.contact_fraction),
            percent(plain.contact_fraction),
            deviation(plain.contact_fraction),
            atoms.wall.minimum_angstrom() - atoms.wall.distance_at_pressure(stress / GPA_PER_EV_A3),
            stress,
            threshold.threshold_angstrom,
            percent(threshold.contact_fraction),
            percent(matched_deviation),
            threshold.overlap.kappa,
            threshold.shifted.kappa,
            explanation(load.atoms.contact_fraction / plain.contact_fraction - 1.0, matched_deviation),
            percent(soft.contact_fraction),
            deviation(soft.contact_fraction),
        ));
        if load.registration != [0, 0] {
            list.push(format!(
                "p* = {}: the atoms' contact map fits best when shifted by {:?} of {} nodes; the maps should need no shift.",
                load.p_star, load.registration, atoms.matched.nx
            ));
        }
    }
    list.push(yield_finding(&found.states, found.plasticity.as_ref()));
    let slab = atoms.kernel().stiffness(std::f64::consts::TAU, 0.0) / std::f64::consts::PI;
    list.push(format!(
        "The block is {:.1} Å deep on a rigid base, which makes the longest wave {slab:.2} times stiffer than on a \
         half-space; the continuum compared here has a layer of the same depth, with isotropic constants in place of the \
         crystal's cubic ones.",
        atoms.block.thickness()
    ));
    if atoms.resolved_gradient < 0.999 * case.gradient {
        list.push(format!(
            "Both see the profile low-passed at {:.1} Å, with a resolved rms gradient of {:.3} instead of {}.",
            atoms.low_pass * atoms.block.length(),
            atoms.resolved_gradient,
            case.gradient
        ));
    }
    list
}

fn yield_finding(states: &[AtomState], plasticity: Option<&PlasticityResults>) -> String {
    let flowed = states.iter().find(|s| s.contacts_below_surface as f64 > FLOWED * s.contacts.max(1) as f64);
    let hardest = states.iter().map(|s| s.contact_stress_gpa).fold(0.0, f64::max);
    match flowed {
        Some(s) => format!(
            "Material has flowed at p* = {}: {} of {} contact atoms did not start in the surface layer. From there on the \
             atoms' area is that of a plastic contact, which no elastic continuum follows.",
            s.p_star, s.contacts_below_surface, s.contacts
        ),
        None => format!(
            "Contact atoms come from the surface layer (but for at most {} %), at a mean stress over their area of up to \
             {hardest:.1} GPa: no sign that material has flowed at the surface. {}",
            100.0 * FLOWED,
            match plasticity {
                None => "Slip below it is not looked for.".to_string(),
                Some(p) => below_surface(p),
            }
        ),
    }
}

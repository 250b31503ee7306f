//! Comparison of atoms and continuum at each load: contact by each criterion, gaps, stresses and sections.

use super::atomistic::site_positions;
use super::findings::{effective_pressure, findings};
use super::matched::{Matched, reduced};
use super::probe_atoms::{ProbeAtoms, Profile, map_name, share, within};
use super::versions::{Side, Solved, Units, versions};
use crate::atoms::contact::onto_grid;
use crate::atoms::wall::CONTACT_DISTANCE_ANGSTROM;
use crate::compare::{SiteCriterion, Sites, registration};
use crate::grid::{Field, Grid, bilinear, mean};
use crate::observe::{Connectivity, along_y, column_at, patch_sizes};
use crate::record::npy;
use crate::record::results::{
    AtomState, AtomsResults, ComparisonResults, CriterionArea, CriterionMatch, LoadComparison, Section,
};
use crate::scene::{AtomsCase, Case};
use crate::units::GPA_PER_EV_A3;
use crate::{Error, Result};
use std::path::Path;

/// Position of the section in x, as a fraction of the cell length.
const SECTION: f64 = 0.5;

/// A stored field of the run folder.
struct Stored(npy::Field<f64>);

/// Sorted gaps, for the fraction of nodes with a gap up to any threshold.
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

    /// The gap relative to other heights; `higher`: their height above the present ones, in the units of the gap.
    fn over(mut self, higher: &[f64]) -> Stored {
        self.0.values.iter_mut().zip(higher).for_each(|(g, h)| *g += h);
        self
    }

    fn field(&self) -> Field<'_> {
        Field::F64(&self.0.values)
    }
}

/// Compares atoms and continuum at every load. File names in the results are relative to the run folder `root`; contact
/// maps are written into its subfolder `stage`.
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
        // At the resolution of the surface sites: a finer map would have more and smaller patches.
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

/// Height of the atoms' profile above the profile dilated by a ball, units of L, on the comparison grid.
fn bridged(case: &Case, atoms: &AtomsCase) -> Vec<f64> {
    let (own, felt) =
        (atoms.heights_angstrom(&case.surface, atoms.matched), atoms.dilated_heights_angstrom(&case.surface));
    reduced(atoms, own.iter().zip(felt).map(|(own, felt)| own - felt).collect())
}

/// Gap of the full-heights solution along the section, at the nodes of the comparison grid, Å.
fn full_section(own: Grid, gap: &Stored, grid: Grid, length: f64) -> Vec<f64> {
    let at = |j: usize| bilinear(own, |k| gap.field().at(k), SECTION, j as f64 * grid.dy()) * length;
    (0..grid.ny).map(at).collect()
}

/// Continuum solutions of one load at the surface sites of the block.
struct Solutions<'a> {
    /// Surface sites on the scene's grid, and on the comparison grid.
    sites: [&'a Sites; 2],
    /// Sites in contact: with the offset wall, and with the compliant wall.
    touching: [&'a [bool]; 2],
    /// Offset of the offset wall, Å.
    rise: f64,
    /// Height of the atoms' profile above the dilated profile, units of L. Added to gaps of the compliant wall, so that
    /// these refer to the atoms' profile as the gaps of the atoms do.
    bridged: &'a [f64],
}

/// Every step of the model chain at the load `i`. Solutions without a stored stress are omitted.
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

//! Comparison of atoms and continuum at each load: contact by each criterion, gaps, stresses and sections.

use super::atomistic::site_positions;
use super::findings::{effective_pressure_gpa, findings};
use super::matched::{Matched, reduced};
use super::probe_atoms::{ProbeAtoms, Profile, map_name, share, within};
use super::versions::{AtomUnits, Side, Solved, versions};
use crate::compare::{SiteCriterion, SitesOnGrid, registration};
use crate::record::results::{ComparisonResults, CriterionArea, CriterionMatch, GapSection, LoadComparison};
use crate::scene::{AtomsCase, Case};
use crate::{Error, Result};
use asperity_atoms::block::SurfaceSites;
use asperity_atoms::contact::onto_grid;
use asperity_atoms::results::{AtomState, AtomsResults};
use asperity_contact::observe::{along_y, column_at};
use asperity_contact::results::ContinuumResults;
use asperity_grid::units::{ANGSTROM_M, GPA_PER_EV_A3};
use asperity_grid::{Field, Grid, bilinear, mean};
use asperity_surface::files::atomic_file::create_folder;
use asperity_surface::files::npy;
use std::path::Path;

/// Position of the section in x, as a fraction of the cell length.
const SECTION: f64 = 0.5;

/// A stored field of the run folder.
struct StoredField(npy::NpyMap<f64>);

/// Sorted gaps, for the fraction of nodes with a gap up to any threshold.
struct Shares(Vec<f64>);

impl Shares {
    fn of(gap: &StoredField) -> Self {
        let mut sorted = gap.0.values.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        Shares(sorted)
    }

    fn up_to(&self, threshold: f64) -> f64 {
        self.0.partition_point(|g| *g <= threshold) as f64 / self.0.len() as f64
    }
}

impl StoredField {
    fn read(root: &Path, file: Option<&str>, grid: Grid) -> Result<Self> {
        let file =
            file.ok_or_else(|| Error::format(root, "a state without its gap field", "a run that stores gaps"))?;
        Ok(StoredField(npy::read_on(&root.join(file), [grid.nx, grid.ny])?))
    }

    /// The gap relative to other heights; `higher`: their height above the present ones, in the units of the gap.
    fn over(mut self, higher: &[f64]) -> StoredField {
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
    atoms_results: &AtomsResults,
    matched: &Matched,
    root: &Path,
    stage: &str,
) -> Result<ComparisonResults> {
    let folder = root.join(stage);
    create_folder(&folder)?;
    let surface = atoms.block.surface();
    let length = atoms.block.length();
    let nearest = |x: f64, y: f64| surface.nearest(x * length, y * length);
    let sites = SitesOnGrid::new(atoms.matched, site_positions(&surface), nearest);
    let comparison = Comparison {
        case,
        atoms,
        matched,
        root,
        stage,
        grid: atoms.matched,
        length,
        surface,
        owners: surface.onto_grid(atoms.matched.nx, atoms.matched.ny),
        probes: ProbeAtoms::new(case, atoms, &sites)?,
        sites: &sites,
        fine_sites: SitesOnGrid::new(case.model.grid, site_positions(&surface), nearest),
        dilation: dilation(case, atoms),
    };
    let walls = [Some(&matched.hard), Some(&matched.compliant), matched.yielding.as_ref(), matched.full.as_ref()];
    let count = atoms_results.states.len();
    if let Some(wall) = walls.into_iter().flatten().find(|wall| wall.states.len() < count) {
        let found = format!("{} states of a wall and {count} of the atoms", wall.states.len());
        return Err(Error::format(root, found, "a state of every wall for each of the atoms"));
    }
    let (mut loads, mut sections) = (Vec::new(), Vec::new());
    for (i, state) in atoms_results.states.iter().enumerate() {
        let gaps = comparison.gaps(i)?;
        loads.push(comparison.load(i, state, &gaps)?);
        sections.push(comparison.section(i, state, &gaps)?);
    }
    let findings = findings(case, atoms, atoms_results, matched, &loads);
    Ok(ComparisonResults {
        full_heights: matched.full.clone(),
        hard_wall: matched.hard.clone(),
        compliant_wall: matched.compliant.clone(),
        yielding_wall: matched.yielding.clone(),
        loads,
        sections,
        findings,
    })
}

/// What the comparisons of all loads share.
struct Comparison<'a> {
    case: &'a Case,
    atoms: &'a AtomsCase,
    matched: &'a Matched,
    root: &'a Path,
    stage: &'a str,
    /// The comparison grid.
    grid: Grid,
    /// Length of the block, Å.
    length: f64,
    surface: SurfaceSites,
    /// Surface site of each node of the grid.
    owners: Vec<usize>,
    probes: ProbeAtoms<'a>,
    /// Surface sites on the comparison grid, and on the scene's grid.
    sites: &'a SitesOnGrid,
    fine_sites: SitesOnGrid,
    /// Height of the atoms' profile above the dilated profile, units of L. Added to gaps of the compliant wall, so that
    /// these refer to the atoms' profile as the gaps of the atoms do.
    dilation: Vec<f64>,
}

/// Gaps of the walls at one load, units of L.
struct WallGaps {
    hard: StoredField,
    /// Of the compliant wall, over the atoms' heights and over the dilated heights on which it was solved.
    compliant: StoredField,
    compliant_dilated: StoredField,
    /// The same two of the compliant wall with hardness.
    yielding: Option<[StoredField; 2]>,
}

/// Contact of the walls' surface sites at a contact distance.
struct WallContacts {
    offset: Vec<bool>,
    /// Offset of the offset wall, Å.
    offset_angstrom: f64,
    compliant: Vec<bool>,
    yielding: Option<Vec<bool>>,
}

impl Comparison<'_> {
    fn gaps(&self, i: usize) -> Result<WallGaps> {
        let read = |wall: &ContinuumResults| StoredField::read(self.root, wall.states[i].gap_file(), self.grid);
        Ok(WallGaps {
            hard: read(&self.matched.hard)?,
            compliant: read(&self.matched.compliant)?.over(&self.dilation),
            compliant_dilated: read(&self.matched.compliant)?,
            yielding: match &self.matched.yielding {
                Some(wall) => Some([read(wall)?.over(&self.dilation), read(wall)?]),
                None => None,
            },
        })
    }

    /// Contact by the atoms' criterion with the contact distance `distance`, Å.
    fn contacts(&self, i: usize, gaps: &WallGaps, distance: f64) -> WallContacts {
        let hard = &self.matched.hard.states[i];
        let effective_pressure = effective_pressure_gpa(self.atoms, hard) / GPA_PER_EV_A3;
        let clear = self.probes.clearances((Profile::Own, gaps.hard.field()), distance);
        let offset_angstrom = self.probes.rise(&clear, effective_pressure);
        let compliant = |dilated: Field| {
            let unpressed = self.probes.unpressed(dilated);
            within(&self.probes.clearances((Profile::Dilated, dilated), distance), |site| unpressed[site])
        };
        WallContacts {
            offset: within(&clear, |_| offset_angstrom),
            offset_angstrom,
            compliant: compliant(gaps.compliant_dilated.field()),
            yielding: gaps.yielding.as_ref().map(|[_, dilated]| compliant(dilated.field())),
        }
    }

    /// The comparison at load `i`. Writes the gap of the compliant wall and the contact maps of the walls.
    fn load(&self, i: usize, state: &AtomState, gaps: &WallGaps) -> Result<LoadComparison> {
        let (grid, length, hard) = (self.grid, self.length, &self.matched.hard.states[i]);
        let compliant_wall_gap = format!("{}/{}", self.stage, map_name(i + 1, "compliant wall gap"));
        npy::write(&self.root.join(&compliant_wall_gap), grid.nx, grid.ny, gaps.compliant.0.values.iter().copied())?;
        let touching = self.atoms_contact(state)?;
        let contacts = self.contacts(i, gaps, self.atoms.wall.repulsion.contact_distance_angstrom);
        let atoms_map = npy::read_flags_on(&self.root.join(&state.contact_map), [grid.nx, grid.ny])?;
        // At the resolution of the surface sites, as that of the atoms.
        let compliant_map: Vec<u8> = self.owners.iter().map(|&site| u8::from(contacts.compliant[site])).collect();
        let model_chain = versions(self.sides(i, state, &contacts)?, &self.surface, hard.pressure / 1e9);
        let (hard_shares, compliant_shares) = (Shares::of(&gaps.hard), Shares::of(&gaps.compliant_dilated));
        let area_vs_distance = state.sensitivity.iter().map(|&[d, fraction]| {
            let at_distance = self.contacts(i, gaps, d);
            [d, fraction, share(&at_distance.offset), share(&at_distance.compliant)]
        });
        let area_vs_gap = state.sensitivity.iter().map(|&[d, _]| {
            let gap = (d - self.atoms.wall.minimum_angstrom()) / length;
            [gap * length, hard_shares.up_to(gap), compliant_shares.up_to(gap)]
        });
        Ok(LoadComparison {
            p_star: state.p_star,
            registration: registration(grid, &atoms_map, &compliant_map),
            atoms: CriterionArea { criterion: self.atoms.contact_criterion(), contact_area: state.contact_area },
            continuum: self.criteria(i, gaps, &contacts, &touching)?,
            atoms_mean_gap_angstrom: state.mean_gap_angstrom,
            hard_wall_mean_gap_angstrom: hard.mean_gap.unwrap_or(f64::NAN) / ANGSTROM_M,
            compliant_wall_mean_gap_angstrom: mean(&gaps.compliant.0.values) * length,
            yielding_wall_mean_gap_angstrom: gaps.yielding.as_ref().map(|[gap, _]| mean(&gap.0.values) * length),
            atoms_clusters: self.surface.cluster_sizes(&touching).len(),
            compliant_wall_clusters: self.surface.cluster_sizes(&contacts.compliant).len(),
            gap_rms_difference_angstrom: self.gap_difference(state, gaps, &touching, &contacts.compliant)?,
            compliant_wall_gap,
            model_chain,
            area_vs_distance: area_vs_distance.collect(),
            area_vs_gap: area_vs_gap.collect(),
        })
    }

    /// Agreement of each wall's contact with that of the atoms (`touching`).
    fn criteria(
        &self,
        i: usize,
        gaps: &WallGaps,
        contacts: &WallContacts,
        touching: &[bool],
    ) -> Result<Vec<CriterionMatch>> {
        let compare = |(criterion, flags): (SiteCriterion, &[bool])| -> Result<CriterionMatch> {
            let name = format!("{}/{}", self.stage, map_name(i + 1, criterion.id()));
            let flags_on_grid: Vec<u8> = flags.iter().map(|t| u8::from(*t)).collect();
            let map = onto_grid(&flags_on_grid, &self.owners);
            npy::write(&self.root.join(&name), self.grid.nx, self.grid.ny, map)?;
            Ok(self.sites.compare(flags, touching, criterion, Some(name)))
        };
        let hard = self.sites.touching(gaps.hard.field(), 0.0);
        let walls: [(SiteCriterion, &[bool]); 3] = [
            (SiteCriterion::HardWall, &hard),
            (SiteCriterion::OffsetWall(contacts.offset_angstrom), &contacts.offset),
            (SiteCriterion::CompliantWall, &contacts.compliant),
        ];
        let yielding = contacts.yielding.iter().map(|flags| (SiteCriterion::YieldingWall, flags.as_slice()));
        walls.into_iter().chain(yielding).map(compare).collect()
    }

    /// rms difference of the gaps of atoms and compliant wall outside both contacts, Å; `None` where every site is in one.
    fn gap_difference(
        &self,
        state: &AtomState,
        gaps: &WallGaps,
        touching: &[bool],
        compliant: &[bool],
    ) -> Result<Option<f64>> {
        let atoms = self.atoms_gap(state)?;
        let wall = self.sites.sample(gaps.compliant.field());
        let open = (0..touching.len()).filter(|&s| !touching[s] && !compliant[s]);
        let differences: Vec<f64> = open.map(|s| atoms[s] - wall[s] * self.length).collect();
        let mean_square = differences.iter().map(|d| d * d).sum::<f64>() / differences.len() as f64;
        Ok((!differences.is_empty()).then(|| mean_square.sqrt()))
    }

    /// Gaps along y in the middle of the cell.
    fn section(&self, i: usize, state: &AtomState, gaps: &WallGaps) -> Result<GapSection> {
        let (grid, length) = (self.grid, self.length);
        let column = column_at(grid, SECTION);
        let atoms_gap = StoredField::read(self.root, Some(state.gap_map.as_str()), grid)?;
        let line =
            |gap: &StoredField, scale: f64| along_y(grid, gap.field(), column).iter().map(|p| p.1 * scale).collect();
        let full_heights_gap_angstrom = match &self.matched.full {
            Some(full) => {
                let gap = StoredField::read(self.root, full.states[i].gap_file(), self.case.model.grid)?;
                let gap_at =
                    |j: usize| bilinear(self.case.model.grid, |k| gap.field().at(k), SECTION, j as f64 * grid.dy());
                (0..grid.ny).map(|j| gap_at(j) * length).collect()
            }
            None => Vec::new(),
        };
        Ok(GapSection {
            p_star: state.p_star,
            y: (0..grid.ny).map(|j| j as f64 * grid.dy() / grid.lx).collect(),
            atoms_gap_angstrom: line(&atoms_gap, 1.0),
            hard_wall_gap_angstrom: line(&gaps.hard, length),
            compliant_wall_gap_angstrom: line(&gaps.compliant, length),
            full_heights_gap_angstrom,
        })
    }

    /// Every step of the model chain at load `i`. Solutions without a stored stress are omitted.
    fn sides(&self, i: usize, state: &AtomState, contacts: &WallContacts) -> Result<Vec<Side>> {
        let units = AtomUnits {
            length_angstrom: self.length,
            modulus_gpa: self.atoms.modulus_gpa,
            width_angstrom: self.atoms.stress_width_angstrom,
        };
        let offset = SiteCriterion::OffsetWall(contacts.offset_angstrom);
        let hard = vec![
            ("hard_wall", SiteCriterion::HardWall, None),
            ("offset_wall", offset, Some(contacts.offset.as_slice())),
        ];
        let compliant = vec![("compliant_wall", SiteCriterion::CompliantWall, Some(contacts.compliant.as_slice()))];
        let yielding = vec![("yielding_wall", SiteCriterion::YieldingWall, contacts.yielding.as_deref())];
        let full = vec![("full_heights", SiteCriterion::HardWall, None)];
        let solutions = [
            (self.matched.full.as_ref(), &self.fine_sites, self.case.model.grid, None, full),
            (Some(&self.matched.hard), self.sites, self.grid, None, hard),
            (Some(&self.matched.compliant), self.sites, self.grid, Some(&self.dilation), compliant),
            (self.matched.yielding.as_ref(), self.sites, self.grid, Some(&self.dilation), yielding),
        ];
        let mut list = Vec::new();
        for (solution, sites, grid, dilation, criteria) in solutions {
            let state = solution.map(|c| &c.states[i]).filter(|s| s.stress_map.is_some());
            let Some(numbers) = state else { continue };
            let gap = StoredField::read(self.root, numbers.gap_file(), grid)?;
            let gap = match dilation {
                Some(by) => gap.over(by),
                None => gap,
            };
            let stress = StoredField::read(self.root, numbers.stress_file(), grid)?;
            let mean_gap = mean(&gap.0.values);
            let solved = Solved { sites, grid, gap: gap.field(), stress: stress.field(), mean_gap };
            let smooth = solved.smooth(units);
            for (id, criterion, touching) in criteria {
                let touching = touching.map_or_else(|| sites.touching(gap.field(), 0.0), <[bool]>::to_vec);
                list.push(solved.side(id, criterion.label(), touching, smooth.clone(), units));
            }
        }
        if let Some(stress) = &state.stress {
            list.push(Side {
                id: "atoms",
                criterion: self.atoms.contact_criterion(),
                touching: self.atoms_contact(state)?,
                gap: self.atoms_gap(state)?,
                mean_gap_angstrom: state.mean_gap_angstrom,
                stress: npy::read_on(&self.root.join(&stress.map), [self.grid.nx, self.grid.ny])?.values,
            });
        }
        Ok(list)
    }

    /// Contact flag of the atoms per surface site.
    fn atoms_contact(&self, state: &AtomState) -> Result<Vec<bool>> {
        let flags = npy::read_flags_on(&self.root.join(state.per_site("contact")), [self.surface.len(), 1])?;
        Ok(flags.iter().map(|v| *v != 0).collect())
    }

    /// Gap of the atoms per surface site, Å.
    fn atoms_gap(&self, state: &AtomState) -> Result<Vec<f64>> {
        Ok(npy::read_on(&self.root.join(state.per_site("gap")), [self.surface.len(), 1])?.values)
    }
}

/// Height of the atoms' profile above the profile dilated by a ball, units of L, on the comparison grid.
fn dilation(case: &Case, atoms: &AtomsCase) -> Vec<f64> {
    let own = atoms.heights_angstrom(case.surface(), atoms.matched);
    let dilated = atoms.dilated_heights_angstrom(case.surface());
    reduced(atoms, own.iter().zip(dilated).map(|(own, dilated)| own - dilated).collect())
}

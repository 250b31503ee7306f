//! Analysis of frames at one load: contact by each criterion, gap, stress field, and maps on the comparison grid.

use crate::Result;
use crate::record::xyz;
use crate::scene::{AtomsCase, Case};
use asperity_atoms::contact::{ContactAtoms, contact_by, gaps, mean, onto_grid};
use asperity_atoms::dump::DumpFrame;
use asperity_atoms::forces::{IndenterForces, indenter_forces, lowered_to};
use asperity_atoms::indenter::Indenter;
use asperity_atoms::interaction::Interaction;
use asperity_atoms::load_history::Between;
use asperity_atoms::results::{AtomState, AtomStress, ContactByCriterion};
use asperity_atoms::voronoi;
use asperity_contact::load::LoadStep;
use asperity_grid::units::GPA_PER_EV_A3;
use asperity_grid::{Grid, bilinear, spread};
use asperity_surface::files::npy;
use std::path::Path;

/// Contact distances d_c of the sensitivity curve: first and last over r_m (the distance at which the repulsion
/// begins), and number.
const DISTANCES: (f64, f64, usize) = (0.95, 1.1, 15);

/// Interaction of indenter atoms with block atoms.
pub(super) fn interaction(atoms: &AtomsCase) -> Interaction {
    Interaction {
        epsilon_ev: atoms.wall.repulsion.epsilon_ev,
        sigma_angstrom: atoms.wall.repulsion.sigma_angstrom,
        adhesion: atoms.adhesion.map(|a| a.pair),
    }
}

/// Analyses frames of a block and its indenter, and writes maps and frames into `folder`.
pub(super) struct FrameAnalyzer<'a> {
    atoms: &'a AtomsCase,
    pub indenter: Indenter,
    interaction: Interaction,
    owners: Vec<usize>,
    fine: Vec<f64>,
    folder: &'a Path,
    /// Name of the stage; prefix of the file names in the results.
    stage: &'a str,
}

impl<'a> FrameAnalyzer<'a> {
    pub(super) fn new(case: &Case, atoms: &'a AtomsCase, folder: &'a Path, stage: &'a str) -> Result<Self> {
        let points = Grid::unit(atoms.points, atoms.points);
        let heights = atoms.heights_angstrom(case.surface(), points);
        Ok(FrameAnalyzer {
            atoms,
            indenter: Indenter::above(&atoms.block, atoms.points, heights, atoms.wall.minimum_angstrom())?,
            interaction: interaction(atoms),
            owners: atoms.block.surface().onto_grid(atoms.matched.nx, atoms.matched.ny),
            fine: atoms.heights_angstrom(case.surface(), atoms.matched),
            folder,
            stage,
        })
    }

    /// Gap of each surface site, Å, in a thermally expanded cell. `expansion`: linear expansion factor. `bounds`: lower
    /// and upper bound of the cell in x and y, Å. `positions`: atoms of the sites, Å, not wrapped. `low`: height of the
    /// lowest indenter atom, Å.
    pub(super) fn gaps_expanded(
        &self,
        (expansion, bounds): (f64, [[f64; 2]; 2]),
        positions: &[[f64; 3]],
        low: f64,
    ) -> Vec<f64> {
        let lowest = self.indenter.heights().iter().copied().fold(f64::INFINITY, f64::min);
        let zero = self.fine[0] - self.indenter.heights()[0] + lowest;
        let over = |c: f64, [from, to]: [f64; 2]| ((c - from) / (to - from)).rem_euclid(1.0);
        let gap = |&[x, y, z]: &[f64; 3]| {
            let profile = bilinear(self.atoms.matched, |k| self.fine[k], over(x, bounds[0]), over(y, bounds[1])) - zero;
            low + expansion * profile - z - self.atoms.wall.minimum_angstrom()
        };
        positions.iter().map(gap).collect()
    }

    /// Writes values per surface site as a map on the comparison grid (`map`) and as a list (`list`). Returns both file
    /// names.
    pub(super) fn write_sites(&self, values: &[f64], map: &str, list: &str) -> Result<[String; 2]> {
        let (nx, ny) = (self.atoms.matched.nx, self.atoms.matched.ny);
        npy::write(&self.folder.join(map), nx, ny, onto_grid(values, &self.owners))?;
        npy::write(&self.folder.join(list), values.len(), 1, values.iter().copied())?;
        Ok([map, list].map(|name| format!("{}/{name}", self.stage)))
    }

    /// Analyses the state at a load, and writes its maps and its frame.
    pub(super) fn state(&self, step: &LoadStep, between: &Between) -> Result<AtomState> {
        let (atoms, frame) = (self.atoms, &between.frame);
        let (sites, touch) = (atoms.block.surface(), atoms.wall.minimum_angstrom());
        let (p_star, force) = (step.imposed_p_star(), atoms.load(step));
        let down = lowered_to(frame, &self.indenter, between.displacement_angstrom, &self.interaction, force)?;
        let d_c = atoms.wall.repulsion.contact_distance_angstrom;
        let forces = indenter_forces(frame, &self.indenter, down, &self.interaction, d_c.max(DISTANCES.1 * touch));
        let near = |distance: f64| contact_by(frame, &sites, |k| forces.nearest[k] < distance);
        let touching = near(d_c);
        // Each grid has its zero at its own lowest node; `offset` is the difference. The height of the indenter is that
        // of its atoms. Between nodes its profile is interpolated on a grid with 16 nodes per shortest wavelength; the
        // error is a hundredth of that wave's amplitude.
        let (length, offset) = (sites.length(), self.fine[0] - self.indenter.heights()[0]);
        let profile = |x: f64, y: f64| bilinear(atoms.matched, |k| self.fine[k], x / length, y / length);
        let gap = gaps(frame, &sites, |x, y| self.indenter.start_z() - down + profile(x, y) - offset, touch)?;
        let stress = self.stress(frame, &forces);
        let flags: Vec<u8> = touching.sites.iter().map(|t| u8::from(*t)).collect();
        let (nx, ny) = (atoms.matched.nx, atoms.matched.ny);
        let name = |description: &str, end: &str| format!("load-{}-{description}.{end}", step.number());
        let path = |description: &str, end: &str| self.folder.join(name(description, end));
        let in_stage = |description: &str, end: &str| format!("{}/{}", self.stage, name(description, end));
        npy::write(&path("contact", "npy"), nx, ny, onto_grid(&flags, &self.owners))?;
        npy::write(&path("gap", "npy"), nx, ny, onto_grid(&gap, &self.owners))?;
        npy::write(&path("stress", "npy"), nx, ny, stress.iter().copied())?;
        npy::write(&path("site-contact", "npy"), flags.len(), 1, flags.iter().copied())?;
        npy::write(&path("site-gap", "npy"), gap.len(), 1, gap.iter().copied())?;
        write_frame(&path("frame", "xyz"), frame, &self.indenter, down, &touching.ids, (&atoms.element, p_star))?;
        let contacts = touching.ids.len();
        let area_per_atom = length.powi(2) / sites.len() as f64;
        let (from, to, n) = DISTANCES;
        let distances = (0..n).map(|k| touch * (from + (to - from) * k as f64 / (n - 1) as f64));
        Ok(AtomState {
            index: step.index,
            branch: step.branch,
            p_star,
            contact_area: touching.fraction(),
            contacts,
            contacts_below_surface: touching.below_surface,
            mean_gap_angstrom: mean(&gap),
            contact_stress_gpa: if contacts == 0 {
                0.0
            } else {
                force / (contacts as f64 * area_per_atom) * GPA_PER_EV_A3
            },
            contact_map: in_stage("contact", "npy"),
            gap_map: in_stage("gap", "npy"),
            frame: Some(in_stage("frame", "xyz")),
            indenter_shift_angstrom: down - between.displacement_angstrom,
            criteria: self.criteria(frame, &forces, &touching),
            sensitivity: distances.map(|d| [d, near(d).fraction()]).collect(),
            stress: Some(AtomStress {
                width_angstrom: atoms.stress_width_angstrom,
                load_error: mean(&stress) / GPA_PER_EV_A3 * length.powi(2) / force - 1.0,
                highest_gpa: stress.iter().copied().fold(0.0, f64::max),
                map: in_stage("stress", "npy"),
            }),
            defects: None,
        })
    }

    /// Normal stress on the comparison grid, GPa: normal forces smoothed by a Gaussian of the scene's width.
    fn stress(&self, frame: &DumpFrame, forces: &IndenterForces) -> Vec<f64> {
        let length = self.atoms.block.length();
        let forces = frame.positions.iter().zip(&forces.normal).filter(|(_, f)| **f != 0.0);
        let reduced = forces.map(|([x, y, _], f)| ([x / length, y / length], f / length.powi(2) * GPA_PER_EV_A3));
        spread(self.atoms.matched, reduced, self.atoms.stress_width_angstrom / length)
    }

    fn criteria(&self, frame: &DumpFrame, forces: &IndenterForces, touching: &ContactAtoms) -> Vec<ContactByCriterion> {
        let (sites, smallest) = (self.atoms.block.surface(), self.atoms.contact_force);
        let by = |id: &str, criterion: String, contact: &ContactAtoms| ContactByCriterion {
            id: id.into(),
            criterion,
            atoms: contact.ids.len(),
            contact_area: contact.fraction(),
        };
        let pressed = contact_by(frame, &sites, |k| forces.normal[k] > 0.0);
        let loaded = contact_by(frame, &sites, |k| forces.normal[k] > smallest);
        // Current surface: atoms of the initial surface layer, and contact atoms from below it.
        let on_top = |id: &u32| sites.index_of(*id).is_some() || touching.ids.binary_search(id).is_ok();
        let (ids, points): (Vec<u32>, Vec<[f64; 2]>) = frame
            .ids
            .iter()
            .zip(&frame.positions)
            .filter(|(id, _)| on_top(id))
            .map(|(id, [x, y, _])| (*id, [*x, *y]))
            .unzip();
        let shares = voronoi::shares(&points, sites.length());
        let area: f64 =
            ids.iter().zip(shares).filter(|(id, _)| touching.ids.binary_search(id).is_ok()).map(|p| p.1).sum();
        vec![
            by("distance", self.atoms.contact_criterion(), touching),
            by("compressed", "the indenter's normal force presses".into(), &pressed),
            by("force_threshold", format!("the indenter presses with more than {smallest} eV/Å"), &loaded),
            ContactByCriterion {
                contact_area: area / sites.length().powi(2),
                ..by("voronoi_area", "Voronoi share of the atoms within the distance".into(), touching)
            },
        ]
    }
}

/// Writes the block atoms of a frame and the indenter atoms as extended XYZ.
fn write_frame(
    path: &Path,
    frame: &DumpFrame,
    indenter: &Indenter,
    down: f64,
    touching: &[u32],
    (element, p_star): (&str, f64),
) -> Result<()> {
    let first = frame.ids.last().copied().unwrap_or(0) as u64 + 1;
    let block = frame.ids.iter().zip(&frame.positions).map(|(id, position)| xyz::Atom {
        id: u64::from(*id),
        species: element,
        position_angstrom: *position,
        contact: touching.binary_search(id).is_ok(),
        indenter: false,
    });
    let rigid = indenter.positions().enumerate().map(|(k, [x, y, z])| xyz::Atom {
        id: first + k as u64,
        species: xyz::DUMMY,
        position_angstrom: [x, y, z - down],
        contact: false,
        indenter: true,
    });
    let info = xyz::XyzHeader {
        cell_angstrom: [frame.length(0), frame.length(1), frame.length(2)],
        p_star: Some(p_star),
        atoms: frame.len() + indenter.atoms() as usize,
    };
    xyz::write(path, info, block.chain(rigid))
}

//! Flags for frames of an own LAMMPS run, and what is printed of them.

use super::output;
use crate::pipeline::{OwnLoad, OwnRun, OwnState};
use crate::report::number::{percent, significant};
use crate::scene::Case;
use crate::{Error, Result};
use asperity_atoms::own_run::BodyTypes;
use asperity_grid::units::{Dimension, Measure, Measures, Unit};

const COMMAND_LINE: &str = "command line";
const HEADING: &str =
    "A run of your own: any orthogonal box, periodic along x and y; the scene's surface extends over it";

/// Accepted contact distances, Å.
const CONTACT_DISTANCES: [f64; 2] = [0.5, 50.0];

#[derive(Debug, clap::Args)]
pub(super) struct OwnRunArgs {
    /// Height of the mean plane of the scene's surface in the dump's coordinates, Å or with a unit: one for all frames, or one for each,
    /// separated by commas. For an indenter that is no atoms, such as a potential.
    #[arg(long, value_name = "Z", allow_hyphen_values = true, requires = "frames", conflicts_with = "indenter_types", help_heading = HEADING)]
    indenter_z: Option<Measures>,
    /// Types or elements of the indenter's atoms. The lowest of them follow the scene's surface: rows along x from the lower corner of
    /// the box, heights upwards.
    #[arg(long, value_name = "TYPES", value_delimiter = ',', requires = "frames", help_heading = HEADING)]
    indenter_types: Vec<String>,
    /// Types or elements of the substrate's atoms. Default: all others. Its surface: the atoms that no other covers in the first frame.
    #[arg(long, value_name = "TYPES", value_delimiter = ',', requires = "frames", help_heading = HEADING)]
    substrate_types: Vec<String>,
    /// Distance d_c from the indenter within which an atom is in contact, Å or with a unit. Gaps are less by it. Default: that of the
    /// scene's [atoms].
    #[arg(long, value_name = "D", requires = "frames", help_heading = HEADING)]
    contact_distance: Option<Measure>,
    /// Load of the frames. Without it the continuum is solved at the contact area of the atoms. The continuum has a hard wall: the surface that a
    /// ball of radius d_c meets. d_c is best where the repulsion begins.
    #[arg(long, value_enum, requires = "frames", help_heading = HEADING)]
    load: Option<OwnLoad>,
}

/// In Å; a plain number is.
fn angstrom(flag: &str, measure: Measure) -> Result<f64> {
    let refused = |accepted: String| Error::input(COMMAND_LINE, flag, measure, accepted);
    let unit = Unit::find("Å").expect("a unit of length");
    let value = measure.of(Dimension::Length).map_err(refused)?.to(unit);
    if value.is_finite() { Ok(value) } else { Err(refused("a finite length".into())) }
}

impl OwnRunArgs {
    /// None where the frames are of a block that asperity built.
    pub(super) fn resolve(&self, case: &Case) -> Result<Option<OwnRun>> {
        let z = self.indenter_z.iter().flat_map(|list| &list.0);
        let indenter_z = z.map(|z| angstrom("--indenter-z", *z)).collect::<Result<Vec<f64>>>()?;
        if indenter_z.is_empty() && self.indenter_types.is_empty() {
            let given = [
                ("--substrate-types", !self.substrate_types.is_empty()),
                ("--contact-distance", self.contact_distance.is_some()),
                ("--load", self.load.is_some()),
            ];
            let accepted = "only with --indenter-z or --indenter-types, for a run of your own";
            return match given.iter().find(|(_, is_given)| *is_given) {
                Some((flag, _)) => Err(Error::input(COMMAND_LINE, *flag, "given", accepted)),
                None => Ok(None),
            };
        }
        if self.load == Some(OwnLoad::Fz) && self.indenter_types.is_empty() {
            return Err(Error::input(
                COMMAND_LINE,
                "--load",
                "fz",
                "scene, or --indenter-types, whose forces are summed",
            ));
        }
        let flag = "--contact-distance";
        let of_scene = case.atoms.as_ref().map(|a| a.wall.repulsion.contact_distance_angstrom);
        let contact_distance = self.contact_distance.map(|d| angstrom(flag, d)).transpose()?.or(of_scene);
        let [least, most] = CONTACT_DISTANCES;
        let accepted = format!("a length from {least} to {most} Å");
        let Some(contact_distance) = contact_distance else {
            return Err(Error::input(COMMAND_LINE, flag, "not given", format!("{accepted}, or a scene with [atoms]")));
        };
        if !(least..=most).contains(&contact_distance) {
            return Err(Error::input(COMMAND_LINE, flag, format!("{contact_distance} Å"), accepted));
        }
        let types = BodyTypes { substrate: self.substrate_types.clone(), indenter: self.indenter_types.clone() };
        Ok(Some(OwnRun { types, indenter_z, contact_distance, load: self.load }))
    }
}

/// The frames, and the continuum next to each.
pub(super) fn table(states: &[OwnState]) -> String {
    let rows = states.iter().flat_map(|s| {
        let atoms = [
            s.file.display().to_string(),
            s.timestep.to_string(),
            significant(s.indenter_z_angstrom, 6),
            "atoms".into(),
            s.p_star.map_or(String::new(), |p| significant(p, 4)),
            percent(s.contact_area),
            String::new(),
            String::new(),
            significant(s.mean_gap_angstrom, 4),
        ];
        let continuum = s.continuum.as_ref().map(|c| {
            let (here, shifted) = (&c.contact.overlap, &c.contact.shifted);
            [
                String::new(),
                String::new(),
                String::new(),
                format!("hard wall at d_c, same {}", c.at),
                significant(c.p_star, 4),
                format!("{} (sites {})", percent(c.contact_area), percent(c.contact.contact_area)),
                format!("{:.2} ({:.2})", here.jaccard, shifted.jaccard),
                format!("{:.2} ({:.2})", here.kappa, shifted.kappa),
                significant(c.mean_gap_angstrom, 4),
            ]
        });
        std::iter::once(atoms).chain(continuum).map(Vec::from)
    });
    output::table(&["file", "timestep", "z / Å", "", "p*", "contact", "Jaccard", "kappa", "mean gap / Å"], rows)
}

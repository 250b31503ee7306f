use crate::measured_errors::MeasuredErrors;
pub use crate::quantity::Quantity;
use serde::Serialize;

/// Whether a method provides a quantity, and under which conditions. The reason is printed in the empty cell of a
/// table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Support {
    Full,
    /// Without adhesion only.
    NoAdhesion,
    /// With the stated limitation.
    Only(&'static str),
    /// Not provided, for the stated reason.
    No(&'static str),
}

/// Whether a method solves for the fields.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum MethodKind {
    /// Solves for fields in equilibrium and reports the residual.
    Solver,
    /// Estimates contact quantities without fields in equilibrium.
    Estimate,
}

/// The only data of the surface that a method receives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Needs {
    Heights,
    /// Power spectrum ([`asperity_surface::PowerSpectrum`]).
    Spectrum,
}

/// Contact criterion of a method. Contact areas are compared together with their criterion.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Criterion {
    /// Gap exactly zero, at a hard wall.
    ZeroGap,
    /// Compressive interfacial stress.
    CompressiveStress,
    /// Gap exactly zero; the area under compressive stress is reported as well.
    ZeroGapAndStress,
    /// Overlap of the undeformed bodies (bearing area), enlarged as the method prescribes.
    Overlap,
    /// Contact spots of single asperities.
    Spots,
    /// Contact fraction of a statistical theory, without positions.
    Statistical,
    /// Gap below the optical resolution.
    Optical { gap_nm: f64 },
    /// An atom of the other body closer than this distance.
    AtomDistance { d_c_angstrom: f64 },
}

impl Criterion {
    /// Of the atoms in the challenge.
    pub const CHALLENGE_ATOMS: Criterion = Criterion::AtomDistance { d_c_angstrom: CHALLENGE_DISTANCE_ANGSTROM };
}

/// Distance of indenter and contact atoms in the all-atom simulation of the challenge.
pub const CHALLENGE_DISTANCE_ANGSTROM: f64 = 4.0354;

impl std::fmt::Display for Criterion {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Criterion::ZeroGap => write!(f, "zero gap"),
            Criterion::CompressiveStress => write!(f, "compressive stress"),
            Criterion::ZeroGapAndStress => write!(f, "zero gap; area under compressive stress reported as well"),
            Criterion::Overlap => write!(f, "overlap of the undeformed bodies"),
            Criterion::Spots => write!(f, "contact spots of single asperities"),
            Criterion::Statistical => write!(f, "contact fraction of a statistical theory"),
            Criterion::Optical { gap_nm } => write!(f, "a gap below {gap_nm} nm at the scale of the experiment"),
            Criterion::AtomDistance { d_c_angstrom } => write!(f, "an indenter atom within {d_c_angstrom} Å"),
        }
    }
}

/// Properties of a method, read by tables, error messages and the tests over the registry.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct MethodCard {
    pub id: &'static str,
    /// Name of the approach in the challenge paper.
    pub paper_name: &'static str,
    pub family: &'static str,
    pub kind: MethodKind,
    pub needs: Needs,
    /// With default settings; [`ContactMethod::criterion`](super::ContactMethod::criterion) for others.
    pub criterion: Criterion,
    /// Data to which constants were fitted, with default settings; none for a solver of the governing equations.
    pub calibrated_on: Option<&'static str>,
    /// One sentence for tables.
    pub summary: &'static str,
    #[serde(serialize_with = "quantities")]
    pub supports: fn(Quantity) -> Support,
    /// What the method solves besides an elastic periodic body under pressures.
    pub capabilities: Capabilities,
    pub dois: &'static [&'static str],
    /// Sources without a DOI here: authors, journal, volume, year, page.
    pub papers: &'static [&'static str],
    /// Measured errors of an estimate, with the surface on which they were measured. None for solvers, whose errors are those of their
    /// grid.
    pub measured_errors: Option<&'static MeasuredErrors>,
}

/// What a method solves besides an elastic periodic body under pressures.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Capabilities {
    /// Plastic flow at a hardness.
    pub hardness: bool,
    /// Imposed mean gaps, displacements and the search of the pull-off.
    pub mean_gap: bool,
    /// The state at first contact, under no pressure.
    pub first_contact: bool,
    /// A body that is not periodic.
    pub non_periodic: bool,
    /// The stress of its states is that of the elastic body under their displacement, also where it deviates from equilibrium.
    pub elastic_stress: bool,
    /// Several ranks of MPI.
    pub ranks: bool,
    /// A GPU.
    pub gpu: bool,
    /// A block of atoms, from a scene with `[atoms]`.
    pub atoms: bool,
}

impl Capabilities {
    pub const NONE: Capabilities = Capabilities {
        hardness: false,
        mean_gap: false,
        first_contact: false,
        non_periodic: false,
        elastic_stress: false,
        ranks: false,
        gpu: false,
        atoms: false,
    };
    /// Of a solver with plastic flow.
    pub const HARDNESS: Capabilities = Capabilities { hardness: true, elastic_stress: true, ..Self::NONE };
}

/// Measured relative error from which on results of a method carry a warning.
const NOTABLE: f64 = 0.2;

impl MethodCard {
    /// One sentence on the quantities whose measured error is notable; `None` without any.
    pub fn warning(&self) -> Option<String> {
        let measured = self.measured_errors?;
        let notable = measured.errors.iter().filter(|e| e.error > NOTABLE);
        let list: Vec<String> = notable.map(|e| format!("{} by {:.0} %", e.quantity.name(), 100.0 * e.error)).collect();
        let spectra = if self.calibrated_on.is_some() {
            "; its constants are fitted, so that it may deviate more on other spectra"
        } else {
            ""
        };
        let (surface, reference) = (&measured.surface, &measured.reference);
        let what = list.join(" and ");
        (!list.is_empty()).then(|| format!("deviates in {what} from {reference}, measured on {surface}{spectra}"))
    }

    /// Whether the method models adhesion.
    pub fn supports_adhesion(&self) -> bool {
        matches!((self.supports)(Quantity::ContactArea), Support::Full | Support::Only(_))
    }

    /// Reason why a quantity is not provided for a problem with or without adhesion; `None` if it is provided.
    pub fn unsupported_reason(&self, quantity: Quantity, adhesive: bool) -> Option<&'static str> {
        match (self.supports)(quantity) {
            Support::No(reason) => Some(reason),
            Support::NoAdhesion if adhesive => Some("not with adhesion"),
            _ => None,
        }
    }
}

fn quantities<S: serde::Serializer>(supports: &fn(Quantity) -> Support, to: S) -> Result<S::Ok, S::Error> {
    to.collect_map(Quantity::OUTPUTS.map(|q| (q, supports(q))))
}

/// Support by a field solver: everything follows from the fields.
pub fn fields(_: Quantity) -> Support {
    Support::Full
}

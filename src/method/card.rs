pub use crate::record::quantity::Quantity;
use serde::Serialize;

/// Whether, and on what terms, a quantity is delivered. The reason is printed where a table has an empty cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Support {
    Full,
    NoAdhesion,
    Only(&'static str),
    No(&'static str),
}

/// Whether the fields of a state are in equilibrium.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Solves for the fields, and says how far from equilibrium it stopped.
    Solver,
    /// Tells of the contact without solving for its fields.
    Estimate,
}

/// What a method is given of the surface, and it is given nothing else.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Needs {
    Heights,
    /// Power by wave number ([`crate::surface::PowerSpectrum`]).
    Spectrum,
}

/// What a method calls contact. Areas are compared only together with it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Criterion {
    /// Gap exactly zero, where the wall holds the surfaces apart.
    ZeroGap,
    /// Interfacial stress that presses.
    CompressiveStress,
    /// Gap exactly zero; where the stress presses is told beside it.
    ZeroGapAndStress,
    /// Undeformed bodies moved into each other: the bearing area, grown by what the method says of it.
    Overlap,
    /// Spots of single asperities.
    Spots,
    /// A share without a place: what a theory calls contact.
    Statistical,
    /// Gap below what light tells from none.
    Optical { gap_nm: f64 },
    /// Any atom of the other body nearer than this.
    AtomDistance { d_c_angstrom: f64 },
}

impl std::fmt::Display for Criterion {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Criterion::ZeroGap => write!(f, "zero gap"),
            Criterion::CompressiveStress => write!(f, "compressive stress"),
            Criterion::ZeroGapAndStress => write!(f, "zero gap, beside compressive stress"),
            Criterion::Overlap => write!(f, "overlap of the undeformed bodies"),
            Criterion::Spots => write!(f, "spots of single asperities"),
            Criterion::Statistical => write!(f, "a share, without a place"),
            Criterion::Optical { gap_nm } => write!(f, "a gap below {gap_nm} nm at the scale of the experiment"),
            Criterion::AtomDistance { d_c_angstrom } => write!(f, "an indenter atom within {d_c_angstrom} Å"),
        }
    }
}

/// What a method is, honestly: read by tables, by the unavailable_reason of what it cannot do, and by tests that walk the registry.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Card {
    pub id: &'static str,
    /// Name of the approach in the challenge paper.
    pub paper_name: &'static str,
    pub family: &'static str,
    pub kind: Kind,
    pub needs: Needs,
    /// With default settings ([`ContactMethod::criterion`](super::ContactMethod::criterion) with others).
    pub criterion: Criterion,
    /// Constants fitted to the reference answer, with default settings; none for a solver of the equations.
    pub calibrated_on: Option<&'static str>,
    /// One sentence for tables.
    pub summary: &'static str,
    #[serde(serialize_with = "quantities")]
    pub supports: fn(Quantity) -> Support,
    pub dois: &'static [&'static str],
    /// Sources whose DOI is not known here: authors, journal, volume, year, page.
    pub papers: &'static [&'static str],
}

impl Card {
    /// Whether adhesion is something that the method knows.
    pub fn supports_adhesion(&self) -> bool {
        matches!((self.supports)(Quantity::ContactArea), Support::Full | Support::Only(_))
    }

    /// Why a quantity is not delivered of a problem, with adhesion or without.
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

/// What a solver of the fields delivers: the fields and all that follows from them, the stiffness from neighbouring loads.
pub(super) fn fields(quantity: Quantity) -> Support {
    match quantity {
        Quantity::Stiffness => Support::Only("as differences between loads"),
        _ => Support::Full,
    }
}

//! The methods of the crate.

use crate::{Error, Result};
use asperity_contact::method::{ContactMethod, MethodKind};
use asperity_methods::REGISTRY;

/// A method of solving or estimating a contact problem.
#[derive(Debug, Clone, PartialEq)]
pub struct Method {
    /// For [`Problem::method`](crate::Problem::method).
    pub id: &'static str,
    /// Name of the approach in the contact-mechanics challenge (Müser et al., Tribol. Lett. 65 (2017) 118).
    pub paper_name: &'static str,
    /// Family of methods, such as boundary elements or asperity models.
    pub family: &'static str,
    /// Whether it solves for the fields in equilibrium, as [`Problem::solve`](crate::Problem::solve) requires. Other methods estimate:
    /// [`Problem::estimate`](crate::Problem::estimate).
    pub solves: bool,
    /// Whether it takes adhesion into account.
    pub adhesion: bool,
    /// What it counts as contact.
    pub criterion: String,
    /// What its constants were fitted to; none for a solver of the equations.
    pub calibrated_on: Option<&'static str>,
    /// One sentence.
    pub summary: &'static str,
    /// DOIs, then papers without one.
    pub references: Vec<&'static str>,
}

/// All methods, in the order in which tables list them.
///
/// ```
/// let solvers: Vec<_> = asperity::methods().into_iter().filter(|m| m.solves).map(|m| m.id).collect();
/// assert!(solvers.contains(&"fast"));
/// ```
pub fn methods() -> Vec<Method> {
    let entry = |card: &asperity_contact::method::MethodCard| Method {
        id: card.id,
        paper_name: card.paper_name,
        family: card.family,
        solves: card.kind == MethodKind::Solver,
        adhesion: card.supports_adhesion(),
        criterion: card.criterion.to_string(),
        calibrated_on: card.calibrated_on,
        summary: card.summary,
        references: card.dois.iter().chain(card.papers).copied().collect(),
    };
    REGISTRY.iter().map(|m| entry(m.card())).collect()
}

/// The method with an id of [`methods()`]; `auto` is the fastest that solves for the fields.
///
/// # Errors
/// `Input` for an unknown id.
pub fn method(id: &str) -> Result<&'static dyn ContactMethod> {
    let unknown = || Error::input("problem", "method", format!("{id:?}"), asperity_methods::ids().join(", "));
    asperity_methods::find(id).ok_or_else(unknown)
}

//! What any method gives for one load.

use super::arrays::map;
use super::state::State;
use asperity_contact::load::LoadStep;
use asperity_contact::method::{ContactMethod, Quantity, Settings};
use ndarray::Array2;

/// The contact under one load, as any method gives it: a solver of the fields or an estimate. Units are those of its [`Problem`](crate::Problem).
#[derive(Debug, Clone)]
pub struct Estimate {
    /// Id of the method.
    pub method: &'static str,
    /// What the method counts as contact.
    pub criterion: String,
    /// Contact area over the area of the cell: the best value.
    pub contact_area: f64,
    /// Mean gap, where the method has one.
    pub mean_gap: Option<f64>,
    /// Quantities that the method does not deliver, at all or under this load, with the reasons.
    pub missing: Vec<(&'static str, &'static str)>,
    /// Gap `[ny, nx]`, where the method has one.
    pub gap: Option<Array2<f64>>,
    /// Interfacial pressure `[ny, nx]`, where the method has one.
    pub pressure: Option<Array2<f64>>,
    /// Whether a node is in contact, `[ny, nx]`, where the method locates the contact.
    pub contact: Option<Array2<bool>>,
    /// Wall time, s.
    pub seconds: f64,
}

impl Estimate {
    pub(super) fn of_state(state: State, method: &dyn ContactMethod, settings: &Settings) -> Self {
        Estimate {
            method: method.card().id,
            criterion: method.criterion(settings).to_string(),
            contact_area: state.contact_area,
            mean_gap: Some(state.mean_gap),
            missing: Vec::new(),
            gap: Some(state.gap),
            pressure: Some(state.pressure),
            contact: Some(state.contact),
            seconds: state.seconds,
        }
    }

    pub(super) fn new(
        (length, modulus): (f64, f64),
        method: &dyn ContactMethod,
        reduced: &asperity_contact::method::ReducedProblem,
        found: &asperity_contact::method::MethodEstimate,
    ) -> Self {
        let step = LoadStep::single(found.pressure, 1.0);
        let state = crate::pipeline::state_of(method.card(), reduced, (&step, 1.0), found);
        let (card, adhesive) = (method.card(), reduced.adhesion != asperity_contact::interface::AttractionLaw::None);
        let never = Quantity::OUTPUTS.into_iter().filter_map(|q| Some((q.id(), card.unsupported_reason(q, adhesive)?)));
        let missing = never.chain(found.undelivered.iter().map(|(q, reason)| (q.id(), *reason))).collect();
        let scaled_map = |values: &[f64], unit: f64| map(reduced.grid, values.iter().map(|v| v * unit).collect());
        Estimate {
            method: method.card().id,
            criterion: method.criterion(&reduced.settings).to_string(),
            contact_area: state.numbers.contact_area,
            mean_gap: found.mean_gap.map(|g| g * length),
            missing,
            gap: found.gap.map(|gap| scaled_map(gap, length)),
            pressure: found.stress.map(|stress| scaled_map(stress, modulus)),
            contact: found.contact.map(|c| map(reduced.grid, c.iter().map(|&c| c != 0).collect())),
            seconds: found.seconds,
        }
    }
}

use crate::scene::quantity::{Dimensional, Quantity};
use asperity_grid::error::Complaint;

/// Complaints about one scene.
pub(super) struct Complaints(pub Vec<Complaint>);

impl Complaints {
    pub(super) fn unless(&mut self, good: bool, key: &str, found: impl ToString, accepted: &str) {
        if !good {
            self.0.push(Complaint::new(key, found, accepted));
        }
    }

    /// Positive and finite.
    pub(super) fn positive(&mut self, key: &str, value: f64) {
        self.unless(value.is_finite() && value > 0.0, key, value, "a positive number");
    }

    /// Likewise a quantity.
    pub(super) fn positive_quantity<D: Dimensional>(&mut self, key: &str, given: Quantity<D>) {
        let value = given.value();
        self.unless(value.is_finite() && value > 0.0, key, given, "a positive number");
    }
}

/// A choice as scenes write it.
pub(crate) fn word(choice: &impl clap::ValueEnum) -> String {
    choice.to_possible_value().map_or(String::new(), |v| v.get_name().to_string())
}

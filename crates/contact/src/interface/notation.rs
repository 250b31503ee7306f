//! How lengths and works are written in the descriptions of laws, walls and bodies.

/// Writes constants that are given in reduced units.
pub trait Notation {
    /// A length, over L.
    fn length(&self, over_length: f64) -> String;
    /// An energy per area, over E* L.
    fn work(&self, reduced: f64) -> String;
}

/// As multiples of L and E* L.
pub(super) struct Reduced;

impl Notation for Reduced {
    fn length(&self, over_length: f64) -> String {
        format!("{over_length:.4e} L")
    }

    fn work(&self, reduced: f64) -> String {
        format!("{reduced:.4e} E*L")
    }
}

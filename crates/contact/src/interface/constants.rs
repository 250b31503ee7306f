//! How the constants of laws and bodies are written.

/// How the constants of a law, a wall or a body are written.
pub struct Constants<'a> {
    /// A length, given over L.
    pub length: &'a dyn Fn(f64) -> String,
    /// An energy per area, given over E* L.
    pub work: &'a dyn Fn(f64) -> String,
}

impl Constants<'_> {
    /// As multiples of L and E* L.
    pub const REDUCED: Constants<'static> =
        Constants { length: &|length| format!("{length:.4e} L"), work: &|work| format!("{work:.4e} E*L") };
}

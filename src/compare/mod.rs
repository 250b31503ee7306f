//! What two states say about each other: contact maps at the atoms' surface sites, registration, gaps.

mod matching;
mod overlap;
mod registration;

pub use matching::{Criteria, Sites, softness_threshold};
pub use overlap::overlap;
pub use registration::registration;

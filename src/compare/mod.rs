//! What two states say about each other: contact maps at the atoms' surface sites, registration, gaps, and how far the one is
//! from the other beside what it cost.

pub mod accuracy;
pub mod advice;
pub mod forecast;
pub mod frontier;
mod matching;
mod overlap;
mod registration;

pub use matching::{SiteCriterion, Sites, softness_rise};
pub use overlap::overlap;
pub use registration::registration;

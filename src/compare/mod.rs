//! What two states say about each other: contact maps at the atoms' surface sites, registration, gaps, and how far the one is
//! from the other beside what it cost.

pub mod accuracy;
pub mod advice;
pub mod forecast;
mod overlap;
pub mod pareto;
mod registration;
mod site_contact;

pub use overlap::overlap;
pub use registration::registration;
pub use site_contact::{SiteCriterion, Sites, wall_offset};

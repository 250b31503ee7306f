//! What a state says: contact area, patches, sections. Observers read borrowed fields and keep nothing of them.

mod area;
mod patches;
mod section;

pub use area::{ContactArea, contact_area, contact_map};
pub use patches::{Connectivity, patch_sizes};
pub use section::{along_y, column_at};

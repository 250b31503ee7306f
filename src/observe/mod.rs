//! What a state says: contact area, patches, sections. Observers read borrowed fields and keep nothing of them.

mod area;
mod distribution;
mod hysteresis;
mod leak;
mod patches;
mod section;
mod spots;
mod stiffness;

/// A map `[ny, nx]` and its width, drawn in words: dots are open, all else is contact.
#[cfg(test)]
fn drawn(text: &str) -> (Vec<u8>, usize) {
    let rows: Vec<&str> = text.split_whitespace().collect();
    (rows.concat().bytes().map(|b| u8::from(b != b'.')).collect(), rows[0].len())
}

pub use area::{ContactArea, contact_area, contact_map};
pub use distribution::{
    Distribution, StressDistribution, gap_distribution, linear_edges, logarithmic_edges, stress_distribution,
};
pub use hysteresis::hysteresis_work;
pub use leak::{hydraulic_gap, spans};
pub use patches::{
    Connectivity, NO_PATCH, Patches, cumulative_area, patch_sizes, patches, size_distribution, spot_conductance,
    typical_size,
};
pub use section::{along_y, column_at};
pub use spots::Spots;
pub use stiffness::stiffness;

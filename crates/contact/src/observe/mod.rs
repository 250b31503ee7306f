//! Observables of a state: contact area, contact clusters, sections. They read borrowed fields.

mod area;
mod cluster_areas;
mod clusters;
mod dissipation;
mod distribution;
mod hydraulic_gap;
mod leakage;
mod plasticity;
mod runs;
mod section;
mod stiffness;

/// A contact map `[ny, nx]` and its width from text rows: dots are open nodes, other characters are contact.
#[cfg(test)]
fn drawn(text: &str) -> (Vec<u8>, usize) {
    let rows: Vec<&str> = text.split_whitespace().collect();
    (rows.concat().bytes().map(|b| u8::from(b != b'.')).collect(), rows[0].len())
}

pub use area::{ContactArea, ContactEdges, ELASTIC_EDGE, contact_area, contact_area_on_ranks, contact_map};
pub use cluster_areas::ClusterAreas;
pub use clusters::{
    ClusterLabels, Connectivity, NO_CLUSTER, cluster_sizes, clusters, constriction_conductance, cumulative_area,
    effective_clusters, median_cluster_size, median_counting_error, share_counting_error, size_distribution,
};
pub use dissipation::{WorkPoint, dissipation};
pub use distribution::{
    Distribution, StressDistribution, gap_distribution, linear_edges, logarithmic_edges, stress_distribution,
};
pub use hydraulic_gap::{hydraulic_gap, percolates};
pub use leakage::{Leakage, leakage, leakage_bytes};
pub use plasticity::Plasticity;
pub use section::{along_y, column_at};
pub use stiffness::stiffness;

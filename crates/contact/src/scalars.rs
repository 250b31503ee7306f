//! The numbers of a state, for every table of states.

use crate::load::Branch;
use crate::state::State;
use asperity_grid::units::Dimension;

/// A number of a state.
#[derive(Debug, Clone, Copy)]
pub struct Scalar {
    /// Name in tables.
    pub key: &'static str,
    pub words: &'static str,
    pub dimension: Dimension,
    /// Whether it belongs to the contact and not to its computation: ensembles average it.
    pub is_physical: bool,
    /// `None` where the state does not have it.
    pub of: Value,
}

type Value = fn(&State) -> Option<f64>;

const fn physical(key: &'static str, dimension: Dimension, words: &'static str, of: Value) -> Scalar {
    Scalar { key, words, dimension, is_physical: true, of }
}

const fn numerical(key: &'static str, dimension: Dimension, words: &'static str, of: Value) -> Scalar {
    Scalar { is_physical: false, ..physical(key, dimension, words, of) }
}

use Dimension::{Area, Length, Number, Stiffness, Stress, Time, Work};

/// In the order of tables.
pub const SCALARS: &[Scalar] = &[
    numerical("unloading", Number, "1 on the unloading branch", |s| {
        Some(f64::from(u8::from(s.branch == Branch::Unloading)))
    }),
    physical("pressure", Stress, "mean pressure", |s| Some(s.pressure)),
    numerical("p_star", Number, "mean pressure over E* times rms gradient", |s| Some(s.p_star)),
    physical("contact_area", Number, "relative contact area", |s| Some(s.contact_area)),
    numerical("contact_area_error", Number, "error of the relative contact area", |s| s.contact_area_error),
    numerical("contact_nodes", Number, "contact nodes over all nodes", |s| s.contact_nodes),
    physical("contact_nodes_compressive", Number, "contact nodes under compression over all nodes", |s| {
        s.contact_nodes_compressive
    }),
    physical("mean_gap", Length, "mean gap", |s| s.mean_gap),
    numerical("mean_gap_error", Length, "error of the mean gap", |s| s.mean_gap_error),
    physical("displacement", Length, "displacement from first contact", |s| s.displacement),
    physical("stiffness", Stiffness, "contact stiffness dp/du", |s| s.stiffness),
    numerical("stiffness_error", Stiffness, "error of the contact stiffness", |s| s.stiffness_error),
    physical("clusters", Number, "number of contact clusters", |s| s.clusters.map(|n| n as f64)),
    physical(
        "median_cluster_area",
        Area,
        "median cluster area: half of the contact area is in clusters up to it",
        |s| s.observed.as_ref()?.median_cluster_area,
    ),
    numerical("median_cluster_area_compressive", Area, "median cluster area of the contact under compression", |s| {
        s.observed.as_ref()?.compressive?.median_cluster_area
    }),
    physical("mean_contact_pressure", Stress, "pressure over the contact area", |s| {
        s.observed.as_ref()?.mean_contact_pressure
    }),
    numerical("contact_area_extrapolated", Number, "area at the true range of the adhesion", |s| {
        Some(s.extrapolated?.area.value)
    }),
    numerical("mean_gap_extrapolated", Length, "mean gap at the true range of the adhesion", |s| {
        Some(s.extrapolated?.mean_gap?.value)
    }),
    numerical("hysteresis_contact_area", Number, "relative change of the area from the same load of loading", |s| {
        Some(s.hysteresis?.area)
    }),
    numerical("hysteresis_mean_gap", Number, "relative change of the mean gap from the same load of loading", |s| {
        Some(s.hysteresis?.mean_gap)
    }),
    numerical("constriction_conductance", Length, "conductance times resistivity, clusters as circular spots", |s| {
        s.observed.as_ref()?.constriction_conductance
    }),
    physical("hydraulic_gap_x", Length, "uniform gap with the same leakage along x", |s| {
        Some(s.leakage?.hydraulic_gaps()[0])
    }),
    numerical("hydraulic_gap_x_error", Length, "error of the hydraulic gap along x", |s| {
        Some(s.leakage?.gap_errors?[0])
    }),
    physical("hydraulic_gap_y", Length, "uniform gap with the same leakage along y", |s| {
        Some(s.leakage?.hydraulic_gaps()[1])
    }),
    numerical("hydraulic_gap_y_error", Length, "error of the hydraulic gap along y", |s| {
        Some(s.leakage?.gap_errors?[1])
    }),
    physical(
        "hydraulic_gap_effective_medium",
        Length,
        "uniform gap with the same leakage, by the effective medium",
        |s| {
            let of_gap = s.observed.as_ref().and_then(|o| o.hydraulic_gap);
            of_gap.or_else(|| Some(s.leakage?.effective_medium.cbrt()))
        },
    ),
    physical("energy", Work, "energy per area", |s| s.energy),
    numerical("elastic_energy", Work, "elastic energy per area", |s| s.elastic_energy),
    numerical("interaction_energy", Work, "energy per area of the interaction", |s| s.interaction_energy),
    physical("flowing_fraction", Number, "nodes whose plastic displacement grows", |s| Some(s.plasticity?.flowing)),
    numerical("displaced_fraction", Number, "nodes with a plastic displacement", |s| Some(s.plasticity?.displaced)),
    numerical("mean_plastic_displacement", Length, "mean plastic displacement", |s| Some(s.plasticity?.displacement)),
    physical("plastic_work", Work, "plastic work per area since the first load", |s| Some(s.plasticity?.work)),
    physical("von_mises", Stress, "largest equivalent stress below the surface", |s| {
        Some(s.subsurface.as_ref()?.von_mises.value)
    }),
    physical("shear", Stress, "largest shear stress below the surface", |s| Some(s.subsurface.as_ref()?.shear.value)),
    numerical("load_error", Number, "relative error of the load", |s| Some(s.load_error)),
    numerical("residual", Number, "rms KKT residual over the pressure", |s| s.residual),
    numerical("iterations", Number, "iterations", |s| Some(s.iterations as f64)),
    numerical("fft_pairs", Number, "transform pairs", |s| Some(s.fft_pairs)),
    numerical("seconds", Time, "wall time", |s| Some(s.seconds)),
];

/// The scalars that at least one of the states has, with their values; NaN for states without.
pub fn columns(states: &[State]) -> impl Iterator<Item = (&'static Scalar, Vec<f64>)> {
    SCALARS.iter().filter_map(|scalar| {
        let values: Vec<Option<f64>> = states.iter().map(scalar.of).collect();
        let any = values.iter().any(Option::is_some);
        any.then(|| (scalar, values.into_iter().map(|v| v.unwrap_or(f64::NAN)).collect()))
    })
}

//! Solvers and estimates, against closed forms, each other and the challenge's paper.

mod adhesive_analytic;
mod analytic;
mod asperities;
mod contact_stress;
mod dissipation;
mod edges;
mod estimates;
mod extrapolation;
mod extremes;
mod extremes_adhesion;
mod fields;
mod found;
mod hardness;
mod hardness_map;
mod laws;
mod map_errors;
mod non_periodic;
mod paths;
mod preparation;
#[path = "../common/program.rs"]
mod program;
mod refinement;
mod scales;
mod statistical;
mod stiffness;
mod subsurface;
mod variants;

//! Rough-surface contact: gap, pressure and contact area of a rough surface on an elastic body, with adhesion or without.
//!
//! A [`Surface`] comes from an array of heights, a file or a spectrum. A [`Problem`] adds the elastic body, the adhesion and the
//! method; [`Problem::solve`] gives the equilibrium under one mean pressure and [`Problem::load_path`] those under a sequence of
//! loads. A [`State`] is what `results.json` and the lines of `asperity solve` hold; [`StateMaps`] has its maps as arrays `[ny, nx]`,
//! x fastest, and functions such as [`clusters`] and [`gap_distribution`] evaluate any map. [`compare_maps`] measures the agreement of two contact maps, [`methods()`] lists the methods, and [`FinishedRun`]
//! reads the folder of `asperity run`.
//!
//! ```
//! use asperity::{Problem, StateMaps, Surface, Touching};
//! use ndarray::Array2;
//! use std::f64::consts::TAU;
//!
//! // A wavy surface of amplitude 0.1 µm on a cell of 10 µm x 10 µm, on a half-space with E* = 25 MPa: lengths in µm, pressures in MPa.
//! let wave = |i: usize| (TAU * i as f64 / 64.0).cos();
//! let heights = Array2::from_shape_fn((64, 64), |(y, x)| 0.1 * wave(x) * wave(y));
//! let surface = Surface::from_array(heights.view(), 10.0, Touching::HighPoints)?;
//! let state = Problem::new(surface, 25.0).solve(0.2)?;
//! println!("contact {:.1} %, mean gap {:.4} µm", 100.0 * state.contact_area, state.mean_gap.unwrap());
//! assert!((state.stress().unwrap().mean().unwrap() - 0.2).abs() < 1e-8);
//! # Ok::<(), asperity::Error>(())
//! ```
//!
//! Units are those of the caller: lengths have the unit of the surface, pressures that of the contact modulus, and energies per
//! area their product.
//!
//! What is documented here is the interface of the crate. The modules are internals of the program `asperity`: they are public
//! for its tests and benchmarks, hidden from this page, and change without notice.

#![warn(missing_docs)]

mod api;

pub use api::*;
#[doc(inline)]
pub use asperity_contact::interface::{Base, RangeChoice, TabulatedLaw};
#[doc(inline)]
pub use asperity_contact::load::{Branch, Load, Stop};
#[doc(inline)]
pub use asperity_contact::method::{ErrorEstimates, Precision};
#[doc(inline)]
pub use asperity_contact::observe::{
    Connectivity, ContactArea, Distribution, Leakage, Plasticity, StressDistribution, linear_edges, logarithmic_edges,
};
#[doc(inline)]
pub use asperity_contact::state::{
    Compressive, Discretisation, Extrapolated, Hysteresis, Missing, Observed, Peak, SubsurfaceResults, SubsurfaceSlice,
};
#[doc(inline)]
pub use asperity_grid::error::{Complaint, Error, LammpsFailure, Result};
#[doc(inline)]
pub use asperity_surface::heights::Touching;
#[doc(inline)]
pub use asperity_surface::{Amplitudes, Spectrum};
#[doc(inline)]
pub use record::results::Overlap;

#[doc(hidden)]
pub use asperity_atoms as atoms;
#[doc(hidden)]
pub use asperity_contact as contact;
#[doc(hidden)]
pub use asperity_grid as grid;
#[doc(hidden)]
pub use asperity_methods as methods;
#[doc(hidden)]
pub use asperity_surface as surface;

#[doc(hidden)]
pub mod challenge;
#[doc(hidden)]
pub mod cli;
#[doc(hidden)]
pub mod cluster;
#[doc(hidden)]
pub mod compare;
#[doc(hidden)]
pub mod pipeline;
#[doc(hidden)]
pub mod record;
#[doc(hidden)]
pub mod report;
#[doc(hidden)]
pub mod scene;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

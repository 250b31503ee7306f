//! A scene: the contents of a TOML file as plain data. Key names contain the units; unknown keys are refused.
//!
//! [`Scene`] is read and printed (`asperity schema`); [`Case`] is the same, checked and resolved into the reduced numbers
//! that surfaces, methods and atoms take.

mod atoms;
mod case;
mod check;
mod laboratory;
mod load;
mod model;
mod nvt;
mod outputs;
mod source;
mod syntax;

pub use atoms::{AtomsCase, PairAdhesion, highest_p_star};
pub use case::{Case, slope_warning};
pub use laboratory::{Laboratory, Units};
pub use load::{LoadRange, LoadScene};
pub use model::{
    ALL_METHODS, AdhesionLaw, AdhesionScene, AtomsScene, ChallengeScene, ContinuumScene, CrystalScene, LayerScene,
    MOST_FOUNDATION_CELLS, REFERENCE_LOAD, Scene, Slope, Start, SurfaceScene, Touching, WallKind, default_tolerance,
};
pub use nvt::NvtScene;
pub use outputs::{AccuracyScene, RequestedOutputs};
pub use source::Surface;

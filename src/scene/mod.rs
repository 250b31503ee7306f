//! A scene: the contents of a TOML file as plain data. Quantities have units; unknown keys are refused.
//!
//! [`Scene`] is read and printed (`asperity schema`); [`Case`] is the same, checked and resolved into the reduced numbers
//! that surfaces, methods and atoms take.

mod accuracy;
mod atoms;
mod atoms_scene;
mod case;
mod check;
mod detrend;
mod given_units;
mod hardness;
mod key_names;
mod laboratory;
mod load;
mod model;
mod names;
mod nvt;
mod other_body;
mod potential;
mod problem;
mod quantity;
mod repulsion;
pub mod schema;
mod source;
mod surface_file;
mod syntax;
mod via_python;

pub use accuracy::AccuracyScene;
pub use atoms::{AtomsCase, PairAdhesion, highest_p_star};
pub use atoms_scene::{AtomsScene, AtomsStart, Foundation, HALF_SPACE_EDGES, MOST_FOUNDATION_CELLS, Slope};
pub use case::Case;
pub use detrend::DetrendScene;
pub use given_units::GivenUnits;
pub use key_names::{NameOf, last_part, rename_keys, rename_keys_in};
pub use laboratory::{BodyScene, LaboratoryScene};
pub use load::{LoadRange, LoadScene};
pub use model::{
    ALL_METHODS, AdhesionScene, ChallengeScene, ContinuumScene, CrystalScene, LayerScene, OtherScene, REFERENCE_LOAD,
    Scene, SubsurfaceScene, SurfaceScene, WallKind,
};
pub use nvt::NvtScene;
pub use other_body::OtherFile;
pub use quantity::{
    AnyQuantity, Dimensional, Energy, Force, Fraction, Length, Number, Quantity, Stress, Temperature, Time, Work,
    dimension,
};
pub use source::{ResolvedSurface, resolve as resolve_surface};
pub use surface_file::{SurfaceFile, metres_of};
pub use via_python::{Converter, read_heights};

//! Interactions between the surfaces and the response of the elastic body: adhesion laws, walls, elastic kernels.

mod cubic;
mod elastic;
mod hardness;
mod harmonic_block;
mod kernel;
mod lattice;
mod lattice_constants;
#[cfg(test)]
mod lattice_springs;
mod lattice_waves;
mod law;
mod layer_interior;
mod non_periodic;
mod notation;
mod rectangle;
mod subsurface;
mod surface_response;

pub use cubic::{Cubic, CubicHalfSpace};
pub use elastic::Elastic;
pub use hardness::{HardnessMap, NodalHardness};
pub use harmonic_block::{Amplitudes, HarmonicBlock, LayerBase};
pub use kernel::{Base, HalfSpace, Kernel, Layer};
pub use lattice::LatticeBoundary;
pub use lattice_constants::{Bond, LatticeConstants};
pub use law::{
    AttractionLaw, COHESIVE_RESOLUTION, Dugdale, Exponential, HardWall, Law, LennardJonesWall, PenaltyWall, PowerLaw93,
    PowerLawWall, RangeChoice, SoftWall, TabulatedLaw, TabulatedWall, Wall, WithAdhesion, Yielding, YieldingWall,
    tabor,
};
pub use layer_interior::{LayerDisplacement, WaveStress};
pub use non_periodic::NonPeriodic;
pub use notation::{Notation, PlainNotation, Reduced, in_notation, is_ordinary, rounded};
pub use subsurface::{StressField, Subsurface, SubsurfaceRequest};
pub use surface_response::SurfaceResponse;

//! What the two surfaces do to each other and to the elastic body: elastic kernels, adhesion laws, walls.

mod cubic;
mod elastic;
mod kernel;
mod law;
mod layer_interior;
mod non_periodic;

pub use cubic::{Cubic, CubicHalfSpace};
pub use elastic::Elastic;
pub use kernel::{Base, HalfSpace, Kernel, Layer};
pub use law::{
    Adhesion, COHESIVE_RESOLUTION, Dugdale, Exponential, HardWall, Law, LennardJonesWall, PenaltyWall, PowerLaw93,
    PowerLawWall, RangeChoice, SoftWall, TabulatedWall, Wall, WithAdhesion, tabor,
};
pub use layer_interior::LayerDisplacement;
pub use non_periodic::NonPeriodic;

//! Pictures, curves and the page that shows them.
//!
//! Everything shown comes from `results.json` and the field files that it names: a report can be drawn again, and looks
//! the same, without running anything.

pub mod hysteresis;
mod map;
pub mod number;
pub mod page;
pub mod picture;
pub mod plot;
pub mod series;

pub use page::{PAGE, write, write_tradeoff};

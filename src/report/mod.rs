//! Report pages with pictures, curves and tables.
//!
//! All contents come from `results.json` and the field files that it names, so a report can be regenerated without
//! solving anything.

pub mod accuracy;
pub mod hysteresis;
mod map;
pub mod number;
pub mod page;
pub mod picture;
pub mod plot;
pub mod relaxation;
mod relief;
mod scale;
mod svg;

pub use page::{PAGE, PrintedFigures, ReportOptions, write, write_with};

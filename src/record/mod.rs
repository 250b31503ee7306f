//! Files that others read.

pub mod results;

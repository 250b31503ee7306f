//! For the package's benchmark and test: the targets, and random changes of their corpora.

pub(crate) mod driver;
pub(crate) mod targets;

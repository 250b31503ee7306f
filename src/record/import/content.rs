//! What a file of heights holds, and what its contents cannot tell.

use super::fourier::Wave;
use crate::record::heights::{Declared, HeightMap};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What four columns `qX qY Re Im` are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Fourier {
    /// Coefficients a of the Fourier series h(r) = Σ a exp(iq·r).
    Series,
    /// What a forward transform of FFTW (r2c or c2c, exp(-iq·r), not normalised) gives for heights on n x n points: the
    /// coefficients of the series times n².
    Fftw,
    /// No waves: all columns are heights, be they four, or three of which two look like coordinates.
    None,
}

impl Fourier {
    pub fn are_waves(self) -> bool {
        self != Fourier::None
    }
}

/// What the contents of a file cannot tell.
#[derive(Debug, Clone, Copy, Default)]
pub struct ImportOptions<'a> {
    /// Name of the array in a file that holds several.
    pub dataset: Option<&'a str>,
    pub fourier: Option<Fourier>,
}

/// What a file holds.
#[derive(Debug, Clone)]
pub enum Content {
    Map(HeightMap),
    Waves(Vec<Wave>),
}

/// A file as it was understood.
#[derive(Debug, Clone)]
pub struct ImportedFile {
    pub content: Content,
    pub declared: Declared,
    /// Format and orientation, in words.
    pub layout: String,
}

impl ImportedFile {
    pub(super) fn map(map: HeightMap, declared: Declared, layout: impl Into<String>) -> Self {
        ImportedFile { content: Content::Map(map), declared, layout: layout.into() }
    }
}

//! Contents of a height file, and options for what the contents do not determine.

use crate::Wave;
use crate::declared::Declared;
use crate::height_map::HeightMap;
use serde::{Deserialize, Serialize};

/// Meaning of four columns `qX qY Re Im`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum Fourier {
    /// Coefficients a of the Fourier series h(r) = Σ a exp(iq·r).
    Series,
    /// Output of a forward FFTW transform (r2c or c2c, exp(-iq·r), not normalised) of heights on n × n points: the
    /// series coefficients times n².
    Fftw,
    /// Not Fourier coefficients: all columns are heights, also if two of three columns look like coordinates.
    None,
}

impl Fourier {
    pub fn are_waves(self) -> bool {
        self != Fourier::None
    }
}

/// Options for what the contents of a file do not determine.
#[derive(Debug, Clone, Copy, Default)]
pub struct ImportOptions<'a> {
    /// Name of the array or channel, for a file with several.
    pub dataset: Option<&'a str>,
    pub fourier: Option<Fourier>,
    /// The file is a profile: positions and heights in two columns or lines, or one line of heights. It becomes a map of one line along x.
    pub profile: bool,
}

/// Contents of a file.
#[derive(Debug, Clone)]
pub enum Content {
    Map(HeightMap),
    Waves(Vec<Wave>),
}

/// An imported file.
#[derive(Debug, Clone)]
pub struct ImportedFile {
    pub content: Content,
    pub declared: Declared,
    /// Format and orientation, in words.
    pub layout: String,
    /// Statements of the file that were not used, each with the remedy.
    pub warnings: Vec<String>,
    /// Statements that were not understood and may be what the file seems not to declare.
    pub not_understood: Vec<String>,
}

impl ImportedFile {
    pub(super) fn map(map: HeightMap, declared: Declared, layout: impl Into<String>) -> Self {
        Self::of(Content::Map(map), declared, layout)
    }

    pub(super) fn of(content: Content, declared: Declared, layout: impl Into<String>) -> Self {
        let (warnings, not_understood) = (Vec::new(), Vec::new());
        ImportedFile { content, declared, layout: layout.into(), warnings, not_understood }
    }
}

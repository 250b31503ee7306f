//! Origin of an imported surface: file, what it declares, and what was done to its heights.

use serde::{Deserialize, Serialize};
use std::fmt;

/// Where the heights of an imported surface come from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Provenance {
    /// Path as given.
    pub file: String,
    /// BLAKE3 hash of the file, hexadecimal.
    pub hash: String,
    /// Format and orientation, in words.
    pub format: String,
    /// The channel that was read.
    pub channel: Option<String>,
    /// All height channels of the file.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub channels: Vec<String>,
    /// Unit of the heights in the file; absent: not known, lengths are in that of the heights.
    pub unit: Option<String>,
    /// Points of the prepared map.
    pub nx: usize,
    /// Rows of the prepared map.
    pub ny: usize,
    /// Extents of the prepared cell in metres, if the unit is known.
    pub length_x_m: Option<f64>,
    /// The same along y.
    pub length_y_m: Option<f64>,
    /// The same as text for people, with the unit.
    pub extent: String,
    /// "low-points" or "high-points".
    pub touching: String,
    /// Whether the map repeats.
    pub periodic: bool,
    /// Whether the file declares it, or the scene or its preparation determines it. Otherwise the map is taken as periodic.
    pub periodicity_is_known: bool,
    /// Points of the file that were not measured.
    pub missing_points: usize,
    /// Of these (and of removed outliers) those that were filled.
    pub filled_points: usize,
    /// Share of the file's points that were filled.
    pub filled_share: f64,
    /// Steps of preparation, those that the file records first.
    pub preparation: Vec<String>,
    /// The map of the other rough body, which is part of the heights.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub other: Option<Box<Provenance>>,
    /// Version of the program that read the file.
    pub version: String,
}

impl fmt::Display for Provenance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.file, self.format)?;
        if let Some(channel) = &self.channel {
            write!(f, ", channel {channel:?}")?;
        }
        match &self.unit {
            Some(unit) => write!(f, ", heights in {unit}")?,
            None => write!(f, ", unit not declared")?,
        }
        let repeats = match (self.periodic, self.periodicity_is_known) {
            (true, true) => "periodic",
            (true, false) => "taken as periodic",
            (false, _) => "not periodic",
        };
        let touching = self.touching.replace('-', " ");
        write!(f, ", {touching} touch first, {repeats}")?;
        if !self.preparation.iter().any(|step| step.starts_with("fill")) {
            write!(f, ", no points filled")?;
        }
        self.preparation.iter().try_for_each(|step| write!(f, "; {step}"))?;
        let prepared = if self.preparation.is_empty() { ", " } else { "; prepared: " };
        write!(f, "{prepared}{} x {} points on {}", self.nx, self.ny, self.extent)?;
        match &self.other {
            Some(other) => write!(f, "; the other body: {other}"),
            None => Ok(()),
        }
    }
}

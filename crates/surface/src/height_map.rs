//! Heights on a grid, and the sign convention: which points come into contact first.

use asperity_grid::error::{Error, Result};
use asperity_grid::extent;
use serde::{Deserialize, Serialize};

/// The points of a height map that are nearest to the other body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum Touching {
    /// The challenge's sign: dark areas touch first.
    LowPoints,
    /// An indenter's heights, as most instruments and programs store them.
    HighPoints,
}

impl Touching {
    /// What [`Touching::words`] are accepted.
    pub const WORDS: &'static str = "low points touch first, or high points touch first";

    /// The convention with these words.
    pub fn of_words(words: &str) -> Option<Self> {
        [Touching::LowPoints, Touching::HighPoints].into_iter().find(|t| t.words() == words)
    }

    /// In files of heights.
    pub fn words(self) -> &'static str {
        match self {
            Touching::LowPoints => "low points touch first",
            Touching::HighPoints => "high points touch first",
        }
    }
}

/// Heights of a cell: row-major `[ny, nx]`, in the unit and sign of the file. Finite; NaN at points that were not measured,
/// if it is made by [`HeightMap::with_missing`].
#[derive(Debug, Clone, PartialEq)]
pub struct HeightMap {
    pub nx: usize,
    pub ny: usize,
    pub heights: Vec<f64>,
}

impl HeightMap {
    /// Checks the shape and that heights and their range are finite; errors name `context`.
    pub fn new(context: &str, nx: usize, ny: usize, heights: Vec<f64>) -> Result<Self> {
        let map = Self::with_missing(context, nx, ny, heights)?;
        match map.first_missing() {
            Some([row, column]) => Err(Error::Height { place: context.to_string(), row, column, value: f64::NAN }),
            None => Ok(map),
        }
    }

    /// Likewise for a map with points that were not measured, which are NaN; at least one is measured.
    pub fn with_missing(context: &str, nx: usize, ny: usize, heights: Vec<f64>) -> Result<Self> {
        if nx == 0 || ny == 0 || nx.checked_mul(ny) != Some(heights.len()) {
            let found = format!("{} heights for shape [{ny}, {nx}]", heights.len());
            return Err(Error::format(context, found, "ny·nx heights, at least one"));
        }
        if let Some(i) = heights.iter().position(|h| h.is_infinite()) {
            return Err(Error::Height { place: context.to_string(), row: i / nx, column: i % nx, value: heights[i] });
        }
        if heights.iter().all(|h| h.is_nan()) {
            return Err(Error::format(context, "no measured height", "a map with heights"));
        }
        let (low, high) = extent(&heights);
        if !(high - low).is_finite() {
            // Subtracting the minimum of such heights would overflow.
            let found = format!("heights from {low:e} to {high:e}");
            return Err(Error::format(context, found, "heights whose range is a finite number"));
        }
        Ok(HeightMap { nx, ny, heights })
    }

    /// Row and column, from 0, of the first point that was not measured.
    pub fn first_missing(&self) -> Option<[usize; 2]> {
        self.heights.iter().position(|h| h.is_nan()).map(|i| [i / self.nx, i % self.nx])
    }

    /// Number of points that were not measured.
    pub fn missing(&self) -> usize {
        self.heights.iter().filter(|h| h.is_nan()).count()
    }

    /// The same surface with low points in contact first and minimum 0: `h − min h`, or `max h − h` for the other
    /// sign.
    pub fn low_first(mut self, sign: Touching) -> Self {
        let (low, high) = extent(&self.heights);
        for h in &mut self.heights {
            *h = match sign {
                Touching::LowPoints => *h - low,
                Touching::HighPoints => high - *h,
            };
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn low_points_first_and_never_below_zero() {
        let map = HeightMap::new("here", 3, 1, vec![-1.0, 0.0, 3.0]).unwrap();
        assert_eq!(map.clone().low_first(Touching::LowPoints).heights, [0.0, 1.0, 4.0]);
        assert_eq!(map.low_first(Touching::HighPoints).heights, [4.0, 3.0, 0.0]);
    }
}

//! What a surface file states about its heights, and conversion of the stated units.

use super::height_map::Touching;
use asperity_grid::units::metres_per;

/// Properties that a file states; `None` or empty for those that it does not.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Declared {
    pub sign: Option<Touching>,
    /// Unit of the heights, as the file writes it.
    pub unit: Option<String>,
    pub extent: Option<DeclaredExtent>,
    /// Whether the heights repeat beyond the edges of the map.
    pub periodic: Option<bool>,
    /// Name of the channel that was read, of a file that names its channels.
    pub channel: Option<String>,
    /// All height channels of the file, the one that was read included.
    pub channels: Vec<String>,
    /// Steps of preparation that the file records, in their order.
    pub history: Vec<String>,
}

/// Extents of the cell: points times spacing along x and y.
#[derive(Debug, Clone, PartialEq)]
pub struct DeclaredExtent {
    pub x: f64,
    pub y: f64,
    /// Unit of both. `None`: that of the heights, whatever it is (lines of `x y h` without a header).
    pub unit: Option<String>,
}

impl Declared {
    /// Metres of one unit of the heights, if the file states a known unit of length.
    pub fn unit_m(&self) -> Option<f64> {
        metres_per(self.unit.as_deref()?)
    }

    /// Extents along x and y in metres, if the file states them with a known unit.
    pub fn extent_m(&self) -> Option<[f64; 2]> {
        let e = self.extent.as_ref()?;
        let metres = match &e.unit {
            Some(unit) => metres_per(unit)?,
            None => self.unit_m()?,
        };
        Some([e.x * metres, e.y * metres])
    }
}

//! Preparation of measured maps in explicit, recorded steps.

mod crop;
mod detrend;
mod digits;
mod edges;
mod extend;
mod facets;
mod fill;
mod filter;
mod harmonic;
mod isotropic;
mod lines;
mod outliers;
mod regrid;
mod rows;
mod three_points;
mod trend;

pub use detrend::{Detrend, subtract_form};
pub(super) use digits::{digits, exact, in_unit};
pub use edges::Edges;
pub(crate) use edges::copies;
pub use fill::{Fill, MAX_FILLED_SHARE};
pub use filter::FilterKind;
pub(super) use filter::shifted;
pub(super) use outliers::{SUSPECT, median, suspected_outliers};
pub(super) use regrid::{regrid, sampled};

use crate::guards::outlier_warning;
use crate::height_map::HeightMap;
use asperity_grid::error::{Error, Result};
use asperity_grid::{Grid, rms};
use filter::PassBand;

/// Steps that a map goes through before it is solved, in the order of the fields. Lengths are in the unit of the extents.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Preparation {
    /// First column, first row, columns and rows of the part that is kept.
    pub crop: Option<[usize; 4]>,
    /// Points that deviate from the median of their neighbourhood by more than this many robust standard deviations become missing.
    pub remove_outliers: Option<f64>,
    pub detrend: Option<Detrend>,
    pub fill: Option<Fill>,
    /// Cut-off wavelength below which waves are removed.
    pub low_pass: Option<f64>,
    /// Cut-off wavelength above which waves are removed.
    pub high_pass: Option<f64>,
    /// Transfer function of these; Gaussian by default.
    pub filter: Option<FilterKind>,
    /// Columns and rows of the resampled map.
    pub resample: Option<[usize; 2]>,
    pub edges: Option<Edges>,
    /// Shortest of the waves that are added below `low_pass`: a realisation of the self-affine spectrum that is fitted to the waves above it.
    pub extend_to: Option<f64>,
    /// A square map in place of a profile, one line of points: a realisation of the isotropic random surface whose profiles have its spectrum.
    pub isotropic_map: bool,
    /// Seed of the waves that are added, and of the isotropic map.
    pub seed: u64,
    /// Name of the unit of lengths in messages and in the history; empty where it is not known.
    pub unit: String,
}

/// A prepared map, without missing points.
#[derive(Debug, Clone, PartialEq)]
pub struct PreparedMap {
    pub map: HeightMap,
    /// Extents along x and y: crop and mirror images change them.
    pub extent: [f64; 2],
    /// Points that were filled.
    pub filled: usize,
    /// One line per step that was applied, with its parameters and what it changed.
    pub history: Vec<String>,
    /// What is doubtful about the steps.
    pub warnings: Vec<String>,
}

impl Preparation {
    /// Whether the steps make a map that repeats.
    pub fn repeats(&self) -> bool {
        self.edges.is_some() || self.isotropic_map
    }

    /// Applies the steps to a map `[ny, nx]` with the extents `[x, y]`, in the unit of the caller; heights have the same unit.
    ///
    /// `periodic`: the map repeats as it is. Filters, resampling and fill then continue across its edges. A cropped map, and
    /// one with new `edges`, is treated as a patch until its edges are made.
    ///
    /// The form is fitted to the measured points, not to filled ones. With a crop, rows and columns of messages are those of the
    /// whole map, counted from 1.
    ///
    /// # Errors
    /// Missing points without a fill, and too many with one; a crop outside of the map; cut-offs that the map does not resolve;
    /// a sharp filter of a map that does not repeat; a resampled map without points or beyond the memory; an isotropic map of more than a line,
    /// or with edges; three points that give no plane; a single column.
    pub fn apply(&self, map: HeightMap, extent: [f64; 2], periodic: bool) -> Result<PreparedMap> {
        let mut grid = Grid { nx: map.nx, ny: map.ny, lx: extent[0], ly: extent[1] };
        let mut heights = map.heights;
        let (mut history, mut warnings) = (Vec::new(), Vec::new());
        let [column, row, ..] = self.crop.unwrap_or_default();
        let repeats = periodic && self.edges.is_none() && self.crop.is_none_or(|c| c == [0, 0, grid.nx, grid.ny]);
        if let Some(part) = self.crop {
            let line = format!("crop: {} x {} points from column {}, row {}", part[2], part[3], column + 1, row + 1);
            (grid, heights) = crop::crop(grid, &heights, part)?;
            history.push(format!("{line} of {} x {}", map.nx, map.ny));
        }
        if let Some(edges) = self.edges.filter(|_| self.isotropic_map) {
            let found = format!("{edges:?}").to_lowercase();
            let accepted = "none with --isotropic-map, which repeats";
            return Err(Error::input("preparation", "--edges", found, accepted));
        }
        if self.remove_outliers.is_none() {
            warnings.extend(outlier_warning(grid, &heights));
        }
        let mut removed = 0;
        if let Some(threshold) = self.remove_outliers {
            removed = outliers::remove(grid, &mut heights, repeats, threshold)?;
            let fraction = share(removed, grid);
            history
                .push(format!("outliers beyond {threshold} robust standard deviations: {removed} removed{fraction}"));
        }
        // Before points are filled: at an edge the filled ones of a tilted map would stand out of the levelled one.
        if let Some(kind) = self.detrend {
            history.push(subtract_form(kind, grid, &mut heights, &self.unit)?);
        }
        let filled = fill::fill(self.fill, grid, &mut heights, repeats, fill::Origin { column, row, removed })?;
        if let Some(kind) = self.fill {
            history.push(format!("fill {}: {filled}{}", kind.word(), share(filled, grid)));
        }
        if let Some(to) = self.extend_to.filter(|_| self.low_pass.is_none()) {
            let accepted = "only together with --low-pass, the wavelength down to which the map is trusted";
            return Err(Error::input("preparation", "--extend-to", to, accepted));
        }
        let filter = filter::check(self.filter, [self.low_pass, self.high_pass], (grid, &self.unit), repeats)?;
        let mut fit = None;
        for band in [self.low_pass.map(PassBand::Long), self.high_pass.map(PassBand::Short)].into_iter().flatten() {
            let previous = rms(&heights);
            filter::apply(filter, band, grid, &mut heights, repeats);
            let (previous, now) = (digits(previous), in_unit(digits(rms(&heights)), &self.unit));
            history.push(format!("{} {}: rms height {previous} to {now}", band.words(&self.unit), filter.word()));
            // Before later steps change the spectrum.
            if let (Some(_), PassBand::Long(cut_off)) = (self.extend_to, band) {
                fit = Some(extend::fit((filter, cut_off), grid, &heights, repeats)?);
            }
        }
        if let Some(points) = self.resample {
            let (method, from) = (regrid::method(grid, points, repeats), [grid.nx, grid.ny]);
            (grid, heights) = regrid(grid, heights, points, repeats)?;
            history
                .push(format!("resample: {} x {} to {} x {} points by {method}", from[0], from[1], grid.nx, grid.ny));
        }
        if let Some(kind) = self.edges {
            let line = kind.line(grid);
            (grid, heights) = kind.make(grid, heights);
            history.push(line);
        }
        if let (Some(to), Some(fit), Some(cut_off)) = (self.extend_to, fit, self.low_pass) {
            let (repeats, law) = (repeats || self.edges.is_some(), (filter, cut_off, self.unit.as_str()));
            let line;
            (grid, heights, line) = fit.extend(law, (to, self.seed), grid, heights, repeats)?;
            history.push(line);
            warnings.extend(fit.warning(&self.unit));
        }
        if self.isotropic_map {
            let (line, doubt);
            (grid, heights, line, doubt) = isotropic::map((grid, &self.unit), &heights, repeats, self.seed)?;
            history.push(line);
            warnings.extend(doubt);
        }
        if grid.nx == 1 && grid.ny > 1 {
            let accepted = "a map of several columns, or a profile (--profile)";
            return Err(Error::input("map", "heights", format!("one column of {} points", grid.ny), accepted));
        }
        let map = HeightMap::new("prepared map", grid.nx, grid.ny, heights)?;
        Ok(PreparedMap { map, extent: [grid.lx, grid.ly], filled, history, warnings })
    }
}

/// " of N points (P %)".
fn share(part: usize, grid: Grid) -> String {
    format!(" of {} points ({} %)", grid.points(), digits(100.0 * part as f64 / grid.points() as f64))
}

//! Maps as PNG: x to the right, y upwards (the first row of a field is the lowest line of the picture).
//!
//! Large maps are reduced by block means, small ones enlarged by integer factors. The lightness of CIVIDIS increases
//! monotonically and the four colours of a superposition differ in lightness, so pictures are also readable in
//! greyscale and with colour vision deficiency.

use std::path::Path;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};

use crate::record::downsample::{DownsampledMap, Downsampler};
use asperity_grid::error::{Error, Result};
use asperity_surface::files::npy;

pub type Rgb = [u8; 3];

/// Colours of Okabe and Ito, with the same roles on every page.
pub const WHITE: Rgb = [255, 255, 255];
pub const BLACK: Rgb = [0, 0, 0];
/// Reference for comparisons.
pub const GREY: Rgb = [140, 140, 140];
pub const ORANGE: Rgb = [230, 159, 0];
pub const BLUE: Rgb = [0, 114, 178];
pub const VERMILION: Rgb = [213, 94, 0];
pub const GREEN: Rgb = [0, 158, 115];
pub const PURPLE: Rgb = [204, 121, 167];

/// Maximum side of a picture, and the side up to which small grids are enlarged, pixels.
pub const LONGEST_SIDE: usize = 800;
pub const SMALLEST_SIDE: usize = 320;

/// Pixels, row-major from the top, as in image files.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    pub width: usize,
    pub height: usize,
    pixels: Vec<Rgb>,
    /// Cells along x, and the values shown, row-major from the lowest row. Contact: 0 or 1; superposed: 0 none,
    /// 1 only the continuum, 2 only the atoms, 3 both; gap: NaN in contact.
    pub nx: usize,
    pub values: Vec<f64>,
    /// Colour of contact in a contact map of one source.
    pub contact: Option<Rgb>,
    /// Colours and meanings, drawn below the map.
    pub key: &'static [(Rgb, &'static str)],
}

/// Values at the ends of a colour bar; values outside are clamped.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct ColourRange {
    pub low: f64,
    pub high: f64,
}

impl ColourRange {
    /// Range from the lowest value to the quantile `1 − clip`, so that single peaks do not darken the whole map. A
    /// constant field gets a range of width one.
    pub fn of<'a>(values: impl IntoIterator<Item = &'a f64>, clip: f64) -> Self {
        let mut sorted: Vec<f64> = values.into_iter().copied().filter(|v| v.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        let (Some(&low), Some(&last)) = (sorted.first(), sorted.last()) else {
            return ColourRange { low: 0.0, high: 1.0 };
        };
        let kept = ((1.0 - clip) * sorted.len() as f64).ceil() as usize;
        let high = sorted[kept.clamp(1, sorted.len()) - 1];
        // If only few values differ from the rest, the range ends at the highest value.
        let high = if high > low { high } else { last };
        if high > low { ColourRange { low, high } } else { ColourRange { low, high: low + 1.0 } }
    }

    fn share(self, value: f64) -> f64 {
        ((value - self.low) / (self.high - self.low)).clamp(0.0, 1.0)
    }
}

/// Colour of a normalised value between 0 (dark) and 1 (light).
pub fn colour(fraction: f64) -> Rgb {
    let c = colorous::CIVIDIS.eval_continuous(fraction);
    [c.r, c.g, c.b]
}

/// Darkest normalised value of the ramp used with contact in black; the two also differ in greyscale.
const DARKEST: f64 = 0.3;

/// Colour of a normalised value if contact is black.
pub fn over_contact(fraction: f64) -> Rgb {
    colour(DARKEST + (1.0 - DARKEST) * fraction)
}

/// Reads a field file and reduces it to at most `longest` cells along a side; `of` is applied to each node first.
/// Only one row is in memory at a time.
pub fn load(path: &Path, longest: usize, select: impl Fn(f64) -> f64) -> Result<DownsampledMap> {
    let reader = npy::NpyReader::open(path)?;
    let mut reducer = Downsampler::new(reader.nx, reader.ny, longest);
    let mut seen = Vec::with_capacity(reader.nx);
    let mut bad = None;
    reader.for_each_row(|y, row| {
        seen.clear();
        seen.extend(row.iter().map(|&v| select(v)));
        if let Some(x) = row.iter().position(|v| !v.is_finite()) {
            bad.get_or_insert((y, x, row[x]));
        }
        reducer.add_row(y, &seen);
    })?;
    match bad {
        Some((y, x, value)) => Err(Error::format(
            path,
            format!("{value} in row {}, column {} (counted from 1)", y + 1, x + 1),
            "finite numbers",
        )),
        None => Ok(reducer.finish()),
    }
}

/// A continuous map in CIVIDIS; low values are dark.
pub fn map(small: &DownsampledMap, range: ColourRange) -> Picture {
    Picture::from_cells(small.nx, small.values.clone(), |i| colour(range.share(small.values[i])))
}

/// Refuses two maps that are drawn over one another and have different shapes.
fn of_one_grid(one: &DownsampledMap, other: &DownsampledMap) -> Result<()> {
    if (one.nx, one.ny) == (other.nx, other.ny) {
        return Ok(());
    }
    let found = format!("maps of {} x {} and {} x {} cells", one.nx, one.ny, other.nx, other.ny);
    Err(Error::format("two maps of one figure", found, "maps of the same grid"))
}

/// A gap map with contact (from the contact fraction of each cell) in black; small gaps are dark.
///
/// # Errors
/// `Format` for maps of different shapes.
pub fn gap(small: &DownsampledMap, range: ColourRange, contact: &DownsampledMap) -> Result<Picture> {
    of_one_grid(small, contact)?;
    let values = small.values.iter().enumerate().map(|(i, v)| if touches(contact, i) { f64::NAN } else { *v });
    Ok(Picture::from_cells(small.nx, values.collect(), |i| {
        if touches(contact, i) { BLACK } else { over_contact(range.share(small.values[i])) }
    }))
}

/// 1 for true; for maps of flags.
pub fn flag(yes: bool) -> f64 {
    f64::from(u8::from(yes))
}

/// Whether a cell of a reduced contact map is drawn as contact: at least half of its nodes are in contact.
pub fn touches(small: &DownsampledMap, i: usize) -> bool {
    small.values[i] >= 0.5
}

/// A contact map from the contact fraction of each cell: contact in `colour`, on white.
pub fn contact(small: &DownsampledMap, colour: Rgb) -> Picture {
    let flags = (0..small.values.len()).map(|i| flag(touches(small, i))).collect();
    let picture = Picture::from_cells(small.nx, flags, |i| if touches(small, i) { colour } else { WHITE });
    Picture { contact: Some(colour), ..picture }
}

/// Superposition of two contact maps: black where both are in contact, orange for the continuum only, blue for the atoms only.
///
/// # Errors
/// `Format` for maps of different shapes.
pub fn superposed(continuum: &DownsampledMap, atoms: &DownsampledMap) -> Result<Picture> {
    of_one_grid(continuum, atoms)?;
    let code = |i| f64::from(u8::from(touches(continuum, i)) + 2 * u8::from(touches(atoms, i)));
    let colour = |i| match (touches(continuum, i), touches(atoms, i)) {
        (true, true) => BLACK,
        (true, false) => ORANGE,
        (false, true) => BLUE,
        (false, false) => WHITE,
    };
    Ok(Picture::from_cells(continuum.nx, (0..continuum.values.len()).map(code).collect(), colour))
}

impl Picture {
    fn from_cells(nx: usize, values: Vec<f64>, colour: impl Fn(usize) -> Rgb) -> Self {
        let ny = values.len() / nx;
        let factor = SMALLEST_SIDE.div_ceil(nx.max(ny)).min(LONGEST_SIDE / nx.max(ny).max(1)).max(1);
        let (width, height) = (nx * factor, ny * factor);
        let mut pixels = Vec::with_capacity(width * height);
        for y in (0..ny).rev() {
            let start = pixels.len();
            for x in 0..nx {
                pixels.extend(std::iter::repeat_n(colour(y * nx + x), factor));
            }
            for _ in 1..factor {
                pixels.extend_from_within(start..start + width);
            }
        }
        Picture { width, height, pixels, nx, values, contact: None, key: &[] }
    }

    /// With colours and their meanings below the map.
    pub fn keyed(self, key: &'static [(Rgb, &'static str)]) -> Self {
        Picture { key, ..self }
    }

    /// PNG file contents, 8-bit RGB.
    pub fn png(&self) -> std::io::Result<Vec<u8>> {
        png(self.pixels.as_flattened(), (self.width, self.height), ExtendedColorType::Rgb8)
    }
}

/// PNG file contents.
pub(super) fn png(bytes: &[u8], size: (usize, usize), kind: ExtendedColorType) -> std::io::Result<Vec<u8>> {
    let mut file = Vec::new();
    PngEncoder::new_with_quality(&mut file, CompressionType::Default, FilterType::Adaptive)
        .write_image(bytes, size.0 as u32, size.1 as u32, kind)
        .map_err(std::io::Error::other)?;
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    impl Picture {
        /// Colour of a pixel, counted from the upper left corner.
        fn at(&self, x: usize, y: usize) -> Rgb {
            self.pixels[y * self.width + x]
        }
    }

    fn small(nx: usize, values: &[f64]) -> DownsampledMap {
        DownsampledMap { nx, ny: values.len() / nx, factor: 1, values: values.to_vec() }
    }

    #[test]
    fn the_first_row_is_at_the_bottom_and_small_maps_are_enlarged() {
        let picture = map(&small(2, &[0.0, 1.0, 1.0, 1.0]), ColourRange { low: 0.0, high: 1.0 });
        assert_eq!((picture.width, picture.height), (320, 320));
        assert_eq!(picture.at(0, 319), colour(0.0));
        assert_eq!(picture.at(319, 319), colour(1.0));
        assert_eq!(picture.at(0, 0), colour(1.0));
    }

    /// The Rec. 709 luma values of the four colours of a superposition differ by at least a fifth of the scale.
    #[test]
    fn a_superposition_reads_in_grey() {
        let luma = |c: Rgb| 0.2126 * f64::from(c[0]) + 0.7152 * f64::from(c[1]) + 0.0722 * f64::from(c[2]);
        let greys = [BLACK, BLUE, ORANGE, WHITE].map(luma);
        assert!(greys.windows(2).all(|w| w[1] - w[0] > 0.2 * 255.0), "{greys:?}");
        let a = small(4, &[1.0, 1.0, 0.0, 0.4]);
        let b = small(4, &[0.5, 0.0, 1.0, 0.0]);
        let picture = superposed(&a, &b).unwrap();
        assert!(superposed(&a, &small(2, &a.values)).unwrap_err().to_string().contains("4 x 1 and 2 x 2"));
        let quarter = picture.width / 4;
        assert_eq!([0, 1, 2, 3].map(|i| picture.at(i * quarter, 0)), [BLACK, ORANGE, BLUE, WHITE]);
    }

    /// Contact is darker than any gap by at least a sixth of the scale.
    #[test]
    fn contact_reads_in_grey() {
        let luma = |c: Rgb| 0.2126 * f64::from(c[0]) + 0.7152 * f64::from(c[1]) + 0.0722 * f64::from(c[2]);
        let steps: Vec<f64> = (0..=20).map(|i| luma(over_contact(f64::from(i) / 20.0))).collect();
        assert!(steps[0] > 255.0 / 6.0 && steps.windows(2).all(|w| w[1] > w[0]), "{steps:?}");
        let range = ColourRange { low: 0.0, high: 1.0 };
        let picture = gap(&small(2, &[0.0, 0.0, 1.0, 1.0]), range, &small(2, &[1.0, 0.0, 0.0, 0.0])).unwrap();
        assert_eq!([picture.at(0, 319), picture.at(319, 319)], [BLACK, over_contact(0.0)]);
    }

    #[test]
    fn a_range_leaves_out_peaks_but_never_collapses() {
        let mut values: Vec<f64> = (0..1000).map(f64::from).collect();
        values[7] = 1e9;
        assert_eq!(ColourRange::of(&values, 0.002), ColourRange { low: 0.0, high: 998.0 });
        assert_eq!(ColourRange::of(&[2.0; 3], 0.0), ColourRange { low: 2.0, high: 3.0 });
        let mut flat = [0.0; 1000];
        flat[1] = 5.0;
        assert_eq!(ColourRange::of(&flat, 0.01), ColourRange { low: 0.0, high: 5.0 });
        assert_eq!(ColourRange::of([].iter(), 0.0), ColourRange { low: 0.0, high: 1.0 });
    }

    #[test]
    fn a_png_is_one() {
        let png = contact(&small(3, &[0.0, 1.0, 0.0]), BLACK).png().unwrap();
        assert!(png.starts_with(b"\x89PNG"));
        let decoded = image::load_from_memory(&png).unwrap();
        assert_eq!((decoded.width(), decoded.height()), (321, 107));
    }
}

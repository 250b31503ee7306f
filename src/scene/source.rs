use crate::grid::{Grid, rms};
use crate::record::heights::{HeightMap, Sign};
use crate::record::import::{self, Content, Fourier, ImportOptions};
use crate::surface::{FourierModes, Modes, Spectrum, lower_to_zero, resample};
use crate::{Error, Result};
use std::path::Path;

/// Where heights come from: a rule that gives them on any grid, or a map that is resampled.
#[derive(Debug, Clone)]
pub enum Surface {
    Synthesised {
        modes: Modes,
        spectrum: Spectrum,
        seed: u64,
    },
    /// Reduced heights (unit: the cell's extent in x), low points touch first.
    Imported {
        grid: Grid,
        heights: Vec<f64>,
        origin: String,
    },
    /// Fourier coefficients, which give heights on any grid that holds them.
    Fourier {
        modes: FourierModes,
        origin: String,
    },
}

/// What a file of heights or of Fourier coefficients is to be taken for.
#[derive(Debug, Clone, Copy)]
pub struct SurfaceFile<'a> {
    pub asked: ImportOptions<'a>,
    /// Points per side of the grid that an FFTW transform was of.
    pub fourier_points: Option<usize>,
    pub sign: Sign,
    /// Unit of the file's heights over the cell's extent in x.
    pub unit: f64,
    /// Shortest wave that is kept of a file of coefficients, over the cell's extent; 0 for all.
    pub low_pass: f64,
    /// How the keys of a complaint are called: as flags, or as keys of a scene.
    pub low_pass_key: &'a str,
    /// The sign's key and what it says, for a file that declares another.
    pub sign_key: (&'a str, &'a str),
    /// The heights' unit in µm and its key, where they have one: a file that declares another is refused.
    pub unit_um: Option<(f64, &'a str)>,
    /// Named in complaints about the keys.
    pub place: &'a str,
    /// How the unit is told.
    pub unit_words: &'a str,
}

/// Share by which a unit may be off the one that a file declares.
const UNIT_OFF: f64 = 1e-9;

impl Surface {
    pub fn synthesised(spectrum: Spectrum, seed: u64) -> Self {
        Surface::Synthesised { modes: Modes::new(spectrum, seed, 1.0), spectrum, seed }
    }

    /// Reads a file, lowest point at 0, low points touching first.
    ///
    /// # Errors
    /// Those of [`import::read`] and [`FourierModes::new`], a declared sign or unit that is not the one asked for, waves that the
    /// transform's own grid does not hold, a low pass for what has no waves.
    pub fn read(path: &Path, ask: SurfaceFile) -> Result<Self> {
        let found = import::read(path, ask.asked)?;
        if let Some(says) = found.declared.sign.filter(|s| *s != ask.sign) {
            let (key, value) = ask.sign_key;
            let accepted = format!("what {} declares: {}", path.display(), says.words());
            return Err(Error::input(ask.place, key, value, accepted));
        }
        if let (Some((um, key)), Some(says)) = (ask.unit_um, found.declared.unit_um())
            && (um / says - 1.0).abs() > UNIT_OFF
        {
            let unit = found.declared.unit.as_deref().unwrap_or_default();
            let accepted = format!("{says}, as {} declares its heights in {unit}", path.display());
            return Err(Error::input(ask.place, key, um, accepted));
        }
        let declared = found.declared.unit.map_or(String::new(), |u| format!(" (the file declares {u:?})"));
        let told = |what: String| {
            format!("read from {}: {what}; heights {}{declared}, {}", path.display(), ask.unit_words, ask.sign.words())
        };
        match found.content {
            Content::Map(_) if ask.low_pass > 0.0 => {
                let accepted = format!("none: {} is a height map", path.display());
                Err(Error::input(ask.place, ask.low_pass_key, "given", accepted))
            }
            Content::Map(map) => {
                let mut map = map.low_first(ask.sign);
                map.heights.iter_mut().for_each(|h| *h *= ask.unit);
                Ok(Surface::imported(map, told(found.layout)))
            }
            Content::Waves(waves) => {
                let points = match ask.asked.fourier {
                    Some(Fourier::Fftw) => ask.fourier_points,
                    _ => None,
                };
                let beyond = |w: &&import::Wave| {
                    points.is_some_and(|n| 2 * w.kx.unsigned_abs().max(w.ky.unsigned_abs()) as usize >= n)
                };
                if let (Some(n), Some(w)) = (points, waves.iter().find(beyond)) {
                    let found = format!("q = ({}, {})", w.kx, w.ky);
                    return Err(Error::format(
                        path,
                        found,
                        format!("waves below half of the {n} points of --fourier-points"),
                    ));
                }
                let sign = if ask.sign == Sign::HighFirst { -1.0 } else { 1.0 };
                let scale = points.map_or(1.0, |n| (n as f64).powi(-2));
                let modes = FourierModes::new(path, &waves, sign * scale * ask.unit, ask.low_pass)?;
                let sum = match points {
                    None => "coefficients a of h(r) = Σ a exp(iq·r)".to_string(),
                    Some(n) => format!("n² a of h(r) = Σ a exp(iq·r), n = {n}"),
                };
                let origin = told(format!("{}, {sum}, {}", found.layout, modes.summary()));
                Ok(Surface::Fourier { modes, origin })
            }
        }
    }

    /// `map` is in lengths of the cell.
    pub fn imported(map: HeightMap, origin: String) -> Self {
        Surface::Imported { grid: Grid::unit(map.nx, map.ny), heights: map.heights, origin }
    }

    /// Heights `[ny, nx]`, lowest at 0, with the modes whose wavelength is at least `low_pass` (0 for all that the grid
    /// holds).
    pub fn heights(&self, grid: Grid, low_pass: f64) -> Vec<f64> {
        let mut heights: Vec<f64> = match self {
            Surface::Synthesised { modes, .. } => modes.heights(grid, low_pass),
            Surface::Imported { grid: own, heights, .. } if *own == grid && low_pass == 0.0 => heights.clone(),
            Surface::Imported { grid: own, heights, .. } => resample(*own, heights, grid, low_pass),
            Surface::Fourier { modes, .. } => modes.heights(grid, low_pass),
        };
        lower_to_zero(&mut heights);
        heights
    }

    /// Root mean square about the mean, over L; of a spectrum what is expected of it.
    pub fn rms_height(&self) -> f64 {
        match self {
            Surface::Synthesised { spectrum, .. } => spectrum.expected(1.0, 0.0).rms_height,
            Surface::Imported { heights, .. } => rms(heights),
            Surface::Fourier { modes, .. } => modes.series().rms(),
        }
    }

    /// One line for the report.
    pub fn origin(&self) -> String {
        match self {
            Surface::Synthesised { seed, .. } => format!("synthesised from its spectrum, seed {seed}"),
            Surface::Imported { origin, .. } | Surface::Fourier { origin, .. } => origin.clone(),
        }
    }
}

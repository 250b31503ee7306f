use crate::record::import::{self, Fourier, ImportOptions};
use crate::scene::{ContinuumScene, KeyName, Laboratory, SurfaceScene, Touching, Units};
use crate::surface::{Detrend, Edges, Fill, FilterKind};
use crate::units::{Measure, metres_per};
use crate::{Error, Result};
use std::path::Path;

pub(super) const COMMAND_LINE: &str = "command line";

/// Keys of a surface file and its preparation and their flags, in every command; of keys that begin alike the longest
/// first.
pub(super) const FILE_FLAGS: [KeyName; 20] = [
    ("laboratory.length_um", "--length"),
    ("laboratory.length_y_um", "--length-y"),
    ("surface.heights_unit_um", "--unit"),
    ("surface.heights", "--heights"),
    ("surface.unit", "--unit"),
    ("surface.dataset", "--dataset"),
    ("surface.fourier_points", "--fourier-points"),
    ("surface.fourier", "--fourier"),
    ("surface.low_pass_um", "--low-pass"),
    ("surface.high_pass_um", "--high-pass"),
    ("surface.filter", "--filter"),
    ("surface.touching", "--touching"),
    ("surface.crop", "--crop"),
    ("surface.remove_outliers", "--remove-outliers"),
    ("surface.fill", "--fill"),
    ("surface.detrend", "--detrend"),
    ("surface.resample", "--resample"),
    ("surface.edges", "--edges"),
    ("surface.strict", "--strict"),
    ("continuum.periodic = false", "--non-periodic"),
];

/// Properties of a surface file that its contents do not contain.
#[derive(Debug, Clone, Default, clap::Args)]
#[command(next_help_heading = "Surface")]
pub(super) struct FileFlags {
    /// Name of the array or channel in a file with several.
    #[arg(long, value_name = "NAME")]
    pub dataset: Option<String>,
    /// Kind of the coefficients in four columns qX qY Re Im; required for them.
    #[arg(long, value_enum)]
    pub fourier: Option<Fourier>,
    /// Points per side of the transform's grid, with --fourier fftw.
    #[arg(long, value_name = "N")]
    pub fourier_points: Option<usize>,
}

impl FileFlags {
    pub(super) fn are_waves(&self) -> bool {
        self.fourier.is_some_and(Fourier::are_waves)
    }
}

/// What is not declared in a surface file, and the preparation of its map.
#[derive(Debug, Clone, clap::Args)]
#[command(next_help_heading = "Surface")]
pub(super) struct MapFlags {
    /// Points of the file that touch first; required unless the file declares it.
    #[arg(long, value_enum)]
    pub touching: Option<Touching>,
    /// As --touching high-points.
    #[arg(long, hide = true, conflicts_with = "touching")]
    pub flip: bool,
    /// Unit of the heights in the file: m, mm, um, nm, Å. Default: what the file declares.
    #[arg(long, value_name = "UNIT")]
    pub unit: Option<String>,
    /// Extent of the file's map in x, in the unit of the heights or with its own (20um). Default: what the file declares.
    #[arg(long, value_name = "L")]
    pub length: Option<Measure>,
    /// Extent in y. Default: what the file declares, or square pixels.
    #[arg(long, value_name = "L")]
    pub length_y: Option<Measure>,
    /// Solve the map as the only rough part of a half-space that is free around it, not as a periodic cell.
    #[arg(long)]
    pub non_periodic: bool,
    /// Keep a part of the map: first column, first row, columns, rows.
    #[arg(long, value_name = "X,Y,NX,NY", value_delimiter = ',', num_args = 1)]
    pub crop: Vec<usize>,
    /// Points that deviate from the median of their neighbourhood by more than SD robust standard deviations become missing points.
    #[arg(long, value_name = "SD")]
    pub remove_outliers: Option<f64>,
    /// Fill missing points.
    #[arg(long, value_enum)]
    pub fill: Option<Fill>,
    /// Subtract the mean, the mean plane, or a polynomial of second order.
    #[arg(long, value_enum)]
    pub detrend: Option<Detrend>,
    /// Remove wavelengths below this one.
    #[arg(long, value_name = "LAMBDA")]
    pub low_pass: Option<Measure>,
    /// Remove wavelengths above this one.
    #[arg(long, value_name = "LAMBDA")]
    pub high_pass: Option<Measure>,
    /// Transfer function of these filters.
    #[arg(long, value_enum)]
    pub filter: Option<FilterKind>,
    /// Resample to this number of columns and rows.
    #[arg(long, value_name = "NX,NY", value_delimiter = ',', num_args = 1)]
    pub resample: Vec<usize>,
    /// Make a map periodic that is not.
    #[arg(long, value_enum)]
    pub edges: Option<Edges>,
    /// Warnings about the surface are errors.
    #[arg(long)]
    pub strict: bool,
}

impl MapFlags {
    /// The first of these flags that is given and that a synthesised surface does not have.
    pub(super) fn of_maps(&self) -> Option<&'static str> {
        let given = [
            ("--touching", self.touching.is_some() || self.flip),
            ("--unit", self.unit.is_some()),
            ("--length-y", self.length_y.is_some()),
            ("--crop", !self.crop.is_empty()),
            ("--remove-outliers", self.remove_outliers.is_some()),
            ("--fill", self.fill.is_some()),
            ("--detrend", self.detrend.is_some()),
            ("--low-pass", self.low_pass.is_some()),
            ("--high-pass", self.high_pass.is_some()),
            ("--filter", self.filter.is_some()),
            ("--resample", !self.resample.is_empty()),
            ("--edges", self.edges.is_some()),
        ];
        given.into_iter().find(|(_, given)| *given).map(|(flag, _)| flag)
    }

    /// Sets the keys of a scene from the flags that are given.
    ///
    /// # Errors
    /// Lists of the wrong length, lengths whose unit cannot be converted.
    pub(super) fn set(
        &self,
        s: &mut SurfaceScene,
        lab: &mut Laboratory,
        continuum: &mut ContinuumScene,
        lengths: &Lengths,
    ) -> Result<()> {
        let flip = self.flip.then_some(Touching::HighPoints);
        s.touching = self.touching.or(flip).or(s.touching);
        if self.unit.is_some() {
            (s.unit, s.heights_unit_um) = (self.unit.clone(), None);
        }
        for (flag, given, to) in [
            ("--length", &self.length, &mut lab.length_um),
            ("--length-y", &self.length_y, &mut lab.length_y_um),
            ("--low-pass", &self.low_pass, &mut s.low_pass_um),
            ("--high-pass", &self.high_pass, &mut s.high_pass_um),
        ] {
            *to = given.as_ref().map(|m| lengths.of(flag, m)).transpose()?.or(*to);
        }
        s.crop = numbers("--crop", &self.crop, "four numbers: X,Y,NX,NY")?.or(s.crop);
        s.resample = numbers("--resample", &self.resample, "two numbers: NX,NY")?.or(s.resample);
        s.remove_outliers = self.remove_outliers.or(s.remove_outliers);
        s.fill = self.fill.or(s.fill);
        s.detrend = self.detrend.or(s.detrend);
        s.filter = self.filter.or(s.filter);
        s.edges = self.edges.or(s.edges);
        s.strict |= self.strict;
        if self.non_periodic {
            continuum.periodic = Some(false);
        }
        Ok(())
    }

    /// Whether a length has a unit of its own, so that the unit of the heights is needed.
    fn has_units(&self) -> bool {
        let lengths = [&self.length, &self.length_y, &self.low_pass, &self.high_pass];
        lengths.into_iter().flatten().any(|m| m.unit.is_some())
    }
}

fn numbers<const N: usize>(flag: &str, given: &[usize], accepted: &str) -> Result<Option<[usize; N]>> {
    if given.is_empty() {
        return Ok(None);
    }
    let wrong = |_| Error::input(COMMAND_LINE, flag, format!("{} numbers", given.len()), accepted);
    given.to_vec().try_into().map(Some).map_err(wrong)
}

/// Conversion of lengths on the command line to those of a scene.
pub(super) struct Lengths {
    /// Metres of one unit of the heights, where it is known.
    pub heights_m: Option<f64>,
    units: Units,
}

impl Lengths {
    /// With the unit of the heights: the given one, or the one that the file declares. The file is read only where lengths have units
    /// or the scene's lengths are not those of the heights.
    pub(super) fn new(
        file: Option<&Path>,
        of: &FileFlags,
        flags: &MapFlags,
        units: Units,
        needed: bool,
    ) -> Result<Self> {
        let given = flags.unit.as_deref().and_then(metres_per);
        let plain = flags.length.is_some() || flags.length_y.is_some();
        let needed = needed || flags.has_units() || units == Units::Named && plain;
        let heights_m = match file.filter(|_| given.is_none() && needed) {
            Some(file) => {
                let options = ImportOptions { dataset: of.dataset.as_deref(), fourier: of.fourier };
                import::read(file, options)?.declared.unit_m()
            }
            None => given,
        };
        Ok(Lengths { heights_m, units })
    }

    /// A length in the unit of the scene; a plain one is in the unit of the heights.
    pub(super) fn of(&self, flag: &str, length: &Measure) -> Result<f64> {
        let metres = match &length.unit {
            None => match (self.units, self.heights_m) {
                (Units::Named, Some(metres)) => return Ok(length.value * (metres / 1e-6)),
                // Without a unit of the heights the file is refused anyway.
                _ => return Ok(length.value),
            },
            Some(unit) => metres_per(unit).ok_or_else(|| {
                let found = format!("{} {unit}", length.value);
                Error::input(COMMAND_LINE, flag, found, "a unit of length: m, mm, um, nm, Å")
            })?,
        };
        match (self.units, self.heights_m) {
            (Units::Named, _) => Ok(length.value * (metres / 1e-6)),
            (Units::Consistent, Some(heights)) => Ok(length.value * (metres / heights)),
            (Units::Consistent, None) => {
                let found = format!("{} {}", length.value, length.unit.as_deref().unwrap_or_default());
                let accepted = "a number in the unit of the heights, or --unit, which the file does not declare";
                Err(Error::input(COMMAND_LINE, flag, found, accepted))
            }
        }
    }
}

/// A height map has its own grid.
pub(super) fn refuse_grid(grid: Option<usize>, file: Option<&Path>, is_map: bool) -> Result<()> {
    match (grid, file.filter(|_| is_map)) {
        (Some(n), Some(file)) => {
            let accepted =
                format!("none: {} is a height map with points of its own; --resample changes them", file.display());
            Err(Error::input(COMMAND_LINE, "--grid", n, accepted))
        }
        _ => Ok(()),
    }
}

use crate::scene::{
    AccuracyScene, ContinuumScene, Converter, DetrendScene, LaboratoryScene, Length, OtherScene, SurfaceScene, Time,
    last_part, metres_of, read_heights,
};
use crate::{Error, Result};
use asperity_contact::problem::ErrorTargets;
use asperity_grid::units::{Dimension, MAX_SECONDS, Measure, Measures};
use asperity_surface::heights::Touching;
use asperity_surface::import::{Fourier, ImportOptions, ImportedFile};
use asperity_surface::{Edges, Fill, FilterKind};
use std::path::{Path, PathBuf};

pub(super) const COMMAND_LINE: &str = "command line";

/// The flag of a command that sets a key of scenes, if it has one.
pub(super) fn flag_of<A: clap::Args>(key: &str) -> Option<String> {
    let name = match key {
        "continuum.periodic" => "non-periodic".to_string(),
        "surface.other" | "surface.other.heights" => "other".into(),
        _ if key.starts_with("laboratory.bodies") => "body".into(),
        _ if key.starts_with("surface.other.") => format!("other-{}", last_part(key).replace('_', "-")),
        _ => last_part(key).replace('_', "-"),
    };
    let command = A::augment_args(clap::Command::new(""));
    command.get_arguments().any(|arg| arg.get_long() == Some(&name)).then(|| format!("--{name}"))
}

/// Properties of a surface file that its contents do not contain.
#[derive(Debug, Clone, Default, clap::Args)]
#[command(next_help_heading = "Surface")]
pub(super) struct FileFlags {
    /// Name of the array or channel in a file with several.
    #[arg(long, value_name = "NAME")]
    pub dataset: Option<String>,
    /// Read a file of an instrument, or a container of contact.engineering, by SurfaceTopography in the Python that ASPERITY_PYTHON names, or
    /// python3: pip install "asperity[files]".
    #[arg(long)]
    pub via_python: bool,
    /// The file is a profile: positions and heights in two columns, or one line of heights. The surface is uniform along y (line contact).
    #[arg(long)]
    pub profile: bool,
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

    /// Puts what was given into the surface of a scene.
    pub(super) fn set(&self, surface: &mut SurfaceScene) {
        if self.fourier.is_some() {
            // Those of other coefficients.
            surface.fourier_points = None;
        }
        surface.dataset = self.dataset.clone().or(surface.dataset.take());
        surface.via_python |= self.via_python;
        surface.profile |= self.profile;
        surface.fourier = self.fourier.or(surface.fourier);
        surface.fourier_points = self.fourier_points.or(surface.fourier_points);
    }

    /// The file as these flags have it.
    ///
    /// # Errors
    /// Those of [`read_heights`].
    pub(super) fn read(&self, file: &Path, touching: Option<Touching>) -> Result<ImportedFile> {
        let options = ImportOptions { dataset: self.dataset.as_deref(), fourier: self.fourier, profile: self.profile };
        let converter = self.via_python.then(|| Converter { touching, ..Converter::default() });
        read_heights(file, options, converter.as_ref())
    }
}

/// What is not declared in a surface file, and the preparation of its map.
#[derive(Debug, Clone, clap::Args)]
#[command(next_help_heading = "Surface")]
pub(super) struct MapFlags {
    /// Points of the file that touch first; required unless the file declares it.
    #[arg(long, value_enum)]
    pub touching: Option<Touching>,
    /// Unit of the heights in the file: m, mm, um, nm, Å. Default: what the file declares.
    #[arg(long, value_name = "UNIT")]
    pub unit: Option<String>,
    /// Extent of the cell in x, with a unit (20um) or in that of the heights. Default: what the file declares.
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
    /// Subtract the mean, plane, quadratic (polynomial of second order) or facets (plane in which most of the surface lies); level each scan
    /// line by line-median, line-linear or line-quadratic; or subtract the plane three-points=X1,Y1;X2,Y2;X3,Y3 through the mean heights next
    /// to three points, from the first point of the map.
    #[arg(long, value_name = "FORM")]
    pub detrend: Option<DetrendScene<Measure>>,
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
    /// Add waves below --low-pass, down to which the map is trusted, to this wavelength: a realisation, by --seed, of the self-affine spectrum
    /// that is fitted to its waves above.
    #[arg(long, value_name = "LAMBDA", requires = "low_pass")]
    pub extend_to: Option<Measure>,
    /// Instead of a surface that is uniform along y, of a --profile: one realisation, by --seed, of the isotropic random surface whose profiles
    /// have its spectrum. The cell is a square of its length, and repeats.
    #[arg(long)]
    pub isotropic_map: bool,
    /// Warnings about the surface are errors, and so is an accuracy that is not reached.
    #[arg(long)]
    pub strict: bool,
    #[command(flatten)]
    pub other_body: OtherFlags,
}

impl MapFlags {
    /// The first of these flags that is given and that a synthesised surface does not have.
    pub(super) fn of_maps(&self) -> Option<&'static str> {
        let options = [
            ("--touching", self.touching.is_some()),
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
            ("--extend-to", self.extend_to.is_some()),
            ("--isotropic-map", self.isotropic_map),
        ];
        options.into_iter().find(|(_, options)| *options).map(|(flag, _)| flag).or(self.other_body.given())
    }

    /// Sets the keys of a scene from the flags that are given.
    ///
    /// # Errors
    /// Lists of the wrong length, lengths whose unit cannot be converted.
    pub(super) fn set(
        &self,
        s: &mut SurfaceScene,
        lab: &mut LaboratoryScene,
        continuum: &mut ContinuumScene,
        in_scene: &dyn Fn(&str, Measure) -> Result<Length>,
    ) -> Result<()> {
        s.touching = self.touching.or(s.touching);
        s.unit = self.unit.clone().or(s.unit.take());
        let to = [&mut lab.length, &mut lab.length_y, &mut s.low_pass, &mut s.high_pass, &mut s.extend_to];
        for ((flag, value), to) in self.lengths().into_iter().zip(to) {
            *to = value.map(|m| in_scene(flag, m)).transpose()?.or(*to);
        }
        s.crop = numbers("--crop", &self.crop, "four numbers: X,Y,NX,NY")?.or(s.crop);
        s.resample = numbers("--resample", &self.resample, "two numbers: NX,NY")?.or(s.resample);
        s.remove_outliers = self.remove_outliers.or(s.remove_outliers);
        s.fill = self.fill.or(s.fill);
        if let Some(form) = self.detrend {
            s.detrend = Some(form.try_map(|m| in_scene("--detrend", m))?);
        }
        s.filter = self.filter.or(s.filter);
        s.edges = self.edges.or(s.edges);
        s.isotropic_map |= self.isotropic_map;
        s.strict |= self.strict;
        s.other = self.other_body.scene(s.other.take(), in_scene)?;
        if self.non_periodic {
            continuum.periodic = Some(false);
        }
        Ok(())
    }

    /// The lengths of these flags.
    pub(super) fn lengths(&self) -> [(&'static str, Option<Measure>); 5] {
        [
            ("--length", self.length),
            ("--length-y", self.length_y),
            ("--low-pass", self.low_pass),
            ("--high-pass", self.high_pass),
            ("--extend-to", self.extend_to),
        ]
    }

    /// The points of the form, and the lengths of the other body.
    pub(super) fn further_lengths(&self) -> Vec<(&'static str, Measure)> {
        let points = self.detrend.iter().flat_map(DetrendScene::lengths).map(|m| ("--detrend", m));
        points.chain(self.other_body.lengths()).collect()
    }

    /// Metres of one unit of the heights, where it is known: of the given one, or the one that the file declares.
    ///
    /// # Errors
    /// Those of reading the file.
    pub(super) fn heights_m(&self, file: Option<&Path>, file_flags: &FileFlags) -> Result<Option<f64>> {
        let given = self.unit.as_deref().and_then(metres_of);
        let Some(file) = file.filter(|_| given.is_none()) else { return Ok(given) };
        Ok(file_flags.read(file, self.touching)?.declared.unit_m())
    }
}

/// The map of a second rough body, which faces the first.
#[derive(Debug, Clone, clap::Args)]
#[command(next_help_heading = "Other rough body")]
pub(super) struct OtherFlags {
    /// Height map of a second rough body, which faces the first: their heights are added. Steps of preparation are applied to both maps, but
    /// --crop to the first, --resample and --edges to the sum.
    #[arg(long, value_name = "FILE")]
    other: Option<PathBuf>,
    /// Name of its array or channel in a file with several.
    #[arg(long, value_name = "NAME")]
    other_dataset: Option<String>,
    /// Read its file by SurfaceTopography, as --via-python.
    #[arg(long)]
    other_via_python: bool,
    /// Unit of its heights. Default: what its file declares, or --unit.
    #[arg(long, value_name = "UNIT")]
    other_unit: Option<String>,
    /// Its points that touch first. Default: what its file declares, or --touching.
    #[arg(long, value_enum)]
    other_touching: Option<Touching>,
    /// Its extent in x. Default: what its file declares, or that of the first map, if both have as many points.
    #[arg(long, value_name = "L")]
    other_length: Option<Measure>,
    /// Its extent in y. Default: what its file declares, or square pixels.
    #[arg(long, value_name = "L")]
    other_length_y: Option<Measure>,
    /// Whether it is turned over about its y axis, as a body that is laid face down. Default: true.
    #[arg(long, value_name = "BOOL")]
    other_turned_over: Option<bool>,
    /// Quarter turns from x towards y, 0 to 3, after it is turned over.
    #[arg(long, value_name = "N")]
    other_quarter_turns: Option<u8>,
    /// Its shift along x and y, after the turns.
    #[arg(long, value_name = "DX,DY")]
    other_shift: Option<Measures>,
}

impl OtherFlags {
    /// The first of these flags that is given.
    pub(super) fn given(&self) -> Option<&'static str> {
        let flags = [
            ("--other", self.other.is_some()),
            ("--other-dataset", self.other_dataset.is_some()),
            ("--other-via-python", self.other_via_python),
            ("--other-unit", self.other_unit.is_some()),
            ("--other-touching", self.other_touching.is_some()),
            ("--other-turned-over", self.other_turned_over.is_some()),
            ("--other-quarter-turns", self.other_quarter_turns.is_some()),
        ];
        let first = flags.into_iter().find(|(_, given)| *given).map(|(flag, _)| flag);
        first.or(self.lengths().first().map(|(flag, _)| *flag))
    }

    /// The table of a scene: that of another file, or `own` with what these flags give.
    ///
    /// # Errors
    /// Flags without a file, a shift that is no pair, lengths whose unit cannot be converted.
    fn scene(
        &self,
        own: Option<OtherScene>,
        in_scene: &dyn Fn(&str, Measure) -> Result<Length>,
    ) -> Result<Option<OtherScene>> {
        // As a file that is given here: relative to where the command runs.
        let given = self.other.as_ref().map(|path| std::path::absolute(path).unwrap_or_else(|_| path.clone()));
        let Some(mut other) = given.map(OtherScene::new).or(own) else {
            return match self.given() {
                Some(flag) => Err(Error::input(COMMAND_LINE, flag, "given", "only together with --other")),
                None => Ok(None),
            };
        };
        let pair = |shift: &Measures| match shift.0[..] {
            [x, y] => Ok([in_scene("--other-shift", x)?, in_scene("--other-shift", y)?]),
            ref list => {
                Err(Error::input(COMMAND_LINE, "--other-shift", format!("{} lengths", list.len()), "two: DX,DY"))
            }
        };
        let length = |flag: &str, m: Option<Measure>| m.map(|m| in_scene(flag, m)).transpose();
        other.dataset = self.other_dataset.clone().or(other.dataset);
        other.via_python |= self.other_via_python;
        other.unit = self.other_unit.clone().or(other.unit);
        other.touching = self.other_touching.or(other.touching);
        other.length = length("--other-length", self.other_length)?.or(other.length);
        other.length_y = length("--other-length-y", self.other_length_y)?.or(other.length_y);
        other.turned_over = self.other_turned_over.unwrap_or(other.turned_over);
        other.quarter_turns = self.other_quarter_turns.unwrap_or(other.quarter_turns);
        other.shift = self.other_shift.as_ref().map(pair).transpose()?.or(other.shift);
        Ok(Some(other))
    }

    /// The lengths of these flags.
    pub(super) fn lengths(&self) -> Vec<(&'static str, Measure)> {
        let extents = [("--other-length", self.other_length), ("--other-length-y", self.other_length_y)];
        let shift = self.other_shift.iter().flat_map(|s| s.0.iter().map(|m| ("--other-shift", *m)));
        extents.into_iter().filter_map(|(flag, m)| Some((flag, m?))).chain(shift).collect()
    }
}

fn numbers<const N: usize>(flag: &str, value: &[usize], accepted: &str) -> Result<Option<[usize; N]>> {
    if value.is_empty() {
        return Ok(None);
    }
    let wrong = |_| Error::input(COMMAND_LINE, flag, format!("{} numbers", value.len()), accepted);
    value.to_vec().try_into().map(Some).map_err(wrong)
}

/// The refusal of a measure of a flag.
pub(super) fn refused(flag: &str, m: Measure, accepted: impl Into<String>) -> Error {
    Error::input(COMMAND_LINE, flag, m, accepted)
}

/// The accuracy that flags ask for.
///
/// # Errors
/// A budget that is no time.
pub(super) fn accuracy(error: Option<&ErrorTargets>, budget: Option<Measure>) -> Result<Option<AccuracyScene>> {
    let seconds = |m: Measure| {
        let good = m.of(Dimension::Time).ok().map(Measure::si).filter(|s| *s > 0.0 && *s <= MAX_SECONDS);
        good.map(|s| Time::new(s, "s"))
            .ok_or_else(|| refused("--budget", m, "a time above zero, as 0.5s, 30s or 10min"))
    };
    let budget = budget.map(seconds).transpose()?;
    let asks = error.is_some() || budget.is_some();
    Ok(asks.then(|| AccuracyScene { error: error.cloned().unwrap_or_default(), budget }))
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

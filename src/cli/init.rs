//! `asperity init`: a commented scene to start from.

use super::file::{COMMAND_LINE, FileFlags, refused};
use super::output;
use crate::scene::{Length, Stress, metres_of};
use crate::{Error, Result};
use asperity_grid::Grid;
use asperity_grid::units::{Dimension, Measure};
use asperity_surface::declared::{Declared, DeclaredExtent};
use asperity_surface::height_map::HeightMap;
use asperity_surface::heights::Touching;
use asperity_surface::import::{Content, ImportedFile};
use asperity_surface::seam_warning;
use serde_json::json;
use std::fmt::{Display, Write};
use std::path::{Path, PathBuf};

const CHALLENGE: &str = include_str!("../../configs/challenge.toml");

/// Points per side on which Fourier coefficients are evaluated by default.
const GRID: usize = 512;

const HEAD: &str = "\
#:schema scene.schema.json
# Editors that know TOML schemas complete and check the keys: asperity schema > scene.schema.json
# Lines with `# FILL IN` are required: remove the # and give the value. All other lines with # are optional.
";

const LOADS: &str = "\
[load]
# Mean pressures over E* times the rms gradient of the surface, in the order in which they are applied.
p_star = [0.001, 0.003, 0.01, 0.03, 0.1]
# Instead of p_star: pressures, normal forces, mean gaps or displacements, or contact fractions.
# pressure = [\"0.1 MPa\", \"0.2 MPa\"]
# force = \"log:1mN:100mN:5\"
# mean_gap = [\"0.5 um\", \"0.2 um\"]
# displacement = [\"0.1 um\", \"0.2 um\"]
# contact = [0.05, 0.1]
# The same loads in reverse, for the hysteresis of adhesion.
# unload = true

# Without this table there is no adhesion.
# [adhesion]
# work_of_adhesion = \"50 mJ/m2\"
# range = \"2 nm\"

# Errors that are small enough: the grid is chosen for them.
# [accuracy]
# error = \"5 %\"

# Without this table there are no atoms (they need LAMMPS and a square cell).
# [atoms]
# cells = 15
# depth_cells = 6
";

const SYNTHESISED: &str = "\
name = \"scene\"
description = \"\"

[laboratory]
# Extent of the cell.
length = \"100 um\"
# Contact modulus E* = E/(1-ν²); of two elastic bodies 1/E* is the sum of both (1-ν²)/E.
modulus = \"25 MPa\"

# A self-affine surface from its spectrum. `asperity init FILE` writes the scene of a measured one.
[surface]
# Points per side.
grid = 512
seed = 18
# Hurst exponent.
hurst = 0.8
# Longest and shortest wavelength of the self-affine part.
roll_off = \"20 um\"
cut_off = \"0.5 um\"
# rms gradient of the whole surface.
rms_gradient = 1

";

#[derive(Debug, clap::Args)]
pub(super) struct InitArgs {
    /// Surface file; what it declares is filled in. Default: a synthesised surface.
    file: Option<PathBuf>,
    /// The scene of the contact-mechanics challenge.
    #[arg(long, conflicts_with = "file")]
    challenge: bool,
    #[command(flatten)]
    file_flags: FileFlags,
    /// Points that touch first; required unless the file declares it.
    #[arg(long, value_enum, requires = "file")]
    touching: Option<Touching>,
    /// Unit of the heights in the file: m, mm, um, nm, Å. Default: what the file declares.
    #[arg(long, value_name = "UNIT", requires = "file")]
    unit: Option<String>,
    /// Extent of the map in x, with a unit (20um). Default: what the file declares.
    #[arg(long, value_name = "L", requires = "file")]
    length: Option<Measure>,
    /// Contact modulus E*, such as 25MPa, which no surface file declares.
    #[arg(long, value_name = "E", requires = "file")]
    modulus: Option<Measure>,
    /// Scene file to write.
    #[arg(long, value_name = "FILE", default_value = "scene.toml")]
    out: PathBuf,
    /// Replace an existing file.
    #[arg(long)]
    overwrite: bool,
    /// One line of JSON on stdout.
    #[arg(long)]
    json: bool,
}

impl InitArgs {
    pub(super) fn execute(self) -> Result<()> {
        if self.out.exists() && !self.overwrite {
            let found = format!("{} (exists)", self.out.display());
            return Err(Error::input(COMMAND_LINE, "--out", found, "another file, or --overwrite to replace it"));
        }
        let Draft { text, fill_in } = match &self.file {
            Some(file) => self.of_file(file)?,
            None if self.challenge => {
                let text = CHALLENGE.split_once('\n').map_or(CHALLENGE, |(_, after_schema)| after_schema);
                Draft::new(&format!("{}{text}", HEAD.lines().take(2).map(|l| format!("{l}\n")).collect::<String>()))
            }
            None => Draft::new(&format!("{HEAD}{SYNTHESISED}{LOADS}")),
        };
        std::fs::write(&self.out, text).map_err(Error::io("write", &self.out))?;
        if self.json {
            return output::json_line(&json!({ "out": self.out, "fill_in": fill_in }));
        }
        output::print(&format!("scene: {}", self.out.display()));
        if !fill_in.is_empty() {
            output::print(&format!("fill in: {}", fill_in.join(", ")));
        }
        output::print(&format!("then: asperity run {} --dry-run", self.out.display()));
        Ok(())
    }

    fn of_file(&self, file: &Path) -> Result<Draft> {
        let mut imported = self.file_flags.read(file, self.touching)?;
        self.declare(&mut imported, file)?;
        let stem = file.file_stem().map_or("scene".into(), |s| s.to_string_lossy());
        let name: String =
            stem.chars().map(|c| if c.is_alphanumeric() || "-_".contains(c) { c } else { '-' }).collect();
        let mut draft = Draft::new(HEAD);
        draft.line(format!("# {}: {}.", file.display(), imported.layout));
        draft.line(format!("name = {}\ndescription = \"\"\n", quoted(name)));
        self.laboratory(&mut draft, &imported.declared)?;
        self.surface(&mut draft, &imported, file)?;
        let periodic = match imported.declared.periodic {
            Some(periodic) => format!("The file declares periodic = {periodic}."),
            None => "The file does not declare whether the map repeats; by default it does.".into(),
        };
        draft.line(format!("[continuum]\n# {periodic} false: the only rough part of a half-space that is free around it.\n# periodic = false\n"));
        draft.line(LOADS.trim_end());
        Ok(draft)
    }

    /// Adds what flags say of the file to what it declares itself.
    ///
    /// # Errors
    /// `Input` where both differ, and for values of another dimension.
    fn declare(&self, imported: &mut ImportedFile, file: &Path) -> Result<()> {
        let (declared, content) = (&mut imported.declared, &imported.content);
        let differs = |flag: &str, given: String, declared: String| {
            Err(Error::input(COMMAND_LINE, flag, given, format!("{declared}, as {} declares", file.display())))
        };
        match (self.touching, declared.sign) {
            (Some(given), Some(own)) if given != own => return differs("--touching", word(given), word(own)),
            (given, own) => declared.sign = given.or(own),
        }
        if let Some(given) = &self.unit {
            let Some(metres) = metres_of(given) else {
                return Err(Error::input(COMMAND_LINE, "--unit", given, "a unit of length: m, mm, um, nm, Å"));
            };
            match (declared.unit_m(), &declared.unit) {
                (Some(own), Some(unit)) if !is_close(metres, own) => {
                    return differs("--unit", given.clone(), unit.clone());
                }
                _ => declared.unit = Some(given.clone()),
            }
        }
        if let Some(given) = self.length {
            let length = Length::written(given).filter(|l| l.si() > 0.0);
            let length = length.ok_or_else(|| refused("--length", given, "a length with its unit, such as 20um"))?.si();
            // Of square pixels, or of extents that the file has in a unit of its own.
            let ratio = match (&declared.extent, content) {
                (Some(e), _) => e.y / e.x,
                (None, Content::Map(map)) => map.ny as f64 / map.nx as f64,
                (None, Content::Waves(_)) => 1.0,
            };
            match declared.extent_m() {
                Some([own, _]) if !is_close(length, own) => {
                    return differs("--length", given.to_string(), format!("{} um", significant(own * 1e6)));
                }
                Some(_) => {}
                None => declared.extent = Some(DeclaredExtent { x: length, y: ratio * length, unit: Some("m".into()) }),
            }
        }
        Ok(())
    }

    fn laboratory(&self, draft: &mut Draft, declared: &Declared) -> Result<()> {
        draft.line("[laboratory]");
        let extent = declared.extent_m().map(|e| e.map(|m| significant(m * 1e6)));
        match (extent, &declared.extent) {
            (Some([x, y]), _) => {
                draft.line("# Extents of the map along x and y.");
                draft.line(format!("length = \"{x} um\"\nlength_y = \"{y} um\""));
            }
            // The extents are known as soon as the unit is.
            (None, Some(e)) => {
                let unit = e.unit.as_deref().unwrap_or("units of the heights");
                draft.line(format!(
                    "# Extents along x and y. Default: what the file declares, {} and {} {unit}.",
                    e.x, e.y
                ));
                draft.line("# length = \"20 um\"\n# length_y = \"20 um\"");
            }
            (None, None) => {
                draft.missing("laboratory.length", "\"20 um\"", "extent of the map in x, points times spacing");
                draft.line("# Extent in y. Default: square pixels.\n# length_y = \"20 um\"");
            }
        }
        let modulus = "contact modulus E* = E/(1-ν²); of two elastic bodies 1/E* is the sum of both (1-ν²)/E";
        match self.modulus {
            Some(given) => {
                let refused = |accepted: String| refused("--modulus", given, accepted);
                let stress = Stress::written(given).ok_or_else(|| refused(Dimension::Stress.accepted()))?;
                if given.value <= 0.0 {
                    return Err(refused("a positive stress".into()));
                }
                draft.line(format!("# Contact modulus E*.\nmodulus = \"{stress}\""));
            }
            None => draft.missing("laboratory.modulus", "\"2 MPa\"", modulus),
        }
        Ok(())
    }

    fn surface(&self, draft: &mut Draft, imported: &ImportedFile, file: &Path) -> Result<()> {
        let declared = &imported.declared;
        draft.line(format!("\n[surface]\nheights = {}", quoted(self.relative(file)?.display())));
        if let Some(dataset) = &self.file_flags.dataset {
            draft.line(format!("dataset = {}", quoted(dataset)));
        }
        if self.file_flags.via_python {
            draft.line("via_python = true");
        }
        if self.file_flags.profile {
            draft.line("profile = true");
        }
        match &declared.unit {
            Some(unit) if metres_of(unit).is_some() => {
                draft.line(format!("# Unit of the heights in the file.\nunit = {}", quoted(unit)));
            }
            other => {
                let reason = other.as_ref().map_or(String::new(), |u| format!(" (the file's {u:?} is none)"));
                draft.missing("surface.unit", "\"nm\"", format!("unit of the heights: m, mm, um, nm, Å{reason}"));
            }
        }
        match declared.sign {
            Some(touching) => draft.line(format!("# Points that touch first.\ntouching = {}", quoted(word(touching)))),
            None => draft.missing(
                "surface.touching",
                "\"high-points\"",
                "points that touch first, \"low-points\" or \"high-points\": instruments store high points of the rough body as high",
            ),
        }
        match &imported.content {
            Content::Waves(_) => self.waves(draft),
            Content::Map(map) => {
                if let Some(kind) = self.file_flags.fourier {
                    draft.line(format!("fourier = {}", quoted(word(kind))));
                }
                let seam = declared.periodic.is_none() && has_seam(map);
                preparation(draft, map.missing(), seam);
            }
        }
        draft.line("");
        Ok(())
    }

    /// Keys of Fourier coefficients.
    fn waves(&self, draft: &mut Draft) {
        draft.line(format!("# Points per side on which the coefficients are evaluated.\ngrid = {GRID}"));
        if let Some(kind) = self.file_flags.fourier {
            draft.line(format!("fourier = {}", quoted(word(kind))));
        }
        if let Some(points) = self.file_flags.fourier_points {
            draft.line(format!("fourier_points = {points}"));
        }
        draft.line("# Shortest wavelength that is kept.\n# low_pass = \"0.5 um\"");
    }

    /// The surface file as the scene names it: relative to the scene's folder where it is inside.
    fn relative(&self, file: &Path) -> Result<PathBuf> {
        let absolute = |path: &Path| std::path::absolute(path).map_err(Error::io("find", path));
        let (file, scene) = (absolute(file)?, absolute(&self.out)?);
        let folder = scene.parent().unwrap_or(Path::new("/"));
        Ok(file.strip_prefix(folder).map_or(file.clone(), Path::to_path_buf))
    }
}

/// Whether a map of undeclared periodicity does not repeat. One with missing points is measured, and does not, either.
fn has_seam(map: &HeightMap) -> bool {
    map.missing() > 0 || seam_warning(Grid::unit(map.nx, map.ny), &map.heights).is_some()
}

/// Steps of preparation of a map. Of one with a `seam` the plane is subtracted and the edges are mirrored: periodic as it is, its
/// largest slope would be at its edges.
fn preparation(draft: &mut Draft, missing: usize, seam: bool) {
    let optional = if seam { "" } else { "# " };
    draft.line(format!(
        "# Preparation; the form is fitted to the measured points and subtracted before missing ones are filled. Form: \"mean\", \"plane\", \"quadratic\", \"facets\", or of each scan line \"line-median\", \"line-linear\", \"line-quadratic\".\n{optional}detrend = \"plane\""
    ));
    let fillings = "\"harmonic\" continues the heights smoothly, \"nearest\" takes the nearest one";
    match missing {
        0 => draft.line(format!(
            "# Filling of missing points, of which the file has none: {fillings}.\n# fill = \"harmonic\""
        )),
        n => draft.missing(
            "surface.fill",
            "\"harmonic\"",
            format!("filling of the {n} points that were not measured: {fillings}"),
        ),
    }
    let reason = if seam { ", as this one" } else { "" };
    draft.line(format!(
        "# Shortest and longest wavelength that are kept.\n# low_pass = \"0.5 um\"\n# high_pass = \"10 um\"\n\
         # Makes a map periodic that is not{reason}: \"mirror\" (four times the points) or \"taper\".\n{optional}edges = \"mirror\""
    ));
}

/// A scene and the keys that it does not have yet.
struct Draft {
    text: String,
    fill_in: Vec<String>,
}

impl Draft {
    fn new(text: &str) -> Self {
        Draft { text: text.into(), fill_in: Vec::new() }
    }

    fn line(&mut self, line: impl Display) {
        let _ = writeln!(self.text, "{line}");
    }

    /// A required key that the file does not declare, with an example of its value.
    fn missing(&mut self, key: &str, example: &str, description: impl Display) {
        let own = key.rsplit('.').next().unwrap_or(key);
        self.line(format!("# FILL IN {own}: {description}.\n# {own} = {example}"));
        self.fill_in.push(key.into());
    }
}

/// Whether two lengths agree to the six digits of headers.
fn is_close(a: f64, b: f64) -> bool {
    (a / b - 1.0).abs() < 1e-5
}

/// A text of TOML.
fn quoted(text: impl Display) -> String {
    toml::Value::String(text.to_string()).to_string()
}

/// Name of a value in scenes and flags.
fn word(value: impl clap::ValueEnum) -> String {
    value.to_possible_value().map_or(String::new(), |v| v.get_name().to_string())
}

/// With six digits: the rounding of headers.
fn significant(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

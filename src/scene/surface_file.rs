//! The file of an imported surface: what it declares is compared with what the scene states, and completes it.

use super::check::word;
use super::model::relative_to;
use super::via_python::{Converter, read_heights};
use super::{LaboratoryScene, Length, Scene, SurfaceScene};
use crate::{Error, Result};
use asperity_grid::error::Complaint;
use asperity_grid::units::{Dimension, Measure, metres_per};
use asperity_surface::Preparation;
use asperity_surface::declared::Declared;
use asperity_surface::files::hashed::file_hash;
use asperity_surface::heights::{HeightMap, Touching};
use asperity_surface::import::{Content, ImportOptions, ImportedFile};
use asperity_surface::provenance::Provenance;
use std::path::{Path, PathBuf};

/// Relative deviation that a given unit may have from the declared one: rounding of a decimal fraction.
const UNIT_TOLERANCE: f64 = 1e-9;

/// Likewise of an extent: headers of instruments print four digits.
const EXTENT_TOLERANCE: f64 = 1e-3;

/// A file of heights or Fourier coefficients, as read.
pub struct SurfaceFile {
    path: PathBuf,
    /// Whether the scene itself states whether the map is periodic.
    periodicity_is_given: bool,
    /// Metres of the unit of lengths of a scene with plain numbers, where they are not in that of these heights.
    pub(super) number_m: Option<f64>,
    pub imported: ImportedFile,
}

/// A map after its preparation, in the unit of the scene's lengths.
pub struct PreparedFile {
    pub map: HeightMap,
    pub extent: [f64; 2],
    pub provenance: Provenance,
    /// What is doubtful about the steps of preparation.
    pub warnings: Vec<String>,
}

impl SurfaceFile {
    /// The file that a scene names, if it names one. `file`: the scene file.
    ///
    /// # Errors
    /// Those of [`read_heights`].
    pub fn read(s: &SurfaceScene, file: &Path) -> Result<Option<Self>> {
        let converter = s.via_python.then(|| Converter { touching: s.touching, ..Converter::default() });
        Self::read_by(s, file, converter.as_ref())
    }

    /// Likewise with a converter of files that are not read otherwise.
    ///
    /// # Errors
    /// Those of [`read_heights`].
    pub fn read_by(s: &SurfaceScene, file: &Path, converter: Option<&Converter>) -> Result<Option<Self>> {
        let Some(path) = &s.heights else { return Ok(None) };
        let path = relative_to(file, path);
        let options = ImportOptions { dataset: s.dataset.as_deref(), fourier: s.fourier, profile: s.profile };
        let imported = read_heights(&path, options, converter)?;
        Ok(Some(SurfaceFile { path, periodicity_is_given: false, number_m: None, imported }))
    }

    /// Completes the scene with what the file declares: unit, extents, sign, periodicity. Returns what is missing in both, and what
    /// differs between them.
    pub fn complete(&mut self, scene: &mut Scene) -> Vec<Complaint> {
        self.periodicity_is_given = scene.continuum.periodic.is_some();
        let mut list = Vec::new();
        let heights_m = self.unit(&mut scene.surface, &scene.laboratory, &mut list);
        if let Some(y) = scene.laboratory.length_y.filter(|_| scene.surface.isotropic_map) {
            list.push(Complaint::new("laboratory.length_y", y, "none with surface.isotropic_map, which is a square"));
        }
        self.extents(&mut scene.laboratory, heights_m, &mut list);
        self.sign(&mut scene.surface, &mut list);
        self.periodicity(scene, &mut list);
        list
    }

    pub(super) fn declared(&self) -> &Declared {
        &self.imported.declared
    }

    fn declares(&self, description: impl std::fmt::Display) -> String {
        format!("{description}, as {} declares", self.path.display())
    }

    /// Statements of the file that may be what is missing.
    fn not_understood(&self) -> String {
        match &self.imported.not_understood[..] {
            [] => String::new(),
            list => format!(" (not understood: {})", list.join(", ")),
        }
    }

    /// The length of a unit of the heights in metres, if it is known. It is kept where the scene has units.
    fn unit(&self, s: &mut SurfaceScene, lab: &LaboratoryScene, list: &mut Vec<Complaint>) -> Option<f64> {
        let declared = self.declared().unit_m();
        let given = s.unit.as_deref().and_then(metres_of);
        if let Some(unit) = s.unit.as_deref().filter(|_| given.is_none()) {
            list.push(Complaint::new("surface.unit", format!("{unit:?}"), "a unit of length: m, mm, um, nm, Å"));
        }
        if let (Some(given), Some(declared)) = (given, declared)
            && differs(given, declared, UNIT_TOLERANCE)
        {
            let text = self.declared().unit.clone().unwrap_or_default();
            let accepted = self.declares(format!("{text} ({} µm)", declared * 1e6));
            list.push(Complaint::new("surface.unit", s.unit.clone().unwrap_or_default(), accepted));
        }
        let metres = given.or(declared);
        if !lab.is_plain() && metres.is_none() && list.is_empty() {
            let declares = match &self.declared().unit {
                Some(unit) => format!("{} declares {unit:?}, which is no known unit of length", self.path.display()),
                None => format!("{} declares none", self.path.display()),
            };
            let more = self.not_understood();
            let accepted = format!("the unit of the heights (m, mm, um, nm, Å): {declares}{more}");
            list.push(Complaint::new("surface.unit", "not given", accepted));
        }
        metres
    }

    /// Sets the extents. A unit is not needed where heights and extents have the same.
    fn extents(&mut self, lab: &mut LaboratoryScene, heights_m: Option<f64>, list: &mut Vec<Complaint>) {
        let declared = self.declared().extent.clone();
        let own_unit = declared.as_ref().and_then(|e| e.unit.as_deref());
        let scale = match (own_unit, lab.metres(self.number_m.or(heights_m))) {
            (Some(unit), Some(metres)) => metres_per(unit).map(|m| m / metres),
            // Lines of x y h in consistent units.
            (None, None) => Some(1.0),
            (None, Some(metres)) => heights_m.map(|m| m / metres),
            (Some(unit), None) => {
                if lab.length.is_none() {
                    let accepted = format!("the unit of the heights: {} has extents in {unit}", self.path.display());
                    list.push(Complaint::new("surface.unit", "not given", accepted));
                    return;
                }
                None
            }
        };
        let numbers = declared.as_ref().zip(scale).map(|(e, scale)| [e.x * scale, e.y * scale]);
        let factor = numbers
            .filter(|_| own_unit.is_none())
            .zip(lab.length)
            .and_then(|([x, _], given)| other_unit(given.over(lab.of_number(x))));
        if let Some((given, [x, _])) = lab.length.zip(numbers).filter(|_| factor.is_some()) {
            let own = rounded(lab.of_number(x));
            let text = format!(
                "the extents of the file have no unit: along x they are {given}, as laboratory.length has it, not {own}"
            );
            self.imported.warnings.push(text);
        }
        let declared = numbers.map(|both| both.map(|number| lab.of_number(number * factor.unwrap_or(1.0))));
        let Some([x, y]) = declared else {
            if lab.length.is_none() {
                let (path, more) = (self.path.display(), self.not_understood());
                let accepted = format!("the extent of the cell in x: {path} declares none{more}");
                list.push(Complaint::new("laboratory.length", "not given", accepted));
            }
            return;
        };
        for (key, given, declared) in
            [("laboratory.length", &mut lab.length, x), ("laboratory.length_y", &mut lab.length_y, y)]
        {
            match *given {
                Some(given) if (given.over(declared) - 1.0).abs() > EXTENT_TOLERANCE => {
                    list.push(Complaint::new(key, given, self.declares(rounded(declared))));
                }
                Some(_) => {}
                None => *given = Some(declared),
            }
        }
    }

    fn sign(&self, s: &mut SurfaceScene, list: &mut Vec<Complaint>) {
        let declared = self.declared().sign;
        match (s.touching, declared) {
            (Some(given), Some(declared)) if given != declared => {
                list.push(Complaint::new("surface.touching", word(&given), self.declares(word(&declared))));
            }
            (None, None) => list.push(Complaint::new(
                "surface.touching",
                "not given",
                format!(
                    "\"low-points\" or \"high-points\": {} does not declare which touch first",
                    self.path.display()
                ),
            )),
            (None, declared) => s.touching = declared,
            _ => {}
        }
    }

    /// A map that does not repeat is made to by its edges, or it is solved as a non-periodic surface.
    fn periodicity(&mut self, scene: &mut Scene, list: &mut Vec<Complaint>) {
        let declared = self.declared_periodic(scene);
        let given = &mut scene.continuum.periodic;
        let edges = scene.surface.edges;
        let made = edges.is_some() || scene.surface.isotropic_map;
        match (*given, declared) {
            (Some(false), _) if edges.is_some() => {
                let accepted = "true, or no surface.edges, which make a map that repeats";
                list.push(Complaint::new("continuum.periodic", "false", accepted));
            }
            (Some(true), Some(false)) if !made => {
                let accepted = self.declares("false") + ", or surface.edges that make the map repeat";
                list.push(Complaint::new("continuum.periodic", "true", accepted));
            }
            (Some(false), Some(true)) => {
                let path = self.path.display();
                let text = format!(
                    "{path} repeats; continuum.periodic = false solves one cell, with a flat half-space around it"
                );
                self.imported.warnings.push(text);
            }
            (None, declared) => *given = Some(made || declared.unwrap_or(true)),
            _ => {}
        }
    }

    /// Whether the map repeats, as the file declares it: a part of a map that repeats does not.
    fn declared_periodic(&self, scene: &Scene) -> Option<bool> {
        self.declared().periodic.filter(|periodic| !periodic || scene.surface.crop.is_none())
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Metres of a unit of the heights, where it is known.
    pub(super) fn heights_m(&self, scene: &Scene) -> Option<f64> {
        scene.surface.unit.as_deref().and_then(metres_of).or(self.declared().unit_m())
    }

    /// Unit of the heights in that of the scene's lengths.
    pub fn height_unit(&self, scene: &Scene) -> f64 {
        let metres = self.heights_m(scene);
        match (scene.laboratory.is_plain(), self.number_m) {
            (false, _) => metres.map_or(1.0, |m| m * 1e6),
            (true, Some(number_m)) => metres.map_or(1.0, |m| m / number_m),
            (true, None) => 1.0,
        }
    }

    /// Name of the unit of the scene's lengths; empty where it is not known, or that of another map.
    fn length_unit(&self, scene: &Scene) -> String {
        let of_heights = self.declared().unit.as_ref().or(scene.surface.unit.as_ref());
        match (scene.laboratory.is_plain(), self.number_m) {
            (false, _) => "um".into(),
            (true, None) => of_heights.cloned().unwrap_or_default(),
            (true, Some(_)) => String::new(),
        }
    }

    /// Heights in the unit of the scene's lengths, low points first, after the steps of preparation that the scene names; with
    /// another rough body those of a single one. The scene is complete.
    ///
    /// # Errors
    /// Those of [`Preparation::apply`].
    pub fn prepare(mut self, scene: &Scene) -> Result<PreparedFile> {
        let (s, lab, scale) = (&scene.surface, &scene.laboratory, self.height_unit(scene));
        let empty = Content::Waves(Vec::new());
        let Content::Map(mut map) = std::mem::replace(&mut self.imported.content, empty) else {
            unreachable!("waves have no preparation")
        };
        if scale != 1.0 {
            map.heights.iter_mut().for_each(|h| *h *= scale);
        }
        let x = lab.number(lab.length());
        let extent = [x, lab.length_y.map_or(x * map.ny as f64 / map.nx as f64, |y| lab.number(y))];
        let (missing, points) = (map.missing(), map.heights.len());
        let made = s.edges.is_some() || s.isotropic_map;
        let repeats = self.declared().periodic.unwrap_or(scene.continuum.is_periodic() && !made);
        let (all, of_sum) = (preparation(s, lab, self.length_unit(scene)), of_sum(s));
        let own = Preparation { resample: None, edges: None, ..all.clone() };
        let steps = if of_sum.is_some() { own } else { all };
        let prepared = steps.apply(map, extent, repeats).map_err(|e| named(e, &self.path))?;
        let mut provenance = self.provenance(scene, [prepared.map.nx, prepared.map.ny], prepared.extent)?;
        provenance.missing_points = missing;
        provenance.filled_points = prepared.filled;
        provenance.filled_share = prepared.filled as f64 / points as f64;
        provenance.preparation.extend(prepared.history);
        let map = prepared.map.low_first(s.touching.unwrap_or(Touching::LowPoints));
        let warnings = prepared.warnings.iter().map(|text| preparation_keys(text)).collect();
        Ok(PreparedFile { map, extent: prepared.extent, provenance, warnings })
    }

    /// The provenance of Fourier coefficients, which are those of `series`.
    pub fn provenance_of_waves(&self, scene: &Scene, series: &str) -> Result<Provenance> {
        let (n, length) = (scene.surface.grid, scene.laboratory.number(scene.laboratory.length()));
        let mut provenance = self.provenance(scene, [n, n], [length, length])?;
        provenance.format += &format!(", {series}");
        Ok(provenance)
    }

    fn provenance(&self, scene: &Scene, [nx, ny]: [usize; 2], [x, y]: [f64; 2]) -> Result<Provenance> {
        let (s, lab, declared) = (&scene.surface, &scene.laboratory, self.declared());
        let metres = lab.metres(self.number_m.or(self.heights_m(scene)));
        let unit = declared.unit.clone().or(s.unit.clone());
        let shown = match (lab.is_plain(), self.number_m) {
            (false, _) => Some("µm"),
            (true, Some(_)) => Some("(the unit of the first map)"),
            (true, None) => unit.as_deref(),
        };
        Ok(Provenance {
            hash: file_hash(&self.path)?,
            file: self.path.display().to_string(),
            format: self.imported.layout.clone(),
            channel: declared.channel.clone(),
            channels: declared.channels.clone(),
            nx,
            ny,
            length_x_m: metres.map(|m| x * m),
            length_y_m: metres.map(|m| y * m),
            extent: extent_words([x, y], shown),
            unit,
            touching: s.touching.map_or(String::new(), |t| word(&t)),
            periodic: scene.continuum.is_periodic(),
            periodicity_is_known: self.declared_periodic(scene).is_some()
                || s.edges.is_some()
                || s.isotropic_map
                || self.periodicity_is_given,
            missing_points: 0,
            filled_points: 0,
            filled_share: 0.0,
            preparation: declared.history.clone(),
            other: None,
            version: env!("CARGO_PKG_VERSION").into(),
        })
    }
}

/// The ratio of two units of length that a ratio of extents is: a power of ten.
fn other_unit(ratio: f64) -> Option<f64> {
    let power = 10f64.powi(ratio.log10().round() as i32);
    (ratio > 0.0 && power != 1.0 && !differs(ratio, power, EXTENT_TOLERANCE)).then_some(power)
}

fn differs(value: f64, declared: f64, tolerance: f64) -> bool {
    (value / declared - 1.0).abs() > tolerance
}

/// An error of the preparation of a file, with the keys of scenes.
pub(super) fn named(error: Error, path: &Path) -> Error {
    match error {
        Error::Input { mut list, .. } => {
            for complaint in &mut list {
                complaint.key = preparation_keys(&complaint.key);
                complaint.accepted = preparation_keys(&complaint.accepted);
            }
            Error::Input { place: path.display().to_string(), list }
        }
        other => other,
    }
}

/// A text about the preparation with keys of scenes in place of flags.
pub(super) fn preparation_keys(text: &str) -> String {
    let of_surface = [
        "crop",
        "remove-outliers",
        "fill",
        "detrend",
        "low-pass",
        "high-pass",
        "filter",
        "resample",
        "edges",
        "extend-to",
        "isotropic-map",
        "profile",
    ];
    let text = text.replace("--non-periodic", "continuum.periodic = false");
    of_surface
        .iter()
        .fold(text, |text, flag| text.replace(&format!("--{flag}"), &format!("surface.{}", flag.replace('-', "_"))))
}

/// Metres of a unit of the heights, which may have a factor: `um`, `0.1 mm`.
pub fn metres_of(unit: &str) -> Option<f64> {
    let measure = || unit.parse::<Measure>().ok()?.of(Dimension::Length).ok().filter(|m| m.unit.is_some());
    metres_per(unit).or_else(|| measure().map(Measure::si).filter(|m| *m > 0.0))
}

/// Steps of preparation of the sum with another body.
pub(super) fn of_sum(s: &SurfaceScene) -> Option<Preparation> {
    s.other.as_ref().map(|_| Preparation { resample: s.resample, edges: s.edges, ..Preparation::default() })
}

/// The steps that a scene names, with lengths as numbers.
fn preparation(s: &SurfaceScene, lab: &LaboratoryScene, unit: String) -> Preparation {
    Preparation {
        crop: s.crop,
        remove_outliers: s.remove_outliers,
        fill: s.fill,
        detrend: s.detrend.map(|form| form.form(|length| lab.number(length))),
        low_pass: s.low_pass.map(|length| lab.number(length)),
        high_pass: s.high_pass.map(|length| lab.number(length)),
        filter: s.filter,
        resample: s.resample,
        edges: s.edges,
        extend_to: s.extend_to.map(|length| lab.number(length)),
        isotropic_map: s.isotropic_map,
        seed: s.seed,
        unit,
    }
}

/// Extents along x and y for a message.
pub(super) fn extent_words([x, y]: [f64; 2], unit: Option<&str>) -> String {
    format!("{} x {} {}", six_digits(x), six_digits(y), unit.unwrap_or("(the unit of the heights)"))
}

/// With six digits, for a message.
fn six_digits(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

/// Likewise.
pub(super) fn rounded(length: Length) -> Length {
    length.with(six_digits(length.value()))
}

//! The file of a second rough body, which faces the first.

use super::surface_file::{self, PreparedFile, SurfaceFile, extent_words, of_sum};
use super::{LaboratoryScene, OtherScene, Scene, SurfaceScene};
use crate::{Error, Result};
use asperity_grid::Grid;
use asperity_grid::error::Complaint;
use asperity_surface::heights::HeightMap;
use asperity_surface::import::Content;
use asperity_surface::{Placement, RoughBody};
use std::path::Path;

/// The file of the other body, as read.
pub struct OtherFile {
    file: SurfaceFile,
    /// The scene as it is for this file: of the first body with what it states, not with what its file declares.
    scene: Scene,
}

impl OtherFile {
    /// The file that a scene names, if it names one. `file`: the scene file.
    ///
    /// # Errors
    /// Those of reading it.
    pub fn read(scene: &Scene, file: &Path) -> Result<Option<Self>> {
        let Some(other) = &scene.surface.other else { return Ok(None) };
        let surface = as_surface(&scene.surface, other);
        let read = SurfaceFile::read(&surface, file).map_err(of_other)?;
        let scene = Scene { surface, ..scene.clone() };
        Ok(read.map(|file| OtherFile { file, scene }))
    }

    /// Completes the scene of this file with what it declares, and with what is known of the `first`, whose scene is complete. Returns what
    /// is missing, and what differs.
    pub fn complete(&mut self, scene: &Scene, first: Option<&SurfaceFile>) -> Vec<Complaint> {
        let (OtherFile { file, scene: own }, Some(first)) = (self, first) else { return Vec::new() };
        let path = file.path().display().to_string();
        let Some(other) = &scene.surface.other else { return Vec::new() };
        let (Content::Map(map), Content::Map(of_first)) = (&file.imported.content, &first.imported.content) else {
            let accepted = "a height map, as that of surface.heights";
            return vec![Complaint::new(
                "surface.other.heights",
                format!("{path}, with a map of another kind"),
                accepted,
            )];
        };
        let same_points = (map.nx, map.ny) == (of_first.nx, of_first.ny);
        let declared = file.declared();
        if declared.unit_m().is_some() {
            own.surface.unit = other.unit.clone();
        }
        if declared.sign.is_some() {
            own.surface.touching = other.touching;
        }
        let lab = &scene.laboratory;
        own.laboratory = LaboratoryScene { length: other.length, length_y: other.length_y, ..lab.clone() };
        if same_points && declared.extent.is_none() && other.length.is_none() {
            own.laboratory.length = lab.length;
            own.laboratory.length_y = other.length_y.or(lab.length_y);
        }
        // Of maps that do not repeat a part is used, whatever the other file declares.
        own.continuum.periodic = match scene.continuum.is_periodic() {
            true => scene.continuum.periodic,
            false => declared.periodic.or(Some(false)),
        };
        file.number_m = first.heights_m(scene);
        let mut list = Vec::new();
        match (lab.is_plain(), file.number_m, file.heights_m(own)) {
            (true, None, Some(_)) => {
                let accepted = format!("that of the heights of the first body, as {path} has a unit");
                list.push(Complaint::new("surface.unit", "not given", accepted));
            }
            (true, Some(_), None) => {
                let accepted = format!("the unit of the heights (m, mm, um, nm, Å): {path} declares none");
                list.push(Complaint::new("surface.other.unit", "not given", accepted));
            }
            _ => {}
        }
        let of_file = file
            .complete(own)
            .into_iter()
            .map(|complaint| Complaint { key: key(&complaint.key).unwrap_or(complaint.key), ..complaint });
        list.extend(of_file);
        list
    }

    /// What is doubtful about the file.
    pub fn warnings(&self) -> &[String] {
        &self.file.imported.warnings
    }

    /// The sum of the heights of both bodies, after the last steps of preparation.
    ///
    /// # Errors
    /// Those of the preparation of the other map, of the last steps, and of [`RoughBody::facing`].
    pub fn added_to(self, first: PreparedFile, scene: &Scene, context: &str) -> Result<PreparedFile> {
        let (Some(other), Some(last)) = (&scene.surface.other, of_sum(&scene.surface)) else { return Ok(first) };
        let lab = &scene.laboratory;
        let shift = other.shift.map_or([0.0, 0.0], |shift| shift.map(|s| lab.number(s)));
        let placement = Placement { turned_over: other.turned_over, quarter_turns: other.quarter_turns, shift };
        let periodic = scene.continuum.is_periodic() && last.edges.is_none();
        let second = self.file.prepare(&self.scene)?;
        let mut provenance = first.provenance;
        let (body, of_other) = (body(first.map, first.extent), body(second.map, second.extent));
        let unit = if lab.is_plain() { provenance.unit.clone().unwrap_or_default() } else { "um".into() };
        let facing = body.facing(of_other, &placement, periodic, &unit).map_err(|e| named(e, context))?;
        let Grid { nx, ny, lx, ly } = facing.sum.grid;
        let map = HeightMap::new("sum of two bodies", nx, ny, facing.sum.heights)?;
        let sum = last.apply(map, [lx, ly], periodic).map_err(|e| surface_file::named(e, Path::new(context)))?;
        let metres = provenance.length_x_m.map(|x| x / first.extent[0]);
        provenance.preparation.push(facing.line);
        provenance.preparation.extend(sum.history);
        let unit = if lab.is_plain() { provenance.unit.as_deref() } else { Some("µm") };
        provenance.extent = extent_words(sum.extent, unit);
        (provenance.nx, provenance.ny) = (sum.map.nx, sum.map.ny);
        [provenance.length_x_m, provenance.length_y_m] = sum.extent.map(|length| metres.map(|m| length * m));
        provenance.other = Some(Box::new(second.provenance));
        let warnings = [first.warnings, second.warnings].concat();
        Ok(PreparedFile { map: sum.map, extent: sum.extent, provenance, warnings })
    }
}

fn body(map: HeightMap, [lx, ly]: [f64; 2]) -> RoughBody {
    RoughBody { grid: Grid { nx: map.nx, ny: map.ny, lx, ly }, heights: map.heights }
}

/// The table of the first body with the file of the other one.
fn as_surface(first: &SurfaceScene, other: &OtherScene) -> SurfaceScene {
    SurfaceScene {
        heights: Some(other.heights.clone()),
        unit: other.unit.clone().or(first.unit.clone()),
        dataset: other.dataset.clone(),
        via_python: other.via_python,
        touching: other.touching.or(first.touching),
        crop: None,
        ..first.clone()
    }
}

/// The key of a complaint about this file. Steps of preparation are those of both.
fn key(key: &str) -> Option<String> {
    const OWN: [&str; 5] = ["unit", "touching", "dataset", "length", "length_y"];
    let last = super::last_part(key);
    OWN.contains(&last).then(|| format!("surface.other.{last}"))
}

/// An error of reading the file, with the keys and flags of this table.
fn of_other(error: Error) -> Error {
    let words = |text: String| {
        text.replace("--dataset (surface.dataset)", "--other-dataset (surface.other.dataset)")
            .replace("--via-python", "--other-via-python")
    };
    match error {
        Error::Format { file, found, accepted } => {
            Error::Format { file, found: words(found), accepted: words(accepted) }
        }
        other => other,
    }
}

/// An error about the sum, with the keys of scenes.
fn named(error: Error, context: &str) -> Error {
    match error {
        Error::Input { mut list, .. } => {
            list.iter_mut().for_each(|c| c.key = format!("surface.other.{}", c.key));
            Error::Input { place: context.into(), list }
        }
        other => other,
    }
}

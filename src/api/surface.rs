//! Surfaces from files.

use crate::scene::{self, Converter, LaboratoryScene, Length, Scene, Stress, SurfaceFile, SurfaceScene};
use crate::{Error, Result};
use asperity_surface::heights::Touching;
use asperity_surface::import::{self, Content};
use asperity_surface::{Preparation, Surface};
use std::path::{Path, PathBuf};

/// What a file of heights does not declare, and the preparation of its map. Lengths are in the unit of the heights.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FileOptions {
    /// Extent of the map along x. `None`: what the file declares.
    pub length: Option<f64>,
    /// Which points touch the other body first. `None`: what the file declares.
    pub touching: Option<Touching>,
    /// Name of the array or channel, in a file with several.
    pub dataset: Option<String>,
    /// The file is a profile, and the surface uniform along y, unless `preparation.isotropic_map`.
    pub profile: bool,
    /// A Python in which asperity and SurfaceTopography are installed. It reads files that this crate does not: those of instruments, and
    /// containers of contact.engineering.
    pub python: Option<PathBuf>,
    /// Unit of the heights, which is also that of lengths. Default: what the file declares.
    pub unit: Option<String>,
    /// Steps that the map goes through before it is solved.
    pub preparation: Preparation,
}

/// Reads a height map: text, `.npy`, `.npz`, HDF5, NetCDF, `.x3p`, `.sdf`, `.sur` or `.gwy`.
///
/// # Errors
/// Those of reading the file, with the place in it; a length or sign that neither file nor options have, or that differ between
/// them; those of the preparation; Fourier coefficients, for which there is `asperity surface`.
pub fn read_surface(path: impl AsRef<Path>, options: &FileOptions) -> Result<Surface> {
    let path = path.as_ref();
    let mut table = SurfaceScene {
        heights: Some(path.to_path_buf()),
        dataset: options.dataset.clone(),
        profile: options.profile,
        touching: options.touching,
        fill: options.preparation.fill,
        crop: options.preparation.crop,
        remove_outliers: options.preparation.remove_outliers,
        detrend: options.preparation.detrend.map(Into::into),
        low_pass: options.preparation.low_pass.map(Length::plain),
        high_pass: options.preparation.high_pass.map(Length::plain),
        filter: options.preparation.filter,
        resample: options.preparation.resample,
        edges: options.preparation.edges,
        extend_to: options.preparation.extend_to.map(Length::plain),
        isotropic_map: options.preparation.isotropic_map,
        ..SurfaceScene::default()
    };
    if table.has_seed() {
        table.seed = options.preparation.seed;
    }
    let mut scene = Scene::new("surface", table);
    // A plain modulus: lengths are in the unit of the heights.
    let (length, modulus) = (options.length.map(Length::plain), Some(Stress::plain(1.0)));
    scene.laboratory = LaboratoryScene { length, modulus, ..LaboratoryScene::default() };
    options.length.iter().try_for_each(|l| positive("length", *l))?;
    let python = options.python.clone().filter(|_| import::is_of_instrument(path).unwrap_or(false));
    let converter = python.map(|python| Converter { python, touching: options.touching });
    let Some(mut file) = SurfaceFile::read_by(&scene.surface, Path::new(""), converter.as_ref())? else {
        unreachable!("it has a file")
    };
    if !matches!(file.imported.content, Content::Map(_)) {
        let accepted = "a height map (`asperity surface` makes one of them)";
        return Err(Error::format(path, "Fourier coefficients", accepted));
    }
    // Other units are labels, which a file without a unit may have.
    let is_known = |unit: &String| file.imported.declared.unit_m().is_some() || scene::metres_of(unit).is_some();
    scene.surface.unit = options.unit.clone().filter(is_known);
    let mut list = file.complete(&mut scene);
    // Options have the last words of the scene's keys.
    for complaint in &mut list {
        complaint.key = scene::last_part(&complaint.key).into();
    }
    if !list.is_empty() {
        return Err(Error::Input { place: PLACE.into(), list });
    }
    scene::resolve_surface(&scene, Some(file), None, PLACE).map(|resolved| resolved.surface)
}

/// Named in errors.
const PLACE: &str = "surface";

fn positive(key: &str, value: f64) -> Result<()> {
    match value.is_finite() && value > 0.0 {
        true => Ok(()),
        false => Err(Error::input(PLACE, key, value, "a positive number")),
    }
}

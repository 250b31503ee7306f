//! The surface of a scene.

use super::check::cut_offs;
use super::model::SurfaceKind;
use super::other_body::OtherFile;
use super::surface_file::{PreparedFile, SurfaceFile};
use super::{LaboratoryScene, Scene};
use crate::{Error, Result};
use asperity_grid::Grid;
use asperity_grid::error::Complaint;
use asperity_surface::height_map::Touching;
use asperity_surface::import::{Content, Fourier};
use asperity_surface::provenance::Provenance;
use asperity_surface::{FourierModes, HeightSource, Modes, Spectrum, Surface, Wave};
use std::sync::Arc;

/// A surface with what its file determines beyond the heights.
pub struct ResolvedSurface {
    pub surface: Surface,
    /// The scene's, with the extents of the prepared cell.
    pub laboratory: LaboratoryScene,
    /// What is doubtful about its file.
    pub warnings: Vec<String>,
}

/// The surface of a scene: synthesised, or that of its file, prepared, with low points touching first, and the heights of the other rough
/// body added. The scene is complete ([`SurfaceFile::complete`]).
///
/// # Errors
/// Those of [`Preparation::apply`](asperity_surface::Preparation::apply) and [`FourierModes::new`], waves that the transform's own grid
/// does not hold, keys of other kinds of surfaces, a grid that does not hold every wave.
pub fn resolve(
    scene: &Scene,
    file: Option<SurfaceFile>,
    other: Option<OtherFile>,
    context: &str,
) -> Result<ResolvedSurface> {
    let (s, mut laboratory) = (&scene.surface, scene.laboratory.clone());
    let square = Grid::unit(s.grid, s.grid);
    let Some(file) = file else {
        let (lambda_r, lambda_s) = cut_offs(s, laboratory.length());
        let spectrum =
            Spectrum { hurst: s.hurst, lambda_r, lambda_s, rms_gradient: s.rms_gradient, amplitudes: s.amplitudes };
        let source = HeightSource::Synthesised { modes: Modes::new(spectrum, s.seed, 1.0), spectrum, seed: s.seed };
        let surface = Surface::from_source(source, square, laboratory.length().si());
        return Ok(ResolvedSurface { surface, laboratory, warnings: Vec::new() });
    };
    let kind = match file.imported.content {
        Content::Map(_) => (SurfaceKind::Map, "heights"),
        Content::Waves(_) => (SurfaceKind::Waves, "Fourier coefficients"),
    };
    let accepted = format!("none: {} has {}", file.path().display(), kind.1);
    let foreign = s.foreign_keys(kind.0).into_iter().map(|key| Complaint::new(key, "given", &accepted));
    let list: Vec<Complaint> = foreign.collect();
    if !list.is_empty() {
        return Err(Error::Input { place: context.to_string(), list });
    }
    let touching = s.touching.unwrap_or(Touching::LowPoints);
    let of_other = other.iter().flat_map(OtherFile::warnings);
    let mut warnings: Vec<String> = file.imported.warnings.iter().chain(of_other).cloned().collect();
    let (source, grid, provenance) = if let Content::Waves(_) = file.imported.content {
        let (modes, provenance) = series(scene, file, touching)?;
        if !modes.resolved_on(Grid::unit(s.grid.max(1), s.grid.max(1))) {
            let least = modes.smallest_grid();
            let accepted =
                format!("at least {least}, which resolves every wave, or surface.low_pass that leaves fewer");
            return Err(Error::input(context, "surface.grid", s.grid, accepted));
        }
        let origin = format!("read from {provenance}; {}", modes.summary());
        (HeightSource::Fourier { modes, origin }, square, provenance)
    } else {
        let first = file.prepare(scene)?;
        let PreparedFile { mut map, extent: [x, y], provenance, warnings: of_steps } = match other {
            Some(other) => other.added_to(first, scene, context)?,
            None => first,
        };
        warnings.extend(of_steps);
        (laboratory.length, laboratory.length_y) = (Some(laboratory.of_number(x)), Some(laboratory.of_number(y)));
        map.heights.iter_mut().for_each(|h| *h *= 1.0 / x);
        let grid = Grid { ly: y / x, ..Grid::unit(map.nx, map.ny) };
        let origin = format!("read from {provenance}");
        (HeightSource::Imported { grid, heights: Arc::new(map.heights), origin }, grid, provenance)
    };
    let surface = Surface::from_source(source, grid, laboratory.length().si()).with_provenance(Some(provenance));
    Ok(ResolvedSurface { surface, laboratory, warnings })
}

/// Fourier coefficients of a file over the cell's extent.
fn series(scene: &Scene, file: SurfaceFile, sign: Touching) -> Result<(FourierModes, Provenance)> {
    let (s, lab) = (&scene.surface, &scene.laboratory);
    let Content::Waves(waves) = &file.imported.content else { unreachable!("a map is no series") };
    let points = s.fourier_points.filter(|_| s.fourier == Some(Fourier::Fftw));
    let beyond = |w: &&Wave| points.is_some_and(|n| 2 * w.kx.unsigned_abs().max(w.ky.unsigned_abs()) as usize >= n);
    if let (Some(n), Some(w)) = (points, waves.iter().find(beyond)) {
        let found = format!("q = ({}, {})", w.kx, w.ky);
        return Err(Error::format(
            file.path(),
            found,
            format!("waves below half of the {n} points of surface.fourier_points (--fourier-points)"),
        ));
    }
    let sign = if sign == Touching::HighPoints { -1.0 } else { 1.0 };
    let scale = points.map_or(1.0, |n| (n as f64).powi(-2));
    let low_pass = s.low_pass.map_or(0.0, |length| lab.reduced(length));
    let unit = file.height_unit(scene);
    let modes = FourierModes::new(file.path(), waves, sign * scale * (unit / lab.number(lab.length())), low_pass)?;
    let series = match points {
        None => "coefficients a of h(r) = Σ a exp(iq·r)".to_string(),
        Some(n) => format!("n² a of h(r) = Σ a exp(iq·r), n = {n}"),
    };
    Ok((modes, file.provenance_of_waves(scene, &series)?))
}

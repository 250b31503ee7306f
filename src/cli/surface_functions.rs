//! Functions of a surface over wave number and distance, as tables.

use crate::Result;
use crate::scene::Case;
use asperity_grid::Grid;
use asperity_surface::files::csv;
use asperity_surface::{AtDistance, Axis, power_spectra, scale_dependent};
use std::f64::consts::{PI, TAU};
use std::path::Path;

/// Writes power spectral densities and differences of heights along both axes to a folder, in SI units. The spectra of a patch are those
/// about its mean plane under a Hann window.
pub(super) fn write(folder: &Path, case: &Case, heights: &[f64]) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(crate::Error::io("create", folder))?;
    let (metres, periodic) = (case.scales.length_m, !case.is_non_periodic());
    let cell = case.model.grid;
    let grid = Grid { lx: cell.lx * metres, ly: cell.ly * metres, ..cell };
    let heights: Vec<f64> = heights.iter().map(|h| h * metres).collect();
    for (name, axis) in [("x", Axis::X), ("y", Axis::Y)] {
        let list = scale_dependent(grid, &heights, axis, periodic);
        let column = |value: &dyn Fn(&AtDistance) -> f64| list.iter().map(value).collect::<Vec<_>>();
        csv::write(
            &folder.join(format!("scale_dependent_{name}.csv")),
            &[
                ("distance_m", &column(&|p| p.distance)),
                ("structure_function_m2", &column(&|p| p.structure_function)),
                ("slope", &column(&|p| p.slope)),
                ("curvature_per_m", &column(&|p| p.curvature.unwrap_or(f64::NAN))),
            ],
        )?;
    }
    let spectra = power_spectra(grid, &heights, periodic);
    for (name, list) in [("x", &spectra.x), ("y", &spectra.y)] {
        let (q, density) = list.iter().map(|p| (p.q, p.density)).unzip();
        spectrum(&folder.join(format!("power_spectrum_{name}.csv")), q, &[("c_1d_m3", density)])?;
    }
    let (q, area): (Vec<f64>, Vec<f64>) = spectra.radial.iter().map(|p| (p.q, p.density)).unzip();
    // In the units of a profile's, as Jacobs et al. have it; the profiles of a self-affine surface have 0.8 to 1.2 times as much.
    let isotropic = q.iter().zip(&area).map(|(q, c)| q * c / PI).collect();
    spectrum(&folder.join("power_spectrum_radial.csv"), q, &[("c_2d_m4", area), ("c_iso_m3", isotropic)])
}

fn spectrum(path: &Path, q: Vec<f64>, densities: &[(&str, Vec<f64>)]) -> Result<()> {
    let lengths: Vec<f64> = q.iter().map(|q| TAU / q).collect();
    let mut columns: Vec<(&str, &[f64])> = vec![("wave_number_per_m", &q), ("wavelength_m", &lengths)];
    columns.extend(densities.iter().map(|(name, values)| (*name, &values[..])));
    csv::write(path, &columns)
}

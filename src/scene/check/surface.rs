//! Checks of `[surface]`.

use super::complaints::Complaints;
use crate::record::import::Fourier;
use crate::scene::{Scene, SurfaceScene, Units};
use std::ops::RangeInclusive;

/// Grids of runs, whose statistics need two points per side.
const RUN_GRID: RangeInclusive<usize> = 2..=65_536;

/// Grids of single solves: past any machine's memory, and far below what overflows.
const SOLVE_GRID: RangeInclusive<usize> = 1..=1 << 20;

/// Shortest cut-off over the cell's extent. Random numbers of a mode are keyed by 32-bit mode numbers; long before that, 1e4 modes
/// per side take half a minute.
const SHORTEST_CUT_OFF: f64 = 1e-4;

/// Roll-off and cut-off wavelengths over the cell's extent, whichever way they are given.
pub(crate) fn cut_offs(surface: &SurfaceScene, length_um: f64) -> (f64, f64) {
    let pick = |um: Option<f64>, mode: Option<f64>, default: f64| match (um, mode) {
        (Some(um), _) => um / length_um,
        (None, Some(mode)) => 1.0 / mode,
        (None, None) => default,
    };
    (
        pick(surface.roll_off_um, surface.roll_off_mode, crate::surface::Spectrum::CHALLENGE.lambda_r),
        pick(surface.cut_off_um, surface.cut_off_mode, crate::surface::Spectrum::CHALLENGE.lambda_s),
    )
}

pub(super) fn check(c: &mut Complaints, scene: &Scene) {
    let points = match scene.laboratory.units {
        Units::Named => RUN_GRID,
        Units::Consistent => SOLVE_GRID,
    };
    let grids = format!("{} to {} points per side", points.start(), points.end());
    let s = &scene.surface;
    if s.heights.is_some() {
        file(c, scene);
        // Whether so few points hold every wave is known once the file is read.
        let waves = s.fourier.is_some_and(Fourier::are_waves);
        c.unless(!waves || s.grid <= *points.end(), "surface.grid", s.grid, &grids);
    } else {
        c.unless(points.contains(&s.grid), "surface.grid", s.grid, &grids);
        spectrum(c, scene);
    }
}

/// A file of heights or of Fourier coefficients.
fn file(c: &mut Complaints, scene: &Scene) {
    let s = &scene.surface;
    c.unless(
        scene.laboratory.contact_modulus_mpa.is_some(),
        "laboratory.contact_modulus_mpa",
        "not given",
        "the contact modulus E* = E/(1-ν²): an imported surface has none by default",
    );
    s.heights_unit_um.iter().for_each(|um| c.positive("surface.heights_unit_um", *um));
    s.remove_outliers.iter().for_each(|sd| c.positive("surface.remove_outliers", *sd));
    s.high_pass_um.iter().for_each(|um| c.positive("surface.high_pass_um", *um));
    let transform = s.fourier == Some(Fourier::Fftw);
    c.unless(
        s.fourier_points.is_some() == transform,
        "surface.fourier_points",
        s.fourier_points.map_or("not given".into(), |n| n.to_string()),
        "points per side of the transform's grid with surface.fourier = \"fftw\", and only with it",
    );
    c.unless(
        s.fourier_points.is_none_or(|n| (2..=65_536).contains(&n)),
        "surface.fourier_points",
        s.fourier_points.unwrap_or(0),
        "2 to 65536 points per side",
    );
    let waves = s.fourier.is_some_and(Fourier::are_waves);
    if let Some(um) = s.low_pass_um {
        c.positive("surface.low_pass_um", um);
    }
    if let Some(y) = scene.laboratory.length_y_um {
        c.positive("laboratory.length_y_um", y);
        c.unless(!waves, "laboratory.length_y_um", y, "none: the cell of Fourier coefficients is square");
    }
}

/// A surface from its spectrum.
fn spectrum(c: &mut Complaints, scene: &Scene) {
    let s = &scene.surface;
    for (key, given) in [
        ("surface.dataset", s.dataset.is_some()),
        ("surface.fourier", s.fourier.is_some()),
        ("surface.fourier_points", s.fourier_points.is_some()),
        ("surface.low_pass_um", s.low_pass_um.is_some()),
    ] {
        c.unless(!given, key, "given", "only together with a file, surface.heights");
    }
    c.unless(s.hurst > 0.0 && s.hurst <= 1.0, "surface.hurst", s.hurst, "a Hurst exponent above 0 and up to 1");
    c.positive("surface.rms_gradient", s.rms_gradient);
    let both = |a: Option<f64>, b: Option<f64>| a.is_some() && b.is_some();
    for (wave, mode, um, number) in [
        ("surface.roll_off_um", "surface.roll_off_mode", s.roll_off_um, s.roll_off_mode),
        ("surface.cut_off_um", "surface.cut_off_mode", s.cut_off_um, s.cut_off_mode),
    ] {
        c.unless(!both(um, number), wave, "given together with its mode number", "one of the two");
        // Of the cut-off there is more to check below.
        let [um, number] = [um, number].map(|v| v.filter(|_| wave == "surface.roll_off_um"));
        um.into_iter().for_each(|um| c.positive(wave, um));
        number.into_iter().for_each(|n| c.positive(mode, n));
    }
    wavelengths(c, scene);
}

/// Order and limits of the roll-off and cut-off wavelengths, reported by the key that the scene uses.
fn wavelengths(c: &mut Complaints, scene: &Scene) {
    let (s, length_um) = (&scene.surface, scene.laboratory.length());
    let (roll_off, cut_off) = cut_offs(s, length_um);
    // `solve --cut-off` is a fraction of the cell. Dividing by its length again may change the last digits.
    let unit = if scene.laboratory.units == Units::Consistent { length_um } else { 1.0 };
    const ROUNDING: f64 = 1e-9;
    let written =
        |[um_key, mode_key]: [&'static str; 2], um: Option<f64>, mode: Option<f64>, resolved: f64| match (um, mode) {
            (None, Some(mode)) => (mode_key, mode),
            (um, _) => (um_key, um.unwrap_or(resolved * length_um) / unit),
        };
    let (roll_off_key, roll_off_written) =
        written(["surface.roll_off_um", "surface.roll_off_mode"], s.roll_off_um, s.roll_off_mode, roll_off);
    let (cut_off_key, cut_off_written) =
        written(["surface.cut_off_um", "surface.cut_off_mode"], s.cut_off_um, s.cut_off_mode, cut_off);
    c.unless(
        cut_off <= roll_off * (1.0 + ROUNDING) || cut_off.is_nan() || roll_off.is_nan(),
        cut_off_key,
        format!("{cut_off_written} (with {roll_off_key} = {roll_off_written})"),
        "a short cut-off wavelength no longer than the roll-off wavelength",
    );
    c.unless(
        roll_off <= 1.0,
        roll_off_key,
        roll_off_written,
        "a wavelength of at most the cell's length, a mode of at least 1",
    );
    c.unless(
        cut_off >= SHORTEST_CUT_OFF * (1.0 - ROUNDING),
        cut_off_key,
        cut_off_written,
        "a wavelength of at least 1e-4 of the cell, a mode of at most 1e4",
    );
}

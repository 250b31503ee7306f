//! Checks of `[surface]`.

use super::complaints::Complaints;
use crate::scene::model::SurfaceKind;
use crate::scene::{Length, Scene, SurfaceScene};
use asperity_contact::method::{MethodCard, MethodKind};
use asperity_surface::SHORTEST_CUT_OFF;
use asperity_surface::import::Fourier;
use std::ops::RangeInclusive;

/// Grids of runs, whose statistics need two points per side.
const RUN_GRID: RangeInclusive<usize> = 2..=65_536;

/// Grids of single solves: past any machine's memory, and far below what overflows.
const SOLVE_GRID: RangeInclusive<usize> = 1..=1 << 20;

/// Roll-off and cut-off wavelengths over the cell's extent, whichever way they are given.
pub(crate) fn cut_offs(surface: &SurfaceScene, length: Length) -> (f64, f64) {
    let pick = |wave: Option<Length>, mode: Option<f64>, default: f64| match (wave, mode) {
        (Some(wave), _) => wave.over(length),
        (None, Some(mode)) => 1.0 / mode,
        (None, None) => default,
    };
    (
        pick(surface.roll_off, surface.roll_off_mode, asperity_surface::Spectrum::CHALLENGE.lambda_r),
        pick(surface.cut_off, surface.cut_off_mode, asperity_surface::Spectrum::CHALLENGE.lambda_s),
    )
}

pub(super) fn check(c: &mut Complaints, scene: &Scene) {
    let points = if scene.laboratory.is_plain() { SOLVE_GRID } else { RUN_GRID };
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
        scene.laboratory.modulus.is_some() || !scene.laboratory.bodies.is_empty(),
        "laboratory.modulus",
        "not given",
        "laboratory.bodies, or the contact modulus E* = E/(1-ν²): an imported surface has none by default",
    );
    s.remove_outliers.iter().for_each(|sd| c.positive("surface.remove_outliers", *sd));
    s.high_pass.iter().for_each(|wave| c.positive_quantity("surface.high_pass", *wave));
    s.extend_to.iter().for_each(|wave| c.positive_quantity("surface.extend_to", *wave));
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
    c.unless(
        !s.isotropic_map || s.profile,
        "surface.isotropic_map",
        "given",
        "only together with surface.profile: a profile has one line of heights",
    );
    if s.profile {
        profile(c, scene);
    }
    s.low_pass.iter().for_each(|wave| c.positive_quantity("surface.low_pass", *wave));
    if let Some(y) = scene.laboratory.length_y {
        c.positive_quantity("laboratory.length_y", y);
        c.unless(!waves, "laboratory.length_y", y, "none: the cell of Fourier coefficients is square");
    }
}

/// A profile, which is uniform along y unless a map is made of it.
fn profile(c: &mut Complaints, scene: &Scene) {
    let s = &scene.surface;
    c.unless(
        s.fourier.is_none(),
        "surface.fourier",
        "given with surface.profile",
        "none: a profile has positions and heights",
    );
    if s.isotropic_map {
        return;
    }
    c.unless(
        scene.continuum.is_periodic(),
        "continuum.periodic",
        "false with surface.profile",
        "a profile that repeats: surface.edges makes it so. Uniform along y it has no edges there",
    );
    c.unless(
        scene.atoms.is_none(),
        "surface.profile",
        "given with [atoms]",
        "a map, as of surface.isotropic_map: the block of atoms is square",
    );
    let estimates = |m: &MethodCard| m.kind == MethodKind::Estimate;
    let own = asperity_methods::find(&scene.continuum.method).map(|m| m.card());
    c.unless(
        !own.is_some_and(estimates) && scene.continuum.compare_with.is_empty(),
        "surface.profile",
        "given with a method that estimates, or continuum.compare_with",
        "a solver of the fields, or surface.isotropic_map: estimates are for roughness along both axes",
    );
}

/// A surface from its spectrum.
fn spectrum(c: &mut Complaints, scene: &Scene) {
    let s = &scene.surface;
    for key in s.foreign_keys(SurfaceKind::Spectrum) {
        c.unless(false, key, "given", "only together with a file, surface.heights");
    }
    let y = scene.laboratory.length_y;
    c.unless(
        y.is_none(),
        "laboratory.length_y",
        y.map_or(String::new(), |y| y.to_string()),
        "none: the cell of a spectrum is square",
    );
    c.unless(s.hurst > 0.0 && s.hurst <= 1.0, "surface.hurst", s.hurst, "a Hurst exponent above 0 and up to 1");
    c.positive("surface.rms_gradient", s.rms_gradient);
    for (wave, mode, length, number) in [
        ("surface.roll_off", "surface.roll_off_mode", s.roll_off, s.roll_off_mode),
        ("surface.cut_off", "surface.cut_off_mode", s.cut_off, s.cut_off_mode),
    ] {
        let both = length.is_some() && number.is_some();
        c.unless(!both, wave, "given together with its mode number", "one of the two");
        // Of the cut-off there is more to check below.
        if wave == "surface.roll_off" {
            length.into_iter().for_each(|length| c.positive_quantity(wave, length));
            number.into_iter().for_each(|n| c.positive(mode, n));
        }
    }
    wavelengths(c, scene);
}

/// Order and limits of the roll-off and cut-off wavelengths, reported by the key that the scene uses.
fn wavelengths(c: &mut Complaints, scene: &Scene) {
    let (s, length) = (&scene.surface, scene.laboratory.length());
    let (roll_off, cut_off) = cut_offs(s, length);
    // Quotients of lengths may differ in the last digits.
    const ROUNDING: f64 = 1e-9;
    let written = |keys: [&'static str; 2], wave: Option<Length>, mode: Option<f64>, resolved: f64| match (wave, mode) {
        (None, Some(mode)) => (keys[1], mode.to_string()),
        (wave, _) => (keys[0], wave.unwrap_or(length.with(resolved * length.value())).to_string()),
    };
    let (roll_off_key, roll_off_written) =
        written(["surface.roll_off", "surface.roll_off_mode"], s.roll_off, s.roll_off_mode, roll_off);
    let (cut_off_key, cut_off_written) =
        written(["surface.cut_off", "surface.cut_off_mode"], s.cut_off, s.cut_off_mode, cut_off);
    c.unless(
        cut_off <= roll_off * (1.0 + ROUNDING) || cut_off.is_nan() || roll_off.is_nan(),
        cut_off_key,
        format!("{cut_off_written} (with {roll_off_key} = {roll_off_written})"),
        "a short cut-off wavelength no longer than the roll-off wavelength",
    );
    c.unless(
        roll_off <= 1.0,
        roll_off_key,
        &roll_off_written,
        "a wavelength of at most the cell's length, a mode of at least 1",
    );
    c.unless(
        cut_off >= SHORTEST_CUT_OFF * (1.0 - ROUNDING),
        cut_off_key,
        &cut_off_written,
        "a wavelength of at least 1e-4 of the cell, a mode of at most 1e4",
    );
}

//! Checks of `[challenge]`.

use super::complaints::Complaints;
use super::surface::cut_offs;
use crate::scene::{REFERENCE_LOAD, Scene, WallKind};
use asperity_contact::problem::{AdhesionLaw, LoadKind};
use asperity_surface::Spectrum;

/// The challenge's statements are about its own problem.
pub(super) fn check(c: &mut Complaints, scene: &Scene) {
    let Some(challenge) = &scene.challenge else { return };
    let ids = asperity_methods::ids().join(", ");
    let second = &challenge.cross_check_method;
    c.unless(asperity_methods::find(second).is_some(), "challenge.cross_check_method", format!("{second:?}"), &ids);
    let same = |a: &str, b: &str| {
        asperity_methods::find(a).zip(asperity_methods::find(b)).is_some_and(|(a, b)| a.card().id == b.card().id)
    };
    c.unless(
        !same(second, &scene.continuum.method),
        "challenge.cross_check_method",
        format!("{second:?}"),
        "another method than continuum.method",
    );
    let (lab, s, a, m) = (&scene.laboratory, &scene.surface, &scene.adhesion, &scene.continuum);
    let own = |value: f64, its: f64| (value / its - 1.0).abs() < 1e-9;
    let (length, modulus) = (lab.length(), lab.modulus());
    c.unless(own(length.to("um"), 100.0), "laboratory.length", length, "100 um with [challenge]");
    c.unless(own(modulus.to("MPa"), 25.0), "laboratory.modulus", modulus, "25 MPa with [challenge]");
    if s.heights.is_none() {
        let (lambda_r, lambda_s) = cut_offs(s, length);
        let its = Spectrum::CHALLENGE;
        for (key, value, own_value) in [
            ("surface.hurst", s.hurst, its.hurst),
            ("surface.roll_off", lambda_r * length.to("um"), its.lambda_r * 100.0),
            ("surface.cut_off", lambda_s * length.to("um"), its.lambda_s * 100.0),
            ("surface.rms_gradient", s.rms_gradient, its.rms_gradient),
        ] {
            c.unless(own(value, own_value), key, value, &format!("{own_value} with [challenge]"));
        }
    }
    let its = a.as_ref().is_some_and(|a| {
        own(a.work_of_adhesion.to("mJ/m2"), 50.0) && own(a.range.to("nm"), 2.071) && a.law == AdhesionLaw::Exponential
    });
    c.unless(its, "adhesion", "another than the challenge's", "50 mJ/m² over 2.071 nm, exponential, with [challenge]");
    let plain = m.layer.is_none() && m.crystal.is_none() && m.is_periodic() && m.wall == WallKind::Hard;
    c.unless(plain, "continuum", "another body or wall", "a periodic half-space and a hard wall with [challenge]");
    let loads = scene.load.loads();
    let reference = loads.kind == LoadKind::PStar && loads.values.iter().any(|p| own(*p, REFERENCE_LOAD));
    c.unless(reference, "load.p_star", "without 0.01", "loads with 0.01, the reference of [challenge]");
}

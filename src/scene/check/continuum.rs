//! Checks of `[continuum]`.

use super::complaints::Complaints;
use crate::scene::{ALL_METHODS, Length, Scene, WallKind};
use asperity_contact::interface::RangeChoice;
use asperity_contact::method::{MethodKind, Precision};

pub(super) fn check(c: &mut Complaints, scene: &Scene) {
    let m = &scene.continuum;
    let ids = asperity_methods::ids().join(", ");
    c.unless(asperity_methods::find(&m.method).is_some(), "continuum.method", format!("{:?}", m.method), &ids);
    for (i, id) in m.compare_with.iter().enumerate() {
        let is_known = id == ALL_METHODS || asperity_methods::find(id).is_some();
        c.unless(
            is_known,
            &format!("continuum.compare_with[{i}]"),
            format!("{id:?}"),
            &format!("{ALL_METHODS}, {ids}"),
        );
    }
    estimates(c, scene);
    let extrapolates = scene.adhesion.as_ref().is_some_and(|a| a.resolution == RangeChoice::Extrapolate);
    c.unless(
        m.initial_gap.is_none() || !extrapolates,
        "adhesion.resolution",
        "\"extrapolate\" with continuum.initial_gap",
        "another range: the coarser grids of an extrapolation cannot start there",
    );
    let hindered = !m.is_periodic();
    c.unless(
        !(hindered && scene.atoms.is_some()),
        "continuum.periodic",
        "false with atoms",
        "a periodic surface: atoms repeat",
    );
    c.unless(
        !(hindered && (m.layer.is_some() || m.crystal.is_some())),
        "continuum.periodic",
        "false with continuum.layer or continuum.crystal",
        "a periodic surface, or the half-space",
    );
    hardness(c, scene);
    subsurface(c, scene);
    c.unless(
        m.layer.is_none() || m.crystal.is_none(),
        "continuum.crystal",
        "given together with continuum.layer",
        "one of the two: layers are isotropic",
    );
    match (m.wall, m.penalty_length) {
        (WallKind::Penalty, None) => c.unless(
            false,
            "continuum.penalty_length",
            "not given",
            "the compression of the penalty wall under a pressure of E*",
        ),
        (WallKind::Hard, Some(length)) => {
            c.unless(false, "continuum.penalty_length", length, "only together with continuum.wall = \"penalty\"")
        }
        (WallKind::Penalty, Some(_)) | (WallKind::Hard, None) => {}
    }
}

/// A hardness, and what cannot be combined with it.
fn hardness(c: &mut Complaints, scene: &Scene) {
    let m = &scene.continuum;
    let is_map = m.hardness_map.is_some();
    if let Some(unit) = m.hardness_map_unit {
        c.unless(is_map, "continuum.hardness_map_unit", unit, "only together with continuum.hardness_map");
        c.positive_quantity("continuum.hardness_map_unit", unit);
    }
    if !is_map && scene.hardness().is_none() {
        return;
    }
    let key = if is_map { "continuum.hardness_map" } else { "continuum.hardness" };
    c.unless(!is_map || scene.hardness().is_none(), key, "given together with a hardness", "one of the two");
    c.unless(m.initial_gap.is_none(), key, "given with continuum.initial_gap", "none: a gap has no history of flow");
}

/// Stress below the surface.
fn subsurface(c: &mut Complaints, scene: &Scene) {
    const DEPTHS: &str = "continuum.subsurface.depths";
    const POISSON: &str = "continuum.subsurface.poisson";
    let m = &scene.continuum;
    let Some(s) = &m.subsurface else { return };
    c.unless(!s.depths.is_empty(), DEPTHS, "no depth", "at least one");
    let thickness = m.layer.as_ref().map(|l| l.thickness);
    let accepted = match thickness {
        Some(largest) => format!("depths from 0 to {largest}, the thickness of the layer"),
        None => "finite depths from 0 on".into(),
    };
    for (i, depth) in s.depths.iter().enumerate() {
        let above =
            |largest: Length| if largest.value() > 0.0 { depth.over(largest) > 1.0 } else { depth.value() > 0.0 };
        let within = depth.value().is_finite() && depth.value() >= 0.0 && !thickness.is_some_and(above);
        c.unless(within, &format!("{DEPTHS}[{i}]"), depth, &accepted);
    }
    match (s.poisson, &m.layer) {
        (Some(nu), Some(layer)) => {
            let accepted = format!("none: the layer's own, {}", layer.poisson);
            c.unless(false, POISSON, nu, &accepted);
        }
        (Some(nu), None) => c.unless((0.0..=0.5).contains(&nu), POISSON, nu, "a Poisson's ratio from 0 to 0.5"),
        (None, None) => c.unless(false, POISSON, "not given", "the Poisson's ratio of the half-space"),
        (None, Some(_)) => {}
    }
    s.shear_strength.into_iter().for_each(|t| c.positive_quantity("continuum.subsurface.shear_strength", t));
    c.unless(m.crystal.is_none(), "continuum.subsurface", "given with continuum.crystal", "an isotropic body");
}

/// What a method that estimates cannot do.
fn estimates(c: &mut Complaints, scene: &Scene) {
    let m = &scene.continuum;
    if asperity_methods::find(&m.method).is_none_or(|m| m.card().kind == MethodKind::Solver) {
        return;
    }
    let extrapolates = scene.adhesion.as_ref().is_some_and(|a| a.resolution == RangeChoice::Extrapolate);
    for (requested, key) in [
        (scene.atoms.is_some(), "[atoms]"),
        (scene.challenge.is_some(), "[challenge]"),
        (scene.load.unload, "load.unload"),
        (!scene.load.contact.is_empty(), "load.contact"),
        (m.initial_gap.is_some(), "continuum.initial_gap"),
        (m.leakage, "continuum.leakage"),
        (m.subsurface.is_some(), "continuum.subsurface"),
        (extrapolates, "adhesion.resolution = \"extrapolate\""),
        (scene.adhesion.as_ref().is_some_and(|a| !a.other_ranges.is_empty()), "adhesion.other_ranges"),
        (m.precision == Precision::F32, "continuum.precision = \"f32\""),
    ] {
        c.unless(
            !requested,
            "continuum.method",
            format!("{:?} with {key}", m.method),
            "a solver of the fields (see `asperity methods`); estimates belong in continuum.compare_with",
        );
    }
}

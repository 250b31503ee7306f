//! Checks of `[continuum]`.

use super::complaints::Complaints;
use crate::scene::{ALL_METHODS, Length, Scene, WallKind};
use asperity_contact::interface::RangeChoice;
use asperity_contact::method::{MethodKind, Precision};
use asperity_grid::error::{Complaint, Error};

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
    if let Some(t) = m.tolerance {
        c.unless(t > 0.0 && t < 1.0, "continuum.tolerance", t, "a number between 0 and 1");
    }
    for (key, goal) in [
        ("continuum.energy_tolerance", m.energy_tolerance),
        ("continuum.area_tolerance", m.area_tolerance),
        ("continuum.mean_gap_tolerance", m.mean_gap_tolerance),
    ] {
        goal.into_iter().for_each(|g| c.positive(key, g));
    }
    c.unless(
        m.energy_tolerance.is_none()
            || asperity_methods::find(&m.method).is_none_or(|m| m.card().capabilities.energy_target),
        "continuum.energy_tolerance",
        m.energy_tolerance.unwrap_or(0.0),
        "none with this method: `fast` estimates its energy above the minimum",
    );
    c.unless(m.max_iterations > 0, "continuum.max_iterations", m.max_iterations, "at least 1");
    let extrapolates = scene.adhesion.as_ref().is_some_and(|a| a.resolution == RangeChoice::Extrapolate);
    c.unless(
        m.initial_gap.is_none() || !extrapolates,
        "adhesion.resolution",
        "\"extrapolate\" with continuum.initial_gap",
        "another range: the coarser grids of an extrapolation cannot start there",
    );
    non_periodic(c, scene);
    hardness(c, scene);
    subsurface(c, scene);
    body(c, scene);
    match (m.wall, m.penalty_length) {
        (WallKind::Penalty, None) => c.unless(
            false,
            "continuum.penalty_length",
            "not given",
            "the compression of the penalty wall under a pressure of E*",
        ),
        (WallKind::Penalty, Some(length)) => c.positive_quantity("continuum.penalty_length", length),
        (WallKind::Hard, Some(length)) => {
            c.unless(false, "continuum.penalty_length", length, "only together with continuum.wall = \"penalty\"")
        }
        (WallKind::Hard, None) => {}
    }
}

/// A surface that is not periodic.
fn non_periodic(c: &mut Complaints, scene: &Scene) {
    let m = &scene.continuum;
    if m.is_periodic() {
        return;
    }
    let extrapolates = scene.adhesion.as_ref().is_some_and(|a| a.resolution == RangeChoice::Extrapolate);
    for (hinders, what, accepted) in [
        (scene.atoms.is_some(), "atoms", "a periodic surface: atoms repeat"),
        (
            m.layer.is_some() || m.crystal.is_some(),
            "continuum.layer or continuum.crystal",
            "a periodic surface, or the half-space",
        ),
        (
            asperity_methods::find(&m.method).is_some_and(|m| !m.card().capabilities.non_periodic),
            "this continuum.method",
            "a periodic surface, or continuum.method = \"fast\"",
        ),
        (
            scene.load.pull_off || !scene.load.mean_gap.is_empty() || !scene.load.displacement.is_empty(),
            "a mean gap, a displacement or a pull-off",
            "a periodic surface, or load control",
        ),
        (extrapolates, "adhesion.resolution = \"extrapolate\"", "a periodic surface, or another range"),
    ] {
        c.unless(!hinders, "continuum.periodic", format!("false with {what}"), accepted);
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
    m.hardness.into_iter().for_each(|hardness| c.positive_quantity("continuum.hardness", hardness));
    if !is_map && m.hardness.is_none() {
        return;
    }
    let key = if is_map { "continuum.hardness_map" } else { "continuum.hardness" };
    c.unless(!is_map || m.hardness.is_none(), key, "given together with continuum.hardness", "one of the two");
    let accepted = "continuum.hardness: a map has no gap of first flow behind a soft wall";
    c.unless(!is_map || m.wall == WallKind::Hard, key, "given with continuum.wall = \"penalty\"", accepted);
    let capable: Vec<&str> =
        asperity_methods::REGISTRY.iter().map(|m| m.card()).filter(|m| m.capabilities.hardness).map(|m| m.id).collect();
    let accepted = format!("none, or a method that models plastic flow: {}", capable.join(", "));
    for id in std::iter::once(&m.method).chain(m.compare_with.iter().filter(|id| *id != ALL_METHODS)) {
        let models = asperity_methods::find(id).is_none_or(|m| m.card().capabilities.hardness);
        c.unless(models, key, format!("given with the method {id}"), &accepted);
    }
    let extrapolates = scene.adhesion.as_ref().is_some_and(|a| a.resolution == RangeChoice::Extrapolate);
    c.unless(!extrapolates, key, "given with adhesion.resolution = \"extrapolate\"", "another range");
    c.unless(m.initial_gap.is_none(), key, "given with continuum.initial_gap", "none: a gap has no history of flow");
    let l = &scene.load;
    let needs_pressures = !l.mean_gap.is_empty() || !l.displacement.is_empty() || !l.contact.is_empty() || l.pull_off;
    let accepted = "loads as pressure, force or p*: searches for other loads would leave flow behind";
    c.unless(
        !needs_pressures,
        key,
        "given with a mean gap, a displacement, a contact fraction or a pull-off",
        accepted,
    );
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
    let solves = asperity_methods::find(&m.method).is_none_or(|m| m.card().kind == MethodKind::Solver);
    let accepted = "a solver of the fields (see `asperity methods`)";
    c.unless(solves, "continuum.subsurface", format!("given with the method {}", m.method), accepted);
}

/// Layer or crystal.
fn body(c: &mut Complaints, scene: &Scene) {
    let m = &scene.continuum;
    if let Some(layer) = &m.layer {
        c.positive_quantity("continuum.layer.thickness", layer.thickness);
        let nu = layer.poisson;
        c.unless((0.0..=0.5).contains(&nu), "continuum.layer.poisson", nu, "a Poisson's ratio from 0 to 0.5");
    }
    if let Some(crystal) = &m.crystal {
        c.unless(
            m.layer.is_none(),
            "continuum.crystal",
            "given together with continuum.layer",
            "one of the two: layers are isotropic",
        );
        // The kernel checks that the crystal is stable and its stiffness a short series.
        if let Err(Error::Input { list, .. }) = crystal.half_space() {
            for complaint in list {
                let (key, found) = match complaint.key.as_str() {
                    "C11" => ("continuum.crystal.c11".into(), crystal.c11.to_string()),
                    "C44" => ("continuum.crystal.c44".into(), crystal.c44.to_string()),
                    other => (format!("continuum.crystal, {other}"), complaint.found),
                };
                c.0.push(Complaint { key, found, ..complaint });
            }
        }
    }
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
        (extrapolates, "adhesion.resolution = \"extrapolate\""),
        (scene.adhesion.as_ref().is_some_and(|a| !a.other_ranges.is_empty()), "adhesion.other_ranges"),
        (m.area_tolerance.is_some(), "continuum.area_tolerance"),
        (m.mean_gap_tolerance.is_some(), "continuum.mean_gap_tolerance"),
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

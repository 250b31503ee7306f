//! Checks of two bodies: their elastic constants, and the surface of the second.

use super::complaints::Complaints;
use crate::scene::{BodyScene, DetrendScene, Scene};
use asperity_surface::import::Fourier;

pub(super) fn check(c: &mut Complaints, scene: &Scene) {
    elastic(c, scene);
    other(c, scene);
}

fn elastic(c: &mut Complaints, scene: &Scene) {
    const BODIES: &str = "laboratory.bodies";
    let (lab, m) = (&scene.laboratory, &scene.continuum);
    let Some(first) = lab.bodies.first() else { return };
    c.unless(lab.bodies.len() <= 2, BODIES, format!("{} bodies", lab.bodies.len()), "one or two");
    c.unless(lab.modulus.is_none(), BODIES, "given together with laboratory.modulus", "one of the two");
    let half_space = m.layer.is_none() && m.crystal.is_none();
    let accepted = "laboratory.modulus with a layer (a coating) or a crystal: only of half-spaces the compliances add up to one contact modulus";
    c.unless(half_space, BODIES, "given with continuum.layer or continuum.crystal", accepted);
    let twice = m.hardness.is_some() || m.hardness_map.is_some();
    c.unless(!twice || lab.hardness().is_none(), BODIES, "a hardness, and one of continuum", "one of the two");
    for (i, BodyScene { young, poisson, hardness }) in lab.bodies.iter().enumerate() {
        let key = |name: &str| format!("{BODIES}[{i}].{name}");
        c.positive_quantity(&key("young"), *young);
        c.unless((0.0..=0.5).contains(poisson), &key("poisson"), poisson, "a Poisson's ratio from 0 to 0.5");
        hardness.iter().for_each(|h| c.positive_quantity(&key("hardness"), *h));
        let mixed = young.is_plain() != first.young.is_plain();
        c.unless(!mixed, &key("young"), young, "with a unit as the first body, or none has one");
    }
}

fn other(c: &mut Complaints, scene: &Scene) {
    const OTHER: &str = "surface.other";
    let Some(other) = &scene.surface.other else { return };
    let waves = scene.surface.fourier.is_some_and(Fourier::are_waves);
    let is_map = scene.surface.heights.is_some() && !waves;
    c.unless(
        is_map,
        OTHER,
        "given",
        "only together with a height map, surface.heights (`asperity surface --out` writes one)",
    );
    c.unless(
        scene.surface.extend_to.is_none(),
        "surface.extend_to",
        "given with surface.other",
        "none: `asperity surface --extend-to --out` extends each map, with a seed of its own",
    );
    c.unless(
        !scene.surface.isotropic_map,
        "surface.isotropic_map",
        "given with surface.other",
        "none: `asperity surface --isotropic-map --out` makes each map, with a seed of its own",
    );
    let points = matches!(scene.surface.detrend, Some(DetrendScene::ThreePoints(_)));
    c.unless(
        !points,
        "surface.detrend",
        "three points given with surface.other",
        "another form: `asperity surface --detrend three-points=… --out` levels each map",
    );
    let lengths = [("length", other.length), ("length_y", other.length_y)];
    lengths.into_iter().filter_map(|(key, l)| Some((key, l?))).for_each(|(key, l)| {
        c.positive_quantity(&format!("{OTHER}.{key}"), l);
    });
    c.unless(other.quarter_turns <= 3, &format!("{OTHER}.quarter_turns"), other.quarter_turns, "0, 1, 2 or 3");
}

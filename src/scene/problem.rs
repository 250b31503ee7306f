//! The problem that a scene states.

use super::{AdhesionScene, LaboratoryScene, Length, Scene};
use asperity_contact::method::Fast;
use asperity_contact::problem::{Adhesion, Body, Hardness, Problem};
use asperity_surface::Surface;

/// The attraction of a scene with this range.
pub(super) fn adhesion(a: &AdhesionScene, range: Length) -> Adhesion {
    Adhesion {
        work_of_adhesion: a.work_of_adhesion.si(),
        range: range.si(),
        law: a.law,
        resolution: a.resolution,
        table: None,
    }
}

/// The problem of a scene in SI units; plain numbers stay as they are.
pub(super) fn problem(scene: &Scene, lab: &LaboratoryScene, surface: Surface, map: Option<Hardness>) -> Problem {
    let c = &scene.continuum;
    let body = match (&c.layer, &c.crystal) {
        (Some(l), _) => Body::Layer { thickness: l.thickness.si(), poisson: l.poisson, base: l.base },
        (None, Some(c)) => {
            // Only their ratios matter.
            let [c11, c12, c44] = [c.c11, c.c12, c.c44].map(|c| c.to("GPa"));
            Body::Cubic { c11, c12, c44 }
        }
        (None, None) if !c.is_periodic() => Body::NonPeriodic,
        (None, None) => Body::HalfSpace,
    };
    Problem {
        body,
        adhesion: scene.adhesion.as_ref().map(|a| adhesion(a, a.range)),
        penalty_length: c.penalty_length.map(Length::si),
        hardness: map.or(scene.hardness().map(|h| h.si().into())),
        // An unknown one is a complaint of its own.
        method: asperity_methods::find(&c.method).unwrap_or(&Fast),
        precision: c.precision,
        tolerance: c.tolerance,
        max_iterations: c.max_iterations,
        settings: scene.methods,
        ..Problem::new(surface, lab.modulus().si())
    }
}

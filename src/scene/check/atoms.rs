//! Checks of `[atoms]`.

use super::complaints::Complaints;
use super::nvt;
use crate::scene::{AtomsScene, AtomsStart, HALF_SPACE_EDGES, MOST_FOUNDATION_CELLS, Scene};
use asperity_atoms::block::BaseKind;
use asperity_grid::units::MAX_SECONDS;

/// Deepest foundation of an elastic base, edges of the block: deeper ones only lower the indenter.
const MOST_EDGES: usize = 10;

pub(super) fn check(c: &mut Complaints, scene: &Scene) {
    let Some(a) = &scene.atoms else { return };
    c.unless((4..=2000).contains(&a.cells), "atoms.cells", a.cells, "4 to 2000 lattice constants");
    c.unless((1..=1000).contains(&a.depth_cells), "atoms.depth_cells", a.depth_cells, "1 to 1000 lattice constants");
    c.unless(
        a.time_limit.is_none_or(|t| t.to("s") <= MAX_SECONDS),
        "atoms.time_limit",
        a.time_limit.map_or(String::new(), |t| t.to_string()),
        &format!("at most {MAX_SECONDS} s"),
    );
    let attracts = scene.adhesion.as_ref().is_some_and(|a| a.work_of_adhesion.value() > 0.0);
    let from_touch = attracts || a.start_or_default(attracts) == AtomsStart::Touch;
    base(c, a, from_touch);
    c.unless(
        !a.element.is_empty() && a.element.chars().all(|ch| ch.is_ascii_alphanumeric()),
        "atoms.element",
        format!("{:?}", a.element),
        "a chemical symbol",
    );
    let lengths = [
        ("atoms.step", a.step),
        ("atoms.adhesion_range", Some(a.adhesion_range)),
        ("atoms.low_pass", a.low_pass),
        ("atoms.lattice_constant", a.lattice_constant),
        ("atoms.indenter_sigma", a.indenter_sigma),
        ("atoms.contact_distance", a.contact_distance),
        ("atoms.stress_width", a.stress_width),
    ];
    lengths.into_iter().filter_map(|(key, v)| Some((key, v?))).for_each(|(key, v)| c.positive_quantity(key, v));
    a.hardness.into_iter().for_each(|h| c.positive_quantity("atoms.hardness", h));
    a.modulus.into_iter().for_each(|e| c.positive_quantity("atoms.modulus", e));
    c.positive_quantity("atoms.force_tolerance", a.force_tolerance);
    a.contact_force.into_iter().for_each(|f| c.positive_quantity("atoms.contact_force", f));
    a.indenter_epsilon.into_iter().for_each(|e| c.positive_quantity("atoms.indenter_epsilon", e));
    a.time_limit.into_iter().for_each(|t| c.positive_quantity("atoms.time_limit", t));
    c.unless(
        !(attracts && a.start == Some(AtomsStart::Continuum)),
        "atoms.start",
        "\"continuum\"",
        "\"touch\" with adhesion: the state depends on the load path",
    );
    c.unless(
        !(a.start == Some(AtomsStart::Continuum) && a.step.is_some()),
        "atoms.step",
        a.step.map_or(String::new(), |step| step.to_string()),
        "only together with atoms.start = \"touch\": from the continuum there are no steps",
    );
    c.unless(
        !(a.depth_error && scene.continuum.layer.is_some()),
        "atoms.depth_error",
        "true",
        "false with continuum.layer: the block is judged by a half-space",
    );
    c.unless(
        scene.adhesion.is_some() || a.adhesion_range == AtomsScene::default().adhesion_range,
        "atoms.adhesion_range",
        a.adhesion_range,
        "only together with [adhesion]",
    );
    a.nvt.iter().for_each(|n| nvt::check(c, n, a, scene));
    c.unless((1..=1024).contains(&a.ranks), "atoms.ranks", a.ranks, "1 to 1024 MPI ranks");
    constants(c, a);
}

/// Base and foundation.
fn base(c: &mut Complaints, a: &AtomsScene, from_touch: bool) {
    let depth = a.foundation_depth();
    c.unless(
        depth <= MOST_FOUNDATION_CELLS,
        "atoms.foundation_cells",
        depth,
        &format!("0 (a rigid base) to {MOST_FOUNDATION_CELLS} lattice constants"),
    );
    c.unless(
        !(depth > 0 && from_touch && a.base != Some(BaseKind::Elastic)),
        "atoms.foundation_cells",
        depth,
        "0, or atoms.base = \"elastic\", with a descent from first contact: a prescribed base has the displacement of the continuum's \
         solution at a load",
    );
    let elastic = a.base == Some(BaseKind::Elastic);
    c.unless(
        !elastic || depth <= MOST_EDGES.saturating_mul(a.cells),
        "atoms.foundation_cells",
        depth,
        &format!(
            "at most {MOST_EDGES} atoms.cells with an elastic base: for waves, a foundation from {HALF_SPACE_EDGES} on is a half-space"
        ),
    );
    let founded = depth > 0;
    c.unless(
        a.base.is_none_or(|base| founded == (base != BaseKind::Rigid)),
        "atoms.base",
        format!("{:?}", a.base.map(|b| format!("{b:?}").to_lowercase()).unwrap_or_default()),
        if founded {
            "\"prescribed\" or \"elastic\" with atoms.foundation_cells above 0 or \"half-space\""
        } else {
            "\"rigid\", or with atoms.foundation_cells above 0 or \"half-space\""
        },
    );
    c.unless(
        !(elastic && a.nvt.is_some()),
        "atoms.base",
        "\"elastic\"",
        "\"rigid\" or \"prescribed\" with atoms.nvt: the force constants of an elastic base are those of the crystal at 0 K",
    );
}

/// Constants of another potential.
fn constants(c: &mut Complaints, a: &AtomsScene) {
    for (key, value) in [
        ("atoms.lattice_constant", a.lattice_constant.map(|l| l.to_string())),
        ("atoms.modulus", a.modulus.map(|e| e.to_string())),
    ] {
        let alone = value.filter(|_| a.potential.is_none());
        c.unless(alone.is_none(), key, alone.unwrap_or_default(), "only together with atoms.potential");
    }
}

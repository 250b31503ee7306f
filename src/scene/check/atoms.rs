//! Checks of `[atoms]`.

use super::complaints::Complaints;
use super::nvt;
use crate::atoms::block::BaseKind;
use crate::scene::{AtomsScene, HALF_SPACE_EDGES, MOST_FOUNDATION_CELLS, Scene, Start};
use crate::units::MAX_SECONDS;

/// Deepest foundation of an elastic base, edges of the block: deeper ones only lower the indenter.
const MOST_EDGES: usize = 10;

pub(super) fn check(c: &mut Complaints, scene: &Scene) {
    let Some(a) = &scene.atoms else { return };
    c.unless((4..=2000).contains(&a.cells), "atoms.cells", a.cells, "4 to 2000 lattice constants");
    c.unless((1..=1000).contains(&a.depth_cells), "atoms.depth_cells", a.depth_cells, "1 to 1000 lattice constants");
    c.unless(
        a.time_limit_s.is_none_or(|s| !s.is_finite() || s <= MAX_SECONDS),
        "atoms.time_limit_s",
        a.time_limit_s.unwrap_or(0.0),
        &format!("at most {MAX_SECONDS}"),
    );
    let attracts = scene.adhesion.as_ref().is_some_and(|a| a.work_of_adhesion_mj_m2 > 0.0);
    let from_touch = attracts || a.start_or_default(attracts) == Start::Touch;
    base(c, a, from_touch);
    c.unless(
        !a.element.is_empty() && a.element.chars().all(|ch| ch.is_ascii_alphanumeric()),
        "atoms.element",
        format!("{:?}", a.element),
        "a chemical symbol",
    );
    for (key, value) in [
        ("atoms.step_angstrom", a.step_angstrom),
        ("atoms.hardness_gpa", a.hardness_gpa),
        ("atoms.force_tolerance_ev_per_angstrom", Some(a.force_tolerance_ev_per_angstrom)),
        ("atoms.adhesion_range_angstrom", Some(a.adhesion_range_angstrom)),
        ("atoms.low_pass_angstrom", a.low_pass_angstrom),
        ("atoms.lattice_constant_angstrom", a.lattice_constant_angstrom),
        ("atoms.contact_modulus_gpa", a.contact_modulus_gpa),
        ("atoms.indenter_epsilon_ev", a.indenter_epsilon_ev),
        ("atoms.indenter_sigma_angstrom", a.indenter_sigma_angstrom),
        ("atoms.contact_distance_angstrom", a.contact_distance_angstrom),
        ("atoms.contact_force_ev_per_angstrom", a.contact_force_ev_per_angstrom),
        ("atoms.stress_width_angstrom", a.stress_width_angstrom),
        ("atoms.time_limit_s", a.time_limit_s),
    ] {
        if let Some(v) = value {
            c.positive(key, v);
        }
    }
    c.unless(
        !(attracts && a.start == Some(Start::Continuum)),
        "atoms.start",
        "\"continuum\"",
        "\"touch\" with adhesion: the state depends on the load path",
    );
    c.unless(
        !(a.start == Some(Start::Continuum) && a.step_angstrom.is_some()),
        "atoms.step_angstrom",
        a.step_angstrom.unwrap_or(0.0),
        "only together with atoms.start = \"touch\": from the continuum there are no steps",
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
    for (key, given) in [
        ("atoms.lattice_constant_angstrom", a.lattice_constant_angstrom),
        ("atoms.contact_modulus_gpa", a.contact_modulus_gpa),
    ] {
        let alone = given.filter(|_| a.potential.is_none());
        c.unless(alone.is_none(), key, alone.unwrap_or(0.0), "only together with atoms.potential");
    }
}

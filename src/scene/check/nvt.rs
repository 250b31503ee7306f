//! Checks of `[atoms.nvt]`.

use super::complaints::Complaints;
use crate::scene::{AtomsScene, AtomsStart, NvtScene, Scene};
use asperity_atoms::nvt::{FREE_LAYERS, LEAST_AVERAGED_PS};
use asperity_atoms::potential::HOTTEST_K;

/// Strain of the crystal's expansion beyond which another unit or another crystal is more likely.
const MOST_EXPANSION: f64 = 0.1;

pub(super) fn check(c: &mut Complaints, nvt: &NvtScene, atoms: &AtomsScene, scene: &Scene) {
    let (t, shipped) = (nvt.temperature.to("K"), atoms.potential.is_none());
    let (a0, ps) = (atoms.lattice_constant, nvt.time.to("ps"));
    let attracts = scene.adhesion.as_ref().is_some_and(|a| a.work_of_adhesion.value() > 0.0);
    let from_touch = attracts || atoms.start_or_default(attracts) == AtomsStart::Touch;
    let least_depth = FREE_LAYERS / 2 + 1;
    let expanded = nvt.lattice_constant;
    let is_fraction = (0.0..=0.9).contains(&nvt.equilibration);
    let shortest = LEAST_AVERAGED_PS / if is_fraction { 1.0 - nvt.equilibration } else { 1.0 };
    let near = expanded.zip(a0).is_none_or(|(a, a0)| (a.over(a0) - 1.0).abs() <= MOST_EXPANSION);
    c.unless(
        t.is_finite() && t > 0.0 && (t <= HOTTEST_K || !shipped),
        "atoms.nvt.temperature",
        nvt.temperature,
        &format!("a positive number, with the shipped potential up to {HOTTEST_K} K: its expansion is measured so far"),
    );
    c.unless(
        ps.is_finite() && ps >= shortest,
        "atoms.nvt.time",
        nvt.time,
        &format!("at least {shortest:.2} ps, of which {LEAST_AVERAGED_PS} ps are averaged over"),
    );
    c.unless(is_fraction, "atoms.nvt.equilibration", nvt.equilibration.to_string(), "a fraction from 0 to 0.9");
    c.unless(
        expanded.is_some() != shipped,
        "atoms.nvt.lattice_constant",
        expanded.map_or("not given".into(), |a| a.to_string()),
        "the value at the temperature with atoms.potential (asperity potential --measure --temperature finds it), and only with it",
    );
    c.unless(
        near,
        "atoms.nvt.lattice_constant",
        expanded.map_or(String::new(), |a| a.to_string()),
        &format!("a lattice constant within {MOST_EXPANSION} of atoms.lattice_constant"),
    );
    c.unless(
        !from_touch,
        "atoms.nvt",
        "given with atoms that start from first contact",
        "atoms.start = \"continuum\" without adhesion: the steps of a displacement ramp are between the loads",
    );
    c.unless(
        atoms.depth_cells >= least_depth,
        "atoms.depth_cells",
        format!("{} with atoms.nvt", atoms.depth_cells),
        &format!("at least {least_depth}: the thermostat acts below the uppermost {FREE_LAYERS} layers"),
    );
}

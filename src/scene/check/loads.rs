//! Checks of `[load]`.

use super::complaints::Complaints;
use crate::scene::names::Keys;
use crate::scene::{LoadRange, LoadScene, Scene};
use asperity_contact::problem::{LoadKind, Names};

/// Loads that a message names.
const MOST_NAMED: usize = 24;

pub(super) fn check(c: &mut Complaints, scene: &Scene) {
    let load = &scene.load;
    let attracts = scene.adhesion.as_ref().is_some_and(|a| a.work_of_adhesion.value() > 0.0);
    let atoms = scene.atoms.is_some();
    kinds(c, load);
    load.p_star_range.iter().for_each(|r| load_range(c, r));
    let loads = load.loads();
    let key = Keys(scene).name(loads.kind.field());
    for (i, value) in loads.values.iter().enumerate() {
        let good = !atoms || *value > 0.0;
        c.unless(good, &format!("{key}[{i}]"), value, "a positive number: atoms are only pressed");
        // First contact without adhesion is given by the surface alone.
        let first = *value == 0.0 && !attracts && !matches!(loads.kind, LoadKind::MeanGap | LoadKind::Displacement);
        let accepted = "a positive number: only the method \"fast\" solves first contact";
        c.unless(!first || scene.continuum.compare_with.is_empty(), &format!("{key}[{i}]"), 0, accepted);
    }
    let accepted = "load.p_star, load.pressure or load.force: atoms are under load control";
    let presses = matches!(loads.kind, LoadKind::PStar | LoadKind::Pressure | LoadKind::Force);
    c.unless(!atoms || presses, &key, "given with atoms", accepted);
    branches_of_atoms(c, scene);
    maps(c, scene);
    let flows = scene.hardness().is_some() || scene.continuum.hardness_map.is_some();
    c.unless(
        !scene.load.unload || attracts || atoms || flows,
        "load.unload",
        "true",
        "only with adhesion.work_of_adhesion, [atoms], continuum.hardness or hardness_map: without them unloading repeats the loading branch",
    );
}

/// One kind of load, at least one value.
fn kinds(c: &mut Complaints, load: &LoadScene) {
    let kinds = [
        ("load.p_star", !load.p_star.is_empty()),
        ("load.p_star_range", load.p_star_range.is_some()),
        ("load.pressure", !load.pressure.is_empty()),
        ("load.force", !load.force.is_empty()),
        ("load.mean_gap", !load.mean_gap.is_empty()),
        ("load.displacement", !load.displacement.is_empty()),
        ("load.contact", !load.contact.is_empty()),
    ];
    let value: Vec<&str> = kinds.iter().filter(|(_, value)| *value).map(|(key, _)| *key).collect();
    let all = kinds.map(|(key, _)| key.trim_start_matches("load.")).join(", ");
    c.unless(!value.is_empty(), "load", "no loads", &format!("at least one, in one of {all}"));
    if let [first, second, ..] = value[..] {
        c.unless(false, second, format!("given together with {first}"), "one kind of load");
    }
}

fn load_range(c: &mut Complaints, r: &LoadRange) {
    c.positive("load.p_star_range.from", r.from);
    c.positive("load.p_star_range.to", r.to);
    c.unless(r.from != r.to, "load.p_star_range.to", r.to, "another load than .from");
    let decades = (r.to.log10() - r.from.log10()).abs();
    // Ends that are no positive numbers have their own complaint.
    let too_wide = decades.is_finite() && decades > LoadRange::DECADES;
    c.unless(
        !too_wide,
        "load.p_star_range.to",
        format!("{:e}", r.to),
        &format!("a load within {} decades of .from", LoadRange::DECADES),
    );
    let per_decade = r.per_decade;
    c.unless(LoadRange::PER_DECADE.contains(&per_decade), "load.p_star_range.per_decade", per_decade, "1 to 100 loads");
}

/// Atoms are pressed to the highest load and unloaded once, and each load is read on its branch.
fn branches_of_atoms(c: &mut Complaints, scene: &Scene) {
    let (loads, atoms) = (scene.load.loads(), scene.atoms.is_some());
    let (p, key) = (&loads.values, Keys(scene).name(loads.kind.field()));
    let falls = p.windows(2).position(|w| w[1] < w[0]).map(|i| i + 1);
    if let Some(i) = falls.filter(|_| atoms && !loads.is_closed() && loads.kind != LoadKind::MeanGap) {
        c.unless(
            false,
            &format!("{key}[{i}]"),
            scene.load.text(loads.kind, i).unwrap_or_else(|| p[i].to_string()),
            "no less than the load before, or load.unload: atoms are unloaded once, from the highest load",
        );
    }
    let path = loads.path();
    let there = &path[..path.len().div_ceil(2)];
    c.unless(
        !(atoms && scene.load.unload) || there.is_sorted_by(|a, b| a < b),
        "load.unload",
        "true with loads that do not rise",
        "rising loads: atoms unload from the highest",
    );
}

/// Loads whose maps are stored.
fn maps(c: &mut Complaints, scene: &Scene) {
    for (i, value) in scene.load.maps_at.iter().flatten().enumerate() {
        let known = !scene.load.indices_of(*value).is_empty();
        let loads = scene.load.loads();
        let shown = |(i, load): (usize, &f64)| scene.load.text(loads.kind, i).unwrap_or_else(|| load.to_string());
        let named: Vec<String> = loads.values.iter().enumerate().take(MOST_NAMED).map(shown).collect();
        let more = if loads.values.len() > MOST_NAMED { ", …" } else { "" };
        let accepted = format!("one of the loads: {}{more}", named.join(", "));
        c.unless(known, &format!("load.maps_at[{i}]"), value, &accepted);
    }
    c.unless(
        scene.load.maps_at.is_none() || scene.atoms.is_none(),
        "load.maps_at",
        "given with atoms",
        "none: atoms are compared with the maps of every load",
    );
}

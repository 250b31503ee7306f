//! Checks of `[load]`.

use super::complaints::Complaints;
use crate::method;
use crate::scene::{LoadRange, Scene};

/// Loads that a message names.
const MOST_NAMED: usize = 24;

pub fn check(c: &mut Complaints, scene: &Scene) {
    let p = &scene.load.p_star;
    let gaps = &scene.load.mean_gap_um;
    let range = &scene.load.p_star_range;
    let pressures = &scene.load.pressure_mpa;
    let given = [!p.is_empty(), range.is_some(), !gaps.is_empty(), !pressures.is_empty()];
    let given = given.into_iter().filter(|g| *g).count();
    c.unless(given > 0, "load.p_star", "[]", "at least one load, or load.p_star_range, or load.mean_gap_um");
    c.unless(
        given < 2,
        if gaps.is_empty() { "load.p_star_range" } else { "load.mean_gap_um" },
        "given together with other loads",
        "one of load.p_star, load.p_star_range and load.mean_gap_um",
    );
    range.iter().for_each(|r| load_range(c, r));
    let attracts = scene.adhesion.as_ref().is_some_and(|a| a.work_of_adhesion_mj_m2 > 0.0);
    let atoms = scene.atoms.is_some();
    let named = |name, list: &Vec<f64>| {
        list.iter().enumerate().map(move |(i, v)| (format!("{name}[{i}]"), *v)).collect::<Vec<_>>()
    };
    for (key, value) in [named("load.p_star", p), named("load.pressure_mpa", pressures)].concat() {
        c.unless(
            value.is_finite() && (value > 0.0 || attracts && !atoms),
            &key,
            value,
            "a positive number: tension needs adhesion, and atoms are only pressed",
        );
    }
    for (i, value) in gaps.iter().enumerate() {
        c.unless(
            value.is_finite() && *value >= 0.0,
            &format!("load.mean_gap_um[{i}]"),
            value,
            "zero or a positive number",
        );
    }
    c.unless(
        !atoms || gaps.is_empty(),
        "load.mean_gap_um",
        "given with atoms",
        "load.p_star: atoms are under load control",
    );
    branches_of_atoms(c, scene);
    maps(c, scene);
    c.unless(
        !scene.load.unload || attracts || atoms,
        "load.unload",
        "true",
        "an [adhesion] or [atoms]: without both, unloading repeats the loading branch",
    );
    c.unless(!scene.load.pull_off || attracts, "load.pull_off", "true", "an adhesive interface, [adhesion]");
    let controls = !gaps.is_empty() || scene.load.pull_off;
    let method = &scene.continuum.method;
    c.unless(
        !controls || method::find(method).is_none_or(|m| m.card().id == "fast"),
        "continuum.method",
        format!("{method:?}"),
        "\"fast\" or \"auto\": no other method controls the mean gap, which load.mean_gap_um and load.pull_off need",
    );
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
    c.unless((1..=100).contains(&per_decade), "load.p_star_range.per_decade", per_decade, "1 to 100 loads");
}

/// Atoms are pressed to the highest load and unloaded once, and each load is read on its branch.
fn branches_of_atoms(c: &mut Complaints, scene: &Scene) {
    let (p, atoms) = (&scene.load.p_star, scene.atoms.is_some());
    let attracts = scene.adhesion.as_ref().is_some_and(|a| a.work_of_adhesion_mj_m2 > 0.0);
    let falls = p.windows(2).position(|w| w[1] < w[0]).map(|i| i + 1);
    if let Some(i) = falls.filter(|_| atoms && attracts && !scene.load.is_closed()) {
        c.unless(
            false,
            &format!("load.p_star[{i}]"),
            p[i],
            "no less than the load before, or load.unload: with adhesion atoms unload on another branch",
        );
    }
    let path = scene.load.p_star_path();
    let there = &path[..path.len().div_ceil(2)];
    c.unless(
        !(atoms && scene.load.unload) || there.is_sorted_by(|a, b| a < b),
        "load.unload",
        "true with loads that do not rise",
        "rising loads: atoms go back from the highest",
    );
}

/// Loads whose maps are stored.
fn maps(c: &mut Complaints, scene: &Scene) {
    for (i, value) in scene.load.maps_at.iter().flatten().enumerate() {
        let known = !scene.load.indices_of(*value).is_empty();
        let path = scene.load.p_star_path();
        let loads: Vec<String> = path.iter().take(MOST_NAMED).map(|p| p.to_string()).collect();
        let more = if path.len() > MOST_NAMED { ", …" } else { "" };
        let accepted = format!("one of the loads p*: {}{more}", loads.join(", "));
        c.unless(known, &format!("load.maps_at[{i}]"), value, &accepted);
    }
    c.unless(
        scene.load.maps_at.is_none() || scene.atoms.is_none(),
        "load.maps_at",
        "given with atoms",
        "nothing: atoms are compared with the maps of every load",
    );
}

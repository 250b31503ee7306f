//! Checks of `[load]`.

use super::complaints::Complaints;
use crate::scene::{Dimensional, LoadRange, LoadScene, Number, Quantity, Scene};

/// Loads that a message names.
const MOST_NAMED: usize = 24;

pub(super) fn check(c: &mut Complaints, scene: &Scene) {
    let load = &scene.load;
    let attracts = scene.adhesion.as_ref().is_some_and(|a| a.work_of_adhesion.value() > 0.0);
    let atoms = scene.atoms.is_some();
    kinds(c, load);
    load.p_star_range.iter().for_each(|r| load_range(c, r));
    let pressures = [
        ("p_star", load.p_star.iter().map(|p| Number::plain(*p)).map(Given::of).collect::<Vec<_>>()),
        ("pressure", load.pressure.iter().copied().map(Given::of).collect()),
        ("force", load.force.iter().copied().map(Given::of).collect()),
    ];
    match (atoms, attracts) {
        (true, _) => each(c, &pressures, "a positive number: atoms are only pressed", |v| v > 0.0),
        (false, false) => {
            each(c, &pressures, "zero (first contact) or a positive number: tension needs adhesion", |v| v >= 0.0)
        }
        (false, true) => each(c, &pressures, "a number", |_| true),
    }
    first_contact(c, scene, &pressures);
    let lengths = [("mean_gap", &load.mean_gap), ("displacement", &load.displacement)];
    let lengths = lengths.map(|(key, list)| (key, list.iter().copied().map(Given::of).collect()));
    each(c, &lengths, "zero or a positive number", |v| v >= 0.0);
    let contact = load.contact.iter().map(|a| Number::plain(*a)).map(Given::of).collect();
    each(c, &[("contact", contact)], "a fraction of the cell between 0 and 1", |v| v > 0.0 && v < 1.0);
    for (key, list) in load.lists().iter().filter(|(key, _)| *key != "load.p_star") {
        let accepted = "load.p_star: atoms are under load control in p*";
        c.unless(!atoms || list.is_empty(), key, "given with atoms", accepted);
    }
    c.unless(
        load.contact.is_empty() || !attracts,
        "load.contact",
        "given with adhesion",
        "pressures or mean gaps: with adhesion several states have the same contact",
    );
    branches_of_atoms(c, scene);
    maps(c, scene);
    c.unless(
        !scene.load.unload || attracts || atoms || scene.continuum.hardness.is_some(),
        "load.unload",
        "true",
        "an adhesion.work_of_adhesion, [atoms] or continuum.hardness: without them, unloading repeats the loading branch",
    );
    c.unless(
        !scene.load.pull_off || attracts,
        "load.pull_off",
        "true",
        "an adhesive interface, adhesion.work_of_adhesion",
    );
    let controls = !load.mean_gap.is_empty() || !load.displacement.is_empty() || load.pull_off;
    let method = &scene.continuum.method;
    c.unless(
        !controls || asperity_methods::find(method).is_none_or(|m| m.card().capabilities.mean_gap),
        "continuum.method",
        format!("{method:?}"),
        "\"fast\" or \"auto\": no other method controls the mean gap, which load.mean_gap and load.pull_off need",
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
    c.unless(!value.is_empty(), "load.p_star", "[]", &format!("at least one load, in one of {all}"));
    if let [first, second, ..] = value[..] {
        c.unless(false, second, format!("given together with {first}"), "one kind of load");
    }
}

/// First contact without adhesion is given by the surface alone, and only `fast` takes it as a load.
fn first_contact(c: &mut Complaints, scene: &Scene, pressures: &[(&str, Vec<Given>)]) {
    let attracts = scene.adhesion.as_ref().is_some_and(|a| a.work_of_adhesion.value() > 0.0);
    let zero = pressures.iter().find_map(|(key, list)| Some((key, list.iter().position(|v| v.value == 0.0)?)));
    let Some((key, i)) = zero.filter(|_| !attracts && scene.atoms.is_none()) else { return };
    let own = &scene.continuum.method;
    let others = asperity_methods::find(own).is_some_and(|m| !m.card().capabilities.first_contact);
    c.unless(
        !others && scene.continuum.compare_with.is_empty(),
        &format!("load.{key}[{i}]"),
        0,
        "a positive number: only the method \"fast\" solves first contact",
    );
}

/// A load as it is given, for messages.
struct Given {
    value: f64,
    text: String,
}

impl Given {
    fn of<D: Dimensional>(load: Quantity<D>) -> Given {
        Given { value: load.value(), text: load.to_string() }
    }
}

/// Each value of lists of loads is finite and `good`.
fn each(c: &mut Complaints, lists: &[(&str, Vec<Given>)], accepted: &str, good: impl Fn(f64) -> bool) {
    for (key, list) in lists {
        for (i, Given { value, text }) in list.iter().enumerate() {
            c.unless(value.is_finite() && good(*value), &format!("load.{key}[{i}]"), text, accepted);
        }
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
    let (p, atoms) = (&scene.load.p_star, scene.atoms.is_some());
    let attracts = scene.adhesion.as_ref().is_some_and(|a| a.work_of_adhesion.value() > 0.0);
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
        "rising loads: atoms unload from the highest",
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
        "none: atoms are compared with the maps of every load",
    );
}

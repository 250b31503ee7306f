//! Checks of a scene. Every complaint is collected, so that all are reported at once.

mod atoms;
mod bodies;
mod challenge;
mod complaints;
mod continuum;
mod loads;
mod nvt;
mod surface;

pub(super) use complaints::word;
pub(super) use surface::cut_offs;

use super::Scene;
use asperity_contact::problem::AdhesionLaw;
use asperity_grid::error::Complaint;
use complaints::Complaints;
use std::path::Path;

/// Longest description, bytes. results.nc holds 60000 bytes of it, and it stands above the report.
const LONGEST_DESCRIPTION: usize = 20_000;

pub(super) fn complaints(scene: &Scene) -> Vec<Complaint> {
    let mut c = Complaints(Vec::new());
    let name_ok = !scene.name.is_empty()
        && scene.name.chars().all(|ch| ch.is_alphanumeric() || "-_.".contains(ch))
        && !scene.name.starts_with('.');
    c.unless(
        name_ok,
        "name",
        format!("{:?}", scene.name),
        "letters, digits, '-', '_' and '.' (it names the run folder)",
    );
    let length = scene.description.len();
    c.unless(
        length <= LONGEST_DESCRIPTION,
        "description",
        format!("{length} bytes"),
        &format!("at most {LONGEST_DESCRIPTION} bytes"),
    );
    c.positive_quantity("laboratory.length", scene.laboratory.length());
    // That of bodies is positive unless one of them is refused.
    scene.laboratory.modulus.iter().for_each(|modulus| c.positive_quantity("laboratory.modulus", *modulus));
    bodies::check(&mut c, scene);
    surface::check(&mut c, scene);
    loads::check(&mut c, scene);
    challenge::check(&mut c, scene);
    adhesion(&mut c, scene);
    continuum::check(&mut c, scene);
    if let Some(budget) = scene.accuracy.as_ref().and_then(|a| a.budget) {
        c.positive_quantity("accuracy.budget", budget);
    }
    atoms::check(&mut c, scene);
    c.0
}

fn adhesion(c: &mut Complaints, scene: &Scene) {
    let Some(a) = &scene.adhesion else { return };
    for (i, range) in a.other_ranges.iter().enumerate() {
        let key = format!("adhesion.other_ranges[{i}]");
        c.positive_quantity(&key, *range);
        c.unless(!a.other_ranges[..i].contains(range) && *range != a.range, &key, range, "another range");
    }
    c.unless(
        a.law == AdhesionLaw::Exponential || scene.atoms.is_none(),
        "adhesion.law",
        format!("{:?} with atoms", word(&a.law)),
        "\"exponential\": the atoms have no other law",
    );
}

/// Complaints about files that a scene names and that do not exist. An error on opening them would not know the key.
pub(super) fn missing_files(scene: &Scene, file: &Path) -> Vec<Complaint> {
    let named = [
        ("surface.heights", scene.surface.heights.as_ref(), "a file of heights or of their Fourier coefficients"),
        ("surface.other.heights", scene.surface.other.as_ref().map(|o| &o.heights), "a height map"),
        ("continuum.initial_gap", scene.continuum.initial_gap.as_ref(), "a gap (.npy)"),
        ("continuum.hardness_map", scene.continuum.hardness_map.as_ref(), "a map of the hardness"),
        ("atoms.potential", scene.atoms.as_ref().and_then(|a| a.potential.as_ref()), "an eam/alloy (setfl) file"),
    ];
    let complaint = |key: &str, path: &Path, accepted: &str| {
        let found = super::model::relative_to(file, path);
        if found == path && !found.is_file() {
            let reason = match std::fs::metadata(&found) {
                Ok(m) if m.is_dir() => "a folder",
                Ok(_) => "no regular file",
                Err(_) => "no such file",
            };
            return Some(Complaint::new(key, format!("{} ({reason})", path.display()), accepted));
        }
        let reason = match std::fs::metadata(&found) {
            Ok(m) if m.is_dir() => "which is a folder",
            Ok(_) => return None,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => "where there is no file",
            // The error on opening it is more precise.
            Err(_) => return None,
        };
        let found = format!("{:?}, that is {}, {reason}", path.display(), found.display());
        Some(Complaint::new(key, found, format!("{accepted}, its path relative to the scene file")))
    };
    named.into_iter().filter_map(|(key, path, accepted)| complaint(key, path?, accepted)).collect()
}

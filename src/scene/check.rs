//! What a scene may say. Every complaint is collected, so that a user mends a scene once.

use super::{ALL_METHODS, AdhesionLaw, LoadRange, MOST_FOUNDATION_CELLS, Scene, Start, SurfaceScene, WallKind};
use crate::error::{Complaint, Error};
use crate::interface::{CubicHalfSpace, RangeChoice};
use crate::method::{self, Kind};
use crate::record::import::Fourier;
use crate::units::MAX_SECONDS;
use std::path::Path;

struct Complaints(Vec<Complaint>);

impl Complaints {
    fn unless(&mut self, good: bool, key: &str, found: impl ToString, accepted: &str) {
        if !good {
            self.0.push(Complaint::new(key, found, accepted));
        }
    }

    /// Positive and finite.
    fn positive(&mut self, key: &str, value: f64) {
        self.unless(value.is_finite() && value > 0.0, key, value, "a positive number");
    }
}

/// Roll-off and cut-off wavelengths over the cell's extent, whichever way they are given.
pub(super) fn cut_offs(surface: &SurfaceScene, length_um: f64) -> (f64, f64) {
    let pick = |um: Option<f64>, mode: Option<f64>, default: f64| match (um, mode) {
        (Some(um), _) => um / length_um,
        (None, Some(mode)) => 1.0 / mode,
        (None, None) => default,
    };
    (
        pick(surface.roll_off_um, surface.roll_off_mode, crate::surface::Spectrum::CHALLENGE.lambda_r),
        pick(surface.cut_off_um, surface.cut_off_mode, crate::surface::Spectrum::CHALLENGE.lambda_s),
    )
}

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
    c.positive("laboratory.length_um", scene.laboratory.length_um);
    c.positive("laboratory.contact_modulus_mpa", scene.laboratory.contact_modulus_mpa);
    surface(&mut c, scene);
    loads(&mut c, scene);
    challenge(&mut c, scene);
    accuracy(&mut c, scene);
    if let Some(a) = &scene.adhesion {
        let gamma = a.work_of_adhesion_mj_m2;
        c.unless(
            gamma.is_finite() && gamma >= 0.0,
            "adhesion.work_of_adhesion_mj_m2",
            gamma,
            "a number, zero or above",
        );
        c.positive("adhesion.range_nm", a.range_nm);
        for (i, range) in a.other_ranges_nm.iter().enumerate() {
            let key = format!("adhesion.other_ranges_nm[{i}]");
            c.positive(&key, *range);
            c.unless(!a.other_ranges_nm[..i].contains(range) && *range != a.range_nm, &key, range, "another range");
        }
        c.unless(
            a.law == AdhesionLaw::Exponential || scene.atoms.is_none(),
            "adhesion.law",
            format!("{:?} with atoms", word(&a.law)),
            "\"exponential\": the atoms have no other law",
        );
    }
    continuum(&mut c, scene);
    if scene.atoms.is_some() {
        atoms(&mut c, scene);
    }
    c.0
}

fn accuracy(c: &mut Complaints, scene: &Scene) {
    let Some(a) = &scene.accuracy else { return };
    let given = [a.error.is_some(), a.budget_s.is_some()];
    let found = if given == [true; 2] { "error and budget_s" } else { "neither error nor budget_s" };
    c.unless(given[0] != given[1], "accuracy", found, "one of error (0.05) and budget_s (30)");
    a.error.iter().for_each(|e| c.positive("accuracy.error", *e));
    a.budget_s.iter().for_each(|s| c.positive("accuracy.budget_s", *s));
    c.unless(
        scene.challenge.is_none(),
        "challenge",
        "with [accuracy]",
        "none: its statements need all that is counted",
    );
}

/// Files that a scene names and that are not there: said with the key, which an error on opening them does not know.
pub(super) fn missing_files(scene: &Scene, file: &Path) -> Vec<Complaint> {
    let named = [
        ("surface.heights", scene.surface.heights.as_ref(), "a file of heights or of their Fourier coefficients"),
        ("continuum.initial_gap", scene.continuum.initial_gap.as_ref(), "a gap (.npy)"),
        ("atoms.potential", scene.atoms.as_ref().and_then(|a| a.potential.as_ref()), "an eam/alloy (setfl) file"),
    ];
    let tables = scene.accuracy.iter().flat_map(|a| &a.tables);
    let named = named.into_iter().chain(tables.map(|t| ("accuracy.tables", Some(t), "a table of asperity tradeoff")));
    let complaint = |key: &str, path: &Path, accepted: &str| {
        let found = super::case::relative_to(file, path);
        let why = match std::fs::metadata(&found) {
            Ok(m) if m.is_dir() => "which is a folder",
            Ok(_) => return None,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => "where there is no file",
            // Opening it says more.
            Err(_) => return None,
        };
        let found = format!("{:?}, that is {}, {why}", path.display(), found.display());
        Some(Complaint::new(key, found, format!("{accepted}, its path relative to the scene file")))
    };
    named.filter_map(|(key, path, accepted)| complaint(key, path?, accepted)).collect()
}

fn surface(c: &mut Complaints, scene: &Scene) {
    let s = &scene.surface;
    if s.heights.is_some() {
        c.unless(
            s.touching.is_some(),
            "surface.touching",
            "not given",
            "\"low-points\" or \"high-points\": a height file does not say which of its points touch first",
        );
        c.positive("surface.heights_unit_um", s.heights_unit_um);
        let transform = s.fourier == Some(Fourier::Fftw);
        c.unless(
            s.fourier_points.is_some() == transform,
            "surface.fourier_points",
            s.fourier_points.map_or("not given".into(), |n| n.to_string()),
            "points per side of the transform's grid with surface.fourier = \"fftw\", and only with it",
        );
        c.unless(
            s.fourier_points.is_none_or(|n| (2..=65_536).contains(&n)),
            "surface.fourier_points",
            s.fourier_points.unwrap_or(0),
            "2 to 65536 points per side",
        );
        let waves = s.fourier.is_some_and(Fourier::are_waves);
        if let Some(um) = s.low_pass_um {
            c.positive("surface.low_pass_um", um);
            c.unless(waves, "surface.low_pass_um", um, "only together with surface.fourier");
        }
        c.unless(!waves || (2..=65_536).contains(&s.grid), "surface.grid", s.grid, "2 to 65536 points per side");
        return;
    }
    for (key, given) in [
        ("surface.dataset", s.dataset.is_some()),
        ("surface.fourier", s.fourier.is_some()),
        ("surface.fourier_points", s.fourier_points.is_some()),
        ("surface.low_pass_um", s.low_pass_um.is_some()),
    ] {
        c.unless(!given, key, "given", "only together with surface.heights, which names a file");
    }
    c.unless((2..=65_536).contains(&s.grid), "surface.grid", s.grid, "2 to 65536 points per side");
    c.unless(s.hurst > 0.0 && s.hurst <= 1.0, "surface.hurst", s.hurst, "a Hurst exponent above 0 and up to 1");
    c.positive("surface.rms_gradient", s.rms_gradient);
    let both = |a: Option<f64>, b: Option<f64>| a.is_some() && b.is_some();
    for (wave, mode, um, number) in [
        ("surface.roll_off_um", "surface.roll_off_mode", s.roll_off_um, s.roll_off_mode),
        ("surface.cut_off_um", "surface.cut_off_mode", s.cut_off_um, s.cut_off_mode),
    ] {
        c.unless(!both(um, number), wave, "given together with its mode number", "one of the two");
        if let Some(um) = um {
            c.positive(wave, um);
        }
        if let Some(n) = number {
            c.positive(mode, n);
        }
    }
    let length_um = scene.laboratory.length_um;
    let (roll_off, cut_off) = cut_offs(s, length_um);
    // Told by the key and in the number that the scene has.
    let said =
        |[um_key, mode_key]: [&'static str; 2], um: Option<f64>, mode: Option<f64>, resolved: f64| match (um, mode) {
            (None, Some(mode)) => (mode_key, mode),
            (um, _) => (um_key, um.unwrap_or(resolved * length_um)),
        };
    let (roll_off_key, roll_off_said) =
        said(["surface.roll_off_um", "surface.roll_off_mode"], s.roll_off_um, s.roll_off_mode, roll_off);
    let (cut_off_key, cut_off_said) =
        said(["surface.cut_off_um", "surface.cut_off_mode"], s.cut_off_um, s.cut_off_mode, cut_off);
    c.unless(
        cut_off <= roll_off || cut_off.is_nan() || roll_off.is_nan(),
        cut_off_key,
        format!("{cut_off_said} (with {roll_off_key} = {roll_off_said})"),
        "a short cut-off wavelength no longer than the roll-off wavelength",
    );
    c.unless(
        roll_off <= 1.0,
        roll_off_key,
        roll_off_said,
        "a wavelength of at most the cell's length, a mode of at least 1",
    );
    // The random numbers of a mode are keyed by 32-bit mode numbers; long before that, 1e4 modes a side take half a minute.
    c.unless(
        cut_off >= 1e-4,
        cut_off_key,
        cut_off_said,
        "a wavelength of at least 1e-4 of the cell, a mode of at most 1e4",
    );
}

fn loads(c: &mut Complaints, scene: &Scene) {
    let p = &scene.load.p_star;
    let gaps = &scene.load.mean_gap_um;
    let range = &scene.load.p_star_range;
    let given = [!p.is_empty(), range.is_some(), !gaps.is_empty()].into_iter().filter(|g| *g).count();
    c.unless(given > 0, "load.p_star", "[]", "at least one load, or load.p_star_range, or load.mean_gap_um");
    c.unless(
        given < 2,
        if gaps.is_empty() { "load.p_star_range" } else { "load.mean_gap_um" },
        "given together with other loads",
        "one of load.p_star, load.p_star_range and load.mean_gap_um",
    );
    if let Some(r) = range {
        c.positive("load.p_star_range.from", r.from);
        c.positive("load.p_star_range.to", r.to);
        c.unless(r.from != r.to, "load.p_star_range.to", r.to, "another load than .from");
        let decades = (r.to.log10() - r.from.log10()).abs();
        // Ends that are no positive numbers are told already.
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
    let attracts = scene.adhesion.as_ref().is_some_and(|a| a.work_of_adhesion_mj_m2 > 0.0);
    let atoms = scene.atoms.is_some();
    for (i, value) in p.iter().enumerate() {
        c.unless(
            value.is_finite() && (*value > 0.0 || attracts && !atoms),
            &format!("load.p_star[{i}]"),
            value,
            "a positive number: nothing but adhesion holds a pull, and atoms are only pressed",
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
    c.unless(!atoms || gaps.is_empty(), "load.mean_gap_um", "given with atoms", "load.p_star: atoms are pressed");
    // The atoms go to the highest load and back, once, and each load is read on the way.
    let falls = p.windows(2).position(|w| w[1] < w[0]).map(|i| i + 1);
    if let Some(i) = falls.filter(|_| atoms && attracts && !scene.load.is_closed()) {
        c.unless(
            false,
            &format!("load.p_star[{i}]"),
            p[i],
            "no less than the load before, or load.unload: with adhesion the way back of atoms is another",
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
    for (i, value) in scene.load.maps_at.iter().flatten().enumerate() {
        let known = !scene.load.indices_of(*value).is_empty();
        let path = scene.load.p_star_path();
        let loads: Vec<String> = path.iter().take(MOST_NAMED).map(|p| p.to_string()).collect();
        let more = if path.len() > MOST_NAMED { ", …" } else { "" };
        let accepted = format!("one of the loads p*: {}{more}", loads.join(", "));
        c.unless(known, &format!("load.maps_at[{i}]"), value, &accepted);
    }
    c.unless(
        scene.load.maps_at.is_none() || !atoms,
        "load.maps_at",
        "given with atoms",
        "nothing: atoms are compared with the maps of every load",
    );
    c.unless(
        !scene.load.unload || attracts || atoms,
        "load.unload",
        "true",
        "an [adhesion], without which the way back is the way there, or [atoms], which may have yielded",
    );
    c.unless(
        !scene.load.pull_off || attracts,
        "load.pull_off",
        "true",
        "an [adhesion] that holds the surfaces together",
    );
    let controls = !gaps.is_empty() || scene.load.pull_off;
    let method = &scene.continuum.method;
    c.unless(
        !controls || method::find(method).is_none_or(|m| m.card().id == "fast"),
        "continuum.method",
        format!("{method:?}"),
        "\"fast\" or \"auto\": no other method controls the mean gap, which load.mean_gap_um and load.pull_off need",
    );
}

fn continuum(c: &mut Complaints, scene: &Scene) {
    let m = &scene.continuum;
    let ids = method::ids().join(", ");
    c.unless(method::find(&m.method).is_some(), "continuum.method", format!("{:?}", m.method), &ids);
    for (i, id) in m.compare_with.iter().enumerate() {
        let known = id == ALL_METHODS || method::find(id).is_some();
        c.unless(known, &format!("continuum.compare_with[{i}]"), format!("{id:?}"), &format!("{ALL_METHODS}, {ids}"));
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
        m.energy_tolerance.is_none() || method::find(&m.method).is_none_or(|m| m.card().id == "fast"),
        "continuum.energy_tolerance",
        m.energy_tolerance.unwrap_or(0.0),
        "none with this method: `fast` estimates its energy above the minimum",
    );
    c.unless(m.max_iterations > 0, "continuum.max_iterations", m.max_iterations, "at least 1");
    let extrapolates = scene.adhesion.as_ref().is_some_and(|a| a.range == RangeChoice::Extrapolate);
    c.unless(
        m.initial_gap.is_none() || !extrapolates,
        "adhesion.range",
        "\"extrapolate\" with continuum.initial_gap",
        "another range: the coarser grids of an extrapolation cannot start there",
    );
    if !m.periodic {
        for (hinders, what, accepted) in [
            (scene.atoms.is_some(), "atoms", "true: atoms repeat"),
            (
                m.layer.is_some() || m.crystal.is_some(),
                "continuum.layer or .crystal",
                "true: only the half-space can do without",
            ),
            (method::find(&m.method).is_some_and(|m| m.card().id != "fast"), "this method", "true, or method \"fast\""),
            (
                scene.load.pull_off || !scene.load.mean_gap_um.is_empty(),
                "a mean gap or a pull-off",
                "true: without images there is only load control",
            ),
            (extrapolates, "adhesion.range = \"extrapolate\"", "true, or another range"),
        ] {
            c.unless(!hinders, "continuum.periodic", format!("false with {what}"), accepted);
        }
    }
    if let Some(layer) = &m.layer {
        c.positive("continuum.layer.thickness_um", layer.thickness_um);
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
        // Whether such a crystal is stable, and its stiffness a short series, is for the kernel to say.
        if let Err(Error::Input { list, .. }) = CubicHalfSpace::new(crystal.c11_gpa, crystal.c12_gpa, crystal.c44_gpa) {
            for complaint in list {
                let key = match complaint.key.as_str() {
                    "C11" => "continuum.crystal.c11_gpa".into(),
                    "C44" => "continuum.crystal.c44_gpa".into(),
                    other => format!("continuum.crystal, {other}"),
                };
                c.0.push(Complaint { key, ..complaint });
            }
        }
    }
    match (m.wall, m.penalty_length_nm) {
        (WallKind::Penalty, None) => c.unless(
            false,
            "continuum.penalty_length_nm",
            "not given",
            "the length by which the penalty wall yields under a pressure of E*",
        ),
        (WallKind::Penalty, Some(length)) => c.positive("continuum.penalty_length_nm", length),
        (WallKind::Hard, Some(length)) => {
            c.unless(false, "continuum.penalty_length_nm", length, "only together with continuum.wall = \"penalty\"")
        }
        (WallKind::Hard, None) => {}
    }
}

/// What only solvers of the fields can do, asked of a method that estimates.
fn estimates(c: &mut Complaints, scene: &Scene) {
    let m = &scene.continuum;
    if method::find(&m.method).is_none_or(|m| m.card().kind == Kind::Solver) {
        return;
    }
    let extrapolates = scene.adhesion.as_ref().is_some_and(|a| a.range == RangeChoice::Extrapolate);
    for (asked, key) in [
        (scene.atoms.is_some(), "[atoms]"),
        (scene.challenge.is_some(), "[challenge]"),
        (scene.load.unload, "load.unload"),
        (m.initial_gap.is_some(), "continuum.initial_gap"),
        (extrapolates, "adhesion.range = \"extrapolate\""),
        (scene.adhesion.as_ref().is_some_and(|a| !a.other_ranges_nm.is_empty()), "adhesion.other_ranges_nm"),
    ] {
        c.unless(
            !asked,
            "continuum.method",
            format!("{:?} with {key}", m.method),
            "a method that solves for the fields; others go under continuum.compare_with",
        );
    }
}

/// Loads that a message names.
const MOST_NAMED: usize = 24;

/// The challenge's statements are about its own problem.
fn challenge(c: &mut Complaints, scene: &Scene) {
    let Some(challenge) = &scene.challenge else { return };
    let ids = method::ids().join(", ");
    let second = &challenge.cross_check_method;
    c.unless(method::find(second).is_some(), "challenge.cross_check_method", format!("{second:?}"), &ids);
    let same = |a: &str, b: &str| method::find(a).zip(method::find(b)).is_some_and(|(a, b)| a.card().id == b.card().id);
    c.unless(
        !same(second, &scene.continuum.method),
        "challenge.cross_check_method",
        format!("{second:?}"),
        "another method than continuum.method",
    );
    let (lab, s, a, m) = (&scene.laboratory, &scene.surface, &scene.adhesion, &scene.continuum);
    let own = |given: f64, its: f64| (given / its - 1.0).abs() < 1e-9;
    c.unless(own(lab.length_um, 100.0), "laboratory.length_um", lab.length_um, "100 with [challenge]");
    let modulus = lab.contact_modulus_mpa;
    c.unless(own(modulus, 25.0), "laboratory.contact_modulus_mpa", modulus, "25 with [challenge]");
    if s.heights.is_none() {
        let (lambda_r, lambda_s) = cut_offs(s, lab.length_um);
        let its = crate::surface::Spectrum::CHALLENGE;
        for (key, given, own_value) in [
            ("surface.hurst", s.hurst, its.hurst),
            ("surface.roll_off_um", lambda_r * lab.length_um, its.lambda_r * 100.0),
            ("surface.cut_off_um", lambda_s * lab.length_um, its.lambda_s * 100.0),
            ("surface.rms_gradient", s.rms_gradient, its.rms_gradient),
        ] {
            c.unless(own(given, own_value), key, given, &format!("{own_value} with [challenge]"));
        }
    }
    let its = a.as_ref().is_some_and(|a| {
        own(a.work_of_adhesion_mj_m2, 50.0) && own(a.range_nm, 2.071) && a.law == AdhesionLaw::Exponential
    });
    c.unless(its, "adhesion", "another than the challenge's", "50 mJ/m² over 2.071 nm, exponential, with [challenge]");
    let plain = m.layer.is_none() && m.crystal.is_none() && m.periodic && m.wall == WallKind::Hard;
    c.unless(plain, "continuum", "another body or wall", "a periodic half-space and a hard wall with [challenge]");
    let reference = scene.load.p_star_path().iter().any(|p| own(*p, super::REFERENCE_LOAD));
    c.unless(reference, "load.p_star", "without 0.01", "loads with 0.01, the reference of [challenge]");
}

/// A choice as the scene says it.
fn word(choice: &impl clap::ValueEnum) -> String {
    choice.to_possible_value().map_or(String::new(), |v| v.get_name().to_string())
}

fn atoms(c: &mut Complaints, scene: &Scene) {
    let Some(a) = &scene.atoms else { return };
    c.unless((4..=2000).contains(&a.cells), "atoms.cells", a.cells, "4 to 2000 lattice constants");
    c.unless((1..=1000).contains(&a.depth_cells), "atoms.depth_cells", a.depth_cells, "1 to 1000 lattice constants");
    c.unless(
        a.foundation_cells <= MOST_FOUNDATION_CELLS,
        "atoms.foundation_cells",
        a.foundation_cells,
        &format!("0 (a rigid base) to {MOST_FOUNDATION_CELLS} lattice constants"),
    );
    c.unless(
        a.time_limit_s.is_none_or(|s| !s.is_finite() || s <= MAX_SECONDS),
        "atoms.time_limit_s",
        a.time_limit_s.unwrap_or(0.0),
        &format!("at most {MAX_SECONDS}"),
    );
    let attracts = scene.adhesion.as_ref().is_some_and(|a| a.work_of_adhesion_mj_m2 > 0.0);
    let from_touch = attracts || a.start_or_default(attracts) == Start::Touch;
    c.unless(
        !(a.foundation_cells > 0 && from_touch),
        "atoms.foundation_cells",
        a.foundation_cells,
        "0 with a descent from first touch: a foundation goes where the continuum's solution at a load says",
    );
    c.unless(
        !a.element.is_empty() && a.element.chars().all(|ch| ch.is_ascii_alphanumeric()),
        "atoms.element",
        format!("{:?}", a.element),
        "a chemical symbol",
    );
    for (key, value) in [
        ("atoms.step_angstrom", a.step_angstrom),
        ("atoms.force_tolerance_ev_per_angstrom", Some(a.force_tolerance_ev_per_angstrom)),
        ("atoms.adhesion_range_angstrom", Some(a.adhesion_range_angstrom)),
        ("atoms.low_pass_angstrom", a.low_pass_angstrom),
        ("atoms.lattice_constant_angstrom", a.lattice_constant_angstrom),
        ("atoms.contact_modulus_gpa", a.contact_modulus_gpa),
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
        "\"touch\" with adhesion: which state is reached depends on the way there",
    );
    c.unless(
        !(a.start == Some(Start::Continuum) && a.step_angstrom.is_some()),
        "atoms.step_angstrom",
        a.step_angstrom.unwrap_or(0.0),
        "only together with atoms.start = \"touch\": from the continuum there are no steps",
    );
    for (good, key, found, accepted) in a.nvt.iter().flat_map(|h| h.checks(scene, a)) {
        c.unless(good, key, found, &accepted);
    }
    c.unless((1..=1024).contains(&a.ranks), "atoms.ranks", a.ranks, "1 to 1024 MPI ranks");
    for (key, given) in [
        ("atoms.lattice_constant_angstrom", a.lattice_constant_angstrom),
        ("atoms.contact_modulus_gpa", a.contact_modulus_gpa),
    ] {
        let alone = given.filter(|_| a.potential.is_none());
        c.unless(alone.is_none(), key, alone.unwrap_or(0.0), "only together with atoms.potential");
    }
    for (key, given) in [
        ("atoms.lattice_constant_angstrom", a.lattice_constant_angstrom.is_some()),
        ("atoms.contact_modulus_gpa", a.contact_modulus_gpa.is_some()),
    ] {
        c.unless(
            a.potential.is_none() || given,
            key,
            "not given",
            "the value for atoms.potential (`asperity potential --quantity` finds it)",
        );
    }
}

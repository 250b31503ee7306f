//! Constants of the crystal in a scene: those of its potential, measured with LAMMPS and kept in the user's cache.

use super::atomistic::find_engine;
use crate::report::number::trimmed;
use crate::scene::{Length, Scene, Stress};
use crate::{Error, Result};
use asperity_atoms::crystal::{self, FaceModuli, MeasuredCrystal, Structure};
use asperity_atoms::lammps_command::LammpsCommand;
use asperity_atoms::potential::{CALCIUM, CALCIUM_ELEMENT, CALCIUM_MODULUS_GPA, SetflHeader};
use asperity_atoms::properties::PotentialCard;
use asperity_atoms::run_script::LmpCommand;
use asperity_grid::error::Complaint;
use asperity_surface::files::hashed::file_hash;
use asperity_surface::files::user_cache::UserCache;
use serde::{Deserialize, Serialize};
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Relative difference up to which a constant of a scene is that of its potential.
const TOLERANCE: f64 = 0.01;

/// Relative difference of the lattice constant that is warned of: the block is strained by it along x and y.
const STRAINED: f64 = 1e-3;

/// Digits of measured constants that are used: those that the measurement resolves (2e-6 of the lattice constant, 1e-4 of E*), so that a
/// scene does not depend on the rounding of the machine that measures.
const LATTICE_DIGITS: usize = 6;
const MODULUS_DIGITS: usize = 4;

/// Folder of the cache.
const KIND: &str = "crystals";

/// Keys of the constants, with their units.
const LATTICE: (&str, &str) = ("atoms.lattice_constant", "Å");
const MODULUS: (&str, &str) = ("atoms.modulus", "GPa");

/// What is to be said of the constants of a scene.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Said {
    /// Constants that a scene leaves out, and where they come from.
    pub used: Vec<String>,
    pub warnings: Vec<String>,
}

/// Constants of the crystal of a potential, as scenes have them.
#[derive(Debug, Clone, Copy)]
struct Constants {
    a0: f64,
    moduli: FaceModuli,
}

/// What the cache keeps of a crystal.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CachedCrystal {
    /// BLAKE3 hash of the potential's file, and the element in it.
    potential_blake3: String,
    element: String,
    /// LAMMPS that measured it.
    lammps: String,
    crystal: MeasuredCrystal,
}

/// The crystal of an element of a potential, and what measured it.
type CrystalWithOrigin = (MeasuredCrystal, String);

/// Name of a crystal in the cache. It contains the scripts: another way of measuring finds its own values.
fn key(hash: &str, element: &str) -> String {
    let parts = [hash, element, &crystal::scripts()].join("\n");
    blake3::hash(parts.as_bytes()).to_hex().to_string()
}

/// The crystals of the potentials of scenes. Each is measured once.
pub struct Crystals<'a> {
    lammps: LammpsCommand,
    /// Whether the program that a scene names may be executed.
    permit: &'a dyn Fn(&Scene, &Path) -> Result<()>,
    cache: UserCache,
    /// By hash of the file and element: those of this process, where nothing is kept.
    known: RefCell<BTreeMap<(String, String), CrystalWithOrigin>>,
    said: RefCell<BTreeSet<String>>,
}

impl<'a> Crystals<'a> {
    /// `lammps`: how LAMMPS is started here. `permit` refuses programs that a scene may not name.
    pub fn new(lammps: &LammpsCommand, permit: &'a dyn Fn(&Scene, &Path) -> Result<()>) -> Self {
        let (known, said) = (RefCell::default(), RefCell::default());
        Crystals { lammps: lammps.clone(), permit, cache: UserCache::of_user(KIND), known, said }
    }

    /// Compares the constants of a scene with those of its potential, and fills in those that it leaves out. A scene that is wrong
    /// elsewhere is left as it is. Where nothing can be measured, as without LAMMPS, given constants are taken with a warning. What has been
    /// said of an earlier scene is not said again.
    ///
    /// # Errors
    /// `Input` for constants more than 1 % off, and for a potential whose crystal is not fcc; `Format` for a damaged potential, or one
    /// without the element; `MissingProgram` and `Lammps` if constants are left out and cannot be measured.
    pub fn settle(&self, scene: &mut Scene, file: &Path) -> Result<Said> {
        let Some(path) = scene.potential(file).filter(|_| scene.is_sound(file)) else { return Ok(Said::default()) };
        let Some(atoms) = &scene.atoms else { return Ok(Said::default()) };
        let given = (atoms.lattice_constant.map(|a| a.to("Å")), atoms.modulus.map(|e| e.to("GPa")));
        let element = atoms.element.clone();
        let crystal = match self.find(scene, file, &path, &element) {
            Err(e) if is_of_machine(&e) => return self.unmeasured(given, (&path, file), e),
            crystal => crystal?,
        };
        let (constants, how) = match crystal {
            Some((measured, by)) => (fcc(&measured, (&path, &element), file)?, by),
            None => (shipped()?, "the shipped potential".to_string()),
        };
        let mut said = Said::default();
        said.warnings.extend(compare(given, &constants, (&path, &element), file)?);
        let atoms = scene.atoms.as_mut().expect("found above");
        let a0 = *atoms.lattice_constant.get_or_insert(Length::new(constants.a0, "Å"));
        let modulus = *atoms.modulus.get_or_insert(Stress::new(constants.moduli.mean_gpa, "GPa"));
        if given.0.is_none() || given.1.is_none() {
            let place = path.display();
            said.used.push(format!(
                "{element} of {place}: a0 = {a0}, E* = {modulus} (harmonic mean over directions in (001)), {how}"
            ));
        }
        Ok(self.once(said))
    }

    /// Without what has been said before.
    fn once(&self, mut said: Said) -> Said {
        let mut previous = self.said.borrow_mut();
        [&mut said.used, &mut said.warnings]
            .into_iter()
            .for_each(|list| list.retain(|text| previous.insert(text.clone())));
        said
    }

    /// What becomes of constants that cannot be measured here.
    fn unmeasured(
        &self,
        given: (Option<f64>, Option<f64>),
        (potential, file): (&Path, &Path),
        e: Error,
    ) -> Result<Said> {
        let absent: Vec<&str> =
            [(given.0, LATTICE.0), (given.1, MODULUS.0)].iter().filter(|g| g.0.is_none()).map(|g| g.1).collect();
        if absent.is_empty() {
            let keys = format!("{} and {}", LATTICE.0, MODULUS.0);
            let text = format!("{keys} are not checked against {}: {e}", potential.display());
            return Ok(self.once(Said { warnings: vec![text], ..Said::default() }));
        }
        Err(match e {
            Error::MissingProgram { program, .. } => {
                let remedy = format!(
                    "it measures {}, which {} leaves out: install it (Debian: apt-get install lammps), name it with --lammps or as \
                     atoms.program, or give the values that `asperity potential --measure` prints where it is",
                    absent.join(" and "),
                    file.display()
                );
                Error::MissingProgram { program, how: remedy }
            }
            other => other,
        })
    }

    /// The crystal; `None` for the shipped potential, whose constants are known.
    fn find(&self, scene: &Scene, file: &Path, potential: &Path, element: &str) -> Result<Option<CrystalWithOrigin>> {
        let hash = file_hash(potential)?;
        if element == CALCIUM_ELEMENT.0 && hash == PotentialCard::calcium()?.blake3 {
            return Ok(None);
        }
        let id = (hash.clone(), element.to_string());
        if let Some(known) = self.known.borrow().get(&id) {
            return Ok(Some(known.clone()));
        }
        let kept = self.cache.read::<CachedCrystal>(&key(&hash, element));
        let cached = match kept.filter(|k| k.potential_blake3 == hash && k.element == element) {
            Some(kept) => (kept.crystal, format!("measured earlier with {}", kept.lammps)),
            None => {
                // Before a program is started: what is wrong with the file says more.
                SetflHeader::read(potential)?.element(potential, element)?;
                (self.permit)(scene, file)?;
                let engine = find_engine(&scene.lammps_command(file, &self.lammps), file)?;
                let scratch = tempfile::tempdir().map_err(Error::io("make", std::env::temp_dir()))?;
                let lammps = LmpCommand { program: engine.program().to_path_buf() };
                let potential = std::path::absolute(potential).map_err(Error::io("find", potential))?;
                let measured = crystal::measure(&lammps, scratch.path(), &potential, element, None);
                let crystal = measured.map_err(|e| match e {
                    // The folder of the scripts is gone.
                    Error::Lammps { failure, .. } => Error::Lammps { folder: potential, failure },
                    other => other,
                })?;
                keep(&self.cache, (&hash, element), engine.describe(), &crystal);
                (crystal, format!("measured with {}", engine.describe()))
            }
        };
        self.known.borrow_mut().insert(id, cached.clone());
        Ok(Some(cached))
    }
}

fn keep(cache: &UserCache, (hash, element): (&str, &str), lammps: &str, crystal: &MeasuredCrystal) {
    let cached = CachedCrystal {
        potential_blake3: hash.into(),
        element: element.into(),
        lammps: lammps.into(),
        crystal: crystal.clone(),
    };
    cache.write(&key(hash, element), &cached);
}

/// Keeps a crystal that was measured for other reasons.
///
/// # Errors
/// `Io` if the potential cannot be read.
pub fn keep_crystal(potential: &Path, element: &str, lammps: &str, crystal: &MeasuredCrystal) -> Result<()> {
    keep(&UserCache::of_user(KIND), (&file_hash(potential)?, element), lammps, crystal);
    Ok(())
}

/// Whether this machine cannot measure, as opposed to what is measured being wrong.
fn is_of_machine(e: &Error) -> bool {
    let program = |c: &Complaint| c.key == "atoms.program";
    match e {
        Error::Input { list, .. } => list.iter().all(program),
        other => other.is_of_program(),
    }
}

/// Rounded to a number of significant digits.
fn rounded(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits - 1).parse().unwrap_or(value)
}

fn shipped() -> Result<Constants> {
    let p = PotentialCard::calcium()?.properties;
    let (along_100_gpa, along_110_gpa) = (p.contact_modulus_100_gpa, p.contact_modulus_110_gpa);
    let moduli = FaceModuli { mean_gpa: CALCIUM_MODULUS_GPA, along_100_gpa, along_110_gpa };
    Ok(Constants { a0: CALCIUM.a0, moduli })
}

/// Constants of an fcc crystal.
fn fcc(measured: &MeasuredCrystal, (potential, element): (&Path, &str), file: &Path) -> Result<Constants> {
    let face = measured.face()?.filter(|_| measured.structure == Structure::Fcc).ok_or_else(|| {
        let found = format!("{} ({element}: {})", potential.display(), measured.describe());
        let accepted = "a potential whose crystal is fcc: the block of atoms is fcc with a (001) face";
        Error::input(file.display(), "atoms.potential", found, accepted)
    })?;
    let moduli = [face.mean_gpa, face.along_100_gpa, face.along_110_gpa].map(|m| rounded(m, MODULUS_DIGITS));
    let [mean_gpa, along_100_gpa, along_110_gpa] = moduli;
    let moduli = FaceModuli { mean_gpa, along_100_gpa, along_110_gpa };
    Ok(Constants { a0: rounded(measured.a0_angstrom, LATTICE_DIGITS), moduli })
}

/// Refuses constants that are not those of the potential. Returns a warning of a strained crystal.
fn compare(
    value: (Option<f64>, Option<f64>),
    constants: &Constants,
    (potential, element): (&Path, &str),
    file: &Path,
) -> Result<Option<String>> {
    let crystal_name = format!("{element} of {}", potential.display());
    let separation = |value: f64, measured: f64| (value / measured - 1.0).abs();
    let complaint = |(key, unit): (&str, &str), value: f64, measured: f64, hint: String| {
        let accepted = format!(
            "{measured} {unit}, which LAMMPS measures for {crystal_name} ({} apart; up to 1 % is accepted): give that value or leave the key out{hint}",
            difference(value, measured)
        );
        Complaint::new(key, format!("{value} {unit}"), accepted)
    };
    let mut list = Vec::new();
    if let Some(a0) = value.0.filter(|a0| separation(*a0, constants.a0) > TOLERANCE) {
        list.push(complaint(LATTICE, a0, constants.a0, another_unit(a0, constants.a0)));
    }
    let m = &constants.moduli;
    if let Some(modulus) = value.1.filter(|modulus| separation(*modulus, m.mean_gpa) > TOLERANCE) {
        let directions = [("[100]", m.along_100_gpa), ("[110]", m.along_110_gpa)];
        let hint = match directions.iter().find(|d| separation(modulus, d.1) <= TOLERANCE) {
            Some((along, _)) => {
                format!("; the given value is that of waves along {along}, not the mean over directions")
            }
            None => another_unit(modulus, m.mean_gpa),
        };
        list.push(complaint(MODULUS, modulus, m.mean_gpa, hint));
    }
    if !list.is_empty() {
        return Err(Error::Input { place: file.display().to_string(), list });
    }
    Ok(value.0.filter(|a0| separation(*a0, constants.a0) > STRAINED).map(|a0| {
        format!(
            "{} = {a0} Å is {} from the {} Å that LAMMPS measures for {crystal_name}: the block is under that strain along x and y",
            LATTICE.0,
            difference(a0, constants.a0),
            constants.a0
        )
    }))
}

/// How far a value is from the measured one, in per cent, or as a factor.
fn difference(value: f64, measured: f64) -> String {
    let ratio = value / measured;
    if (0.5..2.0).contains(&ratio) {
        return format!("{} %", trimmed(100.0 * (ratio - 1.0).abs(), 3));
    }
    format!("a factor of {}", trimmed(ratio.max(1.0 / ratio), 3))
}

/// A power of ten between the values suggests another unit.
fn another_unit(value: f64, measured: f64) -> String {
    let power = (value / measured).log10();
    let is_power = power.round() != 0.0 && (power - power.round()).abs() <= TOLERANCE;
    String::from(if is_power { "; check the unit" } else { "" })
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALUMINIUM: Constants =
        Constants { a0: 4.08165, moduli: FaceModuli { mean_gpa: 91.56, along_100_gpa: 89.0, along_110_gpa: 94.0 } };

    fn compared(a0: Option<f64>, modulus: Option<f64>) -> Result<Option<String>> {
        compare((a0, modulus), &ALUMINIUM, (Path::new("Al.alloy"), "Al"), Path::new("s.toml"))
    }

    #[test]
    fn constants_up_to_one_per_cent_apart_are_accepted() {
        for given in [(None, None), (Some(4.08165), Some(91.56)), (Some(4.0825), Some(92.4)), (None, Some(90.7))] {
            assert_eq!(compared(given.0, given.1).expect("within"), None, "{given:?}");
        }
        let strained = compared(Some(4.05), None).expect("within").expect("a warning");
        assert!(strained.contains("4.05 Å is 0.775 % from the 4.08165 Å"), "{strained}");
    }

    #[test]
    fn refusals_have_both_numbers_and_what_may_be_wrong() {
        for (a0, modulus, parts) in [
            (
                Some(4.05),
                Some(80.0),
                &["s.toml: atoms.modulus = 80 GPa; accepted: 91.56 GPa", "Al of Al.alloy", "12.6 % apart"][..],
            ),
            (
                Some(3.9),
                None,
                &["atoms.lattice_constant = 3.9 Å; accepted: 4.08165 Å", "4.45 % apart", "leave the key out"],
            ),
            (Some(0.408165), None, &["a factor of 10 apart", "check the unit"]),
            (None, Some(91560.0), &["a factor of 1000 apart", "check the unit"]),
            (None, Some(89.2), &["waves along [100]"]),
            (None, Some(94.0), &["waves along [110]"]),
            (None, Some(90.6), &["1.05 % apart"]),
        ] {
            let refused = compared(a0, modulus).expect_err("refused");
            let text = refused.to_string();
            assert!(refused.exit_code() == 2 && text.lines().count() == 1, "{text}");
            assert!(parts.iter().all(|part| text.contains(part)), "{text}: {parts:?}");
        }
        let both = compared(Some(3.9), Some(45.0)).expect_err("refused").to_string();
        assert_eq!(both.lines().count(), 2, "{both}");
    }

    #[test]
    fn crystals_of_other_files_elements_and_scripts_have_other_names() {
        assert_ne!(key("a", "Al"), key("b", "Al"));
        assert_ne!(key("a", "Al"), key("a", "Cu"));
        assert_eq!(key("a", "Al"), key("a", "Al"));
    }

    /// The digits of constants that are measured: al.toml of the issue and a scene without them are the same scene.
    #[test]
    fn measured_constants_are_rounded() {
        assert_eq!((rounded(4.0816549008, LATTICE_DIGITS), rounded(91.55912, MODULUS_DIGITS)), (4.08165, 91.56));
        assert_eq!(rounded(5.5883981287, LATTICE_DIGITS), 5.5884);
    }
}

//! Findings of the comparison of atoms and continuum, as sentences.

use super::given_loads::given_loads;
use super::matched::Matched;
use crate::record::given_loads::GivenLoads;
use crate::record::results::{CriterionMatch, LoadComparison, Overlap};
use crate::scene::{AtomsCase, Case};
use asperity_atoms::block::{BaseKind, Block};
use asperity_atoms::results::{AtomState, AtomsResults, PlasticityResults};
use asperity_contact::interface::Kernel;
use asperity_contact::state::State;
use asperity_grid::units::GPA_PER_EV_A3;

/// Total pressure, GPa: the load, and the mean adhesive attraction of the hard-wall solution. For an exponential law
/// the attraction is the interaction energy over the range.
pub(super) fn effective_pressure_gpa(atoms: &AtomsCase, hard: &State) -> f64 {
    let energy = hard.interaction_energy.unwrap_or(0.0);
    let attraction = atoms.adhesion.map_or(0.0, |a| -energy / (a.rho * atoms.scales.length_m));
    (hard.pressure + attraction) / 1e9
}

fn below_surface(p: &PlasticityResults, loads: GivenLoads) -> String {
    match p.first_yield {
        None => format!(
            "Below the surface layers the crystal has not slipped: no load step has more than {} defect atoms.",
            p.noise_atoms
        ),
        Some(load) => {
            let previous = p.last_elastic.filter(|b| *b > 0.0);
            let after =
                previous.map_or(String::new(), |b| format!(" (not yet at the step before, {})", loads.value(b)));
            format!(
                "Below the surface layers the crystal first yields at {}{after}: at higher loads it is not elastic.",
                loads.label(load)
            )
        }
    }
}

/// Largest relative deviation of the compliant-wall area for which the contact criterion explains the difference.
const EXPLAINED: f64 = 0.15;

fn explanation(hard: f64, matched: f64) -> &'static str {
    if matched.abs() > EXPLAINED {
        "The same criterion leaves a difference: here the mechanics differ, too"
    } else if matched.abs() < 0.5 * hard.abs() {
        "Most of the difference is the criterion, not the mechanics"
    } else {
        "The difference is small under either criterion"
    }
}

/// Fraction of contact atoms from below the surface layer above which plastic flow is reported.
const FLOWED: f64 = 0.02;

/// Compares the compliant wall with hardness (GPa) and without, each with the deviation of the atoms' contact in words.
fn of_hardness((load, at): (&LoadComparison, &str), hardness: f64, walls: [(&CriterionMatch, String); 2]) -> String {
    let [(adhesive, over), (without, over_without)] = walls;
    let kappa = |m: &CriterionMatch| format!("{:.2}", m.overlap.kappa).replace('-', "−");
    format!(
        "{at}: compliant wall with the crystal's hardness of {hardness:.2} GPa: {:.1} % ({over}), κ = {}, mean gap {:.3} Å (atoms {:.3} Å). \
         Without it: {over_without}, κ = {}, mean gap {:.3} Å.",
        100.0 * adhesive.contact_area,
        kappa(adhesive),
        load.yielding_wall_mean_gap_angstrom.unwrap_or(f64::NAN),
        load.atoms_mean_gap_angstrom,
        kappa(without),
        load.compliant_wall_mean_gap_angstrom,
    )
}

/// The mean stress over the contact of the atoms and the compression of the wall under it, as a sentence; empty without contact.
fn compression(atoms: &AtomsCase, hard: &State, contact: f64) -> String {
    if contact == 0.0 {
        return String::new();
    }
    let stress = effective_pressure_gpa(atoms, hard) / contact;
    let by = atoms.wall.minimum_angstrom() - atoms.wall.distance_at_pressure(stress / GPA_PER_EV_A3);
    match atoms.adhesion {
        None => format!(" The mean contact stress of {stress:.1} GPa compresses the wall by {by:.2} Å."),
        Some(_) => format!(" Load and attraction, {stress:.1} GPa over the contact, compress the wall by {by:.2} Å."),
    }
}

/// Explains the differences between atoms and continuum, in sentences with numbers.
pub(super) fn findings(
    case: &Case,
    atoms: &AtomsCase,
    atoms_results: &AtomsResults,
    matched: &Matched,
    loads: &[LoadComparison],
) -> Vec<String> {
    let (mut list, named) = (Vec::new(), given_loads(case));
    // The report uses the minus sign U+2212.
    let percent = |x: f64| format!("{:.1} %", 100.0 * x).replace('-', "−");
    let kappa = |o: &Overlap| format!("{:.2}", o.kappa).replace('-', "−");
    for (load, state) in loads.iter().zip(&matched.hard.states) {
        let [hard, offset, compliant, yielding @ ..] = &load.continuum[..] else { continue };
        let at = named.label(load.p_star);
        let over = |m: &CriterionMatch| (m.contact_area > 0.0).then(|| load.atoms.contact_area / m.contact_area - 1.0);
        let deviates = |m: &CriterionMatch| {
            over(m).map_or("no contact".into(), |x| format!("the atoms deviate by {}", percent(x)))
        };
        let explained = over(hard).zip(over(compliant)).map(|(hard, matched)| explanation(hard, matched));
        let pressed = compression(atoms, state, load.atoms.contact_area);
        list.push(format!(
            "{at}: {} of the surface atoms are in contact. Hard wall, zero gap: {} ({}). Compliant wall, with the contact criterion of the \
             atoms: {} ({}), κ = {}, for a misaligned map {}.{}{} Offset wall, shifted by {:.2} Å: {} ({}), κ = {}.",
            percent(load.atoms.contact_area),
            percent(hard.contact_area),
            deviates(hard),
            percent(compliant.contact_area),
            deviates(compliant),
            kappa(&compliant.overlap),
            kappa(&compliant.shifted),
            explained.map_or(String::new(), |text| format!(" {text}.")),
            pressed,
            offset.offset_angstrom,
            percent(offset.contact_area),
            deviates(offset),
            kappa(&offset.overlap),
        ));
        list.extend(yielding.iter().zip(&matched.yielding).map(|(adhesive, wall)| {
            let hardness = wall.hardness.unwrap_or(f64::NAN) / 1e9;
            of_hardness((load, &at), hardness, [(adhesive, deviates(adhesive)), (compliant, deviates(compliant))])
        }));
        if load.registration != [0, 0] {
            list.push(format!(
                "{at}: the atoms' contact map fits best when shifted by {:?} of {} nodes; correct maps fit without a shift.",
                load.registration, atoms.matched.nx
            ));
        }
    }
    list.extend(few_contact_atoms(&atoms_results.states, named));
    list.push(yield_finding(&atoms_results.states, atoms_results.plasticity.as_ref(), named));
    list.extend(slip_at_the_base(&atoms.block, atoms_results.plasticity.as_ref()));
    let below = atoms.block.thickness() - atoms.block.deformable_thickness();
    let base = match atoms.block.base {
        BaseKind::Rigid => "a rigid base".to_string(),
        BaseKind::Prescribed => format!("{below:.1} Å of elastic continuum on a rigid base"),
        BaseKind::Elastic => format!("{below:.1} Å of harmonic crystal on a rigid base"),
    };
    let slab = atoms.kernel().stiffness(std::f64::consts::TAU, 0.0) / std::f64::consts::PI;
    list.push(format!(
        "The block is {:.1} Å deep on {base}, which makes the longest wave {slab:.2} times stiffer than on a \
         half-space; the continuum compared here has a layer of the whole depth, with isotropic constants in place of the \
         crystal's cubic ones.",
        atoms.block.deformable_thickness()
    ));
    if atoms.resolved_gradient < 0.999 * case.gradient {
        list.push(format!(
            "Both use the profile without wavelengths below {:.1} Å, with a resolved rms gradient of {:.3} instead of {:.3}.",
            atoms.low_pass * atoms.block.length(),
            atoms.resolved_gradient,
            case.gradient
        ));
    }
    list
}

/// The loads whose comparison rests on few contact atoms, with the counting error of each.
pub(super) fn few_contact_atoms(states: &[AtomState], loads: GivenLoads) -> Option<String> {
    let few: Vec<String> = (states.iter().filter(|s| s.has_few_contacts()))
        .map(|s| match s.contacts {
            0 => format!("none at {}", loads.label(s.p_star)),
            n => format!("{n} at {} (counting error {:.0} %)", loads.label(s.p_star), 100.0 / (n as f64).sqrt()),
        })
        .collect();
    let least = AtomState::FEW_CONTACTS;
    (!few.is_empty()).then(|| {
        format!(
            "The comparison of atoms and continuum rests on fewer than {least} contact atoms: {}. Smaller differences at these loads \
             mean nothing; higher loads or a larger block (atoms.cells) have more contact atoms.",
            few.join(", ")
        )
    })
}

/// Slip so close to a base that the base impedes it: the layers below an elastic base are harmonic, and the two next to the base interact with atoms that are coupled to them.
const NEAR_THE_BASE: usize = 2;

fn slip_at_the_base(block: &Block, plasticity: Option<&PlasticityResults>) -> Option<String> {
    let layers = plasticity?.layers_above_base.filter(|l| *l <= NEAR_THE_BASE)?;
    let base = match block.base {
        BaseKind::Elastic => "the elastic base, below which the crystal is harmonic and passes no dislocation",
        _ => "the base, which does not slip",
    };
    Some(format!(
        "Slip reached the layer {layers} above {base}: more depth_cells are needed for the plastic flow at these loads."
    ))
}

fn yield_finding(states: &[AtomState], plasticity: Option<&PlasticityResults>, loads: GivenLoads) -> String {
    let flowed = states.iter().find(|s| s.contacts_below_surface as f64 > FLOWED * s.contacts.max(1) as f64);
    let hardest = states.iter().map(|s| s.contact_stress_gpa).fold(0.0, f64::max);
    let at_surface = match flowed {
        Some(s) => format!(
            "Atoms have changed layers at {}: {} of {} contact atoms did not start in the surface layer. At higher loads the \
             atoms' area is that of a plastic contact, which no elastic continuum follows.",
            loads.label(s.p_star),
            s.contacts_below_surface,
            s.contacts
        ),
        None => format!(
            "At most {} % of the contact atoms come from below the surface layer, at a mean contact stress of up to \
             {hardest:.1} GPa: no sign that material has flowed at the surface.",
            100.0 * FLOWED
        ),
    };
    let below = match plasticity {
        None => "Slip below the surface was not examined (atoms.plasticity).".to_string(),
        Some(p) => below_surface(p, loads),
    };
    format!("{at_surface} {below}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state(p_star: f64, contacts: usize) -> AtomState {
        AtomState {
            index: 0,
            branch: asperity_contact::load::Branch::Loading,
            p_star,
            contact_area: 0.01,
            contacts,
            contacts_below_surface: 0,
            mean_gap_angstrom: 1.0,
            contact_stress_gpa: 1.0,
            contact_map: String::new(),
            gap_map: String::new(),
            frame: None,
            indenter_shift_angstrom: 0.0,
            criteria: Vec::new(),
            sensitivity: Vec::new(),
            stress: None,
            defects: None,
        }
    }

    /// Loads with few contact atoms are named with the counting error; thirty are enough.
    #[test]
    fn few_contact_atoms_are_named_with_their_error() {
        let text = few_contact_atoms(
            &[state(0.001, 0), state(0.003, 4), state(0.01, 29), state(0.03, 30)],
            GivenLoads::P_STAR,
        )
        .expect("few");
        for part in
            ["none at p* = 0.001", "4 at p* = 0.003 (counting error 50 %)", "29 at p* = 0.01 (counting error 19 %)"]
        {
            assert!(text.contains(part), "{text}");
        }
        assert!(!text.contains("0.03 "), "{text}");
        assert_eq!(few_contact_atoms(&[state(0.03, 30), state(0.1, 500)], GivenLoads::P_STAR), None);
    }

    #[test]
    fn slip_at_the_base_is_named_with_its_layer() {
        let block = Block::new(6, 4, 5.5884, 7.0).and_then(|b| b.on_elastic_base(4, 7.0)).expect("valid");
        let with = |layers_above_base| PlasticityResults {
            atoms: 100,
            masked_layers: 2,
            threshold: 0.06,
            noise_atoms: 3,
            steps: vec![[0.01, 9.0]],
            first_yield: Some(0.01),
            last_elastic: None,
            layers_above_base,
            hardness_gpa: None,
        };
        let text = slip_at_the_base(&block, Some(&with(Some(1)))).expect("a finding");
        assert!(text.contains("layer 1 above the elastic base") && text.contains("depth_cells"), "{text}");
        assert_eq!(slip_at_the_base(&block, Some(&with(Some(NEAR_THE_BASE + 1)))), None);
        assert_eq!((slip_at_the_base(&block, Some(&with(None))), slip_at_the_base(&block, None)), (None, None));
    }
}

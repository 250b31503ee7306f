//! Audit of a scale-down: the dimensionless groups of the original problem (target) and of the block of atoms (actual).
//!
//! A group is *kept* if both agree within [`SAME`], *unreachable* if a block of atoms cannot have the target value,
//! and *changed* if it could but this block does not. Every reason states the value used, with its unit.

use std::f64::consts::{PI, SQRT_2};

use super::indenter::{gcd, max_spacing};
use super::potential::{CALCIUM, CALCIUM_MODULUS_GPA};
use super::repulsion::Repulsion;
use super::wall::LatticeWall;
use crate::results::AuditLine;
use asperity_contact::interface;
use asperity_contact::interface::{Base, Layer};
use asperity_grid::error::Result;
use asperity_grid::units::{ANGSTROM_M, GPA_PER_EV_A3, Scales};

/// Relative tolerance of equal values: below the resolution of atoms, above the rounding of quoted inputs such as
/// 3.4878e-3 eV/Å².
pub const SAME: f64 = 1e-3;
/// Minimum number of distinct positions of crystal atoms in the cell of the indenter's lattice. Measured for flats: with
/// 25 positions or more, adhesion is within 1 % of its areal law for ranges from 0.5 Å; with one position it is off
/// by up to 80 % at 0.2 Å.
pub const FEWEST_REGISTRIES: usize = 25;
/// Relative stiffening by the finite depth of the slab below which a wave is treated as on a half-space.
const HALF_SPACE: f64 = 0.02;

/// Input of the audit. Lengths are reduced (unit: the cell's extent) or in Å as the names indicate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AuditInput {
    pub target: Target,
    pub actual: Actual,
}

/// The original problem in dimensionless form.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    /// Mean pressure over E* times the rms gradient of the full spectrum.
    pub p_star: f64,
    /// Work of adhesion over E* L; 0 without adhesion.
    pub gamma: f64,
    /// Range of the adhesion over L; ignored without adhesion.
    pub rho: f64,
    /// rms gradient of the full spectrum.
    pub rms_gradient: f64,
    /// Shortest wavelength λ_s over L.
    pub lambda_s: f64,
    /// Radius R_c = [(⟨h_xx²⟩+⟨h_yy²⟩)/2]^(-1/2) of the full spectrum, over L.
    pub curvature_radius: f64,
}

/// The block of atoms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Actual {
    /// Extent of the cell and depth of the deformable slab, Å.
    pub length_angstrom: f64,
    pub depth_angstrom: f64,
    /// Thickness of the elastic foundation within the depth, Å.
    pub foundation_angstrom: f64,
    /// Lattice constant, Å.
    pub a0_angstrom: f64,
    /// Contact modulus E* of the block's surface, GPa, and Poisson's ratio for the depth's effect.
    pub modulus_gpa: f64,
    pub poisson: f64,
    /// Mean pressure over E* times `rms_gradient`, as prescribed.
    pub p_star: f64,
    /// Work of adhesion, eV/Å², and its range, Å, of the indenter; 0 without adhesion.
    pub gamma_ev_a2: f64,
    pub rho_angstrom: f64,
    /// rms gradient of the whole scaled spectrum, and after the low-pass.
    pub rms_gradient: f64,
    pub resolved_gradient: f64,
    /// Shortest wavelength after the low-pass, Å.
    pub lambda_min_angstrom: f64,
    /// R_c after the low-pass, Å.
    pub curvature_radius_angstrom: f64,
    pub repulsion: Repulsion,
    /// Indenter atoms along x; crystal cells along x.
    pub net_points: usize,
    pub crystal_cells: usize,
}

impl Actual {
    fn scales(&self) -> Scales {
        Scales { length_m: self.length_angstrom * ANGSTROM_M, modulus_pa: self.modulus_gpa * 1e9 }
    }

    /// Spacing s of the indenter's lattice, Å.
    pub fn spacing_angstrom(&self) -> f64 {
        self.length_angstrom / self.net_points as f64
    }
}

/// Audits a scale-down, one line per group.
///
/// # Errors
/// `Error::Input` if the lattice's spacing or the lattice constant is not positive.
pub fn audit(input: &AuditInput) -> Result<Vec<AuditLine>> {
    let AuditInput { target, actual } = input;
    let wall = LatticeWall::new(actual.repulsion, actual.spacing_angstrom(), actual.a0_angstrom)?;
    let mut lines = vec![load(target, actual)];
    if target.gamma > 0.0 || actual.gamma_ev_a2 > 0.0 {
        adhesion(target, actual, &wall, &mut lines)?;
    }
    lines.extend(roughness(target, actual));
    lines.push(depth(actual));
    lines.push(spacing(actual));
    lines.push(registries(actual));
    lines.extend(repulsion(actual));
    Ok(lines)
}

fn line(group: &str, symbol: &str, target: f64, actual: f64, reachable: bool, reason: String) -> AuditLine {
    let same = (actual - target).abs() <= SAME * target.abs().max(actual.abs());
    let status = match (same, reachable) {
        (true, _) => "kept",
        (false, true) => "changed",
        (false, false) => "unreachable",
    };
    AuditLine { group: group.into(), symbol: symbol.into(), target, actual, status: status.into(), reason }
}

fn load(target: &Target, actual: &Actual) -> AuditLine {
    let gpa = actual.p_star * actual.rms_gradient * actual.modulus_gpa;
    let newton_per_ev = 1e-9 / GPA_PER_EV_A3;
    let force = gpa * 1e9 * newton_per_ev * actual.length_angstrom * actual.length_angstrom;
    let reason = format!("mean pressure {gpa:.4} GPa, {force:.1} eV/Å on the indenter");
    line("load", "p* = p/(E* ḡ)", target.p_star, actual.p_star, true, reason)
}

fn adhesion(target: &Target, actual: &Actual, wall: &LatticeWall, lines: &mut Vec<AuditLine>) -> Result<()> {
    let scales = actual.scales();
    let gamma = actual.gamma_ev_a2 * asperity_grid::units::J_M2_PER_EV_A2;
    let gamma_reduced = scales.reduced_energy_per_area(gamma);
    let reason = format!("{gamma:.5} J/m² = {:.4e} eV/Å² between flats, repulsion included", actual.gamma_ev_a2);
    lines.push(line("work of adhesion", "γ/(E* L)", target.gamma, gamma_reduced, true, reason));

    let target_rho_angstrom = target.rho * actual.length_angstrom;
    let target_gamma = scales.energy_per_area_ev_a2(target.gamma);
    // Reachability is judged at the target adhesion; without adhesion every range is reachable.
    let smallest_range = if target.gamma > 0.0 { wall.smallest_range(target_gamma)? } else { 0.0 };
    let reachable = target_rho_angstrom >= smallest_range;
    let rho = actual.rho_angstrom;
    let cause = if reachable {
        format!("{target_rho_angstrom:.4} Å would be the scaled range; {rho:.4} Å is used")
    } else {
        format!(
            "the scaled range is {target_rho_angstrom:.4} Å, below the {:.2} Å at which the uncapped exponential outgrows \
             the Lennard-Jones core and below an atom's thermal vibration of 0.1 to 0.2 Å; {rho:.4} Å is used",
            (100.0 * smallest_range).ceil() / 100.0
        )
    };
    let rho_reduced = rho / actual.length_angstrom;
    lines.push(line("adhesion range", "ρ/L", target.rho, rho_reduced, reachable, cause.clone()));

    let stress = |gamma: f64, rho: f64| if rho > 0.0 { gamma / rho } else { 0.0 };
    let (target_stress, actual_stress) = (stress(target.gamma, target.rho), stress(gamma_reduced, rho_reduced));
    let reason = format!("largest adhesive stress {:.3} GPa: {cause}", actual_stress * actual.modulus_gpa);
    lines.push(line("adhesive stress", "γ/(ρ E*)", target_stress, actual_stress, reachable, reason));

    let tabor = |radius: f64, gamma: f64, rho: f64| stress(interface::tabor(radius, gamma, 1.0), rho);
    let radius_reduced = actual.curvature_radius_angstrom / actual.length_angstrom;
    let (target_tabor, actual_tabor) =
        (tabor(target.curvature_radius, target.gamma, target.rho), tabor(radius_reduced, gamma_reduced, rho_reduced));
    // The range that would keep the Tabor parameter with the blunter summits after the low-pass.
    let range_for_target = if target_tabor > 0.0 {
        tabor(radius_reduced, gamma_reduced, 1.0) / target_tabor * actual.length_angstrom
    } else {
        rho
    };
    let reason = format!(
        "μ = R_c^(1/3) (γ/E*)^(2/3)/ρ = {actual_tabor:.3} with R_c = {:.2} Å and ρ = {rho:.4} Å; μ = {target_tabor:.3} would need \
         ρ = {range_for_target:.4} Å",
        actual.curvature_radius_angstrom
    );
    lines.push(line("Tabor parameter", "μ", target_tabor, actual_tabor, range_for_target >= smallest_range, reason));
    Ok(())
}

fn roughness(target: &Target, actual: &Actual) -> [AuditLine; 4] {
    let bond = actual.a0_angstrom / SQRT_2;
    let lambda_s = target.lambda_s * actual.length_angstrom;
    let lambda = actual.lambda_min_angstrom;
    let full_reason = format!("rms gradient {:.4} over the whole spectrum, before the low-pass", actual.rms_gradient);
    // Indenter atoms on a lattice represent no wave shorter than two spacings, a crystal none shorter than two bonds.
    let reachable = lambda_s >= (2.0 * bond).max(2.0 * actual.spacing_angstrom());
    let resolved_reason = format!(
        "rms gradient {:.4} of the indenter, whose waves have {lambda:.2} Å and more; {:.4} over the whole spectrum",
        actual.resolved_gradient, actual.rms_gradient
    );
    let bonds_reason = format!(
        "λ_s = {lambda_s:.3} Å is {:.3} bond lengths a0/√2 = {bond:.3} Å; the shortest wave kept is {:.2}",
        lambda_s / bond,
        lambda / bond
    );
    let cut_reason =
        format!("waves below {lambda:.2} Å are left out, {:.2} times λ_s = {lambda_s:.3} Å", lambda / lambda_s);
    [
        line("slope", "ḡ", target.rms_gradient, actual.rms_gradient, true, full_reason),
        line(
            "resolved rms gradient",
            "ḡ(λ_min)",
            target.rms_gradient,
            actual.resolved_gradient,
            reachable,
            resolved_reason,
        ),
        line("shortest wave in bonds", "λ_s √2/a0", lambda_s / bond, lambda / bond, reachable, bonds_reason),
        line("shortest wave", "λ_min/λ_s", 1.0, lambda / lambda_s, reachable, cut_reason),
    ]
}

fn depth(actual: &Actual) -> AuditLine {
    let ratio = actual.depth_angstrom / actual.length_angstrom;
    let slab = Layer { thickness: ratio, poisson: actual.poisson, base: Base::Bonded };
    let factor = |n: usize| slab.stiffening(2.0 * PI * ratio * n as f64);
    let stiffening = factor(1);
    let affected = (1..=1000).take_while(|n| factor(*n) > 1.0 + HALF_SPACE).count();
    let founded = match actual.foundation_angstrom {
        0.0 => String::new(),
        below => format!(", {below:.1} Å of it an elastic foundation"),
    };
    let waves = match affected {
        0 => "all waves are within 2 % as stiff as on a half-space".to_string(),
        n => format!(
            "the longest wave is {stiffening:.2} times stiffer than on a half-space, and the {n} longest by more than 2 %"
        ),
    };
    let reason = format!(
        "slab {:.1} Å deep{founded}, {ratio:.4} of the cell, above a rigid plane: {waves}",
        actual.depth_angstrom
    );
    // A deeper slab is a matter of cost.
    line("depth", "stiffness of wave L over half-space", 1.0, stiffening, true, reason)
}

fn spacing(actual: &Actual) -> AuditLine {
    let s = actual.spacing_angstrom();
    let max = max_spacing(actual.a0_angstrom, actual.repulsion.minimum_angstrom());
    let within = s <= max;
    let digits = (max * 1e4).round() / 1e4;
    let reason = if within {
        format!("s = {s:.4} Å, at most {digits} Å: no crystal atom passes between indenter atoms at slope 1")
    } else {
        format!("s = {s:.4} Å is above {digits} Å: on slopes near 1 crystal atoms pass between indenter atoms")
    };
    let (target, d_c) = (if within { s } else { max }, actual.repulsion.contact_distance_angstrom);
    line("indenter spacing", "s/d_c", target / d_c, s / d_c, true, reason)
}

/// Constants of the repulsion in units of the crystal, against the challenge's on calcium.
fn repulsion(actual: &Actual) -> [AuditLine; 3] {
    let groups = |r: &Repulsion, a0: f64, modulus_gpa: f64| {
        let stiffness = r.epsilon_ev / (modulus_gpa / GPA_PER_EV_A3 * a0.powi(3));
        [stiffness, r.sigma_angstrom / a0, r.contact_distance_angstrom / r.minimum_angstrom()]
    };
    let [stiffness, range, contact] = groups(&Repulsion::CHALLENGE, CALCIUM.a0, CALCIUM_MODULUS_GPA);
    let r = &actual.repulsion;
    let [own_stiffness, own_range, own_contact] = groups(r, actual.a0_angstrom, actual.modulus_gpa);
    let epsilon = format!("ε = {:.4} eV between atoms of indenter and block", r.epsilon_ev);
    let sigma = format!("σ = {:.4} Å, a0 = {:.4} Å", r.sigma_angstrom, actual.a0_angstrom);
    let distance = format!(
        "an atom within d_c = {:.4} Å of an indenter atom is in contact; the repulsion begins at r_m = {:.4} Å",
        r.contact_distance_angstrom,
        r.minimum_angstrom()
    );
    [
        line("repulsion energy", "ε/(E* a0³)", stiffness, own_stiffness, true, epsilon),
        line("repulsion range", "σ/a0", range, own_range, true, sigma),
        line("contact distance", "d_c/r_m", contact, own_contact, true, distance),
    ]
}

/// Number of distinct positions of the atoms of an fcc (100) surface in the cell of a square lattice with `points` per
/// `cells` lattice constants; 1 for a lattice in registry with the crystal.
pub fn distinct_registries(points: usize, cells: usize) -> usize {
    let divisor = gcd(points.max(1), cells.max(1));
    let (p, q) = (points.max(1) / divisor, cells.max(1) / divisor);
    // Surface atoms sit at (i, j) a0/2 with i + j even, that is at i p/(2q) of a cell of that lattice: a residue of i p modulo 2q.
    let period = 2 * q;
    let reached = |parity: usize| -> Vec<usize> {
        let mut r: Vec<usize> = (parity..period).step_by(2).map(|i| i * p % period).collect();
        r.sort_unstable();
        r.dedup();
        r
    };
    let (even, odd) = (reached(0), reached(1));
    let squared = |v: &[usize]| v.len() * v.len();
    // Residues of even and odd sites are equal sets or disjoint.
    if even == odd { squared(&even) } else { squared(&even) + squared(&odd) }
}

fn registries(actual: &Actual) -> AuditLine {
    let registries = distinct_registries(actual.net_points, actual.crystal_cells);
    let enough = registries >= FEWEST_REGISTRIES;
    let divisor = gcd(actual.net_points.max(1), actual.crystal_cells.max(1));
    let (p, q) = (actual.net_points / divisor, actual.crystal_cells / divisor);
    let reason = if enough {
        format!(
            "{p} indenter atoms per {q} lattice constants put surface atoms at {registries} positions in the cell of their lattice: incommensurate"
        )
    } else {
        format!(
            "{p} indenter atoms per {q} lattice constants put surface atoms at only {registries} positions in the cell of their lattice: commensurate, so that \
             adhesion and repulsion depend on the registry"
        )
    };
    let target = if enough { registries } else { FEWEST_REGISTRIES };
    line("lattice mismatch", "positions in the cell of their lattice", target as f64, registries as f64, true, reason)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The challenge with its block of 175 cells, 25 deep, and the adhesion that atoms can represent.
    fn challenge() -> AuditInput {
        let a0 = 5.5884;
        AuditInput {
            target: Target {
                p_star: 0.01,
                gamma: 2e-5,
                rho: 2.071e-5,
                rms_gradient: 1.0,
                lambda_s: 1e-3,
                curvature_radius: 6.0e-4,
            },
            actual: Actual {
                length_angstrom: 175.0 * a0,
                depth_angstrom: 25.0 * a0,
                foundation_angstrom: 0.0,
                a0_angstrom: a0,
                modulus_gpa: 28.57,
                poisson: 0.3,
                p_star: 0.01,
                gamma_ev_a2: 3.48783e-3,
                rho_angstrom: 0.5,
                rms_gradient: 1.0,
                resolved_gradient: 0.564,
                lambda_min_angstrom: 10.16,
                curvature_radius_angstrom: 6.1,
                repulsion: Repulsion::CHALLENGE,
                net_points: 385,
                crystal_cells: 175,
            },
        }
    }

    fn find<'a>(lines: &'a [AuditLine], group: &str) -> &'a AuditLine {
        lines.iter().find(|l| l.group == group).unwrap_or_else(|| panic!("no line {group}"))
    }

    #[test]
    fn audit_of_the_challenge_block() {
        let lines = audit(&challenge()).unwrap();
        let statuss: Vec<(&str, &str)> = lines.iter().map(|l| (l.group.as_str(), l.status.as_str())).collect();
        assert_eq!(
            statuss,
            [
                ("load", "kept"),
                ("work of adhesion", "kept"),
                ("adhesion range", "unreachable"),
                ("adhesive stress", "unreachable"),
                ("Tabor parameter", "unreachable"),
                ("slope", "kept"),
                ("resolved rms gradient", "unreachable"),
                ("shortest wave in bonds", "unreachable"),
                ("shortest wave", "unreachable"),
                ("depth", "changed"),
                ("indenter spacing", "kept"),
                ("lattice mismatch", "kept"),
                ("repulsion energy", "kept"),
                ("repulsion range", "kept"),
                ("contact distance", "kept"),
            ]
        );
        // 0.2857 GPa on (97.797 nm)² is 1705.5 eV/Å; ρ would be 0.0203 Å; γ/(ρE*) = 0.9657; μ = 3.0007.
        assert!(find(&lines, "load").reason.contains("0.2857 GPa, 1705.5 eV/Å"), "{}", find(&lines, "load").reason);
        assert!(find(&lines, "adhesion range").reason.contains("0.0203 Å"));
        assert!((find(&lines, "adhesive stress").target - 0.9657).abs() < 1e-4);
        let tabor = find(&lines, "Tabor parameter");
        assert!((tabor.target - 3.0007).abs() < 1e-3, "{}", tabor.target);
        // (6.1 Å)^(1/3) (19.56e-3 Å)^(2/3)/0.5 Å: DMT-like.
        assert!((tabor.actual - 0.2653).abs() < 1e-3, "{}", tabor.actual);
        assert!(find(&lines, "depth").reason.contains("2.68 times"), "{}", find(&lines, "depth").reason);
        assert!(lines.iter().all(|l| l.target.is_finite() && l.actual.is_finite()), "JSON holds no infinity");
    }

    #[test]
    fn adhesion_lines_are_absent_without_adhesion_and_changed_with_adhesion_of_the_atoms_only() {
        let mut input = challenge();
        input.target.gamma = 0.0;
        input.target.rho = 0.0;
        let lines = audit(&input).unwrap();
        assert_eq!(find(&lines, "work of adhesion").status, "changed");
        assert!(lines.iter().all(|l| l.target.is_finite() && l.actual.is_finite()));
        input.actual.gamma_ev_a2 = 0.0;
        assert!(audit(&input).unwrap().iter().all(|l| !l.group.contains("adhes")));
    }

    #[test]
    fn other_blocks_get_other_statuses() {
        let mut input = challenge();
        input.target.rho = 0.5 / input.actual.length_angstrom;
        input.target.lambda_s = 10.16 / input.actual.length_angstrom;
        input.actual.resolved_gradient = 1.0;
        input.actual.p_star = 0.02;
        input.actual.rms_gradient = 0.5;
        input.actual.net_points = 350;
        input.actual.repulsion.epsilon_ev *= 1.1;
        input.actual.repulsion.sigma_angstrom *= 1.1;
        let lines = audit(&input).unwrap();
        for (group, status) in [
            ("load", "changed"),
            ("adhesion range", "kept"),
            ("adhesive stress", "kept"),
            ("slope", "changed"),
            ("resolved rms gradient", "kept"),
            ("shortest wave in bonds", "kept"),
            ("indenter spacing", "changed"),
            ("lattice mismatch", "changed"),
            ("repulsion energy", "changed"),
            ("repulsion range", "changed"),
            ("contact distance", "changed"),
        ] {
            assert_eq!(find(&lines, group).status, status, "{group}");
        }
        input.actual.net_points = 0;
        assert!(audit(&input).is_err());
    }

    #[test]
    fn registry_counts_agree_with_a_search() {
        for (p, q) in [(11, 5), (385, 175), (14, 5), (2, 1), (4, 1), (1, 1), (3, 2), (5, 3), (10, 5), (6, 5)] {
            let d = gcd(p, q);
            let (p0, q0) = (p / d, q / d);
            let mut seen = std::collections::BTreeSet::new();
            for i in 0..4 * q0 {
                for j in (0..4 * q0).filter(|j| (i + j) % 2 == 0) {
                    seen.insert((i * p0 % (2 * q0), j * p0 % (2 * q0)));
                }
            }
            assert_eq!(distinct_registries(p, q), seen.len(), "{p}/{q}");
        }
        assert_eq!((distinct_registries(11, 5), distinct_registries(2, 1)), (50, 1));
    }
}

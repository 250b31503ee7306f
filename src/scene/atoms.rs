//! The block of atoms of a scene, resolved: crystal, indenter, wall, and the audit of scaling down.

use super::model::relative_to;
use super::names::Keys;
use super::repulsion::BlockCrystal;
use super::{AtomsScene, AtomsStart, Scene, Slope};
use crate::{Error, Result};
use asperity_atoms::audit::{Actual, AuditInput, Target, audit};
use asperity_atoms::block::{BaseKind, Block};
use asperity_atoms::compliant_wall::CompliantWall;
use asperity_atoms::engine::ranks_warning;
use asperity_atoms::indenter::grid_points;
use asperity_atoms::interaction::Yukawa;
use asperity_atoms::job_spec::FORCE_TOLERANCE;
use asperity_atoms::nvt::NvtSettings;
use asperity_atoms::potential::{CALCIUM, CALCIUM_C11_GPA, CALCIUM_ELEMENT, CALCIUM_MODULUS_GPA, SetflHeader};
use asperity_atoms::results::AuditLine;
use asperity_atoms::wall::{self, LatticeWall as AtomWall};
use asperity_contact::interface::{AttractionLaw, Base, Elastic, Layer, TabulatedWall};
use asperity_contact::load::LoadStep;
use asperity_contact::problem::Names;
use asperity_grid::Grid;
use asperity_grid::error::Complaint;
use asperity_grid::sys::expect_memory;
use asperity_grid::units::{GPA_PER_EV_A3, Scales};
use asperity_surface::{HeightSource, dilate_by_ball, moments, range};
use std::path::{Path, PathBuf};

/// Poisson's ratio of the calcium-like block for the depth's effect: the Hill average of its elastic constants is 0.298.
const BLOCK_POISSON: f64 = 0.3;

/// Grid spacings of the comparison per spacing of the indenter's atoms: sixteen per shortest wave of the profile.
const MATCHED_REFINEMENT: usize = 4;

/// Normal force from which an atom counts as loaded over the largest force that an equilibrium leaves, of a looser one than usual
/// over what is usual: below, the two cannot be distinguished.
const CONTACT_FORCE_TOLERANCES: f64 = 10.0;

/// Low-pass wavelength of the indenter over its spacing: the shortest wave that atoms on a grid still follow.
const LOW_PASS_SPACINGS: f64 = 4.0;

/// Resolved rms gradient beyond which a profile that was scaled up is warned of. On a block of 25 nm no atom leaves the crystal's order
/// at 0.2 up to p* = 0.03; at 0.37 4 in 1000 do, and areas still follow elasticity to 7 %
/// (evidence/validation-yield.md#slope-and-size).
const YIELDING: f64 = 0.5;

/// Mean pressure over E* up to which a block is pressed: by that elasticity would have it shortened by half.
const MAX_PRESSURE_OVER_MODULUS: f64 = 0.5;

/// The load up to which atoms are pressed, p*, on a surface of this rms gradient.
pub fn highest_p_star(gradient: f64) -> f64 {
    MAX_PRESSURE_OVER_MODULUS / gradient
}

/// Rounded down to two digits, so that the printed limit itself is accepted.
fn rounded_down(value: f64) -> f64 {
    let unit = 10f64.powf(value.log10().floor() - 1.0);
    (value / unit).floor() * unit
}

/// The adhesion that atoms carry, and what the continuum must carry to be compared with it.
#[derive(Debug, Clone, Copy)]
pub struct PairAdhesion {
    pub pair: Yukawa,
    /// Work of adhesion and range of two flats, reduced by the block.
    pub gamma: f64,
    pub rho: f64,
    /// Factor on γ in the pair term that makes up for the soft wall.
    pub calibration: f64,
}

/// The block of atoms of a case.
#[derive(Debug, Clone)]
pub struct AtomsCase {
    pub block: Block,
    /// Atoms along a side of the indenter.
    pub points: usize,
    pub wall: AtomWall,
    /// `None`: the shipped calcium-like potential.
    pub potential: Option<PathBuf>,
    pub element: String,
    pub mass_u: f64,
    pub scales: Scales,
    pub modulus_gpa: f64,
    /// Shortest wavelength of the profile, units of L.
    pub low_pass: f64,
    /// Factor on the heights: 1 for the literal profile.
    pub stretch: f64,
    pub resolved_gradient: f64,
    pub start: AtomsStart,
    /// Whether the highest load is followed by an unloading branch.
    pub unload: bool,
    /// Constant-temperature runs of the relaxed states, if requested.
    pub nvt: Option<NvtSettings>,
    /// Load at p* = 1, eV/Å.
    pub load_unit: f64,
    pub adhesion: Option<PairAdhesion>,
    pub audit: Vec<AuditLine>,
    /// Grid on which the continuum is compared with the atoms.
    pub matched: Grid,
    /// Normal force from which an atom counts as loaded, eV/Å, and width of the Gaussian of the stress field, Å.
    pub contact_force: f64,
    pub stress_width_angstrom: f64,
    /// Warnings about constants of the indenter that are not made for the crystal.
    repulsion_warnings: Vec<String>,
    /// Mean gap of the profile at first contact, Å: the largest descent of the indenter.
    pub first_touch_gap_angstrom: f64,
}

/// The laboratory's problem, from which the atoms are scaled.
pub(super) struct LaboratoryProblem<'a> {
    pub(super) scene: &'a Scene,
    pub(super) file: &'a Path,
    pub(super) surface: &'a HeightSource,
    pub(super) grid: Grid,
    pub(super) gradient: f64,
    pub(super) adhesion: AttractionLaw,
    pub(super) highest_p_star: f64,
}

/// A pressure that would shorten the block by half is refused.
fn refuse_crushing(problem: &LaboratoryProblem, context: &str) -> Result<()> {
    let (p_star, largest) = (problem.highest_p_star, highest_p_star(problem.gradient));
    if p_star <= largest {
        return Ok(());
    }
    let accepted = format!(
        "at most {:.1e} in p* with atoms: pressures above {MAX_PRESSURE_OVER_MODULUS} E* crush the crystal. p* is the pressure over E* times \
         the rms gradient; if {:.3} is not the gradient of the surface, the unit of its heights or of its extent is wrong",
        rounded_down(largest),
        problem.gradient
    );
    let key = Keys(problem.scene).name(problem.scene.load.loads().kind.field());
    Err(Error::input(context, key, format!("{p_star:.3e} in p*"), accepted))
}

/// The block's crystal, and the mass of an atom, u.
fn crystal<'a>(problem: &LaboratoryProblem, a: &'a AtomsScene, context: &str) -> Result<(BlockCrystal<'a>, f64)> {
    let element = a.element.as_str();
    let Some(path) = &a.potential else {
        let (symbol, _, mass_u) = CALCIUM_ELEMENT;
        if element != symbol {
            let accepted = format!("{symbol:?}, the element of the shipped potential, or another atoms.potential");
            return Err(Error::input(context, "atoms.element", format!("{element:?}"), accepted));
        }
        let (a0, cutoff_angstrom) = (CALCIUM.a0, CALCIUM.rc);
        return Ok((BlockCrystal { element, a0, modulus_gpa: CALCIUM_MODULUS_GPA, cutoff_angstrom }, mass_u));
    };
    let path = relative_to(problem.file, path);
    let header = SetflHeader::read(&path)?;
    let mass_u = header.element(&path, element)?.mass_u;
    let constants = [
        ("atoms.lattice_constant", a.lattice_constant.map(|l| l.to("Å"))),
        ("atoms.modulus", a.modulus.map(|e| e.to("GPa"))),
    ];
    let absent = constants.iter().filter(|(_, value)| value.is_none());
    let accepted = "the value for atoms.potential (`asperity potential --measure` finds it)";
    let list: Vec<Complaint> = absent.map(|(key, _)| Complaint::new(*key, "not given", accepted)).collect();
    let [(_, Some(a0)), (_, Some(modulus_gpa))] = constants else {
        return Err(Error::Input { place: context.into(), list });
    };
    Ok((BlockCrystal { element, a0, modulus_gpa, cutoff_angstrom: header.cutoff_angstrom }, mass_u))
}

/// The low-passed profile of the indenter, in units of the block's length.
struct IndenterProfile {
    grid: Grid,
    low_pass_angstrom: f64,
    /// Factor on the heights.
    stretch: f64,
    resolved_gradient: f64,
    /// Before the factor.
    curvature_radius: f64,
    /// Mean minus lowest height, before the factor.
    first_touch_gap: f64,
}

impl IndenterProfile {
    /// `points`: atoms along a side of the indenter; `length`: of the block, Å.
    fn resolve(
        problem: &LaboratoryProblem,
        a: &AtomsScene,
        wall: &AtomWall,
        points: usize,
        length: f64,
    ) -> Result<Self> {
        let place = problem.file.display();
        let usual = LOW_PASS_SPACINGS * wall.spacing_angstrom;
        let low_pass_angstrom = a.low_pass.map_or(usual, |wave| wave.to("Å"));
        let (low_pass, shortest) = (low_pass_angstrom / length, 2.0 * wall.spacing_angstrom);
        if low_pass_angstrom < shortest || low_pass > 1.0 {
            let accepted = format!("{shortest:.2} (two spacings of the indenter's atoms) to {length:.1} Å");
            return Err(Error::input(place, "atoms.low_pass", format!("{low_pass_angstrom} Å"), accepted));
        }
        let grid = Grid::unit(MATCHED_REFINEMENT * points, MATCHED_REFINEMENT * points);
        // The audit needs the moments of the low-passed heights: these and their spectrum.
        let description = format!("the indenter's profile on {} x {} points", grid.nx, grid.ny);
        expect_memory(description, 3 * 8 * grid.points() as u64, "a smaller atoms.cells needs less")?;
        let heights = problem.surface.heights(grid, low_pass);
        let resolved = moments(grid, &heights);
        if resolved.rms_gradient == 0.0 {
            let found = format!("{low_pass_angstrom} Å (nothing of the profile is left)");
            let accepted = "a wavelength below the profile's longest";
            return Err(Error::input(place, "atoms.low_pass", found, accepted));
        }
        let stretch = match a.slope {
            Slope::Literal => 1.0,
            Slope::Renormalised => problem.gradient / resolved.rms_gradient,
        };
        let extent = range(&heights);
        Ok(IndenterProfile {
            grid,
            low_pass_angstrom,
            stretch,
            resolved_gradient: resolved.rms_gradient * stretch,
            curvature_radius: resolved.curvature_radius(),
            first_touch_gap: extent.mean - extent.min,
        })
    }
}

/// The dimensionless groups of the laboratory's problem.
fn target(problem: &LaboratoryProblem) -> Target {
    let (gamma, rho) = (problem.adhesion.work_of_adhesion(), problem.adhesion.range());
    let (lambda_s, curvature_radius) = match problem.surface {
        HeightSource::Synthesised { spectrum, .. } => (spectrum.lambda_s, spectrum.expected(1.0, 0.0).curvature_radius),
        HeightSource::Imported { grid, heights, .. } => (2.0 * grid.dx(), moments(*grid, heights).curvature_radius()),
        HeightSource::Fourier { modes, .. } => {
            let heights = modes.heights(problem.grid, 0.0);
            (modes.shortest(), moments(problem.grid, &heights).curvature_radius())
        }
    };
    Target { p_star: problem.highest_p_star, gamma, rho, rms_gradient: problem.gradient, lambda_s, curvature_radius }
}

impl AtomsCase {
    /// Normal force on the indenter at a load step, eV/Å.
    pub fn load(&self, step: &LoadStep) -> f64 {
        step.imposed_p_star() * self.load_unit
    }

    pub(super) fn resolve(problem: &LaboratoryProblem) -> Result<AtomsCase> {
        let place = problem.file.display().to_string();
        let a = problem.scene.atoms.as_ref().expect("called for scenes with atoms");
        refuse_crushing(problem, &place)?;
        let (crystal, mass_u) = crystal(problem, a, &place)?;
        let repulsion = crystal.repulsion(a, &place)?;
        let block = Block::new(a.cells, a.depth_cells, crystal.a0, crystal.cutoff_angstrom)
            .and_then(|b| match a.base {
                Some(BaseKind::Elastic) => b.on_elastic_base(a.foundation_depth(), crystal.cutoff_angstrom),
                _ => b.on_foundation(a.foundation_depth()),
            })
            .map_err(|e| e.with_context(&place, None))?;
        if problem.grid.lx != problem.grid.ly {
            let found = format!("{} x {} points", problem.grid.nx, problem.grid.ny);
            return Err(Error::input(
                place,
                "surface.heights",
                found,
                "a square cell, as the block of atoms is: surface.crop = [X, Y, N, N] takes a square part",
            ));
        }
        let points = grid_points(a.cells, crystal.a0, repulsion.minimum_angstrom());
        let length = block.length();
        let wall = AtomWall::new(repulsion, length / points as f64, crystal.a0)?;
        let profile = IndenterProfile::resolve(problem, a, &wall, points, length)?;
        let scales =
            Scales { length_m: length * asperity_grid::units::ANGSTROM_M, modulus_pa: crystal.modulus_gpa * 1e9 };
        let adhesion = pair_adhesion(problem, a.adhesion_range.to("Å"), &wall, scales)
            .map_err(|e| e.with_context(&place, Some("atoms.adhesion_range")))?;
        let audit = audit(&AuditInput {
            target: target(problem),
            actual: Actual {
                length_angstrom: length,
                depth_angstrom: block.thickness(),
                foundation_angstrom: block.thickness() - block.deformable_thickness(),
                a0_angstrom: crystal.a0,
                modulus_gpa: crystal.modulus_gpa,
                poisson: BLOCK_POISSON,
                p_star: problem.highest_p_star,
                gamma_ev_a2: adhesion.map_or(0.0, |p| scales.energy_per_area_ev_a2(p.gamma)),
                rho_angstrom: if adhesion.is_some() { a.adhesion_range.to("Å") } else { 0.0 },
                rms_gradient: problem.gradient,
                resolved_gradient: profile.resolved_gradient,
                lambda_min_angstrom: profile.low_pass_angstrom,
                curvature_radius_angstrom: profile.curvature_radius / profile.stretch * length,
                repulsion,
                net_points: points,
                crystal_cells: a.cells,
            },
        })?;
        Ok(AtomsCase {
            block,
            points,
            wall,
            potential: a.potential.as_ref().map(|p| relative_to(problem.file, p)),
            element: a.element.clone(),
            mass_u,
            scales,
            modulus_gpa: crystal.modulus_gpa,
            low_pass: profile.low_pass_angstrom / length,
            stretch: profile.stretch,
            resolved_gradient: profile.resolved_gradient,
            start: a.start_or_default(adhesion.is_some()),
            unload: problem.scene.load.loads().is_closed() || problem.scene.load.pull_off,
            nvt: a.nvt.as_ref().map(|h| h.settings()),
            load_unit: length * length * scales.stress_ev_a3(1.0) * problem.gradient,
            adhesion,
            audit,
            matched: profile.grid,
            contact_force: a.contact_force.map_or_else(
                || CONTACT_FORCE_TOLERANCES * a.force_tolerance.to("eV/Å").min(FORCE_TOLERANCE),
                |force| force.to("eV/Å"),
            ),
            stress_width_angstrom: a.stress_width.map_or(crystal.a0, |width| width.to("Å")),
            repulsion_warnings: crystal.warnings(a, &repulsion),
            first_touch_gap_angstrom: profile.first_touch_gap * profile.stretch * length,
        })
    }

    /// Heights of the profile in Å on a grid over the block, lowest at 0.
    pub fn heights_angstrom(&self, surface: &HeightSource, grid: Grid) -> Vec<f64> {
        let scale = self.stretch * self.block.length();
        surface.heights(grid, self.low_pass).into_iter().map(|h| h * scale).collect()
    }

    /// What an atom of the block meets of these heights, as a ball of the wall's radius r_m, on the grid of the comparison, Å.
    pub fn dilated_heights_angstrom(&self, surface: &HeightSource) -> Vec<f64> {
        let length = self.block.length();
        let scaled = Grid { lx: self.matched.lx * length, ly: self.matched.ly * length, ..self.matched };
        dilate_by_ball(scaled, &self.heights_angstrom(surface, self.matched), self.wall.minimum_angstrom())
    }

    /// The block's own elastic layer.
    pub fn kernel(&self) -> Elastic {
        Elastic::Layer(self.layer())
    }

    pub fn layer(&self) -> Layer {
        let thickness = self.block.thickness() / self.block.length();
        Layer { thickness, poisson: BLOCK_POISSON, base: Base::Bonded }
    }

    /// What the block shortens as a whole under a mean pressure of E*, units of L. C11 is known of the shipped potential.
    pub fn compression(&self) -> f64 {
        let layer = self.layer();
        match self.potential {
            None => layer.thickness * self.modulus_gpa / CALCIUM_C11_GPA,
            Some(_) => layer.compression(),
        }
    }

    /// The distance criterion of contact, in words.
    pub fn contact_criterion(&self) -> String {
        format!("an indenter atom within {} Å", (1e4 * self.wall.repulsion.contact_distance_angstrom).round() / 1e4)
    }

    /// Number of atoms of block and indenter.
    pub fn atoms(&self) -> u64 {
        self.block.atoms() + (self.points * self.points) as u64
    }

    /// Repulsion law per area of the indenter's atoms over the block, with the compliance of the block's single atoms.
    pub fn compliant_wall(&self) -> CompliantWall {
        CompliantWall::new(&self.wall, self.modulus_gpa / GPA_PER_EV_A3, self.resolved_gradient)
    }

    /// The same, reduced.
    pub fn compliant_law(&self) -> TabulatedWall {
        self.compliant_wall().reduced(self.block.length(), self.modulus_gpa / GPA_PER_EV_A3)
    }

    /// Adhesion of the continuum to be compared with the atoms, for a hard or for the compliant wall.
    pub fn matched_adhesion(&self, compliant: bool) -> AttractionLaw {
        self.adhesion.map_or(AttractionLaw::None, |a| {
            AttractionLaw::exponential(a.gamma * if compliant { a.calibration } else { 1.0 }, a.rho)
        })
    }

    pub(super) fn warnings(&self, gradient: f64, ranks: usize) -> Vec<String> {
        let mut list: Vec<String> = ranks_warning(ranks, self.atoms()).into_iter().collect();
        list.extend(self.repulsion_warnings.iter().cloned());
        if self.stretch != 1.0 && self.resolved_gradient > YIELDING {
            list.push(format!(
                "the resolved slope of the indenter is scaled up by {:.2} to the whole spectrum's: contact stresses will \
                 exceed the crystal's strength from the first contact on, and areas will not agree with elasticity",
                self.stretch
            ));
        }
        if self.resolved_gradient < 0.999 * gradient {
            list.push(format!(
                "atoms resolve {:.3} of the rms gradient {gradient:.3}: wavelengths below {:.1} Å are left out, here and in \
                 the continuum that the atoms are compared with",
                self.resolved_gradient,
                self.low_pass * self.block.length()
            ));
        }
        list
    }
}

fn pair_adhesion(
    problem: &LaboratoryProblem,
    rho_angstrom: f64,
    wall: &AtomWall,
    scales: Scales,
) -> Result<Option<PairAdhesion>> {
    // Another law is refused with the scene.
    let AttractionLaw::Exponential(law) = problem.adhesion else { return Ok(None) };
    let gamma_ev_a2 = scales.energy_per_area_ev_a2(law.gamma);
    let pair = wall::YukawaAdhesion::new(wall, gamma_ev_a2, rho_angstrom)?;
    Ok(Some(PairAdhesion {
        pair: Yukawa {
            amplitude_ev_angstrom: pair.coefficient_ev_angstrom,
            kappa_per_angstrom: pair.kappa_per_angstrom(),
            cutoff_angstrom: pair.cutoff_angstrom,
        },
        gamma: law.gamma,
        rho: rho_angstrom * asperity_grid::units::ANGSTROM_M / scales.length_m,
        calibration: pair.calibration,
    }))
}

//! The continuum at the loads of an own LAMMPS run, or at the contact areas of its atoms.

use super::own_frame::Profile;
use super::{Listener, ProgressReporter};
use crate::scene::Case;
use crate::{Error, Result};
use asperity_contact::interface::{RangeChoice, Wall};
use asperity_contact::load::Load;
use asperity_contact::method::{ReducedProblem, Stop};
use asperity_contact::path::{LoadPathSolver, pressures_of_contact};
use asperity_grid::mean;

/// What the continuum is to have in common with a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Common {
    Load(Load),
    /// Contact area over that of the box, between 0 and 1.
    ContactArea(f64),
}

/// The continuum at one frame. Gaps over the box's edge along x.
pub(super) struct OwnContinuum {
    pub p_star: f64,
    /// Over the area of the box.
    pub contact_area: f64,
    /// Between the substrate and the surface that a ball of radius d_c meets: zero where an atom touches.
    pub touching_gap: Vec<f64>,
    /// From the substrate up to the surface, less d_c, as gaps of atoms are.
    pub gap: Vec<f64>,
}

impl OwnContinuum {
    pub(super) fn mean_gap(&self) -> f64 {
        mean(&self.gap)
    }
}

/// Solves the continuum on the surface that a ball of the `radius` d_c (over the box's edge) meets, as a hard wall. Returns the states up to the
/// first load without one, and why it has none.
///
/// # Errors
/// `Interrupted`, and others that are not of a load.
pub(super) fn solve(
    case: &Case,
    (profile, radius): (&Profile, f64),
    common: &[Common],
    listener: &dyn Listener,
) -> Result<(Vec<OwnContinuum>, Option<Error>)> {
    let [heights, dilated] = profile.heights(radius);
    let mut problem = ReducedProblem { grid: profile.grid, ..case.problem((&dilated).into()) };
    if let Some(atoms) = &case.atoms {
        problem = ReducedProblem { kernel: atoms.kernel(), adhesion: atoms.matched_adhesion(false), ..problem };
    }
    problem.wall = Wall::Hard;
    let method = asperity_methods::find(&case.scene.continuum.method).expect("checked with the scene");
    let watch = ProgressReporter::new(listener, None, "continuum: ", (0, common.len()));
    let mut states = Vec::new();
    let mut walk = || {
        let areas: Vec<f64> =
            common.iter().filter_map(|c| if let Common::ContactArea(a) = c { Some(*a) } else { None }).collect();
        let mut pressures = pressures_of_contact(&areas, &problem, method, case.gradient, &watch)?.into_iter();
        let load = |c: &Common| match c {
            Common::Load(load) => *load,
            Common::ContactArea(_) => Load::Pressure(pressures.next().expect("one for each area")),
        };
        let loads: Vec<Load> = common.iter().map(load).collect();
        let solver = LoadPathSolver::new(problem.clone(), method, RangeChoice::True, 0.0, &loads).without_error();
        solver.walk(None, false, &watch, |_, reached| {
            let state = &reached.state;
            if state.stop != Stop::Converged {
                return Err(state.not_converged(method.card().id, state.stop, solver.problem().tolerance, None));
            }
            let touching_gap: Vec<f64> = (0..profile.grid.points()).map(|k| state.gap.at(k)).collect();
            let rise = heights.iter().zip(&dilated).map(|(height, dilated)| height - dilated);
            states.push(OwnContinuum {
                p_star: state.pressure / case.gradient,
                contact_area: reached.area.contact_area,
                gap: touching_gap.iter().zip(rise).map(|(gap, rise)| gap + rise).collect(),
                touching_gap,
            });
            watch.next();
            Ok(())
        })
    };
    match walk() {
        Ok(_) => Ok((states, None)),
        Err(why @ (Error::NotConverged { .. } | Error::Input { .. })) => {
            Ok((states, Some(case.given_units().rewrite(why))))
        }
        Err(other) => Err(other),
    }
}

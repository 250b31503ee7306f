//! The contact problem and its solution.

use super::Surface;
use super::estimate::Estimate;
use super::state::{LoadPath, PullOff, State};
use crate::error::Complaint;
use crate::interface::{self, Base, CubicHalfSpace, Elastic, Layer, NonPeriodic, PenaltyWall, RangeChoice, Wall};
use crate::load::{Load, LoadStep};
use crate::method::{self, ContactMethod, Heights, Kind, NoObserver, Precision, Stop};
use crate::path;
use crate::scene::{AdhesionLaw, default_tolerance};
use crate::{Error, Result};

/// A rigid rough surface on an elastic body.
///
/// Units are those of the caller: lengths have the unit of the surface, pressures that of the modulus, and energies per area
/// their product. With 1 for the extent of the cell and for the modulus, all results are in reduced units.
#[derive(Debug, Clone)]
pub struct Problem {
    /// The rough surface.
    pub surface: Surface,
    /// Contact modulus E* = E/(1-ν²).
    pub contact_modulus: f64,
    /// The elastic body.
    pub body: Body,
    /// Attraction between the surfaces; none by default.
    pub adhesion: Option<Adhesion>,
    /// Compliance of the repulsion: the penetration under a pressure of E*. None, the default, is a hard wall.
    pub penalty_length: Option<f64>,
    /// An id of [`methods`](crate::methods); `"auto"`, the default, is the fastest that solves for the fields.
    pub method: String,
    /// Floating-point type of the fields.
    pub precision: Precision,
    /// Largest rms residual over the mean pressure. Default: 1e-8, in single precision what rounding allows.
    pub tolerance: Option<f64>,
    /// Iterations per load after which a solver stops.
    pub max_iterations: usize,
}

/// The elastic body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Body {
    /// An isotropic half-space under a periodic surface.
    HalfSpace,
    /// An isotropic layer on a rigid base.
    Layer {
        /// Thickness, in the unit of the surface's length.
        thickness: f64,
        /// Poisson's ratio.
        poisson: f64,
        /// Boundary condition at the base.
        base: Base,
    },
    /// A cubic crystal with an (001) face and x along `[100]`. Only the ratios of the constants matter.
    Cubic {
        /// Elastic constant C11.
        c11: f64,
        /// Elastic constant C12.
        c12: f64,
        /// Elastic constant C44.
        c44: f64,
    },
    /// An isotropic half-space under a surface that is not periodic, free outside of the map.
    NonPeriodic,
}

/// Attraction between the surfaces.
///
/// ```
/// use asperity::{Adhesion, AdhesionLaw, RangeChoice};
///
/// let adhesion = Adhesion { work_of_adhesion: 0.05, range: 2e-9, ..Adhesion::default() };
/// assert_eq!((adhesion.law, adhesion.resolution), (AdhesionLaw::Exponential, RangeChoice::Mesh));
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Adhesion {
    /// Work of adhesion γ, in units of modulus times length.
    pub work_of_adhesion: f64,
    /// Range ρ, in the unit of the surface's length.
    pub range: f64,
    /// Decay of the attraction with the gap.
    pub law: AdhesionLaw,
    /// What happens where the grid does not resolve the range.
    pub resolution: RangeChoice,
}

impl Problem {
    /// Contact without adhesion on a half-space of contact modulus E* = E/(1-ν²).
    pub fn new(surface: Surface, contact_modulus: f64) -> Self {
        Problem {
            surface,
            contact_modulus,
            body: Body::HalfSpace,
            adhesion: None,
            penalty_length: None,
            method: "auto".into(),
            precision: Precision::F64,
            tolerance: None,
            max_iterations: 50_000,
        }
    }

    /// The equilibrium under a mean pressure, from first contact.
    ///
    /// # Errors
    /// `Input` for values out of their range, for methods that do not solve for the fields and for those that cannot solve this
    /// problem; `Memory`; `NotConverged`.
    ///
    /// ```
    /// use asperity::{Problem, Spectrum, Surface, SynthesisOptions};
    ///
    /// let spectrum = Spectrum { lambda_s: 1.0 / 8.0, ..Spectrum::CHALLENGE };
    /// let surface = Surface::from_spectrum(spectrum, SynthesisOptions { nodes: 32, length: 1.0, seed: 1 })?;
    /// let state = Problem::new(surface, 1.0).solve(0.05)?;
    /// assert!((state.pressure.mean().unwrap() - 0.05).abs() < 1e-9);
    /// assert!(state.gap.iter().all(|g| *g >= 0.0));
    /// # Ok::<(), asperity::Error>(())
    /// ```
    pub fn solve(&self, mean_pressure: f64) -> Result<State> {
        let mut path = self.load_path(&[Load::Pressure(mean_pressure)])?;
        Ok(path.states.remove(0))
    }

    /// Equilibria under `loads`, one after another: with adhesion, loading and unloading lead to different states.
    ///
    /// # Errors
    /// As [`Problem::solve`].
    pub fn load_path(&self, loads: &[Load]) -> Result<LoadPath> {
        self.path(loads, false)
    }

    /// As [`Problem::load_path`]; after the last load the surfaces are separated, and the largest tensile pressure on the way
    /// is found.
    ///
    /// # Errors
    /// As [`Problem::solve`]; `Input` without adhesion.
    pub fn load_path_with_pull_off(&self, loads: &[Load]) -> Result<LoadPath> {
        self.path(loads, true)
    }

    /// The contact under a mean pressure by any method, those included that do not solve for the fields.
    ///
    /// # Errors
    /// As [`Problem::solve`].
    pub fn estimate(&self, mean_pressure: f64) -> Result<Estimate> {
        let method = self.find_method()?;
        if method.card().kind == Kind::Solver {
            return Ok(Estimate::of_state(self.solve(mean_pressure)?, method, &method::Settings::default()));
        }
        let loads = self.reduced_loads(&[Load::Pressure(mean_pressure)], false)?;
        self.surface.with_heights(false, |heights| {
            let input = path::EstimatorInput::new(self.reduced(heights)?, method)?;
            let mut found = None;
            input.walk((&loads, 0), &NoObserver, |_, problem, estimate| {
                found = Some(Estimate::new(self, method, problem, estimate));
                Ok(())
            })?;
            Ok(found.expect("a path that ends without an error has visited its load"))
        })
    }

    /// Bytes that solving for a load path takes besides the surface.
    ///
    /// # Errors
    /// As [`Problem::solve`].
    pub fn memory(&self) -> Result<u64> {
        let method = self.find_method()?;
        self.surface.with_heights(false, |heights| {
            Ok(path::LoadPath::new(self.reduced(heights)?, method, self.resolution(), 0.0, &[]).plan(false).bytes)
        })
    }

    fn path(&self, loads: &[Load], pull_off: bool) -> Result<LoadPath> {
        let method = self.find_method()?;
        if method.card().kind != Kind::Solver {
            let accepted = "a method that solves for the fields, or `Problem::estimate`";
            return Err(Error::input(PLACE, "method", method.card().id, accepted));
        }
        let loads = self.reduced_loads(loads, pull_off)?;
        let steps = LoadStep::path(&loads, &[], loads.len());
        // As on the command line: the default method works on waves.
        let as_waves = method.card().id == "fast" && self.body != Body::NonPeriodic;
        self.surface.with_heights(as_waves, |heights| {
            let path = path::LoadPath::new(self.reduced(heights)?, method, self.resolution(), 0.0, &loads);
            let (need, have) = (path.plan(pull_off).bytes, crate::sys::available_memory_bytes());
            if need > have {
                let what = method.card().id.into();
                let advice = "a surface with fewer nodes or Precision::F32 needs less".into();
                return Err(Error::Memory { what, need, have, advice });
            }
            let mut states = Vec::new();
            let pulled = path.walk(None, pull_off, &NoObserver, |i, reached| match reached.state.stop {
                Stop::Converged => {
                    states.push(State::new(self, &steps[i], &reached));
                    Ok(())
                }
                Stop::Interrupted => Err(Error::Interrupted),
                stop => Err(Error::NotConverged {
                    method: method.card().id,
                    why: stop.to_string(),
                    iterations: reached.state.iterations,
                    residual: reached.state.residual,
                    tolerance: path.problem().tolerance,
                    partial: None,
                }),
            })?;
            Ok(LoadPath { states, pull_off: pulled.map(|p| PullOff::new(self, &p)) })
        })
    }

    fn find_method(&self) -> Result<&'static dyn ContactMethod> {
        method::find(&self.method)
            .ok_or_else(|| Error::input(PLACE, "method", format!("{:?}", self.method), method::ids().join(", ")))
    }

    fn resolution(&self) -> RangeChoice {
        self.adhesion.map_or(RangeChoice::default(), |a| a.resolution)
    }

    /// Unit of the energies per area.
    pub(super) fn energy_unit(&self) -> f64 {
        self.contact_modulus * self.surface.length()
    }

    /// The problem in reduced units.
    fn reduced<'a>(&self, heights: Heights<'a>) -> Result<method::Problem<'a>> {
        self.check()?;
        let (grid, length) = (self.surface.grid(), self.surface.length());
        let kernel = match self.body {
            Body::HalfSpace => Elastic::HalfSpace,
            Body::Layer { thickness, poisson, base } => {
                Elastic::Layer(Layer { thickness: thickness / length, poisson, base })
            }
            Body::Cubic { c11, c12, c44 } => Elastic::Cubic(CubicHalfSpace::new(c11, c12, c44)?),
            Body::NonPeriodic => Elastic::NonPeriodic(NonPeriodic::of_region(grid.lx, grid.ly)),
        };
        let adhesion = self.adhesion.map_or(interface::Adhesion::None, |a| {
            a.law.adhesion(a.work_of_adhesion / self.energy_unit(), a.range / length)
        });
        let wall = self.penalty_length.map_or(Wall::Hard, |l| Wall::Penalty(PenaltyWall { length: l / length }));
        Ok(method::Problem {
            kernel,
            adhesion,
            wall,
            precision: self.precision,
            tolerance: self.tolerance.unwrap_or(default_tolerance(self.precision, grid)),
            max_iterations: self.max_iterations,
            ..method::Problem::new(grid, heights)
        })
    }

    fn check(&self) -> Result<()> {
        let adhesion = self.adhesion.unwrap_or_default();
        let mut list = Vec::new();
        let mut unless = |good: bool, key: &str, found: f64, accepted: &str| {
            if !good {
                list.push(Complaint::new(key, found, accepted));
            }
        };
        let positive = |value: f64| value.is_finite() && value > 0.0;
        let (modulus, work) = (self.contact_modulus, adhesion.work_of_adhesion);
        unless(positive(modulus), "contact_modulus", modulus, "a positive number");
        unless(work.is_finite() && work >= 0.0, "adhesion.work_of_adhesion", work, "zero or a positive number");
        let range = adhesion.range;
        unless(self.adhesion.is_none() || positive(range), "adhesion.range", range, "a positive number");
        self.penalty_length.iter().for_each(|&l| unless(positive(l), "penalty_length", l, "a positive number"));
        self.tolerance.iter().for_each(|&t| unless(positive(t) && t < 1.0, "tolerance", t, "a number in (0, 1)"));
        if let Body::Layer { thickness, poisson, .. } = self.body {
            unless(positive(thickness), "body.thickness", thickness, "a positive number");
            unless((0.0..=0.5).contains(&poisson), "body.poisson", poisson, "a number from 0 to 0.5");
        }
        if list.is_empty() { Ok(()) } else { Err(Error::Input { place: PLACE.into(), list }) }
    }

    /// Loads in reduced units.
    fn reduced_loads(&self, loads: &[Load], pull_off: bool) -> Result<Vec<Load>> {
        let attracts = self.adhesion.is_some_and(|a| a.work_of_adhesion > 0.0);
        if pull_off && !attracts {
            return Err(Error::input(PLACE, "pull-off", "without adhesion", "a positive work of adhesion"));
        }
        let reduced = |load: &Load| match *load {
            Load::Pressure(p) if p.is_finite() && (attracts || p > 0.0) => Ok(Load::Pressure(p / self.contact_modulus)),
            Load::Pressure(p) => Err(Error::input(PLACE, "mean pressure", p, "a positive number; with adhesion, any")),
            Load::MeanGap(g) if g.is_finite() && g > 0.0 => Ok(Load::MeanGap(g / self.surface.length())),
            Load::MeanGap(g) => Err(Error::input(PLACE, "mean gap", g, "a positive number")),
        };
        loads.iter().map(reduced).collect()
    }
}

/// Named in errors.
const PLACE: &str = "problem";

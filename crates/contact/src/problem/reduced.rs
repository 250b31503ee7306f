//! A problem in reduced units: the extent of the cell along x and the contact modulus are 1.

use super::{Body, Field, Hardness, LoadKind, Loads, Names, Problem, default_tolerance};
use crate::interface::{
    AttractionLaw, CubicHalfSpace, Elastic, HardnessMap, Layer, NodalHardness, NonPeriodic, PenaltyWall, RangeChoice,
    Wall, rounded,
};
use crate::load::{Load, LoadStep};
use crate::method::{Heights, MethodKind, Precision, ReducedProblem, Settings, is_representable};
use crate::path::estimated_p_star;
use asperity_grid::error::Complaint;
use asperity_grid::{Error, Grid, Result, mean, sys};
use asperity_surface::{HeightSource, moments, non_periodic_gradient};
use std::sync::Arc;

/// A problem in reduced units without its heights: what a plan needs, and with heights a [`ReducedProblem`].
#[derive(Debug, Clone)]
pub struct ReducedModel {
    pub grid: Grid,
    pub kernel: Elastic,
    /// With the requested range, before adaptation to the grid.
    pub adhesion: AttractionLaw,
    /// What happens where the grid does not resolve the range.
    pub resolution: RangeChoice,
    pub wall: Wall,
    /// Largest contact stress, units of E*; `None` for an elastic body.
    pub hardness: Option<Hardness>,
    pub precision: Precision,
    pub tolerance: f64,
    pub max_iterations: usize,
    pub settings: Settings,
}

impl ReducedModel {
    /// The problem on these heights.
    pub fn problem<'a>(&'a self, heights: Heights<'a>) -> ReducedProblem<'a> {
        ReducedProblem {
            kernel: self.kernel,
            adhesion: self.adhesion,
            wall: self.wall,
            hardness: self.hardness.as_ref().map(|hardness| match hardness {
                Hardness::Uniform(value) => NodalHardness::Uniform(*value),
                Hardness::Map(map) => NodalHardness::from(&**map),
            }),
            precision: self.precision,
            tolerance: self.tolerance,
            max_iterations: self.max_iterations,
            settings: self.settings,
            ..ReducedProblem::new(self.grid, heights)
        }
    }

    /// The largest spacing of the grid.
    pub fn spacing(&self) -> f64 {
        self.grid.dx().max(self.grid.dy())
    }

    /// Range of a law on this grid, units of L: enlarged where the grid does not resolve it.
    pub fn range_used(&self, adhesion: AttractionLaw) -> f64 {
        self.resolution.law(adhesion, self.spacing()).range()
    }
}

/// A problem and its loads in reduced units.
#[derive(Debug, Clone)]
pub struct Reduction {
    pub model: ReducedModel,
    /// The load path, the unloading branch included. Contact areas have estimated pressures.
    pub steps: Vec<LoadStep>,
    /// Pressure over E* at p* = 1.
    pub gradient: f64,
}

/// Whether a transform of the heights fits into memory: heights, a spectrum and one more field.
pub(super) fn fits(grid: Grid) -> bool {
    3 * 8 * grid.points() as u64 <= sys::available_memory_bytes()
}

impl Problem {
    /// rms gradient of the whole spectrum, of which p* is a multiple; NaN for a map whose transform does not fit into memory.
    pub fn gradient(&self) -> f64 {
        match self.surface.source() {
            HeightSource::Synthesised { spectrum, .. } => spectrum.rms_gradient,
            HeightSource::Fourier { modes, .. } => modes.rms_gradient(),
            HeightSource::Imported { grid, .. } if !fits(*grid) => f64::NAN,
            HeightSource::Imported { grid, heights, .. } if self.body == Body::NonPeriodic => {
                non_periodic_gradient(*grid, heights)
            }
            HeightSource::Imported { grid, heights, .. } => moments(*grid, heights).rms_gradient,
        }
    }

    /// The problem and its loads in reduced units. `gradient`: see [`Problem::gradient`].
    ///
    /// # Errors
    /// `Input`: an unstable crystal, a displacement or mean gap at which the gap is closed, a number that over- or underflows.
    pub fn reduced(&self, loads: &Loads, gradient: f64, (place, names): (&str, &dyn Names)) -> Result<Reduction> {
        let (grid, length, modulus) = (self.surface.grid(), self.surface.length(), self.modulus);
        let refuse = |complaint: Complaint| Error::Input { place: place.into(), list: vec![complaint] };
        let hardness = match &self.hardness {
            None => None,
            Some(Hardness::Uniform(value)) => Some(Hardness::Uniform(value / modulus)),
            Some(Hardness::Map(map)) => Some(Hardness::Map(Arc::new(
                self.reduced_map(map)
                    .map_err(|complaint| refuse(Complaint { key: names.name(Field::HardnessMap), ..complaint }))?,
            ))),
        };
        let model = ReducedModel {
            grid,
            kernel: self.kernel()?,
            adhesion: self.adhesion.as_ref().map_or(AttractionLaw::None, |a| a.reduced(length, modulus)),
            resolution: self.adhesion.as_ref().map_or(RangeChoice::default(), |a| a.resolution),
            wall: self.penalty_length.map_or(Wall::Hard, |l| Wall::Penalty(PenaltyWall { length: l / length })),
            hardness,
            precision: self.precision,
            tolerance: self.tolerance.unwrap_or(default_tolerance(self.precision, grid)),
            max_iterations: self.max_iterations,
            settings: self.settings,
        };
        self.refuse_flat(loads, gradient, names).map_err(refuse)?;
        let touch = self.first_touch(loads, names).map_err(refuse)?;
        let steps = self.steps(loads, gradient, touch);
        self.refuse_closed(&model, loads, gradient, names).map_err(refuse)?;
        self.refuse_unrepresentable(&model, loads, &steps, names).map_err(refuse)?;
        self.refuse_hidden(&model, loads, &steps, names).map_err(refuse)?;
        Ok(Reduction { model, steps, gradient })
    }

    /// A flat surface touches everywhere or nowhere: it has no p*, and no contact fraction or displacement in between.
    fn refuse_flat(&self, loads: &Loads, gradient: f64, names: &dyn Names) -> std::result::Result<(), Complaint> {
        // The gradient of equal heights may be rounding.
        let is_flat = match self.surface.source() {
            HeightSource::Imported { heights, .. } => heights.iter().all(|h| *h == heights[0]),
            _ => gradient == 0.0,
        };
        let needs_roughness = matches!(loads.kind, LoadKind::PStar | LoadKind::Contact | LoadKind::Displacement);
        match loads.values.first() {
            Some(value) if is_flat && needs_roughness => {
                let accepted = "pressures, forces or mean gaps: the surface is flat".into();
                Err(names.complaint(loads.kind.field(), Some(0), *value, accepted))
            }
            _ => Ok(()),
        }
    }

    fn reduced_map(&self, map: &HardnessMap) -> std::result::Result<HardnessMap, Complaint> {
        let grid = self.surface.grid();
        if !map.is_on(grid.nx, grid.ny) {
            let accepted = format!("values {:?}, as the surface has", self.surface.shape());
            return Err(Complaint::new("", "a map of another shape", accepted));
        }
        map.converted(|h| h / self.modulus)
    }

    /// The elastic body.
    fn kernel(&self) -> Result<Elastic> {
        let (grid, length) = (self.surface.grid(), self.surface.length());
        Ok(match self.body {
            Body::HalfSpace => Elastic::HalfSpace,
            Body::Layer { thickness, poisson, base } => {
                Elastic::Layer(Layer { thickness: thickness / length, poisson, base })
            }
            Body::Cubic { c11, c12, c44 } => Elastic::Cubic(CubicHalfSpace::new(c11, c12, c44)?),
            Body::NonPeriodic => Elastic::NonPeriodic(NonPeriodic::of_region(grid.lx, grid.ly)),
        })
    }

    /// Mean gap at first contact, where displacements are imposed.
    fn first_touch(&self, loads: &Loads, names: &dyn Names) -> std::result::Result<f64, Complaint> {
        if loads.kind != LoadKind::Displacement {
            return Ok(f64::NAN);
        }
        let (length, gap) = (self.surface.length(), mean(&self.surface.source().heights(self.surface.grid(), 0.0)));
        match loads.values.iter().position(|d| d / length >= gap) {
            None => Ok(gap),
            Some(i) => {
                let most = names.value(Field::Displacement, None, rounded(gap * length));
                let accepted = format!("less than {most}, the mean gap at first contact: there the gap is closed");
                Err(names.complaint(Field::Displacement, Some(i), loads.values[i], accepted))
            }
        }
    }

    /// The load steps. A flat surface has no p*.
    fn steps(&self, loads: &Loads, gradient: f64, touch: f64) -> Vec<LoadStep> {
        let (length, modulus, mapped) = (self.surface.length(), self.modulus, self.surface.mapped_area());
        let path = loads.path();
        let target = |value: f64| match loads.kind {
            LoadKind::PStar => Load::Pressure(value * gradient),
            LoadKind::Pressure => Load::Pressure(value / modulus),
            LoadKind::Force => Load::Pressure(value / modulus / mapped),
            LoadKind::Contact => Load::Pressure(gradient * estimated_p_star(value)),
            LoadKind::MeanGap => Load::MeanGap(value / length),
            LoadKind::Displacement => Load::MeanGap(touch - value / length),
        };
        let targets: Vec<Load> = path.iter().map(|value| target(*value)).collect();
        let of_pressure = |load: &Load| match load {
            Load::Pressure(p) if gradient > 0.0 => Some(p / gradient),
            _ => None,
        };
        let p_star: Vec<f64> = match loads.kind {
            LoadKind::PStar => path,
            _ => targets.iter().filter_map(of_pressure).collect(),
        };
        let same_on_finer_grids = !matches!(loads.kind, LoadKind::Contact | LoadKind::Displacement);
        let steps = LoadStep::path(&targets, &p_star, loads.loading_count()).into_iter();
        steps.map(|step| LoadStep { same_on_finer_grids, ..step }).collect()
    }

    /// Behind a hard wall every pressure from that of full contact on has the mean gap zero, so that it determines no load.
    fn refuse_closed(
        &self,
        model: &ReducedModel,
        loads: &Loads,
        gradient: f64,
        names: &dyn Names,
    ) -> std::result::Result<(), Complaint> {
        let zero = loads.values.iter().position(|v| *v == 0.0);
        let closed = zero.filter(|_| loads.kind == LoadKind::MeanGap && model.wall == Wall::Hard);
        let Some(i) = closed else { return Ok(()) };
        let mut accepted = "a positive number".to_string();
        if model.adhesion == AttractionLaw::None && fits(model.grid) {
            let heights = self.surface.source().heights(model.grid, 0.0);
            let full = model.problem((&heights).into()).full_contact_pressure();
            accepted += &format!("; full contact from {} = {} on", names.name(Field::PStar), full / gradient);
        }
        Err(names.complaint(Field::MeanGap, Some(i), 0.0, accepted))
    }

    /// Pressures that rounding of the heights exceeds, for methods that solve for the fields.
    fn refuse_hidden(
        &self,
        model: &ReducedModel,
        loads: &Loads,
        steps: &[LoadStep],
        names: &dyn Names,
    ) -> std::result::Result<(), Complaint> {
        let is_map_beyond_memory = matches!(self.surface.source(), HeightSource::Imported { grid, .. } if !fits(*grid));
        if self.method.card().kind != MethodKind::Solver || is_map_beyond_memory {
            return Ok(());
        }
        let rms = self.surface.rms_height() / self.surface.length();
        let least = model.problem(Heights::Planned(None)).least_pressure(rms);
        let hidden = |step: &LoadStep| matches!(step.target, Load::Pressure(p) if p > 0.0 && p < least);
        let Some(i) = steps.iter().position(hidden).filter(|_| least.is_finite()) else { return Ok(()) };
        let accepted = format!(
            "at least {least:.1e} times {}, as a pressure: rounding of the heights hides smaller stresses; check the units of load and modulus",
            names.name(Field::Modulus)
        );
        Err(names.complaint(loads.kind.field(), Some(i), loads.path()[i], accepted))
    }

    /// Values that over- or underflow in reduced units, and units whose products do.
    fn refuse_unrepresentable(
        &self,
        model: &ReducedModel,
        loads: &Loads,
        steps: &[LoadStep],
        names: &dyn Names,
    ) -> std::result::Result<(), Complaint> {
        let mut values = vec![(Field::Modulus, None, self.modulus, self.modulus * self.surface.length())];
        for (i, (value, step)) in loads.path().into_iter().zip(steps).enumerate() {
            let (Load::Pressure(reduced) | Load::MeanGap(reduced)) = step.target;
            values.push((loads.kind.field(), Some(i), value, reduced));
        }
        if let Some(a) = &self.adhesion {
            values.push((Field::WorkOfAdhesion, None, a.work_of_adhesion, model.adhesion.work_of_adhesion()));
            if a.work_of_adhesion != 0.0 {
                values.push((Field::Range, None, a.range, model.adhesion.range()));
            }
        }
        if let (Some(length), Wall::Penalty(wall)) = (self.penalty_length, model.wall) {
            values.push((Field::PenaltyLength, None, length, wall.length));
        }
        match &model.hardness {
            Some(Hardness::Uniform(reduced)) => {
                values.push((Field::Hardness, None, reduced * self.modulus, *reduced));
            }
            Some(Hardness::Map(map)) => {
                let (low, high) = map.extent();
                values.extend([low, high].map(|h| (Field::HardnessMap, None, h * self.modulus, h)));
            }
            None => {}
        }
        match values.into_iter().find(|(.., given, reduced)| !is_representable(*given, *reduced)) {
            None => Ok(()),
            Some((field, index, given, _)) => {
                let (modulus, length) = (names.name(Field::Modulus), names.name(Field::Length));
                let accepted =
                    format!("a number that neither over- nor underflows over or times {modulus} and {length}");
                let key = index.map_or_else(|| names.name(field), |i| names.entry(field, i));
                Err(Complaint::new(key, format!("{given:e}"), accepted))
            }
        }
    }
}

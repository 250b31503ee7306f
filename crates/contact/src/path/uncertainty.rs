//! Uncertainty components of the numbers of a state.

use crate::method::{Equilibrium, Heights, ReducedProblem};
use crate::observe::ContactArea;
use crate::quantity::Quantity;
use crate::state::{Discretisation, Extrapolated};
use crate::uncertainty::{UncertaintyComponent, UncertaintySource};

/// What the uncertainty of a state follows from.
pub(super) struct UncertaintyInput<'a> {
    /// With the adhesion used on its grid.
    pub problem: &'a ReducedProblem<'a>,
    /// Whether the method uses another range of adhesion than the requested one.
    pub enlarges: bool,
    /// Of the problem's heights, L.
    pub rms_height: f64,
    pub state: &'a Equilibrium<'a>,
    pub area: &'a ContactArea,
    pub discretisation: Option<Discretisation>,
    pub waves: LeftOutWaves,
    pub extrapolated: Option<Extrapolated>,
}

/// Waves of a surface that a grid does not hold.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct LeftOutWaves {
    /// rms gradient of all waves over that of the grid's, less 1.
    gradient: f64,
    /// Root mean square of their heights, L.
    rms_height: f64,
}

impl LeftOutWaves {
    /// Of the heights of a periodic surface on a grid: none of nodes, which are all that is known.
    pub(super) fn of(problem: &ReducedProblem) -> Self {
        let Heights::Series(series) = problem.heights else { return LeftOutWaves::default() };
        let grid = problem.grid;
        let [rms, gradient] = series.whole(grid);
        let (resolved_rms, resolved) = (series.resolved_rms(grid), series.rms_gradient(grid));
        let rms_height = ((rms - resolved_rms) * (rms + resolved_rms)).max(0.0).sqrt();
        // Below this the difference is rounding.
        let rms_height = if rms_height <= ROUNDING_OF_RMS * rms { 0.0 } else { rms_height };
        LeftOutWaves { gradient: if rms_height > 0.0 { gradient / resolved - 1.0 } else { 0.0 }, rms_height }
    }

    pub(super) fn any(&self) -> bool {
        self.rms_height > 0.0
    }
}

/// rms height of left-out waves, over that of all, that is rounding of a difference of squares.
const ROUNDING_OF_RMS: f64 = 1e-7;

/// Relative errors by left-out waves, over the relative gradient or over the rms height per mean gap. The area of light contact goes as the
/// inverse of the rms gradient. Fitted to grids with a half to an eighth of the points of maps of seeds 950 and 951, 117 grids of smooth
/// ones, against grids four times finer than the map.
const AREA_BY_GRADIENT: f64 = 1.25;
const STIFFNESS_BY_GRADIENT: f64 = 0.5;
const GAP_BY_HEIGHT: f64 = 0.5;

/// Uncertainty components of a state. Those of the mean gap apply where the load is imposed.
pub(super) fn components(known: &UncertaintyInput) -> Vec<UncertaintyComponent> {
    let &UncertaintyInput { problem, enlarges, rms_height, state, area, discretisation, waves, extrapolated } = known;
    let (area, gap) = (area.contact_area, state.mean_gap);
    let mut parts = Vec::new();
    let mut add = |quantity, source, relative: Option<f64>, is_bound| {
        // The relative uncertainty is not finite where the quantity is zero.
        let relative = relative.filter(|r| r.is_finite());
        parts.push(UncertaintyComponent { quantity, source, relative, is_bound });
    };
    if let Some(d) = discretisation {
        add(Quantity::ContactArea, UncertaintySource::Grid, d.area, d.area_is_bound);
        add(Quantity::MeanGap, UncertaintySource::Grid, d.mean_gap, d.mean_gap_is_bound);
        if state.stiffness.is_some() {
            add(Quantity::Stiffness, UncertaintySource::Grid, d.stiffness, false);
        }
    }
    if waves.any() {
        add(Quantity::ContactArea, UncertaintySource::Waves, Some(AREA_BY_GRADIENT * waves.gradient), false);
        add(Quantity::MeanGap, UncertaintySource::Waves, Some(GAP_BY_HEIGHT * waves.rms_height / gap), false);
        if state.stiffness.is_some() {
            let of_stiffness = STIFFNESS_BY_GRADIENT * waves.gradient;
            add(Quantity::Stiffness, UncertaintySource::Waves, Some(of_stiffness), false);
        }
    }
    if enlarges {
        let far = extrapolated.map(|e| (e.area.value - area).abs() + e.area.error);
        let far_gap = extrapolated.and_then(|e| e.mean_gap).map(|g| (g.value - gap).abs() + g.error);
        add(Quantity::ContactArea, UncertaintySource::Range, far.map(|a| a / area), false);
        add(Quantity::MeanGap, UncertaintySource::Range, far_gap.map(|g| g / gap), false);
        if state.stiffness.is_some() {
            add(Quantity::Stiffness, UncertaintySource::Range, None, false);
        }
    }
    // A relative residual is treated as a relative error of the load. The area is proportional to the load; the mean
    // gap changes by the load error over the contact stiffness.
    let of_load =
        |fraction: f64| [Some(fraction), state.stiffness.map(|k| fraction * state.pressure.abs() / (k * gap))];
    let [of_area, of_gap] = of_load(state.residual);
    add(Quantity::ContactArea, UncertaintySource::Solver, state.error_estimates.area.or(of_area), false);
    add(Quantity::MeanGap, UncertaintySource::Solver, state.error_estimates.mean_gap.or(of_gap), false);
    let [of_area, of_gap] = of_load(problem.rounding_floor(rms_height, state.pressure));
    add(Quantity::ContactArea, UncertaintySource::Precision, of_area, false);
    add(Quantity::MeanGap, UncertaintySource::Precision, of_gap, false);
    parts
}

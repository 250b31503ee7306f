//! Uncertainty components of the numbers of a state.

use crate::method::{Equilibrium, ReducedProblem};
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
    pub extrapolated: Option<Extrapolated>,
}

/// Uncertainty components of a state. Those of the mean gap apply where the load is imposed.
pub(super) fn components(known: &UncertaintyInput) -> Vec<UncertaintyComponent> {
    let &UncertaintyInput { problem, enlarges, rms_height, state, area, discretisation, extrapolated } = known;
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

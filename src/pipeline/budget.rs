//! Uncertainty components of the contact area and the mean gap of solved states.

use crate::method::Problem;
use crate::path::CORRECTION;
use crate::record::quantity::Quantity;
use crate::record::results::{RangeResults, StateResults};
use crate::record::uncertainty::{UncertaintyComponent, UncertaintySource};

/// Uncertainty components of a state. `rms_height` is that of the problem's heights, units of L. The components of the
/// mean gap apply where the load is imposed.
pub(super) fn budget(
    problem: &Problem,
    rms_height: f64,
    range: Option<&RangeResults>,
    state: &StateResults,
) -> Vec<UncertaintyComponent> {
    let mut parts = Vec::new();
    let mut add = |quantity, source, relative: Option<f64>, is_bound| {
        // The relative uncertainty is not finite where the quantity is zero.
        let relative = relative.filter(|r| r.is_finite());
        parts.push(UncertaintyComponent { quantity, source, relative, is_bound });
    };
    if let Some(d) = state.discretisation {
        add(Quantity::ContactArea, UncertaintySource::Grid, d.area, d.area_is_bound);
        add(Quantity::MeanGap, UncertaintySource::Grid, d.mean_gap, d.mean_gap_is_bound);
    }
    if range.is_some_and(|r| r.used != r.requested) {
        let far = state.extrapolated;
        let area = far.map(|e| (e.area.value - state.contact_fraction_corrected).abs() + e.area.error);
        let gap = far.and_then(|e| e.mean_gap).map(|g| (g.value - state.mean_gap).abs() + g.error);
        add(Quantity::ContactArea, UncertaintySource::Range, area.map(|a| a / state.contact_fraction_corrected), false);
        add(Quantity::MeanGap, UncertaintySource::Range, gap.map(|g| g / state.mean_gap), false);
    }
    // A relative residual is treated as a relative error of the load. The area is proportional to the load; the mean
    // gap changes by the load error over the contact stiffness.
    let of_load = |share: f64| {
        [Some(share), state.numbers.stiffness.map(|k| share * state.numbers.pressure.abs() / (k * state.mean_gap))]
    };
    let [area, gap] = of_load(state.residual);
    add(Quantity::ContactArea, UncertaintySource::Solver, state.area_error_estimate.or(area), false);
    add(Quantity::MeanGap, UncertaintySource::Solver, state.mean_gap_error_estimate.or(gap), false);
    let [area, gap] = of_load(problem.rounding_floor(rms_height, state.numbers.pressure));
    add(Quantity::ContactArea, UncertaintySource::Precision, area, false);
    add(Quantity::MeanGap, UncertaintySource::Precision, gap, false);
    let step = state.numbers.stiffness_error.zip(state.numbers.stiffness).map(|(error, k)| error / k);
    if state.numbers.stiffness.is_some() {
        add(Quantity::Stiffness, UncertaintySource::LoadStep, step, false);
    }
    let rim = CORRECTION * (state.numbers.contact_fraction - state.contact_fraction_corrected).abs();
    add(Quantity::ContactArea, UncertaintySource::Criterion, Some(rim / state.contact_fraction_corrected), false);
    parts
}

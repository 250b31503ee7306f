//! Estimates of methods that do not solve for the fields, as states.

use crate::interface::AttractionLaw;
use crate::load::LoadStep;
use crate::method::{Criterion, MethodCard, MethodEstimate, ReducedProblem};
use crate::observe::{
    ClusterAreas, Connectivity, ContactEdges, cluster_sizes, contact_area, gap_distribution, stiffness,
    stress_distribution,
};
use crate::observed::{SIZES_PER_DECADE, gap_edges, stress_edges};
use crate::quantity::Quantity;
use crate::state::{Missing, Observed, State};
use asperity_grid::Field;
use std::borrow::Cow;

/// What a method does not deliver at any load.
pub fn never_delivered(card: &MethodCard, adhesive: bool) -> Missing {
    let reason = |q| Some((q, card.unsupported_reason(q, adhesive)?.to_string()));
    Quantity::OUTPUTS.into_iter().filter_map(reason).collect()
}

/// Sets the contact stiffness from neighbouring loads where the method gives none.
pub fn set_stiffness(states: &mut [State]) {
    let points: Vec<(f64, f64)> = states.iter().filter_map(|s| Some((s.pressure, s.mean_gap?))).collect();
    let with_gap = states.iter_mut().filter(|s| s.mean_gap.is_some());
    for (state, k) in with_gap.zip(stiffness(&points)).filter(|(s, _)| s.stiffness.is_none()) {
        state.stiffness = k;
    }
}

/// The numbers of an estimate, in reduced units: those that the method gives, and those evaluated from its fields.
/// `gradient`: pressure over E* at p* = 1.
pub fn state_of(
    card: &MethodCard,
    problem: &ReducedProblem,
    (step, gradient, criterion): (&LoadStep, f64, &str),
    e: &MethodEstimate,
) -> State {
    let grid = problem.grid;
    let node_area = grid.dx() * grid.dy();
    // Zero at nodes in contact, positive elsewhere.
    let open: Option<Cow<[f64]>> = match (e.contact, e.gap) {
        (Some(map), _) => Some(map.iter().map(|&m| if m == 0 { 1.0 } else { 0.0 }).collect()),
        (None, Some(gap)) => Some(gap.into()),
        // Nodes under compression are in contact.
        (None, None) => e.stress.map(|stress| stress.iter().map(|s| if *s > 0.0 { 0.0 } else { 1.0 }).collect()),
    };
    let touching = open.as_ref().map(|open| Field::F64(open));
    let clusters = e.clusters.as_ref().map(|areas| ClusterAreas::new(areas.iter().copied())).or_else(|| {
        let sizes = cluster_sizes(e.contact?, grid.nx, Connectivity::Eight, problem.kernel.is_periodic());
        Some(ClusterAreas::new(sizes.into_iter().map(|nodes| nodes as f64 * node_area)))
    });
    let largest = |field: &[f64]| field.iter().copied().fold(0.0, f64::max);
    let gap = e
        .gap_distribution
        .clone()
        .or_else(|| e.gap.map(|gap| gap_distribution(Field::F64(gap), 0.0, gap_edges(largest(gap)))));
    let adhesive = problem.adhesion != AttractionLaw::None;
    let stress = e.stress_distribution.clone().or_else(|| {
        let stress = e.stress?;
        let edges = stress_edges(stress.iter().copied().fold(0.0, f64::min), largest(stress));
        Some(stress_distribution(touching?, Field::F64(stress), (0.0, adhesive), edges))
    });
    // Contact defined by a solved gap includes a rim of nodes too many and needs the perimeter correction. Contact
    // defined by overlap has no such bias.
    let edges = if card.criterion == Criterion::ZeroGap { ContactEdges::ELASTIC } else { ContactEdges::COUNTED };
    let edges = ContactEdges { periodic: problem.kernel.is_periodic(), ..edges };
    let counted = touching.filter(|_| e.contact.is_some()).map(|open| contact_area(grid, open, edges));
    let area = counted.filter(|_| edges.excess > 0.0).map_or(e.contact_area, |corrected| corrected.contact_area);
    let mut missing: Missing = e.undelivered.iter().map(|(q, reason)| (*q, reason.to_string())).collect();
    // From the mean gaps of neighbouring loads, unless the method has an own one or never gives any.
    if e.undelivered.iter().any(|(q, _)| *q == Quantity::MeanGap)
        && e.stiffness.is_none()
        && card.unsupported_reason(Quantity::Stiffness, adhesive).is_none()
    {
        missing.insert(Quantity::Stiffness, "no mean gap at this load".into());
    }
    let observed = Observed {
        gap_logarithmic: gap,
        cluster_density: clusters.as_ref().map_or(Vec::new(), |s| s.distribution(SIZES_PER_DECADE)),
        cluster_area: clusters.as_ref().map_or(Vec::new(), ClusterAreas::cumulative),
        median_cluster_area: clusters.as_ref().and_then(ClusterAreas::median),
        ..Observed::default()
    };
    State {
        index: step.index,
        branch: step.branch,
        p_star: step.p_star_at(e.pressure, gradient),
        pressure: e.pressure,
        non_periodic: !problem.kernel.is_periodic(),
        criterion: criterion.into(),
        contact_area: area,
        contact_nodes: counted.map(|area| area.contact_nodes),
        clusters: clusters.as_ref().map(ClusterAreas::count),
        mean_gap: e.mean_gap,
        stiffness: e.stiffness,
        load_error: e.load_error,
        observed: Some(observed.with_stress(stress)),
        missing,
        stop: e.stop,
        iterations: e.iterations,
        fft_pairs: e.fft_pairs,
        seconds: e.seconds,
        ..State::default()
    }
}

use super::number::work;
use crate::record::given_loads::GivenLoads;
use asperity_contact::results::ContinuumResults;
use asperity_contact::state::Hysteresis;

/// One sentence on the hysteresis of a load path; `None` for a body without history and without an unloading branch.
pub fn hysteresis_sentence(c: &ContinuumResults, loads: GivenLoads) -> Option<String> {
    c.states.iter().find_map(|s| s.hysteresis)?;
    let dissipated = match c.dissipation {
        None => String::new(),
        // Trapezoids between loads that are far apart.
        Some(w) if w <= 0.0 => " The loads are too far apart to tell what the path dissipates.".into(),
        Some(w) => format!(" The path dissipates {}.", work(w)),
    };
    let changes: Vec<String> = c
        .states
        .iter()
        .filter_map(|s| s.hysteresis.filter(Hysteresis::is_significant).map(|h| (s.p_star, h.area)))
        .map(|(p, area)| format!("{:+.1} % at {}", 100.0 * area, loads.label(p)))
        .collect();
    Some(match changes.as_slice() {
        [] => "Unloading retraces loading: the contact at each load is the same to 0.1 %.".into(),
        list => format!("Hysteresis: on unloading the contact differs by {}.{dissipated}", list.join(", ")),
    })
}

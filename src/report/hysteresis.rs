use super::number::trimmed;
use crate::record::results::{ContinuumResults, Hysteresis};

/// What the way back was, in a sentence; none where there was none. `work` says energies per area, units of E* L.
pub fn hysteresis_sentence(c: &ContinuumResults, work: impl Fn(f64) -> String) -> Option<String> {
    let loop_takes = work(c.hysteresis_work?);
    let hanging: Vec<String> = c
        .states
        .iter()
        .filter_map(|s| s.hysteresis.filter(Hysteresis::is_significant).map(|h| (s.numbers.p_star, h.area)))
        .map(|(p, area)| format!("{:+.1} % at p* = {}", 100.0 * area, trimmed(p, 4)))
        .collect();
    Some(match hanging.as_slice() {
        [] => "On the way back every load has the contact that it had on the way there, to 0.1 %.".into(),
        list => format!(
            "The way back hangs on another branch: contact changes by {}. The loop takes {loop_takes}.",
            list.join(", ")
        ),
    })
}

//! How the atoms were relaxed, in one sentence.

use crate::report::number::{count, significant};
use asperity_atoms::results::{LoadStepResults, StepMinimizer};

/// Minimisers of the load steps, rejected steps of the harmonic relaxation, and the decrease of energy that it still predicts.
pub fn relaxation_sentence(steps: &[LoadStepResults]) -> String {
    let number = |m: StepMinimizer| steps.iter().filter(|s| s.minimizer == m).count();
    let used = StepMinimizer::ALL.into_iter().filter(|m| number(*m) > 0);
    let of_steps = |n: usize| format!("{} step{}", count(n), if n == 1 { "" } else { "s" });
    let list: Vec<String> = used.map(|m| format!("{} ({})", m.word(), of_steps(number(m)))).collect();
    let rejected: usize = steps.iter().map(|s| s.rejected).sum();
    let decrease = steps.iter().filter_map(|s| s.predicted_decrease_ev).reduce(f64::max);
    let mut text = format!("Minimiser: {}", list.join(", "));
    if rejected > 0 {
        text += &format!("; the harmonic relaxation rejected {}", of_steps(rejected));
    }
    if let Some(decrease) = decrease {
        text +=
            &format!("; by the harmonic crystal the energy would fall by up to {} eV more", significant(decrease, 2));
    }
    text + "."
}

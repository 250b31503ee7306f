use super::{PRESSURE, median, solve};
use asperity::cli::output::{print, table};
use asperity::contact::method::ContactMethod;
use asperity::methods;
use asperity::methods::{REGISTRY, all_atom};
use asperity::report::number::{memory, significant};
use asperity::scene::ALL_METHODS;
use asperity::{Error, Result};
use serde::Deserialize;

/// Time, planned and measured memory of methods on the challenge's surface without adhesion, and how the time grows
/// with the number of points. Each solve runs on one thread.
#[derive(clap::Args)]
pub(super) struct Methods {
    /// Ids from `asperity methods`, or all.
    #[arg(value_name = "ID", required = true)]
    methods: Vec<String>,
    /// Points per side.
    #[arg(long, value_name = "N,N,...", value_delimiter = ',', default_values_t = [512, 1024, 2048])]
    sizes: Vec<usize>,
    /// Shortest wave of the surface over the cell.
    #[arg(long, value_name = "LAMBDA", default_value = "0.001")]
    cut_off: String,
    /// Rounds, of which medians are taken.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u16).range(1..))]
    repeats: u16,
}

/// Output of `solve --json` of solvers and estimators.
#[derive(Deserialize)]
struct Solved {
    contact_area: f64,
    cpu_seconds: f64,
    planned_bytes: u64,
    measured_bytes: u64,
}

/// Medians on one grid.
struct Run {
    size: usize,
    solved: Solved,
}

impl Methods {
    pub(super) fn execute(self) -> Result<()> {
        let (mut rows, mut powers) = (Vec::new(), Vec::new());
        for method in self.methods()? {
            let runs = self.measure(method)?;
            rows.extend(runs.iter().map(|r| row(method, r)));
            let points = |r: &Run| ((r.size * r.size) as f64, r.solved.cpu_seconds);
            if let Some(power) = exponent(&runs.iter().map(points).collect::<Vec<_>>()) {
                let power = significant(power, 3);
                powers.push(format!("{method}: CPU time grows as the number of points to the power {power}"));
            }
        }
        print(&format!(
            "one load, p = {PRESSURE} E*, of the challenge's surface with waves down to {} L, on one thread; memory beyond the heights",
            self.cut_off
        ));
        let head = [
            "method",
            "points",
            "contact",
            "CPU / s",
            "CPU / s per point",
            "planned",
            "measured",
            "planned / measured",
        ];
        print(&table(&head, rows));
        powers.iter().for_each(|line| print(line));
        Ok(())
    }

    fn methods(&self) -> Result<Vec<&'static str>> {
        if let Some(id) = self.methods.iter().find(|id| *id != ALL_METHODS && methods::find(id).is_none()) {
            let accepted = format!("{ALL_METHODS}, {}", methods::ids().join(", "));
            return Err(Error::input("command line", "methods", id, accepted));
        }
        let all = self.methods.iter().any(|id| id == ALL_METHODS);
        let named = |m: &&dyn ContactMethod| self.methods.iter().any(|id| id == m.card().id);
        let wanted = |m: &&&dyn ContactMethod| all && m.card().id != all_atom::ID || named(m);
        Ok(REGISTRY.iter().filter(wanted).map(|m| m.card().id).collect())
    }

    /// One entry per grid on which the method succeeds.
    fn measure(&self, method: &str) -> Result<Vec<Run>> {
        let mut runs = Vec::new();
        for &size in &self.sizes {
            let mut solved: Vec<Solved> = Vec::new();
            for round in 1..=self.repeats {
                eprintln!("{method} on {size}²: round {round} of {}", self.repeats);
                solved.extend(solve(size, &["--method", method, "--cut-off", &self.cut_off], 1)?);
            }
            let Some(first) = solved.first() else { continue };
            let cpu_seconds = median(solved.iter().map(|s| s.cpu_seconds));
            let measured_bytes = solved.iter().map(|s| s.measured_bytes).max().unwrap_or(0);
            runs.push(Run { size, solved: Solved { cpu_seconds, measured_bytes, ..*first } });
        }
        Ok(runs)
    }
}

fn row(method: &str, r: &Run) -> Vec<String> {
    let s = &r.solved;
    vec![
        method.into(),
        format!("{}²", r.size),
        significant(s.contact_area, 3),
        significant(s.cpu_seconds, 2),
        format!("{:.1e}", s.cpu_seconds / (r.size * r.size) as f64),
        memory(s.planned_bytes),
        memory(s.measured_bytes),
        significant(s.planned_bytes as f64 / s.measured_bytes.max(1) as f64, 2),
    ]
}

/// Slope of a line through the logarithms, by least squares; `None` with fewer than two points.
fn exponent(points: &[(f64, f64)]) -> Option<f64> {
    let logs: Vec<(f64, f64)> = points.iter().filter(|p| p.1 > 0.0).map(|p| (p.0.ln(), p.1.ln())).collect();
    let n = logs.len() as f64;
    let (x, y) = (logs.iter().map(|p| p.0).sum::<f64>() / n, logs.iter().map(|p| p.1).sum::<f64>() / n);
    let spread: f64 = logs.iter().map(|p| (p.0 - x).powi(2)).sum();
    let rise: f64 = logs.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    (logs.len() > 1 && spread > 0.0).then(|| rise / spread)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponents_of_powers_are_found() {
        const ROUNDING: f64 = 1e-12; // a few logarithms in f64
        let points: Vec<(f64, f64)> = [1e4, 1e5, 1e6].iter().map(|n: &f64| (*n, 3e-7 * n.powf(1.25))).collect();
        assert!((exponent(&points).expect("three points") - 1.25).abs() < ROUNDING);
        assert_eq!(exponent(&points[..1]), None);
        assert_eq!(exponent(&[(1e4, 1.0), (1e4, 2.0)]), None);
    }

    #[test]
    fn methods_are_measured_in_the_order_of_the_registry() {
        let methods = |list: &[&str]| Methods {
            methods: list.iter().map(|id| id.to_string()).collect(),
            sizes: vec![64, 128],
            cut_off: "0.04".into(),
            repeats: 1,
        };
        let some = methods(&["winkler", "bvm"]);
        assert_eq!(some.methods().expect("known"), ["bvm", "winkler"]);
        assert_eq!(methods(&["all"]).methods().expect("known").len(), REGISTRY.len() - 1);
        let runs = some.measure("bvm").expect("measured");
        assert_eq!(runs.iter().map(|r| r.size).collect::<Vec<_>>(), [64, 128]);
        assert!(runs.iter().all(|r| r.solved.cpu_seconds >= 0.0 && row("bvm", r).len() == 8));
    }
}

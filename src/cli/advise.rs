use super::{tradeoff, words};
use crate::compare::advice::{Advice, Limit, Target, candidates, choose};
use crate::interface::Adhesion;
use crate::pipeline::shortest_wave;
use crate::record::tradeoff::{FILE, Measure, Tradeoff};
use crate::report::number::{duration, significant};
use crate::scene::{Case, Surface};
use crate::{Error, Result};
use std::path::PathBuf;

const PLACE: &str = "command line";

#[derive(Debug, clap::Args)]
pub struct Advise {
    /// Scene file (TOML) that is to be run.
    scene: PathBuf,
    /// What is to be accurate: contact_area, mean_gap, stiffness, gap_map, contact_map, gap_pdf, stress_pdf, patch_area or
    /// typical_patch.
    #[arg(long, value_name = "WHAT")]
    quantity: String,
    /// Error that is good enough, as 5% or 0.05; the cheapest setting within it is told.
    #[arg(long, value_name = "SHARE", required_unless_present = "budget", conflicts_with = "budget")]
    error: Option<String>,
    /// Wall time that there is, as 30s, 10m or 2h; the most accurate setting within it is told.
    #[arg(long, value_name = "TIME")]
    budget: Option<String>,
    /// Tables of `asperity tradeoff`, apart by commas. Default: that of the scene's own runs/NAME-tradeoff.
    #[arg(long, value_name = "FILES", value_delimiter = ',', num_args = 1)]
    table: Vec<PathBuf>,
    /// Advise beyond what was measured, too, and say what of it is.
    #[arg(long)]
    extrapolate: bool,
    /// One line of JSON on stdout.
    #[arg(long)]
    json: bool,
}

impl Advise {
    pub fn execute(self) -> Result<()> {
        let measure = Measure::ALL.into_iter().find(|m| m.id() == self.quantity).ok_or_else(|| {
            let accepted = Measure::ALL.map(Measure::id).join(", ");
            Error::input(PLACE, "--quantity", &self.quantity, accepted)
        })?;
        let (limit, flag, asked) = match (&self.error, &self.budget) {
            (Some(text), _) => (Limit::Error(share(text)?), "--error", text),
            (None, Some(text)) => (Limit::Seconds(tradeoff::seconds("--budget", text)?), "--budget", text),
            (None, None) => return Err(Error::input(PLACE, "--error", "not given", "an error, or --budget")),
        };
        let case = Case::read(&self.scene)?;
        let files = match self.table.is_empty() {
            true => vec![PathBuf::from("runs").join(format!("{}-tradeoff", case.scene.name)).join(FILE)],
            false => self.table.clone(),
        };
        if let Some(file) = files.iter().find(|f| !f.exists()) {
            let accepted = format!("a table that `asperity tradeoff {}` wrote", self.scene.display());
            return Err(Error::input(PLACE, "--table", format!("{} (no such file)", file.display()), accepted));
        }
        let tables = files.iter().map(|f| Tradeoff::read(f)).collect::<Result<Vec<_>>>()?;
        let all = candidates(&tables, &target(&case), measure);
        let (known, beyond): (Vec<Advice>, Vec<Advice>) =
            all.into_iter().partition(|a| self.extrapolate || a.extrapolated.is_empty());
        let Some(advice) = choose(&known, measure, limit) else {
            return Err(Error::input(PLACE, flag, asked, accepted(&known, &beyond, measure, limit)));
        };
        // A height map has its own grid.
        let grid = match case.surface {
            Surface::Imported { .. } => String::new(),
            _ => format!(" --grid {}", advice.grid),
        };
        let command = format!(
            "asperity run {}{grid} --method {} --precision {} --tolerance {:e}",
            self.scene.display(),
            advice.method,
            advice.precision,
            advice.tolerance
        );
        if self.json {
            let mut told =
                serde_json::to_value(advice).map_err(|e| Error::format("advice", e, "values that JSON can hold"))?;
            told["quantity"] = measure.id().into();
            told["command"] = command.into();
            return words::json_line(&told);
        }
        say(advice, measure);
        words::say(&command);
        Ok(())
    }
}

/// A share as people write it.
fn share(text: &str) -> Result<f64> {
    let (number, unit) = text.trim().strip_suffix('%').map_or((text.trim(), 1.0), |n| (n, 0.01));
    let found = number.trim().parse::<f64>().ok().map(|n| unit * n).filter(|e| e.is_finite() && *e > 0.0);
    found.ok_or_else(|| Error::input(PLACE, "--error", text, "a share above zero, as 5% or 0.05"))
}

fn target(case: &Case) -> Target {
    Target {
        shortest_wave: shortest_wave(&case.surface),
        own_grid: matches!(case.surface, Surface::Imported { .. }).then_some(case.grid.nx),
        aspect: case.grid.ny as f64 / case.grid.nx as f64,
        adhesive: case.adhesion != Adhesion::None,
        kernel: case.kernel.to_string(),
        p_star: case.p_star[..case.loads_there().min(case.p_star.len())].to_vec(),
    }
}

/// What the tables would serve instead.
fn accepted(known: &[Advice], beyond: &[Advice], measure: Measure, limit: Limit) -> String {
    if let Some(a) = choose(beyond, measure, limit) {
        return format!(
            "what was measured; --extrapolate would take {} on {} points a side ({})",
            a.method,
            a.grid,
            a.extrapolated.join("; ")
        );
    }
    let best = choose(known, measure, Limit::Seconds(f64::INFINITY));
    match (limit, best) {
        (_, None) => {
            format!("a table with the {} of such a scene; what is given has none, or beyond it alone", measure.name())
        }
        (Limit::Error(_), Some(a)) => {
            format!("at least {}, the least that the tables have", tradeoff::shown(measure, a.expected_error))
        }
        (Limit::Seconds(_), Some(_)) => {
            let least = known.iter().map(|a| a.expected_seconds).fold(f64::INFINITY, f64::min);
            format!("at least {}, the least that the tables have", duration(least))
        }
    }
}

fn say(a: &Advice, measure: Measure) {
    words::say(&format!("{} on {} points a side, {} to {:e}", a.method, a.grid, a.precision, a.tolerance));
    let range = a.error_range.map(|e| tradeoff::shown(measure, e));
    let uncertain = a.reference_uncertainty.map_or("not known".into(), |u| tradeoff::shown(measure, u));
    words::say(&format!(
        "{}: expected to err by {} ({} to {} over the loads; the reference is uncertain by {uncertain})",
        measure.name(),
        tradeoff::shown(measure, a.expected_error),
        range[0],
        range[1]
    ));
    let spread = match a.seconds_range {
        Some([from, to]) if from < to => format!(" ({} to {})", duration(from), duration(to)),
        Some(_) => " (as measured)".into(),
        None => " (uncertain: two grids or fewer)".into(),
    };
    let exponent =
        a.exponent.map_or(String::new(), |e| format!(", cost growing as points to the {}", significant(e, 2)));
    words::say(&format!(
        "time: {}{spread} on {} threads of the machine of the table{exponent}",
        duration(a.expected_seconds),
        a.threads
    ));
    a.extrapolated.iter().for_each(|why| words::say(&format!("beyond what was measured: {why}")));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_have_a_percent_or_none() {
        for (text, expected) in [("5%", 0.05), ("0.05", 0.05), (" 20 % ", 0.2)] {
            assert!(share(text).is_ok_and(|s| (s - expected).abs() < 1e-12), "{text}");
        }
        for text in ["", "%", "-1%", "0", "five", "NaN"] {
            assert_eq!(share(text).err().map(|e| e.exit_code()), Some(2), "{text}");
        }
    }
}

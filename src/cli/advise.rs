use super::{output, progress::TerminalProgress, tradeoff};
use crate::compare::advice::{Limit, Table};
use crate::pipeline::{self, Unserved, Verification};
use crate::record::advice::Advice;
use crate::record::quantity::Quantity;
use crate::record::tradeoff::FILE;
use crate::report::number::{duration, error_of, percent, significant};
use crate::scene::{Case, Scene, Surface};
use crate::{Error, Result};
use std::path::PathBuf;
use std::process::ExitCode;

const PLACE: &str = "command line";

#[derive(Debug, clap::Args)]
pub struct Advise {
    /// Scene file (TOML).
    scene: PathBuf,
    /// Quantity: contact_area, mean_gap, stiffness, gap_map, contact_map, gap_pdf, stress_pdf, patch_area or
    /// median_cluster_area. With --verify several, comma-separated.
    #[arg(long, value_name = "QUANTITY", value_delimiter = ',', num_args = 1, required = true)]
    quantity: Vec<String>,
    /// Largest relative error, as 5% or 0.05, for the cheapest setting. With --verify several, comma-separated.
    #[arg(
        long,
        value_name = "ERROR",
        value_delimiter = ',',
        num_args = 1,
        required_unless_present = "budget",
        conflicts_with = "budget"
    )]
    error: Vec<String>,
    /// Wall time instead, as 30s, 10m or 2h, for the most accurate setting.
    #[arg(long, value_name = "TIME")]
    budget: Option<String>,
    /// Tables of `asperity tradeoff` or `asperity merge-tables`, comma-separated. Default: that of the scene's own
    /// runs/NAME-tradeoff, or, where there is none, those that come with the program.
    #[arg(long, value_name = "FILES", value_delimiter = ',', num_args = 1)]
    table: Vec<PathBuf>,
    /// Extrapolate beyond the measured settings, and report where.
    #[arg(long, conflicts_with = "verify")]
    extrapolate: bool,
    /// Run what is advised for every error of every quantity and hold it against a reference. Exit code 1 if fewer than nine
    /// in ten settings meet their target.
    #[arg(long, conflicts_with = "budget")]
    verify: bool,
    /// With --verify: seeds of the surfaces, comma-separated. Default: the scene's own.
    #[arg(long, value_name = "LIST", value_delimiter = ',', num_args = 1, requires = "verify")]
    seeds: Vec<u64>,
    /// With --verify: folder of the runs. Default: runs/NAME-proof.
    #[arg(long, value_name = "DIR", requires = "verify")]
    out: Option<PathBuf>,
    /// One line of JSON on stdout.
    #[arg(long)]
    json: bool,
}

/// Fraction of settings that must meet their target.
const KEPT: f64 = 0.9;

impl Advise {
    pub fn execute(self) -> Result<ExitCode> {
        let quantities = self.quantity.iter().map(|q| quantity(q)).collect::<Result<Vec<_>>>()?;
        let errors = self.error.iter().map(|e| relative_error(e)).collect::<Result<Vec<_>>>()?;
        if self.verify {
            return self.verify_advice(&quantities, &errors);
        }
        let ([quantity], [_] | []) = (&quantities[..], &errors[..]) else {
            let accepted = "one quantity and one error, or --verify";
            return Err(Error::input(
                PLACE,
                "--quantity",
                format!("{} of them", quantities.len().max(errors.len())),
                accepted,
            ));
        };
        let (limit, flag, asked) = match (errors.first(), &self.budget) {
            (Some(error), _) => (Limit::Error(*error), "--error", &self.error[0]),
            (None, Some(text)) => (Limit::Seconds(tradeoff::seconds("--budget", text)?), "--budget", text),
            (None, None) => return Err(Error::input(PLACE, "--error", "not given", "an error, or --budget")),
        };
        let case = Case::read(&self.scene)?;
        let (tables, provenance) = self.tables(&case)?;
        let advice = pipeline::advise(&tables, &case, *quantity, limit, self.extrapolate)
            .map_err(|Unserved(accepted)| Error::input(PLACE, flag, asked, accepted))?;
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
            let mut line =
                serde_json::to_value(&advice).map_err(|e| Error::format("advice", e, "values that JSON can hold"))?;
            line["quantity"] = quantity.id().into();
            line["tables"] = provenance.into();
            line["command"] = command.into();
            output::json_line(&line)?;
        } else {
            print_advice(&advice, *quantity, &provenance);
            output::print(&command);
        }
        Ok(ExitCode::SUCCESS)
    }

    fn verify_advice(&self, quantities: &[Quantity], errors: &[f64]) -> Result<ExitCode> {
        let scene = Scene::read(&self.scene)?;
        let seeds = if self.seeds.is_empty() { vec![scene.surface.seed] } else { self.seeds.clone() };
        let root = self.out.clone().unwrap_or_else(|| PathBuf::from("runs").join(format!("{}-proof", scene.name)));
        std::fs::create_dir_all(&root).map_err(Error::io("create", &root))?;
        let mut trials: Vec<Verification> = Vec::new();
        for seed in seeds {
            let mut scene = scene.clone();
            scene.surface.seed = seed;
            let case = Case::resolve(scene, &self.scene)?;
            let progress = TerminalProgress::new();
            let out = root.join(format!("seed-{seed}"));
            trials.extend(pipeline::verify(&case, &self.tables(&case)?.0, (quantities, errors), &out, &progress)?);
        }
        let known: Vec<bool> = trials.iter().filter_map(Verification::met).collect();
        let kept = known.iter().filter(|met| **met).count();
        if self.json {
            output::json_line(
                &serde_json::json!({ "kept": kept, "advised": known.len(), "asked": trials.len(), "trials": trials }),
            )?;
        } else {
            print_trials(&trials);
            output::print(&format!(
                "{kept} of {} advised settings meet their target; {} were refused",
                known.len(),
                trials.len() - known.len()
            ));
        }
        let enough = !known.is_empty() && kept as f64 >= KEPT * known.len() as f64;
        Ok(if enough { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }

    /// Those given, else those measured on this scene here, else those of the program.
    fn tables(&self, case: &Case) -> Result<(Vec<Table>, String)> {
        if let Some(file) = self.table.iter().find(|f| !f.exists()) {
            let accepted = format!("a table that `asperity tradeoff {}` wrote", self.scene.display());
            return Err(Error::input(PLACE, "--table", format!("{} (no such file)", file.display()), accepted));
        }
        let own = PathBuf::from("runs").join(format!("{}-tradeoff", case.scene.name)).join(FILE);
        let files = if self.table.is_empty() && own.exists() { vec![own] } else { self.table.clone() };
        pipeline::read_tables(&files)
    }
}

/// A relative error as 5% or 0.05.
fn relative_error(text: &str) -> Result<f64> {
    let (number, unit) = text.trim().strip_suffix('%').map_or((text.trim(), 1.0), |n| (n, 0.01));
    let found = number.trim().parse::<f64>().ok().map(|n| unit * n).filter(|e| e.is_finite() && *e > 0.0);
    found.ok_or_else(|| Error::input(PLACE, "--error", text, "a relative error above zero, as 5% or 0.05"))
}

/// A quantity by its id.
fn quantity(id: &str) -> Result<Quantity> {
    Quantity::COMPARED.into_iter().find(|m| m.id() == id).ok_or_else(|| {
        let accepted = Quantity::COMPARED.map(Quantity::id).join(", ");
        Error::input(PLACE, "--quantity", id, accepted)
    })
}

fn print_trials(trials: &[Verification]) {
    let head = ["surface", "quantity", "target", "advised", "expected", "found", "reference ±", "met"];
    let row = |t: &Verification| {
        let error = |e: Option<f64>| e.map_or("-".into(), |e| error_of(t.quantity, e));
        let setting = |a: &Advice| format!("{} {}, {} to {:e}", a.method, a.grid, a.precision, a.tolerance);
        vec![
            t.surface.clone(),
            t.quantity.name().into(),
            percent(t.asked),
            t.advice.as_ref().map_or_else(|| t.unavailable_reason.clone().unwrap_or_default(), setting),
            error(t.advice.as_ref().map(|a| a.expected_error)),
            error(t.found),
            error(t.uncertainty),
            t.met().map_or("-".into(), |met| if met { "yes".into() } else { "no".to_string() }),
        ]
    };
    output::print(&output::table(&head, trials.iter().map(row)));
}

fn print_advice(a: &Advice, quantity: Quantity, provenance: &str) {
    output::print(&format!("{} on {} × {} points, {} to {:e}", a.method, a.grid, a.grid, a.precision, a.tolerance));
    let range = a.error_range.map(|e| error_of(quantity, e));
    let surfaces = if a.surfaces == 1 { "one surface".into() } else { format!("{} surfaces", a.surfaces) };
    output::print(&format!(
        "{}: expected error {} ({} to {} at single loads), as measured on {surfaces}",
        quantity.name(),
        error_of(quantity, a.expected_error),
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
    output::print(&format!(
        "time: {}{spread} on {} threads of the machine of the table{exponent}",
        duration(a.expected_seconds),
        a.threads
    ));
    output::print(&format!("tables: {provenance}"));
    a.extrapolated.iter().for_each(|why| output::print(&format!("beyond what was measured: {why}")));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn relative_errors_are_fractions_or_percentages() {
        for (text, expected) in [("5%", 0.05), ("0.05", 0.05), (" 20 % ", 0.2)] {
            assert!(relative_error(text).is_ok_and(|s| (s - expected).abs() < 1e-12), "{text}");
        }
        for text in ["", "%", "-1%", "0", "five", "NaN"] {
            assert_eq!(relative_error(text).err().map(|e| e.exit_code()), Some(2), "{text}");
        }
    }
}

use super::{output, tradeoff};
use crate::compare::advice::{Limit, Table};
use crate::pipeline::{self, Unserved};
use crate::record::advice::Advice;
use crate::record::tradeoff::FILE;
use crate::report::number::{duration, error_of, significant};
use crate::scene::{Case, Scene, Surface};
use crate::{Error, Result};
use asperity_contact::quantity::Quantity;
use asperity_grid::units::fraction;
use std::path::PathBuf;
use std::process::ExitCode;

const PLACE: &str = "command line";

#[derive(Debug, clap::Args)]
pub(super) struct Advise {
    /// Scene file (TOML).
    scene: PathBuf,
    /// Quantity: contact_area, mean_gap, stiffness, gap_map, contact_map, gap_pdf, stress_pdf, patch_area or
    /// median_cluster_area.
    #[arg(long)]
    quantity: String,
    /// Largest relative error, as 5% or 0.05, for the cheapest setting.
    #[arg(long, required_unless_present = "budget", conflicts_with = "budget")]
    error: Option<String>,
    /// Largest wall time, as 30s, 10min or 2h, for the most accurate setting.
    #[arg(long, value_name = "TIME")]
    budget: Option<String>,
    /// Tables of `asperity tradeoff`, comma-separated. Default: that in runs/NAME-tradeoff of the scene, otherwise those of the program.
    #[arg(long, value_name = "FILES", value_delimiter = ',', num_args = 1)]
    table: Vec<PathBuf>,
    /// Extrapolate beyond the measured settings, and report where.
    #[arg(long)]
    extrapolate: bool,
    /// One line of JSON on stdout.
    #[arg(long)]
    json: bool,
}

impl Advise {
    pub(super) fn execute(self) -> Result<ExitCode> {
        let quantity = quantity(&self.quantity)?;
        let (limit, flag, value) = match (&self.error, &self.budget) {
            (Some(text), _) => (Limit::Error(relative_error(text)?), "--error", text),
            (None, Some(text)) => (Limit::Seconds(tradeoff::seconds("--budget", text)?), "--budget", text),
            (None, None) => return Err(Error::input(PLACE, "--error", "not given", "an error, or --budget")),
        };
        let mut scene = Scene::read(&self.scene)?;
        if scene.leaves_constants_out() {
            // Advice is of the continuum: nothing is measured for it.
            scene.atoms = None;
        }
        let case = Case::resolve(scene, &self.scene)?;
        let (tables, provenance) = self.tables(&case)?;
        let advice = pipeline::advise(&tables, &case, quantity, limit, self.extrapolate)
            .map_err(|Unserved(accepted)| Error::input(PLACE, flag, value, accepted))?;
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
            print_advice(&advice, quantity, &provenance);
            output::print(&command);
        }
        Ok(ExitCode::SUCCESS)
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
    let found = fraction(text).filter(|e| e.is_finite() && *e > 0.0);
    found.ok_or_else(|| Error::input(PLACE, "--error", text, "a relative error above zero, as 5% or 0.05"))
}

/// A quantity by its id.
fn quantity(id: &str) -> Result<Quantity> {
    Quantity::COMPARED.into_iter().find(|m| m.id() == id).ok_or_else(|| {
        let accepted = Quantity::COMPARED.map(Quantity::id).join(", ");
        Error::input(PLACE, "--quantity", id, accepted)
    })
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
    let exponent = a.exponent.map_or(String::new(), |e| format!(", cost ∝ points^{}", significant(e, 2)));
    output::print(&format!(
        "time: {}{spread} on {} threads of the machine of the table{exponent}",
        duration(a.expected_seconds),
        a.threads
    ));
    output::print(&format!("tables: {provenance}"));
    a.extrapolated.iter().for_each(|why| output::print(&format!("extrapolated: {why}")));
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

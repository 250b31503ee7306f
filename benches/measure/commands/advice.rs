use asperity::cli::output::{print, table};
use asperity::cli::progress::TerminalProgress;
use asperity::compare::advice::{Limit, Table};
use asperity::contact::method::{self, Precision};
use asperity::contact::quantity::Quantity;
use asperity::methods;
use asperity::pipeline::{self, ExactSetting, Listener, TradeoffRequest, Unserved};
use asperity::record::advice::Advice;
use asperity::report::number::{error_of, percent};
use asperity::scene::{Case, Scene, Surface};
use asperity::{Error, Result};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Nodes per shortest wavelength of the reference: twice those of the finest settings in the shipped tables.
const REFERENCE_POINTS: f64 = 32.0;

/// Fraction of settings that must meet their target.
const ENOUGH: f64 = 0.9;

/// Run the advised settings on surfaces that are not in the tables, and compare them with a reference.
///
/// Exit code 1 if fewer than nine in ten settings meet the requested error.
#[derive(clap::Args)]
pub(super) struct VerifyAdvice {
    /// Scene file (TOML).
    scene: PathBuf,
    /// Quantities, as contact_area.
    #[arg(long, value_name = "QUANTITY,...", value_delimiter = ',', required = true, value_parser = quantity)]
    quantity: Vec<Quantity>,
    /// Relative errors, as 0.05.
    #[arg(long, value_name = "ERROR,...", value_delimiter = ',', required = true)]
    error: Vec<f64>,
    /// Tables of `asperity tradeoff`. Default: those of the program.
    #[arg(long, value_name = "FILE,...", value_delimiter = ',')]
    table: Vec<PathBuf>,
    /// Seeds of the surfaces. Default: the scene's own.
    #[arg(long, value_name = "N,...", value_delimiter = ',')]
    seeds: Vec<u64>,
    /// Folder of the runs. Default: runs/NAME-verified.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

fn quantity(id: &str) -> std::result::Result<Quantity, String> {
    let accepted = || format!("accepted: {}", Quantity::COMPARED.map(Quantity::id).join(", "));
    Quantity::COMPARED.into_iter().find(|q| q.id() == id).ok_or_else(accepted)
}

/// A requested error, and the error of the advised setting.
struct Verification {
    surface: String,
    quantity: Quantity,
    requested: f64,
    /// The reason if the tables do not support the request.
    advice: std::result::Result<Advice, String>,
    /// Root mean square error over the loads; `uncertainty` is that of the reference. `None` if the setting does not
    /// give the quantity.
    measured: Option<f64>,
    uncertainty: Option<f64>,
}

impl Verification {
    /// Whether the error of the advised setting is at most the requested error. `None` without an advised setting.
    fn met(&self) -> Option<bool> {
        let limit = self.quantity.error_of_deviation(self.requested);
        self.advice.as_ref().ok().map(|_| self.measured.is_some_and(|e| e <= limit))
    }

    fn row(&self) -> Vec<String> {
        let error = |e: Option<f64>| e.map_or("-".into(), |e| error_of(self.quantity, e));
        let setting = |a: &Advice| format!("{} {}, {} to {:e}", a.method, a.grid, a.precision, a.tolerance);
        vec![
            self.surface.clone(),
            self.quantity.name().into(),
            percent(self.requested),
            self.advice.as_ref().map_or_else(String::clone, setting),
            error(self.advice.as_ref().ok().map(|a| a.expected_error)),
            error(self.measured),
            error(self.uncertainty),
            self.met().map_or("-", |met| if met { "yes" } else { "no" }).into(),
        ]
    }
}

impl VerifyAdvice {
    pub(super) fn execute(self) -> Result<ExitCode> {
        let verified = self.verify(&TerminalProgress::new())?;
        let head = ["surface", "quantity", "target", "advised", "expected", "measured", "reference ±", "met"];
        print(&table(&head, verified.iter().map(Verification::row)));
        let known: Vec<bool> = verified.iter().filter_map(Verification::met).collect();
        let met = known.iter().filter(|met| **met).count();
        let refused = verified.len() - known.len();
        print(&format!("{met} of {} advised settings meet their target; {refused} were refused", known.len()));
        let enough = !known.is_empty() && met as f64 >= ENOUGH * known.len() as f64;
        Ok(if enough { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }

    fn verify(&self, listener: &dyn Listener) -> Result<Vec<Verification>> {
        let scene = Scene::read(&self.scene)?;
        let seeds = if self.seeds.is_empty() { vec![scene.surface.seed] } else { self.seeds.clone() };
        let root = self.out.clone().unwrap_or_else(|| PathBuf::from("runs").join(format!("{}-verified", scene.name)));
        std::fs::create_dir_all(&root).map_err(Error::io("create", &root))?;
        let (tables, _) = pipeline::read_tables(&self.table)?;
        let mut verified = Vec::new();
        for seed in seeds {
            let mut scene = scene.clone();
            scene.surface.seed = seed;
            let case = Case::resolve(scene, &self.scene)?;
            verified.extend(self.of_case(&case, &tables, &root.join(format!("seed-{seed}")), listener)?);
        }
        Ok(verified)
    }

    /// Requests every error for every quantity, runs the advised settings in a folder, and compares them with a
    /// reference.
    fn of_case(&self, case: &Case, tables: &[Table], out: &Path, listener: &dyn Listener) -> Result<Vec<Verification>> {
        let mut verified = Vec::new();
        for &quantity in &self.quantity {
            verified.extend(self.error.iter().map(|&requested| {
                Verification {
                    surface: case.surface.origin(),
                    quantity,
                    requested,
                    advice: pipeline::advise(tables, case, quantity, Limit::Error(requested), false)
                        .map_err(|Unserved(reason)| reason),
                    measured: None,
                    uncertainty: None,
                }
            }));
        }
        let mut exact: Vec<ExactSetting> = Vec::new();
        for setting in verified.iter().filter_map(|v| v.advice.as_ref().ok()).map(exact_of) {
            if !exact.contains(&setting) {
                exact.push(setting);
            }
        }
        let Some(finest) = exact.iter().map(|e| e.n).max() else { return Ok(verified) };
        let waves = (REFERENCE_POINTS / pipeline::shortest_wavelength(&case.surface)).ceil() as usize;
        let reference = match case.surface {
            Surface::Imported { .. } => case.grid.nx,
            _ => waves.max(2 * finest).next_power_of_two(),
        };
        let is_advised = |m: &&dyn method::ContactMethod| exact.iter().any(|e| e.method == m.card().id);
        let request = TradeoffRequest {
            methods: methods::REGISTRY.iter().copied().filter(is_advised).collect(),
            grids: None,
            reference: Some(reference),
            budget_seconds: None,
            repeats: Some(1),
            exact: Some(exact),
            layer_thicknesses: Vec::new(),
            blocks: None,
        };
        let (results, _) = pipeline::tradeoff(case, &request, out, listener)?;
        for v in &mut verified {
            let Some(setting) = v.advice.as_ref().ok().map(exact_of) else { continue };
            let Some(point) = results.points.iter().find(|p| setting.is_of(p)) else { continue };
            let reference = results.reference(point.setting.adhesive);
            v.measured = point.errors.get(&v.quantity).copied();
            v.uncertainty = reference.and_then(|r| r.uncertainty.get(&v.quantity).copied());
        }
        Ok(verified)
    }
}

fn exact_of(advice: &Advice) -> ExactSetting {
    let precision = if advice.precision == "f32" { Precision::F32 } else { Precision::F64 };
    ExactSetting { method: advice.method.clone(), n: advice.grid, precision, tolerance: advice.tolerance }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// On a surface that is not in the tables the advised setting is run and compared with a reference.
    #[test]
    fn advice_is_verified_on_another_surface() {
        let folder = tempfile::tempdir().expect("scratch");
        let scene = folder.path().join("unseen.toml");
        let text = "name = \"unseen\"\n[surface]\ncut_off = \"4.0 um\"\nseed = 3\n[load]\np_star = [0.005, 0.02]\n";
        std::fs::write(&scene, text).expect("written");
        let command = VerifyAdvice {
            scene,
            quantity: ["contact_area", "mean_gap"].map(|id| quantity(id).expect("known")).into(),
            error: vec![0.05, 0.2],
            table: Vec::new(),
            seeds: vec![41],
            out: Some(folder.path().join("verified")),
        };
        let verified = command.verify(&pipeline::Silent).expect("verified");
        assert_eq!(verified.len(), 4);
        for v in &verified {
            assert!(v.surface.contains("41") && v.met() == Some(true) && v.uncertainty.is_some(), "{:?}", v.row());
        }
        assert!(quantity("beauty").is_err_and(|accepted| accepted.contains("mean_gap")));
    }
}

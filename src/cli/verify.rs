//! `asperity verify`: a finished run, repeated. `asperity crate`: what others need to repeat it.

use super::file::COMMAND_LINE;
use super::machine::LammpsFlags;
use super::progress::TerminalProgress;
use super::{output, programs, run};
use crate::pipeline::{self, FinishedRun, Repetition, ro_crate};
use crate::report::number::significant;
use crate::{Error, Result};
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
pub(super) struct VerifyArgs {
    /// Run folder.
    folder: PathBuf,
    /// Largest relative difference of a number, and of a field over its largest value; what solvers leave below their tolerance is not
    /// compared. Default: the same bits of all numbers and fields, which another kind of processor need not give.
    #[arg(long, default_value_t = 0.0, value_name = "RELATIVE")]
    tolerance: f64,
    /// New folder for the repetition. Default: none is left.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Execute the program that the scene names as atoms.program.
    #[arg(long)]
    allow_program: bool,
    #[command(flatten)]
    lammps: LammpsFlags,
    /// One line of JSON on stdout.
    #[arg(long)]
    json: bool,
}

impl VerifyArgs {
    pub(super) fn execute(self) -> Result<ExitCode> {
        if !(0.0..1.0).contains(&self.tolerance) {
            return Err(Error::input(
                COMMAND_LINE,
                "--tolerance",
                self.tolerance,
                "zero, or a number below 1, as 1e-6",
            ));
        }
        if let Some(out) = self.out.as_ref().filter(|out| out.exists()) {
            return Err(Error::input(COMMAND_LINE, "--out", format!("{} (exists)", out.display()), "a new folder"));
        }
        let finished = FinishedRun::open(&self.folder)?;
        let (scene, lammps) = (ro_crate::scene_of(&finished, &self.folder)?, self.lammps.command());
        let mut case = run::resolved(scene, &finished.scene, &lammps, self.allow_program)?;
        programs::check(&case, self.allow_program)?;
        let units = case.given_units();
        pipeline::impose_contact(&mut case, units, &asperity_contact::method::NoObserver)?;
        let scratch = tempfile::tempdir().map_err(Error::io("create", "a scratch folder"))?;
        let out = self.out.clone().unwrap_or_else(|| scratch.path().join("repetition"));
        let progress = TerminalProgress::new();
        pipeline::run(&case, &out, &progress)?;
        drop(progress);
        let found = finished.compare(&out, self.tolerance == 0.0)?;
        let agrees = found.agrees(self.tolerance);
        if self.json {
            output::json_line(
                &serde_json::json!({ "agrees": agrees, "tolerance": self.tolerance, "repetition": found }),
            )?;
        } else {
            self.print(&found, agrees);
        }
        Ok(if agrees { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }

    fn print(&self, found: &Repetition, agrees: bool) {
        let [run, repetition] = &found.programs;
        output::print(&format!("run by {run}, repeated by {repetition}"));
        let equal = |all: usize, changed: usize| format!("{} of {all} have the same bits", all - changed);
        output::print(&format!("numbers: {}", equal(found.numbers, found.changed_numbers)));
        output::print(&format!("fields: {}", equal(found.fields, found.changed_fields.len())));
        if let Some(l) = &found.largest {
            let shown = |value: Option<f64>| value.map_or("missing".into(), |v| format!("{v:e}"));
            let (run, repetition) = (shown(l.run), shown(l.repetition));
            output::print(&format!(
                "largest relative difference: {}, of {}: {run}, repeated {repetition}",
                significant(l.relative, 2),
                l.key
            ));
        }
        for field in &found.changed_fields {
            let by = field.relative.map_or(String::new(), |relative| format!(", by {}", significant(relative, 2)));
            output::print(&format!("another field: {}{by}", field.file));
        }
        let limit = match self.tolerance {
            0.0 => "to the bit".to_string(),
            tolerance => format!("within {}", significant(tolerance, 2)),
        };
        output::print(&format!("{} {limit}", if agrees { "verified" } else { "NOT verified" }));
    }
}

#[derive(Debug, clap::Args)]
pub(super) struct CrateArgs {
    /// Run folder.
    folder: PathBuf,
    /// Licence of the data: an SPDX identifier, such as CC-BY-4.0, or an address.
    #[arg(long, value_name = "LICENSE")]
    license: String,
    /// One line of JSON on stdout.
    #[arg(long)]
    json: bool,
}

impl CrateArgs {
    pub(super) fn execute(&self) -> Result<()> {
        let good = |c: char| c.is_ascii_alphanumeric() || "-.+:/_#?=&%~".contains(c);
        if self.license.is_empty() || !self.license.chars().all(good) {
            let accepted = "an SPDX identifier, such as CC-BY-4.0, or an address";
            return Err(Error::input(COMMAND_LINE, "--license", format!("{:?}", self.license), accepted));
        }
        let file = ro_crate::write(&self.folder, &self.license)?;
        if self.json {
            return output::json_line(&serde_json::json!({ "metadata": output::path(&file) }));
        }
        output::print(&file.display().to_string());
        Ok(())
    }
}

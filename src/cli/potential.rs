use super::output;
use crate::pipeline::keep_crystal;
use crate::report::number::{significant, trimmed};
use crate::{Error, Result};
use asperity_atoms::crystal::{MeasuredCrystal, Structure};
use asperity_atoms::engine::LammpsEngine;
use asperity_atoms::potential::{CALCIUM_ELEMENT, Potential as Eam, SetflHeader};
use asperity_atoms::properties::{ExpandedLattice, PotentialCard, Properties, expand, measure};
use asperity_atoms::run_script::LmpCommand;
use asperity_grid::units::{Dimension, Measure};
use asperity_surface::files::atomic_file::write_atomic;
use std::path::{Path, PathBuf};

/// Highest accepted temperature, K: most metals have melted.
const HIGHEST_K: f64 = 3000.0;

#[derive(Debug, clap::Args)]
pub(super) struct PotentialArgs {
    /// Write the shipped calcium-like potential (setfl, eam/alloy) here.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Check or measure this eam/alloy file instead of the shipped potential.
    #[arg(long, value_name = "FILE")]
    potential: Option<PathBuf>,
    /// Element that the file must have.
    #[arg(long, default_value = "Ca")]
    element: String,
    /// Find the crystal structure (fcc, bcc or hcp) with LAMMPS, and measure lattice constant, elastic constants, contact modulus of the
    /// (001) face (mean over directions, along [100] and along [110]) and defect energies (half a minute).
    #[arg(long)]
    measure: bool,
    /// With --measure: also the lattice constant at these temperatures (comma-separated, K), which an own potential needs as
    /// atoms.nvt.lattice_constant; half a minute each, fcc crystals only.
    #[arg(long, value_name = "TEMPERATURES", value_delimiter = ',', num_args = 1, requires = "measure")]
    temperature: Vec<Measure>,
    /// The LAMMPS program.
    #[arg(long, value_name = "FILE")]
    lammps: Option<PathBuf>,
    /// Of several minima of the energy, measure the one near this lattice constant, Å. Default: the lowest.
    #[arg(long, value_name = "ANGSTROM")]
    lattice_constant: Option<f64>,
    /// One line of JSON on stdout.
    #[arg(long)]
    json: bool,
}

impl PotentialArgs {
    pub(super) fn execute(self) -> Result<()> {
        if let (Some(given), Some(_)) = (&self.potential, &self.out) {
            let accepted = "--out writes the shipped potential; leave out one of the two";
            return Err(Error::input("command line", "--potential", given.display(), accepted));
        }
        let scratch = tempfile::tempdir().map_err(Error::io("create a folder in", std::env::temp_dir()))?;
        let file = match (&self.potential, &self.out) {
            (Some(file), _) => file.clone(),
            (None, out) => {
                let file = out.clone().unwrap_or_else(|| scratch.path().join("Ca.eam.alloy"));
                write_atomic(&file, |w| Eam::calcium().write_setfl(w))?;
                file
            }
        };
        let header = SetflHeader::read(&file)?;
        let element = header.element(&file, &self.element)?;
        let temperatures = self.temperatures()?;
        let (crystal, measured, expanded) = if self.measure {
            let (crystal, properties) = self.properties(&file, scratch.path())?;
            let expanded = self.expanded(&file, scratch.path(), &crystal, &temperatures)?;
            (Some(crystal), properties, expanded)
        } else {
            (None, None, Vec::new())
        };
        let shipped = self.potential.is_none() && self.element == CALCIUM_ELEMENT.0;
        let deviations = match &measured {
            Some(m) if shipped => Some(PotentialCard::calcium()?.deviations(m)),
            _ => None,
        };
        let name = self.potential.as_ref().or(self.out.as_ref());
        if self.json {
            return output::json_line(&serde_json::json!({
                "file": name,
                "element": element.symbol,
                "mass_u": element.mass_u,
                "cutoff_angstrom": header.cutoff_angstrom,
                "crystal": crystal,
                "properties": measured,
                "expanded": expanded,
                "deviations": deviations,
            }));
        }
        output::print(&format!(
            "{}: {} of {:?}, mass {} u, cut-off {} Å",
            name.map_or("shipped potential".into(), |p| p.display().to_string()),
            element.symbol,
            header.elements.iter().map(|e| &e.symbol).collect::<Vec<_>>(),
            element.mass_u,
            significant(header.cutoff_angstrom, 6)
        ));
        crystal.iter().for_each(print_crystal);
        if let Some(m) = &measured {
            let rows = serde_json::to_value(m).ok().and_then(|v| v.as_object().cloned()).unwrap_or_default();
            let number = |v: &serde_json::Value| v.as_f64().map_or("-".into(), |x| significant(x, 6));
            output::print(&output::table(
                &["property", "measured", "what it is"],
                rows.iter().map(|(k, v)| vec![k.clone(), number(v), Properties::meaning(k).into()]),
            ));
        }
        for lattice in &expanded {
            output::print(&format!(
                "at {} K (mean of the run): a = {:.4} Å (standard error {:.4} Å), {:.3} % more than at 0 K",
                trimmed(lattice.temperature_k, 4),
                lattice.lattice_constant_angstrom,
                lattice.error_angstrom,
                100.0
                    * (lattice.lattice_constant_angstrom / crystal.as_ref().map_or(f64::NAN, |c| c.a0_angstrom) - 1.0)
            ));
        }
        match deviations {
            Some(list) if list.is_empty() => output::print("every property is as potentials/Ca.toml states"),
            Some(list) => list.iter().for_each(|d| output::print(&format!("not as stated: {d}"))),
            None => {}
        }
        Ok(())
    }

    /// In K; numbers without a unit are in K.
    fn temperatures(&self) -> Result<Vec<f64>> {
        let kelvin = |given: &Measure| {
            let kelvin = given.of(Dimension::Temperature).ok().map(Measure::si).filter(|t| *t > 0.0 && *t <= HIGHEST_K);
            let accepted = format!("temperatures above zero, at most {HIGHEST_K} K, as 300K");
            kelvin.ok_or_else(|| Error::input("command line", "--temperature", given, accepted))
        };
        self.temperature.iter().map(kelvin).collect()
    }

    fn expanded(
        &self,
        file: &Path,
        scratch: &Path,
        crystal: &MeasuredCrystal,
        temperatures: &[f64],
    ) -> Result<Vec<ExpandedLattice>> {
        if temperatures.is_empty() {
            return Ok(Vec::new());
        }
        if crystal.structure != Structure::Fcc {
            let accepted = format!("an fcc crystal; this one is {}", crystal.structure);
            return Err(Error::input("command line", "--temperature", "given", accepted));
        }
        let command = LmpCommand { program: LammpsEngine::find(self.lammps.as_deref())?.program().to_path_buf() };
        let file = std::path::absolute(file).map_err(Error::io("find", file))?;
        let at = |&kelvin: &f64| {
            expand(&command, &scratch.join("expansion"), &file, (&self.element, crystal.a0_angstrom), kelvin)
        };
        temperatures.iter().map(at).collect()
    }

    fn properties(&self, file: &Path, scratch: &Path) -> Result<(MeasuredCrystal, Option<Properties>)> {
        let engine = LammpsEngine::find(self.lammps.as_deref())?;
        let file = std::path::absolute(file).map_err(Error::io("find", file))?;
        let command = LmpCommand { program: engine.program().to_path_buf() };
        let properties = measure(&command, scratch, &file, &self.element, self.lattice_constant)?;
        if self.lattice_constant.is_none() {
            // Scenes of this potential need not measure it again.
            keep_crystal(&file, &self.element, engine.describe(), &properties.0)?;
        }
        Ok(properties)
    }
}

/// Prints the structure, and what it is not good for.
fn print_crystal(crystal: &MeasuredCrystal) {
    output::print(&format!("crystal of the lowest energy among fcc, bcc and hcp: {}", crystal.describe()));
    match crystal.structure {
        Structure::Fcc => {}
        Structure::Bcc => output::print("runs with atoms refuse it: their block is fcc"),
        Structure::Hcp => output::print(
            "runs with atoms refuse it: their block is fcc. Elastic constants, E* and defects are measured for cubic crystals only",
        ),
    }
}

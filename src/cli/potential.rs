use super::output;
use crate::pipeline::keep_crystal;
use crate::report::number::significant;
use crate::{Error, Result};
use asperity_atoms::crystal::{MeasuredCrystal, Structure};
use asperity_atoms::engine::LammpsEngine;
use asperity_atoms::potential::{CALCIUM_ELEMENT, Potential as Eam, SetflHeader};
use asperity_atoms::properties::{PotentialCard, Properties, measure};
use asperity_atoms::run_script::LmpCommand;
use asperity_surface::files::atomic_file::write_atomic;
use std::path::{Path, PathBuf};

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
        let (crystal, measured) = match self.measure.then(|| self.properties(&file, scratch.path())).transpose()? {
            Some((crystal, properties)) => (Some(crystal), properties),
            None => (None, None),
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
        match deviations {
            Some(list) if list.is_empty() => output::print("every property is as potentials/Ca.toml states"),
            Some(list) => list.iter().for_each(|d| output::print(&format!("not as stated: {d}"))),
            None => {}
        }
        Ok(())
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

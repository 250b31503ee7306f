use super::output;
use crate::atoms::engine::LammpsEngine;
use crate::atoms::potential::{CALCIUM, CALCIUM_ELEMENT, Potential as Eam, SetflHeader};
use crate::atoms::properties::{Card, LmpCommand, Properties, measure};
use crate::record::atomic_file::write_atomic;
use crate::report::number::significant;
use crate::{Error, Result};
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(super) struct Potential {
    /// Write the shipped calcium-like potential (setfl, eam/alloy) here.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Check or measure this eam/alloy file instead of the shipped potential.
    #[arg(long, value_name = "FILE")]
    potential: Option<PathBuf>,
    /// Element that the file must have.
    #[arg(long, default_value = "Ca")]
    element: String,
    /// Measure lattice constant, elastic constants, contact modulus and defect energies with LAMMPS (half a minute).
    #[arg(long)]
    measure: bool,
    /// The LAMMPS program.
    #[arg(long, value_name = "FILE")]
    lammps: Option<PathBuf>,
    /// Lattice constant from which the measurement starts, Å. Default: the file's own.
    #[arg(long, value_name = "ANGSTROM")]
    lattice_constant: Option<f64>,
    /// One line of JSON on stdout.
    #[arg(long)]
    json: bool,
}

impl Potential {
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
        let measured = if self.measure { Some(self.properties(&file, &header, scratch.path())?) } else { None };
        let shipped = self.potential.is_none() && self.element == CALCIUM_ELEMENT.0;
        let deviations = match &measured {
            Some(m) if shipped => Some(Card::calcium()?.deviations(m)),
            _ => None,
        };
        let name = self.potential.as_ref().or(self.out.as_ref());
        if self.json {
            return output::json_line(&serde_json::json!({
                "file": name,
                "element": element.symbol,
                "mass_u": element.mass_u,
                "cutoff_angstrom": header.cutoff_angstrom,
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
        if let Some(m) = &measured {
            let rows = serde_json::to_value(m).ok().and_then(|v| v.as_object().cloned()).unwrap_or_default();
            let number = |v: &serde_json::Value| v.as_f64().map_or(v.to_string(), |x| significant(x, 6));
            output::print(&output::table(
                &["property", "measured"],
                rows.iter().map(|(k, v)| vec![k.clone(), number(v)]),
            ));
        }
        match deviations {
            Some(list) if list.is_empty() => output::print("every property is as potentials/Ca.toml states"),
            Some(list) => list.iter().for_each(|d| output::print(&format!("not as stated: {d}"))),
            None => {}
        }
        Ok(())
    }

    fn properties(
        &self,
        file: &std::path::Path,
        header: &SetflHeader,
        scratch: &std::path::Path,
    ) -> Result<Properties> {
        let engine = LammpsEngine::find(self.lammps.as_deref())?;
        let own = header.element(file, &self.element)?.a0_angstrom.unwrap_or(CALCIUM.a0);
        let file = std::path::absolute(file).map_err(Error::io("find", file))?;
        let command = LmpCommand { program: engine.program().to_path_buf() };
        measure(&command, scratch, &file, &self.element, self.lattice_constant.unwrap_or(own))
    }
}

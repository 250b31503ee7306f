use super::cluster::CommandRequest;
use super::machine::{LammpsFlags, MachineFlags, submits};
use super::run::StageFlags;
use super::{crystals, output, programs, progress::TerminalProgress};
use crate::pipeline::{self, TradeoffRequest};
use crate::record::tradeoff::{AtomsCost, BlockSize, FILE, ResolvedErrors, TradeoffPoint, TradeoffResults as Table};
use crate::report::number::{count, duration, error_of, memory, significant, trimmed};
use crate::scene::{ALL_METHODS, Case, MOST_FOUNDATION_CELLS, Scene};
use crate::{Error, Result};
use asperity_atoms::job_spec::Minimizer;
use asperity_contact::method::{ContactMethod, Device};
use asperity_contact::quantity::Quantity;
use asperity_grid::units::{Dimension, MAX_SECONDS, Measure};
use asperity_methods::REGISTRY;
use std::path::PathBuf;
use std::process::ExitCode;

const PLACE: &str = "command line";

/// Largest number of repeats: the least cost hardly decreases with more.
const MOST_REPEATS: usize = 100;

#[derive(Debug, clap::Args)]
pub(super) struct TradeoffArgs {
    /// Scene file (TOML): its surface, loads and adhesion.
    scene: PathBuf,
    /// Run folder. Default: runs/NAME-tradeoff.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Methods: comma-separated ids from `asperity methods`. Default: all.
    #[arg(long, value_name = "IDS", value_delimiter = ',', num_args = 1)]
    methods: Vec<String>,
    /// Points per side of the grids, comma-separated divisors of the reference's. At least 16. Default: the scene's, a half, a quarter.
    #[arg(long, value_name = "LIST", value_delimiter = ',', num_args = 1)]
    grids: Vec<usize>,
    /// Points per side of the reference (`fast`, f64). Default: the scene's.
    #[arg(long, value_name = "N")]
    reference: Option<usize>,
    /// Seed of the surface. Default: surface.seed of the scene.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Time after which no further setting begins, as 90s, 10min or 2h, including earlier runs in this folder. Each method comes
    /// once before the other settings; skipped settings are listed. The reference is always solved. Default: no limit.
    #[arg(long, value_name = "TIME")]
    budget: Option<String>,
    /// Blocks of atoms that LAMMPS runs, comma-separated, as CELLSxDEPTH, CELLSxDEPTH+FOUNDATION (with a prescribed base) or
    /// CELLSxDEPTH+FOUNDATION-elastic, in lattice constants, each with -harmonic or -fire for a minimiser other than the scene's. Default for a scene with [atoms]: its own block; a block with half the
    /// cells (a multiple of five); a block with half the depth; if the atoms start from the continuum, also the latter on a foundation
    /// that replaces the other half; two deformable cells on an elastic base that replaces the rest; its own block relaxed by
    /// LAMMPS alone.
    #[arg(long, value_name = "LIST", value_delimiter = ',', num_args = 1)]
    atoms: Vec<String>,
    /// Number of runs of each setting; the fastest counts. Default: one, or three to thirty for settings that take less than a second.
    #[arg(long, value_name = "N")]
    repeats: Option<usize>,
    #[command(flatten)]
    stages: StageFlags,
    #[command(flatten)]
    lammps: LammpsFlags,
    #[command(flatten)]
    machine: MachineFlags,
    /// Print the settings with their memory and time, without running them; with --machine, the script without submitting it.
    #[arg(long)]
    dry_run: bool,
    /// One line of JSON on stdout.
    #[arg(long)]
    json: bool,
}

impl TradeoffArgs {
    pub(super) fn execute(self) -> Result<ExitCode> {
        if Device::chosen() == Device::Cuda {
            return Err(Error::input(PLACE, "--device", "cuda", "cpu: costs of methods are compared on the processor"));
        }
        let budget_seconds = self.budget.as_deref().map(|text| seconds("--budget", text)).transpose()?;
        if let Some(n) = self.repeats.filter(|n| !(1..=MOST_REPEATS).contains(n)) {
            return Err(Error::input(PLACE, "--repeats", n, format!("1 to {MOST_REPEATS} runs")));
        }
        let methods = methods(&self.methods)?;
        let blocks = (!self.atoms.is_empty()).then(|| self.atoms.iter().map(|a| block(a)).collect()).transpose()?;
        let mut scene = Scene::read(&self.scene)?;
        if let (Some(seed), Some(file), false) = (self.seed, &scene.surface.heights, scene.surface.has_seed()) {
            let accepted = format!("none: {} has the heights", file.display());
            return Err(Error::input(PLACE, "--seed", seed, accepted));
        }
        scene.surface.seed = self.seed.unwrap_or(scene.surface.seed);
        let machine = self.machine.find(&self.lammps)?;
        let with_blocks = blocks.is_some();
        if !with_blocks && !methods.iter().any(|m| m.card().capabilities.atoms) {
            // Without atoms nothing is measured for them.
            scene.atoms = None;
        }
        let allowed = self.stages.allow_program;
        let warnings = match crystals::settle(&mut scene, &self.scene, &machine.1.lammps, allowed) {
            // As for a scene with its constants, methods without atoms are compared.
            Err(e @ (Error::MissingProgram { .. } | Error::Program { .. })) if !with_blocks => {
                scene.atoms = None;
                vec![format!("the atoms are left out: {e}")]
            }
            settled => settled?,
        };
        let mut case = Case::resolve(scene, &self.scene)?;
        warnings.iter().for_each(|text| output::eprint(&format!("warning: {text}")));
        let out = self.out.unwrap_or_else(|| PathBuf::from("runs").join(format!("{}-tradeoff", case.scene.name)));
        case.lammps = machine.1.lammps.clone();
        programs::check(&case, self.stages.allow_program)?;
        if submits(&machine.1) {
            // The largest solve of a setting; settings that do not fit are left out.
            let (results, dry_run, json) = (FILE, self.dry_run, self.json);
            let seconds = budget_seconds.or(Some(machine.1.seconds() as f64));
            let request = CommandRequest { case: &case, out: &out, machine, results, seconds, dry_run, json };
            return request.submit().map(|()| ExitCode::SUCCESS);
        }
        if !self.dry_run {
            let units = case.given_units();
            pipeline::impose_contact(&mut case, units, &asperity_contact::method::NoObserver)?;
        }
        let request = TradeoffRequest {
            methods,
            grids: (!self.grids.is_empty()).then_some(self.grids),
            reference: self.reference,
            budget_seconds,
            repeats: self.repeats,
            blocks,
        };
        if self.dry_run {
            let plan = pipeline::tradeoff_plan(&case, &request)?;
            if self.json {
                return output::json_line(&plan).map(|()| ExitCode::SUCCESS);
            }
            output::plan("setting", &plan);
            plan.warnings.iter().for_each(|w| output::print(&format!("warning: {w}")));
            return Ok(ExitCode::SUCCESS);
        }
        let progress = TerminalProgress::new();
        let (tradeoff, page) = pipeline::tradeoff(&case, &request, self.stages.folder.folder(&out), &progress)?;
        drop(progress);
        output::finished(self.json, (&out, &page), ("tradeoff", &tradeoff), || print_tradeoff(&tradeoff))?;
        Ok(ExitCode::SUCCESS)
    }
}

/// Methods of the registry by their ids, in its order.
fn methods(ids: &[String]) -> Result<Vec<&'static dyn ContactMethod>> {
    for id in ids {
        if id != ALL_METHODS && asperity_methods::find(id).is_none() {
            let accepted = format!("{}, or {ALL_METHODS}", asperity_methods::ids().join(", "));
            return Err(Error::input(PLACE, "--methods", id, accepted));
        }
    }
    let all = ids.is_empty() || ids.iter().any(|id| id == ALL_METHODS);
    let keep = |id: &str| all || ids.iter().any(|w| asperity_methods::find(w).is_some_and(|m| m.card().id == id));
    Ok(REGISTRY.iter().copied().filter(|m| keep(m.card().id)).collect())
}

/// A block as its name.
fn block(text: &str) -> Result<BlockSize> {
    let ends = BlockSize::MINIMIZERS.into_iter().find_map(|(end, m)| Some((text.trim().strip_suffix(end)?, m)));
    let (name, minimizer) = ends.unwrap_or((text.trim(), Minimizer::Auto));
    let size = name.split_once('x').and_then(|(cells, depth)| {
        let (depth, below) = depth.split_once('+').unwrap_or((depth, "0"));
        let elastic_base = below.ends_with(BlockSize::ELASTIC);
        let below = below.strip_suffix(BlockSize::ELASTIC).unwrap_or(below);
        let [cells, depth_cells, foundation_cells] = [cells, depth, below].map(|w| w.parse().ok());
        let [cells, depth_cells, foundation_cells] = [cells?, depth_cells?, foundation_cells?];
        Some(BlockSize { cells, depth_cells, foundation_cells, elastic_base, minimizer })
    });
    let size = size.filter(|b| {
        (4..=2000).contains(&b.cells)
            && (1..=1000).contains(&b.depth_cells)
            && b.foundation_cells <= MOST_FOUNDATION_CELLS
    });
    let accepted = "cells across (4 to 2000) and deep (1 to 1000), lattice constants, as 15x6, or on a foundation 15x6+10 or 15x2+14-elastic, \
                    with -harmonic or -fire for a minimiser";
    size.ok_or_else(|| Error::input(PLACE, "--atoms", text, accepted))
}

/// A time with its unit, in s.
pub(super) fn seconds(flag: &str, text: &str) -> Result<f64> {
    let seconds = text.parse::<Measure>().and_then(|m| m.of(Dimension::Time)).ok().map(Measure::si);
    seconds.filter(|s| *s > 0.0 && *s <= MAX_SECONDS).ok_or_else(|| {
        Error::input(PLACE, flag, text, "a time above zero, at most 30 years, as 0.5s, 30s, 10min or 2h")
    })
}

/// Prints cost and error of each setting.
fn print_tradeoff(tradeoff: &Table) {
    for r in &tradeoff.references {
        let s = &r.setting;
        let which = if tradeoff.references.len() == 1 {
            ""
        } else if s.adhesive {
            ", with adhesion"
        } else {
            ", without adhesion"
        };
        output::print(&format!(
            "reference{which}: {} on {} x {} points, {} to {:e}: {} CPU",
            s.method,
            s.nx,
            s.ny,
            s.precision,
            s.tolerance,
            duration(r.cost.cpu_seconds)
        ));
        let uncertainty: Vec<String> = Quantity::COMPARED
            .iter()
            .filter_map(|m| r.uncertainty.get(m).map(|u| format!("{} {}", m.name(), error_of(*m, *u))))
            .collect();
        output::print(&format!(
            "  uncertain by: {}",
            if uncertainty.is_empty() { "not known".into() } else { uncertainty.join(", ") }
        ));
    }
    const COLUMNS: [Quantity; 5] =
        [Quantity::ContactArea, Quantity::MeanGap, Quantity::GapMap, Quantity::ContactMap, Quantity::MedianClusterArea];
    let head =
        ["method", "grid", "to", "CPU", "of ref.", "memory", "area", "mean gap", "gap map", "contact map", "cluster"];
    let row = |p: &TradeoffPoint| {
        let s = &p.setting;
        let mut cells = vec![
            match s.block {
                Some(block) => format!("{} ({block})", s.method),
                None if p.is_reference => format!("{} (reference)", s.method),
                None => s.method.clone(),
            },
            format!("{} x {}", s.nx, s.ny),
            format!("{} {}", s.precision, trimmed(s.tolerance, 2)),
            duration(p.cost.cpu_seconds),
            significant(p.cost.cpu_over_reference, 2),
            memory(p.cost.measured_bytes),
        ];
        cells.extend(COLUMNS.map(|m| tradeoff.error(p, m).map_or("-".into(), |e| error_of(m, e))));
        cells
    };
    output::print(&output::table(&head, tradeoff.points.iter().filter(|p| p.unavailable_reason.is_none()).map(row)));
    print_atoms(tradeoff);
    let mut refused: Vec<(&str, &str)> = Vec::new();
    for p in &tradeoff.points {
        if let Some(reason) = p.unavailable_reason.as_deref().filter(|w| !refused.contains(&(&p.setting.method, w))) {
            refused.push((&p.setting.method, reason));
            output::print(&format!("{} in {} not available: {reason}", p.setting.method, p.setting.precision));
        }
    }
    for l in &tradeoff.skipped {
        let s = &l.setting;
        output::print(&format!(
            "left out: {} on {}, {} to {:e}: {}",
            s.method, s.nx, s.precision, s.tolerance, l.reason
        ));
    }
    tradeoff.warnings.iter().for_each(|w| output::print(&format!("warning: {w}")));
}

/// Prints cost of the blocks of atoms, and their errors against the solution on the heights that they resolve.
fn print_atoms(tradeoff: &Table) {
    let blocks: Vec<(&TradeoffPoint, &ResolvedErrors)> =
        tradeoff.points.iter().filter_map(|p| p.resolved.as_ref().map(|r| (p, r))).collect();
    if blocks.is_empty() {
        return;
    }
    let row = |(p, r): &(&TradeoffPoint, &ResolvedErrors)| {
        let taken = p.cost.atoms;
        let number = |value: fn(&AtomsCost) -> String| taken.as_ref().map_or("-".into(), value);
        let mut cells = vec![
            p.setting.block.map_or("-".into(), |b| b.to_string()),
            number(|a| count(a.atoms as usize)),
            number(|a| count(a.force_evaluations)),
            number(|a| duration(a.lammps_cpu_seconds)),
            format!("L/{}", significant(1.0 / r.shortest_wavelength, 2)),
        ];
        let error = |m| r.errors.get(&m).map_or("-".into(), |e| error_of(m, *e));
        cells.extend([Quantity::ContactArea, Quantity::MeanGap, Quantity::GapMap, Quantity::ContactMap].map(error));
        cells
    };
    output::print("atoms, against the solution on the heights that they resolve:");
    let head = ["block", "atoms", "evaluations", "LAMMPS", "waves to", "area", "mean gap", "gap map", "contact map"];
    output::print(&output::table(&head, blocks.iter().map(row)));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_units() {
        for (text, expected) in [("10min", 600.0), ("0.1s", 0.1), ("2h", 7200.0), ("90", 90.0), ("250ms", 0.25)] {
            assert!(seconds("--budget", text).is_ok_and(|s| (s / expected - 1.0f64).abs() < 1e-12), "{text}");
        }
        for text in ["", "m", "-3s", "0s", "10 parsecs", "inf", "NaN", "1e19s"] {
            assert_eq!(seconds("--budget", text).err().map(|e| e.exit_code()), Some(2), "{text}");
        }
    }
}

//! What `solve` finds, for people and for programs.

use super::Solve;
use crate::Result;
use crate::cli::words;
use crate::interface::{Adhesion, Law};
use crate::method::{Problem, Stop};
use crate::observe::contact_map;
use crate::path::{LoadPath, Reached};
use crate::record::results::PullOff;
use crate::record::{json, npy};
use crate::report::number::{duration, memory, percent, significant};
use serde_json::{Value, json};

/// Tells one solve's states in the units of its command line.
pub(super) struct Told<'a> {
    solve: &'a Solve,
    /// As asked for, and as the grid was given it.
    asked: Adhesion,
    problem: Problem<'a>,
    resolved_gradient: f64,
    planned_bytes: u64,
    loads: usize,
    count: usize,
    /// Processor time up to the state told last, s.
    cpu: f64,
}

impl<'a> Told<'a> {
    pub fn new(solve: &'a Solve, asked: &Problem<'a>, path: &LoadPath<'a>, loads: usize) -> Self {
        let problem = path.problem().clone();
        let resolved_gradient = problem.resolved_gradient();
        let (planned_bytes, cpu) = (path.plan().bytes, crate::sys::cpu_seconds());
        Told { solve, asked: asked.adhesion, problem, resolved_gradient, planned_bytes, loads, count: 0, cpu }
    }

    /// States told so far.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Name of a file of load `i`.
    pub fn name(&self, i: usize, prefix: &str, name: &str) -> String {
        if self.loads == 1 { format!("{prefix}{name}") } else { format!("{prefix}load-{}-{name}", i + 1) }
    }

    /// A state that was found before the solve was interrupted.
    pub fn again(&mut self, line: &Value) -> Result<()> {
        self.count += 1;
        if self.solve.json { words::json_line(line) } else { Ok(()) }
    }

    /// Tells a state, writes its files, and gives its line of JSON.
    pub fn state(&mut self, i: usize, reached: &Reached) -> Result<Value> {
        self.count += 1;
        let before = std::mem::replace(&mut self.cpu, crate::sys::cpu_seconds());
        let line = self.line(reached, self.cpu - before);
        let (solve, state, grid) = (self.solve, &reached.state, self.problem.grid);
        if let Some(out) = &solve.out
            && state.stop != Stop::Interrupted
        {
            let (length, modulus, n) = (solve.length, solve.modulus, state.gap.len());
            // A state that did not converge must not be taken for one that did, by name or by whoever reads the folder.
            let prefix = if state.stop == Stop::Converged { "" } else { "partial-" };
            let path = |name: &str| out.join(self.name(i, prefix, name));
            npy::write(&path("gap.npy"), grid.nx, grid.ny, (0..n).map(|i| state.gap.at(i) * length))?;
            npy::write(&path("stress.npy"), grid.nx, grid.ny, (0..n).map(|i| state.stress.at(i) * modulus))?;
            npy::write(&path("contact.npy"), grid.nx, grid.ny, contact_map(state.gap, 0.0))?;
            json::write(&path("solve.json"), &line)?;
        }
        if solve.json {
            words::json_line(&line)?;
        } else {
            words::say(&self.table(reached));
        }
        Ok(line)
    }

    fn line(&self, reached: &Reached, cpu_seconds: f64) -> Value {
        let Reached { state, area, discretisation, extrapolated } = reached;
        let (length, modulus) = (self.solve.length, self.solve.modulus);
        let (problem, grid) = (&self.problem, self.problem.grid);
        let spacing = grid.dx().max(grid.dy());
        let energy = modulus * length;
        json!({
            "method": crate::method::find(&self.solve.method).map(|m| m.card().id),
            "nx": grid.nx,
            "ny": grid.ny,
            "precision": problem.precision,
            "threads": rayon::current_num_threads(),
            "kernel": problem.kernel.to_string(),
            "adhesion": problem.adhesion.to_string(),
            "wall": problem.wall.to_string(),
            "cohesive_resolution": self.asked.resolution_on(spacing),
            "range": problem.adhesion.resolution_on(spacing).map(|used| json!({
                "asked": self.asked.range() * length,
                "used": problem.adhesion.range() * length,
                "resolution_used": used,
            })),
            "resolved_gradient": self.resolved_gradient,
            "pressure": state.pressure * modulus,
            "criterion": "zero gap",
            "contact_fraction": area.fraction,
            "contact_fraction_corrected": area.corrected,
            "perimeter": area.perimeter / length,
            "mean_gap": state.mean_gap * length,
            "discretisation": discretisation,
            "extrapolated": extrapolated.map(|e| json!({
                "contact_fraction": e.area,
                "mean_gap": e.mean_gap.map(|g| json!({ "value": g.value * length, "error": g.error * length })),
            })),
            "load_error": state.load_error,
            "residual": state.residual,
            "tolerance": problem.tolerance,
            "complementarity": state.complementarity,
            "energy": state.energy * energy,
            "elastic_energy": state.elastic_energy * energy,
            "adhesion_energy": state.interaction_energy * energy,
            "settled": state.settled,
            "stop": state.stop.to_string(),
            "iterations": state.iterations,
            "fft_pairs": state.fft_pairs,
            "seconds": state.seconds,
            "cpu_seconds": cpu_seconds,
            "planned_bytes": self.planned_bytes,
            "peak_rss_bytes": crate::sys::peak_rss_bytes(),
        })
    }

    fn table(&self, reached: &Reached) -> String {
        let Reached { state, area, discretisation, extrapolated } = reached;
        let (length, modulus) = (self.solve.length, self.solve.modulus);
        let mut rows = vec![
            ("mean pressure", significant(state.pressure * modulus, 6)),
            ("contact (zero gap)", percent(area.fraction)),
            ("contact, perimeter-corrected", percent(area.corrected)),
            ("mean gap", significant(state.mean_gap * length, 6)),
            ("energy per area", significant(state.energy * modulus * length, 6)),
        ];
        if let Some(d) = discretisation {
            let [nx, ny] = d.coarser;
            let gap = d.mean_gap.map_or(String::new(), |g| format!(", mean gap {}", percent(g)));
            let change = format!("area {}{gap}, from {nx} x {ny} points", percent(d.area));
            rows.push(("change with the grid", change));
        }
        if let Some(e) = extrapolated {
            let area = format!("{} ± {}", percent(e.area.value), percent(e.area.error));
            rows.push(("at the true range: contact", area));
            if let Some(g) = e.mean_gap {
                let (gap, error) = (significant(g.value * length, 6), significant(g.error * length, 2));
                rows.push(("at the true range: mean gap", format!("{gap} ± {error}")));
            }
        }
        rows.extend([
            ("rms gradient on this grid", significant(self.resolved_gradient, 4)),
            ("load error", format!("{:.1e}", state.load_error)),
            ("KKT residual over pressure", format!("{:.1e}", state.residual)),
            ("stop", state.stop.to_string()),
            ("iterations, FFT pairs", format!("{}, {:.1}", state.iterations, state.fft_pairs)),
            ("time, peak memory", format!("{}, {}", duration(state.seconds), memory(crate::sys::peak_rss_bytes()))),
        ]);
        words::table(&["quantity", "value"], rows.into_iter().map(|(k, v)| vec![k.to_string(), v]))
    }

    pub fn pull_off(&self, found: &PullOff) -> Result<()> {
        let (length, modulus) = (self.solve.length, self.solve.modulus);
        let curve: Vec<[f64; 2]> = found.curve.iter().map(|[g, p]| [g * length, p * modulus]).collect();
        let line = json!({
            "pull_off_pressure": found.pressure * modulus,
            "mean_gap": found.mean_gap * length,
            "mean_gap_error": found.mean_gap_error * length,
            "curve": curve,
        });
        if let Some(out) = &self.solve.out {
            json::write(&out.join("pull-off.json"), &line)?;
        }
        if self.solve.json {
            return words::json_line(&line);
        }
        let gap = (significant(found.mean_gap * length, 4), significant(found.mean_gap_error * length, 2));
        words::say(&words::table(
            &["quantity", "value"],
            [
                ("largest pull", significant(-found.pressure * modulus, 6)),
                ("at the mean gap", format!("{} ± {}", gap.0, gap.1)),
            ]
            .map(|(k, v)| vec![k.to_string(), v]),
        ));
        Ok(())
    }
}

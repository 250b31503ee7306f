//! Results of `solve`, as tables and as JSON.

use super::SolveArgs;
use super::curve::{self, in_unit, share};
use super::fields::{FieldWriter, OfFields, file_name};
use crate::Result;
use crate::cli::output;
use crate::record::load_table::{self, Dimension, ResultUnits};
use crate::report::number::{change, duration, memory, percent, significant};
use crate::scene::{Case, rename_keys_in};
use asperity_contact::interface::{AttractionLaw, RangeChoice, SubsurfaceRequest};
use asperity_contact::method::{Device, Equilibrium, MethodCard, ReducedProblem, Stop};
use asperity_contact::observe::Leakage;
use asperity_contact::path::{self, LoadPathSolver, Reached};
use asperity_contact::results::{Discretisation, HardnessMapResults, Peak, PullOff, SubsurfaceResults};
use asperity_grid::Field;
use asperity_grid::sys::MemoryGrowth;
use asperity_grid::units::Scales;
use asperity_surface::files::{json, npy};
use asperity_surface::provenance::Provenance;
use serde::Deserialize;
use serde_json::{Value, json};

/// Reports the states of one solve in the units of its command line.
pub(super) struct SolveReporter<'a> {
    solve: &'a SolveArgs,
    /// Of the results: the units of the command line.
    scales: Scales,
    units: ResultUnits,
    /// rms gradient, reduced.
    gradient: f64,
    provenance: Option<Provenance>,
    /// As requested, and as used by the method on this grid.
    requested: AttractionLaw,
    used: AttractionLaw,
    problem: ReducedProblem<'a>,
    subsurface: Option<SubsurfaceRequest>,
    fields: FieldWriter<'a>,
    /// Of a hardness that is a map, over E*.
    hardness_map: Option<HardnessMapResults>,
    card: &'static MethodCard,
    criterion: String,
    pub resolved_gradient: f64,
    planned_bytes: u64,
    growth: MemoryGrowth,
    pub loads: usize,
    /// Line of JSON of each state so far.
    pub lines: Vec<Value>,
    /// Processor time up to the last state, s.
    cpu: f64,
}

/// Planned memory, and memory and processor time before the solve.
pub(super) struct Before {
    pub planned_bytes: u64,
    pub growth: MemoryGrowth,
    pub cpu: f64,
}

impl Before {
    pub(super) fn now(planned_bytes: u64) -> Self {
        Before { planned_bytes, growth: MemoryGrowth::begin(), cpu: asperity_grid::sys::cpu_seconds() }
    }
}

impl<'a> SolveReporter<'a> {
    pub(super) fn new(
        solve: &'a SolveArgs,
        case: &Case,
        requested: &ReducedProblem<'a>,
        path: &LoadPathSolver<'a>,
        loads: usize,
        Before { planned_bytes, growth, cpu }: Before,
    ) -> Self {
        let problem = path.problem().clone();
        let resolved_gradient = problem.resolved_gradient();
        SolveReporter {
            solve,
            scales: case.scales,
            units: solve.units(case),
            gradient: case.gradient,
            provenance: case.provenance().cloned(),
            requested: requested.adhesion,
            used: path.adhesion(),
            card: path.method().card(),
            criterion: path.method().criterion(&problem.settings).to_string(),
            problem,
            subsurface: case.subsurface(),
            fields: FieldWriter::new(solve, case, path, loads),
            hardness_map: case.hardness_map.clone(),
            resolved_gradient,
            planned_bytes,
            growth,
            loads,
            lines: Vec::new(),
            cpu,
        }
    }

    /// Reports a state of an interrupted or finished solve.
    pub(super) fn again(&mut self, line: Value) -> Result<()> {
        self.report(line)
    }

    fn report(&mut self, line: Value) -> Result<()> {
        if self.solve.json {
            output::json_line(&line)?;
        } else if self.loads == 1 {
            output::print(&table(&line, self.solve.resolution, &self.units));
        } else {
            if self.lines.is_empty() {
                output::print(&curve::head(&self.units));
            }
            output::print(&curve::line(self.lines.len() + 1, &line));
        }
        self.lines.push(line);
        match &self.solve.out {
            Some(out) => {
                // The first that does not converge is the last: it is no point of the curve.
                let points = self.lines.iter().take_while(|l| l["stop"] == Stop::Converged.to_string()).count();
                if points == 0 { Ok(()) } else { load_table::write(out, &self.lines[..points], &self.units) }
            }
            None => Ok(()),
        }
    }

    /// Reports a state and writes its files. Returns its line of JSON.
    pub(super) fn state(&mut self, i: usize, reached: &Reached) -> Result<Value> {
        let previous = std::mem::replace(&mut self.cpu, asperity_grid::sys::cpu_seconds());
        let fields = self.fields.state(i, &reached.state)?;
        let mut line = self.line(reached, &fields, self.cpu - previous);
        self.add_subsurface(i, &reached.state, &fields, &mut line)?;
        if let Some(out) = &self.solve.out {
            json::write(&out.join(file_name(i, self.loads, reached.state.stop, "solve.json")), &line)?;
        }
        self.report(line.clone())?;
        Ok(line)
    }

    fn line(&self, reached: &Reached, fields: &OfFields, cpu_seconds: f64) -> Value {
        let Reached { state, area, discretisation, extrapolated, displacement, .. } = reached;
        let (length, modulus) = (self.scales.length_m, self.scales.modulus_pa);
        let (problem, grid, energy) = (&self.problem, self.problem.grid, modulus * length);
        let spacing = grid.dx().max(grid.dy());
        let mut line = json!({
            "method": self.card.id,
            "nx": grid.nx,
            "ny": grid.ny,
            "precision": problem.precision,
            "threads": rayon::current_num_threads(),
            "device": Device::of(problem, self.card),
            "kernel": problem.kernel.to_string(),
            "adhesion": self.used.to_string(),
            "wall": problem.wall.to_string(),
            "gamma": self.requested.work_of_adhesion() * energy,
            "cohesive_resolution": self.requested.resolution_on(spacing),
            "range": self.used.resolution_on(spacing).map(|used| json!({
                "requested": self.requested.range() * length,
                "used": self.used.range() * length,
                "resolution_used": used,
            })),
            "resolved_gradient": self.resolved_gradient,
            "pressure": state.pressure * modulus,
            "p_star": state.pressure / self.gradient,
            "criterion": self.criterion,
            "contact_area": area.contact_area,
            "contact_nodes": area.contact_nodes,
            "contact_nodes_compressive": fields.compressive,
            "perimeter": area.perimeter / length,
            "mean_gap": state.mean_gap * length,
            "displacement": displacement * length,
            "discretisation": discretisation,
            "extrapolated": extrapolated.map(|e| json!({
                "contact_area": e.area,
                "mean_gap": e.mean_gap.map(|g| json!({ "value": g.value * length, "error": g.error * length })),
            })),
            "load_error": state.load_error,
            "residual": state.residual,
            "tolerance": problem.tolerance,
            "complementarity": state.complementarity,
            "energy": state.energy * energy,
            "elastic_energy": state.elastic_energy * energy,
            "interaction_energy": state.interaction_energy * energy,
            "error_estimates": state.error_estimates,
            "stop": state.stop.to_string(),
            "iterations": state.iterations,
            "fft_pairs": state.fft_pairs,
            "seconds": state.seconds,
            "cpu_seconds": cpu_seconds,
            "planned_bytes": self.planned_bytes,
            "measured_bytes": self.growth.bytes(),
            "peak_rss_bytes": self.growth.peak_bytes(),
        });
        if problem.ranks.are_several() {
            line["ranks"] = json!(problem.ranks.count());
        }
        self.add_errors(reached, &mut line);
        line["length_x"] = json!(grid.lx * length);
        line["length_y"] = json!(grid.ly * length);
        line["modulus"] = json!(modulus);
        line["units"] = json!({ "length": self.units.length, "stress": self.units.stress });
        line["provenance"] = json!(self.provenance);
        line["version"] = json!(env!("CARGO_PKG_VERSION"));
        if self.solve.leakage {
            self.add_leakage(fields.gap(state), reached.coarser_gaps, &mut line);
        }
        if let Some(plasticity) = state.plasticity {
            line["hardness"] = json!(problem.hardness.map(|h| h.mean() * modulus));
            if let Some(map) = &self.hardness_map {
                let (lowest, highest) = (map.lowest * modulus, map.highest * modulus);
                line["hardness_map"] = json!(HardnessMapResults { lowest, highest, ..map.clone() });
            }
            line["flowing_fraction"] = json!(plasticity.flowing);
            line["displaced_fraction"] = json!(plasticity.displaced);
            line["mean_plastic_displacement"] = json!(plasticity.displacement * length);
            line["plastic_work"] = json!(plasticity.work * energy);
        }
        line
    }

    /// Adds the contact stiffness and the stated errors to the line of a state.
    fn add_errors(&self, reached: &Reached, line: &mut Value) {
        let length = self.scales.length_m;
        let per_length = self.scales.modulus_pa / length;
        line["contact_area_error"] = json!(reached.contact_area_error());
        line["mean_gap_error"] = json!(reached.mean_gap_error().map(|e| e * length));
        line["stiffness"] = json!(reached.state.stiffness.map(|k| k * per_length));
        line["stiffness_error"] = json!(reached.stiffness_error().map(|e| e * per_length));
    }

    /// A warning for loads whose contact the grid does not resolve.
    pub(super) fn unresolved(&self) -> Option<String> {
        let changes: Vec<Option<Discretisation>> =
            self.lines.iter().map(|line| Discretisation::deserialize(&line["discretisation"]).ok()).collect();
        let loads = self.lines.iter().zip(&changes).enumerate().map(|(i, (line, change))| {
            ((i + 1).to_string(), line["contact_area"].as_f64().unwrap_or(0.0), change.as_ref())
        });
        path::unresolved_contact("load ", loads).map(|text| rename_keys_in(&text, &|key| self.solve.flag_of(key)))
    }

    /// Adds the stress below the surface to the line of a state, and writes its maps.
    fn add_subsurface(&self, i: usize, state: &Equilibrium, fields: &OfFields, line: &mut Value) -> Result<()> {
        let Some(request) = self.subsurface.as_ref().filter(|_| state.stop == Stop::Converged) else { return Ok(()) };
        let (Scales { length_m: length, modulus_pa: modulus }, grid) = (self.scales, self.problem.grid);
        let slices =
            path::subsurface(request, (grid, self.problem.kernel), fields.stress(state), |depth, quantity, values| {
                let Some(out) = &self.solve.out else { return Ok(None) };
                let map = format!("{}.npy", path::subsurface_map(quantity, depth));
                let name = file_name(i, self.loads, state.stop, &map);
                npy::write_field(&out.join(&name), grid.nx, grid.ny, Field::F64(values), modulus)?;
                Ok(Some(name))
            })?;
        line["subsurface"] = json!(slices.in_units(length, modulus));
        Ok(())
    }

    /// Adds the flow through the gap to the line of a state: conductivities as the cube of a length, and the gaps.
    fn add_leakage(&self, gap: Field, coarser: Option<([f64; 2], f64)>, line: &mut Value) {
        let cube = self.scales.length_m.powi(3);
        let flow = path::leakage(&self.problem, gap, 0.0, coarser).map(|flow| Leakage {
            gap_errors: flow.gap_errors.map(|errors| errors.map(|e| e * self.scales.length_m)),
            conductivity: flow.conductivity.map(|k| k * cube),
            effective_medium: flow.effective_medium * cube,
            ..flow
        });
        line["leakage"] = json!(flow);
        if let Some(flow) = flow {
            let [x, y] = flow.hydraulic_gaps();
            line["hydraulic_gap_x"] = json!(x);
            line["hydraulic_gap_y"] = json!(y);
            let errors = flow.gap_errors.map_or([None; 2], |errors| errors.map(Some));
            line["hydraulic_gap_x_error"] = json!(errors[0]);
            line["hydraulic_gap_y_error"] = json!(errors[1]);
            line["hydraulic_gap_effective_medium"] = json!(flow.effective_medium.cbrt());
        }
    }

    /// Reports the pull-off and writes its file. Returns its line of JSON.
    pub(super) fn pull_off(&self, pull_off: &PullOff) -> Result<Value> {
        let (length, modulus) = (self.scales.length_m, self.scales.modulus_pa);
        let curve: Vec<[f64; 2]> = pull_off.curve.iter().map(|[g, p]| [g * length, p * modulus]).collect();
        let line = json!({
            "pull_off_pressure": pull_off.pressure * modulus,
            "pull_off_pressure_error": pull_off.pressure_error.map(|e| e * modulus),
            "mean_gap": pull_off.mean_gap * length,
            "mean_gap_error": pull_off.mean_gap_error.map(|e| e * length),
            "coarser": pull_off.coarser,
            "curve": curve,
        });
        if let Some(out) = &self.solve.out {
            json::write(&out.join("pull-off.json"), &line)?;
            load_table::write_pull_off(out, &curve, &self.units)?;
        }
        self.pull_off_again(&line)?;
        Ok(line)
    }

    /// The line of a pull-off.
    pub(super) fn pull_off_again(&self, line: &Value) -> Result<()> {
        if self.solve.json {
            return output::json_line(line);
        }
        let number = |key: &str| line[key].as_f64();
        let with_error = |value: f64, error: Option<f64>, digits: usize| {
            let error = error.map_or(String::new(), |e| format!(" ± {}", significant(e, 2)));
            format!("{}{error}", significant(value, digits))
        };
        let pull = with_error(-number("pull_off_pressure").unwrap_or(f64::NAN), number("pull_off_pressure_error"), 6);
        let gap = with_error(number("mean_gap").unwrap_or(f64::NAN), number("mean_gap_error"), 4);
        let from = match &line["coarser"] {
            Value::Array(points) => format!("the changes to {} x {} points", points[0], points[1]),
            _ => "none: the error by the grid is not known".to_string(),
        };
        let rows = [("largest tension", pull), ("at the mean gap", gap), ("errors, estimated by", from)];
        output::print(&output::table(&["quantity", "value"], rows.map(|(k, v)| vec![k.to_string(), v])));
        Ok(())
    }
}

/// Rows of the stress below the surface, if it was requested.
fn below_the_surface(line: &Value, units: &ResultUnits) -> Vec<(&'static str, String)> {
    let Ok(s) = SubsurfaceResults::deserialize(&line["subsurface"]) else { return Vec::new() };
    let value_at = |p: &Peak| {
        format!("{}, {} deep", in_unit(units, p.value, Dimension::Stress), in_unit(units, p.depth, Dimension::Length))
    };
    let fraction = s.shear_over_strength.map(|fraction| ("over the shear strength", significant(fraction, 3)));
    let largest = [
        ("largest von Mises stress below", value_at(&s.von_mises)),
        ("largest shear stress below", value_at(&s.shear)),
    ];
    largest.into_iter().chain(fraction).collect()
}

/// A value with its error and unit.
fn with_error(line: &Value, key: &str, (units, dimension): (&ResultUnits, Dimension)) -> String {
    let error = line[format!("{key}_error")].as_f64().map_or(String::new(), |e| format!(" ± {}", significant(e, 2)));
    let value = in_unit(units, line[key].as_f64().unwrap_or(f64::NAN), dimension);
    match value.split_once(' ') {
        Some((number, unit)) => format!("{number}{error} {unit}"),
        None => value + &error,
    }
}

/// Rows of the flow through the gap, if it was requested.
fn leakage(line: &Value, units: &ResultUnits) -> Vec<(&'static str, String)> {
    if !line["leakage"].is_object() {
        return Vec::new();
    }
    let gap = |key: &str| with_error(line, key, (units, Dimension::Length));
    let ratio = line["leakage"]["ratio"].as_f64().map_or("–".into(), |r| significant(r, 3));
    let medium = format!("{} (flow {ratio} times that solved)", gap("hydraulic_gap_effective_medium"));
    let gaps = format!("{}, {}", gap("hydraulic_gap_x"), gap("hydraulic_gap_y"));
    vec![("equivalent hydraulic gap along x, y", gaps), ("in effective-medium theory", medium)]
}

/// A state for people, from its line of JSON.
fn table(line: &Value, range: RangeChoice, units: &ResultUnits) -> String {
    let number = |value: &Value| value.as_f64().unwrap_or(f64::NAN);
    let plain = |key: &str, digits: usize| significant(number(&line[key]), digits);
    let power = |key: &str| format!("{:.1e}", number(&line[key]));
    // Separated surfaces have no equilibrium: the last iterate is no result.
    let separated = line["stop"] == Stop::Detached.to_string();
    let of_contact = |text: String| if separated { "–".to_string() } else { text };
    let sized = |key: &str, dimension| of_contact(in_unit(units, number(&line[key]), dimension));
    let mut rows = vec![
        ("mean pressure", in_unit(units, number(&line["pressure"]), Dimension::Stress)),
        ("contact is", line["criterion"].as_str().unwrap_or_default().to_string()),
        ("contact area", of_contact(share(line, "contact_area") + " of the cell")),
        ("contact nodes", of_contact(percent(number(&line["contact_nodes"])))),
    ];
    if let Some(presses) = line["contact_nodes_compressive"].as_f64() {
        rows.push(("part under compression", of_contact(percent(presses))));
    }
    rows.push(("mean gap", of_contact(with_error(line, "mean_gap", (units, Dimension::Length)))));
    rows.push(("displacement from first contact", sized("displacement", Dimension::Length)));
    if line["stiffness"].is_number() {
        rows.push(("contact stiffness", of_contact(with_error(line, "stiffness", (units, Dimension::Stiffness)))));
    }
    rows.extend(leakage(line, units));
    if line["flowing_fraction"].is_number() {
        rows.push(("flowing at the hardness", of_contact(percent(number(&line["flowing_fraction"])))));
        rows.push(("mean plastic displacement", sized("mean_plastic_displacement", Dimension::Length)));
        rows.push(("plastic work per area", sized("plastic_work", Dimension::Work)));
    }
    rows.extend(below_the_surface(line, units));
    rows.push(("energy per area", sized("energy", Dimension::Work)));
    if let Ok(d) = Discretisation::deserialize(&line["discretisation"]) {
        let [nx, ny] = d.coarser;
        let gap = change(d.mean_gap, d.mean_gap_is_bound);
        let area = change(d.area, d.area_is_bound);
        rows.push(("error by the grid: contact area", format!("{area}, from {nx} x {ny} points")));
        rows.push(("error by the grid: mean gap", gap));
    }
    let enlarged = line["range"]["requested"] != line["range"]["used"];
    if range == RangeChoice::Extrapolate && enlarged && !separated && line["extrapolated"].is_null() {
        rows.push(("at the true range", "not extrapolated: three grids as coarse as these differ by too much".into()));
    }
    if let Some(e) = line["extrapolated"].as_object() {
        let value_of = |key: &str| e.get(key).map(|v| (number(&v["value"]), number(&v["error"])));
        if let Some((area, error)) = value_of("contact_area") {
            let contact = format!("{} ± {} % of the cell", significant(100.0 * area, 3), significant(100.0 * error, 2));
            rows.push(("at the true range: contact", contact));
        }
        if let Some((gap, error)) = value_of("mean_gap").filter(|g| g.0.is_finite()) {
            rows.push(("at the true range: mean gap", format!("{} ± {}", significant(gap, 6), significant(error, 2))));
        }
    }
    if let Some(range) = line["range"].as_object() {
        let value_of = |key: &str| range.get(key).map_or(f64::NAN, number);
        rows.push(("work of adhesion", plain("gamma", 4)));
        rows.push(("requested range of adhesion", significant(value_of("requested"), 4)));
        rows.push(("range used on this grid", significant(value_of("used"), 4)));
    }
    rows.extend([
        ("rms gradient on this grid", plain("resolved_gradient", 4)),
        ("load error", of_contact(power("load_error"))),
        ("KKT residual over pressure", of_contact(power("residual"))),
        ("stop", line["stop"].as_str().unwrap_or_default().to_string()),
        ("iterations, FFT pairs", format!("{}, {:.1}", line["iterations"], number(&line["fft_pairs"]))),
        (
            "time, peak memory",
            format!(
                "{}, {}",
                duration(number(&line["seconds"])),
                memory(line["peak_rss_bytes"].as_u64().unwrap_or_default())
            ),
        ),
    ]);
    output::table(&["quantity", "value"], rows.into_iter().map(|(k, v)| vec![k.to_string(), v]))
}

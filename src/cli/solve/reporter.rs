//! Results of `solve`, as tables and as JSON.

use super::SolveArgs;
use super::curve::{self, Further, SolveNotation, in_unit, share, si_unit};
use super::fields::{FieldWriter, OfFields, file_name};
use super::solved::{Solved, state_of_line};
use crate::Result;
use crate::cli::output;
use crate::record::load_table::{self, ResultUnits};
use crate::report::number::{self, change, duration, memory, percent, significant};
use crate::scene::{Case, rename_keys_in};
use asperity_contact::interface::{AttractionLaw, RangeChoice, SubsurfaceRequest};
use asperity_contact::load::{LoadStep, Stop};
use asperity_contact::method::{Device, Equilibrium, MethodCard, ReducedProblem};
use asperity_contact::path::{self, LoadPathSolver, Reached};
use asperity_contact::results::{HardnessMapResults, PullOff};
use asperity_contact::state::{Peak, State, SubsurfaceResults, TrivialLoads};
use asperity_grid::Field;
use asperity_grid::sys::MemoryGrowth;
use asperity_grid::units::{Dimension, Scales};
use asperity_surface::Surface;
use asperity_surface::files::{json, npy};
use asperity_surface::provenance::Provenance;
use serde_json::{Value, json};

/// Reports the states of one solve in the units of its command line.
pub(super) struct SolveReporter<'a> {
    solve: &'a SolveArgs,
    /// Whether states are printed as they are solved.
    shows: bool,
    /// Of the results: the units of the command line.
    scales: Scales,
    units: ResultUnits,
    /// rms gradient, reduced.
    gradient: f64,
    steps: Vec<LoadStep>,
    provenance: Option<Provenance>,
    /// As requested, and as used by the method on this grid.
    requested: AttractionLaw,
    used: AttractionLaw,
    problem: ReducedProblem<'a>,
    subsurface: Option<SubsurfaceRequest>,
    fields: FieldWriter<'a>,
    /// Of a hardness that is a map, over E*.
    hardness_map: Option<HardnessMapResults>,
    /// In the units of the command line.
    surface: Surface,
    card: &'static MethodCard,
    criterion: String,
    pub resolved_gradient: f64,
    planned_bytes: u64,
    growth: MemoryGrowth,
    pub loads: usize,
    /// Each state so far, and its line of JSON.
    states: Vec<State>,
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
        (solve, shows): (&'a SolveArgs, bool),
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
            shows,
            scales: case.scales,
            units: solve.units(case),
            gradient: case.gradient,
            steps: case.load_steps().to_vec(),
            provenance: case.provenance().cloned(),
            requested: requested.adhesion,
            used: path.adhesion(),
            card: path.method().card(),
            criterion: path.method().criterion(&problem.settings).to_string(),
            problem,
            subsurface: case.subsurface(),
            fields: FieldWriter::new(solve, case, path, loads),
            hardness_map: case.hardness_map.clone(),
            surface: case.problem.surface.clone(),
            resolved_gradient,
            planned_bytes,
            growth,
            loads,
            states: Vec::new(),
            lines: Vec::new(),
            cpu,
        }
    }

    /// Reports a state of an interrupted or finished solve.
    pub(super) fn again(&mut self, line: Value) -> Result<()> {
        self.report(state_of_line(&line)?, line)
    }

    fn report(&mut self, state: State, line: Value) -> Result<()> {
        if self.shows {
            show_state(self.solve, &self.units, (self.lines.len(), self.loads), (&state, &line))?;
        }
        self.states.push(state);
        self.lines.push(line);
        match &self.solve.out {
            Some(out) => {
                // The first that does not converge is the last: it is no point of the curve.
                let points = self.states.iter().take_while(|s| s.stop == Stop::Converged).count();
                if points == 0 { Ok(()) } else { load_table::write(out, &self.states[..points], &self.units) }
            }
            None => Ok(()),
        }
    }

    /// Reports a state and writes its files. Returns its line of JSON.
    pub(super) fn state(&mut self, i: usize, reached: &Reached) -> Result<Value> {
        let previous = std::mem::replace(&mut self.cpu, asperity_grid::sys::cpu_seconds());
        let fields = self.fields.state(i, &reached.state)?;
        let (length, modulus) = (self.scales.length_m, self.scales.modulus_pa);
        let flow = || reached.leakage(&self.problem, fields.gap(&reached.state), 0.0, &self.steps[i]);
        let state = State {
            contact_nodes_compressive: fields.compressive,
            leakage: self.solve.leakage.then(flow).flatten(),
            subsurface: self.subsurface(i, &reached.state, &fields)?,
            ..reached.numbers(&self.steps[i], self.gradient, &self.criterion)
        };
        let state = state.in_units(length, modulus);
        let line = self.line(&state, self.cpu - previous);
        if let Some(out) = &self.solve.out {
            json::write(&out.join(file_name(i, self.loads, state.stop, "solve.json")), &line)?;
        }
        self.report(state, line.clone())?;
        Ok(line)
    }

    /// The line of JSON of a state: the state, and what describes problem and machine.
    fn line(&self, state: &State, cpu_seconds: f64) -> Value {
        let Scales { length_m: length, modulus_pa: modulus } = self.scales;
        let (problem, grid) = (&self.problem, self.problem.grid);
        let spacing = grid.dx().max(grid.dy());
        let ranks = problem.ranks.are_several().then(|| problem.ranks.count());
        let notation = SolveNotation { units: &self.units, scales: self.scales };
        let about = json!({
            "method": self.card.id,
            "nx": grid.nx,
            "ny": grid.ny,
            "length_x": grid.lx * length,
            "length_y": grid.ly * length,
            "modulus": modulus,
            "units": self.units_of_line(),
            "precision": problem.precision,
            "threads": rayon::current_num_threads(),
            "device": Device::of(problem, self.card),
            "kernel": problem.kernel.described(&notation),
            "adhesion": self.used.described(&notation),
            "wall": problem.wall.described(&notation),
            "gamma": self.requested.work_of_adhesion() * modulus * length,
            "cohesive_resolution": self.requested.resolution_on(spacing),
            "range": self.used.resolution_on(spacing).map(|used| json!({
                "requested": self.requested.range() * length,
                "used": self.used.range() * length,
                "resolution_used": used,
            })),
            "resolved_gradient": self.resolved_gradient,
            "tolerance": problem.tolerance,
            "cpu_seconds": cpu_seconds,
            "planned_bytes": self.planned_bytes,
            "measured_bytes": self.growth.bytes(),
            "peak_rss_bytes": self.growth.peak_bytes(),
            "provenance": self.provenance,
            "version": env!("CARGO_PKG_VERSION"),
        });
        let mut line = with(state, about);
        if let Some(ranks) = ranks {
            line["ranks"] = json!(ranks);
        }
        if let Some(flow) = state.leakage {
            let ([x, y], errors) = (flow.hydraulic_gaps(), flow.gap_errors);
            line["hydraulic_gap_x"] = json!(x);
            line["hydraulic_gap_y"] = json!(y);
            line["hydraulic_gap_x_error"] = json!(errors.map(|e| e[0]));
            line["hydraulic_gap_y_error"] = json!(errors.map(|e| e[1]));
            line["hydraulic_gap_effective_medium"] = json!(flow.effective_medium.cbrt());
        }
        if let Some(hardness) = problem.hardness {
            line["hardness"] = json!(hardness.mean() * modulus);
            if let Some(map) = &self.hardness_map {
                line["hardness_map"] = json!(map.clone().in_units(modulus));
            }
        }
        line
    }

    fn units_of_line(&self) -> Value {
        json!({ "length": self.units.length, "stress": self.units.stress })
    }

    /// Warnings of [`doubtful`].
    pub(super) fn doubtful(&self) -> Vec<String> {
        let list = if self.shows { doubtful(&self.states) } else { Vec::new() };
        list.iter().map(|text| rename_keys_in(text, &|key| self.solve.flag_of(key))).collect()
    }

    /// The stress below the surface of a state, if it was requested; writes its maps.
    fn subsurface(&self, i: usize, state: &Equilibrium, fields: &OfFields) -> Result<Option<SubsurfaceResults>> {
        let Some(request) = self.subsurface.as_ref().filter(|_| state.stop == Stop::Converged) else { return Ok(None) };
        let (modulus, grid) = (self.scales.modulus_pa, self.problem.grid);
        let body = (grid, self.problem.kernel);
        let results = path::subsurface(request, body, fields.stress(state), |depth, quantity, values| {
            let Some(out) = &self.solve.out else { return Ok(None) };
            let map = format!("{}.npy", path::subsurface_map(quantity, depth));
            let name = file_name(i, self.loads, state.stop, &map);
            npy::write_field(&out.join(&name), grid.nx, grid.ny, Field::F64(values), modulus)?;
            Ok(Some(name))
        })?;
        Ok(Some(results))
    }

    /// Reports the pull-off and writes its file. Returns its line of JSON.
    pub(super) fn pull_off(&self, pull_off: &PullOff) -> Result<Value> {
        let found = pull_off.clone().in_units(self.scales.length_m, self.scales.modulus_pa).on(&self.surface);
        let line = json!({
            "units": self.units_of_line(),
            "pull_off_pressure": found.pressure,
            "pull_off_pressure_error": found.pressure_error,
            "pull_off_force": found.force,
            "mean_gap": found.mean_gap,
            "mean_gap_error": found.mean_gap_error,
            "coarser": found.coarser,
            "curve": found.curve,
        });
        if let Some(out) = &self.solve.out {
            json::write(&out.join("pull-off.json"), &line)?;
            load_table::write_pull_off(out, &found.curve, &self.units)?;
        }
        self.pull_off_again(&line)?;
        Ok(line)
    }

    /// Shows the line of a pull-off.
    pub(super) fn pull_off_again(&self, line: &Value) -> Result<()> {
        if self.shows { show_pull_off(self.solve.json, &self.units, line) } else { Ok(()) }
    }

    /// All results.
    pub(super) fn solved(self, pull_off: Option<Value>) -> Solved {
        Solved { states: self.states, lines: self.lines, pull_off, earlier_seconds: None }
    }
}

/// Warnings for loads whose contact the grid does not resolve, with keys of scenes, and for those at which nothing touches or everything.
pub(super) fn doubtful(states: &[State]) -> Vec<String> {
    let numbered = states.iter().enumerate();
    let loads = numbered.map(|(i, s)| ((i + 1).to_string(), s.contact_area, s.discretisation.as_ref()));
    path::unresolved_contact("load ", loads).into_iter().chain(TrivialLoads::of(states).warnings()).collect()
}

/// Prints all states.
pub(super) fn show_states(solve: &SolveArgs, units: &ResultUnits, states: &[State], lines: &[Value]) -> Result<()> {
    let mut each = states.iter().zip(lines).enumerate();
    each.try_for_each(|(i, shown)| show_state(solve, units, (i, states.len()), shown))
}

/// Prints state `i` of `loads`: as a line of JSON, as a table, or as a row of the table of all.
fn show_state(
    solve: &SolveArgs,
    units: &ResultUnits,
    (i, loads): (usize, usize),
    (state, line): (&State, &Value),
) -> Result<()> {
    if solve.json {
        return output::json_line(line);
    }
    if loads == 1 {
        output::print(&table(state, line, solve, units));
        return Ok(());
    }
    let (state, units) = solve.in_unit_of_loads(state, units);
    let further = Further {
        leakage: solve.leakage,
        plasticity: solve.hardness.is_some()
            || solve.hardness_map.is_some()
            || solve.body.iter().any(|b| b.hardness.is_some()),
        subsurface: state.subsurface.is_some(),
    };
    if i == 0 {
        output::print(&curve::head(&units, &further));
    }
    output::print(&curve::line(i + 1, &state, &units, &further));
    Ok(())
}

/// Prints the line of a pull-off.
pub(super) fn show_pull_off(as_json: bool, units: &ResultUnits, line: &Value) -> Result<()> {
    if as_json {
        return output::json_line(line);
    }
    let number = |key: &str| line[key].as_f64();
    let pressure = -number("pull_off_pressure").unwrap_or(f64::NAN);
    let pull = with_error(pressure, number("pull_off_pressure_error"), (units, Dimension::Stress));
    let mean_gap = number("mean_gap").unwrap_or(f64::NAN);
    let gap = with_error(mean_gap, number("mean_gap_error"), (units, Dimension::Length));
    let from = match &line["coarser"] {
        Value::Array(points) => format!("the changes to {} x {} points", points[0], points[1]),
        _ => "none: the error by the grid is not known".to_string(),
    };
    // Their relative errors are the same.
    let force = number("pull_off_force").map(|force| {
        let error = number("pull_off_pressure_error").map(|e| -e * force / pressure);
        with_error(-force, error, (units, Dimension::Force))
    });
    let force = force.map(|force| ("as a force on the map", force));
    let rows = [("at the mean gap", gap), ("errors, estimated by", from)];
    let rows = [("largest tension", pull)].into_iter().chain(force).chain(rows);
    output::print(&output::table(&["quantity", "value"], rows.map(|(k, v)| vec![k.to_string(), v])));
    Ok(())
}

/// A state with further keys.
pub(super) fn with(state: &State, mut about: Value) -> Value {
    if let (Ok(Value::Object(state)), Some(about)) = (serde_json::to_value(state), about.as_object_mut()) {
        about.extend(state);
    }
    about
}

/// Rows of the stress below the surface, if it was requested.
fn below_the_surface(s: &State, units: &ResultUnits) -> Vec<(&'static str, String)> {
    let Some(s) = &s.subsurface else { return Vec::new() };
    let peak_text = |p: &Peak| {
        format!("{}, {} deep", in_unit(units, p.value, Dimension::Stress), in_unit(units, p.depth, Dimension::Length))
    };
    let fraction = s.shear_over_strength.map(|fraction| ("over the shear strength", significant(fraction, 3)));
    let largest = [
        ("largest von Mises stress below", peak_text(&s.von_mises)),
        ("largest shear stress below", peak_text(&s.shear)),
    ];
    largest.into_iter().chain(fraction).collect()
}

/// A value with its error and unit.
fn with_error(value: f64, error: Option<f64>, (units, dimension): (&ResultUnits, Dimension)) -> String {
    match (error, si_unit(units, dimension)) {
        (None, _) => in_unit(units, value, dimension),
        (Some(error), Some((of_unit, unit))) => {
            let (value, error) = number::with_error(value * of_unit, error * of_unit, unit);
            value + &error
        }
        (Some(error), None) => {
            let unit = units.of(dimension).map_or(String::new(), |unit| format!(" {}", unit.replace('_', " ")));
            number::to_error(value, error) + &unit
        }
    }
}

/// Rows of the flow through the gap, if it was requested.
fn leakage(s: &State, units: &ResultUnits) -> Vec<(&'static str, String)> {
    let Some(flow) = s.leakage else { return Vec::new() };
    let [x, y] = flow.hydraulic_gaps();
    let [error_x, error_y] = flow.gap_errors.map_or([None; 2], |errors| errors.map(Some));
    let gap = |value: f64, error: Option<f64>| with_error(value, error, (units, Dimension::Length));
    let ratio = flow.ratio.map_or("–".into(), |r| significant(r, 3));
    let medium = format!("{} (flow {ratio} times that solved)", gap(flow.effective_medium.cbrt(), None));
    let gaps = format!("{}, {}", gap(x, error_x), gap(y, error_y));
    vec![("equivalent hydraulic gap along x, y", gaps), ("in effective-medium theory", medium)]
}

/// Rows of the numbers at the true range of the adhesion.
fn at_the_true_range(s: &State, line: &Value, range: RangeChoice) -> Vec<(&'static str, String)> {
    let enlarged = line["range"]["requested"] != line["range"]["used"];
    let Some(e) = s.extrapolated else {
        let missing = range == RangeChoice::Extrapolate && enlarged && s.stop != Stop::Detached;
        let reason = "not extrapolated: three grids as coarse as these differ by too much";
        return if missing { vec![("at the true range", reason.into())] } else { Vec::new() };
    };
    let contact = [(e.area.value, 3), (e.area.error, 2)].map(|(v, digits)| significant(100.0 * v, digits));
    let gap = e.mean_gap.map(|g| format!("{} ± {}", significant(g.value, 6), significant(g.error, 2)));
    let contact = ("at the true range: contact", format!("{} ± {} % of the cell", contact[0], contact[1]));
    std::iter::once(contact).chain(gap.map(|gap| ("at the true range: mean gap", gap))).collect()
}

/// A state for people; `line` also describes the problem.
fn table(s: &State, line: &Value, solve: &SolveArgs, in_line: &ResultUnits) -> String {
    let (s, units) = &solve.in_unit_of_loads(s, in_line);
    let number = |value: &Value| value.as_f64().unwrap_or(f64::NAN);
    let power = |value: f64| format!("{value:.1e}");
    // Separated surfaces have no equilibrium: the last iterate is no result.
    let of_contact = |text: String| if s.stop == Stop::Detached { "–".to_string() } else { text };
    let sized = |value: f64, dimension| of_contact(in_unit(units, value, dimension));
    let mut rows = vec![
        ("mean pressure", in_unit(units, s.pressure, Dimension::Stress)),
        ("contact is", s.criterion.clone()),
        ("contact area", of_contact(share(s) + " of the cell")),
    ];
    if let Some(force) = &units.force {
        let unit = force.unit.as_ref().map_or(String::new(), |unit| format!(" {unit}"));
        rows.insert(0, ("normal force", significant(force.of(s), 6) + &unit));
    }
    rows.extend(s.contact_nodes.map(|n| ("contact nodes", of_contact(percent(n)))));
    rows.extend(s.contact_nodes_compressive.map(|n| ("part under compression", of_contact(percent(n)))));
    let with_error = |value: f64, error, dimension| of_contact(with_error(value, error, (units, dimension)));
    rows.extend(s.mean_gap.map(|gap| ("mean gap", with_error(gap, s.mean_gap_error, Dimension::Length))));
    rows.extend(s.displacement.map(|d| ("displacement from first contact", sized(d, Dimension::Length))));
    rows.extend(s.stiffness.map(|k| ("contact stiffness", with_error(k, s.stiffness_error, Dimension::Stiffness))));
    rows.extend(leakage(s, units));
    if let Some(p) = s.plasticity {
        rows.push(("flowing at the hardness", of_contact(percent(p.flowing))));
        rows.push(("mean plastic displacement", sized(p.displacement, Dimension::Length)));
        rows.push(("plastic work per area", sized(p.work, Dimension::Work)));
    }
    rows.extend(below_the_surface(s, units));
    rows.extend(s.energy.map(|e| ("energy per area", sized(e, Dimension::Work))));
    if let Some(d) = s.discretisation {
        let [nx, ny] = d.coarser;
        let area = change(d.area, d.area_is_bound);
        rows.push(("error by the grid: contact area", format!("{area}, from {nx} x {ny} points")));
        rows.push(("error by the grid: mean gap", change(d.mean_gap, d.mean_gap_is_bound)));
    }
    rows.extend(at_the_true_range(s, line, solve.resolution));
    if line["range"].is_object() {
        rows.push(("work of adhesion", in_unit(in_line, number(&line["gamma"]), Dimension::Work)));
        rows.push((
            "requested range of adhesion",
            in_unit(units, number(&line["range"]["requested"]), Dimension::Length),
        ));
        rows.push(("range used on this grid", in_unit(units, number(&line["range"]["used"]), Dimension::Length)));
    }
    let memory = memory(line["peak_rss_bytes"].as_u64().unwrap_or_default());
    rows.push(("rms gradient on this grid", significant(number(&line["resolved_gradient"]), 4)));
    rows.push(("load error", of_contact(power(s.load_error))));
    rows.extend(s.residual.map(|r| ("KKT residual over pressure", of_contact(power(r)))));
    rows.extend([
        ("stop", s.stop.to_string()),
        ("iterations, FFT pairs", format!("{}, {:.1}", s.iterations, s.fft_pairs)),
        ("time, peak memory", format!("{}, {memory}", duration(s.seconds))),
    ]);
    output::table(&["quantity", "value"], rows.into_iter().map(|(k, v)| vec![k.to_string(), v]))
}

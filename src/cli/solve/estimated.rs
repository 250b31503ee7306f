//! Loads by a method that estimates instead of solving for the fields.

use super::curve::{SolveNotation, in_unit};
use super::fields::load_name;
use super::reporter::with;
use super::solved::Solved;
use super::{SolveArgs, cache};
use crate::Result;
use crate::cli::output;
use crate::cli::progress::TerminalProgress;
use crate::pipeline::ProgressReporter;
use crate::record::load_table::{self, ResultUnits};
use crate::report::number::{duration, memory, percent, significant};
use crate::scene::Case;
use asperity_contact::estimated::{never_delivered, set_stiffness, state_of};
use asperity_contact::interface::AttractionLaw;
use asperity_contact::load::Load;
use asperity_contact::method::{Heights, Quantity};
use asperity_contact::path::EstimatorInput;
use asperity_contact::state::State;
use asperity_grid::Field;
use asperity_grid::units::{Dimension, Scales};
use asperity_surface::files::{json, npy};
use serde_json::{Value, json};

pub(super) fn run(solve: &SolveArgs, case: &Case, heights: Heights, progress: &TerminalProgress) -> Result<()> {
    let method = asperity_methods::find(&solve.method).expect("checked with the scene");
    let steps = case.load_steps();
    let loads: Vec<Load> = steps.iter().map(|step| step.target).collect();
    let problem = &case.problem(heights);
    let card = method.card();
    let (plan, available) = (EstimatorInput::plan(problem, method), asperity_grid::sys::available_memory_bytes());
    let grid = problem.grid;
    solve.print_plan(method, grid, plan.bytes, available)?;
    if solve.dry_run {
        return Ok(());
    }
    // On a surface other than this one.
    card.measured_errors.iter().for_each(|errors| progress.note(&format!("{}: measured errors: {errors}", card.id)));
    let key = solve.key(None)?;
    if let Some(out) = &solve.out {
        solve.open_folder(out, &key)?;
        cache::clear(out, None)?;
    }
    let (mut states, mut about_states) = (Vec::new(), Vec::new());
    let watch = ProgressReporter::new(progress, None, "", (0, loads.len()));
    let resolved_gradient = problem.resolved_gradient();
    let criterion = method.criterion(&problem.settings).to_string();
    let Scales { length_m: length, modulus_pa: modulus } = case.scales;
    let units = solve.units(case);
    let growth = asperity_grid::sys::MemoryGrowth::begin();
    let mut cpu = asperity_grid::sys::cpu_seconds();
    let input = EstimatorInput::new(problem.clone(), method)?;
    let walked = input.walk((&loads, 0), &watch, |i, problem, estimate| {
        // Before anything is counted in what was found.
        let (previous, measured) = (std::mem::replace(&mut cpu, asperity_grid::sys::cpu_seconds()), growth.bytes());
        let state = state_of(card, problem, (&steps[i], case.gradient, &criterion), estimate);
        let mut state = state.in_units(length, modulus);
        // What the method never gives, besides what it does not give at this load.
        state.missing.extend(never_delivered(card, problem.adhesion != AttractionLaw::None));
        let (used, notation) = (method.adhesion(problem), SolveNotation { units: &units, scales: case.scales });
        let about = json!({
            "method": card.id,
            "nx": grid.nx,
            "ny": grid.ny,
            "kernel": problem.kernel.described(&notation),
            "adhesion": used.described(&notation),
            "gamma": problem.adhesion.work_of_adhesion() * modulus * length,
            "range": used.range() * length,
            "calibrated_on": method.calibrated_on(&problem.settings),
            "measured_errors": card.measured_errors,
            "resolved_gradient": resolved_gradient,
            "cpu_seconds": cpu - previous,
            "planned_bytes": plan.bytes,
            "measured_bytes": measured,
            "peak_rss_bytes": growth.peak_bytes(),
            "provenance": case.provenance(),
        });
        if let Some(out) = &solve.out {
            let name = |name: &str| name_of(i, loads.len(), name);
            for (file, field, unit) in [("gap.npy", estimate.gap, length), ("stress.npy", estimate.stress, modulus)] {
                if let Some(field) = field {
                    npy::write_field(&out.join(name(file)), grid.nx, grid.ny, Field::F64(field), unit)?;
                }
            }
            if let Some(map) = estimate.contact {
                npy::write(&out.join(name("contact.npy")), grid.nx, grid.ny, map.iter().copied())?;
            }
        }
        states.push(state);
        about_states.push(about);
        watch.next();
        Ok(())
    });
    // Once all loads are known, from which the stiffness follows.
    set_stiffness(&mut states);
    let lines: Vec<Value> = states.iter().zip(about_states).map(|(state, about)| with(state, about)).collect();
    show((solve, loads.len()), (&states, &lines), &units)?;
    walked?;
    let Some(out) = &solve.out else { return Ok(()) };
    load_table::write(out, &states, &units)?;
    solve.finish(out, key, &Solved { states, lines, ..Solved::default() }, None)
}

/// Prints the loads that were estimated of `count`, and writes what describes them.
fn show((solve, count): (&SolveArgs, usize), (states, lines): (&[State], &[Value]), units: &ResultUnits) -> Result<()> {
    for (i, (state, line)) in states.iter().zip(lines).enumerate() {
        if let Some(out) = &solve.out {
            json::write(&out.join(name_of(i, count, "solve.json")), line)?;
        }
        if solve.json {
            output::json_line(line)?;
        } else {
            output::print(&table(state, line, units));
        }
    }
    Ok(())
}

/// Name of a file of load `i` of `count`.
fn name_of(i: usize, count: usize, name: &str) -> String {
    if count == 1 { name.to_string() } else { format!("{}-{name}", load_name(i, count)) }
}

/// A state for people; `line` also describes the problem.
fn table(s: &State, line: &Value, units: &ResultUnits) -> String {
    let missing = |quantity: Quantity| match s.missing.get(&quantity) {
        Some(reason) => format!("– ({reason})"),
        None => "–".to_string(),
    };
    let sized = |dimension| move |value: f64| in_unit(units, value, dimension);
    let area =
        |a: f64| significant(a, 6) + &units.of(Dimension::Length).map_or(String::new(), |unit| format!(" {unit}²"));
    let of_problem = |key: &str| line[key].as_f64().unwrap_or(f64::NAN);
    let median = s.observed.as_ref().and_then(|o| o.median_cluster_area);
    let mut rows = vec![
        ("method", line["method"].as_str().unwrap_or_default().to_string()),
        ("mean pressure", sized(Dimension::Stress)(s.pressure)),
        ("contact is", s.criterion.clone()),
        ("contact", percent(s.contact_area)),
    ];
    if line["gamma"].as_f64().is_some_and(|g| g > 0.0) {
        rows.push(("work of adhesion", sized(Dimension::Work)(of_problem("gamma"))));
        rows.push(("range of adhesion", sized(Dimension::Length)(of_problem("range"))));
    }
    let memory = memory(line["peak_rss_bytes"].as_u64().unwrap_or_default());
    rows.extend([
        ("mean gap", s.mean_gap.map_or_else(|| missing(Quantity::MeanGap), sized(Dimension::Length))),
        ("median cluster area", median.map_or_else(|| missing(Quantity::ClusterPdf), area)),
        ("rms gradient on this grid", significant(of_problem("resolved_gradient"), 4)),
        ("load error", format!("{:.1e}", s.load_error)),
        ("time, peak memory", format!("{}, {memory}", duration(s.seconds))),
    ]);
    if let Some(fitted) = line["calibrated_on"].as_str() {
        rows.push(("its constants are fitted to", fitted.to_string()));
    }
    output::table(&["quantity", "value"], rows.into_iter().map(|(k, v)| vec![k.to_string(), v]))
}

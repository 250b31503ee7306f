//! Loads by a method that estimates instead of solving for the fields.

use super::fields::load_name;
use super::{SolveArgs, cache};
use crate::Result;
use crate::cli::output;
use crate::cli::progress::TerminalProgress;
use crate::pipeline::{ProgressReporter, state_of};
use crate::record::load_table;
use crate::report::number::{duration, memory, percent, significant};
use crate::scene::Case;
use asperity_contact::interface::AttractionLaw;
use asperity_contact::load::{Load, LoadStep};
use asperity_contact::method::{ContactMethod, Heights, MethodEstimate, Quantity, ReducedProblem};
use asperity_contact::path::EstimatorInput;
use asperity_grid::Field;
use asperity_grid::units::Scales;
use asperity_surface::files::{json, npy};
use serde_json::{Value, json};

pub(super) fn run(solve: &SolveArgs, case: &Case, heights: Heights, progress: &TerminalProgress) -> Result<()> {
    let method = asperity_methods::find(&solve.method).expect("checked with the scene");
    let loads: Vec<Load> = case.load_steps().iter().map(|step| step.target).collect();
    let requested = &case.problem(heights);
    let card = method.card();
    let (plan, available) = (EstimatorInput::plan(requested, method), asperity_grid::sys::available_memory_bytes());
    let grid = requested.grid;
    solve.print_plan(method, grid, plan.bytes, available)?;
    if solve.dry_run {
        return Ok(());
    }
    // On a surface other than this one.
    card.measured_errors.iter().for_each(|errors| progress.note(&format!("{}: measured errors: {errors}", card.id)));
    let key = solve.key()?;
    if let Some(out) = &solve.out {
        solve.open_folder(out, &key)?;
        cache::clear(out, None)?;
    }
    let mut lines = Vec::new();
    let watch = ProgressReporter::new(progress, None, "", (0, loads.len()));
    let resolved_gradient = requested.resolved_gradient();
    let growth = asperity_grid::sys::MemoryGrowth::begin();
    let mut cpu = asperity_grid::sys::cpu_seconds();
    let input = EstimatorInput::new(requested.clone(), method)?;
    input.walk((&loads, 0), &watch, |i, problem, estimate| {
        // Before anything is counted in what was found.
        let (previous, measured) = (std::mem::replace(&mut cpu, asperity_grid::sys::cpu_seconds()), growth.bytes());
        let mut line = line(case.scales, method, problem, estimate);
        line["method"] = json!(card.id);
        line["criterion"] = json!(method.criterion(&problem.settings).to_string());
        line["calibrated_on"] = json!(method.calibrated_on(&problem.settings));
        line["measured_errors"] = json!(card.measured_errors);
        line["resolved_gradient"] = json!(resolved_gradient);
        line["cpu_seconds"] = json!(cpu - previous);
        line["planned_bytes"] = json!(plan.bytes);
        line["measured_bytes"] = json!(measured);
        line["peak_rss_bytes"] = json!(growth.peak_bytes());
        let adhesive = problem.adhesion != AttractionLaw::None;
        line["provenance"] = json!(case.provenance());
        // What the method never gives, and what it does not give at this load.
        let never = Quantity::OUTPUTS
            .into_iter()
            .filter_map(|q| Some((q.id().to_string(), Value::from(card.unsupported_reason(q, adhesive)?))));
        let here = line["missing"].as_object().into_iter().flatten().map(|(q, reason)| (q.clone(), reason.clone()));
        line["missing"] = never.chain(here).collect();
        if let Some(out) = &solve.out {
            let name = |name: &str| match loads.len() {
                1 => name.to_string(),
                n => format!("{}-{name}", load_name(i, n)),
            };
            for (file, field, unit) in [
                ("gap.npy", estimate.gap, case.scales.length_m),
                ("stress.npy", estimate.stress, case.scales.modulus_pa),
            ] {
                if let Some(field) = field {
                    npy::write_field(&out.join(name(file)), grid.nx, grid.ny, Field::F64(field), unit)?;
                }
            }
            if let Some(map) = estimate.contact {
                npy::write(&out.join(name("contact.npy")), grid.nx, grid.ny, map.iter().copied())?;
            }
            json::write(&out.join(name("solve.json")), &line)?;
        }
        if solve.json {
            output::json_line(&line)?;
        } else {
            output::print(&table(&line));
        }
        lines.push(line);
        watch.next();
        Ok(())
    })?;
    let Some(out) = &solve.out else { return Ok(()) };
    load_table::write(out, &lines, &solve.units(case))?;
    solve.finish(out, key, lines, None)
}

fn line(scales: Scales, method: &dyn ContactMethod, problem: &ReducedProblem, estimate: &MethodEstimate) -> Value {
    let (length, modulus, grid) = (scales.length_m, scales.modulus_pa, problem.grid);
    let state = state_of(method.card(), problem, (&LoadStep::single(estimate.pressure, 1.0), 1.0), estimate);
    let used = method.adhesion(problem);
    json!({
        "nx": grid.nx,
        "ny": grid.ny,
        "kernel": problem.kernel.to_string(),
        "adhesion": used.to_string(),
        "gamma": problem.adhesion.work_of_adhesion() * modulus * length,
        "range": used.range() * length,
        "pressure": estimate.pressure * modulus,
        "contact_area": state.numbers.contact_area,
        "contact_nodes": state.contact_nodes,
        "mean_gap": state.mean_gap.map(|g| g * length),
        "stiffness": state.numbers.stiffness.map(|k| k * modulus / length),
        "patches": state.numbers.patches,
        "missing": state.missing.iter().map(|m| (m.quantity.clone(), Value::from(m.reason.as_str()))).collect::<Value>(),
        "median_cluster_area": state.median_cluster_area.map(|a| a * length * length),
        "load_error": state.numbers.load_error,
        "stop": state.numbers.stop,
        "iterations": state.numbers.iterations,
        "fft_pairs": state.numbers.fft_pairs,
        "seconds": state.numbers.seconds,
    })
}

/// A state for people, from its line of JSON.
fn table(line: &Value) -> String {
    let missing = |quantity: &str| match line["missing"][quantity].as_str() {
        Some(reason) => format!("– ({reason})"),
        None => "–".to_string(),
    };
    let or_reason = |key: &str, quantity: &str, show: &dyn Fn(f64) -> String| {
        line[key].as_f64().map_or_else(|| missing(quantity), show)
    };
    let plain = |v: f64| significant(v, 6);
    let text = |key: &str| line[key].as_str().unwrap_or_default().to_string();
    let mut rows = vec![
        ("method", text("method")),
        ("mean pressure", or_reason("pressure", "", &plain)),
        ("contact is", text("criterion")),
        ("contact", or_reason("contact_area", "contact_area", &percent)),
    ];
    if line["gamma"].as_f64().is_some_and(|g| g > 0.0) {
        rows.push(("work of adhesion", or_reason("gamma", "", &|g| significant(g, 4))));
        rows.push(("range of adhesion", or_reason("range", "", &|r| significant(r, 4))));
    }
    rows.extend([
        ("mean gap", or_reason("mean_gap", "mean_gap", &plain)),
        ("median cluster area", or_reason("median_cluster_area", "patch_pdf", &plain)),
        ("rms gradient on this grid", or_reason("resolved_gradient", "", &|v| significant(v, 4))),
        ("load error", or_reason("load_error", "", &|v| format!("{v:.1e}"))),
        ("time, peak memory", {
            let bytes = line["peak_rss_bytes"].as_u64().unwrap_or_default();
            format!("{}, {}", duration(line["seconds"].as_f64().unwrap_or_default()), memory(bytes))
        }),
    ]);
    if let Some(fitted) = line["calibrated_on"].as_str() {
        rows.push(("its constants are fitted to", fitted.to_string()));
    }
    output::table(&["quantity", "value"], rows.into_iter().map(|(k, v)| vec![k.to_string(), v]))
}

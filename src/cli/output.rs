//! Results on stdout, in words and tables.

use crate::pipeline::{PlannedStage, RunPlan};
use crate::record::acceptance::{AcceptanceCheck, CheckScope, CheckStatus};
use crate::record::given_loads::GivenLoads;
use crate::record::methods::MethodResults;
use crate::record::results::{Overlap, Results, SurfaceStatistic};
use crate::report::accuracy::{depth_sentence, missed_by, summary};
use crate::report::hysteresis::hysteresis_sentence;
use crate::report::number::{
    duration, length, memory, percent, si_with_error, significant, to_error, trimmed, with_error,
};
use crate::report::relaxation::relaxation_sentence;
use crate::{Error, Result};
use asperity_atoms::results::{AtomPullOff, AtomState, AtomsResults, AuditLine, NvtResults};
use asperity_contact::load::Branch;
use asperity_contact::results::ContinuumResults;
use asperity_contact::state::State;
use comfy_table::Table;
use serde::Serialize;
use std::borrow::Cow;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

/// Micrometres of a metre.
const UM: f64 = 1e6;

/// The first failure to write stdout.
static FAILURE: Mutex<Option<std::io::Error>> = Mutex::new(None);

/// Keeps a failure to write stdout for [`written`]. A reader that has gone away (`| head`) is no error of ours.
pub(super) fn note_failure(wrote: std::io::Result<()>) {
    if let Err(e) = wrote
        && e.kind() != std::io::ErrorKind::BrokenPipe
    {
        FAILURE.lock().unwrap_or_else(|e| e.into_inner()).get_or_insert(e);
    }
}

/// Whether all of stdout was written.
///
/// # Errors
/// `Output` with the first failure.
pub(super) fn written() -> Result<()> {
    note_failure(std::io::stdout().flush());
    match FAILURE.lock().unwrap_or_else(|e| e.into_inner()).take() {
        None => Ok(()),
        Some(source) => Err(Error::Output { source }),
    }
}

/// The text with control characters as `\u{1b}`: names of files and scenes must not drive a terminal. New lines and
/// tabs stay.
pub fn printable(text: &str) -> Cow<'_, str> {
    // Marks that reverse the order of the characters shown are no control characters of Unicode, but act as such.
    let drives = |c: char| {
        c.is_control() && c != '\n' && c != '\t' || matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
    };
    if !text.contains(drives) {
        return text.into();
    }
    text.chars().map(|c| if drives(c) { c.escape_unicode().to_string() } else { c.into() }).collect::<String>().into()
}

/// A path for JSON. Bytes that are no UTF-8 become `\xff`.
pub(super) fn path(path: &Path) -> String {
    let chunks = path.as_os_str().as_encoded_bytes().utf8_chunks();
    let shown = |c: std::str::Utf8Chunk| {
        let invalid: String = c.invalid().iter().map(|b| format!("\\x{b:02x}")).collect();
        c.valid().to_string() + &invalid
    };
    chunks.map(shown).collect()
}

/// Whether another process prints what this one would.
static SILENT: AtomicBool = AtomicBool::new(false);

/// From now on [`print`] and [`eprint`] print nothing.
pub(super) fn silence() {
    SILENT.store(true, Ordering::Relaxed);
}

/// A line on stdout. Whether all lines were written is reported by `written`.
pub fn print(line: &str) {
    if SILENT.load(Ordering::Relaxed) {
        return;
    }
    note_failure(writeln!(std::io::stdout(), "{}", printable(line)));
}

/// A warning on stderr.
pub fn warn(text: &str) {
    eprint(&format!("warning: {text}"));
}

/// A line on stderr; without stderr there is no place for a complaint.
pub fn eprint(line: &str) {
    if !SILENT.load(Ordering::Relaxed) {
        complain(line);
    }
}

/// A line on stderr of any process.
pub fn complain(line: &str) {
    let _ = writeln!(std::io::stderr(), "{}", printable(line));
}

/// One line of JSON on stdout.
pub fn json_line(value: &impl Serialize) -> Result<()> {
    let text = serde_json::to_string(value).map_err(|e| Error::format("results", e, "values that JSON can hold"))?;
    print(&text);
    Ok(())
}

/// A table without rules.
pub fn table(header: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let mut table = Table::new();
    table.load_style(comfy_table::presets::NOTHING);
    table.set_header(header.to_vec());
    rows.into_iter().for_each(|row| {
        table.add_row(row);
    });
    table.to_string()
}

/// Stages or settings with their estimated memory and time.
pub(super) fn plan(kind: &str, plan: &RunPlan) {
    let row = |s: &PlannedStage| vec![s.name.clone(), s.what.clone(), memory(s.bytes), duration(s.seconds)];
    print(&table(&[kind, "what", "memory", "estimated time"], plan.stages.iter().map(row)));
    let (bytes, seconds) = (memory(plan.bytes), duration(plan.seconds));
    print(&format!("needs {bytes} of memory and about {seconds} (an order of magnitude)"));
}

/// Expected against realised; of a measured surface nothing is expected.
pub fn statistics(list: &[SurfaceStatistic]) -> String {
    let known = list.iter().any(|s| s.expected.is_some());
    let coarse = list.iter().any(|s| s.expected_on_grid.is_some());
    let expected = match (known, coarse) {
        (_, true) => &["whole spectrum", "on this grid", "band (2 sd)", "realised"][..],
        (true, false) => &["expected", "band (2 sd)", "realised"],
        (false, false) => &["value"],
    };
    let number = |v: Option<f64>| v.map_or("-".into(), |v| significant(v, 5));
    table(
        &[&["quantity", "symbol"], expected, &["unit"]].concat(),
        list.iter().map(|s| {
            let mut row = vec![s.name.clone(), s.symbol.clone()];
            row.extend(known.then(|| number(s.expected)));
            row.extend(coarse.then(|| number(s.expected_on_grid)));
            row.extend(known.then(|| s.band.map_or("-".into(), |b| format!("± {}", significant(b, 2)))));
            row.extend([significant(s.realised, 5), s.unit.clone()]);
            row
        }),
    )
}

/// The scaling audit.
pub fn audit(lines: &[AuditLine]) -> String {
    table(
        &["group", "symbol", "target", "actual", "status", "reason"],
        lines.iter().map(|l| {
            let (target, actual) = (significant(l.target, 4), significant(l.actual, 4));
            vec![l.group.clone(), l.symbol.clone(), target, actual, l.status.clone(), l.reason.clone()]
        }),
    )
}

/// Summary of a run: loads, areas, gaps, and atoms against continuum.
pub fn results(results: &Results) {
    let loads = results.loads;
    if let Some(c) = &results.continuum {
        print(&format!("continuum: {}, {}, adhesion {}, {}", c.method, c.kernel, c.adhesion, c.wall));
        states(c, loads);
        adhesion(c, loads);
        hysteresis_sentence(c, loads).iter().for_each(|sentence| print(sentence));
    }
    results.accuracy.iter().for_each(|reached| print(&summary(reached)));
    let ranges = results.other_ranges.iter().map(|c| (format!("adhesion {}", c.adhesion), c));
    let without = results.non_adhesive.iter().map(|c| ("without adhesion".to_string(), c));
    for (what, c) in without.chain(ranges) {
        print(&format!("{what}:"));
        states(c, loads);
    }
    if !results.methods.is_empty() {
        methods(&results.methods, loads);
    }
    if !results.acceptance.is_empty() {
        print(&acceptance(&results.acceptance));
        print(&crate::challenge::summary(&results.acceptance));
    }
    comparison(results);
    depth_sentence(results).iter().for_each(|sentence| print(&format!("atoms: {sentence}")));
    let pulled = results.atoms.iter().filter_map(|atoms| atoms.unloading.as_ref()?.pull_off);
    pulled.for_each(|p| print(&format!("atoms: {}", atoms_pull_off(&p))));
    let steps = results.atoms.iter().map(|atoms| &atoms.load_steps).filter(|steps| !steps.is_empty());
    steps.for_each(|steps| print(&format!("atoms: {}", relaxation_sentence(steps))));
    results.atoms.iter().filter_map(|atoms| atoms.nvt.as_ref()).for_each(|nvt| at_temperature(nvt, loads));
}

/// Contact and gap of the NVT runs.
fn at_temperature(nvt: &NvtResults, loads: GivenLoads) {
    print(&format!("atoms at {} K, means of time with their standard errors:", trimmed(nvt.temperature_k, 4)));
    print(&table(
        &[loads.head(), "contact", "mean gap / Å"],
        nvt.states.iter().map(|s| {
            let (area, gap) = (s.contact_area, s.mean_gap_angstrom);
            let of_area = with_error(100.0 * area.value, 100.0 * area.error, "%");
            let of_gap = with_error(gap.value, gap.error, "");
            vec![loads.value(s.p_star), of_area.0 + &of_area.1, of_gap.0 + &of_gap.1]
        }),
    ));
}

/// Results of the compared methods, one row per load.
fn methods(list: &[MethodResults], loads: GivenLoads) {
    let dash = || "-".to_string();
    let median = |s: &State| s.observed.as_ref()?.median_cluster_area;
    let lines = list.iter().flat_map(|m| {
        let name = if m.adhesive { m.method.clone() } else { format!("{}, without adhesion", m.method) };
        m.states.iter().map(move |s| {
            vec![
                name.clone(),
                loads.value(s.p_star),
                percent(s.contact_area),
                s.mean_gap.map_or_else(dash, |g| significant(g * UM, 4)),
                s.clusters.map_or_else(dash, |n| n.to_string()),
                median(s).map_or_else(dash, |a| significant(a * UM * UM, 3)),
                duration(s.seconds),
            ]
        })
    });
    let head = ["method", loads.head(), "contact", "mean gap / µm", "clusters", "median / µm²", "time"];
    print(&table(&head, lines));
    for m in list {
        if let Some(reason) = &m.unavailable_reason {
            print(&format!("{} not available: {reason}", m.method));
        }
    }
}

/// States of a load path, with the errors of contact area and mean gap where they are known.
fn states(c: &ContinuumResults, loads: GivenLoads) {
    let dash = || "-".to_string();
    let has = |of: fn(&State) -> bool| c.states.iter().any(of);
    let (flows, leaks) = (has(|s| s.plasticity.is_some()), has(|s| s.leakage.is_some()));
    let has_subsurface = has(|s| s.subsurface.is_some());
    let mut head = vec![loads.head(), "contact", "mean gap / µm", "clusters", "residual", "FFT pairs", "stop"];
    head.extend(flows.then_some("flowing"));
    head.extend(has_subsurface.then_some("von Mises / MPa"));
    if leaks {
        head.extend(["flow gap x / µm", "flow gap y / µm"]);
    }
    let stated =
        |value: f64, error: Option<f64>| error.map_or_else(|| significant(value, 4), |error| to_error(value, error));
    print(&table(
        &head,
        c.states.iter().map(|s| {
            let mut row = vec![
                loads.value(s.p_star) + if s.branch == Branch::Unloading { " (unloading)" } else { "" },
                stated(100.0 * s.contact_area, s.contact_area_error.map(|e| 100.0 * e)) + "\u{a0}%",
                s.mean_gap.map_or_else(dash, |g| stated(g * UM, s.mean_gap_error.map(|e| e * UM))),
                s.clusters.map_or("-".into(), |n| n.to_string()),
                s.residual.map_or_else(dash, |r| format!("{r:.1e}")),
                format!("{:.1}", s.fft_pairs),
                s.stop.to_string(),
            ];
            row.extend(flows.then(|| s.plasticity.map_or_else(dash, |p| percent(p.flowing))));
            let below = s.subsurface.as_ref().map(|below| significant(below.von_mises.value * 1e-6, 4));
            row.extend(has_subsurface.then(|| below.unwrap_or_else(dash)));
            if leaks {
                let shown = |gap: f64| if gap > 0.0 { significant(gap * UM, 3) } else { "sealed".into() };
                let gaps = s.leakage.map(|flow| flow.hydraulic_gaps().map(shown));
                row.extend(gaps.unwrap_or_else(|| [dash(), dash()]));
            }
            row
        }),
    ));
}

/// Adhesion range on the grid, numbers extrapolated to the true range, and pull-off.
fn adhesion(c: &ContinuumResults, loads: GivenLoads) {
    if let Some(r) = c.range.filter(|r| r.used != r.requested) {
        let [requested, used] = [r.requested, r.used].map(|r| length(r, 4));
        print(&format!("adhesion: range ρ = {requested} requested, {used} used on this grid"));
    }
    for s in &c.states {
        if let Some(e) = s.extrapolated {
            let gap = e.mean_gap.map(|g| (significant(g.value * UM, 4), significant(g.error * UM, 2)));
            print(&format!(
                "at {}, extrapolated to the true range: contact ({} ± {}) % of the cell{}",
                loads.label(s.p_star),
                significant(100.0 * e.area.value, 3),
                significant(100.0 * e.area.error, 2),
                gap.map_or(String::new(), |(gap, error)| format!(", mean gap {gap} ± {error} µm"))
            ));
        }
    }
    if let Some(p) = &c.pull_off {
        let pull = si_with_error(-p.pressure, p.pressure_error, "Pa");
        let gap = si_with_error(p.mean_gap, p.mean_gap_error, "m");
        let force = p.force.map(|f| si_with_error(-f, p.relative_error().map(|e| -f * e), "N"));
        let force = force.map_or(String::new(), |force| format!(" ({force} on the map)"));
        print(&format!("pull-off: largest tension {pull}{force}, at a mean gap of {gap}"));
    }
}

/// Atoms against the continuum on their own heights.
pub fn comparison(results: &Results) {
    let Some(c) = &results.comparison else { return };
    let pair = |a: &Overlap, b: &Overlap, value: fn(&Overlap) -> f64| format!("{:.2} ({:.2})", value(a), value(b));
    print("atoms against the continuum on the same profile, layer and load (in brackets: misaligned map)");
    let rows = c.loads.iter().flat_map(|load| {
        let atoms = vec![
            results.loads.value(load.p_star),
            format!("atoms: {}", load.atoms.criterion),
            percent(load.atoms.contact_area),
            "".into(),
            "".into(),
            significant(load.atoms_mean_gap_angstrom, 4),
        ];
        let lines = load.continuum.iter().map(|m| {
            vec![
                "".into(),
                m.criterion.clone(),
                percent(m.contact_area),
                pair(&m.overlap, &m.shifted, |o| o.jaccard),
                pair(&m.overlap, &m.shifted, |o| o.kappa),
                load.mean_gap_angstrom(&m.id).map_or_else(String::new, |gap| significant(gap, 4)),
            ]
        });
        std::iter::once(atoms).chain(lines.collect::<Vec<_>>())
    });
    let head = [results.loads.head(), "contact counted as", "contact", "Jaccard", "kappa", "mean gap / Å"];
    print(&table(&head, rows));
    results.atoms.as_ref().and_then(|atoms| yielding(atoms, results.loads)).iter().for_each(|sentence| print(sentence));
}

/// The largest tensile force on the atoms.
fn atoms_pull_off(p: &AtomPullOff) -> String {
    let nn = p.force_nn / p.force_ev_per_angstrom;
    format!(
        "pull-off force {} nN, up to {} nN more between the steps of {} Å, with {} atoms in contact",
        significant(-p.force_nn, 4),
        significant(p.error_ev_per_angstrom * nn, 2),
        significant(p.step_angstrom, 2),
        p.contacts
    )
}

/// Onset of plasticity, if it was analysed.
fn yielding(a: &AtomsResults, loads: GivenLoads) -> Option<String> {
    let p = a.plasticity.as_ref()?;
    let begins = match (p.first_yield, p.last_elastic) {
        (None, _) => "no yield".to_string(),
        (Some(load), None) => format!("first yield at {} or before", loads.label(load)),
        (Some(load), Some(before)) => {
            format!("first yield between {} and {}", loads.label(before), loads.value(load))
        }
    };
    let defects_of = |s: &AtomState| s.defects.map(|n| format!("{} at {}", n.atoms, loads.value(s.p_star)));
    let counts: Vec<_> = a.states.iter().filter_map(defects_of).collect();
    Some(format!("{begins}; defect atoms of {} analysed, by {}: {}", p.atoms, loads.head(), counts.join(", ")))
}

/// The challenge's statements.
fn acceptance(list: &[AcceptanceCheck]) -> String {
    let number = |v: f64| significant(v, 4);
    table(
        &["", "statement", "value", "reference", "accepted", "unit", "status", "why"],
        list.iter().map(|check| {
            vec![
                check.id.clone(),
                check.statement.clone(),
                check.value.map_or("-".into(), number),
                check.reference.map_or("-".into(), number),
                check.accepted(number).unwrap_or("-".into()),
                if check.unit == "1" { String::new() } else { check.unit.clone() },
                match (check.status, check.scope) {
                    (CheckStatus::Fail, CheckScope::LongerRange) => "fail, longer range".into(),
                    (CheckStatus::Fail, _) => "FAIL".into(),
                    (status, _) => status.to_string(),
                },
                check.reason.clone(),
            ]
        }),
    )
}

/// Reports a finished folder: one line of JSON with its paths and the results under a key, or the output of `print_results` and the path
/// of the report.
pub fn finished(
    json: bool,
    (folder, report): (&Path, &Path),
    (key, results): (&str, &impl Serialize),
    print_results: impl FnOnce(),
) -> Result<()> {
    if json {
        return json_line(&serde_json::json!({ "out": path(folder), "report": path(report), key: results }));
    }
    print_results();
    print(&format!("report: {}", report.display()));
    Ok(())
}

/// Exit code of a run with a report: an error if the surfaces separated before the last load, if an auxiliary solve failed, or, if `strict`, the accuracy was not reached; 1 if an acceptance check failed.
pub fn ended(results: &Results, page: PathBuf, strict: bool) -> Result<ExitCode> {
    if let Some(why) = results.continuum.as_ref().and_then(|c| c.contact_lost.clone()) {
        return Err(Error::ContactLost { why, kept: page });
    }
    if let Some(reason) = results.continuum.as_ref().and_then(|c| c.pull_off_failure.clone()) {
        return Err(Error::PullOff { why: reason, kept: page });
    }
    if !results.failures.is_empty() {
        return Err(Error::AuxiliarySolve { why: results.failures.join("; "), kept: page });
    }
    if let Some(missed) = missed_by(results).filter(|_| strict) {
        return Err(Error::Inaccurate(missed));
    }
    Ok(if crate::challenge::has_failed(&results.acceptance) { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::ffi::OsStrExt;

    #[test]
    fn control_characters_and_foreign_bytes_are_shown_and_not_sent() {
        assert_eq!(printable("a\tb\nü"), "a\tb\nü");
        assert_eq!(printable("a\u{1b}[2Jb\r\u{202e}c\u{9b}"), "a\\u{1b}[2Jb\\u{d}\\u{202e}c\\u{9b}");
        assert_eq!(path(Path::new(std::ffi::OsStr::from_bytes(b"a\xff\xfe/b"))), "a\\xff\\xfe/b");
    }
}

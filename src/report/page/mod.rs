//! Report pages: single HTML files with embedded styles, figures and script, without external resources. Everything is
//! visible without JavaScript; with it maps and curves answer to pointer and keyboard.
//!
//! [`write()`] reads `results.json` and the field files that it names, and writes `report.html` and `figures/`.
//! Sections without results are omitted. `tradeoff` does the same for `tradeoff.json`.

mod accuracy;
mod atoms;
mod bands;
mod challenge;
mod compare;
mod criteria;
mod curves;
mod definitions;
mod distributions;
mod document;
mod ensemble;
mod explorer;
mod figures;
mod loads;
mod method_style;
mod methods;
mod model_chain;
mod nvt;
mod packed;
mod paper;
mod prelude;
mod printed;
mod profile;
mod ranges;
mod relief;
mod requested;
mod summary;
mod surface;
mod tiles;
mod tradeoff;
mod uncertainty;
mod unloading;

use std::io::Write;
use std::path::{Path, PathBuf};

use crate::record::ensemble::Ensemble;
use crate::record::tradeoff::TradeoffResults;
use crate::report::accuracy::depth_sentence;
use asperity_contact::uncertainty::UncertaintySource;
use asperity_grid::error::Error;
use asperity_surface::files::atomic_file::{create_folder, write_atomic};
use document::{PageSection, document, linked};
use prelude::*;
pub use printed::{PrintedFigures, ReportOptions};

/// File name of the page in a run folder.
pub const PAGE: &str = "report.html";

/// Writes the report of a run folder with the default options, and returns the path of the page.
///
/// # Errors
/// As [`write_with`].
pub fn write(run_folder: &Path) -> Result<PathBuf> {
    write_with(run_folder, &ReportOptions::default())
}

/// Writes the report of a run, a trade-off or a sweep, and returns the path of the page.
///
/// # Errors
/// `results.json` is missing, damaged or of another schema; a field file is missing or has an unexpected shape; a PDF is
/// requested on a machine without fonts.
pub fn write_with(folder: &Path, options: &ReportOptions) -> Result<PathBuf> {
    let writer = |aspect, scales, loads| FigureWriter { folder, aspect, scales, loads, options };
    if folder.join(crate::record::ensemble::FILE).exists() {
        let ensemble = Ensemble::read(folder)?;
        let writer = writer(1.0, ScalesSi { length_m: 1.0, modulus_pa: 1.0 }, GivenLoads::P_STAR);
        return place(folder, || ensemble::page(&writer, &ensemble));
    }
    if !folder.join(FILE).exists() && folder.join(crate::record::tradeoff::FILE).exists() {
        let tradeoff = TradeoffResults::read(&folder.join(crate::record::tradeoff::FILE))?;
        let writer = writer(tradeoff.ny as f64 / tradeoff.nx as f64, tradeoff.scales, tradeoff.loads);
        return place(folder, || tradeoff::page(&writer, &tradeoff));
    }
    let results = Results::read(folder)?;
    if results.comparison.is_some() && results.atoms.is_none() {
        return Err(Error::format(folder.join(FILE), "a comparison without atoms", "both or neither"));
    }
    let writer = writer(results.surface.aspect, results.scales, results.loads);
    place(folder, || page(&writer, &results))
}

/// Creates the figures folder, and writes the page.
fn place(run_folder: &Path, page: impl FnOnce() -> Result<Markup>) -> Result<PathBuf> {
    let figures = run_folder.join("figures");
    create_folder(&figures)?;
    let page = page()?.into_string();
    let path = run_folder.join(PAGE);
    write_atomic(&path, |w| w.write_all(page.as_bytes()))?;
    Ok(path)
}

fn page(writer: &FigureWriter, results: &Results) -> Result<Markup> {
    let mut sections = Vec::new();
    let mut add = |anchor, title, body| sections.push(PageSection { anchor, title, body });
    if !results.acceptance.is_empty() {
        add("acceptance", "Acceptance checks of the challenge", challenge::checks(&results.acceptance));
        add("challenge", "The challenge’s figures", challenge::figures(writer, results)?);
    }
    add("surface", "The surface", surface::section(writer, results)?);
    if let Some(continuum) = &results.continuum {
        let sentence = results.comparison.as_ref().and_then(|_| summary::continuum_found(results, continuum));
        let body = html! { @if let Some(s) = sentence { p.found { (s) } } (accuracy::section(results)) (loads::section(writer, continuum)?) };
        add("loads", if results.atoms.is_some() { "Contact at the laboratory scale" } else { "Contact" }, body);
        if continuum.states.iter().any(|s| s.observed.is_some()) {
            add(
                "distributions",
                "Gaps, stresses and clusters",
                distributions::section(writer, continuum, !results.acceptance.is_empty())?,
            );
        }
    }
    if !results.other_ranges.is_empty() {
        add("ranges", "Range of the adhesion", ranges::section(writer, results)?);
    }
    if !results.methods.is_empty() {
        add("methods", "Comparison of methods", methods::section(writer, results)?);
    }
    if let Some(atoms) = &results.atoms {
        add("atoms", "The atoms", atoms::section(writer, atoms)?);
    }
    if let (Some(atoms), Some(comparison)) = (&results.atoms, &results.comparison) {
        let has_depth = |s: &State| s.uncertainty.iter().any(|p| p.source == UncertaintySource::Depth);
        let walls = [
            ("Uncertainty budget of the hard wall", &comparison.hard_wall),
            ("Uncertainty budget of the compliant wall", &comparison.compliant_wall),
        ];
        let body = html! {
            (compare::section(writer, atoms, comparison)?)
            @if let Some(sentence) = depth_sentence(results) { p.found { (capitalised(&sentence)) "." } }
            @for (title, wall) in walls.iter().filter(|(_, wall)| wall.states.iter().any(has_depth)) {
                (uncertainty::budgets(title, wall, results.loads))
            }
        };
        add("comparison", "Continuum against atoms", body);
    }
    if let Some(plots) = curves::section(writer, results)? {
        add("area", "Contact and mean gap against load", plots);
    }
    if let Some(c) = results.comparison.as_ref().filter(|c| !c.findings.is_empty()) {
        add("findings", "Discussion", html! { ul { @for f in &c.findings { li { (f) } } } });
    }
    if !results.stages.is_empty() {
        add("costs", "Computational cost", costs(&results.stages));
    }
    if !results.sources.is_empty() {
        add("sources", "Sources", html! { ol { @for s in &results.sources { li { (linked(s)) } } } });
    }
    add("definitions", "Definitions", definitions::section(results));
    let top = summary::section(writer, results)?;
    document((&results.name, &results.description), top, &sections, &writer.folder.join(FILE))
}

fn costs(stages: &[StageCost]) -> Markup {
    let key = |s: &StageCost| html! { code.quiet { (s.key.get(..12).unwrap_or(&s.key)) } };
    let all: f64 = stages.iter().map(|s| s.seconds).sum();
    let peak = stages.iter().map(|s| s.peak_rss_bytes).max().unwrap_or(0);
    let name = &"all".to_string();
    let rows = stages.iter().map(|s| (&s.name, s.seconds, s.peak_rss_bytes, Some(s))).chain([(name, all, peak, None)]);
    // The sum is in bold.
    let cell =
        |text: &str, stage: Option<&StageCost>| html! { @if stage.is_some() { (text) } @else { strong { (text) } } };
    html! {
        p { "Wall time and peak resident memory of each stage. A stage is identified by the key of its inputs. A stage reused "
            "from an earlier run shows its cost in that run; a resumed stage shows the time of all its parts." }
        (columns!("words", rows, |(name, seconds, bytes, s)| {
            "stage" => cell(name, s),
            "time" => cell(&duration(seconds), s),
            "peak memory" => cell(&memory(bytes), s),
            "origin" => s.map_or(String::new(), origin),
            "key" => s.map(key).unwrap_or_default(),
        }))
    }
}

fn origin(stage: &StageCost) -> String {
    let parts = match stage.earlier_seconds {
        0.0 => String::new(),
        s => format!(", {} of it in earlier parts", duration(s)),
    };
    format!("{}{parts}", if stage.reused { "reused from an earlier run" } else { "computed" })
}

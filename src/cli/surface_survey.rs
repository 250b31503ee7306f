//! What can be said about a file of heights before its sign, unit or filling are chosen.

use super::output;
use crate::report::number::trimmed;
use crate::scene::{SurfaceFile, SurfaceScene};
use crate::{Error, Result};
use asperity_grid::{Grid, extent, rms};
use asperity_surface::import::{Content, ImportedFile};
use asperity_surface::{Detrend, Fill, Preparation, PreparedMap, quality_warnings, seam_warning, subtract_form};
use std::path::Path;

/// Whether an error only names what the file does not declare, or missing points that nobody fills.
pub(super) fn is_incomplete(error: &Error) -> bool {
    let Error::Input { list, .. } = error else { return false };
    list.iter().all(|c| c.found == "not given" || c.found.contains("were not measured"))
}

/// Prints the survey of the height map that a scene names; `scene` is its file. Heights keep the sign and the unit of the file.
pub(super) fn print(surface: &SurfaceScene, scene: &Path) -> Result<()> {
    let Some(file) = SurfaceFile::read(surface, scene)? else { return Ok(()) };
    let path = file.path().to_path_buf();
    let ImportedFile { content, declared, layout, .. } = file.imported;
    let Content::Map(map) = content else { return Ok(()) };
    let unit = declared.unit.clone().unwrap_or_default();
    let not_declared = |flag: &str| format!("not declared ({flag})");
    let mut rows: Vec<[String; 2]> = vec![["format".into(), layout]];
    let mut row = |name: &str, value: String| rows.push([name.into(), value]);
    match &declared.channels[..] {
        [] => {}
        [only] => row("channel", only.clone()),
        several => row("channels", format!("{} (--dataset)", several.join(", "))),
    }
    row("points", format!("{} x {}", map.nx, map.ny));
    let extents = declared.extent.as_ref().map(|e| {
        let unit = e.unit.as_deref().unwrap_or(&unit);
        format!("{} x {} {unit}", trimmed(e.x, 6), trimmed(e.y, 6)).trim_end().to_string()
    });
    row("extents", extents.unwrap_or_else(|| not_declared("--length")));
    let of_slope = match declared.extent.as_ref().map(|e| e.unit.as_deref().unwrap_or(&unit)) {
        None => format!(" ({} per pixel)", if unit.is_empty() { "heights" } else { &unit }),
        Some(lateral) if lateral == unit => String::new(),
        Some(lateral) => format!(" ({unit} per {lateral})"),
    };
    row("unit of the heights", declared.unit.clone().unwrap_or_else(|| not_declared("--unit")));
    row("touch first", declared.sign.map_or_else(|| not_declared("--touching"), |sign| sign.words().into()));
    let repeats = |periodic: bool| if periodic { "yes" } else { "no" }.to_string();
    row("repeats", declared.periodic.map_or_else(|| "not declared".into(), repeats));
    for step in &declared.history {
        row("history", step.clone());
    }
    let (missing, points) = (map.missing(), map.heights.len());
    if missing > 0 {
        let percent = trimmed(100.0 * missing as f64 / points as f64, 3);
        row("not measured", format!("{missing} of {points} points, {percent} % (--fill)"));
    }
    let in_unit = |value: f64| format!("{} {unit}", trimmed(value, 5)).trim_end().to_string();
    let (low, high) = extent(&map.heights);
    row("heights", format!("{} to {}", in_unit(low), in_unit(high)));
    let extents = declared.extent.map_or([map.nx as f64, map.ny as f64], |e| [e.x, e.y]);
    let grid = Grid { nx: map.nx, ny: map.ny, lx: extents[0], ly: extents[1] };
    for (about, form) in [("mean", Detrend::Mean), ("plane", Detrend::Plane), ("parabola", Detrend::Quadratic)] {
        let mut level = map.heights.clone();
        let line = subtract_form(form, grid, &mut level, "")?;
        level.retain(|h| !h.is_nan());
        if form == Detrend::Plane {
            row("tilt", format!("{}{of_slope}", line.trim_start_matches("detrend plane: ")));
        }
        row(&format!("rms height about the {about}"), in_unit(rms(&level)));
    }
    output::print(&format!("{}, sign and unit as in the file, of the measured points:", path.display()));
    let wide = rows.iter().map(|[name, _]| name.chars().count()).max().unwrap_or_default();
    rows.iter().for_each(|[name, value]| output::print(&format!("  {name:wide$}  {value}")));
    // Warnings are about heights without holes.
    let fill = (missing > 0).then_some(Fill::Nearest);
    let filled = Preparation { fill, ..Preparation::default() }.apply(map, extents, false);
    let Ok(PreparedMap { map, warnings: outliers, .. }) = filled else {
        output::eprint(
            "warning: more points are missing than are filled: spikes, steps and edges are not judged; --crop takes a part",
        );
        return Ok(());
    };
    let seam = seam_warning(grid, &map.heights).filter(|_| declared.periodic != Some(false));
    let warnings = quality_warnings(grid, &map.heights).into_iter().chain(outliers).chain(seam);
    warnings.for_each(|w| output::eprint(&format!("warning: {w}")));
    Ok(())
}

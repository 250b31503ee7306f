//! The surface in three dimensions with the contact in colour: a still picture, and the heights for the script, which turns
//! the view and follows the load.

use serde::Serialize;

use super::compare::{at_load, key, matched};
use super::explorer::{SIDE, data};
use super::packed::{self, Packed};
use super::prelude::*;
use crate::record::downsample::DownsampledMap;
use crate::report::relief::{GROUND, Relief, ReliefFigure};

/// Range of the heights over the width of the cell in the picture, at most.
const HIGHEST: f64 = 0.2;

/// Heights for the script. `scale`: heights of the picture over the width of the cell, per unit of `heights`.
#[derive(Debug, Serialize)]
struct ReliefData {
    heights: Packed,
    aspect: f64,
    scale: f64,
    ground: Rgb,
    /// Colour of contact of a single solution.
    contact: Rgb,
    /// Extents of the cell along x and y, and how much the heights are enlarged.
    labels: [String; 3],
}

/// The figure; `None` without heights.
pub(super) fn section(writer: &FigureWriter, results: &Results) -> Result<Option<Markup>> {
    let Some(file) = &results.surface.heights else { return Ok(None) };
    let mut map = writer.load(file, SIDE, |h| -h)?;
    let (low, high) = ends(map.values.iter().copied());
    if high.partial_cmp(&low) != Some(std::cmp::Ordering::Greater) {
        return Ok(None);
    }
    map.values.iter_mut().for_each(|v| *v -= low);
    let enlarged = round_below(HIGHEST / (high - low));
    let (p_star, flags) = contact(writer, results)?.unzip();
    let flags = flags.unwrap_or_default();
    let colours: Vec<Rgb> = (0..map.values.len()).map(|i| colour(&flags, &map, i)).collect();
    let heights: Vec<f64> = map.values.iter().map(|v| v * enlarged).collect();
    let relief = Relief { nx: map.nx, heights: &heights, colours: &colours, aspect: writer.aspect };
    let length = writer.scales.length_m;
    let labels = [
        format!("x: {}", si_given(length, "m")),
        format!("y: {}", si_given(length * writer.aspect, "m")),
        format!("heights × {}", trimmed(enlarged, 3)),
    ];
    let alt = format!("the surface upside down in three dimensions, {}", labels.join(", "));
    let heights_m = map.values.iter().map(|v| v * length).collect();
    let drawn = ReliefFigure { alt, relief, labels: labels.clone(), heights_m, length_m: length };
    let still = writer.draw("relief", &drawn, ReliefFigure::WIDTH as f64)?;
    let (heights, aspect, scale) = (packed::values(&map), writer.aspect, enlarged);
    let script = ReliefData { heights, aspect, scale, ground: GROUND, contact: VERMILION, labels };
    let compared = results.comparison.is_some();
    Ok(Some(figure(
        html! {
            div.relief id="relief" { (still.unwrap_or_default()) }
            (data(writer, "heights", &script)?)
            @if p_star.is_some() {
                div.key { @if compared { (key(&COMPARED)) } @else { (key(&[(VERMILION, "contact")])) } }
            }
        },
        html! {
            "The surface upside down, so that the points that touch first are on top; heights are enlarged " (trimmed(enlarged, 3)) " times."
            @if compared { " Contact at the atoms’ sites." }
            @if let Some(p) = p_star { span.still-only { " Contact at " (writer.loads.label(p)) "." } }
        },
    )))
}

const COMPARED: [(Rgb, &str); 3] =
    [(BLACK, "contact of both"), (ORANGE, "only the continuum"), (BLUE, "only the atoms")];

/// The number 1, 2 or 5 times a power of ten at or below a number.
fn round_below(v: f64) -> f64 {
    let decade = 10f64.powf(v.log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|m| m * decade).find(|r| *r <= v).unwrap_or(decade)
}

/// Contact maps of the highest load: of the continuum and of the atoms, or of the only solution.
fn contact(writer: &FigureWriter, results: &Results) -> Result<Option<(f64, Vec<DownsampledMap>)>> {
    if let (Some(atoms), Some(c)) = (&results.atoms, &results.comparison) {
        let Some(load) = c.loads.last() else { return Ok(None) };
        let state = at_load(&atoms.states, load.p_star, |s| s.p_star);
        let (Some(state), Some(map)) = (state, matched(load).and_then(|m| m.map.as_deref())) else { return Ok(None) };
        let maps = [map, &state.contact_map].map(|f| writer.flags(f, SIDE));
        return maps.into_iter().collect::<Result<Vec<_>>>().map(|maps| Some((load.p_star, maps)));
    }
    let states = results.continuum.iter().flat_map(|c| &c.states);
    let stored = states.filter_map(|s: &State| Some((s, s.gap_file()?))).filter(|(s, _)| s.stop != Stop::Detached);
    // On loading where it was also met on unloading.
    let highest = stored.rev().max_by(|(a, _), (b, _)| a.p_star.total_cmp(&b.p_star));
    let Some((state, file)) = highest else { return Ok(None) };
    Ok(Some((state.p_star, vec![writer.closed(file, SIDE)?])))
}

/// Colour of a node of the heights; contact maps may have another number of cells.
fn colour(maps: &[DownsampledMap], heights: &DownsampledMap, i: usize) -> Rgb {
    let touches = |map: &DownsampledMap| {
        let place = |node: usize, from: usize, to: usize| ((node as f64 + 0.5) / from as f64 * to as f64) as usize;
        let (x, y) = (place(i % heights.nx, heights.nx, map.nx), place(i / heights.nx, heights.ny, map.ny));
        picture::touches(map, y.min(map.ny - 1) * map.nx + x.min(map.nx - 1))
    };
    match maps.iter().map(touches).collect::<Vec<bool>>()[..] {
        [true] => VERMILION,
        [true, true] => BLACK,
        [true, false] => ORANGE,
        [false, true] => BLUE,
        _ => GROUND,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn enlargements_are_round() {
        assert_eq!([3.6, 0.27, 12.0, 50.0].map(round_below), [2.0, 0.2, 10.0, 50.0]);
    }
}

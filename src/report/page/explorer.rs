//! Maps of the first screen: the drawings that show without JavaScript, and the same maps as compressed arrays for the
//! script of the page.

use std::io::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, PreEscaped, html};
use serde::Serialize;

use super::compare::{at_load, matched};
use super::figures::FigureWriter;
use super::loads::{CLIPPED, of_stress};
use crate::error::{Error, Result};
use crate::load::Branch;
use crate::record::downsample::DownsampledMap;
use crate::record::results::{ContinuumResults, Results, StateResults};
use crate::report::map::Legend;
use crate::report::number::{si_scale, trimmed};
use crate::report::picture::{self, BLACK, BLUE, ORANGE, Range, Rgb};
use crate::units::ANGSTROM_M;

/// Maximum side of the maps for the script, cells: with gap, stress and contact of two sources at three loads the page
/// stays below 5 MB.
const SIDE: usize = 256;
/// Levels of a stored value: the rounding is below 10⁻⁵ of the range of the map.
const LEVELS: f64 = 65_535.0;
/// Colours of the ramp given to the script, which interpolates between them.
const RAMP: usize = 32;

/// A map for the script. `data`: base64 of a zlib stream; one byte per cell for flags, otherwise all high bytes and then
/// all low bytes of the 16-bit differences to the left neighbour. Rows from the lowest.
#[derive(Debug, Clone, Serialize)]
struct Packed {
    nx: usize,
    ny: usize,
    low: f64,
    high: f64,
    data: String,
}

#[derive(Debug, Serialize)]
struct Shown {
    label: &'static str,
    unit: String,
    low: f64,
    high: f64,
}

#[derive(Debug, Serialize)]
struct Layer {
    title: String,
    colour: Rgb,
    contact: Vec<Option<Packed>>,
    gap: Vec<Option<Packed>>,
    stress: Vec<Option<Packed>>,
}

/// One of the three frames: a layer with a fixed quantity or the selected one, or both layers superposed.
#[derive(Debug, Serialize)]
struct View {
    layer: Option<usize>,
    quantity: Option<&'static str>,
}

#[derive(Debug, Serialize)]
struct Explorer {
    length: [f64; 2],
    unit: String,
    loads: Vec<String>,
    gap: Shown,
    stress: Shown,
    ramp: Vec<Rgb>,
    layers: Vec<Layer>,
    views: Vec<View>,
}

/// Fields of one source at one load, in the units shown.
#[derive(Default)]
struct Fields {
    contact: Option<DownsampledMap>,
    gap: Option<DownsampledMap>,
    stress: Option<DownsampledMap>,
}

/// Fields of all sources: title, colour of contact, one entry per load.
type Source = (String, Rgb, Vec<Fields>);

/// The three maps; `None` if no field is stored.
pub(super) fn section(writer: &FigureWriter, results: &Results) -> Result<Option<Markup>> {
    let (loads, sources, length_m, units) = match (&results.atoms, &results.comparison) {
        (Some(_), Some(_)) => of_comparison(writer, results)?,
        _ => match &results.continuum {
            Some(c) => of_continuum(writer, c)?,
            None => return Ok(None),
        },
    };
    let last = loads.len().saturating_sub(1);
    let complete = |f: &Fields| f.contact.is_some();
    if loads.is_empty() || !sources.iter().all(|s| s.2.get(last).is_some_and(complete)) {
        return Ok(None);
    }
    let drawn = drawings(writer, &sources, last, length_m)?;
    let data = explorer(&sources, loads, [length_m, length_m * writer.aspect], units);
    let json =
        serde_json::to_string(&data).map_err(|e| Error::format(writer.folder, e.to_string(), "finite numbers"))?;
    Ok(Some(html! {
        div.maps {
            @for (title, drawing) in &drawn {
                div.view { div.panel-title { (title) } (drawing) }
            }
        }
        p.quiet.key {
            @if sources.len() > 1 {
                @for (colour, words) in [(BLACK, "both"), (ORANGE, "only the continuum"), (BLUE, "only the atoms")] {
                    (super::compare::key(colour, words))
                }
            }
            span.at-load { (data.loads[last]) }
            @if let Some(width) = smoothing(results) {
                "Stress of the atoms: forces spread by a Gaussian of " (trimmed(width, 3)) " Å; the continuum’s is not smoothed."
            }
        }
        script type="application/json" id="maps" { (PreEscaped(json.replace("</", "<\\/"))) }
    }))
}

/// Width of the Gaussian that makes a field of the forces on the atoms, Å.
fn smoothing(results: &Results) -> Option<f64> {
    results.comparison.as_ref()?;
    results.atoms.as_ref()?.states.iter().find_map(|s| s.stress.as_ref()).map(|s| s.width_angstrom)
}

/// The drawings of the highest load.
fn drawings(writer: &FigureWriter, sources: &[Source], at: usize, length_m: f64) -> Result<Vec<(String, Markup)>> {
    let draw = |name: &str, title: &str, picture: &picture::Picture| -> Result<(String, Markup)> {
        Ok((title.to_string(), writer.map((name, title), picture, length_m, Legend::None)?))
    };
    let mut drawn = Vec::new();
    for (k, (title, colour, fields)) in sources.iter().enumerate() {
        let Some(contact) = &fields[at].contact else { continue };
        drawn.push(draw(&format!("first-{}", k + 1), title, &picture::contact(contact, *colour))?);
        if let ([_], Some(gap)) = (sources, &fields[at].gap) {
            let range = Range { low: 0.0, ..Range::of(&gap.values, CLIPPED) };
            drawn.push(draw("first-gap", "Gap", &picture::gap(gap, range, contact))?);
        }
        if let ([_], Some(stress)) = (sources, &fields[at].stress) {
            drawn.push(draw("first-stress", "Normal stress", &picture::map(stress, of_stress(&stress.values)))?);
        }
    }
    if let [(.., first), (.., second)] = sources
        && let (Some(a), Some(b)) = (&first[at].contact, &second[at].contact)
        && (a.nx, a.ny) == (b.nx, b.ny)
    {
        drawn.push(draw("first-superposed", "Superposed", &picture::superposed(a, b))?);
    }
    Ok(drawn)
}

/// Labels of the loads, sources, extent of the cell in m, and units of gap and stress.
type Loaded = (Vec<String>, Vec<Source>, f64, [String; 2]);

/// The compliant-wall continuum and the atoms, Å and GPa.
fn of_comparison(writer: &FigureWriter, results: &Results) -> Result<Loaded> {
    let (Some(atoms), Some(c)) = (&results.atoms, &results.comparison) else { return Ok(Default::default()) };
    let flag = |v: f64| f64::from(u8::from(v != 0.0));
    let (mut loads, mut continuum, mut block) = (Vec::new(), Vec::new(), Vec::new());
    for load in &c.loads {
        let (Some(m), Some(state)) = (matched(load), at_load(&atoms.states, load.p_star, |s| s.p_star)) else {
            continue;
        };
        let file = |name: &str, of: &dyn Fn(f64) -> f64| -> Result<DownsampledMap> {
            picture::load(&writer.field(name)?, SIDE, of)
        };
        let stress = at_load(&c.compliant_wall.states, load.p_star, |s: &StateResults| s.numbers.p_star)
            .and_then(|s| s.numbers.stress_map.as_deref());
        continuum.push(Fields {
            contact: m.map.as_deref().map(|f| file(f, &flag)).transpose()?,
            gap: Some(file(&load.compliant_wall_gap, &|v| v * atoms.length_angstrom)?),
            stress: stress.map(|f| file(f, &|v| v * atoms.modulus_gpa)).transpose()?,
        });
        block.push(Fields {
            contact: Some(file(&state.contact_map, &flag)?),
            gap: Some(file(&state.gap_map, &|v| v)?),
            stress: state.stress.as_ref().map(|s| file(&s.map, &|v| v)).transpose()?,
        });
        loads.push(format!("p* = {}", trimmed(load.p_star, 4)));
    }
    let title = c.loads.first().and_then(matched).map_or("Continuum".into(), |m| format!("Continuum, {}", m.label()));
    let sources = vec![(title, ORANGE, continuum), ("Atoms".into(), BLUE, block)];
    Ok((loads, sources, atoms.length_angstrom * ANGSTROM_M, ["Å".into(), "GPa".into()]))
}

/// The continuum at the scale of the scene.
fn of_continuum(writer: &FigureWriter, c: &ContinuumResults) -> Result<Loaded> {
    let stored = |s: &&StateResults| s.numbers.gap_map.is_some() && s.numbers.stop != "detached";
    let states: Vec<&StateResults> = c.states.iter().filter(stored).collect();
    let highest = states.iter().map(|s| s.mean_gap).fold(0.0, f64::max) * writer.scales.length_m;
    let pressure = |s: &&StateResults| s.numbers.pressure.abs() / s.numbers.contact_fraction.max(1e-3);
    let strongest = states.iter().map(pressure).fold(0.0, f64::max) * writer.scales.modulus_pa;
    let ((gap_factor, gap_prefix), (stress_factor, stress_prefix)) = (si_scale(highest), si_scale(strongest));
    let (mut loads, mut fields) = (Vec::new(), Vec::new());
    for state in states {
        let Some(gap) = &state.numbers.gap_map else { continue };
        let gap = writer.field(gap)?;
        let stress = state.numbers.stress_map.as_deref().map(|f| writer.field(f)).transpose()?;
        fields.push(Fields {
            contact: Some(picture::load(&gap, SIDE, |v| f64::from(u8::from(v <= 0.0)))?),
            gap: Some(picture::load(&gap, SIDE, |v| v * writer.scales.length_m / gap_factor)?),
            stress: stress
                .map(|f| picture::load(&f, SIDE, |v| v * writer.scales.modulus_pa / stress_factor))
                .transpose()?,
        });
        let branch = if state.branch == Branch::Unloading { ", unloading" } else { "" };
        loads.push(format!("p* = {}{branch}", trimmed(state.numbers.p_star, 4)));
    }
    let units = [format!("{gap_prefix}m"), format!("{stress_prefix}Pa")];
    Ok((loads, vec![("Contact".into(), BLACK, fields)], writer.scales.length_m, units))
}

fn explorer(sources: &[Source], loads: Vec<String>, length_m: [f64; 2], [gap, stress]: [String; 2]) -> Explorer {
    let all = |of: fn(&Fields) -> Option<&DownsampledMap>| {
        sources.iter().flat_map(|s| &s.2).filter_map(of).flat_map(|m| &m.values).copied().collect::<Vec<f64>>()
    };
    let gap_range = Range { low: 0.0, ..Range::of(&all(|f| f.gap.as_ref()), CLIPPED) };
    let stress_range = of_stress(&all(|f| f.stress.as_ref()));
    let layer = |(title, colour, fields): &Source| Layer {
        title: title.clone(),
        colour: *colour,
        contact: fields.iter().map(|f| f.contact.as_ref().map(flags)).collect(),
        gap: fields.iter().map(|f| f.gap.as_ref().map(values)).collect(),
        stress: fields.iter().map(|f| f.stress.as_ref().map(values)).collect(),
    };
    let view = |layer, quantity| View { layer, quantity };
    let views = match sources {
        [_] => vec![view(Some(0), Some("contact")), view(Some(0), Some("gap")), view(Some(0), Some("stress"))],
        _ => vec![view(Some(0), None), view(Some(1), None), view(None, None)],
    };
    let (scale, prefix) = si_scale(length_m[0]);
    Explorer {
        length: length_m.map(|l| l / scale),
        unit: format!("{prefix}m"),
        loads,
        gap: Shown { label: "gap", unit: gap, low: gap_range.low, high: gap_range.high },
        stress: Shown { label: "normal stress", unit: stress, low: stress_range.low, high: stress_range.high },
        ramp: (0..=RAMP).map(|i| picture::colour(i as f64 / RAMP as f64)).collect(),
        layers: sources.iter().map(layer).collect(),
        views,
    }
}

fn flags(map: &DownsampledMap) -> Packed {
    let bytes: Vec<u8> = (0..map.values.len()).map(|i| u8::from(picture::touches(map, i))).collect();
    Packed { nx: map.nx, ny: map.ny, low: 0.0, high: 1.0, data: packed(&bytes) }
}

fn values(map: &DownsampledMap) -> Packed {
    let low = map.values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = map.values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let per_level = if high > low { LEVELS / (high - low) } else { 0.0 };
    let level = |v: f64| ((v - low) * per_level).round() as u16;
    let mut differences = Vec::with_capacity(map.values.len());
    for row in map.values.chunks(map.nx) {
        let mut last = 0_u16;
        for v in row {
            differences.push(level(*v).wrapping_sub(last));
            last = level(*v);
        }
    }
    let high_bytes = differences.iter().map(|d| (d >> 8) as u8);
    let bytes: Vec<u8> = high_bytes.chain(differences.iter().map(|d| (d & 0xff) as u8)).collect();
    Packed { nx: map.nx, ny: map.ny, low, high, data: packed(&bytes) }
}

fn packed(bytes: &[u8]) -> String {
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
    // Writing into memory does not fail.
    let _ = encoder.write_all(bytes);
    STANDARD.encode(encoder.finish().unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    /// Values decoded as the script decodes them.
    fn decoded(p: &Packed) -> Vec<f64> {
        let mut bytes = Vec::new();
        let compressed = STANDARD.decode(&p.data).expect("base64");
        flate2::read::ZlibDecoder::new(compressed.as_slice()).read_to_end(&mut bytes).expect("zlib");
        let (n, mut last) = (p.nx * p.ny, 0_u16);
        (0..n)
            .map(|i| {
                last = if i % p.nx == 0 { 0 } else { last };
                last = last.wrapping_add(u16::from(bytes[i]) << 8 | u16::from(bytes[n + i]));
                p.low + f64::from(last) * (p.high - p.low) / LEVELS
            })
            .collect()
    }

    #[test]
    fn values_survive_to_a_level() {
        let of = |values: Vec<f64>| DownsampledMap { nx: 7, ny: values.len() / 7, factor: 1, values };
        let map = of((0..35).map(|i| (f64::from(i) * 1.7).sin() - 0.3).collect());
        let found = decoded(&values(&map));
        assert!(map.values.iter().zip(&found).all(|(a, b)| (a - b).abs() <= 2.0 / LEVELS), "{found:?}");
        assert_eq!(decoded(&values(&of(vec![2.5; 14]))), [2.5; 14]);
    }
}

//! Maps of the first screen: the drawings that show without JavaScript, and the same maps as compressed arrays for the
//! script of the page.

use serde::Serialize;

use super::compare::{SUPERPOSED, at_load, key, matched, state_at, yielding};
use super::loads::{of_gap, of_stress};
use super::packed::{self, Packed};
use super::prelude::*;
use crate::record::downsample::DownsampledMap;
use crate::report::picture::Picture;
use asperity_grid::error::Error;
use asperity_grid::units::ANGSTROM_M;
use asperity_grid::{Grid, smoothed};

/// Maximum side of the maps for the script, cells: with gap, stress and contact of two sources at three loads the page
/// stays below 5 MB.
pub(super) const SIDE: usize = 256;
/// Colours of the ramp given to the script, which interpolates between them.
const RAMP: usize = 32;

#[derive(Debug, Serialize)]
struct ShownField {
    label: &'static str,
    unit: String,
    #[serde(flatten)]
    range: ColourRange,
}

#[derive(Debug, Serialize)]
struct MapLayer {
    title: String,
    colour: Rgb,
    /// Contact fraction at each load, if the title shows it.
    shares: Vec<String>,
    contact: Vec<Option<Packed>>,
    gap: Vec<Option<Packed>>,
    stress: Vec<Option<Packed>>,
}

/// One of the three frames: a layer with a fixed quantity or the selected one. Contact is superposed on that of `over`.
#[derive(Debug, Serialize)]
struct View {
    layer: usize,
    quantity: Option<&'static str>,
    over: Option<usize>,
}

#[derive(Debug, Serialize)]
struct Explorer {
    length: [f64; 2],
    unit: String,
    loads: Vec<String>,
    /// Index of the load that is shown first: the highest.
    shown: usize,
    gap: ShownField,
    stress: ShownField,
    ramp: Vec<Rgb>,
    layers: Vec<MapLayer>,
    views: [View; 3],
}

/// Fields of one source at one load, in the units shown, and its contact fraction if the title shows it.
#[derive(Default)]
struct FieldMaps {
    share: Option<f64>,
    contact: Option<DownsampledMap>,
    gap: Option<DownsampledMap>,
    stress: Option<DownsampledMap>,
}

/// Fields of a solution, one entry per load. `colour`: of its contact, and of its lines if it is not superposed on the atoms.
struct Source {
    title: String,
    colour: Rgb,
    fields: Vec<FieldMaps>,
}

/// The three maps; `None` if no field is stored.
pub(super) fn section(writer: &FigureWriter, results: &Results) -> Result<Option<Markup>> {
    let loaded = match (&results.atoms, &results.comparison) {
        (Some(atoms), Some(c)) => of_comparison(writer, atoms, c)?,
        _ => match &results.continuum {
            Some(c) => of_continuum(writer, c)?,
            None => return Ok(None),
        },
    };
    let Some(shown) = loaded.highest() else { return Ok(None) };
    let complete = |f: &FieldMaps| f.contact.is_some();
    if !loaded.sources.iter().all(|s| s.fields.get(shown).is_some_and(complete)) {
        return Ok(None);
    }
    let figures = drawings(writer, &loaded.sources, shown, loaded.length_m)?;
    let sources = &loaded.sources;
    let script = explorer(&loaded, shown, writer.aspect);
    Ok(Some(html! {
        div.maps {
            @for (title, drawing) in &figures {
                div.view { div.panel-title { (title) } (drawing) }
            }
        }
        p.quiet.key {
            @if sources.len() > 1 {
                (key(&SUPERPOSED))
                @if sources.len() > 2 { (key(&[(PURPLE, "gap and stress with hardness")])) }
            }
            span.at-load { (script.loads[shown]) }
            @if let Some(width) = results.comparison.as_ref().and(results.atoms.as_ref()).and_then(smoothing) {
                "Stress: the atoms’ forces and the continuum’s stress are spread by a Gaussian with a standard deviation of " (trimmed(width, 3)) " Å."
            }
        }
        (data(writer, "maps", &script)?)
    }))
}

/// Data for the script of the page.
pub(super) fn data(writer: &FigureWriter, id: &str, data: &impl Serialize) -> Result<Markup> {
    let json =
        serde_json::to_string(data).map_err(|e| Error::format(writer.folder, e.to_string(), "finite numbers"))?;
    Ok(html! { script type="application/json" id=(id) { (PreEscaped(json.replace("</", "<\\/"))) } })
}

/// Width of the Gaussian that makes a field of the forces on the atoms, Å.
fn smoothing(atoms: &AtomsResults) -> Option<f64> {
    atoms.states.iter().find_map(|s| s.stress.as_ref()).map(|s| s.width_angstrom)
}

/// The drawings of the highest load, with their titles.
fn drawings(writer: &FigureWriter, sources: &[Source], load: usize, length_m: f64) -> Result<Vec<(String, Markup)>> {
    let mut figures = Vec::new();
    for (k, view) in views(sources).iter().enumerate() {
        let Some((name, title, picture)) = drawing(sources, (k, view), load).transpose()? else { continue };
        figures.push((title.clone(), writer.map((&name, &title), &picture, length_m)?));
    }
    Ok(figures)
}

/// Name, title and picture of a view; `None` without its field.
fn drawing(sources: &[Source], (k, view): (usize, &View), load: usize) -> Option<Result<(String, String, Picture)>> {
    let source = &sources[view.layer];
    let (here, name) = (&source.fields[load], format!("first-{}", k + 1));
    let contact = here.contact.as_ref()?;
    let (name, title, picture) = match (view.quantity, view.over.and_then(|o| sources[o].fields[load].contact.as_ref()))
    {
        (Some("gap"), _) => {
            let gap = here.gap.as_ref()?;
            ("first-gap".into(), "Gap".into(), picture::gap(gap, of_gap(&gap.values), contact))
        }
        (Some("stress"), _) => {
            let stress = here.stress.as_ref()?;
            ("first-stress".into(), "Normal stress".into(), Ok(picture::map(stress, of_stress(&stress.values))))
        }
        (_, Some(over)) if (contact.nx, contact.ny) != (over.nx, over.ny) => return None,
        (quantity, Some(over)) => {
            let title = if quantity.is_some() { "Superposed".into() } else { source.title_at(load) };
            (name, title, picture::superposed(contact, over))
        }
        (_, None) => (name, source.title_at(load), Ok(picture::contact(contact, source.colour))),
    };
    Some(picture.map(|picture| (name, title, picture)))
}

impl Source {
    /// Contact fraction at a load in per cent; empty if the title does not show it.
    fn share(&self, load: usize) -> String {
        self.fields[load].share.map_or(String::new(), percent)
    }

    fn title_at(&self, load: usize) -> String {
        match self.share(load) {
            share if share.is_empty() => self.title.clone(),
            share => format!("{}: {share}", self.title),
        }
    }
}

/// Contact, gap and stress of one source; two sources and both superposed; elastic continuum and continuum with hardness, each
/// superposed on the atoms, and the atoms.
fn views(sources: &[Source]) -> [View; 3] {
    let alone = |layer, quantity| View { layer, quantity, over: None };
    let on = |layer, over, quantity| View { layer, quantity, over: Some(over) };
    match sources {
        [_] => [alone(0, Some("contact")), alone(0, Some("gap")), alone(0, Some("stress"))],
        [_, _] => [alone(0, None), alone(1, None), on(0, 1, Some("contact"))],
        _ => [on(0, 2, None), on(1, 2, None), alone(2, None)],
    }
}

/// Fields of the loads.
struct Loaded {
    /// p* and label of each load.
    loads: Vec<(f64, String)>,
    sources: Vec<Source>,
    length_m: f64,
    /// Units of gap and stress.
    units: [String; 2],
}

impl Loaded {
    /// Index of the highest load, on loading where it was also met on unloading; `None` without loads.
    fn highest(&self) -> Option<usize> {
        (0..self.loads.len()).rev().max_by(|a, b| self.loads[*a].0.total_cmp(&self.loads[*b].0))
    }
}

/// The compliant-wall continuum, the same with the crystal's hardness where solved, and the atoms; Å and GPa.
fn of_comparison(writer: &FigureWriter, atoms: &AtomsResults, c: &ComparisonResults) -> Result<Loaded> {
    let length = |v: f64| v * atoms.length_angstrom;
    // As the atoms' forces are spread.
    let width = smoothing(atoms).map(|w| w / atoms.length_angstrom);
    let smooth = |mut map: DownsampledMap| {
        if let Some(width) = width {
            map.values = smoothed(Grid::unit(map.nx, map.ny), &map.values, width);
        }
        map
    };
    let of_continuum = |c: &ContinuumResults, load: &LoadComparison, m: &CriterionMatch, gap| -> Result<FieldMaps> {
        let stress = state_at(c, load).and_then(State::stress_file);
        Ok(FieldMaps {
            share: Some(m.contact_area),
            contact: m.map.as_deref().map(|f| writer.flags(f, SIDE)).transpose()?,
            gap,
            stress: stress.map(|f| writer.load(f, SIDE, |v| v * atoms.modulus_gpa)).transpose()?.map(smooth),
        })
    };
    // Gaps are measured from the dilated heights; those of the compliant wall are also stored from the original heights.
    let from_heights = |c_hard: &ContinuumResults, load: &LoadComparison| -> Result<Option<DownsampledMap>> {
        let [hard, elastic] = [c_hard, &c.compliant_wall].map(|c| state_at(c, load)?.gap_file());
        let (Some(hard), Some(elastic)) = (hard, elastic) else { return Ok(None) };
        let [hard, elastic, heights] = [hard, elastic, &load.compliant_wall_gap].map(|f| writer.load(f, SIDE, length));
        let (mut gap, elastic, heights) = (hard?, elastic?, heights?);
        if [&elastic, &heights].iter().any(|m| (m.nx, m.ny) != (gap.nx, gap.ny)) {
            return Ok(None);
        }
        for (v, (e, h)) in gap.values.iter_mut().zip(elastic.values.iter().zip(&heights.values)) {
            *v += h - e;
        }
        Ok(Some(gap))
    };
    let (mut loads, mut elastic, mut hard, mut block) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for load in &c.loads {
        let (Some(m), Some(state)) = (matched(load), at_load(&atoms.states, load.p_star, |s| s.p_star)) else {
            continue;
        };
        let gap = writer.load(&load.compliant_wall_gap, SIDE, length)?;
        elastic.push(of_continuum(&c.compliant_wall, load, m, Some(gap))?);
        if let Some((wall, m)) = c.yielding_wall.as_ref().and_then(|w| Some((w, yielding(load)?))) {
            hard.push(of_continuum(wall, load, m, from_heights(wall, load)?)?);
        }
        block.push(FieldMaps {
            share: Some(load.atoms.contact_area),
            contact: Some(writer.flags(&state.contact_map, SIDE)?),
            gap: Some(writer.load(&state.gap_map, SIDE, |v| v)?),
            stress: state.stress.as_ref().map(|s| writer.load(&s.map, SIDE, |v| v)).transpose()?,
        });
        loads.push((load.p_star, writer.loads.label(load.p_star)));
    }
    let source = |title: &str, colour, fields| Source { title: title.into(), colour, fields };
    let atoms_alone = source("Atoms", BLUE, block);
    let sources = if hard.len() == loads.len() && !hard.is_empty() {
        let elastic = source("Elastic continuum", ORANGE, elastic);
        vec![elastic, source("Continuum with hardness", PURPLE, hard), atoms_alone]
    } else {
        let label = c.loads.first().and_then(matched).map(|m| format!("Continuum, {}", m.label()));
        vec![source(&label.unwrap_or("Continuum".into()), ORANGE, elastic), atoms_alone]
    };
    Ok(Loaded { loads, sources, length_m: atoms.length_angstrom * ANGSTROM_M, units: ["Å".into(), "GPa".into()] })
}

/// The continuum at the scale of the scene.
fn of_continuum(writer: &FigureWriter, c: &ContinuumResults) -> Result<Loaded> {
    let stored = |s: &&State| s.gap_map.is_some() && s.stop != Stop::Detached;
    let states: Vec<&State> = c.states.iter().filter(stored).collect();
    let highest = states.iter().filter_map(|s| s.mean_gap).fold(0.0, f64::max);
    let pressure = |s: &&State| s.pressure.abs() / s.contact_area.max(1e-3);
    let strongest = states.iter().map(pressure).fold(0.0, f64::max);
    let ((gap_factor, gap_prefix), (stress_factor, stress_prefix)) = (si_scale(highest), si_scale(strongest));
    let (mut loads, mut fields) = (Vec::new(), Vec::new());
    for state in states {
        let Some(gap) = state.gap_file() else { continue };
        let stress = state.stress_file();
        let in_unit = |v: f64| v * writer.scales.modulus_pa / stress_factor;
        fields.push(FieldMaps {
            share: None,
            contact: Some(writer.closed(gap, SIDE)?),
            gap: Some(writer.load(gap, SIDE, |v| v * writer.scales.length_m / gap_factor)?),
            stress: stress.map(|f| writer.load(f, SIDE, in_unit)).transpose()?,
        });
        let branch = if state.branch == Branch::Unloading { ", unloading" } else { "" };
        loads.push((state.p_star, writer.loads.label(state.p_star) + branch));
    }
    let units = [format!("{gap_prefix}m"), format!("{stress_prefix}Pa")];
    let source = Source { title: "Contact".into(), colour: BLACK, fields };
    Ok(Loaded { loads, sources: vec![source], length_m: writer.scales.length_m, units })
}

fn explorer(loaded: &Loaded, shown: usize, aspect: f64) -> Explorer {
    let Loaded { loads, sources, length_m, units: [gap, stress] } = loaded;
    let all = |value: fn(&FieldMaps) -> Option<&DownsampledMap>| {
        sources.iter().flat_map(|s| &s.fields).filter_map(value).flat_map(|m| &m.values).copied().collect::<Vec<f64>>()
    };
    let values = |source: &Source, value: fn(&FieldMaps) -> Option<&DownsampledMap>| {
        source.fields.iter().map(|f| value(f).map(packed::values)).collect()
    };
    let layer = |source: &Source| MapLayer {
        title: source.title.clone(),
        colour: source.colour,
        shares: (0..source.fields.len()).map(|i| source.share(i)).collect(),
        contact: source.fields.iter().map(|f| f.contact.as_ref().map(packed::flags)).collect(),
        gap: values(source, |f| f.gap.as_ref()),
        stress: values(source, |f| f.stress.as_ref()),
    };
    let (scale, prefix) = si_scale(*length_m);
    Explorer {
        length: [length_m / scale, length_m * aspect / scale],
        unit: format!("{prefix}m"),
        loads: loads.iter().map(|(_, label)| label.clone()).collect(),
        shown,
        gap: ShownField { label: "gap", unit: gap.clone(), range: of_gap(&all(|f| f.gap.as_ref())) },
        stress: ShownField {
            label: "normal stress",
            unit: stress.clone(),
            range: of_stress(&all(|f| f.stress.as_ref())),
        },
        ramp: (0..=RAMP).map(|i| picture::colour(i as f64 / RAMP as f64)).collect(),
        layers: sources.iter().map(layer).collect(),
        views: views(sources),
    }
}

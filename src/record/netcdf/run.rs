//! Results of a run as a single NetCDF file in SI units: maps with coordinates, curves and distributions.

use super::curves::curves;
use crate::record::acceptance::AcceptanceCheck;
use crate::record::results::{Results, SurfaceResults};
use asperity_atoms::results::AtomsResults;
use asperity_contact::observe::Distribution;
use asperity_contact::results::ContinuumResults;
use asperity_contact::state::{Observed, State};
use asperity_grid::error::Result;
use asperity_grid::units::ANGSTROM_M;
use asperity_surface::files::netcdf::write;
use asperity_surface::files::netcdf::{Attribute, Variable, VariableData, counter};
use asperity_surface::files::npy::NpyReader;
use asperity_surface::height_map::Touching;
use std::path::{Path, PathBuf};

/// Name of the file in a run folder.
pub const FILE: &str = "results.nc";

const ATOMS_MAP: [&str; 3] = ["atoms_load", "atoms_y", "atoms_x"];

/// Writes `results.nc` into a run folder, from the results and the field files that they name.
pub fn write_run(folder: &Path, results: &Results) -> Result<()> {
    let text = |key: &str, value: &str| (key.to_string(), Attribute::Text(value.to_string()));
    let mut attributes = vec![
        text("title", &results.name),
        text("description", &results.description),
        text("source", &format!("asperity {}", env!("CARGO_PKG_VERSION"))),
        text("references", &results.sources.join("\n")),
        ("length_m".to_string(), Attribute::Number(results.scales.length_m)),
        ("contact_modulus_pa".to_string(), Attribute::Number(results.scales.modulus_pa)),
    ];
    let (length, modulus) = (results.scales.length_m, results.scales.modulus_pa);
    let mut list = surface(folder, &results.surface, length);
    if let Some(continuum) = &results.continuum {
        let words = [("method", &continuum.method), ("kernel", &continuum.kernel)];
        let words = words.into_iter().chain([("adhesion", &continuum.adhesion), ("wall", &continuum.wall)]);
        attributes.extend(words.map(|(key, value)| text(key, value)));
        let number = |key: &str, value: f64| (key.to_string(), Attribute::Number(value));
        attributes.extend(continuum.range.map(|r| number("range_m", r.used)));
        attributes.extend(continuum.dissipation.map(|w| number("dissipation_j_m2", w)));
        if let Some([open, sealed]) = continuum.percolation {
            attributes.extend([number("percolates_to_p_star", open), number("sealed_from_p_star", sealed)]);
        }
        list.extend(solved(folder, continuum, length, modulus));
    }
    let ranges = results.other_ranges.iter().enumerate().map(|(i, c)| (format!("range_{}_", i + 1), c));
    let others = results.non_adhesive.iter().map(|c| ("non_adhesive_".to_string(), c)).chain(ranges);
    for (prefix, c) in others.chain(results.cross_check.iter().map(|c| ("cross_check_".to_string(), c))) {
        attributes
            .extend([text(&format!("{prefix}method"), &c.method), text(&format!("{prefix}adhesion"), &c.adhesion)]);
        attributes.extend(c.range.map(|r| (format!("{prefix}range_m"), Attribute::Number(r.used))));
        list.extend(solved(folder, c, length, modulus).into_iter().map(|v| v.prefixed(&prefix, &["x", "y"])));
    }
    if !results.acceptance.is_empty() {
        let said = |j: &AcceptanceCheck| {
            let value = j.value.map_or(String::new(), |v| format!(" {v}"));
            format!("{}{value}: {}", j.id, j.status)
        };
        let lines: Vec<String> = results.acceptance.iter().map(said).collect();
        attributes.push(text("acceptance", &lines.join("\n")));
    }
    if let Some(atoms) = &results.atoms {
        list.extend(of_atoms(folder, atoms)?);
    }
    write(&folder.join(FILE), &attributes, &list)
}

/// All variables of one load path.
fn solved(folder: &Path, c: &ContinuumResults, length: f64, modulus: f64) -> Vec<Variable> {
    let mut list = curves(c);
    list.extend(maps(folder, c, length, modulus));
    list.extend(distributions(&c.states));
    list
}

/// Coordinate with the positions of `n` nodes of a periodic cell.
fn axis(name: &str, n: usize, extent: f64) -> Variable {
    let positions = (0..n).map(|i| i as f64 * extent / n as f64).collect();
    Variable::new(
        name,
        &[name],
        VariableData::Numbers(positions),
        "m",
        &format!("position along {}", &name[name.len() - 1..]),
    )
}

fn surface(folder: &Path, s: &SurfaceResults, length: f64) -> Vec<Variable> {
    let mut list = vec![axis("x", s.nx, length), axis("y", s.ny, length * s.aspect)];
    if let Some(file) = &s.heights {
        // A single map, without a load dimension.
        let file = VariableData::Scaled(vec![folder.join(file)], length);
        let heights = Variable::new("heights", &["y", "x"], file, "m", "height of the rigid surface")
            .with("sign", Attribute::Text(Touching::LowPoints.words().into()))
            .with("origin", Attribute::Text(s.origin.clone()));
        list.push(heights);
    }
    if !s.psd.is_empty() {
        let mode = s.psd.iter().map(|p| p.mode).collect();
        let square = length * length;
        let psd =
            |values: Vec<f64>, name, long| Variable::new(name, &["mode"], VariableData::Numbers(values), "m2", long);
        list.push(Variable::new("mode", &["mode"], VariableData::Numbers(mode), "1", "wave number |q| L/2π"));
        list.push(psd(s.psd.iter().map(|p| p.realised * square).collect(), "psd", "mean |a|² of the waves, realised"));
        if s.psd.iter().any(|p| p.expected.is_some()) {
            let expected = s.psd.iter().map(|p| p.expected.map_or(f64::NAN, |e| e * square)).collect();
            list.push(psd(expected, "psd_expected", "mean |a|² of the waves, expected from the spectrum"));
        }
    }
    list
}

/// The states with stored maps, with their indices.
pub(in crate::record) fn stored(c: &ContinuumResults) -> impl Iterator<Item = (usize, &State)> {
    c.states.iter().enumerate().filter(|(_, s)| s.gap_map.is_some() && s.stress_map.is_some())
}

/// Fields of the continuum: along `load` if stored for every load, otherwise along `map_load`, the loads with stored
/// fields.
fn maps(folder: &Path, c: &ContinuumResults, length: f64, modulus: f64) -> Vec<Variable> {
    let stored: Vec<(usize, &State)> = stored(c).collect();
    if stored.is_empty() {
        return Vec::new();
    }
    let files = |value: fn(&State) -> Option<&str>| -> Vec<PathBuf> {
        stored.iter().filter_map(|(_, s)| value(s)).map(|file| folder.join(file)).collect()
    };
    let (gaps, stresses) = (files(State::gap_file), files(State::stress_file));
    let mut list = Vec::new();
    let dimensions = if stored.len() == c.states.len() { "load" } else { "map_load" };
    if dimensions == "map_load" {
        let numbers = VariableData::Numbers(stored.iter().map(|(i, _)| (i + 1) as f64).collect());
        list.push(Variable::new(dimensions, &[dimensions], numbers, "1", "number of a load with stored maps"));
    }
    let map = |name, data, units, long_name| Variable::new(name, &[dimensions, "y", "x"], data, units, long_name);
    list.push(map("gap", VariableData::Scaled(gaps.clone(), length), "m", "gap between the surfaces"));
    list.push(
        map("contact", VariableData::AtMostZero(gaps), "1", "1 at nodes in contact")
            .with("criterion", Attribute::Text("zero gap".into())),
    );
    list.push(map("stress", VariableData::Scaled(stresses, modulus), "Pa", "interfacial stress, compression positive"));
    list
}

/// Rows of different lengths as a rectangular array, padded with NaN.
fn ragged(rows: &[Vec<f64>], width: usize) -> VariableData {
    let filled =
        |row: &Vec<f64>| row.iter().copied().chain(std::iter::repeat(f64::NAN)).take(width).collect::<Vec<_>>();
    VariableData::Numbers(rows.iter().flat_map(filled).collect())
}

/// Probability densities and cluster areas, one row per load.
fn distributions(states: &[State]) -> Vec<Variable> {
    type Of = fn(&Observed) -> Option<&Distribution>;
    let available: Vec<Option<&Observed>> = states.iter().map(|s| s.observed.as_ref()).collect();
    if available.iter().all(Option::is_none) {
        return Vec::new();
    }
    let mut list = Vec::new();
    // One row per load, along a new dimension.
    let mut table = |dimension: &str, columns: &[(&str, &str, &str, Vec<Vec<f64>>)]| {
        let width = columns.iter().flat_map(|c| &c.3).map(Vec::len).max().unwrap_or(0);
        if width > 0 {
            list.push(counter(dimension, 0, width, "number of the bin"));
            list.extend(columns.iter().map(|(name, units, long, rows)| {
                Variable::new(name, &["load", dimension], ragged(rows, width), units, long)
            }));
        }
    };
    let rows = |value: &dyn Fn(&Observed) -> Vec<f64>| -> Vec<Vec<f64>> {
        available.iter().map(|o| o.map_or(Vec::new(), value)).collect()
    };
    let value: [(&str, &str, &str, Of); 4] = [
        ("gap", "m", "m-1", |o| o.gap.as_ref()),
        ("gap_logarithmic", "m", "m-1", |o| o.gap_logarithmic.as_ref()),
        ("stress", "Pa", "Pa-1", |o| o.stress.as_ref()),
        ("contact_stress", "Pa", "Pa-1", |o| o.contact_stress.as_ref()),
    ];
    for (name, units, inverse, value) in value {
        let density = |o: &Observed| value(o).map_or(Vec::new(), Distribution::density);
        let middle = rows(&|o| density(o).iter().map(|d| d.0).collect());
        let density = rows(&|o| density(o).iter().map(|d| d.1).collect());
        table(
            &format!("{name}_bin"),
            &[
                (&format!("{name}_middle"), units, "middle of the bin", middle),
                (&format!("{name}_density"), inverse, "probability density, of all nodes", density),
            ],
        );
    }
    table(
        "cluster_bin",
        &[
            ("cluster_area", "m2", "area of a cluster", rows(&|o| o.cluster_density.iter().map(|p| p[0]).collect())),
            (
                "cluster_density",
                "m-2",
                "probability density",
                rows(&|o| o.cluster_density.iter().map(|p| p[1]).collect()),
            ),
            ("cluster_count", "1", "clusters in the bin", rows(&|o| o.cluster_density.iter().map(|p| p[2]).collect())),
        ],
    );
    table(
        "cluster_rank",
        &[
            (
                "cluster_area_ranked",
                "m2",
                "area of a cluster",
                rows(&|o| o.cluster_area.iter().map(|p| p[0]).collect()),
            ),
            (
                "cluster_cumulative_fraction",
                "1",
                "fraction of the contact in clusters up to this area",
                rows(&|o| o.cluster_area.iter().map(|p| p[1]).collect()),
            ),
        ],
    );
    list
}

/// Maps and curves of the atoms on the comparison grid.
fn of_atoms(folder: &Path, atoms: &AtomsResults) -> Result<Vec<Variable>> {
    let mut list = Vec::new();
    if let Some(first) = atoms.states.first() {
        let map = NpyReader::open(&folder.join(&first.gap_map))?;
        let extent = atoms.length_angstrom * ANGSTROM_M;
        list.push(axis("atoms_x", map.nx, extent));
        list.push(axis("atoms_y", map.ny, extent * map.ny as f64 / map.nx as f64));
        list.push(counter("atoms_load", 1, atoms.states.len(), "number of the load"));
        let curve = |value: fn(&asperity_atoms::results::AtomState) -> f64| {
            VariableData::Numbers(atoms.states.iter().map(value).collect())
        };
        let dimensions = ["atoms_load"];
        list.push(Variable::new(
            "atoms_p_star",
            &dimensions,
            curve(|s| s.p_star),
            "1",
            "load over E* times rms gradient",
        ));
        let contact = "fraction of the surface atoms in contact";
        list.push(Variable::new("atoms_contact_area", &dimensions, curve(|s| s.contact_area), "1", contact));
        let gap = curve(|s| s.mean_gap_angstrom * ANGSTROM_M);
        list.push(Variable::new("atoms_mean_gap", &dimensions, gap, "m", "mean gap of the atoms"));
        let files = |value: fn(&asperity_atoms::results::AtomState) -> &String| -> Vec<PathBuf> {
            atoms.states.iter().map(|s| folder.join(value(s))).collect()
        };
        let gaps = VariableData::Scaled(files(|s| &s.gap_map), ANGSTROM_M);
        list.push(Variable::new("atoms_gap", &ATOMS_MAP, gaps, "m", "gap of the nearest surface atom"));
        let flags = VariableData::Flags(files(|s| &s.contact_map));
        list.push(Variable::new("atoms_contact", &ATOMS_MAP, flags, "1", "1 where the nearest surface atom touches"));
    }
    if !atoms.load_steps.is_empty() {
        let step = |value: fn(&asperity_atoms::results::LoadStepResults) -> f64| {
            VariableData::Numbers(atoms.load_steps.iter().map(value).collect())
        };
        let dimensions = ["load_step"];
        list.push(counter(dimensions[0], 0, atoms.load_steps.len(), "load step"));
        let down = step(|s| s.displacement_angstrom * ANGSTROM_M);
        list.push(Variable::new("load_step_displacement", &dimensions, down, "m", "descent of the indenter"));
        list.push(Variable::new(
            "load_step_p_star",
            &dimensions,
            step(|s| s.p_star),
            "1",
            "load over E* times rms gradient",
        ));
        list.push(Variable::new("load_step_contacts", &dimensions, step(|s| s.contacts as f64), "1", "contact atoms"));
    }
    Ok(list)
}

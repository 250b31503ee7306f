//! `results.xdmf`: the maps of `results.nc` for ParaView, one time step for each load. It holds no numbers of its own.

use super::netcdf::run as maps;
use super::results::Results;
use asperity_contact::state::State;
use asperity_grid::error::Result;
use asperity_surface::files::atomic_file::write_atomic;
use std::io::Write;
use std::path::Path;

/// Name of the file in a run folder.
pub const FILE: &str = "results.xdmf";

/// Maps of each load, with the type of their numbers.
const OF_LOADS: [(&str, &str); 3] =
    [("gap", FLOAT), ("stress", FLOAT), ("contact", "NumberType=\"UChar\" Precision=\"1\"")];

const FLOAT: &str = "NumberType=\"Float\" Precision=\"8\"";

/// Writes the file, if the run has stored maps.
///
/// # Errors
/// `Io`.
pub fn write(folder: &Path, results: &Results) -> Result<()> {
    let Some(text) = text(results) else { return Ok(()) };
    write_atomic(&folder.join(FILE), |w| w.write_all(text.as_bytes()))
}

fn text(results: &Results) -> Option<String> {
    let c = results.continuum.as_ref()?;
    let stored: Vec<&State> = maps::stored(c).map(|(_, state)| state).collect();
    if stored.is_empty() {
        return None;
    }
    let (surface, (nx, ny), loads) = (&results.surface, (c.nx, c.ny), stored.len());
    let (dx, dy) = (results.scales.length_m / nx as f64, results.scales.length_m * surface.aspect / ny as f64);
    let of_load = |k: usize, (name, kind): (&str, &str)| {
        attribute(
            name,
            &format!(
                "<DataItem ItemType=\"HyperSlab\" Dimensions=\"1 {ny} {nx}\"><DataItem Dimensions=\"3 3\" Format=\"XML\">{k} 0 0  1 1 1  1 {ny} {nx}\
                 </DataItem><DataItem Dimensions=\"{loads} {ny} {nx}\" {kind} Format=\"HDF\">{}:/{name}</DataItem></DataItem>",
                maps::FILE
            ),
        )
    };
    let has_heights = surface.heights.is_some() && (surface.nx, surface.ny) == (nx, ny);
    let heights = has_heights.then(|| {
        let stored =
            format!("<DataItem Dimensions=\"1 {ny} {nx}\" {FLOAT} Format=\"HDF\">{}:/heights</DataItem>", maps::FILE);
        attribute("heights", &stored)
    });
    let grid = |(k, state): (usize, &&State)| {
        let fields: String = OF_LOADS.map(|map| of_load(k, map)).into_iter().chain(heights.clone()).collect();
        format!(
            "<Grid Name=\"load {}\" GridType=\"Uniform\"><Time Value=\"{}\"/>\n\
             <Topology TopologyType=\"3DCoRectMesh\" Dimensions=\"1 {ny} {nx}\"/>\n\
             <Geometry GeometryType=\"ORIGIN_DXDYDZ\"><DataItem Dimensions=\"3\" Format=\"XML\">0 0 0</DataItem>\
             <DataItem Dimensions=\"3\" Format=\"XML\">{dx:e} {dy:e} {dx:e}</DataItem></Geometry>\n{fields}</Grid>\n",
            state.index + 1,
            state.index + 1
        )
    };
    let grids: String = stored.iter().enumerate().map(grid).collect();
    Some(format!(
        "<?xml version=\"1.0\"?>\n<Xdmf Version=\"2.0\"><Domain>\n\
         <Grid Name=\"loads\" GridType=\"Collection\" CollectionType=\"Temporal\">\n{grids}</Grid>\n</Domain></Xdmf>\n"
    ))
}

/// A map of nodes.
fn attribute(name: &str, values: &str) -> String {
    format!("<Attribute Name=\"{name}\" AttributeType=\"Scalar\" Center=\"Node\">{values}</Attribute>\n")
}

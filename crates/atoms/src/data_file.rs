//! The LAMMPS data file of block and indenter.

use std::fs::File;
use std::io::{self, BufWriter, Write};

use super::block::{Block, FLOOR_GAP_ANGSTROM};
use super::indenter::Indenter;
use super::job_files::Hashing;

/// Empty box above the highest atom of the indenter, Å.
const HEAD_ROOM_ANGSTROM: f64 = 5.0;

/// Writes the atoms as a LAMMPS data file and returns the BLAKE3 hash of the file. The box has space for an indenter
/// that rises by `max_rise_angstrom` above its initial position.
pub(super) fn write_data(
    file: File,
    block: &Block,
    indenter: &Indenter,
    max_rise_angstrom: f64,
    mass_u: f64,
) -> io::Result<String> {
    let mut out = BufWriter::with_capacity(1 << 16, Hashing { file, hasher: blake3::Hasher::new() });
    let length = block.length();
    writeln!(out, "fcc block {0} x {0} x {1} cells under a rigid indenter", block.cells, block.depth_cells)?;
    writeln!(out, "\n{} atoms\n3 atom types\n", block.atoms() + indenter.atoms())?;
    writeln!(out, "0.0 {length:.10} xlo xhi\n0.0 {length:.10} ylo yhi")?;
    let room = HEAD_ROOM_ANGSTROM + max_rise_angstrom;
    writeln!(out, "0.0 {:.10} zlo zhi\n", indenter.highest_z() + room)?;
    // LAMMPS requires a mass for every type; the mass of the indenter is not used.
    writeln!(out, "Masses\n\n1 {mass_u} # deformable\n2 {mass_u} # indenter\n3 {mass_u} # base\n\nAtoms # atomic\n")?;
    for site in block.sites() {
        let [x, y, z] = site.position;
        debug_assert!(z >= FLOOR_GAP_ANGSTROM);
        writeln!(out, "{} {} {x:.10} {y:.10} {z:.10}", site.id, if site.fixed { 3 } else { 1 })?;
    }
    for (id, [x, y, z]) in (block.atoms() + 1..).zip(indenter.positions()) {
        writeln!(out, "{id} 2 {x:.10} {y:.10} {z:.10}")?;
    }
    let hashing = out.into_inner().map_err(io::IntoInnerError::into_error)?;
    Ok(hashing.hasher.finalize().to_hex().to_string())
}

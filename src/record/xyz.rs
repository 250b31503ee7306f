//! Extended XYZ for OVITO and ASE.

use std::io::{self, Write};
use std::path::Path;

use asperity_grid::error::Result;
use asperity_surface::files::atomic_file::{miscount, write_atomic};

/// Species of an atom that is of no element: ASE refuses any name that is neither an element nor this.
pub const DUMMY: &str = "X";

/// One atom of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Atom<'a> {
    pub id: u64,
    /// Chemical symbol; [`DUMMY`] for an atom that is of no element.
    pub species: &'a str,
    pub position_angstrom: [f64; 3],
    pub contact: bool,
    /// Whether the atom is of the rigid indenter.
    pub indenter: bool,
}

/// Metadata of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct XyzHeader {
    /// Edges of the orthogonal cell. Periodic in x and y, open in z.
    pub cell_angstrom: [f64; 3],
    /// Where it is known.
    pub p_star: Option<f64>,
    /// Number of atoms, which the format requires first.
    pub atoms: usize,
}

/// Writes one frame atom by atom, without a second copy in memory. Returns an error if the number of atoms is wrong.
pub fn write<'a>(path: &Path, frame: XyzHeader, atoms: impl IntoIterator<Item = Atom<'a>>) -> Result<()> {
    write_atomic(path, |w| {
        let [a, b, c] = frame.cell_angstrom;
        writeln!(w, "{}", frame.atoms)?;
        writeln!(
            w,
            "Lattice=\"{a} 0 0 0 {b} 0 0 0 {c}\" Properties=species:S:1:pos:R:3:contact:I:1:id:I:1:indenter:I:1:color:R:3{} pbc=\"T T F\"",
            frame.p_star.map_or(String::new(), |p| format!(" p_star={p}"))
        )?;
        let mut count = 0;
        for atom in atoms {
            count += 1;
            if count > frame.atoms {
                return Err(miscount("atoms", "more", frame.atoms));
            }
            if atom.species.is_empty() || atom.species.contains(char::is_whitespace) {
                let message = format!("{:?} of atom {} is no species name", atom.species, atom.id);
                return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
            }
            let [x, y, z] = atom.position_angstrom;
            // Six decimals (1e-6 Å): 1 % of the smallest difference from the contact distance in the scaled-down challenge.
            let [contact, indenter] = [atom.contact, atom.indenter].map(u8::from);
            let colour = colour(&atom);
            writeln!(w, "{} {x:.6} {y:.6} {z:.6} {contact} {} {indenter} {colour}", atom.species, atom.id)?;
        }
        if count < frame.atoms { Err(miscount("atoms", count, frame.atoms)) } else { Ok(()) }
    })
}

/// Red, green and blue of an atom, from 0 to 1: contact orange, the block grey, the indenter blue (Okabe and Ito).
fn colour(atom: &Atom) -> &'static str {
    match (atom.indenter, atom.contact) {
        (true, _) => "0 0.45 0.7",
        (false, true) => "0.9 0.62 0",
        (false, false) => "0.62 0.62 0.62",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_reads_as_ovito_expects() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("frame.xyz");
        let frame = XyzHeader { cell_angstrom: [10.0, 20.5, 30.0], p_star: Some(0.01), atoms: 2 };
        let atoms = [
            Atom { id: 7, species: "Ca", position_angstrom: [0.0, 1.25, -2.0], contact: true, indenter: false },
            Atom { id: 9, species: DUMMY, position_angstrom: [9.0, 1e-7, 3.0], contact: false, indenter: true },
        ];
        write(&path, frame, atoms).unwrap();
        let expected = "2\nLattice=\"10 0 0 0 20.5 0 0 0 30\" \
                      Properties=species:S:1:pos:R:3:contact:I:1:id:I:1:indenter:I:1:color:R:3 p_star=0.01 pbc=\"T T F\"\n\
                      Ca 0.000000 1.250000 -2.000000 1 7 0 0.9 0.62 0\nX 9.000000 0.000000 3.000000 0 9 1 0 0.45 0.7\n";
        assert_eq!(std::fs::read_to_string(&path).unwrap(), expected);
        assert!(write(&path, frame, atoms.into_iter().take(1)).unwrap_err().to_string().contains("1 atoms were given"));
        let blank = Atom { species: "C a", ..atoms[0] };
        assert!(write(&path, frame, [blank, blank]).is_err());
    }
}

//! Potentials of pairs alone whose crystal is bcc or hcp: wells at the distances of its neighbours.

use std::path::Path;

/// Nearest neighbours, Å.
const BOND: f64 = 2.5;
/// Depth, eV, and width, Å, of the well at the nearest neighbours.
const WELL: (f64, f64) = (0.3, 0.15);
const ROWS: usize = 2000;
const CUTOFF: f64 = 5.0;

/// Distance of the second neighbours of bcc over that of the nearest: with a well there, 14 neighbours bind, 12 in fcc.
pub(crate) const BCC: (f64, f64) = (1.1547005383792515, 1.0);
/// A distance that hcp has, √(8/3), and fcc has not. The well is shallow.
pub(crate) const HCP: (f64, f64) = (1.632993161855452, 0.1);

/// Writes a table of `element` with a second well (distance over that of the nearest neighbours, depth over theirs).
pub(crate) fn write(file: &Path, element: &str, second: (f64, f64)) {
    let gauss = |r: f64, at: f64| (-((r - at) / WELL.1).powi(2)).exp();
    let wells = |r: f64| WELL.0 * (gauss(r, BOND) + second.1 * gauss(r, second.0 * BOND));
    // Hard inside the nearest neighbours, nothing at them.
    let core = |r: f64| 5.0 * (-(r / 1.7).powi(8)).exp();
    let step = CUTOFF / (ROWS - 1) as f64;
    let mut text = format!("pairs\n\n\n1 {element}\n{ROWS} 0.001 {ROWS} {step:.16e} {CUTOFF}\n1 50.0 0.0 none\n");
    (0..2 * ROWS).for_each(|_| text += "0.0\n");
    for row in 0..ROWS {
        let r = row as f64 * step;
        text += &format!("{:.16e}\n", r * (core(r) - wells(r)));
    }
    std::fs::write(file, text).expect("written");
}

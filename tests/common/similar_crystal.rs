//! A crystal similar to the shipped one, with the lattice constant and about the contact modulus of aluminium.

use std::path::Path;

/// Lattice constant, Å, and contact modulus, GPa, of this crystal and of the shipped one.
pub(crate) const ALUMINIUM: (f64, f64) = (4.05, 80.0);
pub(crate) const CALCIUM: (f64, f64) = (5.5884, 28.57);

/// Writes the shipped potential in other units of length and energy: F and f over the same densities, distances and r φ scaled. Returns
/// the keys of `[atoms]` for it.
pub(crate) fn keys(file: &Path) -> String {
    let length = ALUMINIUM.0 / CALCIUM.0;
    let energy = ALUMINIUM.1 / CALCIUM.1 * length.powi(3);
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("potentials/Ca.eam.alloy");
    let text = std::fs::read_to_string(shipped).expect("the shipped potential");
    let mut lines = text.lines();
    let mut next = || lines.next().expect("a header").to_string();
    let comments = [next(), next(), next()].join("\n");
    assert_eq!(next().split_whitespace().collect::<Vec<_>>(), ["1", "Ca"]);
    let (sizes, atom) = (next(), next());
    let sizes: Vec<f64> = sizes.split_whitespace().map(|w| w.parse().expect("a number")).collect();
    let [rows, density, points, step, cutoff] = sizes[..] else { panic!("five numbers") };
    let mass =
        atom.split_whitespace().nth(1).and_then(|w| w.parse::<f64>().ok()).expect("a mass") * energy / length.powi(2);
    let values: Vec<f64> = lines.flat_map(str::split_whitespace).map(|w| w.parse().expect("a number")).collect();
    assert_eq!(values.len() as f64, rows + 2.0 * points);
    let factor = |k: usize| match k as f64 {
        k if k < rows => energy,
        k if k < rows + points => 1.0,
        _ => energy * length,
    };
    let numbers: Vec<String> = values.iter().enumerate().map(|(k, v)| format!("{:.16e}", v * factor(k))).collect();
    let head = format!("{comments}\n1 Al\n{rows} {density:e} {points} {:e} {:e}\n", step * length, cutoff * length);
    let text = format!("{head}13 {mass} {} fcc\n{}\n", ALUMINIUM.0, numbers.join("\n"));
    std::fs::write(file, text).expect("written");
    format!(
        "potential = {file:?}\nelement = \"Al\"\nlattice_constant = \"{} Å\"\nmodulus = \"{} GPa\"\n",
        ALUMINIUM.0, ALUMINIUM.1
    )
}

//! Energy and forces of atoms from an `eam/alloy` table, independent of LAMMPS.
//!
//! LAMMPS interpolates between the rows of the table by cubics whose slopes at the rows are fourth-order differences
//! (`PairEAM::interpolate`). With the same interpolation two independent sums over pairs agree to rounding.

use std::path::Path;

/// A tabulated function at `0, step, 2 step, …` with its slopes, per step.
struct Spline {
    step: f64,
    values: Vec<f64>,
    slopes: Vec<f64>,
}

impl Spline {
    fn through(values: Vec<f64>, step: f64) -> Self {
        let (f, n) = (&values, values.len());
        let slope = |m: usize| match m {
            0 => f[1] - f[0],
            1 => 0.5 * (f[2] - f[0]),
            _ if m + 1 == n => f[n - 1] - f[n - 2],
            _ if m + 2 == n => 0.5 * (f[n - 1] - f[n - 3]),
            _ => ((f[m - 2] - f[m + 2]) + 8.0 * (f[m + 1] - f[m - 1])) / 12.0,
        };
        let slopes = (0..n).map(slope).collect();
        Spline { step, values, slopes }
    }

    /// Value and derivative.
    fn at(&self, x: f64) -> (f64, f64) {
        let m = ((x / self.step) as usize).min(self.values.len() - 2);
        let p = x / self.step - m as f64;
        let rise = self.values[m + 1] - self.values[m];
        let (s, t) = (self.slopes[m], self.slopes[m + 1]);
        let (two, three) = (3.0 * rise - 2.0 * s - t, s + t - 2.0 * rise);
        (self.values[m] + p * (s + p * (two + p * three)), (s + p * (2.0 * two + p * 3.0 * three)) / self.step)
    }
}

/// The single element of an `eam/alloy` file.
pub(crate) struct Table {
    cutoff: f64,
    embedding: Spline,
    density: Spline,
    /// r φ(r).
    pair: Spline,
}

impl Table {
    pub(crate) fn read(file: &Path) -> Self {
        let text = std::fs::read_to_string(file).expect("the table");
        // Skips three comment lines and the line of elements; axes and the line of the element follow.
        let mut lines = text.lines().skip(4);
        let axes: Vec<f64> =
            lines.next().expect("axes").split_whitespace().map(|w| w.parse().expect("a number")).collect();
        let [rows_rho, step_rho, rows_r, step_r, cutoff] = axes[..] else { panic!("five numbers: {axes:?}") };
        let mut numbers = lines.skip(1).flat_map(str::split_whitespace).map(|w| w.parse::<f64>().expect("a number"));
        let mut take = |rows: f64, step: f64| Spline::through(numbers.by_ref().take(rows as usize).collect(), step);
        let (embedding, density, pair) = (take(rows_rho, step_rho), take(rows_r, step_r), take(rows_r, step_r));
        Table { cutoff, embedding, density, pair }
    }

    /// Energy (eV) and forces (eV/Å) of atoms in a periodic cube of edge `length` (Å), more than two cut-offs long.
    pub(crate) fn evaluate(&self, positions: &[[f64; 3]], length: f64) -> (f64, Vec<[f64; 3]>) {
        let n = positions.len();
        let mut near = Vec::new();
        for i in 0..n {
            for j in 0..i {
                let d: [f64; 3] = std::array::from_fn(|c| {
                    let d = positions[i][c] - positions[j][c];
                    d - (d / length).round() * length
                });
                let r = d.iter().map(|c| c * c).sum::<f64>().sqrt();
                if r < self.cutoff {
                    near.push((i, j, d, r));
                }
            }
        }
        let mut rho = vec![0.0; n];
        for &(i, j, _, r) in &near {
            let f = self.density.at(r).0;
            rho[i] += f;
            rho[j] += f;
        }
        let embedded: Vec<(f64, f64)> = rho.iter().map(|r| self.embedding.at(*r)).collect();
        let mut energy: f64 = embedded.iter().map(|e| e.0).sum();
        let mut forces = vec![[0.0; 3]; n];
        for &(i, j, d, r) in &near {
            let ((z, slope), fade) = (self.pair.at(r), self.density.at(r).1);
            energy += z / r;
            let pull = (slope - z / r) / r + (embedded[i].1 + embedded[j].1) * fade;
            for c in 0..3 {
                forces[i][c] -= pull * d[c] / r;
                forces[j][c] += pull * d[c] / r;
            }
        }
        (energy, forces)
    }
}

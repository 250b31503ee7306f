//! Operations on whole fields: convolutions with a symbol, inner products in a fixed order, common requirements, and
//! the residuals of a gap. Except for the transform this is independent of the row-wise operator of `bvm`, `fast` and
//! `gfmd`.

use super::residuals::Residuals;
use super::{Precision, ReducedProblem, require};
use asperity_grid::Result;
use asperity_grid::{Grid, HalfSpectrum, Transform, dot, mean, sum_rows};
use rayon::prelude::*;
use rustfft::num_complex::Complex;

/// Elements of a block, the unit of work of a thread.
const BLOCK: usize = 4096;

/// Multiplies fields by real symbols in Fourier space.
pub struct Convolution {
    transform: Transform<f64>,
    spectrum: HalfSpectrum<f64>,
    /// Transform pairs so far.
    pub fft_pairs: f64,
}

/// A real symbol on the half spectrum `[nx/2+1, ny]`, including the `1/N` of the transform.
pub struct Symbol(Vec<f64>);

impl Convolution {
    pub fn new(grid: Grid) -> Self {
        let transform = Transform::new(grid);
        let spectrum = transform.spectrum();
        Convolution { transform, spectrum, fft_pairs: 0.0 }
    }

    /// Bytes of a convolution with `symbols` symbols.
    pub fn bytes(grid: Grid, symbols: u64) -> u64 {
        Transform::<f64>::spectrum_bytes(grid) + symbols * (grid.half() * grid.ny * size_of::<f64>()) as u64
    }

    /// Symbol with the values `of(qx, qy)`.
    pub fn symbol(&self, value: impl Fn(f64, f64) -> f64 + Sync) -> Symbol {
        let grid = self.transform.grid();
        let per_point = 1.0 / grid.points() as f64;
        let mut values = vec![0.0; grid.half() * grid.ny];
        values.par_chunks_mut(grid.ny).enumerate().for_each(|(i, column)| {
            column.iter_mut().enumerate().for_each(|(j, v)| *v = per_point * value(grid.qx(i), grid.qy(j)));
        });
        Symbol(values)
    }

    /// Writes the convolution of `field` to `into`; one transform pair.
    pub fn apply(&mut self, symbol: &Symbol, field: &[f64], into: &mut [f64]) {
        let ny = self.transform.grid().ny;
        let filter = |i: usize, column: &mut [Complex<f64>]| {
            column.iter_mut().zip(&symbol.0[i * ny..]).for_each(|(c, &s)| *c = c.scale(s));
            0.0
        };
        self.transform.forward_filtered(field, &mut self.spectrum, &filter);
        self.transform.inverse(&mut self.spectrum, into);
        self.fft_pairs += 1.0;
    }
}

impl Symbol {
    /// The largest stored value, including `1/N`.
    pub fn most(&self) -> f64 {
        self.0.iter().copied().fold(f64::NEG_INFINITY, f64::max)
    }

    /// Sets the stored values to `value` of those of another symbol of the same grid, both including `1/N`.
    pub fn set(&mut self, from: &Symbol, value: impl Fn(f64) -> f64) {
        self.0.iter_mut().zip(&from.0).for_each(|(to, &v)| *to = value(v));
    }

    /// A symbol with the `value` of the stored ones, both including `1/N`.
    pub fn map(&self, value: impl Fn(f64) -> f64) -> Symbol {
        Symbol(self.0.iter().map(|&v| value(v)).collect())
    }
}

/// Mean of the product of two fields.
pub fn inner(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len();
    let block = |k: usize| k * BLOCK..n.min((k + 1) * BLOCK);
    let [sum] = sum_rows(n.div_ceil(BLOCK), |k| [dot(&a[block(k)], &b[block(k)])]);
    sum / n as f64
}

/// `to += factor · what`.
pub fn add(to: &mut [f64], factor: f64, damage: &[f64]) {
    to.par_chunks_mut(BLOCK)
        .zip(damage.par_chunks(BLOCK))
        .for_each(|(to, damage)| to.iter_mut().zip(damage).for_each(|(t, w)| *t += factor * w));
}

/// Sets every element of `to` to `of(index, value)`.
pub fn each(to: &mut [f64], value: impl Fn(usize, f64) -> f64 + Sync) {
    to.par_chunks_mut(BLOCK).enumerate().for_each(|(k, to)| {
        to.iter_mut().enumerate().for_each(|(i, t)| *t = value(k * BLOCK + i, *t));
    });
}

/// `K` means over the grid of the values `of(index)`.
pub fn means<const K: usize>(n: usize, value: impl Fn(usize) -> [f64; K] + Sync + Send) -> [f64; K] {
    let sums = sum_rows(n.div_ceil(BLOCK), |k| {
        let mut sums = [0.0; K];
        for i in k * BLOCK..n.min((k + 1) * BLOCK) {
            sums.iter_mut().zip(value(i)).for_each(|(s, v)| *s += v);
        }
        sums
    });
    sums.map(|s| s / n as f64)
}

/// Heights without their mean, for a method in f64 on a periodic cell.
///
/// # Errors
/// `Input` for another precision, a non-periodic body.
pub fn heights(problem: &ReducedProblem, id: &str) -> Result<Vec<f64>> {
    problem.expect_periodic(id)?;
    if problem.precision != Precision::F64 {
        return Err(require::refused(id, "precision", "f32", "f64"));
    }
    let mut heights = problem.heights.on_nodes(problem.grid).into_owned();
    let middle = mean(&heights);
    each(&mut heights, |_, h| h - middle);
    Ok(heights)
}

/// Residuals of a gap with the elastic stress plus pressure `stress` and the adhesive `traction`. With a hard wall
/// (`hard`) closed nodes may carry compression. The last argument is the elastic and the interaction energy.
pub fn residuals(gap: &[f64], stress: &[f64], traction: &[f64], hard: bool, (elastic, law): (f64, f64)) -> Residuals {
    let [square, missing, work, mean_gap, contact] = means(gap.len(), |i| {
        let (g, t) = (gap[i], stress[i] + traction[i]);
        let residual = if hard && g <= 0.0 { t.min(0.0) } else { t };
        [residual * residual, residual, (t * g).abs(), g, f64::from(u8::from(g <= 0.0))]
    });
    Residuals {
        elastic,
        interaction: law,
        mean_gap,
        mean_separation: mean_gap,
        contact,
        residual: if elastic.is_finite() { square.sqrt() } else { f64::NAN },
        imbalance: missing,
        complementarity: work,
        flow: 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// A wave is multiplied by its symbol; means and products equal direct sums.
    #[test]
    fn convolution_multiplies_a_wave_by_its_symbol() {
        let grid = Grid { nx: 12, ny: 10, lx: 1.0, ly: 0.5 };
        let wave = |i: usize| {
            let (x, y) = ((i % 12) as f64 / 12.0, (i / 12) as f64 / 10.0);
            (2.0 * PI * (3.0 * x - 2.0 * y)).cos() + 0.25
        };
        let field: Vec<f64> = (0..grid.points()).map(wave).collect();
        let mut convolution = Convolution::new(grid);
        let symbol = convolution.symbol(|qx, qy| 0.5 * qx.hypot(qy));
        let mut actual = vec![0.0; field.len()];
        convolution.apply(&symbol, &field, &mut actual);
        let k = 0.5 * (6.0 * PI).hypot(8.0 * PI);
        for (f, v) in actual.iter().zip(&field) {
            assert!((f - k * (v - 0.25)).abs() < 1e-12, "{f} {v}");
        }
        assert!((inner(&actual, &field) - 0.5 * k).abs() < 1e-12);
        let [m, s] = means(field.len(), |i| [field[i], field[i] * field[i]]);
        assert!((m - 0.25).abs() < 1e-14 && (s - inner(&field, &field)).abs() < 1e-14);
    }
}

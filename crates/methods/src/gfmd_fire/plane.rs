use asperity_contact::interface::{Elastic, Kernel};
use asperity_grid::{Grid, Real, signed_mode};
use rayon::prelude::*;
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftDirection};
use std::f64::consts::PI;
use std::sync::Arc;

/// The elastic body on the full complex spectrum: transform of rows, transposition, transform of columns,
/// multiplication by the stiffness, and inverse. Twice the work of a real transform, but no code in common with it.
pub(super) struct Plane {
    nx: usize,
    ny: usize,
    rows: [Arc<dyn Fft<f64>>; 2],
    columns: [Arc<dyn Fft<f64>>; 2],
    /// Spectrum `[ny, nx]`.
    by_rows: Vec<Complex<f64>>,
    /// Its transpose `[nx, ny]`.
    by_columns: Vec<Complex<f64>>,
    /// Stiffness of the modes over the number of points `[nx, ny]`.
    stiffness: Vec<f64>,
}

impl Plane {
    pub(super) fn new(grid: Grid, kernel: Elastic) -> Self {
        let (nx, ny) = (grid.nx, grid.ny);
        let per_point = 1.0 / grid.points() as f64;
        let stiffness = (0..nx * ny)
            .map(|i| {
                let (qx, qy) = (signed_mode(i / ny, nx) as f64 / grid.lx, signed_mode(i % ny, ny) as f64 / grid.ly);
                per_point * kernel.stiffness(2.0 * PI * qx, 2.0 * PI * qy)
            })
            .collect();
        Plane {
            nx,
            ny,
            rows: [FftDirection::Forward, FftDirection::Inverse].map(|d| f64::plan(nx, d)),
            columns: [FftDirection::Forward, FftDirection::Inverse].map(|d| f64::plan(ny, d)),
            by_rows: vec![Complex::default(); nx * ny],
            by_columns: vec![Complex::default(); nx * ny],
            stiffness,
        }
    }

    /// Bytes of two complex spectra and the stiffness.
    pub(super) fn bytes(grid: Grid) -> u64 {
        (grid.points() * (2 * size_of::<Complex<f64>>() + size_of::<f64>())) as u64
    }

    /// Writes the stress of the displacement `of(node)` to `into` `[ny, nx]`.
    pub(super) fn stress(&mut self, value: impl Fn(usize) -> f64 + Sync, into: &mut [f64]) {
        let (nx, ny) = (self.nx, self.ny);
        let [forward_row, inverse_row] = &self.rows;
        self.by_rows.par_chunks_mut(nx).enumerate().for_each_init(
            || vec![Complex::default(); forward_row.get_inplace_scratch_len()],
            |scratch, (y, row)| {
                row.iter_mut().enumerate().for_each(|(x, c)| *c = Complex::new(value(y * nx + x), 0.0));
                forward_row.process_with_scratch(row, scratch);
            },
        );
        transpose(&self.by_rows, nx, &mut self.by_columns);
        let [forward, inverse] = &self.columns;
        self.by_columns.par_chunks_mut(ny).zip(self.stiffness.par_chunks(ny)).for_each_init(
            || vec![Complex::default(); forward.get_inplace_scratch_len().max(inverse.get_inplace_scratch_len())],
            |scratch, (column, stiffness)| {
                forward.process_with_scratch(column, scratch);
                column.iter_mut().zip(stiffness).for_each(|(c, k)| *c *= k);
                inverse.process_with_scratch(column, scratch);
            },
        );
        transpose(&self.by_columns, ny, &mut self.by_rows);
        self.by_rows.par_chunks_mut(nx).zip(into.par_chunks_mut(nx)).for_each_init(
            || vec![Complex::default(); inverse_row.get_inplace_scratch_len()],
            |scratch, (row, into)| {
                inverse_row.process_with_scratch(row, scratch);
                into.iter_mut().zip(row).for_each(|(t, c)| *t = c.re);
            },
        );
    }
}

/// Transposes rows of `width` values.
fn transpose(from: &[Complex<f64>], width: usize, to: &mut [Complex<f64>]) {
    let height = from.len() / width;
    to.par_chunks_mut(height).enumerate().for_each(|(x, column)| {
        column.iter_mut().enumerate().for_each(|(y, c)| *c = from[y * width + x]);
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Comparison with the direct sum over modes and points, on grids of both parities.
    #[test]
    fn stress_equals_the_direct_sum() {
        for (nx, ny, ly) in [(6, 5, 0.7), (7, 4, 1.3), (1, 6, 1.0)] {
            let grid = Grid { nx, ny, lx: 1.0, ly };
            let field: Vec<f64> = (0..nx * ny).map(|i| ((i * 7) % 11) as f64 * 0.1).collect();
            let mut actual = vec![0.0; field.len()];
            Plane::new(grid, Elastic::HalfSpace).stress(|i| field[i], &mut actual);
            for (i, f) in actual.iter().enumerate() {
                let mut exact = 0.0;
                for (kx, ky) in (0..nx).flat_map(|kx| (0..ny).map(move |ky| (kx, ky))) {
                    let (kx, ky) = (signed_mode(kx, nx) as f64, signed_mode(ky, ny) as f64);
                    for (j, u) in field.iter().enumerate() {
                        let (x, y) = ((i % nx) as f64 - (j % nx) as f64, (i / nx) as f64 - (j / nx) as f64);
                        let phase = 2.0 * PI * (kx * x / nx as f64 + ky * y / ny as f64);
                        exact += PI * kx.hypot(ky / ly) * u * phase.cos() / (nx * ny) as f64;
                    }
                }
                assert!((f - exact).abs() < 1e-12, "{nx} x {ny}: {f} {exact}");
            }
        }
    }
}

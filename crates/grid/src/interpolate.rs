use super::{Grid, Real, Transform, signed_mode};
use rayon::prelude::*;
use rustfft::num_complex::Complex;

/// Fourier interpolation to the grid of `to` of a field given by its half spectrum on `from`. The mean and the modes
/// (kx, ky) below the Nyquist modes of both grids are included if they are `kept`. `scratch` is a spectrum of `to`.
pub fn interpolate<T: Real>(
    from: &Transform<T>,
    spectrum: &[Complex<T>],
    to: &Transform<T>,
    scratch: &mut [Complex<T>],
    field: &mut [T],
    kept: impl Fn(i64, i64) -> bool + Sync,
) {
    let (old, new) = (from.grid(), to.grid());
    let per_point = T::of(1.0 / old.points() as f64);
    let resolved = |k: i64, n: usize| k == 0 || 2 * k.unsigned_abs() < n as u64;
    let columns =
        (0..new.half().min(old.half())).filter(|&i| resolved(i as i64, new.nx) && resolved(i as i64, old.nx)).count();
    scratch.par_chunks_mut(new.pitch()).enumerate().for_each(|(j, row)| {
        row.fill(Complex::default());
        let ky = signed_mode(j, new.ny);
        if resolved(ky, new.ny) && resolved(ky, old.ny) {
            let start = ky.rem_euclid(old.ny as i64) as usize * old.pitch();
            for (kx, (value, source)) in row[..columns].iter_mut().zip(&spectrum[start..]).enumerate() {
                if kept(kx as i64, ky) {
                    *value = source.scale(per_point);
                }
            }
        }
    });
    to.inverse(scratch, field);
}

/// Bilinear interpolation on the periodic grid at (x, y); `value_of_node` returns the value of a node.
pub fn bilinear(grid: Grid, value_of_node: impl Fn(usize) -> f64, x: f64, y: f64) -> f64 {
    let (u, v) = (x / grid.dx(), y / grid.dy());
    let (i, j) = (u.floor(), v.floor());
    let (fx, fy) = (u - i, v - j);
    let wrap = |k: f64, n: usize| (k as i64).rem_euclid(n as i64) as usize;
    let value_at = |di: f64, dj: f64| value_of_node(wrap(j + dj, grid.ny) * grid.nx + wrap(i + di, grid.nx));
    (1.0 - fy) * ((1.0 - fx) * value_at(0.0, 0.0) + fx * value_at(1.0, 0.0))
        + fy * ((1.0 - fx) * value_at(0.0, 1.0) + fx * value_at(1.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bilinear_is_exact_on_a_plane_and_periodic() {
        let grid = Grid { nx: 5, ny: 4, lx: 1.0, ly: 2.0 };
        let node = |k: usize| 3.0 * (k % 5) as f64 - (k / 5) as f64;
        assert!((bilinear(grid, node, 0.33, 1.2) - (3.0 * 1.65 - 2.4)).abs() < 1e-12);
        assert!((bilinear(grid, node, 0.9, 0.0) - 6.0).abs() < 1e-12);
        assert_eq!(bilinear(grid, node, -0.2, -0.5), 12.0 - 3.0);
    }
}

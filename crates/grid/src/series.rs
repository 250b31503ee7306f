use super::sums::root_of_squares;
use super::{COLUMNS, Grid, Real, Transform, dot, signed_mode, vectorised};
use crate::sys::ranks::{ALONE, Ranks};
use rayon::prelude::*;
use rustfft::num_complex::Complex;
use std::sync::OnceLock;

/// Bytes of coefficients above which every rank computes all of them instead of receiving those of others.
const LARGEST_GATHERED: usize = 1 << 30;

/// A real periodic field without its mean, as the coefficients of its Fourier series `Σ a e^{iqr}` in a box of modes.
///
/// A rough surface whose shortest waves are much longer than a pixel has few modes: the challenge's two million take
/// 32 MB, its heights on 32768² points 8.6 GB.
#[derive(Debug, Clone, Default)]
pub struct Series<T> {
    /// `[kx][ky]`, kx = 0 … and ky in the order of an FFT.
    coefficients: Vec<Complex<T>>,
    /// Values of kx, and of ky.
    width: usize,
    height: usize,
    /// The grid whose nodes define the series. On other grids the Nyquist modes are omitted.
    nodes: Option<Grid>,
    /// See [`Series::whole`].
    whole: OnceLock<[f64; 2]>,
}

impl<T: Real> Series<T> {
    /// Modes up to kx_max and |ky| up to ky_max with the given amplitudes, without the mean.
    pub fn from_modes(kx_max: usize, ky_max: usize, amplitude: impl Fn(i64, i64) -> Complex<f64> + Sync) -> Self {
        Self::from_modes_on(&ALONE, kx_max, ky_max, amplitude)
    }

    /// The same on every rank, each of which computes a part of the amplitudes.
    pub fn from_modes_on(
        ranks: &Ranks,
        kx_max: usize,
        ky_max: usize,
        amplitude: impl Fn(i64, i64) -> Complex<f64> + Sync,
    ) -> Self {
        let (width, height) = (kx_max + 1, 2 * ky_max + 1);
        let ranks = if width * height * size_of::<Complex<T>>() < LARGEST_GATHERED { ranks } else { &ALONE };
        let local = ranks.share(width);
        let mut coefficients = vec![Complex::default(); local.len() * height];
        coefficients.par_chunks_mut(height).enumerate().for_each(|(k, column)| {
            let kx = local.start + k;
            for (j, value) in column.iter_mut().enumerate() {
                if kx > 0 || j > 0 {
                    let a = amplitude(kx as i64, signed_mode(j, height));
                    *value = Complex::new(T::of(a.re), T::of(a.im));
                }
            }
        });
        if ranks.are_several() {
            coefficients = ranks.gather(&coefficients, &ranks.shares(width, height));
        }
        Series { coefficients, width, height, nodes: None, whole: OnceLock::new() }
    }

    /// The series that interpolates a field `[ny, nx]` on a grid.
    pub fn from_nodes(grid: Grid, field: &[f64]) -> Self {
        Self::through(grid, &|i| field[i])
    }

    /// The series that interpolates the heights of the nodes `i = y nx + x` of a grid.
    pub fn through(grid: Grid, height: &(dyn Fn(usize) -> f64 + Sync)) -> Self {
        let transform = Transform::<f64>::new(grid);
        let mut spectrum = transform.spectrum();
        let mean = super::mean_of(grid.points(), height);
        transform.forward_of(
            &|y, row| row.iter_mut().enumerate().for_each(|(x, w)| *w = height(y * grid.nx + x) - mean),
            &mut spectrum,
        );
        let (width, height, per_point) = (grid.half(), grid.ny, 1.0 / grid.points() as f64);
        let mut coefficients = vec![Complex::default(); width * height];
        coefficients.par_chunks_mut(COLUMNS * height).enumerate().for_each(|(block, columns)| {
            for (j, row) in spectrum.chunks_exact(grid.pitch()).enumerate() {
                for (column, c) in columns.chunks_exact_mut(height).zip(&row[COLUMNS * block..]) {
                    column[j] = Complex::new(T::of(c.re * per_point), T::of(c.im * per_point));
                }
            }
        });
        coefficients[0] = Complex::default();
        Series { coefficients, width, height, nodes: Some(grid), whole: OnceLock::new() }
    }

    /// The sum of a series through the nodes of a grid and another one on that grid.
    pub fn plus(mut self, other: &Series<f64>) -> Self {
        let Some(grid) = self.nodes else { return self };
        self.coefficients.par_chunks_mut(self.height).enumerate().for_each(|(i, column)| {
            other.add_to(i, grid, column, T::one());
        });
        self.whole = OnceLock::new();
        self
    }

    /// The series with only the waves (kx, ky) that `keep` accepts.
    pub fn kept(&self, keep: impl Fn(i64, i64) -> bool + Sync) -> Self {
        let mut series = Series { whole: OnceLock::new(), ..self.clone() };
        series.coefficients.par_chunks_mut(self.height).enumerate().for_each(|(kx, column)| {
            for (j, value) in column.iter_mut().enumerate() {
                if !keep(kx as i64, signed_mode(j, self.height)) {
                    *value = Complex::default();
                }
            }
        });
        series
    }

    pub fn converted<U: Real>(&self) -> Series<U> {
        let convert = |c: &Complex<T>| Complex::new(U::of(c.re.wide()), U::of(c.im.wide()));
        Series {
            coefficients: self.coefficients.par_iter().map(convert).collect(),
            width: self.width,
            height: self.height,
            nodes: self.nodes,
            whole: self.whole.clone(),
        }
    }

    /// The series over a divisor.
    pub fn divided(&self, by: f64) -> Self {
        let mut series = self.clone();
        series.coefficients.par_iter_mut().for_each(|c| *c = c.unscale(T::of(by)));
        series.whole = self.whole.get().map_or_else(OnceLock::new, |whole| whole.map(|value| value / by).into());
        series
    }

    /// Largest magnitude of a real or imaginary part.
    fn largest(&self) -> f64 {
        self.coefficients.iter().map(|c| c.re.wide().abs().max(c.im.wide().abs())).fold(0.0, f64::max)
    }

    pub fn bytes(&self) -> u64 {
        size_of_val(&self.coefficients[..]) as u64
    }

    /// Column `i` of the half spectrum on a grid: the coefficients of ky = 0, 1, …, and those of the last negative ky
    /// …, -1. Modes from the grid's Nyquist modes on are omitted.
    pub fn column(&self, i: usize, grid: Grid) -> (&[Complex<T>], &[Complex<T>]) {
        let own = self.nodes.is_some_and(|g| (g.nx, g.ny) == (grid.nx, grid.ny));
        let resolved = |k: usize, n: usize| k == 0 || 2 * k < n;
        // Nyquist modes of the defining grid are ambiguous on others.
        let limit = |box_modes: usize, nodes: Option<usize>, n: usize| {
            (0..box_modes).rev().find(|&k| resolved(k, n) && nodes.is_none_or(|m| resolved(k, m))).unwrap_or(0)
        };
        if i >= self.width {
            return (&[], &[]);
        }
        let column = &self.coefficients[i * self.height..][..self.height];
        if own {
            return (column, &[]);
        }
        if !resolved(i, grid.nx) || !self.nodes.is_none_or(|g| resolved(i, g.nx)) {
            return (&[], &[]);
        }
        let top = limit(self.height / 2 + 1, self.nodes.map(|g| g.ny), grid.ny);
        (&column[..=top], &column[self.height - top..])
    }

    /// rms gradient of the waves that a grid resolves.
    pub fn rms_gradient(&self, grid: Grid) -> f64 {
        root_of_squares(|unit| self.root_of_sum(grid, unit, |q_squared| q_squared), || self.largest())
    }

    /// Root mean square of the waves that a grid resolves.
    pub fn resolved_rms(&self, grid: Grid) -> f64 {
        root_of_squares(|unit| self.root_of_sum(grid, unit, |_| 1.0), || self.largest())
    }

    /// A grid of the same cell that resolves every wave.
    pub fn resolving(&self, cell: Grid) -> Grid {
        let (nx, ny) = self.nodes.map_or((2 * self.width, self.height + 1), |nodes| (nodes.nx, nodes.ny));
        Grid { nx, ny, ..cell }
    }

    /// Root mean square and rms gradient of all waves on a cell, those included that [`Series::cut`] has left out.
    pub fn whole(&self, cell: Grid) -> [f64; 2] {
        let all = self.resolving(cell);
        *self.whole.get_or_init(|| [self.rms(), self.rms_gradient(all)])
    }

    /// Root mean square of all waves, those included that [`Series::cut`] has left out.
    pub fn whole_rms(&self) -> f64 {
        self.whole.get().map_or_else(|| self.rms(), |whole| whole[0])
    }

    /// Whether a grid holds every wave.
    pub fn is_held_by(&self, grid: Grid) -> bool {
        let [nx, ny] = self.nodes.map_or([2 * self.width - 1, self.height], |own| [own.nx, own.ny]);
        nx <= grid.nx && ny <= grid.ny
    }

    /// Only the waves that a grid holds, in less memory. [`Series::whole`] stays.
    pub fn cut(&self, grid: Grid) -> Self {
        if self.nodes.is_some_and(|own| (own.nx, own.ny) == (grid.nx, grid.ny)) {
            return self.clone();
        }
        let widest = (0..self.width).rev().find(|&i| !self.column(i, grid).0.is_empty()).unwrap_or(0);
        let (up, down) = self.column(0, grid);
        let (width, height) = (widest + 1, up.len() + down.len());
        let mut coefficients = Vec::with_capacity(width * height);
        for i in 0..width {
            let (up, down) = self.column(i, grid);
            coefficients.extend_from_slice(up);
            coefficients.extend_from_slice(down);
        }
        Series { coefficients, width, height, nodes: None, whole: self.whole(grid).into() }
    }

    /// Root of the sum of the resolved waves' squares, each times `weight` of its q².
    fn root_of_sum(&self, grid: Grid, unit: f64, weight: impl Fn(f64) -> f64 + Sync) -> f64 {
        let columns = (0..self.width.min(grid.half())).into_par_iter();
        let sums: Vec<f64> = columns
            .map(|i| {
                let (up, down) = self.column(i, grid);
                let qx = grid.qx(i);
                // Together the two parts are a column in FFT order.
                let rows = self.height.max(up.len() + down.len());
                let wave = |j: usize, c: &Complex<T>| {
                    let qy = std::f64::consts::TAU / grid.ly * signed_mode(j, rows) as f64;
                    weight(qx * qx + qy * qy) * c.unscale(T::of(unit)).norm_sqr().wide()
                };
                let up_sum: f64 = up.iter().enumerate().map(|(j, c)| wave(j, c)).sum();
                let first = rows - down.len();
                let down_sum: f64 = down.iter().enumerate().map(|(j, c)| wave(first + j, c)).sum();
                grid.column_weight(i) * (up_sum + down_sum)
            })
            .collect();
        sums.iter().sum::<f64>().sqrt()
    }

    /// Root mean square of the field.
    pub fn rms(&self) -> f64 {
        root_of_squares(|unit| self.rms_over(unit), || self.largest())
    }

    fn rms_over(&self, unit: f64) -> f64 {
        let grid = self.nodes.unwrap_or(Grid::unit(2 * self.width - 1, self.height));
        let sums: Vec<f64> = self
            .coefficients
            .par_chunks(self.height)
            .enumerate()
            .map(|(i, column)| {
                let parts: &[T] = bytemuck::cast_slice(column);
                let square = if unit == 1.0 {
                    vectorised(
                        #[inline(always)]
                        || dot(parts, parts),
                    )
                } else {
                    parts.iter().map(|p| (p.wide() / unit).powi(2)).sum()
                };
                grid.column_weight(i) * square
            })
            .collect();
        sums.iter().sum::<f64>().sqrt()
    }

    /// Values on the nodes of a transform's grid (of the rows of this rank), in its precision. `spectrum` is scratch space.
    pub fn on_nodes<U: Real>(&self, transform: &Transform<U>, spectrum: &mut [Complex<U>]) -> Vec<U> {
        let grid = transform.grid();
        let mut field = vec![U::default(); transform.own_points()];
        transform.inverse_filled(spectrum, &mut field, None, &|i, _, column| {
            column.fill(Complex::default());
            self.add_to(i, grid, column, U::one());
        });
        field
    }

    /// Adds `factor` times the series to column `i` of a spectrum.
    pub fn add_to<U: Real>(&self, i: usize, grid: Grid, column: &mut [Complex<U>], factor: U) {
        let (up, down) = self.column(i, grid);
        let start = column.len() - down.len();
        vectorised(
            #[inline(always)]
            || {
                for (part, waves) in [(0, up), (start, down)] {
                    for (c, a) in column[part..].iter_mut().zip(waves) {
                        *c += Complex::new(U::of(a.re.wide()), U::of(a.im.wide())).scale(factor);
                    }
                }
            },
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// Round trip from nodes to the series and back, for half spectra of less than a block of columns, one block, and
    /// several blocks with and without a remainder.
    #[test]
    fn series_through_nodes_have_their_values() {
        for (nx, ny) in [(1, 1), (1, 7), (7, 1), (14, 6), (15, 5), (16, 4), (17, 3), (34, 3)] {
            let grid = Grid::unit(nx, ny);
            let field: Vec<f64> = (0..grid.points()).map(|i| ((i * i + 7 * i) % 101) as f64 / 17.0).collect();
            let mean = super::super::mean(&field);
            let transform = Transform::<f64>::new(grid);
            let series = Series::<f64>::from_nodes(grid, &field);
            let actual = series.on_nodes(&transform, &mut transform.spectrum());
            for (f, h) in actual.iter().zip(&field) {
                assert!((f - (h - mean)).abs() < 1e-13, "{nx} x {ny}: {f} {}", h - mean);
            }
            let rms = super::super::rms(&field);
            assert!((series.rms() - rms).abs() < 1e-13, "{nx} x {ny}: {} {rms}", series.rms());
        }
    }

    /// A series without the waves that a grid does not hold has the same field there, and the statistics of all waves.
    #[test]
    fn a_cut_series_keeps_what_its_grid_holds() {
        let fine = Grid { ly: 0.5, ..Grid::unit(24, 16) };
        let field: Vec<f64> = (0..fine.points()).map(|i| ((i * i + 7 * i) % 101) as f64 / 17.0).collect();
        let series = Series::<f64>::from_nodes(fine, &field);
        for (nx, ny) in [(12, 8), (9, 5), (24, 4), (2, 2)] {
            let grid = Grid { nx, ny, ..fine };
            let (transform, cut) = (Transform::<f64>::new(grid), series.cut(grid));
            let [whole, own] = [&series, &cut].map(|s| s.on_nodes(&transform, &mut transform.spectrum()));
            assert!(whole.iter().zip(&own).all(|(w, o)| w == o), "{nx} x {ny}");
            assert_eq!(cut.whole(grid), [series.rms(), series.rms_gradient(fine)]);
            assert!(cut.whole_rms() == series.rms() && cut.is_held_by(grid) && !series.is_held_by(grid));
            assert!((cut.rms() - series.resolved_rms(grid)).abs() < 1e-13 && cut.bytes() < series.bytes());
            assert_eq!(cut.divided(2.0).whole(grid), cut.whole(grid).map(|value| value / 2.0));
        }
    }

    #[test]
    fn ranks_compute_the_same_series_together() {
        let amplitude = |kx: i64, ky: i64| Complex::new((7 * kx + ky) as f64, (kx - 3 * ky) as f64);
        let alone = Series::<f64>::from_modes(4, 3, amplitude);
        for actual in crate::sys::ranks::on_threads(3, |ranks| Series::<f64>::from_modes_on(&ranks, 4, 3, amplitude)) {
            assert_eq!(actual.coefficients, alone.coefficients);
        }
    }

    /// A few waves, from their amplitudes and from nodes, on grids that resolve all or some of them.
    #[test]
    fn series_give_the_same_field_on_every_grid() {
        let waves = [(1, 0, 0.3, 0.1), (0, 2, -0.2, 0.4), (3, -2, 0.05, -0.07), (4, 3, 0.02, 0.01)];
        let amplitude = |kx: i64, ky: i64| {
            waves.iter().filter(|w| (w.0, w.1) == (kx, ky)).map(|w| Complex::new(w.2, w.3)).sum::<Complex<f64>>()
                + waves
                    .iter()
                    .filter(|w| kx == 0 && w.0 == 0 && w.1 == -ky)
                    .map(|w| Complex::new(w.2, -w.3))
                    .sum::<Complex<f64>>()
        };
        let direct = |grid: Grid, resolved: usize| -> Vec<f64> {
            (0..grid.points())
                .map(|k| {
                    let (x, y) = ((k % grid.nx) as f64 / grid.nx as f64, (k / grid.nx) as f64 / grid.ny as f64);
                    let one = |w: &(i64, i64, f64, f64)| {
                        let phase = 2.0 * PI * (w.0 as f64 * x + w.1 as f64 * y);
                        2.0 * (w.2 * phase.cos() - w.3 * phase.sin())
                    };
                    waves[..resolved].iter().map(one).sum()
                })
                .collect()
        };
        let modes = Series::<f64>::from_modes(4, 3, amplitude);
        let base = Grid::unit(12, 10);
        let through = Series::<f64>::from_nodes(base, &direct(base, 4));
        let transform = Transform::<f64>::new(base);
        let twice = through.clone().plus(&modes).on_nodes(&transform, &mut transform.spectrum());
        assert!(twice.iter().zip(direct(base, 4)).all(|(f, d)| (f - 2.0 * d).abs() < 1e-14));
        for (grid, resolved) in [(base, 4), (Grid::unit(9, 7), 4), (Grid::unit(8, 6), 3), (Grid::unit(16, 4), 1)] {
            let transform = Transform::<f64>::new(grid);
            for series in [&modes, &through] {
                let actual = series.on_nodes(&transform, &mut transform.spectrum());
                // (0, 2) is at the Nyquist mode of four points, like all shorter waves.
                for (f, d) in actual.iter().zip(direct(grid, resolved)) {
                    assert!((f - d).abs() < 1e-14, "{grid:?}: {f} {d}");
                }
            }
        }
        let rms = super::super::rms(&direct(base, 4));
        assert!((modes.rms() / rms - 1.0).abs() < 1e-14 && (through.rms() / rms - 1.0).abs() < 1e-14);
    }
}

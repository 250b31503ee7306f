use asperity_grid::sys::expect_memory;
use asperity_grid::{Error, Result};
use asperity_grid::{Grid, Series, Transform};
use rustfft::num_complex::Complex;
use std::path::Path;
use std::sync::Arc;

/// One line `qX qY Re Im`: wave numbers in units of 2π over the extent of the cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wave {
    pub kx: i32,
    pub ky: i32,
    pub re: f64,
    pub im: f64,
}

/// Largest accepted difference of a(-q) and a(q)*, over |a|: rounding of files with six digits.
const PARTNERS: f64 = 1e-5;

/// A periodic surface as the coefficients of its Fourier series h(r) = Σ a exp(iq·r), reduced heights,
/// without its mean.
#[derive(Debug, Clone)]
pub struct FourierModes {
    series: Arc<Series<f64>>,
    /// Extents of the cell.
    cell: Grid,
    /// Largest wave number along x or y, units of 2π over the cell's extent.
    largest: usize,
    waves: usize,
}

impl FourierModes {
    /// The surface with `factor` times the given coefficients, for waves no shorter than `low_pass` (over the cell's
    /// extent; 0 for all). One of a pair ±q is enough.
    ///
    /// # Errors
    /// `Error::Format` for a wave given twice, for pairs ±q that are not complex conjugates, and if the low pass
    /// removes everything; `Error::Memory` for too many waves.
    pub fn new(path: &Path, waves: &[Wave], factor: f64, low_pass: f64) -> Result<Self> {
        let keep = |w: &&Wave| f64::from(w.kx).hypot(f64::from(w.ky)) * low_pass <= 1.0 + 1e-9;
        let keep = || waves.iter().filter(keep).filter(|w| (w.re, w.im) != (0.0, 0.0));
        let [kx_max, ky_max] =
            keep().fold([0, 0], |[x, y], w| [x.max(w.kx.unsigned_abs()), y.max(w.ky.unsigned_abs())]);
        let (kx_max, ky_max) = (kx_max as usize, ky_max as usize);
        if (kx_max, ky_max) == (0, 0) {
            let accepted = "waves, of which --low-pass (surface.low_pass) leaves some";
            return Err(Error::format(path, "no wave but the mean", accepted));
        }
        let height = 2 * ky_max + 1;
        let description = format!("waves up to qX = {kx_max}, qY = {ky_max} of {}", path.display());
        let required = 33 * ((kx_max + 1) * height) as u64;
        expect_memory(description, required, "--low-pass (surface.low_pass) leaves fewer")?;
        let mut table = vec![Complex::<f64>::default(); (kx_max + 1) * height];
        // Whether q, and whether -q, occurred in the file.
        let mut seen = vec![[false; 2]; table.len()];
        let place = |kx: i64, ky: i64| kx as usize * height + (ky + ky_max as i64) as usize;
        for wave in keep() {
            let (kx, ky) = (i64::from(wave.kx), i64::from(wave.ky));
            let given = Complex::new(wave.re, wave.im) * factor;
            let mirrored = kx < 0 || kx == 0 && ky < 0;
            let (index, a) = if mirrored { (place(-kx, -ky), given.conj()) } else { (place(kx, ky), given) };
            let own_partner = (kx, ky) == (0, 0) && a.im.abs() > PARTNERS * a.norm();
            if seen[index][usize::from(mirrored)] {
                return Err(Error::format(path, format!("q = ({kx}, {ky}) twice"), "every wave once"));
            }
            if own_partner || seen[index][usize::from(!mirrored)] && (table[index] - a).norm() > PARTNERS * a.norm() {
                let found =
                    format!("coefficients of q = ({kx}, {ky}) and ({}, {}) that contradict each other", -kx, -ky);
                return Err(Error::format(path, found, "a(-q) = a(q)*, as heights are real numbers"));
            }
            seen[index][usize::from(mirrored)] = true;
            table[index] = a;
        }
        let waves = table.iter().filter(|a| a.norm_sqr() > 0.0).count();
        let series = Series::from_modes(kx_max, ky_max, |kx, ky| {
            if kx == 0 && ky < 0 { table[place(0, -ky)].conj() } else { table[place(kx, ky)] }
        });
        Ok(FourierModes { series: series.into(), cell: Grid::unit(1, 1), largest: kx_max.max(ky_max), waves })
    }

    /// The waves through the heights of a map.
    pub fn through(grid: Grid, heights: &[f64]) -> Self {
        let series = Series::from_nodes(grid, heights).into();
        FourierModes { series, cell: grid, largest: grid.nx.max(grid.ny) / 2, waves: grid.points() / 2 }
    }

    /// Points per side of the smallest grid that resolves every wave.
    pub fn smallest_grid(&self) -> usize {
        2 * self.largest + 1
    }

    pub fn resolved_on(&self, grid: Grid) -> bool {
        grid.nx.min(grid.ny) >= self.smallest_grid()
    }

    /// rms gradient of all waves.
    pub fn rms_gradient(&self) -> f64 {
        self.series.whole(self.cell)[1]
    }

    /// Wavelength of the shortest wave along an axis, over the cell's extent.
    pub fn shortest(&self) -> f64 {
        1.0 / self.largest as f64
    }

    pub fn series(&self) -> &Series<f64> {
        &self.series
    }

    /// Heights `[ny, nx]` with zero mean, of the waves that the grid resolves and that are no shorter than `low_pass`
    /// (0 for all).
    pub fn heights(&self, grid: Grid, low_pass: f64) -> Vec<f64> {
        let transform = Transform::<f64>::new(grid);
        let mut spectrum = transform.spectrum();
        if low_pass == 0.0 {
            return self.series.on_nodes(&transform, &mut spectrum);
        }
        let aspect = self.cell.lx / self.cell.ly;
        let long = |kx: i64, ky: i64| (kx as f64).hypot(ky as f64 * aspect) * low_pass <= 1.0 + 1e-9;
        self.series.kept(long).on_nodes(&transform, &mut spectrum)
    }

    /// One line for messages.
    pub fn summary(&self) -> String {
        format!("{} waves up to |qX|, |qY| = {}·2π/L", self.waves, self.largest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    const FILE: &str = "waves.dat";

    fn wave(kx: i32, ky: i32, re: f64, im: f64) -> Wave {
        Wave { kx, ky, re, im }
    }

    fn modes(waves: &[Wave]) -> FourierModes {
        FourierModes::new(Path::new(FILE), waves, 1.0, 0.0).unwrap()
    }

    /// Against the sum over all waves of the file and their partners, on grids that are odd, even and the smallest.
    #[test]
    fn heights_are_the_sum_of_the_waves() {
        let half = [wave(2, -1, 0.3, 0.1), wave(0, 3, -0.2, 0.4), wave(1, 0, 0.05, 0.7), wave(0, 0, 9.0, 0.0)];
        let whole: Vec<Wave> = half
            .iter()
            .flat_map(|w| [*w, wave(-w.kx, -w.ky, w.re, -w.im)])
            .filter(|w| (w.kx, w.ky) != (0, 0))
            .collect();
        assert_eq!(modes(&half).smallest_grid(), 7);
        for n in [7, 8, 12] {
            let grid = Grid::unit(n, n);
            let sum = |x: f64, y: f64| {
                whole
                    .iter()
                    .map(|w| {
                        let phase = TAU * (f64::from(w.kx) * x + f64::from(w.ky) * y);
                        w.re * phase.cos() - w.im * phase.sin()
                    })
                    .sum::<f64>()
            };
            let exact: Vec<f64> =
                (0..n * n).map(|i| sum((i % n) as f64 / n as f64, (i / n) as f64 / n as f64)).collect();
            for actual in [modes(&half), modes(&whole)] {
                assert!(actual.heights(grid, 0.0).iter().zip(&exact).all(|(f, e)| (f - e).abs() < 1e-14), "{n}");
                assert!(actual.resolved_on(grid) && !actual.resolved_on(Grid::unit(6, 6)));
            }
        }
        let long = modes(&half).heights(Grid::unit(8, 8), 0.9);
        assert!((long[0] - 0.1).abs() < 1e-15, "only (1, 0) is as long: {}", long[0]);
    }

    #[test]
    fn contradictory_and_missing_waves_are_refused() {
        let says = |waves: &[Wave], low_pass: f64| {
            FourierModes::new(Path::new(FILE), waves, 1.0, low_pass).unwrap_err().to_string()
        };
        assert!(
            says(&[wave(1, 2, 1.0, 0.5), wave(-1, -2, 1.0, 0.5)], 0.0).contains("(-1, -2) and (1, 2) that contradict")
        );
        assert!(says(&[wave(1, 2, 1.0, 0.5), wave(1, 2, 1.0, 0.5)], 0.0).contains("q = (1, 2) twice"));
        assert!(says(&[wave(0, 0, 1.0, 0.5), wave(1, 2, 1.0, 0.5)], 0.0).contains("contradict"));
        assert!(says(&[wave(0, 0, 1.0, 0.0)], 0.0).contains("no wave but the mean"));
        assert!(says(&[wave(3, 0, 1.0, 0.0)], 0.5).contains("--low-pass"));
    }
}

//! Response of the surface of a harmonic crystal ([`HarmonicBlock`]) to forces on its highest layers.

use rayon::prelude::*;
use rustfft::num_complex::Complex;

use super::harmonic_block::{HarmonicBlock, LANES, multiply_add};
use asperity_grid::{HalfSpectrum, Real, vectorised};

/// Layers of a [`SurfaceResponse`] at most.
const MAX_SURFACE_LAYERS: usize = 4;

/// Response of the highest layers of a block to forces on them, the layers below in equilibrium.
pub struct SurfaceResponse<'b, T: Real> {
    block: &'b HarmonicBlock<T>,
    /// Components of the layers.
    size: usize,
    /// By wave: their part of the highest inverse Schur complement.
    compliances: Vec<T>,
    amplitudes: Vec<[T; LANES]>,
    spectra: Vec<HalfSpectrum<T>>,
}

impl<'b, T: Real> SurfaceResponse<'b, T> {
    /// Of the highest `layers` layers, at most [`HarmonicBlock::reach`].
    pub fn new(block: &'b HarmonicBlock<T>, layers: usize) -> Self {
        let (size, square) = (3 * layers, block.size * block.size);
        let first = block.size - size;
        let mut compliances = Vec::with_capacity(block.waves.len() * size * size);
        for inverses in block.inverses.chunks(block.groups * square) {
            let top = &inverses[(block.groups - 1) * square..];
            (first..block.size).for_each(|k| compliances.extend_from_slice(&top[k * block.size + first..][..size]));
        }
        SurfaceResponse {
            block,
            size,
            compliances,
            amplitudes: vec![[T::default(); LANES]; block.waves.len() * size],
            spectra: (0..size).map(|_| block.transform.spectrum()).collect(),
        }
    }

    /// Replaces forces by displacements: fields of the components of the highest layers, from the lowest of these, on the grid of half lattice
    /// constants as in [`HarmonicBlock::analyse`]. With fewer layers than the response has, no force acts on the others.
    pub fn apply(&mut self, fields: &mut [Vec<T>]) {
        let (block, all, size) = (self.block, self.size, fields.len());
        let (transform, first) = (&block.transform, all - size);
        let spectra = &mut self.spectra[..size];
        spectra.par_iter_mut().zip(fields.par_iter()).for_each(|(s, f)| transform.forward(f, s));
        let spectra = &*spectra;
        let amplitudes = &mut self.amplitudes[..block.waves.len() * size];
        let waves = amplitudes.par_chunks_mut(size).zip(self.compliances.par_chunks(all * all));
        waves.zip(&block.waves).for_each(|((lanes, compliance), modes)| {
            let mut forces = [[T::default(); LANES]; 3 * MAX_SURFACE_LAYERS];
            for (k, mode) in modes.iter().enumerate() {
                for l in 0..size / 3 {
                    let mut v: [Complex<T>; 3] = std::array::from_fn(|c| spectra[3 * l + c][mode.index]);
                    mode.symmetry.reduce(&mut v);
                    for (c, v) in v.into_iter().enumerate() {
                        (forces[3 * l + c][2 * k], forces[3 * l + c][2 * k + 1]) = (v.re, v.im);
                    }
                }
            }
            vectorised(|| {
                lanes.fill([T::default(); LANES]);
                for (row, to) in compliance[first * all..].chunks_exact(all).zip(lanes.iter_mut()) {
                    multiply_add(&row[first..], &forces[..size], T::one(), std::slice::from_mut(to));
                }
            });
        });
        let amplitudes = &*amplitudes;
        self.spectra[..size].par_iter_mut().zip(fields.par_iter_mut()).enumerate().for_each(
            |(k, (spectrum, field))| {
                block.fill_spectrum(amplitudes, size, k, spectrum);
                transform.inverse(spectrum, field);
            },
        );
    }
}

#[cfg(test)]
mod tests {
    use super::super::harmonic_block::LayerBase;
    use super::super::lattice_springs::{crystal, sites};
    use super::*;

    const LAYERS: usize = 5;
    /// Double precision, relative to the largest displacement.
    const ROUNDING: f64 = 1e-12;

    /// Forces on the highest layers of the block, as fields, and their displacements by a solution of all layers.
    fn exact(block: &HarmonicBlock<f64>, cells: usize, loaded: usize) -> [Vec<Vec<f64>>; 2] {
        let points = 4 * cells * cells;
        let force = |k: usize, field: &mut [f64]| {
            for [x, y] in sites(cells, LAYERS - 1 - k / 3) {
                field[y as usize * 2 * cells + x as usize] =
                    (0.7 + 12.9898 * f64::from(k as i32 + 7 * x + 31 * y)).sin();
            }
        };
        let mut field = block.analyse(LAYERS - loaded..LAYERS, |layer, c, to| force(3 * layer + c, to));
        block.eliminate(&mut field);
        block.substitute(&mut field);
        let displacements = block.synthesise(&field, LAYERS - 2..LAYERS, |_, _, u| u.to_vec());
        let mut forces = vec![vec![0.0; points]; 6];
        (6 - 3 * loaded..6).for_each(|k| force(3 * (LAYERS - 2) + k, &mut forces[k]));
        [forces, displacements]
    }

    /// With forces on both layers, and on the highest alone, of which the displacements alone may be asked for.
    #[test]
    fn the_surface_responds_as_the_whole_block() {
        for (cells, loaded) in [(3, 2), (3, 1), (4, 2), (4, 1)] {
            let block = HarmonicBlock::new(cells, LAYERS, &crystal(), LayerBase::Rigid).expect("stable");
            let [forces, exact] = exact(&block, cells, loaded);
            let mut response = SurfaceResponse::new(&block, 2);
            for asked in loaded..=2 {
                let first = 6 - 3 * asked;
                let mut fields = forces[first..].to_vec();
                response.apply(&mut fields);
                for (k, (actual, exact)) in fields.iter().zip(&exact[first..]).enumerate() {
                    let largest = exact.iter().fold(0.0f64, |m, u| m.max(u.abs()));
                    for [x, y] in sites(cells, LAYERS - 1 - (LAYERS - asked + k / 3)) {
                        let at = y as usize * 2 * cells + x as usize;
                        assert!((actual[at] - exact[at]).abs() < ROUNDING * largest, "{cells} {loaded} {asked} {k}");
                    }
                }
            }
        }
    }
}

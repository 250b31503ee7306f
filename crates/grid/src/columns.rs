//! Columns of a half spectrum, and what is done with them.

use super::{Grid, Real};
use crate::sys::ranks::Ranks;
use rustfft::num_complex::Complex;

/// A multiplication in Fourier space, a column at a time.
pub trait SpectralFilter<T: Real>: Sync {
    /// Multiplies column `i` (all `ny` rows in FFT order), including the `1/(nx·ny)` of the transform. Returns the
    /// contribution of this column to a sum over the spectrum.
    fn apply(&self, i: usize, column: &mut [Complex<T>]) -> f64;
}

impl<T: Real, F: Fn(usize, &mut [Complex<T>]) -> f64 + Sync> SpectralFilter<T> for F {
    fn apply(&self, i: usize, column: &mut [Complex<T>]) -> f64 {
        self(i, column)
    }
}

/// Columns of a spectrum with all their rows.
pub struct SpectrumColumns<'s, T> {
    pub(super) values: &'s [Complex<T>],
    pub(super) pitch: usize,
    /// Number of the first column.
    pub(super) first: usize,
}

impl<T> SpectrumColumns<'_, T> {
    pub(super) const NONE: Self = SpectrumColumns { values: &[], pitch: 0, first: 0 };
}

impl<T: Copy> SpectrumColumns<'_, T> {
    /// Row `y` of column `i`.
    #[inline]
    pub fn at(&self, y: usize, i: usize) -> Complex<T> {
        self.values[y * self.pitch + i - self.first]
    }
}

/// The spectrum of a grid, and the ranks that share its rows.
#[derive(Clone, Copy)]
pub struct SharedSpectrum<'s, T> {
    pub grid: Grid,
    pub ranks: &'s Ranks,
    pub values: &'s [Complex<T>],
}

impl<T> SharedSpectrum<'_, T> {
    /// All columns, where one rank has them.
    pub(super) fn columns(&self) -> SpectrumColumns<'_, T> {
        SpectrumColumns { values: self.values, pitch: self.grid.pitch(), first: 0 }
    }
}

/// Sets column `i`, given the columns of another spectrum that include the one of this number, if that has it.
pub type FillColumn<'f, T> = dyn Fn(usize, &SpectrumColumns<'_, T>, &mut [Complex<T>]) + Sync + 'f;

#[derive(Clone, Copy, PartialEq)]
pub(super) enum Direction {
    Both,
    Forward,
    Inverse,
    /// Forward, only for the sum that the filter returns.
    Sum,
}

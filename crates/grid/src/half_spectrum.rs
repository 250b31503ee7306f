use super::Real;
use rustfft::num_complex::Complex;
use std::ops::{Deref, DerefMut};

/// Bytes of a cache line.
const LINE: usize = 64;

/// A half spectrum: `ny` rows of `nx/2+1` coefficients, a row `pitch` elements after the one before (see
/// [`Grid::pitch`](crate::Grid::pitch)).
///
/// Rows longer than a block of columns are aligned to cache lines, so that the blocks of the column pass are whole
/// lines, too. Without alignment, gathering 2048² coefficients takes two to three times as long.
#[derive(Debug)]
pub struct HalfSpectrum<T> {
    elements: Vec<Complex<T>>,
    /// Elements before the first aligned one.
    first: usize,
    len: usize,
}

impl<T: Real> HalfSpectrum<T> {
    /// `len` zeros.
    pub(super) fn of(len: usize) -> Self {
        let spare = LINE / size_of::<Complex<T>>();
        let elements = vec![Complex::default(); len + spare];
        // `align_offset` may fail; the rows then stay unaligned.
        let first = elements.as_ptr().align_offset(LINE).min(spare);
        HalfSpectrum { elements, first, len }
    }
}

impl<T> Default for HalfSpectrum<T> {
    fn default() -> Self {
        HalfSpectrum { elements: Vec::new(), first: 0, len: 0 }
    }
}

impl<T> Deref for HalfSpectrum<T> {
    type Target = [Complex<T>];

    fn deref(&self) -> &[Complex<T>] {
        &self.elements[self.first..][..self.len]
    }
}

impl<T> DerefMut for HalfSpectrum<T> {
    fn deref_mut(&mut self) -> &mut [Complex<T>] {
        &mut self.elements[self.first..][..self.len]
    }
}

use rayon::prelude::*;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use rustfft::num_traits::{Float, NumAssign};
use rustfft::{Fft, FftDirection, FftPlanner};
use std::borrow::Cow;
use std::sync::Arc;

/// Precision of the fields. Sums are always taken in `f64`.
pub trait Real: rustfft::FftNum + Float + NumAssign + Default + std::iter::Sum + bytemuck::Pod {
    fn of(value: f64) -> Self;

    fn wide(self) -> f64;

    /// Heights in working precision, and the offset still to be subtracted from them. For `f64` these are the given
    /// heights and `mean`; for `f32` a converted copy with `mean` subtracted, and zero.
    fn heights(source: &[f64], mean: f64) -> (Cow<'_, [Self]>, Self);

    /// The values as a borrowed [`Field`].
    fn lend(values: &[Self]) -> Field<'_>;

    /// Complex transforms of `len` numbers. Compiled in this crate: most of a transform would otherwise be in every crate that has one.
    fn plan(len: usize, direction: FftDirection) -> Arc<dyn Fft<Self>>;

    /// Transforms of `len` real numbers.
    fn plan_real(len: usize) -> (Arc<dyn RealToComplex<Self>>, Arc<dyn ComplexToReal<Self>>);
}

fn plan_real<T: rustfft::FftNum>(len: usize) -> (Arc<dyn RealToComplex<T>>, Arc<dyn ComplexToReal<T>>) {
    let mut planner = RealFftPlanner::new();
    (planner.plan_fft_forward(len), planner.plan_fft_inverse(len))
}

impl Real for f32 {
    #[inline]
    fn of(value: f64) -> Self {
        value as f32
    }

    #[inline]
    fn wide(self) -> f64 {
        f64::from(self)
    }

    fn heights(source: &[f64], mean: f64) -> (Cow<'_, [f32]>, f32) {
        (Cow::Owned(source.par_iter().map(|h| (h - mean) as f32).collect()), 0.0)
    }

    fn lend(values: &[f32]) -> Field<'_> {
        Field::F32(values)
    }

    fn plan(len: usize, direction: FftDirection) -> Arc<dyn Fft<f32>> {
        FftPlanner::new().plan_fft(len, direction)
    }

    fn plan_real(len: usize) -> (Arc<dyn RealToComplex<f32>>, Arc<dyn ComplexToReal<f32>>) {
        plan_real(len)
    }
}

impl Real for f64 {
    #[inline]
    fn of(value: f64) -> Self {
        value
    }

    #[inline]
    fn wide(self) -> f64 {
        self
    }

    fn heights(source: &[f64], mean: f64) -> (Cow<'_, [f64]>, f64) {
        (Cow::Borrowed(source), mean)
    }

    fn lend(values: &[f64]) -> Field<'_> {
        Field::F64(values)
    }

    fn plan(len: usize, direction: FftDirection) -> Arc<dyn Fft<f64>> {
        FftPlanner::new().plan_fft(len, direction)
    }

    fn plan_real(len: usize) -> (Arc<dyn RealToComplex<f64>>, Arc<dyn ComplexToReal<f64>>) {
        plan_real(len)
    }
}

/// A borrowed field `[ny, nx]` of either precision.
#[derive(Debug, Clone, Copy)]
pub enum Field<'a> {
    F32(&'a [f32]),
    F64(&'a [f64]),
}

impl Field<'_> {
    pub fn len(&self) -> usize {
        match self {
            Field::F32(v) => v.len(),
            Field::F64(v) => v.len(),
        }
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    #[inline]
    pub fn at(&self, i: usize) -> f64 {
        match self {
            Field::F32(v) => f64::from(v[i]),
            Field::F64(v) => v[i],
        }
    }

    pub fn to_vec(&self) -> Vec<f64> {
        (0..self.len()).map(|i| self.at(i)).collect()
    }
}

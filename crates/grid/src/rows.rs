//! Transforms of real rows.
//!
//! A row of even length is treated as half as many complex numbers. A last (inverse: first) pass converts their
//! transform to that of the row. The pass is vectorised here: with `realfft`, which converts one number at a time, a
//! solve on 2048² took 10 % longer. Odd rows use `realfft`.

use super::{Real, vectorised};
use realfft::{ComplexToReal, RealToComplex};
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftDirection};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Plans for rows of one length.
pub(super) enum Rows<T: Real> {
    Even { forward: Folded<T>, inverse: Folded<T> },
    Odd { forward: Arc<dyn RealToComplex<T>>, inverse: Arc<dyn ComplexToReal<T>> },
}

/// A transform of half the length and the factors of its conversion.
pub(super) struct Folded<T: Real> {
    transform: Arc<dyn Fft<T>>,
    /// Factor of the sums.
    share: T,
    /// Factors of the differences, modes 1, 2, …: real and imaginary parts apart.
    turns: [Vec<T>; 2],
}

impl<T: Real> Rows<T> {
    pub(super) fn new(nx: usize) -> Self {
        if !nx.is_multiple_of(2) {
            let (forward, inverse) = T::plan_real(nx);
            return Rows::Odd { forward, inverse };
        }
        // -i/2 e^{-2πik/nx} forward, i e^{2πik/nx} inverse: a round trip is un-normalised.
        let folded = |transform, fraction: f64, sign: f64| {
            let angles = (1..nx.div_ceil(4)).map(|k| TAU * k as f64 / nx as f64);
            let (re, im) = angles.map(|a| (T::of(-fraction * a.sin()), T::of(sign * fraction * a.cos()))).unzip();
            Folded { transform, share: T::of(fraction), turns: [re, im] }
        };
        Rows::Even {
            forward: folded(T::plan(nx / 2, FftDirection::Forward), 0.5, -1.0),
            inverse: folded(T::plan(nx / 2, FftDirection::Inverse), 1.0, 1.0),
        }
    }

    /// Scratch space of a transform.
    pub(super) fn scratch(&self) -> Vec<Complex<T>> {
        let len = match self {
            Rows::Even { forward, inverse } => {
                let needs = |f: &Folded<T>| f.transform.get_outofplace_scratch_len();
                needs(forward).max(needs(inverse))
            }
            Rows::Odd { forward, inverse } => forward.get_scratch_len().max(inverse.get_scratch_len()),
        };
        vec![Complex::default(); len]
    }

    /// Transforms `row`, which is overwritten, to the `nx/2+1` coefficients of `spectrum`.
    pub(super) fn forward(&self, row: &mut [T], spectrum: &mut [Complex<T>], scratch: &mut [Complex<T>]) {
        match self {
            Rows::Even { forward: Folded { transform, share, turns }, .. } => {
                let middle = spectrum.len() - 1;
                let pairs = bytemuck::cast_slice_mut(row);
                transform.process_outofplace_with_scratch(pairs, &mut spectrum[..middle], scratch);
                let Complex { re, im } = spectrum[0];
                spectrum[0] = Complex::new(re + im, T::zero());
                spectrum[middle] = Complex::new(re - im, T::zero());
                fold(&mut spectrum[1..middle], *share, turns);
            }
            Rows::Odd { forward, .. } => {
                forward.process_with_scratch(row, spectrum, scratch).expect("row and spectrum have the plan's lengths");
            }
        }
    }

    /// Transforms `spectrum`, which is overwritten, to `row`. Imaginary parts of the mean and of an even row's
    /// Nyquist mode, which are rounding errors, are ignored.
    pub(super) fn inverse(&self, spectrum: &mut [Complex<T>], row: &mut [T], scratch: &mut [Complex<T>]) {
        match self {
            Rows::Even { inverse: Folded { transform, share, turns }, .. } => {
                let middle = spectrum.len() - 1;
                let [mean, last] = [spectrum[0].re, spectrum[middle].re];
                spectrum[0] = Complex::new(mean + last, mean - last);
                fold(&mut spectrum[1..middle], *share, turns);
                let pairs = bytemuck::cast_slice_mut(row);
                transform.process_outofplace_with_scratch(&mut spectrum[..middle], pairs, scratch);
            }
            Rows::Odd { inverse, .. } => {
                spectrum[0].im = T::zero();
                inverse.process_with_scratch(spectrum, row, scratch).expect("row and spectrum have the plan's lengths");
            }
        }
    }
}

/// Number of modes folded at once.
const BATCH: usize = 16;

/// Of modes `1 … m-1` every pair `a` = k and `b` = m-k: `s + d` and `(s - d)*` with `s = share (a + b*)` and
/// `d = turn (a - b*)`. The one that is its own pair is turned by a right angle.
fn fold<T: Real>(modes: &mut [Complex<T>], fraction: T, turns: &[Vec<T>; 2]) {
    let pairs = modes.len() / 2;
    if modes.len() % 2 == 1 {
        let twice = fraction + fraction;
        modes[pairs] = modes[pairs].conj().scale(twice);
    }
    let middle = modes.len() - pairs;
    let (up, down) = modes.split_at_mut(middle);
    let [re, im] = turns.each_ref().map(|t| &t[..pairs]);
    vectorised(
        #[inline(always)]
        || {
            let (batches, remainder) = up[..pairs].as_chunks_mut::<BATCH>();
            let (rest_down, batches_down) = down.as_rchunks_mut::<BATCH>();
            let ((re, re_rest), (im, im_rest)) = (re.as_chunks::<BATCH>(), im.as_chunks::<BATCH>());
            // By index: with an iterator the loop was not vectorised, and solves on 2048² took 5 % longer.
            let last = batches.len();
            for i in 0..last {
                fold_batch(&mut batches[i], &mut batches_down[last - 1 - i], fraction, (&re[i], &im[i]));
            }
            let turns = re_rest.iter().zip(im_rest);
            for ((up, down), (re, im)) in remainder.iter_mut().zip(rest_down.iter_mut().rev()).zip(turns) {
                let one = std::array::from_mut::<Complex<T>>;
                fold_batch(one(up), one(down), fraction, (std::array::from_ref(re), std::array::from_ref(im)));
            }
        },
    );
}

#[inline(always)]
fn fold_batch<T: Real, const N: usize>(
    up: &mut [Complex<T>; N],
    down: &mut [Complex<T>; N],
    share: T,
    (re, im): (&[T; N], &[T; N]),
) {
    // Real and imaginary parts separately; the upper modes are in the order of the lower ones.
    let [mut a_re, mut a_im, mut b_re, mut b_im] = [[T::zero(); N]; 4];
    for i in 0..N {
        (a_re[i], a_im[i]) = (up[i].re, up[i].im);
        (b_re[i], b_im[i]) = (down[N - 1 - i].re, down[N - 1 - i].im);
    }
    for i in 0..N {
        let (s_re, s_im) = (share * (a_re[i] + b_re[i]), share * (a_im[i] - b_im[i]));
        let (d_re, d_im) = (a_re[i] - b_re[i], a_im[i] + b_im[i]);
        let (t_re, t_im) = (re[i] * d_re - im[i] * d_im, re[i] * d_im + im[i] * d_re);
        (a_re[i], a_im[i]) = (s_re + t_re, s_im + t_im);
        (b_re[i], b_im[i]) = (s_re - t_re, t_im - s_im);
    }
    for i in 0..N {
        up[i] = Complex::new(a_re[i], a_im[i]);
        down[N - 1 - i] = Complex::new(b_re[i], b_im[i]);
    }
}

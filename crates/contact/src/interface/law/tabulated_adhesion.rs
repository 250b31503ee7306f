use super::tabulated::cubic;
use super::{Law, range_on_mesh};
use asperity_grid::{Error, Result};

/// Intervals of a table.
const INTERVALS: usize = 256;

/// Largest error of a table over the largest traction: jumps are refused, kinks between two nodes pass.
const MOST_ERROR: f64 = 1e-2;

/// Largest traction at the end of a table, beyond which there is none, over the largest one.
const MOST_LEFT: f64 = 1e-4;

/// Named in errors.
const PLACE: &str = "adhesion law";

/// An attraction between surfaces with a traction of your own, tabulated once.
///
/// Between 257 nodes the traction is a cubic with the values and slopes of its ends, beyond the last it is zero. The distance between
/// nodes is proportional to the square root of the gap: tractions vary most near contact. The energy is the exact integral, so that
/// solvers converge on the table as on a closed form. [`TabulatedLaw::error`] is the difference from the given traction.
///
/// ```
/// use asperity_contact::interface::TabulatedLaw;
///
/// // The challenge's exponential law: γ = 0.05, ρ = 0.002.
/// let law = TabulatedLaw::new(0.04, |gap| 0.05 / 0.002 * (-gap / 0.002_f64).exp())?;
/// assert!((law.work_of_adhesion() / 0.05 - 1.0).abs() < 1e-7 && law.error() < 1e-7);
/// # Ok::<(), asperity_contact::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TabulatedLaw {
    /// Work of adhesion γ.
    gamma: f64,
    /// Range ρ: γ over the largest traction.
    rho: f64,
    /// Of the traction `(γ/ρ) f(g/ρ)`.
    shape: LawTable,
    error: f64,
}

/// Values f(x), slopes and integrals `-∫ f` from x to the end at the nodes `x = end (k/n)²`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct LawTable {
    end: f64,
    nodes: [[f64; 3]; INTERVALS + 1],
    /// Least and largest slope.
    slopes: [f64; 2],
}

impl TabulatedLaw {
    /// Tabulates `traction`, attraction positive, over gaps from 0 to `cutoff`. Units are those of the caller.
    ///
    /// # Errors
    /// `Input` for a cutoff that is no positive number; for tractions that are not finite, have not vanished at the cutoff, jump, or do no
    /// work of separation.
    pub fn new(cutoff: f64, mut traction: impl FnMut(f64) -> f64) -> Result<Self> {
        let refuse = |key: &str, found: String, accepted: &str| Err(Error::input(PLACE, key, found, accepted));
        if !(cutoff > 0.0 && cutoff.is_finite()) {
            return refuse("cutoff", cutoff.to_string(), "a positive number");
        }
        let mut largest = 0.0_f64;
        let mut wrong = None;
        let mut traction_at = |g: f64| {
            let t = traction(g);
            if !t.is_finite() {
                wrong.get_or_insert((g, t));
            }
            largest = largest.max(t.abs());
            t
        };
        let mut shape = LawTable {
            end: cutoff,
            nodes: std::array::from_fn(|k| node(cutoff, k, &mut traction_at)),
            slopes: [0.0; 2],
        };
        let left = shape.nodes[INTERVALS][0];
        shape.nodes[INTERVALS][0] = 0.0;
        shape.integrate();
        let (mut error, mut place) = (0.0, 0.0);
        for k in 0..INTERVALS {
            for u in [0.25, 0.5, 0.75] {
                let g = position(cutoff, k) + u * step(cutoff, k);
                let deviation = (traction_at(g) - shape.at(g)[0]).abs();
                if deviation > error {
                    (error, place) = (deviation, g);
                }
            }
        }
        if let Some((g, t)) = wrong {
            return refuse("traction", format!("{t} at a gap of {g:e}"), "finite numbers");
        }
        if left.abs() > MOST_LEFT * largest {
            let found = format!("{cutoff:e}, where the traction is {:.2e} of its largest", left.abs() / largest);
            return refuse("cutoff", found, &format!("a gap at which less than {MOST_LEFT:e} of the traction is left"));
        }
        if error > MOST_ERROR * largest {
            let found =
                format!("another than its table by {:.2e} of its largest near a gap of {place:e}", error / largest);
            return refuse("traction", found, "a continuous function of the gap, on the scale of the cutoff");
        }
        let gamma = 0.0 - shape.nodes[0][2];
        if gamma.partial_cmp(&0.0) != Some(std::cmp::Ordering::Greater) {
            let found = format!("a work of separation of {gamma:e}");
            return refuse("traction", found, "an attraction, positive: a positive work of separation");
        }
        let rho = gamma / largest;
        Ok(TabulatedLaw { gamma, rho, shape: shape.normalised(gamma, rho), error: error / largest })
    }

    /// Work of adhesion: the integral of the traction.
    pub fn work_of_adhesion(&self) -> f64 {
        self.gamma
    }

    /// Range: the work of adhesion over the largest traction.
    pub fn range(&self) -> f64 {
        self.rho
    }

    /// Largest difference between table and given traction over the largest traction, at three points in each interval.
    pub fn error(&self) -> f64 {
        self.error
    }

    /// Traction of the table at a gap; at negative gaps that of zero gap.
    pub fn traction(&self, gap: f64) -> f64 {
        Law::traction(self, gap)
    }

    /// The law of the same shape with another work of adhesion and range.
    pub fn with(&self, work_of_adhesion: f64, range: f64) -> Self {
        TabulatedLaw { gamma: work_of_adhesion, rho: range, ..*self }
    }

    /// Largest softening over `γ/ρ²`.
    fn steepness(&self) -> f64 {
        -self.shape.slopes[0].min(0.0)
    }
}

/// Gap of a node.
#[inline]
fn position(end: f64, k: usize) -> f64 {
    let u = k as f64 / INTERVALS as f64;
    end * u * u
}

/// Width of an interval.
#[inline]
fn step(end: f64, k: usize) -> f64 {
    end * (2 * k + 1) as f64 / (INTERVALS * INTERVALS) as f64
}

/// Value of a function and its slope at a node, by differences of fourth order within the table.
fn node(end: f64, k: usize, f: &mut impl FnMut(f64) -> f64) -> [f64; 3] {
    /// Weights, times twelve, of equidistant values at one end of them and in their middle.
    const AT_END: [f64; 5] = [-25.0, 48.0, -36.0, 16.0, -3.0];
    const IN_MIDDLE: [f64; 5] = [1.0, -8.0, 0.0, 8.0, -1.0];
    let g = position(end, k);
    let d = step(end, k.saturating_sub(1)) / 8.0;
    let (weights, first, d) = match k {
        0 => (AT_END, 0.0, d),
        INTERVALS => (AT_END, 0.0, -d),
        _ => (IN_MIDDLE, -2.0, d),
    };
    let sum: f64 = weights.iter().enumerate().map(|(i, w)| w * f(g + (first + i as f64) * d)).sum();
    [f(g), sum / (12.0 * d), 0.0]
}

impl LawTable {
    /// Sets the integrals and the extremes of the slope.
    fn integrate(&mut self) {
        for k in (0..INTERVALS).rev() {
            let h = step(self.end, k);
            let [a, b] = self.interval(k, h);
            self.nodes[k][2] = self.nodes[k + 1][2] - h * cubic(&a, &b, 1.0)[2];
            // The slope is a parabola of the position.
            let [s0, s1, middle] = [0.0, 1.0, 0.5].map(|t| cubic(&a, &b, t)[1]);
            let (linear, square) = (4.0 * middle - 3.0 * s0 - s1, 2.0 * (s0 + s1) - 4.0 * middle);
            let vertex = (-0.5 * linear / square).clamp(0.0, 1.0);
            let vertex = if vertex.is_nan() { 0.0 } else { vertex };
            for s in [s0, s1, cubic(&a, &b, vertex)[1]] {
                self.slopes = [self.slopes[0].min(s / h), self.slopes[1].max(s / h)];
            }
        }
    }

    /// Ends of an interval, with their slopes times its width.
    #[inline]
    fn interval(&self, k: usize, h: f64) -> [[f64; 3]; 2] {
        [k, k + 1].map(|k| [self.nodes[k][0], self.nodes[k][1] * h, 0.0])
    }

    /// Value, slope and energy at x; before the first node those of a constant value, zero beyond the last.
    #[inline]
    fn at(&self, x: f64) -> [f64; 3] {
        if x >= self.end {
            return [0.0; 3];
        }
        if x < 0.0 {
            return [self.nodes[0][0], 0.0, self.nodes[0][2] + self.nodes[0][0] * x];
        }
        let k = ((x / self.end).sqrt() * INTERVALS as f64) as usize;
        let k = k.min(INTERVALS - 1);
        let h = step(self.end, k);
        let [a, b] = self.interval(k, h);
        let [value, slope, integral] = cubic(&a, &b, (x - position(self.end, k)) / h);
        [value, slope / h, self.nodes[k][2] + h * integral]
    }

    /// From the units of `gamma` and `rho` to shapes.
    fn normalised(mut self, gamma: f64, rho: f64) -> Self {
        let units = [gamma / rho, gamma / (rho * rho), gamma];
        self.end /= rho;
        self.nodes.iter_mut().for_each(|node| *node = std::array::from_fn(|i| node[i] / units[i]));
        self.slopes = self.slopes.map(|s| s / units[1]);
        self
    }
}

impl Law for TabulatedLaw {
    const ACTIVE: bool = true;
    const HARD: bool = true;

    #[inline]
    fn traction(&self, g: f64) -> f64 {
        self.gamma / self.rho * self.shape.at(g / self.rho)[0]
    }

    #[inline]
    fn energy(&self, g: f64) -> f64 {
        self.gamma * self.shape.at(g / self.rho)[2]
    }

    #[inline]
    fn slope(&self, g: f64) -> f64 {
        self.gamma / self.rho.powi(2) * self.shape.at(g / self.rho)[1]
    }

    fn cutoff(&self) -> f64 {
        self.shape.end * self.rho
    }

    fn max_slope(&self, _: f64) -> f64 {
        let [least, largest] = self.shape.slopes;
        largest.max(-least) * self.gamma / self.rho.powi(2)
    }

    fn range(&self) -> f64 {
        self.rho
    }

    fn softening(&self) -> f64 {
        self.steepness() * self.gamma / self.rho.powi(2)
    }

    fn on_mesh(&self, dx: f64) -> Self {
        self.with(self.gamma, range_on_mesh(self.gamma, self.rho, self.steepness(), dx))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interface::{Dugdale, Exponential, PowerLaw93};

    const GAMMA: f64 = 2e-5;
    const RHO: f64 = 2e-2;

    /// Table of a law against the law itself, over the largest traction and its own scales.
    fn compare(law: impl Law, ranges: f64, tolerance: f64) {
        let table = TabulatedLaw::new(ranges * RHO, |g| law.traction(g)).expect("a smooth law");
        let largest = (0..1000).map(|k| law.traction(0.005 * RHO * f64::from(k))).fold(0.0, f64::max);
        let mut error = 0.0_f64;
        for k in 0..10_000 {
            let g = 1e-3 * RHO * f64::from(k);
            error = error.max((table.traction(g) - law.traction(g)).abs() / largest);
            // The table has no energy beyond its end.
            let energy = if g < ranges * RHO { law.energy(g) - law.energy(ranges * RHO) } else { 0.0 };
            assert!((table.energy(g) - energy).abs() < 10.0 * tolerance * GAMMA, "energy at {g}");
        }
        assert!(error < tolerance && error < 2.0 * table.error() + 1e-12, "{error:e}, stated {:e}", table.error());
        assert!((table.softening() / law.softening() - 1.0).abs() < 30.0 * tolerance);
    }

    #[test]
    fn tables_of_closed_laws_equal_them() {
        compare(Exponential { gamma: GAMMA, rho: RHO }, 30.0, 1e-7);
        compare(PowerLaw93 { gamma: GAMMA, rho: RHO }, 40.0, 3e-6);
        // The taper is a cubic, with kinks of the slope's slope at its ends.
        compare(Dugdale::new(GAMMA, RHO), 1.5, 1e-4);
    }

    #[test]
    fn what_is_no_adhesion_law_is_refused() {
        let refused = |cutoff: f64, traction: fn(f64) -> f64, tokens: &str| {
            let error = TabulatedLaw::new(cutoff, traction).expect_err(tokens).to_string();
            assert!(error.contains(tokens) && error.contains("accepted"), "{error}");
        };
        refused(-1.0, |_| 0.0, "cutoff = -1");
        refused(10.0, |g| 1.0 / (1.0 + g), "cutoff = 1e1, where the traction is 9.09e-2");
        refused(10.0, |g| if g < 1.0 { 1.0 } else { 0.0 }, "its table by 6.64e-1");
        refused(10.0, |g| (1.0 - g).sqrt(), "traction = NaN at a gap of");
        refused(10.0, |g| -(-g).exp(), "work of separation of -9.99");
        refused(10.0, |_| 0.0, "work of separation of 0");
    }

    /// A linear cohesive law: exact with its kink at the end, within a per cent where the kink is between nodes.
    #[test]
    fn kinks_are_interpolated() {
        let linear = |g: f64| (1.0 - g).max(0.0);
        let table = TabulatedLaw::new(1.0, linear).expect("continuous");
        assert!(
            table.error() < 1e-12
                && (table.work_of_adhesion() - 0.5).abs() < 1e-12
                && (table.range() - 0.5).abs() < 1e-12
        );
        let table = TabulatedLaw::new(2.1, linear).expect("continuous");
        assert!(table.error() > 1e-5 && (table.work_of_adhesion() - 0.5).abs() < 1e-4, "{}", table.error());
    }
}

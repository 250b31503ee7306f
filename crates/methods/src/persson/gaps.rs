//! Distribution of gaps (Almqvist, Campañá, Prodanov & Persson, J. Mech. Phys. Solids 59 (2011) 2355).

use super::roughening::{Opening, Rules, SpectralBand, contact_area, gap_sum};
use asperity_contact::observe::{Distribution, linear_edges};
use asperity_grid::bisect;
use std::f64::consts::{PI, SQRT_2};

/// Bins of equal width.
pub(super) const BINS: usize = 120;

/// Standard deviations of the largest bin above the mean gaps.
const REACH: f64 = 4.0;

/// Smallest contact area lost in a step; the difference of two volumes, accurate to 1e-6, is divided by it.
const LEAST_LOST: f64 = 1e-3;

/// Area that loses contact when a band is added.
struct SeparatedArea {
    /// Fraction of the area.
    contact_area: f64,
    /// Centre of the Gaussian.
    gap: f64,
    /// Its standard deviation: the rms height of the shorter waves.
    rough: f64,
}

/// Pr(u) and the number of evaluations of the opening; `None` if stopped.
///
/// The mean gap in the area that loses contact with a band follows from the volumes `ū A` before and after: their
/// difference over the lost area. Shorter waves broaden it to a Gaussian whose negative part is mirrored. In the
/// publication the mirrored part increases the mean; here the Gaussian is shifted so that the mean of the
/// distribution is the mean gap.
pub(super) fn gap_distribution(
    bands: &[SpectralBand],
    c: f64,
    pressure: f64,
    opening: &Opening,
    stopping: impl Fn() -> bool,
) -> Option<(Distribution, usize)> {
    let rules = Rules::new();
    let volume = |from: usize, touching: f64| {
        let (gap, evaluations) = gap_sum(&bands[from..], c, pressure / touching, &rules, |x| opening.at(x));
        (gap * touching, evaluations)
    };
    let mut shorter: f64 = bands.iter().map(|b| b.height).sum();
    let (mut touching, mut separated) = (1.0, Vec::with_capacity(bands.len()));
    let (mut open, mut evaluations) = volume(0, touching);
    let mut longer = 0;
    for (k, band) in bands.iter().enumerate() {
        if stopping() {
            return None;
        }
        shorter -= band.height;
        let after = contact_area(c, pressure, band.after());
        let (lost, last) = (touching - after, k + 1 == bands.len());
        if lost < LEAST_LOST && !(last && lost > 0.0) {
            continue;
        }
        let (left, more) = volume(k + 1, after);
        evaluations += more;
        // Half of the height variance of the bands themselves, during which gaps open.
        let own_variance: f64 = bands[longer..=k].iter().map(|b| b.height).sum();
        let gap = ((open - left) / lost).max(0.0);
        separated.push(SeparatedArea::of(lost, gap, (shorter + 0.5 * own_variance).max(0.0).sqrt()));
        (touching, open, longer) = (after, left, k + 1);
    }
    let top = separated.iter().map(|p| p.gap + REACH * p.rough).fold(0.0, f64::max);
    let edges = linear_edges(0.0, if top > 0.0 { top } else { 1.0 }, BINS);
    let up_to: Vec<f64> = edges.iter().map(|&u| separated.iter().map(|p| p.contact_area * p.up_to(u)).sum()).collect();
    let all: f64 = separated.iter().map(|p| p.contact_area).sum();
    let fractions = up_to.windows(2).map(|w| w[1] - w[0]).collect();
    Some((Distribution { fractions, delta: touching, below: 0.0, above: all - up_to[BINS], edges }, evaluations))
}

impl SeparatedArea {
    /// Halvings that exhaust the precision.
    const HALVINGS: usize = 60;

    /// A mirrored Gaussian with the mean `gap`: of the width `rough`, or narrower about zero where a Gaussian of this
    /// width has a larger mirrored mean.
    fn of(contact_area: f64, gap: f64, rough: f64) -> Self {
        if gap <= rough * (2.0 / PI).sqrt() {
            return SeparatedArea { contact_area, gap: 0.0, rough: gap * (0.5 * PI).sqrt() };
        }
        let narrow = |centre: f64| SeparatedArea { contact_area, gap: centre, rough }.mean() < gap;
        SeparatedArea { contact_area, gap: bisect(0.0, gap, Self::HALVINGS, narrow).1, rough }
    }

    fn mean(&self) -> f64 {
        if self.rough == 0.0 {
            return self.gap;
        }
        let x = self.gap / (SQRT_2 * self.rough);
        self.rough * (2.0 / PI).sqrt() * (-x * x).exp() + self.gap * libm::erf(x)
    }

    /// Fraction of these gaps below `u`.
    fn up_to(&self, u: f64) -> f64 {
        let width = (SQRT_2 * self.rough).max(f64::MIN_POSITIVE);
        0.5 * (libm::erf((u - self.gap) / width) + libm::erf((u + self.gap) / width))
    }
}

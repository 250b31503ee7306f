//! How gaps are distributed (Almqvist, Campañá, Prodanov & Persson, J. Mech. Phys. Solids 59 (2011) 2355).

use super::roughening::{Band, Opening, Rules, gap_sum, share};
use crate::observe::{Distribution, linear_edges};
use std::f64::consts::{PI, SQRT_2};

/// Bins of equal width.
pub(super) const BINS: usize = 120;

/// Standard deviations of the rough gaps up to which there are bins.
const REACH: f64 = 4.0;

/// Area that is lost before a gap is told of it: differences of volumes, good to a millionth, are divided by it.
const LEAST_LOST: f64 = 1e-3;

/// What loses contact when waves are added.
struct Parted {
    share: f64,
    /// Middle of the Gaussian.
    gap: f64,
    /// Its standard deviation: the rms height of the shorter waves.
    rough: f64,
}

/// Pr(u), and how often the opening was asked.
///
/// Where a band's waves part the surfaces, the gap on average is what keeps the mean over all that touched before: the
/// difference between the volumes before and after, `ū A`, over the lost area. Shorter waves make of it a Gaussian, whose part
/// below zero is mirrored. As published the mirror adds to the mean; here the Gaussian is moved until it does not, so that
/// the distribution's mean is the mean gap.
pub(super) fn gap_distribution(
    bands: &[Band],
    c: f64,
    pressure: f64,
    opening: &Opening,
    stopping: impl Fn() -> bool,
) -> Option<(Distribution, usize)> {
    let rules = Rules::new();
    let volume = |from: usize, touching: f64| {
        let (gap, asked) = gap_sum(&bands[from..], c, pressure / touching, &rules, |x| opening.at(x));
        (gap * touching, asked)
    };
    let mut shorter: f64 = bands.iter().map(|b| b.height).sum();
    let (mut touching, mut parted) = (1.0, Vec::with_capacity(bands.len()));
    let (mut open, mut asked) = volume(0, touching);
    let mut longer = 0;
    for (k, band) in bands.iter().enumerate() {
        if stopping() {
            return None;
        }
        shorter -= band.height;
        let after = share(c, pressure, band.after());
        let (lost, last) = (touching - after, k + 1 == bands.len());
        if lost < LEAST_LOST && !(last && lost > 0.0) {
            continue;
        }
        let (left, more) = volume(k + 1, after);
        asked += more;
        // Half of the bands themselves: gaps open while they are added.
        let own: f64 = bands[longer..=k].iter().map(|b| b.height).sum();
        let gap = ((open - left) / lost).max(0.0);
        parted.push(Parted::of(lost, gap, (shorter + 0.5 * own).max(0.0).sqrt()));
        (touching, open, longer) = (after, left, k + 1);
    }
    let top = parted.iter().map(|p| p.gap + REACH * p.rough).fold(0.0, f64::max);
    let edges = linear_edges(0.0, if top > 0.0 { top } else { 1.0 }, BINS);
    let up_to: Vec<f64> = edges.iter().map(|&u| parted.iter().map(|p| p.share * p.up_to(u)).sum()).collect();
    let all: f64 = parted.iter().map(|p| p.share).sum();
    let fractions = up_to.windows(2).map(|w| w[1] - w[0]).collect();
    Some((Distribution { fractions, delta: touching, below: 0.0, above: all - up_to[BINS], edges }, asked))
}

impl Parted {
    /// Halvings to the last bit.
    const HALVINGS: usize = 60;

    /// With the mean of the mirrored Gaussian at the gap on average. Where it is so small that no Gaussian of this width has
    /// such a mirrored mean, a narrower one about zero has.
    fn of(share: f64, gap: f64, rough: f64) -> Self {
        if gap <= rough * (2.0 / PI).sqrt() {
            return Parted { share, gap: 0.0, rough: gap * (0.5 * PI).sqrt() };
        }
        let (mut low, mut high) = (0.0, gap);
        for _ in 0..Self::HALVINGS {
            let centre = 0.5 * (low + high);
            if (Parted { share, gap: centre, rough }).mean() < gap { low = centre } else { high = centre }
        }
        Parted { share, gap: high, rough }
    }

    fn mean(&self) -> f64 {
        if self.rough == 0.0 {
            return self.gap;
        }
        let x = self.gap / (SQRT_2 * self.rough);
        self.rough * (2.0 / PI).sqrt() * (-x * x).exp() + self.gap * libm::erf(x)
    }

    /// Share of these gaps that is below `u`.
    fn up_to(&self, u: f64) -> f64 {
        let width = (SQRT_2 * self.rough).max(f64::MIN_POSITIVE);
        0.5 * (libm::erf((u - self.gap) / width) + libm::erf((u + self.gap) / width))
    }
}

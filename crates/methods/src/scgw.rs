//! Slightly corrected Greenwood-Williamson model: the curvature of summits depends on their height (Carbone, J. Mech.
//! Phys. Solids 57 (2009) 1093). Summits are those of a Gaussian surface with three spectral moments (Nayak, J. Lubr.
//! Technol. 93 (1971) 398), each an independent Hertz contact.

use crate::prelude::*;
use crate::quadrature::{gauss_legendre, integral};
use std::f64::consts::{PI, SQRT_2};

pub(super) struct Scgw;

static CARD: MethodCard = MethodCard {
    id: "scgw",
    paper_name: "SCGW",
    family: "single asperities",
    kind: MethodKind::Estimate,
    needs: Needs::Spectrum,
    criterion: Criterion::Spots,
    calibrated_on: None,
    summary: "independent Hertz contacts on the summits of a Gaussian surface with three spectral moments",
    supports,
    capabilities: Capabilities::NONE,
    dois: &["10.1007/s11249-017-0900-2"],
    papers: &["Carbone, J. Mech. Phys. Solids 57 (2009) 1093", "Nayak, J. Lubr. Technol. 93 (1971) 398"],
    measured_errors: Some(&MEASURED),
};

static ERRORS: [MeasuredError; 2] = [MeasuredError::of_area(0.42), MeasuredError::of_open_gap(2.22)];
static MEASURED: MeasuredErrors = MeasuredErrors::on_the_challenge(&ERRORS, false);

fn supports(quantity: Quantity) -> Support {
    use Quantity::*;
    match quantity {
        ContactArea | Stiffness => Support::NoAdhesion,
        MeanGap => Support::Only("mean gap of the undeformed surface, without adhesion"),
        GapMap | StressMap | ContactMap => Support::No("statistical method without positions"),
        ClusterPdf | ClusterArea | MedianClusterArea | GapPdf | StressPdf => {
            Support::No("only sums over asperities are computed")
        }
    }
}

/// Processor time of a load, measured by the benchmark `measure`; an order of magnitude.
const SECONDS: f64 = 1e-2;

impl ContactMethod for Scgw {
    fn card(&self) -> &'static MethodCard {
        &CARD
    }

    fn plan(&self, _: &ReducedProblem) -> SolvePlan {
        let bytes = (16 * (HEIGHTS + CURVATURES)) as u64;
        SolvePlan { bytes, iterations: 50, pairs_per_iteration: 0.0, seconds: SECONDS }
    }

    fn prepare<'p>(&self, problem: &'p ReducedProblem<'p>, observer: &'p dyn Observer) -> Result<StartedMethod<'p>> {
        let power = require::isotropic_power(problem, CARD.id)?;
        require::no_adhesion(problem, CARD.id)?;
        let (m0, m2, m4) = power.moments();
        Ok(estimating(ScgwEstimator { summits: Summits::new(m0, m2, m4), observer }))
    }
}

/// Quadrature points over the heights and the curvatures of summits.
const HEIGHTS: usize = 80;
const CURVATURES: usize = 64;

/// Standard deviations at which Gaussians are truncated.
const REACH: f64 = 9.0;

/// Smallest variance of the curvature at given height, over m4. Nayak's bandwidth parameter is at least 3/2, its
/// value for a single wavelength, on an isotropic surface; a realisation may have less by the scatter of its
/// directions.
const LEAST_SPREAD: f64 = 1e-6;

/// Joint distribution of summits in height and curvature. Heights towards the other body, from the mean plane.
struct Summits {
    m0: f64,
    m2: f64,
    m4: f64,
    heights: Vec<(f64, f64)>,
    curvatures: Vec<(f64, f64)>,
}

/// Contacts of the summits above a plane, per area of the cell.
#[derive(Debug, Clone, Copy, Default)]
struct Contacts {
    pressure: f64,
    area: f64,
    /// -dp/dd.
    stiffness: f64,
}

impl Summits {
    fn new(m0: f64, m2: f64, m4: f64) -> Self {
        Summits { m0, m2, m4, heights: gauss_legendre(HEIGHTS), curvatures: gauss_legendre(CURVATURES) }
    }

    /// Number density of summits per area and height, and their mean curvature at that height.
    ///
    /// Height z and mean curvature A are jointly normal with variances m0 and 2 m4/3 and covariance m2. A point with
    /// a horizontal tangent, of density 1/(2π m2), is a summit if the half difference of its principal curvatures,
    /// Rayleigh distributed with s² = m4/3, is less than A; the mean of A² less its square over these is A² - 2 s² +
    /// 2 s² exp(-A²/2s²).
    fn at(&self, z: f64) -> (f64, f64) {
        let (m0, m2, m4) = (self.m0, self.m2, self.m4);
        let mean = m2 * z / m0;
        let spread = (2.0 * m4 / 3.0 - m2 * m2 / m0).max(LEAST_SPREAD * m4).sqrt();
        let (from, to) = ((mean - REACH * spread).max(0.0), mean + REACH * spread);
        if to <= 0.0 {
            return (0.0, 0.0);
        }
        let two_s2 = 2.0 * m4 / 3.0;
        let weight = |a: f64| {
            let x = a * a / two_s2;
            // x - 1 + exp(-x), or x²/2 for small x.
            let less = if x < 1e-4 { 0.5 * x * x } else { x + (-x).exp_m1() };
            two_s2 * less * (-0.5 * ((a - mean) / spread).powi(2)).exp()
        };
        let norm = (-0.5 * z * z / m0).exp() / ((2.0 * PI).powi(2) * m2 * m0.sqrt() * spread);
        let density = integral(&self.curvatures, from, to, weight);
        let first = integral(&self.curvatures, from, to, |a| a * weight(a));
        if density > 0.0 { (norm * density, first / density) } else { (0.0, 0.0) }
    }

    /// Hertz contacts of the summits above a plane at height d.
    fn above(&self, d: f64) -> Contacts {
        let rms = self.m0.sqrt();
        // Beyond this height the density is below exp(-REACH²/2) of that at d.
        let to = if d > 0.0 { (d * d + (REACH * rms).powi(2)).sqrt() } else { REACH * rms };
        let mut sum = Contacts::default();
        let deepest = (to - d).max(0.0).sqrt();
        for (x, w) in &self.heights {
            // Substituting depth = y² makes the integrand smooth.
            let y = 0.5 * deepest * (1.0 + x);
            let depth = y * y;
            let (density, curvature) = self.at(d + depth);
            if density <= 0.0 || curvature <= 0.0 {
                continue;
            }
            let weight = 0.5 * deepest * w * 2.0 * y * density;
            let radius = curvature.recip();
            sum.pressure += weight * 4.0 / 3.0 * radius.sqrt() * depth.powf(1.5);
            sum.area += weight * PI * radius * depth;
            sum.stiffness += weight * 2.0 * (radius * depth).sqrt();
        }
        sum
    }

    /// Mean gap between the undeformed surface and a plane at d, and its derivative.
    fn bearing_gap(&self, d: f64) -> (f64, f64) {
        let rms = self.m0.sqrt();
        let t = d / rms;
        let below = 0.5 * libm::erfc(-t / SQRT_2);
        let gap = rms * ((-0.5 * t * t).exp() / (2.0 * PI).sqrt() + t * below);
        (gap, below)
    }
}

struct ScgwEstimator<'p> {
    summits: Summits,
    observer: &'p dyn Observer,
}

/// Bounds of the height of the plane, in units of the rms height.
const HIGHEST: f64 = 30.0;

/// Halvings that exhaust the precision.
const HALVINGS: usize = 60;

impl Estimator for ScgwEstimator<'_> {
    fn estimate(&mut self, load: Load) -> Result<MethodEstimate<'_>> {
        let clock = Instant::now();
        let pressure = require::pressure(load, false, CARD.id)?;
        let summits = &self.summits;
        let rms = summits.m0.sqrt();
        let (mut low, mut high) = (-HIGHEST * rms, HIGHEST * rms);
        if summits.above(low).pressure < pressure {
            let largest = summits.above(low).pressure;
            let accepted = format!("at most {largest:.3} E*, the largest pressure that its asperities carry");
            return Err(require::refused(CARD.id, "pressure", format!("{pressure:e} E*"), accepted));
        }
        let (mut stop, mut iterations) = (Stop::Converged, 0);
        while iterations < HALVINGS {
            if self.observer.stop_requested() {
                stop = Stop::Interrupted;
                break;
            }
            iterations += 1;
            let middle = 0.5 * (low + high);
            if summits.above(middle).pressure > pressure { low = middle } else { high = middle }
        }
        let d = 0.5 * (low + high);
        let bearing = summits.above(d);
        let (gap, slope) = summits.bearing_gap(d);
        Ok(MethodEstimate {
            contact_area: require::contact_of_spots(bearing.area, pressure, CARD.id)?,
            mean_gap: Some(gap),
            stiffness: (slope > 0.0).then_some(bearing.stiffness / slope),
            load_error: (bearing.pressure / pressure - 1.0).abs(),
            stop,
            iterations,
            seconds: clock.elapsed().as_secs_f64(),
            ..MethodEstimate::at(pressure)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_surface::{PowerSpectrum, Spectrum};

    fn challenge() -> Summits {
        let (m0, m2, m4) = PowerSpectrum::expected(&Spectrum::CHALLENGE, 1.0).moments();
        Summits::new(m0, m2, m4)
    }

    /// Number of summits per area, m4/(6√3 π m2) (Nayak 1971), for broad spectra and for a single wavelength.
    #[test]
    fn number_of_summits_is_nayaks() {
        for s in [challenge(), Summits::new(1.0, 1.0, 2.0), Summits::new(1.0, 1.0, 1.501), Summits::new(2.0, 3.0, 40.0)]
        {
            let reach = REACH * s.m0.sqrt();
            let rule = gauss_legendre(200);
            let all = integral(&rule, -reach, reach, |z| s.at(z).0);
            let exact = s.m4 / (6.0 * 3f64.sqrt() * PI * s.m2);
            assert!((all / exact - 1.0).abs() < 1e-8, "{all} {exact}");
        }
    }

    /// Mean height of the summits, 4 √(m0/(π α)) for all α (Nayak 1971).
    #[test]
    fn mean_summit_height_is_nayaks() {
        for s in [challenge(), Summits::new(1.0, 1.0, 2.0)] {
            let reach = REACH * s.m0.sqrt();
            let rule = gauss_legendre(200);
            let [all, first] = [0, 1].map(|k| integral(&rule, -reach, reach, |z| z.powi(k) * s.at(z).0));
            let alpha = s.m0 * s.m4 / (s.m2 * s.m2);
            let exact = 4.0 * (s.m0 / (PI * alpha)).sqrt();
            assert!((first / all / exact - 1.0).abs() < 1e-8, "{} {exact}", first / all);
        }
    }

    /// At large separation, area over pressure times the rms gradient approaches √(2π) as d^-2 for all moments.
    #[test]
    fn area_is_proportional_to_load_at_large_separation() {
        for (m0, m2, m4) in [(1.0, 1.0, 2.0), (2.0, 3.0, 9.0)] {
            let s = Summits::new(m0, m2, m4);
            let kappa = |t: f64| {
                let r = s.above(t * m0.sqrt());
                r.area / r.pressure * (2.0 * m2).sqrt()
            };
            let [near, far] = [15.0, 30.0].map(|t| kappa(t) / (2.0 * PI).sqrt() - 1.0);
            assert!(far.abs() < 0.01, "{far}");
            assert!((near / far - 4.0).abs() < 0.5, "{near} {far}");
        }
    }

    /// Comparison with differences.
    #[test]
    fn stiffness_is_the_derivative_of_pressure() {
        let s = challenge();
        let (d, step) = (2.0 * s.m0.sqrt(), 1e-5 * s.m0.sqrt());
        let slope = (s.above(d - step).pressure - s.above(d + step).pressure) / (2.0 * step);
        assert!((s.above(d).stiffness / slope - 1.0).abs() < 1e-6);
        let gap = (s.bearing_gap(d + step).0 - s.bearing_gap(d - step).0) / (2.0 * step);
        assert!((s.bearing_gap(d).1 / gap - 1.0).abs() < 1e-6);
    }
}

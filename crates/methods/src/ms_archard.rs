//! Asperities on asperities: each band of wavelengths is a two-dimensional sinusoid that carries the load on the
//! contact area of the longer bands (Jackson & Streator, Wear 261 (2006) 1337, after Archard, Proc. R. Soc. A 243
//! (1957) 190).
//!
//! A band of rms height σ and rms gradient g is a wave of amplitude 2σ with the full-contact pressure E* g. Its
//! contact fraction multiplies the contact area of the longer bands, and the mean pressure in contact increases
//! accordingly. Adhesion adds the traction of the law at the mean gap of the band; the state is the one reached from
//! first contact.

use crate::prelude::*;
use crate::sinusoid;
use asperity_grid::bisect;
use asperity_surface::PowerSpectrum;

pub(super) struct MsArchard;

static CARD: MethodCard = MethodCard {
    id: "ms-archard",
    paper_name: "MS-Archard",
    family: "stacked waves",
    kind: MethodKind::Estimate,
    needs: Needs::Spectrum,
    criterion: Criterion::Statistical,
    calibrated_on: Some("adhesive contact area at p* = 0.01, and the area at the jump to full contact (band ratio 5)"),
    summary: "one sinusoid per band of wavelengths, shorter bands on the contact area of longer ones",
    supports,
    capabilities: Capabilities::NONE,
    dois: &["10.1007/s11249-017-0900-2", "10.1098/rspa.1957.0214"],
    papers: &["Jackson & Streator, Wear 261 (2006) 1337"],
    measured_errors: Some(&MEASURED),
};

static ERRORS: [MeasuredError; 2] = [MeasuredError::of_area(0.98), MeasuredError::of_open_gap(0.57)];
static MEASURED: MeasuredErrors = MeasuredErrors::on_the_challenge(&ERRORS, true);

fn supports(quantity: Quantity) -> Support {
    use Quantity::*;
    match quantity {
        ContactArea | MeanGap => Support::Only("depends on the band ratio ms-archard.band_ratio"),
        GapMap | StressMap | ContactMap => Support::No("statistical method without positions"),
        ClusterPdf | ClusterArea | MedianClusterArea => Support::No("statistical method without patches"),
        GapPdf | StressPdf => Support::No("only mean values are computed"),
        Stiffness => Support::Only("as differences between loads"),
    }
}

/// Largest band ratio.
const WIDEST: f64 = 1e6;

/// Processor time of a load, measured by the benchmark `measure`; an order of magnitude.
const SECONDS: f64 = 1e-3;

impl ContactMethod for MsArchard {
    fn card(&self) -> &'static MethodCard {
        &CARD
    }

    fn calibrated_on(&self, settings: &Settings) -> Option<&'static str> {
        if settings.ms_archard.band_ratio == settings::FITTED_BAND_RATIO { CARD.calibrated_on } else { None }
    }

    fn plan(&self, problem: &ReducedProblem) -> SolvePlan {
        let shells = problem.shells();
        let bytes = (shells * size_of::<SinusoidBand>()) as u64;
        SolvePlan { bytes, iterations: shells, pairs_per_iteration: 0.0, seconds: SECONDS }
    }

    fn prepare<'p>(&self, problem: &'p ReducedProblem<'p>, observer: &'p dyn Observer) -> Result<StartedMethod<'p>> {
        let power = require::isotropic_power(problem, CARD.id)?;
        let ratio = problem.settings.ms_archard.band_ratio;
        if !(ratio > 1.0 && ratio <= WIDEST) {
            return Err(require::refused(CARD.id, "ms-archard.band_ratio", ratio, "above 1 and at most 1e6"));
        }
        if let AttractionLaw::PowerLaw93(_) | AttractionLaw::Tabulated(_) = problem.adhesion {
            let accepted = "a law with its largest attraction at zero gap: exponential, Dugdale or none";
            return Err(require::refused(CARD.id, "adhesion", problem.adhesion, accepted));
        }
        Ok(estimating(Stack { bands: bands(power, ratio), adhesion: problem.adhesion, observer }))
    }
}

/// A band of wavelengths as a sinusoid.
#[derive(Debug, Clone, Copy)]
struct SinusoidBand {
    amplitude: f64,
    /// rms gradient, which is also the full-contact pressure over E*.
    gradient: f64,
}

/// Groups the shells of the spectrum into bands, from the longest wave.
fn bands(power: &PowerSpectrum, ratio: f64) -> Vec<SinusoidBand> {
    /// The mean wave numbers of the longest waves may differ by rounding.
    const ROUNDING: f64 = 1.0 - 1e-9;
    let mut sums: Vec<(f64, f64)> = Vec::new();
    let mut end = 0.0;
    for shell in &power.shells {
        if sums.is_empty() {
            end = shell.q * ROUNDING * ratio;
        }
        let mut starts = sums.is_empty();
        while shell.q >= end {
            end *= ratio;
            starts = true;
        }
        if starts {
            sums.push((0.0, 0.0));
        }
        let sum = sums.last_mut().expect("a band has begun");
        sum.0 += shell.height;
        sum.1 += shell.gradient;
    }
    sums.iter().map(|(h, g)| SinusoidBand { amplitude: 2.0 * h.sqrt(), gradient: g.sqrt() }).collect()
}

struct Stack<'p> {
    bands: Vec<SinusoidBand>,
    adhesion: AttractionLaw,
    observer: &'p dyn Observer,
}

/// Pressures at which the first equilibrium is searched, equidistant in their cube roots, and halvings that exhaust the
/// precision.
const TRIED: usize = 400;
const HALVINGS: usize = 60;

impl SinusoidBand {
    /// Adhesive traction at a pressure over the full-contact pressure of the band.
    fn pull(&self, x: f64, adhesion: &AttractionLaw) -> f64 {
        adhesion.traction(self.amplitude * sinusoid::mean_gap(x))
    }

    /// Contact pressure over that of full contact under an external pressure; with adhesion the smallest in
    /// equilibrium, at which growing contact stops. Also the number of evaluations.
    fn pressed(&self, pressure: f64, adhesion: &AttractionLaw) -> (f64, usize) {
        if *adhesion == AttractionLaw::None {
            return ((pressure / self.gradient).min(1.0), 1);
        }
        let balanced = |x: f64| x * self.gradient >= pressure + self.pull(x, adhesion);
        let root = |k: usize| (k as f64 / TRIED as f64).powi(3);
        let Some(k) = (1..=TRIED).find(|&k| balanced(root(k))) else { return (1.0, TRIED) };
        (bisect(root(k - 1), root(k), HALVINGS, |x| !balanced(x)).1, k + HALVINGS)
    }
}

impl Estimator for Stack<'_> {
    fn estimate(&mut self, load: Load) -> Result<MethodEstimate<'_>> {
        let clock = Instant::now();
        let pressure = require::pressure(load, false, CARD.id)?;
        let (mut contact_area, mut gap, mut iterations) = (1.0, 0.0, 0);
        let (mut on_band, mut unbalanced) = (pressure, 0.0_f64);
        let mut stop = Stop::Converged;
        for band in &self.bands {
            if self.observer.stop_requested() {
                stop = Stop::Interrupted;
                break;
            }
            let (x, tried) = band.pressed(on_band, &self.adhesion);
            iterations += tried;
            // The band contributes its gap within the contact area of the longer bands.
            gap += contact_area * band.amplitude * sinusoid::mean_gap(x);
            let pull = band.pull(x, &self.adhesion);
            if x < 1.0 {
                unbalanced = unbalanced.max((x * band.gradient / (on_band + pull) - 1.0).abs());
            }
            let touching = sinusoid::contact_area(x);
            contact_area *= touching;
            on_band = (on_band + pull) / touching;
        }
        Ok(MethodEstimate {
            contact_area,
            mean_gap: Some(gap),
            load_error: unbalanced,
            stop,
            iterations,
            seconds: clock.elapsed().as_secs_f64(),
            ..MethodEstimate::at(pressure)
        })
    }
}

//! The surface stage: heights and their statistics.

use super::continuum::in_stage;
use super::folder::StageKey;
use super::stage::{EstimatedCost, MachineSpeed, Stage, StageContext, StageKeys};
use crate::Result;
use crate::record::results::{
    CURVATURE_RADIUS, FIRST_TOUCH, HEIGHT_RANGE, PsdPoint, RMS_HEIGHT, SurfaceResults, SurfaceStatistic,
};
use crate::scene::Case;
use asperity_grid::{Grid, Transform};
use asperity_surface::HeightSource;
use asperity_surface::files::npy;
use asperity_surface::{Expected, areal, correlation_length, hann_windowed, moments, non_periodic_moments, psd, range};
use std::path::Path;

/// Time of synthesis and statistics on one thread, s per point; an order of magnitude.
const SECONDS_PER_POINT: f64 = 40e-9;

pub(super) struct SurfaceStage<'a> {
    pub case: &'a Case,
}

impl Stage for SurfaceStage<'_> {
    type Input<'i> = ();
    type Output = SurfaceResults;

    fn name(&self) -> String {
        "surface".into()
    }

    fn what(&self) -> String {
        format!("{} x {} heights, statistics", self.case.model.grid.nx, self.case.model.grid.ny)
    }

    fn cost(&self, _: MachineSpeed) -> EstimatedCost {
        let points = self.case.model.grid.points();
        // Heights and their half spectrum; in addition the map that they are resampled from.
        let fields = if self.case.surface().series_bytes().is_some() { 2 } else { 3 };
        let spare = Transform::<f64>::spectrum_bytes(self.case.model.grid) - 8 * points as u64;
        EstimatedCost { bytes: fields * 8 * points as u64 + spare, seconds: SECONDS_PER_POINT * points as f64 }
    }

    fn keys(&self, dependencies: &[&StageKey]) -> Result<StageKeys> {
        StageKey::new("surface", &(StageKey::of_program()?, self.case.solved_grid()), dependencies)
            .map(StageKeys::restarted)
    }

    fn run(&self, (): (), context: &StageContext) -> Result<SurfaceResults> {
        surface(self.case, &self.case.surface().heights(self.case.model.grid, 0.0), context.folder, context.stage)
    }
}

/// Expected and realised statistics of heights, and their power spectrum. Heights are written to `heights.npy`, from which the solve
/// stages read imported ones.
fn surface(case: &Case, heights: &[f64], folder: &Path, stage: &str) -> Result<SurfaceResults> {
    npy::write(&folder.join("heights.npy"), case.model.grid.nx, case.model.grid.ny, heights.iter().copied())?;
    let is_finite = case.is_non_periodic();
    let note = "Heights that do not repeat: moments are those of the nodes and of the differences between neighbours, none of \
                them across an edge; the spectrum is that of the heights about their mean plane under a Hann window.";
    Ok(SurfaceResults {
        origin: case.surface().origin(),
        provenance: case.provenance().cloned(),
        periodic: !is_finite,
        note: if is_finite { note.into() } else { String::new() },
        nx: case.model.grid.nx,
        ny: case.model.grid.ny,
        aspect: case.model.grid.ly / case.model.grid.lx,
        heights: Some(in_stage(stage, "heights.npy")),
        statistics: statistics(case, heights),
        psd: if is_finite {
            spectrum(case.surface(), case.model.grid, &hann_windowed(case.model.grid, heights))
        } else {
            spectrum(case.surface(), case.model.grid, heights)
        },
    })
}

/// Expected and realised statistics of heights on their grid. Expected values are those of the full spectrum; if the
/// grid does not resolve all modes, the values of the resolved modes are added.
pub fn statistics(case: &Case, heights: &[f64]) -> Vec<SurfaceStatistic> {
    let (surface, grid, um) = (case.surface(), case.model.grid, case.scales.length_m * 1e6);
    if case.is_non_periodic() {
        return patch_statistics(grid, heights, um);
    }
    let (m, r) = (moments(grid, heights), range(heights));
    let (expected, on_grid) = match surface {
        HeightSource::Synthesised { spectrum, modes, .. } => (
            Some(spectrum.expected(grid.ly / grid.lx, 0.0)),
            (!modes.resolved_on(grid)).then(|| spectrum.expected_on(grid)),
        ),
        HeightSource::Imported { .. } | HeightSource::Fourier { .. } => (None, None),
    };
    let line = |name: &str, symbol: &str, unit: &str, value: Option<&dyn Fn(&Expected) -> f64>, realised: f64| {
        SurfaceStatistic {
            expected: value.and_then(|value| expected.as_ref().map(value)),
            expected_on_grid: value.and_then(|value| on_grid.as_ref().map(value)),
            ..realised_statistic(name, symbol, unit, realised)
        }
    };
    let band = on_grid.as_ref().or(expected.as_ref()).map(|e| e.rms_height_band * um);
    vec![
        SurfaceStatistic {
            band,
            ..line("rms height", RMS_HEIGHT, "µm", Some(&|e| e.rms_height * um), m.rms_height * um)
        },
        line("rms gradient", "ḡ", "1", Some(&|e| e.rms_gradient), m.rms_gradient),
        line(
            "curvature radius",
            CURVATURE_RADIUS,
            "nm",
            Some(&|e| e.curvature_radius * um * 1e3),
            m.curvature_radius() * um * 1e3,
        ),
        line("profile moment m0", "m0", "µm²", Some(&|e| e.m0 * um * um), m.m0 * um * um),
        line("profile moment m2", "m2", "1", Some(&|e| e.m2), m.m2),
        line("profile moment m4", "m4", "µm⁻²", Some(&|e| e.m4 / um / um), m.m4 / um / um),
        line("Nayak's bandwidth parameter", "α", "1", Some(&|e| e.nayak()), m.nayak()),
        line("mean gap at first contact", FIRST_TOUCH, "µm", None, (r.mean - r.min) * um),
        line("range of heights", HEIGHT_RANGE, "µm", None, (r.max - r.min) * um),
        line(
            "elastic energy of full contact",
            "U_el",
            "µm E*",
            Some(&|e| e.full_contact_energy * um),
            m.full_contact_energy * um,
        ),
    ]
    .into_iter()
    .chain(areal_statistics(grid, heights, um, true))
    .collect()
}

/// Parameters of ISO 25178-2 other than the rms height.
fn areal_statistics(grid: Grid, heights: &[f64], um: f64, periodic: bool) -> impl Iterator<Item = SurfaceStatistic> {
    let p = areal(grid, heights, periodic);
    let gradient = periodic.then_some(("rms gradient between neighbours", "Sdq", "1", p.sdq));
    let lines = [
        ("mean absolute height", "Sa", "µm", p.sa * um),
        ("skewness (peaks are positive)", "Ssk", "1", p.ssk),
        ("kurtosis", "Sku", "1", p.sku),
        ("developed area over projected area, minus one", "Sdr", "1", p.sdr),
    ];
    // On a patch that is its gradient.
    // A patch of one line has no area.
    gradient
        .into_iter()
        .chain(lines)
        .filter(|line| line.3.is_finite())
        .map(|(name, symbol, unit, realised)| realised_statistic(name, symbol, unit, realised))
}

/// Correlation lengths: a transform more, and four times the points for a patch.
pub fn correlation_statistics(case: &Case, heights: &[f64]) -> Vec<SurfaceStatistic> {
    let um = case.scales.length_m * 1e6;
    let Some(length) = correlation_length(case.model.grid, heights, !case.is_non_periodic()) else { return Vec::new() };
    let aspect = length.aspect.map(|aspect| realised_statistic("texture aspect ratio", "Str", "1", aspect));
    let fastest = realised_statistic("autocorrelation length (fastest decay to 0.2)", "Sal", "µm", length.fastest * um);
    std::iter::once(fastest).chain(aspect).collect()
}

fn realised_statistic(name: &str, symbol: &str, unit: &str, realised: f64) -> SurfaceStatistic {
    SurfaceStatistic {
        name: name.into(),
        symbol: symbol.into(),
        unit: unit.into(),
        expected: None,
        expected_on_grid: None,
        realised,
        band: None,
    }
}

/// Statistics of non-periodic heights, without expected values.
fn patch_statistics(grid: Grid, heights: &[f64], um: f64) -> Vec<SurfaceStatistic> {
    let (m, r) = (non_periodic_moments(grid, heights), range(heights));
    let lines = [
        ("rms height about the mean", RMS_HEIGHT, "µm", m.rms_height * um),
        ("rms gradient between neighbours", "ḡ", "1", m.rms_gradient),
        ("curvature radius", CURVATURE_RADIUS, "nm", m.m4.sqrt().recip() * um * 1e3),
        ("profile moment m2", "m2", "1", m.m2),
        ("profile moment m4", "m4", "µm⁻²", m.m4 / um / um),
        ("mean gap at first contact", FIRST_TOUCH, "µm", (r.mean - r.min) * um),
        ("range of heights", HEIGHT_RANGE, "µm", (r.max - r.min) * um),
    ];
    lines
        .into_iter()
        // Heights without curvature have no finite radius.
        .filter(|line| line.3.is_finite())
        .map(|(name, symbol, unit, realised)| realised_statistic(name, symbol, unit, realised))
        .chain(areal_statistics(grid, heights, um, false))
        .collect()
}

fn spectrum(surface: &HeightSource, grid: Grid, heights: &[f64]) -> Vec<PsdPoint> {
    let power = match surface {
        HeightSource::Synthesised { spectrum, .. } => {
            let scale = spectrum.expected(grid.ly / grid.lx, 0.0).power_prefactor;
            Some(move |n: f64| spectrum.relative_power(n) * scale)
        }
        HeightSource::Imported { .. } | HeightSource::Fourier { .. } => None,
    };
    let bins = psd(grid, heights, |n| power.as_ref().map_or(0.0, |p| p(n)));
    bins.iter()
        .map(|b| PsdPoint { mode: b.mode, realised: b.power, expected: power.as_ref().map(|_| b.expected) })
        .collect()
}

//! Model of the laboratory submission: a printed surface, scaled up a thousand times, is pressed onto a rubber sheet,
//! and a camera images the contact by frustrated total internal reflection (Bennett, Harris, Schulze, Urueña, McGhee,
//! Pitenis, Müser, Angelini & Sawyer, Tribology Letters 65 (2017) 134; section 3 of Müser et al., Tribology Letters
//! 65 (2017) 118).
//!
//! Heights are averaged over the resolution of the printer (a box average, exact in Fourier space); the body is an
//! incompressible layer bonded to its support; a camera pixel is in contact if the gap of most of its nodes is below
//! the optical gap; gaps follow from a displacement averaged over the window of the image correlation. The method
//! `fast` solves the contact problem. Not modelled: the edges of sheet and print (the cell is periodic), friction,
//! viscosity.
//!
//! Scaling up at the same E*ḡ preserves the dimensionless groups except those of adhesion: the work of adhesion of
//! rubber, 50 mJ/m² in a cell of 0.1 m, equals the challenge's γ/(E*L) = 2·10⁻⁵ at E* = 25 kPa and is less for
//! stiffer rubber; a molecular range is far below the challenge's ρ/L = 2·10⁻⁵. The model uses the adhesion of the
//! problem.

use crate::prelude::*;
use asperity_contact::interface::{Base, Layer, RangeChoice};
use asperity_contact::method::settings::ExperimentSettings;
use asperity_grid::Transform;
use rustfft::num_complex::Complex;

pub(super) struct Experiment;

static CARD: MethodCard = MethodCard {
    id: "experiment",
    paper_name: "experiment",
    family: "laboratory",
    kind: MethodKind::Estimate,
    needs: Needs::Heights,
    criterion: Criterion::Optical { gap_nm: settings::OPTICAL_GAP_NM },
    calibrated_on: None,
    summary: "printed surface, bonded rubber layer and camera, solved by fast",
    supports,
    capabilities: Capabilities::NONE,
    dois: &["10.1007/s11249-017-0900-2"],
    papers: &["Bennett et al., Tribology Letters 65 (2017) 134"],
    measured_errors: None,
};

fn supports(quantity: Quantity) -> Support {
    use Quantity::*;
    match quantity {
        ContactMap | ContactArea | ClusterPdf | ClusterArea | MedianClusterArea => {
            Support::Only("camera pixels below the optical gap; no edges")
        }
        GapMap | GapPdf | MeanGap => Support::Only("by digital image correlation; no edges"),
        Stiffness => Support::Only("as differences between loads"),
        StressMap | StressPdf => Support::No("optical images show contact, not stress"),
    }
}

fn layer(settings: &ExperimentSettings) -> Elastic {
    Elastic::Layer(Layer { thickness: settings.thickness, poisson: settings.poisson, base: Base::Bonded })
}

fn check(settings: &ExperimentSettings) -> Result<()> {
    require::positive(settings.thickness, CARD.id, "experiment.thickness")?;
    let lengths = [
        ("experiment.print_resolution", settings.print_resolution),
        ("experiment.pixel_size", settings.pixel_size),
        ("experiment.optical_gap", settings.optical_gap),
        ("experiment.correlation_window", settings.correlation_window),
    ];
    for (key, value) in lengths {
        if !(value >= 0.0 && value.is_finite()) {
            return Err(require::refused(CARD.id, key, value, "a length of at least 0"));
        }
    }
    if !(0.0..=0.5).contains(&settings.poisson) {
        return Err(require::refused(CARD.id, "experiment.poisson", settings.poisson, "0 to 0.5"));
    }
    Ok(())
}

impl ContactMethod for Experiment {
    fn card(&self) -> &'static MethodCard {
        &CARD
    }

    fn criterion(&self, settings: &Settings) -> Criterion {
        // Rounded to a thousandth of a nanometre.
        let gap_nm = (settings.experiment.optical_gap * settings::PRINT_SIDE_NM * 1e3).round() / 1e3;
        Criterion::Optical { gap_nm }
    }

    fn adhesion(&self, problem: &ReducedProblem) -> AttractionLaw {
        // A range that the grid does not resolve pins contact lines to it, as in `fast`.
        RangeChoice::Mesh.law(problem.adhesion, problem.grid.dx().max(problem.grid.dy()))
    }

    fn plan(&self, problem: &ReducedProblem) -> SolvePlan {
        // The solver, printed heights, previous gap, correlated gap, and the map.
        let inner = Fast.plan(&ReducedProblem { heights: Heights::Planned(None), ..problem.clone() });
        SolvePlan { bytes: inner.bytes + (3 * 8 + 1) * problem.grid.points() as u64, ..inner }
    }

    fn prepare<'p>(&self, problem: &'p ReducedProblem<'p>, observer: &'p dyn Observer) -> Result<StartedMethod<'p>> {
        require::half_space(problem, CARD.id)?;
        require::hard_wall(problem, CARD.id)?;
        check(&problem.settings.experiment)?;
        let grid = problem.grid;
        let mut printed = require::heights_above_lowest(problem).into_owned();
        box_average(grid, &mut printed, problem.settings.experiment.print_resolution);
        let (last, contact, gap) = (Vec::new(), Vec::new(), Vec::new());
        Ok(estimating(ExperimentEstimator { problem, observer, printed, last, contact, gap }))
    }
}

struct ExperimentEstimator<'p> {
    problem: &'p ReducedProblem<'p>,
    observer: &'p dyn Observer,
    printed: Vec<f64>,
    /// Solved gap of the last load, the start of the next.
    last: Vec<f64>,
    contact: Vec<u8>,
    gap: Vec<f64>,
}

impl Estimator for ExperimentEstimator<'_> {
    fn estimate(&mut self, load: Load) -> Result<MethodEstimate<'_>> {
        let clock = Instant::now();
        let settings = self.problem.settings.experiment;
        let grid = self.problem.grid;
        let adhesive = self.problem.adhesion != AttractionLaw::None;
        let pressure = require::pressure(load, adhesive, CARD.id)?;
        let adhesion = Experiment.adhesion(self.problem);
        let (heights, kernel) = ((&self.printed).into(), layer(&settings));
        let inner = ReducedProblem { heights, kernel, adhesion, ..self.problem.clone() };
        let mut run = Fast.start(&inner, self.observer)?.solver()?;
        if adhesive && !self.last.is_empty() {
            run.set_gap(&self.last);
        }
        let state = run.equilibrate(Load::Pressure(pressure))?;
        let estimate = MethodEstimate::solved(pressure, &state, self.problem.tolerance);
        self.last = state.gap.to_vec();
        drop(run);
        self.contact = photograph(grid, &self.last, settings.optical_gap, settings.pixel_size);
        self.gap = correlated(grid, &self.printed, &self.last, settings.correlation_window);
        let touching = self.contact.iter().map(|c| usize::from(*c)).sum::<usize>();
        Ok(MethodEstimate {
            contact_area: touching as f64 / grid.points() as f64,
            contact: Some(&self.contact),
            gap: Some(&self.gap),
            seconds: clock.elapsed().as_secs_f64(),
            ..estimate
        })
    }

    /// With adhesion a load starts from the gap of the previous one.
    fn replay(&mut self, load: Load) -> Result<()> {
        if self.problem.adhesion != AttractionLaw::None { self.estimate(load).map(|_| ()) } else { Ok(()) }
    }
}

/// Averages a field `[ny, nx]` over a box of this width around every node, exactly for the modes of the grid.
fn box_average(grid: Grid, field: &mut [f64], width: f64) {
    if width == 0.0 {
        return;
    }
    let transform = Transform::<f64>::new(grid);
    let mut spectrum = transform.spectrum();
    let sinc = |q: f64| if q == 0.0 { 1.0 } else { (0.5 * q * width).sin() / (0.5 * q * width) };
    let per_point = 1.0 / grid.points() as f64;
    transform.forward_filtered(field, &mut spectrum, &|i: usize, column: &mut [Complex<f64>]| {
        let along_x = sinc(grid.qx(i)) * per_point;
        column.iter_mut().enumerate().for_each(|(j, c)| *c *= along_x * sinc(grid.qy(j)));
        0.0
    });
    transform.inverse(&mut spectrum, field);
}

/// Contact map: 1 on the nodes of camera pixels in which most nodes have a gap below `optical_gap`. Pixels smaller
/// than the node spacing are replaced by the nodes.
fn photograph(grid: Grid, gap: &[f64], optical_gap: f64, pixel: f64) -> Vec<u8> {
    let close: Vec<u8> = gap.iter().map(|g| u8::from(*g <= optical_gap)).collect();
    let pixels = |l: f64, n: usize| if pixel > 0.0 { ((l / pixel).round() as usize).clamp(1, n) } else { n };
    let (px, py) = (pixels(grid.lx, grid.nx), pixels(grid.ly, grid.ny));
    if (px, py) == (grid.nx, grid.ny) {
        return close;
    }
    // Pixel of a node.
    let pixel_of = |i: usize| ((i / grid.nx) * py / grid.ny) * px + (i % grid.nx) * px / grid.nx;
    let mut counts = vec![[0u32; 2]; px * py];
    for (i, c) in close.iter().enumerate() {
        let count = &mut counts[pixel_of(i)];
        count[0] += 1;
        count[1] += u32::from(*c);
    }
    (0..gap.len()).map(|i| u8::from(2 * counts[pixel_of(i)][1] > counts[pixel_of(i)][0])).collect()
}

/// Gap between the printed heights and the displacement averaged over the window, at least zero.
fn correlated(grid: Grid, printed: &[f64], gap: &[f64], window: f64) -> Vec<f64> {
    let mut displaced: Vec<f64> = printed.iter().zip(gap).map(|(h, g)| h - g).collect();
    box_average(grid, &mut displaced, window);
    printed.iter().zip(displaced).map(|(h, u)| (h - u).max(0.0)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{PI, TAU};

    /// A wave is attenuated by the sinc factors of the box along both axes; the mean is unchanged.
    #[test]
    fn box_average_attenuates_waves() {
        let grid = Grid { nx: 24, ny: 20, lx: 1.0, ly: 0.6 };
        let wave = |i: usize| (TAU * 3.0 * (i % 24) as f64 / 24.0).cos() * (TAU * (i / 24) as f64 / 20.0).cos();
        let mut field: Vec<f64> = (0..480).map(|i| 2.0 + wave(i)).collect();
        box_average(grid, &mut field, 0.1);
        let sinc = |x: f64| x.sin() / x;
        let kept = sinc(0.3 * PI) * sinc(0.1 * PI / 0.6);
        for (i, f) in field.iter().enumerate() {
            assert!((f - 2.0 - kept * wave(i)).abs() < 1e-14);
        }
    }

    /// Pixels of two by two nodes: three of four nodes make contact, two do not.
    #[test]
    fn pixel_is_in_contact_if_most_nodes_are() {
        let grid = Grid::unit(4, 4);
        let gap = [0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0];
        let seen = photograph(grid, &gap, 0.5, 0.5);
        assert_eq!(seen, [1, 1, 0, 0, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
        let one_by_one: Vec<u8> = gap.iter().map(|g| u8::from(*g == 0.0)).collect();
        assert_eq!(photograph(grid, &gap, 0.5, 0.01), one_by_one);
    }
}

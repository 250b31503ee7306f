//! Figures 4 to 12 of the challenge's paper: their axes and data, for the page of the challenge and for the comparison of methods.

use super::prelude::*;
use asperity_contact::load::at_step;
use asperity_contact::observe::{Distribution, column_at};
use asperity_grid::Grid;
use asperity_surface::files::npy;

/// Data of a figure.
pub(super) enum Data {
    /// A value of every state, against the load.
    Path(fn(&State) -> Option<f64>),
    /// A curve of one state.
    State(StateCurve),
}

type StateCurve = fn(&FigureWriter, &State) -> Result<Vec<(f64, f64)>>;

/// Square micrometres of a square metre.
const UM2: f64 = UM * UM;

pub(super) struct PaperFigure {
    /// In the paper.
    pub number: usize,
    pub name: &'static str,
    pub caption: &'static str,
    pub needs: Quantity,
    pub x: (fn(&'static str) -> AxisScale, &'static str),
    pub y: (fn(&'static str) -> AxisScale, &'static str),
    pub data: Data,
}

const AREA: (fn(&'static str) -> AxisScale, &str) = (log, "area a (µm²)");
const LOAD: (fn(&'static str) -> AxisScale, &str) = (log, "load p*");
/// Stresses over the mean pressure below which a profile is not drawn: a section without contact has only rounding errors.
const NOISE: f64 = 1e-3;

#[rustfmt::skip]
pub(super) const FIGURES: [PaperFigure; 9] = [
    PaperFigure { number: 4, name: "gap-section", caption: "Gap along y at x = L/2",
        needs: Quantity::GapMap, x: (linear, "y (µm)"), y: (linear, "gap (µm)"),
        data: Data::State(|w, s| column(w, s.gap_file(), w.scales.length_m * UM)) },
    PaperFigure { number: 5, name: "stress-section", caption: "Interfacial stress along y at x = L/2; tension is negative",
        needs: Quantity::StressMap, x: (linear, "y (µm)"), y: (linear, "stress over E*"),
        data: Data::State(|w, s| {
            let points = column(w, s.stress_file(), 1.0)?;
            let most = points.iter().map(|p| p.1.abs()).fold(0.0, f64::max);
            Ok(if most < NOISE * s.pressure.abs() / w.scales.modulus_pa { Vec::new() } else { points })
        }) },
    PaperFigure { number: 6, name: "cluster-sizes", caption: "Pr(a), density of clusters of an area",
        needs: Quantity::ClusterPdf, x: AREA, y: (log, "density of clusters Pr(a) (1/µm²)"),
        data: Data::State(|_, s| Ok(seen(s, |o| o.cluster_density.iter().map(|[a, d, _]| (a * UM2, d / UM2)).collect()))) },
    PaperFigure { number: 7, name: "cluster-area", caption: "CPr(a), fraction of the contact in clusters up to an area",
        needs: Quantity::ClusterPdf, x: AREA, y: (linear, "fraction of the contact CPr(a)"),
        data: Data::State(|_, s| Ok(seen(s, |o| cumulative(&o.cluster_area, UM2)))) },
    PaperFigure { number: 8, name: "gaps", caption: "Pr(u), distribution of the gap out of contact",
        needs: Quantity::GapPdf, x: (log, "gap (µm)"), y: (log, "probability density Pr(u) (1/µm)"),
        data: Data::State(|_, s| Ok(seen(s, |o| density(o.gap_logarithmic.as_ref(), UM)))) },
    PaperFigure { number: 9, name: "stresses", caption: "Pr(σ), distribution of the interfacial stress",
        needs: Quantity::StressPdf, x: (linear, "stress over E*"), y: (log, "probability density Pr(σ) E*"),
        data: Data::State(|w, s| Ok(seen(s, |o| density(o.stress.as_ref(), 1.0 / w.scales.modulus_pa)))) },
    PaperFigure { number: 10, name: "area", caption: "Relative contact area against load",
        needs: Quantity::ContactArea, x: LOAD, y: (log, "relative contact area"),
        data: Data::Path(|s| Some(s.contact_area)) },
    PaperFigure { number: 11, name: "contact-pressure", caption: "Mean contact pressure against load",
        needs: Quantity::ContactArea, x: LOAD, y: (linear, "contact pressure over E* ḡ"),
        data: Data::Path(|s| (s.contact_area > 0.0).then(|| s.p_star / s.contact_area)) },
    PaperFigure { number: 12, name: "mean-gap", caption: "Mean gap against load",
        needs: Quantity::MeanGap, x: LOAD, y: (log, "mean gap (µm)"),
        data: Data::Path(|s| s.mean_gap.map(|g| g * UM)) },
];

/// A curve of the observables of a state, if it has them.
fn seen(s: &State, of: impl Fn(&Observed) -> Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    s.observed.as_ref().map_or(Vec::new(), of)
}

/// The share of the contact in clusters up to an area, which is counted in `unit`: a step at the area of each cluster.
pub(super) fn cumulative(cluster_area: &[[f64; 2]], unit: f64) -> Vec<(f64, f64)> {
    let below = std::iter::once(0.0).chain(cluster_area.iter().map(|[_, share]| *share));
    cluster_area.iter().zip(below).flat_map(|(&[a, share], below)| [(a * unit, below), (a * unit, share)]).collect()
}

/// The density of a distribution in multiples of `unit`.
pub(super) fn density(of: Option<&Distribution>, unit: f64) -> Vec<(f64, f64)> {
    of.map_or(Vec::new(), |d| d.density_in(unit))
}

impl PaperFigure {
    pub(super) fn plot(&self, curves: Vec<Curve>) -> Plot {
        Plot::new((self.x.0)(self.x.1), (self.y.0)(self.y.1), curves)
    }

    /// Points of states, of that with an index if the figure shows a single load.
    pub(super) fn points(
        &self,
        writer: &FigureWriter,
        index: Option<usize>,
        states: &[State],
    ) -> Result<Vec<(f64, f64)>> {
        match self.data {
            Data::Path(of) => Ok(states.iter().filter_map(|s| Some((s.p_star, of(s)?))).collect()),
            Data::State(of) => match index.and_then(|index| at_step(states, index)) {
                Some(here) => of(writer, here),
                None => Ok(Vec::new()),
            },
        }
    }

    /// Whether the figure is a curve over all loads; otherwise it shows a single load.
    pub(super) fn is_path(&self) -> bool {
        matches!(self.data, Data::Path(_))
    }
}

/// Position of the sections, over L.
const SECTION: f64 = 0.5;

/// A column of a stored map: position along y (µm) and value times `unit`.
pub(super) fn column(writer: &FigureWriter, file: Option<&str>, unit: f64) -> Result<Vec<(f64, f64)>> {
    let Some(file) = file else { return Ok(Vec::new()) };
    // Read row by row, because the whole map may not fit into memory.
    let map = npy::NpyReader::open(&writer.field(file)?)?;
    let grid = Grid { nx: map.nx, ny: map.ny, lx: 1.0, ly: writer.aspect };
    let (column, step) = (column_at(grid, SECTION), grid.dy());
    let mut points = Vec::with_capacity(grid.ny);
    map.for_each_row(|y, row| points.push((y as f64 * step * writer.scales.length_m * UM, row[column] * unit)))?;
    Ok(points)
}

//! Surface section: statistics, height map, power spectrum.

use maud::{Markup, html};

use super::figures::{FigureWriter, capitalised, figure, panel, symbol, table, text};
use super::relief;
use crate::error::{Error, Result};
use crate::record::results::{Results, Statistic};
use crate::report::map::{Bar, Legend};
use crate::report::number::{count, si_given, significant};
use crate::report::picture::{self, LONGEST_SIDE, Range};
use crate::report::plot::{Axis, Curve, EXPECTED, Plot, REALISED};

pub(super) fn section(writer: &FigureWriter, results: &Results) -> Result<Markup> {
    let surface = &results.surface;
    let (nx, ny) = (surface.nx, surface.ny);
    let map = surface.heights.as_ref().map(|file| map(writer, file, [nx, ny])).transpose()?;
    let expected = surface.psd.iter().any(|p| p.expected.is_some());
    let [length_x, length_y] = [1.0, surface.aspect].map(|l| si_given(l * writer.scales.length_m, "m"));
    Ok(html! {
        p { (capitalised(&surface.origin)) ", on " (count(nx)) " × " (count(ny)) " nodes over a " (if surface.periodic { "periodic cell" } else { "non-periodic area" }) " of " (length_x) " × "
            (length_y) ". Heights are measured from the lowest point; low points touch first." }
        @if !surface.statistics.is_empty() { (statistics(&surface.statistics)) }
        @if !surface.note.is_empty() { p.quiet { (surface.note) } }
        @if let Some(map) = map { (map) }
        @if let Some(psd) = psd(writer, results)? {
            (figure(psd, html! { "Two-dimensional power spectral density C(q), mean over directions"
                @if expected { ", realised and prescribed" } ". Convention: C(q) = A |h̃(q)|² with the area A of the cell; the mean square "
                "height is the integral of C(q) over d²q/(2π)² (doi:10.1088/2051-672X/aa51f8)."
                @if !surface.periodic { " Computed under a Hann window, which affects the two lowest modes." } }))
        }
        @if let Some(relief) = relief::section(writer, results)? { (relief) }
    })
}

/// Picture of the heights.
fn map(writer: &FigureWriter, file: &str, [nx, ny]: [usize; 2]) -> Result<Markup> {
    let path = writer.field(file)?;
    let heights = picture::load(&path, LONGEST_SIDE, |h| h * writer.scales.length_m)?;
    // The map must have the shape stated in `results.json`.
    if (heights.nx, heights.ny) != (nx.div_ceil(heights.factor), ny.div_ceil(heights.factor)) {
        let found = format!("another shape than the {nx} × {ny} nodes of results.json");
        return Err(Error::format(path, found, format!("[{ny}, {nx}]")));
    }
    let range = Range::of(&heights.values, 0.0);
    let legend = Legend::Ramp(Bar::prefixed("height", range, "m", false));
    let names = ("heights", "height map, dark is low");
    let image = writer.large_map(names, &picture::map(&heights, range), writer.scales.length_m, legend)?;
    let blocks = if heights.factor > 1 {
        format!(" Each picture element is the mean of {0} × {0} nodes.", heights.factor)
    } else {
        String::new()
    };
    Ok(figure(
        panel("", image, html! {}),
        html! { "Height map; dark is low and touches first. x to the right, y up." (blocks) },
    ))
}

fn statistics(list: &[Statistic]) -> Markup {
    let coarse = list.iter().any(|s| s.expected_on_grid.is_some());
    let rows = list
        .iter()
        .map(|s| {
            let unit = if s.unit == "1" { "" } else { &s.unit };
            let with_unit = |v: f64| text(format!("{} {unit}", significant(v, 4)).trim_end());
            let mut row = vec![text(&s.name), symbol(&s.symbol), s.expected.map_or(text("–"), with_unit)];
            row.extend(coarse.then(|| s.expected_on_grid.map_or(text("–"), with_unit)));
            row.extend([
                with_unit(s.realised),
                s.band.map_or(text("–"), |b| text(format!("± {} {unit}", significant(b, 2)).trim_end())),
                status(s),
            ]);
            row
        })
        .collect();
    let mut head = vec!["quantity", "symbol", "expected", "realised", "band", "status"];
    if coarse {
        head.splice(2..3, ["whole spectrum", "on this grid"]);
    }
    html! {
        (table(&head, rows))
        @if coarse {
            p.quiet { "Whole spectrum and on this grid are ensemble values: of all waves, and of those that this grid resolves. "
                "The grid leaves out what is shorter than two nodes, and with it much of gradient and curvature; the status "
                "is about the waves of this grid." }
        }
        @if list.iter().any(|s| s.expected.is_some()) {
            p.quiet { @if !coarse { "Expected is the ensemble of the spectrum, all of which this grid resolves. " }
                "Realised is this surface. The band is two standard deviations of what a realisation may have: about one "
                "in twenty lies outside by chance." }
        }
    }
}

/// Deviation of a realised statistic from its expected value on the grid.
fn status(s: &Statistic) -> Markup {
    match (s.expected_on_grid.or(s.expected), s.band) {
        (Some(expected), Some(band)) if (s.realised - expected).abs() <= band => text("within the band"),
        (Some(_), Some(_)) => html! { span.bad { "outside the band" } },
        (Some(expected), None) if expected != 0.0 => {
            let off = (s.realised - expected).abs() / expected.abs();
            // Normalised statistics deviate only by rounding.
            text(if off < 1e-9 { "met".into() } else { format!("{} % off", significant(100.0 * off, 2)) })
        }
        _ => text("–"),
    }
}

/// Power over the largest power below which a mode is a rounding error: the rounding of double precision is 10⁻³² per
/// mode, and the challenge's spectrum decreases to 10⁻¹⁴ on the largest grids.
const ROUNDING: f64 = 1e-24;

fn psd(writer: &FigureWriter, results: &Results) -> Result<Option<Markup>> {
    let points = &results.surface.psd;
    // Modes outside the spectrum have only rounding errors.
    let largest = points.iter().map(|p| p.realised).fold(0.0, f64::max);
    let present = points.iter().filter(|p| p.realised > ROUNDING * largest);
    let (q, c) = density_units(writer);
    let curve = |label: &str, style, points: Vec<(f64, f64)>| Curve { label: label.into(), style, points };
    let curves = vec![
        curve("realised", REALISED, present.map(|p| (p.mode * q, p.realised * c)).collect()),
        curve("expected", EXPECTED, points.iter().filter_map(|p| Some((p.mode * q, p.expected? * c))).collect()),
    ];
    let plot = Plot::new((Axis::Log, Axis::Log), DENSITY_LABELS, curves);
    writer.curves("psd", &plot)
}

/// Axis labels of the power spectral density.
pub(super) const DENSITY_LABELS: (&str, &str) = ("wave number q (1/m)", "C(q) (m⁴)");

/// Factors from mode number and power per mode (units of L²) to q in 1/m and C(q) in m⁴. C(q) = A |h̃(q)|² is the
/// two-dimensional power spectral density, with the mean square height as the integral of C over d²q/(2π)²
/// (Jacobs, Junge, Pastewka, Surf. Topogr.: Metrol. Prop. 5 (2017) 013001); A is the area of the cell.
pub(super) fn density_units(writer: &FigureWriter) -> (f64, f64) {
    let length = writer.scales.length_m;
    (std::f64::consts::TAU / length, length.powi(4) * writer.aspect)
}

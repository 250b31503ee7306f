//! Surface section: statistics, height map, power spectrum.

use super::figures::symbol;
use super::prelude::*;
use super::{profile, relief};
use crate::report::picture::LONGEST_SIDE;
use asperity_grid::error::Error;

pub(super) fn section(writer: &FigureWriter, results: &Results) -> Result<Markup> {
    let surface = &results.surface;
    let (nx, ny) = (surface.nx, surface.ny);
    let flat = profile::is_profile(ny);
    let heights = surface.heights.as_deref();
    let map = heights.filter(|_| !flat).map(|file| map(writer, file, [nx, ny])).transpose()?;
    let line = heights.filter(|_| flat).map(|file| profile::heights(writer, file)).transpose()?;
    let [length_x, length_y] = [1.0, surface.aspect].map(|l| si_given(l * writer.scales.length_m, "m"));
    let caption = html! { "Two-dimensional power spectral density C(q), mean over directions"
    @if surface.psd.iter().any(|p| p.expected.is_some()) { ", realised and prescribed" }
    ". Convention: C(q) = A |h̃(q)|² with the area A of the cell; the mean square "
    "height is the integral of C(q) over d²q/(2π)² (doi:10.1088/2051-672X/aa51f8)."
    @if !surface.periodic { " Computed under a Hann window, which affects the two lowest modes." } };
    Ok(html! {
        p { (capitalised(&surface.origin)) ", on " (count(nx)) " × " (count(ny)) " nodes over a " (if surface.periodic { "periodic cell" } else { "non-periodic area" }) " of " (length_x) " × "
            (length_y) ". Heights are measured from the lowest point; low points touch first." }
        @if !surface.statistics.is_empty() { (statistics(&surface.statistics)) }
        @if !surface.note.is_empty() { p.quiet { (surface.note) } }
        @if let Some(map) = map { (map) }
        (writer.figures(line.into_iter().chain([Figure::new("psd", caption, psd(writer, results, "expected"))]))?)
        @if !flat { @if let Some(relief) = relief::section(writer, results)? { (relief) } }
    })
}

/// Picture of the heights.
fn map(writer: &FigureWriter, file: &str, [nx, ny]: [usize; 2]) -> Result<Markup> {
    let heights = writer.load(file, LONGEST_SIDE, |h| h * writer.scales.length_m)?;
    // The map must have the shape stated in `results.json`.
    if (heights.nx, heights.ny) != (nx.div_ceil(heights.factor), ny.div_ceil(heights.factor)) {
        let found = format!("another shape than the {nx} × {ny} nodes of results.json");
        return Err(Error::format(writer.field(file)?, found, format!("[{ny}, {nx}]")));
    }
    let image = writer.heights(("heights", "height map, dark is low"), &heights)?;
    let factor = heights.factor;
    Ok(figure(
        panel("", image, ""),
        html! { "Height map; dark is low and touches first. x to the right, y up."
        @if factor > 1 { " Each picture element is the mean of " (factor) " × " (factor) " nodes." } },
    ))
}

/// What is expected, and how far the surface is from it, is known of a synthesised surface only.
fn statistics(list: &[SurfaceStatistic]) -> Markup {
    let known = list.iter().any(|s| s.expected.is_some());
    let coarse = list.iter().any(|s| s.expected_on_grid.is_some());
    let row = |s: &SurfaceStatistic| {
        let value = |v: f64, n: usize| format!("{} {}", significant(v, n), of_unit(&s.unit)).trim_end().to_string();
        let expected = |v: Option<f64>| or_dash(v.map(|v| value(v, 4)));
        let mut row = row![s.name, symbol(&s.symbol)];
        row.extend(known.then(|| expected(s.expected)));
        row.extend(coarse.then(|| expected(s.expected_on_grid)));
        row.extend(row![value(s.realised, 4)]);
        if known {
            row.extend(row![or_dash(s.band.map(|b| format!("± {}", value(b, 2)))), status(s)]);
        }
        row
    };
    let expected = match (known, coarse) {
        (_, true) => &["whole spectrum", "on this grid"][..],
        (true, false) => &["expected"],
        (false, false) => &[],
    };
    let realised = if known { &["realised", "band", "status"][..] } else { &["value"] };
    let head = [&["quantity", "symbol"], expected, realised].concat();
    html! {
        (table("words", &head, list.iter().map(row)))
        @if coarse {
            p.quiet { "Whole spectrum and on this grid are ensemble values: of all waves, and of those that this grid resolves. "
                "The grid leaves out what is shorter than two nodes, and with it much of gradient and curvature; the status "
                "is about the waves of this grid." }
        }
        @if known {
            p.quiet { @if !coarse { "Expected is the ensemble of the spectrum, all of which this grid resolves. " }
                "Realised is this surface. The band is two standard deviations of what a realisation may have: about one "
                "in twenty lies outside by chance." }
        }
    }
}

/// Deviation of a realised statistic from its expected value on the grid.
fn status(s: &SurfaceStatistic) -> Markup {
    match (s.expected_on_grid.or(s.expected), s.band) {
        (Some(expected), Some(band)) if (s.realised - expected).abs() <= band => "within the band".render(),
        (Some(_), Some(_)) => bad("outside the band"),
        (Some(expected), None) if expected != 0.0 => {
            let deviation = (s.realised - expected).abs() / expected.abs();
            // Normalised statistics deviate only by rounding.
            if deviation < 1e-9 {
                "met".render()
            } else {
                html! { (significant(100.0 * deviation, 2)) " % off" }
            }
        }
        _ => "–".render(),
    }
}

/// Power over the largest power, times the number of nodes, below which a mode is a rounding error: such modes would stretch the
/// axis over many empty decades. Heights of a file in single precision are wrong by ε = 2⁻²⁴ of their value, which is ε²⟨h²⟩/N for
/// each of N modes; the largest mode has more than 10⁻⁴ of ⟨h²⟩. A self-affine spectrum, whose power falls with the fourth power of q
/// at most, is above it on any grid of up to 10¹¹ nodes.
const ROUNDING: f64 = 1e4 * (f32::EPSILON as f64 / 2.0) * (f32::EPSILON as f64 / 2.0);

/// The power spectral density, realised and prescribed.
///
/// C(q) = A |h̃(q)|² is the two-dimensional power spectral density, with the mean square height as the integral of C over
/// d²q/(2π)² (Jacobs, Junge, Pastewka, Surf. Topogr.: Metrol. Prop. 5 (2017) 013001); A is the area of the cell.
pub(super) fn psd(writer: &FigureWriter, results: &Results, prescribed: &str) -> Plot {
    let points = &results.surface.psd;
    // Modes outside the spectrum have only rounding errors.
    let largest = points.iter().map(|p| p.realised).fold(0.0, f64::max);
    let floor = ROUNDING / (results.surface.nx * results.surface.ny) as f64 * largest;
    let present = points.iter().filter(|p| p.realised > floor);
    let length = writer.scales.length_m;
    // From mode number and power per mode (units of L²) to q in 1/m and C(q) in m⁴.
    let (q, c) = (std::f64::consts::TAU / length, length.powi(4) * writer.aspect);
    let curves = vec![
        Curve::new("realised", REALISED, present.map(|p| (p.mode * q, p.realised * c))),
        Curve::new(prescribed, EXPECTED, points.iter().filter_map(|p| Some((p.mode * q, p.expected? * c)))),
    ];
    Plot::new(log("wave number q (1/m)"), log("C(q) (m⁴)"), curves)
}

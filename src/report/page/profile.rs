//! A surface of one line of nodes, which is uniform along y: its fields are curves along x, as maps they would be slivers.

use super::distributions::LOOKS;
use super::prelude::*;
use crate::report::picture::LONGEST_SIDE;

/// Whether a grid of `ny` lines is a profile.
pub(super) fn is_profile(ny: usize) -> bool {
    ny == 1
}

/// Values of a stored field along x, and the SI prefix that suits them.
struct Lines {
    values: Vec<Vec<f64>>,
    prefix: &'static str,
}

impl Lines {
    /// `unit`: that of the field, m or Pa.
    fn load<'a>(writer: &FigureWriter, files: impl Iterator<Item = &'a str>, unit: f64) -> Result<Self> {
        let line = |file| Ok(writer.load(file, LONGEST_SIDE, |v| v * unit)?.values);
        Ok(Lines::scaled(files.map(line).collect::<Result<Vec<_>>>()?))
    }

    fn scaled(mut values: Vec<Vec<f64>>) -> Self {
        let (scale, prefix) = si_scale(values.iter().flatten().fold(0.0, |most: f64, v| most.max(v.abs())));
        values.iter_mut().flatten().for_each(|v| *v /= scale);
        Lines { values, prefix }
    }

    /// `looks`: label and style of each line.
    fn plot(&self, writer: &FigureWriter, (label, unit): (&str, &str), looks: Vec<(String, Style)>) -> Plot {
        let (scale, prefix) = si_scale(writer.scales.length_m);
        let length = writer.scales.length_m / scale;
        let curve = |(values, (label, look)): (&Vec<f64>, (String, Style))| {
            let at = |i: usize| (i as f64 + 0.5) / values.len() as f64 * length;
            Curve::new(label, look, values.iter().enumerate().map(|(i, v)| (at(i), *v)))
        };
        let curves = self.values.iter().zip(looks).map(curve).collect();
        let y = linear(format!("{label} ({}{unit})", self.prefix));
        Plot { proportion: 0.42, ..Plot::new(linear(format!("x ({prefix}m)")), y, curves) }
    }
}

/// The heights, low points touching first.
pub(super) fn heights(writer: &FigureWriter, file: &str) -> Result<Figure> {
    let lines = Lines::load(writer, [file].into_iter(), writer.scales.length_m)?;
    let plot = lines.plot(writer, ("height", "m"), vec![(String::new(), LOOKS[0])]);
    Ok(Figure::new("heights", "The profile, which is uniform along y; low points touch first.", plot))
}

/// Both surfaces at the highest load, in the frame of the rough one, for the first screen; `None` without its maps.
pub(super) fn surfaces(writer: &FigureWriter, results: &Results) -> Result<Option<Markup>> {
    let states = results.continuum.iter().flat_map(|c| &c.states);
    let stored = states.filter(|s| s.gap_file().is_some() && s.stop != Stop::Detached);
    let highest = stored.rev().max_by(|a, b| a.p_star.total_cmp(&b.p_star));
    let (Some(state), Some(heights)) = (highest, results.surface.heights.as_deref()) else { return Ok(None) };
    let Some(gap) = state.gap_file() else { return Ok(None) };
    let [rough, gap] = [heights, gap].map(|file| writer.load(file, LONGEST_SIDE, |v| v * writer.scales.length_m));
    let (rough, gap) = (rough?, gap?);
    let body = rough.values.iter().zip(&gap.values).map(|(h, g)| h - g).collect();
    let at = writer.loads.label(state.p_star);
    let looks = vec![("rough surface".to_string(), LABORATORY.without_marker()), (format!("body at {at}"), LOOKS[1])];
    let plot = Lines::scaled(vec![rough.values, body]).plot(writer, ("height", "m"), looks);
    writer.curves("first-profile", &plot)
}

/// Gaps and stresses of some loads.
pub(super) fn fields(writer: &FigureWriter, states: &[&State]) -> Result<Markup> {
    let looks = |has: &dyn Fn(&State) -> bool| {
        let own = states.iter().filter(|s| has(s));
        own.zip(LOOKS).map(|(s, look)| (writer.loads.label(s.p_star) + back(s), look)).collect()
    };
    let gaps = Lines::load(writer, states.iter().filter_map(|s| s.gap_file()), writer.scales.length_m)?;
    let stresses = Lines::load(writer, states.iter().filter_map(|s| s.stress_file()), writer.scales.modulus_pa)?;
    writer.figures([
        Figure::new(
            "gap-profile",
            "Gap along x; zero in contact.",
            gaps.plot(writer, ("gap", "m"), looks(&|s| s.gap_file().is_some())),
        ),
        Figure::new(
            "stress-profile",
            "Normal stress along x, compression positive.",
            stresses.plot(writer, ("normal stress", "Pa"), looks(&|s| s.stress_file().is_some())),
        ),
    ])
}

//! A surface of one line of nodes, which is uniform along y: its fields are curves along x, as maps they would be slivers.

use super::distributions::LOOKS;
use super::prelude::*;

/// Nodes that are all drawn. Of more the lowest and the highest of each group are, so that no extreme is lost.
const DRAWN: usize = 4096;

/// Whether a grid of `ny` lines is a profile.
pub(super) fn is_profile(ny: usize) -> bool {
    ny == 1
}

/// Values of a stored field at all nodes along x, and the SI prefix that suits them.
struct Lines {
    values: Vec<Vec<f64>>,
    prefix: &'static str,
}

/// Nodes, counted from 0, and values of a curve with at most [`DRAWN`] points.
fn drawn(values: &[f64]) -> Vec<(usize, f64)> {
    let group = if values.len() > DRAWN { (2 * values.len()).div_ceil(DRAWN) } else { 1 };
    let extremes = |(first, group): (usize, &[f64])| {
        let at = |i: usize| (first + i, group[i]);
        let by = |a: &usize, b: &usize| group[*a].total_cmp(&group[*b]);
        let all = 0..group.len();
        let (low, high) = (all.clone().min_by(by).expect("not empty"), all.max_by(by).expect("not empty"));
        let mut ends = vec![low.min(high), low.max(high)];
        ends.dedup();
        ends.into_iter().map(at).collect::<Vec<_>>()
    };
    values.chunks(group).enumerate().map(|(i, chunk)| (i * group, chunk)).flat_map(extremes).collect()
}

impl Lines {
    /// `unit`: that of the field, m or Pa.
    fn load<'a>(writer: &FigureWriter, files: impl Iterator<Item = &'a str>, unit: f64) -> Result<Self> {
        let line = |file| Ok(writer.load(file, usize::MAX, |v| v * unit)?.values);
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
            let at = |i: usize| i as f64 / values.len() as f64 * length;
            Curve::new(label, look, drawn(values).into_iter().map(|(i, v)| (at(i), v)))
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
    let [rough, gap] = [heights, gap].map(|file| writer.load(file, usize::MAX, |v| v * writer.scales.length_m));
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_of_many_nodes_keep_every_extreme() {
        let short: Vec<f64> = (0..DRAWN).map(|i| (i * i % 37) as f64).collect();
        assert_eq!(drawn(&short), short.iter().copied().enumerate().collect::<Vec<_>>());
        let mut long: Vec<f64> = (0..50_001).map(|i| f64::from(i).sin()).collect();
        for (i, value) in [(0, 5.0), (7_777, -9.0), (50_000, 7.0)] {
            long[i] = value;
        }
        let found = drawn(&long);
        assert!(found.len() <= DRAWN && found.is_sorted_by(|a, b| a.0 < b.0));
        assert!(found.iter().all(|&(i, v)| long[i] == v));
        assert!([(0, 5.0), (7_777, -9.0), (50_000, 7.0)].iter().all(|extreme| found.contains(extreme)));
    }
}

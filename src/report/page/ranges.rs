//! Contact area and mean gap against the range of adhesion.

use crate::load::Branch;
use maud::{Markup, html};

use super::distributions::LOOKS;
use super::figures::{FigureWriter, figure, numbers, text};
use crate::error::Result;
use crate::interface::tabor;
use crate::record::results::{CURVATURE_RADIUS, ContinuumResults, Results, StateResults};
use crate::report::number::{percent, si, significant, trimmed};
use crate::report::plot::{Axis, Curve, Marker, Plot, Style};

pub(super) fn section(writer: &FigureWriter, results: &Results) -> Result<Markup> {
    let Some(tabor) = Tabor::of(results) else { return Ok(html! {}) };
    let mut solved: Vec<(f64, &ContinuumResults)> = results
        .continuum
        .iter()
        .chain(&results.other_ranges)
        .filter_map(|c| Some((tabor.of_range(c.range?.used), c)))
        .collect();
    solved.sort_by(|a, b| a.0.total_cmp(&b.0));
    // Loads are matched by index: with prescribed mean gaps the pressures differ between ranges.
    let n = results.other_ranges[0].states.len();
    let shown: Vec<usize> = if n <= LOOKS.len() {
        (0..n).collect()
    } else {
        (0..LOOKS.len()).map(|i| i * (n - 1) / (LOOKS.len() - 1)).collect()
    };
    let imposed = |k: usize| {
        let of = |c: &&ContinuumResults| c.states.get(k).map(|s| s.numbers.p_star);
        let mut known = solved.iter().map(|(_, c)| *c).collect::<Vec<_>>().into_iter();
        let first = known.next().as_ref().and_then(of);
        known.all(|c| of(&c) == first).then_some(first).flatten()
    };
    let curves = |of: &dyn Fn(&StateResults) -> f64| -> Vec<Curve> {
        let curve = |(look, &k): (&Style, &usize)| Curve {
            label: imposed(k).map_or_else(|| format!("load {}", k + 1), |p| format!("p* = {}", trimmed(p, 4))),
            style: Style { marker: Marker::Disc, ..*look },
            points: solved.iter().filter_map(|(mu, c)| Some((*mu, of(c.states.get(k)?)))).collect(),
        };
        LOOKS.iter().zip(&shown).map(curve).collect()
    };
    let um = writer.scales.length_m * 1e6;
    let mut figures = Vec::new();
    for (name, label, curves, caption) in [
        (
            "area-of-range",
            "relative contact area",
            curves(&|s| s.numbers.contact_area),
            "Contact area against Tabor’s parameter: short ranges to the right.",
        ),
        ("mean-gap-of-range", "mean gap (µm)", curves(&|s| s.mean_gap * um), "Mean gap against Tabor’s parameter."),
    ] {
        let plot = Plot::new((Axis::Log, Axis::Log), ("Tabor parameter", label), curves);
        figures.extend(writer.curves(name, &plot)?.map(|c| figure(c, html! { (caption) })));
    }
    let rows = solved
        .iter()
        .flat_map(|(mu, c)| {
            let range = c.range.map_or(0.0, |r| r.used);
            let resolved = c.range.map_or(0.0, |r| r.resolution_used);
            c.states.iter().filter(|s| s.branch == Branch::Loading).map(move |s| {
                vec![
                    text(si(range * writer.scales.length_m, "m", 4)),
                    text(significant(*mu, 3)),
                    text(significant(resolved, 3)),
                    text(trimmed(s.numbers.p_star, 4)),
                    text(percent(s.numbers.contact_area)),
                    text(si(s.mean_gap * writer.scales.length_m, "m", 4)),
                ]
            })
        })
        .collect();
    Ok(html! {
        p { "The loading branch with the same work of adhesion and other ranges. Tabor’s parameter is "
            "(R_c γ²/(E*² ρ³))^1/3 with the surface’s curvature radius R_c, " (si(tabor.radius * writer.scales.length_m, "m", 4))
            ", and the range used on the grid." }
        @for f in &figures { (f) }
        (numbers(&["range", "Tabor parameter", "resolution", "p*", "contact area", "mean gap"], rows))
    })
}

struct Tabor {
    /// R_c and γ, units of L and E* L.
    radius: f64,
    gamma: f64,
}

impl Tabor {
    fn of(results: &Results) -> Option<Self> {
        let gamma = results.other_ranges.first()?.range?.gamma;
        let radius = results.surface.statistic(CURVATURE_RADIUS)?;
        Some(Tabor { radius: radius.realised * 1e-9 / results.scales.length_m, gamma })
    }

    fn of_range(&self, range: f64) -> f64 {
        tabor(self.radius, self.gamma, range)
    }
}

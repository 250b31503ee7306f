//! Contact area and mean gap against the range of adhesion.

use super::distributions::LOOKS;
use super::prelude::*;
use asperity_contact::interface::tabor;

pub(super) fn section(writer: &FigureWriter, results: &Results) -> Result<Markup> {
    let Some(tabor) = Tabor::of(results) else { return Ok(html! {}) };
    let all = results.continuum.iter().chain(&results.other_ranges);
    let mut solved: Vec<(f64, &ContinuumResults)> =
        all.filter_map(|c| Some((tabor.of_range(c.range?.used), c))).collect();
    solved.sort_by(|a, b| a.0.total_cmp(&b.0));
    // Loads are matched by index: with prescribed mean gaps the pressures differ between ranges.
    let label = |k: usize| match distinct(solved.iter().map(|(_, c)| c.states.get(k).map(|s| s.p_star)))[..] {
        [Some(imposed)] => writer.loads.label(imposed),
        _ => format!("load {}", k + 1),
    };
    let shown = spread(results.other_ranges[0].states.len(), LOOKS.len());
    let curves = |quantity: &dyn Fn(&State) -> f64| -> Vec<Curve> {
        let points = |k: usize| solved.iter().filter_map(move |(mu, c)| Some((*mu, quantity(c.states.get(k)?))));
        let look = |look: &Style| Style { marker: Marker::Disc, ..*look };
        LOOKS.iter().zip(&shown).map(|(l, &k)| Curve::new(label(k), look(l), points(k))).collect()
    };
    let plot =
        |label: &str, quantity: &dyn Fn(&State) -> f64| Plot::new(log("Tabor parameter"), log(label), curves(quantity));
    let figures = [
        Figure::new(
            "area-of-range",
            "Contact area against Tabor’s parameter: short ranges to the right.",
            plot("relative contact area", &|s| s.contact_area),
        ),
        Figure::new(
            "mean-gap-of-range",
            "Mean gap against Tabor’s parameter.",
            plot("mean gap (µm)", &|s| s.mean_gap.unwrap_or(f64::NAN) * UM),
        ),
    ];
    let loading = solved.iter().flat_map(|(mu, c)| {
        let (range, resolved) = c.range.map_or((0.0, 0.0), |r| (r.used, r.resolution_used));
        c.states.iter().filter(|s| s.branch == Branch::Loading).map(move |s| (mu, range, resolved, s))
    });
    Ok(html! {
        p { "The loading branch with the same work of adhesion and other ranges. Tabor’s parameter is "
            "(R_c γ²/(E*² ρ³))^1/3 with the surface’s curvature radius R_c, " (length(tabor.radius, 4))
            ", and the range used on the grid." }
        (writer.figures(figures)?)
        (columns!("numbers", loading, |(mu, range, resolved, s)| {
            "range" => length(range, 4),
            "Tabor parameter" => significant(*mu, 3),
            "resolution" => significant(resolved, 3),
            writer.loads.head() => writer.loads.value(s.p_star),
            "contact area" => percent(s.contact_area),
            "mean gap" => or_dash(s.mean_gap.map(|g| length(g, 4))),
        }))
    })
}

struct Tabor {
    /// R_c, m, and γ/E*, m.
    radius: f64,
    gamma: f64,
}

impl Tabor {
    fn of(results: &Results) -> Option<Self> {
        let gamma = results.other_ranges.first()?.range?.gamma;
        let radius = results.surface.statistic(CURVATURE_RADIUS)?;
        Some(Tabor { radius: radius.realised * 1e-9, gamma: gamma / results.scales.modulus_pa })
    }

    fn of_range(&self, range: f64) -> f64 {
        tabor(self.radius, self.gamma, range)
    }
}

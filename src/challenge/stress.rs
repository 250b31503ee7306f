//! Interfacial stresses and their distribution.

use super::{ChallengeData, Statement, reference, share_below};
use crate::record::acceptance::AcceptanceCheck;
use asperity_contact::observe::{Distribution, effective_clusters};
use asperity_contact::state::{Observed, State};
use libm::erf;

/// Error of nodal stresses at a residual of 1e-4 of the pressure, over γ/ρ.
const TENSION_TOLERANCE: f64 = 1e-2;
/// Tolerance for "O(10 %)" between two solvers.
const CLOSE: f64 = 0.1;
/// Accepted share of the contact under tension, %. In JKR theory the share is s² = (a0/a)^(3/2)/3 with a0 the radius at zero
/// load: 2/3 at pull-off, where a³ = a0³/4, and 1/10 for a spot with a³ = 11 a0³. Spots under load and some near pull-off
/// lie between.
const TENSILE_SHARE: [f64; 2] = [10.0, 200.0 / 3.0];

pub(super) fn assess(data: &ChallengeData) -> Vec<AcceptanceCheck> {
    let pull = data.adhesive_stress();
    let observed = data.observed();
    // The histogram starts at the largest tension. At loads above the reference load the residual, proportional to the
    // pressure, exceeds the tension.
    let tension = observed.and_then(|[adhesive, _]| adhesive.stress.as_ref()?.edges.first().copied());
    let contact_stress = observed.and_then(|[a, b]| Some([a.contact_stress.as_ref()?, b.contact_stress.as_ref()?]));
    let reference = reference(data.plain);
    let form = reference.zip(contact_stress).map(|(s, [_, plain])| persson_distance(s.pressure, plain));
    // Stresses within a cluster are correlated: the independent ones are as many as equal clusters.
    let independent =
        observed.and_then(|[_, plain]| effective_clusters(&plain.cluster_area, data.counted_area(plain)?));
    let form_error = form.zip(independent).map(|([_, fraction], n)| (fraction * (1.0 - fraction) / n).sqrt());
    let second =
        data.results.cross_check.as_ref().and_then(|c| c.states.first()?.observed.as_ref()?.contact_stress.as_ref());
    let difference = second.zip(contact_stress).map(|(second, [_, plain])| distance(second, plain));
    // The clusters are independent, their nodes are not.
    let clusters = super::reference(data.adhesive).and_then(|s| s.clusters).filter(|n| *n > 0);
    let s24 =
        Statement::new("S24", "Pr(σ) of contact without adhesion, two methods: largest difference of fractions", "1");
    vec![
        data.at_range(Statement::new("S14", "largest tension at the reference load, over γ/ρ", "1").within(
            tension.map(|t| -t / pull),
            1.0,
            [0.0, 1.0 + TENSION_TOLERANCE],
            "a bound: the wall is purely repulsive",
        ).with_error(super::reference(data.adhesive).and_then(|s| Some(s.residual? * s.pressure / pull)))),
        data.of_roughness(
            Statement::new(
                "S22",
                "Pr(σ) of contact without adhesion against two Gaussians: largest difference of fractions",
                "1",
            ),
            |item| {
                item.within(
                    form.map(|[difference, _]| difference),
                    0.0,
                    [0.0, CLOSE],
                    "Persson's form with the variance that gives the area found; limit as for S24",
                )
                .with_error(form_error)
            },
        ),
        data.of_adhesion(
            Statement::new("S23a", "contact under tension, of all contact, with adhesion", "%"),
            |item| {
                let fraction = super::reference(data.adhesive).and_then(under_tension);
                let error = fraction.zip(clusters).map(|(f, n)| (f * (100.0 - f) / n as f64).sqrt());
                item.within(
                    fraction,
                    100.0 / 3.0,
                    TENSILE_SHARE,
                    "\"reaching into tension\"; limits from JKR spots at pull-off and at eleven times the cubed radius of zero load",
                )
                .with_error(error)
            },
        ),
        data.of_adhesion(
            Statement::new("S23b", "Pr(σ) out of contact, just below zero over half of the largest tension", "1"),
            |item| {
                let peak = observed.and_then(|[adhesive, _]| peak(adhesive));
                // Large tension is at the edges of the clusters, as the smallest gaps of S21b.
                let error = peak.zip(clusters).map(|(ratio, n)| ratio * (2.0 / n as f64).sqrt());
                item.at_least(peak, 1.0, "a peak at σ → 0⁻ from the gap").with_error(error)
            },
        ),
        match second {
            Some(_) => s24.within(difference, 0.0, [0.0, CLOSE], "\"O(10 %)\""),
            None => s24.not_assessed("one method ran"),
        },
    ]
}

fn under_tension(s: &State) -> Option<f64> {
    let (compressive, contact) = (s.contact_nodes_compressive?, s.observed.as_ref()?.gap.as_ref()?.delta);
    (contact > 0.0).then(|| 100.0 * (1.0 - compressive / contact))
}

/// Density of tension outside contact in the last bin below zero stress, over that at half of the largest tension.
fn peak(o: &Observed) -> Option<f64> {
    let (stress, contact) = (o.stress.as_ref()?, o.contact_stress.as_ref()?);
    let edges = &stress.edges;
    let outside = |i: usize| (stress.fractions[i] - contact.fractions[i]) / (edges[i + 1] - edges[i]);
    let bin = |x: f64| (0..edges.len() - 1).find(|&i| edges[i + 1] >= x);
    // The last bin without compression.
    let zero = edges.iter().rposition(|e| *e <= 0.0)?.checked_sub(1)?;
    let half = bin(0.5 * edges[0])?;
    (half < zero && outside(half) > 0.0).then(|| outside(zero) / outside(half))
}

/// Largest difference of two cumulative distributions, each normalised to one.
fn distance(a: &Distribution, b: &Distribution) -> f64 {
    let total = |d: &Distribution| d.fractions.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    let difference = |x: &f64| (share_below(a, *x) / total(a) - share_below(b, *x) / total(b)).abs();
    a.edges.iter().chain(&b.edges).map(difference).fold(0.0, f64::max)
}

/// Largest difference from Persson's Pr(σ), a Gaussian around the pressure minus its mirror image, with the variance
/// that gives the contact area found; and the fraction of the contact below the stress where the difference is largest.
fn persson_distance(pressure: f64, contact: &Distribution) -> [f64; 2] {
    let area: f64 = contact.fractions.iter().sum();
    // erf(t) = area, and t = p/√(2v).
    let (mut low, mut high) = (0.0, 6.0);
    for _ in 0..80 {
        let t = 0.5 * (low + high);
        if erf(t) < area { low = t } else { high = t }
    }
    let width = pressure / low.max(f64::MIN_POSITIVE);
    let below = |s: f64| {
        let whole = erf(pressure / width);
        0.5 * (erf((s - pressure) / width) + whole) - 0.5 * (erf((s + pressure) / width) - whole)
    };
    let area = area.max(f64::MIN_POSITIVE);
    let difference = |x: &f64| {
        let fraction = share_below(contact, *x);
        [(fraction - below(x.max(0.0))).abs() / area, fraction / area]
    };
    contact
        .edges
        .iter()
        .map(difference)
        .fold([0.0; 2], |most, candidate| if candidate[0] > most[0] { candidate } else { most })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(density: impl Fn(f64) -> f64) -> Distribution {
        let edges: Vec<f64> = (0..=400).map(|i| f64::from(i) * 0.01).collect();
        let fractions: Vec<f64> = edges.windows(2).map(|e| density(0.5 * (e[0] + e[1])) * 0.01).collect();
        let delta = 1.0 - fractions.iter().sum::<f64>();
        Distribution { edges, fractions, delta, below: 0.0, above: 0.0 }
    }

    #[test]
    fn perssons_form_is_its_own() {
        let (p, v) = (0.1, 0.25_f64);
        let gauss = |x: f64| (-x * x / (2.0 * v)).exp() / (2.0 * std::f64::consts::PI * v).sqrt();
        let form = of(|s| gauss(s - p) - gauss(s + p));
        assert!(persson_distance(p, &form)[0] < 1e-3);
        let [apart, fraction] = persson_distance(p, &of(|s| if s < 0.2 { 0.5 } else { 0.0 }));
        assert!(apart > 0.3 && fraction > 0.99, "{apart} {fraction}");
    }

    #[test]
    fn equal_shapes_are_close_whatever_their_sizes() {
        let (a, b) = (of(|s| (-s).exp() * 0.1), of(|s| (-s).exp() * 0.2));
        assert!(distance(&a, &b) < 1e-12);
        assert!(distance(&a, &of(|s| (-3.0 * s).exp())) > 0.2);
    }
}

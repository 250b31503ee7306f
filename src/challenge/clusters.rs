//! Sizes of contact clusters.

use super::{ChallengeData, LineFit, SIZE_EXPONENT, Statement, line};
use crate::record::acceptance::AcceptanceCheck;
use asperity_contact::observe::{median_counting_error, share_counting_error};
use asperity_contact::state::Observed;

/// Square micrometres of a square metre.
const UM2: f64 = 1e12;
/// Smallest cluster of the fit, nodes; sizes below depend on the discretisation.
const SMALLEST_NODES: f64 = 16.0;
/// Smallest number of clusters in a bin of the fit.
const FEWEST: f64 = 5.0;
/// Area of clusters that contain a fifth of the contact, µm².
const FIFTH_UM2: f64 = 1.0;
/// Largest node spacing for the most probable cluster, µm.
const FINE_UM: f64 = 5e-3;

pub(super) fn assess(data: &ChallengeData) -> Vec<AcceptanceCheck> {
    let adhesive = data.observed().map(|[adhesive, _]| adhesive);
    let node_um2 = data.length_um * data.length_um / (data.adhesive.nx * data.adhesive.ny) as f64;
    let size_exponent = adhesive.and_then(|o| size_exponent(o, SMALLEST_NODES * node_um2 / UM2));
    let median = adhesive.and_then(|o| o.median_cluster_area).map(|a| a * UM2);
    let fifth = adhesive
        .map(|o| o.cluster_area.iter().take_while(|[a, _]| a * UM2 <= FIFTH_UM2).last().map_or(0.0, |[_, s]| *s));
    let compressive = adhesive.and_then(|o| o.compressive?.median_cluster_area).map(|a| a * UM2);
    let spacing = node_um2.sqrt();
    let s16 = Statement::new("S16", "most probable cluster", "nm²");
    vec![
        data.of_both(Statement::new("S15", "exponent of Pr(a), falling", "1"), |item| {
            item.near(
                size_exponent.as_ref().map(|l| -l.slope),
                -SIZE_EXPONENT,
                0.15,
                "from 16 nodes to the median cluster, with adhesion, at the reference load",
            )
            .with_error(size_exponent.as_ref().map(|l| l.slope_error))
        }),
        if spacing > FINE_UM {
            s16.not_assessed(format!(
                "needs nodes {:.0} nm apart, these are {:.0} nm; the paper names 100 and 1000 nm²",
                1e3 * FINE_UM,
                1e3 * spacing
            ))
        } else {
            let largest = adhesive.and_then(|o| most_probable(&o.cluster_density));
            data.of_both(s16, |item| {
                item.within(
                    largest.map(|[a, _]| a * UM2 * 1e6),
                    316.0,
                    [100.0, 1000.0],
                    "the paper names 100 and 1000 nm²",
                )
                .with_error(largest.map(|[_, error]| error * UM2 * 1e6))
            })
        },
        data.of_both(
            Statement::new("S17a", "median cluster: half of the contact is in clusters up to it", "µm²"),
            |item| {
                let error = adhesive.zip(median).and_then(|(o, m)| {
                    Some(median_counting_error(&o.cluster_area, data.counted_area(o)?, m / UM2)? * UM2)
                });
                item.within(median, 3.0, [2.0, 4.5], "a factor of 1.5").with_error(error)
            },
        ),
        data.of_both(Statement::new("S17b", "contact in clusters up to 1 µm²", "1"), |item| {
            let error =
                adhesive.and_then(|o| share_counting_error(&o.cluster_area, data.counted_area(o)?, FIFTH_UM2 / UM2));
            item.near(fifth, 0.2, 0.07, "\"20 %\", with adhesion, at the reference load").with_error(error)
        }),
        data.of_both(Statement::new("S18", "median cluster where contact is compression", "µm²"), |item| {
            let error = adhesive.and_then(|o| o.compressive?.median_cluster_area_error).map(|e| e * UM2);
            item.within(compressive, 1.0, [0.5, 2.0], "a third of the other, to a factor of two").with_error(error)
        }),
    ]
}

/// Line of the number density of clusters in logarithms, fitted from the area `smallest_area` (m²) to the
/// median one.
fn size_exponent(o: &Observed, smallest_area: f64) -> Option<LineFit> {
    let largest = o.median_cluster_area?;
    let fits = |[a, density, n]: &&[f64; 3]| (smallest_area..=largest).contains(a) && *n >= FEWEST && *density > 0.0;
    let points: Vec<(f64, f64)> = o.cluster_density.iter().filter(fits).map(|[a, d, _]| (a.ln(), d.ln())).collect();
    line(&points)
}

/// The most probable cluster area and its error: half the range of the bins whose density is that of the most probable
/// one within the counting errors of both, and half a bin.
fn most_probable(density: &[[f64; 3]]) -> Option<[f64; 2]> {
    let densest = density.iter().max_by(|a, b| a[1].total_cmp(&b[1]))?;
    let error = |bin: &[f64; 3]| bin[1] / bin[2].sqrt();
    let alike = |bin: &&[f64; 3]| densest[1] - bin[1] <= error(densest).hypot(error(bin));
    let areas = || density.iter().filter(alike).map(|[a, ..]| *a);
    let (smallest, largest) = (areas().fold(densest[0], f64::min), areas().fold(densest[0], f64::max));
    let next = density.iter().map(|[a, ..]| *a).filter(|a| *a > densest[0]).fold(f64::INFINITY, f64::min);
    let bin = if next.is_finite() { next - densest[0] } else { 0.0 };
    Some([densest[0], 0.5 * (largest - smallest + bin)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_within_the_counting_error_count_for_the_most_probable_cluster() {
        // Densities 8 ± 2, 10 ± 1 and 2 ± 1: the first is as probable as the second, the third is not.
        let actual = most_probable(&[[1.0, 8.0, 16.0], [2.0, 10.0, 100.0], [4.0, 2.0, 4.0]]);
        assert_eq!(actual, Some([2.0, 0.5 * (1.0 + 2.0)]));
        assert_eq!(most_probable(&[[1.0, 3.0, 100.0], [2.0, 10.0, 100.0], [4.0, 2.0, 4.0]]), Some([2.0, 1.0]));
        assert_eq!(most_probable(&[]), None);
    }
}

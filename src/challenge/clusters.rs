//! Sizes of contact clusters.

use super::{ChallengeData, SIZE_EXPONENT, Statement, line};
use crate::record::acceptance::AcceptanceCheck;
use crate::record::results::Observed;

/// Smallest cluster of the fit, nodes; sizes below depend on the discretisation.
const SMALLEST_NODES: f64 = 16.0;
/// Smallest number of clusters in a bin of the fit.
const FEWEST: f64 = 5.0;
/// Area of clusters that contain a fifth of the contact, µm².
const FIFTH_UM2: f64 = 1.0;
/// Largest node spacing for the most probable cluster, µm.
const FINE_UM: f64 = 5e-3;

pub(super) fn assess(data: &ChallengeData) -> Vec<AcceptanceCheck> {
    let um2 = data.length_um * data.length_um;
    let with = data.observed().map(|[with, _]| with);
    let node_um2 = um2 / (data.adhesive.nx * data.adhesive.ny) as f64;
    let size_exponent = with.and_then(|o| size_exponent(o, SMALLEST_NODES * node_um2 / um2));
    let median = with.and_then(|o| o.median_cluster_area).map(|a| a * um2);
    let fifth =
        with.map(|o| o.patch_area.iter().take_while(|[a, _]| a * um2 <= FIFTH_UM2).last().map_or(0.0, |[_, s]| *s));
    let compressive = with.and_then(|o| o.compressive?.median_cluster_area).map(|a| a * um2);
    let spacing = node_um2.sqrt();
    let s16 = Statement::new("S16", "most probable cluster", "nm²");
    vec![
        data.of_both(Statement::new("S15", "size_exponent of Pr(a), falling", "1"), |item| {
            item.near(
                size_exponent,
                -SIZE_EXPONENT,
                0.15,
                "from 16 nodes to the median cluster, with adhesion, at the reference load",
            )
        }),
        if spacing > FINE_UM {
            s16.not_assessed(format!(
                "needs nodes {:.0} nm apart, these are {:.0} nm; the paper names 100 and 1000 nm²",
                1e3 * FINE_UM,
                1e3 * spacing
            ))
        } else {
            let most = with.and_then(|o| o.patch_density.iter().max_by(|a, b| a[1].total_cmp(&b[1])));
            data.of_both(s16, |item| {
                item.within(
                    most.map(|[a, ..]| a * um2 * 1e6),
                    316.0,
                    [100.0, 1000.0],
                    "the paper names 100 and 1000 nm²",
                )
            })
        },
        data.of_both(
            Statement::new("S17a", "median cluster: half of the contact is in clusters up to it", "µm²"),
            |item| item.within(median, 3.0, [2.0, 4.5], "a factor of 1.5"),
        ),
        data.of_both(Statement::new("S17b", "contact in clusters up to 1 µm²", "1"), |item| {
            item.near(fifth, 0.2, 0.07, "\"20 %\", with adhesion, at the reference load")
        }),
        data.of_both(Statement::new("S18", "median cluster where contact is compression", "µm²"), |item| {
            item.within(compressive, 1.0, [0.5, 2.0], "a third of the other, to a factor of two")
        }),
    ]
}

/// Negative size_exponent of the number density of clusters, fitted from the area `smallest_area` (units of L²) to the
/// median one.
fn size_exponent(o: &Observed, smallest_area: f64) -> Option<f64> {
    let largest = o.median_cluster_area?;
    let fits = |[a, density, n]: &&[f64; 3]| (smallest_area..=largest).contains(a) && *n >= FEWEST && *density > 0.0;
    let points: Vec<(f64, f64)> = o.patch_density.iter().filter(fits).map(|[a, d, _]| (a.ln(), d.ln())).collect();
    line(&points).map(|l| -l.0)
}

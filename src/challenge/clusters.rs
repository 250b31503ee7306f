//! Sizes of contact clusters.

use super::{ChallengeData, Line, SIZE_EXPONENT, Statement, line};
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
            |item| {
                let error = with.zip(median).and_then(|(o, m)| Some(median_error(o, m / um2)? * um2));
                item.within(median, 3.0, [2.0, 4.5], "a factor of 1.5").with_error(error)
            },
        ),
        data.of_both(Statement::new("S17b", "contact in clusters up to 1 µm²", "1"), |item| {
            let error = with.and_then(|o| share_error(o, FIFTH_UM2 / um2));
            item.near(fifth, 0.2, 0.07, "\"20 %\", with adhesion, at the reference load").with_error(error)
        }),
        data.of_both(Statement::new("S18", "median cluster where contact is compression", "µm²"), |item| {
            item.within(compressive, 1.0, [0.5, 2.0], "a third of the other, to a factor of two")
        }),
    ]
}

/// Line of the number density of clusters in logarithms, fitted from the area `smallest_area` (units of L²) to the
/// median one.
fn size_exponent(o: &Observed, smallest_area: f64) -> Option<Line> {
    let largest = o.median_cluster_area?;
    let fits = |[a, density, n]: &&[f64; 3]| (smallest_area..=largest).contains(a) && *n >= FEWEST && *density > 0.0;
    let points: Vec<(f64, f64)> = o.patch_density.iter().filter(fits).map(|[a, d, _]| (a.ln(), d.ln())).collect();
    line(&points)
}

/// Counting error of the share F of the contact in clusters up to an area: with independent clusters of area a,
/// δF² = (1 − F)² Σ a² below + F² Σ a² above, over the whole contact squared.
fn share_error(o: &Observed, area: f64) -> Option<f64> {
    // A cluster in a step of the cumulative share holds a/A of the contact area A, which the contact fraction is.
    let contact = o.gap.delta;
    let (mut below, mut above, mut before, mut share) = (0.0, 0.0, 0.0, 0.0);
    for [a, cumulative] in &o.patch_area {
        let squares = (cumulative - before) * a / contact;
        before = *cumulative;
        if *a <= area {
            (below, share) = (below + squares, *cumulative);
        } else {
            above += squares;
        }
    }
    // Without clusters on both sides there is nothing to count.
    (contact > 0.0 && below * above > 0.0).then(|| ((1.0_f64 - share).powi(2) * below + share * share * above).sqrt())
}

/// Counting error of the median cluster: half the range of areas whose cumulative share is within the error of one half.
fn median_error(o: &Observed, median: f64) -> Option<f64> {
    let error = share_error(o, median)?;
    let at = |share: f64| o.patch_area.iter().find(|[_, s]| *s >= share).map(|[a, _]| *a);
    Some(0.5 * (at((0.5 + error).min(1.0))? - at(0.5 - error)?))
}

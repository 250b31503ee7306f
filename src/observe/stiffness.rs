/// Contact stiffness with its error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stiffness {
    /// dp/dū, pressure over length.
    pub value: f64,
    /// Between neighbours the change from the line to the nearer of them to the parabola; at an end the error of the line
    /// from the curvature of the next two intervals. `None` where two points are all there is.
    pub error: Option<f64>,
}

/// Contact stiffness dp/dū (pressure over length, positive) at each point of a branch: p over the slope of the mean gap
/// against ln p, from the parabola through the point and its neighbours, or from the line through two points at the
/// ends. `branch`: points `(p, ū)` in the order of the loads. `None` for non-positive pressures, equal neighbours, and
/// a single point.
///
/// The slope against ln p is used because ū is nearly linear in ln p at small p*, which permits loads a factor of three
/// apart.
pub fn stiffness(branch: &[(f64, f64)]) -> Vec<Option<Stiffness>> {
    let slope = |a: usize, b: usize| {
        let (run, rise) = ((branch.get(b)?.0 / branch.get(a)?.0).ln(), branch[b].1 - branch[a].1);
        (branch[a].0 > 0.0 && branch[b].0 > 0.0 && run != 0.0).then(|| (rise / run, run))
    };
    // Error of a line of extent h, from the change to the slope of the next interval.
    let of_line =
        |line: (f64, f64), next: Option<(f64, f64)>| next.map(|(t, k)| ((t - line.0) * line.1 / (line.1 + k)).abs());
    (0..branch.len())
        .map(|i| {
            let before = i.checked_sub(1).and_then(|a| slope(a, i));
            let after = slope(i, i + 1);
            let (per_log, error) = match (before, after) {
                (Some((s, h)), Some((t, k))) => {
                    let parabola = (s * k + t * h) / (h + k);
                    let nearer = if h.abs() < k.abs() { s } else { t };
                    (parabola, Some((parabola - nearer).abs()))
                }
                (Some(line), None) => (line.0, of_line(line, i.checked_sub(2).and_then(|a| slope(a, i - 1)))),
                (None, Some(line)) => (line.0, of_line(line, slope(i + 1, i + 2))),
                (None, None) => return None,
            };
            let value = -branch[i].0 / per_log;
            (per_log != 0.0).then(|| Stiffness { value, error: error.map(|e| (value * e / per_log).abs()) })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logarithms_and_parabolas_of_them_are_exact() {
        /// Rounding.
        const TOLERANCE: f64 = 1e-12;
        let loads = [0.001, 0.004, 0.01, 0.02];
        let logarithmic: Vec<(f64, f64)> = loads.iter().map(|p: &f64| (*p, 0.1 - 0.3 * p.ln())).collect();
        for (k, p) in stiffness(&logarithmic).iter().zip(loads) {
            assert!((k.expect("a neighbour").value / (p / 0.3) - 1.0).abs() < TOLERANCE);
        }
        // A parabola in ln p, at points with neighbours on both sides, for increasing and decreasing loads.
        let mut curved: Vec<(f64, f64)> =
            loads.iter().map(|p: &f64| (*p, -0.3 * p.ln() + 0.01 * p.ln().powi(2))).collect();
        for _ in 0..2 {
            for (k, (p, _)) in stiffness(&curved).iter().zip(&curved).skip(1).take(2) {
                let expected = p / (0.3 - 0.02 * p.ln());
                assert!((k.expect("neighbours").value / expected - 1.0).abs() < TOLERANCE);
            }
            curved.reverse();
        }
    }

    /// The slope of a parabola of curvature c in ln p deviates from that of a line of extent h by c h: the error at an end
    /// is that of its line, and elsewhere that of the line to the nearer neighbour.
    #[test]
    fn errors_of_a_parabola_are_those_of_its_lines() {
        const CURVATURE: f64 = 0.01;
        let loads = [0.001f64, 0.004, 0.01, 0.04];
        let branch: Vec<(f64, f64)> = loads.iter().map(|p| (*p, -0.3 * p.ln() + CURVATURE * p.ln().powi(2))).collect();
        let extents: Vec<f64> = loads.windows(2).map(|w| (w[1] / w[0]).ln()).collect();
        let nearest = [extents[0], extents[0].min(extents[1]), extents[1].min(extents[2]), extents[2]];
        for ((k, p), extent) in stiffness(&branch).iter().zip(loads).zip(nearest) {
            let k = k.expect("a neighbour");
            // value = -p/slope, and its error that of the slope in proportion.
            let expected = k.value * CURVATURE * extent * k.value / p;
            assert!((k.error.expect("three points") / expected - 1.0).abs() < 1e-9, "{k:?} {expected}");
        }
        assert_eq!(stiffness(&branch[..2])[0].expect("a neighbour").error, None);
        // The same on unloading.
        let unloading: Vec<(f64, f64)> = branch.iter().rev().copied().collect();
        for (up, down) in stiffness(&branch).iter().zip(stiffness(&unloading).iter().rev()) {
            let [up, down] = [up, down].map(|k| k.and_then(|k| k.error).expect("three points"));
            assert!((up / down - 1.0).abs() < 1e-9, "{up} {down}");
        }
    }

    #[test]
    fn single_and_repeated_loads_have_no_stiffness() {
        assert_eq!(stiffness(&[(0.1, 1.0)]), [None]);
        assert_eq!(stiffness(&[(0.1, 1.0), (0.1, 0.9)]), [None, None]);
        assert_eq!(stiffness(&[(0.1, 0.0), (0.2, 0.0)]), [None, None]);
        assert_eq!(stiffness(&[(-0.1, 1.0), (0.0, 0.9), (0.1, 0.8)]), [None, None, None]);
        assert!(stiffness(&[]).is_empty());
    }
}

/// Work lost in a closed loading and unloading cycle per area, -∮ p dū. `path`: pressure and mean gap in the order of
/// the loads, closed at the first load. Trapezoidal rule over the mean gap: coinciding branches cancel exactly, for any
/// load steps.
pub fn hysteresis_work(path: &[(f64, f64)]) -> f64 {
    let piece = |a: &(f64, f64), b: &(f64, f64)| 0.5 * (a.0 + b.0) * (a.1 - b.1);
    let open: f64 = path.windows(2).map(|w| piece(&w[0], &w[1])).sum();
    open + path.last().zip(path.first()).map_or(0.0, |(last, first)| piece(last, first))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_area_of_the_loop() {
        /// Rounding.
        const TOLERANCE: f64 = 1e-15;
        // Approach at pressure 2 and separation at pressure 1, by 0.5 each.
        let loop_of = [(1.0, 1.0), (2.0, 1.0), (2.0, 0.5), (1.0, 0.5)];
        assert!((hysteresis_work(&loop_of) - 0.5).abs() < TOLERANCE);
        let there = [(0.1, 1.0), (0.3, 0.4), (1.0, 0.1)];
        let back = [(0.3, 0.4), (0.1, 1.0)];
        assert!(hysteresis_work(&[&there[..], &back[..]].concat()).abs() < TOLERANCE);
        // With adhesion the gap is smaller on unloading, and work is lost.
        let hanging = [(0.3, 0.3), (0.1, 0.8)];
        assert!(hysteresis_work(&[&there[..], &hanging[..]].concat()) > 0.0);
        assert_eq!(hysteresis_work(&[]), 0.0);
    }
}

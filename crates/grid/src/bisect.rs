/// Halves an interval: its lower half is kept where `below` is false in the middle. Returns its ends.
pub fn bisect(mut low: f64, mut high: f64, halvings: usize, below: impl Fn(f64) -> bool) -> (f64, f64) {
    for _ in 0..halvings {
        let middle = 0.5 * (low + high);
        if below(middle) { low = middle } else { high = middle }
    }
    (low, high)
}

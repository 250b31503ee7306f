//! Ranges, ticks and labels of axes.

use super::number::{superscript, trimmed};

/// An axis: whether it is logarithmic, and its label with the unit in brackets.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisScale {
    pub log: bool,
    pub label: String,
}

pub fn linear<T: Into<String>>(label: T) -> AxisScale {
    AxisScale { log: false, label: label.into() }
}

pub fn log<T: Into<String>>(label: T) -> AxisScale {
    AxisScale { log: true, label: label.into() }
}

impl AxisScale {
    /// For scripts.
    pub(super) fn kind(&self) -> &'static str {
        if self.log { "log" } else { "linear" }
    }

    /// A value in axis coordinates: its logarithm on a logarithmic axis.
    pub(super) fn place(&self, v: f64) -> f64 {
        if self.log { v.log10() } else { v }
    }
}

/// Number of decades below which multiples of powers of ten are also labelled.
const FEW_DECADES: f64 = 3.0;

/// Range and ticks of an axis, in axis coordinates.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PlotAxis {
    log: bool,
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) ticks: Vec<f64>,
    pub(super) minor: Vec<f64>,
    step: f64,
    /// Power of ten factored out of the labels of a linear axis.
    power: i32,
}

impl PlotAxis {
    pub(super) fn new(log: bool, values: &[f64]) -> Self {
        let (low, high) = ends(values.iter().copied());
        if log { Self::logarithmic(low, high) } else { Self::linear(low, high) }
    }

    fn linear(low: f64, high: f64) -> Self {
        // A single value gets a margin on both sides.
        let half = if high > low { 0.0 } else { (0.1 * low.abs()).max(1e-12) };
        let (low, high) = (low - half, high + half);
        let step = round_step((high - low) / 6.0);
        let room = 0.03 * (high - low);
        // An axis that would start close to zero starts at zero, without a margin below data that are never negative.
        let low = if low >= 0.0 && low < 0.3 * high { 0.0 } else { low - room };
        let high = high + room;
        let (first, last) = ((low / step).ceil() as i64, (high / step + 1e-9).floor() as i64);
        let largest = low.abs().max(high.abs());
        let power = if (1e-2..1e5).contains(&largest) { 0 } else { largest.log10().floor() as i32 };
        let ticks = (first..=last).map(|i| i as f64 * step).collect();
        PlotAxis { log: false, low, high, ticks, minor: Vec::new(), step, power }
    }

    fn logarithmic(low: f64, high: f64) -> Self {
        let room = (0.03 * (high - low)).max(0.05);
        let (low, high) = (low - room, high + room);
        let (first, last) = (low.ceil() as i32, high.floor() as i32);
        let every = ((last - first) / 8 + 1).max(1);
        let within = |v: &f64| *v >= low && *v <= high;
        let multiples = |of: &[f64]| -> Vec<f64> {
            (first - 1..=last).flat_map(|d| of.iter().map(move |m| f64::from(d) + m.log10())).filter(within).collect()
        };
        let decades = (first..=last).filter(|d| (d - first) % every == 0).map(f64::from).collect::<Vec<f64>>();
        // Over fewer than three decades, powers of ten alone are too few labels.
        let ticks = if high - low < FEW_DECADES { multiples(&[1.0, 2.0, 5.0]) } else { decades };
        let minor = if every == 1 { multiples(&[2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]) } else { Vec::new() };
        PlotAxis { log: true, low, high, ticks, minor, step: 1.0, power: 0 }
    }

    fn label(&self, v: f64) -> String {
        if self.log {
            // All labels of an axis have one format.
            let far = self.ticks.iter().any(|t| !(-3.0..=4.0).contains(t));
            let powers = self.high - self.low >= FEW_DECADES && far;
            return if powers { format!("10{}", superscript(v as i32)) } else { trimmed(10f64.powf(v), 2) };
        }
        let factor = 10f64.powi(self.power);
        let step = self.step / factor;
        // A step of 2.5 needs one more decimal than its decade.
        let mantissa = step / 10f64.powf(step.log10().floor());
        let whole = (mantissa - mantissa.round()).abs() < 1e-6;
        let decimals = (-(step.log10().floor()) + if whole { 0.0 } else { 1.0 }).max(0.0) as usize;
        let text = format!("{:.decimals$}", v / factor);
        // A negative rounding error must not be printed as "−0.0".
        if text.trim_matches(['-', '0', '.']).is_empty() { "0".into() } else { text.replace('-', "−") }
    }

    pub(super) fn labels(&self) -> impl Iterator<Item = String> {
        self.ticks.iter().map(|t| self.label(*t))
    }

    pub(super) fn factor_note(&self) -> String {
        if self.power == 0 { String::new() } else { format!(" × 10{}", superscript(-self.power)) }
    }

    /// Position of a value in axis coordinates, as a fraction of the axis.
    pub(super) fn place(&self, value: f64) -> f64 {
        (value - self.low) / (self.high - self.low)
    }
}

/// Lowest and highest value; `(∞, −∞)` of none.
pub(super) fn ends(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    values.into_iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
}

/// The round number at or above `rough`: 1, 2, 2.5 or 5 times a power of ten.
pub(super) fn round_step(rough: f64) -> f64 {
    let decade = 10f64.powf(rough.log10().floor());
    let steps = [1.0, 2.0, 2.5, 5.0, 10.0].map(|m| m * decade);
    steps.into_iter().find(|s| *s >= 0.999_999 * rough).unwrap_or(rough)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(log: bool, low: f64, high: f64) -> Vec<String> {
        PlotAxis::new(log, &[low, high]).labels().collect()
    }

    #[test]
    fn ticks_people_would_choose() {
        assert_eq!(labels(false, 0.01, 0.1), ["0", "0.02", "0.04", "0.06", "0.08", "0.10"]);
        assert_eq!(labels(false, -1.0, 1.0), ["−1.0", "−0.5", "0", "0.5", "1.0"]);
        assert_eq!(labels(true, -1.0, 2.0), ["0.1", "1", "10", "100"]);
        assert_eq!(labels(true, -8.0, -5.0), ["10⁻⁸", "10⁻⁷", "10⁻⁶", "10⁻⁵"]);
        assert_eq!(labels(true, -4.0, 1.0), ["10⁻⁴", "10⁻³", "10⁻²", "10⁻¹", "10⁰", "10¹"]);
        let path = ["0.001", "0.002", "0.005", "0.01", "0.02", "0.05", "0.1", "0.2"];
        assert_eq!(labels(true, -3.0, 0.3_f64.log10()), path);
        assert_eq!(labels(true, 0.02_f64.log10(), 0.09_f64.log10()), ["0.02", "0.05", "0.1"]);
        let small = PlotAxis::new(false, &[0.0, 3e-5]);
        assert_eq!(small.factor_note(), " × 10⁵");
        assert!(small.labels().any(|l| l == "1.0"), "{:?}", small.labels().collect::<Vec<_>>());
        assert_eq!(labels(false, 5.0, 5.0).len(), 5);
    }
}

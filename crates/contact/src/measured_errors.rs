//! Errors of a method that were measured on one surface, together with that surface.

use super::quantity::Quantity;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// Root mean square error of a quantity over some loads.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct MeasuredError {
    /// Of which quantity.
    pub quantity: Quantity,
    /// Relative, of areas and of mean gaps.
    pub error: f64,
    /// Loads of the root mean square.
    pub p_star: Cow<'static, [f64]>,
}

/// The surface on which errors were measured. Lengths over the extent of the cell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct MeasuredSurface {
    /// In words.
    pub spectrum: Cow<'static, str>,
    /// Hurst exponent.
    pub hurst: f64,
    /// Roll-off wavelength.
    pub lambda_r: f64,
    /// Short cut-off wavelength.
    pub lambda_s: f64,
    /// rms gradient.
    pub rms_gradient: f64,
    /// Points along x and y.
    pub grid: [usize; 2],
    /// Seeds of the surfaces.
    pub seeds: Cow<'static, [u64]>,
    /// Whether the surfaces attract each other, with the adhesion of the challenge.
    pub adhesive: bool,
}

/// Errors of a method, the surface on which they were measured, and what with. On other surfaces they may be larger.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct MeasuredErrors {
    /// One for each quantity and adhesion.
    pub errors: Cow<'static, [MeasuredError]>,
    /// On which they were measured.
    pub surface: MeasuredSurface,
    /// What the errors are deviations from.
    pub reference: Cow<'static, str>,
}

/// Loads of the challenge's scene. The mean gap is compared on those up to 0.14: beyond it is nearly closed.
const LOADS: [f64; 12] = [0.001, 0.003, 0.01, 0.03, 0.1, 0.14, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0];
const OPEN: usize = 6;

impl MeasuredErrors {
    /// Errors of contact area and mean gap on the surface of the challenge: `asperity tradeoff configs/challenge.toml`, evidence/trade-off.md.
    pub const fn on_the_challenge(errors: &'static [MeasuredError], adhesive: bool) -> Self {
        MeasuredErrors {
            errors: Cow::Borrowed(errors),
            surface: MeasuredSurface {
                spectrum: Cow::Borrowed("of the contact-mechanics challenge: self-affine, flat above the roll-off"),
                hurst: 0.8,
                lambda_r: 0.2,
                lambda_s: 0.001,
                rms_gradient: 1.0,
                grid: [1024, 1024],
                seeds: Cow::Borrowed(&[18]),
                adhesive,
            },
            reference: Cow::Borrowed("fast on 2048 x 2048 points"),
        }
    }
}

impl MeasuredError {
    /// Over all loads of the challenge.
    pub const fn of_area(error: f64) -> Self {
        MeasuredError { quantity: Quantity::ContactArea, error, p_star: Cow::Borrowed(&LOADS) }
    }

    /// Over the lowest `loads` of the challenge.
    pub const fn of_mean_gap(error: f64, loads: usize) -> Self {
        let (lowest, _) = LOADS.split_at(loads);
        MeasuredError { quantity: Quantity::MeanGap, error, p_star: Cow::Borrowed(lowest) }
    }

    /// The same over those at which the gap is open.
    pub const fn of_open_gap(error: f64) -> Self {
        Self::of_mean_gap(error, OPEN)
    }
}

impl std::fmt::Display for MeasuredSurface {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let seeds: Vec<String> = self.seeds.iter().map(u64::to_string).collect();
        let (plural, [nx, ny]) = (if seeds.len() == 1 { "" } else { "s" }, self.grid);
        write!(
            f,
            "one surface with the spectrum {} (H = {}, roll-off {} L, shortest wave {} L, rms gradient {}; seed{plural} {}; {nx} x {ny} \
             points; {} adhesion)",
            self.spectrum,
            self.hurst,
            self.lambda_r,
            self.lambda_s,
            self.rms_gradient,
            seeds.join(", "),
            if self.adhesive { "with" } else { "without" }
        )
    }
}

impl std::fmt::Display for MeasuredErrors {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let error_text = |e: &MeasuredError| {
            let range = match (e.p_star.first(), e.p_star.last()) {
                (Some(first), Some(last)) => format!("p* = {first} to {last}, {} loads", e.p_star.len()),
                _ => "no load".into(),
            };
            // Two digits.
            let percent = 100.0 * e.error;
            let percent = if percent < 10.0 { format!("{percent:.1}") } else { format!("{percent:.0}") };
            format!("{} {percent} % ({range})", e.quantity.name())
        };
        let list: Vec<String> = self.errors.iter().map(error_text).collect();
        write!(f, "{}: root mean squares on {}, against {}", list.join(", "), self.surface, self.reference)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_surface::Spectrum;

    static ERRORS: [MeasuredError; 2] = [MeasuredError::of_area(0.15), MeasuredError::of_open_gap(0.083)];
    static SOME: MeasuredErrors = MeasuredErrors::on_the_challenge(&ERRORS, false);

    /// The surface stands in the text and in the JSON, which is read back.
    #[test]
    fn errors_carry_their_surface() {
        let text = SOME.to_string();
        for part in [
            "contact area 15 % (p* = 0.001 to 1, 12 loads)",
            "mean gap 8.3 % (p* = 0.001 to 0.14, 6 loads)",
            "H = 0.8",
            "seed 18",
            "1024 x 1024",
            "without adhesion",
            "fast on 2048 x 2048",
        ] {
            assert!(text.contains(part), "{part}: {text}");
        }
        let json = serde_json::to_string(&SOME).expect("numbers and words");
        assert_eq!(serde_json::from_str::<MeasuredErrors>(&json).expect("the same"), SOME);
        assert!(json.contains("\"seeds\":[18]") && json.contains("\"hurst\":0.8"), "{json}");
    }

    /// The numbers are those of the challenge's spectrum.
    #[test]
    fn surface_is_that_of_the_challenge() {
        let Spectrum { hurst, lambda_r, lambda_s, rms_gradient, .. } = Spectrum::CHALLENGE;
        let own = &SOME.surface;
        assert_eq!(
            (own.hurst, own.lambda_r, own.lambda_s, own.rms_gradient),
            (hurst, lambda_r, lambda_s, rms_gradient)
        );
    }
}

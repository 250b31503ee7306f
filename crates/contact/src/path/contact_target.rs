//! Loads that are given as contact areas: the pressures that produce them.

use crate::interface::rounded;
use crate::method::{ContactMethod, Load, Observer, ProblemScale, ReducedProblem, Stop};
use asperity_grid::sys::expect_memory;
use asperity_grid::{Error, Result};

/// Relative deviation of the contact area that is accepted, or one node if that is more: contact changes by whole nodes.
const CONTACT_TOLERANCE: f64 = 1e-3;

/// Relative distance of two pressures between which the contact jumps past a target.
const JUMP: f64 = 1e-7;

/// Margin of the estimate of rounding.
const ROUNDING: f64 = 10.0;

/// Share of the first guess below which a pressure may be called the lightest.
const LIGHTEST: f64 = 1e-2;

/// Solves per area. Regula falsi with the Illinois rule takes 4 to 10.
const MOST_SOLVES: usize = 60;

/// p* at which about this fraction of a rough surface is in contact: A = erf(√π p*), inverted by Winitzki's formula (error below 0.4 %).
pub fn estimated_p_star(area: f64) -> f64 {
    const A: f64 = 0.147;
    let log = (1.0 - area * area).ln();
    let half = 2.0 / (std::f64::consts::PI * A) + log / 2.0;
    ((half * half - log / A).sqrt() - half).sqrt() / std::f64::consts::PI.sqrt()
}

/// The pressures (E*) that give these contact areas over the area of the cell. `gradient`: pressure over E* at p* = 1, for the first guess.
///
/// # Errors
/// `Interrupted` by the observer; a solve that does not converge; an area that no pressure gives; too little memory; a method that does not
/// solve for the fields.
pub fn pressures_of_contact(
    areas: &[f64],
    problem: &ReducedProblem,
    method: &dyn ContactMethod,
    gradient: f64,
    observer: &dyn Observer,
) -> Result<Vec<f64>> {
    let what = format!("a solve on {} x {} points", problem.grid.nx, problem.grid.ny);
    expect_memory(what, method.plan(problem).bytes, "a map with fewer points needs less")?;
    // As load paths do: results depend on pressure over gradient alone.
    let scale = ProblemScale::of(&problem.heights);
    let heights = scale.heights(&problem.heights);
    let problem = &scale.problem(problem, &heights);
    let mut run = method.start(problem, observer)?.solver()?;
    let node_fraction = 1.0 / problem.grid.points() as f64;
    let mut contact = |pressure: f64| -> Result<f64> {
        let state = run.equilibrate(Load::Pressure(pressure))?;
        match state.stop {
            Stop::Converged => Ok(problem.contact_area(&state, 0.0).contact_area),
            Stop::Interrupted => Err(Error::Interrupted),
            stop => Err(state.not_converged(method.card().id, stop, problem.tolerance, None)),
        }
    };
    let mut pressure_of = |target: f64| {
        let guess = scale.divide(gradient) * estimated_p_star(target);
        // Below, rounding of the heights exceeds the tolerance.
        let hidden = ROUNDING * guess * problem.rounding_floor(problem.heights.rms(), guess) / problem.tolerance;
        let lightest = hidden.min(LIGHTEST * guess);
        root(target, (guess, lightest), (CONTACT_TOLERANCE * target).max(node_fraction), &mut contact)?
            .map_err(|jump| Error::input("problem", "load.contact", target, jump.accepted()))
    };
    let mut pressures: Vec<f64> = Vec::new();
    for (i, area) in areas.iter().enumerate() {
        // An area that is given again has the same pressure to the last digit, so that a closed path stays closed.
        let again = areas[..i].iter().position(|before| before == area);
        pressures.push(match again {
            Some(before) => pressures[before],
            None => scale.multiply(pressure_of(*area)?),
        });
    }
    Ok(pressures)
}

/// The contact nearest to a target that no pressure gives, below and above it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Jump {
    below: Option<f64>,
    above: Option<f64>,
}

impl Jump {
    fn accepted(self) -> String {
        let percent = |area: f64| format!("{}%", rounded(100.0 * area));
        match (self.below.map(percent), self.above.map(percent)) {
            (Some(below), Some(above)) => {
                format!("up to {below}, or from {above} on: the contact of this surface jumps in between")
            }
            (None, Some(above)) => format!("{above} and more, which is in contact under the lightest loads"),
            (Some(below), None) => format!("up to {below}, beyond which it hardly grows"),
            (None, None) => unreachable!("one of them was set"),
        }
    }
}

/// The pressure at which `contact`, which rises with it, is `target` within `tolerance`, or the jump over the target: points at one height
/// touch all at once under the `lightest` pressure.
fn root(
    target: f64,
    (guess, lightest): (f64, f64),
    tolerance: f64,
    contact: &mut impl FnMut(f64) -> Result<f64>,
) -> Result<std::result::Result<f64, Jump>> {
    let mut jump = Jump::default();
    // In the logarithm of the pressure, which is positive.
    let (mut low, mut high): (Option<[f64; 2]>, Option<[f64; 2]>) = (None, None);
    let (mut x, mut side) = (guess.ln(), 0);
    for _ in 0..MOST_SOLVES {
        let area = contact(x.exp())?;
        let deviation = area - target;
        if deviation.abs() <= tolerance {
            return Ok(Ok(x.exp()));
        }
        match deviation < 0.0 {
            true => jump.below = Some(jump.below.unwrap_or(0.0).max(area)),
            false => jump.above = Some(jump.above.unwrap_or(1.0).min(area)),
        }
        let here = if deviation < 0.0 { -1 } else { 1 };
        // Illinois: an end that stays twice counts half.
        if here == side {
            let other = if deviation < 0.0 { &mut high } else { &mut low };
            other.iter_mut().for_each(|end| end[1] /= 2.0);
        }
        side = here;
        *(if deviation < 0.0 { &mut low } else { &mut high }) = Some([x, deviation]);
        x = match (low, high) {
            (Some([a, fa]), Some([b, fb])) if (b - a).abs() > JUMP => (a * fb - b * fa) / (fb - fa),
            (Some(_), Some(_)) => return Ok(Err(jump)),
            (None, Some(_)) if x <= lightest.ln() => return Ok(Err(jump)),
            // Contact is about proportional to the pressure.
            (Some([a, fa]), None) => a + (target / (target + fa).max(target / 10.0)).ln().max(0.1),
            (None, Some([b, fb])) => (b - ((target + fb) / target).ln().max(0.1)).max(lightest.ln()),
            (None, None) => unreachable!("one of them was set"),
        };
    }
    Ok(Err(jump))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_root_is_found_from_a_poor_guess_and_a_jump_is_reported() {
        for guess in [1e-6, 0.3, 1e3] {
            let mut solves = 0;
            let mut smooth = |p: f64| {
                solves += 1;
                Ok(p / (1.0 + p))
            };
            let actual = root(0.2, (guess, 1e-9), 1e-6, &mut smooth).expect("no error").expect("a root");
            assert!((actual - 0.25).abs() < 1e-5 && solves < 40, "{actual} after {solves}");
        }
        let mut step = |p: f64| Ok(if p < 0.5 { 0.1 } else { 0.9 });
        let jump = root(0.5, (0.4, 1e-9), 1e-3, &mut step).expect("no error").expect_err("no root");
        assert_eq!(jump, Jump { below: Some(0.1), above: Some(0.9) });
        assert!(jump.accepted().starts_with("up to 10%, or from 90% on"));
        let mut saturated = |p: f64| Ok(0.5 * p / (1.0 + p));
        let jump = root(0.8, (0.4, 1e-9), 1e-3, &mut saturated).expect("no error").expect_err("no root");
        assert!(jump.above.is_none() && jump.accepted().starts_with("up to 50%"), "{jump:?}");
        // A terrace touches as a whole.
        let mut solves = 0;
        let mut terrace = |p: f64| {
            solves += 1;
            Ok(0.25 + p / (1.0 + p))
        };
        let jump = root(0.004, (0.01, 1e-9), 1e-4, &mut terrace).expect("no error").expect_err("no root");
        assert!(jump.below.is_none() && jump.accepted().starts_with("25% and more") && solves < 12, "{solves}");
    }

    #[test]
    fn the_estimate_inverts_the_error_function() {
        // erf(√π p*) at p* = 0.01 and 0.5: 0.019998, 0.789908 (Abramowitz and Stegun 7.1.6).
        for (p_star, area) in [(0.01, 0.019998), (0.5, 0.789908)] {
            let estimate: f64 = estimated_p_star(area);
            assert!((estimate / p_star - 1.0).abs() < 4e-3, "{estimate} for {p_star}");
        }
    }
}

//! Contact area and mean contact pressure.

use super::{ChallengeData, Statement, cover, reference};
use crate::record::acceptance::AcceptanceCheck;
use crate::record::results::StateResults;
use std::f64::consts::PI;

/// Largest load p* for the area law without adhesion.
const ALL: f64 = 1.001;
/// Contact fraction up to which area is proportional to load.
const PROPORTIONAL: f64 = 0.2;
/// Contact fractions that count as "a few per cent".
const FEW_PER_CENT: [f64; 2] = [0.01, 0.05];
/// Loads p* with nearly constant mean contact pressure: two of the paper's three decades.
const SPAN: [f64; 2] = [1e-3, 0.1];
/// Relative tolerance for "within the symbol size" of the paper's figure.
const SYMBOL_SIZE: f64 = 0.2;

/// All contact fractions are perimeter-corrected, which removes the discretisation error at the edges of clusters.
fn area(s: &StateResults) -> f64 {
    s.contact_fraction_corrected
}

pub(super) fn assess(data: &ChallengeData) -> Vec<AcceptanceCheck> {
    let plain: Vec<&StateResults> = ChallengeData::touching(data.plain).collect();
    let adhesive: Vec<&StateResults> = ChallengeData::touching(data.adhesive).collect();
    // Waves that the grid does not resolve are absent from the solution: loads are relative to the resolved rms
    // gradient.
    let gradient = data.plain.resolved_gradient.unwrap_or(1.0);
    let load = |s: &StateResults| s.numbers.pressure / gradient;
    let worst = |list: &[f64], aim: f64| {
        list.iter().copied().max_by(|a, b| (a / aim - 1.0).abs().total_cmp(&(b / aim - 1.0).abs()))
    };
    let ratios: Vec<f64> = plain.iter().filter(|s| area(s) < PROPORTIONAL).map(|s| area(s) / load(s)).collect();
    let law: Vec<f64> =
        plain.iter().filter(|s| s.numbers.p_star < ALL).map(|s| area(s) / libm::erf(PI.sqrt() * load(s))).collect();
    let increases: Vec<f64> = adhesive
        .iter()
        .filter(|s| (FEW_PER_CENT[0]..FEW_PER_CENT[1]).contains(&area(s)))
        .filter_map(|s| Some(area(s) / area(plain.iter().find(|p| p.numbers.index == s.numbers.index)?)))
        .collect();
    let at_reference = reference(data.adhesive).map(area);
    let pressures: Vec<f64> = adhesive
        .iter()
        .filter(|s| (9.9e-4..0.1001).contains(&s.numbers.p_star))
        .map(|s| s.numbers.pressure / area(s))
        .collect();
    let spread = cover(adhesive.iter().map(|s| s.numbers.p_star), SPAN).then(|| {
        let (least, most) = pressures.iter().fold((f64::INFINITY, 0.0_f64), |(l, m), p| (l.min(*p), m.max(*p)));
        most / least
    });
    let lowest: Vec<f64> = plain.iter().filter(|s| s.numbers.p_star < 0.0101).map(|s| load(s) / area(s)).collect();
    let first = adhesive.iter().find(|s| (s.numbers.p_star / 1e-3 - 1.0).abs() < 0.05).map(|s| 100.0 * area(s));
    vec![
        data.of_both(
            Statement::new("S05", "adhesion raises the contact area, at a few per cent of contact", "1"),
            |item| item.near(worst(&increases, 1.5), 1.5, 0.2, "\"roughly 50 %\"; the load farthest from it"),
        ),
        data.of_both(Statement::new("S06", "contact at the reference load, with adhesion", "%"), |item| {
            item.near(at_reference.map(|a| 100.0 * a), 3.0, 0.5, "\"3 %\", to half of its digit")
        }),
        Statement::new("S07a", "area over load without adhesion, a_r/p*, below 20 % of contact", "1").near(
            worst(&ratios, 2.0),
            2.0,
            2.0 * SYMBOL_SIZE,
            "symbol size; the load farthest from it, in terms of the resolved gradient",
        ),
        Statement::new("S07b", "area without adhesion over erf(√π p*), all loads", "1").near(
            worst(&law, 1.0),
            1.0,
            SYMBOL_SIZE,
            "symbol size; the load farthest from it",
        ),
        data.of_both(
            Statement::new("S08", "mean contact pressure, largest over smallest, p* = 0.001 … 0.1", "1"),
            |item| item.within(spread, 1.0, [1.0, 1.5], "\"changes by less than 50 %\""),
        ),
        Statement::new("S09", "mean contact pressure without adhesion at small loads", "E* ḡ").near(
            worst(&lowest, 0.5),
            0.5,
            0.075,
            "15 %; the load farthest from it, up to p* = 0.01",
        ),
        data.of_both(Statement::new("S10", "contact at p* = 0.001, with adhesion", "%"), |item| {
            item.within(first, 0.3, [0.2, 0.45], "\"0.3 %\", to a factor of 1.5")
        }),
    ]
}

//! Contact area and mean contact pressure.

use super::{ChallengeData, Statement, cover, reference, uncertainty};
use crate::record::acceptance::AcceptanceCheck;
use asperity_contact::quantity::Quantity;
use asperity_contact::state::State;
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

/// All contact areas are best values, without the excess of nodes along the edges of clusters.
fn area(s: &State) -> f64 {
    s.contact_area
}

/// Values that the statements are about.
struct Areas {
    increase: RelativeValue,
    at_reference: RelativeValue,
    ratio: RelativeValue,
    law: RelativeValue,
    spread: RelativeValue,
    lowest: RelativeValue,
    first: RelativeValue,
}

/// A value with its relative error; `None` if the run has no such value.
type RelativeValue = Option<(f64, Option<f64>)>;

impl Areas {
    fn of(data: &ChallengeData) -> Self {
        let plain: Vec<&State> = ChallengeData::touching(data.plain).collect();
        let adhesive: Vec<&State> = ChallengeData::touching(data.adhesive).collect();
        // Waves that the grid does not resolve are absent from the solution: loads are relative to the resolved rms
        // gradient.
        let gradient = data.plain.resolved_gradient.unwrap_or(1.0) * data.modulus_pa;
        let load = |s: &State| s.pressure / gradient;
        // Values with their relative errors.
        let worst = |list: &[(f64, Option<f64>)], aim: f64| {
            let deviation = |v: &(f64, Option<f64>)| (v.0 / aim - 1.0).abs();
            list.iter().copied().max_by(|a, b| deviation(a).total_cmp(&deviation(b)))
        };
        let relative_error = |s: &State| uncertainty(s, Quantity::ContactArea);
        let sum_of_errors = |a: Option<f64>, b: Option<f64>| a.zip(b).map(|(a, b)| a + b);
        let ratios: Vec<_> =
            plain.iter().filter(|s| area(s) < PROPORTIONAL).map(|s| (area(s) / load(s), relative_error(s))).collect();
        let law: Vec<_> = plain
            .iter()
            .filter(|s| s.p_star < ALL)
            .map(|s| (area(s) / libm::erf(PI.sqrt() * load(s)), relative_error(s)))
            .collect();
        let increases: Vec<_> = adhesive
            .iter()
            .filter(|s| (FEW_PER_CENT[0]..FEW_PER_CENT[1]).contains(&area(s)))
            .filter_map(|s| {
                let without = plain.iter().find(|p| p.index == s.index)?;
                Some((area(s) / area(without), sum_of_errors(relative_error(s), relative_error(without))))
            })
            .collect();
        let at_reference = reference(data.adhesive).map(|s| (100.0 * area(s), relative_error(s)));
        let pressures: Vec<_> = adhesive
            .iter()
            .filter(|s| (9.9e-4..0.1001).contains(&s.p_star))
            .map(|s| (s.pressure / area(s), relative_error(s)))
            .collect();
        let spread = cover(adhesive.iter().map(|s| s.p_star), SPAN).then(|| {
            let by_value = |a: &&(f64, Option<f64>), b: &&(f64, Option<f64>)| a.0.total_cmp(&b.0);
            let (smallest, largest) = (pressures.iter().min_by(by_value)?, pressures.iter().max_by(by_value)?);
            Some((largest.0 / smallest.0, sum_of_errors(largest.1, smallest.1)))
        });
        let lowest: Vec<_> =
            plain.iter().filter(|s| s.p_star < 0.0101).map(|s| (load(s) / area(s), relative_error(s))).collect();
        let first = adhesive
            .iter()
            .find(|s| (s.p_star / 1e-3 - 1.0).abs() < 0.05)
            .map(|s| (100.0 * area(s), relative_error(s)));
        Areas {
            increase: worst(&increases, 1.5),
            at_reference,
            ratio: worst(&ratios, 2.0),
            law: worst(&law, 1.0),
            spread: spread.flatten(),
            lowest: worst(&lowest, 0.5),
            first,
        }
    }
}

pub(super) fn assess(data: &ChallengeData) -> Vec<AcceptanceCheck> {
    let Areas { increase, at_reference, ratio, law, spread, lowest, first } = Areas::of(data);
    let value = |known: RelativeValue| known.map(|f| f.0);
    let with_error = |check: AcceptanceCheck, known: RelativeValue| {
        check.with_error(known.and_then(|(v, relative)| Some(v * relative?)))
    };
    vec![
        data.of_both(
            Statement::new("S05", "adhesion raises the contact area, at a few per cent of contact", "1"),
            |item| {
                with_error(
                    item.near(value(increase), 1.5, 0.2, "\"roughly 50 %\"; the load farthest from it"),
                    increase,
                )
            },
        ),
        data.of_both(Statement::new("S06", "contact at the reference load, with adhesion", "%"), |item| {
            with_error(item.near(value(at_reference), 3.0, 0.5, "\"3 %\", to half of its digit"), at_reference)
        }),
        with_error(
            Statement::new("S07a", "area over load without adhesion, a_r/p*, below 20 % of contact", "1").near(
                value(ratio),
                2.0,
                2.0 * SYMBOL_SIZE,
                "symbol size; the load farthest from it, in terms of the resolved gradient",
            ),
            ratio,
        ),
        with_error(
            Statement::new("S07b", "area without adhesion over erf(√π p*), all loads", "1").near(
                value(law),
                1.0,
                SYMBOL_SIZE,
                "symbol size; the load farthest from it",
            ),
            law,
        ),
        data.of_both(
            Statement::new("S08", "mean contact pressure, largest over smallest, p* = 0.001 … 0.1", "1"),
            |item| with_error(item.within(value(spread), 1.0, [1.0, 1.5], "\"changes by less than 50 %\""), spread),
        ),
        with_error(
            Statement::new("S09", "mean contact pressure without adhesion at small loads", "E* ḡ").near(
                value(lowest),
                0.5,
                0.075,
                "15 %; the load farthest from it, up to p* = 0.01",
            ),
            lowest,
        ),
        data.of_both(Statement::new("S10", "contact at p* = 0.001, with adhesion", "%"), |item| {
            with_error(item.within(value(first), 0.3, [0.2, 0.45], "\"0.3 %\", to a factor of 1.5"), first)
        }),
    ]
}

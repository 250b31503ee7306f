//! Set-up of the problem: scales, adhesion, surface.

use super::{ChallengeData, MESH_LIMIT, Statement, line, reference};
use crate::record::acceptance::{AcceptanceCheck, CheckStatus};
use crate::record::results::{CURVATURE_RADIUS, FIRST_TOUCH, HEIGHT_RANGE, RMS_HEIGHT};
use crate::scene::REFERENCE_LOAD;
use asperity_contact::interface;

/// γ/(E* L): 50 mJ/m² over 25 MPa × 0.1 mm.
pub(super) const GAMMA: f64 = 2e-5;
/// Curvature radius stated in the paper, over L.
const PRINTED_RADIUS: f64 = 60e-9 / 1e-4;

/// A statistic of heights. `printed`: value of the challenge's surface and half a unit of its last digit; `alike`: mean
/// over surfaces with the same spectrum and three standard deviations.
struct HeightStatistic {
    id: &'static str,
    text: &'static str,
    symbol: &'static str,
    unit: &'static str,
    printed: [f64; 2],
    alike: [f64; 2],
}

/// Heights of surfaces with the same spectrum: 100 realisations by independent code, scripts/challenge-ranges.py.
const HEIGHTS: [HeightStatistic; 4] = [
    HeightStatistic {
        id: "S04a",
        text: "rms height",
        symbol: RMS_HEIGHT,
        unit: "µm",
        printed: [0.762, HALF_A_DIGIT],
        alike: [0.776, 0.1],
    },
    HeightStatistic {
        id: "S04b",
        text: "mean minus lowest height",
        symbol: FIRST_TOUCH,
        unit: "µm",
        printed: [2.633, HALF_A_DIGIT],
        alike: [2.888, 0.8],
    },
    HeightStatistic {
        id: "S04c",
        text: "range of heights",
        symbol: HEIGHT_RANGE,
        unit: "µm",
        printed: [5.642, HALF_A_DIGIT],
        alike: [5.79, 1.17],
    },
    HeightStatistic {
        id: "S04d",
        text: "curvature radius",
        symbol: CURVATURE_RADIUS,
        unit: "nm",
        printed: [60.0, 0.5],
        alike: [60.13, 0.4],
    },
];

/// Modes of the self-affine part of the spectrum: beyond the bend at the roll-off L/5, up to the cut-off L/1000.
const SELF_AFFINE_MODE: f64 = 10.0;
const CUT_OFF_MODE: f64 = 1000.0;

/// Half a unit of the last printed digit of heights, µm.
pub(super) const HALF_A_DIGIT: f64 = 5e-4;
/// Mean radius of curvature of the summits (random-field theory), µm.
const SUMMIT_RADIUS_UM: f64 = 0.040;

/// Largest height difference between an extremum of the surface and the highest node near it, µm.
pub(super) fn sampling(data: &ChallengeData) -> f64 {
    let spacing = data.length_um / data.adhesive.nx as f64;
    spacing * spacing / (4.0 * SUMMIT_RADIUS_UM)
}

/// Tabor parameter for the range `rho`, units of L.
pub(super) fn tabor(rho: f64) -> f64 {
    interface::tabor(PRINTED_RADIUS, GAMMA, rho)
}

pub(super) fn assess(data: &ChallengeData) -> Vec<AcceptanceCheck> {
    let mut list = vec![mesh(data)];
    let [requested, used] = data.ranges;
    list.push(Statement::new("S01", "Tabor parameter", "1").near(
        Some(tabor(requested)),
        3.0007,
        1e-3,
        format!("at the range used on this grid: {:.2}", tabor(used)),
    ));
    let pressure = reference(data.adhesive).map(|s| s.pressure * 1e-3);
    list.push(Statement::new("S02", "pressure at the reference load p* = 0.01", "kPa").near(
        pressure,
        data.modulus_pa * REFERENCE_LOAD * 1e-3,
        250.0 * 1e-6,
        "E* ḡ p*",
    ));
    list.push(Statement::new("S03", "largest adhesive stress γ/ρ", "E* ḡ").near(
        Some(GAMMA / requested),
        0.96572,
        1e-4,
        format!("at the range used on this grid: {:.4}", GAMMA / used),
    ));
    list.extend(HEIGHTS.iter().map(|statistic| heights(data, statistic)));
    list.push(hurst(data));
    list
}

/// Hurst exponent of the realised spectrum between roll-off and cut-off, or the shortest wave of the grid: C(q) falls as
/// q^(−2 − 2H).
fn hurst(data: &ChallengeData) -> AcceptanceCheck {
    let end = (data.adhesive.nx.min(data.adhesive.ny) as f64 / 2.0).min(CUT_OFF_MODE);
    let psd = data.results.surface.psd.iter();
    let points: Vec<(f64, f64)> = psd
        .filter(|p| (SELF_AFFINE_MODE..end).contains(&p.mode) && p.realised > 0.0)
        .map(|p| (p.mode.ln(), p.realised.ln()))
        .collect();
    let item = Statement::new("A03", "Hurst exponent of the spectrum from its roll-off to the shortest wave", "1");
    let Some(fit) = line(&points) else { return item.not_assessed("fewer than three points of the spectrum there") };
    // A coarse grid has few modes.
    let error = 0.5 * fit.slope_error;
    let reason = "\"0.8\", to half of its digit and two standard errors of the fit";
    item.near(Some(-0.5 * fit.slope - 1.0), 0.8, 0.05 + 2.0 * error, reason).with_error(Some(error))
}

fn mesh(data: &ChallengeData) -> AcceptanceCheck {
    let item = Statement::new("MESH", "mesh criterion of the adhesion, dx γ/(ρ² E*)", "1");
    let [requested, used] = data.mesh;
    let check = item.within(
        Some(used),
        MESH_LIMIT,
        [0.0, MESH_LIMIT],
        if used < requested {
            format!(
                "met by a longer range; the challenge's own would have {requested:.1} here, and needs 29686 points per side"
            )
        } else {
            "the challenge's own range".to_string()
        },
    );
    match check.status {
        CheckStatus::Fail => AcceptanceCheck {
            status: CheckStatus::NotAssessed,
            reason: data.unresolved.clone().unwrap_or_default(),
            ..check
        },
        _ => check,
    }
}

fn heights(data: &ChallengeData, compared: &HeightStatistic) -> AcceptanceCheck {
    let statistic = data.results.surface.statistic(compared.symbol);
    let item = Statement::new(compared.id, compared.text, compared.unit);
    let Some(statistic) = statistic else { return item.not_assessed("the surface has no such statistic") };
    if statistic
        .expected_on_grid
        .zip(statistic.expected)
        .is_some_and(|(on_grid, whole)| (on_grid / whole - 1.0).abs() > 0.01)
    {
        return item.not_assessed("the grid does not resolve the whole spectrum: 2002 points per side do");
    }
    let ([printed, digit], [alike, width]) = (compared.printed, compared.alike);
    // Sums over the nodes of a resolved spectrum are exact; extrema lie between nodes.
    let extreme = if compared.symbol.contains('-') { sampling(data) } else { 0.0 };
    let error = Some(extreme);
    if extreme > width {
        let points = (data.length_um / (4.0 * SUMMIT_RADIUS_UM * width).sqrt()).ceil();
        return item.not_assessed(format!(
            "the extrema of the surface lie between the nodes; {points} points per side find them"
        ));
    }
    if data.is_imported() {
        return data.of_roughness(item, |item| {
            let reason = "the paper's own surface, to the last printed digit and what lies between nodes";
            item.near(Some(statistic.realised), printed, digit + extreme, reason).with_error(error)
        });
    }
    let reason = format!(
        "three standard deviations of surfaces with this spectrum; the paper's own has {printed} {}",
        compared.unit
    );
    item.near(Some(statistic.realised), alike, width, reason).with_error(error)
}

//! Requirements of methods with a limited scope. Each is an error of one line.

use super::{Load, MethodCard, ReducedProblem};
use crate::interface::{AttractionLaw, Elastic, Wall};
use asperity_grid::{Error, Result};
use asperity_grid::{Grid, lowest, mean};
use asperity_surface::{PowerSpectrum, Summit, SummitCurvature, SummitFit};
use std::borrow::Cow;

/// Anisotropy of the power spectrum above which a surface is not isotropic. Realisations of the challenge's spectrum at
/// 128² to 512² have less than 0.2, ridges have 1.
const MOST_ANISOTROPIC: f64 = 0.3;

/// The error of method `id` for a value that it does not accept.
pub fn refused(id: &str, key: &str, found: impl ToString, accepted: impl Into<String>) -> Error {
    Error::input(format!("method {id}"), key, found, accepted)
}

fn refuse<T>(id: &str, key: &str, found: impl ToString, accepted: impl Into<String>) -> Result<T> {
    Err(refused(id, key, found, accepted))
}

/// A hard wall: gaps are never negative.
pub fn hard_wall(problem: &ReducedProblem, id: &str) -> Result<()> {
    match problem.wall {
        Wall::Hard => Ok(()),
        wall => refuse(id, "wall", wall, "a hard wall"),
    }
}

/// One rank, except for the method that several can share.
pub fn ranks(problem: &ReducedProblem, card: &MethodCard) -> Result<()> {
    match problem.ranks.count() {
        1 => Ok(()),
        _ if card.capabilities.ranks => Ok(()),
        n => refuse(card.id, "ranks", n, "one: several share a solve by the method `fast` alone"),
    }
}

/// A hardness that is positive, and only for methods that model plastic flow.
pub fn hardness(problem: &ReducedProblem, card: &MethodCard) -> Result<()> {
    let Some(hardness) = problem.hardness else { return Ok(()) };
    let (value, Grid { nx, ny, .. }) = (hardness.mean(), problem.grid);
    let accepted = match hardness.map() {
        _ if !card.capabilities.hardness => "none: this method models no plastic flow; `fast`, `bvm` and `gfmd` do",
        _ if value.is_nan() || value <= 0.0 => "a positive stress",
        Some(_) if problem.wall != Wall::Hard => "one value: a map has no gap of first flow behind a soft wall",
        Some(map) if !map.is_on(nx, ny) => "a map on the grid of the surface",
        _ => return Ok(()),
    };
    let prefix = if hardness.map().is_some() { "a map, mean " } else { "" };
    refuse(card.id, "hardness", format!("{prefix}{value:e} E*"), accepted)
}

/// A pressure that the contact can carry: below `largest`, at which every node flows.
pub fn below_hardness(load: Load, largest: f64, id: &str) -> Result<()> {
    match load {
        Load::MeanGap(g) if largest < f64::INFINITY => {
            refuse(id, "mean gap", format!("{g:e} L"), "a pressure: with a hardness no other load is imposed")
        }
        Load::Pressure(p) if p >= largest => {
            let accepted = format!(
                "less than {largest:e} E*, at which every node flows: a smaller load (--pressure, [load]) or a larger hardness \
                 (--hardness, continuum.hardness, atoms.hardness)"
            );
            refuse(id, "pressure", format!("{p:e} E*"), accepted)
        }
        _ => Ok(()),
    }
}

/// A periodic, isotropic half-space, to which the closed forms of single asperities apply.
pub fn half_space(problem: &ReducedProblem, id: &str) -> Result<()> {
    problem.expect_periodic(id)?;
    match problem.kernel {
        Elastic::HalfSpace => Ok(()),
        kernel => refuse(id, "kernel", kernel, "a half-space"),
    }
}

/// No adhesion.
pub fn no_adhesion(problem: &ReducedProblem, id: &str) -> Result<()> {
    match problem.adhesion {
        AttractionLaw::None => Ok(()),
        adhesion => refuse(id, "adhesion", adhesion, "none: this method models no adhesion"),
    }
}

/// The pressure of a load (E*); tensile only if the method models adhesion (`tension`).
pub fn pressure(load: Load, tension: bool, id: &str) -> Result<f64> {
    match load {
        Load::Pressure(p) if p.is_finite() && (p > 0.0 || tension) => Ok(p),
        Load::Pressure(p) => refuse(
            id,
            "pressure",
            format!("{p:e} E*"),
            "a positive pressure: without adhesion no tension is in equilibrium",
        ),
        Load::MeanGap(g) => {
            refuse(id, "mean gap", format!("{g:e} L"), "a pressure; the method `fast` controls the mean gap")
        }
    }
}

/// A setting that must be positive and finite.
pub fn positive(value: f64, id: &str, key: &str) -> Result<f64> {
    if value > 0.0 && value.is_finite() { Ok(value) } else { refuse(id, key, value, "a positive number") }
}

/// Heights `[ny, nx]` on the nodes above the lowest one, L: an offset would cost digits.
pub fn heights_above_lowest<'p>(problem: &ReducedProblem<'p>) -> Cow<'p, [f64]> {
    let nodes = match problem.heights {
        super::Heights::Nodes(nodes) => Cow::Borrowed(nodes),
        heights => Cow::Owned(heights.on_nodes(problem.grid).into_owned()),
    };
    let low = lowest(&nodes);
    if low == 0.0 {
        return nodes;
    }
    let mut nodes = nodes.into_owned();
    nodes.iter_mut().for_each(|h| *h -= low);
    Cow::Owned(nodes)
}

/// The undeformed gap `max(h - depth, 0)` at the approach `depth`. Returns its mean.
pub fn undeformed_gap(heights: &[f64], depth: f64, gap: &mut Vec<f64>) -> f64 {
    gap.clear();
    gap.extend(heights.iter().map(|h| (h - depth).max(0.0)));
    mean(gap)
}

/// The contact fraction of spots with this total area over that of the cell. Beyond the whole cell independent spots overlap, and their
/// sum is no contact fraction.
pub fn contact_of_spots(sum: f64, pressure: f64, id: &str) -> Result<f64> {
    if sum <= 1.0 {
        return Ok(sum);
    }
    let accepted = format!("a lower pressure: there its contact spots add up to {sum:.3} times the cell");
    refuse(id, "pressure", format!("{pressure:e} E*"), accepted)
}

/// Summits of the surface, in the order of first contact.
///
/// # Errors
/// `Input` if there are none or if one is flat.
pub fn summits(
    grid: Grid,
    heights: &[f64],
    (fit, curvature): (SummitFit, SummitCurvature),
    id: &str,
) -> Result<Vec<Summit>> {
    let mut summits = asperity_surface::summits(grid, heights, fit, curvature);
    if summits.is_empty() {
        return refuse(id, "surface", "no summit", "a rough surface");
    }
    if let Some(flat) = summits.iter().find(|s| !s.radius.is_finite()) {
        let place = format!("a flat summit (plateau) at x = {:.4} L, y = {:.4} L", flat.x, flat.y);
        return refuse(id, "surface", place, "rounded summits");
    }
    summits.sort_by(|a, b| a.height.total_cmp(&b.height));
    Ok(summits)
}

/// Power spectrum of an isotropic surface, for a half-space with a hard wall.
///
/// # Errors
/// `Input`, in one line.
pub fn isotropic_power<'a>(problem: &ReducedProblem<'a>, id: &str) -> Result<&'a PowerSpectrum> {
    half_space(problem, id)?;
    hard_wall(problem, id)?;
    let power = problem.expect_power(id)?;
    let finite = power.shells.iter().all(|s| [s.q, s.height, s.gradient, s.curvature].iter().all(|v| v.is_finite()));
    if !finite || power.rms_gradient().is_nan() || power.rms_gradient() <= 0.0 {
        return refuse(id, "spectrum", "no power", "a rough surface");
    }
    if power.anisotropy > MOST_ANISOTROPIC {
        let accepted = format!("up to {MOST_ANISOTROPIC} (isotropic surfaces)");
        return refuse(id, "spectrum.anisotropy", format!("{:.2}", power.anisotropy), accepted);
    }
    Ok(power)
}

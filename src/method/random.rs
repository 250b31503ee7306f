//! What theories of a random surface ask of a problem, and refuse.

use super::{Load, Problem};
use crate::interface::{Elastic, Wall};
use crate::surface::Power;
use crate::{Error, Result};

/// Anisotropy of the power above which a surface is no isotropic random one. Realisations of the challenge's spectrum at
/// 128² to 512² have less than 0.2, ridges have 1.
const MOST_ANISOTROPIC: f64 = 0.3;

fn refuse<T>(id: &str, key: &str, found: impl ToString, accepted: impl Into<String>) -> Result<T> {
    Err(Error::input(format!("method {id}"), key, found, accepted))
}

/// A half-space under a hard wall: all that closed forms of single asperities and waves know.
///
/// # Errors
/// `Input`, in one line.
pub(super) fn expect_half_space(problem: &Problem, id: &str) -> Result<()> {
    if problem.kernel != Elastic::HalfSpace {
        return refuse(id, "kernel", problem.kernel, "an isotropic half-space, which the formulae are of");
    }
    if problem.wall != Wall::Hard {
        return refuse(id, "wall", "soft", "the hard wall, which the formulae are of");
    }
    Ok(())
}

/// The power of an isotropic surface on such a half-space.
///
/// # Errors
/// `Input`, in one line.
pub(super) fn expect_isotropic<'a>(problem: &Problem<'a>, id: &str) -> Result<&'a Power> {
    expect_half_space(problem, id)?;
    let power = problem.expect_power(id)?;
    let finite = power.shells.iter().all(|s| [s.q, s.height, s.gradient, s.curvature].iter().all(|v| v.is_finite()));
    if !finite || power.rms_gradient().is_nan() || power.rms_gradient() <= 0.0 {
        return refuse(id, "spectrum", "no power", "waves of some height");
    }
    if power.anisotropy > MOST_ANISOTROPIC {
        let accepted = format!("up to {MOST_ANISOTROPIC}: surfaces alike in all directions");
        return refuse(id, "spectrum.anisotropy", format!("{:.2}", power.anisotropy), accepted);
    }
    Ok(power)
}

/// The pressure that is imposed, which must press.
///
/// # Errors
/// `Input` for a mean gap and for pressures that do not press.
pub(super) fn expect_pressure(load: Load, id: &str) -> Result<f64> {
    match load {
        Load::Pressure(p) if p > 0.0 && p.is_finite() => Ok(p),
        Load::Pressure(p) => refuse(id, "pressure", p, "> 0: the method knows no pull"),
        Load::MeanGap(gap) => refuse(id, "mean gap", gap, "a pressure: the method imposes no gap"),
    }
}

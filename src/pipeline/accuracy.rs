//! Choice of grid, method, precision and tolerance for a requested accuracy, from measured tables.

use crate::compare::advice::{Limit, Table, Tables, Target, candidates, choose};
use crate::record::advice::{AccuracyChoice, Advice};
use crate::report::number::{duration, error_of};
use crate::scene::{AccuracyScene, Case, ContinuumScene, Scene, Surface, SurfaceScene};
use crate::{Error, Result};
use asperity_contact::interface::{Adhesion, RangeChoice};
use asperity_contact::method::Precision;
use asperity_contact::quantity::Quantity;
use std::path::{Path, PathBuf};

/// The tables have no setting for a request. The text names accepted values.
pub struct Unserved(pub String);

/// Resolves a scene. If it requests an accuracy, the setting is chosen from tables.
///
/// # Errors
/// Invalid input; an accuracy combined with a grid, method, precision or tolerance; an accuracy that the tables do not
/// support.
pub fn resolve_accuracy(mut scene: Scene, file: &Path) -> Result<Case> {
    let Some(requested) = scene.accuracy.clone() else { return Case::resolve(scene, file) };
    refuse_both(&scene, file)?;
    let case = Case::resolve(scene.clone(), file)?;
    let (tables, provenance) = tables(&requested, &case)?;
    let limit = match (requested.error, requested.budget.map(|t| t.to("s"))) {
        (Some(share), _) => Limit::Error(share),
        (None, Some(s)) => Limit::Seconds(s),
        (None, None) => unreachable!("checked with the scene"),
    };
    let advice =
        advise(&tables, &case, requested.quantity, limit, requested.extrapolate).map_err(|Unserved(accepted)| {
            let (key, found) = match limit {
                Limit::Error(e) => ("accuracy.error", e),
                Limit::Seconds(s) => ("accuracy.budget", s),
            };
            Error::input(file.display(), key, found, accepted)
        })?;
    if !matches!(case.surface, Surface::Imported { .. }) {
        scene.surface.grid = advice.grid;
    }
    let c = &mut scene.continuum;
    c.method = advice.method.clone();
    c.precision = if advice.precision == "f32" { Precision::F32 } else { Precision::F64 };
    c.tolerance = Some(advice.tolerance);
    // Plasticity needs frames of the whole block; the quantities of [accuracy] do not.
    let watched = scene.atoms.as_mut().is_some_and(|a| std::mem::take(&mut a.plasticity));
    let chosen = AccuracyChoice {
        quantity: requested.quantity,
        error: requested.error,
        budget_s: requested.budget.map(|t| t.to("s")),
        tables: provenance,
        advice,
    };
    let mut settled = Case { chosen: Some(chosen), ..Case::resolve(scene, file)? };
    if watched {
        let what = requested.quantity.name();
        settled
            .warnings
            .push(format!("atoms.plasticity is left out: {what} is the only requested quantity and does not need it"));
    }
    Ok(settled)
}

/// Refuses a scene with both an accuracy and a setting that the accuracy determines.
fn refuse_both(scene: &Scene, file: &Path) -> Result<()> {
    let (c, d) = (&scene.continuum, ContinuumScene::default());
    let given = [
        ("surface.grid", scene.surface.grid != SurfaceScene::default().grid),
        ("continuum.method", c.method != d.method),
        ("continuum.precision", c.precision != d.precision),
        ("continuum.tolerance", c.tolerance.is_some()),
    ];
    match given.iter().find(|(_, given)| *given) {
        None => Ok(()),
        Some((key, _)) => {
            let accepted = "none with [accuracy], which chooses it; or no [accuracy]";
            Err(Error::input(file.display(), *key, "given", accepted))
        }
    }
}

fn tables(requested: &AccuracyScene, case: &Case) -> Result<(Vec<Table>, String)> {
    read_tables(&requested.tables.iter().map(|t| case.resolve_path(t)).collect::<Vec<_>>())
}

/// Reads these table files, or the shipped tables if there are none. Returns the tables and their provenance.
///
/// # Errors
/// As [`Tables::read`].
pub fn read_tables(files: &[PathBuf]) -> Result<(Vec<Table>, String)> {
    if files.is_empty() {
        let shipped = Tables::shipped();
        return Ok((shipped.tables, format!("those of the program, made by {}", shipped.provenance)));
    }
    let mut list = Vec::new();
    for file in files {
        list.extend(Tables::read(file)?);
    }
    let names: Vec<String> = files.iter().map(|t| t.display().to_string()).collect();
    Ok((list, names.join(", ")))
}

/// Chooses the setting for a case: within the measured range, or, if `extrapolate`, beyond it.
pub fn advise(
    tables: &[Table],
    case: &Case,
    quantity: Quantity,
    limit: Limit,
    extrapolate: bool,
) -> std::result::Result<Advice, Unserved> {
    let all = candidates(tables, &target(case), quantity);
    let (known, beyond): (Vec<Advice>, Vec<Advice>) =
        all.into_iter().partition(|a| extrapolate || a.extrapolated.is_empty());
    choose(&known, quantity, limit).cloned().ok_or_else(|| Unserved(accepted(&known, &beyond, quantity, limit)))
}

fn target(case: &Case) -> Target {
    Target {
        shortest_wavelength: shortest_wavelength(&case.surface),
        hurst: hurst(&case.surface),
        own_grid: matches!(case.surface, Surface::Imported { .. }).then_some(case.grid.nx),
        aspect: case.grid.ny as f64 / case.grid.nx as f64,
        kernel: case.kernel.to_string(),
        adhesion: (case.adhesion != Adhesion::None).then(|| adhesion_label(case)),
        p_star: case.loading_p_star(),
    }
}

/// Adhesion as named in tables. With a true range on every grid, coarse grids may not resolve it and the problem
/// differs from the default, so the text states it.
pub(super) fn adhesion_label(case: &Case) -> String {
    match case.range() {
        RangeChoice::True if case.adhesion != Adhesion::None => format!("{}, true on every grid", case.adhesion),
        _ => case.adhesion.to_string(),
    }
}

/// Shortest wavelength of a surface, units of L; for a height map, two grid spacings.
pub fn shortest_wavelength(surface: &Surface) -> f64 {
    match surface {
        Surface::Synthesised { spectrum, .. } => spectrum.lambda_s,
        Surface::Fourier { modes, .. } => modes.shortest(),
        Surface::Imported { grid, .. } => 2.0 * grid.dx(),
    }
}

/// Hurst exponent of a surface that is synthesised from a spectrum.
pub(super) fn hurst(surface: &Surface) -> Option<f64> {
    match surface {
        Surface::Synthesised { spectrum, .. } => Some(spectrum.hurst),
        _ => None,
    }
}

fn accepted(known: &[Advice], beyond: &[Advice], quantity: Quantity, limit: Limit) -> String {
    if let Some(a) = choose(beyond, quantity, limit) {
        return format!(
            "a limit that a measured setting reaches. Not measured: {}. The estimate is {} on {} points per side, error {} to {}; accept it with --extrapolate \
             (in a scene accuracy.extrapolate = true)",
            a.extrapolated.join("; "),
            a.method,
            a.grid,
            error_of(quantity, a.error_range[0]),
            error_of(quantity, a.error_range[1])
        );
    }
    let best = choose(known, quantity, Limit::Seconds(f64::INFINITY));
    match (limit, best) {
        (_, None) => {
            format!("another quantity: the tables have no {} of such a scene", quantity.name())
        }
        (Limit::Error(_), Some(a)) => {
            format!("at least {}, the least that the tables have", error_of(quantity, a.expected_error))
        }
        (Limit::Seconds(_), Some(_)) => {
            let least = known.iter().map(|a| a.expected_seconds).fold(f64::INFINITY, f64::min);
            format!("at least {}, the least that the tables have", duration(least))
        }
    }
}

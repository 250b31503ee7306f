//! Stress below the surface of a state, at the depths that a scene requests.

use crate::interface::{Elastic, StressField, Subsurface, SubsurfaceRequest};
use crate::method::ReducedProblem;
use crate::state::{Peak, SubsurfaceResults, SubsurfaceSlice};
use asperity_grid::{Error, Result};
use asperity_grid::{Field, Grid};
use rayon::prelude::*;

/// Quantities of a slice whose maps are passed on.
const MAPS: [&str; 2] = ["von-mises", "shear"];

/// Bodies whose stresses are known.
pub const ISOTROPIC: &str = "an isotropic body: a half-space or a layer";

/// Name of a map, without the number of a load and the extension: `QUANTITY-depth-K`, depths from 1.
pub fn subsurface_map(quantity: &str, depth: usize) -> String {
    format!("{quantity}-depth-{}", depth + 1)
}

/// Whether a file name, without the number of a load, is a [`subsurface_map`].
pub fn is_subsurface_map(name: &str) -> bool {
    let parts = name.strip_suffix(".npy").and_then(|n| n.rsplit_once("-depth-"));
    parts.is_some_and(|(quantity, k)| MAPS.contains(&quantity) && k.parse::<usize>().is_ok())
}

/// Bytes for the stresses of a problem.
pub fn subsurface_bytes(problem: &ReducedProblem) -> u64 {
    Subsurface::bytes(problem.grid, problem.kernel) + (2 * size_of::<f64>() * problem.grid.points()) as u64
}

/// Stresses below the pressure `[ny, nx]` (E*) of a state. `map` receives the number of the depth, the quantity
/// (`von-mises` or `shear`) and its values `[ny, nx]` (E*), and returns the name of the file where it is stored, if it is.
///
/// # Errors
/// `Input` for a crystal; those of `map`.
pub fn subsurface(
    request: &SubsurfaceRequest,
    (grid, kernel): (Grid, Elastic),
    pressure: Field,
    mut map: impl FnMut(usize, &'static str, &[f64]) -> Result<Option<String>>,
) -> Result<SubsurfaceResults> {
    let body = Subsurface::new(grid, kernel, request.poisson, pressure);
    let body = body.ok_or_else(|| Error::input("subsurface", "body", kernel, ISOTROPIC))?;
    let mut slices = Vec::new();
    for (k, &depth) in request.depths.iter().enumerate() {
        let stresses = body.at(depth);
        let fields = equivalents(&stresses, grid.points());
        drop(stresses);
        let mut peaks = Vec::new();
        for (name, field) in MAPS.into_iter().zip(&fields) {
            let highest = (0..field.len()).max_by(|&i, &j| field[i].total_cmp(&field[j])).unwrap_or(0);
            let (x, y) = ((highest % grid.nx) as f64 * grid.dx(), (highest / grid.nx) as f64 * grid.dy());
            peaks.push(Peak { value: field[highest], x, y, depth, map: map(k, name, field)? });
        }
        let [shear, von_mises] = [peaks.pop(), peaks.pop()].map(|p| p.expect("one of each quantity"));
        slices.push(SubsurfaceSlice { depth, von_mises, shear });
    }
    Ok(SubsurfaceResults::new(body.poisson(), slices, request.shear_strength))
}

/// Stress after von Mises, and largest shear stress.
fn equivalents(stresses: &StressField, points: usize) -> [Vec<f64>; 2] {
    let (von_mises, shear) = (0..points).into_par_iter().map(|i| <(f64, f64)>::from(stresses.equivalent(i))).unzip();
    [von_mises, shear]
}

//! What a benchmark is to measure, and the check of its grids.

use super::benchmark_point::{self, COARSEST, GRIDS_BELOW};
use crate::record::tradeoff::BlockSize;
use crate::scene::Case;
use crate::{Error, Result};
use asperity_contact::method::ContactMethod;
use asperity_surface::HeightSource;

const PLACE: &str = "command line";

/// Points per side of the finest grid, as in scenes.
const FINEST: usize = 65_536;

/// Request for a benchmark.
pub struct TradeoffRequest {
    pub methods: Vec<&'static dyn ContactMethod>,
    /// Points per side, each a divisor of the reference's. Default: the scene's, one half and one quarter of it.
    pub grids: Option<Vec<usize>>,
    /// Points per side of the reference. Default: the scene's.
    pub reference: Option<usize>,
    /// Wall time of all stages, with earlier runs in the same folder, after which no setting begins, s.
    pub budget_seconds: Option<f64>,
    /// Runs of each setting. Default: one, and more for short settings.
    pub repeats: Option<usize>,
    /// Blocks of atoms. Default: those of a scene with atoms, if `all-atom` is among the methods.
    pub blocks: Option<Vec<BlockSize>>,
}

impl TradeoffRequest {
    /// Points per side of the reference, and of the grids in the order in which they run.
    pub(super) fn grids(&self, case: &Case, warnings: &mut Vec<String>) -> Result<(usize, Vec<usize>)> {
        let full_grid = case.model.grid.nx;
        let reference = self.reference.unwrap_or(full_grid);
        let range = |key: &str, n: usize| match (COARSEST..=FINEST).contains(&n) {
            true => Ok(()),
            false => Err(Error::input(PLACE, key, n, format!("{COARSEST} to {FINEST} points per side"))),
        };
        if self.reference.is_some() {
            range("--reference", reference)?;
            if matches!(case.surface(), HeightSource::Imported { .. }) && reference != full_grid {
                let accepted = format!("{full_grid}, the map's own: a height map has no finer grid");
                return Err(Error::input(PLACE, "--reference", reference, accepted));
            }
            if self.grids.is_none() && !reference.is_multiple_of(full_grid) {
                let accepted =
                    format!("a multiple of the scene's {full_grid} points per side, or --grids that divide it");
                return Err(Error::input(PLACE, "--reference", reference, accepted));
            }
        }
        let mut list = Vec::new();
        match &self.grids {
            Some(given) => {
                for &n in given {
                    range("--grids", n)?;
                    if !reference.is_multiple_of(n) {
                        let accepted =
                            format!("divisors of the reference's {reference} points per side: nodes must coincide");
                        return Err(Error::input(PLACE, "--grids", n, accepted));
                    }
                    benchmark_point::on_grid(case, n).map_err(|e| e.with_context(PLACE, Some("--grids")))?;
                    if !list.contains(&n) {
                        list.push(n);
                    }
                }
            }
            None => {
                for n in benchmark_point::halves(full_grid, GRIDS_BELOW) {
                    match benchmark_point::on_grid(case, n) {
                        Ok(_) => list.push(n),
                        Err(e) => warnings.push(format!("no grid of {n} points per side: {e}")),
                    }
                }
            }
        }
        list.sort_unstable_by(|a, b| b.cmp(a));
        // The scene's own grid runs first, if it is in the list; the others follow from fine to coarse.
        if let Some(i) = list.iter().position(|n| *n == full_grid) {
            list[..=i].rotate_right(1);
        }
        Ok((reference, list))
    }
}

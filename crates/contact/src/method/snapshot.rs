//! States within a solve, from which it can continue.

use asperity_grid::sys::ranks::Ranks;
use asperity_grid::{Error, Result};
use asperity_grid::{Field, Grid};
use serde::de::DeserializeOwned;

/// A state from which [`SolverRun::resume`](super::SolverRun::resume) can continue, with borrowed fields.
#[derive(Debug, Clone)]
pub struct SnapshotRef<'a> {
    /// Present grid of the solver.
    pub grid: Grid,
    /// Whose rows the fields are, as in [`Equilibrium`](super::Equilibrium).
    pub ranks: &'a Ranks,
    /// Gap `[ny, nx]`, L.
    pub gap: Field<'a>,
    /// A second field `[ny, nx]` that the method needs: velocities or a search direction.
    pub auxiliary: Option<Field<'a>>,
    /// Plastic displacement `[ny, nx]` of the loads before, L; `None` without.
    pub plastic: Option<Field<'a>>,
    /// Scalars of the iteration, in the method's own format.
    pub progress: serde_json::Value,
}

/// A stored snapshot; fields as in [`SnapshotRef`], of a shared grid the rows of this rank.
#[derive(Debug, Clone)]
pub struct SolverSnapshot {
    pub grid: Grid,
    pub gap: Vec<f64>,
    pub auxiliary: Option<Vec<f64>>,
    pub plastic: Option<Vec<f64>>,
    pub progress: serde_json::Value,
}

impl SolverSnapshot {
    /// Gap `[ny, nx]` (L) and the scalars of method `id`.
    ///
    /// # Errors
    /// `Input` if the snapshot is not of method `id` on `grid`.
    pub fn restore<P: DeserializeOwned>(self, grid: Grid, id: &str) -> Result<(Vec<f64>, P)> {
        self.restore_rows(grid, grid.ny, id)
    }

    /// As [`SolverSnapshot::restore`], of `rows` rows of the gap.
    pub(super) fn restore_rows<P: DeserializeOwned>(self, grid: Grid, rows: usize, id: &str) -> Result<(Vec<f64>, P)> {
        let progress =
            serde_json::from_value(self.progress).map_err(|e| foreign(grid, id, "progress", e.to_string()))?;
        let points = Grid { ny: rows, ..grid }.points();
        match self.gap.len() {
            len if len == points => Ok((self.gap, progress)),
            len => Err(foreign(grid, id, "gap", format!("{len} values"))),
        }
    }

    /// Gap and auxiliary field `[ny, nx]`, and the scalars of method `id`.
    ///
    /// # Errors
    /// As [`SolverSnapshot::restore`], and `Input` if there is no auxiliary field.
    pub fn restore_pair<P: DeserializeOwned>(mut self, grid: Grid, id: &str) -> Result<(Vec<f64>, Vec<f64>, P)> {
        let auxiliary = self.auxiliary.take().ok_or_else(|| foreign(grid, id, "auxiliary", "nothing".into()))?;
        let (gap, progress) = self.restore(grid, id)?;
        match auxiliary.len() {
            len if len == grid.points() => Ok((gap, auxiliary, progress)),
            len => Err(foreign(grid, id, "auxiliary", format!("{len} values"))),
        }
    }
}

fn foreign(grid: Grid, id: &str, key: &str, found: String) -> Error {
    let accepted = format!("a snapshot of method {id} on {} x {} points", grid.nx, grid.ny);
    Error::input("checkpoint", key, found, accepted)
}

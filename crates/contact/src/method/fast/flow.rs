//! The surface under plastic flow: the flow of a finished load becomes part of the heights.

use super::FastRun;
use super::window::ComputationCell;
use crate::interface::Law;
use crate::method::plastic::PlasticFlow;
use crate::method::residuals::Residuals;
use crate::method::{Heights, ReducedProblem};
use crate::observe::Plasticity;
use asperity_grid::{Real, Series, lowest, mean, rms};

impl<T: Real, L: Law> FastRun<'_, T, L> {
    /// Heights of the surface after plastic flow, and their rms. Sets the origin of the approach of a padded cell.
    pub(super) fn heights_of(
        problem: &ReducedProblem,
        cell: &mut ComputationCell,
        flow: &PlasticFlow<T>,
    ) -> (Series<T>, f64) {
        if cell.is_padded() {
            let mut nodes = problem.heights.on_nodes(problem.grid);
            if flow.has_begun() {
                nodes = (0..nodes.len()).map(|i| flow.height(&nodes, i)).collect();
            }
            let field = cell.continued(&nodes);
            cell.mean_height = mean(&field) - lowest(&problem.heights.on_nodes(problem.grid));
            return (Series::from_nodes(cell.grid, &field), rms(&nodes));
        }
        let series: Series<T> = match problem.heights {
            Heights::Nodes(nodes) if flow.has_begun() => Series::through(problem.grid, &|i| flow.height(nodes, i)),
            Heights::Series(waves) if flow.has_begun() => {
                let displacement = flow.displacement();
                Series::through(problem.grid, &|i| displacement[i].wide()).plus(waves)
            }
            Heights::Nodes(nodes) => Series::from_nodes(problem.grid, nodes),
            Heights::Series(series) => return (series.converted(), series.whole_rms()),
            Heights::Planned(_) => unreachable!("a solve has heights"),
        };
        let rms = series.rms();
        (series, rms)
    }

    /// The heights of the surface after plastic flow, in place of those before.
    pub(super) fn displace(&mut self) {
        self.heights = Series::default();
        (self.heights, _) = Self::heights_of(self.problem, &mut self.cell, &self.flow);
    }

    /// Moves the flow of a load from its gap to the heights of the next.
    pub(super) fn yielded(&mut self, residuals: &mut Residuals, converged: bool) -> Option<Plasticity> {
        let (window, nx) = (self.cell.window(self.cell.grid), self.cell.grid.nx);
        // The heights of a padded cell keep the origin of the approach.
        let previous = if self.cell.is_padded() { 0.0 } else { self.flow.mean() };
        residuals.mean_separation -= previous;
        let layout = [window.nx, nx, window.points()];
        let plasticity = self.flow.take(&self.law, &mut self.gap, (layout, converged), residuals)?;
        if residuals.flow > 0.0 && converged {
            self.displace();
        }
        Some(plasticity)
    }
}

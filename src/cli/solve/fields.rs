//! Fields of the states of a solve, of which every rank has its rows: their files, and what the report needs of them.

use super::SolveArgs;
use crate::Result;
use crate::scene::Case;
use asperity_contact::interface::AttractionLaw;
use asperity_contact::method::{Equilibrium, Heights, Stop};
use asperity_contact::observe::contact_map;
use asperity_contact::path::LoadPathSolver;
use asperity_grid::sys::ranks::Ranks;
use asperity_grid::units::Scales;
use asperity_grid::{Field, Grid, mean, sum_rows, sums_of_ranks};
use asperity_surface::files::npy;
use std::borrow::Cow;
use std::path::Path;

/// What all ranks do with the fields of a state.
pub(super) struct FieldWriter<'a> {
    solve: &'a SolveArgs,
    out: Option<&'a Path>,
    /// Number of loads.
    loads: usize,
    /// Whether there is adhesion on this grid, and whether it was requested.
    adhesive: [bool; 2],
    subsurface: bool,
    grid: Grid,
    /// Those of the problem; a small grid is whole on each.
    ranks: &'a Ranks,
    scales: Scales,
    /// Of two bodies each one's share in the deformation, with the heights on all nodes.
    bodies: Option<(Vec<f64>, Cow<'a, [f64]>)>,
}

/// What the report needs of the fields of all ranks.
pub(super) struct OfFields {
    /// Fraction of the nodes that are in contact and under compression, where adhesion was requested.
    pub compressive: Option<f64>,
    /// Whole fields on the first of several ranks, where a quantity needs them.
    gap: Option<Vec<f64>>,
    stress: Option<Vec<f64>>,
}

impl OfFields {
    /// The gap `[ny, nx]`, on the first rank, for the flow through it.
    pub(super) fn gap<'f>(&'f self, state: &Equilibrium<'f>) -> Field<'f> {
        self.gap.as_deref().map_or(state.gap, Field::F64)
    }

    /// The stress `[ny, nx]`, on the first rank, for the stress below it.
    pub(super) fn stress<'f>(&'f self, state: &Equilibrium<'f>) -> Field<'f> {
        self.stress.as_deref().map_or(state.stress, Field::F64)
    }
}

impl<'a> FieldWriter<'a> {
    pub(super) fn new(solve: &'a SolveArgs, case: &Case, path: &LoadPathSolver<'a>, loads: usize) -> Self {
        let problem = path.problem();
        let nodes = || match problem.heights {
            Heights::Nodes(nodes) => Cow::Borrowed(nodes),
            ref series => Cow::Owned(series.on_nodes(problem.grid).into_owned()),
        };
        FieldWriter {
            solve,
            out: solve.out.as_deref(),
            loads,
            adhesive: [path.adhesion(), case.model.adhesion].map(|law| law != AttractionLaw::None),
            subsurface: case.subsurface().is_some(),
            grid: path.problem().grid,
            ranks: path.problem().ranks,
            scales: case.scales,
            bodies: (solve.body.len() == 2 && solve.out.is_some() && !problem.ranks.are_several())
                .then(|| (case.laboratory.shares(), nodes())),
        }
    }

    /// Writes the fields of load `i`. Collective.
    ///
    /// # Errors
    /// I/O, on any rank.
    pub(super) fn state(&self, i: usize, state: &Equilibrium) -> Result<OfFields> {
        self.write(i, state)?;
        let (ranks, grid) = (state.ranks, self.grid);
        let presses = |i: &usize| state.gap.at(*i) <= 0.0 && state.stress.at(*i) > 0.0;
        let in_row = |y: usize| [(y * grid.nx..(y + 1) * grid.nx).filter(presses).count() as f64];
        // Without adhesion all contact is compressive.
        let compressive = self.adhesive[1].then(|| {
            let own = sum_rows(state.gap.len() / grid.nx, in_row);
            let [nodes] = sums_of_ranks(ranks, ranks.count(), &[own]);
            nodes / grid.points() as f64
        });
        let gathered = |is_needed: bool, field: Field| {
            let gather = || ranks.gather_on_first(&field.to_vec(), &ranks.shares(grid.ny, grid.nx));
            (is_needed && ranks.are_several()).then(gather)
        };
        Ok(OfFields {
            compressive,
            gap: gathered(self.solve.leakage, state.gap),
            stress: gathered(self.subsurface && state.stop == Stop::Converged, state.stress),
        })
    }

    fn write(&self, i: usize, state: &Equilibrium) -> Result<()> {
        let Some(out) = self.out.filter(|_| self.ranks.is_first() || state.ranks.are_several()) else {
            return Ok(());
        };
        let (ranks, shape) = (state.ranks, [self.grid.nx, self.grid.ny]);
        let Scales { length_m: length, modulus_pa: modulus } = self.scales;
        let path = |name: &str| out.join(file_name(i, self.loads, state.stop, name));
        let write = |name: &str, field, unit| npy::write_field_on_ranks(ranks, &path(name), shape, field, unit);
        write("gap.npy", state.gap, length)?;
        if self.adhesive[0] {
            write("stress.npy", state.stress, modulus)?;
        } else {
            npy::write_contact_pressure(ranks, &path("stress.npy"), shape, state.gap, state.stress, modulus)?;
        }
        if let Some(plastic) = state.plastic {
            write("plastic.npy", plastic, length)?;
        }
        if self.solve.elastic_stress {
            write("elastic-stress.npy", state.stress, modulus)?;
        }
        if let Some((shares, heights)) = &self.bodies {
            let displacement = displacement(state, heights);
            for (k, share) in shares.iter().enumerate() {
                write(&format!("displacement-{}.npy", k + 1), Field::F64(&displacement), share * length)?;
            }
        }
        npy::write_on_ranks(ranks, &path("contact.npy"), shape, contact_map(state.gap, 0.0))
    }
}

/// Elastic displacement into the bodies `[ny, nx]` about its mean: the gap without the heights and their plastic change.
fn displacement(state: &Equilibrium, heights: &[f64]) -> Vec<f64> {
    let plastic = |i: usize| state.plastic.map_or(0.0, |field| field.at(i));
    let mut values: Vec<f64> = (0..heights.len()).map(|i| state.gap.at(i) - heights[i] - plastic(i)).collect();
    let mean = mean(&values);
    values.iter_mut().for_each(|v| *v -= mean);
    values
}

/// Name of a file of load `i` of `count`. It distinguishes a state that did not converge.
pub(super) fn file_name(i: usize, count: usize, stop: Stop, name: &str) -> String {
    let prefix = if stop == Stop::Converged { "" } else { "partial-" };
    if count == 1 { format!("{prefix}{name}") } else { format!("{prefix}{}-{name}", load_name(i, count)) }
}

/// Name of load `i` of `count` in file names: numbers of equal length sort as the loads do.
pub(super) fn load_name(i: usize, count: usize) -> String {
    let digits = count.to_string().len();
    format!("load-{:0digits$}", i + 1)
}

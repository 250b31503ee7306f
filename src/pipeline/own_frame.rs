//! One frame of an own LAMMPS run: contact and gap of the substrate's surface layer under the scene's surface.

use crate::scene::Case;
use crate::{Error, Result};
use asperity_atoms::contact::ContactAtoms;
use asperity_atoms::dump::DumpFrame;
use asperity_atoms::own_run::{Bodies, BodyTypes, box_edges, nearest_distances, uncovered};
use asperity_atoms::planar_cells::PlanarCells;
use asperity_grid::sys::expect_memory;
use asperity_grid::{Grid, bilinear, mean, rms};
use std::path::PathBuf;

/// Nodes per contact distance of the surface that atoms are near to: distances to the nearest node are then at most 0.2 % too long.
const NODES_PER_DISTANCE: f64 = 12.0;

/// Largest rms distance of the indenter's lowest atoms from the scene's surface over its rms height. Of another surface it is √2, turned
/// upside down 2, of a flat 1.
const FIT: f64 = 0.7;

/// Depth below the contact distance, over it, at which no wall and no atom carries most of a surface layer.
const TOO_DEEP: f64 = 0.5;

/// Contact distances of the sensitivity curve over d_c: first and last, and number.
const DISTANCES: (f64, f64, usize) = (0.95, 1.1, 15);

/// What the user of an own run knows of it.
#[derive(Debug, Clone)]
pub struct OwnRun {
    pub types: BodyTypes,
    /// Height of the mean plane of the indenter's surface in each frame, or one for all, Å; empty: the indenter's atoms tell it.
    pub indenter_z: Vec<f64>,
    /// d_c, Å.
    pub contact_distance: f64,
    pub load: Option<OwnLoad>,
}

/// Where the load of a frame is known from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum OwnLoad {
    /// Frame K has load K of the scene.
    Scene,
    /// Sum of fz over the indenter's atoms, before fix setforce, over the box and the E* of the scene.
    Fz,
}

/// The surface over the box.
pub(super) struct Profile {
    /// Grid of maps and continuum.
    pub grid: Grid,
    fine: Grid,
    /// Heights on `fine` about their mean, over the box's edge along x.
    heights: Vec<f64>,
}

impl Profile {
    /// Over a box of this edge, Å. Nodes resolve the contact distance, unless the indenter is that of `[atoms]`, which its own nodes resolve.
    fn of(case: &Case, run: &OwnRun, edge: f64) -> Result<Self> {
        let (grid, low_pass, stretch) = match &case.atoms {
            Some(atoms) => (atoms.matched, atoms.low_pass, atoms.stretch),
            None => (case.model.grid, 0.0, 1.0),
        };
        let refined = match case.atoms.is_some() && !run.types.indenter.is_empty() {
            true => 1,
            false => {
                (NODES_PER_DISTANCE * grid.dx().max(grid.dy()) * edge / run.contact_distance).ceil().max(1.0) as usize
            }
        };
        let fine = Grid { nx: refined * grid.nx, ny: refined * grid.ny, ..grid };
        let description = format!("the surface on {} x {} points", fine.nx, fine.ny);
        expect_memory(description, 8 * 8 * fine.points() as u64, "a smaller box needs less")?;
        let mut heights = case.surface().heights(fine, low_pass);
        let middle = mean(&heights);
        heights.iter_mut().for_each(|h| *h = (*h - middle) * stretch);
        Ok(Profile { grid, fine, heights })
    }

    /// Height above the mean plane over the box's edge along x; x and y over the same.
    fn at(&self, x: f64, y: f64) -> f64 {
        bilinear(self.fine, |k| self.heights[k], x, y)
    }

    /// Heights, and those that a ball of this radius (over the box's edge) meets, on the grid of the continuum.
    pub(super) fn heights(&self, radius: f64) -> [Vec<f64>; 2] {
        let (every, nx) = (self.fine.nx / self.grid.nx, self.grid.nx);
        let node = |k: usize| k / nx * every * self.fine.nx + k % nx * every;
        let dilated = asperity_surface::dilate_by_ball(self.fine, &self.heights, radius);
        [&self.heights, &dilated].map(|fine| (0..self.grid.points()).map(|k| fine[node(k)]).collect())
    }

    /// The nodes as atoms of the indenter, whose mean plane is at `z`, Å.
    fn nodes(&self, [along_x, along_y]: [f64; 2], z: f64) -> Vec<[f64; 3]> {
        let Grid { nx, ny, .. } = self.fine;
        let over = |k: usize, n: usize, edge: f64| k as f64 * edge / n as f64;
        let node = |(k, h): (usize, &f64)| [over(k % nx, nx, along_x), over(k / nx, ny, along_y), z + h * along_x];
        self.heights.iter().enumerate().map(node).collect()
    }
}

/// The surface layer of the substrate: the atoms that no other covers from above in the first frame.
pub(super) struct SurfaceLayer {
    ids: Vec<u32>,
    /// Over the box's edge along x.
    pub positions: Vec<[f64; 2]>,
    pub cells: PlanarCells,
}

/// What an own run gives to every frame.
pub(super) struct OwnFrames<'a> {
    pub run: &'a OwnRun,
    pub profile: Profile,
    pub layer: SurfaceLayer,
    /// Edges of the box in the first frame, Å.
    pub edges: [f64; 2],
}

/// Contact and gap of one frame.
pub(super) struct AnalysedFrame {
    pub file: PathBuf,
    pub timestep: u64,
    /// Height of the mean plane of the indenter's surface, Å.
    pub indenter_z: f64,
    pub contact: ContactAtoms,
    /// Gap of each surface atom: height of the surface above it, less d_c, Å.
    pub gaps: Vec<f64>,
    pub sensitivity: Vec<[f64; 2]>,
    /// Force on the indenter, eV/Å, if the load is known by it.
    pub force: Option<f64>,
}

/// Positions from the lower corner of the box along x and y, Å.
fn positions(frame: &DumpFrame, atoms: &[usize]) -> Vec<[f64; 3]> {
    let [[x0, _], [y0, _], _] = frame.bounds;
    atoms.iter().map(|&k| frame.positions[k]).map(|[x, y, z]| [x - x0, y - y0, z]).collect()
}

impl<'a> OwnFrames<'a> {
    /// Finds the surface layer in the first frame.
    pub(super) fn begin(case: &Case, run: &'a OwnRun, first: &DumpFrame) -> Result<Self> {
        let grid = case.model.grid;
        let edges = box_edges(first, grid.ly / grid.lx)?;
        let profile = Profile::of(case, run, edges[0])?;
        let substrate = run.types.of(first)?.substrate;
        let points = positions(first, &substrate);
        let top = uncovered(&points, edges);
        let planar: Vec<[f64; 2]> = top.iter().map(|&k| [points[k][0], points[k][1]]).collect();
        let spacing = (edges[0] * edges[1] / top.len() as f64).sqrt();
        let over = |c: f64, axis: usize| (c / edges[axis]).rem_euclid(1.0) * edges[axis] / edges[0];
        let layer = SurfaceLayer {
            ids: top.iter().map(|&k| first.ids[substrate[k]]).collect(),
            positions: planar.iter().map(|&[x, y]| [over(x, 0), over(y, 1)]).collect(),
            cells: PlanarCells::new(&planar, edges, spacing),
        };
        Ok(OwnFrames { run, profile, layer, edges })
    }

    /// Contact and gap in frame `index` of the run.
    pub(super) fn analyse(&self, index: usize, frame: &DumpFrame) -> Result<AnalysedFrame> {
        let (run, layer) = (self.run, &self.layer);
        let edges = box_edges(frame, self.profile.grid.ly / self.profile.grid.lx)?;
        let bodies = run.types.of(frame)?;
        let indenter_z = match run.indenter_z[..] {
            [] => self.fitted(frame, &bodies, edges)?,
            [one] => one,
            ref list => *list.get(index).ok_or_else(|| wrong_count(list.len(), "more"))?,
        };
        let indenter = match bodies.indenter.is_empty() {
            true => self.profile.nodes(edges, indenter_z),
            false => positions(frame, &bodies.indenter),
        };
        let points = positions(frame, &bodies.substrate);
        let d_c = run.contact_distance;
        let distances = nearest_distances(&points, &indenter, edges, d_c * DISTANCES.1);
        let contact = |limit: f64| {
            let near = bodies.substrate.iter().zip(&distances).filter(|(_, d)| **d < limit);
            let ids: Vec<u32> = near.map(|(&k, _)| frame.ids[k]).collect();
            let sites: Vec<bool> = layer.ids.iter().map(|id| ids.binary_search(id).is_ok()).collect();
            let below_surface = ids.len() - sites.iter().filter(|t| **t).count();
            ContactAtoms { sites, ids, below_surface }
        };
        let (from, to, n) = DISTANCES;
        let limits = (0..n).map(|k| d_c * (from + (to - from) * k as f64 / (n - 1) as f64));
        Ok(AnalysedFrame {
            file: frame.source.clone(),
            timestep: frame.timestep,
            indenter_z,
            contact: contact(d_c),
            gaps: self.gaps(frame, indenter_z, edges)?,
            sensitivity: limits.map(|limit| [limit, contact(limit).fraction()]).collect(),
            force: (run.load == Some(OwnLoad::Fz)).then(|| force(frame, &bodies)).transpose()?,
        })
    }

    /// Height of the surface above each surface atom, less d_c, Å.
    fn gaps(&self, frame: &DumpFrame, indenter_z: f64, edges: [f64; 2]) -> Result<Vec<f64>> {
        let ([[x0, _], [y0, _], _], d_c) = (frame.bounds, self.run.contact_distance);
        let gap = |&id: &u32| {
            let accepted = "every atom of the surface layer of the first frame";
            let missing =
                || Error::format(&frame.source, format!("timestep {}: no atom {id}", frame.timestep), accepted);
            let [x, y, z] = frame.position(id).ok_or_else(missing)?;
            let gap = indenter_z + self.profile.at((x - x0) / edges[0], (y - y0) / edges[0]) * edges[0] - z - d_c;
            if gap < -2.0 * d_c {
                let found = format!(
                    "timestep {}: atom {id} is {:.3} Å above the indenter's surface",
                    frame.timestep,
                    -gap - d_c
                );
                let accepted =
                    "a substrate below it: --indenter-z is the height of the mean plane of the scene's surface";
                return Err(Error::format(&frame.source, found, accepted));
            }
            Ok(gap)
        };
        let gaps: Vec<f64> = self.layer.ids.iter().map(gap).collect::<Result<_>>()?;
        let deep = gaps.iter().filter(|gap| **gap < -TOO_DEEP * d_c).count();
        if 2 * deep > gaps.len() {
            let found = format!(
                "timestep {}: most atoms of the surface layer are less than {} d_c from the indenter's surface",
                frame.timestep,
                1.0 - TOO_DEEP
            );
            let accepted = "a surface layer of the substrate's atoms: --substrate-types leaves out others, such as the indenter's; or a smaller \
                            --contact-distance";
            return Err(Error::format(&frame.source, found, accepted));
        }
        Ok(gaps)
    }

    /// Height of the mean plane of the surface that the indenter's lowest atoms follow, Å.
    ///
    /// # Errors
    /// `Format` for too few atoms, and atoms that do not follow the surface.
    fn fitted(&self, frame: &DumpFrame, bodies: &Bodies, edges: [f64; 2]) -> Result<f64> {
        let mirrored: Vec<[f64; 3]> =
            positions(frame, &bodies.indenter).into_iter().map(|[x, y, z]| [x, y, -z]).collect();
        let low = uncovered(&mirrored, edges);
        let spacing = (edges[0] * edges[1] / low.len() as f64).sqrt();
        let at = format!("timestep {}", frame.timestep);
        if spacing > 2.0 * self.run.contact_distance {
            let found =
                format!("{at}: {} lowest atoms of the indenter, one per {spacing:.1} Å x {spacing:.1} Å", low.len());
            let accepted = "all atoms of the indenter's surface, less than 2 d_c apart; or --indenter-z";
            return Err(Error::format(&frame.source, found, accepted));
        }
        let above = |&k: &usize| {
            -mirrored[k][2] - self.profile.at(mirrored[k][0] / edges[0], mirrored[k][1] / edges[0]) * edges[0]
        };
        let heights: Vec<f64> = low.iter().map(above).collect();
        let (z, height) = (mean(&heights), rms(&self.profile.heights) * edges[0]);
        let off = rms(&heights);
        if off > FIT * height {
            let found = format!(
                "{at}: an indenter {off:.2} Å (rms) off the scene's surface, whose rms height is {height:.2} Å"
            );
            let accepted = "its surface over the box: rows along x, from the lower corner, heights upwards, low points in contact first";
            return Err(Error::format(&frame.source, found, accepted));
        }
        Ok(z)
    }
}

/// Force on the indenter, upwards, eV/Å.
fn force(frame: &DumpFrame, bodies: &Bodies) -> Result<f64> {
    let list = bodies.indenter.iter().map(|&k| frame.forces_z.get(k).copied());
    let found = match list.sum::<Option<f64>>() {
        Some(sum) if sum.is_finite() => return Ok(sum),
        Some(_) => "forces fz of the indenter's atoms that are no numbers",
        None => "no column fz",
    };
    Err(Error::format(&frame.source, format!("timestep {}: {found}", frame.timestep), FORCES))
}

/// What `--load fz` needs.
pub(super) const FORCES: &str =
    "--load fz: forces of the pair interaction, before fix setforce, which zeroes them; or --load scene";

/// The refusal of a list of heights that is no list of one for each frame. `frames`: "more", or their number.
pub(super) fn wrong_count(heights: usize, frames: impl std::fmt::Display) -> Error {
    let found = format!("{heights} heights, {frames} frames");
    Error::input("command line", "--indenter-z", found, "one height for all frames, or one for each")
}

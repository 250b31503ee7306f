//! Relaxed states at constant temperature: settings, sampling and averages.
//!
//! A separate job with one step per load: the relaxed state of the load is expanded to the lattice constant at the
//! temperature, equilibrated, and sampled for [`BLOCKS`] blocks of time. The contact probability of a surface atom is
//! the fraction of samples in which it is in contact. Errors are standard errors from block averages (Flyvbjerg &
//! Petersen, J. Chem. Phys. 91 (1989) 461). Units: Å, eV, ps.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::block::Block;
use asperity_contact::uncertainty::ValueWithError;
use asperity_grid::{Error, Result};
use asperity_surface::files::atomic_file::read_text;

/// Number of averaging blocks.
pub const BLOCKS: usize = 32;

/// Smallest number of merged blocks for an error estimate: eight blocks give the standard deviation to 25 %.
const FEWEST_BLOCKS: usize = 8;

/// Layers from the top without thermostat: two lattice constants, in which contact is determined.
pub const FREE_LAYERS: usize = 4;

/// Time step up to 300 K and above, ps. With 0.012 ps the energy of 2048 atoms at 300 K drifts by 2.6 meV/ns per
/// atom, with 0.008 ps by 0.5.
const TIMESTEPS_PS: [f64; 2] = [0.008, 0.004];

/// Time steps between samples: 0.04 to 0.08 ps, well below the shortest vibration period of about 0.2 ps.
const EVERY: usize = 10;

/// Shortest block, ps: longer than that period, with several samples.
const SHORTEST_BLOCK_PS: f64 = 0.24;

/// Shortest averaging time, ps.
pub const LEAST_AVERAGED_PS: f64 = BLOCKS as f64 * SHORTEST_BLOCK_PS;

/// Damping time of the thermostat, ps, and viscous damping of each indenter atom along z, eV ps/Å².
const DAMP_PS: f64 = 1.0;
const VISCOUS: f64 = 0.02;

/// Processor time of a time step over that of a force evaluation of a minimiser: molecular dynamics rebuilds
/// neighbour lists.
pub const MD_STEP_COST_RATIO: f64 = 2.0;

/// Settings of the scene.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct NvtSettings {
    pub temperature_k: f64,
    /// Total time per load, ps, and its fraction for equilibration.
    pub time_ps: f64,
    pub equilibration: f64,
    /// Lattice constant at the temperature, Å.
    pub lattice_constant_angstrom: f64,
}

/// The NVT run of a job; part of `job.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NvtRun {
    pub temperature_k: f64,
    /// Lattice constant at the temperature over that of the relaxed states.
    pub expansion: f64,
    pub timestep_ps: f64,
    pub block_steps: usize,
    pub warm_blocks: usize,
    /// First and last id of the surface layer, and of the atoms with a thermostat.
    pub surface: [u32; 2],
    pub thermostatted: [u32; 2],
    /// Loads, rising, eV/Å: those of the relaxed states times the expansion of the cell's area, so that the pressure
    /// is the same.
    pub loads: Vec<f64>,
    /// BLAKE3 hash of the load steps of the relaxed states.
    pub relaxed_hash: String,
}

impl NvtSettings {
    fn timestep_ps(&self) -> f64 {
        TIMESTEPS_PS[usize::from(self.temperature_k > 300.0)]
    }

    /// Time steps per block, and number of equilibration blocks.
    fn blocks(&self) -> (usize, usize) {
        let steps = self.time_ps / self.timestep_ps();
        let averaged = steps * (1.0 - self.equilibration);
        let block = ((averaged / (BLOCKS * EVERY) as f64).round() as usize).max(self.fewest_samples()) * EVERY;
        (block, (steps * self.equilibration / block as f64).round() as usize)
    }

    /// Samples in the shortest block.
    fn fewest_samples(&self) -> usize {
        (SHORTEST_BLOCK_PS / (EVERY as f64 * self.timestep_ps())).round() as usize
    }

    /// Time steps at each load.
    pub fn steps(&self) -> usize {
        let (block, warm) = self.blocks();
        (warm + BLOCKS) * block
    }
}

impl NvtRun {
    /// The run that samples the relaxed states of `loads` (eV/Å, rising) on `block`; `relaxed_hash` is the hash of
    /// their load steps.
    pub(super) fn new(
        settings: &NvtSettings,
        block: &Block,
        loads: impl Iterator<Item = f64>,
        relaxed_hash: String,
    ) -> Self {
        let expansion = settings.lattice_constant_angstrom / block.a0;
        let (block_steps, warm_blocks) = settings.blocks();
        let ids = |from: usize, to: usize| {
            let first = |layer: usize| layer as u64 * block.atoms_per_layer();
            [first(from) as u32 + 1, first(to) as u32]
        };
        NvtRun {
            temperature_k: settings.temperature_k,
            expansion,
            timestep_ps: settings.timestep_ps(),
            block_steps,
            warm_blocks,
            surface: ids(block.layers() - 1, block.layers()),
            thermostatted: ids(block.base_layers, block.layers() - FREE_LAYERS),
            loads: loads.map(|load| load * expansion * expansion).collect(),
            relaxed_hash,
        }
    }

    /// Averaging time and equilibration time at each load, ps.
    pub fn averaging_ps(&self) -> f64 {
        (BLOCKS * self.block_steps) as f64 * self.timestep_ps
    }

    pub fn equilibration_ps(&self) -> f64 {
        (self.warm_blocks * self.block_steps) as f64 * self.timestep_ps
    }

    /// Time steps at each load.
    pub fn steps(&self) -> usize {
        (self.warm_blocks + BLOCKS) * self.block_steps
    }

    /// `-var` pairs of the script.
    pub(super) fn variables(&self) -> Vec<(String, String)> {
        let range = |[from, to]: [u32; 2]| format!("{from}:{to}");
        let fixed = [
            ("relaxed", RELAXED.to_string()),
            ("steps", self.loads.len().to_string()),
            ("temperature", self.temperature_k.to_string()),
            ("expansion", self.expansion.to_string()),
            ("surface", range(self.surface)),
            ("thermostatted", range(self.thermostatted)),
            ("timestep", self.timestep_ps.to_string()),
            ("sample_every", EVERY.to_string()),
            ("block_steps", self.block_steps.to_string()),
            ("equilibration_blocks", self.warm_blocks.to_string()),
            ("blocks", BLOCKS.to_string()),
            ("thermostat_damp", DAMP_PS.to_string()),
            ("indenter_damping", VISCOUS.to_string()),
        ];
        let loads = self.loads.iter().enumerate().map(|(k, load)| (format!("load{k}"), load.to_string()));
        fixed.into_iter().map(|(key, value)| (key.to_string(), value)).chain(loads).collect()
    }
}

/// Restart files of the relaxed states in the folder of an NVT run are `relaxed.K`.
pub(super) const RELAXED: &str = "relaxed";

/// Averages over one block of time at a load.
#[derive(Debug, Clone, PartialEq)]
pub struct BlockAverage {
    pub temperature_k: f64,
    /// Load on the indenter, eV/Å, and height of its lowest atom, Å.
    pub load: f64,
    pub low_angstrom: f64,
    /// For each surface site: contact probability and mean position of its atom, Å (not wrapped).
    pub contact_probability: Vec<f64>,
    pub positions: Vec<[f64; 3]>,
}

/// All blocks at a load.
#[derive(Debug, Clone, PartialEq)]
pub struct NvtSamples {
    pub blocks: Vec<BlockAverage>,
    /// Bounds of the expanded cell along x and along y, Å.
    pub bounds: [[f64; 2]; 2],
}

impl NvtSamples {
    /// Reads the output of step `k`.
    ///
    /// # Errors
    /// `Io`; `Format` for files without every block of every surface site.
    pub fn read(folder: &Path, run: &NvtRun, k: usize) -> Result<NvtSamples> {
        let file = folder.join(format!("block_averages.{k}.txt"));
        let text = read_text(&file)?;
        let rows: Vec<Vec<f64>> = text.lines().filter(|l| !l.starts_with('#')).map(numbers).collect();
        let is_whole = |rows: &[Vec<f64>], n: usize| rows.len() == BLOCKS && rows.iter().all(|r| r.len() == n);
        if !is_whole(&rows, 5) {
            return Err(Error::format(&file, format!("{} rows", rows.len()), format!("{BLOCKS} rows of five numbers")));
        }
        let file = folder.join(format!("sites.{k}.dump"));
        let text = read_text(&file)?;
        let count = (run.surface[1] - run.surface[0] + 1) as usize;
        // The first frame precedes the end of the first block.
        let frames: Vec<&str> = text.split("ITEM: TIMESTEP\n").skip(2).collect();
        let sites: Option<Vec<SiteProbabilities>> = frames.iter().map(|f| sites(f, run.surface[0])).collect();
        let sites = sites.filter(|s| {
            s.len() == BLOCKS && s.iter().all(|(contact_probability, _)| contact_probability.len() == count)
        });
        let bounds = frames.first().and_then(|f| bounds(f));
        let (Some(sites), Some(bounds)) = (sites, bounds) else {
            let accepted = format!("{BLOCKS} frames of {count} sites after the first");
            return Err(Error::format(&file, format!("{} frames", frames.len()), accepted));
        };
        let blocks = rows.iter().zip(sites).map(|(row, (contact_probability, positions))| BlockAverage {
            temperature_k: row[1],
            load: row[2],
            low_angstrom: row[3],
            contact_probability,
            positions,
        });
        Ok(NvtSamples { blocks: blocks.collect(), bounds })
    }

    /// Mean and error of a quantity of each block.
    pub fn mean(&self, value: impl Fn(&BlockAverage) -> f64) -> ValueWithError {
        mean(&self.blocks.iter().map(value).collect::<Vec<f64>>())
    }

    /// Contact probability of each surface site.
    pub fn probabilities(&self) -> Vec<ValueWithError> {
        let count = self.blocks.first().map_or(0, |b| b.contact_probability.len());
        (0..count).map(|i| self.mean(|b| b.contact_probability[i])).collect()
    }
}

fn numbers(line: &str) -> Vec<f64> {
    line.split_ascii_whitespace().filter_map(|w| w.parse().ok()).collect()
}

/// Bounds of the cell in x and y from the text of a frame after its first line.
fn bounds(frame: &str) -> Option<[[f64; 2]; 2]> {
    let mut lines = frame.lines().skip_while(|l| !l.starts_with("ITEM: BOX BOUNDS")).skip(1);
    let mut pair = || numbers(lines.next()?).try_into().ok();
    Some([pair()?, pair()?])
}

/// Contact probabilities of surface sites, and their mean positions, Å.
type SiteProbabilities = (Vec<f64>, Vec<[f64; 3]>);

/// Reads a frame of sites with consecutive ids from `first` on.
fn sites(frame: &str, first: u32) -> Option<SiteProbabilities> {
    let (mut contact_probability, mut positions) = (Vec::new(), Vec::new());
    for line in frame.lines().skip_while(|l| !l.starts_with("ITEM: ATOMS")).skip(1) {
        let [id, fraction, x, y, z] = numbers(line)[..] else { return None };
        if id != f64::from(first) + contact_probability.len() as f64 {
            return None;
        }
        contact_probability.push(fraction);
        positions.push([x, y, z]);
    }
    Some((contact_probability, positions))
}

/// Mean of block averages with its standard error: the largest estimate when neighbouring blocks are merged in pairs,
/// down to `FEWEST_BLOCKS`. Blocks shorter than the correlation time underestimate the error.
pub fn mean(blocks: &[f64]) -> ValueWithError {
    let value = blocks.iter().sum::<f64>() / blocks.len() as f64;
    let (mut merged, mut error) = (blocks.to_vec(), 0.0_f64);
    while merged.len() >= FEWEST_BLOCKS {
        let n = merged.len() as f64;
        let variance = merged.iter().map(|b| (b - value).powi(2)).sum::<f64>() / (n - 1.0);
        error = error.max((variance / n).sqrt());
        merged = merged.chunks_exact(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
    }
    ValueWithError { value, error }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROOM: NvtSettings =
        NvtSettings { temperature_k: 300.0, time_ps: 40.0, equilibration: 0.2, lattice_constant_angstrom: 5.63 };

    #[test]
    fn time_is_divided_into_whole_blocks() {
        let (block, warm) = ROOM.blocks();
        assert_eq!((block, warm, ROOM.steps()), (130, 8, 5200));
        assert!((ROOM.steps() as f64 * ROOM.timestep_ps() / ROOM.time_ps - 1.0).abs() < 0.05);
        let hot = NvtSettings { temperature_k: 301.0, ..ROOM };
        assert_eq!(hot.timestep_ps(), 0.004);
        // A block is never shorter than a vibration period.
        assert_eq!(NvtSettings { time_ps: 0.1, ..ROOM }.blocks().0, 3 * EVERY);
        assert_eq!(NvtSettings { time_ps: 0.1, ..hot }.blocks().0, 6 * EVERY);
    }

    /// Uncorrelated numbers, uniform between 0 and 1.
    fn noise(count: usize) -> Vec<f64> {
        let mut state = 7_u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / (1_u64 << 31) as f64
        };
        (0..count).map(|_| next()).collect()
    }

    /// The standard error decreases as the square root of the averaging time and agrees with its exact value.
    #[test]
    fn standard_errors_decrease_as_the_square_root_of_time() {
        let error = |length: usize| {
            // Averaged over many series, since the scatter of a single one is uncertain.
            let all = noise(100 * BLOCKS * length);
            let series = all.chunks(BLOCKS * length);
            let standard_error = |s: &[f64]| {
                let blocks: Vec<f64> = s.chunks(length).map(|c| c.iter().sum::<f64>() / length as f64).collect();
                mean(&blocks).error
            };
            series.map(standard_error).sum::<f64>() / 100.0
        };
        let (short, long) = (error(10), error(160));
        assert!((short / long - 4.0).abs() < 0.2, "{short} {long}");
        // The largest of three estimates exceeds the exact value slightly.
        let exact = (1.0 / 12.0 / (10.0 * BLOCKS as f64)).sqrt();
        assert!(short > exact && short < 1.5 * exact, "{short} {exact}");
    }

    #[test]
    fn correlated_blocks_give_the_full_standard_error() {
        // Four consecutive blocks are equal: eight independent means.
        let few = noise(8);
        let blocks: Vec<f64> = few.iter().flat_map(|v| [*v; 4]).collect();
        let actual = mean(&blocks);
        let average = few.iter().sum::<f64>() / 8.0;
        let exact = (few.iter().map(|v| (v - average).powi(2)).sum::<f64>() / 7.0 / 8.0).sqrt();
        assert!((actual.value - average).abs() < 1e-12 && (actual.error - exact).abs() < 1e-12, "{actual:?} {exact}");
        assert_eq!(mean(&[0.25; BLOCKS]), ValueWithError { value: 0.25, error: 0.0 });
    }

    #[test]
    fn incomplete_frames_of_sites_are_refused() {
        let frame = "800\nITEM: NUMBER OF ATOMS\n2\nITEM: BOX BOUNDS pp pp ff\n-0.2 56.1\n-0.3 56.2\n0 60\n\
                     ITEM: ATOMS id f_site[1] f_site[2] f_site[3] f_site[4]\n7 0.5 1 2 3\n8 1 4 5 6\n";
        assert_eq!(bounds(frame), Some([[-0.2, 56.1], [-0.3, 56.2]]));
        assert_eq!(sites(frame, 7), Some((vec![0.5, 1.0], vec![[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])));
        assert_eq!(sites(frame, 6), None);
        assert_eq!(sites(&frame[..frame.len() - 4], 7), None);
    }
}

//! Relaxed states held at a temperature: their job folder, and what the averages over it say.
//!
//! A job of its own, one step for each load: the relaxed state of the load is expanded to the crystal's lattice constant at the
//! temperature, warmed, and then watched for [`BLOCKS`] blocks of time. Contact is a probability for each surface atom, the share
//! of the samples in which it touches; errors come from the scatter of block means (Flyvbjerg & Petersen, J. Chem. Phys. 91 (1989)
//! 461). Units: Å, eV, ps.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::block::Block;
use crate::record::results::ValueWithError;
use crate::{Error, Result};

/// Blocks of time that are averaged over.
pub const BLOCKS: usize = 32;

/// Fewest blocks, merged from those, that an error is taken from: of eight means the scatter is known to a quarter.
const FEWEST_BLOCKS: usize = 8;

/// Layers from the top whose atoms the thermostat leaves alone: two lattice constants, where contact is decided.
pub const FREE_LAYERS: usize = 4;

/// Time step, ps, up to 300 K and above: 0.012 ps let the energy of 2048 atoms at 300 K drift by 2.6 meV/ns an atom, 0.008 ps by 0.5.
const TIMESTEPS_PS: [f64; 2] = [0.008, 0.004];

/// Time steps between samples: 0.04 to 0.08 ps, well below the crystal's shortest period of about 0.2 ps.
const EVERY: usize = 10;

/// Shortest block, ps: longer than that period, and some samples.
const SHORTEST_BLOCK_PS: f64 = 0.24;

/// Least time that can be averaged over, ps.
pub const LEAST_AVERAGED_PS: f64 = BLOCKS as f64 * SHORTEST_BLOCK_PS;

/// Relaxation time of the thermostat, ps, and damping of each indenter atom's way up and down, eV ps/Å².
const DAMP_PS: f64 = 1.0;
const VISCOUS: f64 = 0.02;

/// Processor time of a step of dynamics over that of a force evaluation of a minimiser: it rebuilds neighbour lists.
pub const MD_STEP_COST_RATIO: f64 = 2.0;

/// What is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct NvtSettings {
    pub temperature_k: f64,
    /// All of the time at a load, ps, and the share of it that passes before anything is averaged.
    pub time_ps: f64,
    pub equilibration: f64,
    /// Of the crystal at the temperature, Å.
    pub lattice_constant_angstrom: f64,
}

/// What a job keeps of its hold; part of `job.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NvtRun {
    pub temperature_k: f64,
    /// Lattice constant at the temperature over that of the relaxed states.
    pub expansion: f64,
    pub timestep_ps: f64,
    pub block_steps: usize,
    pub warm_blocks: usize,
    /// First and last id of the surface layer, and of the atoms that the thermostat acts on.
    pub surface: [u32; 2],
    pub thermostatted: [u32; 2],
    /// Rising, eV/Å: the relaxed states' times the expansion of the cell's area, so that the pressure is theirs.
    pub loads: Vec<f64>,
    /// BLAKE3 of the ladder of the relaxed states.
    pub relaxed_hash: String,
}

impl NvtSettings {
    fn timestep_ps(&self) -> f64 {
        TIMESTEPS_PS[usize::from(self.temperature_k > 300.0)]
    }

    /// Time steps in a block, and blocks before anything is averaged.
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
    /// The run that samples the relaxed states of `loads` (eV/Å, rising) on `block`; `relaxed_hash` is the hash of their load steps.
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

    /// Time that is averaged over at each load, and time before it, ps.
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

/// Relaxed states in a hold's folder are `relaxed.K`.
pub(super) const RELAXED: &str = "relaxed";

/// One block of time at a load.
#[derive(Debug, Clone, PartialEq)]
pub struct BlockAverage {
    pub temperature_k: f64,
    /// On the indenter, eV/Å, and height of its lowest atom, Å.
    pub load: f64,
    pub low_angstrom: f64,
    /// For each surface site: the share of the samples in which its atom touches, and its mean position, Å (not wrapped).
    pub touching: Vec<f64>,
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
    /// What the step `k` of a hold has left.
    ///
    /// # Errors
    /// `Io`; `Format` for files that do not hold every block of every surface site.
    pub fn read(folder: &Path, run: &NvtRun, k: usize) -> Result<NvtSamples> {
        let file = folder.join(format!("block_averages.{k}.txt"));
        let text = std::fs::read_to_string(&file).map_err(Error::io("read", &file))?;
        let rows: Vec<Vec<f64>> = text.lines().filter(|l| !l.starts_with('#')).map(numbers).collect();
        let whole = |rows: &[Vec<f64>], n: usize| rows.len() == BLOCKS && rows.iter().all(|r| r.len() == n);
        if !whole(&rows, 5) {
            return Err(Error::format(&file, format!("{} rows", rows.len()), format!("{BLOCKS} rows of five numbers")));
        }
        let file = folder.join(format!("sites.{k}.dump"));
        let text = std::fs::read_to_string(&file).map_err(Error::io("read", &file))?;
        let count = (run.surface[1] - run.surface[0] + 1) as usize;
        // The first frame is from before the first block has ended.
        let frames: Vec<&str> = text.split("ITEM: TIMESTEP\n").skip(2).collect();
        let sites: Option<Vec<Sites>> = frames.iter().map(|f| sites(f, run.surface[0])).collect();
        let sites = sites.filter(|s| s.len() == BLOCKS && s.iter().all(|(touching, _)| touching.len() == count));
        let bounds = frames.first().and_then(|f| bounds(f));
        let (Some(sites), Some(bounds)) = (sites, bounds) else {
            let accepted = format!("{BLOCKS} frames of {count} sites after the first");
            return Err(Error::format(&file, format!("{} frames", frames.len()), accepted));
        };
        let blocks = rows.iter().zip(sites).map(|(row, (touching, positions))| BlockAverage {
            temperature_k: row[1],
            load: row[2],
            low_angstrom: row[3],
            touching,
            positions,
        });
        Ok(NvtSamples { blocks: blocks.collect(), bounds })
    }

    /// A number of each block, averaged.
    pub fn mean(&self, of: impl Fn(&BlockAverage) -> f64) -> ValueWithError {
        mean(&self.blocks.iter().map(of).collect::<Vec<f64>>())
    }

    /// For each surface site the probability that its atom touches.
    pub fn probabilities(&self) -> Vec<ValueWithError> {
        let count = self.blocks.first().map_or(0, |b| b.touching.len());
        (0..count).map(|i| self.mean(|b| b.touching[i])).collect()
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

/// Shares of the samples in which surface sites touch, and their mean positions, Å.
type Sites = (Vec<f64>, Vec<[f64; 3]>);

/// Of sites whose ids begin with `first` and have no gaps, from the text of a frame.
fn sites(frame: &str, first: u32) -> Option<Sites> {
    let (mut touching, mut positions) = (Vec::new(), Vec::new());
    for line in frame.lines().skip_while(|l| !l.starts_with("ITEM: ATOMS")).skip(1) {
        let [id, share, x, y, z] = numbers(line)[..] else { return None };
        if id != f64::from(first) + touching.len() as f64 {
            return None;
        }
        touching.push(share);
        positions.push([x, y, z]);
    }
    Some((touching, positions))
}

/// Mean of block means with its standard error: the largest that they show when neighbours are merged, two by two, down to
/// `FEWEST_BLOCKS`. Blocks shorter than what they are correlated over show too small an error before they are merged.
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
    fn time_is_cut_into_whole_blocks() {
        let (block, warm) = ROOM.blocks();
        assert_eq!((block, warm, ROOM.steps()), (130, 8, 5200));
        assert!((ROOM.steps() as f64 * ROOM.timestep_ps() / ROOM.time_ps - 1.0).abs() < 0.05);
        let hot = NvtSettings { temperature_k: 301.0, ..ROOM };
        assert_eq!(hot.timestep_ps(), 0.004);
        // Never a block that is shorter than a vibration.
        assert_eq!(NvtSettings { time_ps: 0.1, ..ROOM }.blocks().0, 3 * EVERY);
        assert_eq!(NvtSettings { time_ps: 0.1, ..hot }.blocks().0, 6 * EVERY);
    }

    /// Numbers without correlation, uniform between 0 and 1.
    fn noise(count: usize) -> Vec<f64> {
        let mut state = 7_u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / (1_u64 << 31) as f64
        };
        (0..count).map(|_| next()).collect()
    }

    /// The error of the mean of what is averaged in blocks falls as the square root of the time, and is what it should be.
    #[test]
    fn errors_shrink_as_the_root_of_the_time() {
        let error = |length: usize| {
            // Over many series, since the scatter of one is itself uncertain.
            let all = noise(100 * BLOCKS * length);
            let series = all.chunks(BLOCKS * length);
            let of = |s: &[f64]| {
                let blocks: Vec<f64> = s.chunks(length).map(|c| c.iter().sum::<f64>() / length as f64).collect();
                mean(&blocks).error
            };
            series.map(of).sum::<f64>() / 100.0
        };
        let (short, long) = (error(10), error(160));
        assert!((short / long - 4.0).abs() < 0.2, "{short} {long}");
        // The largest of three levels is above the true one, but not far.
        let exact = (1.0 / 12.0 / (10.0 * BLOCKS as f64)).sqrt();
        assert!(short > exact && short < 1.5 * exact, "{short} {exact}");
    }

    #[test]
    fn correlated_blocks_do_not_hide_their_error() {
        // Four blocks in a row are alike: eight independent means.
        let few = noise(8);
        let blocks: Vec<f64> = few.iter().flat_map(|v| [*v; 4]).collect();
        let found = mean(&blocks);
        let average = few.iter().sum::<f64>() / 8.0;
        let exact = (few.iter().map(|v| (v - average).powi(2)).sum::<f64>() / 7.0 / 8.0).sqrt();
        assert!((found.value - average).abs() < 1e-12 && (found.error - exact).abs() < 1e-12, "{found:?} {exact}");
        assert_eq!(mean(&[0.25; BLOCKS]), ValueWithError { value: 0.25, error: 0.0 });
    }

    #[test]
    fn frames_of_sites_are_read_whole_or_not_at_all() {
        let frame = "800\nITEM: NUMBER OF ATOMS\n2\nITEM: BOX BOUNDS pp pp ff\n-0.2 56.1\n-0.3 56.2\n0 60\n\
                     ITEM: ATOMS id f_site[1] f_site[2] f_site[3] f_site[4]\n7 0.5 1 2 3\n8 1 4 5 6\n";
        assert_eq!(bounds(frame), Some([[-0.2, 56.1], [-0.3, 56.2]]));
        assert_eq!(sites(frame, 7), Some((vec![0.5, 1.0], vec![[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])));
        assert_eq!(sites(frame, 6), None);
        assert_eq!(sites(&frame[..frame.len() - 4], 7), None);
    }
}

//! The readers of this program under input that nobody intended. A target writes bytes into a file and reads it; the
//! file and what it says may be anything, the answer is a value or an error of one line.
//!
//! cargo-fuzz (`fuzz/target.rs`), `cargo bench --bench measure -- damage` and `tests/damaged_input.rs` run the same targets.

use asperity::atoms::dump::DumpReader;
use asperity::atoms::job::Job;
use asperity::atoms::load_history::{LoadHistory, evaluations};
use asperity::atoms::nvt::{BLOCKS, NvtRun, NvtSamples};
use asperity::atoms::potential::SetflHeader;
use asperity::contact::interface::{AttractionLaw, RangeChoice};
use asperity::contact::method::{Heights, Load, NoObserver, ReducedProblem};
use asperity::contact::path::LoadPathSolver;
use asperity::grid::Grid;
use asperity::grid::sys::ranks::ALONE;
use asperity::methods;
use asperity::pipeline::RunFolder;
use asperity::pipeline::checkpoint::Checkpoint;
use asperity::pipeline::sweep::Sweep;
use asperity::record::results as record;
use asperity::record::written::WrittenFolder;
use asperity::scene::{Case, Scene};
use asperity::surface::files::hashed::{self, FileHash};
use asperity::surface::files::{atomic_file, npy};
use asperity::surface::import::{self, Content, Fourier, ImportOptions};
use asperity::{Error, Result, report};
use serde_json::{Map, Value};
use std::io::{Seek, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Longest message, characters.
const LONGEST_MESSAGE: usize = 20_000;

/// What a reader may take in any case: buffers of decoders (zstd's window alone is 8 MiB), and packed data up to the size
/// from which `import` bounds their ratio, 64 MiB, as bytes and as numbers.
const BASE_BYTES: usize = 160 << 20;

/// Allocated bytes per byte of the file, and per byte of the numbers that were read.
const FACTOR: usize = 64;
/// Time for each byte of the scenes that a sweep delivers: a scene of some 600 bytes takes 0.7 ms.
const SCENE_BYTE: Duration = Duration::from_micros(2);

/// A reader.
pub(crate) struct Target {
    pub(crate) name: &'static str,
    /// Name of the file that holds the input, in a folder of its own.
    file: &'static str,
    /// Other files of that folder.
    prepare: fn(&Path) -> Result<()>,
    /// Reads the file. The value is the number of bytes that its contents take as numbers.
    read: fn(&Path) -> Result<usize>,
    /// Processor time beyond the limit of any input, for each delivered byte.
    delivery: Duration,
    /// Files with valid input, as folders or files of the repository and the ends of their names.
    corpus: (&'static [&'static str], &'static [&'static str]),
}

const SURFACES: &[&str] = &["tests/fixtures", "tests/fixtures/declared", "tests/fixtures/surfaces"];

const fn surface(name: &'static str, ends: &'static [&'static str]) -> Target {
    Target {
        name,
        file: "surface",
        prepare: nothing,
        read: heights,
        delivery: Duration::ZERO,
        corpus: (SURFACES, ends),
    }
}

const fn stored(
    name: &'static str,
    file: &'static str,
    read: fn(&Path) -> Result<usize>,
    corpus: &'static [&'static str],
) -> Target {
    Target { name, file, prepare: nothing, read, delivery: Duration::ZERO, corpus: (corpus, &[""]) }
}

pub(crate) const TARGETS: &[Target] = &[
    surface("surface_text", &[".txt", ".dat", ".asc", ".csv", ".xyz"]),
    Target { read: waves, ..surface("surface_waves", &["fftw.dat", "series.dat", "half.dat", "fourier.h5"]) },
    surface("surface_npy", &[".npy"]),
    surface("surface_npz", &[".npz"]),
    surface("surface_hdf5", &[".h5"]),
    surface("surface_netcdf", &[".nc"]),
    surface("surface_x3p", &[".x3p"]),
    surface("surface_sdf", &[".sdf"]),
    surface("surface_sur", &[".sur", ".pro"]),
    surface("surface_gwy", &[".gwy"]),
    Target {
        name: "scene",
        file: "scene.toml",
        prepare: nothing,
        read: scene,
        delivery: Duration::ZERO,
        corpus: (&["tests/scenes/good", "tests/scenes/bad"], &[".toml"]),
    },
    Target {
        name: "sweep",
        file: "configs/sweeps/sweep.toml",
        prepare: scene_of_sweeps,
        read: sweep,
        delivery: SCENE_BYTE,
        corpus: (&["fuzz/corpus/sweep"], &[".toml"]),
    },
    Target { prepare: stage_files, ..stored("stage", "stage/done.json", stage, &["fuzz/corpus/stage"]) },
    Target { prepare: fields, ..stored("checkpoint", "checkpoint.json", checkpoint, &["fuzz/corpus/checkpoint"]) },
    stored("field", "field.npy", field, &["tests/fixtures/square.npy", "fuzz/corpus/field"]),
    stored("dump", "frame.dump", dump, &["fuzz/corpus/dump"]),
    stored("job", "job.json", job, &["fuzz/corpus/job"]),
    Target { prepare: averages, ..stored("nvt", "sites.0.dump", nvt, &["fuzz/corpus/nvt"]) },
    stored("load_steps", "load_steps.csv", load_steps, &["fuzz/corpus/load_steps"]),
    stored("log", "log.0", log, &["fuzz/corpus/log"]),
    stored("potential", "potential.eam.alloy", potential, &["fuzz/corpus/potential"]),
    Target { prepare: maps, ..stored("results", "results.json", results, &["fuzz/corpus/results"]) },
    stored("tradeoff", "tradeoff.json", tradeoff, &["fuzz/corpus/tradeoff"]),
    stored("ensemble", "ensemble.json", ensemble, &["fuzz/corpus/ensemble"]),
];

#[allow(dead_code, reason = "not by tests/damaged_input.rs, which runs all")]
pub(crate) fn find(name: &str) -> Option<&'static Target> {
    TARGETS.iter().find(|t| t.name == name)
}

fn create(folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(Error::io("create", folder))
}

fn nothing(_: &Path) -> Result<()> {
    Ok(())
}

fn repository() -> &'static Path {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    if here.ends_with("fuzz") { here.parent().unwrap_or(here) } else { here }
}

impl Target {
    /// The stored inputs.
    ///
    /// # Errors
    /// `Io`; `Format` if there is none.
    pub(crate) fn corpus(&self) -> Result<Vec<(PathBuf, Vec<u8>)>> {
        let (places, ends) = self.corpus;
        let mut files = Vec::new();
        for place in places.iter().map(|p| repository().join(p)) {
            if place.is_dir() {
                let entries = std::fs::read_dir(&place).map_err(Error::io("list", &place))?;
                files.extend(entries.flatten().map(|e| e.path()).filter(|p| p.is_file()));
            } else {
                files.push(place);
            }
        }
        files.retain(|f| f.to_str().is_some_and(|name| ends.iter().any(|end| name.ends_with(end))));
        files.sort();
        if files.is_empty() {
            return Err(Error::format(self.name, "no stored input", "at least one file"));
        }
        files.into_iter().map(|f| std::fs::read(&f).map_err(Error::io("read", &f)).map(|bytes| (f, bytes))).collect()
    }
}

/// A file that is written in place and read by one target: a file that is truncated and written anew may reach the disk.
pub(crate) struct Reading {
    target: &'static Target,
    file: std::fs::File,
    path: PathBuf,
    folder: tempfile::TempDir,
}

/// What became of one input.
pub(crate) struct Answer {
    pub(crate) read: bool,
    /// Bytes that the reader may have allocated.
    pub(crate) allowed_bytes: usize,
    /// Processor time beyond the limit of any input: that of a sweep of a hundred bytes with a hundred thousand scenes.
    pub(crate) delivery: Duration,
}

impl Reading {
    /// # Errors
    /// `Io`.
    pub(crate) fn new(target: &'static Target) -> Result<Reading> {
        let folder = tempfile::tempdir().map_err(Error::io("create", "a scratch folder"))?;
        let path = folder.path().join(target.file);
        (target.prepare)(folder.path())?;
        create(path.parent().unwrap_or(folder.path()))?;
        let file = std::fs::File::create(&path).map_err(Error::io("create", &path))?;
        Ok(Reading { target, file, path, folder })
    }

    /// Reads an input.
    ///
    /// # Errors
    /// A message of the reader that has several lines where one belongs, or is too long. `Io` for the scratch file.
    pub(crate) fn check(&mut self, input: &[u8]) -> Result<Answer> {
        // Readers replace their file (a stage that is written again) or open it anew; it is the same after this.
        if !self.path.exists() {
            self.file = std::fs::File::create(&self.path).map_err(Error::io("create", &self.path))?;
        }
        let put = |file: &mut std::fs::File| {
            file.rewind().and_then(|()| file.write_all(input)).and_then(|()| file.set_len(input.len() as u64))
        };
        put(&mut self.file).map_err(Error::io("write", self.folder.path()))?;
        let found = (self.target.read)(&self.path);
        let allowed = |numbers: usize| BASE_BYTES.saturating_add(FACTOR.saturating_mul(input.len() + numbers));
        match found {
            Ok(numbers) => {
                let delivery = self.target.delivery.saturating_mul(u32::try_from(numbers).unwrap_or(u32::MAX));
                Ok(Answer { read: true, allowed_bytes: allowed(numbers), delivery })
            }
            Err(error) => {
                let text = error.to_string();
                // Complaints about a scene have a line each.
                let lines = if matches!(error, Error::Input { .. } | Error::Syntax { .. }) { 1000 } else { 1 };
                if text.lines().count() > lines || text.chars().count() > LONGEST_MESSAGE {
                    let found = format!("a message of {} lines: {text}", text.lines().count());
                    return Err(Error::format(self.target.name, found, "one line"));
                }
                Ok(Answer { read: false, allowed_bytes: allowed(0), delivery: Duration::ZERO })
            }
        }
    }
}

fn imported(path: &Path, options: ImportOptions) -> Result<usize> {
    Ok(match import::read(path, options)?.content {
        Content::Map(map) => 8 * map.heights.len(),
        Content::Waves(waves) => 32 * waves.len(),
    })
}

fn heights(path: &Path) -> Result<usize> {
    // The scene reader tests whether a file is one of heights.
    import::holds_numbers(path)?;
    imported(path, ImportOptions::default())
}

fn waves(path: &Path) -> Result<usize> {
    imported(path, ImportOptions { fourier: Some(Fourier::Series), ..Default::default() })
}

fn scene(path: &Path) -> Result<usize> {
    // Files that the scene names are those of the tests.
    let mut scene = Scene::read(path)?;
    // To resolve a block takes a second, and a sum over the modes of the challenge's surface a third of one.
    scene.atoms = None;
    scene.surface.cut_off_mode = Some(scene.surface.cut_off_mode.unwrap_or(64.0).min(64.0));
    Case::resolve(scene, &repository().join("tests/scenes/good/scene.toml")).map(|_| 0)
}

/// The scene that the corpus of `sweep` varies.
fn scene_of_sweeps(folder: &Path) -> Result<()> {
    create(&folder.join("configs"))?;
    let (from, to) = (repository().join("configs/tiny.toml"), folder.join("configs/tiny.toml"));
    std::fs::copy(&from, &to).map(drop).map_err(Error::io("copy", &from))
}

fn sweep(path: &Path) -> Result<usize> {
    Sweep::read(path, &|_, _| Ok(())).map(|sweep| sweep.points.iter().map(|p| p.scene.len()).sum())
}

/// Signs the contents of a file of `hashed` again: the hash protects against damage, not against what a program wrote
/// that means something else. Whether it was an object of JSON.
fn signed(path: &Path, with_files: bool) -> Result<bool> {
    let Ok(mut object) = serde_json::from_slice::<Map<String, Value>>(&std::fs::read(path).unwrap_or_default()) else {
        return Ok(false);
    };
    let files =
        object.remove("files").and_then(|f| serde_json::from_value::<Vec<FileHash>>(f).ok()).unwrap_or_default();
    let files = if with_files { files } else { Vec::new() };
    object.remove("blake3");
    let signed = path.with_extension("signed");
    hashed::write(&signed, &object, &files)?;
    std::fs::copy(&signed, path).map(|_| true).map_err(Error::io("copy", path))
}

fn stage_files(folder: &Path) -> Result<()> {
    drop(RunFolder::open(folder)?);
    create(&folder.join("stage"))?;
    let output = folder.join("stage/output.json");
    std::fs::write(&output, "1\n").map_err(Error::io("write", &output))
}

fn stage(path: &Path) -> Result<usize> {
    let root = path.parent().and_then(Path::parent).unwrap_or(path);
    // The files that it lists are not there.
    let listed = WrittenFolder::stages(root).and_then(|folder| folder.verify());
    if signed(path, false)? { WrittenFolder::stages(root)?.verify().map(|()| 0) } else { listed.map(|()| 0) }
}

const POINTS: usize = 8;

fn fields(folder: &Path) -> Result<()> {
    let values = (0..POINTS * POINTS).map(|i| (i % 7) as f64 * 1e-3);
    for name in ["checkpoint-0.npy", "checkpoint-auxiliary-0.npy"] {
        npy::write(&folder.join(name), POINTS, POINTS, values.clone())?;
    }
    Ok(())
}

/// A solve that continues from the checkpoint, with each method that writes some.
fn checkpoint(path: &Path) -> Result<usize> {
    let folder = path.parent().unwrap_or(path);
    let find = || Checkpoint::find(folder, "checkpoint", "key", &|_| {});
    drop(find());
    if !signed(path, true)? {
        return Err(Error::format("checkpoint", "no object", "an object"));
    }
    let heights: Vec<f64> = (0..POINTS * POINTS).map(|i| ((i * 7919) % 64) as f64 * 1e-4).collect();
    let loads = [Load::Pressure(0.01), Load::Pressure(0.02)];
    for id in ["fast", "bvm", "gfmd"] {
        let problem = ReducedProblem {
            max_iterations: 20,
            ..ReducedProblem::new(Grid::unit(POINTS, POINTS), Heights::Nodes(&heights))
        };
        let found = methods::find(id).ok_or_else(|| Error::format("method", id, "a method"))?;
        let Some(begin) = find() else { return Err(Error::format("checkpoint", "not its key", "its key")) };
        assert!(problem.adhesion == AttractionLaw::None);
        let path = LoadPathSolver::new(problem, found, RangeChoice::Mesh, 0.0, &loads).without_error();
        path.walk(Some(begin.begin(&ALONE)?), false, &NoObserver, |_, _| Ok(()))?;
    }
    Ok(0)
}

fn field(path: &Path) -> Result<usize> {
    let flags = npy::read_flags(path);
    let numbers = npy::read(path)?;
    flags.map(|f| f.values.len() + 8 * numbers.values.len())
}

fn dump(path: &Path) -> Result<usize> {
    DumpReader::open(path)?.try_fold(0, |bytes, frame| frame.map(|f| bytes.max(32 * f.len())))
}

fn job(path: &Path) -> Result<usize> {
    let job = Job::open(path.parent().unwrap_or(path))?;
    let history = LoadHistory::default();
    job.memory_bytes(2);
    job.variables(&history.steps, true);
    Ok(0)
}

/// The samples of a run at constant temperature of a surface of two atoms.
fn nvt(path: &Path) -> Result<usize> {
    let run = NvtRun {
        temperature_k: 300.0,
        expansion: 1.0,
        timestep_ps: 0.005,
        block_steps: 100,
        warm_blocks: 1,
        surface: [1, 2],
        thermostatted: [3, 4],
        loads: vec![1.0],
        relaxed_hash: String::new(),
    };
    let samples = NvtSamples::read(path.parent().unwrap_or(path), &run, 0)?;
    samples.mean(|b| b.load);
    Ok(48 * samples.probabilities().len())
}

/// Averages of each block, which accompany the sites.
fn averages(folder: &Path) -> Result<()> {
    let file = folder.join("block_averages.0.txt");
    std::fs::write(&file, "1 300 0.5 10 20\n".repeat(BLOCKS)).map_err(Error::io("write", &file))
}

fn load_steps(path: &Path) -> Result<usize> {
    let history = LoadHistory::read(path.parent().unwrap_or(path))?;
    for load in [0.0, 0.1, 1.0] {
        history.bracket(load, None);
        history.bracket_unloading(load, history.steps.len() / 2);
    }
    Ok(64 * history.steps.len())
}

fn log(path: &Path) -> Result<usize> {
    Ok(32 * evaluations(&atomic_file::read_text(path)?).len())
}

fn potential(path: &Path) -> Result<usize> {
    SetflHeader::read(path).map(|header| 64 * header.elements.len())
}

/// The fields that `fuzz/corpus/results` names.
fn maps(folder: &Path) -> Result<()> {
    const SIDE: usize = 16;
    for (part, names) in [
        ("continuum", &["load-1-gap.npy", "load-1-stress.npy"][..]),
        ("method-winkler-non-adhesive", &["load-1-contact.npy", "load-1-gap.npy", "load-1-stress.npy"]),
        ("surface", &["heights.npy"]),
    ] {
        create(&folder.join(part))?;
        let values = (0..SIDE * SIDE).map(|i| (i % 7) as f64 * 1e-3);
        let stage = folder.join(part);
        names.iter().try_for_each(|name| npy::write(&stage.join(name), SIDE, SIDE, values.clone()))?;
        hashed::write(&stage.join(hashed::DONE_FILE), &Map::new(), &hashed::hashes(&stage, &|_| true)?)?;
    }
    Ok(())
}

/// The results are read and drawn.
fn results(path: &Path) -> Result<usize> {
    let folder = path.parent().unwrap_or(path);
    hashed::write_checksums(folder, &[record::FILE])?;
    asperity::FinishedRun::read(folder)?;
    report::write(folder).map(|_| 0)
}

fn tradeoff(path: &Path) -> Result<usize> {
    asperity::record::tradeoff::TradeoffResults::read(path)?;
    report::write(path.parent().unwrap_or(path)).map(|_| 0)
}

fn ensemble(path: &Path) -> Result<usize> {
    report::write(path.parent().unwrap_or(path)).map(|_| 0)
}

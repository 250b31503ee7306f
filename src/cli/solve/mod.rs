mod cache;
mod estimated;
mod reporter;

use super::{file::FileFlags, output, progress::TerminalProgress};
use crate::error::Complaint;
use crate::grid::{Grid, Series};
use crate::interface::{Adhesion, Base, CubicHalfSpace, Elastic, Layer, NonPeriodic, PenaltyWall, RangeChoice, Wall};
use crate::method::{self, ContactMethod, Heights, Kind, Load, Precision, Problem, Settings, Stop, Targets};
use crate::path::{Begin, Checkpoint, CheckpointWriter, LoadPath};
use crate::pipeline::{Key, Listener, Progress};
use crate::record::heights::Sign;
use crate::report::number::memory;
use crate::scene::{AdhesionLaw, Surface, SurfaceFile, SurfaceScene, WallKind, default_tolerance, slope_warning};
use crate::surface::{Modes, Spectrum, quality_warnings};
use crate::{Error, Result};
use cache::SolveCache;
use reporter::{Before, SolveReporter};
use serde_json::json;
use std::path::PathBuf;

const CHECKPOINT: &str = "checkpoint";

/// Lengths are in the unit of the heights, stresses in the unit of the modulus.
// A negative value is refused by its flag's own check, not taken for a flag.
#[derive(Debug, Clone, clap::Args)]
#[command(allow_negative_numbers = true)]
pub struct Solve {
    /// File of heights or of Fourier coefficients, as --heights names one.
    #[arg(required_unless_present_any = ["challenge", "heights"], conflicts_with_all = ["challenge", "heights"])]
    file: Option<PathBuf>,
    /// Height map (.npy, .npz, HDF5, NetCDF, ASCII matrix or lines of x y h), or Fourier coefficients qX qY Re Im. Low points
    /// touch first unless --flip.
    #[arg(long, value_name = "FILE", conflicts_with = "challenge")]
    heights: Option<PathBuf>,
    #[command(flatten)]
    flags: FileFlags,
    /// Points per side for Fourier coefficients; a height map has its own.
    #[arg(long, value_name = "N", conflicts_with = "challenge")]
    grid: Option<usize>,
    /// Shortest wavelength that is kept of Fourier coefficients.
    #[arg(long, value_name = "LAMBDA", conflicts_with = "challenge")]
    low_pass: Option<f64>,
    /// Instead of a map: the challenge's spectrum on N x N points of a cell of extent --length. Its waves are kept, not its
    /// heights, so that a large grid takes no more memory than the solver.
    #[arg(long, value_name = "N")]
    challenge: Option<usize>,
    /// Seed of the challenge's surface; without it the one of scenes.
    #[arg(long, value_name = "N", default_value_t = SurfaceScene::default().seed, requires = "challenge")]
    seed: u64,
    /// Short cut-off wavelength of the challenge's surface over the cell.
    #[arg(long, value_name = "LAMBDA", default_value_t = Spectrum::CHALLENGE.lambda_s, requires = "challenge")]
    cut_off: f64,
    /// Extent of the map in x.
    #[arg(long, default_value_t = 1.0, value_name = "L")]
    length: f64,
    /// Extent in y. Default: square pixels.
    #[arg(long, value_name = "L", conflicts_with = "challenge")]
    length_y: Option<f64>,
    /// Contact modulus E* = E/(1-ν²).
    #[arg(long, default_value_t = 1.0, value_name = "E")]
    modulus: f64,
    /// Mean pressure; several, apart by commas, are put on one after another. With adhesion, up and down are different
    /// branches, and a pull may be negative.
    #[arg(long, value_name = "P", value_delimiter = ',', num_args = 1, required_unless_present = "mean_gap")]
    pressure: Vec<f64>,
    /// Mean gap instead, one or several: reaches states that no pressure holds.
    #[arg(long, value_name = "G", value_delimiter = ',', num_args = 1, conflicts_with = "pressure")]
    mean_gap: Vec<f64>,
    /// After the last load, pull the surfaces apart and find the largest pull on the way.
    #[arg(long)]
    pull_off: bool,
    /// Gap to start from (.npy), in the unit of the heights, as --out writes it.
    #[arg(long, value_name = "FILE")]
    initial_gap: Option<PathBuf>,
    /// Work of adhesion γ (modulus times length).
    #[arg(long, default_value_t = 0.0, value_name = "GAMMA")]
    gamma: f64,
    /// Range ρ of the adhesion.
    #[arg(long, requires = "gamma")]
    rho: Option<f64>,
    /// What is done where the grid is too coarse for that range.
    #[arg(long, value_enum, default_value_t = RangeChoice::Mesh)]
    range: RangeChoice,
    /// How the attraction fades with the gap.
    #[arg(long, value_enum, default_value_t = AdhesionLaw::Exponential, requires = "gamma")]
    law: AdhesionLaw,
    /// What keeps the surfaces apart.
    #[arg(long, value_enum, default_value_t = WallKind::Hard)]
    wall: WallKind,
    /// Length by which the penalty wall yields under a pressure of E*.
    #[arg(long)]
    wall_length: Option<f64>,
    /// An id from `asperity methods`, or auto.
    #[arg(long, default_value = "auto", value_name = "ID")]
    method: String,
    /// A setting of a method as KEY=VALUE, such as winkler.spring_length=0.0034; `asperity schema` lists them under methods.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Largest rms KKT residual over the pressure. Default: 1e-8 in f64; in f32 1e-3, from 1024 points a side on in
    /// proportion.
    #[arg(long, visible_alias = "tolerance")]
    tol: Option<f64>,
    /// Go on until the energy is within this part of the minimum (as `fast` estimates it).
    #[arg(long, value_name = "PART")]
    energy_tolerance: Option<f64>,
    /// Go on until the contact area is estimated to change by no more than this part.
    #[arg(long, value_name = "PART")]
    area_tolerance: Option<f64>,
    /// The same for the mean gap.
    #[arg(long, value_name = "PART")]
    mean_gap_tolerance: Option<f64>,
    /// Floating-point type of the fields; sums are always f64.
    #[arg(long, value_enum, default_value_t = Precision::F64)]
    precision: Precision,
    /// Iterations after which the solver gives up.
    #[arg(long, default_value_t = 50_000, value_name = "N")]
    max_iterations: usize,
    /// High points touch first.
    #[arg(long, conflicts_with = "challenge")]
    flip: bool,
    /// The map lies alone on a half-space that is free around it, instead of repeating.
    #[arg(long, conflicts_with_all = ["thickness", "crystal", "mean_gap", "pull_off"])]
    non_periodic: bool,
    /// Elastic layer of this thickness instead of the half-space.
    #[arg(long, value_name = "T")]
    thickness: Option<f64>,
    /// Poisson's ratio of the layer.
    #[arg(long, default_value_t = 0.3, value_name = "NU", requires = "thickness")]
    poisson: f64,
    /// The layer's lower face.
    #[arg(long, value_enum, default_value_t = Base::Bonded, requires = "thickness")]
    base: Base,
    /// Elastic constants of a cubic crystal, (001) face with x along [100], instead of an isotropic half-space. Any unit:
    /// only their ratios matter, E* is --modulus.
    #[arg(long, value_name = "C11,C12,C44", value_delimiter = ',', num_args = 1)]
    crystal: Vec<f64>,
    /// Write gap.npy, stress.npy, contact.npy and solve.json here ("load-1-" and so on before the names of several loads,
    /// "partial-" before those of what did not converge), and checkpoints from which the same command goes on.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Say what memory it takes, and do nothing.
    #[arg(long)]
    dry_run: bool,
    /// One line of JSON per load on stdout.
    #[arg(long)]
    json: bool,
}

/// Points per side of the challenge's surface: past any machine's memory, and far below what overflows.
const MOST_POINTS: usize = 1 << 20;

/// Shortest cut-off of the challenge's surface over the cell, as in scenes: 1e4 modes a side take half a minute.
const SHORTEST_CUT_OFF: f64 = 1e-4;

/// The surface to be solved for.
enum Given {
    Nodes(Grid, Vec<f64>),
    Series(Grid, Series<f64>),
}

impl Given {
    fn grid(&self) -> Grid {
        match self {
            Given::Nodes(grid, _) | Given::Series(grid, _) => *grid,
        }
    }

    fn heights(&self) -> Heights<'_> {
        match self {
            Given::Nodes(_, nodes) => nodes.into(),
            Given::Series(_, series) => Heights::Series(series),
        }
    }

    fn in_waves(self) -> Self {
        match self {
            Given::Nodes(grid, nodes) => Given::Series(grid, Series::from_nodes(grid, &nodes)),
            waves => waves,
        }
    }
}

impl Solve {
    fn check(&self) -> Result<()> {
        let mut list = Vec::new();
        let mut positive = |key: &str, value: f64| {
            if !(value.is_finite() && value > 0.0) {
                list.push(Complaint::new(key, value, "a positive number"));
            }
        };
        positive("--length", self.length);
        positive("--modulus", self.modulus);
        for &p in self.pressure.iter().filter(|p| !p.is_finite() || self.gamma == 0.0) {
            positive("--pressure", p);
        }
        for &g in self.mean_gap.iter().filter(|g| **g != 0.0) {
            positive("--mean-gap", g);
        }
        [
            ("--length-y", self.length_y),
            ("--low-pass", self.low_pass),
            ("--rho", self.rho),
            ("--tol", self.tol),
            ("--thickness", self.thickness),
            ("--penalty-length", self.wall_length),
            ("--energy-tolerance", self.energy_tolerance),
            ("--area-tolerance", self.area_tolerance),
            ("--mean-gap-tolerance", self.mean_gap_tolerance),
        ]
        .into_iter()
        .for_each(|(key, value)| value.into_iter().for_each(|v| positive(key, v)));
        self.flags.check(self.challenge.is_none(), &mut list);
        for (key, found) in [("--grid", self.grid.map(|n| n as f64)), ("--low-pass", self.low_pass)] {
            if let Some(found) = found.filter(|_| !self.flags.are_waves()) {
                list.push(Complaint::new(
                    key,
                    found,
                    "only together with --fourier: a height map has points of its own",
                ));
            }
        }
        if let Some(y) = self.length_y.filter(|_| self.flags.are_waves()) {
            list.push(Complaint::new("--length-y", y, "none: the cell of Fourier coefficients is square"));
        }
        if let Some(n) = self.grid.filter(|n| !(1..=MOST_POINTS).contains(n)) {
            list.push(Complaint::new("--grid", n, format!("1 to {MOST_POINTS} points per side")));
        }
        if let Some(tolerance) = self.tol.filter(|t| *t >= 1.0) {
            list.push(Complaint::new("--tol", tolerance, "a number below 1"));
        }
        if !(self.gamma.is_finite() && self.gamma >= 0.0) {
            list.push(Complaint::new("--gamma", self.gamma, "zero or a positive number"));
        }
        if self.gamma > 0.0 && self.rho.is_none() {
            list.push(Complaint::new("--rho", "not given", "the range of the adhesion that --gamma asks for"));
        }
        if self.pull_off && self.gamma == 0.0 {
            list.push(Complaint::new(
                "--pull-off",
                "given without --gamma",
                "an adhesion that holds the surfaces together",
            ));
        }
        let estimates = method::find(&self.method).is_some_and(|m| m.card().kind == Kind::Estimate);
        if estimates {
            list.extend(estimated::complaints(self));
        }
        let controls = self.pull_off || !self.mean_gap.is_empty();
        if controls && !estimates && method::find(&self.method).is_some_and(|m| m.card().id != "fast") {
            let accepted = "fast or auto: no other method controls the mean gap";
            list.push(Complaint::new("--method", &self.method, accepted));
        }
        if self.initial_gap.is_some() && self.range == RangeChoice::Extrapolate {
            let accepted = "mesh or true: the coarser grids of an extrapolation cannot start there";
            list.push(Complaint::new("--range", "extrapolate with --initial-gap", accepted));
        }
        if self.non_periodic && self.range == RangeChoice::Extrapolate {
            list.push(Complaint::new("--range", "extrapolate with --non-periodic", "mesh or true"));
        }
        match (self.wall, self.wall_length) {
            (WallKind::Penalty, None) => {
                list.push(Complaint::new(
                    "--penalty-length",
                    "not given",
                    "the length by which --wall penalty gives way",
                ));
            }
            (WallKind::Hard, Some(length)) => {
                list.push(Complaint::new("--penalty-length", length, "only together with --wall penalty"));
            }
            _ => {}
        }
        match self.crystal[..] {
            [] => {}
            [..] if self.thickness.is_some() => {
                let accepted = "one of the two: layers are isotropic";
                list.push(Complaint::new("--crystal", "given together with --thickness", accepted));
            }
            [c11, c12, c44] => {
                if let Err(Error::Input { list: why, .. }) = CubicHalfSpace::new(c11, c12, c44) {
                    list.extend(why.into_iter().map(|c| Complaint { key: format!("--crystal, {}", c.key), ..c }));
                }
            }
            _ => {
                let found = format!("{} numbers", self.crystal.len());
                list.push(Complaint::new("--crystal", found, "three: C11,C12,C44"));
            }
        }
        if !(0.0..=0.5).contains(&self.poisson) {
            list.push(Complaint::new("--poisson", self.poisson, "a number from 0 to 0.5"));
        }
        if let Some(n) = self.challenge.filter(|n| !(1..=MOST_POINTS).contains(n)) {
            list.push(Complaint::new("--challenge", n, format!("1 to {MOST_POINTS} points per side")));
        }
        let roll_off = Spectrum::CHALLENGE.lambda_r;
        if !(SHORTEST_CUT_OFF..=roll_off).contains(&self.cut_off) {
            let accepted = format!("a number from {SHORTEST_CUT_OFF} to the roll-off's {roll_off}");
            list.push(Complaint::new("--cut-off", self.cut_off, accepted));
        }
        if method::find(&self.method).is_none() {
            list.push(Complaint::new("--method", format!("{:?}", self.method), method::ids().join(", ")));
        }
        if list.is_empty() { Ok(()) } else { Err(Error::Input { place: "command line".into(), list }) }
    }

    /// The surface in lengths of the cell.
    fn given(&self, progress: &TerminalProgress) -> Result<Given> {
        if let Some(n) = self.challenge {
            let spectrum = Spectrum { lambda_s: self.cut_off, ..Spectrum::CHALLENGE };
            let (grid, modes) = (Grid::unit(n, n), Modes::new(spectrum, self.seed, 1.0));
            modes.left_out_by(grid).iter().for_each(|w| progress.warn(w));
            return Ok(Given::Series(grid, modes.series()));
        }
        let file = self.surface_file().expect("clap requires one of the two");
        let surface = Surface::read(
            file,
            SurfaceFile {
                asked: self.flags.asked(),
                fourier_points: self.flags.fourier_points,
                sign: if self.flip { Sign::HighFirst } else { Sign::LowFirst },
                unit: 1.0 / self.length,
                low_pass: self.low_pass.map_or(0.0, |l| l / self.length),
                low_pass_key: "--low-pass",
                sign_key: ("--flip", if self.flip { "given" } else { "not given" }),
                // Lengths are in the file's own unit.
                unit_um: None,
                place: "command line",
                unit_words: "as they are",
            },
        )?;
        match surface {
            Surface::Imported { grid, heights, .. } => {
                quality_warnings(grid, &heights).iter().for_each(|w| progress.warn(w));
                let ly = self.length_y.map_or(grid.ly, |y| y / self.length);
                Ok(Given::Nodes(Grid { ly, ..grid }, heights))
            }
            Surface::Fourier { modes, .. } => {
                let n = self.grid.unwrap_or(0);
                if !modes.held_by(Grid::unit(n.max(1), n.max(1))) {
                    let found = self.grid.map_or("not given".into(), |n| n.to_string());
                    let least = modes.smallest_grid();
                    let accepted =
                        format!("at least {least}, which holds every wave, or a --low-pass that leaves fewer");
                    return Err(Error::input("command line", "--grid", found, accepted));
                }
                Ok(Given::Series(Grid::unit(n, n), modes.into_series()))
            }
            Surface::Synthesised { .. } => unreachable!("files are no spectra"),
        }
    }

    fn surface_file(&self) -> Option<&std::path::Path> {
        self.file.as_ref().or(self.heights.as_ref()).map(PathBuf::as_path)
    }

    /// The problem, with the adhesion as asked for.
    fn problem<'a>(&self, grid: Grid, heights: Heights<'a>, tolerance: f64) -> Result<Problem<'a>> {
        let kernel = match (self.thickness, &self.crystal[..]) {
            (Some(t), _) => {
                Elastic::Layer(Layer { thickness: t / self.length, poisson: self.poisson, base: self.base })
            }
            (None, &[c11, c12, c44]) => Elastic::Cubic(CubicHalfSpace::new(c11, c12, c44)?),
            (None, _) if self.non_periodic => Elastic::NonPeriodic(NonPeriodic::of_region(grid.lx, grid.ly)),
            (None, _) => Elastic::HalfSpace,
        };
        let wall = match self.wall_length {
            Some(length) => Wall::Penalty(PenaltyWall { length: length / self.length }),
            None => Wall::Hard,
        };
        let gamma = self.gamma / (self.modulus * self.length);
        Ok(Problem {
            kernel,
            adhesion: self.law.adhesion(gamma, self.rho.unwrap_or(1.0) / self.length),
            wall,
            precision: self.precision,
            tolerance,
            targets: Targets {
                energy: self.energy_tolerance,
                area: self.area_tolerance,
                mean_gap: self.mean_gap_tolerance,
            },
            max_iterations: self.max_iterations,
            settings: self.settings()?,
            ..Problem::new(grid, heights)
        })
    }

    /// What methods are told beside the problem.
    fn settings(&self) -> Result<Settings> {
        // Dotted keys of TOML are just what is given, but for the quotes of words.
        let quoted = |given: &String| match given.split_once('=') {
            Some((key, value)) if given.parse::<toml::Table>().is_err() => format!("{key} = {:?}", value.trim()),
            _ => given.clone(),
        };
        let lines: Vec<String> = self.set.iter().map(quoted).collect();
        toml::from_str(&lines.join("\n")).map_err(|e| {
            let found = format!("{} ({})", self.set.join(" "), e.message());
            Error::input(
                "command line",
                "--set",
                found,
                "METHOD.KEY=VALUE, as `asperity schema` lists them under methods",
            )
        })
    }

    /// A mean gap of zero is reached by any pressure from one on, so that it asks for none.
    fn refuse_closed(&self, problem: &Problem) -> Result<()> {
        if problem.wall != Wall::Hard || !self.mean_gap.contains(&0.0) {
            return Ok(());
        }
        let mut accepted = "a positive gap".to_string();
        if problem.adhesion == Adhesion::None {
            let full = problem.full_contact_pressure() * self.modulus;
            accepted += &format!("; all of the surface touches from --pressure {full} on");
        }
        Err(Error::input("command line", "--mean-gap", 0, accepted))
    }

    /// Bytes planned, told if that is all that is asked for.
    ///
    /// # Errors
    /// Where they do not fit.
    fn planned(&self, method: &'static dyn ContactMethod, asked: &Problem, loads: &[Load]) -> Result<u64> {
        let planned = |problem| LoadPath::new(problem, method, self.range, 0.0, loads).plan(self.pull_off).bytes;
        let (need, have) = (planned(asked.clone()), crate::sys::available_memory_bytes());
        self.tell_plan(method, asked.grid, need, have)?;
        match need > have {
            true => {
                let advice = fitting(planned, asked, have);
                Err(Error::Memory { what: method.card().id.into(), need, have, advice })
            }
            false => Ok(need),
        }
    }

    /// What --dry-run is for.
    fn tell_plan(&self, method: &'static dyn ContactMethod, grid: Grid, need: u64, have: u64) -> Result<()> {
        if self.dry_run && self.json {
            return output::json_line(&json!({ "bytes": need, "available_bytes": have }));
        }
        if self.dry_run {
            let (id, need, have) = (method.card().id, memory(need), memory(have));
            let Grid { nx, ny, .. } = grid;
            output::print(&format!("{id} on {nx} x {ny} points needs {need} of memory; {have} are available"));
        }
        Ok(())
    }

    /// What a checkpoint must be of to be gone on from: this command, and what its files hold.
    fn key(&self) -> Result<String> {
        let files = [&self.surface_file().map(PathBuf::from), &self.initial_gap]
            .map(|f| f.as_ref().map(|f| Key::of_file(f)).transpose());
        let [heights, start] = files;
        let silent = Solve { json: false, ..self.clone() };
        Ok(Key::new("solve", &(format!("{silent:?}"), heights?, start?), &[])?.with(""))
    }

    pub fn execute(self) -> Result<()> {
        self.check()?;
        let method = method::find(&self.method).expect("checked");
        let progress = TerminalProgress::new();
        let given = self.given(&progress)?;
        let (grid, tolerance) = (given.grid(), self.tol.unwrap_or(default_tolerance(self.precision, given.grid())));
        let pressures = self.pressure.iter().map(|p| Load::Pressure(p / self.modulus));
        let loads: Vec<Load> = pressures.chain(self.mean_gap.iter().map(|g| Load::MeanGap(g / self.length))).collect();
        let asked = self.problem(grid, given.heights(), tolerance)?;
        if method.card().kind == Kind::Estimate {
            return estimated::run(&self, method, &asked, &loads, &progress);
        }
        if let Some(caveat) = self.range.resolution_warning(asked.adhesion, grid.dx().max(grid.dy())) {
            progress.warn(&caveat);
        }
        self.refuse_closed(&asked)?;
        // Of a map as it comes: what the default method makes of it takes no more.
        let before = Before::now(self.planned(method, &asked, &loads)?);
        if self.dry_run {
            return Ok(());
        }
        let given = match method.card().id {
            // The default method works on waves, of which the gradient is told, too: a map is transformed once, and let go.
            "fast" if !self.non_periodic => given.in_waves(),
            _ => given,
        };
        let asked = self.problem(grid, given.heights(), tolerance)?;
        let path = LoadPath::new(asked.clone(), method, self.range, 0.0, &loads);
        let mut reporter = SolveReporter::new(&self, &asked, &path, loads.len(), before);
        slope_warning(reporter.resolved_gradient).iter().for_each(|caveat| progress.warn(caveat));
        let (mut writer, mut begin) = (None, None);
        let mut solved_by = String::new();
        if let Some(out) = &self.out {
            let key = self.key()?;
            // A finished solve would be done anew by another build of the program.
            solved_by = format!("{key} {}", Key::of_program()?);
            cache::open(out)?;
            let fields = (0..loads.len()).map(|i| reporter.name(i, "", "gap.npy"));
            if let Some(finished) = SolveCache::find(out, &solved_by, fields.collect::<Vec<_>>()) {
                progress.note(&format!("finished already: this is what {} holds", out.display()));
                finished.states.into_iter().try_for_each(|line| reporter.again(line))?;
                return finished.pull_off.iter().try_for_each(|line| reporter.pull_off_again(line));
            }
            let checkpoint = Checkpoint::find(out, CHECKPOINT, &key);
            if checkpoint.is_none() && out.join(format!("{CHECKPOINT}.json")).exists() {
                let found = format!("{} (holds what another solve was interrupted with)", out.display());
                let accepted = "another folder, or that solve's own command to finish it";
                return Err(Error::input("command line", "--out", found, accepted));
            }
            let finished = checkpoint.as_ref().map_or(Vec::new(), |c| c.finished.clone());
            if checkpoint.is_some() {
                progress.note(&match finished.len() {
                    n if n < loads.len() => format!("going on from load {} of {}", n + 1, loads.len()),
                    _ => "going on with the pull-off".to_string(),
                });
            }
            finished.iter().try_for_each(|line| reporter.again(line.clone()))?;
            writer = Some(CheckpointWriter::new(out, CHECKPOINT, key, finished));
            begin = checkpoint.map(Begin::Checkpoint);
        }
        if let (None, Some(file)) = (&begin, &self.initial_gap) {
            let gap = crate::pipeline::start(file, grid)?;
            begin = Some(Begin::Gap(gap.into_iter().map(|g| g / self.length).collect()));
        }
        if let Some(out) = &self.out {
            match begin {
                Some(Begin::Checkpoint(_)) => SolveCache::forget(out),
                _ => cache::clear(out, self.initial_gap.as_deref())?,
            }
        }
        let what = format!("{} on {} x {} points", method.card().id, grid.nx, grid.ny);
        progress.begin("solve", &what);
        let watch = Progress::new(&progress, writer.as_ref(), "", (reporter.lines.len(), loads.len()));
        let pulled = path.walk(begin, self.pull_off, &watch, |i, reached| {
            watch.next();
            let state = &reached.state;
            if state.stop == Stop::Interrupted {
                // Where it happened to be is no result.
                writer.iter().for_each(|k| k.write_interrupted(grid, state));
                return Err(Error::Interrupted);
            }
            let line = reporter.state(i, &reached)?;
            match state.stop {
                Stop::Converged => {
                    if let Some(k) = &writer {
                        k.load_finished(line);
                    }
                    Ok(())
                }
                stop => Err(Error::NotConverged {
                    method: method.card().id,
                    why: stop.to_string(),
                    iterations: state.iterations,
                    residual: state.residual,
                    tolerance,
                    partial: self.out.as_ref().map(|o| o.join(reporter.name(i, "partial-", "gap.npy"))),
                }),
            }
        })?;
        let pulled = pulled.map(|p| reporter.pull_off(&p)).transpose()?;
        if let Some(out) = &self.out {
            SolveCache::write(out, solved_by, reporter.lines, pulled)?;
        }
        writer.iter().for_each(CheckpointWriter::remove_files);
        Ok(())
    }
}

/// What would fit into the memory that there is, on grids of the problem's shape; `bytes` plans a problem and all that is
/// held beside it.
fn fitting<'p>(bytes: impl Fn(Problem<'p>) -> u64, problem: &Problem<'p>, have: u64) -> String {
    let Grid { nx, ny, .. } = problem.grid;
    let of = |precision| {
        let grid = |n: usize| Grid { nx: n, ny: (n * ny / nx).max(1), ..problem.grid };
        let fits = |n| bytes(Problem { grid: grid(n), precision, ..problem.clone() }) <= have;
        // Bisection: one more point never needs less.
        let (mut low, mut high) = (0, nx + 1);
        while high - low > 1 {
            let middle = low + (high - low) / 2;
            if fits(middle) { low = middle } else { high = middle }
        }
        format!("{} x {} points", low, if low == 0 { 0 } else { grid(low).ny })
    };
    match problem.precision {
        Precision::F32 => format!("{} fit", of(Precision::F32)),
        Precision::F64 => format!("{} fit, with --precision f32 {}", of(Precision::F64), of(Precision::F32)),
    }
}

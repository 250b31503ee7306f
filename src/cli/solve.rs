use super::{listen, words};
use crate::error::Complaint;
use crate::grid::{Grid, Series};
use crate::interface::{Base, COHESIVE_RESOLUTION, CubicHalfSpace, Elastic, Layer, StiffWall, Wall};
use crate::method::{self, Goals, Heights, Iteration, Load, Precision, Problem, Stop};
use crate::observe::{contact_area, contact_map};
use crate::record::heights::{self, Sign};
use crate::record::{json, npy};
use crate::report::number::{duration, memory, percent, significant};
use crate::scene::{AdhesionLaw, WallKind, default_tolerance};
use crate::surface::{Modes, Spectrum};
use crate::{Error, Result};
use serde_json::json;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::process::ExitCode;

/// Lengths are in the unit of the heights, stresses in the unit of the modulus.
// A negative value is refused by its flag's own check, not taken for a flag.
#[derive(Debug, clap::Args)]
#[command(allow_negative_numbers = true)]
pub struct Solve {
    /// Height map: .npy or ASCII matrix. Low points touch first unless --flip.
    #[arg(long, value_name = "FILE", required_unless_present = "challenge", conflicts_with = "challenge")]
    heights: Option<PathBuf>,
    /// Instead of a map: the challenge's spectrum on N x N points of a cell of extent --length. Its waves are kept, not its
    /// heights, so that a large grid takes no more memory than the solver.
    #[arg(long, value_name = "N")]
    challenge: Option<usize>,
    /// Seed of the challenge's surface.
    #[arg(long, value_name = "N", default_value_t = 1, requires = "challenge")]
    seed: u64,
    /// Short cut-off wavelength of the challenge's surface over the cell.
    #[arg(long, value_name = "LAMBDA", default_value_t = Spectrum::CHALLENGE.lambda_s, requires = "challenge")]
    cut_off: f64,
    /// Extent of the map in x.
    #[arg(long, default_value_t = 1.0, value_name = "L")]
    length: f64,
    /// Extent in y. Default: square pixels.
    #[arg(long, value_name = "L")]
    length_y: Option<f64>,
    /// Contact modulus E* = E/(1-ν²).
    #[arg(long, default_value_t = 1.0, value_name = "E")]
    modulus: f64,
    /// Mean pressure.
    #[arg(long, value_name = "P")]
    pressure: f64,
    /// Work of adhesion γ (modulus times length).
    #[arg(long, default_value_t = 0.0, value_name = "GAMMA")]
    gamma: f64,
    /// Range ρ of the adhesion.
    #[arg(long)]
    rho: Option<f64>,
    /// How the attraction fades with the gap.
    #[arg(long, value_enum, default_value_t = AdhesionLaw::Exponential)]
    law: AdhesionLaw,
    /// What keeps the surfaces apart.
    #[arg(long, value_enum, default_value_t = WallKind::Hard)]
    wall: WallKind,
    /// Length by which a stiff wall gives way under a pressure of E*.
    #[arg(long)]
    wall_length: Option<f64>,
    /// An id from `asperity methods`, or auto.
    #[arg(long, default_value = "auto", value_name = "ID")]
    method: String,
    /// Largest rms KKT residual over the pressure. Default: 1e-8 in f64, 1e-3 in f32.
    #[arg(long)]
    tol: Option<f64>,
    /// Go on until the energy is within this part of the minimum (an estimate from above that `fast` makes).
    #[arg(long, value_name = "PART")]
    energy_goal: Option<f64>,
    /// Go on until the contact area is estimated to change by no more than this part.
    #[arg(long, value_name = "PART")]
    area_goal: Option<f64>,
    /// The same for the mean gap.
    #[arg(long, value_name = "PART")]
    gap_goal: Option<f64>,
    /// Floating-point type of the fields; sums are always f64.
    #[arg(long, value_enum, default_value_t = Precision::F64)]
    precision: Precision,
    /// Iterations after which the solver gives up.
    #[arg(long, default_value_t = 50_000, value_name = "N")]
    max_iterations: usize,
    /// High points touch first.
    #[arg(long)]
    flip: bool,
    /// Elastic layer of this thickness instead of the half-space.
    #[arg(long, value_name = "T")]
    thickness: Option<f64>,
    /// Poisson's ratio of the layer.
    #[arg(long, default_value_t = 0.3, value_name = "NU")]
    poisson: f64,
    /// The layer's lower face.
    #[arg(long, value_enum, default_value_t = Base::Bonded)]
    base: Base,
    /// Elastic constants of a cubic crystal, (001) face with x along [100], instead of an isotropic half-space. Any unit:
    /// only their ratios matter, E* is --modulus.
    #[arg(long, value_name = "C11,C12,C44", value_delimiter = ',', num_args = 1)]
    crystal: Vec<f64>,
    /// Write gap.npy, stress.npy, contact.npy and solve.json here; "partial-" goes before the names if not converged.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// One line of JSON on stdout.
    #[arg(long)]
    json: bool,
}

/// The surface to be solved for.
enum Given {
    Nodes(Grid, Vec<f64>),
    Series(Grid, Series<f64>),
}

impl Solve {
    fn check(&self, tolerance: f64) -> Result<()> {
        let mut list = Vec::new();
        let mut positive = |key: &str, value: f64| {
            if !(value.is_finite() && value > 0.0) {
                list.push(Complaint::new(key, value, "a positive number"));
            }
        };
        positive("--length", self.length);
        positive("--modulus", self.modulus);
        positive("--pressure", self.pressure);
        positive("--tol", tolerance);
        [
            ("--length-y", self.length_y),
            ("--rho", self.rho),
            ("--thickness", self.thickness),
            ("--wall-length", self.wall_length),
            ("--energy-goal", self.energy_goal),
            ("--area-goal", self.area_goal),
            ("--gap-goal", self.gap_goal),
        ]
        .into_iter()
        .for_each(|(key, value)| value.into_iter().for_each(|v| positive(key, v)));
        if tolerance >= 1.0 {
            list.push(Complaint::new("--tol", tolerance, "a number below 1"));
        }
        if !(self.gamma.is_finite() && self.gamma >= 0.0) {
            list.push(Complaint::new("--gamma", self.gamma, "zero or a positive number"));
        }
        if self.gamma > 0.0 && self.rho.is_none() {
            list.push(Complaint::new("--rho", "not given", "the range of the adhesion that --gamma asks for"));
        }
        match (self.wall, self.wall_length) {
            (WallKind::Stiff, None) => {
                list.push(Complaint::new("--wall-length", "not given", "the length by which --wall stiff gives way"));
            }
            (WallKind::Hard, Some(length)) => {
                list.push(Complaint::new("--wall-length", length, "only together with --wall stiff"));
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
        if method::find(&self.method).is_none() {
            list.push(Complaint::new("--method", format!("{:?}", self.method), method::ids().join(", ")));
        }
        if list.is_empty() { Ok(()) } else { Err(Error::Input { place: "command line".into(), list }) }
    }

    /// The surface in lengths of the cell.
    fn given(&self) -> Result<Given> {
        if let Some(n) = self.challenge {
            let spectrum = Spectrum { lambda_s: self.cut_off, ..Spectrum::CHALLENGE };
            return Ok(Given::Series(Grid::unit(n, n), Modes::new(spectrum, self.seed, 1.0).series()));
        }
        let file = self.heights.as_ref().expect("clap requires one of the two");
        let (map, declared) = heights::read(file)?;
        let sign = if self.flip { Sign::HighFirst } else { Sign::LowFirst };
        if let Some(says) = declared.sign.filter(|s| *s != sign) {
            let found = if self.flip { "given" } else { "not given" };
            let accepted = format!("what {} declares: {}", file.display(), says.words());
            return Err(Error::input("command line", "--flip", found, accepted));
        }
        let mut map = map.low_first(sign);
        let scale = 1.0 / self.length;
        map.heights.iter_mut().for_each(|h| *h *= scale);
        let ly = self.length_y.map_or(map.ny as f64 / map.nx as f64, |y| y / self.length);
        Ok(Given::Nodes(Grid { nx: map.nx, ny: map.ny, lx: 1.0, ly }, map.heights))
    }

    pub fn execute(self) -> Result<ExitCode> {
        let tolerance = self.tol.unwrap_or(default_tolerance(self.precision));
        self.check(tolerance)?;
        let method = method::find(&self.method).expect("checked");
        let given = self.given()?;
        let (grid, lent) = match &given {
            Given::Nodes(grid, nodes) => (*grid, nodes.into()),
            Given::Series(grid, series) => (*grid, Heights::Series(series)),
        };
        let kernel = match (self.thickness, &self.crystal[..]) {
            (Some(t), _) => {
                Elastic::Layer(Layer { thickness: t / self.length, poisson: self.poisson, base: self.base })
            }
            (None, &[c11, c12, c44]) => Elastic::Cubic(CubicHalfSpace::new(c11, c12, c44)?),
            (None, _) => Elastic::HalfSpace,
        };
        let wall = match self.wall_length {
            Some(length) => Wall::Stiff(StiffWall { length: length / self.length }),
            None => Wall::Hard,
        };
        let adhesion =
            self.law.adhesion(self.gamma / (self.modulus * self.length), self.rho.unwrap_or(1.0) / self.length);
        let problem = Problem {
            grid,
            heights: lent,
            kernel,
            adhesion,
            wall,
            precision: self.precision,
            tolerance,
            goals: Goals { energy: self.energy_goal, area: self.area_goal, mean_gap: self.gap_goal },
            max_iterations: self.max_iterations,
        };
        let cohesive_resolution = adhesion.cohesive_resolution(grid.dx().max(grid.dy()));
        if let Some(c) = cohesive_resolution.filter(|c| *c < COHESIVE_RESOLUTION) {
            eprintln!(
                "warning: the grid does not resolve the adhesion: cohesive resolution {c:.2}, and below \
                 {COHESIVE_RESOLUTION} contact lines are pinned to the grid and the answer depends on the path"
            );
        }
        let (plan, have) = (method.plan(&problem), crate::sys::available_memory_bytes());
        if plan.bytes > have {
            let advice = "a coarser map or --precision f32 needs less".into();
            return Err(Error::Memory { what: method.card().id.into(), need: plan.bytes, have, advice });
        }
        if let Some(out) = &self.out {
            std::fs::create_dir_all(out).map_err(Error::io("create", out))?;
        }
        let watch = |_: Iteration| if listen::stopping() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
        let mut run = method.start(&problem, &watch)?;
        let cpu_before = crate::sys::cpu_seconds();
        let state = run.equilibrate(Load::Pressure(self.pressure / self.modulus))?;
        let cpu_seconds = crate::sys::cpu_seconds() - cpu_before;
        let area = contact_area(grid, state.gap, 0.0);
        let energy = self.modulus * self.length;
        let line = json!({
            "method": method.card().id,
            "nx": grid.nx,
            "ny": grid.ny,
            "precision": self.precision,
            "threads": rayon::current_num_threads(),
            "kernel": kernel.to_string(),
            "adhesion": adhesion.to_string(),
            "wall": wall.to_string(),
            "cohesive_resolution": cohesive_resolution,
            "pressure": self.pressure,
            "criterion": "zero gap",
            "contact_fraction": area.fraction,
            "contact_fraction_corrected": area.corrected,
            "perimeter": area.perimeter / self.length,
            "mean_gap": state.mean_gap * self.length,
            "load_error": state.load_error,
            "residual": state.residual,
            "tolerance": tolerance,
            "complementarity": state.complementarity,
            "energy": state.energy * energy,
            "elastic_energy": state.elastic_energy * energy,
            "adhesion_energy": state.interaction_energy * energy,
            "settled": state.settled,
            "stop": state.stop.to_string(),
            "iterations": state.iterations,
            "fft_pairs": state.fft_pairs,
            "seconds": state.seconds,
            "cpu_seconds": cpu_seconds,
            "planned_bytes": plan.bytes,
            "peak_rss_bytes": crate::sys::peak_rss_bytes(),
        });
        if let Some(out) = &self.out {
            let (length, modulus) = (self.length, self.modulus);
            let n = state.gap.len();
            // A state that did not converge must not be taken for one that did, by name or by whoever reads the folder.
            let prefix = if state.stop == Stop::Converged { "" } else { "partial-" };
            let path = |name: &str| out.join(format!("{prefix}{name}"));
            npy::write(&path("gap.npy"), grid.nx, grid.ny, (0..n).map(|i| state.gap.at(i) * length))?;
            npy::write(&path("stress.npy"), grid.nx, grid.ny, (0..n).map(|i| state.stress.at(i) * modulus))?;
            npy::write(&path("contact.npy"), grid.nx, grid.ny, contact_map(state.gap, 0.0))?;
            json::write(&path("solve.json"), &line)?;
        }
        if self.json {
            words::json_line(&line)?;
        } else {
            words::say(&words::table(
                &["quantity", "value"],
                [
                    ("contact (zero gap)", percent(area.fraction)),
                    ("contact, perimeter-corrected", percent(area.corrected)),
                    ("mean gap", significant(state.mean_gap * self.length, 6)),
                    ("energy per area", significant(state.energy * energy, 6)),
                    ("load error", format!("{:.1e}", state.load_error)),
                    ("KKT residual over pressure", format!("{:.1e}", state.residual)),
                    ("stop", state.stop.to_string()),
                    ("iterations, FFT pairs", format!("{}, {:.1}", state.iterations, state.fft_pairs)),
                    (
                        "time, peak memory",
                        format!("{}, {}", duration(state.seconds), memory(crate::sys::peak_rss_bytes())),
                    ),
                ]
                .map(|(k, v)| vec![k.to_string(), v]),
            ));
        }
        match state.stop {
            Stop::Converged => Ok(ExitCode::SUCCESS),
            Stop::Interrupted => Err(Error::Interrupted),
            stop => Err(Error::NotConverged {
                method: method.card().id,
                why: stop.to_string(),
                iterations: state.iterations,
                residual: state.residual,
                tolerance,
                partial: self.out.map(|o| o.join("partial-gap.npy")),
            }),
        }
    }
}

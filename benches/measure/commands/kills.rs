use super::super::folder::{fields, of_the_scene};
use asperity::grid::sys;
use asperity::{Error, Result};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// Most kills of one run before it may end.
const MOST_KILLS: usize = 4;

/// Kill every long command with SIGKILL at random times, repeat it until it ends, and compare its results with those of
/// an undisturbed run.
#[derive(clap::Args)]
pub(super) struct Kills {
    /// Kills in all, spread evenly over the commands.
    #[arg(long, default_value_t = 200, value_name = "N")]
    kills: usize,
    #[arg(long, default_value_t = 1, value_name = "SEED")]
    seed: u64,
    /// The program. Default: that of this build.
    #[arg(long, default_value = env!("CARGO_BIN_EXE_asperity"), value_name = "FILE")]
    program: PathBuf,
    /// A folder to work in; that of a killed run whose results differ stays there.
    #[arg(long, value_name = "DIR")]
    folder: Option<PathBuf>,
    /// Small problems of tenths of a second.
    #[arg(long)]
    small: bool,
    /// Commands. Default: all; those with atoms need LAMMPS.
    #[arg(value_parser = COMMANDS)]
    commands: Vec<String>,
}

const COMMANDS: [&str; 7] = ["run", "run-atoms", "solve", "sweep", "tradeoff", "challenge", "atoms-run"];

const SCENE: &str = "[laboratory]\nlength = \"100 um\"\nmodulus = \"25 MPa\"\n[load]\np_star = [0.02, 0.05, 0.1]\n\
                     [continuum]\nmethod = \"gfmd\"\ncompare_with = [\"winkler\", \"fast\", \"icha\"]\n[surface]\n";

const ATOMS: &str = "[surface]\ngrid = 32\ncut_off_mode = 6\n[load]\np_star = [0.01, 0.03]\n\
                     [atoms]\ncells = 10\ndepth_cells = 4\n";

impl Kills {
    /// # Errors
    /// A run that fails after a kill, or whose results differ; I/O.
    pub(super) fn execute(self) -> Result<()> {
        let scratch = tempfile::tempdir().map_err(Error::io("create", "a scratch folder"))?;
        let folder = self.folder.clone().unwrap_or(scratch.path().to_path_buf());
        fs::create_dir_all(&folder).map_err(Error::io("create", &folder))?;
        self.write_scenes(&folder)?;
        let all = || COMMANDS.map(str::to_string).to_vec();
        let names = if self.commands.is_empty() { all() } else { self.commands.clone() };
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        println!("{:>10} {:>8} {:>6} {:>6} {:>7}", "command", "whole/s", "kills", "runs", "fields");
        let mut sum = 0;
        for (i, name) in names.iter().enumerate() {
            let share = (i + 1) * self.kills / names.len() - i * self.kills / names.len();
            let (whole, seconds) = self.undisturbed(name, &folder)?;
            let (mut kills, mut runs) = (0, 0);
            while kills < share {
                let most = random.random_range(1..=MOST_KILLS.min(share - kills));
                kills += self.disturbed(name, &folder, (most, seconds), &mut random)?;
                runs += 1;
                let found = results(name, &folder.join("out"))?;
                if let Some(what) = difference(&whole, &found) {
                    return Err(Error::format(
                        folder.join("out"),
                        format!("{name}: {what} after kills"),
                        "the results of folder whole",
                    ));
                }
            }
            println!("{name:>10} {seconds:>8.2} {kills:>6} {runs:>6} {:>7}", whole.0.len());
            sum += kills;
        }
        println!("{sum} kills, all results identical");
        Ok(())
    }

    fn write_scenes(&self, folder: &Path) -> Result<()> {
        let grid = if self.small { "grid = 32\ncut_off_mode = 8\n" } else { "grid = 256\ncut_off_mode = 64\n" };
        let point = if self.small { "grid = 16\ncut_off_mode = 6\n" } else { "grid = 128\ncut_off_mode = 32\n" };
        for (name, text) in [
            ("scene.toml", format!("name = \"kills\"\n{SCENE}{grid}")),
            ("point.toml", format!("name = \"point\"\n{SCENE}{point}")),
            ("atoms.toml", format!("name = \"atoms\"\n{ATOMS}")),
            ("sweep.toml", "scene = \"point.toml\"\n[over]\nsurface.seed = \"1..3\"\n".to_string()),
        ] {
            let file = folder.join(name);
            fs::write(&file, text).map_err(Error::io("write", &file))?;
        }
        Ok(())
    }

    /// The command that is killed; it writes into the folder `out`.
    fn command(&self, name: &str, folder: &Path, out: &Path) -> Command {
        let scene = |name: &str| folder.join(name);
        let mut command = Command::new(&self.program);
        let size = if self.small { "32" } else { "256" };
        match name {
            "run" => command.arg("run").arg(scene("scene.toml")),
            "run-atoms" => command.arg("run").arg(scene("atoms.toml")),
            "sweep" => command.arg("sweep").arg(scene("sweep.toml")),
            "solve" => command.args(["solve", "--challenge", size, "--cut-off", "0.03", "--method", "gfmd"]).args([
                "--pressure",
                "0.01,0.02,0.05,0.1",
                "--gamma",
                "0",
            ]),
            "tradeoff" => command.arg("tradeoff").arg(scene("point.toml")).args([
                "--methods",
                "fast,scgw",
                "--grids",
                if self.small { "16" } else { "64,128" },
                "--repeats",
                "1",
            ]),
            "challenge" => command.args(["challenge", "--grid", if self.small { "32" } else { "64" }]),
            _ => return self.atoms_run(out),
        };
        command.arg("--out").arg(out);
        command
    }

    fn atoms_run(&self, job: &Path) -> Command {
        let mut command = Command::new(&self.program);
        command.args(["atoms", "run"]).arg(job);
        command
    }

    /// Starts from an empty folder, or from the job that `atoms build` writes.
    fn prepare(&self, name: &str, folder: &Path, out: &Path) -> Result<()> {
        if out.exists() {
            fs::remove_dir_all(out).map_err(Error::io("remove", out))?;
        }
        if name == "atoms-run" {
            let mut build = Command::new(&self.program);
            build.args(["atoms", "build"]).arg(folder.join("atoms.toml")).arg("--out").arg(out);
            self.to_the_end(name, build)?;
        }
        Ok(())
    }

    /// Results and time of a run that is not killed.
    fn undisturbed(&self, name: &str, folder: &Path) -> Result<(Found, f64)> {
        let out = folder.join("out");
        self.prepare(name, folder, &out)?;
        let begun = Instant::now();
        self.to_the_end(name, self.command(name, folder, &out))?;
        let seconds = begun.elapsed().as_secs_f64();
        let found = results(name, &out)?;
        let whole = folder.join("whole");
        if whole.exists() {
            fs::remove_dir_all(&whole).map_err(Error::io("remove", &whole))?;
        }
        // The paths that a result names are the same in both.
        fs::rename(&out, &whole).map_err(Error::io("rename", &out))?;
        Ok((found, seconds))
    }

    /// Kills the command up to `most` times, each at a random part of the time of a whole run, and lets it end. Returns
    /// how often it was killed: some runs end before.
    fn disturbed(
        &self,
        name: &str,
        folder: &Path,
        (most, seconds): (usize, f64),
        random: &mut ChaCha8Rng,
    ) -> Result<usize> {
        let out = folder.join("out");
        self.prepare(name, folder, &out)?;
        let mut kills = 0;
        for _ in 0..most {
            let mut child =
                quiet(self.command(name, folder, &out)).spawn().map_err(Error::io("start", &self.program))?;
            std::thread::sleep(Duration::from_secs_f64(seconds * random.random_range(0.0..1.0)));
            let ended = child.try_wait().map_err(Error::io("wait for", &self.program))?;
            child.kill().and_then(|()| child.wait()).map_err(Error::io("kill", &self.program))?;
            match ended {
                None => kills += 1,
                Some(_) => break,
            }
        }
        self.to_the_end(name, self.command(name, folder, &out))?;
        Ok(kills)
    }

    fn to_the_end(&self, name: &str, command: Command) -> Result<()> {
        let mut command = quiet(command);
        let output = command.stderr(Stdio::piped()).output().map_err(Error::io("start", &self.program))?;
        // Statements of the challenge fail on a coarse grid (1); a LAMMPS whose parent was killed may hold its job for
        // an instant.
        if ended(name, output.status) {
            return Ok(());
        }
        let said = String::from_utf8_lossy(&output.stderr).lines().last().unwrap_or_default().to_string();
        Err(Error::format(format!("{command:?}"), format!("{}: {said}", output.status), "a run that ends"))
    }
}

fn ended(name: &str, status: ExitStatus) -> bool {
    status.success() || name == "challenge" && status.code() == Some(1)
}

fn quiet(mut command: Command) -> Command {
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    sys::group::die_with_parent(&mut command);
    command
}

/// Fields with their bytes, and results without times.
type Found = (Vec<(PathBuf, Vec<u8>)>, Value);

/// The first difference: a field's file, or a value with its path in the results.
fn difference(whole: &Found, found: &Found) -> Option<String> {
    let files = |found: &Found| found.0.iter().map(|(file, _)| file.clone()).collect::<Vec<_>>();
    if files(whole) != files(found) {
        return Some(format!("the fields {:?} in place of {:?}", files(found), files(whole)));
    }
    let field = whole.0.iter().zip(&found.0).find(|(a, b)| a != b);
    field.map(|(a, _)| format!("another field {}", a.0.display())).or_else(|| different_value("", &whole.1, &found.1))
}

fn different_value(path: &str, whole: &Value, found: &Value) -> Option<String> {
    match (whole, found) {
        (Value::Object(a), Value::Object(b)) if a.keys().eq(b.keys()) => {
            a.iter().zip(b.values()).find_map(|((key, a), b)| different_value(&format!("{path}.{key}"), a, b))
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            a.iter().zip(b).enumerate().find_map(|(i, (a, b))| different_value(&format!("{path}[{i}]"), a, b))
        }
        _ => (whole != found).then(|| format!("{path} = {found} in place of {whole}")),
    }
}

fn results(name: &str, out: &Path) -> Result<Found> {
    let json = |file: &str| -> Result<Value> {
        let path = out.join(file);
        let bytes = fs::read(&path).map_err(Error::io("read", &path))?;
        serde_json::from_slice(&bytes).map_err(|e| Error::format(&path, e, "JSON"))
    };
    let value = match name {
        "solve" => (1..=4).map(|k| json(&format!("load-{k}-solve.json"))).collect::<Result<Value>>()?,
        "sweep" => json("ensemble.json")?,
        // Costs and what is derived from them differ; states are among the fields.
        "tradeoff" => {
            let points = json("tradeoff.json")?["points"].as_array().cloned().unwrap_or_default();
            let kept = |p: &Value| ["method", "nx", "precision", "tolerance", "errors", "loads"].map(|k| p[k].clone());
            points.iter().map(|p| kept(p).into_iter().collect::<Value>()).collect()
        }
        "atoms-run" => Value::Null,
        "run-atoms" => {
            let found = json("results.json")?;
            // Peak memory of LAMMPS and times of its steps differ between runs.
            [found["atoms"]["states"].clone(), found["comparison"].clone(), found["continuum"].clone()]
                .into_iter()
                .collect()
        }
        _ => json("results.json")?,
    };
    Ok((fields(out), of_the_scene(&value)))
}

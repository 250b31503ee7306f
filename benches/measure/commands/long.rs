//! Long commands on small problems, and what they leave: for commands that disturb them.

use super::super::folder::{fields, of_the_scene};
use asperity::grid::sys;
use asperity::surface::files::hashed;
use asperity::{Error, Result};
use serde_json::Value;
use std::fs::{self, Permissions};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::Instant;

pub(super) const COMMANDS: [&str; 10] =
    ["run", "run-atoms", "solve", "pull-off", "sweep", "tradeoff", "challenge", "atoms-run", "report", "compare"];

/// Submits a sweep to a Slurm whose programs answer and start nothing, runs its tasks and collects the results. A folder that is damaged
/// fails in one of them.
const SUBMISSION: &str = "\"$0\" sweep sweep.toml --machine cluster --out \"$1\" || exit\n\
                          for task in 0 1 2; do \"$0\" slurm-task \"$1\" $task; done\n\
                          exec \"$0\" collect \"$1\"";

const MACHINES: &str = "[cluster]\nengine = \"slurm\"\npack_minutes = 0.0\n";

const SCENE: &str = "[laboratory]\nlength = \"100 um\"\nmodulus = \"25 MPa\"\n[load]\np_star = [0.02, 0.05, 0.1]\n\
                     [continuum]\nmethod = \"gfmd\"\ncompare_with = [\"winkler\", \"fast\", \"icha\"]\n[surface]\n";

const ATOMS: &str = "[surface]\ngrid = 32\ncut_off_mode = 6\n[load]\np_star = [0.01, 0.03]\n\
                     [atoms]\ncells = 10\ndepth_cells = 4\n";

/// What is random, what runs, and where.
#[derive(clap::Args)]
pub(super) struct Disturbance {
    #[arg(long, default_value_t = 1, value_name = "SEED")]
    pub seed: u64,
    /// The program. Default: that of this build.
    #[arg(long, default_value = env!("CARGO_BIN_EXE_asperity"), value_name = "FILE")]
    pub program: PathBuf,
    /// A folder to work in; one whose results differ stays there.
    #[arg(long, value_name = "DIR")]
    pub folder: Option<PathBuf>,
}

/// The program, and the size of the problems.
pub(super) struct LongCommands {
    pub program: PathBuf,
    /// Problems of tenths of a second.
    pub small: bool,
}

impl LongCommands {
    pub(super) fn write_scenes(&self, folder: &Path) -> Result<()> {
        let grid = if self.small { "grid = 32\ncut_off_mode = 8\n" } else { "grid = 256\ncut_off_mode = 64\n" };
        let point = if self.small { "grid = 16\ncut_off_mode = 6\n" } else { "grid = 128\ncut_off_mode = 32\n" };
        for (name, text) in [
            ("scene.toml", format!("name = \"kills\"\n{SCENE}{grid}")),
            ("point.toml", format!("name = \"point\"\n{SCENE}{point}")),
            ("atoms.toml", format!("name = \"atoms\"\n{ATOMS}")),
            ("sweep.toml", "scene = \"point.toml\"\n[over]\nsurface.seed = \"1..3\"\n".to_string()),
            ("machines.toml", MACHINES.to_string()),
            ("sbatch", "#!/bin/sh\necho 7\n".to_string()),
            ("squeue", "#!/bin/sh\n".to_string()),
        ] {
            let file = folder.join(name);
            fs::write(&file, text).map_err(Error::io("write", &file))?;
        }
        for name in ["sbatch", "squeue"] {
            let file = folder.join(name);
            fs::set_permissions(&file, Permissions::from_mode(0o755)).map_err(Error::io("write", &file))?;
        }
        Ok(())
    }

    /// A command; it writes into the folder `out`.
    pub(super) fn command(&self, name: &str, folder: &Path, out: &Path) -> Command {
        let scene = |name: &str| folder.join(name);
        let mut command = Command::new(&self.program);
        let size = if self.small { "32" } else { "256" };
        match name {
            "run" => command.arg("run").arg(scene("scene.toml")),
            "run-atoms" => command.arg("run").arg(scene("atoms.toml")),
            "report" | "compare" => {
                command.arg(name).arg(out);
                return command;
            }
            "submission" => return self.submission(folder, out),
            "pull-off" => command
                .args(["solve", "--challenge", size, "--cut-off", "0.1", "--pressure", "0.01,0.02"])
                .args(["--gamma", "0.02", "--range", "0.05", "--pull-off"]),
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

    fn submission(&self, folder: &Path, out: &Path) -> Command {
        let mut command = Command::new("sh");
        let path = format!("{}:{}", folder.display(), std::env::var("PATH").unwrap_or_default());
        command.args(["-c", SUBMISSION]).arg(&self.program).arg(out).current_dir(folder).env("PATH", path);
        command
    }

    fn atoms_run(&self, job: &Path) -> Command {
        let mut command = Command::new(&self.program);
        command.args(["atoms", "run"]).arg(job);
        command
    }

    /// Starts from an empty folder, from the job that `atoms build` writes, or from a finished run.
    pub(super) fn prepare(&self, name: &str, folder: &Path, out: &Path) -> Result<()> {
        remove(out)?;
        match name {
            "atoms-run" => {
                let mut build = Command::new(&self.program);
                build.args(["atoms", "build"]).arg(folder.join("atoms.toml")).arg("--out").arg(out);
                self.to_the_end(name, build)
            }
            "report" => self.place_finished("run", folder, out),
            "compare" => self.place_finished("run-atoms", folder, out),
            _ => Ok(()),
        }
    }

    /// The same run each time: its page names the hash of results with times.
    fn place_finished(&self, name: &str, folder: &Path, out: &Path) -> Result<()> {
        let finished = folder.join(format!("finished-{name}"));
        if !finished.exists() {
            self.to_the_end(name, self.command(name, folder, out))?;
            fs::rename(out, &finished).map_err(Error::io("rename", out))?;
        }
        replace(&finished, out)
    }

    /// Results and time of a command that is not disturbed; its folder becomes `whole`.
    pub(super) fn undisturbed(&self, name: &str, folder: &Path) -> Result<(Found, f64)> {
        let out = folder.join("out");
        self.prepare(name, folder, &out)?;
        let begun = Instant::now();
        self.to_the_end(name, self.command(name, folder, &out))?;
        let seconds = begun.elapsed().as_secs_f64();
        let found = results(name, &out)?;
        let whole = folder.join("whole");
        remove(&whole)?;
        // The paths that a result names are the same in both.
        fs::rename(&out, &whole).map_err(Error::io("rename", &out))?;
        Ok((found, seconds))
    }

    pub(super) fn to_the_end(&self, name: &str, command: Command) -> Result<()> {
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

pub(super) fn quiet(mut command: Command) -> Command {
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    sys::group::die_with_parent(&mut command);
    command
}

/// Fields with their bytes, and results without times.
pub(super) type Found = (Vec<(PathBuf, Vec<u8>)>, Value);

/// The first difference: a field's file, or a value with its path in the results.
pub(super) fn difference(whole: &Found, found: &Found) -> Option<String> {
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

pub(super) fn results(name: &str, out: &Path) -> Result<Found> {
    let json = |file: &str| -> Result<Value> {
        let path = out.join(file);
        let bytes = fs::read(&path).map_err(Error::io("read", &path))?;
        serde_json::from_slice(&bytes).map_err(|e| Error::format(&path, e, "JSON"))
    };
    let value = match name {
        "solve" => (1..=4).map(|k| json(&format!("load-{k}-solve.json"))).collect::<Result<Value>>()?,
        "pull-off" => json("done.json")?["states"].clone(),
        "report" => hashed::file_hash(&out.join("report.html"))?.into(),
        "sweep" | "submission" => json("ensemble.json")?,
        // Costs and what is derived from them differ; states are among the fields.
        "tradeoff" => {
            let points = json("tradeoff.json")?["points"].as_array().cloned().unwrap_or_default();
            let kept = |p: &Value| ["method", "nx", "precision", "tolerance", "errors", "loads"].map(|k| p[k].clone());
            points.iter().map(|p| kept(p).into_iter().collect::<Value>()).collect()
        }
        "atoms-run" => Value::Null,
        "run-atoms" | "compare" => {
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

/// Files and folders below a folder, sorted.
pub(super) fn entries(folder: &Path) -> Vec<PathBuf> {
    let mut list = Vec::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(&next).into_iter().flatten().flatten() {
            folders.extend(entry.path().is_dir().then(|| entry.path()));
            list.push(entry.path());
        }
    }
    list.sort();
    list
}

pub(super) fn remove(place: &Path) -> Result<()> {
    match fs::symlink_metadata(place) {
        Err(_) => Ok(()),
        Ok(data) if data.is_dir() => fs::remove_dir_all(place),
        Ok(_) => fs::remove_file(place),
    }
    .map_err(Error::io("remove", place))
}

/// A copy of a folder in place of another.
pub(super) fn replace(from: &Path, to: &Path) -> Result<()> {
    remove(to)?;
    fs::create_dir(to).map_err(Error::io("create", to))?;
    for entry in entries(from) {
        let place = to.join(entry.strip_prefix(from).expect("below"));
        let copied = if entry.is_dir() { fs::create_dir(&place) } else { fs::copy(&entry, &place).map(|_| ()) };
        copied.map_err(Error::io("copy", &entry))?;
    }
    Ok(())
}

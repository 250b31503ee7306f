//! `machines.toml`: how a machine runs points of a sweep.

use asperity_atoms::lammps_command::LammpsCommand;
use asperity_grid::error::{Error, Result};
use asperity_surface::files::atomic_file::read_text;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Name of the file, in the working folder and in the user's folder of settings.
const FILE: &str = "machines.toml";

/// Shortest time between the signal and the time limit, s: Slurm looks about twice a minute.
const LEAST_MARGIN_SECONDS: u64 = 60;

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Engine {
    #[default]
    Local,
    Slurm,
}

/// A machine of `machines.toml`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Machine {
    pub engine: Engine,
    /// Lines of shell before the program, as `module load lammps`.
    pub setup: Vec<String>,
    /// Options of sbatch, as `--partition=short`.
    pub sbatch: Vec<String>,
    /// Time limit of a turn, as Slurm has it: minutes, `hours:minutes:seconds` or `days-hours`.
    pub time: String,
    /// Time between the signal that ends a turn and its limit, s.
    pub margin_seconds: u64,
    /// Cores of a task: threads of asperity, and MPI ranks.
    pub cpus: usize,
    /// Memory of a task, MB. Default: a quarter more than planned, and 200 MB.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub memory_mb: Option<u64>,
    /// Tasks or local points that run at once. Default: as many as there are.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_once: Option<usize>,
    /// Points are put into one task until their planned time exceeds this.
    pub pack_minutes: f64,
    /// Most tasks of an array (`MaxArraySize` of Slurm, less one).
    pub most_tasks: usize,
    /// Path of asperity there. Default: this program.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub program: Option<PathBuf>,
    pub lammps: LammpsCommand,
}

impl Default for Machine {
    fn default() -> Self {
        Machine {
            engine: Engine::Local,
            setup: Vec::new(),
            sbatch: Vec::new(),
            time: "60".into(),
            margin_seconds: 120,
            cpus: 1,
            memory_mb: None,
            at_once: None,
            pack_minutes: 10.0,
            most_tasks: 1000,
            program: None,
            lammps: LammpsCommand::default(),
        }
    }
}

impl Machine {
    /// Seconds of a turn.
    pub fn seconds(&self) -> u64 {
        seconds(&self.time).unwrap_or(0)
    }

    /// The first value that is not accepted: key, value, what is accepted.
    fn complaint(&self) -> Option<(&'static str, String, String)> {
        let wrong = |key, value: String, accepted: &str| Some((key, value, accepted.to_string()));
        let one_line = |lines: &[String]| lines.iter().find(|l| l.contains('\n')).cloned();
        let ranks = self.lammps.ranks.unwrap_or(1);
        match seconds(&self.time) {
            None => wrong("time", self.time.clone(), "minutes, hours:minutes:seconds or days-hours:minutes:seconds"),
            Some(limit) if self.margin_seconds < LEAST_MARGIN_SECONDS || self.margin_seconds >= limit => {
                let accepted = format!("{LEAST_MARGIN_SECONDS} s or more, and less than time = {:?}", self.time);
                wrong("margin_seconds", self.margin_seconds.to_string(), &accepted)
            }
            _ if !(1..=65_536).contains(&self.cpus) => wrong("cpus", self.cpus.to_string(), "1 to 65536 cores"),
            _ if self.at_once == Some(0) => wrong("at_once", "0".into(), "1 or more"),
            _ if self.memory_mb == Some(0) => wrong("memory_mb", "0".into(), "1 or more"),
            _ if !(self.pack_minutes >= 0.0 && self.pack_minutes.is_finite()) => {
                wrong("pack_minutes", self.pack_minutes.to_string(), "minutes, zero for one point in each task")
            }
            _ if self.most_tasks == 0 => wrong("most_tasks", "0".into(), "1 or more"),
            _ if ranks == 0 || ranks > self.cpus && self.engine == Engine::Slurm => {
                wrong("lammps.ranks", ranks.to_string(), &format!("1 to cpus = {}", self.cpus))
            }
            _ => {
                let options = self.sbatch.iter().find(|o| !o.starts_with('-') || o.contains('\n')).cloned();
                let options = options.map(|o| ("sbatch", o, "options of sbatch, as \"--partition=short\"".into()));
                options
                    .or_else(|| one_line(&self.setup).map(|l| ("setup", l, "one line of shell in each entry".into())))
            }
        }
    }
}

/// Seconds of a time limit of Slurm; `None` for other text and for zero.
fn seconds(text: &str) -> Option<u64> {
    let numbers = |t: &str| t.split(':').map(|n| n.parse::<u64>().ok()).collect::<Option<Vec<u64>>>();
    let total = match text.split_once('-') {
        Some((days, rest)) => {
            let rest = numbers(rest).filter(|n| n.len() <= 3)?;
            let mut below = rest.iter().zip([3600, 60, 1]).map(|(n, unit)| n.checked_mul(unit));
            let below = below.try_fold(0_u64, |sum, part| sum.checked_add(part?))?;
            days.parse::<u64>().ok()?.checked_mul(86_400)?.checked_add(below)?
        }
        None => match numbers(text)?[..] {
            [minutes] => minutes.checked_mul(60)?,
            [minutes, seconds] => minutes.checked_mul(60)?.checked_add(seconds)?,
            [hours, minutes, seconds] => {
                hours.checked_mul(3600)?.checked_add(minutes.checked_mul(60)?)?.checked_add(seconds)?
            }
            _ => return None,
        },
    };
    (total > 0).then_some(total)
}

/// The machine `name` of `file`, or of `machines.toml` in the working folder, or of that in the user's folder of settings.
///
/// # Errors
/// `Io` and `Format` for a file that cannot be read; `Input` for a wrong value, or a name that no file has.
pub fn find(name: &str, file: Option<&Path>) -> Result<Machine> {
    let files = match file {
        Some(file) => vec![file.to_path_buf()],
        None => [Some(PathBuf::from(FILE)), user_file()].into_iter().flatten().filter(|f| f.exists()).collect(),
    };
    let mut known = Vec::new();
    for file in &files {
        let mut machines = read(file)?;
        if let Some(machine) = machines.remove(name) {
            return match machine.complaint() {
                Some((key, value, accepted)) => {
                    Err(Error::input(file.display(), format!("{name}.{key}"), value, accepted))
                }
                None => Ok(machine),
            };
        }
        known.extend(machines.into_keys());
    }
    let accepted = match (files.is_empty(), known.is_empty()) {
        (true, _) => {
            "a machine of machines.toml, in the working folder or in ~/.config/asperity (docs/cluster.md)".into()
        }
        (_, true) => "a machine: the file has none".into(),
        _ => known.join(", "),
    };
    Err(Error::input("command line", "--machine", name, accepted))
}

fn read(file: &Path) -> Result<BTreeMap<String, Machine>> {
    let text = read_text(file)?;
    toml::from_str(&text).map_err(|e| {
        let line = e.span().map_or(1, |span| text[..span.start.min(text.len())].matches('\n').count() + 1);
        let message = e.message().lines().next().unwrap_or_default();
        // The message of a value does not name its key.
        let key = text.lines().nth(line - 1).and_then(|l| Some(l.split_once('=')?.0.trim()));
        let key = key.filter(|k| !message.contains(k)).map(|k| format!("{k}: "));
        let found = format!("line {line}: {}{message}", key.unwrap_or_default());
        Error::format(file, found, "a table for each machine, with the keys and values of docs/cluster.md")
    })
}

fn user_file() -> Option<PathBuf> {
    let settings = std::env::var_os("XDG_CONFIG_HOME").map(PathBuf::from);
    let folder = settings.or_else(|| Some(PathBuf::from(std::env::var_os("HOME")?).join(".config")))?;
    Some(folder.join("asperity").join(FILE))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_those_of_slurm() {
        let times = ["90", "1:30", "2:00:00", "1-12", "1-00:30", "1-00:00:05"];
        let expected = [5400, 90, 7200, 129_600, 88_200, 86_405];
        assert_eq!(times.map(|t| seconds(t).expect("a time")), expected);
        for wrong in ["", "0", "two", "1:2:3:4", "1-", "-5", "99999999999999999999"] {
            assert_eq!(seconds(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn machines_are_found_by_name() {
        let folder = tempfile::tempdir().expect("scratch");
        let file = folder.path().join(FILE);
        let text = "[desk]\nat_once = 2\n[cluster]\nengine = \"slurm\"\ntime = \"04:00:00\"\ncpus = 8\n\
                    lammps = { ranks = 8, launcher = \"srun -n {ranks}\" }\n[short]\nengine = \"slurm\"\ntime = \"1\"\n";
        std::fs::write(&file, text).expect("written");
        let machine = find("cluster", Some(&file)).expect("found");
        assert_eq!((machine.engine, machine.seconds(), machine.lammps.ranks), (Engine::Slurm, 14_400, Some(8)));
        let unknown = find("desktop", Some(&file)).expect_err("unknown").to_string();
        assert!(unknown.contains("--machine = desktop") && unknown.contains("cluster, desk"), "{unknown}");
        let wrong = find("short", Some(&file)).expect_err("too short").to_string();
        assert!(wrong.contains("short.margin_seconds = 120"), "{wrong}");
    }

    #[test]
    fn wrong_values_are_named() {
        let folder = tempfile::tempdir().expect("scratch");
        let file = folder.path().join(FILE);
        for (text, named) in [
            ("[a]\ntime = \"soon\"", "a.time = soon"),
            ("[a]\nengine = \"slurm\"\ncpus = 2\nlammps.ranks = 4", "a.lammps.ranks = 4"),
            ("[a]\nsbatch = [\"partition=x\"]", "a.sbatch = partition=x"),
            ("[a]\npack_minutes = -1.0", "a.pack_minutes = -1"),
            ("\n[a]\ntimes = \"1\"", "line 3: unknown field `times`"),
        ] {
            std::fs::write(&file, text).expect("written");
            let error = find("a", Some(&file)).expect_err(text).to_string();
            assert!(error.contains(named), "{error}");
        }
    }
}

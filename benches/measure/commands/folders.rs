use super::long::{Disturbance, LongCommands, difference, entries, quiet, remove, replace, results};
use asperity::{Error, Result};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use std::fs;
use std::io::Read;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Damage a random file or folder of what each command left, draw the report, repeat the command, and compare. Damaged results
/// are computed again; links, pipes and folders in place of files are refused, and once they are removed the command ends as
/// without them. Nothing outside of the folder is read or changed.
#[derive(clap::Args)]
pub(super) struct Folders {
    /// Damages in all, spread evenly over the commands.
    #[arg(long, default_value_t = 1000, value_name = "N")]
    damages: usize,
    #[command(flatten)]
    with: Disturbance,
    /// Commands. Default: all without atoms.
    #[arg(value_parser = COMMANDS)]
    commands: Vec<String>,
}

const COMMANDS: [&str; 6] = ["run", "solve", "sweep", "tradeoff", "submission", "run-atoms"];

/// The last one needs LAMMPS.
const WITHOUT_ATOMS: usize = 5;

/// Longest time of a command, which takes tenths of a second.
const LIMIT: Duration = Duration::from_secs(60);

/// What links lead to.
const VICTIM: &str = "keep";

/// Files, and what they hold.
type Tree = Vec<(PathBuf, Vec<u8>)>;

#[derive(Debug, Clone, Copy)]
enum Damage {
    Removed,
    Cut,
    Flipped,
    Empty,
    /// Noise of the same length.
    Noise,
    /// Another file of the folder.
    Exchanged,
    Link,
    LinkToFolder,
    Pipe,
    Folder,
}

const DAMAGES: [Damage; 10] = [
    Damage::Removed,
    Damage::Cut,
    Damage::Flipped,
    Damage::Empty,
    Damage::Noise,
    Damage::Exchanged,
    Damage::Link,
    Damage::LinkToFolder,
    Damage::Pipe,
    Damage::Folder,
];

impl Damage {
    /// Whether it is no file any more.
    fn is_of_kind(self) -> bool {
        matches!(self, Damage::Link | Damage::LinkToFolder | Damage::Pipe | Damage::Folder)
    }
}

impl Folders {
    /// # Errors
    /// A damage that is used, that no repetition repairs, or that reaches out of the folder; a bug; I/O.
    pub(super) fn execute(self) -> Result<()> {
        let scratch = tempfile::tempdir().map_err(Error::io("create", "a scratch folder"))?;
        let folder = self.with.folder.clone().unwrap_or(scratch.path().to_path_buf());
        fs::create_dir_all(&folder).map_err(Error::io("create", &folder))?;
        let long = LongCommands { program: self.with.program.clone(), small: true };
        long.write_scenes(&folder)?;
        let victims = Victims::create(&folder)?;
        let all = || COMMANDS[..WITHOUT_ATOMS].iter().map(|s| s.to_string()).collect();
        let names: Vec<String> = if self.commands.is_empty() { all() } else { self.commands.clone() };
        let mut random = ChaCha8Rng::seed_from_u64(self.with.seed);
        println!("{:>10} {:>8} {:>9} {:>8}", "command", "damages", "computed", "refused");
        for (i, name) in names.iter().enumerate() {
            let share = (i + 1) * self.damages / names.len() - i * self.damages / names.len();
            let (whole, _) = long.undisturbed(name, &folder)?;
            let out = folder.join("out");
            let outside = victims.outside(&out)?;
            let mut refusals = 0;
            for _ in 0..share {
                replace(&folder.join("whole"), &out)?;
                let (place, damage) = victims.damage(&out, &mut random)?;
                let fail = |what: String| {
                    let found = format!("{name}: {damage:?} {}: {what}", place.display());
                    Err(Error::format(&out, found, "the results of folder whole, or a refusal"))
                };
                if matches!(name.as_str(), "run" | "sweep" | "submission" | "run-atoms") {
                    let mut report = Command::new(&long.program);
                    report.arg("report").arg(&out);
                    let (code, said) = ended(report)?;
                    if !matches!(code, Some(0 | 2)) {
                        return fail(format!("report ended with {code:?}: {said}"));
                    }
                }
                let (mut code, mut said) = ended(long.command(name, &folder, &out))?;
                if code == Some(2) && damage.is_of_kind() {
                    refusals += 1;
                    remove(&place)?;
                    (code, said) = ended(long.command(name, &folder, &out))?;
                }
                if code != Some(0) {
                    return fail(format!("the command ended with {code:?}: {said}"));
                }
                if let Some(what) = difference(&whole, &results(name, &out)?) {
                    return fail(what);
                }
                if victims.outside(&out)? != outside {
                    return fail("a file outside of the folder was changed".to_string());
                }
            }
            println!("{name:>10} {share:>8} {:>9} {refusals:>8}", share - refusals);
        }
        println!("no damage was used, none lasted, and nothing outside was changed");
        Ok(())
    }
}

/// A file and a folder outside, to which links lead, and all that lies next to the damaged folder.
struct Victims {
    file: PathBuf,
    folder: PathBuf,
    all: PathBuf,
}

impl Victims {
    fn create(folder: &Path) -> Result<Self> {
        let victims =
            Victims { file: folder.join("victim"), folder: folder.join("victims"), all: folder.to_path_buf() };
        fs::create_dir_all(&victims.folder).map_err(Error::io("create", &victims.folder))?;
        for file in [&victims.file, &victims.folder.join("file")] {
            fs::write(file, VICTIM).map_err(Error::io("write", file))?;
        }
        Ok(victims)
    }

    /// Everything but the damaged folder.
    fn outside(&self, out: &Path) -> Result<Tree> {
        let mut tree = Tree::new();
        for place in entries(&self.all).into_iter().filter(|place| !place.starts_with(out)) {
            let bytes = if place.is_file() { fs::read(&place).map_err(Error::io("read", &place))? } else { Vec::new() };
            tree.push((place, bytes));
        }
        Ok(tree)
    }

    /// Damages a random entry below a folder.
    fn damage(&self, out: &Path, random: &mut ChaCha8Rng) -> Result<(PathBuf, Damage)> {
        let entries = entries(out);
        let place = entries[random.random_range(0..entries.len())].clone();
        let mut damage = DAMAGES[random.random_range(0..DAMAGES.len())];
        if place.is_dir() && !damage.is_of_kind() {
            damage = Damage::Removed;
        }
        let io = Error::io("damage", &place);
        let mut bytes = if place.is_file() { fs::read(&place).map_err(Error::io("read", &place))? } else { Vec::new() };
        match damage {
            Damage::Cut => bytes.truncate(random.random_range(0..bytes.len().max(1))),
            Damage::Flipped if !bytes.is_empty() => {
                let k = random.random_range(0..bytes.len());
                bytes[k] ^= 1 << random.random_range(0..8);
            }
            Damage::Empty => bytes.clear(),
            Damage::Noise => random.fill(&mut bytes[..]),
            Damage::Exchanged => {
                let files: Vec<&PathBuf> = entries.iter().filter(|e| e.is_file()).collect();
                let other = files[random.random_range(0..files.len())];
                bytes = fs::read(other).map_err(Error::io("read", other))?;
            }
            _ => {}
        }
        remove(&place)?;
        match damage {
            Damage::Removed => Ok(()),
            Damage::Link => symlink(&self.file, &place),
            Damage::LinkToFolder => symlink(&self.folder, &place),
            Damage::Folder => fs::create_dir(&place),
            Damage::Pipe => {
                let made = Command::new("mkfifo").arg(&place).status();
                made.and_then(|s| if s.success() { Ok(()) } else { Err(std::io::Error::other("mkfifo failed")) })
            }
            _ => fs::write(&place, bytes),
        }
        .map_err(io)?;
        Ok((place, damage))
    }
}

/// Exit code of a command and the last line that it said; `None` for one that a signal ended, or that did not end in time.
fn ended(command: Command) -> Result<(Option<i32>, String)> {
    let mut command = quiet(command);
    let mut child = command.stderr(Stdio::piped()).spawn().map_err(Error::io("start", "the program"))?;
    let begun = Instant::now();
    while child.try_wait().map_err(Error::io("wait for", "the program"))?.is_none() {
        if begun.elapsed() > LIMIT {
            child.kill().and_then(|()| child.wait()).map_err(Error::io("kill", "the program"))?;
            return Ok((None, format!("no end within {} s", LIMIT.as_secs())));
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    let code = child.wait().map_err(Error::io("wait for", "the program"))?.code();
    let mut said = String::new();
    if let Some(mut stderr) = child.stderr.take() {
        stderr.read_to_string(&mut said).map_err(Error::io("read", "the program's words"))?;
    }
    Ok((code, said.lines().last().unwrap_or_default().to_string()))
}

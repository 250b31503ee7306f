use super::long::{COMMANDS, Disturbance, LongCommands, difference, quiet, results};
use asperity::{Error, Result};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use std::fs;
use std::io;
use std::path::Path;
use std::process::{Child, Command};
use std::time::Duration;

/// Most kills of one run before it may end.
const MOST_KILLS: usize = 4;

/// Interrupt every long command at random times by SIGKILL, SIGTERM or SIGSTOP and SIGCONT, repeat it until it ends, and compare its
/// results with those of an undisturbed run.
#[derive(clap::Args)]
pub(super) struct Kills {
    /// Interruptions in all, spread evenly over the commands.
    #[arg(long, default_value_t = 200, value_name = "N")]
    kills: usize,
    #[command(flatten)]
    with: Disturbance,
    /// Small problems of tenths of a second.
    #[arg(long)]
    small: bool,
    /// Commands. Default: all; those with atoms need LAMMPS.
    #[arg(value_parser = COMMANDS)]
    commands: Vec<String>,
}

impl Kills {
    /// # Errors
    /// A run that fails after a kill, or whose results differ; I/O.
    pub(super) fn execute(self) -> Result<()> {
        let scratch = tempfile::tempdir().map_err(Error::io("create", "a scratch folder"))?;
        let folder = self.with.folder.clone().unwrap_or(scratch.path().to_path_buf());
        fs::create_dir_all(&folder).map_err(Error::io("create", &folder))?;
        let long = LongCommands { program: self.with.program.clone(), small: self.small };
        long.write_scenes(&folder)?;
        let all = || COMMANDS.map(str::to_string).to_vec();
        let names = if self.commands.is_empty() { all() } else { self.commands.clone() };
        let mut random = ChaCha8Rng::seed_from_u64(self.with.seed);
        println!("{:>10} {:>8} {:>6} {:>6} {:>7}", "command", "whole/s", "stops", "runs", "fields");
        let mut sum = 0;
        for (i, name) in names.iter().enumerate() {
            let share = (i + 1) * self.kills / names.len() - i * self.kills / names.len();
            let (whole, seconds) = long.undisturbed(name, &folder)?;
            let (mut kills, mut runs) = (0, 0);
            while kills < share {
                let most = random.random_range(1..=MOST_KILLS.min(share - kills));
                kills += disturbed(&long, name, &folder, (most, seconds), &mut random)?;
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
        println!("{sum} interruptions, all results identical");
        Ok(())
    }
}

/// How a command is interrupted.
#[derive(Clone, Copy)]
enum Signal {
    Kill,
    Term,
    /// It goes on after [`STOPPED`].
    Stop,
}

const SIGNALS: [Signal; 3] = [Signal::Kill, Signal::Term, Signal::Stop];

const STOPPED: Duration = Duration::from_millis(50);

impl Signal {
    fn send(self, child: &mut Child) -> io::Result<()> {
        let by_name = |name: &str| Command::new("kill").args([name, &child.id().to_string()]).status().map(drop);
        match self {
            Signal::Kill => child.kill(),
            Signal::Term => by_name("-TERM"),
            Signal::Stop => {
                by_name("-STOP")?;
                std::thread::sleep(STOPPED);
                by_name("-CONT")
            }
        }
    }
}

/// Interrupts the command up to `most` times, each at a random part of the time of a whole run, and lets it end. Returns
/// how often it was interrupted: some runs end before.
fn disturbed(
    long: &LongCommands,
    name: &str,
    folder: &Path,
    (most, seconds): (usize, f64),
    random: &mut ChaCha8Rng,
) -> Result<usize> {
    let out = folder.join("out");
    long.prepare(name, folder, &out)?;
    let mut kills = 0;
    for _ in 0..most {
        let mut child = quiet(long.command(name, folder, &out)).spawn().map_err(Error::io("start", &long.program))?;
        std::thread::sleep(Duration::from_secs_f64(seconds * random.random_range(0.0..1.0)));
        let ended = child.try_wait().map_err(Error::io("wait for", &long.program))?;
        if ended.is_some() {
            break;
        }
        let signal = SIGNALS[random.random_range(0..SIGNALS.len())];
        signal.send(&mut child).and_then(|()| child.wait()).map_err(Error::io("interrupt", &long.program))?;
        kills += 1;
    }
    long.to_the_end(name, long.command(name, folder, &out))?;
    Ok(kills)
}

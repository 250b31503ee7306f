use super::super::fuzz::{driver, targets};
use asperity::{Error, Result};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Longest time that one input may take.
const LIMIT: Duration = Duration::from_secs(2);

/// Read randomly changed copies of valid files with every reader: each must end in a value or one line of error within
/// 2 s, with memory in proportion to its size.
#[derive(clap::Args)]
pub(super) struct Damage {
    /// Changed copies for each reader.
    #[arg(long, default_value_t = 1000, value_name = "N")]
    inputs: u64,
    /// Seed of the first copy; the others follow.
    #[arg(long, default_value_t = 0, value_name = "SEED")]
    first: u64,
    /// Folder for an input that fails.
    #[arg(long, default_value = ".", value_name = "DIR")]
    failures: PathBuf,
    /// Write the valid files into a folder for each reader, as cargo-fuzz takes them.
    #[arg(long, value_name = "DIR")]
    export: Option<PathBuf>,
    /// Readers. Default: all.
    targets: Vec<String>,
}

impl Damage {
    /// # Errors
    /// An unknown reader; the first failing input. A panic ends the program.
    pub(super) fn execute(self) -> Result<()> {
        let known = || targets::TARGETS.iter().map(|t| t.name).collect::<Vec<_>>();
        let unknown = |name: &str| Error::input("command line", "targets", name, known().join(", "));
        let chosen: Vec<_> = match self.targets.is_empty() {
            true => targets::TARGETS.iter().collect(),
            false => {
                let find = |name: &String| targets::find(name).ok_or_else(|| unknown(name));
                self.targets.iter().map(find).collect::<Result<_>>()?
            }
        };
        println!("{:>16} {:>10} {:>10} {:>10} {:>10}", "reader", "read", "refused", "slowest/s", "most/MB");
        for target in chosen {
            if let Some(folder) = &self.export {
                export(target, &folder.join(target.name))?;
            }
            let o = driver::run(target, self.first, self.inputs, LIMIT, &self.failures)?;
            let (seconds, mb) = (o.slowest.as_secs_f64(), o.most_bytes as f64 / 1e6);
            println!("{:>16} {:>10} {:>10} {seconds:>10.3} {mb:>10.1}", target.name, o.read, o.refused);
        }
        Ok(())
    }
}

fn export(target: &targets::Target, folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(Error::io("create", folder))?;
    for (i, (_, bytes)) in target.corpus()?.iter().enumerate() {
        let file = folder.join(format!("valid-{i}"));
        std::fs::write(&file, bytes).map_err(Error::io("write", &file))?;
    }
    Ok(())
}

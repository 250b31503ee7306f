//! Completions of the shell and manual pages, from the arguments themselves.

use super::output;
use crate::{Error, Result};
use clap_complete::Shell;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(super) struct CompletionsArgs {
    /// Shell of the completions.
    #[arg(value_enum)]
    shell: Shell,
}

impl CompletionsArgs {
    /// `command`: the whole program's.
    pub(super) fn execute(self, mut command: clap::Command) {
        let mut text = Vec::new();
        clap_complete::generate(self.shell, &mut command, "asperity", &mut text);
        output::print(String::from_utf8_lossy(&text).trim_end());
    }
}

#[derive(Debug, clap::Args)]
pub(super) struct ManArgs {
    /// Folder for the pages, one per command.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

impl ManArgs {
    /// `command`: the whole program's.
    pub(super) fn execute(self, command: clap::Command) -> Result<()> {
        std::fs::create_dir_all(&self.out).map_err(Error::io("create", &self.out))?;
        clap_mangen::generate_to(command, &self.out).map_err(Error::io("write", &self.out))?;
        output::print(&self.out.display().to_string());
        Ok(())
    }
}

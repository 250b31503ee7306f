use crate::Result;
use crate::compare::advice::Tables;
use crate::record::atomic_file::write_atomic;
use crate::record::tradeoff::Tradeoff;
use crate::report::series;
use std::io::Write;
use std::path::PathBuf;

const HEAD: &str = "# Cost and error of grid, tolerance, precision and layer thickness\n\nWritten by `make measured`, on the surface of \
                    `configs/measured/waves-32.toml`: root mean square errors over its loads.\n\n";

/// Puts tables of `asperity tradeoff` into one file, as `asperity advise --table` and [accuracy] read it.
#[derive(Debug, clap::Args)]
pub struct MergeTables {
    /// tradeoff.json of one run folder or several, or files that this command wrote.
    #[arg(required = true)]
    tables: Vec<PathBuf>,
    /// Where they go.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Markdown file for the series of `fast` of the first tradeoff.json.
    #[arg(long, value_name = "FILE")]
    series: Option<PathBuf>,
    /// Said in the file: the command that measured them, and on what.
    #[arg(long, value_name = "TEXT", default_value = "asperity tradeoff")]
    provenance: String,
}

impl MergeTables {
    pub fn execute(self) -> Result<()> {
        if let Some(file) = &self.series {
            let tradeoff = Tradeoff::read(&self.tables[0])?;
            write_atomic(file, |w| write!(w, "{HEAD}{}", series::markdown(&tradeoff, "fast")))?;
        }
        let tables = self.tables.iter().map(|f| Tables::read(f)).collect::<Result<Vec<_>>>()?.concat();
        Tables::new(self.provenance, tables).write(&self.out)
    }
}

use crate::Result;
use crate::compare::advice::Tables;
use crate::record::atomic_file::write_atomic;
use crate::record::tradeoff::Tradeoff;
use crate::report::series;
use std::io::Write;
use std::path::PathBuf;

const HEAD: &str = "# Cost and error of grid, tolerance, precision and layer thickness\n\nWritten by `make measured`, on the surface of \
                    `configs/measured/waves-32.toml`: root mean square errors over its loads.\n\n";

/// Merge tables of `asperity tradeoff` into one file for `asperity advise --table` and [accuracy].
#[derive(Debug, clap::Args)]
pub struct MergeTables {
    /// Files tradeoff.json of run folders, or merged files.
    #[arg(required = true)]
    tables: Vec<PathBuf>,
    /// File to write.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Markdown file for the series of `fast` of the first tradeoff.json.
    #[arg(long, value_name = "FILE")]
    series: Option<PathBuf>,
    /// Origin of the tables, stored in the file.
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

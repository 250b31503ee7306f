use asperity::compare::advice::{Table, Tables};
use asperity::contact::quantity::Quantity;
use asperity::record::tradeoff::{Tradeoff, TradeoffPoint};
use asperity::report::number::{duration, error_of, significant};
use asperity::{Error, Result};
use std::fmt::Write;
use std::path::PathBuf;

const HEAD: &str = "# Cost and error of grid, tolerance, precision and layer thickness\n\nWritten by `make measured`, on the surface of \
                    `configs/measured/waves-32.toml`: root mean square errors over its loads.\n\n";

/// Merge tables of `asperity tradeoff` into one file, such as data/measured.json.
#[derive(clap::Args)]
pub(super) struct MergeTables {
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
    pub(super) fn execute(self) -> Result<()> {
        if let Some(file) = &self.series {
            let text = format!("{HEAD}{}", markdown(&Tradeoff::read(&self.tables[0])?, "fast"));
            std::fs::write(file, text).map_err(Error::io("write", file))?;
        }
        let tables = self.tables.iter().map(|f| Tables::read(f)).collect::<Result<Vec<_>>>()?.concat();
        let text = text(&self.provenance, &tables).map_err(|e| Error::format(&self.out, e, "tables"))?;
        std::fs::write(&self.out, text).map_err(Error::io("write", &self.out))
    }
}

/// A file of tables with one setting per line.
fn text(provenance: &str, tables: &[Table]) -> std::result::Result<String, serde_json::Error> {
    let mut written = Vec::new();
    for table in tables {
        let head = serde_json::to_string(&Table { lines: Vec::new(), ..table.clone() })?;
        let lines = table.lines.iter().map(|l| Ok(format!("  {}", serde_json::to_string(l)?)));
        let lines = lines.collect::<std::result::Result<Vec<_>, serde_json::Error>>()?;
        written.push(format!("{}\n{}\n]}}", head.strip_suffix("]}").unwrap_or(&head), lines.join(",\n")));
    }
    let provenance = serde_json::to_string(provenance)?;
    let (schema, tables) = (Tables::SCHEMA, written.join(",\n"));
    Ok(format!("{{\"schema\": {schema}, \"provenance\": {provenance}, \"tables\": [\n{tables}\n]}}\n"))
}

/// Error columns.
const COLUMNS: [Quantity; 7] = [
    Quantity::ContactArea,
    Quantity::MeanGap,
    Quantity::Stiffness,
    Quantity::GapMap,
    Quantity::ContactMap,
    Quantity::GapPdf,
    Quantity::StressPdf,
];

/// Tables of a method's points, one per series in which a single parameter differs from the setting of the reference.
fn markdown(tradeoff: &Tradeoff, method: &str) -> String {
    let known: Vec<&TradeoffPoint> =
        tradeoff.points.iter().filter(|p| p.setting.method == method && p.unavailable_reason.is_none()).collect();
    let grids: Vec<&TradeoffPoint> = tradeoff.grids(method);
    let Some(base) = grids.first().map(|p| &p.setting) else { return String::new() };
    let of = |p: &&&TradeoffPoint, n: usize| p.setting.nx == n && p.setting.layer_thickness.is_none();
    // Series over tolerance and precision use the grid with the most settings.
    let settings = |n: usize| known.iter().filter(|p| of(p, n)).count();
    let n = grids.iter().map(|p| p.setting.nx).max_by_key(|n| settings(*n)).unwrap_or(base.nx);
    let mut tolerances: Vec<&TradeoffPoint> =
        known.iter().filter(|p| of(p, n) && p.setting.precision == base.precision).copied().collect();
    tolerances.sort_by(|a, b| b.setting.tolerance.total_cmp(&a.setting.tolerance));
    let precisions: Vec<&TradeoffPoint> =
        known.iter().filter(|p| of(p, n) && p.setting.precision != base.precision).copied().collect();
    let mut layers: Vec<&TradeoffPoint> =
        known.iter().filter(|p| p.setting.layer_thickness.is_some()).copied().collect();
    layers.sort_by(|a, b| {
        a.setting.layer_thickness.partial_cmp(&b.setting.layer_thickness).unwrap_or(std::cmp::Ordering::Equal)
    });
    let mut coarse_first = grids.clone();
    coarse_first.sort_by_key(|p| p.setting.nx);
    let wave = |p: &TradeoffPoint| significant(p.setting.nx as f64 * tradeoff.shortest_wavelength, 3);
    let mut text = String::new();
    let head = ["points per side", "per shortest wave"].map(str::to_string);
    section(&mut text, "Grid", &head, &coarse_first, &|p| vec![p.setting.nx.to_string(), wave(p)]);
    let tolerance = |p: &TradeoffPoint| vec![format!("{:e}", p.setting.tolerance)];
    section(&mut text, "Tolerance", &[format!("tolerance on {n} points per side")], &tolerances, &tolerance);
    let precision = |p: &TradeoffPoint| vec![format!("{} to {:e}", p.setting.precision, p.setting.tolerance)];
    section(&mut text, "Precision", &[format!("precision on {n} points per side")], &precisions, &precision);
    let thickness = |p: &TradeoffPoint| vec![p.setting.layer_thickness.map_or(String::new(), |t| significant(t, 3))];
    section(&mut text, "Finite layer thickness", &["thickness / L".to_string()], &layers, &thickness);
    text
}

fn section(
    text: &mut String,
    title: &str,
    head: &[String],
    points: &[&TradeoffPoint],
    of: &dyn Fn(&TradeoffPoint) -> Vec<String>,
) {
    if points.is_empty() {
        return;
    }
    let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
    let names = COLUMNS.map(|m| m.name().to_string());
    let _ = write!(text, "### {title}\n\n");
    text.push_str(&line(head.iter().cloned().chain(["CPU".into()]).chain(names).collect()));
    text.push_str(&line(vec!["---".into(); head.len() + 1 + COLUMNS.len()]));
    for p in points {
        let error = |m: Quantity| p.errors.get(&m).map_or("–".into(), |e| error_of(m, *e));
        text.push_str(&line(
            of(p).into_iter().chain([duration(p.cost.cpu_seconds)]).chain(COLUMNS.map(error)).collect(),
        ));
    }
    text.push('\n');
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_tables_are_read_as_they_were_written() {
        let folder = tempfile::tempdir().expect("scratch");
        let files = ["one.json", "two.json", "merged.json"].map(|name| folder.path().join(name));
        let shipped = Tables::shipped().tables;
        let (first, rest) = shipped.split_at(1);
        for (file, tables) in files.iter().zip([first, rest]) {
            std::fs::write(file, text("by \"hand\"", tables).expect("JSON")).expect("written");
        }
        let [one, two, out] = files;
        let merge = MergeTables { tables: vec![one, two], out: out.clone(), series: None, provenance: "both".into() };
        merge.execute().expect("merged");
        assert_eq!(Tables::read(&out).expect("read"), shipped);
    }

    /// The shipped file is one of [`text`].
    #[test]
    fn the_shipped_tables_are_written_likewise() {
        let shipped = Tables::shipped();
        let written = text(&shipped.provenance, &shipped.tables).expect("JSON");
        assert_eq!(written, include_str!("../../../data/measured.json"));
    }
}

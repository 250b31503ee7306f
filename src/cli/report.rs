//! `asperity report`: the page of a run folder, and figures for papers.

use super::output;
use crate::report::{PrintedFigures, ReportOptions};
use crate::{Error, Result};
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(super) struct ReportArgs {
    /// Folder of a run, a challenge, a trade-off or a sweep.
    folder: PathBuf,
    /// Also write every figure for papers to figures/WIDTHmm/, with its data as CSV and a script of matplotlib.
    #[arg(long, value_enum, value_delimiter = ',', value_name = "FORMATS")]
    figures: Vec<PictureFormat>,
    /// Width of these figures: 84mm is a column, 174mm a page of most journals.
    #[arg(long, default_value = "84mm", requires = "figures")]
    width: String,
    /// Give every map its own colour range, in place of one range over all loads.
    #[arg(long)]
    own_ranges: bool,
    /// One line of JSON on stdout.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, clap::ValueEnum)]
enum PictureFormat {
    Svg,
    Pdf,
}

/// A width such as "84mm" or "8.4cm", mm.
fn millimetres(text: &str) -> Result<f64> {
    let range = PrintedFigures::WIDTHS;
    let (number, factor) = match (text.strip_suffix("mm"), text.strip_suffix("cm")) {
        (Some(number), _) => (number, 1.0),
        (_, Some(number)) => (number, 10.0),
        _ => ("", 1.0),
    };
    let width = number.trim().parse::<f64>().ok().map(|v| v * factor).filter(|v| range.contains(v));
    let accepted = || format!("{} mm to {} mm, as 84mm or 17.4cm", range.start(), range.end());
    width.ok_or_else(|| Error::input("command line", "--width", format!("{text:?}"), accepted()))
}

impl ReportArgs {
    pub(super) fn execute(&self) -> Result<()> {
        let width_mm = millimetres(&self.width)?;
        let has = |format| self.figures.contains(&format);
        let printed = PrintedFigures { width_mm, svg: has(PictureFormat::Svg), pdf: has(PictureFormat::Pdf) };
        let printed = (!self.figures.is_empty()).then_some(printed);
        let figures = printed.as_ref().map(|p| p.folder(&self.folder));
        let options = ReportOptions { own_ranges: self.own_ranges, printed };
        let page = crate::pipeline::redraw(&self.folder, &options)?;
        if self.json {
            let figures = figures.as_deref().map(output::path);
            return output::json_line(&serde_json::json!({ "report": output::path(&page), "figures": figures }));
        }
        output::print(&page.display().to_string());
        if let Some(folder) = figures {
            output::print(&folder.display().to_string());
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn widths_are_lengths_of_a_page() {
        assert_eq!(millimetres("84mm").expect("a width"), 84.0);
        assert_eq!(millimetres("17.4 cm").expect("a width"), 174.0);
        for wrong in ["84", "mm", "1mm", "9m", "NaNmm"] {
            let text = millimetres(wrong).expect_err("refused").to_string();
            assert!(text.contains("--width") && text.contains("as 84mm"), "{text}");
        }
    }
}

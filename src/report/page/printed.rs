//! Figures for papers: SVG and PDF at a column width with one type size, their source data as CSV, and a script of
//! matplotlib that draws them again.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::{Arc, LazyLock};

use serde_json::{Map, Value, json};
use svg2pdf::usvg;

use crate::report::map::{HEIGHT, MapFigure};
use crate::report::number::si_scale;
use crate::report::picture::{BLACK, BLUE, ORANGE, WHITE};
use crate::report::plot::{Dash, Fill, Plot, Style};
use crate::report::relief::ReliefFigure;
use crate::report::scale::ends;
use crate::report::svg::{DrawingSize, css};
use asperity_grid::error::{Error, Result};
use asperity_surface::files::atomic_file::{create_folder, write_atomic};

/// Options of a report.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReportOptions {
    /// Every map has its own colour range; otherwise maps of one quantity have one range over all loads.
    pub own_ranges: bool,
    pub printed: Option<PrintedFigures>,
}

/// Figures for papers, written to `figures/WIDTHmm/`.
#[derive(Debug, Clone, PartialEq)]
pub struct PrintedFigures {
    /// Width of a figure, mm.
    pub width_mm: f64,
    pub svg: bool,
    pub pdf: bool,
}

impl PrintedFigures {
    /// Accepted widths, mm.
    pub const WIDTHS: std::ops::RangeInclusive<f64> = 40.0..=400.0;

    /// The folder of the figures in a run folder.
    pub fn folder(&self, run: &Path) -> PathBuf {
        run.join("figures").join(format!("{}mm", self.width_mm))
    }
}

/// Fonts of the machine. Text without any font would be missing from a PDF.
static FONTS: LazyLock<Arc<usvg::fontdb::Database>> = LazyLock::new(|| {
    let mut fonts = usvg::fontdb::Database::new();
    fonts.load_system_fonts();
    for family in ["Helvetica Neue", "Arial", "Liberation Sans", "DejaVu Sans"] {
        let query = usvg::fontdb::Query { families: &[usvg::fontdb::Family::Name(family)], ..Default::default() };
        if fonts.query(&query).is_some() {
            fonts.set_sans_serif_family(family);
            break;
        }
    }
    Arc::new(fonts)
});

/// Style of matplotlib for the scripts, and the scripts without the settings of a figure.
const STYLE: &str = include_str!("redraw/asperity.mplstyle");
const STYLE_FILE: &str = "asperity.mplstyle";
const HEAD: &str = include_str!("redraw/head.py");
/// Resolution of views of the surface in print.
const PRINTED_DPI: f64 = 300.0;

/// A drawing of the page, which can also be printed.
pub(super) trait Drawing {
    /// The bitmap in the drawing of a width in pixels; `None` without.
    fn png(&self, width: usize) -> Option<std::io::Result<Vec<u8>>>;
    /// `None` if there is nothing to show.
    fn svg(&self, png: &[u8], format: DrawingSize) -> Option<String>;
    /// Tables: end of the file name, contents.
    fn data(&self) -> Vec<(&'static str, String)>;
    /// Settings of the script, and its commands. `width`: inches.
    fn script(&self, width: f64) -> (Value, &'static str);
}

/// SVG and PDF of a drawing, its data and its script.
pub(super) fn store(run: &Path, printed: &PrintedFigures, name: &str, drawing: &dyn Drawing) -> Result<()> {
    let folder = &printed.folder(run);
    let store = |end: &str, bytes: &[u8]| write_atomic(&folder.join(format!("{name}{end}")), |w| w.write_all(bytes));
    let inches = printed.width_mm / 25.4;
    let png =
        drawing.png((inches * PRINTED_DPI) as usize).transpose().map_err(Error::io("write", folder.join(name)))?;
    let Some(svg) = drawing.svg(&png.unwrap_or_default(), DrawingSize::printed(printed.width_mm)) else {
        return Ok(());
    };
    create_folder(folder)?;
    if printed.svg {
        store(".svg", svg.as_bytes())?;
    }
    if printed.pdf {
        store(".pdf", &pdf(&svg, &folder.join(format!("{name}.pdf")))?)?;
    }
    for (end, table) in drawing.data() {
        store(end, table.as_bytes())?;
    }
    let (settings, commands) = drawing.script(inches);
    // A string of JSON is one of Python.
    let settings = Value::from(settings.to_string());
    store(".py", format!("{HEAD}settings = json.loads({settings})\n{commands}").as_bytes())?;
    write_atomic(&folder.join(STYLE_FILE), |w| w.write_all(STYLE.as_bytes()))
}

/// # Errors
/// `Input` if the machine has no font.
fn pdf(svg: &str, path: &Path) -> Result<Vec<u8>> {
    if FONTS.is_empty() {
        return Err(Error::input(
            path.display(),
            "--figures pdf",
            "a machine without fonts",
            "an installed sans-serif font",
        ));
    }
    let options = usvg::Options { fontdb: Arc::clone(&FONTS), font_family: "sans-serif".into(), ..Default::default() };
    let failed = |reason: String| Error::format(path, reason, "a drawing that becomes a PDF");
    let tree = usvg::Tree::from_str(svg, &options).map_err(|e| failed(e.to_string()))?;
    svg2pdf::to_pdf(&tree, svg2pdf::ConversionOptions::default(), svg2pdf::PageOptions { dpi: 72.0 })
        .map_err(|e| failed(e.to_string()))
}

/// A field of a CSV file, quoted where necessary.
fn field(text: &str) -> String {
    if text.contains([',', '"']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.into() }
}

/// Name of a curve in the data; a curve without label has its number.
fn label(label: &str, index: usize) -> String {
    if label.is_empty() { format!("_{}", index + 1) } else { label.into() }
}

/// Rows of a CSV file.
fn rows(nx: usize, cells: impl Iterator<Item = String>) -> String {
    cells.collect::<Vec<_>>().chunks(nx).map(|row| row.join(",") + "\n").collect()
}

fn look(style: Style) -> Value {
    let (marker, fill) = style.marker.look().map_or(("", Fill::Full), |(_, fill, name)| (name, fill));
    let line = match style.dash {
        Dash::Solid => "-",
        Dash::Dashed => "--",
        Dash::Dotted => ":",
        Dash::None => "",
    };
    let colour = css(style.colour);
    let face = if fill == Fill::White { "white" } else { &colour };
    json!({ "color": colour, "linestyle": line, "marker": marker, "markerfacecolor": face })
}

impl Drawing for Plot {
    fn png(&self, _: usize) -> Option<std::io::Result<Vec<u8>>> {
        None
    }

    fn svg(&self, _: &[u8], format: DrawingSize) -> Option<String> {
        self.drawn(format)
    }

    fn data(&self) -> Vec<(&'static str, String)> {
        let mut text = format!("curve,{},{},standard error\n", field(&self.x.label), field(&self.y.label));
        for (i, curve) in self.curves.iter().enumerate() {
            let label = field(&label(&curve.label, i));
            for (k, (x, y)) in curve.points.iter().enumerate() {
                let error = curve.errors.get(k).filter(|e| e.is_finite()).map_or(String::new(), f64::to_string);
                let _ = writeln!(text, "{label},{x},{y},{error}");
            }
        }
        vec![(".csv", text)]
    }

    fn script(&self, width: f64) -> (Value, &'static str) {
        let looks: Map<String, Value> =
            self.curves.iter().enumerate().map(|(i, c)| (label(&c.label, i), look(c.style))).collect();
        let (x, y) = (&self.x, &self.y);
        let axes = json!({ "xlabel": x.label, "ylabel": y.label, "xscale": x.kind(), "yscale": y.kind() });
        let size = [width, self.proportion.max(0.6) * width];
        (json!({ "size": size, "axes": axes, "looks": looks }), include_str!("redraw/plot.py"))
    }
}

impl Drawing for MapFigure<'_> {
    fn png(&self, _: usize) -> Option<std::io::Result<Vec<u8>>> {
        Some(self.picture.png())
    }

    fn svg(&self, png: &[u8], format: DrawingSize) -> Option<String> {
        Some(self.svg(png, format))
    }

    fn data(&self) -> Vec<(&'static str, String)> {
        let factor = self.bar.as_ref().map_or(1.0, |bar| bar.factor);
        let cells = self.picture.values.iter().map(|v| ((v / factor) as f32).to_string());
        vec![(".csv", rows(self.picture.nx, cells))]
    }

    fn script(&self, width: f64) -> (Value, &'static str) {
        let (scale, prefix) = si_scale(self.cell_m[0]);
        let [right, top] = self.cell_m.map(|l| l / scale);
        // Of the codes of a contact map.
        let colours = [WHITE, self.picture.contact.unwrap_or(ORANGE), BLUE, BLACK].map(css);
        let bar = self.bar.as_ref().map(|bar| {
            let extend = if bar.clipped { "max" } else { "neither" };
            json!({ "low": bar.range.low, "high": bar.range.high, "label": bar.label(), "extend": extend })
        });
        let axes = json!({ "xlabel": format!("x ({prefix}m)"), "ylabel": format!("y ({prefix}m)") });
        let settings = json!({
            "size": [width, width], "axes": axes, "extent": [0.0, right, 0.0, top], "bar": bar, "colours": colours
        });
        (settings, include_str!("redraw/map.py"))
    }
}

impl Drawing for ReliefFigure<'_> {
    fn png(&self, width: usize) -> Option<std::io::Result<Vec<u8>>> {
        Some(self.relief.png(width))
    }

    fn svg(&self, png: &[u8], format: DrawingSize) -> Option<String> {
        Some(self.svg(png, format))
    }

    /// Heights, and the colours of the cells.
    fn data(&self) -> Vec<(&'static str, String)> {
        let (height, _) = si_scale(ends(self.heights_m.iter().copied()).1);
        let heights = self.heights_m.iter().map(|h| ((h / height) as f32).to_string());
        let colours = self.relief.colours.iter().map(|c| css(*c));
        vec![(".csv", rows(self.relief.nx, heights)), ("-colours.csv", rows(self.relief.nx, colours))]
    }

    fn script(&self, width: f64) -> (Value, &'static str) {
        let ((_, height), (length, prefix)) =
            (si_scale(ends(self.heights_m.iter().copied()).1), si_scale(self.length_m));
        let (across, aspect) = (self.length_m / length, self.relief.aspect);
        let [x, y, z] = [("x", prefix), ("y", prefix), (HEIGHT, height)].map(|(axis, p)| format!("{axis} ({p}m)"));
        let axes = json!({ "xlabel": x, "ylabel": y, "zlabel": z, "box_aspect": [1.0, aspect, 0.2] });
        let settings = json!({ "size": [width, width], "axes": axes, "extent": [across, across * aspect] });
        (settings, include_str!("redraw/relief.py"))
    }
}

//! Figures for papers: SVG and PDF at a column width with one type size, their source data as CSV, and a script of
//! matplotlib that draws them again.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::{Arc, LazyLock};

use svg2pdf::usvg;

use crate::error::{Error, Result};
use crate::record::atomic_file::write_atomic;
use crate::report::map::{Bar, Framed, Legend};
use crate::report::picture::{self, BLUE, ORANGE, Picture, Rgb};
use crate::report::plot::{Axis, Dash, Marker, Plot, Style};
use crate::report::relief::ReliefFigure;
use crate::report::svg::{Format, css};

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

/// Style of matplotlib for the scripts.
const STYLE: &str = "\
# Figures of asperity: one type size, ticks outside, no frame above and right.
font.family: sans-serif
font.size: 8
axes.labelsize: 8
axes.titlesize: 8
legend.fontsize: 8
xtick.labelsize: 8
ytick.labelsize: 8
lines.linewidth: 1
lines.markersize: 4
axes.spines.top: False
axes.spines.right: False
axes.grid: True
grid.color: 0.86
grid.linewidth: 0.5
legend.frameon: False
image.cmap: cividis
image.origin: lower
image.interpolation: nearest
savefig.dpi: 300
pdf.fonttype: 42
";
/// Resolution of views of the surface in print.
const PRINTED_DPI: f64 = 300.0;
const STYLE_FILE: &str = "asperity.mplstyle";

fn store(path: &Path, bytes: &[u8]) -> Result<()> {
    write_atomic(path, |w| w.write_all(bytes))
}

/// SVG and PDF of a drawing, its data and its script.
fn files(folder: &Path, printed: &PrintedFigures, name: &str, svg: &str, data: &str, script: &str) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(Error::io("create", folder))?;
    let path = |end: &str| folder.join(format!("{name}.{end}"));
    if printed.svg {
        store(&path("svg"), svg.as_bytes())?;
    }
    if printed.pdf {
        store(&path("pdf"), &pdf(svg, &path("pdf"))?)?;
    }
    store(&path("csv"), data.as_bytes())?;
    store(&path("py"), script.as_bytes())?;
    store(&folder.join(STYLE_FILE), STYLE.as_bytes())
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
    let failed = |why: String| Error::format(path, why, "a drawing that becomes a PDF");
    let tree = usvg::Tree::from_str(svg, &options).map_err(|e| failed(e.to_string()))?;
    svg2pdf::to_pdf(&tree, svg2pdf::ConversionOptions::default(), svg2pdf::PageOptions { dpi: 72.0 })
        .map_err(|e| failed(e.to_string()))
}

/// Files of a plot.
pub(super) fn plot(run: &Path, printed: &PrintedFigures, name: &str, plot: &Plot) -> Result<()> {
    let Some(svg) = plot.drawn(Format::printed(printed.width_mm)) else { return Ok(()) };
    let script = plot_script(printed, name, plot);
    files(&printed.folder(run), printed, name, &svg, &plot_data(plot), &script)
}

/// A field of a CSV file, quoted where necessary.
fn field(text: &str) -> String {
    if text.contains([',', '"']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.into() }
}

fn plot_data(plot: &Plot) -> String {
    let mut text = format!("curve,{},{},standard error\n", field(&plot.x_label), field(&plot.y_label));
    for (i, curve) in plot.curves.iter().enumerate() {
        let label = field(&label(curve.label.as_str(), i));
        for (k, (x, y)) in curve.points.iter().enumerate() {
            let error = plot.errors.get(i).and_then(|e| e.get(k)).map_or(String::new(), f64::to_string);
            let _ = writeln!(text, "{label},{x},{y},{error}");
        }
    }
    text
}

/// Name of a curve in the data; a curve without label has its number.
fn label(label: &str, index: usize) -> String {
    if label.is_empty() { format!("_{}", index + 1) } else { label.into() }
}

/// A string of Python.
fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

fn look(style: Style) -> String {
    let (marker, filled) = match style.marker {
        Marker::None => ("", true),
        Marker::Disc => ("o", true),
        Marker::Ring | Marker::Target => ("o", false),
        Marker::Square => ("s", true),
        Marker::Frame => ("s", false),
        Marker::Triangle => ("^", true),
        Marker::OpenTriangle => ("^", false),
        Marker::Down => ("v", true),
        Marker::OpenDown => ("v", false),
        Marker::Diamond => ("D", true),
        Marker::OpenDiamond => ("D", false),
        Marker::Cross => ("x", true),
        Marker::Plus => ("+", true),
        Marker::Star => ("*", true),
    };
    let line = match style.dash {
        Dash::Solid => "-",
        Dash::Dashed => "--",
        Dash::Dotted => ":",
        Dash::None => "",
    };
    let face = if filled { "" } else { ", markerfacecolor=\"white\"" };
    format!("dict(color=\"{}\", linestyle=\"{line}\", marker=\"{marker}\"{face})", css(style.colour))
}

/// First lines of a script.
fn preamble(name: &str, printed: &PrintedFigures) -> String {
    format!(
        "\"\"\"Draws {name}.csv with matplotlib, into {name}-redrawn.pdf.\"\"\"\n\
         import csv\n\
         from pathlib import Path\n\n\
         import matplotlib\n\n\
         matplotlib.use(\"Agg\")\n\
         import matplotlib.pyplot as plt\n\n\
         here = Path(__file__).resolve().parent\n\
         plt.style.use(here / \"{STYLE_FILE}\")\n\
         width = {} / 25.4\n",
        printed.width_mm
    )
}

fn plot_script(printed: &PrintedFigures, name: &str, plot: &Plot) -> String {
    let mut text = preamble(name, printed);
    text += "looks = {\n";
    for (i, curve) in plot.curves.iter().enumerate() {
        let _ = writeln!(text, "    {}: {},", quoted(&label(&curve.label, i)), look(curve.style));
    }
    let scale = |axis: Axis| if axis == Axis::Log { "log" } else { "linear" };
    let _ = write!(
        text,
        "}}\n\
         curves = {{}}\n\
         with open(here / \"{name}.csv\", newline=\"\", encoding=\"utf-8\") as file:\n    \
             for label, x, y, error in list(csv.reader(file))[1:]:\n        \
                 curves.setdefault(label, []).append((float(x), float(y), float(error or 0)))\n\
         figure, axes = plt.subplots(figsize=(width, {:.2} * width), layout=\"constrained\")\n\
         for label, points in curves.items():\n    \
             x, y, error = zip(*points)\n    \
             axes.errorbar(x, y, error if any(error) else None, label=label, capsize=2, **looks[label])\n\
         axes.set(xlabel={}, ylabel={}, xscale=\"{}\", yscale=\"{}\")\n\
         if any(not label.startswith(\"_\") for label in curves):\n    \
             axes.legend()\n\
         figure.savefig(here / \"{name}-redrawn.pdf\")\n",
        plot.proportion.max(0.6),
        quoted(&plot.x_label),
        quoted(&plot.y_label),
        scale(plot.x),
        scale(plot.y),
    );
    text
}

/// Files of a map; `cell_m`: extents of the cell.
pub(super) fn map(
    run: &Path,
    printed: &PrintedFigures,
    (name, alt): (&str, &str),
    picture: &Picture,
    (cell_m, legend): ([f64; 2], &Legend),
) -> Result<()> {
    let folder = printed.folder(run);
    let png = picture.png().map_err(Error::io("write", folder.join(name)))?;
    let format = Format::printed(printed.width_mm);
    let svg = Framed { name, alt, png: &png, cell_m, legend: legend.clone(), format }.svg();
    let factor = match legend {
        Legend::Ramp(bar) | Legend::OverContact(bar) => bar.factor,
        Legend::None => 1.0,
    };
    let mut data = String::new();
    for row in picture.values.chunks(picture.nx) {
        let cells: Vec<String> = row.iter().map(|v| format!("{}", (v / factor) as f32)).collect();
        data += &cells.join(",");
        data.push('\n');
    }
    files(&folder, printed, name, &svg, &data, &map_script(printed, name, cell_m, (picture, legend)))
}

/// Files of a view of the surface: heights in the CSV file, colours of the cells in a second one.
pub(super) fn relief(
    run: &Path,
    printed: &PrintedFigures,
    (name, alt): (&str, &str),
    drawn: &ReliefFigure,
) -> Result<()> {
    let folder = printed.folder(run);
    let pixels = (printed.width_mm / 25.4 * PRINTED_DPI) as usize;
    let png = drawn.relief.png(pixels).map_err(Error::io("write", folder.join(name)))?;
    let svg = drawn.svg(alt, &png, Format::printed(printed.width_mm));
    let highest = drawn.heights_m.iter().copied().fold(0.0, f64::max);
    let ((height, prefix), (length, length_prefix)) =
        (crate::report::number::si_scale(highest), crate::report::number::si_scale(drawn.length_m));
    let rows = |cells: Vec<String>| cells.chunks(drawn.relief.nx).map(|row| row.join(",") + "\n").collect::<String>();
    let heights = rows(drawn.heights_m.iter().map(|h| format!("{}", (h / height) as f32)).collect());
    let colours = rows(drawn.relief.colours.iter().map(|c| css(*c)).collect());
    let across = drawn.length_m / length;
    let script = preamble(name, printed)
        + &format!(
            "import numpy as np\n\n\
             # Rows of the files from the lowest; heights upwards, of the surface upside down.\n\
             heights = np.loadtxt(here / \"{name}.csv\", delimiter=\",\", ndmin=2)\n\
             colours = np.loadtxt(here / \"{name}-colours.csv\", delimiter=\",\", ndmin=2, dtype=str, comments=None)\n\
             ny, nx = heights.shape\n\
             x, y = np.meshgrid(np.arange(nx) * {across} / nx, np.arange(ny) * {} / ny)\n\
             figure, axes = plt.subplots(figsize=(width, width), subplot_kw={{\"projection\": \"3d\"}})\n\
             axes.plot_surface(x, y, heights, facecolors=matplotlib.colors.to_rgba_array(colours.ravel()).reshape(ny, nx, 4), \
             rcount=128, ccount=128)\n\
             axes.set(xlabel=\"x ({length_prefix}m)\", ylabel=\"y ({length_prefix}m)\", zlabel=\"height ({prefix}m)\", box_aspect=(1, {}, 0.2))\n\
             figure.savefig(here / \"{name}-redrawn.pdf\")\n",
            across * drawn.relief.aspect,
            drawn.relief.aspect
        );
    files(&folder, printed, name, &svg, &heights, &script)?;
    store(&folder.join(format!("{name}-colours.csv")), colours.as_bytes())
}

fn map_script(
    printed: &PrintedFigures,
    name: &str,
    cell_m: [f64; 2],
    (picture, legend): (&Picture, &Legend),
) -> String {
    let (scale, prefix) = crate::report::number::si_scale(cell_m[0]);
    let mut text = preamble(name, printed);
    let _ = write!(
        text,
        "# Rows of the file from the lowest.\n\
         with open(here / \"{name}.csv\", newline=\"\") as file:\n    \
             cells = [[float(v) for v in row] for row in csv.reader(file)]\n\
         figure, axes = plt.subplots(figsize=(width, width), layout=\"constrained\")\n\
         axes.grid(False)\n\
         extent = (0, {:.6}, 0, {:.6})\n",
        cell_m[0] / scale,
        cell_m[1] / scale
    );
    let bar = |text: &mut String, bar: &Bar, colours: &str| {
        let _ = write!(
            text,
            "{colours}\
             image = axes.imshow(cells, extent=extent, cmap=colours, vmin={}, vmax={})\n\
             figure.colorbar(image, label={}, extend=\"{}\")\n",
            bar.range.low,
            bar.range.high,
            quoted(&bar.label()),
            if bar.clipped { "max" } else { "neither" }
        );
    };
    match legend {
        Legend::Ramp(b) => bar(&mut text, b, "colours = \"cividis\"\n"),
        Legend::OverContact(b) => bar(
            &mut text,
            b,
            "# Contact (nan in the file) is black.\ncolours = matplotlib.colormaps[\"cividis\"].with_extremes(bad=\"black\")\n",
        ),
        Legend::None => {
            let codes = contact_colours(picture).map(css).map(|c| format!("\"{c}\"")).join(", ");
            let _ = write!(
                text,
                "# 0 no contact, 1 contact (of the continuum), 2 of the atoms only, 3 of both.\n\
                 colours = matplotlib.colors.ListedColormap([{codes}])\n\
                 axes.imshow(cells, extent=extent, cmap=colours, vmin=-0.5, vmax=3.5)\n"
            );
        }
    }
    let _ = write!(
        text,
        "axes.set(xlabel=\"x ({prefix}m)\", ylabel=\"y ({prefix}m)\")\nfigure.savefig(here / \"{name}-redrawn.pdf\")\n"
    );
    text
}

/// Colours of the codes of a contact map.
fn contact_colours(picture: &Picture) -> [Rgb; 4] {
    [picture::WHITE, picture.contact.unwrap_or(ORANGE), BLUE, picture::BLACK]
}

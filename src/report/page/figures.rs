//! Figures, tables and panels: drawings are written to `figures/` and returned as markup.

use std::io::Write;
use std::path::{Path, PathBuf};

use maud::{Markup, PreEscaped, Render, html};

use super::printed::{self, Drawing, ReportOptions};
use crate::record::downsample::DownsampledMap;
use crate::record::given_loads::GivenLoads;
use crate::record::results::{FILE, ScalesSi};
use crate::report::map::{self, Bar, HEIGHT, MapFigure};
use crate::report::picture::{self, ColourRange, Picture, flag};
use crate::report::plot::{PANEL, Plot};
use crate::report::svg::DrawingSize;
use asperity_contact::load::Branch;
use asperity_contact::state::State;
use asperity_grid::error::{Error, Result};
use asperity_surface::files::atomic_file::write_atomic;
use asperity_surface::files::inside::inside;

/// Run folder and common data of its pictures.
pub(super) struct FigureWriter<'a> {
    pub folder: &'a Path,
    /// Extent in y over extent in x; pictures have the shape of the cell even if pixels are not square.
    pub aspect: f64,
    pub scales: ScalesSi,
    pub loads: GivenLoads,
    pub options: &'a ReportOptions,
}

/// A plot with its caption. `id`: the name of its file.
pub(super) struct Figure {
    pub id: String,
    pub plot: Plot,
    pub caption: Markup,
}

impl Figure {
    pub(super) fn new(id: impl Into<String>, caption: impl Render, plot: Plot) -> Self {
        Figure { id: id.into(), plot, caption: caption.render() }
    }
}

/// A field of values shown in colours.
pub(super) struct Values<'a> {
    pub quantity: &'static str,
    /// Of the values; `m` and `Pa` get a prefix.
    pub unit: &'static str,
    pub small: &'a DownsampledMap,
    pub range: ColourRange,
    /// Drawn in black.
    pub contact: Option<&'a DownsampledMap>,
}

impl Values<'_> {
    fn picture(&self) -> Result<(Picture, Bar)> {
        let picture = match self.contact {
            Some(contact) => picture::gap(self.small, self.range, contact)?,
            None => picture::map(self.small, self.range),
        };
        let clipped = self.small.values.iter().any(|v| *v > self.range.high);
        let bar = Bar::new(self.quantity, self.range, self.unit);
        Ok((picture, Bar { clipped, over_contact: self.contact.is_some(), ..bar }))
    }
}

impl FigureWriter<'_> {
    /// Path of a file named in `results.json`. It must be relative and inside the run folder, so that the folder can
    /// be moved.
    pub(super) fn field(&self, name: &str) -> Result<PathBuf> {
        inside(self.folder, FILE, name)
    }

    /// A stored field with at most `side` cells along a side; `of` is applied to each node first.
    pub(super) fn load(&self, file: &str, side: usize, of: impl Fn(f64) -> f64) -> Result<DownsampledMap> {
        picture::load(&self.field(file)?, side, of)
    }

    /// Contact from a stored map of contact.
    pub(super) fn flags(&self, file: &str, side: usize) -> Result<DownsampledMap> {
        self.load(file, side, |v| flag(v != 0.0))
    }

    /// Contact from a stored map of gaps.
    pub(super) fn closed(&self, file: &str, side: usize) -> Result<DownsampledMap> {
        self.load(file, side, |gap| flag(gap <= 0.0))
    }

    /// Whether every map has its own colour range.
    pub(super) fn own_ranges(&self) -> bool {
        self.options.own_ranges
    }

    pub(super) fn range_note(&self) -> &'static str {
        if self.own_ranges() { "Every map has its own colour range." } else { "One colour range over all loads." }
    }

    /// Writes `figures/NAME.svg`, and `figures/NAME.png` where the drawing has a bitmap; returns the former, `None` if there is
    /// nothing to show.
    pub(super) fn draw(&self, name: &str, drawing: &dyn Drawing, width: f64) -> Result<Option<Markup>> {
        let path = |end: &str| self.folder.join("figures").join(format!("{name}.{end}"));
        let png = drawing.png(width as usize).transpose().map_err(Error::io("write", path("png")))?;
        let Some(svg) = drawing.svg(png.as_deref().unwrap_or_default(), DrawingSize::page(width)) else {
            return Ok(None);
        };
        if let Some(printed) = &self.options.printed {
            printed::store(self.folder, printed, name, drawing)?;
        }
        if let Some(png) = png {
            write_atomic(&path("png"), |w| w.write_all(&png))?;
        }
        write_atomic(&path("svg"), |w| w.write_all(svg.as_bytes()))?;
        Ok(Some(PreEscaped(svg)))
    }

    fn framed(&self, names: (&str, &str), map: (&Picture, Option<Bar>), length_m: f64, width: f64) -> Result<Markup> {
        let (picture, bar) = map;
        let cell_m = [length_m, self.aspect * length_m];
        let drawn = MapFigure { name: names.0, alt: names.1, picture, cell_m, bar };
        Ok(self.draw(names.0, &drawn, width)?.unwrap_or_default())
    }

    /// A map of contact with axes. `length_m`: width of the cell, m.
    pub(super) fn map(&self, names: (&str, &str), picture: &Picture, length_m: f64) -> Result<Markup> {
        self.framed(names, (picture, None), length_m, map::IN_A_ROW)
    }

    /// A map of values with axes and colour bar.
    pub(super) fn values(&self, names: (&str, &str), values: &Values, length_m: f64) -> Result<Markup> {
        let (picture, bar) = values.picture()?;
        self.framed(names, (&picture, Some(bar)), length_m, map::IN_A_ROW)
    }

    /// A map of the heights at full width.
    pub(super) fn heights(&self, names: (&str, &str), heights: &DownsampledMap) -> Result<Markup> {
        let range = ColourRange::of(&heights.values, 0.0);
        let values = Values { quantity: HEIGHT, unit: "m", small: heights, range, contact: None };
        let (picture, bar) = values.picture()?;
        self.framed(names, (&picture, Some(bar)), self.scales.length_m, map::ALONE)
    }

    /// A plot without caption; `None` if no curve has points.
    pub(super) fn curves(&self, name: &str, plot: &Plot) -> Result<Option<Markup>> {
        Ok(self.draw(name, plot, plot.width)?.map(|svg| html! { div.curves { (svg) } }))
    }

    /// The figures whose curves have points.
    pub(super) fn figures(&self, list: impl IntoIterator<Item = Figure>) -> Result<Markup> {
        let mut all = String::new();
        for Figure { id, plot, caption } in list {
            if let Some(svg) = self.curves(&id, &plot)? {
                all += &figure(svg, caption).into_string();
            }
        }
        Ok(PreEscaped(all))
    }

    /// Small plots in a row, each with a title and a name of its file; empty ones are left out.
    pub(super) fn small<const N: usize>(&self, plots: [(&str, String, Plot); N]) -> Result<Vec<Markup>> {
        let mut drawn = Vec::new();
        for (title, name, plot) in plots {
            let plot = Plot { width: PANEL, proportion: 0.8, ..plot };
            drawn.extend(self.curves(&name, &plot)?.map(|svg| panel(title, svg, "")));
        }
        Ok(drawn)
    }
}

/// A figure with caption, numbered by the style sheet.
pub(super) fn figure(content: impl Render, caption: impl Render) -> Markup {
    html! { figure { (content) figcaption { (caption) } } }
}

/// Pictures side by side, `row` of them in a row.
pub(super) fn panels(row: usize, panels: &[Markup]) -> Markup {
    html! { div.panels style={ "--row:" (row.max(1)) } { (each(panels)) } }
}

/// One of several pictures in a row.
pub(super) fn panel(title: &str, content: impl Render, below: impl Render) -> Markup {
    html! { div.panel { @if !title.is_empty() { div.panel-title { (title) } } (content) div.below { (below) } } }
}

/// One after the other.
pub(super) fn each(list: &[Markup]) -> Markup {
    html! { @for m in list { (m) } }
}

/// A symbol in italics, with the index of `h_rms` as a subscript. Text of several words stays upright.
pub(super) fn symbol(text: &str) -> Markup {
    let is_word = |w: &&str| !w.contains('_') && w.chars().filter(char::is_ascii_alphabetic).count() > 2;
    if text.split(' ').filter(is_word).count() > 1 {
        return html! { span.quiet { "(" (text) ")" } };
    }
    let mut parts = text.split('_');
    let first = parts.next().unwrap_or("");
    html! {
        i { (first) }
        @for part in parts {
            @let end = part.find(|c: char| !c.is_alphanumeric()).unwrap_or(part.len());
            sub { (part[..end]) } i { (part[end..]) }
        }
    }
}

/// A table that scrolls horizontally in a narrow window. `class`: `words`, or `numbers` without line breaks in cells.
pub(super) fn table(class: &str, head: &[&str], rows: impl IntoIterator<Item = Vec<Markup>>) -> Markup {
    html! {
        div.scroll {
            table class=(class) {
                thead { tr { @for h in head { th { (h) } } } }
                tbody { @for row in rows { tr { @for cell in row { td { (cell) } } } } }
            }
        }
    }
}

/// A table as a list of columns: `columns!("numbers", states, |s| { "p*" => trimmed(s.p_star, 4), … })`.
macro_rules! columns {
    ($class:literal, $rows:expr, |$row:pat_param| { $($head:expr => $cell:expr),* $(,)? }) => {
        $crate::report::page::figures::table(
            $class,
            &[$($head),*],
            $rows.into_iter().map(|$row| $crate::report::page::figures::row![$($cell),*]),
        )
    };
}

/// Cells of a row.
macro_rules! row {
    ($($cell:expr),* $(,)?) => { vec![$(maud::Render::render(&$cell)),*] };
}

pub(super) use {columns, row};

/// A value, or a dash if there is none.
pub(super) fn or_dash(value: Option<impl Render>) -> Markup {
    value.map_or_else(|| "–".render(), |v| v.render())
}

/// What is not as it should be.
pub(super) fn bad(words: impl Render) -> Markup {
    html! { span.bad { (words) } }
}

/// What matters less than the rest of its cell.
pub(super) fn quiet(words: impl Render) -> Markup {
    html! { span.quiet { (words) } }
}

/// The text with its first letter capitalised.
pub(super) fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

/// Items in the order of their first occurrence.
pub(super) fn distinct<T: PartialEq>(items: impl IntoIterator<Item = T>) -> Vec<T> {
    items.into_iter().fold(Vec::new(), |mut all, item| {
        if !all.contains(&item) {
            all.push(item);
        }
        all
    })
}

/// Indices of at most `most` of `count` items: both ends, and others at equal intervals.
pub(super) fn spread(count: usize, most: usize) -> Vec<usize> {
    if count <= most { (0..count).collect() } else { (0..most).map(|i| i * (count - 1) / (most - 1)).collect() }
}

/// The unit as it is shown: none of a plain number.
pub(super) fn of_unit(unit: &str) -> &str {
    if unit == "1" { "" } else { unit }
}

/// The load of a state and whether it is on the unloading branch.
pub(super) fn load(s: &State, loads: GivenLoads) -> String {
    loads.value(s.p_star) + back(s)
}

/// Label of a load on the unloading branch.
pub(super) fn back(s: &State) -> &'static str {
    if s.branch == Branch::Unloading { " (unloading)" } else { "" }
}

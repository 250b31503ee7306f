//! Figure writer: figures are written to `figures/` and returned as markup.

use std::path::{Component, Path, PathBuf};

use maud::{Markup, PreEscaped, html};

use super::printed::{self, ReportOptions};
use crate::error::{Error, Result};
use crate::record::atomic_file::write_atomic;
use crate::record::results::{FILE, ScalesSi};
use crate::report::map::{self, Framed, Legend};
use crate::report::picture::Picture;
use crate::report::plot::Plot;
use crate::report::relief::ReliefFigure;
use crate::report::svg::Format;

/// Run folder and common data of its pictures.
pub(super) struct FigureWriter<'a> {
    pub folder: &'a Path,
    /// Extent in y over extent in x; pictures have the shape of the cell even if pixels are not square.
    pub aspect: f64,
    pub scales: ScalesSi,
    pub options: &'a ReportOptions,
}

impl FigureWriter<'_> {
    /// Path of a file named in `results.json`. It must be relative and inside the run folder, so that the folder can
    /// be moved.
    pub(super) fn field(&self, name: &str) -> Result<PathBuf> {
        let inside = Path::new(name).components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
        if name.is_empty() || !inside {
            let accepted = "a path inside the run folder, relative to it";
            return Err(Error::format(self.folder.join(FILE), format!("the field file {name:?}"), accepted));
        }
        Ok(self.folder.join(name))
    }

    /// Writes the bitmap `figures/NAME.png`, and `figures/NAME.svg` with axes and colour bar; returns the latter.
    /// `length_m`: width of the cell, m.
    pub(super) fn map(
        &self,
        (name, alt): (&str, &str),
        picture: &Picture,
        length_m: f64,
        legend: Legend,
    ) -> Result<Markup> {
        self.framed((name, alt), picture, length_m, legend, map::IN_A_ROW)
    }

    /// Whether every map has its own colour range.
    pub(super) fn own_ranges(&self) -> bool {
        self.options.own_ranges
    }

    pub(super) fn range_note(&self) -> &'static str {
        if self.own_ranges() { "Every map has its own colour range." } else { "One colour range over all loads." }
    }

    /// [`Self::map`] at full width.
    pub(super) fn large_map(
        &self,
        names: (&str, &str),
        picture: &Picture,
        length_m: f64,
        legend: Legend,
    ) -> Result<Markup> {
        self.framed(names, picture, length_m, legend, map::ALONE)
    }

    fn framed(
        &self,
        (name, alt): (&str, &str),
        picture: &Picture,
        length_m: f64,
        legend: Legend,
        width: f64,
    ) -> Result<Markup> {
        if let Some(printed) = &self.options.printed {
            printed::map(self.folder, printed, (name, alt), picture, ([length_m, self.aspect * length_m], &legend))?;
        }
        let path = |end: &str| self.folder.join("figures").join(format!("{name}.{end}"));
        let png = picture.png().map_err(Error::io("write", path("png")))?;
        write_atomic(&path("png"), |w| std::io::Write::write_all(w, &png))?;
        let svg = Framed {
            name,
            alt,
            png: &png,
            cell_m: [length_m, self.aspect * length_m],
            legend,
            format: Format::page(width),
        }
        .svg();
        write_atomic(&path("svg"), |w| std::io::Write::write_all(w, svg.as_bytes()))?;
        Ok(PreEscaped(svg))
    }

    /// Writes the bitmap `figures/NAME.png`, and `figures/NAME.svg` with labels; returns the latter.
    pub(super) fn relief(&self, (name, alt): (&str, &str), drawn: &ReliefFigure) -> Result<Markup> {
        if let Some(printed) = &self.options.printed {
            printed::relief(self.folder, printed, (name, alt), drawn)?;
        }
        let path = |end: &str| self.folder.join("figures").join(format!("{name}.{end}"));
        let png = drawn.relief.png(ReliefFigure::WIDTH).map_err(Error::io("write", path("png")))?;
        write_atomic(&path("png"), |w| std::io::Write::write_all(w, &png))?;
        let svg = drawn.svg(alt, &png, Format::page(ReliefFigure::WIDTH as f64));
        write_atomic(&path("svg"), |w| std::io::Write::write_all(w, svg.as_bytes()))?;
        Ok(PreEscaped(svg))
    }

    /// Writes `figures/NAME.svg` and returns it; `None` if no curve has points.
    pub(super) fn curves(&self, name: &str, plot: &Plot) -> Result<Option<Markup>> {
        let Some(svg) = plot.svg() else { return Ok(None) };
        if let Some(printed) = &self.options.printed {
            printed::plot(self.folder, printed, name, plot)?;
        }
        let path = self.folder.join("figures").join(format!("{name}.svg"));
        write_atomic(&path, |w| std::io::Write::write_all(w, svg.as_bytes()))?;
        Ok(Some(html! { div.curves { (PreEscaped(svg)) } }))
    }
}

/// A figure with caption, numbered by the style sheet.
pub(super) fn figure(content: Markup, caption: Markup) -> Markup {
    html! { figure { (content) figcaption { (caption) } } }
}

/// Pictures side by side, `row` of them in a row.
pub(super) fn panels(row: usize, panels: &[Markup]) -> Markup {
    html! { div.panels style={ "--row:" (row.max(1)) } { @for p in panels { (p) } } }
}

/// One of several pictures in a row.
pub(super) fn panel(title: &str, content: Markup, below: Markup) -> Markup {
    html! { div.panel { @if !title.is_empty() { div.panel-title { (title) } } (content) div.below { (below) } } }
}

/// A symbol in italics, with the index of `h_rms` as a subscript. Text of several words stays upright.
pub(super) fn symbol(text: &str) -> Markup {
    if text.split(' ').filter(|w| !w.contains('_') && w.chars().filter(char::is_ascii_alphabetic).count() > 2).count()
        > 1
    {
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

/// A table that scrolls horizontally in a narrow window.
pub(super) fn table(head: &[&str], rows: Vec<Vec<Markup>>) -> Markup {
    of_class("words", head, rows)
}

/// [`table`] of numbers without line breaks in cells.
pub(super) fn numbers(head: &[&str], rows: Vec<Vec<Markup>>) -> Markup {
    of_class("numbers", head, rows)
}

fn of_class(class: &str, head: &[&str], rows: Vec<Vec<Markup>>) -> Markup {
    html! {
        div.scroll {
            table class=(class) {
                thead { tr { @for h in head { th { (h) } } } }
                tbody { @for row in &rows { tr { @for cell in row { td { (cell) } } } } }
            }
        }
    }
}

/// The text with its first letter capitalised.
pub(super) fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

pub(super) fn text(content: impl std::fmt::Display) -> Markup {
    html! { (content.to_string()) }
}

//! Where figures are made: each is written to `figures/` and comes back as markup to put into the page.

use std::path::{Component, Path, PathBuf};

use maud::{Markup, PreEscaped, html};

use crate::error::{Error, Result};
use crate::record::atomic_file::write_atomic;
use crate::record::results::{FILE, ScalesSi};
use crate::report::map::{self, Framed, Legend};
use crate::report::picture::Picture;
use crate::report::plot::Plot;

/// The run folder, and what all its pictures share.
pub struct FigureWriter<'a> {
    pub folder: &'a Path,
    /// Extent in y over extent in x: pictures keep the cell's shape even where the grid's cells are not square.
    pub aspect: f64,
    pub scales: ScalesSi,
}

impl FigureWriter<'_> {
    /// A file that `results.json` names: relative and inside the run folder, so that the folder can be moved.
    pub fn field(&self, name: &str) -> Result<PathBuf> {
        let inside = Path::new(name).components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
        if name.is_empty() || !inside {
            let accepted = "a path inside the run folder, relative to it";
            return Err(Error::format(self.folder.join(FILE), format!("the field file {name:?}"), accepted));
        }
        Ok(self.folder.join(name))
    }

    /// Writes the bare `figures/NAME.png`, and `figures/NAME.svg` with axes and colour bar, which is returned. The cell is
    /// `length_m` wide.
    pub fn map(&self, (name, alt): (&str, &str), picture: &Picture, length_m: f64, legend: Legend) -> Result<Markup> {
        self.framed((name, alt), picture, length_m, legend, map::IN_A_ROW)
    }

    /// [`Self::map`] of a picture that stands alone.
    pub fn large_map(&self, names: (&str, &str), picture: &Picture, length_m: f64, legend: Legend) -> Result<Markup> {
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
        let path = |end: &str| self.folder.join("figures").join(format!("{name}.{end}"));
        let png = picture.png().map_err(Error::io("write", path("png")))?;
        write_atomic(&path("png"), |w| std::io::Write::write_all(w, &png))?;
        let svg = Framed { name, alt, png: &png, cell_m: [length_m, self.aspect * length_m], legend, width }.svg();
        write_atomic(&path("svg"), |w| std::io::Write::write_all(w, svg.as_bytes()))?;
        Ok(PreEscaped(svg))
    }

    /// Writes `figures/NAME.svg` and returns it; nothing where there is nothing to show.
    pub fn curves(&self, name: &str, plot: &Plot) -> Result<Option<Markup>> {
        let Some(svg) = plot.svg() else { return Ok(None) };
        let path = self.folder.join("figures").join(format!("{name}.svg"));
        write_atomic(&path, |w| std::io::Write::write_all(w, svg.as_bytes()))?;
        Ok(Some(html! { div.curves { (PreEscaped(svg)) } }))
    }
}

/// A figure with its caption; the style sheet numbers them.
pub fn figure(content: Markup, caption: Markup) -> Markup {
    html! { figure { (content) figcaption { (caption) } } }
}

/// Pictures side by side, so many in a row.
pub fn panels(row: usize, panels: &[Markup]) -> Markup {
    html! { div.panels style={ "--row:" (row.max(1)) } { @for p in panels { (p) } } }
}

/// One of several pictures side by side.
pub fn panel(title: &str, content: Markup, below: Markup) -> Markup {
    html! { div.panel { @if !title.is_empty() { div.panel-title { (title) } } (content) div.below { (below) } } }
}

/// A symbol in italics, `h_rms` with its index set low. Several words are no symbol and stay upright.
pub fn symbol(text: &str) -> Markup {
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

/// A wide table that scrolls by itself on a narrow window.
pub fn table(head: &[&str], rows: Vec<Vec<Markup>>) -> Markup {
    of_class("words", head, rows)
}

/// [`table`] of numbers, whose cells are not broken.
pub fn numbers(head: &[&str], rows: Vec<Vec<Markup>>) -> Markup {
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

/// A sentence's beginning.
pub fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

pub fn text(content: impl std::fmt::Display) -> Markup {
    html! { (content.to_string()) }
}

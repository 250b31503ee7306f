//! Where figures are made: each is written to `figures/` and comes back as markup to put into the page.

use std::path::{Component, Path, PathBuf};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, PreEscaped, html};

use crate::error::{Error, Result};
use crate::record::land::land;
use crate::record::results::{FILE, ScalesSi};
use crate::report::number::{si_scale, trimmed};
use crate::report::picture::{self, Picture, Range};
use crate::report::plot::Plot;

/// The run folder, and what all its pictures share.
pub struct Desk<'a> {
    pub folder: &'a Path,
    /// Extent in y over extent in x: pictures keep the cell's shape even where the grid's cells are not square.
    pub aspect: f64,
    pub scales: ScalesSi,
}

impl Desk<'_> {
    /// A file that `results.json` names: relative and inside the run folder, so that the folder can be moved.
    pub fn field(&self, name: &str) -> Result<PathBuf> {
        let inside = Path::new(name).components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
        if name.is_empty() || !inside {
            let accepted = "a path inside the run folder, relative to it";
            return Err(Error::format(self.folder.join(FILE), format!("the field file {name:?}"), accepted));
        }
        Ok(self.folder.join(name))
    }

    /// Writes `figures/NAME.png` and returns the picture itself, not a link to it.
    pub fn picture(&self, name: &str, alt: &str, picture: &Picture) -> Result<Markup> {
        let path = self.folder.join("figures").join(format!("{name}.png"));
        let png = picture.png().map_err(Error::io("write", &path))?;
        land(&path, |w| std::io::Write::write_all(w, &png))?;
        let source = format!("data:image/png;base64,{}", STANDARD.encode(&png));
        Ok(html! {
            img src=(source) alt=(alt) width=(picture.width) height=(picture.height)
                style={ "aspect-ratio:1/" (self.aspect) };
        })
    }

    /// Writes `figures/NAME.svg` and returns it; nothing where there is nothing to show.
    pub fn curves(&self, name: &str, plot: &Plot) -> Result<Option<Markup>> {
        let Some(svg) = plot.svg() else { return Ok(None) };
        let path = self.folder.join("figures").join(format!("{name}.svg"));
        land(&path, |w| std::io::Write::write_all(w, svg.as_bytes()))?;
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

/// A colour bar from `range`, whose values are in `unit` already.
///
/// `clipped` says that some values lie above the upper end.
pub fn colour_bar(range: Range, unit: &str, clipped: bool) -> Markup {
    const STOPS: u32 = 24;
    let stops: Vec<String> = (0..=STOPS)
        .map(|i| picture::colour(f64::from(i) / f64::from(STOPS)))
        .map(|[r, g, b]| format!("rgb({r},{g},{b})"))
        .collect();
    let gradient = format!("background:linear-gradient(to right,{})", stops.join(","));
    html! {
        div.bar {
            span { (trimmed(range.low, 3)) }
            i style=(gradient) {}
            span { @if clipped { "≥ " } (trimmed(range.high, 3)) " " (unit) }
        }
    }
}

/// [`colour_bar`] with the SI prefix that suits the upper end; values in `unit` without prefix.
pub fn colour_bar_si(range: Range, unit: &str, clipped: bool) -> Markup {
    let (scale, prefix) = si_scale(range.low.abs().max(range.high.abs()));
    let scaled = Range { low: range.low / scale, high: range.high / scale };
    colour_bar(scaled, &format!("{prefix}{unit}"), clipped)
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

//! HTML page: head, sections, footer.

use std::path::Path;

use maud::{DOCTYPE, Markup, PreEscaped, html};

use asperity_grid::error::Result;
use asperity_surface::files::atomic_file::read_bytes;

/// A section of the page: anchor, title, contents.
pub(super) struct PageSection {
    pub anchor: &'static str,
    pub title: &'static str,
    pub body: Markup,
}

/// A complete page: title and lead, first screen, sections. `source`: the file with the results.
///
/// # Errors
/// The file cannot be read.
pub(super) fn document(
    (name, lead): (&str, &str),
    top: Markup,
    sections: &[PageSection],
    source: &Path,
) -> Result<Markup> {
    let hash = blake3::hash(&read_bytes(source)?).to_hex();
    let from = source.file_name().map_or_else(String::new, |f| f.to_string_lossy().into_owned());
    let version = concat!("asperity ", env!("CARGO_PKG_VERSION"));
    // Texts in margins of printed pages; the script adds the date of printing.
    let quoted = |text: &str| text.replace(['\\', '"', '<', '\n'], " ");
    let margins = format!(
        "@page {{ @top-left {{ content: \"{}\"; }} @top-right {{ content: \"{version}, {from} {}\"; }} \
         @bottom-right {{ content: counter(page) \" / \" counter(pages); }} }}",
        quoted(name),
        &hash[..12]
    );
    Ok(html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="generator" content=(version);
                meta name="color-scheme" content="light dark";
                title { (name) }
                style { (PreEscaped(include_str!("style.css"))) (PreEscaped(margins)) }
            }
            body {
                header {
                    h1 { (name) }
                    a.skip href="#contents" { "Contents" }
                }
                main {
                    div.first { (top) }
                    div.reading {
                        @if !lead.is_empty() { p.lead { (lead) } }
                        nav id="contents" aria-label="Contents" { @for s in sections { a href={ "#" (s.anchor) } { (s.title) } } }
                        @for s in sections { section id=(s.anchor) { h2 { (s.title) } (s.body) } }
                    }
                }
                footer { "Drawn by " (version) " from " (from) " (BLAKE3 " (&hash[..12]) ") in the same folder; the figures "
                    "are also files there. Every number on this page comes from the results." }
                script { (PreEscaped(include_str!("maps.js"))) (PreEscaped(include_str!("relief.js"))) (PreEscaped(include_str!("page.js"))) }
            }
        }
    })
}

/// A citation with its DOI or address as a link.
pub(super) fn linked(citation: &str) -> Markup {
    let words: Vec<Markup> = citation
        .split_inclusive(char::is_whitespace)
        .map(|word| {
            let bare = word.trim();
            let target = bare.trim_end_matches(['.', ',', ';', ':', ')']);
            let doi = target.trim_start_matches("doi:").trim_start_matches("DOI:");
            if target.starts_with("https://") || target.starts_with("http://") {
                html! { a href=(target) { (target) } (word[target.len()..]) }
            } else if doi.starts_with("10.") && doi.contains('/') {
                html! { a href={ "https://doi.org/" (doi) } { (target) } (word[target.len()..]) }
            } else {
                html! { (word) }
            }
        })
        .collect();
    html! { @for w in &words { (w) } }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn citations_become_links_and_nothing_else_does() {
        let text = linked("Müser et al. (2017) <TL> 65, 118, doi:10.1007/s11249-017-0900-2.").into_string();
        let link = "<a href=\"https://doi.org/10.1007/s11249-017-0900-2\">doi:10.1007/s11249-017-0900-2</a>.";
        assert!(text.ends_with(link), "{text}");
        assert!(text.contains("&lt;TL&gt;"));
        assert_eq!(linked("10.5 nm and a/b").into_string(), "10.5 nm and a/b");
    }
}

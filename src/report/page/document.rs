//! HTML page: head, sections, footer.

use maud::{DOCTYPE, Markup, PreEscaped, html};

/// A section of the page: anchor, title, contents.
pub(super) struct Section {
    pub anchor: &'static str,
    pub title: &'static str,
    pub body: Markup,
}

/// A complete page: title and lead, summary, sections. `from`: name of the source file.
pub(super) fn document((name, lead): (&str, &str), top: Markup, sections: &[Section], from: &str) -> Markup {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="generator" content={ "asperity " (env!("CARGO_PKG_VERSION")) };
                title { (name) }
                style { (PreEscaped(include_str!("style.css"))) }
            }
            body {
                h1 { (name) }
                @if !lead.is_empty() { p.lead { (lead) } }
                nav { @for s in sections { a href={ "#" (s.anchor) } { (s.title) } } }
                (top)
                @for s in sections { section id=(s.anchor) { h2 { (s.title) } (s.body) } }
                footer { "Drawn by asperity " (env!("CARGO_PKG_VERSION")) " from " (from) " in the same folder; the figures "
                    "are also files there. Every number on this page comes from the results. Terms are defined in docs/glossary.md." }
            }
        }
    }
}

/// A citation with its DOI or address as a link.
pub(super) fn linked(citation: &str) -> Markup {
    let words: Vec<Markup> = citation
        .split_inclusive(char::is_whitespace)
        .map(|word| {
            let bare = word.trim();
            let target = bare.trim_end_matches(['.', ',', ';', ')']);
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

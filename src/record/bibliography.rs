//! The papers that runs are based on, in BibTeX: what reports list and `asperity cite` prints.

/// The entries. The paper on asperity has the same file.
const REFERENCES: &str = include_str!("../references.bib");

/// An entry, from its `@` to its closing brace.
#[derive(Debug, Clone, Copy)]
pub struct Entry(pub &'static str);

/// All entries.
pub fn entries() -> impl Iterator<Item = Entry> {
    REFERENCES.split("\n\n").map(str::trim).filter(|entry| entry.starts_with('@')).map(Entry)
}

/// `Kelchner, Plimpton & Hamilton, Physical Review B 58 (1998) 11085, doi:…` of the entry with a key.
///
/// # Panics
/// Without such an entry: keys are constants of the program.
pub fn cited(key: &str) -> String {
    let starts = |entry: &Entry| entry.0.split_once('{').is_some_and(|(_, rest)| rest.split(',').next() == Some(key));
    entries().find(starts).unwrap_or_else(|| panic!("no entry {key}")).cited()
}

impl Entry {
    /// Whether a source has the DOI or the preprint of the entry.
    pub fn is_named(self, source: &str) -> bool {
        let preprint = self.field("eprint").is_some_and(|number| source.contains(&format!("arXiv:{number}")));
        preprint || self.field("doi").is_some_and(|doi| dois(source).any(|named| named == doi))
    }

    fn field(self, name: &str) -> Option<&'static str> {
        let line = self.0.lines().find(|line| line.trim_start().split(' ').next() == Some(name))?;
        Some(line.split_once('{')?.1.trim_end_matches(['}', ',']))
    }

    fn cited(self) -> String {
        let field = |name| self.field(name).unwrap_or_default();
        // A book has no journal.
        let place = match self.field("journal") {
            Some(journal) => {
                let first_page = field("pages").split("--").next().unwrap_or_default();
                format!("{journal} {} ({}) {first_page}", field("volume"), field("year"))
            }
            None => format!("{} ({})", field("title"), field("year")),
        };
        let number = self.field("doi").map(|doi| format!(", doi:{doi}"));
        let number = number.or(self.field("eprint").map(|preprint| format!(", arXiv:{preprint}")));
        format!("{}, {place}{}", self.authors(), number.unwrap_or_default())
    }

    /// Up to four surnames.
    fn authors(self) -> String {
        let surname = |author: &str| author.split(',').next().unwrap_or_default().replace(['{', '}'], "");
        let names: Vec<String> = self.field("author").unwrap_or_default().split(" and ").map(surname).collect();
        match &names[..] {
            [first, .., last] if names.len() > 4 || last == "others" => format!("{first} et al."),
            [others @ .., last] if !others.is_empty() => format!("{} & {last}", others.join(", ")),
            _ => names.concat(),
        }
    }
}

/// The DOIs of a source.
fn dois(source: &str) -> impl Iterator<Item = &str> {
    source.split("doi:").skip(1).map(|rest| {
        let end = rest.find([' ', ';', ',']).unwrap_or(rest.len());
        let doi = rest[..end].trim_end_matches([':', '.']);
        // A bracket around it is not part of it.
        if doi.matches(')').count() > doi.matches('(').count() { doi.trim_end_matches(')') } else { doi }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_find_their_entries() {
        let found = |source: &str| entries().filter(|entry| entry.is_named(source)).count();
        for source in [
            "Müser et al., Tribology Letters 65 (2017) 118, doi:10.1007/s11249-017-0900-2: the problem.",
            "Method fft-ia (x): doi:10.1016/S0043-1648(99)00113-1; Medina & Dini, Int. J. Solids Struct. 51 (2014) 2620.",
            "Yastrebov, Anciaux & Molinari, J. Mech. Phys. Solids 107 (2017) 469, arXiv:1701.02727: perimeter.",
        ] {
            assert_eq!(found(source), 1, "{source}");
        }
        assert_eq!(found("The potential is that of Al.alloy."), 0);
        let two = "Method p (q): doi:10.1063/1.1388626; doi:10.1103/PhysRevLett.99.125502.";
        assert_eq!(dois(two).collect::<Vec<_>>(), ["10.1063/1.1388626", "10.1103/PhysRevLett.99.125502"]);
        assert_eq!(found(two), 2);
        assert_eq!(dois("(doi:10.1063/1.1388626)").collect::<Vec<_>>(), ["10.1063/1.1388626"]);
    }

    #[test]
    fn entries_are_complete() {
        for entry in entries() {
            let is_whole =
                entry.0.ends_with('}') && ["author", "title", "year"].iter().all(|field| entry.0.contains(field));
            assert!(is_whole || entry.0.starts_with("@misc"), "{entry:?}");
        }
    }

    #[test]
    fn an_entry_is_cited_in_one_line_that_names_it() {
        for (key, line) in [
            (
                "Kelchner1998",
                "Kelchner, Plimpton & Hamilton, Physical Review B 58 (1998) 11085, doi:10.1103/PhysRevB.58.11085",
            ),
            ("Johnson1985", "Johnson, Contact Mechanics (1985), doi:10.1017/CBO9781139171731"),
            ("Muser2017", "Müser et al., Tribology Letters 65 (2017) 118, doi:10.1007/s11249-017-0900-2"),
            (
                "Yastrebov2017",
                "Yastrebov, Anciaux & Molinari, Journal of the Mechanics and Physics of Solids 107 (2017) 469, arXiv:1701.02727",
            ),
        ] {
            assert_eq!(cited(key), line);
            assert_eq!(entries().filter(|entry| entry.is_named(line)).count(), 1, "{key}");
        }
    }
}

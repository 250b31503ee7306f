//! The description `main.xml` of an x3p file.

use asperity_grid::error::{Error, Result};
use quick_xml::Reader;
use quick_xml::events::Event;
use std::collections::BTreeMap;
use std::path::Path;

/// Depth of elements; the standard has 5.
const DEEPEST: usize = 64;

/// Bytes of the longest path that is kept; the standard's have 50.
const LONGEST: usize = 200;

/// Texts; the standard has 30.
const MOST: usize = 10_000;

/// Texts of the elements by their path below the root, without namespaces, and the heights of `DataList`.
#[derive(Debug, Default)]
pub(super) struct Elements {
    texts: BTreeMap<String, String>,
    /// NaN for points without a value.
    pub(super) list: Vec<f64>,
}

impl Elements {
    pub(super) fn text(&self, path: &str) -> Option<&str> {
        self.texts.get(path).map(String::as_str)
    }
}

const DATUM: &str = "Record3/DataList/Datum";

/// Reads `main.xml`. Entities and document types are ignored.
pub(super) fn read(path: &Path, xml: &[u8]) -> Result<Elements> {
    // The parser quotes names, which may have line breaks and any length.
    let damaged = |e: String| {
        let line: String = e.split_whitespace().collect::<Vec<_>>().join(" ").chars().take(200).collect();
        Error::format(path, format!("main.xml: {line}"), "XML of ISO 25178-72")
    };
    let xml = String::from_utf8_lossy(xml);
    let mut reader = Reader::from_str(&xml);
    reader.config_mut().expand_empty_elements = true;
    let mut elements = Elements::default();
    // Names of the open elements, and the length of the path that ends before each.
    let (mut place, mut lengths) = (String::new(), Vec::new());
    let mut closed = false;
    loop {
        match reader.read_event().map_err(|e| damaged(e.to_string()))? {
            Event::Start(start) => {
                lengths.push(place.len());
                if lengths.len() > DEEPEST {
                    return Err(damaged(format!("more than {DEEPEST} elements within each other")));
                }
                if lengths.len() > 1 {
                    if !place.is_empty() {
                        place.push('/');
                    }
                    place.push_str(start.local_name().as_ref());
                }
                if place == DATUM {
                    elements.list.push(f64::NAN);
                }
            }
            Event::End(_) => {
                place.truncate(lengths.pop().ok_or_else(|| damaged("an end without a start".into()))?);
                closed |= lengths.is_empty();
            }
            Event::Text(text) => {
                let text = text.trim().to_string();
                match elements.list.last_mut() {
                    _ if text.is_empty() => {}
                    Some(height) if place == DATUM => {
                        *height = text.parse().map_err(|_| damaged(format!("the height {text:?}")))?;
                    }
                    _ if place.len() > LONGEST => {}
                    _ if elements.texts.len() == MOST => return Err(damaged(format!("more than {MOST} texts"))),
                    _ => {
                        elements.texts.insert(place.clone(), text);
                    }
                }
            }
            Event::Eof if closed && lengths.is_empty() => return Ok(elements),
            Event::Eof => return Err(damaged("it ends within an element".into())),
            _ => {}
        }
    }
}

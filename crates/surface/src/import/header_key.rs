//! Names of what a header of a text file states: those of Gwyddion in its languages, SPIP, Nova and ESRI grids, and names of other
//! programs in English and German, which combine an axis (`x`, `Z`) with a word (`step`, `Schrittweite`).

/// What a header may state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Key {
    Channel,
    /// Extent of the map: points times spacing.
    Length(Axis),
    /// Likewise, or a number of points: `width`, `size`.
    Size(Axis),
    Spacing(Axis),
    Points(Axis),
    LateralUnit(Axis),
    /// Unit of the heights alone.
    HeightUnit,
    /// Unit of the heights, and of the extents if these have none of their own.
    Unit,
    /// Factor from the numbers to heights.
    Factor,
    /// The same to heights in nm, unless the header states another unit (SPIP).
    ToNanometres,
    /// Number that stands for a missing height.
    Missing,
    Periodic,
    Sign,
    History,
    /// SPIP has lengths in nm unless it states another unit.
    FileFormat,
    /// Known, without a meaning for the heights.
    Other,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Axis {
    X,
    Y,
    Both,
}

impl Axis {
    pub(super) fn places(self) -> &'static [usize] {
        match self {
            Axis::X => &[0],
            Axis::Y => &[1],
            Axis::Both => &[0, 1],
        }
    }
}

/// The meaning of a name; upper case, `-`, `_` and quotation marks make no difference.
pub(super) fn key(name: &str) -> Option<Key> {
    let name = name.trim().trim_matches('"').to_lowercase().replace(['-', '_'], " ");
    let words: Vec<&str> = name.split_whitespace().collect();
    whole(&words.join(" ")).or_else(|| composed(&words))
}

/// Names as a whole.
fn whole(name: &str) -> Option<Key> {
    Some(match name {
        "channel" | "channel name" | "kanál" | "kanal" | "kanalname" | "canal" | "canale" | "チャネル" | "채널"
        | "канал" => Key::Channel,
        "width" | "šířka" | "breite" | "anchura" | "largeur" | "larghezza" | "幅" | "폭" | "largura" | "ширина"
        | "image width" | "map width" | "scan width" | "bildbreite" | "scanbreite" => Key::Size(Axis::X),
        "height" | "výška" | "höhe" | "altura" | "hauteur" | "altezza" | "高さ" | "높이" | "высота"
        | "image height" | "map height" | "scan height" | "bildhöhe" | "scanhöhe" => Key::Size(Axis::Y),
        "lx" => Key::Length(Axis::X),
        "ly" => Key::Length(Axis::Y),
        "dx" => Key::Spacing(Axis::X),
        "dy" => Key::Spacing(Axis::Y),
        "cellsize" => Key::Spacing(Axis::Both),
        "nx" | "xres" | "w" | "ncols" | "columns" | "spalten" => Key::Points(Axis::X),
        "ny" | "yres" | "h" | "nrows" | "rows" | "lines" | "zeilen" => Key::Points(Axis::Y),
        // Gwyddion's words for "value units".
        "jednotky hodnot"
        | "einheiten"
        | "unités"
        | "unità valore"
        | "値の単位"
        | "값 단위"
        | "unidades de valor"
        | "единицы измерения" => Key::HeightUnit,
        "bit2nm" => Key::ToNanometres,
        "nodata value" | "nodata" | "missing value" | "fill value" | "void value" | "fehlwert" | "fehlender wert" => {
            Key::Missing
        }
        "periodic" | "is periodic" | "periodisch" => Key::Periodic,
        "sign" => Key::Sign,
        "history" => Key::History,
        "file format" => Key::FileFormat,
        "xllcorner" | "yllcorner" | "xllcenter" | "yllcenter" | "forward" | "scan direction" => Key::Other,
        _ => return None,
    })
}

/// What a word states of an axis.
#[derive(Clone, Copy, PartialEq)]
enum Noun {
    Length,
    Size,
    Spacing,
    Points,
    Unit,
    Scale,
}

/// An axis, before or after the other words, and what is stated of it. Without an axis, of both.
fn composed(words: &[&str]) -> Option<Key> {
    const FILLING: [&str; 9] = ["in", "of", "der", "des", "the", "number", "no.", "anzahl", "direction"];
    let mut axes = Vec::new();
    let mut rest = Vec::new();
    for word in words.iter().filter(|w| !FILLING.contains(w)) {
        match *word {
            "x" | "y" | "z" | "xy" => axes.push(*word),
            other => rest.push(other),
        }
    }
    let rest = rest.join(" ");
    let known = noun(&rest).or_else(|| noun_of_axis(&rest).filter(|_| !axes.is_empty()));
    let (noun, of) = known.map(|n| (n, None)).or_else(|| qualified(&rest).map(|(n, of)| (n, Some(of))))?;
    let axis = match (&axes[..], of) {
        ([], of) => of.unwrap_or(""),
        ([one], None) => one,
        ([one], Some(of)) if *one == of || of == "xy" && *one != "z" => one,
        _ => return None,
    };
    let lateral = match axis {
        "x" => Some(Axis::X),
        "y" => Some(Axis::Y),
        "z" => None,
        _ => Some(Axis::Both),
    };
    match (noun, lateral) {
        (Noun::Unit, _) if axis.is_empty() => Some(Key::Unit),
        (Noun::Unit, Some(axis)) => Some(Key::LateralUnit(axis)),
        (Noun::Unit, None) => Some(Key::HeightUnit),
        (Noun::Scale, None) => Some(Key::Factor),
        (Noun::Scale, _) if axis.is_empty() => Some(Key::Factor),
        (Noun::Length, axis) => axis.map(Key::Length),
        (Noun::Size, axis) => axis.map(Key::Size),
        (Noun::Spacing | Noun::Scale, axis) => axis.map(Key::Spacing),
        (Noun::Points, axis) => axis.map(Key::Points),
    }
}

fn noun(word: &str) -> Option<Noun> {
    Some(match word {
        "length" | "lengths" | "extent" | "extents" | "scan size" | "physical size" | "physical sizes" => Noun::Length,
        "size" | "image size" | "map size" | "field size" | "field view" | "größe" | "grösse" | "bildgröße"
        | "bildgrösse" | "messfeld" | "messfeldgröße" | "messfläche" | "scangröße" | "abmessung" | "abmessungen" => {
            Noun::Size
        }
        "pixel size" | "pixel spacing" | "spacing" | "grid spacing" | "point spacing" | "sampling interval"
        | "pixelgröße" | "pixelgrösse" | "pixelweite" | "pixelabstand" | "punktabstand" | "messpunktabstand"
        | "schrittweite" | "rasterweite" | "rasterabstand" | "gitterweite" | "gitterabstand" => Noun::Spacing,
        "pixels" | "points" | "samples" | "punkte" | "punktzahl" | "messpunkte" | "bildpunkte" => Noun::Points,
        "unit" | "units" | "einheit" | "einheiten" | "maßeinheit" | "masseinheit" => Noun::Unit,
        "scale" | "factor" | "scale factor" | "conversion factor" | "skalierung" | "skalierungsfaktor" | "faktor"
        | "umrechnungsfaktor" => Noun::Scale,
        _ => return None,
    })
}

/// Words that state something of an axis only with its name: a range alone may be that of the heights.
fn noun_of_axis(word: &str) -> Option<Noun> {
    Some(match word {
        "range" | "scan length" | "scan range" | "länge" | "messlänge" | "scanlänge" | "bereich" | "scanbereich"
        | "ausdehnung" => Noun::Length,
        "step" | "step size" | "sampling" | "sampling step" | "increment" | "abstand" | "schritt" | "inkrement" => {
            Noun::Spacing
        }
        _ => return None,
    })
}

/// `height unit`, `Einheit Höhe`, `Höheneinheit`, `lateral units`: a unit or a factor with the word for its axes.
fn qualified(words: &str) -> Option<(Noun, &'static str)> {
    const HEIGHTS: [&str; 13] = [
        "height",
        "heights",
        "data",
        "value",
        "values",
        "höhe",
        "höhen",
        "daten",
        "wert",
        "werte",
        "werten",
        "vertical",
        "vertikale",
    ];
    const LATERAL: [&str; 7] = ["lateral", "laterale", "length", "längen", "horizontal", "horizontale", "xy"];
    let of = |word: &str| {
        if HEIGHTS.contains(&word) { Some("z") } else { LATERAL.contains(&word).then_some("xy") }
    };
    let split = || {
        if let Some((first, rest)) = words.split_once(' ') {
            let last = || words.rsplit_once(' ').and_then(|(rest, last)| Some((of(last)?, rest)));
            return of(first).map(|of| (of, rest)).or_else(last);
        }
        // German compounds: `Höheneinheit`, `Höhenfaktor`.
        let at = ["einheit", "faktor", "skalierung"].iter().find_map(|noun| words.find(noun))?;
        Some((of(&words[..at])?, &words[at..]))
    };
    let (of, rest) = split()?;
    noun(rest).filter(|n| matches!(n, Noun::Unit | Noun::Scale)).map(|n| (n, of))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_in_english_and_german() {
        for (names, expected) in [
            (&["Width", "Breite", "Bildbreite", "image width", "Size X", "X Größe"][..], Key::Size(Axis::X)),
            (&["x-length", "Länge X", "lx", "Messlänge X", "x_range", "scan size x"], Key::Length(Axis::X)),
            (&["length", "scan size", "physical sizes", "extent"], Key::Length(Axis::Both)),
            (&["size", "Bildgröße", "Messfeld", "field of view", "Abmessungen"], Key::Size(Axis::Both)),
            (&["dy", "Y-Step", "Schrittweite in Y", "Scale Y", "pixel_size_y", "Abstand Y"], Key::Spacing(Axis::Y)),
            (&["pixel size", "Punktabstand", "cellsize", "XY scale", "sampling interval"], Key::Spacing(Axis::Both)),
            (&["x-pixels", "NX", "Spalten", "Anzahl Punkte X", "number of points in x"], Key::Points(Axis::X)),
            (&["Z-Einheit", "Einheit Z", "Höheneinheit", "Einheit der Höhen", "Werteinheiten"], Key::HeightUnit),
            (&["z-unit", "Unit Data", "data unit", "height units", "Value units", "Einheiten"], Key::HeightUnit),
            (&["Unit", "Einheit", "Maßeinheit"], Key::Unit),
            (&["Lateral units", "length unit", "Längeneinheit", "xy unit"], Key::LateralUnit(Axis::Both)),
            (&["Einheit X", "x-unit"], Key::LateralUnit(Axis::X)),
            (&["scale", "z scale", "Skalierung", "Höhenfaktor", "data scale", "z-Faktor"], Key::Factor),
            (&["height conversion factor"], Key::Factor),
        ] {
            names.iter().for_each(|name| assert_eq!(key(name), Some(expected), "{name}"));
        }
        for name in [
            "z range",
            "range",
            "Länge",
            "step",
            "z step",
            "height of the sample",
            "x y unit",
            "date",
            "z",
            "",
            "x",
            "length x unit z",
        ] {
            assert_eq!(key(name), None, "{name}");
        }
    }
}

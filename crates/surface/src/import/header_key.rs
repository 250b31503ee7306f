//! Names of what a header of a text file states: those of Gwyddion in its languages, SPIP, Nova and ESRI grids, and names of other
//! programs in English and German, which combine an axis (`x`, `Z`) with a word (`step`, `Schrittweite`).

/// What a header may state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum HeaderKey {
    Channel,
    /// Extent of the map: points times spacing.
    Length(HeaderAxis),
    /// Likewise, or a number of points: `width`, `size`.
    Size(HeaderAxis),
    Spacing(HeaderAxis),
    Points(HeaderAxis),
    LateralUnit(HeaderAxis),
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
pub(super) enum HeaderAxis {
    X,
    Y,
    Both,
}

impl HeaderAxis {
    pub(super) fn places(self) -> &'static [usize] {
        match self {
            HeaderAxis::X => &[0],
            HeaderAxis::Y => &[1],
            HeaderAxis::Both => &[0, 1],
        }
    }
}

/// The meaning of a name; upper case, `-`, `_` and quotation marks make no difference.
pub(super) fn key(name: &str) -> Option<HeaderKey> {
    let name = name.trim().trim_matches('"').to_lowercase().replace(['-', '_'], " ");
    let tokens: Vec<&str> = name.split_whitespace().collect();
    whole(&tokens.join(" ")).or_else(|| composed(&tokens))
}

/// Names as a whole.
fn whole(name: &str) -> Option<HeaderKey> {
    Some(match name {
        "channel" | "channel name" | "kanál" | "kanal" | "kanalname" | "canal" | "canale" | "チャネル" | "채널"
        | "канал" => HeaderKey::Channel,
        "width" | "šířka" | "breite" | "anchura" | "largeur" | "larghezza" | "幅" | "폭" | "largura" | "ширина"
        | "image width" | "map width" | "scan width" | "bildbreite" | "scanbreite" => HeaderKey::Size(HeaderAxis::X),
        "height" | "výška" | "höhe" | "altura" | "hauteur" | "altezza" | "高さ" | "높이" | "высота"
        | "image height" | "map height" | "scan height" | "bildhöhe" | "scanhöhe" => HeaderKey::Size(HeaderAxis::Y),
        "lx" => HeaderKey::Length(HeaderAxis::X),
        "ly" => HeaderKey::Length(HeaderAxis::Y),
        "dx" => HeaderKey::Spacing(HeaderAxis::X),
        "dy" => HeaderKey::Spacing(HeaderAxis::Y),
        "cellsize" => HeaderKey::Spacing(HeaderAxis::Both),
        "nx" | "xres" | "w" | "ncols" | "columns" | "spalten" => HeaderKey::Points(HeaderAxis::X),
        "ny" | "yres" | "h" | "nrows" | "rows" | "lines" | "zeilen" => HeaderKey::Points(HeaderAxis::Y),
        // Gwyddion's words for "value units".
        "jednotky hodnot"
        | "einheiten"
        | "exported image units"
        | "unités"
        | "unità valore"
        | "値の単位"
        | "값 단위"
        | "unidades de valor"
        | "единицы измерения" => HeaderKey::HeightUnit,
        "bit2nm" => HeaderKey::ToNanometres,
        "nodata value" | "nodata" | "missing value" | "fill value" | "void value" | "fehlwert" | "fehlender wert" => {
            HeaderKey::Missing
        }
        "periodic" | "is periodic" | "periodisch" => HeaderKey::Periodic,
        "sign" => HeaderKey::Sign,
        "history" => HeaderKey::History,
        "file format" => HeaderKey::FileFormat,
        "xllcorner" | "yllcorner" | "xllcenter" | "yllcenter" | "forward" | "scan direction" => HeaderKey::Other,
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
fn composed(words: &[&str]) -> Option<HeaderKey> {
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
    let (noun, qualifier) =
        known.map(|n| (n, None)).or_else(|| qualified(&rest).map(|(n, qualifier)| (n, Some(qualifier))))?;
    let axis = match (&axes[..], qualifier) {
        ([], qualifier) => qualifier.unwrap_or(""),
        ([one], None) => one,
        ([one], Some(qualifier)) if *one == qualifier || qualifier == "xy" && *one != "z" => one,
        _ => return None,
    };
    let lateral = match axis {
        "x" => Some(HeaderAxis::X),
        "y" => Some(HeaderAxis::Y),
        "z" => None,
        _ => Some(HeaderAxis::Both),
    };
    match (noun, lateral) {
        (Noun::Unit, _) if axis.is_empty() => Some(HeaderKey::Unit),
        (Noun::Unit, Some(axis)) => Some(HeaderKey::LateralUnit(axis)),
        (Noun::Unit, None) => Some(HeaderKey::HeightUnit),
        (Noun::Scale, None) => Some(HeaderKey::Factor),
        (Noun::Scale, _) if axis.is_empty() => Some(HeaderKey::Factor),
        (Noun::Length, axis) => axis.map(HeaderKey::Length),
        (Noun::Size, axis) => axis.map(HeaderKey::Size),
        (Noun::Spacing | Noun::Scale, axis) => axis.map(HeaderKey::Spacing),
        (Noun::Points, axis) => axis.map(HeaderKey::Points),
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
fn qualified(tokens: &str) -> Option<(Noun, &'static str)> {
    let axes_of = |word: &str| match word {
        "height" | "heights" | "data" | "value" | "values" | "höhe" | "höhen" | "daten" | "wert" | "werte"
        | "werten" | "vertical" | "vertikale" => Some("z"),
        "lateral" | "laterale" | "length" | "längen" | "horizontal" | "horizontale" | "xy" => Some("xy"),
        _ => None,
    };
    let split = || {
        if let Some((first, remainder)) = tokens.split_once(' ') {
            let last = || tokens.rsplit_once(' ').and_then(|(remainder, last)| Some((axes_of(last)?, remainder)));
            return axes_of(first).map(|axes| (axes, remainder)).or_else(last);
        }
        // German compounds: `Höheneinheit`, `Höhenfaktor`.
        let index = ["einheit", "faktor", "skalierung"].iter().find_map(|noun| tokens.find(noun))?;
        Some((axes_of(&tokens[..index])?, &tokens[index..]))
    };
    let (axes, remainder) = split()?;
    noun(remainder).filter(|n| matches!(n, Noun::Unit | Noun::Scale)).map(|n| (n, axes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_in_english_and_german() {
        for (names, expected) in [
            (
                &["Width", "Breite", "Bildbreite", "image width", "Size X", "X Größe"][..],
                HeaderKey::Size(HeaderAxis::X),
            ),
            (&["x-length", "Länge X", "lx", "Messlänge X", "x_range", "scan size x"], HeaderKey::Length(HeaderAxis::X)),
            (&["length", "scan size", "physical sizes", "extent"], HeaderKey::Length(HeaderAxis::Both)),
            (&["size", "Bildgröße", "Messfeld", "field of view", "Abmessungen"], HeaderKey::Size(HeaderAxis::Both)),
            (
                &["dy", "Y-Step", "Schrittweite in Y", "Scale Y", "pixel_size_y", "Abstand Y"],
                HeaderKey::Spacing(HeaderAxis::Y),
            ),
            (
                &["pixel size", "Punktabstand", "cellsize", "XY scale", "sampling interval"],
                HeaderKey::Spacing(HeaderAxis::Both),
            ),
            (
                &["x-pixels", "NX", "Spalten", "Anzahl Punkte X", "number of points in x"],
                HeaderKey::Points(HeaderAxis::X),
            ),
            (&["Z-Einheit", "Einheit Z", "Höheneinheit", "Einheit der Höhen", "Werteinheiten"], HeaderKey::HeightUnit),
            (&["z-unit", "Unit Data", "data unit", "height units", "Value units", "Einheiten"], HeaderKey::HeightUnit),
            (&["Unit", "Einheit", "Maßeinheit"], HeaderKey::Unit),
            (&["Lateral units", "length unit", "Längeneinheit", "xy unit"], HeaderKey::LateralUnit(HeaderAxis::Both)),
            (&["Einheit X", "x-unit"], HeaderKey::LateralUnit(HeaderAxis::X)),
            (&["scale", "z scale", "Skalierung", "Höhenfaktor", "data scale", "z-Faktor"], HeaderKey::Factor),
            (&["height conversion factor"], HeaderKey::Factor),
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

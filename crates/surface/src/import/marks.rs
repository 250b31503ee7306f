//! Words that stand for a height in a table that was not measured, or is infinite.

/// Whether a field marks a height that was not measured: words of instruments, of runtime libraries and of spreadsheets.
pub(super) fn is_missing(field: &str) -> bool {
    let all = |c: char| field.chars().all(|f| f == c);
    let lower = field.to_lowercase();
    match lower.as_str() {
        "bad" | "na" | "n/a" | "n.a." | "<na>" | "null" | "none" | "nil" | "invalid" | "missing" | "void"
        | "masked" | "undefined" | "nodata" | "no_data" | "no data" | "?" => true,
        // Also of an empty field.
        _ => all('*') || all('-') || is_not_a_number(&lower) || is_sheet_error(&lower),
    }
}

/// `nan`, `-nan(ind)`, `NaNQ`, and Windows' `1.#QNAN`, `-1.#IND00`, `1.#R` (rounded to one digit).
fn is_not_a_number(lower: &str) -> bool {
    let word = lower.trim_start_matches(['-', '+']);
    if let Some(kind) = word.strip_prefix("1.#").or_else(|| word.strip_prefix("1,#")) {
        return ["q", "snan", "nan", "ind", "r"].iter().any(|start| kind.starts_with(start));
    }
    let tail = word.strip_prefix("nan");
    tail.is_some_and(|t| matches!(t, "" | "q" | "s") || t.starts_with('(') && t.ends_with(')'))
}

/// `#N/A`, `#DIV/0!`, `#NAME?` and their translations, `Err:502`.
fn is_sheet_error(lower: &str) -> bool {
    let known = ["#n/a", "#na", "#nv", "#n/d", "#nd", "#н/д", "#error", "#err"];
    let code = |digits: &str| !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit());
    let marked = lower.len() > 2 && lower.starts_with('#') && lower.ends_with(['!', '?']);
    marked || known.contains(&lower) || lower.strip_prefix("err:").is_some_and(code)
}

/// The sign of an infinite height as Windows writes it: `1.#INF`, `-1.#INF00`, `1.#J`.
pub(super) fn infinity(field: &str) -> Option<f64> {
    let lower = field.to_lowercase();
    let word = lower.trim_start_matches(['-', '+']);
    let kind = word.strip_prefix("1.#").or_else(|| word.strip_prefix("1,#"))?;
    let sign = if lower.starts_with('-') { -1.0 } else { 1.0 };
    (kind.starts_with("inf") || kind.starts_with('j')).then_some(sign * f64::INFINITY)
}

/// Whether a field is a number or a mark by itself.
pub(super) fn is_value(field: &str) -> bool {
    let plain = field.trim_matches('"').replace('\u{2212}', "-").replacen(',', ".", 1);
    plain.parse::<f64>().is_ok() || is_missing(&plain)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_for_what_was_not_measured() {
        for word in [
            "nan",
            "-nan",
            "NaN(ind)",
            "-nan(snan)",
            "NaNQ",
            "1.#QNAN",
            "1.#QNAN00",
            "-1.#IND",
            "-1.#IND00",
            "1.#SNAN",
            "1.#R",
            "1,#QNAN",
            "#N/A",
            "#DIV/0!",
            "#VALUE!",
            "#WERT!",
            "#NV",
            "#¡VALOR!",
            "#NAME?",
            "Err:502",
            "NA",
            "N/A",
            "<NA>",
            "--",
            "***",
            "BAD",
            "null",
            "",
        ] {
            assert!(is_missing(word), "{word}");
        }
        for word in ["1.#INF", "inf", "1.#I", "#", "####", "oak", "nano", "Err:", "1.5", "#1", "!"] {
            assert!(!is_missing(word), "{word}");
        }
        let infinite = ["1.#INF", "-1.#INF00", "1.#J", "1.#IND", "2"].map(infinity);
        assert_eq!(infinite, [Some(f64::INFINITY), Some(f64::NEG_INFINITY), Some(f64::INFINITY), None, None]);
    }
}

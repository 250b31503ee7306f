//! Where a comment begins on a line of a table: `#` may be part of a word (`1.#QNAN`, `#N/A`).

use super::fields::split;
use super::marks::{is_missing, is_value};

/// A line in two: fields, and the comment that is behind them. `#`, `%`, `!` and `//` begin a comment at the start of a line, unless a
/// known mark begins a row there; behind fields only a `#` between blanks does. Any other is part of a word.
pub(super) fn comment_apart(line: &str) -> (&str, &str) {
    let trimmed = line.trim_start();
    if trimmed.starts_with(['%', '!']) || trimmed.starts_with("//") {
        return ("", trimmed.trim_start_matches(['%', '!', '/']));
    }
    let (fields, comment) = fields_of(line);
    if trimmed.starts_with('#') {
        let all = split(fields).0;
        let is_row = all.len() > 1 && is_missing(all[0]) && all.iter().all(|f| is_value(f));
        return if is_row { (fields, comment) } else { ("", trimmed.trim_start_matches('#')) };
    }
    (fields, comment)
}

/// Likewise of a line whose start is no comment.
pub(super) fn fields_of(line: &str) -> (&str, &str) {
    let first = line.len() - line.trim_start().len();
    let begins = |&(i, _): &(usize, &str)| {
        let (before, comment) = (&line[..i], line[i..].trim_start_matches('#'));
        let between = before.ends_with(char::is_whitespace) && comment.starts_with(char::is_whitespace);
        let apart = !before.trim_end_matches(' ').ends_with([',', ';', '\t']);
        // More numbers or marks are no comment.
        let mut words = comment.split_whitespace();
        let is_text = words.clone().all(|w| !w.trim_matches('#').is_empty()) && !words.all(is_value);
        i > first && between && apart && is_text
    };
    match line.match_indices('#').find(begins) {
        Some((i, _)) => (&line[..i], line[i..].trim_start_matches('#')),
        None => (line, ""),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_are_apart_from_fields() {
        for (line, text, comment) in [
            ("1 2 # first", "1 2 ", " first"),
            ("1 2 ## first", "1 2 ", " first"),
            ("# nx: 3", "", " nx: 3"),
            ("#nx 3", "", "nx 3"),
            (" % a", "", " a"),
            ("1.#QNAN 2 # of #1", "1.#QNAN 2 ", " of #1"),
            ("#N/A 2 # a line", "#N/A 2 ", " a line"),
            ("#N/A means unknown", "", "N/A means unknown"),
        ] {
            assert_eq!(comment_apart(line), (text, comment), "{line}");
        }
        for line in [
            "1 1.#QNAN 2",
            "1 2 #N/A",
            "1,2,#N/A",
            "1;2; # 3",
            "1\t2\t# 3",
            "1 2 #",
            "1 2 ###",
            "1 2 # 3",
            "1 # # 3",
            "1 ## ### ##",
            "1 2 #oak",
            "3#oak",
            "#N/A,1,2",
            "#DIV/0! 1 2",
            "#VALUE!\t1,5\t\u{2212}2",
            "#ОШИБКА! 1 #N/A",
        ] {
            assert_eq!(comment_apart(line), (line, ""), "{line}");
        }
    }
}

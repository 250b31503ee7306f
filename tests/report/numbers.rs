//! Every number on the page is in `results.json`, to the digits shown: as a stored number in the unit next to it, in a stored
//! text, or as one of the values that the page computes from stored numbers, which are listed here. Drawings, whose ticks are
//! round numbers, are left out; their data are in `figures/`.

use asperity::atoms::results::StepMinimizer;
use asperity::contact::quantity::Quantity;
use asperity::contact::state::State;
use asperity::record::results::{FILE, LoadComparison, Results};
use asperity::report::number::{duration, memory};
use serde_json::Value;
use std::path::Path;

/// Digits that are part of the wording, with the reason.
const WORDING: [(&str, &str); 22] = [
    ("d²q/(2π)²", "formula"),
    ("|h̃(q)|²", "formula"),
    ("doi:10.1088/2051-672X/aa51f8", "citation"),
    ("1/√n of n clusters", "formula"),
    ("slope −1.45 (Müser et al. 2017)", "citation"),
    ("x = L/2", "place of the section"),
    ("1: identical maps", "definition of κ"),
    ("1 for equal maps, 0 for chance", "definition of κ"),
    ("E/(1 − ν²)", "formula"),
    ("modulus E/(1 − ν²)", "formula"),
    ("(0 %)", "deviation below half a per cent"),
    ("At 0 K", "without thermal motion"),
    ("at 0 K", "without thermal motion"),
    ("gap = 0", "criterion"),
    ("profile moment m0", "name"),
    ("profile moment m2", "name"),
    ("profile moment m4", "name"),
    ("√2/a0", "symbol"),
    ("ε/(E* a0³)", "symbol"),
    ("100 %", "bound of the table of changes"),
    ("0.3 µm exp(−8 p*)", "formula of the paper"),
    ("p* = 0.01.", "reference load of the challenge"),
];

/// Numbers of a JSON value that are not in long lists (curves and distributions), and its texts.
fn leaves(value: &Value, numbers: &mut Vec<f64>, texts: &mut Vec<String>) {
    const LONG: usize = 4;
    match value {
        Value::Number(n) => numbers.extend(n.as_f64()),
        Value::String(s) => texts.push(s.clone()),
        Value::Array(list) if list.len() > LONG && list.iter().all(Value::is_number) => {}
        Value::Array(list) => list.iter().for_each(|v| leaves(v, numbers, texts)),
        Value::Object(map) => map.values().for_each(|v| leaves(v, numbers, texts)),
        _ => {}
    }
}

/// A number of the page: value, half a unit of its last digit, the unit next to it, and the text around it.
#[derive(Debug, Clone, PartialEq)]
struct Shown {
    value: f64,
    half: f64,
    unit: String,
    around: String,
}

/// The visible text of a page without drawings, scripts, links and file names.
fn text_of(page: &str) -> String {
    let mut page = page.to_string();
    for tag in ["script", "style", "svg", "code", "footer", "nav", "title"] {
        let (open, close) = (format!("<{tag}"), format!("</{tag}>"));
        while let Some(start) = page.find(&open) {
            let end = page[start..].find(&close).map_or(page.len(), |e| start + e + close.len());
            page.replace_range(start..end, " ");
        }
    }
    let mut text = String::new();
    for (k, piece) in page.split('<').enumerate() {
        let (tag, rest) = if k == 0 { ("", piece) } else { piece.split_once('>').unwrap_or((piece, "")) };
        let name = tag.trim_start_matches('/').split([' ', '>']).next().unwrap_or("");
        let inline = ["strong", "i", "em", "data", "span", "b", "sub", "a"].contains(&name);
        text.push_str(if inline { "" } else { " | " });
        text.push_str(rest);
    }
    text.replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&").replace('\u{a0}', " ")
}

const SUPERSCRIPTS: &str = "⁰¹²³⁴⁵⁶⁷⁸⁹";

/// `⁻⁷` at the start: value and number of characters.
fn power(rest: &[char]) -> Option<(i32, usize)> {
    let sign = usize::from(rest.first() == Some(&'⁻'));
    let digits: Vec<u32> =
        rest[sign..].iter().map_while(|c| SUPERSCRIPTS.chars().position(|s| s == *c).map(|p| p as u32)).collect();
    let value = digits.iter().fold(0, |v, d| 10 * v + *d as i32);
    (!digits.is_empty()).then_some((if sign == 1 { -value } else { value }, sign + digits.len()))
}

/// The numbers of a text. Digits within names (`S04a`, `m0`, `λ_s`) are none.
fn numbers_of(text: &str) -> Vec<Shown> {
    let c: Vec<char> = text.chars().collect();
    let digit = |i: usize| c.get(i).is_some_and(char::is_ascii_digit);
    let mut list = Vec::new();
    let mut i = 0;
    while i < c.len() {
        if !digit(i) {
            i += 1;
            continue;
        }
        let start = i;
        let named = start > 0
            && (c[start - 1].is_alphabetic()
                || ['_', '/', '.'].contains(&c[start - 1]) && !digit(start.wrapping_sub(2)));
        let mut word = String::new();
        while digit(i) || (c.get(i) == Some(&'\u{202f}') && digit(i + 1)) {
            word.extend(Some(c[i]).filter(char::is_ascii_digit));
            i += 1;
        }
        let mut decimals = 0;
        if c.get(i) == Some(&'.') && digit(i + 1) {
            word.push('.');
            i += 1;
            while digit(i) {
                word.push(c[i]);
                decimals += 1;
                i += 1;
            }
        }
        let mut exponent = 0;
        if c[i..].starts_with(&['×', '1', '0'])
            && let Some((e, n)) = power(&c[i + 3..])
        {
            (exponent, i) = (e, i + 3 + n);
        } else if word == "10"
            && let Some((e, n)) = power(&c[i..])
        {
            (exponent, i) = (e, i + n);
            word = "1".into();
        }
        // A letter at the end: a name, such as `2D`.
        if named || c.get(i).is_some_and(|l| l.is_alphabetic() || *l == '²') {
            continue;
        }
        let scale = 10f64.powi(exponent);
        let value: f64 = word.parse::<f64>().expect("digits") * scale;
        // Zeros at the end of a whole number of more than two digits may be rounded digits.
        let zeros = word.chars().rev().take_while(|z| *z == '0').count().min(word.len().saturating_sub(2));
        let rounded = if decimals == 0 { zeros as i32 } else { -decimals };
        let half = 0.5 * scale * 10f64.powi(rounded);
        let unit = unit_after(&c[i..]);
        let around: String = c[start.saturating_sub(40)..(i + 25).min(c.len())].iter().collect();
        list.push(Shown { value, half, unit, around });
    }
    list
}

/// The unit behind a number; of `8.1 ± 2.2 %` that behind the error.
fn unit_after(rest: &[char]) -> String {
    let text: String = rest.iter().take(60).collect();
    let text = match text.strip_prefix(" ± ") {
        Some(error) => error.trim_start_matches(|c: char| c.is_ascii_digit() || c == '.'),
        None => &text,
    };
    let word = text.trim_start_matches(')').strip_prefix(' ').unwrap_or("");
    word.chars().take_while(|c| c.is_alphabetic() || "%/²³⁻*°".contains(*c)).collect()
}

/// Factors from a stored number to the unit shown.
fn factors(unit: &str, results: &Results) -> Vec<f64> {
    let (length, modulus) = (results.scales.length_m, results.scales.modulus_pa);
    let block = results.atoms.as_ref().map(|a| (a.length_angstrom * 1e-10, a.modulus_gpa * 1e9));
    let lengths: Vec<f64> = [1.0, length, 1e-6, 1e-9, 1e-10].into_iter().chain(block.map(|b| b.0)).collect();
    let stresses: Vec<f64> = [1.0, modulus, 1e9, 1e6, 1e3].into_iter().chain(block.map(|b| b.1)).collect();
    let metres = |unit: &str| {
        let list = [("m", 1.0), ("mm", 1e-3), ("µm", 1e-6), ("nm", 1e-9), ("pm", 1e-12), ("fm", 1e-15), ("Å", 1e-10)];
        list.iter().find(|u| u.0 == unit).map(|u| u.1)
    };
    let pascals = |unit: &str| {
        let list = [("Pa", 1.0), ("kPa", 1e3), ("MPa", 1e6), ("GPa", 1e9), ("TPa", 1e12), ("mPa", 1e-3)];
        list.iter().find(|u| u.0 == unit).map(|u| u.1)
    };
    let newtons = [("N", 1.0), ("mN", 1e-3), ("µN", 1e-6), ("nN", 1e-9)];
    if unit == "%" {
        vec![100.0, 1.0]
    } else if let Some((_, n)) = newtons.iter().find(|u| u.0 == unit) {
        vec![1.0 / n]
    } else if let Some(m) = metres(unit) {
        lengths.iter().map(|l| l / m).collect()
    } else if let Some(m) = unit.strip_suffix('²').and_then(metres) {
        lengths.iter().map(|l| (l / m).powi(2)).collect()
    } else if let Some(p) = pascals(unit) {
        stresses.iter().map(|s| s / p).collect()
    } else if let Some((p, m)) = unit.split_once('/').and_then(|(p, m)| Some((pascals(p)?, metres(m)?))) {
        vec![m / p]
    } else if let Some(j) = [("J/m²", 1.0), ("mJ/m²", 1e-3), ("µJ/m²", 1e-6)].iter().find(|u| u.0 == unit) {
        vec![1.0 / j.1]
    } else {
        // Conductances over the cell's extent, and stiffnesses over E*/L.
        vec![1.0, 1.0 / length, length / modulus]
    }
}

/// Values that the page computes from stored numbers, in the units of stored numbers.
fn computed(results: &Results) -> Vec<f64> {
    let mut list = Vec::new();
    let total = |s: &State, q: Quantity| -> f64 {
        s.uncertainty.iter().filter(|u| u.quantity == q).filter_map(|u| u.relative).sum()
    };
    let comparison = results.comparison.as_ref();
    let matched = comparison.iter().flat_map(|c| {
        [Some(&c.hard_wall), Some(&c.compliant_wall), c.full_heights.as_ref(), c.yielding_wall.as_ref()]
            .into_iter()
            .flatten()
    });
    for c in results.continuum.iter().chain(&results.non_adhesive).chain(matched) {
        for s in &c.states {
            // Sums of the known components of the uncertainty, and with them the errors of area, gap and contact stress.
            let (area, gap) = (total(s, Quantity::ContactArea), total(s, Quantity::MeanGap));
            let pressure = s.observed.as_ref().and_then(|o| o.mean_contact_pressure).unwrap_or(0.0);
            list.extend([area, gap, area * s.contact_area, gap * s.mean_gap.unwrap_or(0.0), area * pressure]);
            // Work per unit area stated in mJ/m², and how much a range is enlarged.
            list.extend(s.hysteresis.as_ref().map(|_| 0.0));
        }
        list.extend(c.range.iter().flat_map(|r| [r.used / r.requested]));
        // The relative error of a force is that of its pressure.
        let of_force = c.pull_off.iter().filter_map(|p| Some(p.force? * p.relative_error()?));
        list.extend(of_force);
        list.push(c.states.len() as f64);
    }
    if let Some(c) = comparison {
        for load in &c.loads {
            list.extend(deviations(c.compliant_wall.states.as_slice(), load));
            list.extend(c.yielding_wall.iter().flat_map(|y| deviations(&y.states, load)));
        }
        // The contact stress of the elastic continuum at the surface sites.
        for (load, s) in c.loads.iter().zip(&c.compliant_wall.states) {
            list.extend(load.continuum.iter().map(|m| s.pressure / m.contact_area));
        }
    }
    // Deviations of the statistics of the surface from their expected values.
    for s in &results.surface.statistics {
        let expected = [s.expected, s.expected_on_grid].into_iter().flatten();
        list.extend(expected.filter(|e| *e != 0.0).map(|e| (s.realised - e).abs() / e.abs()));
    }
    if let Some(atoms) = &results.atoms {
        // The cell in nm, steps of the load path and by minimiser, rejected steps, force evaluations of all steps, the largest force.
        list.push(atoms.length_angstrom / 10.0);
        let (steps, turn) = (&atoms.load_steps, atoms.unloading.as_ref().map(|u| u.reversal_step));
        list.push(steps.len() as f64);
        list.extend(turn.iter().flat_map(|t| [(t + 1) as f64, (steps.len() - 1 - t) as f64]));
        list.push(steps.iter().map(|s| s.force_evaluations).sum::<usize>() as f64);
        list.push(steps.iter().map(|s| s.rejected).sum::<usize>() as f64);
        list.extend(StepMinimizer::ALL.map(|m| steps.iter().filter(|s| s.minimizer == m).count() as f64));
        list.extend(
            atoms
                .unloading
                .iter()
                .flat_map(|u| &u.changes)
                .filter(|c| c.contact_area_loading > 0.0)
                .map(|c| c.contact_area_unloading / c.contact_area_loading - 1.0),
        );
        list.extend(atoms.load_steps.iter().map(|s| s.max_force_ev_per_angstrom));
    }
    // Sums of the table of costs.
    list.push(results.warnings.len() as f64);
    list
}

/// Mean gaps along x = L/2 at the reference load and their errors, from the maps: figure 4 of the challenge.
fn line_means(folder: &Path, results: &Results) -> Vec<f64> {
    let states = results.continuum.iter().chain(&results.non_adhesive).flat_map(|c| &c.states);
    let stored = states
        .filter_map(|s| Some((s, asperity::surface::files::npy::NpyReader::open(&folder.join(s.gap_file()?)).ok()?)));
    let mut list = Vec::new();
    for (state, map) in stored {
        let (mut sum, middle, rows) = (0.0, map.nx / 2, map.ny as f64);
        map.for_each_row(|_, row| sum += row[middle]).expect("a map");
        let mean = sum / rows;
        let relative: f64 =
            state.uncertainty.iter().filter(|u| u.quantity == Quantity::MeanGap).filter_map(|u| u.relative).sum();
        list.extend([mean, mean * relative]);
    }
    list
}

/// Deviation of the atoms' contact from each criterion, the ratio, and their errors.
fn deviations(states: &[State], load: &LoadComparison) -> Vec<f64> {
    let near = |s: &&State| (s.p_star / load.p_star - 1.0).abs() < 0.01;
    let area: f64 = states.iter().find(near).map_or(0.0, |s| {
        s.uncertainty.iter().filter(|u| u.quantity == Quantity::ContactArea).filter_map(|u| u.relative).sum()
    });
    let of = |m: f64| {
        let ratio = load.atoms.contact_area / m;
        [ratio, ratio - 1.0, area * ratio, area * m]
    };
    load.continuum.iter().filter(|m| m.contact_area > 0.0).flat_map(|m| of(m.contact_area)).collect()
}

/// Numbers of the page that are neither stored nor computed from stored numbers.
fn unexplained(folder: &Path, page: &str) -> Vec<Shown> {
    let results = Results::read(folder).expect("results");
    let json: Value = serde_json::from_slice(&std::fs::read(folder.join(FILE)).expect("results.json")).expect("JSON");
    let (mut stored, mut texts) = (Vec::new(), Vec::new());
    leaves(&json, &mut stored, &mut texts);
    stored.extend(line_means(folder, &results));
    let costs: f64 = results.stages.iter().map(|s| s.seconds).sum();
    let mut text = text_of(page);
    // Times and sizes have formats of their own.
    let mut formats: Vec<String> = stored.iter().chain([&costs]).map(|v| duration(*v)).collect();
    formats.extend(stored.iter().filter(|v| **v >= 0.0).map(|v| memory(*v as u64)));
    formats.retain(|f| !f.ends_with("kB") && !f.starts_with('<'));
    formats.sort_by_key(|f| std::cmp::Reverse(f.len()));
    for (words, _) in WORDING {
        text = text.replace(words, " … ");
    }
    for f in formats.iter().map(|f| f.replace('\u{a0}', " ")) {
        text = text.replace(&format!("| {f} |"), "| |");
    }
    let quoted: Vec<Shown> = texts.iter().flat_map(|t| numbers_of(t)).collect();
    stored.extend(computed(&results));
    let holds = |n: &Shown| {
        let factors = factors(&n.unit, &results);
        stored.iter().any(|s| factors.iter().any(|f| ((s * f).abs() - n.value).abs() <= 1.0001 * n.half))
            || quoted.iter().any(|q| q.value == n.value && q.half == n.half)
    };
    numbers_of(&text).into_iter().filter(|n| !holds(n)).collect()
}

/// The numbers of a page without an origin, one line each.
fn complaints(folder: &Path, page: &str) -> Vec<String> {
    let line = |n: Shown| format!("{} ± {} {}: …{}…", n.value, n.half, n.unit, n.around.replace('\n', " "));
    unexplained(folder, page).into_iter().map(line).collect()
}

#[test]
fn every_number_of_the_page_is_in_the_results() {
    let folder = tempfile::tempdir().expect("scratch");
    crate::made_run::run_folder(folder.path());
    let page = crate::page(folder.path());
    assert!(numbers_of(&text_of(&page)).len() > 300);
    assert_eq!(complaints(folder.path(), &page), Vec::<String>::new());
    let run = crate::browser::challenge();
    assert_eq!(complaints(run, &crate::page(run)), Vec::<String>::new());
}

/// A wrong number is found: few changed numbers with three digits are by chance in the results.
#[test]
fn wrong_numbers_are_found() {
    let folder = tempfile::tempdir().expect("scratch");
    crate::made_run::run_folder(folder.path());
    let page = crate::page(folder.path());
    let three_digits = |n: &&Shown| n.value >= 100.0 * 2.0 * n.half;
    let list: Vec<Shown> = numbers_of(&text_of(&page)).iter().filter(three_digits).cloned().collect();
    let changed = |n: &Shown| {
        format!("<p>{:.*}\u{a0}{}</p>", (-(2.0 * n.half).log10()).round().max(0.0) as usize, 1.07 * n.value, n.unit)
    };
    let wrong: String = list.iter().map(changed).collect();
    let found = unexplained(folder.path(), &wrong).len();
    assert!(4 * found > 3 * list.len(), "{found} of {}", list.len());
    assert_eq!(complaints(folder.path(), "<p>26.6&nbsp;% of 3 loads at 12.345 nm</p>").len(), 2);
}

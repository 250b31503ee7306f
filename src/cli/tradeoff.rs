use super::{listen::Teller, words};
use crate::method::{self, ContactMethod, REGISTRY};
use crate::pipeline::{self, AskedOfLadder};
use crate::record::tradeoff::{Measure, Point, Tradeoff as Told};
use crate::report::number::{duration, error_of, memory, significant, trimmed};
use crate::scene::{ALL_METHODS, Case, Scene};
use crate::{Error, Result};
use std::path::PathBuf;
use std::process::ExitCode;

const PLACE: &str = "command line";

/// Most runs of a setting: more tell nothing more of its least cost.
const MOST_REPEATS: usize = 100;

#[derive(Debug, clap::Args)]
pub struct Tradeoff {
    /// Scene file (TOML): its surface, loads and adhesion.
    scene: PathBuf,
    /// Run folder. Default: runs/NAME-tradeoff with the scene's name.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Methods, ids from `asperity methods` apart by commas. Default: all.
    #[arg(long, value_name = "IDS", value_delimiter = ',', num_args = 1)]
    methods: Vec<String>,
    /// Points a side of the grids, apart by commas; each divides the reference's. Default: the scene's, its half and its quarter.
    #[arg(long, value_name = "LIST", value_delimiter = ',', num_args = 1)]
    grids: Vec<usize>,
    /// Points a side of the reference, `fast` in f64. Default: the scene's.
    #[arg(long, value_name = "N")]
    reference: Option<usize>,
    /// Instead of surface.seed.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Time for all settings, as 90s, 10m or 2h, those done before in this folder among them: the most telling come first, and
    /// what is left out is listed. The reference is solved in any case. Default: no limit.
    #[arg(long, value_name = "TIME")]
    budget: Option<String>,
    /// Thicknesses over L of bonded layers that stand for the scene's half-space, apart by commas: what a finite slab costs.
    #[arg(long, value_name = "LIST", value_delimiter = ',', num_args = 1)]
    slabs: Vec<f64>,
    /// Runs of each setting, of which the cheapest counts.
    #[arg(long, value_name = "N", default_value_t = 1)]
    repeats: usize,
    /// One line of JSON on stdout.
    #[arg(long)]
    json: bool,
}

impl Tradeoff {
    pub fn execute(self) -> Result<ExitCode> {
        let budget_seconds = self.budget.as_deref().map(|text| seconds("--budget", text)).transpose()?;
        if !(1..=MOST_REPEATS).contains(&self.repeats) {
            return Err(Error::input(PLACE, "--repeats", self.repeats, format!("1 to {MOST_REPEATS} runs")));
        }
        if let Some(t) = self.slabs.iter().find(|t| !(t.is_finite() && **t > 0.0)) {
            return Err(Error::input(PLACE, "--slabs", t, "thicknesses above zero, over the cell's length"));
        }
        let methods = methods(&self.methods)?;
        let mut scene = Scene::read(&self.scene)?;
        if let (Some(seed), Some(file)) = (self.seed, &scene.surface.heights) {
            let accepted = format!("none: {} has the heights", file.display());
            return Err(Error::input(PLACE, "--seed", seed, accepted));
        }
        scene.surface.seed = self.seed.unwrap_or(scene.surface.seed);
        let case = Case::resolve(scene, &self.scene)?;
        let out = self.out.unwrap_or_else(|| PathBuf::from("runs").join(format!("{}-tradeoff", case.scene.name)));
        let asked = AskedOfLadder {
            methods,
            grids: (!self.grids.is_empty()).then_some(self.grids),
            reference: self.reference,
            budget_seconds,
            repeats: self.repeats,
            exact: None,
            slabs: self.slabs,
        };
        let teller = Teller::new();
        let (told, page) = pipeline::tradeoff(&case, &asked, &out, &teller)?;
        drop(teller);
        if self.json {
            words::json_line(&serde_json::json!({ "out": out, "report": page, "tradeoff": told }))?;
        } else {
            say(&told);
            words::say(&format!("report: {}", page.display()));
        }
        Ok(ExitCode::SUCCESS)
    }
}

/// Methods of the registry by their ids, in its order.
fn methods(ids: &[String]) -> Result<Vec<&'static dyn ContactMethod>> {
    for id in ids {
        if id != ALL_METHODS && method::find(id).is_none() {
            let accepted = format!("{}, or {ALL_METHODS}", method::ids().join(", "));
            return Err(Error::input(PLACE, "--methods", id, accepted));
        }
    }
    let all = ids.is_empty() || ids.iter().any(|id| id == ALL_METHODS);
    let wanted = |id: &str| all || ids.iter().any(|w| method::find(w).is_some_and(|m| m.card().id == id));
    Ok(REGISTRY.iter().copied().filter(|m| wanted(m.card().id)).collect())
}

/// A time as people write it, in s.
pub fn seconds(flag: &str, text: &str) -> Result<f64> {
    let text = text.trim();
    let digits = text.trim_end_matches(char::is_alphabetic);
    let unit = match &text[digits.len()..] {
        "s" | "" => Some(1.0),
        "ms" => Some(1e-3),
        "m" | "min" => Some(60.0),
        "h" => Some(3600.0),
        _ => None,
    };
    let found = unit.zip(digits.trim().parse::<f64>().ok()).map(|(unit, n)| unit * n);
    found
        .filter(|s| s.is_finite() && *s > 0.0)
        .ok_or_else(|| Error::input(PLACE, flag, text, "a time above zero, as 0.5s, 30s, 10m or 2h"))
}

/// The table on stdout: what each setting took and erred by.
fn say(told: &Told) {
    for r in &told.references {
        let s = &r.setting;
        let which = if told.references.len() == 1 {
            ""
        } else if s.adhesive {
            ", with adhesion"
        } else {
            ", without adhesion"
        };
        words::say(&format!(
            "reference{which}: {} on {} x {} points, {} to {:e}: {} CPU",
            s.method,
            s.nx,
            s.ny,
            s.precision,
            s.tolerance,
            duration(r.cost.cpu_seconds)
        ));
        let told: Vec<String> = Measure::ALL
            .iter()
            .filter_map(|m| r.uncertainty.get(m).map(|u| format!("{} {}", m.name(), error_of(*m, *u))))
            .collect();
        words::say(&format!("  uncertain by: {}", if told.is_empty() { "not known".into() } else { told.join(", ") }));
    }
    const COLUMNS: [Measure; 5] =
        [Measure::ContactArea, Measure::MeanGap, Measure::GapMap, Measure::ContactMap, Measure::TypicalPatch];
    let head =
        ["method", "grid", "to", "CPU", "of ref.", "memory", "area", "mean gap", "gap map", "contact map", "patch"];
    let row = |p: &Point| {
        let s = &p.setting;
        let mut cells = vec![
            match s.slab {
                Some(t) => format!("{} (layer of {} L)", s.method, trimmed(t, 3)),
                None if p.is_reference => format!("{} (reference)", s.method),
                None => s.method.clone(),
            },
            s.nx.to_string(),
            format!("{} {}", s.precision, trimmed(s.tolerance, 2)),
            duration(p.cost.cpu_seconds),
            significant(p.cost.of_reference, 2),
            memory(p.cost.measured_bytes),
        ];
        cells.extend(COLUMNS.map(|m| p.errors.get(&m).map_or("-".into(), |e| error_of(m, *e))));
        cells
    };
    words::say(&words::table(&head, told.points.iter().filter(|p| p.refusal.is_none()).map(row)));
    let mut refused: Vec<(&str, &str)> = Vec::new();
    for p in &told.points {
        if let Some(why) = p.refusal.as_deref().filter(|w| !refused.contains(&(&p.setting.method, w))) {
            refused.push((&p.setting.method, why));
            words::say(&format!("{} tells nothing: {why}", p.setting.method));
        }
    }
    for l in &told.left_out {
        let s = &l.setting;
        words::say(&format!("left out: {} on {}, {} to {:e}: {}", s.method, s.nx, s.precision, s.tolerance, l.reason));
    }
    told.warnings.iter().for_each(|w| words::say(&format!("warning: {w}")));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_units() {
        for (text, expected) in [("10m", 600.0), ("0.1s", 0.1), ("2h", 7200.0), ("90", 90.0), ("250ms", 0.25)] {
            assert!(seconds("--budget", text).is_ok_and(|s| (s / expected - 1.0f64).abs() < 1e-12), "{text}");
        }
        for text in ["", "m", "-3s", "0s", "10 parsecs", "inf", "NaN"] {
            assert_eq!(seconds("--budget", text).err().map(|e| e.exit_code()), Some(2), "{text}");
        }
    }
}

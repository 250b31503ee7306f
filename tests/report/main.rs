//! The report of a synthetic run: complete, self-contained, and consistent with `results.json`.

mod browser;
mod made_run;
mod numbers;
#[path = "../common/program.rs"]
mod program;
#[path = "../common/tools.rs"]
mod tools;

use std::path::{Path, PathBuf};

use asperity::atoms::results::*;
use asperity::contact::load::{Branch, Stop};
use asperity::contact::observe::{Distribution, linear_edges};
use asperity::contact::state::*;
use asperity::record::given_loads::{GivenLoads, LoadQuantity};
use asperity::record::results::*;
use asperity::report::{self, PrintedFigures, ReportOptions};
use asperity::surface::files::npy;
use made_run::{LABORATORY, grid, height, run_folder, store};

#[test]
fn the_unloading_branch_and_the_pull_off_of_the_atoms_are_shown() {
    let folder = kept("way-back");
    let mut results = run_folder(&folder);
    let atoms = results.atoms.as_mut().expect("atoms");
    atoms.unloading = Some(Unloading {
        reversal_step: 14,
        states: Vec::new(),
        changes: vec![BranchChange {
            p_star: 0.01,
            contact_area_loading: 0.1,
            contact_area_unloading: 0.125,
            mean_gap_angstrom: -0.0432,
        }],
        separated: Some(true),
        pull_off: Some(AtomPullOff {
            step: 21,
            force_ev_per_angstrom: -0.5,
            error_ev_per_angstrom: 0.012,
            force_nn: -0.8011,
            p_star: -0.0034,
            displacement_angstrom: 0.15,
            step_angstrom: 0.075,
            contacts: 5,
        }),
    });
    results.write(&folder).unwrap();
    let page = page(&folder);
    for text in ["in 15 steps and rises in 10", "0.8011 nN", "0.5000 ± 0.012", "25.0", "−0.0432"] {
        assert!(page.contains(text), "{text}");
    }
    for figure in ["unloading-contacts.svg", "load-steps-load.svg"] {
        assert!(folder.join("figures").join(figure).is_file(), "{figure}");
    }
}

/// Kept under `target/tmp` after the test, for inspection.
fn kept(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("report").join(name)
}

fn page(folder: &Path) -> String {
    std::fs::read_to_string(report::write(folder).unwrap()).unwrap()
}

#[test]
fn a_full_report_is_complete_and_self_contained() {
    let folder = kept("full");
    run_folder(&folder);
    let page = page(&folder);
    for (attribute, allowed) in [("src=\"", "nothing has one"), ("href=\"", "#")] {
        for value in page.split(attribute).skip(1) {
            let value = &value[..value.find('"').unwrap()];
            let inside = value.starts_with(allowed) || value.starts_with("data:image/png;base64,");
            assert!(inside || value.starts_with("https://doi.org/"), "{value}");
        }
    }
    assert!(!page.contains("<link") && !page.replace("url(#", "").contains("url(") && !page.contains("@import"));
    assert!(page.contains("A made-up &lt;run&gt;"));
    assert!(
        page.contains(">sealed<") && page.contains("along x and y") && page.contains("0.123") && page.contains("0.345")
    );
    for anchor in ["surface", "loads", "distributions", "atoms", "comparison", "area", "findings", "costs", "sources"] {
        assert!(page.contains(&format!("<section id=\"{anchor}\">")), "{anchor}");
    }
    // Height map and view in three dimensions, two contact maps, gaps and stresses; per load of the comparison four contact panels and three gap
    // panels. Each has axes, and all but contact maps a colour bar.
    // The first screen has three maps.
    assert_eq!(page.matches("<image ").count(), 3 + 2 + 6 + 2 * (4 + 3));
    assert_eq!(page.matches(">x (µm)<").count(), 7);
    assert_eq!(page.matches(">x (nm)<").count(), 3 + 2 * (4 + 3));
    assert_eq!(page.matches("<linearGradient id=").count(), 1 + 4 + 2 * 3);
    assert!(
        page.contains("below 0.170")
            && page.contains("work γ = 50.00")
            && page.contains("2.070\u{a0}nm requested, 8.280")
    );
    assert!(page.contains(", loading") && page.contains(", unloading"));
    assert!(page.contains(">unloading<") && page.contains(">2.34") && page.contains("enlarged 4.00 times"));
    // The grid contributes three quarters of the known uncertainty of the area; unknown contributions are named.
    assert!(page.contains("width:75.000%") && page.contains("not known") && page.contains("Contact area, 3.12"));
    assert!(page.contains("3.34") && page.contains("a tensile stress of at most"));
    assert!(page.contains("outside the band") && page.contains("within the band"));
    // Base64 data of images and maps may contain any three letters.
    let pieces = page.split("<script type=\"application/json\"").enumerate();
    let outside = pieces.map(|(k, piece)| if k == 0 { piece } else { piece.split_once("</script>").unwrap().1 });
    let words = outside.flat_map(|piece| piece.split('"'));
    assert!(words.filter(|part| !part.starts_with("data:")).all(|part| !part.contains("NaN")));
    for figure in [
        "heights.png",
        "psd.svg",
        "area.svg",
        "load-steps-load.svg",
        "section-2.svg",
        "superposed-2.png",
        "gap-1.png",
        "gap-1.svg",
        "contact-2.svg",
        "mean-gap.svg",
        "pull-off.svg",
        "gap-distribution.svg",
        "stress-distribution.svg",
        "cluster-sizes.svg",
        "cluster-area.svg",
    ] {
        assert!(folder.join("figures").join(figure).exists(), "{figure}");
    }
    assert!(std::fs::read_dir(&folder).unwrap().all(|f| !f.unwrap().file_name().to_string_lossy().starts_with('.')));
}

/// A distribution of equal fractions.
fn even(to: f64) -> Distribution {
    Distribution { edges: linear_edges(0.0, to, 10), fractions: vec![0.09; 10], delta: 0.1, below: 0.0, above: 0.0 }
}

#[test]
fn criteria_model_chain_and_yield_are_shown() {
    let folder = kept("atoms");
    let mut results = run_folder(&folder);
    let atoms = results.atoms.as_mut().unwrap();
    for (i, state) in atoms.states.iter_mut().enumerate() {
        let way = |id: &str, share: f64| ContactByCriterion {
            id: id.into(),
            criterion: format!("what is {id}"),
            atoms: 77,
            contact_area: share,
        };
        state.criteria = vec![way("distance", 0.1), way("voronoi_area", 0.0981)];
        let map = store(&folder, &format!("atoms-stress-{i}.npy"), &grid(|x, y| 3.0 * height(x, y).max(0.0))).unwrap();
        state.stress = Some(AtomStress { width_angstrom: 5.5884, load_error: 2e-16, highest_gpa: 4.321, map });
        state.defects = Some(DefectAtoms { atoms: 19 * i, volume_nm3: 0.83 * i as f64 });
    }
    atoms.plasticity = Some(PlasticityResults {
        atoms: 170_000,
        masked_layers: 2,
        threshold: 0.06,
        noise_atoms: 3,
        steps: vec![[0.0, 0.0], [0.0137, 5.0], [0.02, 19.0]],
        first_yield: Some(0.0137),
        last_elastic: Some(0.0),
        layers_above_base: Some(7),
        hardness_gpa: Some(2.417),
    });
    let comparison = results.comparison.as_mut().unwrap();
    for load in &mut comparison.loads {
        let version = |(id, fraction): (&&str, f64)| ModelChainStep {
            id: (*id).into(),
            criterion: "some".into(),
            contact_area: fraction,
            mean_gap_angstrom: 9.2,
            contact_stress_gpa: Some(5.1),
            clusters: 12,
            median_cluster_area_nm2: Some(3.3),
            cluster_area: vec![[1.0, 0.3], [3.3, 1.0]],
            gap: even(20.0),
            stress: even(8.0),
        };
        let ids = ["full_heights", "hard_wall", "offset_wall", "compliant_wall", "atoms"];
        load.model_chain = ids.iter().zip([0.03, 0.05, 0.08, 0.07, 0.09]).map(version).collect();
        load.area_vs_distance =
            (0..15).map(|k| 3.83 + 0.04 * f64::from(k)).map(|d| [d, d - 3.8, d - 3.82, d - 3.83]).collect();
        load.area_vs_gap =
            (0..15).map(|k| 0.04 * f64::from(k) - 0.2).map(|d| [d, d.max(0.0), 0.3 * (d + 0.2)]).collect();
    }
    results.write(&folder).unwrap();
    let page = page(&folder);
    assert!(
        page.contains("what is voronoi_area")
            && page.contains("9.81")
            && page.contains("5.588 Å")
            && page.contains("4.32 GPa")
    );
    assert!(page.contains("first yields at p* = <strong>0.0137</strong>") && page.contains("2.42 GPa"));
    // E* of the atoms and where it is from come before the scales of the laboratory, which may be defaults.
    assert!(
        page.contains("GPa, that of the crystal of their potential (")
            && page.contains("[laboratory] of the scene or its")
    );
    assert!(page.contains(">first yield<") && page.contains("full heights, zero gap"));
    for figure in [
        "plasticity",
        "stress-atoms-2",
        "model-chain-area",
        "model-chain-stress-1",
        "area-vs-distance-2",
        "area-vs-gap-1",
    ] {
        assert!(folder.join(format!("figures/{figure}.svg")).exists(), "{figure}");
    }
}

/// Every figure of the paper has a claim with a value and its error, or the reason why this grid has none.
#[test]
fn figures_of_the_paper_have_claims_with_errors() {
    let page = page(browser::challenge());
    let captions: Vec<&str> = (1..=12)
        .map(|n| {
            let end = page.find(&format!("(The paper’s figure {n}.)")).unwrap_or_else(|| panic!("no figure {n}"));
            page[end..].split("</figcaption>").next().unwrap()
        })
        .collect();
    let claims =
        |c: &&&str| c.contains("expected") || c.contains("not assessed") || c.contains("Mean gap along this line");
    assert_eq!(captions.iter().filter(claims).count(), 12, "{captions:#?}");
    let errors = |c: &&&str| c.contains(" ± ") || c.contains("(exact)");
    assert!(captions.iter().filter(errors).count() >= 9, "{captions:#?}");
    assert!(captions.iter().all(|c| errors(&c) || c.contains("not assessed")), "{captions:#?}");
    assert!(!page.contains("</strong>; the paper "));
}

/// With a solution with hardness the first screen compares elastic continuum, continuum with hardness and atoms.
#[test]
fn what_a_hardness_explains_is_on_the_first_screen() {
    let folder = kept("hardness");
    let mut results = run_folder(&folder);
    let comparison = results.comparison.as_mut().unwrap();
    let mut wall = comparison.compliant_wall.clone();
    wall.hardness = Some(4.5e9);
    comparison.yielding_wall = Some(wall);
    let set = |results: &mut Results, elastic: f64, hard: f64| {
        for load in &mut results.comparison.as_mut().unwrap().loads {
            let mut with = load.continuum[2].clone();
            load.continuum[2].contact_area = elastic * load.atoms.contact_area;
            (with.id, with.contact_area) = ("yielding_wall".into(), hard * load.atoms.contact_area);
            with.overlap.kappa = 0.9123;
            load.continuum.truncate(3);
            load.continuum.push(with);
        }
        results.write(&folder).unwrap();
        page(&folder).replace('\u{a0}', " ")
    };
    let text = set(&mut results, 0.5, 0.98);
    let first = text.split("id=\"contents\"").next().unwrap();
    assert!(first.contains("up to 100 % more"), "{}", &first[first.find("class=\"found\"").unwrap()..][..900]);
    assert!(first.contains("hardness explains it") && first.contains("hardness of 4.50 GPa"));
    for title in ["Elastic continuum: ", "Continuum with hardness: ", "Atoms: "] {
        assert_eq!(first.matches(&format!("<div class=\"panel-title\">{title}")).count(), 1, "{title}");
    }
    assert!(first.contains("with hardness; elastic 0.83") && first.contains(">0.91<"));
    assert!(text.contains("compliant wall with hardness") && !text.contains(">yielding_wall"));
    assert!(set(&mut results, 0.8, 0.7).contains("hardness does not explain it"));
    run_folder(&folder);
}

/// All numbers of a JSON value.
fn numbers_of(value: &serde_json::Value, found: &mut Vec<f64>) {
    match value {
        serde_json::Value::Number(n) => found.extend(n.as_f64()),
        serde_json::Value::Array(list) => list.iter().for_each(|v| numbers_of(v, found)),
        serde_json::Value::Object(map) => map.values().for_each(|v| numbers_of(v, found)),
        _ => (),
    }
}

/// The numbers of the first screen carry the value of `results.json` that they show.
#[test]
fn numbers_of_the_first_screen_are_in_the_results() {
    let folder = tempfile::tempdir().unwrap();
    let mut results = run_folder(folder.path());
    for comparison in [true, false] {
        if !comparison {
            (results.atoms, results.comparison) = (None, None);
            results.write(folder.path()).unwrap();
        }
        let page = page(folder.path());
        if comparison {
            let loads = &results.comparison.as_ref().expect("compared").loads;
            let off = |l: &LoadComparison| {
                let continuum = l.continuum.iter().find(|m| m.id == "compliant_wall").expect("compliant wall");
                (l.atoms.contact_area / continuum.contact_area - 1.0).abs()
            };
            let worst = loads.iter().max_by(|a, b| off(a).total_cmp(&off(b))).expect("loads").p_star;
            assert!(page.contains(&format!("differ most at p* = {worst}, where the atoms have ")), "{worst}");
            assert!(page.contains("of the continuum; ± is the continuum’s"));
        }
        let mut stored = Vec::new();
        let json = std::fs::read_to_string(folder.path().join(FILE)).unwrap();
        numbers_of(&serde_json::from_str(&json).unwrap(), &mut stored);
        let shown: Vec<f64> =
            page.split("<data value=\"").skip(1).map(|rest| rest[..rest.find('"').unwrap()].parse().unwrap()).collect();
        assert_eq!(shown.len(), if comparison { 3 } else { 4 });
        assert!(shown.iter().all(|v| stored.contains(v)), "{shown:?}");
    }
}

/// Figures for papers: one width and one type size, axes with quantity and unit, data and a script for each.
#[test]
fn figures_for_papers_have_one_width_and_one_type_size() {
    let folder = kept("printed");
    run_folder(&folder);
    let printed = PrintedFigures { width_mm: 84.0, svg: true, pdf: true };
    let figures = printed.folder(&folder);
    let options = ReportOptions { printed: Some(printed), ..ReportOptions::default() };
    report::write_with(&folder, &options).unwrap();
    let mut drawn = 0;
    for file in std::fs::read_dir(&figures).unwrap() {
        let path = file.unwrap().path();
        if path.extension().is_none_or(|e| e != "svg") {
            continue;
        }
        drawn += 1;
        let svg = std::fs::read_to_string(&path).unwrap();
        assert!(svg.contains("width=\"84mm\"") && svg.matches("font-size=\"8\"").count() == 1, "{}", path.display());
        assert_eq!(svg.matches("font-size").count(), 1, "{}", path.display());
        let pdf = std::fs::read(path.with_extension("pdf")).unwrap();
        let holds = |part: &[u8]| pdf.windows(part.len()).any(|w| w == part);
        assert!(pdf.starts_with(b"%PDF") && holds(b"/FontFile"), "{}: no embedded font", path.display());
        assert!(path.with_extension("csv").is_file() && path.with_extension("py").is_file());
    }
    assert!(drawn > 30, "{drawn}");
    let psd = std::fs::read_to_string(figures.join("psd.csv")).unwrap();
    assert!(psd.starts_with("curve,wave number q (1/m),C(q) (m⁴),standard error\n"), "{psd}");
    // Mode 1 of a cell of 0.1 mm: q = 2π/L; 10⁻⁵ L² per mode times the area of the cell.
    assert!(psd.contains("\nexpected,62831.8530717958"), "{psd}");
    let sizes = std::fs::read_to_string(figures.join("cluster-sizes.csv")).unwrap();
    // The counting error of a single cluster is its density, and is left out.
    assert!(sizes.lines().skip(1).all(|line| line.split(',').nth(3).unwrap().parse::<f64>().map_or(true, |e| e > 0.0)));
    assert!(sizes.lines().skip(1).any(|line| line.ends_with(',')), "{sizes}");
    let python = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/python/bin/python");
    if !python.is_file() {
        return tools::skip("python", "target/python is not installed; scripts/setup.sh --tests installs it");
    }
    for name in ["area", "cluster-sizes", "gap-1", "relief", "superposed-2"] {
        let output = std::process::Command::new(&python).arg(figures.join(format!("{name}.py"))).output().unwrap();
        assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
        assert!(std::fs::read(figures.join(format!("{name}-redrawn.pdf"))).unwrap().starts_with(b"%PDF"));
    }
}

/// Maps of one quantity have one colour range over the loads, unless requested otherwise.
#[test]
fn loads_share_a_colour_range() {
    let folder = tempfile::tempdir().unwrap();
    run_folder(folder.path());
    let ends = |own_ranges| {
        let options = ReportOptions { own_ranges, printed: None };
        report::write_with(folder.path(), &options).unwrap();
        ["gap-1", "gap-2"].map(|name| {
            let svg = std::fs::read_to_string(folder.path().join(format!("figures/{name}.svg"))).unwrap();
            svg[svg.find("</linearGradient>").unwrap()..].replace(name, "").replace("≥ ", "")
        })
    };
    let [first, second] = ends(false);
    assert_eq!(first, second);
    let [first, second] = ends(true);
    assert_ne!(first, second);
}

#[test]
fn numbers_come_from_the_results() {
    let folder = tempfile::tempdir().unwrap();
    let mut results = run_folder(folder.path());
    let before = page(folder.path());
    assert_eq!(before, page(folder.path()), "the same results give the same page");
    assert!(!before.contains("κ = 0.42"));
    results.comparison.as_mut().unwrap().loads[1].continuum[2].overlap.kappa = 0.4199;
    results.write(folder.path()).unwrap();
    assert!(page(folder.path()).contains("κ = 0.42"));
}

/// The stiffness of the whole cell, its area times that of an area, over E* and the extent: half as much on half of the area.
#[test]
fn conductance_from_stiffness_is_that_of_the_area_of_the_cell() {
    let folder = tempfile::tempdir().unwrap();
    let mut results = run_folder(folder.path());
    (results.atoms, results.comparison) = (None, None);
    let [length, modulus] = LABORATORY;
    for state in &mut results.continuum.as_mut().unwrap().states {
        state.stiffness = Some(0.8642 * modulus / length);
    }
    for (aspect, shown, other) in [(1.0, "0.864", "0.432"), (0.5, "0.432", "0.864")] {
        results.surface.aspect = aspect;
        results.write(folder.path()).unwrap();
        let page = page(folder.path());
        let of = |number: &str| page.contains(&format!(">{number}<"));
        assert!(of(shown) && !of(other), "aspect {aspect}");
    }
}

/// The summary names the lowest and the highest load of a loading and unloading path, and both branches at equal loads.
#[test]
fn a_loading_cycle_is_described_by_its_extremes() {
    let folder = tempfile::tempdir().unwrap();
    let mut results = run_folder(folder.path());
    (results.atoms, results.comparison) = (None, None);
    let c = results.continuum.as_mut().unwrap();
    let of = |p_star: f64, area: f64, branch: Branch| State {
        mean_gap: Some((0.01 - 0.1 * p_star) * 1e-4),
        p_star,
        contact_area: area,
        branch,
        ..c.states[0].clone()
    };
    let (up, down) = (Branch::Loading, Branch::Unloading);
    c.states = vec![of(0.01, 0.05, up), of(0.04, 0.22, up), of(0.01, 0.08, down), of(0.002, 0.03, down)];
    c.pull_off = None;
    c.pull_off_failure = Some("fast stopped".into());
    results.write(folder.path()).unwrap();
    let page = page(folder.path()).replace('\u{a0}', " ");
    let text = "At p* = 0.002 to 0.04 the mean gap is 980 nm to 600 nm and the contact 3.00 % to 22.0 % (± 3.12 % of it \
                or less); at p* = 0.01 it is 5.00 % on loading and 8.00 % on unloading";
    assert!(page.contains(text), "{}", &page[page.find("class=\"found\"").unwrap()..][..600]);
    let tile = "<data value=\"0.22\">22.00</data><span class=\"error\"> ± 0.69 % of the cell</span>";
    assert!(page.contains(tile), "{}", &page[page.find("div class=\"tiles\"").unwrap()..][..900]);
    let curves = std::fs::read_to_string(folder.path().join("figures/mean-gap.svg")).unwrap();
    assert!(curves.contains(", loading") && curves.contains(", unloading") && curves.contains("mean gap (nm)"));
}

/// A detached state has no results, and modes without power have no point in the spectrum.
#[test]
fn meaningless_values_are_omitted() {
    let folder = tempfile::tempdir().unwrap();
    let mut results = run_folder(folder.path());
    (results.atoms, results.comparison) = (None, None);
    let points = |folder: &Path| {
        let psd = std::fs::read_to_string(folder.join("figures/psd.svg")).unwrap();
        (psd.matches("class=\"mark\"").count(), psd.contains("10⁻³⁰"))
    };
    page(folder.path());
    // Points of modes 1 to 49, and one in the legend.
    assert_eq!(points(folder.path()), (50, false));
    let c = results.continuum.as_mut().unwrap();
    c.states[1].stop = Stop::Detached;
    c.states[1].load_error = 123.0;
    results.surface.periodic = false;
    results.surface.note = "Heights that do not repeat.".into();
    results.write(folder.path()).unwrap();
    let page = page(folder.path());
    assert!(page.contains(">detached<") && !page.contains(">123<") && page.contains("<td>–</td>"));
    assert!(page.contains("over a non-periodic area") && page.contains("Heights that do not repeat."));
    assert!(!page.contains("periodic cell of"));
}

/// Pressures of a scene name the loads of its atoms, too: in sentences, tables, titles and axes.
#[test]
fn loads_of_atoms_are_named_as_they_were_given() {
    let folder = kept("pressures");
    let mut results = run_folder(&folder);
    results.loads = GivenLoads { quantity: LoadQuantity::Pressure, of_p_star: 2e8, imposed: None };
    results.write(&folder).unwrap();
    let page = page(&folder);
    let atoms = page.split("<section id=\"atoms\">").nth(1).unwrap().split("<section id=\"costs\">").next().unwrap();
    assert!(!atoms.contains("p* = ") && !atoms.contains(">p*<") && atoms.contains("<th>pressure</th>"), "{atoms}");
    assert!(
        atoms.contains("Maps at 2\u{a0}MPa") && page.contains("Here p* = 1 is 200\u{a0}MPa at the laboratory scale")
    );
    let axis = |name: &str| std::fs::read_to_string(folder.join("figures").join(name)).unwrap();
    assert!(axis("load-steps-load.svg").contains("mean pressure (MPa)"));
}

/// Waves of nothing but the rounding of heights in single precision do not stretch the axis of the spectrum.
#[test]
fn rounding_is_not_in_the_spectrum() {
    let folder = kept("rounding");
    let mut results = run_folder(&folder);
    let drawn = || {
        page(&folder);
        std::fs::read_to_string(folder.join("figures/psd.svg")).unwrap()
    };
    let without = drawn();
    let largest = results.surface.psd.iter().map(|p| p.realised).fold(0.0, f64::max);
    let rounding = |mode| PsdPoint { mode, realised: 1e-17 * largest, expected: None };
    results.surface.psd.extend([70.0, 80.0].map(rounding));
    results.write(&folder).unwrap();
    assert!(drawn() == without);
    results.surface.psd.push(PsdPoint { realised: 1e-12 * largest, ..rounding(90.0) });
    results.write(&folder).unwrap();
    assert!(drawn() != without);
}

#[test]
fn parts_that_were_not_run_are_left_out() {
    let folder = kept("continuum-only");
    let mut results = run_folder(&folder);
    (results.atoms, results.comparison) = (None, None);
    results.write(&folder).unwrap();
    let text = page(&folder);
    assert!(text.contains("id=\"loads\"") && text.contains("id=\"area\""));
    assert!(!text.contains("id=\"atoms\"") && !text.contains("Jaccard"));
    results.continuum = None;
    (results.stages, results.sources, results.warnings) = (vec![], vec![], vec![]);
    results.write(&folder).unwrap();
    let text = page(&folder);
    assert!(text.contains("id=\"surface\"") && !text.contains("id=\"area\"") && !text.contains("Warnings"));
    run_folder(&folder);
}

#[test]
fn an_unconverged_state_is_marked() {
    let folder = tempfile::tempdir().unwrap();
    let mut results = run_folder(folder.path());
    results.continuum.as_mut().unwrap().states[1].stop = Stop::IterationLimit;
    results.write(folder.path()).unwrap();
    let text = page(folder.path());
    assert!(text.contains("iteration limit") && text.contains("(not converged)") && text.contains(">not converged<"));
}

#[test]
fn what_is_missing_or_damaged_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let says = |expected: &[&str]| {
        let message = report::write(folder.path()).unwrap_err().to_string();
        assert!(expected.iter().all(|e| message.contains(e)), "{message}");
    };
    says(&["not a run folder", "results.json and manifest.json are missing"]);
    let path = folder.path().join("results.json");
    std::fs::write(&path, "{\"schema\": 99, \"new\": []}").unwrap();
    says(&["results.json", "schema 99", "accepted: schema 7"]);
    std::fs::write(&path, "{\"name\": 1}").unwrap();
    says(&["results.json", "schema"]);
    std::fs::write(&path, "{\"schema\": 7, \"name\": 1}").unwrap();
    says(&["results.json", "line 1"]);

    let mut results = run_folder(folder.path());
    std::fs::remove_file(folder.path().join("atoms-gap-2.npy")).unwrap();
    says(&["atoms-gap-2.npy"]);
    npy::write(&folder.path().join("contact-1.npy"), 8, 8, [1_u8; 64]).unwrap();
    says(&["contact-1.npy", "8 × 8"]);
    results.surface.heights = Some("/etc/hostname".into());
    results.write(folder.path()).unwrap();
    says(&["/etc/hostname", "inside the run folder"]);
    results.surface.heights = Some("heights.npy".into());
    results.surface.nx = 128;
    results.write(folder.path()).unwrap();
    says(&["heights.npy", "another shape"]);
    results.scales.length_m = f64::NAN;
    assert!(results.write(folder.path()).unwrap_err().to_string().contains("not finite"));
}

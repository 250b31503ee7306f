//! The report in a real browser: it loads completely, answers to pointer and keyboard, has no serious accessibility fault, prints,
//! and needs neither network nor JavaScript.
//!
//! `scripts/setup.sh --tests` installs Chromium and axe-core. A script of the test is appended to the page and writes what
//! it found into the title.

use crate::made_run::run_folder;
use crate::program::{asperity, json_line, stderr};
use crate::tools;
use asperity::report;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::LazyLock;

/// Loads all images of the page, including those inside drawings, and writes their number and the failures into the
/// title.
const WHOLE: &str = r#"
const all = [...document.querySelectorAll("img, image")].map(e => e.getAttribute("src") || e.getAttribute("href"));
const load = source => new Promise(done => {
  const picture = new Image();
  picture.onload = () => done(picture.naturalWidth > 0 ? "" : "empty");
  picture.onerror = () => done(String(source).slice(0, 60));
  picture.src = source;
});
const blank = [...document.querySelectorAll("svg")].filter(s => !s.closest("details:not([open])") && !s.matches("canvas + svg") && s.getBoundingClientRect().height < 20).length;
const wide = document.documentElement.scrollWidth > document.documentElement.clientWidth + 1;
Promise.all(all.map(load)).then(results => {
  const failed = results.filter(r => r);
  document.title = `pictures ${all.length} failed ${failed.length} blank ${blank} wide ${wide} ${failed.join(" ")}`;
});
"#;

/// Uses everything that answers, and writes one word per finding into the title.
const USED: &str = r#"
(async () => {
  const wait = () => new Promise(done => setTimeout(done, 300));
  const found = [];
  const check = (name, holds) => found.push(`${name}=${Boolean(holds)}`);
  const root = document.getElementById("explorer");
  const canvases = () => [...root.querySelectorAll(".view canvas")];
  const pixels = () => canvases().map(c => c.toDataURL());
  const changed = (a, b) => a.filter((v, i) => v !== b[i]).length;
  const key = (element, name, more = {}) => element.dispatchEvent(new KeyboardEvent("keydown", { key: name, bubbles: true, cancelable: true, ...more }));
  const point = (element, kind, x, y) => {
    const box = element.getBoundingClientRect();
    element.dispatchEvent(new PointerEvent(kind, { clientX: box.left + x, clientY: box.top + y, pointerId: 1, bubbles: true }));
  };
  Element.prototype.setPointerCapture = () => {}; // there is no real pointer to capture
  await wait();
  check("three", canvases().length === 3);
  let before = pixels();
  const load = document.getElementById("load");
  load.value = 0;
  load.dispatchEvent(new Event("input"));
  await wait();
  check("slider", changed(before, pixels()) >= 2 && root.querySelector("output[for=load]").textContent === "p* = 0.01");
  const [canvas] = canvases();
  point(canvas, "pointermove", 150, 100);
  await wait();
  check("value", /x = [\d.]+ nm, y = [\d.]+ nm · .*gap −?[\d.e-]+ Å/.test(document.getElementById("readout").textContent));
  point(canvas, "pointerleave", 0, 0);
  await wait();
  before = pixels();
  key(canvas, "+");
  await wait();
  check("zoom", changed(before, pixels()) === 3 && root.dataset.drawn.split(" ")[2] === "0.8");
  before = pixels();
  key(canvas, "ArrowLeft", { shiftKey: true });
  await wait();
  check("pan", changed(before, pixels()) === 3);
  key(canvas, "0");
  key(canvas, "ArrowRight");
  await wait();
  check("keyboard", /x = /.test(document.getElementById("readout").textContent));
  const profile = root.querySelector("canvas.profile");
  before = [profile.toDataURL()];
  const inner = canvas.clientHeight - 36; // below: labels of the axis
  point(canvas, "pointerdown", 150, 6 + inner / 2);
  point(canvas, "pointermove", 150, 6 + inner / 4);
  point(canvas, "pointerup", 150, 6 + inner / 4);
  await wait();
  check("section", Math.abs(Number(document.getElementById("section").value) - 0.75) < 0.02 && changed(before, [profile.toDataURL()]) === 1);
  before = pixels();
  const quantity = document.getElementById("quantity");
  quantity.value = "gap";
  quantity.dispatchEvent(new Event("change"));
  await wait();
  check("quantity", changed(before, pixels()) >= 2 && /^Atoms/.test(root.querySelectorAll(".panel-title")[1].textContent));
  // The view in three dimensions: load of the maps, keyboard, pointer.
  const solid = document.getElementById("relief").querySelector("canvas");
  const turned = () => document.getElementById("relief").dataset.drawn.split(" ").map(Number);
  check("follows", turned()[3] === 0);
  before = [solid.toDataURL()];
  const own = document.getElementById("relief-load");
  own.value = 1;
  own.dispatchEvent(new Event("input"));
  await wait();
  check("leads", load.value === "1" && turned()[3] === 1 && changed(before, [solid.toDataURL()]) === 1);
  before = [solid.toDataURL()];
  key(solid, "ArrowLeft");
  key(solid, "ArrowUp");
  await wait();
  check("turns", turned()[0] === 25 && turned()[1] === 40 && changed(before, [solid.toDataURL()]) === 1);
  point(solid, "pointerdown", 100, 100);
  point(solid, "pointermove", 150, 90);
  point(solid, "pointerup", 150, 90);
  key(solid, "+");
  await wait();
  check("dragged", turned()[0] === 45 && turned()[1] === 37 && turned()[2] === 1.25);
  key(solid, "0");
  await wait();
  check("again", turned()[0] === 30 && turned()[2] === 1);
  const drawn = solid.getContext("2d").getImageData(0, 0, solid.width, solid.height).data;
  const holds = colour => { for (let i = 0; i < drawn.length; i += 4) if (colour.every((c, k) => drawn[i + k] === c)) return true; };
  check("coloured", holds([0, 0, 0]) && !holds([255, 0, 255]));
  const plot = root.parentElement.querySelector("svg.plot");
  const mark = plot.querySelector("g.curve path.mark").getBoundingClientRect();
  plot.dispatchEvent(new PointerEvent("pointermove", { clientX: mark.x + mark.width / 2, clientY: mark.y + mark.height / 2, bubbles: true }));
  const tip = document.querySelector(".tip");
  check("hover", !tip.hidden && /p\* [\d.]+, contact \(% of cell or sites\) [\d.]+/.test(tip.textContent));
  const legend = plot.querySelector("g.key");
  legend.dispatchEvent(new MouseEvent("click", { bubbles: true }));
  check("hide", getComputedStyle(plot.querySelector("g.curve")).display === "none" && legend.getAttribute("aria-pressed") === "false");
  key(legend, "Enter");
  check("show", getComputedStyle(plot.querySelector("g.curve")).display !== "none");
  const paper = () => getComputedStyle(document.body).backgroundColor;
  const light = paper();
  before = pixels();
  document.querySelector("button.theme").click();
  await wait();
  check("dark", paper() !== light && changed(before, pixels()) === 3);
  const term = document.querySelector(".term");
  term.focus();
  check("term", getComputedStyle(term.querySelector(".meaning")).display === "block");
  const low = document.querySelector(".warnings").getBoundingClientRect().bottom;
  check("first", scrollY === 0 && low < 900);
  document.title = found.join(" ");
})();
"#;

/// Serious and critical findings of axe-core, and the number of rules that passed.
const FAULTS: &str = r#"
setTimeout(() => axe.run(document, { resultTypes: ["violations", "passes"] }).then(result => {
  const serious = result.violations.filter(v => ["serious", "critical"].includes(v.impact));
  const words = serious.map(v => `${v.id} (${v.nodes.length}): ${v.nodes[0].target.join(" ")}`);
  document.title = `passes ${result.passes.length} serious ${serious.length} ${words.join("; ")}`;
}), 500);
"#;

fn chromium() -> Option<PathBuf> {
    let found = tools::program(&["chromium", "chromium-browser", "google-chrome"]);
    if found.is_none() {
        tools::skip("browser", "Chromium is not installed; scripts/setup.sh --tests installs it");
    }
    found
}

/// Chromium's output for a page: the DOM on standard output, and console messages on standard error.
fn browse(chromium: &Path, page: &Path, home: &Path, flags: &[&str]) -> (String, String) {
    let output = Command::new(chromium)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr", "--hide-scrollbars"])
        .args(["--virtual-time-budget=20000", "--window-size=1400,900"])
        .arg(format!("--user-data-dir={}", home.display()))
        .args(flags)
        .arg(format!("file://{}", page.display()))
        .output()
        .expect("Chromium starts");
    assert!(output.status.success(), "{}", stderr(&output));
    (String::from_utf8_lossy(&output.stdout).into_owned(), stderr(&output))
}

/// Title of a page after `script`, which is appended to it; there must be no console message.
fn title(chromium: &Path, page: &Path, scratch: &Path, script: &str) -> String {
    let html = std::fs::read_to_string(page).expect("a page");
    let checked = scratch.join("checked.html");
    std::fs::write(&checked, html.replace("</body>", &format!("<script>{script}</script></body>"))).expect("written");
    let (dom, said) = browse(chromium, &checked, &scratch.join("home"), &["--dump-dom"]);
    let complaints: Vec<&str> = said.lines().filter(|l| l.contains("CONSOLE")).collect();
    assert!(complaints.is_empty(), "{complaints:?}");
    dom.split("<title>").nth(1).and_then(|t| t.split("</title>").next()).expect("a title").to_string()
}

/// Number of colours of a screenshot.
fn colours(chromium: &Path, page: &Path, scratch: &Path) -> usize {
    let shot = scratch.join("page.png");
    let flag = format!("--screenshot={}", shot.display());
    browse(chromium, page, &scratch.join("home"), &[&flag]);
    let picture = image::open(&shot).expect("a screenshot").into_rgb8();
    assert_eq!((picture.width(), picture.height()), (1400, 900));
    picture.pixels().map(|p| p.0).collect::<std::collections::BTreeSet<[u8; 3]>>().len()
}

/// Folder of a run of the challenge on a small grid.
pub(crate) fn challenge() -> &'static Path {
    static RUN: LazyLock<PathBuf> = LazyLock::new(|| {
        let run = crate::kept("challenge");
        let _ = std::fs::remove_dir_all(&run);
        let args = ["challenge", "--grid", "64", "--regularise", "--json", "--out"];
        let output = asperity().args(args).arg(&run).output().expect("started");
        assert!(json_line(&output)["report"].as_str().is_some_and(|page| Path::new(page).is_file()));
        run
    });
    &RUN
}

#[test]
fn a_report_loads_completely_in_a_browser() {
    let Some(chromium) = chromium() else { return };
    let scratch = tempfile::tempdir().expect("scratch");
    let page = challenge().join(report::PAGE);
    let title = title(&chromium, &page, scratch.path(), WHOLE);
    let words: Vec<&str> = title.split_whitespace().collect();
    assert_eq!(words[0], "pictures", "the check has not run: {title}");
    // Two height maps and a view in three dimensions, three contact maps, and contact, gap and stress of the reference load on both branches.
    assert!(words[1].parse::<usize>().expect("a number") >= 12, "{title}");
    assert_eq!(words[2..8], ["failed", "0", "blank", "0", "wide", "false"], "{title}");
    assert!(colours(&chromium, &page, scratch.path()) > 100);
}

#[test]
fn a_report_answers_to_pointer_and_keyboard() {
    let Some(chromium) = chromium() else { return };
    let scratch = tempfile::tempdir().expect("scratch");
    run_folder(scratch.path());
    let page = report::write(scratch.path()).expect("a report");
    let title = title(&chromium, &page, scratch.path(), USED);
    let words: Vec<&str> = title.split(' ').collect();
    assert_eq!(words.len(), 20, "{title}");
    assert!(words.iter().all(|w| w.ends_with("=true")), "{title}");
}

#[test]
fn a_report_shows_everything_without_javascript() {
    let Some(chromium) = chromium() else { return };
    let scratch = tempfile::tempdir().expect("scratch");
    run_folder(scratch.path());
    let page = report::write(scratch.path()).expect("a report");
    let html = std::fs::read_to_string(&page).expect("a page");
    // Headless Chromium takes no screenshot with scripts switched off; a policy of the page itself blocks them all.
    let policy = "<meta http-equiv=\"Content-Security-Policy\" content=\"script-src 'none'\"><title>";
    std::fs::write(&page, html.replacen("<title>", policy, 1)).expect("written");
    let (dom, _) = browse(&chromium, &page, &scratch.path().join("home"), &["--dump-dom"]);
    assert!(!dom.contains("<canvas") && !dom.contains("class=\"theme\""), "a script has run");
    assert_eq!(
        dom.split("class=\"maps\"")
            .nth(1)
            .expect("maps")
            .split("</script>")
            .next()
            .expect("data")
            .matches("<image ")
            .count(),
        3
    );
    let still = dom.split("id=\"relief\"").nth(1).and_then(|r| r.split("</svg>").next()).expect("a still picture");
    assert!(still.contains("<image ") && still.contains("heights × "));
    assert!(colours(&chromium, &page, scratch.path()) > 100);
}

#[test]
fn a_report_has_no_serious_accessibility_fault() {
    let Some(chromium) = chromium() else { return };
    let axe = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/axe/node_modules/axe-core/axe.min.js");
    let Ok(axe) = std::fs::read_to_string(axe) else {
        return tools::skip("axe", "axe-core is not installed; scripts/setup.sh --tests installs it");
    };
    let scratch = tempfile::tempdir().expect("scratch");
    run_folder(scratch.path());
    let page = report::write(scratch.path()).expect("a report");
    let title = title(&chromium, &page, scratch.path(), &format!("{axe}</script><script>{FAULTS}"));
    let words: Vec<&str> = title.split(' ').collect();
    assert!(words[0] == "passes" && words[1].parse::<usize>().expect("a number") > 15, "{title}");
    assert_eq!(words[3], "0", "{title}");
}

#[test]
fn a_report_prints_on_few_pages() {
    let Some(chromium) = chromium() else { return };
    let scratch = tempfile::tempdir().expect("scratch");
    run_folder(scratch.path());
    let page = report::write(scratch.path()).expect("a report");
    let paper = scratch.path().join("page.pdf");
    let flag = format!("--print-to-pdf={}", paper.display());
    browse(&chromium, &page, &scratch.path().join("home"), &[&flag, "--no-pdf-header-footer"]);
    let bytes = std::fs::read(&paper).expect("a PDF");
    let pages = String::from_utf8_lossy(&bytes).matches("/Type /Page\n").count();
    assert!((2..=10).contains(&pages), "{pages} pages");
}

//! The report in a real browser: all images load, nothing is fetched from the network, and there are no console
//! messages.
//!
//! `scripts/setup.sh --tests` installs Chromium.

use crate::program::{asperity, json_line, stderr};
use crate::tools;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Loads all images of the page, including those inside drawings, and writes their number and the failures into the
/// title.
const CHECK: &str = r#"<script>
const all = [...document.querySelectorAll("img, image")].map(e => e.getAttribute("src") || e.getAttribute("href"));
const load = source => new Promise(done => {
  const picture = new Image();
  picture.onload = () => done(picture.naturalWidth > 0 ? "" : "empty");
  picture.onerror = () => done(String(source).slice(0, 60));
  picture.src = source;
});
const blank = [...document.querySelectorAll("svg")].filter(s => !s.closest("details:not([open])") && s.getBoundingClientRect().height < 20).length;
const wide = document.documentElement.scrollWidth > document.documentElement.clientWidth + 1;
Promise.all(all.map(load)).then(results => {
  const failed = results.filter(r => r);
  document.title = `pictures ${all.length} failed ${failed.length} blank ${blank} wide ${wide} ${failed.join(" ")}`;
});
</script>"#;

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
        .args(["--virtual-time-budget=20000", "--window-size=1280,2400"])
        .arg(format!("--user-data-dir={}", home.display()))
        .args(flags)
        .arg(format!("file://{}", page.display()))
        .output()
        .expect("Chromium starts");
    assert!(output.status.success(), "{}", stderr(&output));
    (String::from_utf8_lossy(&output.stdout).into_owned(), stderr(&output))
}

#[test]
fn a_report_loads_completely_in_a_browser() {
    let Some(chromium) = chromium() else { return };
    let scratch = tempfile::tempdir().expect("scratch");
    let run = scratch.path().join("run");
    let args = ["challenge", "--grid", "64", "--regularise", "--json", "--out"];
    let output = asperity().args(args).arg(&run).output().expect("started");
    let page = PathBuf::from(json_line(&output)["report"].as_str().expect("a report"));
    let html = std::fs::read_to_string(&page).unwrap_or_else(|e| panic!("{e}: {}", stderr(&output)));
    let checked = scratch.path().join("checked.html");
    std::fs::write(&checked, html.replace("</body>", &format!("{CHECK}</body>"))).expect("written");
    let (dom, said) = browse(&chromium, &checked, &scratch.path().join("home"), &["--dump-dom"]);
    let title = dom.split("<title>").nth(1).and_then(|t| t.split("</title>").next()).expect("a title");
    let words: Vec<&str> = title.split_whitespace().collect();
    assert_eq!(words[0], "pictures", "the check has not run: {title}; {said}");
    // Two height maps, three contact maps, and contact, gap and stress of the reference load on both branches.
    assert!(words[1].parse::<usize>().expect("a number") >= 11, "{title}");
    assert_eq!(words[2..8], ["failed", "0", "blank", "0", "wide", "false"], "{title}");
    let complaints: Vec<&str> = said.lines().filter(|l| l.contains("CONSOLE")).collect();
    assert!(complaints.is_empty(), "{complaints:?}");

    let shot = scratch.path().join("page.png");
    let flag = format!("--screenshot={}", shot.display());
    browse(&chromium, &page, &scratch.path().join("home"), &[&flag]);
    let picture = image::open(&shot).expect("a screenshot").into_rgb8();
    let colours: std::collections::BTreeSet<[u8; 3]> = picture.pixels().map(|p| p.0).collect();
    assert!(colours.len() > 100, "a page of {} colours", colours.len());
}

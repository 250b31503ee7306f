//! Prepared maps and their statistics against SurfaceTopography 1.27.1 (`tests/fixtures/preparation/make.py`), and the steps together.

use asperity::grid::Grid;
use asperity::surface::height_map::HeightMap;
use asperity::surface::{
    Axis, Detrend, Edges, Fill, FilterKind, Preparation, PreparedMap, areal, hann_windowed, moments,
    non_periodic_gradient, power_spectra, psd, scale_dependent, seam_warning,
};
use serde_json::Value;
use std::sync::LazyLock;

/// Where definitions coincide, over the rms height (about 1): rounding of two implementations, after an offset of 100.
const SAME: f64 = 1e-10;

static EXPECTED: LazyLock<Value> =
    LazyLock::new(|| serde_json::from_str(include_str!("../fixtures/preparation/expected.json")).expect("JSON"));

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("an array").iter().map(|h| h.as_f64().unwrap_or(f64::NAN)).collect()
}

fn extent(case: &Value) -> [f64; 2] {
    numbers(&case["extent"]).try_into().expect("two extents")
}

/// A periodic map of 25 x 19 points with oblong pixels, mean 3, rms 1.
fn periodic() -> (&'static Value, HeightMap) {
    let case = &EXPECTED["periodic"];
    (case, HeightMap::new("periodic", 25, 19, numbers(&case["heights"])).unwrap())
}

/// A tilted and bowed part of a larger surface on 24 x 24 points, offset 100; with `holes` or without.
fn patch(key: &str) -> (&'static Value, HeightMap) {
    let case = &EXPECTED["patch"];
    (case, HeightMap::with_missing("patch", 24, 24, numbers(&case[key])).unwrap())
}

fn same(found: &[f64], expected: &Value, what: &str) {
    let expected = numbers(expected);
    assert_eq!(found.len(), expected.len(), "{what}");
    for (i, (f, e)) in found.iter().zip(&expected).enumerate() {
        assert!((f - e).abs() < SAME, "{what} {i}: {f} {e}");
    }
}

fn close(found: f64, expected: &Value, what: &str) {
    let expected = expected.as_f64().expect("a number");
    assert!((found / expected - 1.0).abs() < SAME, "{what}: {found} {expected}");
}

fn grid(prepared: &PreparedMap) -> Grid {
    Grid { nx: prepared.map.nx, ny: prepared.map.ny, lx: prepared.extent[0], ly: prepared.extent[1] }
}

fn same_statistics(grid: Grid, heights: &[f64], expected: &Value, what: &str) {
    let m = moments(grid, heights);
    close(m.rms_height, &expected["sq"], what);
    close(m.rms_gradient, &expected["spectral_gradient"], what);
    let bins = psd(grid, heights, |_| 0.0);
    let expected = expected["psd"].as_array().expect("bins");
    assert_eq!(bins.len(), expected.len(), "{what}");
    for (bin, expected) in bins.iter().zip(expected) {
        close(bin.mode, &expected[0], what);
        close(bin.power, &expected[1], what);
    }
}

/// Sq, the rms gradient of the Fourier series and the power of the waves. The spectrum of SurfaceTopography is |a|² LxLy; its radial
/// bins have other limits, so its map is averaged in ours.
#[test]
fn statistics_of_a_periodic_map_agree() {
    let (case, map) = periodic();
    let [lx, ly] = extent(case);
    let on = Grid { nx: 25, ny: 19, lx, ly };
    same_statistics(on, &map.heights, &case["statistics"], "periodic");
    assert_eq!(seam_warning(on, &map.heights), None);
    // SurfaceTopography's Sdq is that of differences between neighbours, whose transfer is below q.
    let differences = case["difference_gradient"].as_f64().unwrap() / moments(on, &map.heights).rms_gradient;
    assert!((0.8..0.95).contains(&differences), "{differences}");
}

/// The same with the seam of a tilted map, and without its tilt. On an even grid SurfaceTopography's derivative leaves out the
/// Nyquist waves.
#[test]
fn statistics_with_and_without_a_seam_agree() {
    let (case, map) = patch("heights");
    let [lx, ly] = extent(case);
    let on = Grid { nx: 24, ny: 24, lx, ly };
    let plane = Preparation { detrend: Some(Detrend::Plane), ..Preparation::default() };
    let level = plane.apply(map.clone(), [lx, ly], false).unwrap();
    for (heights, key) in [(&map.heights, "with_seam"), (&level.map.heights, "without_tilt")] {
        let expected = &case[key];
        close(moments(on, heights).rms_height, &expected["sq"], key);
        for (bin, expected) in psd(on, heights, |_| 0.0).iter().zip(expected["psd"].as_array().unwrap()) {
            close(bin.power, &expected[1], key);
        }
        let nyquist = moments(on, heights).rms_gradient / expected["spectral_gradient"].as_f64().unwrap();
        assert!((1.0..1.1).contains(&nyquist), "{key}: {nyquist}");
    }
    assert!(seam_warning(on, &map.heights).is_some());
}

/// The spectrum of a map that does not repeat: plane removed, Hann window along both axes. SurfaceTopography's default window has circular
/// symmetry, so the same window is requested there.
#[test]
fn windowed_spectra_of_a_patch_agree() {
    let (case, map) = patch("heights");
    let [lx, ly] = extent(case);
    let on = Grid { nx: 24, ny: 24, lx, ly };
    let bins = psd(on, &hann_windowed(on, &map.heights), |_| 0.0);
    let expected = case["windowed"].as_array().unwrap();
    assert_eq!(bins.len(), expected.len());
    for (bin, expected) in bins.iter().zip(expected) {
        close(bin.mode, &expected[0], "mode");
        close(bin.power, &expected[1], "power");
    }
    // Without the window, the seam carries most of the shortest waves.
    let plain = psd(on, &map.heights, |_| 0.0);
    let last = |bins: &[asperity::surface::PsdBin]| bins.last().unwrap().power;
    assert!(last(&plain) > 2.0 * last(&bins), "{} {}", last(&plain), last(&bins));
}

/// The gradient of a patch is that of all pairs of neighbours. In the mirrored patch of n points one pair of n has no difference.
/// SurfaceTopography's value for the patch itself leaves out the last row and column of differences.
#[test]
fn gradients_of_a_patch_agree() {
    /// Difference of the means over 23 x 24 and over 23 x 23 pairs.
    const LAST_ROW: f64 = 0.02;
    let (case, map) = patch("heights");
    let [lx, ly] = extent(case);
    let found = non_periodic_gradient(Grid { nx: 24, ny: 24, lx, ly }, &map.heights);
    close(found * (23.0f64 / 24.0).sqrt(), &case["mirrored_gradient"], "mirrored");
    let trimmed = case["gradient"].as_f64().unwrap();
    assert!((found / trimmed - 1.0).abs() < LAST_ROW, "{found} {trimmed}");
}

/// Forms fitted to the measured points; filled points are checked in the chain.
#[test]
fn forms_agree() {
    let forms = [(Detrend::Mean, "mean"), (Detrend::Plane, "plane"), (Detrend::Quadratic, "quadratic")];
    for (detrend, key) in forms {
        let (case, map) = patch("heights");
        let form = Preparation { detrend: Some(detrend), ..Preparation::default() };
        let prepared = form.apply(map, extent(case), false).unwrap();
        same(&prepared.map.heights, &case[key], key);
    }
    for (detrend, key) in [(Detrend::Plane, "holes_plane"), (Detrend::Quadratic, "holes_quadratic")] {
        let (case, map) = patch("holes");
        let form = Preparation { detrend: Some(detrend), fill: Some(Fill::Nearest), ..Preparation::default() };
        let missing = map.missing();
        let prepared = form.apply(map.clone(), extent(case), false).unwrap();
        assert_eq!(prepared.filled, missing);
        let expected = numbers(&case[key]);
        for (i, h) in prepared.map.heights.iter().enumerate().filter(|(i, _)| !map.heights[*i].is_nan()) {
            assert!((h - expected[i]).abs() < SAME, "{key} {i}: {h} {}", expected[i]);
        }
    }
}

/// Harmonic filling on square pixels, where its five-point formula is SurfaceTopography's, with holes at edges and a large one.
#[test]
fn harmonic_filling_agrees() {
    for (periodic, key) in [(false, "filled"), (true, "filled_periodic")] {
        let (case, map) = patch("holes");
        let fill = Preparation { fill: Some(Fill::Harmonic), ..Preparation::default() };
        same(&fill.apply(map, extent(case), periodic).unwrap().map.heights, &case[key], key);
    }
}

/// Gaussian and sharp filters by the Fourier coefficients, and Fourier interpolation.
#[test]
fn filters_and_resampling_of_a_periodic_map_agree() {
    let with = |p: Preparation| {
        let (case, map) = periodic();
        p.apply(map, extent(case), true).unwrap().map.heights
    };
    let (case, _) = periodic();
    let none = Preparation::default();
    let sharp = Preparation { filter: Some(FilterKind::Sharp), ..none.clone() };
    same(&with(Preparation { low_pass: Some(1.3), ..none.clone() }), &case["gaussian_low"], "low");
    let band = Preparation { low_pass: Some(1.3), high_pass: Some(3.0), ..none.clone() };
    same(&with(band), &case["gaussian_band"], "band");
    same(&with(Preparation { low_pass: Some(1.3), ..sharp.clone() }), &case["sharp_low"], "sharp low");
    same(&with(Preparation { high_pass: Some(1.3), ..sharp }), &case["sharp_high"], "sharp high");
    same(&with(Preparation { resample: Some([40, 33]), ..none }), &case["resampled"], "resampled");
}

/// Means over 2 x 2 pixels are SurfaceTopography's downsampling by averages.
#[test]
fn coarser_pixels_agree() {
    let (case, map) = patch("heights");
    let coarser = Preparation { resample: Some([12, 12]), ..Preparation::default() };
    same(&coarser.apply(map, extent(case), false).unwrap().map.heights, &case["averaged"], "averaged");
}

/// Plane, fill and mirror images together, and the statistics of the cell, which repeats.
#[test]
fn a_chain_of_steps_agrees() {
    let (case, map) = patch("holes");
    let missing = map.missing();
    let chain = Preparation {
        fill: Some(Fill::Harmonic),
        detrend: Some(Detrend::Plane),
        edges: Some(Edges::Mirror),
        ..Preparation::default()
    };
    let prepared = chain.apply(map, extent(case), true).unwrap();
    assert_eq!(prepared.filled, missing);
    assert_eq!(prepared.extent, [9.6, 9.6]);
    same(&prepared.map.heights, &case["chain"], "chain");
    let expected = &case["chain_statistics"];
    close(moments(grid(&prepared), &prepared.map.heights).rms_height, &expected["sq"], "chain");
    assert_eq!(seam_warning(grid(&prepared), &prepared.map.heights), None);
    let [plane, fill, mirror] = &prepared.history[..] else { panic!("{:?}", prepared.history) };
    assert!(fill.starts_with(&format!("fill harmonic: {missing} of 576 points (")), "{fill}");
    assert!(plane.starts_with("detrend plane: slopes "), "{plane}");
    assert_eq!(mirror, "edges mirror: a cell of 48 x 48 points, twice the extents");
}

/// A corner that was not measured, of a tilted map, is filled on the level of the rest.
#[test]
fn filled_corners_of_a_tilted_map_are_level() {
    let missing = |i: usize| i % 40 < 12 && i / 40 < 12;
    let tilted = |i: usize| 0.1 * (i % 40) as f64 + 0.2 * (i / 40) as f64;
    let heights = (0..1600).map(|i| if missing(i) { f64::NAN } else { tilted(i) }).collect();
    let map = HeightMap::with_missing("tilted", 40, 40, heights).unwrap();
    for fill in [Fill::Harmonic, Fill::Nearest] {
        let steps = Preparation { fill: Some(fill), detrend: Some(Detrend::Plane), ..Preparation::default() };
        let level = steps.apply(map.clone(), [40.0, 40.0], false).unwrap();
        assert!(level.map.heights.iter().all(|h| h.abs() < SAME), "{fill:?}");
    }
}

/// A tilted patch that is taken as periodic has a seam; new edges remove it.
#[test]
fn new_edges_remove_a_seam() {
    let (case, map) = patch("heights");
    let none = Preparation::default();
    let seam = |p: &Preparation| {
        let prepared = p.apply(map.clone(), extent(case), true).unwrap();
        seam_warning(grid(&prepared), &prepared.map.heights)
    };
    let found = seam(&none).expect("a seam");
    assert!(found.contains("--edges taper|mirror"), "{found}");
    for edges in [Edges::Taper, Edges::Mirror] {
        assert_eq!(seam(&Preparation { edges: Some(edges), ..none.clone() }), None);
    }
    // The plane removes the tilt, but not the seam: a part of a larger surface does not repeat.
    assert!(seam(&Preparation { detrend: Some(Detrend::Plane), ..none }).is_some());
}

/// Every step in the order of the fields, on a map with a spike, holes, a tilt and an offset: no NaN is left, the history has a line
/// for each step, and the bits do not depend on the number of threads.
#[test]
fn all_steps_in_their_order() {
    let (_, mut map) = patch("holes");
    map.heights[12 * 24 + 12] = 900.0;
    let all = |edges| Preparation {
        crop: Some([1, 2, 22, 20]),
        remove_outliers: Some(10.0),
        fill: Some(Fill::Nearest),
        detrend: Some(Detrend::Quadratic),
        low_pass: Some(1.0),
        high_pass: Some(3.0),
        resample: Some([33, 10]),
        edges: Some(edges),
        ..Preparation::default()
    };
    for edges in [Edges::Taper, Edges::Mirror] {
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| all(edges).apply(map.clone(), [4.8, 4.8], true).unwrap())
        };
        let prepared = on(1);
        assert_eq!(prepared, on(3));
        assert!(prepared.map.heights.iter().all(|h| h.is_finite()));
        let steps = ["crop: ", "outliers ", "detrend quadratic: ", "fill nearest: ", "low-pass 1 ", "high-pass 3 "];
        let steps = steps.iter().chain(&["resample: 22 x 20 to 33 x 10 ", "edges "]);
        assert!(prepared.history.iter().zip(steps.clone()).all(|(line, step)| line.starts_with(step)), "{prepared:?}");
        assert_eq!(prepared.history.len(), steps.count());
        assert!(prepared.history[1].contains(": 1 removed of 440 points"), "{}", prepared.history[1]);
        let factor = if edges == Edges::Mirror { 2.0 } else { 1.0 };
        let found = prepared.extent.map(|l| l / factor);
        assert!((found[0] - 4.4).abs() < 1e-14 && (found[1] - 4.0).abs() < 1e-14, "{found:?}");
    }
}

/// Nothing is changed without a step, and errors name the place in the whole map.
#[test]
fn no_step_changes_nothing_and_errors_name_the_place() {
    let (case, map) = patch("heights");
    let prepared = Preparation::default().apply(map.clone(), extent(case), false).unwrap();
    assert_eq!((&prepared.map, prepared.history.len()), (&map, 0));
    let (case, map) = patch("holes");
    let says = |p: Preparation| p.apply(map.clone(), extent(case), true).unwrap_err().to_string();
    // The corner of three rows by four columns, of which one row and two columns are left.
    let crop = Preparation { crop: Some([18, 2, 4, 1]), ..Preparation::default() };
    let text = says(crop);
    assert!(
        text.contains("the first in row 3, column 21 (counted from 1)") && text.contains("accepted: none, or `--fill")
    );
    let outside = Preparation { crop: Some([18, 2, 7, 1]), ..Preparation::default() };
    assert!(says(outside).contains("--crop = 7 x 1 points from column 19, row 3; accepted: a part of the map of 24"));
    let sharp = Preparation {
        fill: Some(Fill::Nearest),
        low_pass: Some(1.0),
        filter: Some(FilterKind::Sharp),
        edges: Some(Edges::Taper),
        ..Preparation::default()
    };
    assert!(says(sharp).contains("--filter = sharp; accepted: gaussian"));
}

/// Parameters of ISO 25178-2, profile spectra, structure functions, slopes and curvatures over distance.
#[test]
fn functions_of_profiles_are_the_same() {
    for ((case, map), periodic) in [(periodic(), true), (patch("heights"), false)] {
        let expected = &case["functions"];
        let [lx, ly] = extent(case);
        let grid = Grid { nx: map.nx, ny: map.ny, lx, ly };
        let p = areal(grid, &map.heights, periodic);
        for (name, found) in
            [("sq", p.sq), ("sa", p.sa), ("ssk", p.ssk), ("sku", p.sku), ("sdq", p.sdq), ("sdr", p.sdr)]
        {
            close(found, &expected[name], name);
        }
        for (name, axis) in [("x", Axis::X), ("y", Axis::Y)] {
            let expected = &expected[name];
            let list = scale_dependent(grid, &map.heights, axis, periodic);
            for (i, distance) in numbers(&expected["distance"]).into_iter().enumerate() {
                let p = list.iter().find(|p| (p.distance / distance - 1.0).abs() < SAME).expect("the same distances");
                close(p.slope, &expected["slope"][i], "slope");
                close(p.structure_function, &expected["structure_function"][i], "structure function");
                if i > 0 {
                    close(p.curvature.expect("an even number of pixels"), &expected["curvature"][i - 1], "curvature");
                }
            }
            assert!(list.len() >= 5, "{list:?}");
            if periodic {
                let spectra = power_spectra(grid, &map.heights, true);
                let spectrum = if axis == Axis::X { spectra.x } else { spectra.y };
                let (q, density) = (numbers(&expected["q"]), numbers(&expected["density"]));
                assert!(q.len() >= 8 && spectrum.len() >= q.len());
                for (p, (q, density)) in spectrum.iter().zip(q.iter().zip(density)) {
                    assert!(
                        (p.q / q - 1.0).abs() < SAME && (p.density / density - 1.0).abs() < SAME,
                        "{p:?} {density}"
                    );
                }
            }
        }
    }
}

//! Single-asperity models, bearing-area models and the experiment model against closed forms, solvers and the challenge
//! paper.

use crate::found::{near, path, problem, rough, solved};
use asperity::contact::interface::{AttractionLaw, Base, Elastic, Layer, LennardJonesWall, Wall};
use asperity::contact::method::{
    ExperimentSettings, IchaSettings, Load, NoObserver, ReducedProblem, Settings, Stop, WinklerSettings,
};
use asperity::contact::observe::{
    Connectivity, ContactEdges, cluster_sizes, contact_area, contact_map, median_cluster_size,
};
use asperity::grid::{Field, Grid, minimum_image};
use asperity::methods;
use asperity::surface::moments;
use std::f64::consts::PI;

/// A copied estimate.
#[derive(Debug, Clone, PartialEq)]
struct Estimated {
    stop: Stop,
    area: f64,
    mean_gap: f64,
    load_error: f64,
    contact: Vec<u8>,
    gap: Vec<f64>,
    stress: Vec<f64>,
    clusters: Vec<f64>,
}

fn estimates(problem: &ReducedProblem, id: &str, pressures: &[f64]) -> Vec<Estimated> {
    let mut run = methods::find(id).unwrap().start(problem, &NoObserver).unwrap().estimator().unwrap();
    let mut estimate = |&p: &f64| {
        let e = run.estimate(Load::Pressure(p)).unwrap();
        Estimated {
            stop: e.stop,
            area: e.contact_area,
            mean_gap: e.mean_gap.unwrap_or(f64::NAN),
            load_error: e.load_error,
            contact: e.contact.unwrap_or_default().to_vec(),
            gap: e.gap.unwrap_or_default().to_vec(),
            stress: e.stress.unwrap_or_default().to_vec(),
            clusters: e.clusters.unwrap_or_default(),
        }
    };
    pressures.iter().map(&mut estimate).collect()
}

fn one(problem: &ReducedProblem, id: &str, pressure: f64) -> Estimated {
    let found = estimates(problem, id, &[pressure]).remove(0);
    assert_eq!(found.stop, Stop::Converged, "{id} at {pressure}");
    found
}

/// Periodic surface of spheres (x, y, radius, height of the lowest point).
fn spheres(n: usize, list: &[(f64, f64, f64, f64)]) -> (Grid, Vec<f64>) {
    let grid = Grid::unit(n, n);
    let height = |i: usize| {
        let one = |&(x, y, radius, z): &(f64, f64, f64, f64)| {
            let node = (y * n as f64) as usize * n + (x * n as f64) as usize;
            let [dx, dy] = minimum_image(grid, node, i);
            z + (dx * dx + dy * dy) / (2.0 * radius)
        };
        list.iter().map(one).fold(f64::INFINITY, f64::min)
    };
    (grid, (0..n * n).map(height).collect())
}

fn with<'p>(problem: ReducedProblem<'p>, winkler: WinklerSettings) -> ReducedProblem<'p> {
    ReducedProblem { settings: Settings { winkler, ..Settings::default() }, ..problem }
}

fn gradient(grid: Grid, heights: &[f64]) -> f64 {
    moments(grid, heights).rms_gradient
}

fn typical(map: &[u8], nx: usize) -> f64 {
    median_cluster_size(&cluster_sizes(map, nx, Connectivity::Eight, true)).unwrap_or(0) as f64
}

// Winkler

/// Paraboloid of radius R: the load is πb⁴κ/4R for an overlap of radius b, and the contact area twice that of the
/// overlap.
#[test]
fn winkler_paraboloid_agrees_with_the_closed_form() {
    /// Discretisation of a circle of 48 nodes of radius.
    const AREA: f64 = 0.01;
    let radius = 2.0;
    let (grid, heights) = spheres(256, &[(0.25, 0.75, radius, 0.3)]);
    let length = 0.05;
    let p = with(problem(grid, &heights), WinklerSettings { spring_length: Some(length), calibrate_to: None });
    let b: f64 = 48.0 / 256.0;
    let load = PI * b.powi(4) / (4.0 * radius * length);
    let found = one(&p, "winkler", load);
    assert!(near(found.area, 2.0 * PI * b * b, AREA), "{} {}", found.area, 2.0 * PI * b * b);
    assert!(found.load_error < 1e-12, "{}", found.load_error);
    assert_eq!(cluster_sizes(&found.contact, 256, Connectivity::Eight, true).len(), 1);
    let highest = found.stress.iter().copied().fold(0.0, f64::max);
    assert!(near(highest, b * b / (2.0 * radius) / length, AREA), "{highest}");
    // The overlap area is half of the contact area.
    let core = found.stress.iter().filter(|s| **s > 0.0).count();
    assert_eq!(2 * core, found.contact.iter().filter(|c| **c != 0).count());
}

/// S36: outside contact the gap is the undeformed one minus a constant; in contact it is zero.
#[test]
fn winkler_gap_is_undeformed() {
    let (grid, heights) = rough(256, 256, 1.0 / 32.0, 1);
    let found = one(&problem(grid, &heights), "winkler", 0.01);
    let open = |i: &usize| found.gap[*i] > 0.0;
    let first = (0..heights.len()).find(open).unwrap();
    let shift = heights[first] - found.gap[first];
    for (i, h) in heights.iter().enumerate() {
        assert_eq!(open(&i), found.contact[i] == 0);
        assert!(!open(&i) || (h - found.gap[i] - shift).abs() < 1e-12);
    }
}

/// Areas are a function of p/(E*ḡ): with twice the heights and the load the contact map is the same.
#[test]
fn winkler_area_depends_on_pressure_over_gradient() {
    let (grid, heights) = rough(128, 128, 1.0 / 24.0, 4);
    let double: Vec<f64> = heights.iter().map(|h| 2.0 * h).collect();
    let a = one(&problem(grid, &heights), "winkler", 0.03);
    let b = one(&problem(grid, &double), "winkler", 0.06);
    assert_eq!(a.contact, b.contact);
    assert!(near(b.mean_gap, 2.0 * a.mean_gap, 1e-12) && a.area > 0.01 && a.area < 0.9);
}

/// The same holds for merging contact spots: load steps are in p*, so that spots merge in the same order.
#[test]
fn icha_area_depends_on_pressure_over_gradient() {
    let (grid, heights) = rough(128, 128, 1.0 / 24.0, 4);
    let double: Vec<f64> = heights.iter().map(|h| 2.0 * h).collect();
    let a = one(&problem(grid, &heights), "icha", 0.03);
    let b = one(&problem(grid, &double), "icha", 0.06);
    assert_eq!(a.clusters.len(), b.clusters.len());
    assert!(near(b.area, a.area, 1e-9) && near(b.mean_gap, 2.0 * a.mean_gap, 1e-9) && a.area > 0.01);
}

/// The calibrated area at p* = 0.01 is reproduced to one node. S27: at lower loads the area grows with an exponent
/// below 0.95, while that of the solver is proportional to the load. S28: the mean gap is overestimated; the last gap
/// closes where half of the nodes overlap, at p* between 0.6 and 1.3.
#[test]
fn winkler_calibration_meets_the_area() {
    /// Excess of the mean gap at both loads. Measured: 0.11 to 0.20, and 0.30 to 0.42.
    const EXCESS: [[f64; 2]; 2] = [[0.1, 0.21], [0.29, 0.43]];
    let (mut areas, mut reference) = ([0.0; 2], [0.0; 2]);
    for seed in 1..=6 {
        let (grid, heights) = rough(256, 256, 1.0 / 32.0, seed);
        let base = problem(grid, &heights);
        let g = gradient(grid, &heights);
        let exact = path(&base, "fast", &[0.001 * g, 0.01 * g]);
        // Springs are calibrated at p* = 0.01, where half of the area overlaps.
        let mut sorted = heights.clone();
        sorted.sort_by(f64::total_cmp);
        let overlap = |depth: f64| sorted.iter().map(|h| (depth - h).max(0.0)).sum::<f64>();
        let depth = sorted[(0.5 * exact[1].area * sorted.len() as f64).round() as usize];
        let closed = 0.01 * g * overlap(sorted[sorted.len() / 2]) / overlap(depth);
        let p = with(base, WinklerSettings { spring_length: None, calibrate_to: Some(exact[1].area) });
        let found = estimates(&p, "winkler", &[0.001 * g, 0.01 * g, 0.99 * closed, 1.01 * closed]);
        // The number of contact nodes is even.
        assert!((found[1].area - exact[1].area).abs() < 2.5 / (256.0 * 256.0), "{} {}", found[1].area, exact[1].area);
        for k in 0..2 {
            areas[k] += found[k].area;
            reference[k] += exact[k].area;
            println!("seed {seed}: gap x{:.3}, closed at {:.3}", found[k].mean_gap / exact[k].mean_gap, closed / g);
            let excess = found[k].mean_gap / exact[k].mean_gap - 1.0;
            assert!(excess > EXCESS[k][0] && excess < EXCESS[k][1], "seed {seed}: {excess}");
        }
        assert!(found[2].area < 1.0 && found[3].area == 1.0 && found[3].mean_gap == 0.0);
    }
    let power = |a: [f64; 2]| (a[1] / a[0]).log10();
    println!("powers: winkler {} fast {}", power(areas), power(reference));
    // Measured: 0.83 and 0.97.
    assert!((power(areas) - 0.83).abs() < 0.02 && (power(reference) - 0.97).abs() < 0.02);
}

/// The default spring length, which was fitted to 3 % of contact on surfaces of another generator: 2.3 % on the mean of four
/// of this one at p = 0.01 E*, on 1024² points (1.9 to 3.1 % on eight).
#[test]
fn default_spring_length_gives_the_challenges_area() {
    let area = |seed: u64| {
        let (grid, heights) = rough(1024, 1024, 1e-3, seed);
        one(&problem(grid, &heights), "winkler", 0.01).area
    };
    let mean = (1..=4).map(area).sum::<f64>() / 4.0;
    assert!(near(mean, 0.02344, 0.005), "{mean}");
}

// Summits

/// JKR on one summit during loading and unloading: contact radii of the closed form, jump into contact at first
/// contact, and separation beyond the pull-off force 3πγR/2.
#[test]
fn srgw_single_summit_is_jkr() {
    let (radius, gamma) = (0.5, 1e-4);
    let (grid, heights) = spheres(64, &[(0.25, 0.5, radius, 0.1)]);
    let p = ReducedProblem { adhesion: AttractionLaw::exponential(gamma, 1e-5), ..problem(grid, &heights) };
    let pull_off = 1.5 * PI * gamma * radius;
    // 4a³/3R - √(8πγa³) = F, a quadratic in √a³.
    let closed = |load: f64| {
        let (c, b) = (4.0 / (3.0 * radius), (8.0 * PI * gamma).sqrt());
        ((b + (b * b + 4.0 * c * load).sqrt()) / (2.0 * c)).powf(2.0 / 3.0)
    };
    let loads = [0.0, 0.3 * pull_off, 5.0 * pull_off, pull_off, -0.5 * pull_off, -0.999 * pull_off];
    for (load, found) in loads.iter().zip(estimates(&p, "srgw", &loads)) {
        assert_eq!((found.stop, found.clusters.len()), (Stop::Converged, 1), "{load}");
        assert!(near((found.clusters[0] / PI).sqrt(), closed(*load), 1e-6), "{load} {:?}", found.clusters);
        assert!(near(found.area, found.clusters[0], 1e-12));
    }
    let end = estimates(&p, "srgw", &[-0.5 * pull_off, -1.001 * pull_off, 0.3 * pull_off]);
    assert_eq!((end[1].stop, end[1].area), (Stop::Detached, 0.0));
    assert!(near((end[2].clusters[0] / PI).sqrt(), closed(0.3 * pull_off), 1e-6));
}

/// Without adhesion: area and stress of Hertz on one summit; two summits have a common approach.
#[test]
fn srgw_without_adhesion_is_hertz() {
    let (grid, heights) = spheres(128, &[(0.25, 0.5, 0.4, 0.0)]);
    let load = 1e-3;
    let found = one(&problem(grid, &heights), "srgw", load);
    let a = (0.75 * load * 0.4).cbrt();
    assert!(near(found.area, PI * a * a, 1e-9), "{} {}", found.area, PI * a * a);
    let highest = found.stress.iter().copied().fold(0.0, f64::max);
    assert!(near(highest, 1.5 * load / (PI * a * a), 0.02) && found.load_error < 1e-10, "{highest}");
    assert!((found.gap[64 * 128 + 96] - (0.5f64.powi(2) / 0.8 - a * a / 0.4)).abs() < 2e-3);
    let (grid, heights) = spheres(128, &[(0.25, 0.5, 0.4, 0.0), (0.75, 0.5, 0.2, 0.002)]);
    let found = one(&problem(grid, &heights), "srgw", load);
    let [a, b] = found.clusters[..] else { panic!("two spots") };
    assert!(((a / PI / 0.4) - (b / PI / 0.2) - 0.002).abs() < 1e-9);
}

/// Adhesion increases the area, more on unloading than on loading.
#[test]
fn srgw_has_adhesive_hysteresis() {
    let (grid, heights) = rough(512, 512, 1.0 / 64.0, 1);
    let g = gradient(grid, &heights);
    let adhesion = AttractionLaw::exponential(2e-4, 2e-5);
    let loads = [0.0, 0.003 * g, 0.03 * g, 0.003 * g, 0.0];
    let with = estimates(&ReducedProblem { adhesion, ..problem(grid, &heights) }, "srgw", &loads);
    let without = estimates(&problem(grid, &heights), "srgw", &loads[1..3]);
    println!("areas {:?} without {:?}", with.iter().map(|f| f.area).collect::<Vec<_>>(), without[0].area);
    assert!(with.iter().chain(&without).all(|f| f.stop == Stop::Converged && f.load_error < 1e-8));
    assert!(with[1].area > 1.05 * without[0].area && with[2].area > without[1].area);
    assert!(with[3].area > 1.005 * with[1].area && with[4].area > 1.5 * with[0].area);
}

// Interacting spots

/// One sphere in a periodic cell against `bvm` and Hertz with images: area, mean gap, highest stress.
#[test]
fn icha_single_summit_is_periodic_hertz() {
    let (radius, load) = (1.0, 4.0 / 3.0 * 1e-3);
    let (grid, heights) = spheres(256, &[(0.5, 0.5, radius, 0.0)]);
    let p = problem(grid, &heights);
    let found = one(&p, "icha", load);
    assert!(near(found.area, PI * 0.01, 1e-6), "{}", found.area);
    // δ = a²/R - 3.900265 F/π for zero mean displacement. The term with 9.0336, the lattice sum of 1/r³, is due to the
    // finite size of the images.
    let mean = asperity::grid::mean(&heights);
    let exact = mean - (0.01 - 3.900_264_92 * load / PI + 9.033_62 * 0.1 * 0.01 * load / PI);
    assert!(near(found.mean_gap, exact, 1e-6), "{} {exact}", found.mean_gap);
    let solved = solved(&p, "bvm", load);
    assert!(near(found.mean_gap, solved.mean_gap, 2e-3), "{} {}", found.mean_gap, solved.mean_gap);
    let highest = |s: &[f64]| s.iter().copied().fold(0.0, f64::max);
    assert!(near(highest(&found.stress), highest(&solved.stress), 0.02));
}

/// Two interacting spheres of different radius and height: the load on each and the mean gap agree with `bvm`; without
/// interaction they do not.
#[test]
fn icha_interaction_agrees_with_bvm() {
    let list = [(0.375, 0.5, 0.05, 0.0), (0.625, 0.5, 0.08, 0.004)];
    let (grid, heights) = spheres(256, &list);
    let p = problem(grid, &heights);
    let load = 1e-3;
    // Fraction of the load on the left half.
    let left = |stress: &[f64]| {
        let (mut part, mut all) = (0.0, 0.0);
        for (i, s) in stress.iter().enumerate() {
            all += s;
            part += if i % 256 < 128 { *s } else { 0.0 };
        }
        part / all
    };
    let exact = solved(&p, "bvm", load);
    let [interacting, independent] = ["icha", "srgw"].map(|id| one(&p, id, load));
    let (exact_left, found, not) = (left(&exact.stress), left(&interacting.stress), left(&independent.stress));
    println!(
        "two spheres: load on the first {exact_left} (bvm) {found} (icha) {not} (srgw); mean gap {} {} {}",
        exact.mean_gap, interacting.mean_gap, independent.mean_gap
    );
    assert_eq!(interacting.clusters.len(), 2);
    // Measured: 0.56056 for 0.56029, and 0.55597 without interaction.
    assert!(near(found, exact_left, 1e-3), "{found} {exact_left}");
    assert!((not - exact_left).abs() > 10.0 * (found - exact_left).abs(), "{not} {found} {exact_left}");
    assert!(near(interacting.mean_gap, exact.mean_gap, 0.01), "{} {}", interacting.mean_gap, exact.mean_gap);
}

/// Contact spots that meet merge and carry the load; merging does not depend on the sequence of requested loads.
#[test]
fn icha_spots_merge_with_load() {
    let (grid, heights) = spheres(128, &[(0.46875, 0.5, 0.2, 0.0), (0.53125, 0.5, 0.2, 0.0)]);
    let p = problem(grid, &heights);
    let loads = [1e-5, 6e-4, 3e-3];
    let found = estimates(&p, "icha", &loads);
    assert!(found.iter().all(|f| f.stop == Stop::Converged && f.load_error < 1e-6));
    assert_eq!(found.iter().map(|f| f.clusters.len()).collect::<Vec<_>>(), [2, 1, 1]);
    assert!(found[2].area > found[1].area);
    assert_eq!(one(&p, "icha", loads[2]), found[2]);
    // A lower load afterwards gives the same result as a first one.
    assert_eq!(estimates(&p, "icha", &[loads[2], loads[0]])[1], found[0]);
}

/// S09: the mean contact pressure at low load is E*ḡ/2, on surfaces with 8 nodes per shortest wave. S26: areas are up
/// to 30 % below those of the solver, and mean gaps within 10 %; independent summits deviate more.
#[test]
fn icha_on_rough_surfaces_agrees_with_fast() {
    /// Mean contact pressure over E*ḡ at p* = 0.002, and areas over those of `fast` at both loads.
    const PRESSURE: f64 = 0.513;
    const AREAS: [f64; 2] = [0.883, 0.838];
    /// Scatter of sums over the order of merging.
    const MEASURED: f64 = 0.01;
    let (mut load, mut areas, mut exact, mut alone) = (0.0, [0.0; 2], [0.0; 2], 0.0);
    for seed in [1, 2, 3] {
        let (grid, heights) = rough(512, 512, 1.0 / 64.0, seed);
        let p = problem(grid, &heights);
        let g = gradient(grid, &heights);
        let loads = [0.002 * g, 0.01 * g];
        let found = estimates(&p, "icha", &loads);
        let solved = path(&p, "fast", &loads);
        let single = estimates(&p, "srgw", &loads);
        load += 0.002;
        for k in 0..2 {
            assert_eq!(found[k].stop, Stop::Converged);
            areas[k] += found[k].area;
            exact[k] += contact_area(grid, Field::F64(&solved[k].gap), ContactEdges::ELASTIC).contact_area;
        }
        alone += single[1].area;
        println!(
            "seed {seed}: mean gap icha {} fast {} srgw {}",
            found[1].mean_gap, solved[1].mean_gap, single[1].mean_gap
        );
        // Measured: 0.960, 0.959, 0.950; the paper has 10 %.
        let gap = found[1].mean_gap / solved[1].mean_gap;
        assert!(gap > 0.94 && gap < 0.97, "{gap}");
    }
    let pressure = load / areas[0];
    println!("p_c/(E*g) {pressure}; areas icha {areas:?} fast {exact:?} srgw {alone}");
    // The paper has 0.5 to 15 %.
    assert!(near(pressure, PRESSURE, MEASURED), "{pressure}");
    for k in 0..2 {
        assert!(near(areas[k] / exact[k], AREAS[k], MEASURED), "{areas:?} {exact:?}");
    }
    assert!(alone < areas[1]);
}

/// With the whole spectrum of the challenge many contact spots overlap at large loads; the method converges, and the
/// area increases with load. The approach gives the mean gap of sparse spots alone.
#[test]
fn icha_converges_with_crowded_spots() {
    let (grid, heights) = rough(128, 128, 1e-3, 18);
    let g = gradient(grid, &heights);
    let found = estimates(&problem(grid, &heights), "icha", &[0.03, 0.1, 0.3].map(|p| p * g));
    assert!(
        found.iter().all(|f| f.stop == Stop::Converged && f.load_error < 1e-6),
        "{:?}",
        found.iter().map(|f| f.stop).collect::<Vec<_>>()
    );
    assert!(found.windows(2).all(|w| w[1].area > w[0].area) && found[2].area > 0.4);
    assert!(found[0].mean_gap > 0.0 && found[1].area > 0.2 && found[1..].iter().all(|f| f.mean_gap.is_nan()));
}

/// Estimates are bit-identical on one and two threads.
#[test]
fn threads_do_not_change_estimates() {
    let (grid, heights) = rough(128, 128, 1.0 / 24.0, 3);
    let p = problem(grid, &heights);
    for id in ["winkler", "srgw", "icha", "experiment"] {
        let on = |n: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
            pool.install(|| one(&p, id, 0.01))
        };
        let (a, b) = (on(1), on(2));
        assert!(a.area == b.area && a.gap == b.gap && a.stress == b.stress && a.clusters == b.clusters, "{id}");
    }
}

// Experiment model

fn laboratory<'p>(problem: ReducedProblem<'p>, experiment: ExperimentSettings) -> ReducedProblem<'p> {
    ReducedProblem { settings: Settings { experiment, ..Settings::default() }, ..problem }
}

/// With ideal printer and camera the contact is that of `fast`, on a half-space and on the layer of the experiment;
/// averaging over the window conserves the mean gap.
#[test]
fn experiment_with_ideal_camera_agrees_with_fast() {
    /// Rounding due to the offset of the heights.
    const SOLVED: f64 = 1e-9;
    let (grid, heights) = rough(256, 256, 1.0 / 32.0, 2);
    let perfect = ExperimentSettings {
        print_resolution: 0.0,
        pixel_size: 0.0,
        correlation_window: 0.0,
        ..ExperimentSettings::default()
    };
    for (thickness, differs) in [(100.0, false), (0.15, true)] {
        let kernel = Elastic::Layer(Layer { thickness, poisson: 0.5, base: Base::Bonded });
        let exact = solved(&ReducedProblem { kernel, ..problem(grid, &heights) }, "fast", 0.02);
        let p = laboratory(problem(grid, &heights), ExperimentSettings { thickness, ..perfect });
        let found = one(&p, "experiment", 0.02);
        assert_eq!(found.contact, contact_map(Field::F64(&exact.gap), perfect.optical_gap));
        assert!(found.gap.iter().zip(&exact.gap).all(|(a, b)| (a - b).abs() < SOLVED));
        let half_space = solved(&problem(grid, &heights), "fast", 0.02);
        assert_eq!(!near(exact.mean_gap, half_space.mean_gap, 1e-3), differs);
        let blurred = one(
            &laboratory(problem(grid, &heights), ExperimentSettings { thickness, correlation_window: 0.02, ..perfect }),
            "experiment",
            0.02,
        );
        assert!(near(blurred.mean_gap, exact.mean_gap, 1e-9) && blurred.gap != found.gap);
        assert_eq!(blurred.contact, found.contact);
    }
}

/// A coarser printer smooths the surface and increases the area; so does a larger optical gap; a coarser camera loses
/// small patches.
#[test]
fn experiment_resolution_changes_the_contact_area() {
    let (grid, heights) = rough(256, 256, 1.0 / 32.0, 2);
    let base = ExperimentSettings::default();
    let area = |settings: ExperimentSettings| {
        let found = one(&laboratory(problem(grid, &heights), settings), "experiment", 0.01);
        (found.area, cluster_sizes(&found.contact, 256, Connectivity::Eight, true).len())
    };
    let (sharp, patches) = area(base);
    assert!(area(ExperimentSettings { print_resolution: 1.0 / 40.0, ..base }).0 > 1.1 * sharp);
    assert!(area(ExperimentSettings { optical_gap: 1e-3, ..base }).0 > 1.2 * sharp);
    let (_, fewer) = area(ExperimentSettings { pixel_size: 1.0 / 64.0, ..base });
    assert!(fewer < patches, "{fewer} {patches}");
}

// Unsupported problems

/// Unsupported problems give a one-line error that names the method and the key.
#[test]
fn errors_name_the_unsupported_input() {
    let (grid, heights) = rough(64, 64, 1.0 / 16.0, 1);
    let base = problem(grid, &heights);
    let layer = Elastic::Layer(Layer { thickness: 0.1, poisson: 0.3, base: Base::Bonded });
    let soft = Wall::LennardJones(LennardJonesWall { strength: 1e-3, sigma: 1e-2 });
    let adhesion = AttractionLaw::exponential(1e-4, 1e-3);
    let flat = vec![1.0; 64 * 64];
    let settings = |settings: Settings| ReducedProblem { settings, ..base.clone() };
    let winkler = |spring_length, calibrate_to| with(base.clone(), WinklerSettings { spring_length, calibrate_to });
    let refused = |p: &ReducedProblem, id: &str, word: &str| {
        let error = methods::find(id).unwrap().start(p, &NoObserver).err().unwrap_or_else(|| panic!("{id}: {word}"));
        let error = error.to_string();
        assert!(error.contains(word) && error.contains(id) && !error.contains('\n'), "{id}: {error}");
    };
    for id in ["winkler", "srgw", "icha", "experiment"] {
        refused(&ReducedProblem { kernel: layer, ..base.clone() }, id, "kernel");
        refused(&ReducedProblem { wall: soft, ..base.clone() }, id, "wall");
        let mut run = methods::find(id).unwrap().start(&base, &NoObserver).unwrap().estimator().unwrap();
        for load in [Load::MeanGap(0.1), Load::Pressure(-0.1), Load::Pressure(f64::NAN)] {
            assert!(run.estimate(load).is_err(), "{id}: {load:?}");
        }
    }
    for id in ["winkler", "icha"] {
        refused(&ReducedProblem { adhesion, ..base.clone() }, id, "adhesion");
    }
    for id in ["srgw", "icha"] {
        refused(&problem(grid, &flat), id, "summit");
    }
    let calibrated = WinklerSettings { spring_length: None, calibrate_to: Some(0.03) };
    refused(&with(problem(grid, &flat), calibrated), "winkler", "flat");
    // Two height levels: the overlap fraction cannot be between 0 and 1/2.
    let steps: Vec<f64> = (0..64 * 64).map(|i| f64::from(i as u32 % 2)).collect();
    refused(&with(problem(grid, &steps), calibrated), "winkler", "steps");
    for bad in [winkler(Some(-1.0), None), winkler(Some(0.1), Some(0.1)), winkler(None, Some(1.5))] {
        refused(&bad, "winkler", "winkler.");
    }
    let icha = |steps_per_decade| IchaSettings { steps_per_decade, ..IchaSettings::default() };
    refused(&settings(Settings { icha: icha(0), ..Settings::default() }), "icha", "steps_per_decade");
    let thin = ExperimentSettings { thickness: 0.0, ..ExperimentSettings::default() };
    refused(&laboratory(base.clone(), thin), "experiment", "thickness");
}

/// A flat surface is in full contact.
#[test]
fn winkler_flat_surface_is_in_full_contact() {
    let grid = Grid::unit(8, 8);
    let flat = vec![3.0; 64];
    let found = one(&problem(grid, &flat), "winkler", 0.02);
    assert_eq!((found.area, found.mean_gap), (1.0, 0.0));
    assert!(found.stress.iter().all(|s| near(*s, 0.02, 1e-12)));
}

/// Ignored by default: seconds per node for one load from 512² to 4096² points, and deviations of patches and mean gaps
/// from `fast` for wider spectra (S19, S28).
#[test]
#[ignore = "minutes; prints measurements"]
fn measurements() {
    for n in [512, 1024, 2048, 4096] {
        let (grid, heights) = rough(n, n, 4.0 / n as f64, 1);
        let clock = std::time::Instant::now();
        one(&problem(grid, &heights), "winkler", 0.01);
        println!("winkler {n}²: {:.3e} s a node", clock.elapsed().as_secs_f64() / grid.points() as f64);
    }
    for n in [256, 512, 1024, 2048] {
        let (grid, heights) = rough(n, n, 8.0 / n as f64, 1);
        let p = problem(grid, &heights);
        let load = 0.01 * gradient(grid, &heights);
        let exact = solved(&p, "fast", load);
        let calibrated = with(p.clone(), WinklerSettings { spring_length: None, calibrate_to: Some(exact.area) });
        let clock = std::time::Instant::now();
        let [springs, single, interacting] =
            [(&calibrated, "winkler"), (&p, "srgw"), (&p, "icha")].map(|(p, id)| one(p, id, load));
        let map = contact_map(Field::F64(&exact.gap), 0.0);
        println!(
            "{n}²: a_t winkler/fast {:.2}; a fast {:.4} srgw {:.4} icha {:.4}; u fast {:.5} winkler {:.5} srgw {:.5} icha {:.5}; {:.1} s",
            typical(&springs.contact, n) / typical(&map, n),
            contact_area(grid, Field::F64(&exact.gap), ContactEdges::ELASTIC).contact_area,
            single.area,
            interacting.area,
            exact.mean_gap,
            springs.mean_gap,
            single.mean_gap,
            interacting.mean_gap,
            clock.elapsed().as_secs_f64(),
        );
    }
}

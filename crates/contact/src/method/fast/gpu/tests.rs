//! Every sweep of a level, on the GPU against the host. Without a GPU nothing is compared, and a line says so.

use super::super::fields::{LevelFields, Metric, Spring};
use super::super::host::{Host, LevelProblem};
use super::super::window::Window;
use super::fields::OnGpu;
use super::kernels::Kernels;
use crate::interface::{Base, CubicHalfSpace, Elastic, Exponential, HardWall, Law, Layer};
use crate::method::Precision;
use asperity_grid::sys::gpu::missing_library;
use asperity_grid::sys::ranks::ALONE;
use asperity_grid::{Grid, Real, Series};
use rustfft::num_complex::Complex;

/// Errors of sums and fields over the largest, in f32 and f64: of the state, and of the linear problem in f32.
const TOLERANCES: [(f64, f64); 2] = [(2e-5, 2e-4), (1e-11, 2e-4)];

/// Error of a gap that was moved along a direction: one of eight bits may be rounded to the other side.
const DIRECTION: f64 = 1.0 / 256.0;

fn has_gpu() -> bool {
    let missing = missing_library();
    missing.inspect(|library| eprintln!("not compared with a GPU: {library} is missing"));
    missing.is_none()
}

/// Relative difference of two lists of numbers, over the largest of the first.
fn difference(one: &[f64], other: &[f64]) -> f64 {
    let largest = one.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    assert_eq!(one.len(), other.len());
    let deviations = one.iter().zip(other).map(|(a, b)| if b.is_finite() { (a - b).abs() } else { f64::INFINITY });
    deviations.fold(0.0, f64::max) / largest.max(f64::MIN_POSITIVE)
}

fn wide<T: Real>(values: &[T]) -> Vec<f64> {
    values.iter().map(|v| v.wide()).collect()
}

/// Calls every function of both and compares what they return.
fn compared<T: Real, L: Law>(grid: Grid, kernel: Elastic, law: L, heights: &Series<T>, gamma: f64) {
    let (precision, (state, linear)) = match size_of::<T>() {
        4 => (Precision::F32, TOLERANCES[0]),
        _ => (Precision::F64, TOLERANCES[1]),
    };
    let kernels = Kernels::compiled(precision, gamma).expect("a GPU");
    let body = LevelProblem { kernel, law, heights, window: Window { nx: grid.nx, ny: grid.ny }, ranks: &ALONE };
    let gap: Vec<T> =
        (0..grid.points()).map(|i| T::of(1e-3 * ((i * 7919 % 1013) as f64 / 400.0 - 1.0).max(0.0))).collect();
    let mut host: Box<dyn LevelFields<T>> = Box::new(Host::new(grid, body, gap.clone()));
    let mut gpu: Box<dyn LevelFields<T>> = Box::new(OnGpu::new(&kernels, grid, body, gap.clone()));
    let equal = |description: &str, one: &[f64], other: &[f64], tolerance: f64| {
        let actual = difference(one, other);
        assert!(actual <= tolerance, "{} x {}, {kernel}, {precision:?}: {description} {actual:e}", grid.nx, grid.ny);
    };
    let spring = Spring { stiffness: 0.7, target: 1e-4 };
    host.allocate();
    gpu.allocate();
    let (mut scale, mut beta) = (0.0, 0.0);
    for _ in 0..2 {
        let trials = [&mut host, &mut gpu].map(|f| f.trial(scale, 0.01, spring, precision));
        equal("energy", &[trials[0].0], &[trials[1].0], state);
        for (one, other) in trials[0].1.iter().zip(&trials[1].1) {
            equal("sum of a trial", &[*one], &[*other], 10.0 * linear);
        }
        let [one, other] = [&mut host, &mut gpu].map(|f| f.plain(scale, beta, spring.stiffness));
        equal("plain step", &[one.0[0], one.1], &[other.0[0], other.1], linear);
        equal("curvature of the law", &[one.0[1]], &[other.0[1]], linear);
        (scale, beta) = (0.3, 0.4);
    }
    for f in [&mut host, &mut gpu] {
        f.trial(scale, 0.01, spring, precision);
    }
    let sums = [&mut host, &mut gpu].map(|f| {
        let [first, _] = f.begin(scale);
        let z = f.multiply(Metric::Compliance { mean_stiffness: 2.0 });
        let law_curvature = f.conjugate(0.0);
        let elastic_curvature = f.multiply(Metric::Stiffness { mean_stiffness: spring.stiffness });
        let [residual, _] = f.descend(z / elastic_curvature);
        let next = f.multiply(Metric::Compliance { mean_stiffness: 2.0 });
        let again = f.conjugate(next / z);
        [first, z, law_curvature, elastic_curvature, residual, next, again]
    });
    for (one, other) in sums[0].iter().zip(&sums[1]) {
        equal("linear problem", &[*one], &[*other], 100.0 * linear);
    }
    for f in [&mut host, &mut gpu] {
        f.apply(0.5);
        f.step_along_direction();
        f.apply(0.1);
        f.clear_step();
        f.apply(1.0);
    }
    equal("gap", &wide(host.gap()), &wide(gpu.gap()), DIRECTION);
    let same = host.gap().to_vec();
    *gpu.gap_mut() = same;
    let [one, other] = [&mut host, &mut gpu].map(|f| f.stress(0.01, spring));
    equal("stress", &wide(&one.1), &wide(&other.1), state);
    equal("energy of the state", &[one.0.0], &[other.0.0], state);
    let coarse = host.gap().to_vec();
    let fine = Grid { nx: 2 * grid.nx, ny: 2 * grid.ny, ..grid };
    let body = LevelProblem { window: Window { nx: fine.nx, ny: fine.ny }, ..body };
    let mut refined = Host::refined(fine, body, (grid, coarse.clone()));
    let clipped: Vec<f64> = refined.gap().iter().map(|g| g.wide().max(0.0)).collect();
    let mut on_gpu = OnGpu::new(&kernels, fine, body, Vec::new());
    on_gpu.interpolate(grid, &coarse);
    equal("interpolated gap", &clipped, &wide(on_gpu.gap()), state);
    assert!(!gpu.has_failed());
}

fn compared_in<T: Real>(grid: Grid) {
    let few: Series<f64> =
        Series::from_modes(3, 2, |kx, ky| Complex::new(1e-3 / (1 + kx * kx + ky * ky) as f64, 2e-4 * (kx - ky) as f64));
    let all = Series::through(grid, &|i| 1e-3 * ((i * 31 % 97) as f64 / 97.0));
    let crystal = CubicHalfSpace::new(168.4, 121.4, 75.4).expect("stable");
    let layer = Layer { thickness: 0.1, poisson: 0.3, base: Base::Bonded };
    let attraction = Exponential { gamma: 2e-5, rho: 1e-3 };
    for heights in [few, all] {
        for kernel in [Elastic::HalfSpace, Elastic::Cubic(crystal), Elastic::Layer(layer)] {
            compared::<T, _>(grid, kernel, HardWall, &heights.converted(), 0.0);
        }
        compared::<T, _>(grid, Elastic::HalfSpace, attraction, &heights.converted(), attraction.gamma);
    }
}

/// Even, odd, prime and oblong grids, a single row and a single column; all bodies, with and without attraction, waves fewer
/// than the grid's and all of them.
#[test]
fn sweeps_are_those_of_the_host() {
    if !has_gpu() {
        return;
    }
    let grids = [
        Grid::unit(64, 48),
        Grid::unit(63, 50),
        Grid { nx: 67, ny: 53, lx: 1.0, ly: 0.4 },
        Grid::unit(600, 2),
        Grid { nx: 48, ny: 1, lx: 1.0, ly: 1.0 },
        Grid { nx: 1, ny: 48, lx: 1.0, ly: 1.0 },
    ];
    for grid in grids {
        compared_in::<f32>(grid);
        compared_in::<f64>(grid);
    }
}

/// After a failure nothing more is done, no copy passes for the state, and the error names the card.
#[test]
fn a_failure_ends_the_solve() {
    if !has_gpu() {
        return;
    }
    let grid = Grid::unit(32, 32);
    let heights = Series::<f64>::from_modes(2, 2, |_, _| Complex::new(1e-3, 0.0));
    let kernels = Kernels::compiled(Precision::F64, 0.0).expect("a GPU");
    let body = LevelProblem {
        kernel: Elastic::HalfSpace,
        law: HardWall,
        heights: &heights,
        window: Window { nx: 32, ny: 32 },
        ranks: &ALONE,
    };
    let mut fields = OnGpu::new(&kernels, grid, body, vec![1e-3; grid.points()]);
    fields.allocate();
    assert!(fields.trial(0.0, 0.01, Spring::default(), Precision::F64).0.is_finite() && !fields.has_failed());
    kernels.attempt((), || Err("out of memory".into()));
    assert!(fields.has_failed() && fields.trial(0.0, 0.01, Spring::default(), Precision::F64).0.is_nan());
    let message = kernels.failure().expect("an error").to_string();
    assert!(message.contains("out of memory") && message.contains("--device cpu"), "{message}");
}

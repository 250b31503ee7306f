//! Times of a transform pair and of whole solves. Compare ratios within one run only.

use asperity::contact::interface::AttractionLaw;
use asperity::contact::method::{self, ContactMethod, Heights, Load, NoObserver, Precision, ReducedProblem};
use asperity::grid::{Grid, Real, Transform};
use asperity::methods;
use asperity::surface::{Modes, Spectrum};
use criterion::{Criterion, criterion_group, criterion_main};
use rustfft::num_complex::Complex;

fn pair<T: Real>(c: &mut Criterion) {
    let name = std::any::type_name::<T>();
    for n in [512, 1024] {
        let grid = Grid::unit(n, n);
        let transform = Transform::<T>::new(grid);
        let mut field = vec![T::one(); grid.points()];
        let mut spectrum = transform.spectrum();
        let scale = T::of(1.0 / grid.points() as f64);
        c.bench_function(&format!("transform pair {name} {n}²"), |b| {
            b.iter(|| {
                transform.forward(&field, &mut spectrum);
                transform.inverse(&mut spectrum, &mut field);
                field.iter_mut().for_each(|v| *v *= scale);
            });
        });
        c.bench_function(&format!("column pass {name} {n}²"), |b| {
            b.iter(|| transform.filter_columns(&mut spectrum, &|_: usize, _: &mut [Complex<T>]| 0.0));
        });
    }
}

fn transform_pair(c: &mut Criterion) {
    pair::<f32>(c);
    pair::<f64>(c);
}

/// The challenge's surface as a Fourier series, as for large grids; the benchmark `measure` times larger ones.
fn challenge(c: &mut Criterion) {
    let grid = Grid::unit(512, 512);
    let series = Modes::new(Spectrum::CHALLENGE, 1, 1.0).series().clone();
    let gamma: f64 = 2e-5;
    let adhesion = AttractionLaw::exponential(gamma, 1.4 * (gamma * grid.dx()).sqrt());
    for (name, adhesion) in [("", AttractionLaw::None), (" adhesive", adhesion)] {
        for (precision, tolerance) in [(Precision::F32, 1e-3), (Precision::F64, 1e-8)] {
            let heights = Heights::Series(&series);
            let problem = ReducedProblem { heights, tolerance, ..hard_wall(grid, adhesion, precision) };
            let method = methods::find("fast").expect("the default");
            c.bench_function(&format!("fast 512² {precision:?}{name}, p* = 0.01"), |b| {
                b.iter(|| load(method, &problem))
            });
        }
    }
}

/// A half-space with a hard wall; the heights are to be set.
fn hard_wall(grid: Grid, adhesion: AttractionLaw, precision: Precision) -> ReducedProblem<'static> {
    ReducedProblem {
        adhesion,
        precision,
        tolerance: 1e-6,
        max_iterations: 20_000,
        ..ReducedProblem::new(grid, Heights::Nodes(&[]))
    }
}

/// Number of iterations to p* = 0.01.
fn load(method: &dyn ContactMethod, problem: &ReducedProblem) -> usize {
    let mut run = method
        .start(problem, &NoObserver)
        .expect("a problem of this size starts")
        .solver()
        .expect("a problem of this size starts");
    run.equilibrate(Load::Pressure(0.01)).map(|s| s.iterations).expect("it converges")
}

fn solve(c: &mut Criterion) {
    let grid = Grid::unit(256, 256);
    let spectrum = Spectrum { lambda_s: 1.0 / 64.0, ..Spectrum::CHALLENGE };
    let heights: Vec<f64> = Modes::new(spectrum, 18, 1.0).heights(grid, 0.0);
    let gamma: f64 = 2.7e-4;
    let adhesion = AttractionLaw::exponential(gamma, 1.4 * (gamma * grid.dx()).sqrt());
    for (name, adhesion) in [("", AttractionLaw::None), (" adhesive", adhesion)] {
        let problem = ReducedProblem { heights: (&heights).into(), ..hard_wall(grid, adhesion, Precision::F64) };
        for method in methods::REGISTRY.iter().filter(|m| m.card().kind == method::MethodKind::Solver) {
            let id = method.card().id;
            c.bench_function(&format!("{id} 256²{name}, p* = 0.01"), |b| b.iter(|| load(*method, &problem)));
        }
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10);
    targets = transform_pair, solve, challenge
}
criterion_main!(benches);

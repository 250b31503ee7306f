//! Times of a transform pair and of whole solves. Compare ratios within one run: machines and their moods differ.

use asperity::grid::{Grid, Transform};
use asperity::interface::{Adhesion, Elastic, Wall};
use asperity::method::{self, Goals, Load, Precision, Problem, unwatched};
use asperity::surface::{Modes, Spectrum};
use criterion::{Criterion, criterion_group, criterion_main};
use rustfft::num_complex::Complex;

fn transform_pair(c: &mut Criterion) {
    for n in [512, 1024] {
        let grid = Grid::unit(n, n);
        let transform = Transform::<f64>::new(grid);
        let mut field = vec![1.0; grid.points()];
        let mut spectrum = transform.spectrum();
        c.bench_function(&format!("transform pair f64 {n}²"), |b| {
            b.iter(|| {
                transform.forward(&field, &mut spectrum);
                transform.inverse(&mut spectrum, &mut field);
                field.iter_mut().for_each(|v| *v /= grid.points() as f64);
            });
        });
        c.bench_function(&format!("column pass f64 {n}²"), |b| {
            b.iter(|| transform.filter_columns(&mut spectrum, &|_: usize, _: &mut [Complex<f64>]| 0.0));
        });
    }
}

fn solve(c: &mut Criterion) {
    let grid = Grid::unit(256, 256);
    let spectrum = Spectrum { lambda_s: 1.0 / 64.0, ..Spectrum::CHALLENGE };
    let heights: Vec<f64> = Modes::new(spectrum, 18, 1.0).heights(grid, 0.0);
    let gamma: f64 = 2.7e-4;
    let adhesion = Adhesion::exponential(gamma, 1.4 * (gamma * grid.dx()).sqrt());
    for (name, adhesion) in [("", Adhesion::None), (" adhesive", adhesion)] {
        let problem = Problem {
            grid,
            heights: (&heights).into(),
            kernel: Elastic::HalfSpace,
            adhesion,
            wall: Wall::Hard,
            precision: Precision::F64,
            tolerance: 1e-6,
            goals: Goals::default(),
            max_iterations: 20_000,
        };
        for method in method::REGISTRY {
            let id = method.card().id;
            c.bench_function(&format!("{id} 256²{name}, p* = 0.01"), |b| {
                b.iter(|| {
                    let mut run = method.start(&problem, &unwatched).expect("a problem of this size starts");
                    run.equilibrate(Load::Pressure(0.01)).map(|s| s.iterations).expect("it converges")
                });
            });
        }
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10);
    targets = transform_pair, solve
}
criterion_main!(benches);

//! Stress below the surface: Westergaard's wave, Hertz' contact, layers, and invariants of a stress.

use crate::found::{near, problem};
use asperity::contact::interface::{Base, Elastic, Layer, NonPeriodic, StressField, Subsurface, SubsurfaceRequest};
use asperity::contact::method::{Load, NoObserver, ReducedProblem};
use asperity::contact::path;
use asperity::grid::{Field, Grid};
use asperity::methods;
use std::f64::consts::{FRAC_PI_2, TAU};

const POISSON: f64 = 0.3;

fn below(grid: Grid, body: Elastic, pressure: &[f64]) -> Subsurface {
    Subsurface::new(grid, body, POISSON, Field::F64(pressure)).unwrap()
}

/// All six components under p (1 + cos q·r), along x and oblique.
#[test]
fn one_wave_has_westergaards_stresses() {
    const TOLERANCE: f64 = 1e-13;
    let grid = Grid { nx: 16, ny: 20, lx: 1.0, ly: 1.5 };
    for [kx, ky] in [[1, 0], [0, 2], [2, -3]] {
        let (qx, qy) = (TAU * f64::from(kx), TAU / 1.5 * f64::from(ky));
        let q = qx.hypot(qy);
        let (c, s) = (qx / q, qy / q);
        let phase = |i: usize| qx * (i % 16) as f64 * grid.dx() + qy * (i / 16) as f64 * grid.dy();
        let pressure: Vec<f64> = (0..grid.points()).map(|i| 0.2 * (1.0 + phase(i).cos())).collect();
        let body = below(grid, Elastic::HalfSpace, &pressure);
        for depth in [0.0, 0.02, 0.1, 0.5] {
            let StressField(found) = body.at(depth);
            let (x, fades) = (q * depth, (-q * depth).exp());
            for i in 0..grid.points() {
                let (cosine, sine) = (0.2 * phase(i).cos() * fades, 0.2 * phase(i).sin() * fades);
                // Johnson, eqs. 13.8: along the wave, across it, and with the depth; the mean pressure without strain.
                let (along, across, shear) = (-(1.0 - x) * cosine, -2.0 * POISSON * cosine, -x * sine);
                let mean = -0.2 * POISSON / (1.0 - POISSON);
                let expected = [
                    mean + c * c * along + s * s * across,
                    mean + s * s * along + c * c * across,
                    -0.2 - (1.0 + x) * cosine,
                    c * s * (along - across),
                    c * shear,
                    s * shear,
                ];
                for (k, (found, expected)) in found.iter().zip(expected).enumerate() {
                    assert!((found[i] - expected).abs() < TOLERANCE, "{kx} {ky} {depth} {k}: {} {expected}", found[i]);
                }
            }
        }
    }
}

/// Hertz' stresses on the axis over the peak pressure, at the depth ζ over the radius: radial, along the depth.
fn on_axis(zeta: f64) -> [f64; 2] {
    let squared = 1.0 + zeta * zeta;
    [-(1.0 + POISSON) * (1.0 - zeta * (FRAC_PI_2 - zeta.atan())) + 0.5 / squared, -1.0 / squared]
}

/// A pressure √(1 - r²/a²) around the middle node of `n` by `n`, means over the nodes' rectangles; a = 0.3.
fn hertz(n: usize) -> (Grid, Vec<f64>, usize) {
    const RADIUS: f64 = 0.3;
    const PARTS: usize = 16;
    let at = |i: usize, part: usize| {
        (i as f64 - (n / 2) as f64 + (part as f64 + 0.5) / PARTS as f64 - 0.5) / n as f64 / RADIUS
    };
    let mean = |i: usize| {
        let of = |k: usize| 1.0 - at(i % n, k % PARTS).powi(2) - at(i / n, k / PARTS).powi(2);
        (0..PARTS * PARTS).map(|k| of(k).max(0.0).sqrt()).sum::<f64>() / (PARTS * PARTS) as f64
    };
    let pressure = (0..n * n).map(mean).collect();
    (Grid::unit(n, n), pressure, n / 2 * (n + 1))
}

/// On the axis of a Hertzian pressure: the stresses, with errors that fall at least in proportion to the spacing, and the largest shear
/// stress, 0.31 of the peak pressure at 0.48 of the radius.
#[test]
fn below_a_sphere_are_hertz_stresses() {
    let error = |n: usize| {
        let (grid, pressure, axis) = hertz(n);
        let body = below(grid, Elastic::NonPeriodic(NonPeriodic::of_region(1.0, 1.0)), &pressure);
        [0.2, 0.5, 1.0].map(|zeta| {
            let StressField(found) = body.at(0.3 * zeta);
            let [radial, deep] = on_axis(zeta);
            let expected = [radial, radial, deep, 0.0, 0.0, 0.0];
            found.iter().zip(expected).map(|(f, e)| (f[axis] - e).abs()).fold(0.0, f64::max)
        })
    };
    let [coarse, middle, fine] = [16, 32, 64].map(error);
    for k in 0..3 {
        assert!(middle[k] < 0.5 * coarse[k] && fine[k] < 0.5 * middle[k], "{coarse:?} {middle:?} {fine:?}");
    }
    assert!(fine.iter().all(|e| *e < 2e-3), "{fine:?}");

    let (grid, pressure, axis) = hertz(64);
    let kernel = Elastic::NonPeriodic(NonPeriodic::of_region(1.0, 1.0));
    let depths: Vec<f64> = (0..17).map(|k| 0.3 * (0.40 + 0.01 * f64::from(k))).collect();
    let request = SubsurfaceRequest { depths, poisson: POISSON, shear_strength: Some(0.2) };
    let p = ReducedProblem { kernel, ..problem(grid, &pressure) };
    let mut maps = 0;
    let found = path::subsurface(&request, (p.grid, p.kernel), Field::F64(&pressure), |_, _, map| {
        assert_eq!(map.len(), grid.points());
        maps += 1;
        Ok(None)
    });
    let found = found.unwrap();
    assert_eq!((maps, found.slices.len()), (34, 17));
    let shear = &found.shear;
    assert!(near(shear.value, 0.310, 2e-3) && (shear.depth / 0.3 - 0.48).abs() < 0.011, "{shear:?}");
    assert_eq!((shear.x, shear.y), ((axis % 64) as f64 / 64.0, (axis / 64) as f64 / 64.0));
    assert!(near(found.shear_over_strength.unwrap(), shear.value / 0.2, 1e-15));
    // On the axis two principal stresses are equal: the equivalent stress is twice the shear stress.
    assert!(near(found.von_mises.value, 2.0 * shear.value, 1e-3), "{found:?}");
}

/// A load at the first and at the last node of a patch: the normal stress of one is that of the other, seen from the opposite corner.
#[test]
fn loads_at_opposite_corners_have_mirrored_stresses() {
    /// Rounding of the transforms; the stress under the load is near one half.
    const TOLERANCE: f64 = 1e-14;
    let (n, depth) = (12, 0.1);
    let kernel = Elastic::NonPeriodic(NonPeriodic::of_region(1.0, 1.0));
    let normal = |loaded: usize| {
        let mut pressure = vec![0.0; n * n];
        pressure[loaded] = 1.0;
        let StressField([_, _, zz, ..]) = below(Grid::unit(n, n), kernel, &pressure).at(depth);
        zz
    };
    let (first, last) = (normal(0), normal(n * n - 1));
    for (a, b) in first.iter().zip(last.iter().rev()) {
        assert!((a - b).abs() < TOLERANCE, "{a} {b}");
    }
}

/// The pressure of a solver under a sphere, and the same patch in a large periodic cell.
#[test]
fn a_solved_contact_has_the_same_stresses() {
    let n = 64;
    let grid = Grid::unit(n, n);
    let at = |i: usize| ((i as f64 - 32.0) / n as f64).powi(2);
    let heights: Vec<f64> = (0..n * n).map(|i| 0.5 * (at(i % n) + at(i / n))).collect();
    let kernel = Elastic::NonPeriodic(NonPeriodic::of_region(1.0, 1.0));
    let p = ReducedProblem { kernel, tolerance: 1e-7, ..problem(grid, &heights) };
    // Hertz: a = 0.3, peak 2a/π, load 4a³/3.
    let (radius, peak, load) = (0.3, 0.6 / std::f64::consts::PI, 4.0 / 3.0 * 0.027);
    let mut run = methods::find("fast").unwrap().start(&p, &NoObserver).unwrap().solver().unwrap();
    let stress = run.equilibrate(Load::Pressure(load)).unwrap().stress.to_vec();
    let axis = 32 * (n + 1);
    let StressField(found) = below(grid, kernel, &stress).at(0.48 * radius);
    let [radial, deep] = on_axis(0.48).map(|s| s * peak);
    assert!(
        near(found[0][axis], radial, 0.02) && near(found[2][axis], deep, 0.01),
        "{} {}",
        found[0][axis],
        found[2][axis]
    );

    // Rectangles of the patch against waves of a cell 4 times as large; what remains are its images and its mean strain.
    let cell = Grid { nx: 4 * n, ny: 4 * n, lx: 4.0, ly: 4.0 };
    let mut pressure = vec![0.0; cell.points()];
    for (y, row) in stress.chunks(n).enumerate() {
        pressure[y * cell.nx..][..n].copy_from_slice(row);
    }
    let StressField(waves) = below(cell, Elastic::HalfSpace, &pressure).at(0.48 * radius);
    for (k, (waves, patch)) in waves.iter().zip(&found).enumerate() {
        for i in (0..n * n).step_by(37) {
            let apart = (waves[i / n * cell.nx + i % n] - patch[i]).abs();
            assert!(apart < 0.012 * peak, "{k} {i}: {apart} {peak}");
        }
    }
}

/// A deep layer is a half-space. Nothing is strained along the base of a bonded layer; a free base carries the mean pressure.
#[test]
fn layers_end_at_their_base() {
    let (grid, pressure, _) = hertz(32);
    let layer = |thickness, base| Elastic::Layer(Layer { thickness, poisson: POISSON, base });
    for base in [Base::Bonded, Base::ConstantStress] {
        for depth in [0.0, 0.1, 0.3] {
            let (deep, half) = (
                below(grid, layer(8.0, base), &pressure).at(depth),
                below(grid, Elastic::HalfSpace, &pressure).at(depth),
            );
            let pairs = deep.0.iter().flatten().zip(half.0.iter().flatten());
            let most = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(most < 1e-13, "{base:?} {depth}: {most}");
        }
    }
    let StressField([xx, yy, zz, xy, ..]) = below(grid, layer(0.2, Base::Bonded), &pressure).at(0.2);
    for i in 0..grid.points() {
        let strains = [xx[i] - POISSON * (yy[i] + zz[i]), yy[i] - POISSON * (xx[i] + zz[i]), xy[i]];
        assert!(strains.iter().all(|e| e.abs() < 1e-14), "{strains:?}");
    }
    let mean = pressure.iter().sum::<f64>() / pressure.len() as f64;
    let StressField([_, _, zz, _, xz, yz]) = below(grid, layer(0.2, Base::ConstantStress), &pressure).at(0.2);
    for i in 0..grid.points() {
        assert!((zz[i] + mean).abs() < 1e-12 && xz[i].abs() < 1e-12 && yz[i].abs() < 1e-12);
    }
}

/// Tension, shear, equal pressure on all sides, and principal stresses 3, 1, -2 in turned axes.
#[test]
fn equivalents_are_those_of_the_principal_stresses() {
    /// Where two principal stresses are equal: rounding of the cosine of an angle near zero.
    const TOLERANCE: f64 = 2e-8;
    let (c, s) = (0.6, 0.8);
    // diag(3, 1, -2) turned about z, then about x.
    let (a, b, d) = (3.0 * c * c + s * s, 3.0 * s * s + c * c, 2.0 * c * s);
    let turned = [a, b * c * c - 2.0 * s * s, b * s * s - 2.0 * c * c, d * c, d * s, (b + 2.0) * c * s];
    for (stress, von_mises, shear) in [
        ([2.0, 0.0, 0.0, 0.0, 0.0, 0.0], 2.0, 1.0),
        ([0.0, 0.0, -3.0, 0.0, 0.0, 0.0], 3.0, 1.5),
        ([0.0, 0.0, 0.0, 0.5, 0.0, 0.0], 0.5 * 3f64.sqrt(), 0.5),
        ([0.0, 0.0, 0.0, 0.0, 0.0, -0.5], 0.5 * 3f64.sqrt(), 0.5),
        ([-4.0, -4.0, -4.0, 0.0, 0.0, 0.0], 0.0, 0.0),
        (turned, 19f64.sqrt(), 2.5),
    ] {
        let [found_von_mises, found_shear] = StressField(stress.map(|s| vec![s])).equivalent(0);
        assert!((found_von_mises - von_mises).abs() < 1e-14, "{stress:?}: {found_von_mises}");
        assert!((found_shear - shear).abs() < TOLERANCE, "{stress:?}: {found_shear}");
    }
}

/// Stresses under a pressure and under its transpose are transposes, those of waves of two nodes included.
#[test]
fn a_transposed_pressure_has_transposed_stresses() {
    /// Rounding of the transforms, over the largest pressure.
    const TOLERANCE: f64 = 1e-14;
    let (grid, turned) = (Grid { nx: 8, ny: 6, lx: 1.0, ly: 0.9 }, Grid { nx: 6, ny: 8, lx: 0.9, ly: 1.0 });
    let at = |x: usize, y: usize| ((7 * x + 13 * y * y + x * y * 5) % 11) as f64 / 11.0;
    let pressure: Vec<f64> = (0..48).map(|i| at(i % 8, i / 8)).collect();
    let transposed: Vec<f64> = (0..48).map(|i| at(i / 6, i % 6)).collect();
    for depth in [0.0, 0.05] {
        let StressField(stresses) = below(grid, Elastic::HalfSpace, &pressure).at(depth);
        let StressField(other) = below(turned, Elastic::HalfSpace, &transposed).at(depth);
        for (component, same) in [(0, 1), (1, 0), (2, 2), (3, 3), (4, 5), (5, 4)] {
            for i in 0..48 {
                let (value, expected) = (stresses[component][i], other[same][i % 8 * 6 + i / 8]);
                assert!((value - expected).abs() < TOLERANCE, "{component} at {i}: {value} {expected}");
            }
        }
    }
}

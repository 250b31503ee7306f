//! A non-periodic patch on a half-space: Hertzian contact at any position, and adhesion.

use crate::found::{rough, solved};
use asperity::contact::interface::{AttractionLaw, Elastic, NonPeriodic, PenaltyWall, RangeChoice, Wall};
use asperity::contact::method::{Equilibrium, Load, NoObserver, ReducedProblem, Stop};
use asperity::contact::observe::{Connectivity, ContactEdges, cluster_sizes, contact_area, contact_map, leakage};
use asperity::contact::observed::observed;
use asperity::contact::path::LoadPathSolver;
use asperity::grid::{Grid, extent};
use asperity::methods;
use std::f64::consts::{PI, TAU};

fn problem(grid: Grid, heights: &[f64]) -> ReducedProblem<'_> {
    let kernel = Elastic::NonPeriodic(NonPeriodic::of_region(grid.lx, grid.ly));
    ReducedProblem { kernel, tolerance: 1e-9, max_iterations: 10_000, ..ReducedProblem::new(grid, heights) }
}

fn solve<R>(problem: &ReducedProblem, load: f64, look: impl FnOnce(&Equilibrium) -> R) -> R {
    let mut run = methods::find("fast").unwrap().start(problem, &NoObserver).unwrap().solver().unwrap();
    let state = run.equilibrate(Load::Pressure(load)).unwrap();
    assert_eq!(state.stop, Stop::Converged, "residual {}", state.residual);
    look(&state)
}

/// The paraboloid r²/2 about the node (x, y).
fn sphere(grid: Grid, (x, y): (usize, usize)) -> Vec<f64> {
    let squared = |i: usize, j: usize| {
        let (dx, dy) = ((i as f64 - x as f64) * grid.dx(), (j as f64 - y as f64) * grid.dy());
        dx * dx + dy * dy
    };
    (0..grid.points()).map(|k| 0.5 * squared(k % grid.nx, k / grid.nx)).collect()
}

/// Johnson, Kendall & Roberts (1971): the pull-off force of a sphere is 3/2 πγR. There are no images.
#[test]
fn a_sphere_is_pulled_off() {
    /// At a Tabor parameter of 3.1 the pull-off is larger than in the limit; measured: 2.9 %.
    const TOLERANCE: f64 = 0.03;
    let (n, gamma) = (96, 8e-3);
    let grid = Grid::unit(n, n);
    let heights = sphere(grid, (48, 48));
    let adhesion = AttractionLaw::exponential(gamma, 1.4 * (gamma / n as f64).sqrt());
    let p = ReducedProblem { adhesion, ..problem(grid, &heights) };
    // Under this tension the contact has left the edges of the patch.
    let loads = [Load::Pressure(-0.9 * PI * gamma)];
    let path = LoadPathSolver::new(p, methods::find("fast").unwrap(), RangeChoice::Mesh, 0.0, &loads);
    let pulled = path.walk(None, true, &NoObserver, |_, _| Ok(())).unwrap().unwrap();
    let force = -pulled.pressure / (PI * gamma);
    assert!((force / 1.5 - 1.0).abs() < TOLERANCE, "{force}");
    assert_eq!(pulled.pressure_error, None, "no coarser grid");
}

/// Hertz (1882), R = E* = 1, with the sphere off the centre of the patch: pressure, gap, elastic and free energy 2/5
/// and -3/5 of the force times the approach. There are no images.
#[test]
fn hertz_without_images() {
    /// Relative tolerances of the pressure away from the edge, the approach, the energies and the area, for contact
    /// radii of 13 nodes.
    const PRESSURE: f64 = 0.01;
    const GAP: f64 = 2e-3;
    const ENERGY: f64 = 2e-3;
    const AREA: f64 = 0.04;
    for (grid, middle) in
        [(Grid::unit(128, 128), (64, 64)), (Grid::unit(128, 128), (20, 30)), (Grid::unit(160, 100), (40, 60))]
    {
        let a = 13.3 * grid.dx();
        let (force, approach, highest) = (4.0 / 3.0 * a.powi(3), a * a, 2.0 * a / PI);
        let heights = sphere(grid, middle);
        let pressure = force / (grid.lx * grid.ly);
        // The slopes of the paraboloid are the coordinates, here midway between nodes.
        let slopes = heights.iter().sum::<f64>() * 2.0 / heights.len() as f64;
        assert!((problem(grid, &heights).resolved_gradient() / slopes.sqrt() - 1.0).abs() < 0.02);
        let load = solve(&problem(grid, &heights), pressure, |s| {
            let mut sum = 0.0;
            for (k, h) in heights.iter().enumerate() {
                let r = (2.0 * h).sqrt();
                sum += s.stress.at(k);
                if (r / a - 1.0).abs() > 0.15 {
                    let expected = highest * (1.0 - (r / a).powi(2)).max(0.0).sqrt();
                    assert!((s.stress.at(k) - expected).abs() < PRESSURE * highest, "{k}: {}", s.stress.at(k));
                }
                if r > 1.15 * a {
                    let lifted = ((2.0 * a * a - r * r) * (a / r).asin() + a * (r * r - a * a).sqrt()) / PI;
                    let expected = h - approach + lifted;
                    assert!((s.gap.at(k) - expected).abs() < GAP * approach, "{k}: {} {expected}", s.gap.at(k));
                }
            }
            let work = force * approach / (grid.lx * grid.ly);
            assert!((s.elastic_energy / (0.4 * work) - 1.0).abs() < ENERGY, "{}", s.elastic_energy / work);
            assert!((s.energy / (-0.6 * work) - 1.0).abs() < ENERGY, "{}", s.energy / work);
            let area = contact_area(grid, s.gap, ContactEdges::ELASTIC).contact_area * grid.lx * grid.ly;
            assert!((area / (PI * a * a) - 1.0).abs() < AREA, "{area}");
            sum / grid.points() as f64
        });
        assert!((load / pressure - 1.0).abs() < 1e-9, "{load}");
    }
}

/// The results do not depend on the position of the sphere on the patch, within the tolerance of the solver.
#[test]
fn a_shift_changes_nothing() {
    /// Measured with adhesion: 9e-7 and 6e-6; without: less than a tenth.
    const ENERGY: f64 = 2e-6;
    const ELASTIC: f64 = 1e-5;
    let grid = Grid::unit(96, 96);
    let gamma = 2e-4;
    let adhesion = AttractionLaw::exponential(gamma, 1.5 * (gamma * grid.dx()).sqrt());
    for adhesion in [AttractionLaw::None, adhesion] {
        let found = [(48, 48), (24, 24), (70, 40)].map(|middle| {
            let heights = sphere(grid, middle);
            let p = ReducedProblem { adhesion, ..problem(grid, &heights) };
            solve(&p, 1e-3, |s| (s.energy, s.elastic_energy, contact_area(grid, s.gap, ContactEdges::COUNTED).count))
        });
        for other in &found[1..] {
            assert!((other.0 / found[0].0 - 1.0).abs() < ENERGY, "{found:?}");
            assert!((other.1 / found[0].1 - 1.0).abs() < ELASTIC && other.2 == found[0].2, "{found:?}");
        }
    }
}

/// Quantities that need a periodic cell are refused; a detached patch is reported.
#[test]
fn what_a_patch_cannot_have() {
    let grid = Grid::unit(32, 32);
    let heights = sphere(grid, (16, 16));
    let p = problem(grid, &heights);
    for id in ["gfmd", "bvm"] {
        let refused = methods::find(id).unwrap().start(&p, &NoObserver).err().expect("refused").to_string();
        assert!(refused.contains("non-periodic") && refused.contains("`fast`"), "{refused}");
    }
    let mut run = methods::find("fast").unwrap().start(&p, &NoObserver).unwrap().solver().unwrap();
    let refused = run.equilibrate(Load::MeanGap(0.1)).expect_err("refused").to_string();
    assert!(refused.contains("non-periodic"), "{refused}");
    assert_eq!(run.equilibrate(Load::Pressure(-0.1)).unwrap().stop, Stop::Detached);
}

/// Light loads on steep maps, at which interpolation from a coarser grid lifts all contact: a flat punch (Boussinesq:
/// force 2aE*δ, work ½ force times δ), pillars, and a sphere whose contact is a few nodes wide (Hertz).
#[test]
fn light_loads_on_steep_maps() {
    /// Relative errors of the energy: the radius of a punch of 32 nodes is uncertain by half a node; for the sphere the
    /// contact is 4.5 nodes wide.
    const PUNCH: f64 = 0.02;
    const SPHERE: f64 = 0.03;
    /// Solver's tolerance of the energies under two loads on the same contact.
    const PROPORTIONAL: f64 = 1e-3;
    let grid = Grid::unit(128, 128);
    let from_centre = |k: usize| {
        let middle = |i: usize, n: usize| (i as f64 + 0.5) / n as f64 - 0.5;
        (middle(k % grid.nx, grid.nx), middle(k / grid.nx, grid.ny))
    };
    let radius = 0.25;
    let punch: Vec<f64> =
        (0..grid.points()).map(|k| f64::from(from_centre(k).0.hypot(from_centre(k).1) >= radius)).collect();
    for pressure in [1e-2, 1e-5] {
        let (energy, contact) = solve(&ReducedProblem { tolerance: 1e-7, ..problem(grid, &punch) }, pressure, |s| {
            (s.energy, contact_area(grid, s.gap, ContactEdges::COUNTED).contact_nodes)
        });
        let expected = -0.5 * pressure * pressure / (2.0 * radius);
        assert!((energy / expected - 1.0).abs() < PUNCH, "{pressure}: {energy} {expected}");
        // All nodes of the flat end touch.
        let nodes = punch.iter().filter(|h| **h == 0.0).count();
        assert_eq!((contact * grid.points() as f64).round() as usize, nodes, "{pressure}");
    }
    let on_pillar = |k: usize| (k % grid.nx / 16).is_multiple_of(2) && (k / grid.nx / 16).is_multiple_of(2);
    let pillars: Vec<f64> = (0..grid.points()).map(|k| if on_pillar(k) { 0.0 } else { 0.05 }).collect();
    let [light, heavier] = [1e-4, 1e-3]
        .map(|p| solve(&ReducedProblem { tolerance: 1e-7, ..problem(grid, &pillars) }, p, |s| s.energy / (p * p)));
    assert!((light / heavier - 1.0).abs() < PROPORTIONAL, "{light} {heavier}");
    let heights = sphere(grid, (64, 64));
    let pressure = 5e-6_f64;
    let approach = (0.75 * pressure).powf(2.0 / 3.0);
    let energy = solve(&problem(grid, &heights), pressure, |s| s.energy);
    let expected = -0.6 * pressure * approach;
    assert!((energy / expected - 1.0).abs() < SPHERE, "{energy} {expected}");
}

/// The displacement from first contact: a²/R of Hertz and F/2aE* of a flat punch without images; of a periodic wave in full
/// contact the mean height above the lowest point.
#[test]
fn displacement_from_first_contact() {
    /// Of the contact radius on the grid: half a node of 32 for the punch; the sphere's contact is 27 nodes wide.
    const PUNCH: f64 = 0.02;
    const SPHERE: f64 = 3e-3;
    const FULL: f64 = 1e-9;
    let displacement = |problem: ReducedProblem, load: f64| {
        let loads = [Load::Pressure(load)];
        let path = LoadPathSolver::new(problem, methods::find("fast").unwrap(), RangeChoice::Mesh, 0.0, &loads);
        let mut found = f64::NAN;
        path.walk(None, false, &NoObserver, |_, reached| {
            assert_eq!(reached.state.stop, Stop::Converged);
            found = reached.displacement;
            Ok(())
        })
        .unwrap();
        found
    };
    let grid = Grid::unit(64, 64);
    let a = 13.3 * grid.dx();
    let found = displacement(problem(grid, &sphere(grid, (32, 32))), 4.0 / 3.0 * a.powi(3));
    assert!((found / (a * a) - 1.0).abs() < SPHERE, "{found} {}", a * a);
    let middle = |i: usize| (i as f64 + 0.5) / 64.0 - 0.5;
    let radius = 0.25;
    let punch: Vec<f64> = (0..64 * 64).map(|k| f64::from(middle(k % 64).hypot(middle(k / 64)) >= radius)).collect();
    let found = displacement(problem(grid, &punch), 0.01);
    assert!((found / (0.01 / (2.0 * radius)) - 1.0).abs() < 2.0 * PUNCH, "{found}");
    let wave: Vec<f64> = (0..64 * 64).map(|k| 0.01 * (2.0 * PI * (k % 64) as f64 / 64.0).cos()).collect();
    let found = displacement(ReducedProblem::new(grid, &wave), 0.1);
    assert!((found / 0.01 - 1.0).abs() < FULL, "{found}");
}

/// Stiffness of Hertzian contact, dF/dδ = 2aE*, at every load of a path.
#[test]
fn stiffness_of_a_sphere() {
    /// A sixth of a node of radii of 8 to 15 nodes; measured up to 0.021.
    const NODES: f64 = 0.025;
    let grid = Grid::unit(64, 64);
    let heights = sphere(grid, (32, 32));
    let radii = [0.12, 0.17, 0.24];
    let loads = radii.map(|a: f64| Load::Pressure(4.0 / 3.0 * a.powi(3)));
    let path =
        LoadPathSolver::new(problem(grid, &heights), methods::find("fast").unwrap(), RangeChoice::Mesh, 0.0, &loads);
    let mut found = Vec::new();
    path.with_stiffness()
        .walk(None, false, &NoObserver, |_, reached| {
            let error = reached.stiffness_error().expect("known");
            found.push((reached.state.stiffness.expect("in contact"), error));
            Ok(())
        })
        .unwrap();
    for ((k, error), a) in found.into_iter().zip(radii) {
        let miss = k / (2.0 * a) - 1.0;
        assert!(miss.abs() < NODES && miss.abs() * k <= error, "{a}: {miss} {error}");
    }
}

/// Displacement (L/E*) at a distance of (x, y) from a node under the stress E* that the waves of the grid make of this node alone: Boussinesq's
/// 2/q over the wave vectors that the grid has, ∫∫ (2/q) cos(q·r) dq / (2π)², in closed form along q.
fn displacement_by_one_node(grid: Grid, (x, y): (f64, f64)) -> f64 {
    const ANGLES: usize = 4000;
    let (dx, dy) = (grid.dx(), grid.dy());
    let along = |k: usize| {
        let (sine, cosine) = (TAU * (k as f64 + 0.5) / ANGLES as f64).sin_cos();
        let end = (PI / (dx * cosine.abs())).min(PI / (dy * sine.abs()));
        let phase = end * (x * cosine + y * sine);
        if phase.abs() < 1e-9 { end } else { end * phase.sin() / phase }
    };
    2.0 * dx * dy / (TAU * TAU) * TAU / ANGLES as f64 * (0..ANGLES).map(along).sum::<f64>()
}

/// Stress and gap against a direct sum over all nodes, which has no transform, no padding and no table: the gap without heights and elastic
/// displacement is the same at every node. With the sign conditions, and the law of the wall, this is equilibrium.
#[test]
fn fields_satisfy_the_direct_sum() {
    /// Over the largest displacement: waves at the edge of the spectrum are integrated here, and summed over the
    /// padded cell there. Measured: at most 1e-4.
    const DIRECT: f64 = 2e-4;
    /// Stresses over the pressure: where the gap is open, negative ones, and differences from the laws of wall and adhesion.
    const SIGNS: f64 = 1e-6;
    let gamma: f64 = 1e-4;
    let range = 1.4 * (gamma / 24.0).sqrt();
    let adhesive = AttractionLaw::exponential(gamma, range);
    let walls = [1e-3, 1e-5].map(|length| Wall::Penalty(PenaltyWall { length }));
    for (nx, ny) in [(24, 24), (32, 20)] {
        let grid = Grid { nx, ny, lx: 1.0, ly: 0.8 * ny as f64 / nx as f64 };
        let (_, heights) = rough(nx, ny, 1.0 / 8.0, 3);
        let table: Vec<f64> = (0..nx * ny)
            .map(|i| displacement_by_one_node(grid, ((i % nx) as f64 * grid.dx(), (i / nx) as f64 * grid.dy())))
            .collect();
        let between = |i: usize, j: usize| table[(i / nx).abs_diff(j / nx) * nx + (i % nx).abs_diff(j % nx)];
        for (wall, adhesion) in [
            (Wall::Hard, AttractionLaw::None),
            (walls[0], AttractionLaw::None),
            (walls[1], AttractionLaw::None),
            (Wall::Hard, adhesive),
        ] {
            for pressure in [1e-3, 1e-2] {
                let p = ReducedProblem { wall, adhesion, ..problem(grid, &heights) };
                let found = solved(&p, "fast", pressure);
                let what = format!("{nx} x {ny}, {wall}, {adhesion}, {pressure}");
                let lifted: Vec<f64> =
                    (0..nx * ny).map(|i| (0..nx * ny).map(|j| between(i, j) * found.stress[j]).sum()).collect();
                let approach: Vec<f64> = (0..nx * ny).map(|i| found.gap[i] - heights[i] - lifted[i]).collect();
                let (low, high) = extent(&approach);
                let largest = lifted.iter().copied().fold(0.0, f64::max);
                assert!(high - low < DIRECT * largest, "{what}: {:e}", (high - low) / largest);
                for (gap, stress) in found.gap.iter().zip(&found.stress) {
                    match wall {
                        Wall::Penalty(PenaltyWall { length }) => {
                            let of_the_wall = (-gap / length).max(0.0);
                            assert!((stress - of_the_wall).abs() < SIGNS * pressure, "{what}: {stress} {of_the_wall}");
                        }
                        _ if adhesion == AttractionLaw::None => {
                            assert!(*gap >= 0.0 && *stress >= -SIGNS * pressure, "{what}: {gap} {stress}");
                            assert!(*gap == 0.0 || stress.abs() < SIGNS * pressure, "{what}: {gap} {stress}");
                        }
                        _ => {
                            // Pressed together, a node carries more than the attraction; apart, that of its gap.
                            let excess = stress + gamma / range * (-gap / range).exp();
                            assert!(*gap >= 0.0 && excess >= -SIGNS * pressure, "{what}: {gap} {excess}");
                            assert!(*gap == 0.0 || excess < SIGNS * pressure, "{what}: {gap} {excess}");
                        }
                    }
                }
                let mean = found.stress.iter().sum::<f64>() / (nx * ny) as f64;
                assert!((mean / pressure - 1.0).abs() < SIGNS, "{what}: {mean}");
            }
        }
    }
}

/// Contact clusters, paths and edges of a patch end at its sides: they are those of the same map with an open border, and the gap percolates
/// where fluid flows.
#[test]
fn what_touches_opposite_sides_is_not_connected() {
    let mut seams = 0;
    for (seed, load) in (1..7).flat_map(|seed| [(seed, 0.02), (seed, 0.1)]) {
        let (grid, heights) = rough(40, 32, 0.2, seed);
        solve(&problem(grid, &heights), load, |state| {
            let map = contact_map(state.gap, 0.0);
            let bordered: Vec<u8> = (0..grid.ny + 1)
                .flat_map(|y| (0..grid.nx + 1).map(move |x| (x, y)))
                .map(|(x, y)| if x < grid.nx && y < grid.ny { map[y * grid.nx + x] } else { 0 })
                .collect();
            let mut sizes = [
                cluster_sizes(&bordered, grid.nx + 1, Connectivity::Eight, true),
                cluster_sizes(&map, grid.nx, Connectivity::Eight, false),
            ];
            sizes.iter_mut().for_each(|list| list.sort_unstable());
            assert_eq!(sizes[0], sizes[1], "seed {seed}");
            seams += usize::from(sizes[1].len() != cluster_sizes(&map, grid.nx, Connectivity::Eight, true).len());
            let (observed, _) = observed(grid, state, 0.0, 0.1, (false, false));
            assert_eq!(observed.clusters(), sizes[1].len());
            let flow = leakage(grid, state.gap, 0.0, false).expect("converges");
            assert_eq!(observed.gap_percolates, Some(flow.conductivity.map(|c| c > 0.0)), "seed {seed} at {load}");
            // Edges between neighbours inside of the patch, and none on its border.
            let edges = |step: usize, ends: &dyn Fn(usize) -> bool| {
                (0..map.len()).filter(|&i| !ends(i) && map[i] != map[i + step]).count() as f64
            };
            let along = edges(1, &|i| i % grid.nx == grid.nx - 1) * grid.dy();
            let across = edges(grid.nx, &|i| i / grid.nx == grid.ny - 1) * grid.dx();
            let perimeter = problem(grid, &heights).contact_area(state, 0.0).perimeter;
            assert!((perimeter / ((along + across) / (grid.lx * grid.ly)) - 1.0).abs() < 1e-12, "{perimeter}");
        });
    }
    assert!(seams > 3, "{seams} states with clusters on both sides of a seam");
}

//! A hardness of every node: optimality, a direct solution of the bounded problem, the limit of equal values, translations,
//! coarser grids.

use crate::hardness::{Found, METHODS, direct, path, problem, rough, wavy};
use asperity::contact::interface::{
    AttractionLaw, Base, Elastic, HardnessMap, Layer, NodalHardness, NonPeriodic, PenaltyWall, Wall,
};
use asperity::contact::method::{Load, NoObserver, Precision, ReducedProblem};
use asperity::grid::{Grid, mean};
use asperity::methods;

fn map(grid: Grid, hardness: impl Fn(usize, usize) -> f64) -> HardnessMap {
    let values = (0..grid.points()).map(|i| hardness(i % grid.nx, i / grid.nx)).collect();
    HardnessMap::new(grid.nx, grid.ny, values).unwrap()
}

/// Two hardnesses in squares of `side` nodes.
fn squares(grid: Grid, side: usize, [soft, hard]: [f64; 2]) -> HardnessMap {
    map(grid, |x, y| if (x / side + y / side).is_multiple_of(2) { soft } else { hard })
}

fn with_map<'a>(grid: Grid, heights: &'a [f64], map: &'a HardnessMap) -> ReducedProblem<'a> {
    ReducedProblem { hardness: Some(map.into()), ..problem(grid, heights, 1.0) }
}

#[test]
fn a_direct_solution_of_two_hardnesses_has_the_same_stresses() {
    /// Over the hardness.
    const TOLERANCE: f64 = 1e-7;
    let (n, [soft, hard], pressure) = (12, [0.04, 0.07], 0.02);
    let (grid, heights) = wavy(n);
    let map = squares(grid, 3, [soft, hard]);
    let values: Vec<f64> = (0..n * n).map(|i| NodalHardness::from(&map).at(i)).collect();
    let direct = direct(n, &heights, &values, pressure);
    for of in [soft, hard] {
        let flowing = direct.iter().zip(&values).filter(|(s, h)| **h == of && **s == of).count();
        assert!(flowing > 3, "{flowing} nodes flow at {of}");
    }
    for id in METHODS {
        let found = &path(&with_map(grid, &heights, &map), id, &[Load::Pressure(pressure)])[0];
        for (i, (a, b)) in found.stress.iter().zip(&direct).enumerate() {
            assert!((a - b).abs() < TOLERANCE * soft, "{id}: node {i}: {a} {b}");
        }
    }
}

/// Of equal values: the number. Another hardness where there is never contact: the same states, to the last bit, by the code
/// that reads the map.
#[test]
fn where_it_is_not_reached_the_hardness_changes_no_bit() {
    let loads = [0.01, 0.04, 0.02].map(Load::Pressure);
    let hardness = 0.15;
    // `fast` has a coarser grid.
    for (id, n) in METHODS.into_iter().zip([128, 64, 64]) {
        let (grid, heights) = rough(n, 1.0 / 16.0);
        let highest = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let valley = heights.iter().position(|h| *h == highest).unwrap();
        let p = ReducedProblem { tolerance: 1e-7, ..problem(grid, &heights, hardness) };
        let number = path(&p, id, &loads);
        assert!(number[1].plasticity.unwrap().flowing > 0.01);
        let equal = map(grid, |_, _| hardness);
        assert_eq!(path(&ReducedProblem { hardness: Some((&equal).into()), ..p.clone() }, id, &loads), number);
        let other = map(grid, |x, y| if y * grid.nx + x == valley { 2.0 * hardness } else { hardness });
        let of_map = path(&ReducedProblem { hardness: Some((&other).into()), ..p.clone() }, id, &loads);
        for (a, b) in of_map.into_iter().zip(number) {
            let [work, expected] = [a.plasticity, b.plasticity].map(|p| p.unwrap().work);
            assert!((work - expected).abs() <= 1e-12 * expected, "{id}: {work} {expected}");
            // The energy of the flow is summed in another order.
            assert_eq!(Found { plasticity: b.plasticity, ..a }, b, "{id}");
        }
    }
}

/// At every load of a path 0 ≤ p ≤ H of each node, no stress off contact, and flow at the hardness only. All methods find the
/// same state.
#[test]
fn states_are_optimal_for_the_hardness_of_each_node() {
    /// Stress error of states whose residual is 1e-9 of the pressure, over the pressure, at single nodes of 64².
    const STRESS: f64 = 1e-6;
    /// Difference of plastic displacements between methods, over the mean displacement.
    const DISPLACEMENT: f64 = 1e-5;
    let (grid, heights) = rough(64, 1.0 / 16.0);
    let loads = [0.01, 0.05, 0.02, 0.07].map(Load::Pressure);
    let layer = Elastic::Layer(Layer { thickness: 0.05, poisson: 0.3, base: Base::Bonded });
    let patch = Elastic::NonPeriodic(NonPeriodic::of_region(grid.lx, grid.ly));
    let map = squares(grid, 8, [0.1, 0.2]);
    for (kernel, ids) in [(Elastic::HalfSpace, &METHODS[..]), (layer, &METHODS[..2]), (patch, &METHODS[..1])] {
        let p = ReducedProblem { kernel, ..with_map(grid, &heights, &map) };
        let all: Vec<_> = ids.iter().map(|id| path(&p, id, &loads)).collect();
        for states in &all {
            let mut before = vec![0.0; grid.points()];
            for (state, load) in states.iter().zip(&loads) {
                let Load::Pressure(pressure) = *load else { unreachable!() };
                let (allowed, mut work) = (STRESS * pressure, 0.0);
                for (i, earlier) in before.iter().enumerate() {
                    let (g, s, flow) = (state.gap[i], state.stress[i], state.plastic[i] - earlier);
                    let hardness = NodalHardness::from(&map).at(i);
                    assert!(g >= 0.0 && s > -allowed && s < hardness + allowed, "{kernel}: {i}: {g} {s}");
                    assert!(g == 0.0 || s.abs() < allowed, "{kernel}: {i}: {g} {s}");
                    let at_hardness = (s - hardness).abs() < allowed;
                    assert!(flow >= 0.0 && (flow == 0.0 || at_hardness), "{kernel}: {i}: {flow} {s}");
                    work += hardness * state.plastic[i] / grid.points() as f64;
                }
                assert!((state.plasticity.unwrap().work - work).abs() <= 1e-12 * work);
                before.clone_from(&state.plastic);
            }
        }
        for states in &all[1..] {
            for (a, b) in states.iter().zip(&all[0]) {
                let scale = mean(&b.plastic).max(1e-12);
                let most = a.plastic.iter().zip(&b.plastic).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(most < DISPLACEMENT * scale, "{kernel}: {most} {scale}");
            }
        }
    }
}

/// Surface and map shifted together: the same state, shifted.
#[test]
fn states_shift_with_the_map() {
    /// Over the pressure, at residuals of 1e-9.
    const STRESS: f64 = 1e-6;
    let (grid, heights) = rough(64, 1.0 / 16.0);
    let (n, pressure) = (grid.nx, 0.04);
    let map = squares(grid, 5, [0.1, 0.3]);
    let shifted = |i: usize| (i % n + 13) % n + n * ((i / n + 29) % n);
    let other: Vec<f64> = (0..heights.len()).map(|i| heights[shifted(i)]).collect();
    let values = (0..heights.len()).map(|i| NodalHardness::from(&map).at(shifted(i))).collect();
    let other_map = HardnessMap::new(n, n, values).unwrap();
    for id in METHODS {
        let of = |heights: &[f64], map| path(&with_map(grid, heights, map), id, &[Load::Pressure(pressure)]).remove(0);
        let (here, there) = (of(&heights, &map), of(&other, &other_map));
        for i in 0..heights.len() {
            let (a, b) = (there.stress[i], here.stress[shifted(i)]);
            assert!((a - b).abs() < STRESS * pressure, "{id}: {a} {b}");
        }
    }
}

/// A hardness that varies from node to node, and loads up to nearly all it carries: the coarser grids of `fast` have equilibria,
/// too. In f32 and with an attraction, which the bound includes.
#[test]
fn rough_maps_converge_up_to_their_mean() {
    /// At single nodes over the pressure, at residuals of 1e-7 and, in f32, 1e-3 of it.
    const STRESS: [f64; 2] = [1e-5, 3e-2];
    let (grid, heights) = rough(128, 1.0 / 16.0);
    let map = map(grid, |x, y| if (x * 7919 + y * 104_729).is_multiple_of(5) { 0.5 } else { 0.02 });
    let attraction = AttractionLaw::exponential(2e-5, 4e-3);
    let base = ReducedProblem { tolerance: 1e-7, ..with_map(grid, &heights, &map) };
    for p in [
        base.clone(),
        ReducedProblem { precision: Precision::F32, tolerance: 1e-3, ..base.clone() },
        ReducedProblem { adhesion: attraction, ..base.clone() },
    ] {
        let (most, allowed) = (map.mean(), STRESS[usize::from(p.precision == Precision::F32)]);
        for state in path(&p, "fast", &[0.1, 0.9].map(|share| Load::Pressure(share * most))) {
            for (i, s) in state.stress.iter().enumerate() {
                let hardness = NodalHardness::from(&map).at(i);
                assert!(*s < hardness + allowed * state.pressure, "{}: {s} {hardness}", p.adhesion);
            }
        }
        let mut run = methods::find("fast").unwrap().start(&p, &NoObserver).unwrap().solver().unwrap();
        let refused = run.equilibrate(Load::Pressure(1.001 * most)).map(|s| s.stop).expect_err("too much").to_string();
        assert!(refused.contains("every node flows"), "{refused}");
    }
}

#[test]
fn maps_of_another_grid_and_behind_soft_walls_are_refused() {
    let (grid, heights) = rough(64, 1.0 / 16.0);
    let (own, turned) = (squares(grid, 4, [0.1, 0.2]), squares(Grid::unit(32, 128), 4, [0.1, 0.2]));
    let base = with_map(grid, &heights, &own);
    let soft = ReducedProblem { wall: Wall::Penalty(PenaltyWall { length: 1e-3 }), ..base.clone() };
    let other = ReducedProblem { hardness: Some((&turned).into()), ..base.clone() };
    for (id, p, word) in [("fast", &soft, "soft wall"), ("bvm", &other, "grid of the surface"), ("scgw", &base, "none")]
    {
        let Err(refused) = methods::find(id).unwrap().start(p, &NoObserver) else { panic!("{id} accepts {word}") };
        assert!(refused.to_string().contains(word), "{refused}");
    }
}

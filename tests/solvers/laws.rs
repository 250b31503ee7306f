//! Solvers with all adhesion laws, all walls and the kernel of a cubic crystal, against closed forms and each other.

use crate::program;
use asperity::contact::interface::{
    AttractionLaw, CubicHalfSpace, Dugdale, Elastic, Exponential, Law, PenaltyWall, PowerLaw93, PowerLawWall, Wall,
    WithAdhesion,
};
use asperity::contact::method::{Equilibrium, Load, NoObserver, ReducedProblem, Stop};
use asperity::contact::observe::{ContactEdges, contact_area};
use asperity::grid::Grid;
use asperity::methods;
use asperity::surface::{Modes, Spectrum};

const METHODS: [&str; 3] = ["gfmd", "bvm", "fast"];

fn problem(grid: Grid, heights: &[f64]) -> ReducedProblem<'_> {
    ReducedProblem { tolerance: 1e-9, max_iterations: 20_000, ..ReducedProblem::new(grid, heights) }
}

fn solve<R>(problem: &ReducedProblem, id: &str, pressure: f64, look: impl FnOnce(&Equilibrium) -> R) -> R {
    let mut run = methods::find(id).unwrap().start(problem, &NoObserver).unwrap().solver().unwrap();
    let state = run.equilibrate(Load::Pressure(pressure)).unwrap();
    let ReducedProblem { kernel, adhesion, wall, .. } = problem;
    assert_eq!(state.stop, Stop::Converged, "{id}, {kernel}, {adhesion}, {wall}: residual {}", state.residual);
    look(&state)
}

fn rough(n: usize) -> (Grid, Vec<f64>) {
    let grid = Grid::unit(n, n);
    let spectrum = Spectrum { lambda_s: 1.0 / 24.0, ..Spectrum::CHALLENGE };
    (grid, Modes::new(spectrum, 18, 1.0).heights(grid, 0.0))
}

/// Work of adhesion that about doubles the area of the rough surface at these loads, units of E*·L.
const GAMMA: f64 = 2.7e-4;

/// A law with work of adhesion γ and cohesive resolution `c` on the grid.
fn resolved(make: fn(f64, f64) -> AttractionLaw, grid: Grid, c: f64) -> AttractionLaw {
    // Laws have the form (γ/ρ) f(g/ρ): the resolution is proportional to the range.
    let unit = make(GAMMA, 1.0).resolution_on(grid.dx()).expect("an adhesive law");
    make(GAMMA, c / unit)
}

const LAWS: [fn(f64, f64) -> AttractionLaw; 3] =
    [AttractionLaw::exponential, AttractionLaw::dugdale, AttractionLaw::power_law_93];

/// Checks that the methods agree on the state of the rough surface.
fn agree(problem: &ReducedProblem, pressure: f64) {
    /// Relative to the energy.
    const TOLERANCE: f64 = 1e-6;
    let [a, others @ ..] = METHODS.map(|id| solve(problem, id, pressure, |s| (s.energy, s.mean_gap)));
    let ReducedProblem { kernel, adhesion, wall, .. } = problem;
    for b in others {
        let (energy, gap) = (b.0 / a.0 - 1.0, b.1 / a.1 - 1.0);
        assert!(energy.abs() < TOLERANCE && gap.abs() < TOLERANCE, "{kernel}, {adhesion}, {wall}: {energy:e}, {gap:e}");
    }
}

#[test]
fn methods_agree_with_every_law() {
    let (grid, heights) = rough(128);
    for make in LAWS {
        let adhesion = resolved(make, grid, 1.4);
        agree(&ReducedProblem { adhesion, ..problem(grid, &heights) }, 0.01);
    }
}

#[test]
fn methods_agree_with_laws_behind_soft_walls() {
    let (grid, heights) = rough(128);
    let adhesion = resolved(AttractionLaw::power_law_93, grid, 2.0);
    let (gamma, rho) = (adhesion.work_of_adhesion(), adhesion.range());
    let wall = Wall::PowerLaw(PowerLawWall { gamma, rho });
    agree(&ReducedProblem { adhesion, wall, ..problem(grid, &heights) }, 0.01);
    let wall = Wall::Penalty(PenaltyWall { length: 1e-3 });
    for make in LAWS {
        let adhesion = resolved(make, grid, 1.4);
        agree(&ReducedProblem { adhesion, wall, ..problem(grid, &heights) }, 0.01);
    }
}

#[test]
fn methods_agree_on_a_crystal() {
    let (grid, heights) = rough(128);
    let kernel = Elastic::Cubic(CubicHalfSpace::new(27.8, 18.2, 16.3).unwrap());
    let p = ReducedProblem { kernel, ..problem(grid, &heights) };
    agree(&p, 0.02);
    // The crystal axes are equivalent; the diagonals differ from them.
    let n = grid.nx;
    let transposed: Vec<f64> = (0..n * n).map(|i| heights[(i % n) * n + i / n]).collect();
    let [a, b, isotropic] = [p.clone(), ReducedProblem { heights: (&transposed).into(), ..p }, problem(grid, &heights)]
        .map(|p| solve(&p, "fast", 0.02, |s| s.energy));
    assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
    assert!((a / isotropic - 1.0).abs() > 1e-5, "{a} {isotropic}");
}

/// A crystal with isotropic constants is the isotropic half-space.
#[test]
fn an_isotropic_crystal_changes_nothing() {
    let (grid, heights) = rough(64);
    let kernel = Elastic::Cubic(CubicHalfSpace::new(3.0, 1.0, 1.0).unwrap());
    let [a, b] = [ReducedProblem { kernel, ..problem(grid, &heights) }, problem(grid, &heights)]
        .map(|p| solve(&p, "fast", 0.02, |s| s.mean_gap));
    assert!((a / b - 1.0).abs() < 1e-7, "{a} {b}");
}

/// On flat surfaces the gap is uniform, with wall and attraction in equilibrium with the pressure.
#[test]
fn flat_surfaces_rest_where_the_law_carries_the_load() {
    fn check(wall: Wall, adhesion: AttractionLaw, law: impl Law, pressure: f64) {
        let grid = Grid::unit(8, 8);
        let heights = vec![0.3; 64];
        for id in METHODS {
            let p = ReducedProblem { wall, adhesion, ..problem(grid, &heights) };
            solve(&p, id, pressure, |s| {
                let carried = -law.traction(s.mean_gap);
                assert!((carried / pressure - 1.0).abs() < 1e-8, "{id}, {wall}, {adhesion}: {carried} {pressure}");
                assert!(s.gap.to_vec().iter().all(|g| (g - s.mean_gap).abs() < 1e-12), "{id}, {wall}, {adhesion}");
                assert!(law.slope(s.mean_gap) > 0.0, "{id}, {wall}, {adhesion}: unstable");
            });
        }
    }
    let (gamma, rho) = (1e-3, 0.02);
    let stiff = PenaltyWall { length: 1e-2 };
    let exponential = Exponential { gamma, rho };
    let dugdale = Dugdale::new(gamma, rho);
    let power = PowerLaw93 { gamma, rho };
    let wall = PowerLawWall { gamma, rho };
    for pressure in [0.02, 0.2] {
        check(Wall::Penalty(stiff), AttractionLaw::None, stiff, pressure);
        let with = WithAdhesion { wall: stiff, adhesion: exponential };
        check(Wall::Penalty(stiff), AttractionLaw::Exponential(exponential), with, pressure);
        let with = WithAdhesion { wall: stiff, adhesion: dugdale };
        check(Wall::Penalty(stiff), AttractionLaw::Dugdale(dugdale), with, pressure);
        let with = WithAdhesion { wall, adhesion: power };
        check(Wall::PowerLaw(wall), AttractionLaw::PowerLaw93(power), with, pressure);
    }
    // Under a tension of 0.4 γ/ρ the 9-3 law is in equilibrium on its rising branch, with either wall.
    let pull = -0.4 * gamma / rho;
    check(Wall::Hard, AttractionLaw::PowerLaw93(power), power, pull);
    check(Wall::PowerLaw(wall), AttractionLaw::PowerLaw93(power), WithAdhesion { wall, adhesion: power }, pull);
}

/// A range far beyond the roughness is a uniform attraction (Derjaguin, Muller & Toporov): the area is that at the
/// pressure plus the mean attraction γ/ρ.
#[test]
fn long_range_attraction_adds_to_the_pressure() {
    let (grid, heights) = rough(64);
    let fraction = |s: &Equilibrium| contact_area(grid, s.gap, ContactEdges::COUNTED).contact_nodes;
    let (gamma, rho, pressure) = (50.0, 5000.0, 0.01);
    let plain = solve(&problem(grid, &heights), "bvm", pressure + gamma / rho, fraction);
    for adhesion in [AttractionLaw::exponential(gamma, rho), AttractionLaw::dugdale(gamma, rho)] {
        for id in METHODS {
            let p = ReducedProblem { adhesion, ..problem(grid, &heights) };
            assert_eq!(solve(&p, id, pressure, fraction), plain, "{id}, {adhesion}");
        }
    }
}

/// The penalty wall converges to the hard wall at first order in its length ℓ: the energy is lower by ℓ/2 times the
/// mean square stress, the energy of the wall's compression.
#[test]
fn penalty_walls_converge_to_the_hard_wall() {
    let (grid, heights) = rough(128);
    let pressure = 0.02;
    let (hard, square) = solve(&problem(grid, &heights), "fast", pressure, |s| {
        // The stress is zero where the gap is open.
        let stress = s.stress.to_vec();
        ((s.energy, s.mean_gap), stress.iter().map(|s| s * s).sum::<f64>() / stress.len() as f64)
    });
    let lengths = [4e-3, 1e-3, 2.5e-4];
    let found = lengths.map(|length| {
        let p = ReducedProblem { wall: Wall::Penalty(PenaltyWall { length }), ..problem(grid, &heights) };
        let [a, b] = ["fast", "bvm"].map(|id| solve(&p, id, pressure, |s| (s.energy, s.mean_gap)));
        assert!((a.0 / b.0 - 1.0).abs() < 1e-8, "ℓ = {length}: {a:?} {b:?}");
        agree(&p, pressure);
        (hard.0 - a.0, hard.1 - a.1)
    });
    let order = |a: f64, b: f64| (a / b).ln() / 4f64.ln();
    let [_, middle, fine] = found;
    assert!((order(middle.0, fine.0) - 1.0).abs() < 0.03, "energy: {found:?}");
    assert!((order(middle.1, fine.1) - 1.0).abs() < 0.1, "mean gap: {found:?}");
    assert!((fine.0 / (0.5 * lengths[2] * square) - 1.0).abs() < 0.03, "{} {}", fine.0, 0.5 * lengths[2] * square);
}

/// The command-line flags reach the solver; each invalid one gives a one-line error.
#[test]
fn the_program_takes_laws_walls_and_crystals() {
    let scratch = tempfile::tempdir().expect("scratch");
    let file = scratch.path().join("wave.npy");
    let n = 32;
    let wave = |i: usize| (std::f64::consts::TAU * i as f64 / n as f64).cos();
    let heights = (0..n * n).map(|i| wave(i % n) * wave(i / n));
    asperity::surface::files::npy::write(&file, n, n, heights).expect("written");
    let solve = |more: &[&str]| {
        let plain = ["solve", "--length", "100", "--modulus", "25", "--pressure", "0.2", "--json"];
        let sign = ["--touching", "low-points", "--heights"];
        program::asperity().args(plain).args(sign).arg(&file).args(more).output().expect("started")
    };
    let adhesive = ["--gamma", "5", "--rho", "20", "--law"];
    let flags = ["--wall", "penalty", "--penalty-length", "0.5", "--crystal", "27.8,18.2,16.3"];
    for (law, words) in [("exponential", "exponential"), ("dugdale", "Dugdale"), ("power-9-3", "9-3")] {
        let output = solve(&[&adhesive[..], &[law], &flags].concat());
        assert!(output.status.success(), "{}", program::stderr(&output));
        let said = program::json_line(&output);
        let text = |key: &str| said[key].as_str().expect("a string").to_string();
        assert!(text("adhesion").starts_with(words), "{said}");
        assert!(text("wall").starts_with("penalty wall, ℓ = 0.5"), "{said}");
        assert!(text("kernel").contains("cubic"), "{said}");
    }
    for (flags, says) in [
        (&["--wall", "penalty"][..], "--penalty-length = not given"),
        (&["--penalty-length", "2"], "--penalty-length = 2; accepted: only together with --wall penalty"),
        (&["--wall", "penalty", "--penalty-length", "-1"], "--penalty-length = -1; accepted: a positive number"),
        (&["--crystal", "1,2"], "--crystal = 2 numbers; accepted: three: C11,C12,C44"),
        (&["--crystal", "1,2,3"], "--crystal, C11 = 1; accepted: a number above |C12| = 2"),
        (&["--crystal", "27.8,18.2,16.3", "--thickness", "9"], "--crystal = given together with --thickness"),
        (&["--law", "morse"], "possible values: exponential, dugdale, power-9-3"),
    ] {
        let output = solve(flags);
        let said = program::stderr(&output);
        assert!(output.status.code() == Some(2) && said.contains(says), "{flags:?}: {said}");
    }
}

//! Solves that several ranks share: which grids are shared, and what the ranks agree on.
//!
//! Every rank runs the same iteration. Sums have the same bits on all ranks, so that decisions from them agree without communication.
//! What one rank alone knows (requests to stop, checkpoints that are due) the first rank decides.

use crate::method::{CoarseState, Device, Iteration, Observer, ReducedProblem, SnapshotRef, Stop, require};
use asperity_grid::sys::ranks::Ranks;
use asperity_grid::{Error, Result};
use asperity_grid::{Grid, sharing};
use std::ops::{ControlFlow, Range};

/// Bytes of this rank, given those of a level on one.
pub(super) fn bytes(ranks: &Ranks, grid: Grid, level: u64) -> u64 {
    level.div_ceil(sharing(ranks, grid).count() as u64)
}

/// The nodes of this rank in a field of the whole grid.
pub(super) fn own_nodes(ranks: &Ranks, grid: Grid) -> Range<usize> {
    let rows = sharing(ranks, grid).share(grid.ny);
    rows.start * grid.nx..rows.end * grid.nx
}

/// The stop reason that the first rank has found.
pub(super) fn agreed(ranks: &Ranks, stop: Stop) -> Stop {
    const ALL: [Stop; 8] = [
        Stop::Converged,
        Stop::IterationLimit,
        Stop::RoundingFloor,
        Stop::NoDescent,
        Stop::Diverged,
        Stop::Detached,
        Stop::Interrupted,
        Stop::Rejected,
    ];
    let index = ALL.iter().position(|s| *s == stop).expect("one of them");
    ALL[usize::from(ranks.first_says(index as u8))]
}

/// Problems that several ranks can share.
///
/// # Errors
/// `Input` for those that they cannot.
pub(super) fn check(problem: &ReducedProblem, id: &str) -> Result<()> {
    if !problem.ranks.are_several() {
        return Ok(());
    }
    let on = format!("on {} ranks", problem.ranks.count());
    if Device::chosen() != Device::Cpu {
        return Err(require::refused(id, "device", on, "cpu on several ranks, or one rank"));
    }
    if problem.hardness.is_some() {
        return Err(require::refused(id, "hardness", on, "none on several ranks; one rank, also with more --threads"));
    }
    problem.expect_periodic(id).map_err(|_| -> Error {
        let accepted = "a periodic body on several ranks; one rank, also with more --threads";
        require::refused(id, "kernel", format!("a non-periodic body {on}"), accepted)
    })
}

/// Passes events on to the observer of each rank. All follow the one of the first.
pub(super) struct Agreed<'p> {
    pub observer: &'p dyn Observer,
    pub ranks: &'p Ranks,
}

impl Agreed<'_> {
    fn first_says(&self, own: bool) -> bool {
        self.ranks.first_says(u8::from(own)) == 1
    }
}

impl Observer for Agreed<'_> {
    fn iteration(&self, step: Iteration) -> ControlFlow<()> {
        let stops = self.observer.iteration(step).is_break();
        if self.first_says(stops) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn stop_requested(&self) -> bool {
        self.first_says(self.observer.stop_requested())
    }

    fn coarse_grid_done(&self, state: CoarseState) {
        self.observer.coarse_grid_done(state);
    }

    fn snapshot_due(&self) -> bool {
        self.first_says(self.observer.snapshot_due())
    }

    fn snapshot(&self, snapshot: SnapshotRef) {
        self.observer.snapshot(snapshot);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interface::AttractionLaw;
    use crate::load::Load;
    use crate::method::{ContactMethod, Fast};
    use crate::method::{Precision, Settings, SolverSnapshot};
    use asperity_grid::sys::ranks::on_threads;
    use asperity_grid::{Field, Series};
    use rustfft::num_complex::Complex;
    use std::sync::Mutex;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// Waves with random phases.
    fn heights() -> Series<f64> {
        Series::from_modes(24, 24, |kx, ky| {
            let q = ((kx * kx + ky * ky) as f64).sqrt();
            let phase = ((kx * 7919 + ky * 104_729) % 9973) as f64 * 2.1;
            Complex::from_polar(if kx > 0 && q > 1.5 { 5e-3 * q.powf(-1.8) } else { 0.0 }, phase)
        })
    }

    /// Asks for a snapshot in every iteration from one on, and stops later.
    #[derive(Default)]
    struct Interrupting {
        seen: AtomicUsize,
        stop_at: usize,
        last: Mutex<Option<SolverSnapshot>>,
    }

    impl Observer for Interrupting {
        fn iteration(&self, _: Iteration) -> ControlFlow<()> {
            let seen = self.seen.fetch_add(1, Ordering::Relaxed) + 1;
            if self.stop_at > 0 && seen >= self.stop_at { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        }

        fn snapshot(&self, s: SnapshotRef) {
            let gap = whole(s.ranks, s.grid, s.gap);
            let taken = SolverSnapshot { grid: s.grid, gap, auxiliary: None, plastic: None, progress: s.progress };
            *self.last.lock().expect("one thread") = Some(taken);
        }
    }

    /// The field of which every rank has its rows.
    fn whole(ranks: &Ranks, grid: Grid, own: Field) -> Vec<f64> {
        ranks.gather(&own.to_vec(), &ranks.shares(grid.ny, grid.nx))
    }

    /// What the states of a path have in common on all ranks, and the bits of gap and stress of the last.
    type Found = (Vec<String>, Vec<u64>);

    fn path(
        problem: &ReducedProblem,
        loads: &[f64],
        observer: &dyn Observer,
        resumed: Option<&SolverSnapshot>,
    ) -> Found {
        let fast = Fast;
        let mut run = fast.start(problem, observer).and_then(|s| s.solver()).expect("started");
        if let Some(snapshot) = resumed {
            let gap = snapshot.gap[own_nodes(problem.ranks, snapshot.grid)].to_vec();
            run.resume(SolverSnapshot { gap, ..snapshot.clone() }).expect("of this problem");
        }
        let (mut numbers, mut fields) = (Vec::new(), Vec::new());
        for &p in loads {
            let s = run.equilibrate(Load::Pressure(p)).expect("a load");
            let bits = [s.mean_gap, s.energy, s.residual, s.load_error, s.complementarity].map(f64::to_bits);
            numbers.push(format!("{bits:x?} {:?} {:?} {} {}", s.stop, s.error_estimates, s.iterations, s.fft_pairs));
            fields =
                [s.gap, s.stress].iter().flat_map(|f| whole(s.ranks, problem.grid, *f)).map(f64::to_bits).collect();
        }
        (numbers, fields)
    }

    fn check_bits(nx: usize, ny: usize, precision: Precision, adhesion: AttractionLaw) {
        let series = heights();
        let problem = ReducedProblem {
            precision,
            adhesion,
            tolerance: if precision == Precision::F32 { 1e-2 } else { 1e-6 },
            settings: Settings::default(),
            ..ReducedProblem::new(Grid::unit(nx, ny), crate::method::Heights::Series(&series))
        };
        let on = |count: usize, loads: &[f64], stop_at: usize, resumed: Option<&SolverSnapshot>| {
            on_threads(count, |ranks| {
                // Only the first rank asks for a stop.
                let stop_at = if ranks.is_first() { stop_at } else { 0 };
                let observer = Interrupting { stop_at, ..Default::default() };
                let problem = ReducedProblem { ranks: &ranks, ..problem.clone() };
                let actual = path(&problem, loads, &observer, resumed);
                (actual, observer.last.into_inner().expect("one thread"), observer.seen.into_inner())
            })
        };
        let description = format!("{nx} x {ny}, {precision:?}, {adhesion:?}");
        let loads = [5e-3, 2e-2];
        let (expected, ..) = &on(1, &loads, 0, None)[0];
        assert!(expected.0.iter().all(|s| s.contains("Converged")), "{description}: {:?}", expected.0);
        for count in [2, 3] {
            let actual = on(count, &loads, 0, None);
            assert!(actual.iter().all(|f| f.0.0 == expected.0), "{description}, {count} ranks: numbers");
            assert!(actual.iter().all(|f| f.0.1 == expected.1), "{description}, {count} ranks: fields");
        }
        // Interrupted on two ranks and resumed on others, on a grid that is shared.
        let (uninterrupted, _, iterations) = &on(1, &loads[..1], 0, None)[0];
        let stopped = on(2, &loads[..1], iterations - 3, None);
        assert!(stopped.iter().all(|f| f.0.0[0].contains("Interrupted")), "{description}: {:?}", stopped[0].0.0);
        let snapshot = stopped[0].1.as_ref().expect("a snapshot");
        assert!(snapshot.grid.points() >= 80 * 80, "{description}: {:?}", snapshot.grid);
        for count in [1, 3] {
            let actual = on(count, &loads[..1], 0, Some(snapshot));
            assert!(actual[0].0.1 == uninterrupted.1, "{description}: resumed on {count} ranks");
        }
    }

    /// With one shared grid after one that is not, and with two; on oblong grids; with loads that follow each other.
    #[test]
    fn solves_have_the_same_bits_on_any_number_of_ranks() {
        let adhesive = AttractionLaw::exponential(2e-5, 4e-3);
        check_bits(192, 160, Precision::F32, AttractionLaw::None);
        check_bits(144, 150, Precision::F64, adhesive);
    }

    /// Plateaus under a light load are approached rigidly on the finer grid, by the lowest node of all ranks.
    #[test]
    fn light_loads_on_plateaus_have_the_same_bits_on_any_number_of_ranks() {
        let grid = Grid::unit(192, 192);
        let transform = asperity_grid::Transform::<f64>::new(grid);
        let mut nodes: Vec<f64> = heights().on_nodes(&transform, &mut transform.spectrum());
        let mut sorted = nodes.clone();
        sorted.sort_by(f64::total_cmp);
        let top = sorted[sorted.len() / 10];
        nodes.iter_mut().for_each(|h| *h = h.max(top));
        let problem =
            ReducedProblem { tolerance: 1e-6, ..ReducedProblem::new(grid, crate::method::Heights::Nodes(&nodes)) };
        let on = |count: usize| {
            on_threads(count, |ranks| {
                let problem = ReducedProblem { ranks: &ranks, ..problem.clone() };
                path(&problem, &[1e-5, 1e-7], &crate::method::NoObserver, None)
            })
        };
        let expected = &on(1)[0];
        assert!(expected.0.iter().all(|s| s.contains("Converged")), "{:?}", expected.0);
        for count in [2, 3] {
            assert!(on(count).iter().all(|found| found == expected), "{count} ranks");
        }
    }

    #[test]
    fn problems_that_ranks_cannot_share_are_refused_in_one_line() {
        let series = heights();
        let grid = Grid::unit(32, 32);
        let refused = on_threads(2, |ranks| {
            let problem =
                ReducedProblem { ranks: &ranks, ..ReducedProblem::new(grid, crate::method::Heights::Series(&series)) };
            let hard =
                ReducedProblem { hardness: Some(crate::interface::NodalHardness::Uniform(0.1)), ..problem.clone() };
            let start = |method: &dyn ContactMethod, problem: &ReducedProblem| {
                method.start(problem, &crate::method::NoObserver).err().expect("refused").to_string()
            };
            let fast = Fast;
            let mut run = fast.start(&problem, &crate::method::NoObserver).and_then(|s| s.solver()).expect("started");
            let gap = run.equilibrate(Load::MeanGap(0.1)).expect_err("refused").to_string();
            [start(&Fast, &hard), start(&crate::method::Bvm, &problem), gap]
        });
        for text in refused.iter().flatten() {
            assert!(text.contains("rank") && text.contains("accepted") && !text.contains('\n'), "{text}");
        }
    }
}

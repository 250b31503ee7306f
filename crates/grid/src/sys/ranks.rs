//! The processes that share a solve (ranks), and what they exchange.
//!
//! Without the feature `mpi` there is one rank, and every operation returns at once. Each operation is collective: all ranks call it
//! in the same order, from the thread that started them.

mod threads;
#[cfg(feature = "mpi")]
mod world;

use bytemuck::Pod;
use std::ops::Range;

/// Variables in which launchers of MPI hand their processes the number of their rank, and of all ranks. Where a launcher hands no
/// count, MPI knows it.
const LAUNCHERS: [(&str, Option<&str>); 4] = [
    ("OMPI_COMM_WORLD_RANK", Some("OMPI_COMM_WORLD_SIZE")),
    ("PMI_RANK", Some("PMI_SIZE")),
    ("MV2_COMM_WORLD_RANK", Some("MV2_COMM_WORLD_SIZE")),
    ("PMIX_RANK", None),
];

/// Number of this process and of all processes that a launcher of MPI has started with it: (0, 1) without a launcher.
pub fn launched() -> (usize, usize) {
    let number = |name: &str| std::env::var(name).ok()?.parse().ok();
    LAUNCHERS.iter().find_map(|(rank, count)| Some((number(rank)?, number((*count)?)?))).unwrap_or((0, 1))
}

/// Whether a launcher of MPI has started this process.
#[cfg(feature = "mpi")]
fn is_launched() -> bool {
    LAUNCHERS.iter().any(|(rank, _)| std::env::var_os(rank).is_some())
}

/// Exit code of all ranks after a panic of one (`EX_SOFTWARE` of sysexits.h).
const PANICKED: u8 = 70;

/// One rank.
pub static ALONE: Ranks = Ranks(RankGroup::Alone);

/// The ranks that share a solve, and the one of this process. The default is one alone.
#[derive(Debug, Clone, Default)]
pub struct Ranks(RankGroup);

#[derive(Debug, Clone, Default)]
enum RankGroup {
    #[default]
    Alone,
    #[cfg(feature = "mpi")]
    World(world::World),
    /// Threads of one process, for tests.
    Threads(threads::Rank),
}

/// Ends MPI when it is dropped.
pub struct MpiSession {
    ranks: Ranks,
    #[cfg(feature = "mpi")]
    _universe: Option<::mpi::environment::Universe>,
}

impl MpiSession {
    pub fn ranks(&self) -> &Ranks {
        &self.ranks
    }
}

impl Drop for MpiSession {
    fn drop(&mut self) {
        // The others would wait for this rank.
        if std::thread::panicking() {
            self.ranks.abort(PANICKED);
        }
    }
}

/// Starts MPI in a process that a launcher of MPI has started. `None` if this build has no MPI and there are several ranks.
pub fn start() -> Option<MpiSession> {
    #[cfg(feature = "mpi")]
    if is_launched() {
        let (world, universe) = world::start()?;
        let ranks = if world.count > 1 { Ranks(RankGroup::World(world)) } else { Ranks::default() };
        return Some(MpiSession { ranks, _universe: Some(universe) });
    }
    let alone = MpiSession {
        ranks: Ranks::default(),
        #[cfg(feature = "mpi")]
        _universe: None,
    };
    (launched().1 == 1).then_some(alone)
}

/// Points of the smallest grid that ranks of MPI share, and of that which threads share: tests are of small grids.
const SHARED: usize = 1 << 18;
const SHARED_BY_THREADS: usize = 80 * 80;

/// Runs `work` on ranks that are threads of this process, for tests. The results are in the order of the ranks.
#[doc(hidden)]
pub fn on_threads<R: Send>(count: usize, work: impl Fn(Ranks) -> R + Sync) -> Vec<R> {
    let work = &work;
    std::thread::scope(|scope| {
        let spawn = |rank| scope.spawn(move || work(Ranks(RankGroup::Threads(rank))));
        let started: Vec<_> = threads::ranks(count).into_iter().map(spawn).collect();
        started.into_iter().map(|thread| thread.join().expect("a rank that ended")).collect()
    })
}

/// Part `part` of `n` things in order, of `parts` parts whose sizes differ by one at most.
pub fn share(n: usize, parts: usize, part: usize) -> Range<usize> {
    n * part / parts..n * (part + 1) / parts
}

impl Ranks {
    pub fn count(&self) -> usize {
        match &self.0 {
            RankGroup::Alone => 1,
            #[cfg(feature = "mpi")]
            RankGroup::World(world) => world.count,
            RankGroup::Threads(rank) => rank.count,
        }
    }

    /// Points of the smallest grid that is shared. Coarser ones are held whole by every rank, which costs no communication.
    pub fn smallest_shared(&self) -> usize {
        if matches!(self.0, RankGroup::Threads(_)) { SHARED_BY_THREADS } else { SHARED }
    }

    /// Number of this rank.
    pub fn own(&self) -> usize {
        match &self.0 {
            RankGroup::Alone => 0,
            #[cfg(feature = "mpi")]
            RankGroup::World(world) => world.own,
            RankGroup::Threads(rank) => rank.own,
        }
    }

    pub fn are_several(&self) -> bool {
        self.count() > 1
    }

    /// Whether this rank prints, and writes the files of which each rank has no part.
    pub fn is_first(&self) -> bool {
        self.own() == 0
    }

    /// Largest number of threads of a rank.
    pub fn threads(&self) -> usize {
        match &self.0 {
            RankGroup::Alone => rayon::current_num_threads(),
            #[cfg(feature = "mpi")]
            RankGroup::World(world) => world.threads,
            RankGroup::Threads(_) => 1,
        }
    }

    /// The sum of a number of every rank on the machine of this one.
    pub fn sum_on_this_machine(&self, local: u64) -> u64 {
        match &self.0 {
            RankGroup::Alone => local,
            #[cfg(feature = "mpi")]
            RankGroup::World(world) => world.sum_on_this_machine(local),
            RankGroup::Threads(rank) => rank.gather(&[local]).iter().sum(),
        }
    }

    /// The rows of this rank, of `n`.
    pub fn share(&self, n: usize) -> Range<usize> {
        share(n, self.count(), self.own())
    }

    /// Elements of every rank, of `n` rows with `per_row` elements each.
    pub fn shares(&self, n: usize, per_row: usize) -> Vec<usize> {
        (0..self.count()).map(|rank| share(n, self.count(), rank).len() * per_row).collect()
    }

    /// Sends `counts[q]` elements of `send` to every other rank `q`, in order, and receives `expected[q]` elements from it. Elements of
    /// this rank for itself have their place in both, and stay where they are.
    pub fn exchange<E: Pod>(&self, (send, counts): (&[E], &[usize]), (receive, expected): (&mut [E], &[usize])) {
        match &self.0 {
            RankGroup::Alone => {
                let _ = (send, counts, receive, expected);
            }
            #[cfg(feature = "mpi")]
            RankGroup::World(world) => world.exchange((send, counts), (receive, expected)),
            RankGroup::Threads(rank) => rank.exchange((send, counts), (receive, expected)),
        }
    }

    /// The elements of all ranks in order, on all ranks; rank `q` gives `counts[q]` of them.
    pub fn gather<E: Pod>(&self, local: &[E], counts: &[usize]) -> Vec<E> {
        debug_assert_eq!(local.len(), counts[self.own()]);
        match &self.0 {
            RankGroup::Alone => local.to_vec(),
            #[cfg(feature = "mpi")]
            RankGroup::World(_) => world::gather(local, counts),
            RankGroup::Threads(rank) => rank.gather(local),
        }
    }

    /// As [`Ranks::gather`], on the first rank only, and of any size. The others receive nothing.
    pub fn gather_on_first<E: Pod>(&self, local: &[E], counts: &[usize]) -> Vec<E> {
        debug_assert_eq!(local.len(), counts[self.own()]);
        match &self.0 {
            RankGroup::Alone => local.to_vec(),
            #[cfg(feature = "mpi")]
            RankGroup::World(world) => world.gather_on_first(local, counts),
            RankGroup::Threads(rank) => {
                let all = rank.gather(local);
                if self.is_first() { all } else { Vec::new() }
            }
        }
    }

    /// What the first rank says.
    pub fn first_says(&self, say: u8) -> u8 {
        match &self.0 {
            RankGroup::Alone => say,
            #[cfg(feature = "mpi")]
            RankGroup::World(_) => world::first_says(say),
            RankGroup::Threads(rank) => rank.gather(&[say])[0],
        }
    }

    /// The smallest of one number of each rank.
    pub fn lowest(&self, local: f64) -> f64 {
        self.gather(&[local], &vec![1; self.count()]).into_iter().fold(f64::INFINITY, f64::min)
    }

    /// Ends all ranks with this exit code. Returns where there is one.
    pub fn abort(&self, code: u8) {
        match &self.0 {
            #[cfg(feature = "mpi")]
            RankGroup::World(_) => world::abort(code),
            _ => {
                let _ = code;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_cover_everything_once_and_differ_by_one() {
        for (n, parts) in [(0, 1), (1, 3), (7, 3), (8, 4), (5, 8)] {
            let shares: Vec<_> = (0..parts).map(|part| share(n, parts, part)).collect();
            assert_eq!(shares.iter().cloned().flatten().collect::<Vec<_>>(), (0..n).collect::<Vec<_>>());
            let sizes = || shares.iter().map(|s| s.len());
            assert!(sizes().max().unwrap() - sizes().min().unwrap() <= 1, "{n} in {parts}");
        }
    }

    #[test]
    fn exchanged_elements_arrive_in_the_order_of_the_ranks() {
        let count = 3;
        let received = on_threads(count, |ranks| {
            let own = ranks.own();
            // q + 1 elements to rank q.
            let send: Vec<u64> = (0..count).flat_map(|q| vec![(10 * own + q) as u64; q + 1]).collect();
            let mut receive = vec![0_u64; count * (own + 1)];
            let counts: Vec<usize> = (1..=count).collect();
            ranks.exchange((&send, &counts), (&mut receive, &vec![own + 1; count]));
            let all = ranks.gather(&send[..own], &[0, 1, 2]);
            let first = ranks.gather_on_first(&send[..1], &[1; 3]);
            (receive, all, first, ranks.first_says(7 - own as u8), ranks.lowest(-(own as f64)))
        });
        for (own, (receive, all, first, said, lowest)) in received.into_iter().enumerate() {
            let from = |s: usize| if s == own { 0 } else { (10 * s + own) as u64 };
            let expected: Vec<u64> = (0..count).flat_map(|s| vec![from(s); own + 1]).collect();
            assert_eq!(receive, expected);
            assert_eq!(all, [10, 20, 21]);
            assert_eq!(first, if own == 0 { vec![0, 10, 20] } else { vec![] });
            assert_eq!((said, lowest), (7, -2.0));
        }
    }
}

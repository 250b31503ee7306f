//! The processes that share a solve (ranks), and what they exchange.
//!
//! Ranks of MPI are those of the program (feature `mpi` of the crate `asperity`). Each operation is collective: all ranks call it in the
//! same order, from the thread that started them. Alone, every operation returns at once.

mod communicator;
mod threads;

pub use communicator::Communicator;

use bytemuck::{Pod, cast_slice, cast_slice_mut};
use std::ops::Range;
use std::sync::Arc;

/// One rank.
pub static ALONE: Ranks = Ranks(None);

/// The ranks that share a solve, and the one of this process. The default is one alone.
#[derive(Debug, Clone, Default)]
pub struct Ranks(Option<Arc<dyn Communicator>>);

/// Runs `work` on ranks that are threads of this process, for tests. The results are in the order of the ranks.
#[doc(hidden)]
pub fn on_threads<R: Send>(count: usize, work: impl Fn(Ranks) -> R + Sync) -> Vec<R> {
    let work = &work;
    std::thread::scope(|scope| {
        let spawn = |rank| scope.spawn(move || work(Ranks::of(Arc::new(rank))));
        let started: Vec<_> = threads::ranks(count).into_iter().map(spawn).collect();
        started.into_iter().map(|thread| thread.join().expect("a rank that ended")).collect()
    })
}

/// Part `part` of `n` things in order, of `parts` parts whose sizes differ by one at most.
pub fn share(n: usize, parts: usize, part: usize) -> Range<usize> {
    n * part / parts..n * (part + 1) / parts
}

impl Ranks {
    /// Those of a communicator.
    pub fn of(communicator: Arc<dyn Communicator>) -> Self {
        Ranks((communicator.count() > 1).then_some(communicator))
    }

    pub fn count(&self) -> usize {
        self.0.as_ref().map_or(1, |c| c.count())
    }

    /// Points of the smallest grid that is shared. Coarser ones are held whole by every rank, which costs no communication.
    pub fn smallest_shared(&self) -> usize {
        self.0.as_ref().map_or(0, |c| c.smallest_shared())
    }

    /// Number of this rank.
    pub fn own(&self) -> usize {
        self.0.as_ref().map_or(0, |c| c.own())
    }

    pub fn are_several(&self) -> bool {
        self.0.is_some()
    }

    /// Whether this rank prints, and writes the files of which each rank has no part.
    pub fn is_first(&self) -> bool {
        self.own() == 0
    }

    /// Largest number of threads of a rank.
    pub fn threads(&self) -> usize {
        self.0.as_ref().map_or_else(rayon::current_num_threads, |c| c.threads())
    }

    /// The sum of a number of every rank on the machine of this one.
    pub fn sum_on_this_machine(&self, local: u64) -> u64 {
        let Some(communicator) = &self.0 else { return local };
        let all = self.gather(&[local], &vec![1; self.count()]);
        all.iter().zip(communicator.on_this_machine()).filter(|(_, here)| **here).map(|(n, _)| n).sum()
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
        if let Some(communicator) = &self.0 {
            let (counts, expected) = (bytes::<E>(counts), bytes::<E>(expected));
            communicator.exchange((cast_slice(send), &counts), (cast_slice_mut(receive), &expected));
        }
    }

    /// The elements of all ranks in order, on all ranks; rank `q` gives `counts[q]` of them.
    pub fn gather<E: Pod>(&self, local: &[E], counts: &[usize]) -> Vec<E> {
        debug_assert_eq!(local.len(), counts[self.own()]);
        let Some(communicator) = &self.0 else { return local.to_vec() };
        let mut all = vec![E::zeroed(); counts.iter().sum()];
        communicator.gather(cast_slice(local), (cast_slice_mut(&mut all), &bytes::<E>(counts)));
        all
    }

    /// As [`Ranks::gather`], on the first rank only, and of any size. The others receive nothing.
    pub fn gather_on_first<E: Pod>(&self, local: &[E], counts: &[usize]) -> Vec<E> {
        debug_assert_eq!(local.len(), counts[self.own()]);
        let Some(communicator) = &self.0 else { return local.to_vec() };
        let mut all = vec![E::zeroed(); if self.is_first() { counts.iter().sum() } else { 0 }];
        communicator.gather_on_first(cast_slice(local), (cast_slice_mut(&mut all), &bytes::<E>(counts)));
        all
    }

    /// What the first rank says.
    pub fn first_says(&self, say: u8) -> u8 {
        self.0.as_ref().map_or(say, |c| c.first_says(say))
    }

    /// The smallest of one number of each rank.
    pub fn lowest(&self, local: f64) -> f64 {
        self.gather(&[local], &vec![1; self.count()]).into_iter().fold(f64::INFINITY, f64::min)
    }

    /// Ends all ranks with this exit code. Returns where there is one.
    pub fn abort(&self, code: u8) {
        if let Some(communicator) = &self.0 {
            communicator.abort(code);
        }
    }
}

/// Bytes of numbers of elements.
fn bytes<E>(counts: &[usize]) -> Vec<usize> {
    counts.iter().map(|n| n * size_of::<E>()).collect()
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

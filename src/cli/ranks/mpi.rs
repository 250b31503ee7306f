//! Ranks of MPI.

use asperity_grid::sys::ranks::Communicator;
use mpi::Threading;
use mpi::datatype::{Partition, PartitionMut};
use mpi::environment::{Universe, initialize_with_threading};
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator as _, CommunicatorCollectives, Destination, Root, Source};
use std::fmt;
use std::time::{Duration, Instant};

/// Largest message, bytes: MPI counts with 32 bits.
const MESSAGE: usize = 1 << 30;

/// Points of the smallest grid that is shared.
const SHARED: usize = 1 << 18;

/// All ranks. MPI ends when it is dropped.
pub(super) struct World {
    count: usize,
    own: usize,
    threads: usize,
    here: Vec<bool>,
    _universe: Universe,
}

impl fmt::Debug for World {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "rank {} of {}", self.own, self.count)
    }
}

/// Starts MPI, for calls from this thread.
pub(super) fn start() -> Option<World> {
    let (universe, _) = initialize_with_threading(Threading::Funneled)?;
    let world = universe.world();
    let (count, own) = (world.size() as usize, world.rank() as usize);
    let machine = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    let hash = machine.bytes().fold(0_u64, |hash, byte| hash.wrapping_mul(31).wrapping_add(u64::from(byte)));
    let mut known = vec![[0_u64; 2]; count];
    world.all_gather_into(&[rayon::current_num_threads() as u64, hash][..], known.as_flattened_mut());
    let threads = known.iter().map(|[threads, _]| *threads).max().map_or(1, |t| t as usize);
    let here = known.iter().map(|[_, h]| *h == hash).collect();
    Some(World { count, own, threads, here, _universe: universe })
}

/// Time for which a rank waits for the others without giving its core away, and its pauses afterwards.
const BUSY: Duration = Duration::from_micros(100);
const PAUSE: Duration = Duration::from_micros(50);

/// Waits until all ranks have come here. What follows then exchanges data without waiting: in the operations of MPI a waiting rank uses
/// its core all the time, also where the others share it or the first rank writes files.
fn meet() {
    let mut met = SimpleCommunicator::world().immediate_barrier();
    let started = Instant::now();
    while let Err(waiting) = met.test() {
        met = waiting;
        if started.elapsed() > BUSY {
            std::thread::sleep(PAUSE);
        }
    }
}

/// Counts and offsets of the parts.
fn layout(counts: &[usize]) -> (Vec<i32>, Vec<i32>) {
    let number = |n: usize| i32::try_from(n).expect("a message of less than 2 GiB");
    let ends = counts.iter().scan(0, |end, n| Some(std::mem::replace(end, *end + n)));
    let offsets = ends.map(number).collect();
    (counts.iter().map(|n| number(*n)).collect(), offsets)
}

impl Communicator for World {
    fn count(&self) -> usize {
        self.count
    }

    fn own(&self) -> usize {
        self.own
    }

    fn threads(&self) -> usize {
        self.threads
    }

    fn smallest_shared(&self) -> usize {
        SHARED
    }

    fn on_this_machine(&self) -> &[bool] {
        &self.here
    }

    fn exchange(&self, (send, counts): (&[u8], &[usize]), (receive, expected): (&mut [u8], &[usize])) {
        let (mut counts, offsets) = layout(counts);
        let (mut expected, places) = layout(expected);
        (counts[self.own], expected[self.own]) = (0, 0);
        let send = Partition::new(send, counts, offsets);
        let mut receive = PartitionMut::new(receive, expected, places);
        meet();
        SimpleCommunicator::world().all_to_all_varcount_into(&send, &mut receive);
    }

    fn gather(&self, local: &[u8], (all, counts): (&mut [u8], &[usize])) {
        let (counts, offsets) = layout(counts);
        let mut receive = PartitionMut::new(all, counts, offsets);
        meet();
        SimpleCommunicator::world().all_gather_varcount_into(local, &mut receive);
    }

    fn gather_on_first(&self, local: &[u8], (all, counts): (&mut [u8], &[usize])) {
        meet();
        let world = SimpleCommunicator::world();
        if self.own > 0 {
            local.chunks(MESSAGE).for_each(|part| world.process_at_rank(0).send(part));
            return;
        }
        let (first, mut remainder) = all.split_at_mut(local.len());
        first.copy_from_slice(local);
        for (rank, n) in counts.iter().enumerate().skip(1) {
            let (part, following) = remainder.split_at_mut(*n);
            for part in part.chunks_mut(MESSAGE) {
                world.process_at_rank(rank as i32).receive_into(part);
            }
            remainder = following;
        }
    }

    fn first_says(&self, say: u8) -> u8 {
        meet();
        let mut said = [say];
        SimpleCommunicator::world().process_at_rank(0).broadcast_into(&mut said[..]);
        said[0]
    }

    fn abort(&self, code: u8) {
        SimpleCommunicator::world().abort(i32::from(code))
    }
}

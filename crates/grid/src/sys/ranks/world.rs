//! Ranks of MPI.

use bytemuck::Pod;
use mpi::Threading;
use mpi::datatype::{Partition, PartitionMut};
use mpi::environment::{Universe, initialize_with_threading};
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, CommunicatorCollectives, Destination, Root, Source};
use std::time::{Duration, Instant};

/// Largest message, bytes: MPI counts with 32 bits.
const MESSAGE: usize = 1 << 30;

#[derive(Debug, Clone)]
pub(super) struct World {
    pub count: usize,
    pub own: usize,
    pub threads: usize,
    /// Whether each rank is on the machine of this one.
    here: Vec<bool>,
}

/// Starts MPI, for calls from this thread.
pub(super) fn start() -> Option<(World, Universe)> {
    let (universe, _) = initialize_with_threading(Threading::Funneled)?;
    let world = universe.world();
    let (count, own) = (world.size() as usize, world.rank() as usize);
    let machine = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    let hash = machine.bytes().fold(0_u64, |hash, byte| hash.wrapping_mul(31).wrapping_add(u64::from(byte)));
    let known = gather(&[rayon::current_num_threads() as u64, hash], &vec![2; count]);
    let threads = known.iter().step_by(2).max().map_or(1, |t| *t as usize);
    let here = known.iter().skip(1).step_by(2).map(|h| *h == hash).collect();
    Some((World { count, own, threads, here }, universe))
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

/// Counts and offsets in bytes, of elements of `size` bytes.
fn layout(counts: &[usize], size: usize) -> (Vec<i32>, Vec<i32>) {
    let bytes = |n: usize| i32::try_from(n * size).expect("a message of less than 2 GiB");
    let ends = counts.iter().scan(0, |end, n| Some(std::mem::replace(end, *end + n)));
    let offsets = ends.map(bytes).collect();
    (counts.iter().map(|n| bytes(*n)).collect(), offsets)
}

pub(super) fn gather<E: Pod>(local: &[E], counts: &[usize]) -> Vec<E> {
    let (bytes, offsets) = layout(counts, size_of::<E>());
    let mut all = vec![E::zeroed(); counts.iter().sum()];
    let local: &[u8] = bytemuck::cast_slice(local);
    let mut receive = PartitionMut::new(bytemuck::cast_slice_mut::<_, u8>(&mut all), bytes, offsets);
    meet();
    SimpleCommunicator::world().all_gather_varcount_into(local, &mut receive);
    all
}

impl World {
    pub(super) fn sum_on_this_machine(&self, local: u64) -> u64 {
        gather(&[local], &vec![1; self.count]).iter().zip(&self.here).filter(|(_, here)| **here).map(|(n, _)| n).sum()
    }

    pub(super) fn exchange<E: Pod>(&self, (send, counts): (&[E], &[usize]), (receive, expected): (&mut [E], &[usize])) {
        let (mut counts, offsets) = layout(counts, size_of::<E>());
        let (mut expected, places) = layout(expected, size_of::<E>());
        (counts[self.own], expected[self.own]) = (0, 0);
        let send: &[u8] = bytemuck::cast_slice(send);
        let send = Partition::new(send, counts, offsets);
        let mut receive = PartitionMut::new(bytemuck::cast_slice_mut::<_, u8>(receive), expected, places);
        meet();
        SimpleCommunicator::world().all_to_all_varcount_into(&send, &mut receive);
    }

    pub(super) fn gather_on_first<E: Pod>(&self, local: &[E], counts: &[usize]) -> Vec<E> {
        meet();
        let world = SimpleCommunicator::world();
        let bytes: &[u8] = bytemuck::cast_slice(local);
        if self.own > 0 {
            bytes.chunks(MESSAGE).for_each(|part| world.process_at_rank(0).send(part));
            return Vec::new();
        }
        let mut all = vec![E::zeroed(); counts.iter().sum()];
        let (first, mut remainder) = all.split_at_mut(local.len());
        first.copy_from_slice(local);
        for (rank, n) in counts.iter().enumerate().skip(1) {
            let (part, following) = remainder.split_at_mut(*n);
            for part in bytemuck::cast_slice_mut::<_, u8>(part).chunks_mut(MESSAGE) {
                world.process_at_rank(rank as i32).receive_into(part);
            }
            remainder = following;
        }
        all
    }
}

pub(super) fn first_says(say: u8) -> u8 {
    meet();
    let mut said = [say];
    SimpleCommunicator::world().process_at_rank(0).broadcast_into(&mut said[..]);
    said[0]
}

pub(super) fn abort(code: u8) -> ! {
    SimpleCommunicator::world().abort(i32::from(code))
}

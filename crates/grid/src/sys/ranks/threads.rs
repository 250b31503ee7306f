//! Ranks that are threads of one process, for tests of what ranks compute.

use bytemuck::Pod;
use std::sync::{Arc, Barrier, Mutex};

#[derive(Debug)]
struct Shared {
    posted: Mutex<Vec<Vec<u8>>>,
    barrier: Barrier,
}

#[derive(Debug, Clone)]
pub(super) struct Rank {
    pub own: usize,
    pub count: usize,
    shared: Arc<Shared>,
}

/// All ranks, in order.
pub(super) fn ranks(count: usize) -> Vec<Rank> {
    let shared = Arc::new(Shared { posted: Mutex::new(vec![Vec::new(); count]), barrier: Barrier::new(count) });
    (0..count).map(|local| Rank { own: local, count, shared: shared.clone() }).collect()
}

fn elements<E: Pod>(bytes: &[u8]) -> Vec<E> {
    let mut elements = vec![E::zeroed(); bytes.len() / size_of::<E>()];
    bytemuck::cast_slice_mut(&mut elements).copy_from_slice(bytes);
    elements
}

impl Rank {
    /// What every rank has posted.
    fn all(&self, local: &[u8]) -> Vec<Vec<u8>> {
        self.shared.posted.lock().expect("no rank has failed")[self.own] = local.to_vec();
        self.shared.barrier.wait();
        let all = self.shared.posted.lock().expect("no rank has failed").clone();
        self.shared.barrier.wait();
        all
    }

    pub(super) fn gather<E: Pod>(&self, local: &[E]) -> Vec<E> {
        self.all(bytemuck::cast_slice(local)).iter().flat_map(|part| elements(part)).collect()
    }

    pub(super) fn exchange<E: Pod>(&self, (send, counts): (&[E], &[usize]), (receive, expected): (&mut [E], &[usize])) {
        let offset = |counts: &[usize]| counts[..self.own].iter().sum::<usize>();
        let offsets: Vec<u64> = counts.iter().map(|n| *n as u64).collect();
        let counts_of_all: Vec<usize> = self.gather(&offsets).into_iter().map(|n| n as usize).collect();
        let all = self.all(bytemuck::cast_slice(send));
        let mut to = 0;
        for (rank, part) in all.iter().enumerate() {
            let counts = &counts_of_all[rank * self.count..][..self.count];
            let part: Vec<E> = elements(part);
            let (from, n) = (offset(counts), counts[self.own]);
            let n = if rank == self.own { expected[rank] } else { n };
            assert_eq!(n, expected[rank], "rank {rank} sends as many elements as rank {} expects", self.own);
            if rank != self.own {
                receive[to..to + n].copy_from_slice(&part[from..from + n]);
            }
            to += n;
        }
    }
}

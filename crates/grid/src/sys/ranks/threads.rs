//! Ranks that are threads of one process, for tests of what ranks compute.

use super::communicator::Communicator;
use std::sync::{Arc, Barrier, Mutex};

/// Points of the smallest grid that is shared: tests are of small grids.
const SHARED: usize = 80 * 80;

#[derive(Debug)]
struct Shared {
    posted: Mutex<Vec<Vec<u8>>>,
    barrier: Barrier,
    here: Vec<bool>,
}

#[derive(Debug)]
pub(super) struct Rank {
    own: usize,
    shared: Arc<Shared>,
}

/// All ranks, in order.
pub(super) fn ranks(count: usize) -> Vec<Rank> {
    let posted = Mutex::new(vec![Vec::new(); count]);
    let shared = Arc::new(Shared { posted, barrier: Barrier::new(count), here: vec![true; count] });
    (0..count).map(|own| Rank { own, shared: shared.clone() }).collect()
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
}

impl Communicator for Rank {
    fn count(&self) -> usize {
        self.shared.here.len()
    }

    fn own(&self) -> usize {
        self.own
    }

    fn threads(&self) -> usize {
        1
    }

    fn smallest_shared(&self) -> usize {
        SHARED
    }

    fn on_this_machine(&self) -> &[bool] {
        &self.shared.here
    }

    fn exchange(&self, (send, counts): (&[u8], &[usize]), (receive, expected): (&mut [u8], &[usize])) {
        let layouts = self.all(&counts.iter().flat_map(|n| n.to_ne_bytes()).collect::<Vec<u8>>());
        let mut to = 0;
        for (rank, (part, layout)) in self.all(send).iter().zip(layouts).enumerate() {
            let n = expected[rank];
            if rank != self.own {
                let sent: Vec<usize> = layout.as_chunks().0.iter().map(|n| usize::from_ne_bytes(*n)).collect();
                assert_eq!(sent[self.own], n, "rank {rank} sends as many bytes as rank {} expects", self.own);
                let from = sent[..self.own].iter().sum::<usize>();
                receive[to..to + n].copy_from_slice(&part[from..from + n]);
            }
            to += n;
        }
    }

    fn gather(&self, local: &[u8], (all, _): (&mut [u8], &[usize])) {
        all.copy_from_slice(&self.all(local).concat());
    }

    fn gather_on_first(&self, local: &[u8], (all, _): (&mut [u8], &[usize])) {
        let parts = self.all(local).concat();
        if self.own == 0 {
            all.copy_from_slice(&parts);
        }
    }

    fn first_says(&self, say: u8) -> u8 {
        self.all(&[say])[0][0]
    }

    fn abort(&self, _code: u8) {}
}

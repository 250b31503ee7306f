//! Disjoint sets of integers.

/// Offset between two members of a set.
pub trait Offset: Copy + Default {
    fn plus(self, other: Self) -> Self;
    fn minus(self, other: Self) -> Self;
}

/// For sets whose members have no position.
impl Offset for () {
    fn plus(self, (): Self) -> Self {}
    fn minus(self, (): Self) -> Self {}
}

/// Steps along x and along y.
impl Offset for [i32; 2] {
    fn plus(self, [x, y]: Self) -> Self {
        [self[0] + x, self[1] + y]
    }

    fn minus(self, [x, y]: Self) -> Self {
        [self[0] - x, self[1] - y]
    }
}

/// Union-find over the numbers `0..n` with path compression. The root of a set is its smallest member. For sets with
/// positions the offset of each member from the root is stored.
#[derive(Debug, Clone)]
pub struct UnionFind<D = ()> {
    /// Parent of each number, and the offset from the parent to it.
    parent: Vec<(u32, D)>,
}

impl<D: Offset> UnionFind<D> {
    /// `n` sets of one member each.
    pub fn new(n: usize) -> Self {
        UnionFind { parent: (0..n as u32).map(|i| (i, D::default())).collect() }
    }

    /// Root of a member's set, and the offset from the root to the member.
    pub fn find(&mut self, member: u32) -> (u32, D) {
        let (mut root, mut offset) = (member, D::default());
        while self.parent[root as usize].0 != root {
            let (parent, step) = self.parent[root as usize];
            offset = offset.plus(step);
            root = parent;
        }
        let (mut position, mut remainder) = (member, offset);
        while position != root {
            let (parent, step) = std::mem::replace(&mut self.parent[position as usize], (root, remainder));
            remainder = remainder.minus(step);
            position = parent;
        }
        (root, offset)
    }

    /// Merges the sets of `a` and `b`; `step` is the offset from `a` to `b`.
    ///
    /// # Errors
    /// If both are in the same set: the offset around the closed loop, which is nonzero if the loop winds around the
    /// periodic cell.
    pub fn join(&mut self, a: u32, b: u32, step: D) -> Result<Merged, D> {
        let ((root_a, to_a), (root_b, to_b)) = (self.find(a), self.find(b));
        let offset = to_a.plus(step).minus(to_b);
        if root_a == root_b {
            return Err(offset);
        }
        let (root, lost) = (root_a.min(root_b), root_a.max(root_b));
        let offset = if lost == root_b { offset } else { D::default().minus(offset) };
        self.parent[lost as usize] = (root, offset);
        Ok(Merged { kept: root, lost })
    }
}

impl UnionFind {
    /// Root of a member's set.
    pub fn root(&mut self, member: u32) -> u32 {
        self.find(member).0
    }

    /// Merges the sets of two members; `None` if they are in the same set.
    pub fn unite(&mut self, a: u32, b: u32) -> Option<Merged> {
        self.join(a, b, ()).ok()
    }
}

/// Result of a merge: the root of the merged set (`kept`), and the former root of the other set (`lost`).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Merged {
    pub kept: u32,
    pub lost: u32,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_root_is_the_smallest_member() {
        let mut sets = UnionFind::new(6);
        assert_eq!(sets.unite(5, 3), Some(Merged { kept: 3, lost: 5 }));
        assert_eq!(sets.unite(4, 1), Some(Merged { kept: 1, lost: 4 }));
        assert_eq!(sets.unite(4, 5), Some(Merged { kept: 1, lost: 3 }));
        assert_eq!(sets.unite(3, 1), None);
        assert_eq!((0..6).map(|i| sets.root(i)).collect::<Vec<_>>(), [0, 1, 2, 1, 1, 1]);
    }

    #[test]
    fn offsets_add_up_whichever_root_is_kept() {
        let mut sets: UnionFind<[i32; 2]> = UnionFind::new(4);
        sets.join(3, 2, [1, 0]).unwrap();
        sets.join(1, 0, [0, 1]).unwrap();
        sets.join(2, 1, [2, 2]).unwrap();
        let offset_of = |sets: &mut UnionFind<[i32; 2]>, i| sets.find(i).1;
        let [from, to] = [3, 0].map(|i| offset_of(&mut sets, i));
        assert_eq!(to.minus(from), [3, 3]);
        assert_eq!(sets.join(0, 3, [-3, -3]), Err([0, 0]));
        assert_eq!(sets.join(0, 3, [1, -3]), Err([4, 0]));
    }
}

/// Which neighbours belong to the same patch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Connectivity {
    /// Edge neighbours.
    Four,
    /// Edge and corner neighbours.
    Eight,
}

/// Sizes in nodes of the connected patches of a map `[ny, nx]` (nonzero = contact) on the periodic cell, in the order of
/// their first node. Two-pass union-find over contact nodes only.
pub fn patch_sizes(map: &[u8], nx: usize, connectivity: Connectivity) -> Vec<usize> {
    let ny = map.len() / nx.max(1);
    const NONE: u32 = u32::MAX;
    let mut label = vec![NONE; map.len()];
    let mut parent: Vec<u32> = Vec::new();
    for (i, _) in map.iter().enumerate().filter(|(_, m)| **m != 0) {
        label[i] = parent.len() as u32;
        parent.push(parent.len() as u32);
    }
    for y in 0..ny {
        for x in 0..nx {
            let here = label[y * nx + x];
            if here == NONE {
                continue;
            }
            let (right, left, below) = ((x + 1) % nx, (x + nx - 1) % nx, (y + 1) % ny);
            let mut join = |x: usize, y: usize| {
                let other = label[y * nx + x];
                if other != NONE {
                    let (a, b) = (root(&mut parent, here), root(&mut parent, other));
                    // The smaller label stays, so patches keep the order of their first node.
                    parent[a.max(b) as usize] = a.min(b);
                }
            };
            join(right, y);
            join(x, below);
            if connectivity == Connectivity::Eight {
                join(right, below);
                join(left, below);
            }
        }
    }
    let mut size = vec![0; parent.len()];
    for l in 0..parent.len() as u32 {
        size[root(&mut parent, l) as usize] += 1;
    }
    size.retain(|s| *s > 0);
    size
}

fn root(parent: &mut [u32], mut l: u32) -> u32 {
    while parent[l as usize] != l {
        // Path halving.
        parent[l as usize] = parent[parent[l as usize] as usize];
        l = parent[l as usize];
    }
    l
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(text: &str) -> (Vec<u8>, usize) {
        let rows: Vec<&str> = text.split_whitespace().collect();
        (rows.concat().bytes().map(|b| u8::from(b != b'.')).collect(), rows[0].len())
    }

    #[test]
    fn patches_join_across_the_seam_and_at_corners() {
        let (m, nx) = map("#...# ..... .##.. ...#. #....");
        let mut four = patch_sizes(&m, nx, Connectivity::Four);
        four.sort();
        // The corner pair joins across x; the node below it joins across y; the diagonal is apart.
        assert_eq!(four, [1, 2, 3]);
        let mut eight = patch_sizes(&m, nx, Connectivity::Eight);
        eight.sort();
        assert_eq!(eight, [3, 3]);
    }

    #[test]
    fn checkerboard_stripe_and_full() {
        let (m, nx) = map("#.#. .#.# #.#. .#.#");
        assert_eq!(patch_sizes(&m, nx, Connectivity::Four), [1; 8]);
        assert_eq!(patch_sizes(&m, nx, Connectivity::Eight), [8]);
        let (m, nx) = map(".... #### .... ....");
        assert_eq!(patch_sizes(&m, nx, Connectivity::Four), [4]);
        assert_eq!(patch_sizes(&[1; 12], 3, Connectivity::Four), [12]);
        assert!(patch_sizes(&[0; 12], 3, Connectivity::Four).is_empty());
    }
}

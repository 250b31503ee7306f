//! Maps reduced for display by means over square blocks of nodes.

/// Downsamples a map row by row, so the full map need not be in memory.
///
/// Each cell of the small map is the mean of `factor × factor` nodes (fewer at the far edges if the size is not a
/// multiple of `factor`). Block means preserve areas and mean gaps but smooth peaks; captions state this.
#[derive(Debug, Clone)]
pub struct Downsampler {
    full_nx: usize,
    full_ny: usize,
    factor: usize,
    sums: Vec<f64>,
}

/// Downsampled map, row-major `[ny, nx]`; each cell is the mean of `factor` × `factor` nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct DownsampledMap {
    pub nx: usize,
    pub ny: usize,
    pub factor: usize,
    pub values: Vec<f64>,
}

impl Downsampler {
    /// For maps of `nx × ny` nodes; the sides of the small map have at most `longest` cells (at least one).
    pub fn new(nx: usize, ny: usize, longest: usize) -> Self {
        let factor = nx.max(ny).div_ceil(longest.max(1)).max(1);
        Downsampler { full_nx: nx, full_ny: ny, factor, sums: vec![0.0; nx.div_ceil(factor) * ny.div_ceil(factor)] }
    }

    /// Adds row `y` of `nx` values. Every row must be added once, in any order.
    pub fn add_row(&mut self, y: usize, row: &[f64]) {
        let small_nx = self.full_nx.div_ceil(self.factor);
        let cells = &mut self.sums[y / self.factor * small_nx..][..small_nx];
        for (cell, block) in cells.iter_mut().zip(row.chunks(self.factor)) {
            *cell += block.iter().sum::<f64>();
        }
    }

    pub fn finish(mut self) -> DownsampledMap {
        let (nx, ny) = (self.full_nx.div_ceil(self.factor), self.full_ny.div_ceil(self.factor));
        let length = |i: usize, full: usize| self.factor.min(full - i * self.factor);
        for y in 0..ny {
            for x in 0..nx {
                self.sums[y * nx + x] /= (length(x, self.full_nx) * length(y, self.full_ny)) as f64;
            }
        }
        DownsampledMap { nx, ny, factor: self.factor, values: self.sums }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn downsample(nx: usize, values: &[f64], longest: usize) -> DownsampledMap {
        let mut downsampler = Downsampler::new(nx, values.len() / nx.max(1), longest);
        values.chunks_exact(nx.max(1)).enumerate().for_each(|(y, row)| downsampler.add_row(y, row));
        downsampler.finish()
    }

    #[test]
    fn means_over_whole_and_partial_blocks() {
        let values: Vec<f64> = (0..15).map(f64::from).collect();
        let small = downsample(5, &values, 3);
        assert_eq!((small.nx, small.ny, small.factor), (3, 2, 2));
        assert_eq!(small.values, [3.0, 5.0, 6.5, 10.5, 12.5, 14.0]);
        assert_eq!(downsample(5, &values, 5).values, values);
        assert_eq!(downsample(5, &values, 1).values, [7.0]);
    }
}

use super::columns::{SharedSpectrum, SpectrumColumns};
use super::{COLUMNS, Grid, HalfSpectrum, Real};
use crate::sys::prefetch;
use crate::sys::ranks::{ALONE, Ranks, share};
use rayon::prelude::*;
use rustfft::num_complex::Complex;
use std::ops::Range;
use std::sync::Mutex;

/// Blocks of columns that a rank transforms at a time, at least.
const BLOCKS: usize = 8;
/// Rows that a thread copies at a time.
const ROWS: usize = 64;
/// Distance of the prefetch in rows (see `transform`).
const AHEAD: usize = 16;

/// The ranks that share the rows of a grid.
pub fn sharing(ranks: &Ranks, grid: Grid) -> &Ranks {
    if grid.points() >= ranks.smallest_shared() && grid.ny >= ranks.count() { ranks } else { &ALONE }
}

/// Columns with all their rows: the matrix, the distance of its rows, and the number of its first column.
pub(super) type ColumnMatrix<'m, T> = (&'m mut [Complex<T>], usize, usize);

/// The rows of one rank, and the column pass over the rows of all.
///
/// The columns are transformed in rounds. In each, every rank receives a few blocks of columns from all others, as a matrix of all rows,
/// transforms them as they would be alone, and sends them back. The matrices are small compared with the slab. Blocks are the same
/// on any number of ranks, and their sums are added in the order of the columns.
pub(super) struct Slab<T> {
    ranks: Ranks,
    grid: Grid,
    buffers: Mutex<Buffers<T>>,
}

/// Columns of all rows, and the columns of the others in the rows of this rank.
struct Buffers<T> {
    whole: HalfSpectrum<T>,
    parts: HalfSpectrum<T>,
    source: HalfSpectrum<T>,
}

impl<T> Default for Buffers<T> {
    fn default() -> Self {
        Buffers { whole: HalfSpectrum::default(), parts: HalfSpectrum::default(), source: HalfSpectrum::default() }
    }
}

/// The columns of each rank in one round.
struct ExchangeRound {
    columns: Vec<Range<usize>>,
    own: usize,
}

impl ExchangeRound {
    fn own(&self) -> Range<usize> {
        self.columns[self.own].clone()
    }

    /// The columns of all ranks.
    fn all(&self) -> Range<usize> {
        self.columns.first().map_or(0, |c| c.start)..self.columns.last().map_or(0, |c| c.end)
    }

    /// The same columns, of those that a narrower spectrum has.
    fn within(&self, pitch: usize) -> ExchangeRound {
        let columns = self.columns.iter().map(|c| c.start.min(pitch)..c.end.min(pitch)).collect();
        ExchangeRound { columns, own: self.own }
    }
}

impl<T: Real> Slab<T> {
    pub(super) fn new(grid: Grid, ranks: &Ranks) -> Self {
        Slab { ranks: ranks.clone(), grid, buffers: Mutex::default() }
    }

    pub(super) fn ranks(&self) -> &Ranks {
        &self.ranks
    }

    pub(super) fn rows(&self) -> Range<usize> {
        self.ranks.share(self.grid.ny)
    }

    /// The rounds, and the blocks of each rank in all of them.
    fn rounds(&self) -> (Vec<ExchangeRound>, Vec<Vec<usize>>) {
        let (count, pitch) = (self.ranks.count(), self.grid.pitch());
        let blocks = pitch.div_ceil(COLUMNS);
        let largest = count * BLOCKS.next_multiple_of(self.ranks.threads());
        let mut blocks_of = vec![Vec::new(); count];
        let round = |first: usize| {
            let n = largest.min(blocks - first);
            let columns = (0..count).map(|rank| {
                let own = share(n, count, rank);
                let own = first + own.start..first + own.end;
                blocks_of[rank].extend(own.clone());
                COLUMNS * own.start..(COLUMNS * own.end).min(pitch)
            });
            ExchangeRound { columns: columns.collect(), own: self.ranks.own() }
        };
        let rounds = (0..blocks).step_by(largest).map(round).collect();
        (rounds, blocks_of)
    }

    /// The column pass over the spectrum of all ranks, given the rows of this one: `pass` over the columns of each round, which are sent
    /// back where it changes them. Returns the sums of all blocks.
    pub(super) fn columns(
        &self,
        spectrum: &mut [Complex<T>],
        changes: bool,
        pass: &dyn Fn(ColumnMatrix<'_, T>) -> Vec<f64>,
    ) -> Vec<f64> {
        let mut buffers = self.buffers.lock().unwrap_or_else(|e| e.into_inner());
        let Buffers { whole, parts, .. } = &mut *buffers;
        let (rounds, blocks_of) = self.rounds();
        let mut sums = Vec::new();
        for round in &rounds {
            let matrix = self.receive(spectrum, round, (whole, parts));
            let own = round.own();
            if !own.is_empty() {
                sums.extend(pass((matrix, own.len(), own.start)));
            }
            if changes {
                self.send_back(spectrum, round, (whole, parts));
            }
        }
        self.ordered(&sums, &blocks_of)
    }

    /// The column pass over a spectrum that `pass` sets, given the columns of another one (see
    /// [`inverse_filled`](super::Transform::inverse_filled)).
    pub(super) fn fill_columns(
        &self,
        spectrum: &mut [Complex<T>],
        source: Option<SharedSpectrum<'_, T>>,
        pass: &dyn Fn(ColumnMatrix<'_, T>, &SpectrumColumns<'_, T>),
    ) {
        let mut buffers = self.buffers.lock().unwrap_or_else(|e| e.into_inner());
        let Buffers { whole, parts, source: received } = &mut *buffers;
        for round in &self.rounds().0 {
            let own = round.own();
            let known = match &source {
                None => SpectrumColumns::NONE,
                Some(source) if !source.ranks.are_several() => source.columns(),
                Some(SharedSpectrum { grid, ranks, values }) => {
                    let round = round.within(grid.pitch());
                    let own = round.own();
                    let values = Slab::new(*grid, ranks).receive(values, &round, (received, parts));
                    SpectrumColumns { values, pitch: own.len(), first: own.start }
                }
            };
            if !own.is_empty() {
                let matrix = first_of(whole, self.grid.ny * own.len());
                pass((matrix, own.len(), own.start), &known);
            }
            self.send_back(spectrum, round, (whole, parts));
        }
        // Needed once.
        *received = HalfSpectrum::default();
    }

    /// Elements that every rank receives from this one in a round, and those that this one receives from every rank. This rank sends
    /// itself nothing; its own rows have their place among the received ones.
    fn counts(&self, round: &ExchangeRound) -> (Vec<usize>, Vec<usize>) {
        let rows = self.rows().len();
        let mut sent: Vec<usize> = round.columns.iter().map(|c| rows * c.len()).collect();
        sent[round.own] = 0;
        (sent, self.ranks.shares(self.grid.ny, round.own().len()))
    }

    /// The columns of this rank in a round, with the rows of all ranks.
    fn receive<'b>(
        &self,
        spectrum: &[Complex<T>],
        round: &ExchangeRound,
        (whole, parts): (&'b mut HalfSpectrum<T>, &mut HalfSpectrum<T>),
    ) -> &'b mut [Complex<T>] {
        let (pitch, all) = (self.grid.pitch(), round.all());
        let (sent, received) = self.counts(round);
        let whole = first_of(whole, received.iter().sum());
        let parts = first_of(parts, sent.iter().sum());
        let places = self.places(round, whole, parts, &sent);
        places.into_par_iter().zip(spectrum.par_chunks(ROWS * pitch)).for_each(|(mut places, rows)| {
            for (y, row) in rows.chunks_exact(pitch).enumerate() {
                prefetch(row.as_ptr().wrapping_add(AHEAD * pitch + all.start), all.len());
                for (position, columns) in places.iter_mut().zip(&round.columns) {
                    position[y * columns.len()..][..columns.len()].copy_from_slice(&row[columns.clone()]);
                }
            }
        });
        self.ranks.exchange((parts, &sent), (whole, &received));
        whole
    }

    /// Returns the columns of this rank to all others, and receives those of its rows.
    fn send_back(
        &self,
        spectrum: &mut [Complex<T>],
        round: &ExchangeRound,
        (whole, parts): (&mut HalfSpectrum<T>, &mut HalfSpectrum<T>),
    ) {
        let (pitch, all) = (self.grid.pitch(), round.all());
        let (sent, received) = self.counts(round);
        let whole = first_of(whole, received.iter().sum());
        let parts = first_of(parts, sent.iter().sum());
        self.ranks.exchange((whole, &received), (parts, &sent));
        let places = self.places(round, whole, parts, &sent);
        places.into_par_iter().zip(spectrum.par_chunks_mut(ROWS * pitch)).for_each(|(places, rows)| {
            for (y, row) in rows.chunks_exact_mut(pitch).enumerate() {
                prefetch(row.as_ptr().wrapping_add(AHEAD * pitch + all.start), all.len());
                for (position, columns) in places.iter().zip(&round.columns) {
                    row[columns.clone()].copy_from_slice(&position[y * columns.len()..][..columns.len()]);
                }
            }
        });
    }

    /// Where the rows of this rank lie in the exchanged matrices: of every [`ROWS`] rows the place of the columns of every rank.
    fn places<'b>(
        &self,
        round: &ExchangeRound,
        whole: &'b mut [Complex<T>],
        mut parts: &'b mut [Complex<T>],
        sent: &[usize],
    ) -> Vec<Vec<&'b mut [Complex<T>]>> {
        let rows = self.rows();
        let width = round.own().len();
        let mut own = Some(&mut whole[rows.start * width..rows.end * width]);
        let mut places: Vec<Vec<_>> = (0..rows.len().div_ceil(ROWS)).map(|_| Vec::new()).collect();
        for (rank, columns) in round.columns.iter().enumerate() {
            let (part, remainder) = std::mem::take(&mut parts).split_at_mut(sent[rank]);
            parts = remainder;
            let mut part = own.take_if(|_| rank == round.own).unwrap_or(part);
            for places in &mut places {
                let (place, remainder) = part.split_at_mut((ROWS * columns.len()).min(part.len()));
                places.push(place);
                part = remainder;
            }
        }
        places
    }

    /// The sums of all blocks in the order of the columns, given those of this rank.
    fn ordered(&self, local: &[f64], blocks_of: &[Vec<usize>]) -> Vec<f64> {
        let counts: Vec<usize> = blocks_of.iter().map(Vec::len).collect();
        let all = self.ranks.gather(local, &counts);
        let mut sums = vec![0.0; all.len()];
        blocks_of.iter().flatten().zip(all).for_each(|(block, sum)| sums[*block] = sum);
        sums
    }
}

/// The first `len` elements of a buffer, which grows to hold them.
fn first_of<T: Real>(buffer: &mut HalfSpectrum<T>, len: usize) -> &mut [Complex<T>] {
    if buffer.len() < len {
        *buffer = HalfSpectrum::of(len);
    }
    &mut buffer[..len]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Transform;
    use crate::sys::ranks::on_threads;

    /// Rows of a field on a grid.
    fn field<T: Real>(grid: Grid, rows: Range<usize>) -> Vec<T> {
        (rows.start * grid.nx..rows.end * grid.nx).map(|i| T::of(((i * i + 7 * i) % 101) as f64 / 17.0 - 2.0)).collect()
    }

    fn bits<T: Real>(values: &[T]) -> Vec<u64> {
        values.iter().map(|v| v.wide().to_bits()).collect()
    }

    fn filter<T: Real>(i: usize, column: &mut [Complex<T>]) -> f64 {
        let sum = column.iter().map(|c| c.norm_sqr().wide()).sum::<f64>() * (1.0 + i as f64);
        column.iter_mut().enumerate().for_each(|(m, c)| *c = c.scale(T::of(1.0 / (1.0 + (i + 2 * m) as f64))));
        sum
    }

    /// All passes over a grid: sums, and the rows of this rank of a filtered field, a spectrum, and a finer field through it.
    fn passes<T: Real>(grid: Grid, fine: Grid, shared: [&Ranks; 2]) -> (Vec<u64>, [Vec<u64>; 3]) {
        let transform = Transform::<T>::shared(grid, shared[0]);
        let mut own: Vec<T> = field(grid, transform.own_rows());
        let mut spectrum = transform.spectrum();
        let mut sums = vec![transform.forward_filtered(&own, &mut spectrum, &filter::<T>)];
        let known = bits::<T>(bytemuck::cast_slice(&spectrum));
        sums.push(transform.filter_columns(&mut spectrum, &filter::<T>));
        sums.push(transform.sum_columns(&mut spectrum, &filter::<T>));
        let refined = Transform::<T>::shared(fine, shared[1]);
        let (mut finer, mut values) = (refined.spectrum(), vec![T::zero(); refined.own_points()]);
        let source = SharedSpectrum { grid, ranks: shared[0], values: &spectrum };
        let (low, high) = (grid.half().min(fine.half()), grid.ny.min(fine.ny));
        refined.inverse_filled(&mut finer, &mut values, Some(source), &|i, known, column| {
            column.fill(Complex::default());
            if i < low {
                (0..high).for_each(|k| column[k] = known.at(k, i));
            }
        });
        transform.inverse(&mut spectrum, &mut own);
        let rows: Vec<[f64; 2]> = own.chunks(grid.nx).map(|row| [row[0].wide(), row[grid.nx - 1].wide()]).collect();
        sums.extend(transform.sum_rows(&rows));
        (bits(&sums), [bits(&own), known, bits(&values)])
    }

    fn check<T: Real>(grid: Grid, fine: Grid) {
        let alone = Ranks::default();
        let (sums, fields) = passes::<T>(grid, fine, [&alone; 2]);
        for count in 1..=4 {
            for coarse_is_shared in [true, false] {
                let actual = on_threads(count, |ranks| {
                    passes::<T>(grid, fine, [if coarse_is_shared { &ranks } else { &alone }, &ranks])
                });
                let description = format!("{} x {}, {count} ranks", grid.nx, grid.ny);
                assert!(actual.iter().all(|f| f.0 == sums), "{description}: sums");
                for (k, whole) in fields.iter().enumerate() {
                    let joined: Vec<u64> = match coarse_is_shared || k == 2 {
                        true => actual.iter().flat_map(|f| f.1[k].clone()).collect(),
                        false => actual[count - 1].1[k].clone(),
                    };
                    assert!(joined == *whole, "{description}: field {k}");
                }
            }
        }
    }

    /// Even, odd and oblong grids, with fewer rows or blocks than ranks, with one round and with several.
    #[test]
    fn passes_give_the_same_bits_on_any_number_of_ranks() {
        for (nx, ny) in [(1, 1), (2, 3), (8, 6), (15, 21), (64, 64), (63, 130), (400, 10), (10, 400), (700, 96)] {
            check::<f32>(Grid::unit(nx, ny), Grid::unit(2 * nx, ny + 3));
            check::<f64>(Grid::unit(nx, ny), Grid::unit(nx + 1, 2 * ny));
        }
    }
}

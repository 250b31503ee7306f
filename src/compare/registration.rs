use asperity_grid::{Grid, HalfSpectrum, Transform};

/// Periodic shift (x, y) in nodes, each at most half the grid, that maximises the cross-correlation of `map` with
/// `reference`.
/// Equal maps give (0, 0).
pub fn registration(grid: Grid, map: &[u8], reference: &[u8]) -> [i64; 2] {
    let transform = Transform::<f64>::new(grid);
    let spectrum_of = |m: &[u8]| -> HalfSpectrum<f64> {
        let field: Vec<f64> = m.iter().map(|v| f64::from(*v)).collect();
        let mut spectrum = transform.spectrum();
        transform.forward(&field, &mut spectrum);
        spectrum
    };
    let mut product = spectrum_of(map);
    for (p, r) in product.iter_mut().zip(&*spectrum_of(reference)) {
        *p = p.conj() * r;
    }
    let mut correlation = vec![0.0; grid.points()];
    transform.inverse(&mut product, &mut correlation);
    // Of equal peaks (an empty map) the smallest shift is taken.
    let signed = |k: usize, n: usize| if 2 * k > n { k as i64 - n as i64 } else { k as i64 };
    let place = |i: usize| [signed(i % grid.nx, grid.nx), signed(i / grid.nx, grid.ny)];
    let size = |[x, y]: [i64; 2]| x * x + y * y;
    let highest = correlation.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    // Correlations are counts of nodes, with rounding errors below one half.
    let peak = (0..correlation.len()).filter(|&i| correlation[i] > highest - 0.5).map(place);
    peak.min_by_key(|s| size(*s)).unwrap_or([0, 0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_a_periodic_shift() {
        let grid = Grid::unit(24, 18);
        let reference: Vec<u8> = (0..24 * 18).map(|i| u8::from((i * i + i / 7) % 11 == 0)).collect();
        for (sx, sy) in [(0i64, 0i64), (5, -3), (-8, 7), (12, 9)] {
            let map: Vec<u8> = (0..24 * 18)
                .map(|i| {
                    let (x, y) = ((i % 24) as i64, (i / 24) as i64);
                    reference[((y + sy).rem_euclid(18) * 24 + (x + sx).rem_euclid(24)) as usize]
                })
                .collect();
            assert_eq!(registration(grid, &map, &reference), [sx, sy]);
        }
        assert_eq!(registration(grid, &[0; 24 * 18], &reference), [0, 0]);
    }
}

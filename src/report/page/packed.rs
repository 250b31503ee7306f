//! Maps as compressed arrays for the script of the page.

use std::io::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;

use crate::record::downsample::DownsampledMap;
use crate::report::picture;

/// Levels of a stored value: the rounding is below 10⁻⁵ of the range of the map.
const LEVELS: f64 = 65_535.0;

/// A map for the script. `data`: base64 of a zlib stream; one byte per cell for flags, otherwise all high bytes and then
/// all low bytes of the 16-bit differences to the left neighbour. Rows from the lowest.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Packed {
    nx: usize,
    ny: usize,
    low: f64,
    high: f64,
    data: String,
}

/// Whether each cell is in contact.
pub(super) fn flags(map: &DownsampledMap) -> Packed {
    let bytes: Vec<u8> = (0..map.values.len()).map(|i| u8::from(picture::touches(map, i))).collect();
    Packed { nx: map.nx, ny: map.ny, low: 0.0, high: 1.0, data: packed(&bytes) }
}

/// Values of each cell in 16 bits.
pub(super) fn values(map: &DownsampledMap) -> Packed {
    let low = map.values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = map.values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let per_level = if high > low { LEVELS / (high - low) } else { 0.0 };
    let level = |v: f64| ((v - low) * per_level).round() as u16;
    let mut differences = Vec::with_capacity(map.values.len());
    for row in map.values.chunks(map.nx) {
        let mut last = 0_u16;
        for v in row {
            differences.push(level(*v).wrapping_sub(last));
            last = level(*v);
        }
    }
    let high_bytes = differences.iter().map(|d| (d >> 8) as u8);
    let bytes: Vec<u8> = high_bytes.chain(differences.iter().map(|d| (d & 0xff) as u8)).collect();
    Packed { nx: map.nx, ny: map.ny, low, high, data: packed(&bytes) }
}

fn packed(bytes: &[u8]) -> String {
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
    // Writing into memory does not fail.
    let _ = encoder.write_all(bytes);
    STANDARD.encode(encoder.finish().unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    /// Values decoded as the script decodes them.
    fn decoded(p: &Packed) -> Vec<f64> {
        let mut bytes = Vec::new();
        let compressed = STANDARD.decode(&p.data).expect("base64");
        flate2::read::ZlibDecoder::new(compressed.as_slice()).read_to_end(&mut bytes).expect("zlib");
        let (n, mut last) = (p.nx * p.ny, 0_u16);
        (0..n)
            .map(|i| {
                last = if i % p.nx == 0 { 0 } else { last };
                last = last.wrapping_add(u16::from(bytes[i]) << 8 | u16::from(bytes[n + i]));
                p.low + f64::from(last) * (p.high - p.low) / LEVELS
            })
            .collect()
    }

    #[test]
    fn values_survive_to_a_level() {
        let map_of = |values: Vec<f64>| DownsampledMap { nx: 7, ny: values.len() / 7, factor: 1, values };
        let map = map_of((0..35).map(|i| (f64::from(i) * 1.7).sin() - 0.3).collect());
        let actual = decoded(&values(&map));
        assert!(map.values.iter().zip(&actual).all(|(a, b)| (a - b).abs() <= 2.0 / LEVELS), "{actual:?}");
        assert_eq!(decoded(&values(&map_of(vec![2.5; 14]))), [2.5; 14]);
    }
}

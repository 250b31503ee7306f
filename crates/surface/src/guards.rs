//! Warnings about maps that are probably not what their reader takes them for.

use crate::preparation::{SUSPECT, suspected_outliers};
use crate::scan_lines;
use asperity_grid::{Grid, rms, sum_rows};

/// Smaller side (points) below which a map resolves hardly any wave.
const FEW_POINTS: usize = 16;

/// Digitisation step over the rms height above which light contact is dominated by terraces (eight bits over a range
/// of six rms heights: 0.023).
const COARSE_STEP: f64 = 0.02;

/// Fraction of nodes as high as their neighbours along both axes, below which equal steps belong to the shape (a
/// wedge).
const TERRACES: f64 = 0.01;

/// Mean square of the differences across an edge, over that of neighbours inside, from which on the map does not repeat. On 100
/// periodic self-affine surfaces (H from 0.3 to 0.8, shortest wave of 2 to 8 points) it was at most 2.0, 2.4 and 1.9 on 64², 128² and
/// 256² points; with a tilt of a tenth of their rms slope at least 26, 140 and 620; on parts of larger surfaces at least 4.1, 7.7 and
/// 12, so that 97, 100 and 100 of 100 are found.
const SEAM: f64 = 5.0;

/// rms gradient below which the unit is in doubt. Ground, blasted and polished metals have 0.003 to 1; heights in µm that are read
/// as nm, a factor of 1000, make 0.000003 to 0.001 of it. Polished optics and wafers have 1e-6 to 1e-3: they are warned about in
/// part, and the warning says so.
const FLAT: f64 = 1e-4;

/// rms gradient above which the unit is in doubt. That of the contact-mechanics challenge, 1, is at the limit of small-slope theory.
const STEEP: f64 = 3.0;

/// Ratio of the pixel's sides above which waves of one length are resolved along one axis and not along the other.
const OBLONG: f64 = 2.0;

/// Ratio of the pixel's sides, minus one, up to which pixels count as square: extents are often given with three digits.
const SQUARE: f64 = 0.01;

/// Columns of a table of positions and heights, and rows from which on one is recognised.
const TABLE_COLUMNS: usize = 3;
const TABLE_ROWS: usize = 8;

/// Suspected outliers, over the points of a side (geometric mean), above which they are features of the surface: a rim or a scratch is
/// a line of points.
const SPIKES: f64 = 0.25;

/// Warnings about the quality of a height map `[ny, nx]` in any unit, one sentence each. Of outliers the preparation warns, which sees the
/// map as it was measured.
pub fn quality_warnings(grid: Grid, heights: &[f64]) -> Vec<String> {
    if let Some(table) = table_warning(grid, heights) {
        return vec![table];
    }
    // One line is a profile.
    let shortest = if grid.nx.min(grid.ny) == 1 { grid.nx.max(grid.ny) } else { grid.nx.min(grid.ny) };
    let few = (shortest < FEW_POINTS).then(|| {
        format!(
            "a map of {} x {} points: with fewer than {FEW_POINTS} points along a side hardly any wave is resolved, and results depend on the \
             grid",
            grid.nx, grid.ny
        )
    });
    let pixels = swapped_warning(grid).or_else(|| oblong_warning(grid));
    few.into_iter()
        .chain(pixels)
        .chain(terrace_warning(grid, heights))
        .chain(scan_lines::warning(grid, heights))
        .collect()
}

/// Warnings for rms gradients that suggest a wrong unit.
pub fn slope_warnings(rms_gradient: f64) -> Option<String> {
    if rms_gradient > STEEP {
        return Some(format!(
            "the rms gradient is {rms_gradient:.3}: the theory assumes small slopes, and so steep a surface suggests a wrong unit of length"
        ));
    }
    (rms_gradient > 0.0 && rms_gradient < FLAT).then(|| {
        format!(
            "the rms gradient is {rms_gradient:.1e}, as only polished optics and wafers have: unless this is one, check the units of heights \
             and extents"
        )
    })
}

/// Warning for a map `[ny, nx]` that does not repeat, if it is taken as periodic: the differences of heights across an edge are
/// far larger than those inside.
pub fn seam_warning(grid: Grid, heights: &[f64]) -> Option<String> {
    let [x, y] = seams(grid, heights);
    // Without differences inside, any step is a seam.
    let steep: Vec<_> = [("x", x), ("y", y)].into_iter().filter(|(_, seam)| seam.ratio() > SEAM).collect();
    (!steep.is_empty()).then(|| {
        let list = |value: &dyn Fn(&(&str, Seam)) -> String| steep.iter().map(value).collect::<Vec<_>>().join(" and ");
        let axes = list(&|(axis, _)| axis.to_string());
        let times = list(&|(_, seam)| format!("{:.1}", seam.ratio().sqrt()));
        let total = x.inside + x.across + y.inside + y.across;
        let fraction = 100.0 * (x.across + y.across) / total;
        let digits = if fraction < 1.0 { 2 } else { 0 };
        // A profile has no edges along y, and no patch.
        let patch = if grid.ny > 1 { " and `--non-periodic` solves it as a patch" } else { "" };
        format!(
            "the map does not repeat along {axes}: heights differ across its edges by {times} times as much as neighbours inside (rms), which is \
             {fraction:.digits$} % of the squared gradient; `--edges taper|mirror` makes it repeat{patch}, with `--detrend plane` first if it is \
             tilted"
        )
    })
}

/// Squared slopes along one axis.
#[derive(Debug, Clone, Copy)]
struct Seam {
    /// Sums over pairs of neighbours inside, and across the edge.
    inside: f64,
    across: f64,
    /// Pairs inside per pair across.
    pairs: f64,
}

impl Seam {
    /// Mean square across the edge over that inside.
    fn ratio(self) -> f64 {
        if self.across > 0.0 && self.pairs > 0.0 { self.across / (self.inside / self.pairs) } else { 0.0 }
    }
}

fn seams(grid: Grid, heights: &[f64]) -> [Seam; 2] {
    let (nx, ny) = (grid.nx, grid.ny);
    let sums = sum_rows(ny, |y| {
        let row = &heights[y * nx..(y + 1) * nx];
        let next = &heights[(y + 1) % ny * nx..][..nx];
        let along_x = row.windows(2).map(|pair| (pair[1] - pair[0]).powi(2)).sum::<f64>();
        let along_y = row.iter().zip(next).map(|(a, b)| (b - a).powi(2)).sum::<f64>();
        let last = y + 1 == ny;
        [along_x, (row[0] - row[nx - 1]).powi(2), if last { 0.0 } else { along_y }, if last { along_y } else { 0.0 }]
    });
    let seam = |inside: f64, across: f64, d: f64, n: usize| Seam {
        inside: inside / (d * d),
        across: across / (d * d),
        pairs: n as f64 - 1.0,
    };
    [seam(sums[0], sums[1], grid.dx(), nx), seam(sums[2], sums[3], grid.dy(), ny)]
}

/// Points whose extents fit the number of points only after an exchange of the axes.
fn swapped_warning(grid: Grid) -> Option<String> {
    let square = |a: f64, b: f64| (a / b - 1.0).abs() < SQUARE;
    let exchanged = [grid.ly / grid.nx as f64, grid.lx / grid.ny as f64];
    (square(exchanged[0], exchanged[1]) && !square(grid.dx(), grid.dy())).then(|| {
        format!(
            "{} x {} points (columns x rows) on extents in the ratio 1:{:.3} (x:y): pixels would be square with the extents exchanged, so \
             check which axis is which",
            grid.nx,
            grid.ny,
            grid.ly / grid.lx
        )
    })
}

fn oblong_warning(grid: Grid) -> Option<String> {
    let (dx, dy) = (grid.dx(), grid.dy());
    let ratio = dx.max(dy) / dx.min(dy);
    (ratio > OBLONG && grid.nx.min(grid.ny) > 1).then(|| {
        let square = |l: f64| (l / dx.max(dy)).round().max(1.0) as usize;
        let (long, short) = if dx > dy { ("x", "y") } else { ("y", "x") };
        format!(
            "pixels are {ratio:.1} times as long along {long} as along {short}, so short waves are resolved along {short} only: check the \
             extents, or make pixels square with `--resample {},{}`",
            square(grid.lx),
            square(grid.ly)
        )
    })
}

/// Two or three columns (or rows), the first of which increases, or decreases where high points touch first: a table of positions and
/// heights.
fn table_warning(grid: Grid, heights: &[f64]) -> Option<String> {
    let goes_on = |positions: &[f64]| positions.is_sorted_by(|a, b| a < b) || positions.is_sorted_by(|a, b| a > b);
    let table = |columns: usize, rows: usize| (2..=TABLE_COLUMNS).contains(&columns) && rows >= TABLE_ROWS;
    let column = || -> Vec<f64> { heights.iter().step_by(grid.nx).copied().collect() };
    let by_columns = table(grid.nx, grid.ny) && goes_on(&column());
    let by_rows = table(grid.ny, grid.nx) && goes_on(&heights[..grid.nx]);
    let (count, damage) = if by_columns { (grid.nx, "columns") } else { (grid.ny, "rows") };
    (by_columns || by_rows).then(|| {
        format!(
            "a map of {count} {damage}, the first of which increases or decreases throughout, is probably a profile of positions and heights: it is read \
             as a map of heights [ny, nx], so give a map without positions (for a profile its heights in 16 equal {damage})"
        )
    })
}

/// Warning about points that stand out of their neighbours, as `--remove-outliers` finds them in the measured map.
pub(crate) fn outlier_warning(grid: Grid, heights: &[f64]) -> Option<String> {
    let outliers = suspected_outliers(grid, heights, false);
    let scars = scan_lines::scars(grid, &outliers);
    let points = outliers.len() - scars.iter().sum::<usize>();
    let largest = (SPIKES * (grid.points() as f64).sqrt()).max(1.0);
    let spikes = Some(points).filter(|n| *n > 0 && *n as f64 <= largest).map(|n| counted(n, "point"));
    let segments = scars.iter().max().map(|longest| {
        format!("{} of scan lines (scars; the longest has {longest} points)", counted(scars.len(), "segment"))
    });
    let found: Vec<String> = segments.into_iter().chain(spikes).collect();
    let verb = if found.len() == 1 && found[0].starts_with("1 ") { "deviates" } else { "deviate" };
    (!found.is_empty()).then(|| {
        format!(
            "{} {verb} from the median of their 5 x 5 neighbours by more than {SUSPECT} robust standard deviations: spikes of an \
             instrument carry the first contact and `--remove-outliers {SUSPECT} --fill harmonic` replaces them; sharp peaks of the surface look alike, \
             and are to be kept",
            found.join(" and ")
        )
    })
}

fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

fn terrace_warning(grid: Grid, heights: &[f64]) -> Option<String> {
    let rms = rms(heights);
    let step = step(heights).filter(|step| *step > COARSE_STEP * rms && on_terraces(grid, heights) > TERRACES)?;
    Some(format!(
        "heights are digitised in steps of {:.2} of their rms, so light contact is that of terraces: use a file with more digits \
         (single precision with a large offset has few)",
        step / rms
    ))
}

/// Fraction of nodes that are as high as the next one along both axes.
fn on_terraces(grid: Grid, heights: &[f64]) -> f64 {
    let level = (0..grid.points().saturating_sub(grid.nx))
        .filter(|&i| (i + 1) % grid.nx != 0 && heights[i] == heights[i + 1] && heights[i] == heights[i + grid.nx]);
    level.count() as f64 / grid.points() as f64
}

/// The digitisation step, if all heights are whole multiples of one step and there are few enough levels for it to
/// matter.
fn step(heights: &[f64]) -> Option<f64> {
    const MOST_LEVELS: usize = 1000;
    const SAMPLES: usize = 1 << 20;
    /// Rounding of the levels over a step, after conversion of units and subtraction of the mean.
    const ROUNDING: f64 = 1e-3;
    let mut levels = std::collections::HashSet::new();
    for h in heights.iter().step_by(heights.len().div_ceil(SAMPLES).max(1)) {
        // +0 and -0 are the same level.
        levels.insert((h + 0.0).to_bits());
        if levels.len() > MOST_LEVELS {
            return None;
        }
    }
    let mut levels: Vec<f64> = levels.into_iter().map(f64::from_bits).collect();
    levels.sort_by(f64::total_cmp);
    // Two levels alone may be a flat punch.
    let [first, _, _, ..] = levels[..] else { return None };
    let step = levels.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
    let is_whole = |l: &f64| ((l - first) / step - ((l - first) / step).round()).abs() < ROUNDING;
    levels.iter().all(is_whole).then_some(step)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Modes, Spectrum};
    use std::f64::consts::PI;

    #[test]
    fn small_and_digitised_maps_are_warned_about() {
        let grid = Grid::unit(64, 64);
        let on = |value: &dyn Fn(f64, f64) -> f64| -> Vec<f64> {
            (0..4096).map(|k| value(f64::from(k % 64) / 64.0, f64::from(k / 64) / 64.0)).collect()
        };
        let smooth = on(&|x, y| (2.0 * PI * x + 0.3).sin() + 0.7 * (2.0 * PI * y + 0.2).sin());
        assert_eq!(quality_warnings(grid, &smooth), [""; 0]);
        // Single precision, nanometres on an offset of a millimetre.
        let coarse: Vec<f64> = smooth.iter().map(|h| (f64::from((1e6 + h) as f32) - 1e6) * 1e-9).collect();
        let warnings = quality_warnings(grid, &coarse);
        assert!(matches!(&warnings[..], [one] if one.contains("steps of 0.07")), "{warnings:?}");
        // Steps that are part of the shape.
        let (punch, wedge) = (on(&|x, _| f64::from(x < 0.5)), on(&|x, _| (x - 0.5).abs()));
        assert_eq!([quality_warnings(grid, &punch), quality_warnings(grid, &wedge)], [[""; 0], [""; 0]]);
        assert!(matches!(&quality_warnings(Grid::unit(4, 4), &smooth[..16])[..], [one] if one.contains("4 x 4")));
    }

    /// Surface number k of 100: H from 0.3 to 0.8, four roll-offs, shortest waves of 2 to 8 points on 64² points of its cell.
    fn synthesised(k: usize, n: usize) -> Vec<f64> {
        let spectrum = Spectrum {
            hurst: 0.3 + 0.005 * k as f64,
            lambda_r: [1.0, 0.5, 0.25, 0.125][k % 4],
            lambda_s: [2.1, 4.0, 8.0][k % 3] / 64.0,
            ..Spectrum::CHALLENGE
        };
        Modes::new(spectrum, k as u64, 1.0).heights(Grid::unit(n, n), 0.0)
    }

    fn measured(heights: &[f64], n: usize, part: usize) -> Vec<f64> {
        heights.chunks(n).take(part).flat_map(|r| &r[..part]).copied().collect()
    }

    /// False alarms on periodic surfaces; detection of a tilt of a tenth of the rms gradient, and of parts of larger surfaces.
    #[test]
    fn seams_are_found_and_periodic_surfaces_are_not_warned_about() {
        /// Of 100 surfaces. The parts that are missed have no waves longer than their pixels can resolve.
        const FALSE_ALARMS: usize = 0;
        const TILTS: usize = 100;
        const PARTS: usize = 97;
        let grid = Grid::unit(64, 64);
        let (mut alarms, mut tilts, mut parts, mut spikes) = (0, 0, 0, 0);
        for k in 0..100 {
            let heights = synthesised(k, 64);
            alarms += usize::from(seam_warning(grid, &heights).is_some());
            spikes += usize::from(!quality_warnings(grid, &heights).is_empty());
            spikes += usize::from(outlier_warning(grid, &heights).is_some());
            let tilted: Vec<f64> = heights.iter().enumerate().map(|(i, h)| h + 0.1 * (i % 64) as f64 / 64.0).collect();
            tilts += usize::from(seam_warning(grid, &tilted).is_some());
            parts += usize::from(seam_warning(grid, &measured(&synthesised(k, 128), 128, 64)).is_some());
        }
        assert_eq!((alarms, spikes, tilts), (FALSE_ALARMS, FALSE_ALARMS, TILTS));
        assert!(parts >= PARTS, "{parts}");
    }

    #[test]
    fn seam_warnings_name_axis_size_and_remedies() {
        let grid = Grid { nx: 50, ny: 40, lx: 1.0, ly: 2.0 };
        let wave = |i: usize| (2.0 * PI * (i % 50) as f64 / 50.0).sin() + (4.0 * PI * (i / 50) as f64 / 40.0).cos();
        let tilted: Vec<f64> = (0..2000).map(|i| wave(i) + 0.3 * (i / 50) as f64).collect();
        let text = seam_warning(grid, &tilted).unwrap();
        assert!(
            text.contains("along y") && text.contains("--detrend plane") && text.contains("--edges taper|mirror"),
            "{text}"
        );
        assert_eq!(seam_warning(grid, &(0..2000).map(wave).collect::<Vec<_>>()), None);
        assert_eq!(seam_warning(grid, &[3.0; 2000]), None);
        assert_eq!(seam_warning(Grid::unit(1, 1), &[3.0]), None);
    }

    #[test]
    fn slopes_of_wrong_units_are_warned_about() {
        assert!(slope_warnings(5.0).unwrap().contains("gradient is 5.000"));
        assert!(slope_warnings(3e-5).unwrap().contains("3.0e-5, as only polished optics"));
        assert_eq!([0.0, 1e-3, 0.1, 1.0].map(slope_warnings), [const { None }; 4]);
    }

    #[test]
    fn pixels_tables_and_spikes_are_warned_about() {
        let wave = |i: usize| ((i * 7919) % 1009) as f64 / 1009.0;
        let warn = |grid: Grid| quality_warnings(grid, &(0..grid.points()).map(wave).collect::<Vec<_>>());
        assert_eq!(warn(Grid { nx: 40, ny: 20, lx: 2.0, ly: 1.0 }), [""; 0]);
        assert_eq!(warn(Grid { nx: 40, ny: 20, lx: 1.0, ly: 1.0 }), [""; 0]);
        let swapped = warn(Grid { nx: 40, ny: 20, lx: 1.0, ly: 2.0 });
        assert!(matches!(&swapped[..], [one] if one.contains("extents exchanged")), "{swapped:?}");
        let oblong = warn(Grid { nx: 40, ny: 20, lx: 1.0, ly: 1.6 });
        assert!(
            matches!(&oblong[..], [one] if one.contains("3.2 times") && one.contains("--resample 13,20")),
            "{oblong:?}"
        );
        let profile: Vec<f64> = (0..100).flat_map(|i| [0.5 * i as f64, wave(i)]).collect();
        let by_columns = quality_warnings(Grid::unit(2, 100), &profile);
        let turned: Vec<f64> = (0..200).map(|k| profile[k % 100 * 2 + k / 100]).collect();
        let by_rows = quality_warnings(Grid::unit(100, 2), &turned);
        let high: Vec<f64> = profile.iter().map(|h| 50.0 - h).collect();
        let by_high_columns = quality_warnings(Grid::unit(2, 100), &high);
        for (actual, damage) in [(by_columns, "2 columns"), (by_high_columns, "2 columns"), (by_rows, "2 rows")] {
            assert!(matches!(&actual[..], [one] if one.contains(damage) && one.contains("profile")), "{actual:?}");
        }
        let grid = Grid::unit(64, 64);
        let mut spiked = synthesised(10, 64);
        spiked[1000] += 40.0 * rms(&spiked);
        let actual = outlier_warning(grid, &spiked).expect("a spike");
        assert!(actual.contains("1 point deviates") && actual.contains("--fill"), "{actual}");
        assert_eq!(quality_warnings(grid, &spiked), [""; 0]);
    }
}

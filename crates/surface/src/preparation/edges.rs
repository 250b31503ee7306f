use super::isotropic;
use asperity_grid::{Grid, mean};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Part of the extent over which each end is tapered. 0.1 is the usual split cosine bell of spectral analysis (Bloomfield,
/// Fourier Analysis of Time Series, 1976): 64 % of the points keep their height.
const TAPERED: f64 = 0.1;

/// Treatment of the edges of a map that does not repeat.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum Edges {
    /// Heights fall to their mean towards the edges (Tukey window): the map repeats, its outer part is not the measured one.
    Taper,
    /// The map and its mirror images form a cell of twice the extent along both axes.
    Mirror,
}

impl Edges {
    pub(super) fn make(self, grid: Grid, heights: Vec<f64>) -> (Grid, Vec<f64>) {
        match self {
            Edges::Taper => (grid, taper(grid, heights)),
            Edges::Mirror => mirror(grid, &heights),
        }
    }

    /// The line of the history, for the map before this step.
    pub(super) fn line(self, grid: Grid) -> String {
        match self {
            Edges::Taper => {
                let untapered = |n: usize| window(n).iter().filter(|w| **w == 1.0).count();
                let kept = 100.0 * (untapered(grid.nx) * untapered(grid.ny)) as f64 / grid.points() as f64;
                format!(
                    "edges taper: to the mean over {} % of each side, {kept:.0} % of the points unchanged",
                    100.0 * TAPERED
                )
            }
            Edges::Mirror => {
                let cell = mirrored(grid);
                format!("edges mirror: a cell of {} x {} points, twice the extents", cell.nx, cell.ny)
            }
        }
    }
}

/// Copies of the measured map in the cell that steps of preparation made: four times as many after each time it was mirrored, twice as many
/// of a profile, after a crop as many as its part holds, at least one, and one of an isotropic map.
pub(crate) fn copies(history: &[String]) -> f64 {
    let numbers = |step: &str| -> Vec<f64> {
        step.split(|c: char| !c.is_ascii_digit()).filter_map(|digits| digits.parse().ok()).collect()
    };
    history.iter().fold(1.0, |copies: f64, step| match step.split(':').next() {
        // The line of the mirror: points of the cell, of which a profile has one along y.
        Some("edges mirror") => copies * if numbers(step).get(1) == Some(&1.0) { 2.0 } else { 4.0 },
        Some(isotropic::LINE) => 1.0,
        // The line of the crop: points of the part, its place, points of the whole.
        Some("crop") => match numbers(step)[..] {
            [nx, ny, _, _, of_nx, of_ny] => (copies * nx * ny / (of_nx * of_ny)).max(1.0),
            _ => copies,
        },
        // Of the first map a share lies below the other.
        Some(crate::facing::LINE) => {
            let share = step
                .split_once(crate::facing::SHARE)
                .and_then(|(before, _)| before.rsplit(' ').next()?.parse::<f64>().ok());
            share.map_or(copies, |share| (copies * share).max(1.0))
        }
        _ => copies,
    })
}

/// Tukey's window at the centres of `n` pixels.
fn window(n: usize) -> Vec<f64> {
    let value_at = |i: usize| {
        let from_edge = (i.min(n - 1 - i) as f64 + 0.5) / n as f64;
        if from_edge < TAPERED { 0.5 - 0.5 * (PI * from_edge / TAPERED).cos() } else { 1.0 }
    };
    (0..n).map(value_at).collect()
}

fn taper(grid: Grid, mut heights: Vec<f64>) -> Vec<f64> {
    let (wx, wy, mean) = (window(grid.nx), window(grid.ny), mean(&heights));
    heights.par_chunks_mut(grid.nx).zip(wy).for_each(|(row, wy)| {
        for (h, wx) in row.iter_mut().zip(&wx) {
            let w = wx * wy;
            // Exact where the window is 1.
            *h = w * *h + (1.0 - w) * mean;
        }
    });
    heights
}

/// A profile stays one line.
fn mirrored(grid: Grid) -> Grid {
    let cell = Grid { nx: 2 * grid.nx, lx: 2.0 * grid.lx, ..grid };
    if grid.ny == 1 { cell } else { Grid { ny: 2 * grid.ny, ly: 2.0 * grid.ly, ..cell } }
}

/// Mirrored about the outer edges of the last pixels, so that no point is on a mirror plane.
fn mirror(grid: Grid, heights: &[f64]) -> (Grid, Vec<f64>) {
    let cell = mirrored(grid);
    let rows = heights.chunks(grid.nx);
    let rows = rows.clone().chain(rows.rev()).take(cell.ny);
    (cell, rows.flat_map(|r| r.iter().chain(r.iter().rev())).copied().collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Placement, RoughBody};

    #[test]
    fn mirror_images_meet_without_a_step() {
        let grid = Grid { nx: 3, ny: 2, lx: 3.0, ly: 1.0 };
        let (cell, heights) = mirror(grid, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        assert_eq!(cell, Grid { nx: 6, ny: 4, lx: 6.0, ly: 2.0 });
        let first = [1.0, 2.0, 3.0, 3.0, 2.0, 1.0];
        let last = [4.0, 5.0, 6.0, 6.0, 5.0, 4.0];
        assert_eq!(heights, [first, last, last, first].concat());
    }

    #[test]
    fn mirrored_maps_are_counted() {
        let crop = |part: &str| format!("crop: {part} points from column 3, row 1 of 8 x 8");
        let plane = "detrend plane: slopes 1 and 2".to_string();
        let mirrored = Edges::Mirror.line(Grid::unit(4, 4));
        let count = |steps: &[&String]| copies(&steps.iter().map(|s| s.to_string()).collect::<Vec<_>>());
        assert_eq!([count(&[]), count(&[&plane, &crop("2 x 2")]), count(&[&plane, &mirrored])], [1.0, 1.0, 4.0]);
        assert_eq!(
            ["8 x 8", "8 x 4", "4 x 4", "2 x 2"].map(|part| count(&[&mirrored, &crop(part)])),
            [4.0, 2.0, 1.0, 1.0]
        );
        let line = Edges::Mirror.line(Grid { ny: 1, ..Grid::unit(4, 4) });
        let isotropic = format!("{}: one realisation", isotropic::LINE);
        assert_eq!([count(&[&line]), count(&[&line, &isotropic])], [2.0, 1.0]);
        // A quarter of a mirrored first map lies below the other body.
        let body = |n: usize, length: f64| RoughBody {
            grid: Grid { nx: n, ny: n, lx: length, ly: length },
            heights: vec![0.0; n * n],
        };
        let sum = |n: usize, length: f64| {
            body(8, 8.0).facing(body(n, length), &Placement::default(), false, "").expect("they overlap").line
        };
        assert_eq!([count(&[&mirrored, &sum(4, 4.0)]), count(&[&mirrored, &sum(8, 8.0)])], [1.0, 4.0]);
        assert_eq!([count(&[&sum(4, 4.0)]), count(&[&sum(4, 4.0), &mirrored])], [1.0, 4.0]);
        assert_eq!([count(&[&mirrored, &mirrored]), count(&[&Edges::Taper.line(Grid::unit(4, 4))])], [16.0, 1.0]);
    }

    /// The inner part is bit-identical; the outermost points are nearly at the mean.
    #[test]
    fn the_taper_changes_the_outer_part_only() {
        let grid = Grid::unit(40, 20);
        let heights: Vec<f64> = (0..800).map(|i| 7.0 + f64::from(i % 40) + (f64::from(i) * 0.7).sin()).collect();
        let tapered = taper(grid, heights.clone());
        for (i, (t, h)) in tapered.iter().zip(&heights).enumerate() {
            let inside = (4..36).contains(&(i % 40)) && (2..18).contains(&(i / 40));
            assert_eq!(t == h, inside, "{i}");
        }
        // The window is 0.04 at half a pixel of four.
        assert!((tapered[10 * 40] - mean(&heights)).abs() < 0.05 * (heights[10 * 40] - mean(&heights)).abs());
    }
}

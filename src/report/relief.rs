//! A height map in three dimensions: orthographic projection of shaded quads with a depth buffer. The script of the page
//! (`page/relief.js`) draws the same picture from any direction.

use std::fmt::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use image::ExtendedColorType;

use super::picture::{self, Rgb};
use super::scale::ends;
use super::svg::{DrawingSize, escaped, text};

/// Direction of the view, degrees, of the picture without JavaScript.
pub(super) const AZIMUTH: f64 = 30.0;
pub(super) const ELEVATION: f64 = 35.0;

/// Height of the picture over its width, and width of the cell over that of the picture.
const PROPORTION: f64 = 0.58;
const FILL: f64 = 0.6;

/// Depth of the block below its lowest point, over the width of the cell.
const FLOOR: f64 = 0.03;

/// Number of shades: few, so that the picture compresses well.
const SHADES: f64 = 24.0;

/// Colour of the surface outside the contact, and of the sides of the block.
pub(super) const GROUND: Rgb = [205, 208, 212];
const SIDE: Rgb = [150, 153, 158];

/// Heights upwards over the width of the cell, on a grid of nodes from the lowest row, and a colour for every node.
pub(super) struct Relief<'a> {
    pub nx: usize,
    pub heights: &'a [f64],
    pub colours: &'a [Rgb],
    /// Extent in y over extent in x.
    pub aspect: f64,
}

/// A view with its labels and data.
pub(super) struct ReliefFigure<'a> {
    pub alt: String,
    pub relief: Relief<'a>,
    /// Of the edges along x and y, and of the heights.
    pub labels: [String; 3],
    /// Heights upwards, and width of the cell, m.
    pub heights_m: Vec<f64>,
    pub length_m: f64,
}

impl ReliefFigure<'_> {
    /// Width of the picture, pixels.
    pub(super) const WIDTH: usize = 800;

    /// The picture with its labels.
    pub(super) fn svg(&self, png: &[u8], format: DrawingSize) -> String {
        let (t, width) = (format.text, format.width);
        let height = PROPORTION * width;
        let mut svg = format.open(height, &escaped(&self.alt));
        // Writing into a string does not fail.
        let _ = write!(
            svg,
            "<image width=\"{width:.2}\" height=\"{height:.2}\" href=\"data:image/png;base64,{}\"/>",
            STANDARD.encode(png)
        );
        let [x, y] = self.relief.edges(width);
        text(&mut svg, (x.0, x.1 + 1.6 * t), "start", &self.labels[0]);
        text(&mut svg, (y.0, y.1 + 1.6 * t), "end", &self.labels[1]);
        text(&mut svg, (0.3 * t, 1.3 * t), "start", &self.labels[2]);
        svg.push_str("</svg>");
        svg
    }
}

/// Point in picture coordinates: right, down, away from the viewer.
type Projected = [f64; 3];

struct Canvas {
    width: usize,
    height: usize,
    depth: Vec<f64>,
    pixels: Vec<[u8; 4]>,
}

impl Canvas {
    /// Fills a triangle; pixels whose centre is inside, in front of what is there.
    fn triangle(&mut self, [a, b, c]: [Projected; 3], [red, green, blue]: Rgb) {
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
        if area == 0.0 {
            return;
        }
        let ends = |k: usize, size: usize| {
            let (low, high) = (a[k].min(b[k]).min(c[k]), a[k].max(b[k]).max(c[k]));
            ((low - 0.5).ceil().max(0.0) as usize, ((high - 0.5).floor() + 1.0).clamp(0.0, size as f64) as usize)
        };
        let ((x0, x1), (y0, y1)) = (ends(0, self.width), ends(1, self.height));
        for y in y0..y1 {
            for x in x0..x1 {
                let (px, py) = (x as f64 + 0.5, y as f64 + 0.5);
                let fraction =
                    |p: Projected, q: Projected| ((q[0] - p[0]) * (py - p[1]) - (px - p[0]) * (q[1] - p[1])) / area;
                let (of_a, of_b, of_c) = (fraction(b, c), fraction(c, a), fraction(a, b));
                let depth = of_a * a[2] + of_b * b[2] + of_c * c[2];
                let index = y * self.width + x;
                if of_a >= 0.0 && of_b >= 0.0 && of_c >= 0.0 && depth < self.depth[index] {
                    self.depth[index] = depth;
                    self.pixels[index] = [red, green, blue, 255];
                }
            }
        }
    }

    fn quad(&mut self, [a, b, c, d]: [Projected; 4], colour: Rgb) {
        self.triangle([a, b, c], colour);
        self.triangle([a, c, d], colour);
    }
}

/// Light from the upper left of the viewer, unit vector (right, up, towards the viewer).
const LIGHT: [f64; 3] = [-0.42, 0.57, 0.705];

fn shaded(colour: Rgb, light: f64) -> Rgb {
    let fraction = 0.45 + 0.55 * (SHADES * light.clamp(0.0, 1.0)).round() / SHADES;
    colour.map(|c| (f64::from(c) * fraction).round() as u8)
}

impl Relief<'_> {
    /// Height of the picture of a width, pixels.
    pub(super) fn picture_height(width: usize) -> usize {
        (PROPORTION * width as f64).round() as usize
    }

    /// Middle of the lower edge along x and along y, right and down, in the picture of a width.
    pub(super) fn edges(&self, width: f64) -> [(f64, f64); 2] {
        let (low, high) = ends(self.heights.iter().copied());
        let middle = 0.5 * (low + high);
        let projected_point = |x: f64, y: f64| {
            let [right, down, _] = self.projected([x, y, low - FLOOR - middle], [width, PROPORTION * width]);
            (right, down)
        };
        [projected_point(0.0, -0.5 * self.aspect), projected_point(-0.5, 0.0)]
    }

    /// A point, from the middle of the block, in a picture of a width and height.
    fn projected(&self, [x, y, z]: [f64; 3], [width, height]: [f64; 2]) -> Projected {
        let (sin_a, cos_a) = AZIMUTH.to_radians().sin_cos();
        let (sin_e, cos_e) = ELEVATION.to_radians().sin_cos();
        let scale = FILL * width / self.aspect.max(1.0);
        let (across, away) = (x * cos_a - y * sin_a, x * sin_a + y * cos_a);
        let up = z * cos_e + away * sin_e;
        [0.5 * width + scale * across, 0.5 * height - scale * up, away * cos_e - z * sin_e]
    }

    /// PNG file contents, 8-bit RGBA, transparent around the block.
    pub(super) fn png(&self, width: usize) -> std::io::Result<Vec<u8>> {
        let canvas = self.drawn(width);
        picture::png(canvas.pixels.as_flattened(), (canvas.width, canvas.height), ExtendedColorType::Rgba8)
    }

    fn drawn(&self, width: usize) -> Canvas {
        let (nx, ny) = (self.nx, self.heights.len() / self.nx.max(1));
        let height = Self::picture_height(width);
        let mut canvas =
            Canvas { width, height, depth: vec![f64::INFINITY; width * height], pixels: vec![[0; 4]; width * height] };
        let (sin_a, cos_a) = AZIMUTH.to_radians().sin_cos();
        let (sin_e, cos_e) = ELEVATION.to_radians().sin_cos();
        let (low, high) = ends(self.heights.iter().copied());
        // A step over a node, and the floor of the block.
        let (dx, dy, floor) = (1.0 / nx as f64, self.aspect / ny as f64, low - FLOOR);
        let project = |x: f64, y: f64, z: f64| {
            let centred = [x - 0.5, y - 0.5 * self.aspect, z - 0.5 * (low + high)];
            self.projected(centred, [width as f64, height as f64])
        };
        let value_at = |i: usize, j: usize| self.heights[j * nx + i];
        let node = |i: usize, j: usize| project((i as f64 + 0.5) * dx, (j as f64 + 0.5) * dy, value_at(i, j));
        for j in 0..ny.saturating_sub(1) {
            for i in 0..nx.saturating_sub(1) {
                let slope_x =
                    (value_at(i + 1, j) - value_at(i, j) + value_at(i + 1, j + 1) - value_at(i, j + 1)) / (2.0 * dx);
                let slope_y =
                    (value_at(i, j + 1) - value_at(i, j) + value_at(i + 1, j + 1) - value_at(i + 1, j)) / (2.0 * dy);
                let (across, away) = (slope_x * cos_a - slope_y * sin_a, slope_x * sin_a + slope_y * cos_a);
                let normal = [-across, cos_e + away * -sin_e, sin_e + away * cos_e];
                let length = (1.0 + slope_x * slope_x + slope_y * slope_y).sqrt();
                let light = normal.iter().zip(LIGHT).map(|(n, l)| n * l).sum::<f64>() / length;
                let corners = [node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)];
                canvas.quad(corners, shaded(self.colours[j * nx + i], light));
            }
        }
        let mut wall = |(i, j): (usize, usize), (k, l): (usize, usize), light: f64| {
            let foot = |i: usize, j: usize| project((i as f64 + 0.5) * dx, (j as f64 + 0.5) * dy, floor);
            canvas.quad([node(i, j), node(k, l), foot(k, l), foot(i, j)], shaded(SIDE, light));
        };
        for i in 1..nx {
            wall((i - 1, 0), (i, 0), 0.8);
            wall((i - 1, ny - 1), (i, ny - 1), 0.8);
        }
        for j in 1..ny {
            wall((0, j - 1), (0, j), 0.4);
            wall((nx - 1, j - 1), (nx - 1, j), 0.4);
        }
        canvas
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::picture::{BLUE, ORANGE};

    /// A ridge hides what is behind it, and a flat map is drawn in one shade.
    #[test]
    fn what_is_behind_is_hidden() {
        let n = 32;
        let map = |ridge: f64, row: usize| -> Vec<f64> {
            (0..n * n).map(|k| if k / n == row { ridge } else { 0.0 }).collect()
        };
        let colours: Vec<Rgb> = (0..n * n).map(|k| if k / n > 20 { BLUE } else { ORANGE }).collect();
        let blue = |heights: &[f64]| {
            let canvas = Relief { nx: n, heights, colours: &colours, aspect: 1.0 }.drawn(300);
            canvas.pixels.iter().filter(|p| p[3] == 255 && p[2] > p[0]).count()
        };
        let flat = blue(&map(0.0, 0));
        assert!(flat > 2000, "{flat}");
        assert!(blue(&map(0.5, 19)) < flat / 4, "a ridge in front");
        assert!(blue(&map(0.5, n - 1)) >= flat / 2, "a ridge behind");
        let heights = map(0.0, 0);
        let canvas = Relief { nx: n, heights: &heights, colours: &vec![ORANGE; n * n], aspect: 1.0 }.drawn(300);
        let shades: std::collections::BTreeSet<[u8; 4]> = canvas.pixels.iter().copied().collect();
        // Transparent, the top, and two sides.
        assert_eq!(shades.len(), 4, "{shades:?}");
        assert!(
            Relief { nx: n, heights: &heights, colours: &colours, aspect: 1.0 }
                .png(300)
                .unwrap()
                .starts_with(b"\x89PNG")
        );
    }
}

//! Frames of any substrate under any rigid indenter: which atoms are which, the surface layer, and distances between the two bodies.
//! Nothing is assumed of the crystal.

use super::dump::DumpFrame;
use super::planar_cells::PlanarCells;
use asperity_grid::{Error, Result, mean};

/// An atom is below another one that is nearer than this along the surface and higher than [`COVER_HEIGHT`], both over the distance of
/// neighbours. The layers of crystals are at least 0.5 apart, and atoms of the second one are at most one distance away from one above.
/// Neighbours in a layer pass for one below the other beyond slopes of 0.4.
const COVER_REACH: f64 = 1.05;
const COVER_HEIGHT: f64 = 0.4;

/// The lower atoms of the double layers of bcc (111) and diamond (111) are 0.33 below three that are 0.94 away along the surface, with which
/// slopes of single layers compare. They are below [`SURROUNDING`] atoms within this distance, which are on average this much higher and on all
/// sides: the centre of those that are not below is within [`CENTRED`]; on the slope of a single layer it is 0.33 away or more.
const AROUND: f64 = 1.25;
const DOUBLE_LAYER: f64 = 1.0 / 6.0;
const NOT_BELOW: f64 = -0.1;
const SURROUNDING: usize = 3;
const CENTRED: f64 = 0.28;

/// Atoms from whose neighbours the distance of neighbours is found: the highest, as a dump may have these only.
const MEASURED_ATOMS: usize = 32;

/// Neighbours whose mean distance counts. Of one alone noise makes it too small, and so does hydrogen on a crystal.
const MEASURED_NEIGHBOURS: usize = 2;

/// Types, or elements of dumps that name them, of substrate and indenter.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BodyTypes {
    /// Empty: all that are not of the indenter.
    pub substrate: Vec<String>,
    /// Empty: the indenter is not in the dump.
    pub indenter: Vec<String>,
}

/// Indices in a frame of the atoms of both bodies.
#[derive(Debug, Clone, PartialEq)]
pub struct Bodies {
    pub substrate: Vec<usize>,
    pub indenter: Vec<usize>,
}

impl BodyTypes {
    /// The atoms of both bodies in a frame.
    ///
    /// # Errors
    /// `Input` for a type that the frame does not have, or no atom of the substrate.
    pub fn of(&self, frame: &DumpFrame) -> Result<Bodies> {
        let name = |species: u32| match (frame.element(species), frame.has_types) {
            (Some(element), true) => format!("{species} ({element})"),
            (Some(element), false) => element.to_string(),
            (None, _) => species.to_string(),
        };
        let mut present = frame.species.clone();
        present.sort_unstable();
        present.dedup();
        let present: Vec<(u32, String)> = present.into_iter().map(|s| (s, name(s))).collect();
        let names = || present.iter().map(|(_, name)| name.as_str()).collect::<Vec<_>>().join(", ");
        let find = |key: &str, types: &[String]| -> Result<Vec<u32>> {
            let one = |word: &String| {
                let accepted = match present.is_empty() {
                    true => "dumps with a column type or element".into(),
                    false => format!("types or elements of timestep {}: {}", frame.timestep, names()),
                };
                let is_type = |species: u32| frame.has_types && species.to_string() == *word;
                let is_meant = |species: u32| frame.element(species) == Some(word) || is_type(species);
                let known: Vec<u32> = present.iter().map(|(species, _)| *species).filter(|s| is_meant(*s)).collect();
                match known.is_empty() {
                    true => Err(Error::input(frame.source.display(), key, word, accepted)),
                    false => Ok(known),
                }
            };
            Ok(types.iter().map(one).collect::<Result<Vec<_>>>()?.concat())
        };
        let (above, below) = (find("--indenter-types", &self.indenter)?, find("--substrate-types", &self.substrate)?);
        let of = |k: usize, list: &[u32]| frame.species.get(k).is_some_and(|s| list.contains(s));
        let indenter: Vec<usize> = (0..frame.len()).filter(|&k| of(k, &above)).collect();
        let is_substrate = |&k: &usize| !of(k, &above) && (below.is_empty() || of(k, &below));
        let substrate: Vec<usize> = (0..frame.len()).filter(is_substrate).collect();
        if substrate.is_empty() {
            let (key, accepted) = match below.is_empty() {
                true => ("--indenter-types", "types that leave atoms to the substrate"),
                false => ("--substrate-types", "types that are not those of the indenter"),
            };
            return Err(Error::input(frame.source.display(), key, names(), accepted));
        }
        Ok(Bodies { substrate, indenter })
    }
}

/// Edges of the box along x and y, Å, whose ratio is that of the surface's cell to this tolerance.
const ASPECT: f64 = 1e-3;

/// Edges along x and y of a frame's box, which is to be periodic and `aspect` times as long along y as along x, Å.
///
/// # Errors
/// `Format` for another box.
pub fn box_edges(frame: &DumpFrame, aspect: f64) -> Result<[f64; 2]> {
    let edges = [0, 1].map(|axis| frame.length(axis));
    if let Some(open) = (0..2).find(|&axis| !frame.periodic[axis]) {
        let found = format!("a box that is not periodic along {}", ["x", "y"][open]);
        return Err(Error::format(
            &frame.source,
            found,
            "pp along x and y: the surface of the scene repeats with the box",
        ));
    }
    if ((edges[1] / edges[0]) / aspect - 1.0).abs() > ASPECT {
        let found = format!("a box of {:.4} x {:.4} Å", edges[0], edges[1]);
        let accepted = format!("sides along x and y in the ratio of the scene's surface, 1 : {aspect}");
        return Err(Error::format(&frame.source, found, accepted));
    }
    Ok(edges)
}

/// Mean distance of the nearest neighbours, Å: the median of the highest atoms. Infinite for fewer than two points.
fn neighbour_distance(points: &[[f64; 3]], edges: [f64; 2]) -> f64 {
    let mut order: Vec<usize> = (0..points.len()).collect();
    let count = MEASURED_ATOMS.min(order.len());
    if order.len() > count {
        order.select_nth_unstable_by(count, |&a, &b| points[b][2].total_cmp(&points[a][2]));
    }
    let image = |d: f64, edge: f64| d - (d / edge).round() * edge;
    let mean_distance = |&k: &usize| {
        let [x, y, z] = points[k];
        let distance = |p: &[f64; 3]| image(p[0] - x, edges[0]).hypot(image(p[1] - y, edges[1])).hypot(p[2] - z);
        let mut nearest = [f64::INFINITY; MEASURED_NEIGHBOURS];
        for (_, p) in points.iter().enumerate().filter(|(other, _)| *other != k) {
            let d = distance(p);
            let place = nearest.partition_point(|n| *n <= d);
            if place < nearest.len() {
                nearest[place..].rotate_right(1);
                nearest[place] = d;
            }
        }
        let known: Vec<f64> = nearest.into_iter().filter(|d| d.is_finite()).collect();
        if known.is_empty() { f64::INFINITY } else { mean(&known) }
    };
    let mut distances: Vec<f64> = order[..count].iter().map(mean_distance).collect();
    distances.sort_unstable_by(f64::total_cmp);
    distances.get(distances.len() / 2).copied().unwrap_or(f64::INFINITY)
}

fn planar(points: &[[f64; 3]]) -> Vec<[f64; 2]> {
    points.iter().map(|[x, y, _]| [*x, *y]).collect()
}

/// Indices of the points that no other covers from above: the surface layer. The cell is periodic along x and y.
pub fn uncovered(points: &[[f64; 3]], edges: [f64; 2]) -> Vec<usize> {
    let spacing = neighbour_distance(points, edges);
    if !(spacing.is_finite() && spacing > 0.0) {
        return (0..points.len()).collect();
    }
    let cells = PlanarCells::new(&planar(points), edges, spacing);
    let is_free = |&k: &usize| {
        let [x, y, z] = points[k];
        let height = |other: usize| (points[other][2] - z) / spacing;
        let near = cells.within([x, y], AROUND * spacing);
        let is_cover = |(other, [dx, dy]): &(usize, [f64; 2])| {
            height(*other) > COVER_HEIGHT && dx.hypot(*dy) < COVER_REACH * spacing
        };
        if near.iter().any(is_cover) {
            return false;
        }
        let around = near.iter().filter(|(other, _)| *other != k && height(*other) > NOT_BELOW);
        let (mut centre, mut higher, mut count) = ([0.0; 2], 0.0, 0);
        for (other, [dx, dy]) in around {
            centre = [centre[0] + dx, centre[1] + dy];
            higher += height(*other);
            count += 1;
        }
        let n = count as f64;
        let is_centred = (centre[0] / n).hypot(centre[1] / n) < CENTRED * spacing;
        !(count >= SURROUNDING && is_centred && higher / n > DOUBLE_LAYER)
    };
    (0..points.len()).filter(is_free).collect()
}

/// Distance of each point to the nearest atom of the indenter, Å; infinite beyond `reach`.
pub fn nearest_distances(points: &[[f64; 3]], indenter: &[[f64; 3]], edges: [f64; 2], reach: f64) -> Vec<f64> {
    let cells = PlanarCells::new(&planar(indenter), edges, reach);
    let lowest = indenter.iter().map(|p| p[2]).fold(f64::INFINITY, f64::min);
    let nearest = |&[x, y, z]: &[f64; 3]| {
        if z < lowest - reach {
            return f64::INFINITY;
        }
        let near = cells.within([x, y], reach).into_iter();
        let squares = near.map(|(k, [dx, dy])| dx * dx + dy * dy + (indenter[k][2] - z).powi(2));
        squares.fold(f64::INFINITY, f64::min).sqrt()
    };
    points.iter().map(nearest).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A number of a fixed sequence with mean 0 and standard deviation 1: the sum of twelve of a bit mixer.
    fn gaussian(k: usize) -> f64 {
        let uniform = |i: usize| {
            let mut x = (12 * k + i) as u64 + 1;
            for _ in 0..3 {
                x = (x ^ (x >> 31)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            }
            (x >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..12).map(uniform).sum::<f64>() - 6.0
    }

    /// Faces of crystals: flat, with a slope of 0.3, and shaken.
    #[test]
    fn the_surface_layer_is_that_of_the_crystal() {
        let cell = |basis: &[[f64; 3]], [a, b, c]: [f64; 3]| -> ([f64; 2], Vec<[f64; 3]>) {
            let n = 6;
            let at = |i: usize, top: f64, period: f64| (i as f64 + top) * period;
            let mut list = Vec::new();
            for k in 0..n * n * 3 {
                for [x, y, z] in basis {
                    list.push([at(k % n, *x, a), at(k / n % n, *y, b), at(k / (n * n), *z, c)]);
                }
            }
            ([n as f64 * a, n as f64 * b], list)
        };
        let (r2, r3) = (2f64.sqrt(), 3f64.sqrt());
        let h = 0.5;
        // Lattice constant 4 for fcc; nearest neighbours 3 apart for hcp and bcc.
        let fcc100 = cell(&[[0.0, 0.0, 0.0], [h, h, 0.0], [h, 0.0, h], [0.0, h, h]], [4.0; 3]);
        let fcc110 = cell(&[[0.0, 0.0, 0.0], [h, h, h]], [4.0, 2.0 * r2, 2.0 * r2]);
        let hcp = [[0.0, 0.0, 0.0], [h, h, 0.0], [h, 1.0 / 6.0, h], [0.0, h + 1.0 / 6.0, h]];
        let hcp = cell(&hcp, [3.0, 3.0 * r3, 3.0 * (8f64 / 3.0).sqrt()]);
        let bcc100 = cell(&[[0.0, 0.0, 0.0], [h, h, h]], [2.0 * 3.0 / r3; 3]);
        let diamond = [[0.0, 0.0], [h, h]]
            .map(|[x, y]| [[x, y, 0.0], [x + 0.25, y + 0.25, 0.25], [x + h, y, h], [x + 0.75, y + 0.25, 0.75]]);
        let diamond = cell(&diamond.concat(), [5.43; 3]);
        // Cells along [1-10], [11-2] and [111], two atoms in each plane; heights and places along [11-2] over the cell's edges.
        let stacked = |planes: &[(f64, f64)]| -> Vec<[f64; 3]> {
            planes.iter().flat_map(|&(y, z)| [[0.0, y, z], [h, y + h, z]]).collect()
        };
        let t = 1.0 / 3.0;
        let bcc111 = stacked(&[(0.0, 0.0), (t, t), (2.0 * t, 2.0 * t)]);
        let bcc111 = cell(&bcc111, [2.0 * r2, 2.0 * r2 * r3, r3]);
        let diamond111 =
            [(0.0, 0.25), (t, t), (t, t + 0.25), (2.0 * t, 2.0 * t), (2.0 * t, 2.0 * t + 0.25), (0.0, 1.0)];
        let diamond111 = cell(&stacked(&diamond111), [4.0 / r2, 4.0 * r3 / r2, 4.0 * r3]);
        // Above each atom of the top plane, 0.7 times the distance of neighbours √3 away.
        let mut hydrogenated = diamond111.clone();
        let top = hydrogenated.1.iter().map(|p| p[2]).fold(0.0, f64::max);
        let on_top: Vec<[f64; 3]> = hydrogenated.1.iter().filter(|p| p[2] > top - 1e-9).copied().collect();
        hydrogenated.1.extend(on_top.iter().map(|[x, y, z]| [*x, *y, z + 0.7 * r3]));
        let graphite = cell(&stacked(&[(t, 0.0), (2.0 * t, 0.0), (0.0, h), (t, h)]), [1.42 * r3, 1.42 * 3.0, 6.7]);
        for (name, (edges, points), per_cell) in [
            ("fcc (100)", fcc100, 2),
            ("fcc (110)", fcc110, 1),
            ("hcp (0001)", hcp, 2),
            ("bcc (100)", bcc100, 1),
            ("diamond (100)", diamond, 2),
            ("bcc (111)", bcc111, 2),
            ("diamond (111)", diamond111, 2),
            ("graphite", graphite, 4),
            ("diamond (111) with hydrogen", hydrogenated, 2),
        ] {
            let top = points.iter().map(|p| p[2]).fold(0.0, f64::max);
            let bent: Vec<[f64; 3]> = points
                .iter()
                .map(|&[x, y, z]| {
                    [
                        x - edges[0],
                        y,
                        z + 0.3 * edges[0] / std::f64::consts::TAU * (std::f64::consts::TAU * x / edges[0]).sin(),
                    ]
                })
                .collect();
            // Of neighbours, as at a surface near room temperature.
            let noise = 0.04 * neighbour_distance(&points, edges);
            let shaken: Vec<[f64; 3]> = points
                .iter()
                .enumerate()
                .map(|(k, p)| std::array::from_fn(|i| p[i] + noise * gaussian(3 * k + i)))
                .collect();
            for list in [&points, &bent, &shaken] {
                let found = uncovered(list, edges);
                assert_eq!(found.len(), 36 * per_cell, "{name}");
                assert!(found.iter().all(|&k| points[k][2] > top - 1e-9), "{name}");
            }
        }
    }

    #[test]
    fn distances_are_those_of_all_images() {
        let edges = [8.0, 5.0];
        let point =
            |k: u32, z: f64| [f64::from(k * 37 % 83) / 9.0, f64::from(k * 29 % 61) / 11.0, z + f64::from(k % 7) / 3.0];
        let below: Vec<[f64; 3]> = (0..60).map(|k| point(k, 0.0)).collect();
        let above: Vec<[f64; 3]> = (0..40).map(|k| point(k + 100, 3.0)).collect();
        let image = |d: f64, edge: f64| d - (d / edge).round() * edge;
        let found = nearest_distances(&below, &above, edges, 2.4);
        assert!(found.iter().any(|d| d.is_infinite()) && found.iter().any(|d| d.is_finite()));
        for (p, d) in below.iter().zip(found) {
            let exact = above
                .iter()
                .map(|a| image(a[0] - p[0], edges[0]).hypot(image(a[1] - p[1], edges[1])).hypot(a[2] - p[2]));
            let exact = exact.fold(f64::INFINITY, f64::min);
            assert!((d - exact).abs() < 1e-12 || exact > 2.4 && d > 2.4, "{d} {exact}");
        }
    }
}

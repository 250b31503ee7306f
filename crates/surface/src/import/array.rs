use super::attributes::Coordinate;
use super::content::ImportOptions;
use super::source::{list, quoted};
use crate::height_map::HeightMap;
use asperity_grid::error::{Error, Result};
use std::path::Path;

/// Names preferred for heights in a file with several arrays.
const USUAL: [&str; 3] = ["heights", "surface", "topography"];

/// A map in a file: an array in two dimensions, or a part of one in three.
#[derive(Debug)]
pub(super) struct Plane {
    /// Name of the array; with `[k]` where it has several planes.
    pub(super) name: String,
    pub(super) array: String,
    /// Which of the planes along the first dimension.
    pub(super) index: usize,
    pub(super) shape: [usize; 2],
}

impl Plane {
    /// The maps of an array: of one in more than two dimensions without those of length 1.
    pub(super) fn of(array: &str, shape: &[u64]) -> Vec<Plane> {
        /// Planes of one array that are named.
        const MOST: u64 = 1 << 12;
        let dimensions = map_dimensions(shape);
        let (count, [ny, nx]) = match dimensions[..] {
            [y, x] if shape[y] > 0 && shape[x] > 0 => (1, [shape[y], shape[x]]),
            [n, y, x] if shape[n] <= MOST => (shape[n], [shape[y], shape[x]]),
            _ => return Vec::new(),
        };
        let name = |k| if count == 1 { array.to_string() } else { format!("{array}[{k}]") };
        let plane = |k: u64| Plane {
            name: name(k),
            array: array.to_string(),
            index: k as usize,
            shape: [ny as usize, nx as usize],
        };
        (0..count).map(plane).collect()
    }

    /// Its part of the values of the array.
    pub(super) fn cut<T: Clone>(&self, values: &[T]) -> Vec<T> {
        let points = self.shape[0] * self.shape[1];
        values.get(self.index * points..(self.index + 1) * points).unwrap_or_default().to_vec()
    }
}

/// The dimensions that make up a map, or several.
pub(super) fn map_dimensions(shape: &[u64]) -> Vec<usize> {
    (0..shape.len()).filter(|k| shape.len() == 2 || shape[*k] != 1).collect()
}

/// Selects a map: the one requested by name, the only one, or the only one with a usual name.
pub(super) fn choose<'a>(path: &Path, planes: &'a [Plane], options: ImportOptions) -> Result<&'a Plane> {
    let words = |p: &Plane| format!("{} of {} x {}", p.name, p.shape[0], p.shape[1]);
    let list = list(&planes.iter().map(words).collect::<Vec<_>>());
    let last = |name: &str| name.rsplit('/').next().unwrap_or(name).to_string();
    if let Some(requested) = options.dataset {
        let found = planes.iter().find(|p| p.name.trim_start_matches('/') == requested.trim_start_matches('/'));
        return found.ok_or_else(|| {
            let accepted =
                if planes.is_empty() { "a file with a two-dimensional array of numbers".into() } else { list };
            Error::format(path, format!("no two-dimensional array of numbers named {}", quoted(requested)), accepted)
        });
    }
    let usual: Vec<&Plane> = planes.iter().filter(|p| USUAL.contains(&last(&p.name).as_str())).collect();
    match (planes, &usual[..]) {
        ([], _) => Err(Error::format(path, "no two-dimensional array of numbers", "a file with one")),
        ([only], _) => Ok(only),
        (_, [only]) => Ok(only),
        _ => {
            let found = format!("{} two-dimensional arrays ({list})", planes.len());
            Err(Error::format(path, found, "the name of one of them as --dataset (surface.dataset)"))
        }
    }
}

/// Names for a message and the provenance.
pub(super) fn names(planes: &[Plane]) -> Vec<String> {
    planes.iter().map(|p| p.name.clone()).collect()
}

/// Index order of a stored array.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Order {
    /// `[y, x]`, the order used in this program.
    RowsOfX,
    /// `[x, y]`, the order of SurfaceTopography and ContactMechanics.
    RowsOfY,
}

impl Order {
    pub(super) fn words(self) -> &'static str {
        match self {
            Order::RowsOfX => "[ny, nx]",
            Order::RowsOfY => "[nx, ny], the first index is x",
        }
    }
}

/// Name of an array that marks points that were not measured, as SurfaceTopography writes it.
pub(super) const MASK: &str = "mask";

/// Refuses a mask of another shape than the array `name`.
pub(super) fn check_mask(path: &Path, mask: &str, found: [usize; 2], (name, shape): (&str, [usize; 2])) -> Result<()> {
    if found == shape {
        return Ok(());
    }
    Err(Error::format(path, format!("{mask} of shape {found:?}"), format!("{shape:?}, as {name} has")))
}

/// Reverses a map along axes whose coordinates decrease, as lines of `x y h` are sorted. Returns words for the layout.
pub(super) fn reverse_descending(map: &mut HeightMap, axes: &[Option<Coordinate>; 2]) -> String {
    let points = [map.nx, map.ny];
    let decreases = |k: usize| {
        let values = axes[k].as_ref().map(|a| &a.values[..]).filter(|v| v.len() == points[k]).unwrap_or_default();
        matches!(values, [first, .., last] if last < first)
    };
    let (x, y) = (decreases(0), decreases(1));
    if y {
        // Reversed as a whole and within each row: the rows in reverse order.
        map.heights.reverse();
    }
    if x != y {
        map.heights.chunks_exact_mut(map.nx).for_each(<[f64]>::reverse);
    }
    let names: Vec<&str> = [(x, "x"), (y, "y")].iter().filter(|(reversed, _)| *reversed).map(|(_, n)| *n).collect();
    if names.is_empty() { String::new() } else { format!(", reversed along {}, which decreases", names.join(" and ")) }
}

/// Height map from an array `[first, second]` in C order; missing heights are NaN.
pub(super) fn map(path: &Path, [first, second]: [usize; 2], values: Vec<f64>, order: Order) -> Result<HeightMap> {
    let place = path.display().to_string();
    match order {
        Order::RowsOfX => HeightMap::with_missing(&place, second, first, values),
        Order::RowsOfY => {
            let turned = (0..values.len()).map(|i| values[i % first * second + i / first]).collect();
            HeightMap::with_missing(&place, first, second, turned)
        }
    }
}

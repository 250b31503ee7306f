//! The loads of a path, in the units of the caller.

use super::Field;

/// What is prescribed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LoadKind {
    /// Mean pressure over E* times the rms gradient.
    PStar,
    /// Mean pressure, in the unit of the modulus; compression is positive.
    Pressure,
    /// Normal force on the map, in the unit of modulus times length squared. A mirrored cell, of four maps, carries four times as much.
    Force,
    /// Mean gap, in the unit of the surface's length. It reaches states that are unstable under a prescribed pressure.
    MeanGap,
    /// Displacement from first contact, in the unit of the surface's length: mean gap at first contact minus mean gap.
    Displacement,
    /// Contact area over the area of the cell. The pressures that give it are found first.
    Contact,
}

impl LoadKind {
    /// The field of these loads.
    pub fn field(self) -> Field {
        match self {
            LoadKind::PStar => Field::PStar,
            LoadKind::Pressure => Field::Pressure,
            LoadKind::Force => Field::Force,
            LoadKind::MeanGap => Field::MeanGap,
            LoadKind::Displacement => Field::Displacement,
            LoadKind::Contact => Field::Contact,
        }
    }
}

/// Loads of one kind, in the order in which they are applied.
///
/// ```
/// use asperity_contact::problem::{LoadKind, Loads};
///
/// let loads = Loads { unload: true, ..Loads::new(LoadKind::Pressure, [0.1, 0.2, 0.4]) };
/// assert_eq!(loads.path(), [0.1, 0.2, 0.4, 0.2, 0.1]);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Loads {
    /// What is prescribed.
    pub kind: LoadKind,
    /// Its values.
    pub values: Vec<f64>,
    /// Whether the same loads follow in reverse.
    pub unload: bool,
    /// Whether the surfaces are then separated, to find the pull-off pressure.
    pub pull_off: bool,
}

impl Loads {
    /// Loads without an unloading branch or pull-off.
    pub fn new(kind: LoadKind, values: impl Into<Vec<f64>>) -> Self {
        Loads { kind, values: values.into(), unload: false, pull_off: false }
    }

    /// All loads, those of the unloading branch included.
    pub fn path(&self) -> Vec<f64> {
        let back = self.values.iter().rev().skip(1).filter(|_| self.unload);
        self.values.iter().chain(back).copied().collect()
    }

    /// Whether the path rises to its highest load and returns by the same loads, by `unload` or by its list.
    pub fn is_closed(&self) -> bool {
        let (half, n, path) = (self.values.len() / 2, self.values.len(), &self.values);
        let presses = !matches!(self.kind, LoadKind::MeanGap | LoadKind::Displacement);
        let mirrored = n % 2 == 1 && n > 1 && path.iter().eq(path.iter().rev());
        self.unload || presses && mirrored && path[..=half].is_sorted_by(|a, b| a < b)
    }

    /// How many loads come before the unloading branch of a closed path: all of any other path.
    pub fn loading_count(&self) -> usize {
        let count = self.path().len();
        if self.is_closed() { count.div_ceil(2) } else { count }
    }

    /// Whether a load imposes the mean gap.
    pub(super) fn impose_gaps(&self) -> bool {
        matches!(self.kind, LoadKind::MeanGap | LoadKind::Displacement)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_load_path_is_closed_if_its_loads_are_symmetric() {
        let is_closed = |p_star: &[f64]| Loads::new(LoadKind::PStar, p_star).is_closed();
        assert!(is_closed(&[0.01, 0.02, 0.05, 0.02, 0.01]));
        for path in [&[0.01][..], &[0.01, 0.02], &[0.01, 0.02, 0.01, 0.02], &[0.02, 0.01, 0.02], &[0.01, 0.03, 0.02]] {
            assert!(!is_closed(path), "{path:?}");
        }
        assert!(Loads { unload: true, ..Loads::new(LoadKind::PStar, [0.01, 0.02]) }.is_closed());
    }
}

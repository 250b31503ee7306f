//! Loads: the imposed quantity, its order and its branch.

use serde::{Deserialize, Serialize};

/// The imposed quantity.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub enum Load {
    /// Mean pressure over E*, compression positive.
    Pressure(f64),
    /// Mean gap, units of L. Includes states that are unstable under an imposed pressure.
    MeanGap(f64),
}

impl Load {
    /// Whether this load is lower than `previous`.
    fn is_below(self, previous: Load) -> bool {
        match (self, previous) {
            (Load::Pressure(now), Load::Pressure(before)) => now < before,
            (Load::MeanGap(now), Load::MeanGap(before)) => now > before,
            _ => false,
        }
    }
}

/// Branch of a load path. With adhesion or plasticity the state at a load depends on the branch.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Branch {
    #[default]
    Loading,
    Unloading,
}

/// Why a solver stopped.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Stop {
    #[default]
    Converged,
    #[serde(rename = "iteration limit")]
    IterationLimit,
    /// The residual has stalled at the level that rounding of the fields causes.
    #[serde(rename = "rounding floor of the precision")]
    RoundingFloor,
    /// No step lowers the energy, although the residual is above the rounding level.
    #[serde(rename = "no descent")]
    NoDescent,
    /// The state is not finite.
    Diverged,
    /// The surfaces have separated: the tension exceeds the pull-off stress.
    Detached,
    /// Stopped by the observer.
    Interrupted,
    /// The solver's criteria are met, but the final fields are not in equilibrium with the load.
    #[serde(rename = "no equilibrium: the final fields do not balance the load")]
    Rejected,
}

impl std::fmt::Display for Stop {
    /// The words of `results.json`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.serialize(f)
    }
}

/// One step of a scene's load path; results refer to it by its index.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadStep {
    /// Position on the load path, from 0.
    pub index: usize,
    /// Mean pressure over E* times the rms gradient; `None` if the mean gap is imposed.
    pub p_star: Option<f64>,
    pub target: Load,
    pub branch: Branch,
    /// Index of the step with the same load on the loading branch, for unloading steps of a closed path.
    pub counterpart: Option<usize>,
    /// Whether the scene requests the maps of this load.
    pub maps: bool,
    /// Whether `target` is the same on a finer grid. An imposed contact area or displacement is another pressure or mean gap there, so that the
    /// change to a coarser grid under the same `target` is no error of the state, and none is stated.
    pub same_on_finer_grids: bool,
}

impl LoadStep {
    /// A path of one load without maps. `gradient`: rms gradient.
    pub fn single(p_star: f64, gradient: f64) -> Self {
        let target = Load::Pressure(p_star * gradient);
        LoadStep {
            index: 0,
            p_star: Some(p_star),
            target,
            branch: Branch::Loading,
            counterpart: None,
            maps: false,
            same_on_finer_grids: true,
        }
    }

    /// The steps of `targets` in order. `p_star`: values of imposed pressures, empty if the mean gap is imposed.
    /// `loading_count`: number of steps before the unloading branch of a closed path; all steps for other paths.
    pub fn path(targets: &[Load], p_star: &[f64], loading_count: usize) -> Vec<Self> {
        let falls = |i: usize| i > 0 && targets[i].is_below(targets[i - 1]);
        let step = |(index, &target): (usize, &Load)| LoadStep {
            index,
            p_star: p_star.get(index).copied(),
            target,
            branch: if falls(index) { Branch::Unloading } else { Branch::Loading },
            counterpart: (index >= loading_count).then(|| (2 * loading_count).checked_sub(index + 2)).flatten(),
            same_on_finer_grids: true,
            maps: true,
        };
        targets.iter().enumerate().map(step).collect()
    }

    /// Imposes another `pressure` (over E*). `gradient`: pressure over E* at p* = 1.
    pub fn impose(&mut self, pressure: f64, gradient: f64) {
        self.target = Load::Pressure(pressure);
        self.p_star = self.p_star.map(|_| pressure / gradient);
    }

    /// The imposed p*, or p* of the resulting `pressure` (over E*) if the mean gap is imposed.
    pub fn p_star_at(&self, pressure: f64, gradient: f64) -> f64 {
        self.p_star.unwrap_or(pressure / gradient)
    }

    /// p* of an imposed pressure.
    ///
    /// # Panics
    /// If the mean gap is imposed, which scenes with atoms do not permit.
    pub fn imposed_p_star(&self) -> f64 {
        self.p_star.expect("an imposed pressure")
    }

    /// Number in file names and messages, from 1.
    pub fn number(&self) -> usize {
        self.index + 1
    }
}

/// A result of one load step.
pub trait AtLoad {
    /// [`LoadStep::index`].
    fn index(&self) -> usize;
}

/// The result of step `index`, if `list` contains it.
pub fn at_step<T: AtLoad>(list: &[T], index: usize) -> Option<&T> {
    list.iter().find(|result| result.index() == index)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unloading_steps_refer_to_their_counterparts() {
        let p_star = [0.01, 0.02, 0.05, 0.02, 0.01];
        let targets = p_star.map(Load::Pressure);
        let path = LoadStep::path(&targets, &p_star, 3);
        assert_eq!(path.iter().map(|s| s.counterpart).collect::<Vec<_>>(), [None, None, None, Some(1), Some(0)]);
        let unloading: Vec<usize> = path.iter().filter(|s| s.branch == Branch::Unloading).map(|s| s.index).collect();
        assert_eq!(unloading, [3, 4]);
        // A path with decreasing loads only is not closed.
        let path = LoadStep::path(&targets[2..], &p_star[2..], 3);
        assert!(path.iter().all(|s| s.counterpart.is_none()));
        assert_eq!(
            path.iter().map(|s| s.branch).collect::<Vec<_>>(),
            [Branch::Loading, Branch::Unloading, Branch::Unloading]
        );
    }

    #[test]
    fn a_larger_mean_gap_is_unloading() {
        let path = LoadStep::path(&[Load::MeanGap(0.2), Load::MeanGap(0.1), Load::MeanGap(0.2)], &[], 2);
        assert_eq!(
            (path[1].branch, path[2].branch, path[2].counterpart),
            (Branch::Loading, Branch::Unloading, Some(0))
        );
        assert_eq!(path[2].p_star_at(0.02, 2.0), 0.01);
    }
}

//! Units of a solve, so that results depend on the ratio of pressure to stiffness times gradient alone.
//!
//! Heights, gaps and pressures (over E*) of a linear elastic body may be multiplied by the same factor: the contact
//! stays the same. A solver that adds squares and compares stresses with constants needs numbers of ordinary size,
//! so heights far from it are divided by a power of two, which changes no digit.

use super::problem::{Heights, ReducedProblem};
use super::settings::{ExperimentSettings, Settings};
use super::{Equilibrium, Load, MethodEstimate};
use crate::interface::AttractionLaw;
use crate::observe::{Distribution, Plasticity, StressDistribution};
use asperity_grid::{Error, Result};
use asperity_grid::{Field, Series};
use std::borrow::Cow;

/// rms heights (L) that are solved as they are: their fourth powers are far from the limits of both precisions.
const ORDINARY: std::ops::RangeInclusive<f64> = 1e-9..=1e6;

/// Largest load over the unit: sums of squares over the nodes are finite.
const LARGEST: f64 = 1e140;

/// Unit of heights, gaps and stresses over E* of a solve: a power of two.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProblemScale(f64);

/// Heights in the unit of a [`ProblemScale`].
pub enum ScaledHeights {
    Nodes(Vec<f64>),
    Series(Series<f64>),
}

impl ScaledHeights {
    fn lend(&self) -> Heights<'_> {
        match self {
            ScaledHeights::Nodes(nodes) => Heights::Nodes(nodes),
            ScaledHeights::Series(series) => Heights::Series(series),
        }
    }
}

/// Whether a number kept its digits when `value` became `converted`: finite, and neither zero nor subnormal.
pub fn is_representable(value: f64, converted: f64) -> bool {
    value == 0.0 || converted.is_normal()
}

impl ProblemScale {
    pub const ONE: ProblemScale = ProblemScale(1.0);

    /// 1 for ordinary, flat and non-finite heights, else the power of two at or below the rms height.
    pub fn of(heights: &Heights) -> Self {
        let rms = heights.rms();
        if !rms.is_normal() || ORDINARY.contains(&rms) {
            return ProblemScale::ONE;
        }
        // A number without its mantissa.
        ProblemScale(f64::from_bits(rms.to_bits() & 0x7ff0_0000_0000_0000))
    }

    pub fn is_one(self) -> bool {
        self == ProblemScale::ONE
    }

    /// A length or stress in this unit.
    pub fn divide(self, value: f64) -> f64 {
        value / self.0
    }

    /// A length or stress that has this unit.
    pub fn multiply(self, value: f64) -> f64 {
        value * self.0
    }

    pub fn heights(self, heights: &Heights) -> ScaledHeights {
        match heights {
            Heights::Nodes(nodes) => ScaledHeights::Nodes(nodes.iter().map(|h| self.divide(*h)).collect()),
            // The reciprocal of the smallest units is infinite.
            Heights::Series(series) => ScaledHeights::Series(series.divided(self.0)),
            Heights::Planned(_) => unreachable!("a solve has heights"),
        }
    }

    /// The problem in this unit, with the heights in it.
    pub fn problem<'a>(self, problem: &ReducedProblem<'a>, heights: &'a ScaledHeights) -> ReducedProblem<'a> {
        let experiment = problem.settings.experiment;
        let optical_gap = self.divide(experiment.optical_gap);
        ReducedProblem {
            grid: problem.grid,
            heights: heights.lend(),
            power: None,
            kernel: problem.kernel,
            adhesion: problem.adhesion.in_units(self.0),
            wall: problem.wall.in_units(self.0),
            hardness: problem.hardness.map(|h| h.in_units(self.0)),
            precision: problem.precision,
            tolerance: problem.tolerance,
            max_iterations: problem.max_iterations,
            stiffness: problem.stiffness,
            ranks: problem.ranks,
            settings: Settings { experiment: ExperimentSettings { optical_gap, ..experiment }, ..problem.settings },
        }
    }

    pub fn adhesion(self, adhesion: AttractionLaw) -> AttractionLaw {
        adhesion.in_units(self.0)
    }

    pub fn load(self, load: Load) -> Load {
        match load {
            Load::Pressure(p) => Load::Pressure(self.divide(p)),
            Load::MeanGap(g) => Load::MeanGap(self.divide(g)),
        }
    }

    /// The loads in this unit.
    ///
    /// # Errors
    /// `Input` for heights that are not finite, and for a load or an adhesion that is not representable in it or whose
    /// square overflows.
    pub fn loads(self, problem: &ReducedProblem, loads: &[Load]) -> Result<Vec<Load>> {
        let rms = problem.heights.rms();
        let refuse = |key: &str, found: f64, unit: &str| {
            let accepted =
                format!("at most {LARGEST:e} times the scale of the heights, {:e} {unit}, and no subnormal", self.0);
            Err(Error::input("problem", key, format!("{found:e} {unit}"), accepted))
        };
        if !rms.is_finite() && problem.power.is_none() {
            return Err(Error::input("problem", "heights", format!("an rms of {rms} L"), "finite heights"));
        }
        let (law, own) = (problem.adhesion, problem.adhesion.in_units(self.0));
        if !(own.work_of_adhesion().is_finite() && own.range().is_finite()) {
            return refuse("work of adhesion", law.work_of_adhesion(), "E*L");
        }
        for load in loads {
            let (key, value, unit) = match *load {
                Load::Pressure(p) => ("pressure", p, "E*"),
                Load::MeanGap(g) => ("mean gap", g, "L"),
            };
            let own = self.divide(value);
            if !is_representable(value, value) || !is_representable(value, own) || own.abs() > LARGEST {
                return refuse(key, value, unit);
            }
        }
        Ok(loads.iter().map(|load| self.load(*load)).collect())
    }

    /// A field of this unit.
    pub fn field(self, field: Field) -> Vec<f64> {
        (0..field.len()).map(|i| self.multiply(field.at(i))).collect()
    }

    /// A state of a solve in this unit, with fields made by [`ProblemScale::field`] from its gap, stress and plastic
    /// displacement. Energies are
    /// the product of two factors and underflow where the square of the unit does.
    pub fn state<'a>(
        self,
        state: &Equilibrium<'a>,
        load: Load,
        ([gap, stress], plastic): ([&'a [f64]; 2], Option<&'a [f64]>),
    ) -> Equilibrium<'a> {
        let energy = |e: f64| self.multiply(self.multiply(e));
        Equilibrium {
            load,
            pressure: self.multiply(state.pressure),
            ranks: state.ranks,
            gap: Field::F64(gap),
            stress: Field::F64(stress),
            mean_gap: self.multiply(state.mean_gap),
            separation: self.multiply(state.separation),
            // A ratio of two numbers of this unit.
            stiffness: state.stiffness,
            energy: energy(state.energy),
            elastic_energy: energy(state.elastic_energy),
            interaction_energy: energy(state.interaction_energy),
            plastic: plastic.map(Field::F64),
            plasticity: state.plasticity.map(|p| Plasticity {
                displacement: self.multiply(p.displacement),
                work: energy(p.work),
                ..p
            }),
            load_error: state.load_error,
            residual: state.residual,
            complementarity: state.complementarity,
            error_estimates: state.error_estimates,
            stop: state.stop,
            iterations: state.iterations,
            fft_pairs: state.fft_pairs,
            seconds: state.seconds,
        }
    }

    /// An estimate of a method that worked in this unit, with fields as for [`ProblemScale::state`].
    pub fn estimate<'a>(
        self,
        estimate: &MethodEstimate<'a>,
        load: Load,
        [gap, stress]: [Option<&'a [f64]>; 2],
    ) -> MethodEstimate<'a> {
        let edges =
            |d: &Distribution| Distribution { edges: d.edges.iter().map(|e| self.multiply(*e)).collect(), ..d.clone() };
        MethodEstimate {
            load,
            pressure: self.multiply(estimate.pressure),
            mean_gap: estimate.mean_gap.map(|g| self.multiply(g)),
            gap,
            stress,
            gap_distribution: estimate.gap_distribution.as_ref().map(edges),
            stress_distribution: estimate
                .stress_distribution
                .as_ref()
                .map(|d| StressDistribution { all: edges(&d.all), contact: edges(&d.contact) }),
            ..estimate.clone()
        }
    }

    /// A gap in this unit; that of an ordinary problem as it is.
    pub fn gap(self, gap: &[f64]) -> Cow<'_, [f64]> {
        if self.is_one() { gap.into() } else { gap.iter().map(|g| self.divide(*g)).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_grid::Grid;

    /// Ordinary heights are left alone. Others are divided by a power of two that leaves an rms from 1 to 2.
    #[test]
    fn heights_far_from_one_are_divided_by_a_power_of_two() {
        let scale_of = |size: f64| ProblemScale::of(&Heights::Nodes(&[1.5 * size, -1.5 * size]));
        for size in [0.0, 1e-8, 1.0, 1e5, 1e-320, f64::NAN, f64::INFINITY] {
            assert_eq!(scale_of(size), ProblemScale::ONE, "{size:e}");
        }
        for size in [1e-306, 1e-100, 1e-10, 1e7, 1e100, 1e307] {
            let scale = scale_of(size);
            let heights = [1.5 * size, -1.5 * size];
            let ScaledHeights::Nodes(divided) = scale.heights(&Heights::Nodes(&heights)) else { panic!("nodes") };
            assert!((1.0..2.0).contains(&divided[0]), "{size:e}: {divided:?}");
            assert_eq!(scale.multiply(divided[0]), heights[0], "{size:e}");
        }
    }

    /// Loads that lose their digits are refused in one line, which names the load and the height.
    #[test]
    fn loads_out_of_range_are_refused() {
        let heights = [1e-200, -1e-200];
        let problem = ReducedProblem::new(Grid::unit(2, 1), &heights[..]);
        let scale = ProblemScale::of(&problem.heights);
        assert!(scale.loads(&problem, &[Load::Pressure(1e-200), Load::MeanGap(1e-199)]).is_ok());
        for load in [
            Load::Pressure(f64::INFINITY),
            Load::Pressure(f64::NAN),
            Load::Pressure(1e150),
            Load::Pressure(1e-310),
            Load::MeanGap(1e300),
        ] {
            let error = scale.loads(&problem, &[load]).expect_err("refused").to_string();
            assert!(error.starts_with("problem: ") && !error.contains('\n'), "{load:?}: {error}");
        }
    }
}

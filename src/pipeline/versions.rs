//! The model chain at one load: the continuum on the full heights, the continuum on the heights that the atoms resolve
//! (by each contact criterion), and the atoms. Gaps and contact are evaluated at the block's surface sites, and
//! stresses are smoothed by the same Gaussian.

use crate::compare::SitesOnGrid;
use crate::record::results::ModelChainStep;
use asperity_atoms::block::SurfaceSites;
use asperity_contact::observe::{Distribution, cumulative_area, gap_distribution, linear_edges, median_cluster_size};
use asperity_grid::{Field, Grid, smoothed};

/// Gap bins; about 70 surface sites per bin for a block of 25 nm.
const GAP_BINS: usize = 60;
const STRESS_BINS: usize = 80;
/// Factor on the range of bins, so that the last bin includes the largest value.
const ABOVE: f64 = 1.0 + 1e-9;

/// One step of the model chain, before its distributions are evaluated.
pub(super) struct Side {
    pub id: &'static str,
    pub criterion: String,
    /// Contact flag per surface site.
    pub touching: Vec<bool>,
    /// Gap per surface site, Å.
    pub gap: Vec<f64>,
    pub mean_gap_angstrom: f64,
    /// Smoothed normal stress, GPa, at the nodes of the step's own grid.
    pub stress: Vec<f64>,
}

/// A continuum solution at the same load.
pub(super) struct Solved<'a> {
    pub sites: &'a SitesOnGrid,
    pub grid: Grid,
    /// Gap in units of L; stress in units of E*.
    pub gap: Field<'a>,
    pub stress: Field<'a>,
    pub mean_gap: f64,
}

/// Factors from reduced units to the units of the atoms.
#[derive(Clone, Copy)]
pub(super) struct AtomUnits {
    pub length_angstrom: f64,
    pub modulus_gpa: f64,
    /// Width of the smoothing Gaussian, Å.
    pub width_angstrom: f64,
}

impl Solved<'_> {
    /// Smoothed normal stress, GPa.
    pub(super) fn smooth(&self, units: AtomUnits) -> Vec<f64> {
        let stress: Vec<f64> = (0..self.grid.points()).map(|i| self.stress.at(i) * units.modulus_gpa).collect();
        smoothed(self.grid, &stress, units.width_angstrom / units.length_angstrom)
    }

    /// `touching`: which sites are in contact.
    pub(super) fn side(
        &self,
        id: &'static str,
        criterion: String,
        touching: Vec<bool>,
        stress: Vec<f64>,
        units: AtomUnits,
    ) -> Side {
        Side {
            id,
            criterion,
            touching,
            gap: self.sites.sample(self.gap).into_iter().map(|g| g * units.length_angstrom).collect(),
            mean_gap_angstrom: self.mean_gap * units.length_angstrom,
            stress,
        }
    }
}

/// All steps of the model chain at the pressure `pressure_gpa`, with common bins.
pub(super) fn versions(sides: Vec<Side>, sites: &SurfaceSites, pressure_gpa: f64) -> Vec<ModelChainStep> {
    let all = |value: fn(&Side) -> &Vec<f64>| {
        let values = sides.iter().flat_map(value);
        values.fold((0.0, 0.0), |(a, b): (f64, f64), v| (a.min(*v), b.max(*v)))
    };
    let edges = |(smallest, largest): (f64, f64), bins| {
        let top = if largest > smallest { smallest + ABOVE * (largest - smallest) } else { smallest + 1.0 };
        linear_edges(smallest, top, bins)
    };
    let (gap_edges, stress_edges) = (edges(all(|s| &s.gap), GAP_BINS), edges(all(|s| &s.stress), STRESS_BINS));
    let site_nm2 = sites.site_area() / 100.0;
    let step = |side: Side| {
        let sizes = sites.cluster_sizes(&side.touching);
        let fraction = side.touching.iter().filter(|t| **t).count() as f64 / side.touching.len() as f64;
        ModelChainStep {
            id: side.id.into(),
            criterion: side.criterion,
            contact_area: fraction,
            mean_gap_angstrom: side.mean_gap_angstrom,
            contact_stress_gpa: (fraction > 0.0).then(|| pressure_gpa / fraction),
            clusters: sizes.len(),
            median_cluster_area_nm2: median_cluster_size(&sizes).map(|a| a as f64 * site_nm2),
            cluster_area: cumulative_area(&sizes).into_iter().map(|(a, ratio)| [a as f64 * site_nm2, ratio]).collect(),
            gap: open_gaps(&side.gap, &side.touching, gap_edges.clone()),
            stress: gap_distribution(Field::F64(&side.stress), f64::NEG_INFINITY, stress_edges.clone()),
        }
    };
    sides.into_iter().map(step).collect()
}

/// Distribution of the gaps outside contact. Sites in contact are counted in the delta, whatever their gap.
fn open_gaps(gap: &[f64], touching: &[bool], edges: Vec<f64>) -> Distribution {
    let open: Vec<f64> = gap.iter().zip(touching).map(|(g, t)| if *t { f64::NEG_INFINITY } else { *g }).collect();
    gap_distribution(Field::F64(&open), f64::NEG_INFINITY, edges)
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_atoms::block::Block;

    #[test]
    fn every_version_counts_all_of_its_sites_in_the_same_bins() {
        const A0: f64 = 5.0;
        let sites = Block::new(5, 3, A0, 6.0).expect("valid").surface();
        // Two clusters: three sites of the first row, at distances of a0, and one three rows further on.
        let touching = |k: usize| k < 3 || k == 23;
        let side = |id, shift: f64, criterion: &str| Side {
            id,
            criterion: criterion.into(),
            touching: (0..50).map(touching).collect(),
            gap: (0..50).map(|k| f64::from(k) - 2.0 + shift).collect(),
            mean_gap_angstrom: 3.0,
            stress: (0..16).map(|k| f64::from(k % 4) * 0.5).collect(),
        };
        let actual = versions(vec![side("hard_wall", 0.0, "a"), side("atoms", 0.5, "b")], &sites, 2.0);
        for v in &actual {
            assert_eq!((v.gap.delta, v.gap.below, v.gap.above), (0.08, 0.0, 0.0));
            assert!((v.gap.total() - 1.0).abs() < 1e-12 && (v.stress.total() - 1.0).abs() < 1e-12);
            assert_eq!((v.contact_area, v.contact_stress_gpa), (0.08, Some(25.0)));
            // The area of a site is a0²/2 = 12.5 Å².
            assert_eq!((v.clusters, v.median_cluster_area_nm2), (2, Some(3.0 * 0.125)));
            assert_eq!(v.cluster_area, [[0.125, 0.25], [3.0 * 0.125, 1.0]]);
        }
        assert_eq!(actual[0].gap.edges, actual[1].gap.edges);
        assert_ne!(actual[0].gap.fractions, actual[1].gap.fractions);
    }
}

//! The contact area of a state: counted nodes without the excess along the edges of this problem.

use super::problem::{Equilibrium, ReducedProblem};
use crate::interface::{AttractionLaw, Elastic, Kernel, Law, Wall};
use crate::observe::{ContactArea, ContactEdges, ELASTIC_EDGE, contact_area_on_ranks};
use asperity_grid::Field;
use asperity_grid::sys::ranks::Ranks;
use std::f64::consts::PI;

/// Gap of the open node at an edge, over mean contact stress times spacing over E*, from which on the surface has a step there. On smooth
/// surfaces 1.5 % of the edges are beyond 3.
const STEP: f64 = 4.0;

/// Contact nodes per boundary edge below which no edge counts as a step, as far as the uncertainty is concerned: a strip of one node has 0.5 and a
/// square of eight by eight nodes 2. Behind so narrow contacts a smooth slope looks like a step.
const WIDE: usize = 2;

/// Wave number over that of the shortest wave of a grid (wavelength of two nodes) from which on waves count as missing. Fitted to solved
/// contacts with penalty walls and layers.
const FIRST_MISSING_WAVE: f64 = 0.8;

/// Additional excess of an edge, over that of an elastic one, at a cohesive resolution of 1.
const COHESIVE_EXCESS: f64 = 0.6;

/// Stress of a node over its hardness from which on it flows.
const FLOW_FRACTION: f64 = 0.999;

/// Nodes that flow, by index.
type Flows<'a> = &'a (dyn Fn(usize) -> bool + Sync);

impl ReducedProblem<'_> {
    /// Contact area of a state; a node of contact has a gap of at most `threshold`.
    pub fn contact_area(&self, state: &Equilibrium, threshold: f64) -> ContactArea {
        let flows = self.hardness.map(|h| move |i: usize| state.stress.at(i) >= FLOW_FRACTION * h.at(i));
        let flows = flows.as_ref().map(|flows| flows as Flows);
        self.contact_area_of((state.ranks, state.gap), state.pressure, (threshold, flows))
    }

    /// The same of an iterate, whose flowing nodes have gaps below zero.
    pub(crate) fn contact_area_of_iterate(
        &self,
        (ranks, gap): (&Ranks, Field),
        pressure: f64,
        threshold: f64,
    ) -> ContactArea {
        let flows = |i: usize| gap.at(i) < 0.0;
        let flows = self.hardness.map(|_| &flows as Flows);
        self.contact_area_of((ranks, gap), pressure, (threshold, flows))
    }

    fn contact_area_of(
        &self,
        (ranks, gap): (&Ranks, Field),
        pressure: f64,
        (threshold, flows): (f64, Option<Flows>),
    ) -> ContactArea {
        let periodic = self.kernel.is_periodic();
        let counted =
            contact_area_on_ranks(ranks, self.grid, gap, ContactEdges { threshold, periodic, ..ContactEdges::COUNTED });
        let edges = ContactEdges { flows, ..self.edges(threshold, pressure / counted.contact_nodes) };
        let area = contact_area_on_ranks(ranks, self.grid, gap, edges);
        let known = if counted.count < WIDE * counted.free_edges { counted } else { area };
        let area = ContactArea { free_edges: known.free_edges, straight_edges: known.straight_edges, ..area };
        // Nothing carries more than the hardness.
        let smallest = self.hardness.filter(|h| h.map().is_none()).map_or(0.0, |h| pressure / h.mean());
        ContactArea { contact_area: area.contact_area.clamp(smallest.min(area.contact_nodes), 1.0), ..area }
    }

    /// The edges of a contact under a mean stress (E*) in it. A threshold above zero is a contour of the open gap, and unbiased.
    fn edges(&self, threshold: f64, contact_stress: f64) -> ContactEdges<'static> {
        let periodic = self.kernel.is_periodic();
        if threshold > 0.0 {
            return ContactEdges { threshold, periodic, ..ContactEdges::COUNTED };
        }
        let spacing = self.grid.dx().max(self.grid.dy());
        // Flow bounds the stress, so that smooth slopes would count as steps.
        let steps = contact_stress > 0.0 && self.adhesion == AttractionLaw::None && self.hardness.is_none();
        let step = if steps { STEP * contact_stress * spacing } else { f64::INFINITY };
        // Attraction closes nodes along the edge where the grid hardly resolves its range. Solved contacts: 1.9, 1.3, 1.15, 1.07 and
        // 1.02 at 1, 1.4, 2, 2.8 and 4 to 14. Below 1 the grid pins the edge, and no factor is known.
        let cohesive = self.adhesion.resolution_on(spacing).map_or(1.0, |r| 1.0 + COHESIVE_EXCESS / r.max(1.0).powi(2));
        ContactEdges { threshold, excess: ELASTIC_EDGE * self.edge_factor() * cohesive, step, periodic, flows: None }
    }

    /// Excess of an edge over that of a half-space under a hard wall: the mean over waves shorter than the grid's of the slope
    /// -d ln C/d ln q of the compliance C of body and wall, by which the contact would differ if the grid had these waves. It is 1 for
    /// a half-space, 0 where the response is local (a soft wall, a compressible layer thinner than a node), and negative
    /// for an incompressible layer thinner than a node. On 200 solved contacts the excess differs from it by 0.01 of an
    /// edge, with layers thinner than half a node by 0.02.
    fn edge_factor(&self) -> f64 {
        const SAMPLES: i32 = 32;
        const DIFFERENCE: f64 = 1e-3;
        if self.wall == Wall::Hard && !matches!(self.kernel, Elastic::Layer(_)) {
            return 1.0;
        }
        // Where the wall begins to repel; without slope there it is softer than any body.
        let compliance = match self.wall.soft() {
            None => 0.0,
            Some(wall) => match wall.slope(-f64::MIN_POSITIVE).abs() {
                0.0 => return 0.0,
                slope => slope.recip(),
            },
        };
        let spacing = (self.grid.dx() * self.grid.dy()).sqrt();
        let log_compliance = |q: f64| (self.kernel.stiffness(q, 0.0).recip() + compliance).ln();
        let slope = |q: f64| {
            (log_compliance(q * (1.0 - DIFFERENCE)) - log_compliance(q * (1.0 + DIFFERENCE))) / (2.0 * DIFFERENCE)
        };
        let first = FIRST_MISSING_WAVE * PI / spacing;
        (0..SAMPLES).map(|k| slope(first * f64::from(SAMPLES) / (f64::from(k) + 0.5))).sum::<f64>() / f64::from(SAMPLES)
    }
}

//! All-atom simulation: the scaled-down problem on a block of atoms, run by LAMMPS (Solhjoo & Vakis's submission).
//!
//! A continuum problem contains neither the block nor its potential nor a folder for LAMMPS, so this method runs from
//! a scene with `[atoms]`. The card lets tables and reports list it with the other methods.

use crate::prelude::*;

pub struct AllAtom;

/// Id of the method.
pub const ID: &str = "all-atom";

static CARD: MethodCard = MethodCard {
    id: ID,
    paper_name: "all-atom MD",
    family: "molecular simulation",
    kind: MethodKind::Estimate,
    needs: Needs::Heights,
    criterion: Criterion::CHALLENGE_ATOMS,
    calibrated_on: None,
    summary: "LAMMPS on a scaled-down block, for scenes with [atoms]",
    supports: |quantity| match quantity {
        Quantity::StressMap | Quantity::StressPdf => Support::No("only forces on atoms are computed, no stress field"),
        Quantity::Stiffness => Support::Only("as differences between loads"),
        _ => Support::Full,
    },
    capabilities: Capabilities { atoms: true, ..Capabilities::NONE },
    dois: &["10.1016/j.cpc.2021.108171", "10.1007/s11249-017-0900-2"],
    papers: &[],
    measured_errors: None,
};

impl ContactMethod for AllAtom {
    fn card(&self) -> &'static MethodCard {
        &CARD
    }

    fn plan(&self, _problem: &ReducedProblem) -> SolvePlan {
        // The cost of the block is estimated with the scene.
        SolvePlan { bytes: 0, iterations: 0, pairs_per_iteration: 0.0, seconds: 0.0 }
    }

    fn prepare<'p>(&self, _problem: &'p ReducedProblem<'p>, _watch: &'p dyn Observer) -> Result<StartedMethod<'p>> {
        Err(require::refused(ID, "atoms", "a continuum problem", "a scene with [atoms], for `asperity run`"))
    }
}

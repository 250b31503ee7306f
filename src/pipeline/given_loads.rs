//! How the loads of a scene are named.

use crate::record::given_loads::{GivenLoads, Imposed, LoadQuantity};
use crate::scene::Case;
use asperity_contact::problem::LoadKind;

/// As the scene gave them, at the laboratory scale: a block of atoms has the same p*.
pub(super) fn given_loads(case: &Case) -> GivenLoads {
    let pascal = case.gradient * case.scales.modulus_pa;
    let kind = case.scene.load.loads().kind;
    let (quantity, of_p_star) = match kind {
        LoadKind::PStar => return GivenLoads::P_STAR,
        LoadKind::Pressure => (LoadQuantity::Pressure, pascal),
        LoadKind::Force => (LoadQuantity::Force, pascal * case.problem.surface.mapped_area()),
        // By the pressures that came out.
        LoadKind::MeanGap | LoadKind::Displacement | LoadKind::Contact => (LoadQuantity::Pressure, pascal),
    };
    GivenLoads { quantity, of_p_star, imposed: Imposed::of(kind) }
}

//! Registry of all methods, and lookup by id.

use super::contact_method::ContactMethod;
use super::{
    all_atom, bem_bspline, bicgstab, bvm, experiment, fast, fft_ia, gfmd, gfmd_fire, icha, ms_archard, persson,
    rl_archard, scgw, srgw, winkler,
};

/// All methods, in the order of the tables.
pub const REGISTRY: &[&dyn ContactMethod] = &[
    &fast::Fast,
    &gfmd::Gfmd,
    &bvm::Bvm,
    &gfmd_fire::GfmdFire,
    &fft_ia::FftIa,
    &bicgstab::Bicgstab,
    &bem_bspline::BemBspline,
    &winkler::Winkler,
    &srgw::Srgw,
    &icha::Icha,
    &persson::Persson,
    &scgw::Scgw,
    &ms_archard::MsArchard,
    &rl_archard::RlArchard,
    &experiment::Experiment,
    &all_atom::AllAtom,
];

/// The method with this id; `auto` is the fastest field solver.
pub fn find(id: &str) -> Option<&'static dyn ContactMethod> {
    if id == "auto" {
        return Some(&fast::Fast);
    }
    REGISTRY.iter().find(|m| m.card().id == id).copied()
}

/// All ids, for error messages.
pub fn ids() -> Vec<&'static str> {
    std::iter::once("auto").chain(REGISTRY.iter().map(|m| m.card().id)).collect()
}

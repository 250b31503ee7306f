//! Registry of all methods, and lookup by id.

use crate::{
    all_atom, bem_bspline, bicgstab, experiment, fft_ia, gfmd_fire, icha, ms_archard, persson, rl_archard, scgw, srgw,
    winkler,
};
use asperity_contact::method::ContactMethod;
use asperity_contact::method::{Bvm, Fast, Gfmd};

/// All methods, in the order of the tables.
pub const REGISTRY: &[&dyn ContactMethod] = &[
    &Fast,
    &Gfmd,
    &Bvm,
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
        return Some(&Fast);
    }
    REGISTRY.iter().find(|m| m.card().id == id).copied()
}

/// All ids, for error messages.
pub fn ids() -> Vec<&'static str> {
    std::iter::once("auto").chain(REGISTRY.iter().map(|m| m.card().id)).collect()
}

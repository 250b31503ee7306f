use super::{BemBsplineSettings, BicgstabSettings, FftIaSettings};
use serde::{Deserialize, Serialize};

/// What single methods may be told beside the problem, a table each; the defaults are the challenge's.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    pub fft_ia: FftIaSettings,
    pub bicgstab: BicgstabSettings,
    pub bem_bspline: BemBsplineSettings,
}

use super::{
    BemBsplineSettings, BicgstabSettings, ExperimentSettings, FftIaSettings, IchaSettings, MsArchardSettings,
    PerssonSettings, RlArchardSettings, SrgwSettings, WinklerSettings,
};
use serde::{Deserialize, Serialize};

/// Settings of single methods, one table for each under its id. The defaults are those of the challenge.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct Settings {
    pub fft_ia: FftIaSettings,
    pub bicgstab: BicgstabSettings,
    pub bem_bspline: BemBsplineSettings,
    pub winkler: WinklerSettings,
    pub srgw: SrgwSettings,
    pub icha: IchaSettings,
    pub persson: PerssonSettings,
    pub ms_archard: MsArchardSettings,
    pub rl_archard: RlArchardSettings,
    pub experiment: ExperimentSettings,
}

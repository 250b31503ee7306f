use super::ms_archard::MsArchardSettings;
use super::persson::PerssonSettings;
use super::rl_archard::RlArchardSettings;
use serde::{Deserialize, Serialize};

/// What single methods may be told beside the problem, a table each; the defaults are the challenge's.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    pub persson: PerssonSettings,
    pub ms_archard: MsArchardSettings,
    pub rl_archard: RlArchardSettings,
}

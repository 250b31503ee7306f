//! What a finished solve leaves in its folder, so that the same command tells it again instead of solving anew.

use crate::Result;
use crate::record::json;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::path::Path;

const FILE: &str = "done.json";

#[derive(Serialize, Deserialize)]
pub(super) struct Finished {
    key: String,
    /// What was told of each load, and of the pull-off.
    pub states: Vec<Value>,
    pub pull_off: Option<Value>,
}

impl Finished {
    /// That of a folder, if it is of this key and the fields are still there.
    pub fn find(folder: &Path, key: &str, fields: impl IntoIterator<Item = String>) -> Option<Finished> {
        let found: Finished = json::read(&folder.join(FILE)).ok()?;
        let whole = found.key == key && fields.into_iter().all(|name| folder.join(name).exists());
        whole.then_some(found)
    }

    /// Removes what another solve may have left: its fields are about to be replaced.
    pub fn forget(folder: &Path) {
        // What is not there need not go.
        let _ = std::fs::remove_file(folder.join(FILE));
    }

    pub fn write(folder: &Path, key: String, states: Vec<Value>, pull_off: Option<Value>) -> Result<()> {
        json::write(&folder.join(FILE), &Finished { key, states, pull_off })
    }
}

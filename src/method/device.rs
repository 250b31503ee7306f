use crate::{Error, Result};
use serde::Serialize;
use std::sync::OnceLock;

/// Processor on which the fields are solved. A choice of the process, as the number of threads is: results agree within
/// rounding.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Device {
    /// The processor's cores
    #[default]
    Cpu,
    /// An NVIDIA GPU (method `fast`; program built with the feature `cuda`)
    Cuda,
}

static CHOSEN: OnceLock<Device> = OnceLock::new();

impl Device {
    /// Chooses the device of this process; the first choice holds.
    ///
    /// # Errors
    /// `Input` for a GPU if the program was built without.
    pub fn choose(self) -> Result<()> {
        if self == Device::Cuda && !cfg!(feature = "cuda") {
            let accepted =
                "cpu: this program was built without the feature cuda (cargo build --release --features cuda)";
            return Err(Error::input("command line", "--device", "cuda", accepted));
        }
        CHOSEN.get_or_init(|| self);
        Ok(())
    }

    pub fn chosen() -> Self {
        CHOSEN.get().copied().unwrap_or_default()
    }
}

/// The GPU of this machine, or why there is none to be used.
pub fn gpu() -> String {
    #[cfg(feature = "cuda")]
    return crate::sys::gpu::card().unwrap_or_else(|why| format!("not usable: {why}"));
    #[cfg(not(feature = "cuda"))]
    return "not used: this program was built without the feature cuda".into();
}

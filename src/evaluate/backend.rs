//! Choice of backend.

use super::BackendInfo;
use super::by_size::by_size;
use super::gpu;
use super::simd::InstructionSet;
use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};

/// Where evaluations run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum BackendChoice {
    /// A real GPU if there is one, for populations of 512 candidates and more; else lanes on the processor.
    #[default]
    Auto,
    /// The `f64` reference.
    Cpu,
    /// `f32` lanes on the processor.
    Simd,
    /// A GPU, or a software driver that presents itself as one.
    Gpu,
}

crate::config::named!(BackendChoice {
    Auto = "auto",
    Cpu = "cpu",
    Simd = "simd",
    Gpu = "gpu",
});

impl BackendChoice {
    /// The backend to use; `adapter` is part of the name of the GPU that was asked for, if one was. Never `Auto`.
    ///
    /// `Auto` takes a GPU only where one is real: a software driver does the same work slower than lanes do. Naming an
    /// adapter asks for it, whatever it is.
    pub fn decided(self, adapter: Option<&str>) -> Self {
        match self {
            Self::Auto if adapter.is_some() || gpu::is_real() => Self::Gpu,
            Self::Auto => Self::Simd,
            chosen => chosen,
        }
    }

    /// The backend that would evaluate, as evaluators report it. The GPU is opened, nothing is compiled.
    ///
    /// # Errors
    /// [`Error::NoDevice`] if a GPU was asked for and none fits.
    pub fn would_be(self, adapter: Option<&str>) -> Result<BackendInfo> {
        let lanes = || BackendInfo::of_lanes(InstructionSet::best());
        match self.decided(adapter) {
            Self::Gpu => match gpu::would_be(adapter) {
                Ok(info) if self == Self::Auto && adapter.is_none() => Ok(by_size(info, &lanes())),
                Ok(info) => Ok(info),
                // Like evaluators: lanes take over if no GPU was asked for, and from a GPU that fails.
                Err(Error::NoDevice(_)) if self == Self::Auto && adapter.is_none() => Ok(lanes()),
                Err(Error::Device(_)) => Ok(lanes()),
                Err(error) => Err(error),
            },
            Self::Cpu => Ok(BackendInfo::reference()),
            _ => Ok(lanes()),
        }
    }
}

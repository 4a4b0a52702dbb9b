//! Choice of backend.

use super::gpu::devices;
use serde::{Deserialize, Serialize};
use std::sync::OnceLock;

/// Whether a real GPU is present. Asked once: it wakes every driver.
fn real_gpu() -> bool {
    static PRESENT: OnceLock<bool> = OnceLock::new();
    *PRESENT.get_or_init(|| devices().iter().any(|d| d.kind.is_real()))
}

/// Where evaluations run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum BackendChoice {
    /// A real GPU if there is one, else lanes on the processor.
    #[default]
    Auto,
    /// The `f64` reference.
    Cpu,
    /// `f32` lanes on the processor.
    Simd,
    /// A GPU, or a software driver that poses as one.
    Gpu,
}

impl BackendChoice {
    /// The backend to use; `adapter` is part of the name of the GPU that was asked for, if one was. Never `Auto`.
    ///
    /// `Auto` takes a GPU only where one is real: a software driver does the same work slower than lanes do. Naming an
    /// adapter asks for it, whatever it is.
    pub fn decided(self, adapter: Option<&str>) -> Self {
        match self {
            Self::Auto if adapter.is_some() || real_gpu() => Self::Gpu,
            Self::Auto => Self::Simd,
            chosen => chosen,
        }
    }
}

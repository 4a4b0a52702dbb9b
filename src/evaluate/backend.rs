//! Choice of backend.

use super::gpu::devices;

/// Where evaluations run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
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
            Self::Auto if adapter.is_some() || devices().iter().any(|d| d.kind.is_real()) => Self::Gpu,
            Self::Auto => Self::Simd,
            chosen => chosen,
        }
    }
}

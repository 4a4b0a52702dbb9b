//! Choice of backend.

use super::gpu::{GpuContext, devices};
use super::portions::Portions;
use super::simd::InstructionSet;
use super::{BackendInfo, Evaluator, FallbackEvaluator, Problem};
use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::sync::{Arc, OnceLock};

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

    /// What would evaluate, as evaluators name themselves: the GPU is opened, nothing is compiled.
    ///
    /// # Errors
    /// [`Error::NoDevice`] if a GPU was asked for and none fits.
    pub fn would_be(self, adapter: Option<&str>) -> Result<BackendInfo> {
        let lanes = || BackendInfo::of_lanes(InstructionSet::best());
        match self.decided(adapter) {
            Self::Gpu => match GpuContext::shared(adapter) {
                Ok(context) => Ok(context.backend_info()),
                // As evaluators do: lanes take over where no GPU was asked for, and from one that fails.
                Err(Error::NoDevice(_)) if self == Self::Auto && adapter.is_none() => Ok(lanes()),
                Err(Error::Device(_)) => Ok(lanes()),
                Err(error) => Err(error),
            },
            Self::Cpu => Ok(BackendInfo::reference()),
            _ => Ok(lanes()),
        }
    }
}

/// How one kind of problem is evaluated on each backend.
pub(super) struct Backends<G, L, R> {
    /// On a device.
    pub gpu: G,
    /// In lanes.
    pub lanes: L,
    /// By the reference.
    pub reference: R,
    /// Bytes that a candidate takes at the most while it is evaluated.
    pub bytes_each: u64,
}

impl<G, L, R> Backends<G, L, R> {
    /// An evaluator of `problem` on the backend chosen; `adapter` is part of the name of the GPU to use (see
    /// [`BackendChoice::decided`]). A GPU that fails at work is opened anew, and lanes take over from one that keeps failing
    /// (see [`FallbackEvaluator`]); populations are cut to what memory is allowed (see [`Portions`]).
    ///
    /// # Errors
    /// [`Error::NoDevice`] if a GPU was asked for and none fits. `Auto` without a named adapter never fails for want of one.
    pub fn open<'a, OnDevice, InLanes, Reference>(
        self,
        problem: &'a Problem,
        choice: BackendChoice,
        adapter: Option<&str>,
    ) -> Result<Box<dyn Evaluator + 'a>>
    where
        OnDevice: Evaluator + 'a,
        InLanes: Evaluator + 'a,
        Reference: Evaluator + 'a,
        G: Fn(Arc<GpuContext>) -> Result<OnDevice> + 'a,
        L: Fn(InstructionSet) -> InLanes + 'a,
        R: FnOnce() -> Reference,
    {
        let Self { gpu, lanes, .. } = self;
        let evaluator: Box<dyn Evaluator + 'a> = match choice.decided(adapter) {
            BackendChoice::Gpu => {
                let name = adapter.map(str::to_owned);
                Box::new(FallbackEvaluator::new(
                    problem,
                    (choice, adapter),
                    move || Ok(Box::new(gpu(GpuContext::shared(name.as_deref())?)?)),
                    move || Box::new(lanes(InstructionSet::best())),
                )?)
            }
            BackendChoice::Cpu => Box::new((self.reference)()),
            _ => Box::new(lanes(InstructionSet::best())),
        };
        Ok(Box::new(Portions::new(evaluator, self.bytes_each)))
    }
}

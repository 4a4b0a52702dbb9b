//! Opens the evaluator of a hybrid problem.

use super::{CpuHybridEvaluator, GpuHybridEvaluator, HybridProblem, SimdHybridEvaluator};
use crate::error::Result;
use crate::evaluate::gpu::GpuContext;
use crate::evaluate::simd::InstructionSet;
use crate::evaluate::{BackendChoice, Evaluator};

/// An evaluator of `hybrid` on the backend chosen; `adapter` is part of the name of the GPU to use (see
/// [`BackendChoice::decided`]).
///
/// # Errors
/// [`crate::Error::NoDevice`] if a GPU was asked for and none fits.
pub fn open_hybrid_evaluator<'a>(
    hybrid: &'a HybridProblem,
    choice: BackendChoice,
    adapter: Option<&str>,
) -> Result<Box<dyn Evaluator + 'a>> {
    Ok(match choice.decided(adapter) {
        BackendChoice::Gpu => Box::new(GpuHybridEvaluator::new(hybrid, GpuContext::shared(adapter)?)?),
        BackendChoice::Cpu => Box::new(CpuHybridEvaluator::new(hybrid)),
        _ => Box::new(SimdHybridEvaluator::new(hybrid, InstructionSet::best())),
    })
}

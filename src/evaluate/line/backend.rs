//! Opens the evaluator of a line problem.

use super::{CpuLineEvaluator, GpuLineEvaluator, LineProblem, SimdLineEvaluator};
use crate::error::Result;
use crate::evaluate::gpu::GpuContext;
use crate::evaluate::simd::InstructionSet;
use crate::evaluate::{BackendChoice, Evaluator};

/// An evaluator of `line` on the backend chosen; `adapter` is part of the name of the GPU to use (see
/// [`BackendChoice::decided`]).
///
/// # Errors
/// [`crate::Error::NoDevice`] if a GPU was asked for and none fits. `Auto` without a named adapter never fails for
/// want of one.
pub fn open_line_evaluator<'a>(
    line: &'a LineProblem,
    choice: BackendChoice,
    adapter: Option<&str>,
) -> Result<Box<dyn Evaluator + 'a>> {
    Ok(match choice.decided(adapter) {
        BackendChoice::Gpu => Box::new(GpuLineEvaluator::new(line, GpuContext::shared(adapter)?)?),
        BackendChoice::Cpu => Box::new(CpuLineEvaluator::new(line)),
        _ => Box::new(SimdLineEvaluator::new(line, InstructionSet::best())),
    })
}

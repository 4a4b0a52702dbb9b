//! Opens the evaluator of any kind of problem.

use super::gpu::GpuContext;
use super::portions::Portions;
use super::simd::InstructionSet;
use super::{BackendChoice, CpuBackend, Evaluator, FallbackEvaluator, GpuBackend, ProblemKind, SimdBackend};
use crate::error::Result;

/// An evaluator of `kind` on the backend chosen; `adapter` is part of the name of the GPU to use (see
/// [`BackendChoice::decided`]). A GPU that fails at work is opened anew, and lanes take over from one that keeps failing
/// (see [`FallbackEvaluator`]); populations are cut to what memory is allowed (see [`Portions`]).
///
/// # Errors
/// [`crate::Error::NoDevice`] if a GPU was asked for and none fits. `Auto` without a named adapter never fails for want of one.
pub fn open_evaluator<'a, K: ProblemKind>(
    kind: &'a K,
    choice: BackendChoice,
    adapter: Option<&str>,
) -> Result<Box<dyn Evaluator + 'a>> {
    let lanes = move || Box::new(SimdBackend::new(kind, InstructionSet::best()));
    let evaluator: Box<dyn Evaluator + 'a> = match choice.decided(adapter) {
        BackendChoice::Gpu => {
            let name = adapter.map(str::to_owned);
            Box::new(FallbackEvaluator::new(
                kind.problem(),
                (choice, adapter),
                move || {
                    let context = GpuContext::shared(name.as_deref())?;
                    Ok(Box::new(GpuBackend::new(kind, context)?))
                },
                move || lanes(),
            )?)
        }
        BackendChoice::Cpu => Box::new(CpuBackend::new(kind)),
        _ => lanes(),
    };
    Ok(Box::new(Portions::new(evaluator, kind.bytes_each())))
}

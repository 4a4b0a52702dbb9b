//! Opens the evaluator of a hybrid problem.

use super::{CpuHybridEvaluator, GpuHybridEvaluator, HybridProblem, SimdHybridEvaluator};
use crate::error::Result;
use crate::evaluate::gpu::GpuContext;
use crate::evaluate::portions::Portions;
use crate::evaluate::simd::InstructionSet;
use crate::evaluate::{BackendChoice, Evaluator, FallbackEvaluator};

/// An evaluator of `hybrid` on the backend chosen; `adapter` is part of the name of the GPU to use (see
/// [`BackendChoice::decided`]). A GPU that fails at work is opened anew, and lanes on the processor take over from one that
/// keeps failing (see [`FallbackEvaluator`]).
///
/// # Errors
/// [`crate::Error::NoDevice`] if a GPU was asked for and none fits.
pub fn open_hybrid_evaluator<'a>(
    hybrid: &'a HybridProblem,
    choice: BackendChoice,
    adapter: Option<&str>,
) -> Result<Box<dyn Evaluator + 'a>> {
    let evaluator: Box<dyn Evaluator + 'a> = match choice.decided(adapter) {
        BackendChoice::Gpu => {
            let name = adapter.map(str::to_owned);
            Box::new(FallbackEvaluator::new(
                &hybrid.problem,
                (choice, adapter),
                move || {
                    Ok(Box::new(GpuHybridEvaluator::new(
                        hybrid,
                        GpuContext::shared(name.as_deref())?,
                    )?))
                },
                || Box::new(SimdHybridEvaluator::new(hybrid, InstructionSet::best())),
            )?)
        }
        BackendChoice::Cpu => Box::new(CpuHybridEvaluator::new(hybrid)),
        _ => Box::new(SimdHybridEvaluator::new(hybrid, InstructionSet::best())),
    };
    Ok(Box::new(Portions::new(evaluator, bytes_each(hybrid))))
}

/// Bytes that a candidate takes at the most while it is evaluated: its figures in both precisions and on a device, three
/// figures of each section there, its place, its lap and its row.
fn bytes_each(hybrid: &HybridProblem) -> u64 {
    let figures = hybrid.figures(&vec![0.0; hybrid.dimensions()]).len() as u64;
    16 * figures + 12 * hybrid.plan().rows.len() as u64 + 512
}

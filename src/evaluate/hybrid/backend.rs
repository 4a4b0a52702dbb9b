//! Opens the evaluator of a hybrid problem.

use super::{CpuHybridEvaluator, GpuHybridEvaluator, HybridProblem, SimdHybridEvaluator};
use crate::error::Result;
use crate::evaluate::{BackendChoice, Backends, Evaluator};

/// An evaluator of `hybrid` on the backend chosen; `adapter` is part of the name of the GPU to use (see
/// [`BackendChoice::decided`]). A GPU that fails at work is opened anew, and lanes on the processor take over from one that
/// keeps failing (see [`crate::evaluate::FallbackEvaluator`]).
///
/// # Errors
/// [`crate::Error::NoDevice`] if a GPU was asked for and none fits. `Auto` without a named adapter never fails for
/// want of one.
pub fn open_hybrid_evaluator<'a>(
    hybrid: &'a HybridProblem,
    choice: BackendChoice,
    adapter: Option<&str>,
) -> Result<Box<dyn Evaluator + 'a>> {
    let backends = Backends {
        gpu: |context| GpuHybridEvaluator::new(hybrid, context),
        lanes: |set| SimdHybridEvaluator::new(hybrid, set),
        reference: || CpuHybridEvaluator::new(hybrid),
        bytes_each: bytes_each(hybrid),
    };
    backends.open(&hybrid.problem, choice, adapter)
}

/// Bytes that a candidate takes at the most while it is evaluated: its figures in both precisions and on a device, three
/// figures of each section there, its place, its lap and its row.
fn bytes_each(hybrid: &HybridProblem) -> u64 {
    let figures = hybrid.figures(&vec![0.0; hybrid.dimensions()]).len() as u64;
    16 * figures + 12 * hybrid.plan().rows.len() as u64 + 512
}

//! Opens the evaluator of a replay.

use super::{CpuEvaluator, GpuEvaluator, ReplayProblem, SimdEvaluator};
use crate::error::Result;
use crate::evaluate::{BackendChoice, Backends, Evaluator};

/// An evaluator of `replay` on the backend chosen; `adapter` is part of the name of the GPU to use (see
/// [`BackendChoice::decided`]). A GPU that fails at work is opened anew, and lanes on the processor take over from one that
/// keeps failing (see [`crate::evaluate::FallbackEvaluator`]).
///
/// # Errors
/// [`crate::Error::NoDevice`] if a GPU was asked for and none fits. `Auto` without a named adapter never fails for
/// want of one.
pub fn open_evaluator<'a>(
    replay: &'a ReplayProblem,
    choice: BackendChoice,
    adapter: Option<&str>,
) -> Result<Box<dyn Evaluator + 'a>> {
    let backends = Backends {
        gpu: |context| GpuEvaluator::new(replay, context),
        lanes: |set| SimdEvaluator::new(replay, set),
        reference: || CpuEvaluator::new(replay),
        bytes_each: bytes_each(replay),
    };
    backends.open(&replay.problem, choice, adapter)
}

/// Bytes that a candidate takes at the most while it is evaluated: the figures of its car, once here and once on a device,
/// its errors in every window here or how far each is there, its place and its row.
fn bytes_each(replay: &ReplayProblem) -> u64 {
    8 * replay.free.base().len() as u64 + 48 * replay.plan.windows.len() as u64 + 320
}

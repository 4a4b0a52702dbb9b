//! Opens the evaluator of steady states.

use super::{CpuSteadyEvaluator, GpuSteadyEvaluator, SimdSteadyEvaluator, SteadyProblem};
use crate::error::Result;
use crate::evaluate::{BackendChoice, Backends, Evaluator};

/// An evaluator of `steady` on the backend chosen; `adapter` is part of the name of the GPU to use (see
/// [`BackendChoice::decided`]). A GPU that fails at work is opened anew, and lanes on the processor take over from one that
/// keeps failing (see [`crate::evaluate::FallbackEvaluator`]).
///
/// # Errors
/// [`crate::Error::NoDevice`] if a GPU was asked for and none fits. `Auto` without a named adapter never fails for
/// want of one.
pub fn open_steady_evaluator<'a>(
    steady: &'a SteadyProblem,
    choice: BackendChoice,
    adapter: Option<&str>,
) -> Result<Box<dyn Evaluator + 'a>> {
    let backends = Backends {
        gpu: |context| GpuSteadyEvaluator::new(steady, context),
        lanes: |set| SimdSteadyEvaluator::new(steady, set),
        reference: || CpuSteadyEvaluator::new(steady),
        bytes_each: bytes_each(steady),
    };
    backends.open(&steady.problem, choice, adapter)
}

/// Bytes that a candidate takes at the most while it is evaluated: the figures of its car, once here and once on a device, its
/// last state there and here, its trim and its row.
fn bytes_each(steady: &SteadyProblem) -> u64 {
    8 * steady.free.base().len() as u64 + 480
}

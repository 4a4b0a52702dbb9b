//! Opens the evaluator of a line problem.

use super::{CpuLineEvaluator, GpuLineEvaluator, LineProblem, SimdLineEvaluator};
use crate::error::Result;
use crate::evaluate::{BackendChoice, Backends, Evaluator};

/// An evaluator of `line` on the backend chosen; `adapter` is part of the name of the GPU to use (see
/// [`BackendChoice::decided`]). A GPU that fails at work is opened anew, and lanes on the processor take over from one that
/// keeps failing (see [`crate::evaluate::FallbackEvaluator`]).
///
/// # Errors
/// [`crate::Error::NoDevice`] if a GPU was asked for and none fits. `Auto` without a named adapter never fails for
/// want of one.
pub fn open_line_evaluator<'a>(
    line: &'a LineProblem,
    choice: BackendChoice,
    adapter: Option<&str>,
) -> Result<Box<dyn Evaluator + 'a>> {
    let backends = Backends {
        gpu: |context| GpuLineEvaluator::new(line, context),
        lanes: |set| SimdLineEvaluator::new(line, set),
        reference: || CpuLineEvaluator::new(line),
        bytes_each: bytes_each(line),
    };
    backends.open(&line.problem, choice, adapter)
}

/// Bytes that a candidate takes at the most while it is evaluated: its variables in single precision, once here and once on
/// a device, three figures of each section there, its place, its measures and its row.
fn bytes_each(line: &LineProblem) -> u64 {
    8 * line.dimensions() as u64 + 12 * line.plan().rows.len() as u64 + 320
}

//! Opens the evaluator of steady states.

use super::{CpuSteadyEvaluator, GpuSteadyEvaluator, SimdSteadyEvaluator, SteadyProblem};
use crate::error::Result;
use crate::evaluate::gpu::GpuContext;
use crate::evaluate::portions::Portions;
use crate::evaluate::simd::InstructionSet;
use crate::evaluate::{BackendChoice, Evaluator, FallbackEvaluator};

/// An evaluator of `steady` on the backend chosen; `adapter` is part of the name of the GPU to use (see
/// [`BackendChoice::decided`]). A GPU that fails at work is opened anew, and lanes on the processor take over from one that
/// keeps failing (see [`FallbackEvaluator`]).
///
/// # Errors
/// [`crate::Error::NoDevice`] if a GPU was asked for and none fits.
pub fn open_steady_evaluator<'a>(
    steady: &'a SteadyProblem,
    choice: BackendChoice,
    adapter: Option<&str>,
) -> Result<Box<dyn Evaluator + 'a>> {
    let evaluator: Box<dyn Evaluator + 'a> = match choice.decided(adapter) {
        BackendChoice::Gpu => {
            let name = adapter.map(str::to_owned);
            Box::new(FallbackEvaluator::new(
                &steady.problem,
                (choice, adapter),
                move || {
                    Ok(Box::new(GpuSteadyEvaluator::new(
                        steady,
                        GpuContext::shared(name.as_deref())?,
                    )?))
                },
                || Box::new(SimdSteadyEvaluator::new(steady, InstructionSet::best())),
            )?)
        }
        BackendChoice::Cpu => Box::new(CpuSteadyEvaluator::new(steady)),
        _ => Box::new(SimdSteadyEvaluator::new(steady, InstructionSet::best())),
    };
    Ok(Box::new(Portions::new(evaluator, bytes_each(steady))))
}

/// Bytes that a candidate takes at the most while it is evaluated: the figures of its car, once here and once on a device, its
/// last state there and here, its trim and its row.
fn bytes_each(steady: &SteadyProblem) -> u64 {
    8 * steady.free.base().len() as u64 + 480
}

//! Opens the evaluator of any kind of problem.

use super::by_size::BySize;
use super::portions::Portions;
use super::simd::InstructionSet;
use super::{BackendChoice, CpuBackend, Evaluator, OnDevice, SimdBackend, gpu};
use crate::error::Result;

/// An evaluator of `kind` on the backend chosen; `adapter` is part of the name of the GPU to use (see
/// [`BackendChoice::decided`]). A GPU that fails at work is opened anew, and lanes take over from one that keeps failing
/// (see `FallbackEvaluator`); populations are cut to what memory is allowed (see [`Portions`]).
///
/// `Auto` without a named adapter evaluates populations of fewer than 512 candidates in lanes, whatever GPU there is: a device takes as
/// long for a few candidates as for thousands.
///
/// # Errors
/// [`crate::Error::NoDevice`] if a GPU was asked for and none fits. `Auto` without a named adapter never fails for want of one.
pub fn open_evaluator<'a, K: OnDevice>(
    kind: &'a K,
    choice: BackendChoice,
    adapter: Option<&str>,
) -> Result<Box<dyn Evaluator + 'a>> {
    let lanes =
        move || -> Box<dyn Evaluator + 'a> { Box::new(SimdBackend::new(kind, InstructionSet::best())) };
    let on_device = move |adapter: Option<&str>| gpu::open(kind, (choice, adapter), lanes);
    let left_open = choice == BackendChoice::Auto && adapter.is_none();
    let evaluator = match choice.decided(adapter) {
        BackendChoice::Gpu => match left_open.then(|| gpu::would_be(None)) {
            Some(Ok(info)) => Box::new(BySize::new(lanes(), info, move || on_device(None))),
            _ => on_device(adapter)?,
        },
        BackendChoice::Cpu => Box::new(CpuBackend::new(kind)),
        _ => lanes(),
    };
    Ok(Box::new(Portions::new(evaluator, kind.bytes_each())))
}

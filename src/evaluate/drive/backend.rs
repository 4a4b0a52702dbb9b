//! Opens the evaluator of a drive.

use super::{CpuDriveEvaluator, DriveProblem, GpuDriveEvaluator, SimdDriveEvaluator};
use crate::error::Result;
use crate::evaluate::{BackendChoice, Backends, Evaluator};

/// An evaluator of `drive` on the backend chosen; `adapter` is part of the name of the GPU to use (see
/// [`BackendChoice::decided`]). A GPU that fails at work is opened anew, and lanes on the processor take over from one that
/// keeps failing (see [`crate::evaluate::FallbackEvaluator`]).
///
/// # Errors
/// [`crate::Error::NoDevice`] if a GPU was asked for and none fits. `Auto` without a named adapter never fails for
/// want of one.
pub fn open_drive_evaluator<'a>(
    drive: &'a DriveProblem,
    choice: BackendChoice,
    adapter: Option<&str>,
) -> Result<Box<dyn Evaluator + 'a>> {
    let backends = Backends {
        gpu: |context| GpuDriveEvaluator::new(drive, context),
        lanes: |set| SimdDriveEvaluator::new(drive, set),
        reference: || CpuDriveEvaluator::new(drive),
        bytes_each: bytes_each(drive),
    };
    backends.open(&drive.problem, choice, adapter)
}

/// Bytes that a candidate takes at the most while it is evaluated: the figures of its car, once here and once on a device, its
/// last state twice there and once here, its lap and its row.
fn bytes_each(drive: &DriveProblem) -> u64 {
    8 * drive.free.base().len() as u64 + 640
}

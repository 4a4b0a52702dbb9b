//! Opens the evaluator of a drive.

use super::{CpuDriveEvaluator, DriveProblem, GpuDriveEvaluator, SimdDriveEvaluator};
use crate::error::Result;
use crate::evaluate::gpu::GpuContext;
use crate::evaluate::simd::InstructionSet;
use crate::evaluate::{BackendChoice, Evaluator, FallbackEvaluator};

/// An evaluator of `drive` on the backend chosen; `adapter` is part of the name of the GPU to use (see
/// [`BackendChoice::decided`]). A GPU that fails at work is opened anew, and lanes on the processor take over from one that
/// keeps failing (see [`FallbackEvaluator`]).
///
/// # Errors
/// [`crate::Error::NoDevice`] if a GPU was asked for and none fits.
pub fn open_drive_evaluator<'a>(
    drive: &'a DriveProblem,
    choice: BackendChoice,
    adapter: Option<&str>,
) -> Result<Box<dyn Evaluator + 'a>> {
    Ok(match choice.decided(adapter) {
        BackendChoice::Gpu => {
            let name = adapter.map(str::to_owned);
            Box::new(FallbackEvaluator::new(
                &drive.problem,
                (choice, adapter),
                move || {
                    Ok(Box::new(GpuDriveEvaluator::new(
                        drive,
                        GpuContext::shared(name.as_deref())?,
                    )?))
                },
                || Box::new(SimdDriveEvaluator::new(drive, InstructionSet::best())),
            )?)
        }
        BackendChoice::Cpu => Box::new(CpuDriveEvaluator::new(drive)),
        _ => Box::new(SimdDriveEvaluator::new(drive, InstructionSet::best())),
    })
}

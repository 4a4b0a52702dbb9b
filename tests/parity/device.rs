//! The device that tests run on, if there is one.

use lapswarm::evaluate::gpu::GpuContext;
use lapswarm::evaluate::simd::InstructionSet;
use lapswarm::parity::Subject;
use std::sync::Arc;

/// The device, if there is one.
pub fn device() -> Option<Arc<GpuContext>> {
    GpuContext::shared(None).ok()
}

/// The device of a test that needs one.
pub fn the_device() -> Arc<GpuContext> {
    GpuContext::shared(None).expect("the harness has looked")
}

/// Every instruction set, and the device if there is one.
pub fn subjects() -> Vec<Subject> {
    let lanes = InstructionSet::available().into_iter().map(Subject::Lanes);
    lanes.chain(device().map(Subject::Device)).collect()
}

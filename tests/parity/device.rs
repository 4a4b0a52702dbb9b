//! The device that tests run on, if there is one.

use lapswarm::evaluate::gpu::GpuContext;
use lapswarm::evaluate::gpu::shader::WheelOrder;
use lapswarm::evaluate::simd::InstructionSet;
use lapswarm::parity::Subject;
use std::sync::{Arc, OnceLock};

/// The device, if there is one.
pub fn device() -> Option<Arc<GpuContext>> {
    GpuContext::shared(None).ok()
}

/// The device of a test that needs one.
pub fn the_device() -> Arc<GpuContext> {
    GpuContext::shared(None).expect("the harness has looked")
}

/// The device, if there is one, and the same device with kernels that go through wheels in the other order: those of graphics
/// processors on software, those of software on graphics processors.
pub fn devices() -> Vec<Arc<GpuContext>> {
    static OTHER: OnceLock<Arc<GpuContext>> = OnceLock::new();
    let Some(context) = device() else {
        return Vec::new();
    };
    let other = OTHER.get_or_init(|| {
        let wheels = match context.wheels() {
            WheelOrder::SideBySide => WheelOrder::ByAxle,
            WheelOrder::ByAxle => WheelOrder::SideBySide,
        };
        GpuContext::with_wheels(None, wheels).expect("a device that opens twice")
    });
    vec![context, Arc::clone(other)]
}

/// Every instruction set, and the device if there is one, with kernels of both orders of wheels.
pub fn subjects() -> Vec<Subject> {
    let lanes = InstructionSet::available().into_iter().map(Subject::Lanes);
    lanes.chain(devices().into_iter().map(Subject::Device)).collect()
}

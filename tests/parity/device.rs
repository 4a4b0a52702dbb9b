//! The device that tests run on, if there is one.

use lapswarm::evaluate::gpu::GpuContext;
use lapswarm::evaluate::simd::InstructionSet;
use lapswarm::parity::Subject;
use std::sync::Arc;

/// The device; `None` with a word on standard error if there is none and none is required.
pub fn device() -> Option<Arc<GpuContext>> {
    match GpuContext::shared(None) {
        Ok(context) => Some(context),
        Err(error) => {
            let required = std::env::var("LAPSWARM_REQUIRE_GPU").is_ok_and(|x| x == "1");
            assert!(!required, "LAPSWARM_REQUIRE_GPU=1, but {error}");
            eprintln!("IGNORED: no GPU adapter ({error})");
            None
        }
    }
}

/// Every instruction set, and the device if there is one.
pub fn subjects() -> Vec<Subject> {
    let lanes = InstructionSet::available().into_iter().map(Subject::Lanes);
    lanes.chain(device().map(Subject::Device)).collect()
}

//! Replaying a logged lap with candidate cars: the identification's evaluator and its backends.

mod backend;
mod cpu;
mod gpu;
mod jacobian;
pub mod kernel;
mod problem;
mod simd;

pub use super::{BackendChoice, ModelTable};
pub use backend::open_evaluator;
pub use cpu::{CpuEvaluator, norm_name, trace};
pub use gpu::{Batching, DeviceSample, DeviceWindow, DispatchStatistics, GpuEvaluator, Stretch};
pub use jacobian::Residuals;
pub use problem::{
    CHANNEL_NAMES, CHANNEL_UNITS, ChannelWeights, Norm, Plan, ReplayProblem, Sample, Window, initial_state,
    step_fractions,
};
pub use simd::SimdEvaluator;

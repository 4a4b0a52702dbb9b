//! Replaying a logged lap with candidate cars: the identification's evaluator and its backends.

mod cpu;
mod gpu;
pub mod kernel;
mod problem;
mod simd;
mod table;

pub use cpu::{CpuEvaluator, norm_name, trace};
pub use gpu::{Batching, DeviceSample, DeviceWindow, DispatchStatistics, GpuEvaluator, Stretch};
pub use problem::{CHANNEL_NAMES, CHANNEL_UNITS, ChannelWeights, Norm, Plan, ReplayProblem, Sample, Window};
pub use simd::SimdEvaluator;
pub use table::ModelTable;

//! Cars on circles: what a steering angle gives at a speed once everything has come to rest, whole populations of it.
//!
//! [`crate::vehicle::steady`] follows the same trims by continuation in `f64`; what is settled here is stable as well, as a
//! car under a held steering wheel is.

mod backend;
mod cpu;
mod gpu;
pub mod kernel;
pub mod modes;
mod problem;
mod simd;

pub use backend::open_steady_evaluator;
pub use cpu::CpuSteadyEvaluator;
pub use gpu::{DevicePlan, GpuSteadyEvaluator};
pub use problem::{AIM_FIGURES, SETTLED, Settled, SteadyObjective, SteadyProblem};
pub use simd::SimdSteadyEvaluator;

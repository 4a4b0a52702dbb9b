//! Driving set-ups round lines with a driver: the 4DOF car in closed loop, whole populations of it.

mod backend;
mod cpu;
mod gpu;
mod problem;
mod simd;

pub use crate::evaluate::gpu::StepBatching as DriveBatching;
pub use backend::open_drive_evaluator;
pub use cpu::CpuDriveEvaluator;
pub use gpu::GpuDriveEvaluator;
pub use problem::{DriveObjective, DriveProblem, DriveSettings, LAP_FIGURES};
pub use simd::SimdDriveEvaluator;

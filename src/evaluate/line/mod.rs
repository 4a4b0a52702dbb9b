//! Scoring racing lines: lengths, curvatures and point-mass lap times of whole swarms of them.

mod backend;
mod batches;
mod cpu;
mod gpu;
mod problem;
mod simd;
mod swarm;
mod tables;

pub use backend::open_line_evaluator;
pub(in crate::evaluate) use batches::{LineBatches, LineKernel};
pub use batches::{LineBatching, LineStretch};
pub use cpu::CpuLineEvaluator;
pub use gpu::GpuLineEvaluator;
pub use problem::{LineObjective, LineProblem};
pub use simd::SimdLineEvaluator;
pub use tables::DeviceSection;
pub(in crate::evaluate) use tables::LineTables;

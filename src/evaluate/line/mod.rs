//! Scoring racing lines: lengths, curvatures and point-mass lap times of whole swarms of them.

mod backend;
mod cpu;
mod gpu;
mod problem;
mod simd;
mod swarm;
mod tables;

pub use backend::open_line_evaluator;
pub use cpu::CpuLineEvaluator;
pub use gpu::{GpuLineEvaluator, LineBatching, LineStretch};
pub use problem::{LineObjective, LineProblem};
pub use simd::SimdLineEvaluator;
pub use tables::DeviceSection;
pub(in crate::evaluate) use tables::LineTables;

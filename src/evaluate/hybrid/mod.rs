//! Scoring laps with energy: lines, strategies or both, whole swarms of them.

mod backend;
mod cpu;
mod gpu;
mod problem;
mod simd;

pub use backend::open_hybrid_evaluator;
pub use cpu::CpuHybridEvaluator;
pub use gpu::{EnergyAccount, GpuHybridEvaluator};
pub use problem::{Free, HybridLine, HybridObjective, HybridProblem, MOST_MOTOR, Strategy};
pub use simd::SimdHybridEvaluator;

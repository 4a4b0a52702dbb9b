//! Scoring racing lines: lengths, curvatures and quasi-steady-state lap times of whole swarms of them.

mod cpu;
#[cfg(feature = "gpu")]
pub(in crate::evaluate) mod gpu;
mod problem;
mod simd;

pub use crate::evaluate::open_evaluator as open_line_evaluator;
#[cfg(feature = "gpu")]
pub use gpu::{DeviceSection, GpuLineEvaluator, LineBatching, LineStretch};
pub use problem::{LineObjective, LineProblem};

use super::{Failure, Problem, ProblemKind, are_numbers};
use problem::Measures;

/// Scores lines in `f64`.
pub type CpuLineEvaluator<'a> = crate::evaluate::CpuBackend<'a, LineProblem>;
/// Scores lines in `f32` lanes.
pub type SimdLineEvaluator<'a> = crate::evaluate::SimdBackend<'a, LineProblem>;

impl ProblemKind for LineProblem {
    type Outcome = Measures;
    type Lanes = simd::LineLanes;
    const WITHOUT_COST: Failure = Failure::Standstill;

    fn problem(&self) -> &Problem {
        &self.problem
    }

    /// The variables in single precision, once here and once on a device, those of each cross-section there, the place,
    /// the measures and the row.
    fn bytes_each(&self) -> u64 {
        8 * self.dimensions() as u64 + 4 * (self.plan().figures_each() * self.plan().rows.len()) as u64 + 320
    }

    fn preliminary_failure(&self, candidate: &[f64]) -> Option<Failure> {
        (!are_numbers(candidate)).then_some(Failure::NotFinite)
    }

    fn reference(&self, candidates: &[&[f64]]) -> Vec<Measures> {
        cpu::measures(self, candidates)
    }

    fn objectives_of(&self, _: &[f64], measures: &Measures) -> std::result::Result<Vec<f64>, Failure> {
        let figure = |objective: &LineObjective| {
            let figure = measures[*objective as usize];
            match objective {
                LineObjective::Gamma => figure.sqrt(),
                _ => figure,
            }
        };
        Ok(self.objectives.iter().map(figure).collect())
    }
}

//! Scoring laps with energy: lines, strategies or both, whole swarms of them.

mod cpu;
#[cfg(feature = "gpu")]
mod gpu;
mod problem;
mod simd;

pub use crate::evaluate::open_evaluator as open_hybrid_evaluator;
#[cfg(feature = "gpu")]
pub use gpu::{EnergyAccount, GpuHybridEvaluator};
pub use problem::{Free, HybridLine, HybridObjective, HybridProblem, MOST_MOTOR, Strategy};

use super::{Failure, Problem, ProblemKind, are_numbers};
use crate::line::energy::EnergyLap;

/// Scores laps with energy in `f64`.
pub type CpuHybridEvaluator<'a> = crate::evaluate::CpuBackend<'a, HybridProblem>;
/// Scores laps with energy in `f32` lanes.
pub type SimdHybridEvaluator<'a> = crate::evaluate::SimdBackend<'a, HybridProblem>;

impl ProblemKind for HybridProblem {
    type Outcome = EnergyLap<f64>;
    type Lanes = simd::EnergyLanes;
    const WITHOUT_COST: Failure = Failure::Standstill;

    fn problem(&self) -> &Problem {
        &self.problem
    }

    /// The figures of the kernels in both precisions and on a device, those of each cross-section there, the place, the
    /// lap and the row.
    fn bytes_each(&self) -> u64 {
        let figures = self.line_variables() + self.strategy_figures();
        16 * figures as u64 + 4 * (self.plan().figures_each() * self.plan().rows.len()) as u64 + 512
    }

    /// A figure of the kernels may be too large where the variable behind it is not: the figure is in joules, say, and the
    /// variable in megajoules.
    fn preliminary_failure(&self, candidate: &[f64]) -> Option<Failure> {
        let numbers =
            are_numbers(candidate) && are_numbers(&self.car().gate_figures(&self.strategy_of(candidate).0));
        (!numbers).then_some(Failure::NotFinite)
    }

    fn reference(&self, candidates: &[&[f64]]) -> Vec<EnergyLap<f64>> {
        cpu::laps(self, candidates)
    }

    fn objectives_of(
        &self,
        candidate: &[f64],
        lap: &EnergyLap<f64>,
    ) -> std::result::Result<Vec<f64>, Failure> {
        let figure = |objective: &HybridObjective| match objective {
            HybridObjective::LapTime => lap.time,
            HybridObjective::Fuel => lap.fuel / self.car().fuel_density_kgpl,
            HybridObjective::EnergyUsed => lap.deployed / 1e6,
            HybridObjective::SocSwing => lap.swing / self.car().hybrid.store.capacity_j,
            HybridObjective::Length => self.line_measures(candidate)[0],
            HybridObjective::Gamma => self.line_measures(candidate)[1],
        };
        Ok(self.objectives.iter().map(figure).collect())
    }
}

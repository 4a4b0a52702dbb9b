//! Steady-state cornering: what a steering angle gives at a speed once everything has come to rest, whole populations of it.
//!
//! [`crate::vehicle::steady`] follows the same trims by continuation in `f64`. A trim that is settled here is stable as well, as
//! a car under a held steering wheel is.

mod cpu;
#[cfg(feature = "gpu")]
mod gpu;
pub mod kernel;
pub mod modes;
mod problem;
mod simd;

pub use crate::evaluate::open_evaluator as open_steady_evaluator;
#[cfg(feature = "gpu")]
pub use gpu::{DevicePlan, GpuSteadyEvaluator};
pub use problem::{AIM_FIGURES, SETTLED, Settled, SteadyObjective, SteadyProblem};

use super::{Failure, Problem, ProblemKind};
use kernel::Settling;
use problem::SPEEDS;

/// Settles cars in `f64`.
pub type CpuSteadyEvaluator<'a> = crate::evaluate::CpuBackend<'a, SteadyProblem>;
/// Settles cars in `f32` lanes.
pub type SimdSteadyEvaluator<'a> = crate::evaluate::SimdBackend<'a, SteadyProblem>;

impl ProblemKind for SteadyProblem {
    type Outcome = Settling<f64>;
    type Lanes = simd::SteadyLanes;
    const WITHOUT_COST: Failure = Failure::Undefined;

    fn problem(&self) -> &Problem {
        &self.problem
    }

    /// The figures of the car, once here and once on a device, the last state there and here, the trim and the row.
    fn bytes_each(&self) -> u64 {
        8 * self.free.base().len() as u64 + 480
    }

    /// Cornering at no speed, or at one that no problem may ask for, is off the envelope.
    fn preliminary_failure(&self, candidate: &[f64]) -> Option<Failure> {
        let [speed, _] = self.aim_figures(candidate);
        let driven = (SPEEDS[0]..=SPEEDS[1]).contains(&speed);
        let failure = self.free.preliminary_failure(candidate);
        failure.or_else(|| (!driven).then_some(Failure::OffTheEnvelope))
    }

    fn reference(&self, candidates: &[&[f64]]) -> Vec<Settling<f64>> {
        cpu::settled(self, candidates)
    }

    fn objectives_of(
        &self,
        candidate: &[f64],
        state: &Settling<f64>,
    ) -> std::result::Result<Vec<f64>, Failure> {
        let trim = self.settled(candidate, state)?;
        Ok(self.objectives.iter().map(|o| o.of(&trim)).collect())
    }
}

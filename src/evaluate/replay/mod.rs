//! Replaying a logged lap with candidate cars: the identification's evaluator and its backends.

mod cpu;
#[cfg(feature = "gpu")]
mod gpu;
mod jacobian;
pub mod kernel;
mod plan;
mod problem;
mod simd;
mod starts;

pub use super::{BackendChoice, ModelTable};
pub use crate::evaluate::open_evaluator;
pub use cpu::{Traced, trace};
#[cfg(feature = "gpu")]
pub use gpu::{Batching, DeviceSample, DeviceWindow, DispatchStatistics, GpuEvaluator, Stretch};
pub use jacobian::Residuals;
pub use plan::{Norm, Plan, Sample, Window, initial_state, step_fractions};
pub use problem::{CHANNEL_LABELS, CHANNEL_NAMES, CHANNEL_UNITS, ChannelWeights, ReplayProblem};

use super::{Failure, Problem, ProblemKind};
use plan::CHANNELS;

/// Scores replays in `f64`.
pub type CpuEvaluator<'a> = super::CpuBackend<'a, ReplayProblem>;
/// Scores replays in `f32` lanes.
pub type SimdEvaluator<'a> = super::SimdBackend<'a, ReplayProblem>;

impl ProblemKind for ReplayProblem {
    /// The errors of all windows, if the car drove to the end.
    type Outcome = Option<[f64; CHANNELS]>;
    type Lanes = simd::ReplayLanes;
    /// A car that is so far off has left the range of what cars do.
    const WITHOUT_COST: Failure = Failure::Spun;

    fn problem(&self) -> &Problem {
        &self.problem
    }

    /// The figures of the car, once here and once on a device, the errors in every window here or how far each is there, the
    /// place and the row.
    fn bytes_each(&self) -> u64 {
        8 * self.free.base().len() as u64 + 48 * self.plan.windows.len() as u64 + 320
    }

    fn preliminary_failure(&self, candidate: &[f64]) -> Option<Failure> {
        self.free.preliminary_failure(candidate)
    }

    fn reference(&self, candidates: &[&[f64]]) -> Vec<Self::Outcome> {
        cpu::errors(self, candidates)
    }

    fn objectives_of(
        &self,
        candidate: &[f64],
        errors: &Self::Outcome,
    ) -> std::result::Result<Vec<f64>, Failure> {
        let errors = errors.ok_or_else(|| self.why_lost(candidate))?;
        let costs = self.channel_costs(&errors);
        let weighted = |o: &ChannelWeights| {
            let each = o.weights.iter().zip(costs).map(|(w, c)| w * c);
            match self.plan.norm {
                Norm::One | Norm::MeanSquare => each.sum(),
                // A sum of roots has a crease along which each of them is zero. Swarms get caught in it.
                Norm::Two => each.fold(0.0, f64::hypot),
                // Not f64::max, which would lose what is not a number.
                Norm::Infinity => each.fold(
                    0.0,
                    |most: f64, c| if most > c || most.is_nan() { most } else { c },
                ),
            }
        };
        Ok(self.objectives.iter().map(weighted).collect())
    }
}

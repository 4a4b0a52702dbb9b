//! Closed-loop laps: set-ups driven round lines by a driver, the 4DOF car in closed loop, whole populations of it.

mod cpu;
#[cfg(feature = "gpu")]
mod gpu;
mod problem;
mod simd;

pub use crate::evaluate::open_evaluator as open_drive_evaluator;
#[cfg(feature = "gpu")]
pub use gpu::{DriveBatching, GpuDriveEvaluator};
pub use problem::{DriveObjective, DriveProblem, DriveSettings, LAP_FIGURES};

use super::{Failure, Problem, ProblemKind};
use crate::drive::kernel::{DrivenLap, ending};

/// Drives laps in `f64`.
pub type CpuDriveEvaluator<'a> = crate::evaluate::CpuBackend<'a, DriveProblem>;
/// Drives laps in `f32` lanes.
pub type SimdDriveEvaluator<'a> = crate::evaluate::SimdBackend<'a, DriveProblem>;

impl ProblemKind for DriveProblem {
    type Outcome = DrivenLap;
    type Lanes = simd::DriveLanes;
    const WITHOUT_COST: Failure = Failure::Undefined;

    fn problem(&self) -> &Problem {
        &self.problem
    }

    /// The figures of the car, once here and once on a device, the last state twice there and once here, the lap and the row.
    fn bytes_each(&self) -> u64 {
        8 * self.free.base().len() as u64 + 640
    }

    fn preliminary_failure(&self, candidate: &[f64]) -> Option<Failure> {
        self.free.preliminary_failure(candidate)
    }

    fn reference(&self, candidates: &[&[f64]]) -> Vec<DrivenLap> {
        cpu::laps(self, candidates)
    }

    fn objectives_of(&self, _: &[f64], lap: &DrivenLap) -> std::result::Result<Vec<f64>, Failure> {
        if lap.ending == ending::LEFT_ROAD {
            return Err(Failure::LeftRoad);
        }
        if lap.ending == ending::TOO_LATE {
            return Err(Failure::Unfinished);
        }
        if lap.ending != ending::FINISHED {
            return Err(Failure::Spun);
        }
        Ok(self.objectives.iter().map(|o| o.of(lap)).collect())
    }
}

//! What is asked of a replay: which parameters are free, and how errors make objectives.

use super::plan::{CHANNELS, Norm, Plan, Sample, Window, step_fractions};
use crate::error::{Error, Result};
use crate::evaluate::{Failure, FreeCar, Objective, Problem};
use crate::vehicle::car::CarParameter;
use crate::vehicle::modes::{fastest_mode, stable_steps};
use crate::vehicle::{Car, TyreModel};

/// Names of the compared channels, in the order of all arrays of four.
pub const CHANNEL_NAMES: [&str; CHANNELS] = ["vx", "ax", "ay", "yaw_rate"];
/// What reports call them.
pub const CHANNEL_LABELS: [&str; CHANNELS] = [
    "speed",
    "longitudinal acceleration",
    "lateral acceleration",
    "yaw rate",
];
/// Their units.
pub const CHANNEL_UNITS: [&str; CHANNELS] = ["m/s", "m/s^2", "m/s^2", "rad/s"];

/// An objective as a norm of weighted channel costs, the same norm that their samples are put together in.
#[derive(Clone, Debug, PartialEq)]
pub struct ChannelWeights {
    /// The objective's name and unit.
    pub objective: Objective,
    /// Weight of each channel's cost.
    pub weights: [f64; CHANNELS],
}

/// The identification problem: find the free parameters with which the car does what was logged.
#[derive(Clone, Debug)]
pub struct ReplayProblem {
    /// Variables and objectives.
    pub problem: Problem,
    /// The car and which of its parameters are free, one per variable.
    pub free: FreeCar,
    /// The log, cut and ready, in double precision.
    pub plan: Plan<f64>,
    /// Sample interval, s.
    pub interval_s: f64,
    /// How channel costs make objectives.
    pub objectives: Vec<ChannelWeights>,
    /// The least speed in the windows, at least 1 m/s: there a car's own motions are the fastest.
    pub slowest_mps: f64,
}

impl ReplayProblem {
    /// Puts a problem together.
    ///
    /// `free` are the parameters with their bounds; `samples` the uniform log at `interval_s`; each interval is
    /// integrated in `substeps` Runge-Kutta steps.
    ///
    /// # Errors
    /// [`Error::Input`] if a bound is not finite or out of order, two parameters set the same thing, or a window
    /// does not lie in the log.
    pub fn new(
        car: Car,
        free: Vec<(CarParameter, f64, f64)>,
        samples: Vec<Sample<f64>>,
        windows: Vec<Window<f64>>,
        (interval_s, substeps): (f64, usize),
        norm: Norm,
        objectives: Vec<ChannelWeights>,
    ) -> Result<Self> {
        let wrong =
            |place: &str, found: String, expected: &str| Error::input("the study", place, found, expected);
        let (free, variables) = FreeCar::new(car, free)?;
        for window in &windows {
            if !(window.start + 2 <= window.end
                && window.end <= samples.len()
                && window.scored_from < window.end - window.start)
            {
                let found = format!(
                    "samples {} to {}, scored from {}",
                    window.start, window.end, window.scored_from
                );
                return Err(wrong(
                    "windows",
                    found,
                    "at least two samples within the log, at least one scored",
                ));
            }
        }
        if windows.is_empty() || objectives.is_empty() || substeps == 0 {
            return Err(wrong(
                "windows, objectives, substeps",
                "none".into(),
                "at least one of each",
            ));
        }
        let within = windows.iter().flat_map(|w| &samples[w.start..w.end]);
        let slowest_mps = within
            .map(|s| s.measured[0])
            .fold(f64::INFINITY, f64::min)
            .max(1.0);
        Ok(Self {
            problem: Problem {
                variables,
                objectives: objectives.iter().map(|o| o.objective.clone()).collect(),
            },
            free,
            plan: Plan {
                samples,
                windows,
                step: interval_s / substeps as f64,
                fractions: step_fractions(substeps),
                norm,
            },
            interval_s,
            objectives,
            slowest_mps,
        })
    }

    /// Number of free parameters.
    pub fn dimensions(&self) -> usize {
        self.free.parameters.len()
    }

    /// The tyre model that the kernels must run.
    pub fn tyre_model(&self) -> TyreModel {
        self.free.tyre_model()
    }

    /// A candidate's car in flat form.
    pub fn flat(&self, candidate: &[f64]) -> Vec<f64> {
        self.free.flat(candidate)
    }

    /// Runge-Kutta steps per sample that a car in flat form needs.
    pub fn steps_needed(&self, flat: &[f64]) -> usize {
        stable_steps(
            self.interval_s,
            fastest_mode(flat, self.tyre_model(), self.slowest_mps),
        )
    }

    /// Why a candidate that did not drive to the end was lost.
    pub(super) fn why_lost(&self, candidate: &[f64]) -> Failure {
        if self.steps_needed(&self.flat(candidate)) > self.plan.fractions.len() {
            Failure::StepTooLong
        } else {
            Failure::Spun
        }
    }

    /// The cost of each channel from the errors of all windows (summed, or their maxima).
    pub fn channel_costs(&self, errors: &[f64; CHANNELS]) -> [f64; CHANNELS] {
        let scored: usize = self
            .plan
            .windows
            .iter()
            .map(|w| w.end - w.start - w.scored_from)
            .sum();
        errors.map(|e| match self.plan.norm {
            Norm::One => e * self.interval_s,
            Norm::Two => (e * self.interval_s).sqrt(),
            Norm::Infinity => e,
            Norm::MeanSquare => e / scored as f64,
        })
    }

    /// Adds one window's errors to those of the windows before.
    pub fn accumulate(&self, total: &mut [f64; CHANNELS], errors: [f64; CHANNELS]) {
        for (t, e) in total.iter_mut().zip(errors) {
            *t = if self.plan.norm == Norm::Infinity {
                t.max(e)
            } else {
                *t + e
            };
        }
    }
}

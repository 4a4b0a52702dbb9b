//! What a replay is: the log, how it is cut into windows, which parameters are free, and what is compared.

use super::kernel::CHANNELS;
use crate::error::{Error, Result};
use crate::evaluate::{Evaluation, FAILED_COST, Failure, FreeCar, Objective, Problem, are_costs};
use crate::vehicle::car::CarParameter;
use crate::vehicle::{Car, TyreModel};
use serde::{Deserialize, Serialize};

/// Names of the compared channels, in the order of all arrays of four.
pub const CHANNEL_NAMES: [&str; CHANNELS] = ["vx", "ax", "ay", "yaw_rate"];
/// Their units.
pub const CHANNEL_UNITS: [&str; CHANNELS] = ["m/s", "m/s^2", "m/s^2", "rad/s"];

/// How the error of a channel becomes a cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Norm {
    /// Integral of the magnitude over time.
    One,
    /// Root of the integral of the square over time.
    Two,
    /// Greatest magnitude.
    Infinity,
    /// Mean of the square.
    MeanSquare,
}

/// One sample of the log: inputs, and measured outputs in the order of [`CHANNEL_NAMES`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample<S> {
    /// Wheel speeds FL FR RL RR, rad/s.
    pub wheel_speed: [S; 4],
    /// Road-wheel angle, rad.
    pub steer: S,
    /// Measured outputs.
    pub measured: [S; CHANNELS],
}

/// A stretch of the log that is driven open loop from a known start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window<S> {
    /// First sample.
    pub start: usize,
    /// One past the last sample; at least two samples long.
    pub end: usize,
    /// Samples from the start that are driven but not scored, while unknown states settle.
    pub scored_from: usize,
    /// State at the first sample, in the order of [`crate::vehicle::CarState::to_array`].
    pub initial: [S; 6],
}

/// The state that a window starts from: speed and yaw rate as measured, nothing else moving. Lateral speed, roll
/// and the lagged acceleration are not logged; they settle in a few tenths of a second.
pub fn initial_state(sample: &Sample<f64>) -> [f64; 6] {
    [sample.measured[0], 0.0, sample.measured[3], 0.0, 0.0, 0.0]
}

/// [`Plan::fractions`] for equal sub-steps.
pub fn step_fractions(substeps: usize) -> Vec<[f64; 3]> {
    let n = substeps as f64;
    (0..substeps)
        .map(|i| i as f64)
        .map(|i| [i / n, (i + 0.5) / n, (i + 1.0) / n])
        .collect()
}

/// Everything shared by all candidates, in the precision of a backend.
#[derive(Clone, Debug)]
pub struct Plan<S> {
    /// The log.
    pub samples: Vec<Sample<S>>,
    /// The windows.
    pub windows: Vec<Window<S>>,
    /// Integration step, s.
    pub step: S,
    /// For each sub-step, where it starts, halves and ends as a share of the sample interval.
    pub fractions: Vec<[S; 3]>,
    /// The norm.
    pub norm: Norm,
}

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

    /// The objectives' row of a candidate that drove to the end, from its windows' errors; the failed row
    /// otherwise, or if a figure is not finite or that of a failure.
    pub fn objective_row(&self, errors: Option<[f64; CHANNELS]>) -> (Vec<f64>, Option<Failure>) {
        let row = errors.map(|e| {
            let costs = self.channel_costs(&e);
            let weighted = |o: &ChannelWeights| {
                let each = o.weights.iter().zip(costs).map(|(w, c)| w * c);
                match self.plan.norm {
                    Norm::One | Norm::MeanSquare => each.sum(),
                    // A sum of roots has a crease along which each of them is nought, which swarms get caught in.
                    Norm::Two => each.fold(0.0, f64::hypot),
                    // Not f64::max, which would lose what is not a number.
                    Norm::Infinity => each.fold(
                        0.0,
                        |most: f64, c| if most > c || most.is_nan() { most } else { c },
                    ),
                }
            };
            self.objectives.iter().map(weighted).collect::<Vec<f64>>()
        });
        // A car that is so far off has left the range of what cars do, whatever it was that it did.
        match row.filter(|row| are_costs(row)) {
            Some(row) => (row, None),
            None => (vec![FAILED_COST; self.objectives.len()], Some(Failure::Spun)),
        }
    }

    /// The objectives of candidates from their errors, see [`ReplayProblem::objective_row`], or from why they have none.
    pub(super) fn evaluation_of(
        &self,
        errors: Vec<std::result::Result<Option<[f64; CHANNELS]>, Failure>>,
    ) -> Evaluation {
        let rows = errors.into_iter().map(|errors| match errors {
            Ok(errors) => self.objective_row(errors),
            Err(failure) => (self.objective_row(None).0, Some(failure)),
        });
        Evaluation::of_rows(rows.collect())
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

impl Plan<f64> {
    /// The plan in single precision, for the f32 backends.
    pub fn to_f32(&self) -> Plan<f32> {
        Plan {
            samples: self
                .samples
                .iter()
                .map(|s| Sample {
                    wheel_speed: s.wheel_speed.map(|x| x as f32),
                    steer: s.steer as f32,
                    measured: s.measured.map(|x| x as f32),
                })
                .collect(),
            windows: self
                .windows
                .iter()
                .map(|w| Window {
                    start: w.start,
                    end: w.end,
                    scored_from: w.scored_from,
                    initial: w.initial.map(|x| x as f32),
                })
                .collect(),
            step: self.step as f32,
            fractions: self.fractions.iter().map(|f| f.map(|x| x as f32)).collect(),
            norm: self.norm,
        }
    }
}

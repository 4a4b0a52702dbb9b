//! What kernels of a replay read: the log, how it is cut into windows, and how errors are put together.

use crate::vehicle::CarInput;
use serde::{Deserialize, Serialize};

/// The compared outputs: forward speed (m/s), longitudinal and lateral acceleration (m/s^2), yaw rate (rad/s).
pub const CHANNELS: usize = 4;

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

crate::config::kinds::named!(Norm {
    One = "1",
    Two = "2",
    Infinity = "infinity",
    MeanSquare = "mse",
});

/// One sample of the log: inputs, and measured outputs in the order of [`super::CHANNEL_NAMES`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample<S> {
    /// Wheel speeds FL FR RL RR, rad/s.
    pub wheel_speed: [S; 4],
    /// Road-wheel angle, rad.
    pub steer: S,
    /// How far the DRS is open, 0 to 1.
    pub flap: S,
    /// Measured outputs.
    pub measured: [S; CHANNELS],
}

impl Sample<f64> {
    /// What moves the car at this sample.
    pub fn input(&self) -> CarInput<f64> {
        CarInput {
            wheel_speed: self.wheel_speed,
            steer: self.steer,
            flap: self.flap,
            friction: None,
        }
    }
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
/// and the lagged acceleration are not logged; they settle at the rate of [`crate::vehicle::modes::slowest_decay`].
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
                    flap: s.flap as f32,
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

//! A synthetic lap that the bundled car drives with grip to spare, and problems on it.
//!
//! Near the limit a lap amplifies roundings: on the bundled one, a millionth of a parameter moves the costs of most cars
//! near the truth by more than a ten-thousandth, in `f64` too. A lap that keeps clear of it tells arithmetic apart.

use super::{Draws, free_about};
use crate::error::{Error, Result};
use crate::evaluate::Objective;
use crate::evaluate::replay::{
    CHANNEL_NAMES, CHANNEL_UNITS, ChannelWeights, Norm, ReplayProblem, Sample, Traced, Window, trace,
};
use crate::vehicle::Car;

/// Sample interval, s.
pub const INTERVAL_S: f64 = 0.01;

/// Greatest sensor noise in the synthetic log, channel by channel (m/s, m/s^2, m/s^2, rad/s): a good logger's.
pub const NOISE: [f64; 4] = [0.05, 0.3, 0.3, 0.01];

/// Inputs of a synthetic lap: speeds of 28 to 62 m/s and corners that ask for `grip` (m/s^2) at most. The wheels
/// roll at the speed of their place on a car that follows its steering, so slip follows from what the car does.
fn inputs(car: &Car, count: usize, grip: f64) -> Vec<Sample<f64>> {
    let c = &car.chassis;
    let wheelbase = c.cg_to_front + c.cg_to_rear;
    (0..count)
        .map(|i| {
            let t = i as f64 * INTERVAL_S;
            let turns = |period: f64| (t * std::f64::consts::TAU / period).sin();
            let speed = 45.0 + 12.0 * turns(23.0) + 5.0 * turns(7.3);
            // Rises from a straight start; the mix of periods never repeats within a lap.
            let ay = grip * (t / 3.0).min(1.0) * (0.65 * turns(11.0) + 0.35 * turns(4.7));
            let yaw_rate = ay / speed;
            let rim = |side: f64, radius: f64| (speed - yaw_rate * side) / radius;
            Sample {
                wheel_speed: [
                    rim(c.half_track_front, c.radius_front),
                    rim(-c.half_track_front, c.radius_front),
                    rim(c.half_track_rear, c.radius_rear),
                    rim(-c.half_track_rear, c.radius_rear),
                ],
                steer: wheelbase * ay / (speed * speed) + 0.0015 * ay,
                // Half open, shut, half open, open and so on: each state and each way between them.
                flap: [0.5, 0.0, 0.5, 1.0][i % 4],
                measured: [0.0; 4],
            }
        })
        .collect()
}

/// How the lap is cut.
#[derive(Clone, Copy, Debug)]
pub struct Lap {
    /// Samples of the lap.
    pub samples: usize,
    /// Number of windows, each with its own start.
    pub windows: usize,
    /// Runge-Kutta steps per sample.
    pub substeps: usize,
    /// Norm of the costs.
    pub norm: Norm,
    /// The greatest lateral acceleration that the lap asks for, m/s^2.
    pub grip: f64,
}

impl Default for Lap {
    fn default() -> Self {
        Self {
            samples: 6_000,
            windows: 1,
            substeps: 1,
            norm: Norm::Two,
            grip: 9.0,
        }
    }
}

/// The problem of finding `free` (all between 0.2 and 1.8 times their value in `car`) from a lap that `car` drove.
///
/// # Errors
/// [`Error::Input`] naming a parameter that the car lacks, [`Error::Study`] for a car that cannot drive the lap.
pub fn problem(car: Car, free: &[&str], lap: Lap) -> Result<ReplayProblem> {
    let flat = car.to_flat();
    let free = free_about(&car, free, 0.8)?;
    let mut samples = inputs(&car, lap.samples, lap.grip);
    let initial = [
        samples[0].wheel_speed[0] * car.chassis.radius_front,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
    ];
    let whole = Window {
        start: 0,
        end: lap.samples,
        scored_from: 0,
        initial,
    };
    let objectives: Vec<_> = (0..4)
        .map(|k| ChannelWeights {
            objective: Objective {
                name: CHANNEL_NAMES[k].to_owned(),
                unit: CHANNEL_UNITS[k].to_owned(),
            },
            weights: std::array::from_fn(|j| f64::from(u8::from(j == k))),
        })
        .collect();
    let build = |samples: Vec<Sample<f64>>, windows| {
        ReplayProblem::new(
            car.clone(),
            free.clone(),
            samples,
            windows,
            (INTERVAL_S, lap.substeps),
            lap.norm,
            objectives.clone(),
        )
    };
    let reference = build(samples.clone(), vec![whole])?;
    let Traced { outputs, drives, .. } = trace(&flat, car.tyre_model(), &reference.plan, &whole);
    if !drives {
        return Err(Error::Study(format!(
            "{} does not drive the made-up lap to its end",
            car.name
        )));
    }
    let mut random = Draws::new(1);
    for (sample, output) in samples.iter_mut().zip(&outputs) {
        sample.measured = std::array::from_fn(|k| output[k] + random.within(-NOISE[k], NOISE[k]));
    }
    // Windows start from the logged speed and yaw rate; their first tenth settles what is not logged.
    let length = lap.samples / lap.windows;
    let windows = (0..lap.windows)
        .map(|w| {
            let start = w * length;
            let end = if w + 1 == lap.windows {
                lap.samples
            } else {
                start + length
            };
            Window {
                start,
                end,
                scored_from: if w == 0 { 0 } else { length / 10 },
                initial: [
                    outputs[start][0],
                    0.0,
                    outputs[start][3],
                    0.0,
                    0.0,
                    outputs[start][1],
                ],
            }
        })
        .collect();
    build(samples, windows)
}

/// `count` candidates about the problem's own car, each variable off by at most `share` of itself.
pub fn candidates(problem: &ReplayProblem, count: usize, share: f64, draws: &mut Draws) -> Vec<f64> {
    let centre: Vec<f64> = problem
        .problem
        .variables
        .iter()
        .map(|v| (v.lower + v.upper) / 2.0)
        .collect();
    (0..count)
        .flat_map(|_| {
            centre
                .iter()
                .map(|x| x + x.abs().max(1e-3) * draws.within(-share, share))
                .collect::<Vec<_>>()
        })
        .collect()
}

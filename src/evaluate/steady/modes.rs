//! How long and in which steps a car is driven until it has settled, from the modes of its own equations.

pub use super::kernel::SettlePlan;
use super::kernel::{INTEGRATED, settle_rate};
use crate::evaluate::{FreeCar, Variable};
use crate::random::Random;
use crate::scalar::Dual;
use crate::vehicle::tyre::Tyre;
use crate::vehicle::{CarModel, LinearTyre, MagicFormula, TyreModel};
use nalgebra::SMatrix;

/// Derivatives of the rates of change to the figures that change.
pub type Slopes = SMatrix<f64, INTEGRATED, INTEGRATED>;
type Exact = Dual;

/// The slopes of a car in flat form at a path speed (m/s), under a steering angle (rad), where its figures are these.
pub fn slopes(
    (model, flat): (TyreModel, &[f64]),
    gain: f64,
    (speed, steer): (f64, f64),
    figures: [f64; INTEGRATED],
) -> Slopes {
    match model {
        TyreModel::MagicFormula => slopes_on::<MagicFormula<Exact>>(flat, gain, (speed, steer), figures),
        TyreModel::Linear => slopes_on::<LinearTyre<Exact>>(flat, gain, (speed, steer), figures),
    }
}

fn slopes_on<T: Tyre<Exact>>(
    flat: &[f64],
    gain: f64,
    (speed, steer): (f64, f64),
    figures: [f64; INTEGRATED],
) -> Slopes {
    let flat: Vec<Exact> = flat.iter().copied().map(Exact::constant).collect();
    let car = CarModel::<Exact, T>::from_parameters(&flat);
    let variables = std::array::from_fn(|i| Exact::variable(figures[i], i));
    let [gain, speed, steer] = [gain, speed, steer].map(Exact::constant);
    let rate = settle_rate(&car, gain, speed, steer, variables);
    Slopes::from_fn(|row, column| rate.slopes[row].gradient[column])
}

/// By how much each figure is at most from where nothing changes, if the rates of change are at most `off` there; nothing where
/// the slopes say nothing.
pub fn displaced(slopes: &Slopes, off: &[f64; INTEGRATED]) -> Option<[f64; INTEGRATED]> {
    let inverse = slopes.try_inverse()?;
    let part = |k: usize| (0..INTEGRATED).map(|j| inverse[(k, j)].abs() * off[j]).sum();
    Some(std::array::from_fn(part))
}

/// Length of a step over the time constant of the stiffest mode. Runge and Kutta's method is stable up to 2.78 on the real axis;
/// what is left is for tyres that are stiffer in a bend than straight on, by the load that has moved to them. Where a car
/// settles does not depend on the step: at rest every stage is zero.
const STEP_SHARE: f64 = 1.4;
/// How fast slip follows the push where the tyres are stiffest (1/s): as fast as the body's own modes, no faster.
const SLIP_RATE: f64 = 10.0;
/// Share of the slowest mode straight on that is left near the limit: of the two axles one's side force does not rise any more
/// with slip, the other's by a fifth, half of which damps each of the two modes that they share.
const NEAR_THE_LIMIT: f64 = 0.1;
/// The residual that is left of one that was as great as the car's weight: below what single precision leaves.
const LEFT_OVER: f64 = 1e-5;
/// Slowest mode that is waited for, 1/s: a car that does not keep straight on has none.
const LEAST_DECAY: f64 = 2.0;
/// Most steps.
const MOST_STEPS: f64 = 4096.0;
/// Cars from all over the bounds whose modes are looked at.
const PROBES: u32 = 16;
const PROBE: u32 = 0x57ea;

/// Fastest and slowest mode (1/s).
fn modes(slopes: &Slopes) -> Option<[f64; 2]> {
    if slopes.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let values = slopes.complex_eigenvalues();
    let fastest = values.iter().map(|l| l.norm()).fold(0.0, f64::max);
    let slowest = values.iter().map(|l| -l.re).fold(f64::INFINITY, f64::min);
    Some([fastest, slowest])
}

impl SettlePlan<f64> {
    /// The plan for cars from all over the bounds of `variables`, the last two of which are speed and steering.
    pub fn new(free: &FreeCar, variables: &[Variable]) -> Self {
        let speed = &variables[free.parameters.len()];
        let random = Random::new(0);
        let cars: Vec<Vec<f64>> = (0..=PROBES)
            .map(|probe| {
                let share = |i: u32| {
                    if probe == 0 {
                        0.5
                    } else {
                        random.uniform(PROBE, probe, 0, i)
                    }
                };
                let candidate: Vec<f64> = variables
                    .iter()
                    .zip(0..)
                    .map(|(v, i)| v.lower + share(i) * (v.upper - v.lower))
                    .collect();
                free.flat(&candidate)
            })
            .collect();
        let model = free.tyre_model();
        let straight = |gain: f64| -> Vec<Slopes> {
            cars.iter()
                .flat_map(|flat| {
                    [speed.lower, speed.upper]
                        .map(|v| slopes((model, flat), gain, (v, 0.0), [0.0; INTEGRATED]))
                })
                .collect()
        };
        // The push rises by this much with slip, m/s^2.
        let rise = straight(1.0)
            .iter()
            .map(|s| -s[(INTEGRATED - 1, INTEGRATED - 1)])
            .filter(|x| x.is_finite())
            .fold(1.0, f64::max);
        let gain = SLIP_RATE / rise;
        let (mut fastest, mut slowest) = (SLIP_RATE, f64::INFINITY);
        for [fast, slow] in straight(gain).iter().filter_map(modes) {
            fastest = fastest.max(fast);
            slowest = slowest.min(slow);
        }
        let step = STEP_SHARE / fastest;
        let decay = NEAR_THE_LIMIT * slowest.clamp(LEAST_DECAY, fastest);
        let hold = (1.0 / LEFT_OVER).ln() / decay;
        // A quarter as long again for the steering, so that it moves no faster than a car follows.
        let ramp = (0.25 * hold / step).ceil().min(0.2 * MOST_STEPS);
        let steps = (ramp + hold / step).ceil().min(MOST_STEPS);
        Self {
            step,
            steer_per_step: 1.0 / ramp,
            gain,
            steps: steps as u32,
        }
    }
}

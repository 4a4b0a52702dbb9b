//! Layer three: a made-up lap, driven by cars about the one that logged it.

use super::cases::{Cases, Compared, layer_of};
use super::synthetic_lap::{Lap, candidates, problem};
use super::{Draws, Layer};
use crate::error::Result;
use crate::evaluate::replay::{CHANNEL_NAMES, ReplayProblem};
use crate::scalar::{Counted, operations_of};
use crate::study::identify::IdentifySettings;
use crate::vehicle::model::runge_kutta_step;
use crate::vehicle::{Car, CarInput, CarModel, CarState, MagicFormula};

/// Cars that drive the lap.
const COUNT: usize = 24;
/// Greatest share by which an unknown is off.
const SHARE: f64 = 0.3;
/// Cars next to each, whose costs in `f64` say how well the car's own is determined: where a millionth of the unknowns moves a
/// cost by more than is allowed, the car stands at the edge of a spin.
const NEIGHBOURS: usize = 4;
/// What single precision may add to a cost, as a share of it. A forward speed of 50 m/s in `f32` is off by up to
/// 2e-6 m/s, which is a slip of 4e-8 at all wheels alike; slip stiffness is some 25 times the load, so that accelerations
/// are off by 1e-5 m/s^2 however the rest is computed, and by a few times that with the rounding of what makes a slip.
/// Errors do not grow along the lap: wheels at given speeds and angles hold the car.
const TOLERANCE: f64 = 1e-4;
/// The same, absolute, for cars whose cost is small (m/s, m/s^2, m/s^2, rad/s): the error in the mean.
const FLOOR: [f64; 4] = [4e-6, 2e-5, 2e-5, 1e-6];

/// Steps that a car takes over the log, and arithmetic operations of all of them.
pub fn work_of(replay: &ReplayProblem) -> (usize, u64) {
    let base = replay.free.base();
    let samples: usize = replay.plan.windows.iter().map(|w| w.end - w.start - 1).sum();
    let steps = samples * replay.plan.fractions.len();
    let base: Vec<Counted> = base.iter().map(|x| Counted(*x as f32)).collect();
    let car = CarModel::<Counted, MagicFormula<Counted>>::from_parameters(&base);
    let window = &replay.plan.windows[0];
    let sample = &replay.plan.samples[window.start];
    let input = CarInput {
        wheel_speed: sample.wheel_speed.map(|x| Counted(x as f32)),
        steer: Counted(sample.steer as f32),
        flap: Counted(sample.flap as f32),
        friction: None,
    };
    let state = CarState::from_array(window.initial.map(|x| Counted(x as f32)));
    // All steps are alike.
    let per_step = operations_of(|| {
        runge_kutta_step(&car, &state, |_| input, Counted(0.01), |_| {});
    });
    (steps, per_step * steps as u64)
}

/// What a channel's cost may be off that is `exact` in `f64`.
pub fn allowed(channel: usize, exact: f64) -> f64 {
    TOLERANCE * exact + FLOOR[channel]
}

impl Compared for ReplayProblem {
    const NOUN: &'static str = "car";

    fn limits(&self, _: &[f64], _: &Self::Outcome, exact: &[f64]) -> Option<Vec<[f64; 2]>> {
        let each = exact.iter().enumerate();
        Some(each.map(|(k, x)| [x.abs(), allowed(k, *x)]).collect())
    }
}

/// The layer.
///
/// # Errors
/// Those of reading the bundled lap.
pub(super) fn layer() -> Result<Layer> {
    let unknowns = IdentifySettings::default().free;
    let names: Vec<&str> = unknowns.iter().map(|f| f.name.as_str()).collect();
    let mut car = Car::bundled()?;
    (car.chassis.drs_drag, car.chassis.drs_lift) = (20.0, 15.0);
    let replay = problem(car, &names, Lap::default())?;
    let mut draws = Draws::new(3);
    let cars = candidates(&replay, COUNT, SHARE, &mut draws);
    let cars = cars
        .chunks_exact(replay.dimensions())
        .map(<[f64]>::to_vec)
        .collect();
    let names = CHANNEL_NAMES.map(|channel| format!("replay, {channel}")).to_vec();
    let cases = Cases::among_neighbours(names, replay, cars, NEIGHBOURS, &mut draws);
    Ok(layer_of(vec![cases]))
}

//! The replay kernel: drive a candidate car by the logged inputs and score what it does against what was logged.
//! Twin of `shaders/replay.wgsl`.

use super::problem::{Norm, Plan, Sample, Window};
use crate::scalar::Real;
use crate::vehicle::model::runge_kutta_step;
use crate::vehicle::tyre::Tyre;
use crate::vehicle::{CarInput, CarModel, CarState};

/// The compared outputs: forward speed (m/s), longitudinal and lateral acceleration (m/s^2), yaw rate (rad/s).
pub const CHANNELS: usize = 4;

/// Samples that are summed up before they join the running total, which keeps `f32` sums of long laps from
/// losing their tails: the error grows with the number of terms in each level, not with their product.
pub const BLOCK: usize = 64;

/// The inputs a share `fraction` of the way from one sample to the next, linear between samples.
#[inline(always)]
fn input_between<R: Real>(from: &Sample<R::Storage>, to: &Sample<R::Storage>, fraction: R) -> CarInput<R> {
    let mix = |a: R::Storage, b: R::Storage| R::load(a) + fraction * (R::load(b) - R::load(a));
    CarInput {
        wheel_speed: std::array::from_fn(|i| mix(from.wheel_speed[i], to.wheel_speed[i])),
        steer: mix(from.steer, to.steer),
    }
}

/// Drives `car` through `window`, showing `visit` the four compared outputs at every sample of it.
///
/// Returns where the car drove to the end, and its last state; a car that is lost stays as it was last.
#[inline(always)]
pub fn drive_window<R: Real, T: Tyre<R>>(
    car: &CarModel<R, T>,
    plan: &Plan<R::Storage>,
    window: &Window<R::Storage>,
    mut visit: impl FnMut(usize, [R; CHANNELS]),
) -> (R::Mask, CarState<R>) {
    let mut state = CarState::from_array(window.initial.map(R::load));
    let mut drives = R::splat_mask(true);
    let step = R::load(plan.step);
    let samples = &plan.samples[window.start..window.end];
    for (i, pair) in samples.windows(2).enumerate() {
        for (substep, fractions) in plan.fractions.iter().enumerate() {
            let next = runge_kutta_step(
                car,
                &state,
                |input| input_between(&pair[0], &pair[1], R::load(fractions[input])),
                step,
                |rate| {
                    if substep == 0 {
                        visit(i, [state.body.vx, rate.ax, rate.ay, state.body.yaw_rate]);
                    }
                },
            );
            drives = drives & next.drives();
            let (kept, moved) = (state.to_array(), next.to_array());
            state = CarState::from_array(std::array::from_fn(|k| R::select(drives, moved[k], kept[k])));
        }
    }
    let last = &samples[samples.len() - 1];
    let rate = car.rate(&state, &input_between(last, last, R::lit(0.0)));
    visit(
        samples.len() - 1,
        [state.body.vx, rate.ax, rate.ay, state.body.yaw_rate],
    );
    (drives, state)
}

/// Sums (or maxima, for the infinity norm) of the errors over a window's scored samples, per channel.
#[derive(Clone, Copy, Debug)]
pub struct WindowScore<R: Real> {
    /// One figure per channel.
    pub errors: [R; CHANNELS],
    /// Where the car drove to the end.
    pub drives: R::Mask,
}

/// Scores `car` over one window.
#[inline(always)]
pub fn score_window<R: Real, T: Tyre<R>>(
    car: &CarModel<R, T>,
    plan: &Plan<R::Storage>,
    window: &Window<R::Storage>,
) -> WindowScore<R> {
    let zero = [R::lit(0.0); CHANNELS];
    let mut total = zero;
    let mut block = zero;
    let last = window.end - window.start - 1;
    let (drives, _) = drive_window(car, plan, window, |i, outputs| {
        if i >= window.scored_from {
            let measured = &plan.samples[window.start + i].measured;
            for k in 0..CHANNELS {
                let error = (outputs[k] - R::load(measured[k])).abs();
                block[k] = match plan.norm {
                    Norm::One => block[k] + error,
                    Norm::Two | Norm::MeanSquare => block[k] + error * error,
                    Norm::Infinity => block[k].max(error),
                };
            }
        }
        if (i + 1) % BLOCK == 0 || i == last {
            for k in 0..CHANNELS {
                total[k] = match plan.norm {
                    Norm::Infinity => total[k].max(block[k]),
                    _ => total[k] + block[k],
                };
            }
            block = zero;
        }
    });
    WindowScore {
        errors: total,
        drives,
    }
}

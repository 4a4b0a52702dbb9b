//! The replay kernel: drive a candidate car by the logged inputs and score what it does against what was logged.
//! Twin of `shaders/replay.wgsl`.

#![deny(clippy::disallowed_methods)]

pub use super::plan::CHANNELS;
use super::plan::{Norm, Plan, Sample, Window};
use crate::scalar::Real;
use crate::vehicle::model::runge_kutta_step;
use crate::vehicle::tyre::Tyre;
use crate::vehicle::{CarInput, CarModel, CarState};

/// Samples that are summed up before they join the running total, which keeps `f32` sums of long laps from
/// losing their tails: the error grows with the number of terms in each level, not with their product.
pub const BLOCK: usize = 64;

/// A share `fraction` of the way from `a` to `b`.
#[inline(always)]
fn mix<R: Real>(fraction: R, a: R::Storage, b: R::Storage) -> R {
    R::load(a) + fraction * (R::load(b) - R::load(a))
}

/// The inputs a share `fraction` of the way from one sample to the next, linear between samples.
#[inline(always)]
fn input_between<R: Real>(from: &Sample<R::Storage>, to: &Sample<R::Storage>, fraction: R) -> CarInput<R> {
    let mut wheel_speed = [R::lit(0.0); 4];
    for (i, speed) in wheel_speed.iter_mut().enumerate() {
        *speed = mix(fraction, from.wheel_speed[i], to.wheel_speed[i]);
    }
    CarInput {
        wheel_speed,
        steer: mix(fraction, from.steer, to.steer),
        flap: mix(fraction, from.flap, to.flap),
        friction: None,
    }
}

/// Receives the compared outputs at every sample. This is a trait because lanes are only fast if everything is inlined into the
/// code for their instruction set. A closure that is called from two places is not inlined.
pub trait Visit<R> {
    /// The car and its outputs at a sample of the window.
    fn visit(&mut self, sample: usize, state: &CarState<R>, outputs: [R; CHANNELS]);
}

impl<R, F: FnMut(usize, [R; CHANNELS])> Visit<R> for F {
    #[inline(always)]
    fn visit(&mut self, sample: usize, _: &CarState<R>, outputs: [R; CHANNELS]) {
        self(sample, outputs);
    }
}

/// Drives `car` through `window`, showing `visitor` the four compared outputs at every sample of it.
///
/// Returns the lanes in which the car drove to the end, and its last state. A car that is lost keeps its last valid state.
#[inline(always)]
pub fn drive_window<R: Real, T: Tyre<R>>(
    car: &CarModel<R, T>,
    plan: &Plan<R::Storage>,
    window: &Window<R::Storage>,
    mut visitor: impl Visit<R>,
) -> (R::Mask, CarState<R>) {
    let mut figures = [R::lit(0.0); 6];
    for (figure, initial) in figures.iter_mut().zip(window.initial) {
        *figure = R::load(initial);
    }
    let mut state = CarState::from_array(figures);
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
                        let outputs = [state.body.vx, rate.ax, rate.ay, state.body.yaw_rate];
                        visitor.visit(i, &state, outputs);
                    }
                },
            );
            drives = drives & next.drives();
            let (kept, moved) = (state.to_array(), next.to_array());
            let mut figures = kept;
            for k in 0..figures.len() {
                figures[k] = R::select(drives, moved[k], kept[k]);
            }
            state = CarState::from_array(figures);
        }
    }
    let last = &samples[samples.len() - 1];
    let rate = car.rate(&state, &input_between(last, last, R::lit(0.0)));
    visitor.visit(
        samples.len() - 1,
        &state,
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

/// Errors so far: those of the block in hand, and the total of the blocks before.
struct Scoring<'a, R: Real> {
    plan: &'a Plan<R::Storage>,
    window: &'a Window<R::Storage>,
    total: [R; CHANNELS],
    block: [R; CHANNELS],
}

impl<R: Real> Visit<R> for &mut Scoring<'_, R> {
    #[inline(always)]
    fn visit(&mut self, sample: usize, _: &CarState<R>, outputs: [R; CHANNELS]) {
        let (norm, window) = (self.plan.norm, self.window);
        if sample >= window.scored_from {
            let measured = &self.plan.samples[window.start + sample].measured;
            for k in 0..CHANNELS {
                let error = (outputs[k] - R::load(measured[k])).abs();
                self.block[k] = match norm {
                    Norm::One => self.block[k] + error,
                    Norm::Two | Norm::MeanSquare => self.block[k] + error * error,
                    Norm::Infinity => self.block[k].max(error),
                };
            }
        }
        if (sample + 1).is_multiple_of(BLOCK) || sample + 1 == window.end - window.start {
            for k in 0..CHANNELS {
                self.total[k] = match norm {
                    Norm::Infinity => self.total[k].max(self.block[k]),
                    _ => self.total[k] + self.block[k],
                };
            }
            self.block = [R::lit(0.0); CHANNELS];
        }
    }
}

/// Scores `car` over one window.
#[inline(always)]
pub fn score_window<R: Real, T: Tyre<R>>(
    car: &CarModel<R, T>,
    plan: &Plan<R::Storage>,
    window: &Window<R::Storage>,
) -> WindowScore<R> {
    let zero = [R::lit(0.0); CHANNELS];
    let mut scoring = Scoring {
        plan,
        window,
        total: zero,
        block: zero,
    };
    let (drives, _) = drive_window(car, plan, window, &mut scoring);
    WindowScore {
        errors: scoring.total,
        drives,
    }
}

//! A car that settles on a circle: its own equations of motion at a held path speed, the driven wheels' slip following what
//! the circle asks for. Twin of `shaders/steady.wgsl`.
//!
//! Where nothing changes any more, the car is in a trim as [`crate::vehicle::steady`] defines it: sideways, yaw, roll and
//! pitch accelerations are zero, and the tyres do not push along the path.

#![deny(clippy::disallowed_methods)]

use crate::scalar::Real;
use crate::vehicle::aero::aero_forces;
use crate::vehicle::chassis::BodyState;
use crate::vehicle::model::{STAGES, wheel_speeds};
use crate::vehicle::tyre::Tyre;
use crate::vehicle::{CarInput, CarModel, CarState};

/// Whether a car may still settle: whole numbers, which every backend counts alike.
pub mod ending {
    /// It may.
    pub const SETTLING: f64 = 0.0;
    /// It stood across the road, rolled over or left the range of numbers.
    pub const SPUN: f64 = 1.0;
    /// Its driven wheels spun or locked: no slip holds it on the circle at that speed.
    pub const OFF_THE_ENVELOPE: f64 = 2.0;
}

/// Sine of the sideslip at which a car counts as standing across the road: half a radian, as on the curve of trims.
const GREATEST_SIDESLIP_SINE: f64 = 0.479_425_538_604_203;
/// Slip ratio of the driven wheels at which they count as spun or locked.
const GREATEST_SLIP: f64 = 0.4;
/// Share of the squared path speed that is left for the forward speed of a car whatever it does, so that its root exists.
const LEAST_FORWARD_SHARE: f64 = 0.01;

/// The circle that is asked for.
#[derive(Clone, Copy, Debug)]
pub struct Aim<R> {
    /// Speed along the path (m/s).
    pub speed: R,
    /// Angle of the front road wheels, positive to the left (rad).
    pub steer: R,
}

/// Figures of [`Settling::to_array`].
pub const STATE: usize = 8;
/// Those of them that are integrated.
pub const INTEGRATED: usize = 6;

/// How candidates are brought to settle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SettlePlan<S> {
    /// Length of a step, s.
    pub step: S,
    /// Share of the steering angle that each of the first steps adds, until all of it is there.
    pub steer_per_step: S,
    /// How fast the driven wheels' slip follows the tyres' push, s/m.
    pub gain: S,
    /// Number of steps.
    pub steps: u32,
}

impl SettlePlan<f64> {
    /// The plan in the precision that the scalar `R` stores tables in.
    pub fn stored<R: Real>(&self) -> SettlePlan<R::Storage> {
        SettlePlan {
            step: R::store(self.step),
            steer_per_step: R::store(self.steer_per_step),
            gain: R::store(self.gain),
            steps: self.steps,
        }
    }
}

/// A car on its way into a trim.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settling<R> {
    /// Speed to the left (m/s), yaw rate (rad/s), roll (rad), roll rate (rad/s), lagged longitudinal acceleration (m/s^2) and
    /// slip ratio of the rear wheels.
    pub figures: [R; INTEGRATED],
    /// How far from a balance the car was before the last step, see [`SettleRate::residual`] (m/s^2).
    pub residual: R,
    /// Whether it may still settle, see [`ending`].
    pub ending: R,
}

impl<R: Real> Settling<R> {
    /// A car that runs straight ahead, nothing moving but itself.
    #[inline(always)]
    pub fn begin() -> Self {
        let zero = R::lit(0.0);
        Self {
            figures: [zero; INTEGRATED],
            residual: zero,
            ending: R::lit(ending::SETTLING),
        }
    }

    /// The components in the order of the fields.
    #[inline(always)]
    pub fn to_array(self) -> [R; STATE] {
        let [vy, yaw_rate, roll, roll_rate, pitch, slip] = self.figures;
        [
            vy,
            yaw_rate,
            roll,
            roll_rate,
            pitch,
            slip,
            self.residual,
            self.ending,
        ]
    }

    /// From the components in the order of [`Settling::to_array`].
    #[inline(always)]
    pub fn from_array([vy, yaw_rate, roll, roll_rate, pitch, slip, residual, ending]: [R; STATE]) -> Self {
        Self {
            figures: [vy, yaw_rate, roll, roll_rate, pitch, slip],
            residual,
            ending,
        }
    }
}

impl<S: Copy + Into<f64>> Settling<S> {
    /// In double precision.
    #[allow(clippy::disallowed_methods, reason = "no part of a kernel")]
    pub fn widened(self) -> Settling<f64> {
        Settling {
            figures: self.figures.map(Into::into),
            residual: self.residual.into(),
            ending: self.ending.into(),
        }
    }
}

/// The car of these figures at a path speed (m/s).
#[inline(always)]
pub fn car_state<R: Real>(speed: R, figures: [R; INTEGRATED]) -> CarState<R> {
    let [vy, yaw_rate, roll, roll_rate, pitch_acceleration, _] = figures;
    let squared = speed * speed;
    let vx = (squared - vy * vy)
        .max(R::lit(LEAST_FORWARD_SHARE) * squared)
        .sqrt();
    CarState {
        body: BodyState {
            vx,
            vy,
            yaw_rate,
            roll,
            roll_rate,
        },
        pitch_acceleration,
    }
}

/// Rates of change, and how far from a balance that is.
#[derive(Clone, Copy, Debug)]
pub struct SettleRate<R> {
    /// Time derivatives of [`Settling::figures`].
    pub slopes: [R; INTEGRATED],
    /// The greatest of the accelerations that a trim has none of, as accelerations of the centre of gravity (m/s^2): sideways,
    /// yaw times the wheelbase, roll times its height, what the roll damper carries over mass and height, the lag of pitch and
    /// the tyres' push along the path.
    pub residual: R,
}

/// The rates of change under `steer` (rad) at the front wheels; `gain` is how fast slip follows the push (s/m).
#[inline(always)]
pub fn settle_rate<R: Real, T: Tyre<R>>(
    car: &CarModel<R, T>,
    gain: R,
    speed: R,
    steer: R,
    figures: [R; INTEGRATED],
) -> SettleRate<R> {
    let c = &car.chassis;
    let state = car_state(speed, figures);
    let body = &state.body;
    let slips = [R::lit(0.0), figures[5]];
    let input = CarInput {
        wheel_speed: wheel_speeds(c, body, (steer.cos(), steer.sin()), slips),
        // The model takes the angle that a sensor reads.
        steer: (steer - c.steer_offset) / c.steer_scale,
        flap: R::lit(0.0),
        friction: None,
    };
    let rate = car.rate(&state, &input).state;
    let lag = rate.pitch_acceleration * c.pitch_lag;
    let drag = aero_forces(c, body.vx, R::lit(0.0)).drag / c.mass;
    // Along the path, over the cosine of the sideslip, where the push across it is what the circle takes.
    let push = state.pitch_acceleration + lag + drag + body.vy * body.yaw_rate;
    let damped = c.roll_damping * body.roll_rate / (c.mass * c.cg_height);
    let residual = rate
        .body
        .vy
        .abs()
        .max((rate.body.yaw_rate * (c.cg_to_front + c.cg_to_rear)).abs())
        .max((rate.body.roll_rate * c.cg_height).abs())
        .max(damped.abs())
        .max(lag.abs())
        .max(push.abs());
    SettleRate {
        slopes: [
            rate.body.vy,
            rate.body.yaw_rate,
            rate.body.roll,
            rate.body.roll_rate,
            rate.pitch_acceleration,
            -(gain * push),
        ],
        residual,
    }
}

/// The `number`-th step. A car that is lost stays as it was last.
#[inline(always)]
pub fn settle_step<R: Real, T: Tyre<R>>(
    car: &CarModel<R, T>,
    plan: &SettlePlan<R::Storage>,
    aim: &Aim<R>,
    number: u32,
    before: &Settling<R>,
) -> Settling<R> {
    let step = R::load(plan.step);
    let gain = R::load(plan.gain);
    let turned = (R::lit(f64::from(number)) * R::load(plan.steer_per_step)).min(R::lit(1.0));
    let steer = aim.steer * turned;
    let origin = before.figures;
    let mut reached = origin;
    let mut sum = origin;
    let mut residual = before.residual;
    for (place, stage) in STAGES.iter().enumerate() {
        let rate = settle_rate(car, gain, aim.speed, steer, reached);
        if place == 0 {
            residual = rate.residual;
        }
        let share = step * R::lit(stage.weight);
        let reach = step * R::lit(stage.reach);
        for k in 0..INTEGRATED {
            sum[k] = sum[k] + share * rate.slopes[k];
            reached[k] = origin[k] + reach * rate.slopes[k];
        }
    }
    let across = !sum[0].abs().less_than(R::lit(GREATEST_SIDESLIP_SINE) * aim.speed);
    let spun = across | !car_state(aim.speed, sum).drives();
    let off = !sum[5].abs().less_than(R::lit(GREATEST_SLIP));
    let verdict = R::select(off, R::lit(ending::OFF_THE_ENVELOPE), R::lit(ending::SETTLING));
    let verdict = R::select(spun, R::lit(ending::SPUN), verdict);
    let settling = before.ending.less_than(R::lit(0.5));
    let moves = settling & verdict.less_than(R::lit(0.5));
    let mut figures = origin;
    for k in 0..INTEGRATED {
        figures[k] = R::select(moves, sum[k], origin[k]);
    }
    Settling {
        figures,
        residual: R::select(moves, residual, before.residual),
        ending: R::select(settling, verdict, before.ending),
    }
}

/// All steps of `plan`.
#[inline(always)]
pub fn settle<R: Real, T: Tyre<R>>(
    car: &CarModel<R, T>,
    plan: &SettlePlan<R::Storage>,
    aim: &Aim<R>,
) -> Settling<R> {
    let mut state = Settling::begin();
    for number in 0..plan.steps {
        state = settle_step(car, plan, aim, number, &state);
    }
    state
}

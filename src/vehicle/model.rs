//! The whole car: wheels, tyres, aero, loads and body put together, and one Runge-Kutta step of it
//! (the book, chapter Model, section 2). Twin of `shaders/car.wgsl`.

#![deny(clippy::disallowed_methods)]

use super::aero::aero_forces;
use super::chassis::{BodyForces, BodyState, Chassis, body_derivative};
use super::loads::wheel_loads;
use super::tyre::{Tyre, TyreForces, TyreInput};
use crate::scalar::{Part, Real};

/// What drives the car: the logged inputs.
#[derive(Clone, Copy, Debug)]
pub struct CarInput<R> {
    /// Angular speeds of the wheels FL FR RL RR, rad/s.
    pub wheel_speed: [R; 4],
    /// Angle of the front road wheels, positive to the left, rad.
    pub steer: R,
    /// How far the DRS is open, from 0 to 1.
    pub flap: R,
    /// Friction of the road as a share of that of the car's own tyres; none where it is theirs.
    pub friction: Option<R>,
}

/// The state of the car.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CarState<R> {
    /// The body's state.
    pub body: BodyState<R>,
    /// The lagged longitudinal acceleration, from which load transfer is computed, m/s^2. It follows the true one with the pitch
    /// lag. The lag stands for the pitching body and avoids an algebraic loop between loads and acceleration.
    pub pitch_acceleration: R,
}

/// The rate of change of the state, and the reading of an accelerometer on the roll axis.
#[derive(Clone, Copy, Debug)]
pub struct CarRate<R> {
    /// Time derivative of the state.
    pub state: CarState<R>,
    /// Longitudinal acceleration `dVx/dt - Vy r`, m/s^2.
    pub ax: R,
    /// Lateral acceleration `dVy/dt + Vx r`, m/s^2.
    pub ay: R,
    /// Forward force of the rear wheels on the road, N.
    pub rear_force: R,
}

/// A car with its tyres prepared for their camber.
#[derive(Clone, Copy, Debug)]
pub struct CarModel<R, T> {
    /// Body, wheels and air.
    pub chassis: Chassis<R>,
    /// Tyres of the front and the rear axle.
    pub tyres: [T; 2],
}

/// The side of each wheel of an axle, left positive.
const SIDES: [f64; 2] = [1.0, -1.0];

/// Slip of one wheel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelSlip<R> {
    /// Slip ratio, positive when driven.
    pub ratio: R,
    /// Tangent of the slip angle, positive when the wheel drifts to its left.
    pub tangent: R,
}

/// Slip of a wheel at `(x, y)` (m) from the point under the centre of gravity, turned by the angle whose cosine and sine are
/// given, with rim speed `rim_speed` (m/s). `floor` (m/s) is the least speed with which slip is computed.
#[inline(always)]
pub fn wheel_slip<R: Real>(
    body: &BodyState<R>,
    (x, y): (R, R),
    (cos, sin): (R, R),
    rim_speed: R,
    floor: R,
) -> WheelSlip<R> {
    let hub_x = body.vx - body.yaw_rate * y;
    let hub_y = body.vy + body.yaw_rate * x;
    let vx = cos * hub_x + sin * hub_y;
    let vy = cos * hub_y - sin * hub_x;
    let speed = vx.abs().max(floor);
    WheelSlip {
        ratio: (rim_speed - vx) / speed,
        tangent: vy / speed,
    }
}

/// The speed (rad/s) that gives a wheel of this radius (m) at `(x, y)` (m) from the point under the centre of gravity, turned
/// by the angle whose cosine and sine are given, the slip ratio `slip`.
#[inline(always)]
fn wheel_speed<R: Real>(
    chassis: &Chassis<R>,
    body: &BodyState<R>,
    (x, y): (R, R),
    (cos, sin): (R, R),
    slip: R,
    radius: R,
) -> R {
    let hub = cos * (body.vx - body.yaw_rate * y) + sin * (body.vy + body.yaw_rate * x);
    (hub + slip * hub.abs().max(chassis.slip_speed_floor)) / radius
}

/// The speeds of the wheels FL FR RL RR (rad/s) that give the front and the rear axle these slip ratios, the front wheels
/// turned by the angle whose cosine and sine are given.
#[inline(always)]
pub fn wheel_speeds<R: Real>(
    chassis: &Chassis<R>,
    body: &BodyState<R>,
    turned: (R, R),
    [front, rear]: [R; 2],
) -> [R; 4] {
    let c = chassis;
    let straight = (R::lit(1.0), R::lit(0.0));
    let (a, b) = (c.cg_to_front, -c.cg_to_rear);
    let (wf, wr) = (c.half_track_front, c.half_track_rear);
    [
        wheel_speed(c, body, (a, wf), turned, front, c.radius_front),
        wheel_speed(c, body, (a, -wf), turned, front, c.radius_front),
        wheel_speed(c, body, (b, wr), straight, rear, c.radius_rear),
        wheel_speed(c, body, (b, -wr), straight, rear, c.radius_rear),
    ]
}

/// A tyre's forces turned into body axes: forward and leftward force (N).
#[inline(always)]
pub fn to_body_axes<R: Real>(forces: &TyreForces<R>, (cos, sin): (R, R)) -> (R, R) {
    (forces.x * cos - forces.y * sin, forces.x * sin + forces.y * cos)
}

impl<R: Real, T: Tyre<R>> CarModel<R, T> {
    /// Makes a car ready from its flat form ([`super::Car::to_flat`]).
    ///
    /// Negative camber leans the tops inwards: the left wheels then lean to the right, which is a positive
    /// inclination about the forward axis.
    ///
    /// # Panics
    /// If it is shorter than that.
    pub fn from_parameters(flat: &[R]) -> Self {
        let chassis = Chassis::from_flat(flat);
        let (front, rear) = (Chassis::<R>::PARAMETERS.len(), T::MODEL.parameters().len());
        let degree = R::lit(std::f64::consts::PI / 180.0);
        Self {
            tyres: [
                T::from_parameters(&flat[front..], -(chassis.camber_front * degree)),
                T::from_parameters(&flat[front + rear..], -(chassis.camber_rear * degree)),
            ],
            chassis,
        }
    }

    /// From the table that [`CarModel::to_table`] gives.
    ///
    /// # Panics
    /// If it is shorter than that.
    pub fn from_table(table: &[R]) -> Self {
        let front = Chassis::<R>::PARAMETERS.len();
        let rear = front + T::FIELDS.len();
        Self {
            chassis: Chassis::from_flat(table),
            tyres: [T::from_flat(&table[front..]), T::from_flat(&table[rear..])],
        }
    }

    /// All figures in a row, chassis, front tyre, rear tyre: the form in which kernels read a ready car.
    pub fn to_table(&self) -> Vec<R> {
        [
            self.chassis.to_flat(),
            self.tyres[0].to_flat(),
            self.tyres[1].to_flat(),
        ]
        .concat()
    }

    /// The rate of change of `state` under `input`.
    #[inline(always)]
    pub fn rate(&self, state: &CarState<R>, input: &CarInput<R>) -> CarRate<R> {
        R::apart(Rate {
            car: self,
            state,
            input,
        })
    }
}

/// What [`CarModel::rate`] works on: the longest part of the kernels that drive, which share one copy of it.
struct Rate<'a, R, T> {
    car: &'a CarModel<R, T>,
    state: &'a CarState<R>,
    input: &'a CarInput<R>,
}

impl<R: Real, T: Tyre<R>> Part for Rate<'_, R, T> {
    type Output = CarRate<R>;

    #[inline(always)]
    fn run(self) -> CarRate<R> {
        let Self { car, state, input } = self;
        let chassis = &car.chassis;
        let body = &state.body;
        let aero = aero_forces(chassis, body.vx, input.flap);
        let loads = wheel_loads(chassis, body, state.pitch_acceleration, &aero);

        let steer = input.steer * chassis.steer_scale + chassis.steer_offset;
        let directions = [(steer.cos(), steer.sin()), (R::lit(1.0), R::lit(0.0))];
        let axle_x = [chassis.cg_to_front, -chassis.cg_to_rear];
        let half_track = [chassis.half_track_front, chassis.half_track_rear];
        let radius = [chassis.radius_front, chassis.radius_rear];

        let zero = R::lit(0.0);
        let mut total = BodyForces {
            x: -aero.drag,
            y: zero,
            yaw_moment: zero,
        };
        // One copy of the tyre's code serves both axles by an index, so that the code fits the processor's instruction cache and
        // the coefficients stay in memory. The loops over the wheels are not closures, because large closures would not be
        // compiled for the instruction set of their surroundings.
        let mut rear_force = zero;
        for axle in 0..2 {
            let direction = directions[axle];
            let x = axle_x[axle];
            let mut inputs = [TyreInput::zero(); 2];
            for half in 0..2 {
                let side = R::lit(SIDES[half]);
                let place = (x, half_track[axle] * side);
                let rim_speed = input.wheel_speed[2 * axle + half] * radius[axle];
                let slip = wheel_slip(body, place, direction, rim_speed, chassis.slip_speed_floor);
                inputs[half] = TyreInput {
                    load: loads[2 * axle + half],
                    slip_ratio: slip.ratio,
                    slip_tangent: slip.tangent,
                    side,
                };
            }
            let forces = car.tyres[axle].axle_forces_on(inputs, input.friction);
            // The rear axle comes last, and its wheels do not steer.
            rear_force = forces[0].x + forces[1].x;
            for half in 0..2 {
                let y = half_track[axle] * R::lit(SIDES[half]);
                let (force_x, force_y) = to_body_axes(&forces[half], direction);
                total.x = total.x + force_x;
                total.y = total.y + force_y;
                total.yaw_moment =
                    total.yaw_moment + (x * force_y - y * force_x + forces[half].aligning_moment);
            }
        }

        let rate = body_derivative(chassis, body, &total);
        CarRate {
            ax: rate.vx - body.vy * body.yaw_rate,
            ay: rate.vy + body.vx * body.yaw_rate,
            rear_force,
            state: CarState {
                body: rate,
                pitch_acceleration: (total.x / chassis.mass - state.pitch_acceleration) / chassis.pitch_lag,
            },
        }
    }
}

/// One stage of the classical Runge-Kutta method.
#[derive(Clone, Copy, Debug)]
pub struct Stage {
    /// Number of the input that it reads: 0 at the start of the step, 1 half-way, 2 at the end.
    pub input: usize,
    /// Weight of its rate in the step.
    pub weight: f64,
    /// Share of the step by which its rate moves the state for the next stage.
    pub reach: f64,
}

/// The four stages of the classical Runge-Kutta method. The kernels loop over them instead of writing the rate
/// out four times: the code then fits the processor's instruction cache, which doubles the speed of the lanes.
pub const STAGES: [Stage; 4] = [
    Stage {
        input: 0,
        weight: 1.0 / 6.0,
        reach: 0.5,
    },
    Stage {
        input: 1,
        weight: 1.0 / 3.0,
        reach: 0.5,
    },
    Stage {
        input: 1,
        weight: 1.0 / 3.0,
        reach: 1.0,
    },
    Stage {
        input: 2,
        weight: 1.0 / 6.0,
        reach: 0.0,
    },
];

/// One Runge-Kutta step of `step` seconds from `state`; `input` yields a step's three inputs by number (see [`Stage::input`]),
/// and `watch` receives the rate of the first stage.
#[inline(always)]
pub fn runge_kutta_step<R: Real, T: Tyre<R>>(
    car: &CarModel<R, T>,
    state: &CarState<R>,
    input: impl Fn(usize) -> CarInput<R>,
    step: R,
    watch: impl FnMut(&CarRate<R>),
) -> CarState<R> {
    runge_kutta_step_on(car, state, input, None, step, watch)
}

/// As [`runge_kutta_step`], on a road where gravity pulls at the body: against the car's forward direction and its left (m/s^2).
#[inline(always)]
pub fn runge_kutta_step_on<R: Real, T: Tyre<R>>(
    car: &CarModel<R, T>,
    state: &CarState<R>,
    input: impl Fn(usize) -> CarInput<R>,
    pull: Option<[R; 2]>,
    step: R,
    mut watch: impl FnMut(&CarRate<R>),
) -> CarState<R> {
    let origin = state.to_array();
    let mut reached = origin;
    let mut sum = origin;
    for (number, stage) in STAGES.iter().enumerate() {
        let rate = car.rate(&CarState::from_array(reached), &input(stage.input));
        if number == 0 {
            watch(&rate);
        }
        let mut slope = rate.state.to_array();
        if let Some([climb, lean]) = pull {
            // A field that is the same all over the car moves it as a whole.
            slope[0] = slope[0] - climb;
            slope[1] = slope[1] - lean;
        }
        let share = step * R::lit(stage.weight);
        let reach = step * R::lit(stage.reach);
        for k in 0..origin.len() {
            sum[k] = sum[k] + share * slope[k];
            reached[k] = origin[k] + reach * slope[k];
        }
    }
    CarState::from_array(sum)
}

impl<R: Real> CarState<R> {
    /// A car rolling straight ahead at `vx` (m/s), nothing else moving.
    pub fn straight(vx: R) -> Self {
        let zero = R::lit(0.0);
        Self {
            body: BodyState {
                vx,
                vy: zero,
                yaw_rate: zero,
                roll: zero,
                roll_rate: zero,
            },
            pitch_acceleration: zero,
        }
    }

    /// The components in the order vx, vy, yaw rate, roll, roll rate, lagged longitudinal acceleration.
    #[inline(always)]
    pub fn to_array(self) -> [R; 6] {
        let b = self.body;
        [
            b.vx,
            b.vy,
            b.yaw_rate,
            b.roll,
            b.roll_rate,
            self.pitch_acceleration,
        ]
    }

    /// From the components in the order of [`CarState::to_array`].
    #[inline(always)]
    pub fn from_array([vx, vy, yaw_rate, roll, roll_rate, pitch_acceleration]: [R; 6]) -> Self {
        Self {
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

    /// The lanes in which the car still drives. A car is lost if it slides sideways by more than half a right angle (plus 3 m/s),
    /// spins, rolls over, or has figures that are not finite. The comparisons are written so that NaN counts as lost.
    #[inline(always)]
    pub fn drives(&self) -> R::Mask {
        let b = &self.body;
        b.vy.abs().less_than(b.vx + R::lit(SLIDE_MARGIN))
            & b.vx.less_than(R::lit(GREATEST_SPEED))
            & b.yaw_rate.abs().less_than(R::lit(GREATEST_YAW_RATE))
            & b.roll.abs().less_than(R::lit(GREATEST_ROLL))
            & b.roll_rate.abs().less_than(R::lit(GREATEST_ROLL_RATE))
            & self
                .pitch_acceleration
                .abs()
                .less_than(R::lit(GREATEST_ACCELERATION))
    }
}

/// Allowed sideways speed in excess of the forward speed, m/s.
pub const SLIDE_MARGIN: f64 = 3.0;
/// Forward speed at which a candidate counts as lost, m/s.
pub const GREATEST_SPEED: f64 = 200.0;
/// Yaw rate at which a candidate counts as spun, rad/s.
pub const GREATEST_YAW_RATE: f64 = 6.0;
/// Roll angle at which a candidate counts as rolled over, rad.
pub const GREATEST_ROLL: f64 = 0.7;
/// Roll rate at which a candidate counts as lost, rad/s.
pub const GREATEST_ROLL_RATE: f64 = 50.0;
/// Longitudinal acceleration at which a candidate counts as lost, m/s^2.
pub const GREATEST_ACCELERATION: f64 = 500.0;

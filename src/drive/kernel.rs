//! One step of the closed loop, and a lap of them: look, judge, act, move. Twin of `shaders/drive.wgsl`.

#![deny(clippy::disallowed_methods)]

use super::cornering::CorneringMap;
use super::driver::{Act, Controls, DriverTable, Pace, WheelTorque, act, car_input, planned_speed};
use super::path::{Pose, View, look};
use super::relief::{Footing, footing};
use super::road::{Course, Road};
use crate::scalar::Lookup;
use crate::vehicle::model::runge_kutta_step_on;
use crate::vehicle::tyre::Tyre;
use crate::vehicle::{CarInput, CarModel, CarState};

/// How a lap ended, as whole numbers that every backend represents exactly.
pub mod ending {
    /// The lap is under way.
    pub const UNDER_WAY: f64 = 0.0;
    /// The car crossed the finish line.
    pub const FINISHED: f64 = 1.0;
    /// The car spun, rolled over or turned its back to the path.
    pub const SPUN: f64 = 2.0;
    /// The car left the road.
    pub const LEFT_ROAD: f64 = 3.0;
    /// The lap took too long.
    pub const TOO_LATE: f64 = 4.0;
}

/// Angle to the path beyond which the car counts as turned back, rad.
const TURNED_ROUND: f64 = std::f64::consts::FRAC_PI_2;
/// Start value of the greatest distance beyond an edge, m: below any distance that occurs.
const FAR_INSIDE: f64 = -1e6;

/// What all laps of a population share.
#[derive(Clone, Copy, Debug)]
pub struct World<'a, S> {
    /// The lines and their plans.
    pub road: &'a Road<S>,
    /// The driver.
    pub driver: &'a DriverTable<S>,
    /// What the powertrain gives.
    pub torque: &'a WheelTorque<S>,
    /// What the driver takes the car's steady cornering for.
    pub cornering: &'a CorneringMap<S>,
}

/// A lap under way.
#[derive(Clone, Copy, Debug)]
pub struct DriveState<R> {
    /// The car.
    pub car: CarState<R>,
    /// Arms and feet.
    pub controls: Controls<R>,
    /// Where the car is.
    pub pose: Pose<R>,
    /// Steps since the start line.
    pub steps: R,
    /// Lap time less the time of its whole steps (s). Both lines are crossed within a step.
    pub rest: R,
    /// Greatest distance beyond an edge so far (m), negative within the road.
    pub beyond: R,
    /// Sum of all changes of the road-wheel angle in the rows that the car has passed (rad).
    pub turned: R,
    /// The same in the present row (rad). Two short sums lose less precision in `f32` than a long one.
    pub turned_here: R,
    /// How it ended, see [`ending`].
    pub ending: R,
}

/// Figures of [`DriveState::to_array`].
pub const STATE: usize = 23;

/// What the driver saw and did in a step, before the car moved.
#[derive(Clone, Copy, Debug)]
pub struct Moment<'a, R> {
    /// The car.
    pub car: &'a CarState<R>,
    /// Where it is.
    pub view: &'a View<R>,
    /// What the wheels and the steering are told.
    pub input: &'a CarInput<R>,
    /// The road under it, if that is not level and dry.
    pub footing: Option<&'a Footing<R>>,
}

impl<R: Lookup> DriveState<R> {
    /// A car at the beginning of the run-up, at the planned speed.
    #[inline(always)]
    pub fn begin(world: &World<'_, R::Storage>, course: &Course<R>, pace: &Pace<R>) -> Self {
        let zero = R::lit(0.0);
        let pose = Pose {
            row: course.begin_row,
            lap: R::lit(-1.0),
            along: course.begin_along,
            x: course.begin_x,
            y: course.begin_y,
            yaw: course.begin_yaw,
        };
        let view = look(&world.road.path, course, &pose);
        Self {
            car: CarState::straight(planned_speed(world.road, course, pace, &view, zero)),
            controls: Controls {
                steer: zero,
                front_slip: zero,
                rear_slip: zero,
                rear_force: zero,
                gain: zero,
            },
            pose,
            steps: zero,
            rest: zero,
            beyond: R::lit(FAR_INSIDE),
            turned: zero,
            turned_here: zero,
            ending: R::lit(ending::UNDER_WAY),
        }
    }

    /// The components in the order of the fields.
    #[inline(always)]
    pub fn to_array(self) -> [R; STATE] {
        let [vx, vy, yaw_rate, roll, roll_rate, pitch] = self.car.to_array();
        let (c, p) = (self.controls, self.pose);
        [
            vx,
            vy,
            yaw_rate,
            roll,
            roll_rate,
            pitch,
            c.steer,
            c.front_slip,
            c.rear_slip,
            c.rear_force,
            c.gain,
            p.row,
            p.lap,
            p.along,
            p.x,
            p.y,
            p.yaw,
            self.steps,
            self.rest,
            self.beyond,
            self.turned,
            self.turned_here,
            self.ending,
        ]
    }

    /// From the components in the order of [`DriveState::to_array`].
    #[inline(always)]
    pub fn from_array(figures: [R; STATE]) -> Self {
        let f = figures;
        Self {
            car: CarState::from_array([f[0], f[1], f[2], f[3], f[4], f[5]]),
            controls: Controls {
                steer: f[6],
                front_slip: f[7],
                rear_slip: f[8],
                rear_force: f[9],
                gain: f[10],
            },
            pose: Pose {
                row: f[11],
                lap: f[12],
                along: f[13],
                x: f[14],
                y: f[15],
                yaw: f[16],
            },
            steps: f[17],
            rest: f[18],
            beyond: f[19],
            turned: f[20],
            turned_here: f[21],
            ending: f[22],
        }
    }

    /// The lanes in which the lap is under way.
    #[inline(always)]
    pub fn under_way(&self) -> R::Mask {
        self.ending.less_than(R::lit(0.5))
    }
}

/// One step of every lap that is under way, the `number`-th since the run-up began. Laps that have ended stay as they are.
/// `watch` receives what the driver saw and did.
#[inline(always)]
pub fn drive_step<R: Lookup, T: Tyre<R>>(
    car: &CarModel<R, T>,
    world: &World<'_, R::Storage>,
    (course, pace): (&Course<R>, &Pace<R>),
    number: R,
    before: &DriveState<R>,
    watch: impl FnOnce(&Moment<'_, R>),
) -> DriveState<R> {
    let zero = R::lit(0.0);
    let one = R::lit(1.0);
    let half = R::lit(0.5);
    let (road, driver) = (world.road, world.driver);
    let under_way = before.under_way();

    let view = look(&road.path, course, &before.pose);
    let pose = view.pose;
    let turned_round = !view.heading_error.abs().less_than(R::lit(TURNED_ROUND));
    let off = R::load(driver.run_off).less_than(view.beyond);
    let late = course.most_steps.less_than(number);
    let verdict = R::select(off, R::lit(ending::LEFT_ROAD), R::lit(ending::UNDER_WAY));
    let verdict = R::select(late, R::lit(ending::TOO_LATE), verdict);
    let verdict = R::select(turned_round, R::lit(ending::SPUN), verdict);
    let lost = turned_round | off | late;

    // Time since the line was crossed. It is added at the start line and subtracted at the finish line.
    let since = (pose.row * course.spacing + pose.along) / before.car.body.vx;
    let has_started = before.pose.lap.less_than(-half) & !pose.lap.less_than(-half);
    let finished = !pose.lap.less_than(half);
    let rest = before.rest + R::select(has_started, since, zero);
    let rest = rest - R::select(finished, since, zero);
    let timed = !pose.lap.less_than(-half) & !finished;

    let footing = if road.relief.is_empty() {
        None
    } else {
        Some(footing(&road.relief, course, &view, before.car.body.vx))
    };
    let loaded;
    let car = match &footing {
        None => car,
        Some(footing) => {
            loaded = footing.under(car);
            &loaded
        }
    };
    let mut controls = act(Act {
        driver,
        torque: world.torque,
        cornering: world.cornering,
        road,
        course,
        pace,
        chassis: &car.chassis,
        state: &before.car,
        view: &view,
        footing: footing.as_ref(),
        controls: &before.controls,
    });
    let friction = footing.map(|footing| footing.friction);
    let input = car_input(&car.chassis, &before.car, &controls, view.row.flap, friction);
    watch(&Moment {
        car: &before.car,
        view: &view,
        input: &input,
        footing: footing.as_ref(),
    });

    let step = R::load(driver.step);
    let pull = footing.map(|footing| [footing.climb, footing.lean]);
    let next = runge_kutta_step_on(
        car,
        &before.car,
        |_| input,
        pull,
        step,
        |rate| {
            controls.rear_force = rate.rear_force;
            controls.gain = rate.state.body.vx - pull.map_or(zero, |[climb, _]| climb);
        },
    );
    let verdict = R::select(!lost & finished, R::lit(ending::FINISHED), verdict);
    let spun = !lost & !finished & !next.drives();
    let verdict = R::select(spun, R::lit(ending::SPUN), verdict);

    let (body, then) = (&before.car.body, &next.body);
    let middle_yaw = pose.yaw + R::lit(0.25) * step * (body.yaw_rate + then.yaw_rate);
    let (cos, sin) = (middle_yaw.cos(), middle_yaw.sin());
    let (ahead, left) = (half * (body.vx + then.vx), half * (body.vy + then.vy));
    let steered = (controls.steer - before.controls.steer).abs();
    let here = before.turned_here + R::select(timed, steered, zero);
    let passed = half.less_than(view.passed);
    let after = DriveState {
        car: next,
        controls,
        pose: Pose {
            x: pose.x + (cos * ahead - sin * left) * step,
            y: pose.y + (sin * ahead + cos * left) * step,
            yaw: pose.yaw + half * step * (body.yaw_rate + then.yaw_rate),
            ..pose
        },
        steps: before.steps + R::select(timed, one, zero),
        rest,
        beyond: R::select(timed, before.beyond.max(view.beyond), before.beyond),
        turned: before.turned + R::select(passed, here, zero),
        turned_here: R::select(passed, zero, here),
        ending: verdict,
    };
    // A lost car keeps its last state. A car that has finished keeps its time.
    let stays = !under_way | lost | spun | finished;
    let (kept, moved) = (before.to_array(), after.to_array());
    let mut figures = kept;
    for i in 0..STATE {
        figures[i] = R::select(stays, kept[i], moved[i]);
    }
    let mut state = DriveState::from_array(figures);
    state.ending = R::select(under_way, verdict, before.ending);
    state.rest = R::select(under_way, rest, before.rest);
    state
}

/// What is asked of a lap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrivenLap {
    /// Its time (s).
    pub time_s: f64,
    /// Greatest distance of the car beyond an edge (m). It is negative if the car stayed on the road: the least room, with a
    /// minus sign.
    pub beyond_m: f64,
    /// Mean rate at which the road wheels were turned (rad/s).
    pub steering_radps: f64,
    /// How it ended, see [`ending`]. The other figures are those of a whole lap only if it finished.
    pub ending: f64,
}

impl DrivenLap {
    /// The outcome of a lap from its last state; `step_s` (s) is the step of the integration.
    pub fn of_state(state: &DriveState<f64>, step_s: f64) -> Self {
        let time_s = state.steps * step_s + state.rest;
        Self {
            time_s,
            beyond_m: state.beyond,
            steering_radps: (state.turned + state.turned_here) / time_s,
            ending: state.ending,
        }
    }
}

/// Drives `car` on from `state`, before the step of this `number`, up to the `most`-th step or until its lap has ended in every
/// lane.
#[inline(always)]
pub fn drive_on<R: Lookup, T: Tyre<R>>(
    car: &CarModel<R, T>,
    world: &World<'_, R::Storage>,
    (course, pace): (&Course<R>, &Pace<R>),
    state: &mut DriveState<R>,
    number: &mut u32,
    most: u32,
) {
    while *number < most && !R::all(!state.under_way()) {
        let count = R::lit(f64::from(*number));
        *state = drive_step(car, world, (course, pace), count, state, |_| {});
        *number += 1;
    }
}

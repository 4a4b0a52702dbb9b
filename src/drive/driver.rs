//! The driver: steering by preview and feedback, drive and brake by limited wheel slip. Twin of `shaders/driver.wgsl`.

#![deny(clippy::disallowed_methods)]

use super::cornering::{CorneringMap, SpeedPlace};
use super::path::{View, curvature_ahead};
use super::relief::Footing;
use super::road::{Course, FRONT_CELLS, PLAN_REACH_M, Road};
use super::settings::DriverSettings;
use crate::error::{Error, Result};
use crate::scalar::{Lookup, Part, Real};
use crate::vehicle::aero::aero_forces;
use crate::vehicle::model::wheel_speeds;
use crate::vehicle::powertrain::{GRAVITY_MPS2, Powertrain};
use crate::vehicle::{Car, CarInput, CarState, Chassis};
use std::f64::consts::TAU;

/// Time constant with which wheel slip follows the pedals, s.
pub(super) const PEDAL_LAG_S: f64 = 0.06;
/// Time constant of the driver's arms, s.
pub(super) const STEER_LAG_S: f64 = 0.04;
/// Steering that a driver who does not know the car adds for understeer, rad per g and metre of wheelbase.
const UNDERSTEER: f64 = 0.0025;
/// Lateral acceleration (g) that such a driver takes for all of the grip; his steering goes with it.
const GUESSED_G: f64 = 2.0;
/// Share of the load that the driven wheels are computed to carry.
const DRIVEN_SHARE: f64 = 0.55;
/// Speed below which the driver computes as at this one, m/s.
const LEAST_SPEED: f64 = 3.0;

macro_rules! driver_table {
    ($($(#[$doc:meta])* $field:ident),* $(,)?) => {
        /// A driver's figures. Twin of `Driver` in `shaders/driver.wgsl`.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct DriverTable<S> {
            $($(#[$doc])* pub $field: S,)*
        }

        impl<S> DriverTable<S> {
            /// The fields' names, in the order of [`DriverTable::to_row`].
            pub const FIELDS: &'static [&'static str] = &[$(stringify!($field)),*];

            /// The figures in the order of the fields.
            pub fn to_row(self) -> Vec<S> {
                vec![$(self.$field),*]
            }
        }

        impl DriverTable<f64> {
            /// The figures in the precision that the scalar `R` stores tables in.
            pub fn stored<R: Real>(&self) -> DriverTable<R::Storage> {
                DriverTable { $($field: R::store(self.$field)),* }
            }
        }
    };
}

driver_table! {
    /// Integration step of the closed loop, s.
    step,
    /// How much the driver steers against an angle to the path, rad per rad.
    heading_gain,
    /// Acceleration for every m/s that the plan is ahead, 1/s.
    speed_gain,
    /// Greatest slip ratio, driven or braked.
    slip_limit,
    /// Slip stiffness per load with which the driver computes a change of slip from one of force.
    slip_stiffness,
    /// Greatest road-wheel angle, rad.
    max_steer,
    /// Greatest rate of it, rad/s.
    steer_rate,
    /// One for a driver who knows the car, zero for one who does not.
    knows,
    /// Distance beyond an edge at which a car counts as lost, m.
    run_off,
    /// Share of the load that the driven wheels are computed to carry. This figure and those below are constants. They are passed
    /// as data because compilers for devices would regroup known constants.
    driven_share,
    /// Time constant of the arms, s.
    steer_lag,
    /// Time constant of the feet, s.
    pedal_lag,
    /// Half of the length over which the plan's acceleration is taken, m.
    reach,
    /// Deceleration by rolling resistance, m/s^2.
    rolling,
    /// Mass that the engine accelerates over that of the car.
    rotating,
    /// How far ahead in the plan the driver takes the speed, s,
    speed_ahead,
    /// and the acceleration.
    plan_ahead,
}

impl DriverTable<f64> {
    /// The figures of `settings` in `car`, driven in steps of `step_s`; a car is lost `run_off_m` beyond an edge.
    pub fn new(settings: &DriverSettings, car: &Car, step_s: f64, run_off_m: f64) -> Self {
        Self {
            step: step_s,
            heading_gain: settings.heading_gain,
            speed_gain: settings.speed_gain_1ps,
            slip_limit: settings.slip_limit,
            slip_stiffness: settings.slip_stiffness,
            max_steer: car.max_steer_rad,
            steer_rate: car.max_steer_rate_radps,
            knows: f64::from(u8::from(settings.knowledge.is_some())),
            run_off: run_off_m,
            driven_share: DRIVEN_SHARE,
            steer_lag: STEER_LAG_S,
            pedal_lag: PEDAL_LAG_S,
            reach: PLAN_REACH_M,
            rolling: car.rolling_mps2(),
            rotating: car.rotating_mass_factor(),
            speed_ahead: settings.speed_ahead_s,
            plan_ahead: settings.plan_ahead_s,
        }
    }
}

/// What the driver takes the car's steady cornering for.
pub fn cornering_of(settings: &DriverSettings, car: &Car) -> CorneringMap<f64> {
    let guess = GUESSED_G * UNDERSTEER * (car.chassis.cg_to_front + car.chassis.cg_to_rear);
    let knowledge = settings.knowledge.clone();
    knowledge.unwrap_or_else(|| CorneringMap::guessed(guess, settings.preview_s))
}

/// The torque that a powertrain gives the driven wheels over their speed, in the gear that gives most: in stretches, each
/// from a speed (rad/s) with the torque there (N m) and its rise (N m s/rad).
#[derive(Clone, Debug, PartialEq)]
pub struct WheelTorque<S> {
    /// The stretches, by rising speed; the first begins at standstill.
    pub stretches: Vec<[S; 3]>,
}

/// Torque of a car without a powertrain, which is held back by its tyres alone, N m.
const BOUNDLESS: f64 = 1e9;
/// Two torques that differ by less than this share are the same.
const SAME_TORQUE: f64 = 1e-12;
/// The most stretches of a torque curve that a kernel takes.
const MOST_STRETCHES: usize = 1024;

impl WheelTorque<f64> {
    /// The torque of a car's powertrain.
    ///
    /// # Errors
    /// [`Error::Input`] if it has more points than a kernel takes.
    pub fn of_car(car: &Car) -> Result<Self> {
        let Some(powertrain) = &car.powertrain else {
            return Ok(Self {
                stretches: vec![[0.0, BOUNDLESS, 0.0]],
            });
        };
        let torque = Self::of_powertrain(powertrain);
        if torque.stretches.len() > MOST_STRETCHES {
            return Err(Error::input(
                &car.name,
                "powertrain",
                format!("{} points of all gears together", torque.stretches.len()),
                format!("at most {MOST_STRETCHES}"),
            ));
        }
        Ok(torque)
    }

    fn of_powertrain(powertrain: &Powertrain) -> Self {
        let speeds = &powertrain.engine_speed_rpm;
        let torques = &powertrain.torque_nm;
        // The lines of every gear: speed at the start, torque there, slope.
        let mut lines: Vec<Vec<[f64; 3]>> = Vec::new();
        let mut ends = vec![0.0];
        for gear in &powertrain.gear_ratios {
            let ratio = gear * powertrain.final_drive;
            let rpm = ratio * 60.0 / TAU;
            let share = ratio * powertrain.efficiency;
            let mut of_gear = vec![[0.0, torques[0] * share, 0.0]];
            for i in 1..speeds.len() {
                let rise = (torques[i] - torques[i - 1]) / (speeds[i] - speeds[i - 1]);
                of_gear.push([speeds[i - 1] / rpm, torques[i - 1] * share, rise * rpm * share]);
            }
            of_gear.push([speeds[speeds.len() - 1] / rpm, 0.0, 0.0]);
            ends.extend(of_gear.iter().map(|line| line[0]));
            lines.push(of_gear);
        }
        let line_at = |gear: &[[f64; 3]], speed: f64| {
            let after = gear.partition_point(|line| line[0] <= speed);
            gear[after.max(1) - 1]
        };
        let value = |line: [f64; 3], speed: f64| line[1] + (speed - line[0]) * line[2];
        ends.sort_unstable_by(f64::total_cmp);
        ends.dedup();
        // Between two ends every gear is one line. Where two lines cross, the gear that gives most may change.
        let mut crossings = Vec::new();
        for pair in ends.windows(2) {
            let middle = 0.5 * (pair[0] + pair[1]);
            let here: Vec<[f64; 3]> = lines.iter().map(|gear| line_at(gear, middle)).collect();
            for (i, a) in here.iter().enumerate() {
                for b in &here[..i] {
                    let at = middle - (value(*a, middle) - value(*b, middle)) / (a[2] - b[2]);
                    if at > pair[0] && at < pair[1] {
                        crossings.push(at);
                    }
                }
            }
        }
        ends.extend(crossings);
        ends.sort_unstable_by(f64::total_cmp);
        ends.dedup();
        let mut stretches: Vec<[f64; 3]> = Vec::new();
        for (i, from) in ends.iter().enumerate() {
            let middle = ends.get(i + 1).map_or(from + 1.0, |to| 0.5 * (from + to));
            let best = lines
                .iter()
                .map(|gear| line_at(gear, middle))
                .reduce(|best, line| {
                    if value(line, middle) > value(best, middle) {
                        line
                    } else {
                        best
                    }
                })
                .unwrap_or([0.0; 3]);
            // Points on one line are one stretch.
            let to = ends.get(i + 1).copied().unwrap_or(from + 1.0);
            let goes_on = stretches.last().is_some_and(|before| {
                [*from, to].iter().all(|at| {
                    let (here, there) = (value(best, *at), value(*before, *at));
                    (here - there).abs() <= SAME_TORQUE * here.abs()
                })
            });
            if !goes_on {
                stretches.push([*from, value(best, *from), best[2]]);
            }
        }
        Self { stretches }
    }

    /// The figures in the precision that the scalar `R` stores tables in.
    #[allow(clippy::disallowed_methods, reason = "no part of a kernel")]
    pub fn stored<R: Real>(&self) -> WheelTorque<R::Storage> {
        WheelTorque {
            stretches: self.stretches.iter().map(|s| s.map(R::store)).collect(),
        }
    }
}

/// The torque (N m) at a speed of the driven wheels (rad/s).
#[inline(always)]
pub fn torque_at<R: Real>(torque: &WheelTorque<R::Storage>, speed: R) -> R {
    let mut found = R::lit(0.0);
    for [from, value, rise] in &torque.stretches {
        let past = speed - R::load(*from);
        let here = R::load(*value) + past * R::load(*rise);
        found = R::select(past.less_than(R::lit(0.0)), found, here);
    }
    found
}

/// The state of the driver's arms and feet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Controls<R> {
    /// Road-wheel angle (rad).
    pub steer: R,
    /// Slip ratio of the front wheels.
    pub front_slip: R,
    /// Slip ratio of the rear wheels.
    pub rear_slip: R,
    /// Forward force of the rear wheels at the step before (N),
    pub rear_force: R,
    /// and what the car gained in speed (m/s^2).
    pub gain: R,
}

/// The plan of a candidate: a blend of two neighbouring plans of its line.
#[derive(Clone, Copy, Debug)]
pub struct Pace<R> {
    /// Number of the first plan, a whole number.
    pub plan: R,
    /// Share of the second plan, 0 to 1.
    pub share: R,
}

/// Speed (m/s) a share of the way from one cell of a plan, a whole number, to the next.
#[inline(always)]
fn speed_in_cell<R: Lookup>(plans: &[R::Storage], cell: R, share: R) -> R {
    let (place, _) = cell.place(plans.len(), 1);
    let speed = R::pick(plans, place, 0);
    speed + share * (R::pick(plans, place, 1) - speed)
}

/// Planned speed (m/s) `ahead` metres ahead of the foot.
#[inline(always)]
pub fn planned_speed<R: Lookup>(
    road: &Road<R::Storage>,
    course: &Course<R>,
    pace: &Pace<R>,
    view: &View<R>,
    ahead: R,
) -> R {
    let distance = view.pose.along + ahead;
    let place = view.row.cell_share + distance * course.cells_per_metre + R::lit(FRONT_CELLS as f64);
    let cells = place.whole(course.cells_ahead);
    let share = place - cells;
    let number = course.plan_at + pace.plan * course.plan_stride + view.row.cell + cells;
    let speed = speed_in_cell(&road.plans, number, share);
    if road.plans_per_line == 1 {
        return speed;
    }
    let faster = speed_in_cell(&road.plans, number + course.plan_stride, share);
    speed + pace.share * (faster - speed)
}

/// What the driver goes by in a step.
#[derive(Clone, Copy, Debug)]
pub struct Act<'a, R: Real> {
    /// The driver.
    pub driver: &'a DriverTable<R::Storage>,
    /// What the powertrain gives.
    pub torque: &'a WheelTorque<R::Storage>,
    /// What he takes the car's steady cornering for.
    pub cornering: &'a CorneringMap<R::Storage>,
    /// The lines and their plans.
    pub road: &'a Road<R::Storage>,
    /// The line that he follows.
    pub course: &'a Course<R>,
    /// How fast.
    pub pace: &'a Pace<R>,
    /// His car.
    pub chassis: &'a Chassis<R>,
    /// How it moves.
    pub state: &'a CarState<R>,
    /// Where it is.
    pub view: &'a View<R>,
    /// The road under it, if that is not level and dry.
    pub footing: Option<&'a Footing<R>>,
    /// Where his arms and feet are.
    pub controls: &'a Controls<R>,
}

/// Moves arms and feet for one step.
#[inline(always)]
pub fn act<R: Lookup>(by: Act<'_, R>) -> Controls<R> {
    // The same for every model of tyres.
    R::apart(by)
}

impl<R: Lookup> Part for Act<'_, R> {
    type Output = Controls<R>;

    #[inline(always)]
    fn run(self) -> Controls<R> {
        let Self {
            driver,
            torque,
            cornering,
            road,
            course,
            pace,
            chassis: c,
            state,
            view,
            footing,
            controls,
        } = self;
        let zero = R::lit(0.0);
        let one = R::lit(1.0);
        let step = R::load(driver.step);
        let knows = R::load(driver.knows);
        let body = &state.body;
        let v = body.vx.max(R::lit(LEAST_SPEED));
        let wheelbase = c.cg_to_front + c.cg_to_rear;
        let path = &road.path;
        let pose = &view.pose;
        let aero = aero_forces(c, v, view.row.flap);
        let weight = c.mass * c.gravity + (aero.downforce_front + aero.downforce_rear);
        let friction = footing.map_or(one, |footing| footing.friction);
        let speed = SpeedPlace::of(v);
        let [own_friction, preview] = speed.limits(cornering);
        let grip = friction * own_friction * weight / c.mass;
        let behind = planned_speed(road, course, pace, view, R::load(driver.speed_ahead) * v) - body.vx;
        let look = R::load(driver.plan_ahead) * v;
        let reach = R::load(driver.reach);
        let before = planned_speed(road, course, pace, view, look - reach);
        let after = planned_speed(road, course, pace, view, look + reach);
        let planned = (after * after - before * before) / R::lit(4.0 * PLAN_REACH_M);
        // Feed-forward: geometry plus the slip of both axles in steady cornering; feedback: offset, heading and the yaw rate that the
        // present curvature asks for.
        let curvature = curvature_ahead(path, course, pose, preview * v);
        let bend = view.bend;
        // The speed that one who knows the car will have there.
        let speed_ahead = (v + knows * planned * preview).max(R::lit(LEAST_SPEED));
        let mut across_ahead = curvature * speed_ahead * speed_ahead;
        let mut across = bend * v * v;
        let mut turning = body.yaw_rate * v;
        // On a banked road the tyres bear gravity's part too. The driver knows it, and the gradient, from the road under him.
        if let Some(footing) = footing {
            across_ahead = across_ahead + footing.lean;
            across = across + footing.lean;
            turning = turning + footing.lean;
        }
        // On a slippery road tyres slip less before they let go.
        let held = knows * grip + (one - knows) * (friction * R::lit(GUESSED_G * GRAVITY_MPS2));
        let [understeer, _] = speed.angles(cornering, across_ahead / held);
        let [_, rear_slip] = speed.angles(cornering, across / held);
        let (understeer, rear_slip) = (friction * understeer, friction * rear_slip);
        let sideslip = knows * (c.cg_to_rear * bend - rear_slip);
        let heading =
            view.heading_error + sideslip + view.offset * R::lit(0.9) / (v * R::lit(0.45) + R::lit(3.0));
        let yaw_lack = curvature_ahead(path, course, pose, R::lit(0.08) * v) * v - body.yaw_rate;
        let wanted = wheelbase * curvature + understeer - R::load(driver.heading_gain) * heading
            + R::lit(0.045) * yaw_lack;
        let most = R::load(driver.max_steer);
        let wanted = wanted.max(-most).min(most);
        let fastest = R::load(driver.steer_rate);
        let rate = ((wanted - controls.steer) / R::load(driver.steer_lag))
            .max(-fastest)
            .min(fastest);

        let wanted = planned + R::load(driver.speed_gain) * behind;
        let mut force = c.mass * wanted + aero.drag;
        if let Some(footing) = footing {
            force = force + c.mass * footing.climb;
        }
        // What a bend leaves of the tyres, by the friction circle. The bend is the mean of the path's and the one that the car turns.
        let used = knows * (R::lit(0.5) * (turning + across) / grip).abs();
        let used = used.min(one);
        let left = (one - used * used).max(R::lit(0.01)).sqrt();
        let limit = friction * R::load(driver.slip_limit) * left;
        // The foot moves until the car gains what is wanted. How much slip that takes, the tyres know and the driver does not: he goes no
        // further than soft tyres would need, or he would spin the wheels of a car that gains no more.
        let stiffness = R::load(driver.driven_share) * weight * R::load(driver.slip_stiffness);
        let drives = !controls.rear_slip.less_than(zero);
        let pedal = R::select(drives, controls.rear_slip, controls.front_slip);
        let asked = pedal + c.mass * (wanted - controls.gain) / stiffness;
        let rim_speed = v * (one + controls.rear_slip.max(zero));
        let pull = torque_at(torque, rim_speed / c.radius_rear) / c.radius_rear;
        // What the wheels take to roll and to be turned faster does not reach the road.
        let rotating = R::load(driver.rotating);
        let most = (pull - c.mass * R::load(driver.rolling) + (rotating - one) * aero.drag) / rotating;
        let within = controls.rear_slip.max(zero) + (most - controls.rear_force) / stiffness;
        let driven = asked
            .min(within.max(zero))
            .min(limit)
            .min((force / stiffness).max(zero));
        let braked = asked.max(-limit);
        let brakes = asked.less_than(zero);
        let front = R::select(brakes, braked, zero);
        let rear = R::select(brakes, R::lit(0.75) * braked, driven);
        let lag = R::load(driver.pedal_lag);
        Controls {
            steer: controls.steer + rate * step,
            front_slip: controls.front_slip + (front - controls.front_slip) * step / lag,
            rear_slip: controls.rear_slip + (rear - controls.rear_slip) * step / lag,
            rear_force: controls.rear_force,
            gain: controls.gain,
        }
    }
}

/// The wheel speeds and the steering that the controls ask for, and the DRS: open where the path says so, shut on the brakes; on a road
/// of this friction.
#[inline(always)]
pub fn car_input<R: Real>(
    c: &Chassis<R>,
    state: &CarState<R>,
    controls: &Controls<R>,
    flap: R,
    friction: Option<R>,
) -> CarInput<R> {
    let turned = (controls.steer.cos(), controls.steer.sin());
    CarInput {
        wheel_speed: wheel_speeds(c, &state.body, turned, [controls.front_slip, controls.rear_slip]),
        steer: controls.steer,
        flap: R::select(controls.rear_slip.less_than(R::lit(0.0)), R::lit(0.0), flap),
        friction,
    }
}
